//! Scenes for boards that remove hidden curves and draw by themselves.

use glam::DVec2;
use penvis_firmware::scene::{CHUNK_BYTES, Look, Program, SceneError, Sight, StoredScene};
use thiserror::Error;

use crate::compute::{Loaded, Placed, place};
use crate::device::{Device, PlaceError, Placement};
use crate::error::Error;
use crate::model::{Projection, View};
use crate::page::{Depths, Hidden, Layout, Shares};

/// Why a scene cannot be stored for a board.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StoreError {
    /// The board's lines are G-code.
    #[error("`{device}` speaks {speaks}, and a board draws by G-code; choose another --device")]
    Language {
        /// The device.
        device: String,
        /// Its language.
        speaks: &'static str,
    },
    /// Adaptive isocurves.
    #[error("--iso-spacing, --shade: a board draws isocurves equally far apart in the parameter; give --iso N")]
    Adaptive,
    /// Dashes, or depths told apart.
    #[error("--hidden, --qi: a board draws hidden curves in full and with one pen; give --hidden layer, or omit")]
    Hidden,
    /// Gaps beside outlines.
    #[error("--halo: a board draws curves up to the outlines that they pass behind; leave it out")]
    Halo,
    /// Pens by kind.
    #[error("--pen: a board draws all visible curves of a surface with one pen; give --pen N")]
    Pens,
    /// Shadows.
    #[error("--shadows: a board draws no shadows; leave it out")]
    Shadows,
    /// Fills.
    #[error("--fill: a board draws no fills; leave it out, and those of the scene")]
    Fill,
    /// Marks, or a title.
    #[error("--marks, --title: a board draws the model alone; leave them out")]
    Marks,
    /// A picture that is cut off.
    #[error("--clip: a board draws whole strokes; leave it out, and give a --scale, --width or --height that fits")]
    Clip,
    /// The sheet does not go into the device.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// Something that cannot be stored.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// The scene with what a drawing of it takes: the view, what is wanted, its place on the sheet, and the lines of the device around the
/// strokes.
///
/// # Errors
/// If the view does not exist or does not see all of the model, a board cannot draw what is asked for, the sheet does not go into
/// the device, or Ctrl-C or the time limit ends it.
pub fn store(loaded: Loaded<'_>, device: &Device) -> Result<StoredScene, Error> {
    let Some(language) = device.language.gcode() else {
        let error = StoreError::Language { device: device.name.clone(), speaks: device.language.name() };
        return Err(error.into());
    };
    if loaded.has_shadows() {
        return Err(StoreError::Shadows.into());
    }
    let apart = loaded.depths() == Depths::Apart;
    if loaded.has_gaps() {
        return Err(StoreError::Halo.into());
    }
    let Placed { scene, view, wanted, layout, settled, .. } = place(loaded)?;
    if settled.adaptive.is_some() {
        return Err(StoreError::Adaptive.into());
    }
    if settled.fills.iter().any(Option::is_some) {
        return Err(StoreError::Fill.into());
    }
    if settled.marking.marks || settled.marking.title.is_some() {
        return Err(StoreError::Marks.into());
    }
    if layout.window().is_some() {
        return Err(StoreError::Clip.into());
    }
    let place = device.place(settled.page).map_err(StoreError::from)?;
    let mut looks = Vec::with_capacity(scene.surfaces.len());
    for surface in 0..scene.surfaces.len() {
        let ink = settled.inks.of(surface);
        let pen = ink.pens.only().filter(|_| settled.inks.layers().is_empty()).ok_or(StoreError::Pens)?;
        let hidden = match ink.hidden {
            Hidden::Omit => None,
            Hidden::Layer if !apart => {
                Some(ink.pens.of_hidden().unwrap_or_else(|| settled.inks.last_pen().saturating_add(1)))
            }
            _ => return Err(StoreError::Hidden.into()),
        };
        looks.push(Look { style: *settled.styles.of(surface), pen, hidden });
    }
    let pens = looks.iter().flat_map(|look| [Some(look.pen), look.hidden]).flatten();
    let lines = |lines: Vec<String>| lines.iter().map(|line| format!("{line}\n")).collect::<String>();
    let filled = |template: &[String], pen| lines(template.iter().map(|line| device.fill(line, pen)).collect());
    let mut pens: Vec<u32> = pens.collect();
    pens.sort_unstable();
    pens.dedup();
    let program = Program {
        map: map(&layout, &place),
        draw_feed: device.draw_feed,
        start: filled(&language.start, 1),
        down: lines(language.pen_down()),
        up: lines(language.pen_up()),
        changes: pens.iter().map(|&pen| (pen, filled(&language.pen_change, pen))).collect(),
        end: filled(&language.end, pens.last().copied().unwrap_or(1)),
    };
    let tolerance = layout.to_screen_length(Shares::of(settled.tolerance_mm, false).traced_mm);
    Ok(StoredScene { scene, sight: sight(&view), looks, options: wanted, tolerance, program })
}

/// The lines that send a packed scene to the firmware: those before are forgotten, and nothing is drawn yet.
#[must_use]
pub fn lines(packed: &[u8]) -> String {
    let chunk = |bytes: &[u8]| {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        format!("$PV={digits}\n")
    };
    ["$PV=CLEAR\n".to_owned()].into_iter().chain(packed.chunks(CHUNK_BYTES).map(chunk)).collect()
}

fn sight(view: &View) -> Sight {
    match view.projection {
        Projection::Orthographic => Sight::Orthographic { eye_direction: view.eye_direction, up: view.up },
        Projection::Perspective { eye, target } => Sight::Perspective { eye, target, up: view.up },
    }
}

/// The map from the screen to the machine, as rows [a, b, c].
fn map(layout: &Layout, place: &Placement) -> [[f64; 3]; 2] {
    // From the page to the machine there are only quarter turns, mirrors and shifts.
    let zero = place.to_machine(DVec2::ZERO);
    let [u, v] = [DVec2::X, DVec2::Y].map(|e| (place.to_machine(e) - zero).round());
    let scale = 1.0 / layout.to_screen_length(1.0);
    let shift = place.to_machine(layout.to_page(DVec2::ZERO));
    [0, 1].map(|k| [scale * u[k], scale * v[k], shift[k]])
}

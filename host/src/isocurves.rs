//! Which isocurves are drawn: so many a direction, or as many as cover the surfaces evenly or after a tone.

use glam::DVec3;
use penvis_core::extract::adaptive::{AdaptiveOptions, Direction, Spacing, Tone};

use crate::args::DrawingArgs;
use crate::fill::choice;
use crate::options::{OptionError, bad, direction};
use crate::page::Layout;
use crate::style::MOST_ISOS;

/// Isocurves a direction when nothing is asked for.
pub(crate) const DEFAULT_ISOS: u32 = 8;

/// Smallest spacing in mm: a tenth of what the finest pens draw.
const FINEST_MM: f64 = 0.01;

/// Most levels. Spacing doubles with each, and the coarsest of 16 is 32,768 times the finest.
const MOST_LEVELS: u32 = 16;

/// Curves shorter than this share of the spacing are left out: a pen makes dots of them. More is left out where a tone lets
/// curves end anywhere than where spacing is promised.
const SHORTEST: f64 = 0.25;
const SHORTEST_SHADED: f64 = 2.0;

/// The isocurves that are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Isocurves {
    /// So many a direction and surface, equally far apart in the parameter.
    Uniform(u32),
    /// Adaptive ones.
    Adaptive(Adaptive),
}

/// Adaptive isocurves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Largest distance between neighbours in mm; with a tone, where it is darkest.
    pub spacing_mm: f64,
    /// Where it is measured.
    pub measured: Spacing,
    /// Which isocurves.
    pub direction: Direction,
    /// What makes the spacing wider.
    pub tone: Option<Tone>,
    /// Layers, coarse to fine.
    pub levels: u32,
}

impl Isocurves {
    /// Checks the arguments; none if they ask for nothing.
    ///
    /// # Errors
    /// [`OptionError`] with the option and what it takes.
    pub fn new(args: &DrawingArgs, light: DVec3) -> Result<Option<Self>, OptionError> {
        if let Some(count) = args.iso.filter(|&count| count > MOST_ISOS) {
            return Err(bad("--iso", count, format!("is too many; give {MOST_ISOS} at most")));
        }
        let adaptive = Adaptive::new(args, light)?.map(Self::Adaptive);
        Ok(adaptive.or(args.iso.map(Self::Uniform)))
    }
}

impl Adaptive {
    fn new(args: &DrawingArgs, light: DVec3) -> Result<Option<Self>, OptionError> {
        let measured = match args.iso_metric.as_str() {
            "paper" => Spacing::Screen,
            "surface" => Spacing::Surface,
            other => return Err(bad("--iso-metric", other, "is not one of paper, surface")),
        };
        let word = &args.iso_direction;
        let direction = choice::direction(word).map_err(|problem| bad("--iso-direction", word, problem))?;
        // That of a fill is its own affair.
        let fills = args.fill.as_deref() == Some("iso");
        let levels = args.iso_levels;
        if !(1..=MOST_LEVELS).contains(&levels) {
            return Err(bad("--iso-levels", levels, format!("is not a number of layers; give 1 to {MOST_LEVELS}")));
        }
        if let Some(mm) = args.iso_spacing
            && !(mm.is_finite() && mm >= FINEST_MM)
        {
            return Err(bad("--iso-spacing", mm, format!("is not a spacing in mm; give {FINEST_MM} or more")));
        }
        let tone = tone(args, light)?;
        let spacing_mm = match (args.iso_spacing, tone) {
            (Some(mm), _) => mm,
            // Neighbours are between half the spacing and all of it apart: not nearer than the pen is wide.
            (None, Some(_)) => (2.0 * args.pen_width).max(FINEST_MM),
            (None, None) => {
                return match args {
                    _ if levels != 1 => Err(bad("--iso-levels", levels, NEEDS_SPACING)),
                    _ if direction != Direction::Auto && !fills => Err(bad(
                        "--iso-direction",
                        word,
                        "goes with --iso-spacing, --shade or --fill iso; give one of them",
                    )),
                    _ if measured != Spacing::Screen => Err(bad("--iso-metric", &args.iso_metric, NEEDS_SPACING)),
                    _ => Ok(None),
                };
            }
        };
        Ok(Some(Self { spacing_mm, measured, direction, tone, levels }))
    }

    /// The same in units of the screen.
    #[must_use]
    pub fn on_screen(&self, layout: &Layout) -> AdaptiveOptions {
        let spacing = layout.to_screen_length(self.spacing_mm);
        let Self { measured, direction, tone, levels, .. } = *self;
        let shortest = spacing * if tone.is_some() { SHORTEST_SHADED } else { SHORTEST };
        AdaptiveOptions { spacing, measured, direction, tone, levels, shortest }
    }
}

/// What is wrong with an option of adaptive isocurves alone.
const NEEDS_SPACING: &str = "goes with --iso-spacing or --shade; give one of them";

/// The tone that is asked for.
///
/// # Errors
/// If it is none.
pub fn tone(args: &DrawingArgs, light: DVec3) -> Result<Option<Tone>, OptionError> {
    args.shade.as_deref().map(|text| named_tone(text, light)).transpose()
}

fn named_tone(text: &str, light: DVec3) -> Result<Tone, OptionError> {
    match text {
        "lambert" => Ok(Tone::Lambert(light)),
        "depth" => Ok(Tone::Depth),
        _ => match text.parse() {
            Ok(darkness) if (0.0..=1.0).contains(&darkness) => Ok(Tone::Flat(darkness)),
            _ => Err(bad("--shade", text, "is neither lambert nor depth nor a darkness from 0 to 1")),
        },
    }
}

/// The direction to the light.
///
/// # Errors
/// If it is not a direction.
pub fn light(args: &DrawingArgs) -> Result<DVec3, OptionError> {
    direction("--light", &args.light)
}

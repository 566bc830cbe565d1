//! Shadows: what is visible of the surfaces and not lit.
//!
//! The light is an eye at infinity. What it sees of a surface is lit, and so the shadow is what is visible of a surface less what is visible of
//! it from the light, both as polygons in the surface's parameters, where the two views meet:
//!
//! ```text
//!     eye's screen ---> visible part -+
//!                                     +- (u, v) --> visible less lit ---> eye's screen
//!   light's screen ---> lit part -----+
//! ```
//!
//! | module | does |
//! |---|---|
//! | `light` | the camera that looks from the light |
//! | `less` | the difference of regions in the parameters of a surface |
//! | `shapes` | shadows on the page |

mod less;
mod light;
mod shapes;

use glam::{DVec2, DVec3};
use penvis_core::extract::CurveSet;
use penvis_core::pipeline::{DrawOptions, Monitor, PictureError, Prepared};
use penvis_core::scene::Scene;
use penvis_core::stop::Stopped;
use penvis_core::view::Camera;
use penvis_core::visibility::RayScratch;
use penvis_core::visible::{BorderPoint, UndecidedBorder, VisibleRegion, VisibleRegions};
use rayon::prelude::*;

pub use light::camera;
pub use shapes::{ShadowLoop, ShadowShape, ShadowShapes, UndecidedShadow};

use less::less;

/// Largest turn of the normal between neighbouring points of a border, radians. Borders are made by their distances; this only keeps long
/// chords from being taken for straight where they wind.
const NORMAL_ANGLE: f64 = 0.5;

/// What each of two borders has of a tolerance.
const HALF: f64 = 0.5;

/// The shadows in a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shadows {
    /// The surfaces that have any, in increasing order.
    pub shadows: Vec<Shadow>,
    /// Places at which the border of what is visible or of what is lit is not known.
    pub undecided: Vec<UndecidedLight>,
}

/// What of one surface is visible and in shadow.
#[derive(Clone, Debug, PartialEq)]
pub struct Shadow {
    /// Index of the surface in the scene.
    pub surface: usize,
    /// Its border as polygons with the shadow on the left (y up): outer loops run counter-clockwise, holes clockwise. The last point is joined to
    /// the first.
    pub loops: Vec<Vec<BorderPoint>>,
}

impl Shadow {
    /// Its area on the screen.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.loops.iter().map(|own| less::area(own)).sum()
    }
}

/// A place at which it is not known where a shadow ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndecidedLight {
    /// On the screen of the picture, if the light meets a surface there; what is nearer to the eye may hide it.
    pub at: Option<DVec2>,
    /// The surface whose visible or lit part it borders, if that is known.
    pub surface: Option<usize>,
    /// Why.
    pub why: &'static str,
}

/// The regions visible in a picture, so finely bordered that shadows can be cut from them. There are no more than `normal_angle` (radians) between the normals at
/// neighbouring points, and borders are within half of `tolerance` on the screen.
///
/// # Errors
/// If the monitor stops it.
pub fn visible(
    prepared: &Prepared,
    tolerance: f64,
    normal_angle: f64,
    monitor: &dyn Monitor,
) -> Result<VisibleRegions, Stopped> {
    let eye = prepared.geometry().view.camera();
    prepared.regions_in_parameters(HALF * tolerance, normal_angle.min(NORMAL_ANGLE), eye, monitor)
}

/// The shadows that a light far away casts in a picture. `light` is the direction to it in the viewer's frame: right, up, towards the eye. Borders are
/// within `tolerance` on the screen; what is thinner than twice that is left out, as is what has so small an area: it cannot be told from two
/// polygons that stand for one line.
///
/// Every side of a surface has a light of its own: what is lit from behind is in shadow.
///
/// `visible` are the regions that [`visible`] gives for this tolerance.
///
/// Cost: that of a picture from the light and of the regions visible in it.
///
/// # Errors
/// If the light has no direction, or the monitor stops it.
pub fn shadows(
    scene: &Scene,
    prepared: &Prepared,
    visible: &VisibleRegions,
    light: DVec3,
    tolerance: f64,
    wanted: &DrawOptions,
    monitor: &dyn Monitor,
) -> Result<Shadows, ShadowError> {
    let eye = prepared.geometry().view.camera();
    let lamp = camera(eye, light)?;
    let options = DrawOptions { curves: CurveSet::NONE, isos: 0, deepest: 0, ..*wanted };
    let from_light = Prepared::new(scene, &lamp, &options, monitor)?;
    let lit =
        from_light.regions_in_parameters(HALF * tolerance, NORMAL_ANGLE, eye, monitor).map_err(PictureError::from)?;
    let of = |surface: usize| -> Option<&VisibleRegion> {
        let at = lit.regions.binary_search_by_key(&surface, |r| r.surface).ok()?;
        lit.regions.get(at)
    };
    let shadow = |region: &VisibleRegion| {
        let loops = less(region, of(region.surface), prepared.geometry().view, tolerance);
        (!loops.is_empty()).then_some(Shadow { surface: region.surface, loops })
    };
    let shadows: Vec<Option<Shadow>> = visible.regions.par_iter().map(shadow).collect();
    if monitor.stops() {
        return Err(PictureError::from(Stopped).into());
    }
    let seen = |u: &UndecidedBorder| UndecidedLight { at: Some(u.at), surface: u.surface, why: u.why };
    let mut doubts: Vec<UndecidedLight> = visible.undecided.iter().map(seen).collect();
    doubts.extend(undecided(&lit.undecided, &from_light, eye, monitor)?);
    Ok(Shadows { shadows: shadows.into_iter().flatten().collect(), undecided: doubts })
}

/// Why there are no shadows.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShadowError {
    /// There is no picture from the light.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The light has no direction.
    #[error(transparent)]
    Light(#[from] penvis_core::view::CameraError),
}

/// Places that are undecided on the light's screen, where the eye has them.
fn undecided(
    found: &[UndecidedBorder],
    from_light: &Prepared,
    eye: &Camera,
    monitor: &dyn Monitor,
) -> Result<Vec<UndecidedLight>, PictureError> {
    if found.is_empty() {
        return Ok(Vec::new());
    }
    let probe = from_light.probe(monitor)?;
    let view = from_light.geometry().view;
    let mut scratch = RayScratch::new();
    let mut place = |border: &UndecidedBorder| {
        let candidates = match border.surface {
            Some(surface) => surface..surface + 1,
            None => 0..view.surfaces().len(),
        };
        let met = candidates.filter_map(|surface| probe.place(surface, border.at, &mut scratch));
        let height = |p: DVec3| view.camera().project(p).map_or(f64::NEG_INFINITY, |p| p.z);
        let nearest = met.map(|place| place.model).max_by(|a, b| height(*a).total_cmp(&height(*b)));
        let at = nearest.and_then(|p| eye.project(p)).map(DVec3::truncate);
        UndecidedLight { at, surface: border.surface, why: border.why }
    };
    Ok(found.iter().map(&mut place).collect())
}

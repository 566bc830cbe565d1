//! How much ink a place is to get.

use glam::{DVec2, DVec3};

use crate::extract::Geometry;
use crate::view::{Camera, ViewScene};

/// What makes a place dark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tone {
    /// Nothing: the same darkness everywhere, from 0 (no ink) to 1.
    Flat(f64),
    /// What turns away from the light (Lambert's law), on the side that the eye sees. The direction to the light in the
    /// viewer's frame: x to the right, y up, z towards the eye; any length but 0.
    Lambert(DVec3),
    /// What is far: from dark at the nearest place of the scene to light at the farthest.
    Depth,
}

/// Darkness up to which nothing is drawn, so that highlights are bare instead of sparsely lined.
const HIGHLIGHT: f64 = 0.125;

/// A tone ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shade {
    Flat(f64),
    /// Unit vector to the light in model space.
    Lambert(DVec3),
    /// Extent of the scene in z: farthest, nearest.
    Depth([f64; 2]),
}

impl Shade {
    pub(crate) fn new(tone: Tone, view: &ViewScene) -> Self {
        match tone {
            Tone::Flat(darkness) => Self::Flat(darkness.clamp(0.0, 1.0)),
            Tone::Lambert(light) => Self::Lambert(in_model(view.camera(), light)),
            Tone::Depth => Self::Depth(view.depth()),
        }
    }

    /// How dark a place is to be, from 0 in highlights to 1: in proportion to the share of the paper that ink covers.
    pub(crate) fn darkness(&self, g: &Geometry<'_>, surface: usize, uv: DVec2) -> f64 {
        let dark = self.plain(g, surface, uv);
        // A flat tone has no highlights: it is as dark as was asked for.
        if matches!(self, Self::Flat(_)) { dark } else { ((dark - HIGHLIGHT) / (1.0 - HIGHLIGHT)).max(0.0) }
    }

    fn plain(&self, g: &Geometry<'_>, surface: usize, uv: DVec2) -> f64 {
        match self {
            Self::Flat(darkness) => *darkness,
            Self::Lambert(light) => 1.0 - lambert(g.view, surface, uv, *light),
            Self::Depth([far, near]) => {
                let z = g.view.jet(surface, uv, [false; 2]).p.z;
                if near > far { ((z - far) / (near - far)).clamp(0.0, 1.0) } else { 1.0 }
            }
        }
    }
}

/// A direction in the viewer's frame as a unit vector in model space.
pub(crate) fn in_model(camera: &Camera, direction: DVec3) -> DVec3 {
    camera.axes().iter().zip(direction.to_array()).map(|(axis, x)| *axis * x).sum::<DVec3>().normalize_or_zero()
}

/// Cosine between the light and the normal on the side that the eye sees, 0 where that is turned away from the light or at
/// a singular point.
fn lambert(view: &ViewScene, surface: usize, uv: DVec2, light: DVec3) -> f64 {
    let (cosine, front) = incidence(view, surface, uv, light);
    if front { cosine.max(0.0) } else { (-cosine).max(0.0) }
}

/// Cosine between the light, a unit vector in model space, and the normal ∂u × ∂v, 0 at a singular point; and whether the eye
/// sees that side.
pub(crate) fn incidence(view: &ViewScene, surface: usize, uv: DVec2, light: DVec3) -> (f64, bool) {
    let (patch, local) = view.locate(surface, uv, [false; 2]);
    let front = view.patches()[patch].jet(local.x, local.y).normal().z >= 0.0;
    let normal = view.model_patch(patch).jet(local.x, local.y).normal().normalize_or_zero();
    (normal.dot(light), front)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::facing::facing_of_all;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, sphere};
    use crate::stop::Stop;
    use alloc::vec;

    #[test]
    fn a_ball_is_light_towards_the_light_and_bare_in_the_highlight_from_any_view() {
        let surface = sphere(&Frame::WORLD, 1.0).unwrap();
        let scene = Scene { name: "s".into(), surfaces: vec![SceneSurface::new("s", surface)] };
        let cameras = [
            Camera::orthographic(DVec3::new(1.0, -2.0, 0.5), DVec3::Z).unwrap(),
            Camera::perspective(DVec3::new(4.0, 3.0, 2.0), DVec3::ZERO, DVec3::Z).unwrap(),
        ];
        for camera in cameras {
            let view = ViewScene::new(&scene, &camera).unwrap();
            let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
            let g = Geometry { view: &view, forms: &forms };
            let [right, up, eye] = camera.axes();
            let light = DVec3::new(-1.0, 1.0, 1.0);
            let shade = Shade::new(Tone::Lambert(light), &view);
            let in_model = (up - right + eye).normalize();
            for k in 0..400 {
                let uv = DVec2::new(f64::from(k % 20) + 0.5, f64::from(k / 20) + 0.5) / 20.0;
                let normal = view.model_point(0, uv);
                let seen = match camera.is_perspective() {
                    true => normal.dot(DVec3::new(4.0, 3.0, 2.0) - normal) > 0.0,
                    false => normal.dot(eye) > 0.0,
                };
                let side = if seen { normal } else { -normal };
                let dark = 1.0 - side.dot(in_model).max(0.0);
                let want = ((dark - HIGHLIGHT) / (1.0 - HIGHLIGHT)).max(0.0);
                assert!((shade.darkness(&g, 0, uv) - want).abs() < 1e-9, "{uv}");
            }
        }
    }

    #[test]
    fn the_nearest_is_darkest_by_depth() {
        let surface = sphere(&Frame::WORLD, 1.0).unwrap();
        let scene = Scene { name: "s".into(), surfaces: vec![SceneSurface::new("s", surface)] };
        let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap();
        let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
        let g = Geometry { view: &view, forms: &forms };
        let shade = Shade::new(Tone::Depth, &view);
        let at = |z: f64| {
            let v = (0..=1000).map(|k| DVec2::new(0.3, f64::from(k) / 1000.0));
            let off = |uv: &DVec2| (view.model_point(0, *uv).z - z).abs();
            shade.darkness(&g, 0, v.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap())
        };
        assert!(at(1.0) > 0.99 && at(-0.9) == 0.0 && at(0.5) > at(0.0));
    }
}

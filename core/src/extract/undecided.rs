//! Where the topology of a curve is undecided, in terms of the model.

use glam::{DVec2, DVec3};

use super::silhouette::UndecidedPlace;
use crate::view::ViewScene;

/// A part of a surface in which it is not known how a silhouette or a section runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndecidedPart {
    /// Index of the surface.
    pub surface: usize,
    /// Range of the surface's parameter u.
    pub u: [f64; 2],
    /// Range of the surface's parameter v.
    pub v: [f64; 2],
    /// The middle of the part, model space.
    pub at: DVec3,
    /// Diagonal of the part's box in model space, model units.
    pub size: f64,
    /// Diagonal of the part's box on the screen, view units.
    pub screen_size: f64,
}

impl UndecidedPart {
    /// What the place is on its surface. Boxes hold 5 × 5 points of the part; it is as good as flat unless a whole curve
    /// is undecided.
    #[must_use]
    pub fn new(view: &ViewScene, undecided: &UndecidedPlace) -> Self {
        const PARTS: u32 = 4;
        let patch = &view.patches()[undecided.patch];
        let place = &undecided.place;
        let at = |i: u32, j: u32| {
            let between = |[a, b]: [f64; 2], k: u32| a + (b - a) * f64::from(k) / f64::from(PARTS);
            DVec2::new(between(place.u, i), between(place.v, j))
        };
        let to_surface = |local: DVec2| patch.to_surface(local.x, local.y);
        let model = |local: DVec2| view.model_point(patch.surface, to_surface(local));
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut screen_lo, mut screen_hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for local in (0..=PARTS).flat_map(|i| (0..=PARTS).map(move |j| (i, j))).map(|(i, j)| at(i, j)) {
            let (p, s) = (model(local), patch.eval(local.x, local.y).truncate());
            (lo, hi) = (lo.min(p), hi.max(p));
            (screen_lo, screen_hi) = (screen_lo.min(s), screen_hi.max(s));
        }
        let (low, high) = (to_surface(at(0, 0)), to_surface(at(PARTS, PARTS)));
        Self {
            surface: patch.surface,
            u: [low.x, high.x],
            v: [low.y, high.y],
            at: model(at(PARTS / 2, PARTS / 2)),
            size: (hi - lo).length(),
            screen_size: (screen_hi - screen_lo).length(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::zero_set::Rect;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::plane;
    use crate::view::Camera;

    #[test]
    fn a_part_of_a_patch_is_named_by_its_surface_and_measured() {
        // 4 by 3 in u and v from (1, 0, 0), in two patches that meet at u = 1/2; seen from above.
        let surface = plane(DVec3::X, 4.0 * DVec3::X, 3.0 * DVec3::Y).unwrap().insert_knot_u(0.5, 1).unwrap();
        let far = plane(DVec3::NEG_Z, DVec3::X, DVec3::Y).unwrap();
        let surfaces = [far, surface].map(|surface| SceneSurface::new("s", surface));
        let scene = Scene { name: "t".into(), surfaces: surfaces.into() };
        let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap();
        let place = Rect { u: [0.0, 0.5], v: [0.25, 0.75] };
        let part = UndecidedPart::new(&view, &UndecidedPlace { patch: 2, place });
        assert_eq!((part.surface, part.u, part.v), (1, [0.5, 0.75], [0.25, 0.75]));
        // From (3, 0.75) to (4, 2.25).
        assert!((part.at - DVec3::new(3.5, 1.5, 0.0)).length() < 1e-14, "{}", part.at);
        for size in [part.size, part.screen_size] {
            assert!((size - libm::hypot(1.0, 1.5)).abs() < 1e-14, "{size}");
        }
    }
}

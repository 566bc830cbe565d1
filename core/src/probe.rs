//! What lies behind a point of the screen: the place on a surface, and how dark it is to be.

use glam::{DVec2, DVec3};

use crate::extract::Geometry;
use crate::extract::adaptive::{Shade, Tone};
use crate::visibility::{Occluders, RayScratch};

/// Finds places on surfaces by sight lines.
pub struct Probe<'a> {
    geometry: Geometry<'a>,
    occluders: Occluders<'a>,
}

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Parameters of the surface.
    pub uv: DVec2,
    /// In model space.
    pub model: DVec3,
}

impl<'a> Probe<'a> {
    pub(crate) fn new(geometry: Geometry<'a>, occluders: Occluders<'a>) -> Self {
        Self { geometry, occluders }
    }

    /// The nearest place of a surface behind a point of the screen, whatever is in front of it; `None` if there is none. On
    /// a border or a fold it may be missed. Some microseconds.
    #[must_use]
    pub fn place(&self, surface: usize, screen: DVec2, scratch: &mut RayScratch) -> Option<Place> {
        self.nearest(&|other| other == surface, screen, scratch).map(|(_, place)| place)
    }

    /// The nearest of the surfaces for which `is_one` holds, and its place behind a point of the screen; as [`place`](Self::place).
    #[must_use]
    pub fn nearest(
        &self,
        is_one: &dyn Fn(usize) -> bool,
        screen: DVec2,
        scratch: &mut RayScratch,
    ) -> Option<(usize, Place)> {
        let hit = self.occluders.hits(screen, scratch).iter().find(|hit| is_one(hit.surface))?;
        let (surface, uv) = (hit.surface, hit.uv);
        Some((surface, Place { uv, model: self.geometry.view.model_point(surface, uv) }))
    }

    /// What a tone makes of places.
    #[must_use]
    pub fn shading(&self, tone: Tone) -> Shading<'a> {
        Shading { shade: Shade::new(tone, self.geometry.view), geometry: self.geometry }
    }
}

/// A tone of a picture.
pub struct Shading<'a> {
    shade: Shade,
    geometry: Geometry<'a>,
}

impl Shading<'_> {
    /// How dark a place of a surface is to be, from 0 in highlights to 1, by the exact normal.
    #[must_use]
    pub fn darkness(&self, surface: usize, uv: DVec2) -> f64 {
        self.shade.darkness(&self.geometry, surface, uv)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;
    use crate::pipeline::{DrawOptions, Prepared};
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, sphere};
    use crate::view::Camera;

    #[test]
    fn the_nearer_side_of_a_ball_is_found_and_lit_as_its_normal_says() {
        let surface = SceneSurface::new("ball", sphere(&Frame::WORLD, 1.0).unwrap());
        let scene = Scene { name: "ball".into(), surfaces: vec![surface] };
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
        let prepared = Prepared::new(&scene, &camera, &DrawOptions::default(), &()).unwrap();
        let probe = prepared.probe(&()).unwrap();
        let shading = probe.shading(Tone::Lambert(DVec3::X));
        let mut scratch = RayScratch::new();
        for screen in [DVec2::new(0.3, 0.41), DVec2::new(-0.62, 0.11), DVec2::new(0.07, -0.88)] {
            let place = probe.place(0, screen, &mut scratch).unwrap();
            let z = (1.0 - screen.length_squared()).sqrt();
            assert!((place.model - screen.extend(z)).length() < 1e-9, "{screen}: {place:?}");
            let dark = shading.darkness(0, place.uv);
            // Lambert's law, and bare paper in highlights.
            let want = ((0.875 - screen.x.max(0.0)) / 0.875).max(0.0);
            assert!((dark - want).abs() < 1e-9, "{screen}: {dark}");
        }
        assert_eq!(probe.place(0, DVec2::new(0.8, 0.7), &mut scratch), None);
        let nearest = probe.nearest(&|_| true, DVec2::new(0.3, 0.41), &mut scratch);
        assert_eq!(nearest.map(|(surface, _)| surface), Some(0));
        assert_eq!(probe.nearest(&|surface| surface != 0, DVec2::ZERO, &mut scratch), None);
        assert_eq!(probe.place(1, DVec2::ZERO, &mut scratch), None);
    }
}

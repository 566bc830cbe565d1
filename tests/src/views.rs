//! From where models are looked at.

use glam::DVec3;
use penvis::model::View;
use penvis_core::scene::Scene;

/// Directions to the eye, so many, spread evenly over the sphere.
pub fn directions(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |k| {
        let z: f64 = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (azimuth, r) = (2.399_963_229_728 * f64::from(k) + 0.3, (1.0 - z * z).sqrt());
        DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    })
}

/// Perspective from one and a half diagonals of the model away.
#[must_use]
pub fn near(scene: &Scene, direction: DVec3) -> View {
    let points = || scene.surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    let middle = low.midpoint(high);
    View::perspective(middle + 1.5 * direction * low.distance(high), middle)
}

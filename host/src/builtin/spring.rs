//! A coil spring of 96 rational Bézier patches, as many as the spring of Ruan, Zhang and Yong (2006, fig. 9).

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

use glam::{DVec2, DVec3, DVec4};
use penvis_core::scene::SceneSurface;

use super::{bezier, part};
use crate::model::View;

/// Radius of the coil, to the middle of the wire.
const COIL: f64 = 3.0;
/// Radius of the wire.
const WIRE: f64 = 0.42;
/// Rise of one turn.
const PITCH: f64 = 1.4;
const TURNS: usize = 6;
/// dz/dθ of the helix.
const SLOPE: f64 = PITCH / TAU;

/// The wire's section is a circle in the plane across the helix. One patch is a quarter of the section, quadratic in u,
/// carried through a quarter turn, cubic in v.
pub(super) fn surfaces() -> Option<Vec<SceneSurface>> {
    // In the coordinates (radial, along the turn, upwards): the unit binormal of the helix.
    let binormal = DVec3::new(0.0, -SLOPE, COIL) / (SLOPE * SLOPE + COIL * COIL).sqrt();
    let axes = [DVec3::X, -binormal, -DVec3::X, binormal];
    let mut surfaces = Vec::with_capacity(16 * TURNS);
    for quarter in 0..4 * TURNS {
        for arc in 0..4 {
            let (from, to) = (axes[arc], axes[(arc + 1) % 4]);
            let section = [(from, 1.0), (from + to, FRAC_1_SQRT_2), (to, 1.0)];
            let net = section.map(|(offset, weight)| {
                carry(COIL * DVec3::X + WIRE * offset, quarter).map(|p| p * DVec4::new(1.0, 1.0, 1.0, weight))
            });
            let name = format!("turn {} quarter {} arc {}", quarter / 4 + 1, quarter % 4 + 1, arc + 1);
            surfaces.push(part(name, bezier(net)?));
        }
    }
    Some(surfaces)
}

/// The path of a point of the first section through the given quarter turn, as a rational cubic.
///
/// With J the turn by 90°, a quarter turn takes p along the rational quadratic p, p + Jp, Jp of weights 1, 1/√2, 1,
/// which is linear in p. Raised to degree 3 its weights are 1, (1 + √2)/3, (1 + √2)/3, 1. So every section is an exact
/// circle at the exact distance from the axis. Only the rise is not exact, since the angle θ is no rational function of
/// v: it is the cubic that has the helix's dz/dθ at both ends (there dθ/dv = √2), where patches therefore join smoothly.
fn carry(p: DVec3, quarter: usize) -> [DVec4; 4] {
    let turned = |quarter: usize| match quarter % 4 {
        0 => DVec2::new(p.x, p.y),
        1 => DVec2::new(-p.y, p.x),
        2 => DVec2::new(-p.x, -p.y),
        _ => DVec2::new(p.y, -p.x),
    };
    let height = |quarter: usize| p.z + PITCH * quarter as f64 / 4.0;
    let (start, end) = (turned(quarter), turned(quarter + 1));
    let (low, high) = (height(quarter), height(quarter + 1));
    // dz/dv = 3 w₁ (z₁ − z₀) = SLOPE √2, hence z₁ − z₀ = SLOPE √2 / (1 + √2).
    let step = SLOPE * (2.0 - SQRT_2);
    let corner = SQRT_2 * (start + end);
    let weight = (1.0 + SQRT_2) / 3.0;
    [
        start.extend(low).extend(1.0),
        ((start + corner) / (1.0 + SQRT_2)).extend(low + step).extend(weight),
        ((corner + end) / (1.0 + SQRT_2)).extend(high - step).extend(weight),
        end.extend(high).extend(1.0),
    ]
}

pub(super) fn view() -> View {
    View::orthographic(DVec3::new(1.0, -0.8, 0.55))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far the cubic rise leaves the helix; the sections themselves are exact.
    const RISE_ERROR: f64 = 1.3e-4 * PITCH;

    #[test]
    fn every_section_is_a_circle_across_the_helix() {
        let surfaces = surfaces().unwrap();
        assert_eq!(surfaces.len(), 96);
        let tangent = |e: DVec3| DVec3::new(-e.y * COIL, e.x * COIL, SLOPE).normalize();
        for (index, s) in surfaces.iter().enumerate() {
            assert_eq!((s.surface.degree_u(), s.surface.degree_v()), (2, 3));
            assert!(s.surface.homogeneous().iter().any(|h| h.w != 1.0));
            for v in [0.0, 0.2, 0.5, 0.77, 1.0] {
                let points = [0.0, 0.3, 0.6, 1.0].map(|u| s.surface.eval(u, v));
                let quarter = TAU / 4.0 * (index / 4) as f64;
                let angle = quarter + angle_in_quarter(v);
                let e = DVec3::new(angle.cos(), angle.sin(), 0.0);
                let rise = points.map(|p| p.dot(tangent(e))).into_iter().sum::<f64>() / 4.0;
                let centre = COIL * e + DVec3::Z * (rise / tangent(e).z);
                assert!((centre.z - SLOPE * angle).abs() < RISE_ERROR, "{}", centre.z - SLOPE * angle);
                for p in points {
                    assert!(((p - centre).length() - WIRE).abs() < 1e-12, "{}: {v}", s.name);
                    assert!((p - centre).dot(tangent(e)).abs() < 1e-12, "{}: {v}", s.name);
                }
            }
        }
    }

    /// Angle of the rational quadratic quarter circle at v.
    fn angle_in_quarter(v: f64) -> f64 {
        let (a, b, c) = ((1.0 - v) * (1.0 - v), SQRT_2 * v * (1.0 - v), v * v);
        (b + c).atan2(a + b)
    }
}

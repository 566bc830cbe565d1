//! Height fields over the square [−1, 1]².

use std::array;

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::scene::SceneSurface;

use super::{bezier, part};
use crate::model::View;

/// z = x² − y². Its Bernstein coefficients of degree 3 over [−1, 1] are 1, −1/3, −1/3, 1 for a square.
pub(super) fn saddle() -> Option<Vec<SceneSurface>> {
    const LINE: [f64; 4] = [-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0];
    const SQUARE: [f64; 4] = [1.0, -1.0 / 3.0, -1.0 / 3.0, 1.0];
    let net = array::from_fn::<_, 4, _>(|i| {
        array::from_fn::<_, 4, _>(|j| DVec4::new(LINE[i], LINE[j], SQUARE[i] - SQUARE[j], 1.0))
    });
    Some(vec![part("saddle", bezier(net)?)])
}

/// Low enough that the far side of the saddle bends behind its ridge.
pub(super) fn saddle_view() -> View {
    View::orthographic(DVec3::new(1.0, 0.35, 0.45))
}

/// A bicubic B-spline over a 14 × 14 net with heights 0.22 sin(1.7 i + 0.5 j) + 0.13 sin(1.9 j − 0.8 i): two trains of
/// waves that cross.
pub(super) fn wiggle() -> Option<Vec<SceneSurface>> {
    const COUNT: usize = 14;
    let knots = KnotVector::uniform(3, COUNT - 3, [0.0, 1.0]).ok()?;
    let across = greville(&knots);
    // glam's sine is the same on every platform, which the standard library's is not.
    let sine = |angle: f64| DVec2::from_angle(angle).y;
    let mut points = Vec::with_capacity(COUNT * COUNT);
    for (i, x) in across.iter().enumerate() {
        for (j, y) in across.iter().enumerate() {
            let (i, j) = (i as f64, j as f64);
            let z = 0.22 * sine(1.7 * i + 0.5 * j) + 0.13 * sine(1.9 * j - 0.8 * i);
            points.push(DVec4::new(*x, *y, z, 1.0));
        }
    }
    Some(vec![part("wiggle", Surface::new(knots.clone(), knots, points).ok()?)])
}

pub(super) fn wiggle_view() -> View {
    View::orthographic(DVec3::new(1.0, -0.7, 0.6))
}

/// Two bicubic wings that meet along x = 0 with a break of the tangent plane, inside one surface: the knot 1/2 has
/// multiplicity 3.
pub(super) fn discont() -> Option<Vec<SceneSurface>> {
    const PROFILE: [f64; 7] = [0.0, 0.75, 0.1, 0.8, -0.1, 0.7, 0.15];
    const SCALE: [f64; 4] = [0.6, 1.3, 0.5, 1.0];
    let ku = KnotVector::new(vec![0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.0], 3).ok()?;
    let kv = KnotVector::bezier(3, [0.0, 1.0]).ok()?;
    let (across, along) = (greville(&ku), greville(&kv));
    let points = across
        .iter()
        .zip(PROFILE)
        .flat_map(|(x, h)| along.iter().zip(SCALE).map(move |(y, s)| DVec4::new(*x, *y, h * s, 1.0)))
        .collect();
    Some(vec![part("discont", Surface::new(ku, kv, points).ok()?)])
}

pub(super) fn discont_view() -> View {
    View::orthographic(DVec3::new(0.5, -1.0, 0.6))
}

/// Greville abscissae mapped to [−1, 1]: the coefficients with which a coordinate is linear in the parameter.
fn greville(knots: &KnotVector) -> Vec<f64> {
    let (all, degree) = (knots.as_slice(), knots.degree());
    (1..=knots.control_count()).map(|i| 2.0 * (all[i..i + degree].iter().sum::<f64>() / degree as f64) - 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(surfaces: Option<Vec<SceneSurface>>) -> Surface {
        let mut surfaces = surfaces.unwrap();
        assert_eq!(surfaces.len(), 1);
        surfaces.remove(0).surface
    }

    #[test]
    fn the_saddle_has_its_closed_form() {
        let s = only(saddle());
        for i in 0..=10 {
            for j in 0..=10 {
                let p = s.eval(f64::from(i) / 10.0, f64::from(j) / 10.0);
                assert!((p.z - (p.x * p.x - p.y * p.y)).abs() < 1e-15, "{p}");
            }
        }
    }

    #[test]
    fn fields_are_linear_in_the_parameters_across() {
        for s in [only(saddle()), only(wiggle()), only(discont())] {
            for (u, v) in [(0.0, 0.0), (0.1, 0.73), (0.5, 0.31), (0.9, 0.02), (1.0, 1.0)] {
                assert!(s.eval(u, v).truncate().distance(DVec2::new(2.0 * u - 1.0, 2.0 * v - 1.0)) < 1e-15);
            }
        }
    }

    #[test]
    fn the_break_of_discont_is_sharp_along_its_whole_length() {
        let (before, after) = only(discont()).split_u(0.5).unwrap();
        for k in 0..=20 {
            let v = f64::from(k) / 20.0;
            let ((p, a, _), (q, b, _)) = (before.derivatives(0.5, v), after.derivatives(0.5, v));
            assert!(p.distance(q) < 1e-15);
            assert!(a.angle_between(b).to_degrees() > 30.0, "{v}");
        }
    }
}

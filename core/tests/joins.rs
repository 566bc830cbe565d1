//! Folds over joins that are smooth within the tolerance only are drawn without gaps.

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::stroke::CurveKind;
use penvis_core::view::Camera;

/// A roll from (−1, y, 1) down over the line x = z = 0 to (−1, y, −1), whose tangents lean over beyond it by `above(y)` and
/// `below(y)`, linear in y.
fn roll(above: [f64; 2], below: [f64; 2]) -> Surface {
    let rows = [([-1.0; 2], 1.0), (above, 0.5), ([0.0; 2], 0.0), (below, -0.5), ([-1.0; 2], -1.0)];
    let points =
        rows.iter().flat_map(|&(x, z)| [DVec4::new(x[0], 0.0, z, 1.0), DVec4::new(x[1], 1.0, z, 1.0)]).collect();
    let across = KnotVector::new(vec![0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.0], 2).expect("knots");
    Surface::new(across, KnotVector::bezier(1, [0.0, 1.0]).expect("knots"), points).expect("a roll")
}

/// Intervals of y that visible silhouettes cover, in order, those that touch made one.
fn covered(surfaces: &[Surface]) -> Vec<[f64; 2]> {
    let named = |surface: &Surface| SceneSurface::new("part", surface.clone());
    let scene = Scene { name: "roll".into(), surfaces: surfaces.iter().map(named).collect() };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("a camera");
    let prepared = Prepared::new(&scene, &camera, &DrawOptions::default(), &()).expect("a picture");
    let traced = prepared.trace(1e-6, &()).expect("nothing stops it");
    assert!(traced.stats.visibility.undecided.is_empty(), "{:?}", traced.stats.visibility.undecided);
    let silhouettes = traced.strokes.iter().filter(|s| s.kind == CurveKind::Silhouette);
    let mut parts: Vec<[f64; 2]> = silhouettes
        .map(|s| {
            let y = || s.points.iter().map(|p| p.model.y);
            [y().fold(f64::INFINITY, f64::min), y().fold(f64::NEG_INFINITY, f64::max)]
        })
        .collect();
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut out: Vec<[f64; 2]> = Vec::new();
    for part in parts {
        match out.last_mut() {
            Some(last) if part[0] <= last[1] + 1e-5 => last[1] = last[1].max(part[1]),
            _ => out.push(part),
        }
    }
    out
}

#[test]
fn the_outline_of_a_roll_has_no_gap_where_it_passes_from_a_patch_to_the_join() {
    // Half the offset is the tangent of the lean: up to 0.4°, so that the join is smooth everywhere.
    for above in [[-0.003, 0.003], [0.003, -0.001], [-0.002, -0.002], [0.002, 0.001]] {
        for below in [[-0.003, 0.003], [0.001, -0.003], [-0.001, -0.002], [0.0005, 0.001]] {
            let whole = roll(above, below);
            let (a, b) = whole.split_u(0.5).expect("a place inside");
            for surfaces in [vec![whole], vec![a.clone(), b.clone()], vec![b.transposed(), a.reversed_v()]] {
                let parts = covered(&surfaces);
                assert_eq!(parts.len(), 1, "{above:?} {below:?}: {parts:?}");
                assert!(parts[0][0] < 1e-5 && parts[0][1] > 1.0 - 1e-5, "{above:?} {below:?}: {parts:?}");
            }
        }
    }
}

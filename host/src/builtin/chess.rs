//! Chess pieces beside the pawn: queen and rook turned, the knight with a head of free form on a turned foot.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::scene::SceneSurface;

use super::part;
use super::turned::{arcs, spline, turn};
use crate::model::View;

/// Foot, tall body, collar, a flaring crown with a rounded rim, and a ball of radius 0.25 about (0, 4).
pub(super) fn queen() -> Option<Vec<SceneSurface>> {
    const RIM: (f64, f64) = (1.1, 0.0);
    const WAIST: (f64, f64) = (0.82, 0.72);
    const NECK: (f64, f64) = (0.32, 2.62);
    const CROWN: (f64, f64) = (0.34, 2.86);
    const OUTER: (f64, f64) = (0.66, 3.5);
    const INNER: (f64, f64) = (0.54, 3.5);
    const BALL: (f64, f64) = (0.15, 3.8);
    let foot =
        [RIM, (1.2, 0.02), (1.25, 0.16), (1.16, 0.34), (0.9, 0.32), (0.88, 0.48), (1.02, 0.55), (0.95, 0.68), WAIST];
    let body = [WAIST, (0.7, 0.78), (0.52, 1.0), (0.4, 1.5), (0.33, 2.2), (0.31, 2.5), NECK];
    let collar = [NECK, (0.44, 2.6), (0.62, 2.64), (0.7, 2.72), (0.62, 2.8), (0.42, 2.82), CROWN];
    let crown = [CROWN, (0.36, 3.0), (0.44, 3.2), (0.6, 3.36), OUTER];
    let cap = [INNER, (0.46, 3.64), (0.3, 3.72), (0.2, 3.74), BALL];
    Some(vec![
        part("underside", turn(&spline(&[(0.0, 0.0), RIM])?)?),
        part("foot", turn(&spline(&foot)?)?),
        part("body", turn(&spline(&body)?)?),
        part("collar", turn(&spline(&collar)?)?),
        part("crown", turn(&spline(&crown)?)?),
        part("rim", turn(&arcs((0.6, 3.5), &[OUTER, (0.6, 3.56), INNER])?)?),
        part("cap", turn(&spline(&cap)?)?),
        part("ball", turn(&arcs((0.0, 4.0), &[BALL, (0.25, 4.0), (0.0, 4.25)])?)?),
    ])
}

/// Foot, body, and a turret with a wall round a floor.
pub(super) fn rook() -> Option<Vec<SceneSurface>> {
    const RIM: (f64, f64) = (1.0, 0.0);
    const WAIST: (f64, f64) = (0.78, 0.62);
    const NECK: (f64, f64) = (0.47, 1.8);
    const LEDGE: (f64, f64) = (0.68, 1.96);
    const OUTER: (f64, f64) = (0.7, 2.45);
    const INNER: (f64, f64) = (0.52, 2.45);
    const FLOOR: (f64, f64) = (0.5, 2.15);
    let foot =
        [RIM, (1.1, 0.02), (1.15, 0.14), (1.07, 0.31), (0.82, 0.29), (0.8, 0.43), (0.95, 0.49), (0.9, 0.59), WAIST];
    let body = [WAIST, (0.67, 0.67), (0.58, 0.8), (0.5, 1.1), (0.46, 1.45), (0.46, 1.7), NECK];
    Some(vec![
        part("underside", turn(&spline(&[(0.0, 0.0), RIM])?)?),
        part("foot", turn(&spline(&foot)?)?),
        part("body", turn(&spline(&body)?)?),
        part("ledge", turn(&spline(&[NECK, (0.6, 1.8), (0.68, 1.86), LEDGE])?)?),
        part("wall", turn(&spline(&[LEDGE, OUTER])?)?),
        part("battlement", turn(&spline(&[OUTER, INNER])?)?),
        part("inside", turn(&spline(&[INNER, FLOOR])?)?),
        part("floor", turn(&spline(&[FLOOR, (0.0, 2.15)])?)?),
    ])
}

/// A foot closed on top, and on it neck and head, two ears and a mane.
pub(super) fn knight() -> Option<Vec<SceneSurface>> {
    const RIM: (f64, f64) = (1.0, 0.0);
    const TOP: (f64, f64) = (0.74, 0.66);
    let foot =
        [RIM, (1.1, 0.02), (1.15, 0.14), (1.07, 0.31), (0.82, 0.29), (0.8, 0.43), (0.95, 0.49), (0.9, 0.64), TOP];
    // Position in the plane of symmetry, half the depth in it and half the width across it.
    let head = [
        (-0.02, 0.52, 0.0, 0.0),
        (-0.02, 0.54, 0.62, 0.5),
        (-0.06, 0.9, 0.64, 0.5),
        (-0.2, 1.3, 0.5, 0.36),
        (-0.26, 1.75, 0.46, 0.3),
        (-0.1, 2.2, 0.4, 0.27),
        (0.22, 2.36, 0.36, 0.27),
        (0.5, 2.16, 0.31, 0.24),
        (0.74, 1.9, 0.21, 0.18),
        (0.95, 1.7, 0.19, 0.17),
        (1.07, 1.56, 0.17, 0.15),
        (1.1, 1.52, 0.0, 0.0),
    ];
    let mane = [
        (-0.36, 0.98, 0.0, 0.0),
        (-0.38, 1.0, 0.2, 0.06),
        (-0.6, 1.35, 0.2, 0.07),
        (-0.68, 1.8, 0.2, 0.07),
        (-0.5, 2.3, 0.2, 0.07),
        (-0.1, 2.6, 0.16, 0.06),
        (0.16, 2.62, 0.1, 0.05),
        (0.2, 2.61, 0.0, 0.0),
    ];
    let ear = [
        (-0.02, 2.3, 0.0, 0.0),
        (-0.02, 2.32, 0.12, 0.07),
        (0.0, 2.5, 0.13, 0.08),
        (0.02, 2.66, 0.1, 0.06),
        (0.05, 2.8, 0.02, 0.015),
        (0.052, 2.81, 0.0, 0.0),
    ];
    Some(vec![
        part("underside", turn(&spline(&[(0.0, 0.0), RIM])?)?),
        part("foot", turn(&spline(&foot)?)?),
        part("top", turn(&spline(&[TOP, (0.0, 0.66)])?)?),
        part("head", loft(&head, 0.0)?),
        part("mane", loft(&mane, 0.0)?),
        part("left ear", loft(&ear, 0.17)?),
        part("right ear", loft(&ear, -0.17)?),
    ])
}

pub(super) fn queen_view() -> View {
    View::perspective(DVec3::new(4.6, -7.4, 5.6), DVec3::new(0.0, 0.0, 2.05))
}

pub(super) fn rook_view() -> View {
    View::perspective(DVec3::new(3.2, -4.9, 4.6), DVec3::new(0.0, 0.0, 1.2))
}

pub(super) fn knight_view() -> View {
    View::perspective(DVec3::new(2.6, -5.6, 3.2), DVec3::new(0.05, 0.0, 1.35))
}

/// A closed surface with elliptical sections (x, z, half axis in the plane y = `y`, half axis across it) as the control
/// polygons of a cubic B-spline along its spine: what they are swept into is smooth all over. The first and the last
/// section are points, and each is in the plane of the section beside it as nearly as the spine turns.
fn loft(sections: &[(f64, f64, f64, f64)], y: f64) -> Option<Surface> {
    const CIRCLE: [(f64, f64); 9] = [
        (1.0, 0.0),
        (1.0, 1.0),
        (0.0, 1.0),
        (-1.0, 1.0),
        (-1.0, 0.0),
        (-1.0, -1.0),
        (0.0, -1.0),
        (1.0, -1.0),
        (1.0, 0.0),
    ];
    let at = |k: usize| DVec3::new(sections[k].0, y, sections[k].1);
    let last = sections.len() - 1;
    let mut points = Vec::with_capacity(9 * sections.len());
    for (i, (c, s)) in CIRCLE.into_iter().enumerate() {
        for (k, &(.., depth, width)) in sections.iter().enumerate() {
            let spine = (at((k + 1).min(last)) - at(k.saturating_sub(1))).normalize();
            let across = DVec3::Y.cross(spine);
            let p = at(k) + across * (depth * c) + DVec3::Y * (width * s);
            points.push(p.extend(if i.is_multiple_of(2) { 1.0 } else { FRAC_1_SQRT_2 }));
        }
    }
    let round = [0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0];
    let round = KnotVector::new(round.to_vec(), 2).ok()?;
    let along = KnotVector::uniform(3, last - 2, [0.0, 1.0]).ok()?;
    let points: Vec<DVec4> = points;
    Surface::new(round, along, points).ok()
}

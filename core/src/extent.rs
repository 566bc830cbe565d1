//! How far a scene reaches.
//!
//! Control points say where surfaces are at the most, and trims cut off what may have reached farthest. Here is where they
//! are: along each axis the patches are halved, the one whose control points reach farthest first, until a point that is
//! there is as far as all of them, to the tolerance. Of a part that trims cut through, that there is a point is known from the
//! trim curve itself, which bounds what is kept; so it is halved until it is no longer than the tolerance.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use glam::{DVec2, DVec3, DVec4};

use crate::stop::{Stop, Stopped};
use crate::trim::Cover;
use crate::view::{Patch, ViewScene, halve_net};

/// Lower and upper corner of the box of what there is of the surfaces, in model space; none if nothing is left of them. Each
/// side is reached, and nothing is more than `tolerance`, or the rounding of coordinates, beyond it. Cost: along each axis one
/// look at each control point, and then at parts of the patches that reach farthest, some √(size / tolerance) where many do.
///
/// # Errors
/// If it is stopped.
pub fn extent(view: &ViewScene, tolerance: f64, stop: Stop<'_>) -> Result<Option<[DVec3; 2]>, Stopped> {
    let mut corners = [DVec3::ZERO; 2];
    for axis in 0..3 {
        for (corner, sign) in corners.iter_mut().zip([-1.0, 1.0]) {
            let Some(reach) = reach(view, Towards { axis, sign }, tolerance, stop)? else { return Ok(None) };
            corner[axis] = sign * reach;
        }
    }
    Ok(Some(corners))
}

/// A direction along an axis.
#[derive(Clone, Copy)]
struct Towards {
    axis: usize,
    sign: f64,
}

impl Towards {
    /// How far a homogeneous point is.
    fn of(self, h: DVec4) -> f64 {
        self.sign * h[self.axis] / h.w
    }
}

/// A part of a patch.
struct Cell {
    /// How far its control points reach.
    most: f64,
    /// Index of the patch.
    patch: usize,
    /// Lower and upper corner in the parameters of the surface.
    range: [DVec2; 2],
    /// Its control points; none for the patch as a whole.
    points: Vec<DVec4>,
    /// How often the patch was halved for it.
    halvings: u32,
}

/// Most halvings of a patch. After 50 in each direction a part is as long in parameters as their rounding, and so is its
/// image, whatever the patch looks like.
const DEEPEST: u32 = 100;

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cell {}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cell {
    fn cmp(&self, other: &Self) -> Ordering {
        self.most.total_cmp(&other.most)
    }
}

/// How far the surfaces reach in a direction.
fn reach(view: &ViewScene, towards: Towards, tolerance: f64, stop: Stop<'_>) -> Result<Option<f64>, Stopped> {
    let mut cells = BinaryHeap::new();
    for (index, patch) in model_patches(view) {
        let most = patch.points.iter().map(|&h| towards.of(h)).fold(f64::NEG_INFINITY, f64::max);
        let range = [DVec2::new(patch.u[0], patch.v[0]), DVec2::new(patch.u[1], patch.v[1])];
        cells.push(Cell { most, patch: index, range, points: Vec::new(), halvings: 0 });
    }
    let mut found = None;
    while let Some(mut cell) = cells.pop() {
        stop.check()?;
        // Below this difference of two coordinates there is nothing but rounding.
        let tolerance = tolerance.max(8.0 * f64::EPSILON * cell.most.abs());
        if found.is_some_and(|found: f64| cell.most <= found + tolerance) {
            break;
        }
        let patch = view.model_patch(cell.patch);
        let (p, q) = (patch.degree_u, patch.degree_v);
        if cell.points.is_empty() {
            cell.points.clone_from(&patch.points);
        }
        let trims = view.trims(patch.surface);
        let cover = trims.map_or(Cover::Inside, |trims| trims.cover(cell.range[0], cell.range[1]));
        let reached = match cover {
            Cover::Outside => continue,
            Cover::Inside => Some(corners(&cell.points, p, q).map(|h| towards.of(h)).fold(f64::NEG_INFINITY, f64::max)),
            Cover::Mixed => {
                let least = cell.points.iter().map(|&h| towards.of(h)).fold(f64::INFINITY, f64::min);
                (cell.most - least <= tolerance || cell.halvings == DEEPEST).then_some(least)
            }
        };
        if let Some(reached) = reached {
            found = Some(found.map_or(reached, |found: f64| found.max(reached)));
        }
        if cell.halvings == DEEPEST || reached.is_some_and(|reached| cell.most <= reached + tolerance) {
            continue;
        }
        halve(cell, p, q, towards, &mut cells);
    }
    Ok(found)
}

/// Halves a cell across the direction in which it varies more.
fn halve(mut cell: Cell, p: usize, q: usize, towards: Towards, cells: &mut BinaryHeap<Cell>) {
    let w = q + 1;
    let step = |a: DVec4, b: DVec4| (towards.of(a) - towards.of(b)).abs();
    let along_u = cell.points.iter().zip(cell.points.iter().skip(w)).map(|(&a, &b)| step(a, b)).fold(0.0, f64::max);
    let rows = cell.points.chunks_exact(w);
    let along_v = rows.flat_map(|row| row.windows(2).map(|s| step(s[0], s[1]))).fold(0.0, f64::max);
    let axis = usize::from(along_v > along_u);
    let middle = 0.5 * (cell.range[0][axis] + cell.range[1][axis]);
    let mut upper = cell.points.clone();
    halve_net(&mut cell.points, &mut upper, p, q, axis == 0);
    let [low, high] = cell.range;
    let (mut below, mut above) = ([low, high], [low, high]);
    (below[1][axis], above[0][axis]) = (middle, middle);
    for (range, points) in [(below, cell.points), (above, upper)] {
        let most = points.iter().map(|&h| towards.of(h)).fold(f64::NEG_INFINITY, f64::max);
        cells.push(Cell { most, patch: cell.patch, range, points, halvings: cell.halvings + 1 });
    }
}

fn model_patches(view: &ViewScene) -> impl Iterator<Item = (usize, &Patch)> {
    (0..view.patches().len()).map(|index| (index, view.model_patch(index)))
}

/// The control points that are on the patch whatever its shape.
fn corners(points: &[DVec4], p: usize, q: usize) -> impl Iterator<Item = DVec4> + '_ {
    let w = q + 1;
    [0, q, p * w, p * w + q].into_iter().map(|k| points[k])
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;
    use crate::nurbs::Curve;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, circle, cylinder, plane, sphere, torus};
    use crate::trim::Trims;
    use crate::view::Camera;

    fn found(surfaces: Vec<SceneSurface>) -> Option<[DVec3; 2]> {
        let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap();
        let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
        extent(&view, 1e-7, Stop::NEVER).unwrap()
    }

    fn near(found: Option<[DVec3; 2]>, low: [f64; 3], high: [f64; 3]) {
        let [a, b] = found.unwrap();
        assert!(a.abs_diff_eq(low.into(), 2e-7) && b.abs_diff_eq(high.into(), 2e-7), "{a} {b}");
    }

    fn tilted() -> Frame {
        Frame::new(DVec3::new(5.0, 6.0, 7.0), DVec3::new(1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 0.0)).unwrap()
    }

    #[test]
    fn tilted_quadrics_reach_as_far_as_formulas_say() {
        near(found(vec![SceneSurface::new("s", sphere(&tilted(), 2.0).unwrap())]), [3.0, 4.0, 5.0], [7.0, 8.0, 9.0]);
        // A circle of radius r with the unit normal n reaches r √(1 − n_k²) along axis k: r √(2/3) here.
        let rim = libm::sqrt(2.0 / 3.0);
        let up = libm::sqrt(1.0 / 3.0) * 3.0;
        let can = SceneSurface::new("s", cylinder(&tilted(), 1.0, 3.0).unwrap());
        near(found(vec![can]), [5.0 - rim, 6.0 - rim, 7.0 - rim], [5.0 + up + rim, 6.0 + up + rim, 7.0 + up + rim]);
        let ring = SceneSurface::new("s", torus(&tilted(), 3.0, 1.0).unwrap());
        let far = 3.0 * rim + 1.0;
        near(found(vec![ring]), [5.0 - far, 6.0 - far, 7.0 - far], [5.0 + far, 6.0 + far, 7.0 + far]);
    }

    #[test]
    fn what_trims_cut_off_does_not_count() {
        let trimmed = |curve: Curve, origin: DVec3, u: DVec3, v: DVec3| {
            let surface = plane(origin, u, v).unwrap();
            let trims = Some(Trims::new(&surface, &[vec![curve]]).unwrap());
            SceneSurface { trims, ..SceneSurface::new("part", surface) }
        };
        let hole = circle(&Frame::at(DVec3::new(0.4, 0.5, 0.0)).unwrap(), 0.3).unwrap();
        // In the plane z = x, and on a plane that faces along z.
        let slope = trimmed(hole.clone(), DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0), DVec3::Y);
        near(found(vec![slope]), [0.1, 0.2, 0.1], [0.7, 0.8, 0.7]);
        let level = trimmed(hole, DVec3::Z, DVec3::X * 10.0, DVec3::Y * 10.0);
        near(found(vec![level]), [1.0, 2.0, 1.0], [7.0, 8.0, 1.0]);
        assert_eq!(
            found(vec![SceneSurface::new("s", plane(DVec3::ONE, DVec3::X, DVec3::Y).unwrap())]),
            Some([DVec3::ONE, DVec3::new(2.0, 2.0, 1.0)])
        );
    }

    #[test]
    fn it_stops_when_asked_to() {
        let camera = Camera::orthographic(DVec3::Y, DVec3::Z).unwrap();
        let surfaces = vec![SceneSurface::new("s", sphere(&tilted(), 2.0).unwrap())];
        let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
        assert_eq!(extent(&view, 1e-7, Stop::when(&|| true)), Err(Stopped));
    }
}

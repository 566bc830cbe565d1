//! Two faces of one edge whose sides are apart, or overlap: sight lines between them meet what they do beside them.

use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::Cracks;
use crate::nurbs::{Curve, KnotVector};
use crate::scene::{Scene, SceneSurface};
use crate::shape::plane;
use crate::stitch::{StitchOptions, Stitching};
use crate::stop::Stop;
use crate::trim::{TrimCurve, Trims};
use crate::view::{Camera, ViewScene};
use crate::visibility::{Exclusion, Occluders, RayAnswer, RayScratch, Unclear};

/// How far the sides are apart, which is far more than what counts as one.
const GAP: f64 = 1e-4;

fn bezier(points: &[[f64; 2]]) -> Curve {
    let knots = KnotVector::bezier(points.len() - 1, [0.0, 1.0]).unwrap();
    Curve::new(knots, points.iter().map(|p| DVec3::new(p[0], p[1], 0.0).extend(1.0)).collect()).unwrap()
}

/// The place in x of the edge at y = −1 … 1: a parabola.
fn edge(bend: f64, y: f64) -> f64 {
    bend * (1.0 - y * y)
}

/// The part of the plane z = slope·x within |x| ≤ 1, |y| ≤ 1 on one side of the edge: to the left of it, or to its right. The
/// side that the plane ends in is `off` to the right of the edge.
fn half(left: bool, slope: f64, bend: f64, off: f64) -> SceneSurface {
    let surface = plane(DVec3::new(-1.0, -1.0, -slope), DVec3::new(2.0, 0.0, 2.0 * slope), DVec3::Y * 2.0).unwrap();
    // From −1 … 1 to 0 … 1; the middle control point of a parabola is twice as far out as the parabola.
    let (x, far) = (0.5 + 0.5 * off, 0.5 + 0.5 * off + bend);
    let up = bezier(&[[x, 0.0], [far, 0.5], [x, 1.0]]);
    let side = |a: [f64; 2], b: [f64; 2]| TrimCurve { curve: bezier(&[a, b]), edge: None };
    let shared = |curve: Curve| TrimCurve { curve, edge: Some(7) };
    let ring = if left {
        vec![side([0.0, 0.0], [x, 0.0]), shared(up), side([x, 1.0], [0.0, 1.0]), side([0.0, 1.0], [0.0, 0.0])]
    } else {
        let down = shared(up.reversed());
        vec![side([x, 0.0], [1.0, 0.0]), side([1.0, 0.0], [1.0, 1.0]), side([1.0, 1.0], [x, 1.0]), down]
    };
    let trims = Trims::oriented(&surface, [false; 2], &[ring]).unwrap();
    SceneSurface { trims: Some(trims), ..SceneSurface::new("half", surface) }
}

/// The same left half as a surface that ends there itself.
fn whole_left(slope: f64, off: f64) -> SceneSurface {
    let surface =
        plane(DVec3::new(-1.0, -1.0, -slope), DVec3::new(1.0 + off, 0.0, (1.0 + off) * slope), DVec3::Y * 2.0).unwrap();
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let side = |k: usize| {
        let curve = bezier(&[corners[k], corners[(k + 1) % 4]]);
        TrimCurve { curve, edge: Some(7).filter(|_| k == 1) }
    };
    let trims = Trims::oriented(&surface, [false; 2], &[(0..4).map(side).collect()]).unwrap();
    SceneSurface { trims: Some(trims), ..SceneSurface::new("half", surface) }
}

/// Asks sight lines through places of two faces, seen from above, for the sheets above z = −5.
struct Asked {
    view: ViewScene,
    stitching: Stitching,
    occluders: Occluders<'static>,
}

impl Asked {
    fn new(faces: Vec<SceneSurface>) -> Self {
        let scene = Scene { name: "crack".into(), surfaces: faces };
        let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap();
        let stitching = Stitching::new(&view, &StitchOptions::of(&view), Stop::NEVER);
        let occluders = Occluders::trimmed(view.patches(), &|s| view.trims(s), usize::MAX, Stop::NEVER).into_owned();
        Self { view, stitching, occluders }
    }

    fn at(&self, x: f64, y: f64) -> RayAnswer {
        self.below(DVec3::new(x, y, -5.0), &[])
    }

    fn below(&self, p: DVec3, exclude: &[Exclusion]) -> RayAnswer {
        let cracks = Cracks::new(&self.view, &self.stitching, self.occluders.resolution());
        self.occluders.query_among(p, exclude, &cracks, &mut RayScratch::new())
    }

    /// Without regard to the crack.
    fn plainly(&self, x: f64, y: f64) -> RayAnswer {
        self.occluders.query(DVec3::new(x, y, -5.0), &[], &mut RayScratch::new())
    }
}

const fn clear(qi: u32) -> RayAnswer {
    RayAnswer { qi, clear: true, reason: None, contact: false }
}

/// Places along the edge and, in parts of the gap, across it.
fn places() -> impl Iterator<Item = (f64, f64)> {
    (0..19).flat_map(|k| {
        [-40.0, -3.0, -1.2, -0.5, -0.4999, -0.2, 0.0, 1e-7, 0.3, 0.5, 0.9, 2.0, 40.0]
            .map(|s| (-0.9 + 0.1 * f64::from(k) + 0.013, s))
    })
}

#[test]
fn between_sides_that_are_apart_or_overlap_one_sheet_is_met() {
    // Planes at an angle meet in a straight line only.
    for (bend, slopes) in [(0.0, [0.3, -0.2]), (0.0, [0.0, 0.0]), (0.2, [0.4, 0.4]), (-0.35, [0.1, 0.1])] {
        for gap in [GAP, -GAP, 1e-5, -1e-5] {
            let halves = [half(true, slopes[0], bend, -0.5 * gap), half(false, slopes[1], bend, 0.5 * gap)];
            let asked = Asked::new(halves.into());
            let mut exposed = 0;
            for (y, s) in places() {
                let x = edge(bend, y) + s * gap.abs();
                assert_eq!(asked.at(x, y), clear(1), "bend {bend} gap {gap} at {x} {y}");
                let plainly = asked.plainly(x, y);
                exposed += usize::from(plainly == clear(if gap > 0.0 { 0 } else { 2 }));
            }
            // The crack is there.
            assert!(exposed > 50, "bend {bend} gap {gap}: {exposed}");
        }
    }
}

#[test]
fn a_surface_that_ends_there_is_as_one_that_is_trimmed() {
    for gap in [GAP, -GAP] {
        let asked = Asked::new(vec![whole_left(0.3, -0.5 * gap), half(false, -0.2, 0.0, 0.5 * gap)]);
        for (y, s) in places() {
            assert_eq!(asked.at(s * gap.abs(), y), clear(1), "gap {gap} at {s} {y}");
        }
    }
}

/// Both faces on the left: an outline, which is two sheets or none, and on the sight line neither.
#[test]
fn where_the_surface_turns_back_the_count_is_not_clear() {
    for gap in [GAP, -GAP] {
        let asked = Asked::new(vec![half(true, 0.3, 0.0, -0.5 * gap), half(true, 0.1, 0.0, 0.5 * gap)]);
        for (y, s) in places() {
            let answer = asked.at(s * gap.abs(), y);
            if s.abs() > 3.5 {
                assert_eq!(answer, clear(if s < 0.0 { 2 } else { 0 }), "{s} {y}");
            } else if s.abs() < 1.5 {
                assert_eq!((answer.clear, answer.reason), (false, Some(Unclear::Border)), "{s} {y}");
            }
        }
    }
}

/// A point on the edge is on its faces, and not behind them; one above does not see them; one that only just lies below, no
/// farther than the sides are apart, is not clear.
#[test]
fn a_crack_counts_for_what_is_behind_it() {
    let gap = GAP;
    let asked = Asked::new(vec![half(true, 0.0, 0.0, -0.5 * gap), half(false, 0.0, 0.0, 0.5 * gap)]);
    assert_eq!(asked.below(DVec3::new(0.0, 0.3, 1.0), &[]), clear(0));
    let on = DVec3::new(-0.5 * gap, 0.3, 0.0);
    let own = |surface: usize, x: f64| Exclusion {
        surface,
        uv: DVec2::new(0.5 + 0.5 * x, 0.65),
        radius: DVec2::splat(2.0 * gap),
    };
    assert_eq!(asked.below(on, &[own(0, -0.5 * gap), own(1, 0.5 * gap)]), clear(0));
    let answer = asked.below(DVec3::new(0.0, 0.3, -0.5 * gap), &[]);
    assert_eq!((answer.clear, answer.reason), (false, Some(Unclear::Contact)));
    assert_eq!(asked.below(DVec3::new(0.0, 0.3, -0.1), &[]), clear(1));
}

/// At the end of an edge there are other edges, and where several meet no half planes.
#[test]
fn at_the_end_of_an_edge_the_count_is_not_clear() {
    let asked = Asked::new(vec![half(true, 0.1, 0.0, -0.5 * GAP), half(false, 0.1, 0.0, 0.5 * GAP)]);
    let answer = asked.at(0.0, 1.0 + 0.2 * GAP);
    assert!(!answer.clear, "{answer:?}");
    assert_eq!(asked.at(0.0, 1.0 + 4.0 * GAP), clear(0));
}

/// What lies exactly on one another needs no crack.
#[test]
fn edges_that_are_one_are_no_cracks() {
    let asked = Asked::new(vec![half(true, 0.3, 0.2, 0.0), half(false, 0.3, 0.2, 0.0)]);
    let cracks = Cracks::new(&asked.view, &asked.stitching, asked.occluders.resolution());
    assert!(cracks.at(DVec2::new(edge(0.2, 0.1), 0.1)).is_empty() && cracks.edges.is_empty());
    for (y, s) in places() {
        assert_eq!(asked.at(edge(0.2, y) + s * GAP, y), clear(1), "{s} {y}");
    }
}

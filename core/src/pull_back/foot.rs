//! The point of a surface that is nearest to a given one.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Ordering;

use glam::{DVec2, DVec3, DVec4};

use super::sheet::Sheet;
use crate::nurbs::SurfaceJet;
use crate::view::{Patch, halve_net, net_box};

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Its parameters; in periodic directions not wrapped.
    pub(super) uv: DVec2,
    /// Its distance from the point whose foot it is.
    pub(super) distance: f64,
}

/// Steps of Newton's method before it is given up; from a start near the foot three to five are enough.
const STEPS: usize = 40;

impl Sheet<'_> {
    /// The foot of `p` that descent from `start` leads to: Newton's method on the squared distance, each step halved until
    /// the distance falls. On a border the parameter that would leave the range is held.
    pub(super) fn foot_near(&self, p: DVec3, start: DVec2) -> Foot {
        let mut uv = self.within(start);
        let mut jet = self.jet(uv);
        let mut squared = (jet.p - p).length_squared();
        // Where a step is shorter than this, the next one, a square of it, is lost in rounding.
        let near = 1e-9 * self.size;
        for _ in 0..STEPS {
            let step = self.newton_step(&jet, jet.p - p, uv);
            let length = (jet.du * step.x + jet.dv * step.y).length();
            let (mut part, mut moved) = (1.0, false);
            for _ in 0..12 {
                let next = self.within(uv + step * part);
                if next == uv {
                    break;
                }
                let there = self.jet(next);
                let d = (there.p - p).length_squared();
                if d < squared {
                    (uv, jet, squared, moved) = (next, there, d, true);
                    break;
                }
                if length * part <= self.rounding {
                    break;
                }
                part *= 0.5;
            }
            if !moved || part == 1.0 && length <= near {
                break;
            }
        }
        Foot { uv, distance: libm::sqrt(squared) }
    }

    /// Newton's step for the squared distance, `r` being surface less point; Gauss–Newton's where the Hessian is no good.
    fn newton_step(&self, jet: &SurfaceJet, r: DVec3, uv: DVec2) -> DVec2 {
        let gradient = DVec2::new(r.dot(jet.du), r.dot(jet.dv));
        // Held: at a border, with descent leading out.
        let held = [0, 1].map(|d| self.leaves(d, uv[d], -gradient[d]));
        let step = -solve(hessian(jet, r), gradient, held);
        // No more than a quarter of the range at once: farther off the quadratic model means nothing.
        let far = (step.abs() / self.range).max_element();
        if far > 0.25 { step * (0.25 / far) } else { step }
    }

    /// Whether the parameter is on a border and the direction leads out over it.
    pub(super) fn leaves(&self, d: usize, x: f64, direction: f64) -> bool {
        !self.periodic[d] && (x <= self.lo[d] && direction < 0.0 || x >= self.hi[d] && direction > 0.0)
    }

    /// The nearest point of the surface: no other is nearer by more than a hundredth of the distance, unless the distance is
    /// no more than `enough`. Best first over the Bézier patches, halved; what a plane across the line of sight keeps
    /// farther away than the best foot so far is left out.
    pub(super) fn foot(&self, p: DVec3, enough: f64) -> Foot {
        let distances: Vec<f64> = self.cells.iter().map(|c| c.distance(p)).collect();
        // Mostly one of the nearest boxes holds the foot, and the others need not be looked at.
        let first = (0..distances.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let mut best = self.foot_near(p, first.map_or(self.lo, |k| self.cells[k].centre()));
        let mut queue: BinaryHeap<Candidate> = BinaryHeap::new();
        if best.distance > enough {
            let open = distances.iter().enumerate().filter(|(_, d)| **d < 0.99 * best.distance);
            queue.extend(open.map(|(k, &bound)| Candidate { bound, cell: Part::Whole(k) }));
        }
        for _ in 0..CELLS {
            let Some(Candidate { bound, cell }) = queue.pop() else { break };
            if best.distance <= enough || bound >= 0.99 * best.distance {
                break;
            }
            let cell = match cell {
                Part::Whole(k) => self.cells[k].clone(),
                Part::Half(cell) => cell,
            };
            let centre = cell.centre();
            let near = self.eval(centre);
            if (near - p).length() < 2.0 * best.distance {
                let foot = self.foot_near(p, centre);
                if foot.distance < best.distance {
                    best = foot;
                }
            }
            if cell.beyond(p, near) >= 0.99 * best.distance {
                continue;
            }
            for half in cell.halves() {
                let bound = bound.max(half.distance(p)).max(half.beyond(p, self.eval(half.centre())));
                if bound < 0.99 * best.distance {
                    queue.push(Candidate { bound, cell: Part::Half(half) });
                }
            }
        }
        Foot { uv: self.wrapped(best.uv), ..best }
    }
}

/// Cells of the surface that one search looks at, at most; the centre of a sphere, as near to all of it, needs some
/// hundreds.
const CELLS: usize = 2000;

/// Second derivatives of half the squared distance: E, F, G.
pub(super) fn hessian(jet: &SurfaceJet, r: DVec3) -> [f64; 3] {
    let [a, b, c] = [jet.du.length_squared(), jet.du.dot(jet.dv), jet.dv.length_squared()];
    let full = [a + r.dot(jet.duu), b + r.dot(jet.duv), c + r.dot(jet.dvv)];
    // Positive definite with something to spare, or it leads to a saddle or a far point.
    let definite = full[0] > 0.1 * a && full[2] > 0.1 * c && full[0] * full[2] - full[1] * full[1] > 0.01 * a * c;
    if definite { full } else { [a, b, c] }
}

/// The solution of the symmetric system, least where it is singular; `held` unknowns are zero.
pub(super) fn solve([a, b, c]: [f64; 3], g: DVec2, held: [bool; 2]) -> DVec2 {
    let single = |k: f64, g: f64| if k > 0.0 { g / k } else { 0.0 };
    let determinant = a * c - b * b;
    match held {
        [true, true] => DVec2::ZERO,
        [true, false] => DVec2::new(0.0, single(c, g.y)),
        [false, true] => DVec2::new(single(a, g.x), 0.0),
        // Below this the determinant is the rounding of its products.
        [false, false] if determinant > 1e-14 * a * c => DVec2::new(c * g.x - b * g.y, a * g.y - b * g.x) / determinant,
        // The two directions are one: what is along it, by the longer of the two.
        [false, false] if a >= c => DVec2::new(single(a, g.x), 0.0),
        [false, false] => DVec2::new(0.0, single(c, g.y)),
    }
}

/// A piece of the surface: a Bézier net with its box.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    points: Vec<DVec4>,
    degree: [usize; 2],
    lo: DVec2,
    hi: DVec2,
    bounds: (DVec3, DVec3),
}

impl Cell {
    pub(super) fn new(patch: Patch) -> Self {
        let bounds = net_box(&patch.points);
        let (lo, hi) = (DVec2::new(patch.u[0], patch.v[0]), DVec2::new(patch.u[1], patch.v[1]));
        Self { points: patch.points, degree: [patch.degree_u, patch.degree_v], lo, hi, bounds }
    }

    fn centre(&self) -> DVec2 {
        0.5 * (self.lo + self.hi)
    }

    /// Distance of `p` from the box.
    fn distance(&self, p: DVec3) -> f64 {
        let (lo, hi) = self.bounds;
        (lo - p).max(p - hi).max(DVec3::ZERO).length()
    }

    /// A lower bound of the distance: by how much all control points, whose hull holds the piece, are on the far side of
    /// the plane through `p` across the direction to its point `near`.
    fn beyond(&self, p: DVec3, near: DVec3) -> f64 {
        let Some(n) = (near - p).try_normalize() else { return 0.0 };
        self.points.iter().map(|h| (h.truncate() / h.w - p).dot(n)).fold(f64::INFINITY, f64::min)
    }

    /// The two halves, across the longer direction of the net; none of a cell that parameters cannot part.
    fn halves(mut self) -> Vec<Self> {
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| {
            let h = self.points[i * (q + 1) + j];
            h.truncate() / h.w
        };
        let along_u = (at(0, q / 2) - at(p, q / 2)).length() >= (at(p / 2, 0) - at(p / 2, q)).length();
        let mut upper = self.points.clone();
        halve_net(&mut self.points, &mut upper, p, q, along_u);
        let (mut lower_hi, mut upper_lo) = (self.hi, self.lo);
        let d = usize::from(!along_u);
        let middle = 0.5 * (self.lo[d] + self.hi[d]);
        if !(self.lo[d] < middle && middle < self.hi[d]) {
            return Vec::new();
        }
        (lower_hi[d], upper_lo[d]) = (middle, middle);
        let bounds = net_box(&upper);
        let high = Self { points: upper, lo: upper_lo, bounds, ..self.clone() };
        let low = Self { bounds: net_box(&self.points), hi: lower_hi, ..self };
        alloc::vec![low, high]
    }
}

enum Part {
    Whole(usize),
    Half(Cell),
}

/// A cell to look at: the nearest first.
struct Candidate {
    bound: f64,
    cell: Part,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound)
    }
}

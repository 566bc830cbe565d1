//! From arcs to vertices: a silhouette on one patch with chord error and turning within bounds, split at its cusps.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::cusp::{CuspForm, Probe, cusps_of};
use super::walk::{bracketed, walk};
use super::{CurveEnd, Segment, SilhouetteOptions, SilhouetteStats, TracedCurve};
use crate::extract::facing::FacingForm;
use crate::extract::zero_set::{Arc, Rect, Variable};
use crate::view::Patch;

/// A vertex with what refinement asks of it.
#[derive(Clone, Copy)]
struct Node {
    local: DVec2,
    screen: DVec2,
    /// How far on the screen rounding, of coordinates and of F, may have moved it.
    blur: f64,
    /// Unit normal of the surface; zero where it is not known (a pole).
    normal: DVec3,
    /// Advance of the screen point along the silhouette, by the normal turned a right angle; it changes sign at cusps
    /// and nowhere else. Zero where it is no larger than its rounding, and at a cusp.
    advance: f64,
    cusp: bool,
}

/// Vertices and the segments between them.
pub(super) struct Path {
    nodes: Vec<Node>,
    segments: Vec<Segment>,
}

/// Halvings of an arc; the chord error falls by four with each, and by two or more at a point where it is singular.
const MAX_HALVINGS: u32 = 24;

/// A normal that rounding may tilt by more than this (radians) is not known: near a pole.
const TILT_MAX: f64 = 1e-3;

pub(super) struct Tracer<'a> {
    pub(super) patch: &'a Patch,
    /// Bound of the rounding in coordinates.
    pub(super) coordinate_rounding: f64,
    /// Bound of the rounding in S_u and S_v.
    pub(super) derivative_rounding: f64,
    /// Bound of the rounding in F_u and F_v.
    pub(super) gradient_rounding: f64,
    pub(super) form: &'a FacingForm,
    pub(super) cusp_form: &'a CuspForm,
    pub(super) options: SilhouetteOptions,
    pub(super) stats: &'a mut SilhouetteStats,
}

impl Tracer<'_> {
    /// The arcs with vertices inserted, cusps among them, until chord error and turning are within the options.
    /// Pieces of arcs whose cusps are not decided are appended to `undecided`.
    pub(super) fn refined(&mut self, arcs: &[Arc], undecided: &mut Vec<Rect>) -> Path {
        let mut path = Path { nodes: Vec::new(), segments: Vec::new() };
        if let Some(first) = arcs.first() {
            path.nodes.push(self.node(first.start));
        }
        for arc in arcs {
            let bracket = if arc.axis == Variable::U { arc.cell.v } else { arc.cell.u };
            let segment = Segment { axis: arc.axis, bracket, rising: arc.rising };
            let Some(&start) = path.nodes.last() else { continue };
            let end = self.node(arc.end);
            let probe = |p: DVec2| {
                let Node { local, screen, blur, advance, .. } = self.node(p);
                Probe { local, screen, blur, advance }
            };
            let cusps = cusps_of(self.form, self.cusp_form, &segment, [start.local, end.local], &probe);
            undecided.extend(cusps.undecided);
            let mut from = start;
            for bracket in cusps.brackets {
                let [a, b] = bracket.map(|p| self.node(p));
                let cusp = self.cusp_between(&segment, a, b);
                if cusp.local == from.local || cusp.local == end.local {
                    continue;
                }
                self.refine(&mut path, segment, from, cusp, 0);
                from = cusp;
            }
            self.refine(&mut path, segment, from, end, 0);
        }
        let last = path.nodes.len().saturating_sub(1);
        for k in 1..last {
            // An advance of exactly 0 on a vertex between two arcs hides the change of sign.
            let (before, after) = (path.nodes[k - 1].advance, path.nodes[k + 1].advance);
            path.nodes[k].cusp |= path.nodes[k].advance == 0.0 && before * after < 0.0;
        }
        self.stats.vertices += path.nodes.len();
        self.stats.cusps += path.nodes.iter().filter(|n| n.cusp).count();
        path
    }

    /// Appends what lies after `a`, up to and with `b`; no cusp lies between them.
    fn refine(&mut self, path: &mut Path, segment: Segment, a: Node, b: Node, depth: u32) {
        let m = self.inserted(&segment, &a, &b);
        let turn = angle(a.normal, m.normal).max(angle(m.normal, b.normal));
        let fine = self.chord_error(&a, &m, &b) <= self.options.chord && turn <= self.options.normal_angle;
        if fine || depth >= MAX_HALVINGS || m.local == a.local || m.local == b.local {
            path.segments.push(segment);
            path.nodes.push(b);
        } else {
            self.refine(path, segment, a, m, depth + 1);
            self.refine(path, segment, m, b, depth + 1);
        }
    }

    /// Distance of the curve from the chord a b on the screen: of its point m, or what the directions of the curve at
    /// its ends make of it, which tells where the curve swings to both sides and meets the chord at m. The screen
    /// normal of a silhouette is that of the surface; a parabola that leaves its chord of length l at a slope s rises to
    /// s l / 4, a cubic that swings to both sides to less.
    fn chord_error(&self, a: &Node, m: &Node, b: &Node) -> f64 {
        let chord = b.screen - a.screen;
        let swing = |n: &Node| (n.normal.truncate().dot(chord) / 4.0).abs();
        distance_to_chord(m.screen, a.screen, b.screen).max(swing(a)).max(swing(b))
    }

    /// The cusp between two vertices at which the advance has opposite signs, by bisection to full precision.
    fn cusp_between(&mut self, segment: &Segment, a: Node, b: Node) -> Node {
        let (mut lo, mut hi) = (0.0, 1.0);
        let mut at = b;
        while at.advance != 0.0 && hi - lo > f64::EPSILON {
            let t = 0.5 * (lo + hi);
            at = self.node(bracketed(self.form, segment, a.local, b.local, t).0);
            if a.advance * at.advance > 0.0 {
                lo = t;
            } else {
                hi = t;
            }
        }
        Node { advance: 0.0, cusp: true, ..at }
    }

    /// A vertex between two others: the walk's, or that of the bracket where the walk leaves the arc.
    fn inserted(&mut self, segment: &Segment, a: &Node, b: &Node) -> Node {
        let (local, steps) = walk(self.form, self.patch, segment, a.local, b.local).unwrap_or_else(|| {
            self.stats.bracketed += 1;
            bracketed(self.form, segment, a.local, b.local, 0.5)
        });
        self.stats.walks += 1;
        self.stats.steps += steps;
        self.stats.steps_max = self.stats.steps_max.max(steps);
        self.node(local)
    }

    /// The tangent of F = 0 that has F > 0 on its left is (F_v, −F_u). Its image S_u F_v − S_v F_u projects to a
    /// multiple of the screen normal turned a right angle; the multiple is the advance.
    ///
    /// What is no larger than its own rounding counts as 0: an advance of either sign would make a cusp out of nothing
    /// wherever a silhouette ends in a pole, or in a point where it turns back exactly on the edge of the patch.
    fn node(&self, local: DVec2) -> Node {
        let jet = self.patch.jet(local.x, local.y);
        let [_, fu, fv] = self.form.gradient(local.x, local.y);
        let (lu, lv) = (jet.du.length(), jet.dv.length());
        let normal = jet.normal();
        // Derivatives are known to some roundings of the coordinates times the degree, a cross product accordingly.
        let tilt = self.derivative_rounding * (lu + lv) / normal.length();
        let normal = if tilt < TILT_MAX { normal.normalize_or_zero() } else { DVec3::ZERO };
        let tangent = jet.du * fv - jet.dv * fu;
        let rounding = tangent.length() * tilt
            + self.derivative_rounding * (fu.abs() + fv.abs())
            + self.gradient_rounding * (lu + lv);
        let advance = tangent.y * normal.x - tangent.x * normal.y;
        let advance = if advance.abs() > rounding { advance } else { 0.0 };
        // F = 0 moves by rounding over |∇F|, in the direction of ∇F.
        let across = (jet.du * fu + jet.dv * fv).truncate().length() / (fu * fu + fv * fv);
        let blur = 2.0 * self.coordinate_rounding + self.form.rounding * across;
        Node { local, screen: jet.p.truncate(), blur, normal, advance, cusp: false }
    }
}

/// Distance of `p` from the segment a b.
pub(super) fn distance_to_chord(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let squared = d.length_squared();
    let t = if squared > 0.0 { ((p - a).dot(d) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (p - (a + d * t)).length()
}

/// Angle between unit vectors; 0 where one of them is zero (unknown).
fn angle(a: DVec3, b: DVec3) -> f64 {
    if a == DVec3::ZERO || b == DVec3::ZERO {
        return 0.0;
    }
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Cuts a path at its cusps. A loop is first turned so that it begins at one.
pub(super) fn split_at_cusps(patch: usize, path: Path, ends: [CurveEnd; 2], out: &mut Vec<TracedCurve>) {
    let Path { mut nodes, mut segments } = path;
    let mut ends = ends;
    if let (CurveEnd::Closed, Some(true)) = (ends[0], nodes.last().map(|n| n.cusp)) {
        nodes[0].cusp = true;
    }
    let cusp = nodes.iter().position(|n| n.cusp);
    if let (CurveEnd::Closed, Some(k)) = (ends[0], cusp) {
        nodes.pop();
        nodes.rotate_left(k);
        segments.rotate_left(k);
        nodes.extend(nodes.first().copied());
        ends = [CurveEnd::Cusp; 2];
    }
    let mut first = 0;
    let last = nodes.len().saturating_sub(1);
    for k in 1..=last {
        if k < last && !nodes[k].cusp {
            continue;
        }
        let end = |at: usize, own: CurveEnd| if at == 0 || at == last { own } else { CurveEnd::Cusp };
        out.push(TracedCurve {
            patch,
            vertices: nodes[first..=k].iter().map(|n| n.local).collect(),
            segments: segments[first..k].to_vec(),
            ends: [end(first, ends[0]), end(k, ends[1])],
        });
        first = k;
    }
}

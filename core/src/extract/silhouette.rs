//! Silhouettes: the curves on which a surface turns away from the eye.
//!
//! On one patch they are the zero set of F ([`facing`](super::facing)), whose topology [`zero_set`] gives as arcs that
//! are graphs over one parameter. A [`TracedCurve`] keeps that: a point of it is found by walking, at a fixed value of
//! the arc's independent parameter, along the other one to F = 0 (Elber and Cohen 1989, §3, with Newton's method inside
//! a bracket for the secant), so every point asked for lies on the true silhouette, and none on a chord.
//!
//! Where the sight line is tangent to the silhouette itself its projection has a cusp (a curtain fold); the curve is
//! split there.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::facing::{Facing, FacingForm, LineForm, coordinate_rounding};
use super::zero_set::{Arc, Rect, Variable, ZeroEnd, zero_set};
use crate::view::Patch;

/// How finely silhouettes are divided into segments. Topology and position do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilhouetteOptions {
    /// Largest distance on the screen between a segment's middle and the curve, in view units.
    pub chord: f64,
    /// Largest angle between surface normals at the ends of a half segment, radians; on a silhouette that is how far
    /// the curve turns on the screen.
    pub normal_angle: f64,
}

/// How a traced curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveEnd {
    /// On an edge or corner of the patch: the vertex has a coordinate of exactly 0 or 1.
    Border,
    /// At a cusp of the projection, where the silhouette goes on as another curve (or as this one, for a loop with a
    /// single cusp).
    Cusp,
    /// At an undecided place.
    Undecided,
    /// At the first point, which is the last one too.
    Closed,
}

/// A piece of a curve between neighbouring vertices: a graph over one local parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The independent parameter.
    pub axis: Variable,
    /// Range of the other parameter, in which F has exactly one zero for each value of the independent one.
    pub bracket: [f64; 2],
    /// Whether F grows with the other parameter.
    pub rising: bool,
}

/// A silhouette curve on one patch, evaluated on F = 0 itself.
///
/// Its parameter t runs from 0 to the number of segments; the integer part names the segment, the fraction the
/// position between its two vertices along the independent parameter. The front-facing side lies on the left in the
/// plane of the local parameters.
///
/// A silhouette goes on in the neighbouring patch from where it meets a smooth edge. The two ends agree across the edge
/// to rounding, and along it to rounding divided by the angle at which the silhouette meets the edge.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedCurve {
    /// Index of the patch.
    pub patch: usize,
    /// Local parameters of the vertices, one more than segments.
    pub vertices: Vec<DVec2>,
    /// The segments.
    pub segments: Vec<Segment>,
    /// How the curve begins and ends.
    pub ends: [CurveEnd; 2],
}

/// A patch edge on which F vanishes identically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeFactor {
    /// Index of the patch.
    pub patch: usize,
    /// Edge: 0 is u = 0, 1 is u = 1, 2 is v = 0, 3 is v = 1.
    pub edge: usize,
    /// Multiplicity of the factor. Where it is odd F, continued over the edge, changes sign.
    pub multiplicity: u8,
    /// The edge is one point in space: no curve, but a limit of normals.
    pub collapsed: bool,
}

/// A place where the topology of a silhouette was not decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndecidedPlace {
    /// Index of the patch.
    pub patch: usize,
    /// Local parameters.
    pub place: Rect,
}

/// Counts of the extraction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SilhouetteStats {
    /// Patches whose zero set was sought.
    pub patches: usize,
    /// Cells looked at.
    pub cells: usize,
    /// Deepest subdivision.
    pub depth_max: u32,
    /// Connected pieces, before splitting at cusps.
    pub components: usize,
    /// Closed ones among them.
    pub loops: usize,
    /// Cusps of the projection.
    pub cusps: usize,
    /// Vertices.
    pub vertices: usize,
    /// Walks to F = 0.
    pub walks: usize,
    /// Steps of all walks together.
    pub steps: usize,
    /// Steps of the longest walk.
    pub steps_max: usize,
}

/// The silhouettes of some patches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Silhouettes {
    /// The curves, by patch.
    pub curves: Vec<TracedCurve>,
    /// Edges that are seen edge-on as a whole; whether such an edge is a silhouette depends on the neighbour.
    pub edges: Vec<EdgeFactor>,
    /// Places left undecided.
    pub undecided: Vec<UndecidedPlace>,
    /// Counts.
    pub stats: SilhouetteStats,
}

impl TracedCurve {
    /// Number of segments, at least 1.
    #[must_use]
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// Range of the parameter: 0 to the number of segments.
    #[must_use]
    pub fn param_range(&self) -> (f64, f64) {
        (0.0, self.segments.len() as f64)
    }

    /// Whether the curve is a loop without cusps.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.ends[0] == CurveEnd::Closed
    }

    /// Local parameters at `t` (clamped to the range): a vertex exactly where `t` is whole, else the zero of F to full
    /// precision. `form` is the form of the curve's patch. Some five evaluations of a univariate polynomial.
    #[must_use]
    pub fn local_at(&self, form: &FacingForm, t: f64) -> DVec2 {
        let t = t.clamp(0.0, self.segments.len() as f64);
        let k = (libm::floor(t) as usize).min(self.segments.len() - 1);
        let fraction = t - k as f64;
        let (a, b) = (self.vertices[k], self.vertices[k + 1]);
        if fraction == 0.0 {
            return a;
        }
        if fraction == 1.0 {
            return b;
        }
        walk(form, &self.segments[k], a, b, fraction).0
    }
}

/// Silhouettes of all patches; `forms` are their forms, index by index. Cost: linear in the number of mixed patches.
#[must_use]
pub fn silhouettes(patches: &[Patch], forms: &[FacingForm], options: SilhouetteOptions) -> Silhouettes {
    let mut out = Silhouettes::default();
    for (k, (patch, form)) in patches.iter().zip(forms).enumerate() {
        silhouettes_of(k, patch, form, options, &mut out);
    }
    out
}

/// Appends the silhouettes of one patch, number `index`, to `out`.
pub fn silhouettes_of(
    index: usize,
    patch: &Patch,
    form: &FacingForm,
    options: SilhouetteOptions,
    out: &mut Silhouettes,
) {
    for (edge, &multiplicity) in form.edge_factor.iter().enumerate() {
        if multiplicity > 0 {
            out.edges.push(EdgeFactor { patch: index, edge, multiplicity, collapsed: form.collapsed[edge] });
        }
    }
    let (Facing::Mixed, Some(polynomial)) = (form.facing, &form.polynomial) else { return };
    let zeros = zero_set(polynomial, form.rounding);
    out.stats.patches += 1;
    out.stats.cells += zeros.stats.cells;
    out.stats.depth_max = out.stats.depth_max.max(zeros.stats.depth_max);
    out.stats.components += zeros.stats.components;
    out.stats.loops += zeros.stats.loops;
    out.undecided.extend(zeros.undecided.iter().map(|&place| UndecidedPlace { patch: index, place }));
    let mut tracer = Tracer {
        patch,
        derivative_rounding: 2.0 * patch.degree_u.max(patch.degree_v) as f64 * coordinate_rounding(patch),
        gradient_rounding: 2.0 * polynomial.degree_u().max(polynomial.degree_v()) as f64 * form.rounding,
        form,
        options,
        stats: &mut out.stats,
    };
    for component in &zeros.components {
        let ends = match component.ends {
            None => [CurveEnd::Closed; 2],
            Some(ends) => ends.map(|e| match e {
                ZeroEnd::Border => CurveEnd::Border,
                ZeroEnd::Undecided => CurveEnd::Undecided,
            }),
        };
        let path = tracer.refined(&component.arcs);
        split_at_cusps(index, path, ends, &mut out.curves);
    }
}

/// The point of the silhouette a `fraction` of the way from `a` to `b` along the segment's independent parameter, and
/// the number of steps to it.
///
/// Newton's method from the chord, kept inside a bracket that every evaluation tightens; a step that leaves it, or that
/// does not halve the one before the last, is replaced by bisection. Ends where a step no longer changes the parameter.
fn walk(form: &FacingForm, segment: &Segment, a: DVec2, b: DVec2, fraction: f64) -> (DVec2, usize) {
    let guess = a + (b - a) * fraction;
    let Some(polynomial) = &form.polynomial else { return (guess, 0) };
    let (x, mut y) = match segment.axis {
        Variable::U => (guess.x, guess.y),
        Variable::V => (guess.y, guess.x),
    };
    let line = LineForm::new(polynomial, segment.axis == Variable::U, x);
    let [mut lo, mut hi] = segment.bracket;
    y = y.clamp(lo, hi);
    let (mut before, mut last) = (hi - lo, hi - lo);
    let mut steps = 0;
    // Bisection alone needs some 60 steps from a bracket of width 1 to one unit in the last place.
    while steps < 100 {
        steps += 1;
        let (f, slope) = line.eval(y);
        if f == 0.0 {
            break;
        }
        if (f > 0.0) == segment.rising {
            hi = y;
        } else {
            lo = y;
        }
        let newton = y - f / slope;
        let halves = (newton - y).abs() <= 0.5 * before;
        let next = if halves && newton >= lo && newton <= hi { newton } else { 0.5 * (lo + hi) };
        (before, last) = (last, (next - y).abs());
        // Half a unit in the last place of 1, the scale of a parameter.
        let settled = (next - y).abs() <= 0.5 * f64::EPSILON || hi - lo <= 0.5 * f64::EPSILON;
        y = next;
        if settled {
            break;
        }
    }
    (if segment.axis == Variable::U { DVec2::new(x, y) } else { DVec2::new(y, x) }, steps)
}

/// A vertex with what refinement asks of it.
#[derive(Clone, Copy)]
struct Node {
    local: DVec2,
    screen: DVec2,
    /// Unit normal of the surface; zero where it is not known (a pole).
    normal: DVec3,
    /// Advance of the screen point along the silhouette, by the normal turned a right angle; it changes sign at cusps
    /// and nowhere else. Zero where it is no larger than its rounding, and at a cusp.
    advance: f64,
    cusp: bool,
}

/// Vertices and the segments between them.
struct Path {
    nodes: Vec<Node>,
    segments: Vec<Segment>,
}

/// Halvings of an arc; the chord error falls by four with each, and by two or more at a point where it is singular.
const MAX_HALVINGS: u32 = 24;

/// A normal that rounding may tilt by more than this (radians) is not known: near a pole.
const TILT_MAX: f64 = 1e-3;

struct Tracer<'a> {
    patch: &'a Patch,
    /// Bound of the rounding in S_u and S_v.
    derivative_rounding: f64,
    /// Bound of the rounding in F_u and F_v.
    gradient_rounding: f64,
    form: &'a FacingForm,
    options: SilhouetteOptions,
    stats: &'a mut SilhouetteStats,
}

impl Tracer<'_> {
    /// The arcs with vertices inserted until chord error and turning are within the options.
    fn refined(&mut self, arcs: &[Arc]) -> Path {
        let mut path = Path { nodes: Vec::new(), segments: Vec::new() };
        if let Some(first) = arcs.first() {
            path.nodes.push(self.node(first.start));
        }
        for arc in arcs {
            let bracket = if arc.axis == Variable::U { arc.cell.v } else { arc.cell.u };
            let segment = Segment { axis: arc.axis, bracket, rising: arc.rising };
            let Some(&start) = path.nodes.last() else { continue };
            let end = self.node(arc.end);
            self.refine(&mut path, segment, start, end, 0);
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

    /// Appends what lies after `a`, up to and with `b`.
    fn refine(&mut self, path: &mut Path, segment: Segment, a: Node, b: Node, depth: u32) {
        let m = self.between(&segment, &a, &b, 0.5);
        let turned = a.advance * m.advance < 0.0 || m.advance * b.advance < 0.0 || a.advance * b.advance < 0.0;
        if turned && depth < MAX_HALVINGS {
            let (from, to) = if a.advance * m.advance < 0.0 || m.advance == 0.0 { (a, m) } else { (m, b) };
            let cusp = self.cusp_between(&segment, from, to);
            if cusp.local != a.local && cusp.local != b.local {
                self.refine(path, segment, a, cusp, depth + 1);
                self.refine(path, segment, cusp, b, depth + 1);
                return;
            }
            // A cusp on a vertex that is there already.
            if cusp.local == a.local {
                if let Some(last) = path.nodes.last_mut() {
                    *last = cusp;
                }
                return self.refine(path, segment, cusp, b, depth + 1);
            }
            return self.refine(path, segment, a, cusp, depth + 1);
        }
        let chord = distance_to_chord(m.screen, a.screen, b.screen);
        let turn = angle(a.normal, m.normal).max(angle(m.normal, b.normal));
        let fine = chord <= self.options.chord && turn <= self.options.normal_angle;
        if fine || depth >= MAX_HALVINGS || m.local == a.local || m.local == b.local {
            path.segments.push(segment);
            path.nodes.push(b);
        } else {
            self.refine(path, segment, a, m, depth + 1);
            self.refine(path, segment, m, b, depth + 1);
        }
    }

    /// The cusp between two vertices at which the advance has opposite signs (or is 0 at `b`), by bisection to full
    /// precision.
    fn cusp_between(&mut self, segment: &Segment, a: Node, b: Node) -> Node {
        let (mut lo, mut hi) = (0.0, 1.0);
        let mut at = b;
        while at.advance != 0.0 && hi - lo > f64::EPSILON {
            let t = 0.5 * (lo + hi);
            at = self.between(segment, &a, &b, t);
            if a.advance * at.advance > 0.0 {
                lo = t;
            } else {
                hi = t;
            }
        }
        Node { advance: 0.0, cusp: true, ..at }
    }

    fn between(&mut self, segment: &Segment, a: &Node, b: &Node, fraction: f64) -> Node {
        let (local, steps) = walk(self.form, segment, a.local, b.local, fraction);
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
        Node { local, screen: jet.p.truncate(), normal, advance, cusp: false }
    }
}

/// Distance of `p` from the segment a b.
fn distance_to_chord(p: DVec2, a: DVec2, b: DVec2) -> f64 {
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
fn split_at_cusps(patch: usize, path: Path, ends: [CurveEnd; 2], out: &mut Vec<TracedCurve>) {
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

#[cfg(test)]
mod tests;

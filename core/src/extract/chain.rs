//! Silhouettes as the eye follows them: chained over the borders of patches and surfaces.
//!
//! Extraction gives silhouettes patch by patch, split at cusps. A silhouette of the scene goes on where two such curves
//! end in one point and the surface is smooth there: at a cusp or a crossing inside a patch, over a knot line, over a
//! smooth edge of stitched surfaces (also of a closed surface with itself), through a corner where many patches meet,
//! and through a pole. It ends at a free boundary, at a crease, at the tip of a cone, and at an undecided place.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::curve::{Geometry, Path, SurfaceCurve};
use super::kind::CurveKind;
use super::silhouette::CurveEnd;
use crate::disjoint::Disjoint;
use crate::stitch::{EdgeClass, Stitching};

/// One curve of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainLink {
    /// Index of the curve.
    pub curve: usize,
    /// Whether the chain runs through it from its end to its beginning.
    pub reversed: bool,
}

/// A connected silhouette of the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SilhouetteChain {
    /// Its curves in order, at least one.
    pub links: Vec<ChainLink>,
    /// Whether it returns to where it began.
    pub closed: bool,
}

/// The silhouettes of the scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SilhouetteChains {
    /// The chains, in the order of their first curves.
    pub chains: Vec<SilhouetteChain>,
    /// Counts.
    pub stats: ChainStats,
}

/// Counts of the chains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChainStats {
    /// Connected silhouettes.
    pub components: usize,
    /// Closed ones among them.
    pub loops: usize,
    /// Joints at which the projection has a cusp, on the borders of patches too.
    pub cusps: usize,
}

/// Tolerances of chaining.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainOptions {
    /// Ends nearer than this can be one place; view-space units. As wide as what counts as one edge in stitching.
    pub gap: f64,
    /// Largest angle between the tangent planes of a smooth passage, radians; facets of a mesh have their own.
    pub angle: f64,
}

/// Chains the silhouettes among `curves`.
///
/// Two ends are joined if they lie within the gap, on surfaces that smooth edges connect, with one tangent plane. Where
/// more than two ends lie together (a crossing, a corner, a pole) those that go on straightest in space come first:
/// in space, because on the screen a silhouette turns back at its cusps. O(n log n) for n curves as long as few ends
/// share a place.
#[must_use]
pub fn silhouette_chains(
    g: &Geometry<'_>,
    stitching: &Stitching,
    curves: &[SurfaceCurve],
    options: ChainOptions,
) -> SilhouetteChains {
    let which: Vec<usize> = (0..curves.len()).filter(|&k| curves[k].kind == CurveKind::Silhouette).collect();
    let sheet = sheets(g, stitching);
    let mut ends = Vec::with_capacity(2 * which.len());
    for &k in &which {
        ends.extend([false, true].map(|last| End::new(g, &curves[k], &sheet, last)));
    }
    let mut pairs = pairs(g, &ends, options);
    pairs.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.ends.cmp(&b.ends)));
    let mut partner: Vec<Option<usize>> = vec![None; ends.len()];
    let mut cusps = 0;
    for p in pairs {
        let [a, b] = p.ends;
        if partner[a].is_none() && partner[b].is_none() {
            (partner[a], partner[b]) = (Some(b), Some(a));
            // Straight on in space and back on the screen; inside a patch the cusp is known for one.
            let turns_back = ends[a].on_screen.dot(ends[b].on_screen) > 0.0;
            cusps += usize::from(turns_back || ([a, b].iter().all(|&k| ends[k].kind == CurveEnd::Cusp)));
        }
    }
    let chains = follow(&ends, &partner, &which);
    let stats = ChainStats { components: chains.len(), loops: chains.iter().filter(|c| c.closed).count(), cusps };
    SilhouetteChains { chains, stats }
}

/// How far along its first or last segment the direction of a curve is taken where its derivative vanishes. A chord over
/// this fraction h of a segment that turns by no more than a radian is off by h radians at most.
const STEP: f64 = 1.0 / 1024.0;

/// A derivative this much shorter than what it is compared with is rounding: some thousand units of roundoff. A cusp
/// farther than this from an end leaves the end a direction on the screen.
const VANISHED: f64 = 1e-12;

/// How far inside a patch, in local parameters, its normal is taken where it vanishes on the border.
const INSIDE: f64 = 1.0 / 16384.0;

/// One end of a silhouette.
struct End {
    surface: usize,
    /// Connected by smooth edges: the same number.
    sheet: usize,
    patch: usize,
    local: DVec2,
    point: DVec3,
    /// Unit directions into the curve, in view space and on the screen.
    into: DVec3,
    on_screen: DVec2,
    /// Unit normal in model space.
    normal: Option<DVec3>,
    /// How the curve ends here; a line ends on the border of a patch.
    kind: CurveEnd,
    /// A point of the curve halfway to its other end.
    middle: DVec3,
    /// Edges of the patch (u = 0, u = 1, v = 0, v = 1) on which the end lies and which are not poles.
    edges: [bool; 4],
}

impl End {
    fn new(g: &Geometry<'_>, curve: &SurfaceCurve, sheet: &[usize], last: bool) -> Self {
        let [a, b] = curve.domain;
        let (t, inward) = if last { (b, -1.0) } else { (a, 1.0) };
        let (patch, local, step, kind) = match &curve.path {
            Path::Traced(c) => {
                let local = c.local_at(&g.forms[c.patch], t);
                (c.patch, local, 1.0, c.ends[usize::from(last)])
            }
            Path::Line(line) => {
                let spans = &line.spans;
                let k =
                    if last { spans.partition_point(|s| s.t[0] < t) } else { spans.partition_point(|s| s.t[0] <= t) };
                let span = &spans[k.saturating_sub(1)];
                (span.patch, g.view.patches()[span.patch].to_local(line.uv(t)), span.t[1] - span.t[0], CurveEnd::Border)
            }
            Path::Trim(line) => {
                let (patch, local) = line.place(g.view, t);
                (patch, local, 1.0, CurveEnd::Border)
            }
            Path::Section(c) => {
                let at = c.at(g.view.patches(), t, c.arc_at(t));
                (at.patches[0], at.local[0], 1.0, CurveEnd::Border)
            }
        };
        let (point, derivative) = if last { curve.jet_below(g, t) } else { curve.jet(g, t) };
        let derivative = derivative * inward;
        let chord = curve.point(g, t + inward * STEP * step.min(b - a)) - point;
        // The tangent, in space or on the screen, where it is known; else, at poles and cusps, the chord.
        let length = derivative.length();
        let known = length > VANISHED * chord.length() && length.is_finite();
        let on_screen = derivative.truncate();
        let seen = known && on_screen.length() > VANISHED * length;
        let on = [local.x == 0.0, local.x == 1.0, local.y == 0.0, local.y == 1.0];
        let collapsed = g.forms[patch].collapsed;
        Self {
            surface: curve.surface,
            sheet: sheet[curve.surface],
            patch,
            local,
            point,
            into: if known { derivative } else { chord }.normalize_or_zero(),
            on_screen: if seen { on_screen } else { chord.truncate() }.normalize_or_zero(),
            normal: model_normal(g, patch, local),
            kind,
            middle: curve.point(g, 0.5 * (a + b)),
            edges: [0, 1, 2, 3].map(|k| on[k] && !collapsed[k]),
        }
    }

    /// Whether a silhouette that arrives in one end may go on in the other, wherever they are: not from an edge back
    /// into the same patch over the same edge, unless both are the same zero on it.
    fn opens_into(&self, other: &Self) -> bool {
        let same_edge = self.patch == other.patch && (0..4).any(|k| self.edges[k] && other.edges[k]);
        let decided = self.kind != CurveEnd::Undecided && other.kind != CurveEnd::Undecided;
        decided && self.sheet == other.sheet && (!same_edge || self.local == other.local)
    }
}

/// Unit normal of a patch in model space; at a place where it vanishes, of a place just inside. `None` if that has none.
fn model_normal(g: &Geometry<'_>, patch: usize, local: DVec2) -> Option<DVec3> {
    let model = g.view.model_patch(patch);
    let at = |l: DVec2| {
        let jet = model.jet(l.x, l.y);
        let n = jet.normal();
        // A derivative shorter than INSIDE of the other is one that vanishes here, and its direction is rounding.
        let [long, short] = [jet.du.length().max(jet.dv.length()), jet.du.length().min(jet.dv.length())];
        (short > INSIDE * long && n.length() > INSIDE * short * long).then(|| n.normalize())
    };
    let inside = local + (DVec2::splat(0.5) - local) * (2.0 * INSIDE);
    at(local).or_else(|| model.jet(inside.x, inside.y).normal().try_normalize())
}

/// For every surface the number of the smooth sheet it belongs to: surfaces connected by smooth edges share one.
fn sheets(g: &Geometry<'_>, stitching: &Stitching) -> Vec<usize> {
    let count = g.view.surfaces().len();
    let mut sheet = Disjoint::new(count);
    for edge in stitching.edges.iter().filter(|e| e.class == EdgeClass::Smooth) {
        for &p in &edge.partners {
            sheet.join(stitching.sides[edge.side].path.surface(), stitching.sides[p].path.surface());
        }
    }
    (0..count).map(|k| sheet.root(k)).collect()
}

/// Two ends that may be joined, twice the index of the silhouette plus one for its last point.
struct Pair {
    ends: [usize; 2],
    /// One plus the cosine between the directions into the two curves (0: straight on, 2: back), plus the distance in
    /// gaps.
    cost: f64,
}

fn pairs(g: &Geometry<'_>, ends: &[End], options: ChainOptions) -> Vec<Pair> {
    // Cells twice the gap wide: whatever is within the gap lies in the same cell or one of its neighbours.
    let cell = (2.0 * options.gap).max(f64::MIN_POSITIVE);
    let key = |p: DVec3| [p.x, p.y, p.z].map(|x| libm::floor(x / cell) as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (k, end) in ends.iter().enumerate() {
        cells.entry(key(end.point)).or_default().push(k);
    }
    let cosine = |a: &End, b: &End| libm::cos(g.view.smooth_angle([a.surface, b.surface], options.angle));
    let mut out = Vec::new();
    for (a, ea) in ends.iter().enumerate() {
        let at = key(ea.point);
        for k in 0..27 {
            let near = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1];
            let near = [0, 1, 2].map(|d| at[d].saturating_add(near[d]));
            for &b in cells.get(&near).into_iter().flatten().filter(|&&b| b > a) {
                let eb = &ends[b];
                let distance = (ea.point - eb.point).length();
                let smooth = ea.normal.zip(eb.normal).is_some_and(|(n, m)| n.dot(m).abs() >= cosine(ea, eb));
                // A curve closes on itself if it leaves the gap in between, or begins and ends at one zero of F.
                let short = a / 2 == b / 2 && (ea.middle - ea.point).length() <= options.gap && ea.local != eb.local;
                if distance <= options.gap && smooth && !short && ea.opens_into(eb) {
                    let turn = 1.0 + ea.into.dot(eb.into);
                    out.push(Pair { ends: [a, b], cost: turn + distance / options.gap });
                }
            }
        }
    }
    out
}

/// Walks the joints into chains.
fn follow(ends: &[End], partner: &[Option<usize>], which: &[usize]) -> Vec<SilhouetteChain> {
    let mut used = vec![false; ends.len() / 2];
    let mut out = Vec::new();
    for first in 0..used.len() {
        if used[first] {
            continue;
        }
        // Back to where the chain begins, or once round a closed one.
        let mut enter = 2 * first;
        while let Some(before) = partner[enter] {
            enter = before ^ 1;
            if enter / 2 == first {
                break;
            }
        }
        let closed = partner[enter].is_some();
        let mut links = Vec::new();
        loop {
            used[enter / 2] = true;
            links.push(ChainLink { curve: which[enter / 2], reversed: enter % 2 == 1 });
            match partner[enter ^ 1] {
                Some(next) if !used[next / 2] => enter = next,
                _ => break,
            }
        }
        out.push(SilhouetteChain { links, closed });
    }
    out
}

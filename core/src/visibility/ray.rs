//! Point queries: the sheets that one sight line meets.

use alloc::vec::Vec;
use core::cmp::Ordering;

use glam::{DVec2, DVec3};

use super::coverage::{SAME_DIRECTION, Sector, coverage};
use super::hierarchy::{Leaf, Occluder, Occluders};
use super::leaf::{Axis, Enclosure, Equations, Root, Solution, Strip, Window, solve};
use super::nets::Nets;
use super::pole::{Fan, Pole, pole_fan};
use crate::trim::{Cover, Nearby, Trims};

/// Halvings of a patch's parameter after which a cell is left undecided: 2⁻²⁶ is where the square of a cell's width, its
/// extent across a fold on the screen, drowns in rounding.
const LIMIT: u8 = 26;

/// The same across a collapsed side: round a pole cells are as small as their distance from it, which ends at the width
/// of a border.
const POLE_LIMIT: u8 = 40;

/// Halvings towards a pole that is seen edge-on, after which the fold that ends there is not followed any closer: 2⁻⁴⁰, the
/// square, is the extent of the cell across the fold.
const FOLDED_POLE_LIMIT: u8 = 20;

/// What an undecided cell takes off the budget: a sight line that meets dozens of them will not be clear.
const UNDECIDED_COST: u32 = 32;

/// Cells that one sight line may examine below the prepared ones. A double root takes some two hundred.
const BUDGET: u32 = 4096;

/// Rounding error of a root, as part of its cell, from which on it counts as grazing.
const GRAZING: f64 = 1e-2;

/// A place on a surface that a query must not count: the point's own sheet, or the same place seen from a stitched
/// neighbour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exclusion {
    /// Index of the surface in the scene.
    pub surface: usize,
    /// Middle of the place, surface parameters.
    pub uv: DVec2,
    /// Half-widths of the place in u and in v, surface parameters. Where the place reaches a side that collapses to a
    /// point (a pole), it reaches all round it.
    pub radius: DVec2,
}

/// A sight line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the surface in the scene.
    pub surface: usize,
    /// Index of the patch, as handed to [`Occluders::new`].
    pub patch: usize,
    /// Surface parameters.
    pub uv: DVec2,
    /// Depth; nearer is larger.
    pub z: f64,
    /// Met at a fold: the sheet is so nearly edge-on that one root is not told from two.
    pub grazing: bool,
    /// On the border of the patch, to within [`Occluders::resolution`] on the screen.
    pub border: bool,
}

/// Why a count may be off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unclear {
    /// A sheet in front is met at a fold.
    Fold,
    /// An open border, or a crease at which the surface turns back, is met in front.
    Border,
    /// A sheet passes through the point itself, to within [`Occluders::resolution`].
    Contact,
    /// The sight line needed more cells than one is allowed.
    Limit,
}

/// How many sheets lie in front of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayAnswer {
    /// Sheets strictly in front. Where the answer is not clear, borders and folds that could not be decided count the
    /// least they may.
    pub qi: u32,
    /// Whether every point of the screen near the point has this count too, sheets through the point apart.
    pub clear: bool,
    /// The first reason for which the answer is not clear.
    pub reason: Option<Unclear>,
    /// Whether a sheet that is not excluded passes through the point.
    pub contact: bool,
}

impl RayAnswer {
    pub(super) fn doubt(&mut self, why: Unclear) {
        self.clear = false;
        self.reason.get_or_insert(why);
    }
}

/// What the queries through one scratch have cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayStats {
    /// Queries.
    pub rays: u64,
    /// Nodes of the hierarchy visited.
    pub nodes: u64,
    /// Cells visited.
    pub leaves: u64,
    /// Sheets counted by an enclosure of the root alone.
    pub enclosed: u64,
    /// Evaluations in Newton's method.
    pub newton: u64,
    /// Cells that had to be subdivided for the sight line.
    pub folds: u64,
    /// Halvings of cells.
    pub halvings: u64,
    /// Cells left undecided at the limit of subdivision.
    pub undecided: u64,
}

/// Buffers of the queries of one thread. Once warm, a query allocates nothing.
#[derive(Clone, Debug)]
pub struct RayScratch {
    /// What the queries have cost; reset it at will.
    pub stats: RayStats,
    equations: Equations,
    nets: Nets,
    windows: Vec<Window>,
    excluded: Vec<[DVec2; 2]>,
    crossings: Vec<Crossing>,
    border: Vec<Crossing>,
    sectors: Vec<Sector>,
    events: Vec<f64>,
    hits: Vec<Hit>,
    budget: u32,
}

impl RayScratch {
    /// Empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self {
            stats: RayStats::default(),
            equations: Equations::EMPTY,
            nets: Nets::default(),
            windows: Vec::new(),
            excluded: Vec::new(),
            crossings: Vec::new(),
            border: Vec::new(),
            sectors: Vec::new(),
            events: Vec::new(),
            hits: Vec::new(),
            budget: 0,
        }
    }
}

impl Default for RayScratch {
    fn default() -> Self {
        Self::new()
    }
}

/// A hit with what is needed to count it.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    hit: Hit,
    /// Local parameters of the patch, and how far away the same root may be found from a sibling cell.
    at: DVec2,
    merge: DVec2,
    /// A root on a collapsed side stands for a whole sector and is never a duplicate.
    pole: bool,
    /// Sign of the Jacobian.
    positive: bool,
    /// What it covers of the screen round the sight line, for a hit on a border.
    sector: Option<Sector>,
    /// Slope of the sheet, |∇z| on the screen.
    slope: f64,
}

/// One sight line.
#[derive(Clone, Copy)]
struct Ray<'a> {
    q: DVec2,
    /// Depth behind which nothing matters.
    floor: f64,
    /// Depth in front of which a root need not be known.
    ceiling: f64,
    exclude: &'a [Exclusion],
}

impl Occluders<'_> {
    /// Counts the sheets strictly in front of `p` (view space), the places in `exclude` left out.
    ///
    /// A sight line through the borders of patches counts one sheet where the patches continue one another, whichever
    /// surfaces they belong to. Each count is certified by coefficient bounds; where no certificate can be had (a fold,
    /// an open border or a contact exactly on the sight line) the answer says so.
    #[must_use]
    pub fn query(&self, p: DVec3, exclude: &[Exclusion], scratch: &mut RayScratch) -> RayAnswer {
        let contact = self.tolerances.contact;
        let ray = Ray { q: p.truncate(), floor: p.z - contact, ceiling: p.z + contact, exclude };
        let enclosed = self.collect(&ray, scratch);
        let mut answer = RayAnswer { qi: enclosed, clear: true, reason: None, contact: false };
        if scratch.budget == 0 {
            answer.doubt(Unclear::Limit);
        }
        scratch.border.clear();
        for c in &scratch.crossings {
            let tolerance = contact + 8.0 * self.tolerances.rounding * c.slope;
            let above = c.hit.z - p.z;
            if above < -tolerance {
                continue;
            }
            if c.hit.grazing {
                answer.doubt(Unclear::Fold);
            } else if above <= tolerance {
                answer.contact = true;
                answer.doubt(Unclear::Contact);
            } else if c.sector.is_some() {
                scratch.border.push(*c);
            } else {
                answer.qi += 1;
            }
        }
        let front = |c: &&Crossing| c.hit.z > ray.ceiling;
        let mut rest = &scratch.crossings[..];
        while let Some((a, others)) = rest.split_first() {
            if front(&a) && others.iter().filter(front).any(|b| self.folded(a, b, &mut scratch.events)) {
                answer.doubt(Unclear::Fold);
            }
            rest = others;
        }
        scratch.border.sort_unstable_by(nearest_first);
        let mut rest = &scratch.border[..];
        while !rest.is_empty() {
            let linked = |w: &[Crossing]| {
                let blur = self.tolerances.border * (w[0].slope + w[1].slope);
                w[0].hit.z - w[1].hit.z <= contact + blur
            };
            let n = 1 + rest.windows(2).take_while(|w| linked(w)).count();
            let (group, others) = rest.split_at(n);
            scratch.sectors.clear();
            scratch.sectors.extend(group.iter().filter_map(|c| c.sector));
            let (low, high) = coverage(&scratch.sectors, SAME_DIRECTION, &mut scratch.events);
            answer.qi += low;
            if low != high {
                answer.doubt(Unclear::Border);
            }
            rest = others;
        }
        answer
    }

    /// Whether two crossings are the two sides of a fold that is no farther than the width of a border on the screen.
    ///
    /// At the distance d from a fold of radius of curvature ρ the sheets lie √(2ρd) in front of and behind the fold and
    /// have the slope √(ρ/2d), so that the difference of their depths is 4d times their slope.
    fn folded(&self, a: &Crossing, b: &Crossing, events: &mut Vec<f64>) -> bool {
        let sides = a.hit.surface == b.hit.surface && a.positive != b.positive && !(a.pole || b.pole);
        let close = (a.hit.z - b.hit.z).abs() <= 2.0 * self.tolerances.border * (a.slope + b.slope);
        // Two patches on either side of a border, one with its parameters reversed, are not a fold.
        let overlap = match (a.sector, b.sector) {
            (Some(a), Some(b)) => coverage(&[a, b], SAME_DIRECTION, events).1 > 1,
            _ => true,
        };
        sides && close && overlap
    }

    /// All hits of the sight line through the screen point `q`, nearest first. A border shared by several patches gives
    /// a hit for each.
    pub fn hits<'s>(&self, q: DVec2, scratch: &'s mut RayScratch) -> &'s [Hit] {
        let ray = Ray { q, floor: f64::NEG_INFINITY, ceiling: f64::INFINITY, exclude: &[] };
        self.collect(&ray, scratch);
        scratch.crossings.sort_unstable_by(nearest_first);
        scratch.hits.clear();
        scratch.hits.extend(scratch.crossings.iter().map(|c| c.hit));
        &scratch.hits
    }

    /// Leaves in `scratch.crossings` what has to be looked at, and returns the number of sheets counted on the way.
    /// `scratch.budget` is 0 if not all cells could be examined.
    fn collect(&self, ray: &Ray<'_>, scratch: &mut RayScratch) -> u32 {
        scratch.stats.rays += 1;
        scratch.crossings.clear();
        scratch.budget = BUDGET;
        let mut enclosed = 0;
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            scratch.stats.nodes += 1;
            let inside = ray.q.cmpge(node.box_min).all() && ray.q.cmple(node.box_max).all();
            if !(inside && node.nearest >= ray.floor) {
                at = node.next as usize;
                continue;
            }
            for leaf in &self.leaves[node.leaves[0] as usize..node.leaves[1] as usize] {
                let border = DVec2::splat(self.tolerances.border);
                let inside = (ray.q + border).cmpge(leaf.box_min).all() && (ray.q - border).cmple(leaf.box_max).all();
                if inside && leaf.depth[1] >= ray.floor {
                    scratch.stats.leaves += 1;
                    enclosed += u32::from(self.visit(leaf, ray, scratch));
                }
            }
            at += 1;
        }
        scratch.stats.enclosed += u64::from(enclosed);
        merge(&mut scratch.crossings);
        enclosed
    }

    /// Looks for the roots in one leaf; true if it holds one that is nearer than the ceiling and need not be known.
    fn visit(&self, leaf: &Leaf, ray: &Ray<'_>, scratch: &mut RayScratch) -> bool {
        let (patch, net) = (self.patch_of(leaf), self.net(leaf));
        let window = leaf.window;
        if let Some(enclosure) = &leaf.regular {
            let estimate = enclosure.estimate(ray.q - leaf.centre());
            if enclosure.misses(estimate) {
                return false;
            }
            excluded(patch, ray.exclude, &mut scratch.excluded);
            let free = !scratch.excluded.iter().any(|[lo, hi]| meets(*lo, *hi, window));
            if free && !leaf.mixed && leaf.depth[0] > ray.ceiling && enclosure.surely_inside(estimate) {
                return true;
            }
            match solve(net, patch.degrees(), ray.q, enclosure, estimate, &mut scratch.stats.newton) {
                Solution::Root(root) => {
                    self.record(patch, Cell { window, mixed: leaf.mixed }, enclosure, ray, root, scratch);
                    return false;
                }
                Solution::Empty => return false,
                Solution::Undecided => {}
            }
        } else {
            excluded(patch, ray.exclude, &mut scratch.excluded);
        }
        scratch.stats.folds += 1;
        scratch.nets.start(net);
        scratch.windows.clear();
        scratch.windows.push(window);
        self.subdivide(patch, leaf.mixed, ray, scratch);
        false
    }

    /// Depth-first search of the roots in the cells on the stack of `scratch`.
    fn subdivide(&self, patch: Occluder<'_>, mixed: bool, ray: &Ray<'_>, scratch: &mut RayScratch) {
        while let Some(window) = scratch.windows.pop() {
            if scratch.budget == 0 {
                return;
            }
            scratch.budget -= 1;
            let cell = Cell { window, mixed };
            match self.examine(patch, cell, ray, scratch) {
                Verdict::Done => scratch.nets.pop(),
                Verdict::Halve(axis) => {
                    scratch.stats.halvings += 1;
                    let [lower, upper] = window.halves(axis);
                    scratch.windows.extend([lower, upper]);
                    scratch.nets.halve_top(patch.degrees(), axis);
                }
            }
        }
    }

    /// Decides one cell, whose net is on top, or says how to halve it.
    fn examine(&self, patch: Occluder<'_>, cell: Cell, ray: &Ray<'_>, scratch: &mut RayScratch) -> Verdict {
        let window = cell.window;
        let net = scratch.nets.top();
        let degrees = patch.degrees();
        let border = self.tolerances.border;
        if scratch.excluded.iter().any(|[lo, hi]| window.lo.cmpge(*lo).all() && window.hi.cmple(*hi).all())
            || net.iter().all(|h| h.z < ray.floor * h.w)
        {
            return Verdict::Done;
        }
        let equations = &mut scratch.equations;
        equations.set(net, degrees, ray.q);
        if equations.separated(&self.tolerances) || (cell.mixed && self.cover(patch, window) == Cover::Outside) {
            return Verdict::Done;
        }
        let mut limit = [LIMIT; 2];
        for (side, touches) in window.sides().into_iter().enumerate() {
            let Some(pole) = patch.poles()[side] else { continue };
            limit[side / 2] = POLE_LIMIT;
            if !touches {
                continue;
            }
            if (ray.q - pole.at).abs().max_element() > border {
                continue;
            }
            if let Some(verdict) = self.at_pole(patch, cell, side, &pole, scratch) {
                return verdict;
            }
        }
        let net = scratch.nets.top();
        let equations = &scratch.equations;
        if equations.vanish(&self.tolerances) {
            // Nothing on the screen tells the points of the cell apart any more.
            return self.give_up(patch, window, scratch);
        }
        let enclosure = equations.enclosure(net, DVec2::ZERO, &self.tolerances);
        if let Some(mut enclosure) = enclosure {
            if enclosure.misses(enclosure.middle) {
                return Verdict::Done;
            }
            enclosure.contraction = equations.contraction(net, DVec2::ZERO, enclosure.rows);
            if enclosure.is_regular() {
                match solve(net, degrees, ray.q, &enclosure, enclosure.middle, &mut scratch.stats.newton) {
                    Solution::Root(root) => {
                        self.record(patch, cell, &enclosure, ray, root, scratch);
                        return Verdict::Done;
                    }
                    Solution::Empty => return Verdict::Done,
                    Solution::Undecided => {}
                }
            }
        }
        let free = |axis: &Axis| window.depth[axis.index()] < limit[axis.index()];
        let next = match equations.strip(&self.tolerances) {
            Strip::Missed => return Verdict::Done,
            Strip::Line(axis) => Some(axis).filter(free),
            Strip::Wide => {
                let axis = equations.split_axis();
                [axis, axis.other()].into_iter().find(free)
            }
        };
        if let Some(axis) = next {
            return Verdict::Halve(axis);
        }
        self.give_up(patch, window, scratch)
    }

    /// Decides the cell at the pole on its side `side`, for a sight line through that pole; `None` if it is too large.
    fn at_pole(
        &self,
        patch: Occluder<'_>,
        Cell { window, mixed }: Cell,
        side: usize,
        pole: &Pole,
        scratch: &mut RayScratch,
    ) -> Option<Verdict> {
        let across = side / 2;
        match pole_fan(scratch.nets.top(), patch.degrees(), side, pole.at, self.tolerances.rounding) {
            Fan::Sector(sector) => {
                let mut at = 0.5 * (window.lo + window.hi);
                at[across] = (side % 2) as f64;
                if !holds(&scratch.excluded, at) {
                    let hit = Hit {
                        surface: patch.patch.surface,
                        patch: patch.index(),
                        uv: patch.to_surface(at),
                        z: pole.depth[1],
                        // A side along the sight line has no depth of its own, and trims may leave a part of the
                        // sector.
                        grazing: mixed || pole.depth[1] - pole.depth[0] > self.tolerances.contact,
                        border: true,
                    };
                    let (sector, merge) = (Some(sector), DVec2::ZERO);
                    scratch.crossings.push(Crossing { hit, at, merge, pole: true, positive: true, sector, slope: 0.0 });
                }
                Some(Verdict::Done)
            }
            Fan::Folded if window.depth[across] < FOLDED_POLE_LIMIT => {
                Some(Verdict::Halve(if across == 0 { Axis::U } else { Axis::V }))
            }
            Fan::Folded => Some(self.give_up(patch, window, scratch)),
            Fan::Wide => None,
        }
    }

    /// Leaves a cell undecided, unless it is part of what is excluded.
    fn give_up(&self, patch: Occluder<'_>, window: Window, scratch: &mut RayScratch) -> Verdict {
        if scratch.excluded.iter().any(|[lo, hi]| meets(*lo, *hi, window)) {
            return Verdict::Done;
        }
        let z = scratch.nets.top().iter().fold(f64::NEG_INFINITY, |z, h| z.max(h.z / h.w));
        let at = 0.5 * (window.lo + window.hi);
        let (surface, index) = (patch.patch.surface, patch.index());
        let hit = Hit { surface, patch: index, uv: patch.to_surface(at), z, grazing: true, border: false };
        let merge = window.hi - window.lo;
        scratch.crossings.push(Crossing { hit, at, merge, pole: false, positive: true, sector: None, slope: 0.0 });
        scratch.stats.undecided += 1;
        scratch.budget = scratch.budget.saturating_sub(UNDECIDED_COST);
        Verdict::Done
    }

    /// How the root at the local parameters `at`, known to within `room`, lies to the trims. `jet` holds the
    /// derivatives of the screen point by the parameters of the cell.
    fn trimmed_sector(
        &self,
        trims: &Trims,
        patch: Occluder<'_>,
        window: Window,
        [a, b]: [DVec2; 2],
        at: DVec2,
        room: DVec2,
    ) -> Beside {
        match trims.nearby(patch.to_surface(at - room), patch.to_surface(at + room)) {
            Nearby::None if trims.contains(patch.to_surface(at)) => Beside::Kept,
            Nearby::None => Beside::CutOff,
            Nearby::Several => Beside::Corner,
            Nearby::Edge { direction, left } => {
                let size = patch.patch.parameter_size() * (window.hi - window.lo);
                let d = direction / size;
                let along = a * d.x + b * d.y;
                // The map to the screen keeps left and right, or exchanges them.
                let kept_left = left == (a.perp_dot(b) > 0.0);
                Beside::Edge(Sector::left_of(if kept_left { along } else { -along }))
            }
        }
    }

    fn record(
        &self,
        patch: Occluder<'_>,
        Cell { window, mixed }: Cell,
        enclosure: &Enclosure,
        ray: &Ray<'_>,
        root: Root,
        scratch: &mut RayScratch,
    ) {
        let at = window.at(root.at);
        let inside = at.clamp(DVec2::ZERO, DVec2::ONE);
        if holds(&scratch.excluded, inside) {
            return;
        }
        let [h, hu, hv] = root.jet;
        let z = h.z / h.w;
        let a = (hu.truncate().truncate() - ray.q * hu.w) / h.w;
        let b = (hv.truncate().truncate() - ray.q * hv.w) / h.w;
        let det = a.perp_dot(b);
        let (zu, zv) = ((hu.z - z * hu.w) / h.w, (hv.z - z * hv.w) / h.w);
        let gradient = (DVec2::new(b.y, -b.x) * zu + DVec2::new(-a.y, a.x) * zv) / det;
        let margin = enclosure.margin.min(DVec2::splat(0.05));
        let near =
            [root.at.x <= margin.x, root.at.x >= 1.0 - margin.x, root.at.y <= margin.y, root.at.y >= 1.0 - margin.y];
        let sides = window.sides();
        let on = |k: usize| near[k] && sides[k] && patch.poles()[k].is_none();
        let inward = |low: bool, high: bool, d: DVec2| match (low, high) {
            (true, _) => Some(d),
            (_, true) => Some(-d),
            _ => None,
        };
        let sector = match (inward(on(0), on(1), a), inward(on(2), on(3), b)) {
            (None, None) => None,
            (Some(d), None) => Some(Sector::left_of(if b.perp_dot(d) > 0.0 { b } else { -b })),
            (None, Some(d)) => Some(Sector::left_of(if a.perp_dot(d) > 0.0 { a } else { -a })),
            (Some(d), Some(e)) => Some(Sector::between(d, e)),
        };
        let merge = 2.0 * margin * (window.hi - window.lo);
        let (trimmed, sector) = match self.trims_of(patch).filter(|_| mixed) {
            Some(trims) => match self.trimmed_sector(trims, patch, window, [a, b], inside, merge) {
                Beside::CutOff => return,
                Beside::Kept => (false, sector),
                // Two borders at once are left to another sight line.
                Beside::Edge(half) => (sector.is_some(), Some(half)),
                Beside::Corner => (true, sector),
            },
            None => (false, sector),
        };
        // A cell so narrow that both of its sides are the same border says nothing of either.
        let narrow = (on(0) && on(1)) || (on(2) && on(3));
        let hit = Hit {
            surface: patch.patch.surface,
            patch: patch.index(),
            uv: patch.to_surface(inside),
            z,
            grazing: narrow || trimmed || enclosure.noise.max_element() > GRAZING,
            border: sector.is_some(),
        };
        let slope = gradient.length();
        scratch.crossings.push(Crossing { hit, at, merge, pole: false, positive: det > 0.0, sector, slope });
    }
}

/// A cell of a patch that is searched, and whether a trim curve enters it or the leaf that it is part of.
#[derive(Clone, Copy)]
struct Cell {
    window: Window,
    mixed: bool,
}

/// How a root lies to the trims of its surface.
enum Beside {
    CutOff,
    Kept,
    /// On a trim curve, beside which the surface fills this half plane.
    Edge(Sector),
    /// On several trim curves.
    Corner,
}

/// What is to be done with a cell.
enum Verdict {
    Done,
    Halve(Axis),
}

/// The excluded rectangles in local parameters of the patch.
fn excluded(patch: Occluder<'_>, exclude: &[Exclusion], out: &mut Vec<[DVec2; 2]>) {
    out.clear();
    for e in exclude.iter().filter(|e| e.surface == patch.patch.surface) {
        let (a, b) = (patch.patch.to_local(e.uv - e.radius), patch.patch.to_local(e.uv + e.radius));
        let (lo, hi) = (a.min(b), a.max(b));
        out.push([lo, hi]);
        for (side, _) in patch.poles().iter().enumerate().filter(|(_, pole)| pole.is_some()) {
            let (across, value) = (side / 2, (side % 2) as f64);
            if lo[across] <= value && value <= hi[across] {
                // The collapsed side is one point: whoever excludes it excludes it all round.
                let (mut lo, mut hi) = (lo, hi);
                lo[1 - across] = f64::NEG_INFINITY;
                hi[1 - across] = f64::INFINITY;
                out.push([lo, hi]);
            }
        }
    }
}

/// Whether one of the rectangles holds the point.
fn holds(rectangles: &[[DVec2; 2]], at: DVec2) -> bool {
    rectangles.iter().any(|[lo, hi]| at.cmpge(*lo).all() && at.cmple(*hi).all())
}

/// Whether a rectangle and a window have a point in common.
fn meets(lo: DVec2, hi: DVec2, window: Window) -> bool {
    lo.cmple(window.hi).all() && hi.cmpge(window.lo).all()
}

/// Nearest first; ties by patch and place, so that the order does not depend on that of the visits.
fn nearest_first(a: &Crossing, b: &Crossing) -> Ordering {
    let by = |x: f64, y: f64| x.total_cmp(&y);
    by(b.hit.z, a.hit.z).then(a.hit.patch.cmp(&b.hit.patch)).then(by(a.at.x, b.at.x)).then(by(a.at.y, b.at.y))
}

/// Removes roots that were found from several cells of one patch.
fn merge(crossings: &mut Vec<Crossing>) {
    let mut kept = 0;
    for k in 0..crossings.len() {
        let c = crossings[k];
        let same = |o: &Crossing| {
            o.hit.patch == c.hit.patch
                && !(o.pole || c.pole)
                && (o.positive == c.positive || o.hit.grazing || c.hit.grazing)
                && (o.at - c.at).abs().cmple(o.merge + c.merge).all()
        };
        match crossings[..kept].iter().position(same) {
            Some(o) => crossings[o].hit.grazing |= c.hit.grazing,
            None => {
                crossings[kept] = c;
                kept += 1;
            }
        }
    }
    crossings.truncate(kept);
}

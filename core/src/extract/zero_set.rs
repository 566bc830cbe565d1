//! The zero set of a polynomial on the unit square: topology with a guarantee.
//!
//! The square is cut into cells until in each one the Bernstein coefficients prove that F has no zero, or that F_u or
//! F_v has none. Where F_v has one sign, every line u = const meets the zero set at most once: it is a graph v(u), and
//! how it passes through the cell follows from the zeros on the cell's four sides alone.
//!
//! ```text
//!        v1 +------o-------------o-+      F_v > 0. Walking along u, the graph is below the cell where
//!           |     /               \|      F(u, v0) > 0, above it where F(u, v1) < 0, and inside otherwise.
//!           |  __/                 |      It enters and leaves at zeros of the sides, here marked o; an
//!           o_/                    o      arc ends wherever it leaves.
//!        v0 +----------------------+
//!           u0                    u1
//! ```
//!
//! So no branch is missed, however small a loop, and none is guessed. Zeros are computed once for each cutting line,
//! over the whole square, and cells take those in their range: cells that share a side share its zeros, and arcs link
//! by identity. What the rounding of F hides is decided by its second derivatives where they can: a saddle is a
//! [`Crossing`] of two branches, an extremum an isolated point. The rest (a curve along which F touches 0 without
//! changing sign, a point where three branches meet) is listed as [`Undecided`].

mod crossing;

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use glam::DVec2;

use self::crossing::{Shape, shape};
use crate::bernstein::{Bivariate, Univariate};

/// Cells are not cut in the middle: models are symmetric, and their silhouettes love u = ½. A cut that follows a zero
/// line, or meets one in a cell corner, would decide nothing. The further ratios serve where the first one, by bad
/// luck, comes close to a zero on a side it meets.
const RATIOS: [f64; 4] = [0.4871, 0.5227, 0.4393, 0.5711];

/// Zeros nearer to a new cell corner than this fraction of the cell's width ask for another ratio.
const CLEARANCE: f64 = 1e-4;

/// Cuts until a cell is undecided: 26 in each direction, a width of 2⁻²⁶ = √(2⁻⁵²). Around a non-degenerate singular
/// point F is as small as its own rounding in a cell of that width, and smaller cells tell nothing more.
const MAX_DEPTH: u32 = 52;

/// A cell in which F stays below this many roundings is undecided. At a crossing of two branches the coefficients of
/// the neighbours' derivatives are about as large as F here, and must stand out of twice the rounding: with less room,
/// a row of cells along each branch would be undecided too.
const DROWNED: f64 = 16.0;

/// Cells looked at until the rest are undecided. Ordinary zero sets need some tens, one of bidegree (25, 25) with a
/// dozen loops one or two thousand; only where F vanishes along a curve without changing sign does the number double
/// with each halving of the width. Cells wait in a queue, so that the width is then the same along the whole curve.
const MAX_CELLS: usize = 1 << 13;

/// Arcs in one cell; more ask for a cut. A side of a cell has at most as many zeros as F has degree.
const MAX_ARCS: usize = 32;

/// Undecided cells up to this width and number are gathered into one place for each singular point. More or wider ones
/// line a curve, and keep their own places.
const GATHERED_WIDTH: f64 = 1.0 / 65536.0;
const GATHERED_CELLS: usize = 64;

/// One of the two variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// The first variable.
    U,
    /// The second variable.
    V,
}

/// A rectangle of the unit square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Range of u.
    pub u: [f64; 2],
    /// Range of v.
    pub v: [f64; 2],
}

impl Rect {
    /// The longer side.
    fn width(&self) -> f64 {
        (self.u[1] - self.u[0]).max(self.v[1] - self.v[0])
    }

    fn hull(&self, other: &Self) -> Self {
        let join = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self { u: join(self.u, other.u), v: join(self.v, other.v) }
    }

    /// Whether the point is inside or on a side.
    fn contains(&self, p: DVec2) -> bool {
        p.x >= self.u[0] && p.x <= self.u[1] && p.y >= self.v[0] && p.y <= self.v[1]
    }
}

/// A place where the topology is not decided: the zero set inside is unknown, arcs that reach it end in it.
pub type Undecided = Rect;

/// A piece of the zero set that is a graph over one variable within a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The independent variable: the arc has exactly one point for each of its values between the ends.
    pub axis: Variable,
    /// The cell; the arc stays inside, and on each line of constant independent variable between the arc's ends F has
    /// no other zero in it.
    pub cell: Rect,
    /// Whether F grows with the dependent variable.
    pub rising: bool,
    /// First point. From here to `end`, F > 0 lies on the left in the (u, v) plane.
    pub start: DVec2,
    /// Last point.
    pub end: DVec2,
}

/// How a component ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZeroEnd {
    /// On the border of the unit square.
    Border,
    /// On the rim of a [`Crossing`]'s place.
    Crossing,
    /// At an [`Undecided`] cell.
    Undecided,
}

/// A place at which two branches cross, or pass each other nearer than F's rounding can tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The saddle point of F.
    pub point: DVec2,
    /// Where F is hidden by its rounding; the arms end on its rim.
    pub place: Rect,
}

/// A connected piece of the zero set: arcs in order, each beginning at the point where the one before it ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// The arcs, at least one, all with F > 0 on their left.
    pub arcs: Vec<Arc>,
    /// How it begins and ends; `None` for a closed loop.
    pub ends: Option<[ZeroEnd; 2]>,
}

/// Counts of the search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ZeroSetStats {
    /// Cells looked at.
    pub cells: usize,
    /// Cuts between the square and the smallest cell.
    pub depth_max: u32,
    /// Connected pieces.
    pub components: usize,
    /// Closed ones among them.
    pub loops: usize,
    /// Crossings of two branches.
    pub crossings: usize,
    /// Isolated points, or loops smaller than what F's rounding hides.
    pub isolated: usize,
    /// Undecided places.
    pub undecided: usize,
}

/// The zero set of a polynomial on the unit square.
#[derive(Clone, Debug, PartialEq)]
pub struct ZeroSet {
    /// Connected pieces: first the open ones, then the loops.
    pub components: Vec<Component>,
    /// Crossings of two branches.
    pub crossings: Vec<Crossing>,
    /// Places left undecided.
    pub undecided: Vec<Undecided>,
    /// Counts.
    pub stats: ZeroSetStats,
}

/// The zero set of `f` on the unit square, as components of monotone arcs.
///
/// Isolated points where `f` touches zero on the border from inside or outside are not part of the answer; `f` must not
/// vanish on a whole border line (divide such factors out first). `rounding` bounds the rounding in the coefficients:
/// derivatives within it count as zero. Arc ends are zeros of `f` on cutting lines to the accuracy of
/// [`Univariate::roots`]. Cost: O(p q (p + q)) a cell and one univariate root search a cutting line.
#[must_use]
pub fn zero_set(f: &Bivariate, rounding: f64) -> ZeroSet {
    let (lo, hi) = f.bounds();
    let mut search = Search::new(f, rounding);
    if lo < 0.0 && hi > 0.0 {
        search.run();
    }
    search.chained()
}

/// A zero at which F changes sign along a cutting line.
#[derive(Clone, Copy)]
struct LineRoot {
    at: f64,
    vertex: usize,
}

/// The sign changes of F along one line of constant u or v.
struct Line {
    roots: Vec<LineRoot>,
    /// Sign of F before the first of them.
    first_positive: bool,
    /// Zeros in the two corners of the square that a border line ends in.
    corners: [Option<usize>; 2],
}

impl Line {
    /// Indices of the roots in [a, b].
    fn range(&self, a: f64, b: f64) -> (usize, usize) {
        (self.roots.partition_point(|r| r.at < a), self.roots.partition_point(|r| r.at <= b))
    }

    /// Sign of F between root k − 1 and root k.
    fn positive(&self, k: usize) -> bool {
        self.first_positive == k.is_multiple_of(2)
    }

    /// Whether a root is closer than `clearance` to `x`.
    fn near(&self, x: f64, clearance: f64) -> bool {
        let (a, b) = self.range(x - clearance, x + clearance);
        a < b
    }
}

/// The zeros on the sides of a cell do not fit a graph.
struct Contradiction;

struct Vertex {
    point: DVec2,
    border: bool,
    crossing: bool,
}

impl Vertex {
    /// Whether components end here.
    fn terminal(&self) -> bool {
        self.border || self.crossing
    }
}

struct Cell {
    f: Bivariate,
    rect: Rect,
    depth: u32,
    /// Lines u = u0, u = u1, v = v0, v = v1.
    sides: [usize; 4],
}

struct Link {
    arc: Arc,
    from: usize,
    to: usize,
}

struct Search<'a> {
    f: &'a Bivariate,
    rounding: f64,
    lines: Vec<Line>,
    /// Lines by constant variable and value (bits), so that neighbouring cells find the same one.
    index: BTreeMap<(bool, u64), usize>,
    vertices: Vec<Vertex>,
    corner: [[Option<usize>; 2]; 2],
    links: Vec<Link>,
    undecided: Vec<Undecided>,
    stats: ZeroSetStats,
}

impl<'a> Search<'a> {
    fn new(f: &'a Bivariate, rounding: f64) -> Self {
        let mut s = Self {
            f,
            rounding,
            lines: Vec::new(),
            index: BTreeMap::new(),
            vertices: Vec::new(),
            corner: [[None; 2]; 2],
            links: Vec::new(),
            undecided: Vec::new(),
            stats: ZeroSetStats::default(),
        };
        // A zero in a corner is decided by the coefficient there, once for both lines that meet in it.
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            if f.get(a * f.degree_u(), b * f.degree_v()) == 0.0 {
                s.corner[a][b] = Some(s.vertices.len());
                s.vertices.push(Vertex { point: DVec2::new(a as f64, b as f64), border: true, crossing: false });
            }
        }
        s
    }

    fn run(&mut self) {
        let sides = [(Variable::U, 0.0), (Variable::U, 1.0), (Variable::V, 0.0), (Variable::V, 1.0)]
            .map(|(a, x)| self.line(a, x));
        let mut queue = VecDeque::new();
        let rect = Rect { u: [0.0, 1.0], v: [0.0, 1.0] };
        queue.push_back(Cell { f: self.f.clone(), rect, depth: 0, sides });
        while let Some(cell) = queue.pop_front() {
            self.stats.cells += 1;
            self.stats.depth_max = self.stats.depth_max.max(cell.depth);
            if self.settle(&cell) {
                continue;
            }
            let exhausted = cell.depth >= MAX_DEPTH || self.stats.cells >= MAX_CELLS;
            if exhausted || cell.f.magnitude() <= DROWNED * self.rounding {
                self.undecided.push(cell.rect);
                continue;
            }
            let (a, b) = self.cut(cell);
            queue.push_back(a);
            queue.push_back(b);
        }
    }

    /// Decides a cell: true if it holds nothing or its arcs are recorded.
    fn settle(&mut self, cell: &Cell) -> bool {
        let (lo, hi) = cell.f.bounds();
        // Of one sign but for rounding: empty, unless a side says otherwise (which only rounding can do).
        if one_sign(lo, hi, self.rounding) && !self.any_side_root(cell) {
            return true;
        }
        let (by_u, by_v) = (slope(&cell.f, Variable::U, self.rounding), slope(&cell.f, Variable::V, self.rounding));
        // Prefer the flatter graph: the dependent variable is the one in which F changes faster.
        let weight = |s: &Option<f64>, w: [f64; 2]| s.map_or(0.0, |s| s.abs() / (w[1] - w[0]));
        let over_u = weight(&by_v, cell.rect.v) >= weight(&by_u, cell.rect.u);
        let order = if over_u {
            [(Variable::U, by_v), (Variable::V, by_u)]
        } else {
            [(Variable::V, by_u), (Variable::U, by_v)]
        };
        let rising = order.map(|(_, s)| s.map(|s| s > 0.0));
        (0..2).any(|k| rising[k].is_some_and(|r| self.trace(cell, order[k].0, r, rising[1 - k])))
    }

    fn any_side_root(&self, cell: &Cell) -> bool {
        (0..4).any(|k| {
            let along = if k < 2 { cell.rect.v } else { cell.rect.u };
            let (a, b) = self.lines[cell.sides[k]].range(along[0], along[1]);
            a < b
        })
    }

    /// Records the arcs of a cell in which the zero set is a graph over `axis`, F rising or falling with the other
    /// variable; `with_axis` says the same of `axis` itself, if it is known. False, and nothing recorded, if the zeros on
    /// the sides contradict that (which only rounding can do).
    fn trace(&mut self, cell: &Cell, axis: Variable, rising: bool, with_axis: Option<bool>) -> bool {
        let (x, y) = match axis {
            Variable::U => (cell.rect.u, cell.rect.v),
            Variable::V => (cell.rect.v, cell.rect.u),
        };
        let [first, last, low, high] = match axis {
            Variable::U => cell.sides,
            Variable::V => [cell.sides[2], cell.sides[3], cell.sides[0], cell.sides[1]],
        };
        let (low, high) = (&self.lines[low], &self.lines[high]);
        let (mut i, i_end) = low.range(x[0], x[1]);
        let (mut j, j_end) = high.range(x[0], x[1]);
        let mut open: Option<usize>;
        let mut pairs: heapless::Vec<(usize, usize), MAX_ARCS> = heapless::Vec::new();
        // Some(true) inside, Some(false) outside; None is F of the wrong sign on both sides.
        let inside = |i: usize, j: usize| match (low.positive(i) == rising, high.positive(j) == rising) {
            (false, true) => Some(true),
            (true, false) => None,
            _ => Some(false),
        };
        match inside(i, j) {
            None => return false,
            Some(state) => match self.end_root(first, y, state) {
                Ok(vertex) => open = vertex,
                Err(Contradiction) => return false,
            },
        }
        while i < i_end || j < j_end {
            let take_low = j >= j_end || (i < i_end && low.roots[i].at <= high.roots[j].at);
            let vertex = if take_low { low.roots[i].vertex } else { high.roots[j].vertex };
            if take_low {
                i += 1;
            } else {
                j += 1;
            }
            match (inside(i, j), open) {
                (Some(true), None) => open = Some(vertex),
                (Some(false), Some(start)) => {
                    if pairs.push((start, vertex)).is_err() {
                        return false;
                    }
                    open = None;
                }
                _ => return false,
            }
        }
        match self.end_root(last, y, open.is_some()) {
            Ok(Some(vertex)) => {
                if let Some(start) = open
                    && pairs.push((start, vertex)).is_err()
                {
                    return false;
                }
            }
            Ok(None) => {}
            Err(Contradiction) => return false,
        }
        // Along increasing u the side of larger v is on the left, along increasing v the side of smaller u.
        let forward = rising == (axis == Variable::U);
        for (a, b) in pairs {
            let (from, to) = if forward { (a, b) } else { (b, a) };
            let (start, end) = (self.vertices[from].point, self.vertices[to].point);
            // An arc that is a graph over both variables runs over the one of which it spans more: over the other one it
            // would be so steep that the steps between floating-point numbers show.
            let spans = (end - start).abs();
            let (steep, other) = match axis {
                Variable::U => (spans.y > spans.x, Variable::V),
                Variable::V => (spans.x > spans.y, Variable::U),
            };
            let (axis, rising) = match with_axis {
                Some(r) if steep => (other, r),
                _ => (axis, rising),
            };
            self.links.push(Link { arc: Arc { axis, cell: cell.rect, rising, start, end }, from, to });
        }
        true
    }

    /// The zero on the side at which a graph begins or ends, `y` the range of the side; none if the graph is not
    /// `inside` there. A corner of the square counts where nothing else does, and may be touched from outside.
    fn end_root(&self, line: usize, y: [f64; 2], inside: bool) -> Result<Option<usize>, Contradiction> {
        let line = &self.lines[line];
        let (a, b) = line.range(y[0], y[1]);
        let low = if y[0] == 0.0 { line.corners[0] } else { None };
        let high = if y[1] == 1.0 { line.corners[1] } else { None };
        match (inside, b - a, low, high) {
            (false, 0, _, _) => Ok(None),
            (true, 1, None, None) => Ok(Some(line.roots[a].vertex)),
            (true, 0, Some(c), None) | (true, 0, None, Some(c)) => Ok(Some(c)),
            _ => Err(Contradiction),
        }
    }

    /// Cuts the longer direction at the first ratio that keeps clear of the zeros it meets.
    fn cut(&mut self, cell: Cell) -> (Cell, Cell) {
        let Rect { u, v } = cell.rect;
        let cut_u = u[1] - u[0] >= v[1] - v[0];
        let (axis, along, across) = if cut_u { (Variable::U, u, v) } else { (Variable::V, v, u) };
        let met = if cut_u { [cell.sides[2], cell.sides[3]] } else { [cell.sides[0], cell.sides[1]] };
        let (width, height) = (along[1] - along[0], across[1] - across[0]);
        let mut chosen = None;
        for ratio in RATIOS {
            let x = along[0] + ratio * width;
            if met.iter().any(|&k| self.lines[k].near(x, CLEARANCE * width)) {
                continue;
            }
            let line = self.line(axis, x);
            let clear = !across.iter().any(|&y| y > 0.0 && y < 1.0 && self.lines[line].near(y, CLEARANCE * height));
            chosen = Some((ratio, x, line));
            if clear {
                break;
            }
        }
        let (ratio, x, line) = chosen.unwrap_or_else(|| {
            let x = along[0] + RATIOS[0] * width;
            (RATIOS[0], x, self.line(axis, x))
        });
        let (f, g) = if cut_u { cell.f.split_u(ratio) } else { cell.f.split_v(ratio) };
        let (mut a, mut b) = (cell.rect, cell.rect);
        let (mut sides_a, mut sides_b) = (cell.sides, cell.sides);
        if cut_u {
            (a.u[1], b.u[0], sides_a[1], sides_b[0]) = (x, x, line, line);
        } else {
            (a.v[1], b.v[0], sides_a[3], sides_b[2]) = (x, x, line, line);
        }
        let depth = cell.depth + 1;
        (Cell { f, rect: a, depth, sides: sides_a }, Cell { f: g, rect: b, depth, sides: sides_b })
    }

    /// The line on which `axis` has the value `x`, its sign changes computed at the first request.
    fn line(&mut self, axis: Variable, x: f64) -> usize {
        let key = (axis == Variable::V, x.to_bits());
        if let Some(&k) = self.index.get(&key) {
            return k;
        }
        let side = if x == 0.0 {
            Some(0)
        } else if x == 1.0 {
            Some(1)
        } else {
            None
        };
        let (p, corners) = match axis {
            Variable::U => (self.f.restricted_u(x), side.map_or([None; 2], |a: usize| self.corner[a])),
            Variable::V => (self.f.restricted_v(x), side.map_or([None; 2], |b: usize| self.corner.map(|c| c[b]))),
        };
        let (changes, first_positive) = sign_changes(&p, [corners[0].is_some(), corners[1].is_some()]);
        let mut roots = Vec::with_capacity(changes.len());
        for at in changes {
            let point = if axis == Variable::U { DVec2::new(x, at) } else { DVec2::new(at, x) };
            roots.push(LineRoot { at, vertex: self.vertices.len() });
            self.vertices.push(Vertex { point, border: side.is_some(), crossing: false });
        }
        let k = self.lines.len();
        self.lines.push(Line { roots, first_positive, corners });
        self.index.insert(key, k);
        k
    }

    /// Decides the undecided places where F has the shape of a saddle or an extremum. The arms of a crossing end on the
    /// rim of its place, inside which F is nought to rounding and has no slope to follow.
    fn crossings(&mut self) -> Vec<Crossing> {
        let mut found = Vec::new();
        for place in core::mem::take(&mut self.undecided) {
            let inside: Vec<bool> = self.vertices.iter().map(|v| place.contains(v.point)).collect();
            let count = |f: &dyn Fn(&Link) -> bool| self.links.iter().filter(|l| f(l)).count();
            let (coming, going) = (count(&|l| inside[l.to]), count(&|l| inside[l.from]));
            let on_border = [place.u, place.v].iter().any(|r| r[0] == 0.0 || r[1] == 1.0);
            // Around a saddle inside the square two arms come and two go; on its border some of them are outside.
            let arms = if on_border { coming <= 2 && going <= 2 } else { (coming, going) == (2, 2) };
            match shape(self.f, &place, self.rounding) {
                Shape::Saddle(point) if arms => {
                    for (vertex, _) in self.vertices.iter_mut().zip(&inside).filter(|(v, inside)| **inside && !v.border)
                    {
                        vertex.crossing = true;
                    }
                    found.push(Crossing { point, place });
                }
                Shape::Extremum if coming + going == 0 => self.stats.isolated += 1,
                _ => self.undecided.push(place),
            }
        }
        found
    }

    /// Links the arcs into components.
    fn chained(mut self) -> ZeroSet {
        self.undecided = gathered(self.undecided);
        // Scraps between the undecided cells of one place belong to what is unknown of it.
        let places = &self.undecided;
        self.links.retain(|l| !places.iter().any(|r| r.contains(l.arc.start) && r.contains(l.arc.end)));
        let crossings = self.crossings();
        let n = self.vertices.len();
        let mut out: Vec<Option<usize>> = Vec::new();
        out.resize(n, None);
        let mut entered = Vec::new();
        entered.resize(n, false);
        for (k, link) in self.links.iter().enumerate() {
            out[link.from] = Some(k);
            entered[link.to] = true;
        }
        let mut used = Vec::new();
        used.resize(self.links.len(), false);
        let mut components = Vec::new();
        // Open components begin at vertices that no arc enters, or on the border; what is left are loops.
        for closed in [false, true] {
            for k in 0..self.links.len() {
                let from = self.links[k].from;
                if used[k] || (!closed && entered[from] && !self.vertices[from].terminal()) {
                    continue;
                }
                let mut arcs = Vec::new();
                let mut next = Some(k);
                let mut last = from;
                while let Some(m) = next.filter(|&m| !used[m]) {
                    used[m] = true;
                    arcs.push(self.links[m].arc);
                    last = self.links[m].to;
                    next = if self.vertices[last].terminal() { None } else { out[last] };
                }
                let end = |v: usize| match self.vertices[v] {
                    Vertex { crossing: true, .. } => ZeroEnd::Crossing,
                    Vertex { border: true, .. } => ZeroEnd::Border,
                    _ => ZeroEnd::Undecided,
                };
                let ends = (last != from || self.vertices[from].terminal()).then(|| [end(from), end(last)]);
                components.push(Component { arcs, ends });
            }
        }
        self.stats.components = components.len();
        self.stats.loops = components.iter().filter(|c| c.ends.is_none()).count();
        self.stats.undecided = self.undecided.len();
        self.stats.crossings = crossings.len();
        ZeroSet { components, crossings, undecided: self.undecided, stats: self.stats }
    }
}

/// Narrow cells that lie together, within a cell's width, as one rectangle around them.
fn gathered(mut cells: Vec<Undecided>) -> Vec<Undecided> {
    if cells.len() > GATHERED_CELLS {
        return cells;
    }
    let mut k = 0;
    while k < cells.len() {
        let a = cells[k];
        let reach = a.width();
        let joined = cells.iter().enumerate().skip(k + 1).find_map(|(l, b)| {
            let hull = a.hull(b);
            let near = hull.width() <= 2.0 * (reach + b.width()) && hull.width() <= GATHERED_WIDTH;
            near.then_some((l, hull))
        });
        match joined {
            Some((l, hull)) => {
                cells[k] = hull;
                cells.swap_remove(l);
                // A larger rectangle may reach one that was left before.
                k = 0;
            }
            None => k += 1,
        }
    }
    cells
}

/// Mean derivative of `f` by `axis` (per width of the cell) if its coefficients have one sign, those within the
/// rounding of a difference left out; none if they have both, or all are rounding.
fn slope(f: &Bivariate, axis: Variable, rounding: f64) -> Option<f64> {
    let w = f.degree_v() + 1;
    let c = f.coefficients();
    let (mut lo, mut hi, mut sum, mut n) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0_usize);
    let mut put = |d: f64| {
        lo = lo.min(d);
        hi = hi.max(d);
        sum += d;
        n += 1;
    };
    match axis {
        Variable::U => c.iter().zip(&c[w..]).for_each(|(a, b)| put(b - a)),
        Variable::V => c.chunks_exact(w).for_each(|row| row.windows(2).for_each(|d| put(d[1] - d[0]))),
    }
    let zero = 2.0 * rounding;
    let degree = if axis == Variable::U { f.degree_u() } else { f.degree_v() };
    (n > 0 && one_sign(lo, hi, zero)).then(|| sum * degree as f64 / n as f64)
}

/// Whether coefficients between `lo` and `hi`, known to ± `zero`, have one sign: surely, or but for rounding where the
/// largest stands far enough out of it to show that the others are nought and not just small.
fn one_sign(lo: f64, hi: f64, zero: f64) -> bool {
    const FAR: f64 = 64.0;
    lo > zero || hi < -zero || (lo >= -zero && hi > FAR * zero) || (hi <= zero && lo < -FAR * zero)
}

/// Where `p` changes sign on [0, 1], in increasing order, and whether it is positive before the first change.
///
/// Zeros without a change of sign are left out: what remains alternates, so that whatever the roots' rounding, all
/// cells on a line read the same pattern. `corner` says which ends are zeros to be left alone. At the others the end
/// coefficient gives the sign, and a change between it and the first interior root, too close to see, lies on the end.
fn sign_changes(p: &Univariate, corner: [bool; 2]) -> (Vec<f64>, bool) {
    let roots = p.roots();
    let c = p.coefficients();
    let interior = || roots.iter().map(|r| r.t).filter(|&t| t > 0.0 && t < 1.0);
    let mut changes = Vec::new();
    let mut positive = None;
    let mut first_positive = false;
    let mut see = |value: f64, at: f64, changes: &mut Vec<f64>| {
        if value == 0.0 {
            return;
        }
        match positive {
            None => first_positive = value > 0.0,
            Some(last) if last != (value > 0.0) => changes.push(at),
            Some(_) => {}
        }
        positive = Some(value > 0.0);
    };
    if !corner[0] {
        see(c[0], 0.0, &mut changes);
    }
    let mut left = 0.0;
    for right in interior().chain(core::iter::once(1.0)) {
        see(p.eval(0.5 * (left + right)), left, &mut changes);
        left = right;
    }
    if !corner[1] {
        see(c[c.len() - 1], 1.0, &mut changes);
    }
    (changes, first_positive)
}

#[cfg(test)]
mod tests;

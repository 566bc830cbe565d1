//! Where curves pierce surfaces: there the sheet passes from behind a curve to in front of it without crossing it on
//! the screen.
//!
//! Curve and surface are subdivided together until they are apart, or flat and transversal, when Newton's method finds
//! the one point. A curve that runs in a surface, within the contact distance, does not pierce it: where a model has two
//! surfaces in one place neither is in front of the other.

use alloc::vec::Vec;

use glam::{DMat3, DVec3, DVec4};

use super::arc::Arc;
use super::{CurveArcs, PROBES};
use crate::grid::Grid;
use crate::view::{Patch, halve_net, net_box, net_extent, net_jet};

/// A piece of a patch in view space.
#[derive(Clone, Debug)]
struct Cell {
    degree: [usize; 2],
    points: Vec<DVec4>,
    lo: DVec3,
    hi: DVec3,
}

/// Where a cell comes from, and its box, rounded outward. Its control points are cut out of the patch again when a curve comes
/// near: there are far fewer such places than cells.
struct Place {
    /// Index of the patch.
    patch: u32,
    /// How often it was quartered, and of each time which quarter, two bits a time.
    quarters: (u8, u8),
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Place {
    fn new(patch: u32, quarters: (u8, u8), cell: &Cell) -> Self {
        Self {
            patch,
            quarters,
            lo: cell.lo.to_array().map(rounded_down),
            hi: (-cell.hi).to_array().map(|x| -rounded_down(x)),
        }
    }

    /// Lower and upper corner.
    fn corners(&self) -> (DVec3, DVec3) {
        (DVec3::from_array(self.lo.map(f64::from)), DVec3::from_array(self.hi.map(f64::from)))
    }
}

/// The next number of single precision that is not greater.
fn rounded_down(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// Where the curves of each surface are.
struct Reaches {
    /// Surfaces that have curves, with the box of all arcs of these.
    boxes: Vec<(usize, DVec3, DVec3)>,
    grid: Grid,
}

/// The box of all arcs of each surface.
pub(super) struct Boxes(Vec<(usize, DVec3, DVec3)>);

impl Boxes {
    /// Those of as many surfaces, without arcs yet.
    pub(super) fn new(surfaces: usize) -> Self {
        Self((0..surfaces).map(|s| (s, DVec3::INFINITY, DVec3::NEG_INFINITY)).collect())
    }

    /// Those of all surfaces that these curves lie on, `surfaces` in number.
    pub(super) fn of(arcs: CurveArcs<'_>, surfaces: usize) -> Self {
        let mut boxes = Self::new(surfaces);
        arcs.iter().for_each(|arc| boxes.add(arcs.curves[arc.curve].surface, &arc));
        boxes
    }

    /// Adds an arc of a curve on a surface.
    pub(super) fn add(&mut self, surface: usize, arc: &Arc) {
        let (_, lo, hi) = &mut self.0[surface];
        *lo = lo.min(arc.lo.extend(arc.z[0]));
        *hi = hi.max(arc.hi.extend(arc.z[1]));
    }
}

impl Reaches {
    fn new(Boxes(mut boxes): Boxes) -> Self {
        boxes.retain(|(_, lo, hi)| lo.cmple(*hi).all());
        let grid = Grid::new(boxes.iter().map(|(_, lo, hi)| (lo.truncate(), hi.truncate())));
        Self { boxes, grid }
    }

    /// Those of surfaces that are not among `joined`, as far as they may come near the box from `lo` to `hi`.
    fn beside(&self, joined: &[usize], (lo, hi): (DVec3, DVec3), near: &mut Vec<u32>) {
        self.grid.near(lo.truncate(), hi.truncate(), near);
        near.retain(|&k| joined.binary_search(&self.boxes[k as usize].0).is_err() && self.meets(k, (lo, hi)));
    }

    /// Whether the box `k` meets another one.
    fn meets(&self, k: u32, (lo, hi): (DVec3, DVec3)) -> bool {
        let (_, low, high) = self.boxes[k as usize];
        low.cmple(hi).all() && lo.cmple(high).all()
    }
}

/// The patches, cut into a few cells each, with a broad phase on the screen. Cells that no curve of a surface that is not joined to
/// theirs comes near, which no curve can pierce, are left out.
pub(super) struct Sheets<'a> {
    patches: &'a [&'a Patch],
    cells: Vec<Place>,
    grid: Grid,
    /// For every surface the surfaces joined to it along an edge, itself included, in increasing order.
    joined: Vec<Vec<usize>>,
    contact: f64,
}

/// Halvings of a patch in each direction for the broad phase: enough to tell most curves from most patches.
const CUTS: u8 = 2;

/// A cell smaller than this part of the scene is not cut: where patches are many, their own boxes tell them apart.
const SMALL: f64 = 1.0 / 32.0;

impl<'a> Sheets<'a> {
    /// `boxes` hold all arcs that may pierce, each as one of one of the surfaces that its curve lies on.
    pub(super) fn new(patches: &'a [&'a Patch], boxes: Boxes, joined: Vec<Vec<usize>>, contact: f64) -> Self {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let nets = patches.iter().map(|p| net_box(&p.points));
        let (lo, hi) = nets.fold(start, |(lo, hi), (low, high)| (lo.min(low), hi.max(high)));
        let small = SMALL * (hi - lo).length();
        let reaches = Reaches::new(boxes);
        let (mut cells, mut near) = (Vec::new(), Vec::new());
        for (patch, p) in (0..).zip(patches) {
            let whole = Cell::of(p);
            reaches.beside(&joined[p.surface], Place::new(patch, (0, 0), &whole).corners(), &mut near);
            if near.is_empty() {
                continue;
            }
            whole.cut((0, 0), small, &mut |quarters, c| {
                let place = Place::new(patch, quarters, &c);
                if near.iter().any(|&k| reaches.meets(k, place.corners())) {
                    cells.push(place);
                }
            });
        }
        cells.shrink_to_fit();
        let grid = Grid::new(cells.iter().map(|c| {
            let (lo, hi) = c.corners();
            (lo.truncate(), hi.truncate())
        }));
        Self { patches, cells, grid, joined, contact }
    }

    /// Parameters of `arc`'s curve at which the arc, part of a curve on `surfaces`, pierces another surface that is not
    /// joined to them. (At a join curve and neighbour meet in an end point of the curve only.)
    ///
    /// Returns the number of cells for which the subdivision came to no end.
    pub(super) fn piercings(&self, arc: &Arc, surfaces: &[usize], out: &mut Vec<f64>) -> u64 {
        let mut undecided = 0;
        let mut near = Vec::new();
        self.grid.near(arc.lo, arc.hi, &mut near);
        let (lo, hi) = (arc.lo.extend(arc.z[0]), arc.hi.extend(arc.z[1]));
        for k in near {
            let place = &self.cells[k as usize];
            let (low, high) = place.corners();
            if low.cmpgt(hi).any() || lo.cmpgt(high).any() {
                continue;
            }
            let patch = self.patches[place.patch as usize];
            if surfaces.iter().any(|&s| self.joined[s].binary_search(&patch.surface).is_ok()) {
                continue;
            }
            let cell = &Cell::of(patch).at(place.quarters);
            if runs_in(arc, cell, self.contact) {
                continue;
            }
            let mut search = Search { contact: self.contact, halvings: 0, found: out };
            search.meet(arc, cell, 0);
            undecided += u64::from(search.halvings >= MOST_HALVINGS);
        }
        undecided
    }
}

impl Cell {
    fn new(degree: [usize; 2], points: Vec<DVec4>) -> Self {
        let (lo, hi) = net_box(&points);
        Self { degree, points, lo, hi }
    }

    /// The halves in u (`axis` 0) or v (1).
    fn halves(&self, axis: usize) -> (Self, Self) {
        let (mut left, mut right) = (self.points.clone(), self.points.clone());
        halve_net(&mut left, &mut right, self.degree[0], self.degree[1], axis == 0);
        (Self::new(self.degree, left), Self::new(self.degree, right))
    }

    /// All of a patch.
    fn of(patch: &Patch) -> Self {
        Self::new([patch.degree_u, patch.degree_v], patch.points.clone())
    }

    /// Quarters the cell [`CUTS`] times, or until its parts are small, and hands out the parts with how they came about.
    fn cut(self, (times, which): (u8, u8), small: f64, out: &mut impl FnMut((u8, u8), Self)) {
        if times == CUTS || (self.hi - self.lo).length() <= small {
            out((times, which), self);
            return;
        }
        let (a, b) = self.halves(0);
        for (upper_u, half) in [(0, a), (1, b)] {
            let (c, d) = half.halves(1);
            for (upper_v, quarter) in [(0, c), (1, d)] {
                quarter.cut((times + 1, which << 2 | upper_u << 1 | upper_v), small, out);
            }
        }
    }

    /// The part of the whole cell that came about so.
    fn at(self, (times, which): (u8, u8)) -> Self {
        (0..times).rev().fold(self, |cell, k| {
            let quarter = which >> (2 * k);
            let (a, b) = cell.halves(0);
            let (c, d) = if quarter & 2 == 0 { a.halves(1) } else { b.halves(1) };
            if quarter & 1 == 0 { c } else { d }
        })
    }

    /// The direction in which the cell is longer.
    fn longer(&self) -> usize {
        let w = self.degree[1] + 1;
        let at = |i: usize, j: usize| {
            let h = self.points[i * w + j];
            h.truncate() / h.w
        };
        let (p, q) = (self.degree[0], self.degree[1]);
        let u = (at(p, 0) - at(0, 0)).length().max((at(p, q) - at(0, q)).length());
        let v = (at(0, q) - at(0, 0)).length().max((at(p, q) - at(p, 0)).length());
        usize::from(v > u)
    }

    /// Position and local derivatives.
    fn jet(&self, s: f64, t: f64) -> (DVec3, DVec3, DVec3) {
        let [h, hu, hv] = net_jet(&self.points, self.degree[0], self.degree[1], s, t);
        let p = h.truncate() / h.w;
        (p, (hu.truncate() - p * hu.w) / h.w, (hv.truncate() - p * hv.w) / h.w)
    }
}

/// Whether the part of the arc over the cell lies within `contact` of it, at all places that are compared: then it runs
/// in the surface. Without this test the search would halve both until they are flat to the contact distance.
fn runs_in(arc: &Arc, cell: &Cell, contact: f64) -> bool {
    let mut over = 0;
    for x in PROBES {
        match height(arc.jet(x).0, cell) {
            Some(h) if h <= contact => over += 1,
            Some(_) => return false,
            None => {}
        }
    }
    over >= 3
}

/// Distance of `p` from its foot on the cell, by Gauss–Newton from the middle; `None` if the foot is not inside.
fn height(p: DVec3, cell: &Cell) -> Option<f64> {
    let (mut s, mut t) = (0.5, 0.5);
    for _ in 0..12 {
        let (q, du, dv) = cell.jet(s, t);
        let (e, f, g) = (du.length_squared(), du.dot(dv), dv.length_squared());
        let det = e * g - f * f;
        if det.is_nan() || det <= 0.0 {
            return None;
        }
        let r = p - q;
        let (x, y) = (r.dot(du), r.dot(dv));
        let (ds, dt) = ((x * g - y * f) / det, (y * e - x * f) / det);
        (s, t) = (s + ds, t + dt);
        if !(-0.5..=1.5).contains(&s) || !(-0.5..=1.5).contains(&t) {
            return None;
        }
        if ds.abs().max(dt.abs()) <= 1e-12 {
            break;
        }
    }
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    inside.then(|| (p - cell.jet(s, t).0).length())
}

/// Levels of halving in all; 2⁻²⁷ in each of three parameters is below the resolution of any picture.
const MAX_DEPTH: u32 = 81;

/// Halvings of one pair of arc and cell at the most; a piercing needs some twenty.
const MOST_HALVINGS: u32 = 4096;

/// The intersection of one arc with one cell.
struct Search<'a> {
    contact: f64,
    halvings: u32,
    found: &'a mut Vec<f64>,
}

impl Search<'_> {
    fn meet(&mut self, arc: &Arc, cell: &Cell, depth: u32) {
        let contact = self.contact;
        let (lo, hi) = (arc.lo.extend(arc.z[0]), arc.hi.extend(arc.z[1]));
        if cell.lo.cmpgt(hi).any() || lo.cmpgt(cell.hi).any() {
            return;
        }
        let (p, du, dv) = cell.jet(0.5, 0.5);
        let normal = du.cross(dv).normalize_or_zero();
        let [c0, c1] = net_extent(&cell.points, p, normal);
        let [a0, a1] = net_extent(&arc.points, p, normal);
        let (arc_size, cell_size) = ((hi - lo).length(), (cell.hi - cell.lo).length());
        if normal != DVec3::ZERO {
            if a0 - arc.error > c1 || a1 + arc.error < c0 {
                return;
            }
            if a0 >= c0 - contact && a1 <= c1 + contact && c1 - c0 <= contact {
                // Within the contact distance all along. It may still go from one side to the other, at a small angle.
                let (from, to) = (arc.jet(0.0).0 - p, arc.jet(1.0).0 - p);
                if from.dot(normal) * to.dot(normal) < 0.0 {
                    self.found.extend(newton(arc, cell).map(|x| arc.param(x)));
                }
                return;
            }
            // Flat and transversal: the arc's tangents and the cell's normals then stay on their sides of a plane's and a
            // line's neighbourhood, so that there is one point at most.
            let (q, d) = arc.jet(0.5);
            let chord = d.normalize_or_zero();
            let rise = chord.dot(normal).abs();
            let bow = arc_bow(arc, q, chord);
            // What the cell is off its plane must be little to the arc as well, or Newton's first step leads far off it.
            let smaller = cell_size.min(arc_size);
            if c1 - c0 <= FLAT * rise * smaller && bow <= FLAT * rise * arc_size && rise > STEEP {
                if let Some(x) = newton(arc, cell) {
                    self.found.push(arc.param(x));
                }
                return;
            }
        }
        if (arc_size <= contact && cell_size <= contact) || depth >= MAX_DEPTH {
            // They touch, as at an end of the curve that lies on the surface, or cross within the contact distance.
            self.found.extend(newton(arc, cell).map(|x| arc.param(x)));
            return;
        }
        if self.halvings >= MOST_HALVINGS {
            return;
        }
        self.halvings += 1;
        if arc_size > cell_size {
            let (l, r) = arc.halves();
            self.meet(&l, cell, depth + 1);
            self.meet(&r, cell, depth + 1);
        } else {
            let (l, r) = cell.halves(cell.longer());
            self.meet(arc, &l, depth + 1);
            self.meet(arc, &r, depth + 1);
        }
    }
}

/// Largest height of a cell or an arc, relative to its size, at which it counts as flat against a rise of one.
const FLAT: f64 = 0.05;

/// Smallest sine of the angle between arc and cell at which Newton's method is tried.
const STEEP: f64 = 0.02;

/// Largest distance of the arc's control points from the line through `q` along `chord`.
fn arc_bow(arc: &Arc, q: DVec3, chord: DVec3) -> f64 {
    arc.points.iter().fold(0.0_f64, |m, h| m.max((h.truncate() / h.w - q).cross(chord).length()))
}

/// The Bézier parameter of the arc at which it meets the cell, if it does within both.
fn newton(arc: &Arc, cell: &Cell) -> Option<f64> {
    // Neighbouring arcs and cells share their ends to rounding; a point there is found from both sides.
    const END_SLACK: f64 = 1e-7;
    let mut x = DVec3::splat(0.5);
    for _ in 0..20 {
        let ((a, da), (p, du, dv)) = (arc.jet(x.x), cell.jet(x.y, x.z));
        let jacobian = DMat3::from_cols(da, -du, -dv);
        if jacobian.determinant() == 0.0 {
            return None;
        }
        let step = jacobian.inverse() * (p - a);
        x += step;
        if !x.is_finite() || x.abs().max_element() > 4.0 {
            return None;
        }
        if step.abs().max_element() <= 1e-12 {
            break;
        }
    }
    let inside = x.cmpge(DVec3::splat(-END_SLACK)).all() && x.cmple(DVec3::splat(1.0 + END_SLACK)).all();
    inside.then(|| x.x.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::arc::Control;
    use super::*;
    use alloc::vec;

    fn arc(points: &[[f64; 3]]) -> Arc {
        let points: Control = points.iter().map(|p| DVec4::new(p[0], p[1], p[2], 1.0)).collect();
        Arc::new(0, [0.0, 1.0], points, 0.0)
    }

    /// The saddle z = x y over the unit square.
    fn saddle() -> Cell {
        let points = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].map(|(x, y)| DVec4::new(x, y, x * y, 1.0));
        Cell::new([1, 1], points.to_vec())
    }

    /// The box of an arc of the first of two surfaces.
    fn boxes(arc: &Arc) -> Boxes {
        let mut boxes = Boxes::new(2);
        boxes.add(0, arc);
        boxes
    }

    fn at(arc: &Arc, cell: &Cell) -> Vec<f64> {
        let patch = Patch {
            surface: 1,
            degree_u: cell.degree[0],
            degree_v: cell.degree[1],
            points: cell.points.clone(),
            u: [0.0, 1.0],
            v: [0.0, 1.0],
        };
        let patches = [&patch];
        let sheets = Sheets::new(&patches, boxes(arc), vec![vec![0], vec![1]], 1e-6);
        let mut out = Vec::new();
        assert_eq!(sheets.piercings(arc, &[0], &mut out), 0);
        out.sort_by(f64::total_cmp);
        out.dedup_by(|a, b| (*a - *b).abs() < 1e-7);
        out
    }

    #[test]
    fn a_line_through_a_saddle_pierces_it_where_the_equation_says() {
        // On x = y = t the saddle has z = t²; the line z = 1 − t meets it at t = (√5 − 1) / 2.
        let t = at(&arc(&[[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]), &saddle());
        assert_eq!(t.len(), 1, "{t:?}");
        assert!((t[0] - 0.618_033_988_749_894_9).abs() < 1e-12);
    }

    #[test]
    fn a_parabola_pierces_twice() {
        // z = 2 (t − ½)² + 0.1 over x = t, y = ½ against z = t / 2: 2 t² − 2.5 t + 0.6 = 0.
        let t = at(&arc(&[[0.0, 0.5, 0.6], [0.5, 0.5, -0.4], [1.0, 0.5, 0.6]]), &saddle());
        let root = libm::sqrt(2.5 * 2.5 - 4.8);
        assert_eq!(t.len(), 2, "{t:?}");
        assert!((t[0] - (2.5 - root) / 4.0).abs() < 1e-12 && (t[1] - (2.5 + root) / 4.0).abs() < 1e-12);
    }

    #[test]
    fn cells_are_kept_only_where_a_curve_may_pierce_them() {
        let net = saddle().points;
        let patch = Patch { surface: 1, degree_u: 1, degree_v: 1, points: net, u: [0.0, 1.0], v: [0.0, 1.0] };
        let patches = [&patch];
        let kept = |x: f64, joined: Vec<Vec<usize>>| {
            let line = arc(&[[x, 0.1, -1.0], [x, 0.1, 1.0]]);
            Sheets::new(&patches, boxes(&line), joined, 1e-6).cells.len()
        };
        // Of four by four cells one is near, of whose sides none is at these places; or none at all.
        assert_eq!([0.1, 0.9, 1.1].map(|x| kept(x, vec![vec![0], vec![1]])), [1, 1, 0]);
        assert_eq!(kept(0.1, vec![vec![0, 1], vec![0, 1]]), 0, "a curve does not pierce what it is joined to");
    }

    #[test]
    fn a_ruling_lies_in_the_saddle_and_does_not_pierce_it() {
        assert!(at(&arc(&[[0.25, 0.0, 0.0], [0.25, 1.0, 0.25]]), &saddle()).is_empty());
    }

    #[test]
    fn a_line_at_a_small_angle_pierces_once() {
        // From below the ruling at x = ¼ to above it; the angle is a thousandth, and less than a contact from end to end.
        for rise in [0.3, 1e-2, 1e-3, 1e-4] {
            let t = at(&arc(&[[0.25, 0.1, 0.025 - 0.3 * rise], [0.25, 0.9, 0.225 + 0.5 * rise]]), &saddle());
            assert_eq!(t.len(), 1, "{rise}: {t:?}");
            assert!((t[0] - 0.375).abs() < 1e-6, "{rise}: {t:?}");
        }
    }

    /// A short arc through a large cell that is flat for its size, but not for that of the arc.
    #[test]
    fn a_short_arc_pierces_a_large_cell() {
        let bowl = [-1.0, 0.0, 1.0].iter().flat_map(|&x| [-1.0, 0.0, 1.0].map(|y| (x, y)));
        let height = |x: f64| if x == 0.0 { -0.02 } else { 0.02 };
        let points = bowl.map(|(x, y)| DVec4::new(x, y, height(x) + height(y), 1.0)).collect();
        let cell = Cell::new([2, 2], points);
        for (x, y) in [(0.9, 0.8), (-0.3, 0.55), (0.01, -0.02)] {
            // The bowl is z = 0.02 (x² + y²).
            let z = 0.02 * (x * x + y * y);
            let t = at(&arc(&[[x, y, z - 3e-4], [x, y, z + 5e-4]]), &cell);
            assert_eq!(t.len(), 1, "({x}, {y}): {t:?}");
            assert!((t[0] - 0.375).abs() < 1e-9, "({x}, {y}): {t:?}");
        }
    }

    #[test]
    fn a_line_beside_or_above_does_not_pierce() {
        assert!(at(&arc(&[[0.0, 0.0, 0.1], [1.0, 1.0, 1.1]]), &saddle()).is_empty());
        assert!(at(&arc(&[[1.1, 0.0, -1.0], [1.1, 1.0, 2.0]]), &saddle()).is_empty());
    }
}

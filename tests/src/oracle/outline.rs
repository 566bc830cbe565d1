//! Where surfaces end: trim curves, and the sides of parameter ranges, as chords whose ends are shared by all surfaces that
//! end there, so that these are joined whatever their parameters.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::scene::{Scene, SceneSurface};

use super::spline;

/// Borders nearer than this part of the scene's size are one: models come out of other programs with some six digits.
/// What is joined over a distance counts as an error of the triangles there.
const WELD: f64 = 3e-6;

/// A chord of a border.
pub(super) struct Chord {
    /// Parameters of its ends.
    pub(super) ends: [DVec2; 2],
    /// Its ends among the outline's points.
    pub(super) vertices: [u32; 2],
    /// Parameters of the border between the ends.
    pub(super) middle: DVec2,
}

/// The borders of all surfaces of a scene.
pub(super) struct Outline {
    /// In model space.
    pub(super) points: Vec<DVec3>,
    /// For each surface its chords; the surface is where the even-odd rule over all of them says inside.
    pub(super) chords: Vec<Vec<Chord>>,
}

impl Outline {
    /// Chords that keep within `sag` of the borders in model space, and do not reach over more than a surface's step in u
    /// or in v.
    pub(super) fn new(scene: &Scene, size: f64, sag: f64, steps: &[DVec2]) -> Self {
        let mut points = Points::new(size);
        let sides: Vec<Side<'_>> = scene.surfaces.iter().enumerate().flat_map(|(k, s)| Side::all(k, s)).collect();
        let mut nodes: Vec<Vec<Node>> = sides.iter().map(|s| s.breaks(&mut points)).collect();
        // What other surfaces have on this border comes first, so that nothing new is put beside it; and once more
        // when all have what they need.
        for (side, nodes) in sides.iter().zip(&mut nodes) {
            side.adopt(&points, nodes);
            side.fill(&mut points, nodes, sag, steps[side.surface]);
        }
        let mut chords: Vec<Vec<Chord>> = scene.surfaces.iter().map(|_| Vec::new()).collect();
        for (side, nodes) in sides.iter().zip(&mut nodes) {
            side.adopt(&points, nodes);
            chords[side.surface].extend(nodes.windows(2).map(|w| side.chord(w[0], w[1])));
        }
        Self { points: points.all, chords }
    }
}

/// A parameter of a side, and the point there.
type Node = (f64, u32);

/// A part of a border that runs one way in u and in v.
struct Side<'a> {
    surface: usize,
    of: &'a Surface,
    /// Homogeneous Bézier points (u·w, v·w, w).
    points: Vec<DVec3>,
}

impl<'a> Side<'a> {
    fn all(surface: usize, s: &'a SceneSurface) -> Vec<Self> {
        let of = &s.surface;
        let side = |points: Vec<DVec3>| Side { surface, of, points };
        if let Some(trims) = &s.trims {
            let pieces = trims.loops().iter().flat_map(|l| l.pieces());
            return pieces.map(|p| side(p.control_points().to_vec())).collect();
        }
        let ([u0, u1], [v0, v1]) = (of.domain_u(), of.domain_v());
        let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1), (u0, v0)].map(|(u, v)| DVec3::new(u, v, 1.0));
        corners.windows(2).map(|w| side(w.to_vec())).collect()
    }

    /// By de Casteljau's algorithm.
    fn uv(&self, t: f64) -> DVec2 {
        let mut row = self.points.clone();
        for r in (1..row.len()).rev() {
            for i in 0..r {
                row[i] = row[i].lerp(row[i + 1], t);
            }
        }
        row[0].truncate() / row[0].z
    }

    fn at(&self, t: f64) -> DVec3 {
        spline::point(self.of, self.uv(t))
    }

    /// The ends, and where the side passes a knot.
    fn breaks(&self, points: &mut Points) -> Vec<Node> {
        let mut ts = vec![0.0, 1.0];
        let (from, to) = (self.uv(0.0), self.uv(1.0));
        for (k, knots) in [self.of.knots_u(), self.of.knots_v()].into_iter().enumerate() {
            let (lo, hi) = (from[k].min(to[k]), from[k].max(to[k]));
            for &knot in knots.breaks().iter().filter(|&&x| lo < x && x < hi) {
                let (mut a, mut b) = (0.0, 1.0);
                for _ in 0..60 {
                    let m = 0.5 * (a + b);
                    if (self.uv(m)[k] < knot) == (from[k] < to[k]) { a = m } else { b = m }
                }
                ts.push(0.5 * (a + b));
            }
        }
        ts.sort_by(f64::total_cmp);
        ts.into_iter().map(|t| (t, points.add(self.at(t)))).collect()
    }

    /// Takes the points in that lie on this side.
    fn adopt(&self, points: &Points, nodes: &mut Vec<Node>) {
        const CHORDS: usize = 16;
        let ways: Vec<DVec3> = (0..=CHORDS).map(|k| self.at(k as f64 / CHORDS as f64)).collect();
        for (k, w) in ways.windows(2).enumerate() {
            let length = w[0].distance(w[1]);
            // A side that is one point has its ends only.
            if length <= points.weld {
                continue;
            }
            let margin = DVec3::splat(points.weld + 0.25 * length);
            for v in points.within(w[0].min(w[1]) - margin, w[0].max(w[1]) + margin) {
                let p = points.all[v as usize];
                let along = (p - w[0]).dot(w[1] - w[0]) / (length * length);
                let t = self.nearest(p, (k as f64 + along.clamp(0.0, 1.0)) / CHORDS as f64);
                let known = nodes.iter().any(|n| n.1 == v && (n.0 - t).abs() * CHORDS as f64 <= 0.5);
                if !known && 0.0 < t && t < 1.0 && self.at(t).distance(p) <= points.weld {
                    let place = nodes.partition_point(|n| n.0 < t);
                    nodes.insert(place, (t, v));
                }
            }
        }
    }

    /// The parameter near `t` at which the side is nearest to `p`: Gauss–Newton with differences for derivatives.
    fn nearest(&self, p: DVec3, mut t: f64) -> f64 {
        const STEP: f64 = 1e-6;
        for _ in 0..8 {
            let (a, b) = ((t - STEP).max(0.0), (t + STEP).min(1.0));
            let slope = (self.at(b) - self.at(a)) / (b - a);
            if slope == DVec3::ZERO {
                break;
            }
            t = (t + (p - self.at(t)).dot(slope) / slope.length_squared()).clamp(0.0, 1.0);
        }
        t
    }

    /// Halves the parts between neighbouring nodes until their chords are good.
    fn fill(&self, points: &mut Points, nodes: &mut Vec<Node>, sag: f64, step: DVec2) {
        const MOST: usize = 20_000;
        let mut k = 0;
        while k + 1 < nodes.len() {
            let ((a, _), (b, _)) = (nodes[k], nodes[k + 1]);
            let [p, q] = [a, b].map(|t| self.at(t));
            let at = |f: f64| self.at(a + f * (b - a));
            let off = [0.25, 0.5, 0.75].map(|f| off_line(p, q, at(f))).into_iter().fold(0.0, f64::max);
            let wide = (self.uv(b) - self.uv(a)).abs().cmpgt(step).any();
            let m = 0.5 * (a + b);
            if (off > sag || wide) && a < m && m < b && nodes.len() < MOST {
                let v = points.add(self.at(m));
                nodes.insert(k + 1, (m, v));
            } else {
                k += 1;
            }
        }
    }

    fn chord(&self, a: Node, b: Node) -> Chord {
        let ends = [a.0, b.0].map(|t| self.uv(t));
        Chord { ends, vertices: [a.1, b.1], middle: self.uv(0.5 * (a.0 + b.0)) }
    }
}

/// Distance of `p` from the line through `a` and `b`.
pub(super) fn off_line(a: DVec3, b: DVec3, p: DVec3) -> f64 {
    (p - a).reject_from_normalized((b - a).normalize_or_zero()).length()
}

/// Points in model space; those within the tolerance of one another are one.
struct Points {
    all: Vec<DVec3>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    width: f64,
    weld: f64,
}

impl Points {
    fn new(size: f64) -> Self {
        let tiny = f64::MIN_POSITIVE;
        Self { all: Vec::new(), cells: HashMap::new(), width: (size / 100.0).max(tiny), weld: WELD * size }
    }

    fn cell(&self, p: DVec3) -> [i64; 3] {
        (p / self.width).to_array().map(|x| x.floor() as i64)
    }

    fn within(&self, lo: DVec3, hi: DVec3) -> impl Iterator<Item = u32> + '_ {
        let (a, b) = (self.cell(lo), self.cell(hi));
        let cells =
            (a[0]..=b[0]).flat_map(move |x| (a[1]..=b[1]).flat_map(move |y| (a[2]..=b[2]).map(move |z| [x, y, z])));
        let inside = move |&v: &u32| {
            let p = self.all[v as usize];
            p.cmpge(lo).all() && p.cmple(hi).all()
        };
        cells.filter_map(|c| self.cells.get(&c)).flatten().copied().filter(inside)
    }

    fn add(&mut self, p: DVec3) -> u32 {
        let reach = DVec3::splat(self.weld);
        let distance = |v: u32| self.all[v as usize].distance(p);
        let near = self.within(p - reach, p + reach).filter(|&v| distance(v) <= self.weld);
        if let Some(known) = near.min_by(|&a, &b| distance(a).total_cmp(&distance(b))) {
            return known;
        }
        let v = self.all.len() as u32;
        self.all.push(p);
        self.cells.entry(self.cell(p)).or_default().push(v);
        v
    }
}

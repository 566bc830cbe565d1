//! Surfaces as triangles in view space, joined along equal edges.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use penvis_core::scene::Scene;

use super::grid::Grid;
use super::outline::off_line;
use super::sight::Sight;
use super::spline;
use super::trimmed::{Model, Sheet};

/// Vertices of surface boundaries nearer than this part of the scene's size are one.
const SAME_VERTEX: f64 = 1e-7;

/// A triangle whose height on the screen is below this part of its longest side is seen edge-on.
const EDGE_ON: f64 = 1e-9;

/// A piece of surface.
pub(super) struct Triangle {
    pub(super) corners: [u32; 3],
    /// Greatest distance of the surface from the triangle's sides, measured at their middles.
    pub(super) error: f64,
    /// Longest side in view space.
    pub(super) side: f64,
    /// Sine of the greatest angle that the surface's normal makes with the triangle's, as far as that is known of itself.
    turn: f64,
    pub(super) neighbours: [Option<u32>; 3],
    /// Number of the piece between neighbouring knots, of all surfaces.
    patch: u32,
}

/// An edge beyond which the number of sheets is another: free, or a fold on the screen.
pub(super) struct Transition {
    pub(super) ends: [DVec3; 2],
    pub(super) triangles: Vec<u32>,
    pub(super) error: f64,
    pub(super) side: f64,
}

/// Where the parameters of one surface are among the triangles.
enum Cells {
    /// Rectangles between lines of constant u and v.
    Rectangles {
        us: Vec<f64>,
        vs: Vec<f64>,
        /// Up to two triangles for each cell, v fastest; collapsed ones are left out.
        triangles: Vec<[Option<u32>; 2]>,
    },
    /// What trims keep.
    Kept {
        /// Parameters of the corners; collapsed triangles are among them.
        corners: Vec<[DVec2; 3]>,
        triangles: Vec<Option<u32>>,
        /// Of the corners, and what the surface may reach beyond them.
        grid: Grid,
    },
}

/// All surfaces as triangles in view space.
pub(super) struct Mesh {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) transitions: Vec<Transition>,
    /// Diagonal of the box of all vertices.
    pub(super) size: f64,
    /// Of each surface the first triangle.
    firsts: Vec<u32>,
    cells: Vec<Cells>,
}

impl Mesh {
    /// Cuts every knot interval of every surface into `parts` in both directions.
    pub(super) fn new(scene: &Scene, sight: &Sight, parts: usize) -> Self {
        let mut build = Build::new(scene);
        let mut cells = Vec::with_capacity(scene.surfaces.len());
        for s in &scene.surfaces {
            build.begin();
            let (ku, kv) = (s.surface.knots_u(), s.surface.knots_v());
            let us = spline::subdivided(ku.as_slice(), ku.degree(), 2 * parts);
            let vs = spline::subdivided(kv.as_slice(), kv.degree(), 2 * parts);
            let points = spline::points(&s.surface, &us, &vs);
            let triangles = build.surface(&points, [us.len(), vs.len()], parts, sight);
            let coarse = |all: Vec<f64>| all.into_iter().step_by(2).collect();
            cells.push(Cells::Rectangles { us: coarse(us), vs: coarse(vs), triangles });
        }
        build.mesh(cells)
    }

    /// The triangles of a model, seen.
    pub(super) fn seen(model: &Model, sight: &Sight) -> Self {
        let mut build = Build::seen(model.vertices.iter().map(|&p| sight.project(p)).collect());
        let cells = model.sheets.iter().map(|s| {
            build.begin();
            build.sheet(s, sight)
        });
        let cells = cells.collect();
        build.mesh(cells)
    }

    /// The surface that a triangle is of.
    pub(super) fn surface(&self, triangle: u32) -> usize {
        self.firsts.partition_point(|&first| first <= triangle) - 1
    }

    pub(super) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].corners.map(|v| self.vertices[v as usize])
    }

    /// Whether the triangle is farther from being seen edge-on than its normal differs from its neighbours': then the
    /// surface does not turn away from the eye between its corners, and come back, unseen. Neighbours across a knot,
    /// where a surface may have a corner, do not count. Of what trims keep, a triangle at a border has no neighbour on the side
    /// where the surface may turn most, and tells that by itself.
    pub(super) fn faces_surely(&self, triangle: u32) -> bool {
        let t = &self.triangles[triangle as usize];
        let normal = self.normal(triangle);
        let smooth = t.neighbours.iter().flatten().filter(|&&n| self.triangles[n as usize].patch == t.patch);
        let turn = smooth.map(|&n| normal.cross(self.normal(n)).length()).fold(t.turn, f64::max);
        normal.z.abs() > turn
    }

    /// Unit normal in view space, on the side of u × v; zero if the corners lie on a line.
    fn normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The triangles of the cell that holds the parameters (u, v) of a surface, and of its neighbours where the
    /// parameters lie on the border between cells.
    pub(super) fn at(&self, surface: usize, u: f64, v: f64) -> Vec<u32> {
        match &self.cells[surface] {
            Cells::Rectangles { us, vs, triangles } => {
                let rows = vs.len() - 1;
                let (is, js) = (holding(us, u), holding(vs, v));
                let cells = is.flat_map(|i| js.clone().map(move |j| i * rows + j));
                cells.flat_map(|k| triangles[k].into_iter().flatten()).collect()
            }
            Cells::Kept { corners, triangles, grid } => {
                let at = DVec2::new(u, v);
                let off: Vec<(f64, u32)> = grid.at(at).iter().map(|&k| (outside(corners[k as usize], at), k)).collect();
                // Beside a curved border the parameters may lie in none.
                let least = off.iter().map(|o| o.0).fold(f64::INFINITY, f64::min);
                let same = least + ROUNDING * at.abs().max_element();
                off.iter().filter(|o| o.0 <= same).filter_map(|o| triangles[o.1 as usize]).collect()
            }
        }
    }

    /// What is joined to the triangles `from` by way of triangles that come within `reach` of `p` on the screen; none if
    /// they are so many that the surface must be seen edge-on there. Edges at an angle are passed where `may_pass` them.
    pub(super) fn around(
        &self,
        from: &[u32],
        p: DVec3,
        reach: f64,
        may_pass: impl Fn([DVec3; 2]) -> bool,
    ) -> Option<Vec<u32>> {
        const MOST: usize = 500;
        let mut found = from.to_vec();
        let mut next = 0;
        while next < found.len() {
            if found.len() > MOST {
                return None;
            }
            let t = found[next];
            let corners = self.corners(t);
            for side in 0..3 {
                let Some(n) = self.triangles[t as usize].neighbours[side] else { continue };
                let open = self.joins_smoothly(t, n) || may_pass([corners[side], corners[(side + 1) % 3]]);
                if open && !found.contains(&n) && self.distance(n, p.truncate()) <= reach {
                    found.push(n);
                }
            }
            next += 1;
        }
        Some(found)
    }

    /// The sides of some triangles at which a neighbour lies at an angle.
    pub(super) fn sharp_edges(&self, of: &[u32]) -> impl Iterator<Item = [DVec3; 2]> {
        let sides = of.iter().flat_map(|&t| (0..3).map(move |side| (t, side)));
        sides.filter_map(|(t, side)| {
            let n = self.triangles[t as usize].neighbours[side]?;
            let corners = self.corners(t);
            (!self.joins_smoothly(t, n)).then_some([corners[side], corners[(side + 1) % 3]])
        })
    }

    /// Whether two neighbours' normals differ by less than a quarter of a radian. Cells are far smaller than that, so that
    /// more is the angle of an edge.
    fn joins_smoothly(&self, a: u32, b: u32) -> bool {
        const EDGE: f64 = 0.25;
        // Of the lines, not the sides: surfaces that are joined may run their parameters either way.
        self.normal(a).cross(self.normal(b)).length() < EDGE
    }

    /// Distance on the screen of a triangle from the point `q`.
    pub(super) fn distance(&self, triangle: u32, q: DVec2) -> f64 {
        outside(self.corners(triangle).map(DVec3::truncate), q)
    }

    /// Whether the triangle covers the screen point `q`. Of triangles that share an edge, and lie on its two sides, one
    /// covers a point on it: an edge is judged the same way from both.
    pub(super) fn covers(&self, triangle: u32, q: DVec2) -> bool {
        let [a, b, c] = self.corners(triangle).map(DVec3::truncate);
        passes_right(a, b, q) ^ passes_right(b, c, q) ^ passes_right(c, a, q)
    }
}

/// Parameters that differ by less than this part of themselves are the same.
const ROUNDING: f64 = 1e-13;

/// Distance of `q` from a triangle of the plane.
fn outside([a, b, c]: [DVec2; 3], q: DVec2) -> f64 {
    if passes_right(a, b, q) ^ passes_right(b, c, q) ^ passes_right(c, a, q) {
        return 0.0;
    }
    [(a, b), (b, c), (c, a)].iter().map(|&(a, b)| q.distance(nearest(a, b, q).0)).fold(f64::INFINITY, f64::min)
}

/// The point of a segment nearest to `q`, and where it is between the ends, from 0 to 1.
pub(super) fn nearest(a: DVec2, b: DVec2, q: DVec2) -> (DVec2, f64) {
    let d = b - a;
    let along = if d == DVec2::ZERO { 0.0 } else { ((q - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    (a + d * along, along)
}

/// The indices of the intervals between neighbouring `breaks` that hold `t`, ends included.
fn holding(breaks: &[f64], t: f64) -> std::ops::Range<usize> {
    let last = breaks.len() - 2;
    let from = breaks.partition_point(|&b| b < t).saturating_sub(1).min(last);
    let to = breaks.partition_point(|&b| b <= t).saturating_sub(1).min(last);
    from..to + 1
}

/// Whether the horizontal ray from `q` to the right meets the edge, whose lower end belongs to it.
pub(super) fn passes_right(a: DVec2, b: DVec2, q: DVec2) -> bool {
    let (a, b) = if (a.y, a.x) <= (b.y, b.x) { (a, b) } else { (b, a) };
    a.y <= q.y && q.y < b.y && (b - a).perp_dot(q - a) > 0.0
}

struct Build {
    vertices: Vec<DVec3>,
    triangles: Vec<Triangle>,
    /// Of each surface so far the first triangle.
    firsts: Vec<u32>,
    /// Number of patches so far.
    patches: u32,
    /// Boundary vertices by their position in model space, in units of `same`.
    known: HashMap<[i64; 3], Vec<(DVec3, u32)>>,
    same: f64,
}

impl Build {
    fn new(scene: &Scene) -> Self {
        let points = scene.surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
        let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        Self {
            vertices: Vec::new(),
            triangles: Vec::new(),
            firsts: Vec::new(),
            patches: 0,
            known: HashMap::new(),
            same: SAME_VERTEX * (hi - lo).length(),
        }
    }

    /// With the vertices that there are already, in view space.
    fn seen(vertices: Vec<DVec3>) -> Self {
        let (triangles, firsts) = (Vec::new(), Vec::new());
        Self { vertices, triangles, firsts, patches: 0, known: HashMap::new(), same: 0.0 }
    }

    /// What is added from now on is of the next surface.
    fn begin(&mut self) {
        self.firsts.push(self.triangles.len() as u32);
    }

    fn mesh(mut self, cells: Vec<Cells>) -> Mesh {
        let transitions = self.join();
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = self.vertices.iter().fold(start, |(lo, hi), &p| (lo.min(p), hi.max(p)));
        let Self { vertices, triangles, firsts, .. } = self;
        Mesh { vertices, triangles, transitions, size: (hi - lo).length(), firsts, cells }
    }

    /// Adds the triangles of one surface, whose vertices there are.
    fn sheet(&mut self, sheet: &Sheet, sight: &Sight) -> Cells {
        let first = self.patches;
        self.patches += sheet.patches;
        let triangles = sheet.facets.iter().map(|f| {
            let ends = f.corners.map(|v| self.vertices[v as usize]);
            let shared = (0..3).map(|k| ends[k].distance(sight.project(f.own[k]))).fold(0.0, f64::max);
            // Sides run at any angle to a fold, and both ends of one may be as far as it is long from the fold that it stands
            // for: four times what the surface is off at its middle, of which the usual safety covers half.
            let off = |k: usize| {
                let (middle, rim) = f.middles[k];
                let gap = |p: DVec3| off_line(ends[k], ends[(k + 1) % 3], sight.project(p));
                (2.0 * gap(middle)).max(rim.map_or(0.0, gap))
            };
            let triangle = self.triangle(f.corners, shared + off(0).max(off(1)).max(off(2)), first + f.patch)?;
            // The triangle of a corner and the middles beside it is half as far from the triangle's middle as the corner.
            let (own, middles) = (f.own.map(|p| sight.project(p)), f.middles.map(|(p, _)| sight.project(p)));
            let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).normalize_or_zero();
            let flat = normal(own[0], own[1], own[2]);
            let turned = |k: usize| 2.0 * normal(own[k], middles[k], middles[(k + 2) % 3]).cross(flat).length();
            self.triangles[triangle as usize].turn = turned(0).max(turned(1)).max(turned(2));
            Some(triangle)
        });
        let triangles = triangles.collect();
        let corners: Vec<[DVec2; 3]> = sheet.facets.iter().map(|f| f.uv).collect();
        let grid = Grid::new(corners.len(), |k| {
            let [a, b, c] = corners[k];
            let margin = sheet.slack + ROUNDING * a.abs().max(b.abs()).max(c.abs());
            [a.min(b).min(c) - margin, a.max(b).max(c) + margin]
        });
        Cells::Kept { corners, triangles, grid }
    }

    /// Adds the triangles of one surface, whose points are given on a grid twice as fine as the triangles'.
    fn surface(
        &mut self,
        points: &[DVec3],
        [nu, nv]: [usize; 2],
        parts: usize,
        sight: &Sight,
    ) -> Vec<[Option<u32>; 2]> {
        let view: Vec<DVec3> = points.iter().map(|&p| sight.project(p)).collect();
        let mut index = vec![0; points.len()];
        for i in (0..nu).step_by(2) {
            for j in (0..nv).step_by(2) {
                let k = i * nv + j;
                let border = i == 0 || j == 0 || i == nu - 1 || j == nv - 1;
                index[k] = if border { self.border_vertex(points[k], view[k]) } else { self.vertex(view[k]) };
            }
        }
        let mut cells = Vec::with_capacity((nu / 2) * (nv / 2));
        let (first, spans) = (self.patches, (nv / (2 * parts)) as u32);
        for i in (0..nu - 2).step_by(2) {
            for j in (0..nv - 2).step_by(2) {
                let at = |a: usize, b: usize| (i + a) * nv + j + b;
                let patch = first + (i / (2 * parts)) as u32 * spans + (j / (2 * parts)) as u32;
                self.patches = self.patches.max(patch + 1);
                let mut add = |corners: [usize; 3]| {
                    let [a, b, c] = corners;
                    // The point at the mean parameters of two corners stands between them in the fine grid.
                    let gap = |a: usize, b: usize| off_line(view[a], view[b], view[(a + b) / 2]);
                    let error = gap(a, b).max(gap(b, c)).max(gap(c, a));
                    self.triangle(corners.map(|k| index[k]), error, patch)
                };
                cells.push([add([at(0, 0), at(2, 0), at(2, 2)]), add([at(0, 0), at(2, 2), at(0, 2)])]);
            }
        }
        cells
    }

    fn triangle(&mut self, corners: [u32; 3], error: f64, patch: u32) -> Option<u32> {
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            return None;
        }
        let p = corners.map(|k| self.vertices[k as usize]);
        let side = p[0].distance(p[1]).max(p[1].distance(p[2])).max(p[2].distance(p[0]));
        self.triangles.push(Triangle { corners, error, side, turn: 0.0, neighbours: [None; 3], patch });
        Some(self.triangles.len() as u32 - 1)
    }

    fn vertex(&mut self, view: DVec3) -> u32 {
        self.vertices.push(view);
        self.vertices.len() as u32 - 1
    }

    /// The vertex at `p` on the boundary of a surface, which another boundary may have brought already.
    fn border_vertex(&mut self, p: DVec3, view: DVec3) -> u32 {
        let key = |d: DVec3| ((p + d * self.same) / (2.0 * self.same)).to_array().map(|x| x.floor() as i64);
        // Boxes twice as wide as the tolerance: what is within it lies in one of the eight that these corners touch.
        for n in 0..8 {
            let side = |bit: i32| if n & bit == 0 { -1.0 } else { 1.0 };
            let boxed = self.known.get(&key(DVec3::new(side(1), side(2), side(4))));
            let same = boxed.into_iter().flatten().find(|(q, _)| q.distance(p) <= self.same);
            if let Some(&(_, k)) = same {
                return k;
            }
        }
        let home = key(DVec3::ZERO);
        let k = self.vertex(view);
        self.known.entry(home).or_default().push((p, k));
        k
    }

    /// Finds neighbours, and the edges beyond which the number of sheets is another.
    fn join(&mut self) -> Vec<Transition> {
        let mut edges: HashMap<(u32, u32), Vec<(u32, usize)>> = HashMap::with_capacity(2 * self.triangles.len());
        for (k, t) in self.triangles.iter().enumerate() {
            for side in 0..3 {
                let (a, b) = (t.corners[side], t.corners[(side + 1) % 3]);
                edges.entry((a.min(b), a.max(b))).or_default().push((k as u32, side));
            }
        }
        let mut transitions = Vec::new();
        for (&(a, b), users) in &edges {
            let ends = [a, b].map(|v| self.vertices[v as usize]);
            if let &[(k, side), (l, other)] = users.as_slice() {
                self.triangles[k as usize].neighbours[side] = Some(l);
                self.triangles[l as usize].neighbours[other] = Some(k);
                if self.beside(ends, k, side) * self.beside(ends, l, other) < 0.0 {
                    continue;
                }
            }
            let triangles: Vec<u32> = users.iter().map(|u| u.0).collect();
            let most =
                |f: fn(&Triangle) -> f64| triangles.iter().map(|&t| f(&self.triangles[t as usize])).fold(0.0, f64::max);
            let (error, side) = (most(|t| t.error), most(|t| t.side));
            transitions.push(Transition { ends, triangles, error, side });
        }
        transitions
    }

    /// On which side of its edge on the screen the triangle lies: ±1, or 0 if it is seen edge-on.
    fn beside(&self, ends: [DVec3; 2], triangle: u32, side: usize) -> f64 {
        let t = &self.triangles[triangle as usize];
        let [a, b] = ends.map(DVec3::truncate);
        let twice_area = (b - a).perp_dot(self.vertices[t.corners[(side + 2) % 3] as usize].truncate() - a);
        if twice_area.abs() <= EDGE_ON * t.side * t.side { 0.0 } else { twice_area.signum() }
    }
}

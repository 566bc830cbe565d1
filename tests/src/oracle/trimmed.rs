//! Trimmed surfaces as triangles in model space: constrained Delaunay triangulations of what is kept of the parameter
//! ranges, whose borders are shared with the surfaces beyond.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::scene::Scene;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::CHORD;
use super::mesh::passes_right;
use super::outline::{Chord, Outline, off_line};
use super::spline;

/// Triangles come this much nearer to their surface than those of untrimmed scenes, whose sides run along folds more often.
const NEARER: f64 = 0.5;

/// Chords of borders keep within this part of what triangles may be off: borders are where most lines are judged.
const BORDER: f64 = 0.25;

/// Triangles whose height is below this part of their longest side, in parameters, are rounding of borders that are
/// straight; nothing of the surface is in them.
const FLAT: f64 = 1e-7;

/// A triangle in model space.
pub(super) struct Facet {
    /// Vertices of the model.
    pub(super) corners: [u32; 3],
    /// Parameters of the corners.
    pub(super) uv: [DVec2; 3],
    /// The surface at the corners, which may be shared with another surface that is a little off.
    pub(super) own: [DVec3; 3],
    /// The surface at the mean parameters of the ends of each side, and the border beside the side if it is one.
    pub(super) middles: [(DVec3, Option<DVec3>); 3],
    /// Number of the piece between neighbouring knots, of this surface.
    pub(super) patch: u32,
}

/// The triangles of one surface.
pub(super) struct Sheet {
    pub(super) facets: Vec<Facet>,
    /// How far in u and in v the surface may reach beyond its triangles.
    pub(super) slack: DVec2,
    /// Number of pieces between neighbouring knots.
    pub(super) patches: u32,
}

/// All surfaces of a scene as triangles, before they are seen.
pub struct Model {
    pub(super) vertices: Vec<DVec3>,
    pub(super) sheets: Vec<Sheet>,
}

impl Model {
    /// Triangles within 10⁻⁴ of the scene's size of their surfaces, as long as that takes no more than 100 000 of them on
    /// one surface.
    ///
    /// # Panics
    /// If parameters are beyond what a triangulation can hold: some 10²⁰⁰.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        const MOST: usize = 100_000;
        let (chord, most) = (CHORD, MOST);
        let points = || scene.surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (lo, hi) = points().fold(start, |(lo, hi), p| (lo.min(p), hi.max(p)));
        let size = (hi - lo).length();
        let nets: Vec<Net<'_>> =
            scene.surfaces.iter().map(|s| Net::new(&s.surface, NEARER * chord * size, most)).collect();
        let steps: Vec<DVec2> = nets.iter().map(Net::step).collect();
        let outline = Outline::new(scene, size, BORDER * chord * size, &steps);
        let mut vertices = outline.points;
        let sheets = nets.iter().zip(&outline.chords).map(|(n, chords)| n.sheet(chords, &mut vertices)).collect();
        Self { vertices, sheets }
    }
}

/// A surface with the lines of constant u and v at whose crossings it gets vertices.
struct Net<'a> {
    surface: &'a Surface,
    us: Vec<f64>,
    vs: Vec<f64>,
    /// Mean lengths in space for a unit of u and of v.
    speed: DVec2,
}

impl<'a> Net<'a> {
    fn new(surface: &'a Surface, chord: f64, most: usize) -> Self {
        let (ku, kv) = (surface.knots_u(), surface.knots_v());
        let mut parts = 8;
        loop {
            let us = spline::subdivided(ku.as_slice(), ku.degree(), 2 * parts);
            let vs = spline::subdivided(kv.as_slice(), kv.degree(), 2 * parts);
            let points = spline::points(surface, &us, &vs);
            let at = |i: usize, j: usize| points[i * vs.len() + j];
            let (mut error, mut length) = (0.0_f64, DVec2::ZERO);
            for i in (0..us.len() - 1).step_by(2) {
                for j in (0..vs.len() - 1).step_by(2) {
                    for (k, l) in [(2, 0), (0, 2), (2, 2)] {
                        error = error.max(off_line(at(i, j), at(i + k, j + l), at(i + k / 2, j + l / 2)));
                    }
                    length += DVec2::new(at(i, j).distance(at(i + 2, j)), at(i, j).distance(at(i, j + 2)));
                }
            }
            let next = parts * 3 / 2;
            let grown = us.len() * vs.len() * next * next / (2 * parts * parts);
            if error <= chord || grown > most {
                let coarse = |all: Vec<f64>| all.into_iter().step_by(2).collect::<Vec<f64>>();
                let (us, vs) = (coarse(us), coarse(vs));
                let [rows, columns] = [vs.len() - 1, us.len() - 1].map(|n| n as f64);
                let range = DVec2::new(us[us.len() - 1] - us[0], vs[vs.len() - 1] - vs[0]);
                let speed = length / DVec2::new(rows, columns) / range;
                let speed = DVec2::from_array(speed.to_array().map(|s| if s > 0.0 { s } else { 1.0 }));
                return Self { surface, us, vs, speed };
            }
            parts = next;
        }
    }

    /// Widest distance between neighbouring lines.
    fn step(&self) -> DVec2 {
        let widest = |all: &[f64]| all.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        // Rounding does not make another chord.
        1.001 * DVec2::new(widest(&self.us), widest(&self.vs))
    }

    /// The triangles of what the chords enclose.
    fn sheet(&self, chords: &[Chord], vertices: &mut Vec<DVec3>) -> Sheet {
        let inside = Inside::new(chords);
        let mut cdt = ConstrainedDelaunayTriangulation::<Corner>::new();
        let scaled = |uv: DVec2| {
            let p = (uv * self.speed).to_array().map(|x| if x.abs() < 1e-100 { 0.0 } else { x });
            Point2::new(p[0], p[1])
        };
        let mut known = HashMap::new();
        let mut rims = HashMap::new();
        let mut edges = Vec::with_capacity(chords.len());
        for c in chords {
            let ends = [0, 1].map(|k| {
                let uv = c.ends[k];
                *known.entry(uv.to_array().map(f64::to_bits)).or_insert_with(|| {
                    let corner = Corner { position: scaled(uv), uv, vertex: Some(c.vertices[k]) };
                    cdt.insert(corner).expect("parameters that a triangulation can hold")
                })
            });
            if ends[0] != ends[1] {
                edges.push(ends);
                let key = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                rims.insert(key, c.middle);
            }
        }
        for (uv, _) in self.free_crossings(chords).into_iter().filter(|(uv, free)| *free && inside.holds(*uv)) {
            let corner = Corner { position: scaled(uv), uv, vertex: None };
            cdt.insert(corner).expect("parameters that a triangulation can hold");
        }
        for [a, b] in edges {
            let on = |p: Point2<f64>| Corner { position: p, uv: DVec2::new(p.x, p.y) / self.speed, vertex: None };
            cdt.add_constraint_and_split(a, b, on);
        }
        let mut numbers: Vec<Option<u32>> = cdt.vertices().map(|v| v.data().vertex).collect();
        let mut facets = Vec::new();
        for face in cdt.inner_faces() {
            let corners = face.vertices();
            let uv = corners.map(|v| v.data().uv);
            let ps = corners.map(|v| DVec2::new(v.position().x, v.position().y));
            let area = (ps[1] - ps[0]).perp_dot(ps[2] - ps[0]).abs();
            let side =
                [(0, 1), (1, 2), (2, 0)].map(|(i, j)| ps[i].distance_squared(ps[j])).into_iter().fold(0.0, f64::max);
            let centre = (uv[0] + uv[1] + uv[2]) / 3.0;
            if area <= FLAT * side || !inside.holds(centre) {
                continue;
            }
            let own = uv.map(|uv| spline::point(self.surface, uv));
            let numbered = [0, 1, 2].map(|k| {
                *numbers[corners[k].fix().index()].get_or_insert_with(|| {
                    vertices.push(own[k]);
                    vertices.len() as u32 - 1
                })
            });
            let middles = [0, 1, 2].map(|k| {
                let (a, b) = (corners[k].fix(), corners[(k + 1) % 3].fix());
                let rim = rims.get(&[a.min(b), a.max(b)]).map(|&uv| spline::point(self.surface, uv));
                (spline::point(self.surface, uv[k].midpoint(uv[(k + 1) % 3])), rim)
            });
            facets.push(Facet { corners: numbered, uv, own, middles, patch: self.patch(centre) });
        }
        let off = |c: &Chord| (c.middle - c.ends[0].midpoint(c.ends[1])).abs();
        let slack = chords.iter().map(off).fold(DVec2::ZERO, DVec2::max);
        // The middle is not where a chord is farthest off; twice as much is.
        let [spans_u, spans_v] = [self.surface.knots_u(), self.surface.knots_v()].map(|k| k.breaks().len() as u32 - 1);
        Sheet { facets, slack: 2.0 * slack, patches: spans_u * spans_v }
    }

    /// The crossings of the lines, and whether they are free: outside all circles over chords as diameters, so that no triangle
    /// is flat on a border.
    fn free_crossings(&self, chords: &[Chord]) -> Vec<(DVec2, bool)> {
        let nv = self.vs.len();
        let uvs = self.us.iter().flat_map(|&u| self.vs.iter().map(move |&v| DVec2::new(u, v)));
        let mut all: Vec<(DVec2, bool)> = uvs.map(|uv| (uv, true)).collect();
        for c in chords {
            let [a, b] = c.ends.map(|uv| uv * self.speed);
            let (middle, radius) = (a.midpoint(b), 0.5 * a.distance(b));
            let (lo, hi) = ((middle - radius) / self.speed, (middle + radius) / self.speed);
            let between =
                |all: &[f64], lo: f64, hi: f64| all.partition_point(|&x| x < lo)..all.partition_point(|&x| x <= hi);
            for i in between(&self.us, lo.x, hi.x) {
                for j in between(&self.vs, lo.y, hi.y) {
                    let (uv, free) = &mut all[i * nv + j];
                    *free &= (*uv * self.speed).distance(middle) > radius;
                }
            }
        }
        all
    }

    fn patch(&self, uv: DVec2) -> u32 {
        let [i, j] = [(self.surface.knots_u(), uv.x), (self.surface.knots_v(), uv.y)].map(|(k, t)| {
            let breaks = k.breaks();
            breaks.partition_point(|&b| b <= t).clamp(1, breaks.len() - 1) - 1
        });
        (i * (self.surface.knots_v().breaks().len() - 1) + j) as u32
    }
}

/// A vertex of a triangulation.
struct Corner {
    /// Parameters times mean speeds, so that triangles that are well shaped there are so in space.
    position: Point2<f64>,
    uv: DVec2,
    /// The vertex of the model, if it is shared.
    vertex: Option<u32>,
}

impl HasPosition for Corner {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// The even-odd rule over chords, which are kept by the rows of v that they pass.
struct Inside {
    rows: Vec<Vec<[DVec2; 2]>>,
    lo: f64,
    height: f64,
}

impl Inside {
    fn new(chords: &[Chord]) -> Self {
        let vs = || chords.iter().flat_map(|c| c.ends).map(|uv| uv.y);
        let (lo, hi) = vs().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let count = chords.len().max(1);
        let height = ((hi - lo) / count as f64).max(f64::MIN_POSITIVE);
        let mut inside = Self { rows: vec![Vec::new(); count], lo, height };
        for c in chords {
            let [a, b] = c.ends.map(|uv| inside.row(uv.y));
            for row in a.min(b)..=a.max(b) {
                inside.rows[row].push(c.ends);
            }
        }
        inside
    }

    fn row(&self, v: f64) -> usize {
        (((v - self.lo) / self.height).max(0.0) as usize).min(self.rows.len() - 1)
    }

    fn holds(&self, uv: DVec2) -> bool {
        self.rows[self.row(uv.y)].iter().fold(false, |odd, &[a, b]| odd ^ passes_right(a, b, uv))
    }
}

//! How isocurves cover surfaces, measured on the surfaces themselves: by points and polylines, with nothing of the
//! symbolic distances by which the isocurves were chosen.

use glam::{DVec2, DVec3};
use penvis_core::line::Axis;
use penvis_core::nurbs::Surface;
use penvis_core::pipeline::Prepared;
use penvis_core::stroke::CurveKind;
use penvis_core::view::Camera;

/// Places along a surface's isocurves at which neighbours are compared.
const PLACES: usize = 96;

/// Points a knot interval in each direction at which a surface is looked at: a prime, so that none lies on the isocurves that
/// halving makes.
const SAMPLES: usize = 19;

/// Chords of an isocurve's polyline for each knot interval that it crosses.
const CHORDS: usize = 48;

/// What the isocurves of one surface in one direction are like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coverage {
    /// Largest distance on the screen of a point of the surface from the isocurves and the edges along them.
    pub farthest: f64,
    /// Pairs of neighbours looked at, over places along the isocurves.
    pub pairs: usize,
    /// Of these, pairs nearer together than half the spacing.
    pub crowded: usize,
    /// Largest distance between corresponding points of neighbours.
    pub widest: f64,
    /// Length on the screen.
    pub length: f64,
    /// Equally spaced isocurves, edges among them, that are nowhere farther apart than the spacing.
    pub uniform: usize,
    /// Their length on the screen.
    pub uniform_length: f64,
}

impl Coverage {
    /// Takes those of another surface in.
    pub fn add(&mut self, other: &Self) {
        self.farthest = self.farthest.max(other.farthest);
        self.widest = self.widest.max(other.widest);
        self.pairs += other.pairs;
        self.crowded += other.crowded;
        self.length += other.length;
        self.uniform += other.uniform;
        self.uniform_length += other.uniform_length;
    }
}

/// A part of an isocurve: constant parameter, and interval of the other one.
type Part = (f64, [f64; 2]);

/// A surface seen from a camera, with one parameter held.
struct Sheet<'a> {
    surface: &'a Surface,
    camera: &'a Camera,
    axis: Axis,
}

impl Sheet<'_> {
    /// The point on the screen at the constant parameter `s` and the running one `t`.
    fn at(&self, s: f64, t: f64) -> DVec2 {
        let p: DVec3 = match self.axis {
            Axis::U => self.surface.eval(s, t),
            Axis::V => self.surface.eval(t, s),
        };
        self.camera.project(p).map_or(DVec2::NAN, DVec3::truncate)
    }

    /// Distinct knots of the constant and of the running parameter.
    fn knots(&self) -> [Vec<f64>; 2] {
        let [u, v] = [self.surface.knots_u(), self.surface.knots_v()].map(|k| k.breaks());
        if self.axis == Axis::U { [u, v] } else { [v, u] }
    }

    fn polyline(&self, (s, t): Part) -> Vec<DVec2> {
        let [_, knots] = self.knots();
        let inside = knots.windows(2).filter(|w| w[0] < t[1] && w[1] > t[0]).count();
        let count = CHORDS * inside.max(1);
        (0..=count).map(|k| self.at(s, t[0] + (t[1] - t[0]) * k as f64 / count as f64)).collect()
    }

    /// Values spread over the intervals between knots, none of them a knot.
    fn spread(knots: &[f64], each: usize) -> Vec<f64> {
        let inside = |w: &[f64]| {
            let [a, b] = [w[0], w[1]];
            (0..each).map(move |k| a + (b - a) * (k as f64 + 0.5) / each as f64).collect::<Vec<_>>()
        };
        knots.windows(2).flat_map(inside).collect()
    }

    /// The largest distance between neighbours of `count` equally spaced isocurves.
    fn widest_of(&self, count: usize) -> f64 {
        let [across, along] = self.knots();
        let (a, b) = (across[0], across[across.len() - 1]);
        let s = |k: usize| a + (b - a) * k as f64 / (count - 1) as f64;
        let mut most = 0.0_f64;
        for t in Self::spread(&along, PLACES / (along.len() - 1)) {
            let row: Vec<DVec2> = (0..count).map(|k| self.at(s(k), t)).collect();
            most = row.windows(2).map(|w| w[0].distance(w[1])).fold(most, f64::max);
        }
        most
    }

    /// The fewest equally spaced isocurves nowhere farther apart than `spacing`, and their length. At least three, so that
    /// the seam of a closed surface is not all of it.
    fn uniform(&self, spacing: f64) -> (usize, f64) {
        let (mut low, mut high) = (2, 3);
        while self.widest_of(high) > spacing {
            (low, high) = (high, 2 * high - 1);
        }
        while high - low > 1 {
            let middle = (low + high) / 2;
            if self.widest_of(middle) > spacing { low = middle } else { high = middle }
        }
        let [across, along] = self.knots();
        let (a, b) = (across[0], across[across.len() - 1]);
        let whole = [along[0], along[along.len() - 1]];
        let one = |k: usize| length(&self.polyline((a + (b - a) * k as f64 / (high - 1) as f64, whole)));
        (high, (0..high).map(one).sum())
    }
}

fn length(line: &[DVec2]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Measures the isocurves of each surface in each direction in which there are some besides its edges. `camera` and `surfaces` are those that
/// `prepared` was made of, with adaptive isocurves of `spacing` on the screen.
#[must_use]
pub fn measure<'a>(
    surfaces: impl Iterator<Item = &'a Surface>,
    camera: &Camera,
    prepared: &Prepared,
    spacing: f64,
) -> Vec<Coverage> {
    let mut out = Vec::new();
    for (index, surface) in surfaces.enumerate() {
        for axis in [Axis::U, Axis::V] {
            let parts: Vec<Part> = prepared
                .curves()
                .iter()
                .filter(|c| c.kind == CurveKind::Iso && c.surface == index && c.axis() == Some(axis))
                .map(|c| {
                    let uv = c.uv(&prepared.geometry(), c.domain[0]);
                    (if axis == Axis::U { uv.x } else { uv.y }, c.domain)
                })
                .collect();
            let sheet = Sheet { surface, camera, axis };
            let [across, _] = sheet.knots();
            // An edge alone can be the neighbour's isocurve.
            if parts.iter().any(|(s, _)| *s != across[0] && *s != across[across.len() - 1]) {
                out.push(one(&sheet, parts, spacing));
            }
        }
    }
    out
}

fn one(sheet: &Sheet<'_>, mut parts: Vec<Part>, spacing: f64) -> Coverage {
    let [across, along] = sheet.knots();
    let whole = [along[0], along[along.len() - 1]];
    let ends = [across[0], across[across.len() - 1]];
    // Edges along the isocurves are drawn as what they are.
    parts.retain(|(s, _)| !ends.contains(s));
    parts.extend(ends.map(|s| (s, whole)));
    let mut found = Coverage::default();
    for t in Sheet::spread(&along, PLACES / (along.len() - 1)) {
        let mut there: Vec<f64> = parts.iter().filter(|(_, i)| i[0] <= t && t <= i[1]).map(|p| p.0).collect();
        there.sort_by(f64::total_cmp);
        for w in there.windows(2) {
            let gap = sheet.at(w[0], t).distance(sheet.at(w[1], t));
            found.pairs += 1;
            found.crowded += usize::from(gap < 0.5 * spacing);
            found.widest = found.widest.max(gap);
        }
    }
    let lines: Vec<Vec<DVec2>> = parts.iter().map(|p| sheet.polyline(*p)).collect();
    found.length = lines.iter().map(|l| length(l)).sum();
    let near = Near::new(&lines, spacing);
    for s in Sheet::spread(&across, SAMPLES) {
        for t in Sheet::spread(&along, SAMPLES) {
            found.farthest = found.farthest.max(near.distance(sheet.at(s, t)));
        }
    }
    (found.uniform, found.uniform_length) = sheet.uniform(spacing);
    found
}

/// Chords in square cells of the size of the spacing.
struct Near {
    cell: f64,
    chords: std::collections::HashMap<(i64, i64), Vec<(DVec2, DVec2)>>,
}

impl Near {
    fn new(lines: &[Vec<DVec2>], cell: f64) -> Self {
        let mut near = Self { cell, chords: std::collections::HashMap::new() };
        for w in lines.iter().flat_map(|l| l.windows(2)) {
            let (low, high) = (near.index(w[0].min(w[1])), near.index(w[0].max(w[1])));
            for i in low.0..=high.0 {
                for j in low.1..=high.1 {
                    near.chords.entry((i, j)).or_default().push((w[0], w[1]));
                }
            }
        }
        near
    }

    fn index(&self, p: DVec2) -> (i64, i64) {
        let at = (p / self.cell).floor();
        (at.x as i64, at.y as i64)
    }

    /// Distance of the nearest chord, if that is less than a cell; else some distance of more.
    fn distance(&self, p: DVec2) -> f64 {
        let (x, y) = self.index(p);
        let cells = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (x + i, y + j)));
        let chords = cells.filter_map(|c| self.chords.get(&c)).flatten();
        let to = |&(a, b): &(DVec2, DVec2)| {
            let d = b - a;
            let share = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            (p - a - d * share).length()
        };
        chords.map(to).fold(2.0 * self.cell, f64::min)
    }
}

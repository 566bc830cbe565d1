//! What the triangles show at a point of the screen, and how much of the screen they cover.

use glam::{DVec2, DVec3};

use super::{LEAST, Oracle, SAFETY, mesh};

/// Direction of the lines along which area is measured: one that no edge of a model is likely to have in a view along an axis, for
/// an edge along the lines is known to their distance only.
const ALONG: f64 = 0.7236;

/// What is nearest to the eye at a point of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nearest {
    /// No surface is there.
    Nothing,
    /// The surface with this index.
    Surface(usize),
    /// Triangles of several surfaces are as near as they are known, or one ends or folds within its error of the point.
    Ambiguous,
}

impl Oracle {
    /// What is seen at a point of the screen. Microseconds.
    #[must_use]
    pub fn nearest(&self, q: DVec2) -> Nearest {
        let least = LEAST * self.mesh.size;
        // Lowest and highest depth that the surface of each triangle there can have.
        let mut there: Vec<([f64; 2], usize)> = Vec::new();
        for &t in self.triangles.at(q).iter().filter(|&&t| self.mesh.covers(t, q)) {
            let reach = SAFETY * self.mesh.triangles[t as usize].error + least;
            let [a, b, c] = self.mesh.corners(t);
            let normal = (b - a).cross(c - a);
            let height = a.z - (q - a.truncate()).dot(normal.truncate()) / normal.z;
            let margin = reach * (1.0 + normal.truncate().length() / normal.z.abs());
            let (low, high) = (a.z.min(b.z).min(c.z) - reach, a.z.max(b.z).max(c.z) + reach);
            there.push(([(height - margin).max(low), (height + margin).min(high)], self.mesh.surface(t)));
        }
        let nearest = there.iter().max_by(|a, b| a.0[0].total_cmp(&b.0[0])).copied();
        let floor = nearest.map_or(f64::NEG_INFINITY, |n| n.0[0]);
        let ends = self.transitions.at(q).iter().any(|&k| {
            let t = &self.mesh.transitions[k as usize];
            let [a, b] = t.ends;
            let distance = q.distance(mesh::nearest(a.truncate(), b.truncate(), q).0);
            distance <= SAFETY * t.error + least && a.z.max(b.z) > floor - t.side - least
        });
        match nearest {
            _ if ends => Nearest::Ambiguous,
            None => Nearest::Nothing,
            Some((_, surface)) if there.iter().all(|t| t.1 == surface || t.0[1] < floor) => Nearest::Surface(surface),
            Some(_) => Nearest::Ambiguous,
        }
    }

    /// Area of the screen that the triangles cover, by lines so many on the diagonal of its box: exact along each line, and by
    /// the midpoint rule across. Of a surface that bulges out of its triangles it is short by the length of the outline times
    /// [`relative_error`](Self::relative_error) times the size at the most.
    #[must_use]
    pub fn area(&self, lines: u32) -> f64 {
        let along = DVec2::from_angle(ALONG);
        let turned = |p: DVec3| DVec2::new(p.truncate().dot(along), p.truncate().dot(along.perp()));
        let points: Vec<DVec2> = self.mesh.vertices.iter().map(|&p| turned(p)).collect();
        let range = |low: f64, high: f64, p: &DVec2| (low.min(p.y), high.max(p.y));
        let (low, high) = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| range(l, h, p));
        let step = (high - low) / f64::from(lines);
        let mut covered: Vec<Vec<[f64; 2]>> = vec![Vec::new(); lines as usize];
        for t in &self.mesh.triangles {
            let corners = t.corners.map(|v| points[v as usize]);
            let (from, to) = corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| range(l, h, p));
            let first = ((from - low) / step - 0.5).ceil().max(0.0) as usize;
            for (k, line) in covered.iter_mut().enumerate().skip(first) {
                let y = low + (k as f64 + 0.5) * step;
                if y >= to {
                    break;
                }
                let [mut x0, mut x1] = [f64::INFINITY, f64::NEG_INFINITY];
                for i in 0..3 {
                    let (a, b) = (corners[i], corners[(i + 1) % 3]);
                    if (a.y <= y) != (b.y <= y) {
                        let x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
                        (x0, x1) = (x0.min(x), x1.max(x));
                    }
                }
                if x0 < x1 {
                    line.push([x0, x1]);
                }
            }
        }
        covered.iter_mut().map(|line| step * union(line)).sum()
    }
}

/// Length of a union of intervals.
fn union(intervals: &mut [[f64; 2]]) -> f64 {
    intervals.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut length, mut end) = (0.0, f64::NEG_INFINITY);
    for &[a, b] in intervals.iter() {
        length += (b - a.max(end)).max(0.0);
        end = end.max(b);
    }
    length
}

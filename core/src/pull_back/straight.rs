//! Curves along lines of constant u or v, whose images are straight.

use glam::DVec2;

use super::walk::{Miss, Node, Stop, Walk};

/// Sine of the angle between a curve and a line of constant u or v up to which the line is tried.
const PARALLEL: f64 = 1e-3;

impl Walk<'_> {
    /// The ends of the line of constant u or v that is the image of the part of the curve between two stops, and how far it
    /// is off: by feet at p·q places of every span of the curve, and of the two that the middle makes of its own, p being the
    /// degree of the curve and q that of the line in space.
    ///
    /// By Bézout's theorem two pieces with one point more in common, and the places with the knots are so many, are of one
    /// curve; what is within the tolerance at all is taken for such. The feet go along the line without turning, so that the
    /// curve covers it from end to end.
    pub(super) fn straight(&self, seed: Node, [from, to]: [Stop; 2]) -> Option<([DVec2; 2], Miss)> {
        let jet = self.sheet.jet(seed.uv);
        let slope = self.slope(seed, true);
        let along = [jet.du.length() * slope.x, jet.dv.length() * slope.y].map(f64::abs);
        let d = usize::from(along[1] < along[0]);
        if along[d] > PARALLEL * along[1 - d] || along[1 - d] == 0.0 {
            return None;
        }
        // On a seam, a border or a knot line rather than next to it.
        let near = self.tolerance / [jet.du, jet.dv][d].length();
        let middle = DVec2::select(glam::BVec2::new(d == 0, d == 1), self.sheet.on_line(seed.uv, near), seed.uv);
        let (first, before) = self.along(Node { uv: middle, ..seed }, from, d)?;
        let (last, after) = self.along(Node { uv: middle, ..seed }, to, d)?;
        let rises = slope[1 - d] > 0.0;
        let turns = [(first, middle), (middle, last)].iter().any(|(a, b)| (b[1 - d] > a[1 - d]) != rises);
        (!turns).then_some(([first, last], before.with(after)))
    }

    /// The image of a stop, which is on the line of constant parameter `d` through the seed as all the way to it is.
    fn along(&self, seed: Node, stop: Stop, d: usize) -> Option<(DVec2, Miss)> {
        let up = stop.t > seed.t;
        let knots = self.breaks.iter().copied();
        let between = |k: &f64| seed.t.min(stop.t) < *k && *k < seed.t.max(stop.t);
        let surface = [self.sheet.surface.knots_v(), self.sheet.surface.knots_u()][d];
        let places = (self.curve.degree() * surface.degree()).max(4);
        let (mut here, mut miss, mut sign) = (seed, Miss::default(), 0.0);
        let mut span = |next: f64| {
            let start = here.t;
            for k in 1..=places {
                let t = if k == places { next } else { start + (next - start) * (k as f64 / places as f64) };
                let (uv, found) = self.next_along(here, t, d, stop)?;
                let moved = uv[1 - d] - here.uv[1 - d];
                if moved * sign < 0.0 || moved == 0.0 {
                    return None;
                }
                sign = moved;
                (here, miss) = (Node { t, uv }, miss.with(found));
            }
            Some(())
        };
        if up {
            knots.filter(between).chain([stop.t]).try_for_each(&mut span)?;
        } else {
            knots.rev().filter(between).chain([stop.t]).try_for_each(&mut span)?;
        }
        Some((here.uv, miss))
    }

    /// The foot at `t` on the line of constant parameter `d` on which `here` is, and how far the curve is from it.
    fn next_along(&self, here: Node, t: f64, d: usize, stop: Stop) -> Option<(DVec2, Miss)> {
        const BETWEEN: f64 = 1.5;
        let p = self.curve.eval(t);
        let (mut uv, mut along, mut off) = (here.uv, 0.0, None);
        if let Some(pole) = stop.pole.filter(|_| t == stop.t) {
            uv[pole.d] = pole.value;
        } else {
            let guess = self.slope(here, t > here.t) * (t - here.t);
            if (guess.abs() / self.sheet.range).max_element() > 0.5 {
                return None;
            }
            let foot = self.sheet.foot_near(p, here.uv + guess);
            uv[1 - d] = foot.uv[1 - d];
            if t == stop.t {
                uv = self.sheet.on_line(uv, 0.0);
            }
            off = Some(foot.distance);
            along = BETWEEN * (self.sheet.eval(foot.uv) - self.sheet.eval(uv)).length();
            if along > 2.0 * self.tolerance || foot.distance > self.limit {
                return None;
            }
        }
        let total = (self.sheet.eval(uv) - p).length();
        (uv[d] == here.uv[d]).then_some((uv, Miss { along, total, off: off.unwrap_or(total) }))
    }
}

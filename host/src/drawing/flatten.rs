//! Curves on the paper as polylines, within a tolerance.

use std::f64::consts::TAU;

use glam::DVec2;

/// Largest coordinate on paper and side of a sheet in mm. No plotter here reaches so far.
pub(super) const LONGEST_MM: f64 = 10_000.0;

/// Most vertices of a drawing whose curves are made into polylines here: some 300 m of ink in chords of 0.03 mm, in 400 MB.
const MOST_POINTS: usize = 10_000_000;

/// Collects lines and curves on the paper, in mm, as polylines that leave them by no more than a tolerance.
///
/// The pieces of a curve P(t) are equally long in t. A chord over a step h of it is no farther from P than h²/8 of the largest |P″| there (the error of linear
/// interpolation), which for a Bézier curve is bounded by the second differences of its control points, P″ being a Bézier curve of them.
pub(super) struct Flattener {
    tolerance_mm: f64,
    /// Points that may be added.
    left: usize,
    lines: Vec<Vec<DVec2>>,
    current: Vec<DVec2>,
    /// Where a polyline was closed, after which none was begun.
    closed_at: Option<DVec2>,
}

impl Flattener {
    /// With a tolerance in mm, which is positive.
    pub(super) fn new(tolerance_mm: f64) -> Self {
        Self { tolerance_mm, left: MOST_POINTS, lines: Vec::new(), current: Vec::new(), closed_at: None }
    }

    /// The polylines since the last call, each of two points or more. Those of one point were only gone to.
    pub(super) fn take(&mut self) -> Vec<Vec<DVec2>> {
        self.finish();
        std::mem::take(&mut self.lines)
    }

    fn finish(&mut self) {
        self.closed_at = None;
        let line = std::mem::take(&mut self.current);
        if line.len() > 1 {
            self.lines.push(line);
        }
    }

    fn push(&mut self, p: DVec2) -> Result<(), String> {
        if !p.abs().cmple(DVec2::splat(LONGEST_MM)).all() {
            return Err(format!("has a coordinate of more than {LONGEST_MM} mm; no paper is so large"));
        }
        // A dot is a point twice.
        if self.current.len() > 1 && self.current.last() == Some(&p) {
            return Ok(());
        }
        self.left = self.left.checked_sub(1).ok_or_else(too_many)?;
        self.current.push(p);
        Ok(())
    }

    /// Begins a polyline.
    ///
    /// # Errors
    /// As for all that adds points: if one lies on no paper, or they are too many; what is wrong, and what to do.
    pub(super) fn move_to(&mut self, p: DVec2) -> Result<(), String> {
        self.finish();
        self.push(p)
    }

    /// Goes on straight.
    pub(super) fn line_to(&mut self, p: DVec2) -> Result<(), String> {
        if self.at()?.is_some() { self.push(p) } else { Ok(()) }
    }

    /// Goes on along a quadratic Bézier curve.
    pub(super) fn quad_to(&mut self, a: DVec2, to: DVec2) -> Result<(), String> {
        let Some(from) = self.at()? else { return Ok(()) };
        // |P″| is twice the second difference.
        let count = self.pieces(1.0, 2.0 * (from - 2.0 * a + to).length())?;
        self.along(count, to, |t| from.lerp(a, t).lerp(a.lerp(to, t), t))
    }

    /// Goes on along a cubic Bézier curve.
    pub(super) fn cubic_to(&mut self, a: DVec2, b: DVec2, to: DVec2) -> Result<(), String> {
        let Some(from) = self.at()? else { return Ok(()) };
        // |P″| is at most six times the larger second difference.
        let bend = (from - 2.0 * a + b).length().max((a - 2.0 * b + to).length());
        let count = self.pieces(1.0, 6.0 * bend)?;
        self.along(count, to, |t| {
            let (p, q, r) = (from.lerp(a, t), a.lerp(b, t), b.lerp(to, t));
            p.lerp(q, t).lerp(q.lerp(r, t), t)
        })
    }

    /// Goes on along the ellipse `centre + a cos t + b sin t`, from the angle `start` by `sweep`, both in radians, to where that ends.
    pub(super) fn arc_to(
        &mut self,
        centre: DVec2,
        [a, b]: [DVec2; 2],
        start: f64,
        sweep: f64,
        to: DVec2,
    ) -> Result<(), String> {
        if self.at()?.is_none() {
            return Ok(());
        }
        let sweep = sweep.clamp(-TAU, TAU);
        // |P″| = |a cos t + b sin t| is at most the longer half axis, the larger singular value of (a, b).
        let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
        let longest = ((aa + bb + (aa - bb).hypot(2.0 * ab)) / 2.0).sqrt();
        let count = self.pieces(sweep.abs(), longest)?;
        self.along(count, to, |t| {
            let (sin, cos) = (start + sweep * t).sin_cos();
            centre + a * cos + b * sin
        })
    }

    /// Goes back to where the polyline began. What is drawn next begins another one there.
    pub(super) fn close(&mut self) -> Result<(), String> {
        let Some(&first) = self.current.first() else { return Ok(()) };
        if self.current.len() == 1 || self.current.last() != Some(&first) {
            self.push(first)?;
        }
        self.finish();
        self.closed_at = Some(first);
        Ok(())
    }

    /// Where the pen is, if it is anywhere: what goes on from there needs it to be on a polyline.
    fn at(&mut self) -> Result<Option<DVec2>, String> {
        if let (true, Some(first)) = (self.current.is_empty(), self.closed_at) {
            self.push(first)?;
        }
        Ok(self.current.last().copied())
    }

    /// Into how many pieces `length` of a parameter is cut, for a second derivative of at most `bend` mm.
    fn pieces(&self, length: f64, bend: f64) -> Result<usize, String> {
        let count = (length * (bend / (8.0 * self.tolerance_mm)).sqrt()).ceil();
        if count <= self.left as f64 { Ok((count as usize).max(1)) } else { Err(too_many()) }
    }

    fn along(&mut self, count: usize, to: DVec2, at: impl Fn(f64) -> DVec2) -> Result<(), String> {
        for k in 1..count {
            self.push(at(k as f64 / count as f64))?;
        }
        self.push(to)
    }
}

fn too_many() -> String {
    format!(
        "needs more than {MOST_POINTS} points, or has a coordinate that is no number; give a larger --tolerance, or fewer curves"
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Largest distance of points of a curve from a polyline.
    fn off(line: &[DVec2], at: impl Fn(f64) -> DVec2) -> f64 {
        let to_segment = |p: DVec2, w: &[DVec2]| {
            let d = w[1] - w[0];
            let along = if d == DVec2::ZERO { 0.0 } else { ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            p.distance(w[0] + d * along)
        };
        let distance = |p| line.windows(2).map(|w| to_segment(p, w)).fold(f64::INFINITY, f64::min);
        (0..=200).map(|k| distance(at(f64::from(k) / 200.0))).fold(0.0, f64::max)
    }

    fn point() -> impl Strategy<Value = DVec2> {
        (-50.0..50.0, -50.0..50.0).prop_map(|(x, y)| DVec2::new(x, y))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn no_curve_is_farther_from_its_polyline_than_the_tolerance(
            p in [point(), point(), point(), point()], start in -7.0..7.0_f64, sweep in -TAU..TAU, tolerance in 0.01..5.0
        ) {
            let [from, a, b, to] = p;
            let traced = |go: &dyn Fn(&mut Flattener)| {
                let mut flattener = Flattener::new(tolerance);
                flattener.move_to(from).unwrap();
                go(&mut flattener);
                flattener.take().remove(0)
            };
            let line = traced(&|f| f.cubic_to(a, b, to).unwrap());
            let bezier = |p: &[DVec2], t: f64| {
                let mut p = p.to_vec();
                while p.len() > 1 {
                    p = p.windows(2).map(|w| w[0].lerp(w[1], t)).collect();
                }
                p[0]
            };
            prop_assert!(off(&line, |t| bezier(&[from, a, b, to], t)) <= tolerance * (1.0 + 1e-9));
            let line = traced(&|f| f.quad_to(a, to).unwrap());
            prop_assert!(off(&line, |t| bezier(&[from, a, to], t)) <= tolerance * (1.0 + 1e-9));
            let at = |t: f64| b + a * (start + sweep * t).cos() + to * (start + sweep * t).sin();
            let mut flattener = Flattener::new(tolerance);
            flattener.move_to(at(0.0)).unwrap();
            flattener.arc_to(b, [a, to], start, sweep, at(1.0)).unwrap();
            let line = flattener.take().remove(0);
            prop_assert!(off(&line, at) <= tolerance * (1.0 + 1e-9) + 1e-9);
        }
    }

    #[test]
    fn a_circle_has_no_more_chords_than_it_needs() {
        let mut flattener = Flattener::new(0.01);
        let at = DVec2::new(10.0, 0.0);
        flattener.move_to(at).unwrap();
        flattener.arc_to(DVec2::ZERO, [at, DVec2::new(0.0, 10.0)], 0.0, TAU, at).unwrap();
        // An arc of r (1 - cos(h / 2)) = tolerance needs 71 of them.
        assert_eq!(flattener.take()[0].len(), 71 + 1);
    }

    #[test]
    fn dots_are_kept_and_places_that_are_only_gone_to_are_not() {
        let mut flattener = Flattener::new(0.01);
        let [a, b] = [DVec2::ZERO, DVec2::ONE];
        flattener.move_to(b).unwrap();
        flattener.move_to(a).unwrap();
        flattener.line_to(a).unwrap();
        flattener.line_to(a).unwrap();
        flattener.move_to(a).unwrap();
        flattener.line_to(b).unwrap();
        flattener.close().unwrap();
        flattener.line_to(b).unwrap();
        assert_eq!(flattener.take(), [vec![a, a], vec![a, b, a], vec![a, b]]);
    }

    #[test]
    fn what_is_no_place_or_too_much_is_refused() {
        let mut flattener = Flattener::new(1e-12);
        flattener.move_to(DVec2::ZERO).unwrap();
        assert!(flattener.quad_to(DVec2::splat(9e3), DVec2::X).unwrap_err().contains("more than 10000000 points"));
        assert!(flattener.quad_to(DVec2::NAN, DVec2::X).is_err());
        assert!(flattener.line_to(DVec2::splat(f64::NAN)).unwrap_err().contains("no paper is so large"));
        assert!(flattener.line_to(DVec2::splat(1e5)).is_err());
    }
}

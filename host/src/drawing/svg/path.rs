//! Path data.

use std::f64::consts::TAU;

use glam::{DAffine2, DMat2, DVec2};
use svgtypes::{PathParser, PathSegment};

use super::super::flatten::Flattener;

/// Why a path ends before its end.
pub(super) enum PathError {
    /// Its data cannot be read from there on; what was read before is drawn, as SVG wants it.
    Data,
    /// Its geometry is none for paper.
    Geometry(String),
}

impl From<String> for PathError {
    fn from(problem: String) -> Self {
        Self::Geometry(problem)
    }
}

/// Draws the path of some data (`d`), put on the paper by `place`.
pub(super) fn draw(data: &str, place: &DAffine2, out: &mut Flattener) -> Result<(), PathError> {
    let mut at = DVec2::ZERO;
    let mut first = DVec2::ZERO;
    // Where the control point before was, if it was one of a curve of the same degree: smooth curves mirror it.
    let (mut cubic, mut quad) = (None, None);
    let on = |p: DVec2| place.transform_point2(p);
    for segment in PathParser::from(data) {
        let segment = segment.map_err(|_| PathError::Data)?;
        let (last_cubic, last_quad) = (cubic.take(), quad.take());
        let origin = if is_absolute(&segment) { DVec2::ZERO } else { at };
        let to = |x: f64, y: f64| origin + DVec2::new(x, y);
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                at = to(x, y);
                first = at;
                out.move_to(on(at))?;
            }
            PathSegment::LineTo { x, y, .. } => {
                at = to(x, y);
                out.line_to(on(at))?;
            }
            PathSegment::HorizontalLineTo { x, .. } => {
                at.x = to(x, 0.0).x;
                out.line_to(on(at))?;
            }
            PathSegment::VerticalLineTo { y, .. } => {
                at.y = to(0.0, y).y;
                out.line_to(on(at))?;
            }
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => {
                let [a, b] = [to(x1, y1), to(x2, y2)];
                (at, cubic) = (to(x, y), Some(b));
                out.cubic_to(on(a), on(b), on(at))?;
            }
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
                let [a, b] = [last_cubic.map_or(at, |c| 2.0 * at - c), to(x2, y2)];
                (at, cubic) = (to(x, y), Some(b));
                out.cubic_to(on(a), on(b), on(at))?;
            }
            PathSegment::Quadratic { x1, y1, x, y, .. } => {
                let a = to(x1, y1);
                (at, quad) = (to(x, y), Some(a));
                out.quad_to(on(a), on(at))?;
            }
            PathSegment::SmoothQuadratic { x, y, .. } => {
                let a = last_quad.map_or(at, |c| 2.0 * at - c);
                (at, quad) = (to(x, y), Some(a));
                out.quad_to(on(a), on(at))?;
            }
            PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
                let from = at;
                at = to(x, y);
                let turn = x_axis_rotation.to_radians();
                match Arc::new(from, at, DVec2::new(rx, ry), turn, large_arc, sweep) {
                    Some(arc) => arc.draw(place, on(at), out)?,
                    None => out.line_to(on(at))?,
                }
            }
            PathSegment::ClosePath { .. } => {
                at = first;
                out.close()?;
            }
        }
    }
    Ok(())
}

fn is_absolute(segment: &PathSegment) -> bool {
    match *segment {
        PathSegment::MoveTo { abs, .. }
        | PathSegment::LineTo { abs, .. }
        | PathSegment::HorizontalLineTo { abs, .. }
        | PathSegment::VerticalLineTo { abs, .. }
        | PathSegment::CurveTo { abs, .. }
        | PathSegment::SmoothCurveTo { abs, .. }
        | PathSegment::Quadratic { abs, .. }
        | PathSegment::SmoothQuadratic { abs, .. }
        | PathSegment::EllipticalArc { abs, .. }
        | PathSegment::ClosePath { abs } => abs,
    }
}

/// A part of an ellipse: `centre + axes (cos t, sin t)`, from `start` by `sweep`.
pub(super) struct Arc {
    pub(super) centre: DVec2,
    pub(super) axes: [DVec2; 2],
    pub(super) start: f64,
    pub(super) sweep: f64,
}

impl Arc {
    /// From its ends, as path data says it (SVG 1.1, F.6.5 and F.6.6); none if it is a line.
    fn new(from: DVec2, to: DVec2, radii: DVec2, turn: f64, large: bool, positive: bool) -> Option<Self> {
        let mut radii = radii.abs();
        if from == to || !radii.cmpgt(DVec2::ZERO).all() {
            return None;
        }
        let turned = DMat2::from_angle(turn);
        let half = turned.transpose() * ((from - to) / 2.0);
        // On the unit circle; radii that are too small are made as large as they need to be.
        let mut unit = half / radii;
        let length = unit.length();
        if length > 1.0 {
            radii *= length;
            unit /= length;
        }
        let rest = (1.0 / unit.length_squared() - 1.0).max(0.0).sqrt();
        let side = if large == positive { -1.0 } else { 1.0 };
        let middle = DVec2::new(unit.y, -unit.x) * (side * rest);
        let centre = turned * (middle * radii) + (from + to) / 2.0;
        let [begin, end] = [unit - middle, -unit - middle];
        let mut sweep = begin.perp_dot(end).atan2(begin.dot(end));
        if positive && sweep < 0.0 {
            sweep += TAU;
        } else if !positive && sweep > 0.0 {
            sweep -= TAU;
        }
        let axes = [turned.x_axis * radii.x, turned.y_axis * radii.y];
        let arc = Self { centre, axes, start: begin.y.atan2(begin.x), sweep };
        arc.centre.is_finite().then_some(arc)
    }

    /// Draws it, from where it begins, to `end` on the paper.
    pub(super) fn draw(&self, place: &DAffine2, end: DVec2, out: &mut Flattener) -> Result<(), String> {
        let axes = self.axes.map(|axis| place.transform_vector2(axis));
        out.arc_to(place.transform_point2(self.centre), axes, self.start, self.sweep, end)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn lines(data: &str) -> Vec<Vec<DVec2>> {
        let mut out = Flattener::new(1.0);
        assert!(draw(data, &DAffine2::IDENTITY, &mut out).is_ok(), "{data}");
        out.take()
    }

    fn points(p: &[[f64; 2]]) -> Vec<DVec2> {
        p.iter().map(|&p| p.into()).collect()
    }

    #[test]
    fn every_command_goes_where_it_says() {
        let table: &[(&str, &[&[[f64; 2]]])] = &[
            ("M1 2 L3 4 5 6", &[&[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]]),
            ("m1 2 l3 4 5 6", &[&[[1.0, 2.0], [4.0, 6.0], [9.0, 12.0]]]),
            ("M1 1H5V6h-1v-2", &[&[[1.0, 1.0], [5.0, 1.0], [5.0, 6.0], [4.0, 6.0], [4.0, 4.0]]]),
            ("M1 1H2V2zm3 0h1", &[&[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 1.0]], &[[4.0, 1.0], [5.0, 1.0]]]),
            ("M1 1H2zV5", &[&[[1.0, 1.0], [2.0, 1.0], [1.0, 1.0]], &[[1.0, 1.0], [1.0, 5.0]]]),
            ("M1 1A0 5 0 0 1 3 3", &[&[[1.0, 1.0], [3.0, 3.0]]]),
            ("M1 1zzz", &[&[[1.0, 1.0], [1.0, 1.0]]]),
            // Flat enough to be chords.
            ("M0 0C1 0 2 0 3 0S5 0 6 0t1 0", &[&[[0.0, 0.0], [3.0, 0.0], [6.0, 0.0], [7.0, 0.0]]]),
        ];
        for (data, expected) in table {
            assert_eq!(lines(data), expected.iter().map(|p| points(p)).collect::<Vec<_>>(), "{data}");
        }
    }

    #[test]
    fn smooth_curves_go_on_in_their_direction() {
        let smooth = lines("M0 0Q50 100 100 0T200 0T300 0");
        assert_eq!(smooth, lines("M0 0Q50 100 100 0Q150 -100 200 0Q250 100 300 0"));
        assert_eq!(lines("M0 0c0 90 90 90 90 0s90 -90 90 0"), lines("M0 0C0 90 90 90 90 0C90 -90 180 -90 180 0"));
        // After a curve of another degree there is nothing to mirror.
        assert_eq!(lines("M0 0Q50 90 90 0S90 90 180 0"), lines("M0 0Q50 90 90 0C90 0 90 90 180 0"));
    }

    #[test]
    fn arcs_are_on_the_side_that_their_flags_say() {
        // Of radius 5 about (5, 0) or, with these ends, (0, 5).
        for (flags, centre, length) in
            [("0 1", [0.0, 5.0], 0.25), ("0 0", [5.0, 0.0], 0.25), ("1 1", [5.0, 0.0], 0.75), ("1 0", [0.0, 5.0], 0.75)]
        {
            let mut out = Flattener::new(1e-4);
            assert!(draw(&format!("M0 0A5 5 0 {flags} 5 5"), &DAffine2::IDENTITY, &mut out).is_ok());
            let line = out.take().remove(0);
            assert!(line.iter().all(|p| (p.distance(centre.into()) - 5.0).abs() < 1e-9), "{flags}: {line:?}");
            let ink: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
            assert!((ink - length * 10.0 * PI).abs() < 0.01, "{flags}: {ink}");
        }
        // Radii that are too small, and a turned ellipse as wide as its ends are apart.
        let half = lines("M0 0A1 1 0 0 1 60 0").remove(0);
        assert!(half.iter().all(|p| (p.distance(DVec2::new(30.0, 0.0)) - 30.0).abs() < 1e-9 && p.y < 1e-9), "{half:?}");
        let turned = lines("M0 0A30 60 90 0 0 120 0").remove(0);
        assert!(turned.iter().all(|p| (((p.x - 60.0) / 60.0).hypot(p.y / 30.0) - 1.0).abs() < 1e-9), "{turned:?}");
    }

    #[test]
    fn a_path_ends_where_its_data_cannot_be_read() {
        let mut out = Flattener::new(1.0);
        assert!(matches!(draw("M1 1L2 2Lx", &DAffine2::IDENTITY, &mut out), Err(PathError::Data)));
        assert_eq!(out.take(), [points(&[[1.0, 1.0], [2.0, 2.0]])]);
        assert!(matches!(draw("M1 1L2e9 2", &DAffine2::IDENTITY, &mut out), Err(PathError::Geometry(_))));
    }
}

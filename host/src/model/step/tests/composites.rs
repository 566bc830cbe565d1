//! Edges along composite curves.

use super::*;

impl Text {
    fn line(&mut self, a: [f64; 3], b: [f64; 3]) -> usize {
        let (p, d) = (self.point(a), self.direction([b[0] - a[0], b[1] - a[1], b[2] - a[2]]));
        let vector = self.add(format!("VECTOR('',#{d},1.)"));
        let line = self.add(format!("LINE('',#{p},#{vector})"));
        self.part(line, a, b)
    }

    /// The part of a curve between two points.
    fn part(&mut self, curve: usize, a: [f64; 3], b: [f64; 3]) -> usize {
        let ends = [a, b].map(|p| self.point(p));
        self.add(format!("TRIMMED_CURVE('',#{curve},(#{}),(#{}),.T.,.CARTESIAN.)", ends[0], ends[1]))
    }

    fn composite(&mut self, curves: &[(usize, bool)]) -> usize {
        let segments: Vec<String> = curves
            .iter()
            .map(|&(curve, forward)| {
                let sense = if forward { "T" } else { "F" };
                format!("#{}", self.add(format!("COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.{sense}.,#{curve})")))
            })
            .collect();
        self.add(format!("COMPOSITE_CURVE('',({}),.F.)", segments.join(",")))
    }
}

/// A plate with one round end: its long way round, from (0, 0) over (2, 0) and the half circle to (2, 2) and (0, 2), is one edge
/// of a line, an arc and a line that is given the other way round; the first of its lines ends `off`.
fn plate(off: f64) -> Result<Import, ReadError> {
    let mut text = Text::default();
    let v = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]].map(|p| text.vertex(p));
    let frame = text.frame([2.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let circle = text.add(format!("CIRCLE('',#{frame},1.)"));
    let curves = [
        (text.line([0.0; 3], [2.0 - off, 0.0, 0.0]), true),
        (text.part(circle, [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]), true),
        (text.line([0.0, 2.0, 0.0], [2.0, 2.0, 0.0]), false),
    ];
    let long = text.composite(&curves);
    let edges = [(text.edge(v, long), true), (text.straight([v[1], v[0]]), true)];
    let frame = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let plane = text.add(format!("PLANE('',#{frame})"));
    let face = text.face(plane, &[&edges], true);
    let (context, shell) = (text.millimetres(), text.shell(&[face]));
    text.representation(&[shell], context);
    text.read()
}

#[test]
fn an_edge_of_lines_and_an_arc_is_where_these_are() {
    // A file rounds; a joint is where the one before it ends.
    for off in [0.0, 1e-7] {
        let import = plate(off).unwrap();
        assert!(import.report.problems.is_empty(), "{:?}", import.report);
        let surface = &import.scene.surfaces[0];
        let mut length = 0.0;
        for piece in surface.trims.as_ref().unwrap().loops().iter().flat_map(|l| l.pieces()) {
            let at = |k: u32| {
                let uv = piece.eval(f64::from(k) / 64.0);
                surface.surface.eval(uv.x, uv.y)
            };
            for k in 0..64 {
                let (p, next) = (at(k), at(k + 1));
                length += p.distance(next);
                let centre = DVec3::new(2.0, 1.0, 0.0);
                let away = if p.x > 2.0 { p.distance(centre) - 1.0 } else { p.x.min(p.y).min(2.0 - p.y) };
                assert!(away.abs() < 2e-7, "{p}");
            }
        }
        assert!((length - 6.0 - std::f64::consts::PI).abs() < 1e-3, "{length}");
    }
}

#[test]
fn a_gap_between_its_curves_is_told_by_its_segment() {
    let told = match plate(1e-3) {
        Ok(import) => import.report.problems.join("\n"),
        Err(error) => error.to_string(),
    };
    assert!(told.contains("COMPOSITE_CURVE_SEGMENT") && told.contains("begins 1.000e-3 from where"), "{told}");
}

#[test]
fn a_composite_curve_of_itself_is_refused() {
    let mut text = Text::default();
    let v = text.vertex([0.0; 3]);
    let composite = text.composite(&[(99, true)]);
    text.data = text.data.replace("#99)", &format!("#{composite})"));
    let edge = text.edge([v, v], composite);
    let frame = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let plane = text.add(format!("PLANE('',#{frame})"));
    let face = text.face(plane, &[&[(edge, true)]], true);
    let (context, shell) = (text.millimetres(), text.shell(&[face]));
    text.representation(&[shell], context);
    let told = match text.read() {
        Ok(import) => import.report.problems.join("\n"),
        Err(error) => error.to_string(),
    };
    assert!(told.contains("one is defined by itself"), "{told}");
}

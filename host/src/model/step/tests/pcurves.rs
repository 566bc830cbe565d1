//! Faces whose edges have parameter curves.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;
use penvis_core::nurbs::{Curve, KnotVector};
use penvis_core::shape::{self, Frame};
use penvis_core::trim::TrimPiece;

use super::super::parameters::Parameters;
use super::super::units::Units;
use super::*;

impl Text {
    fn point2(&mut self, p: [f64; 2]) -> usize {
        self.add(format!("CARTESIAN_POINT('',({:?},{:?}))", p[0], p[1]))
    }

    /// A line of parameters through `p`, whose own parameter runs by `d`.
    fn line2(&mut self, p: [f64; 2], d: [f64; 2]) -> usize {
        let p = self.point2(p);
        let direction = self.add(format!("DIRECTION('',({:?},{:?}))", d[0], d[1]));
        let vector = self.add(format!("VECTOR('',#{direction},{:?})", d[0].hypot(d[1])));
        self.add(format!("LINE('',#{p},#{vector})"))
    }

    /// A Bézier curve with these points over an interval.
    fn bezier(&mut self, points: &[usize], [a, b]: [f64; 2]) -> usize {
        let (list, degree) = (numbers(points), points.len() - 1);
        let multiple = degree + 1;
        self.add(format!(
            "B_SPLINE_CURVE_WITH_KNOTS('',{degree},({list}),.UNSPECIFIED.,.F.,.F.,({multiple},{multiple}),({a:?},{b:?}),.UNSPECIFIED.)"
        ))
    }

    fn bezier2(&mut self, points: &[[f64; 2]], domain: [f64; 2]) -> usize {
        let points: Vec<usize> = points.iter().map(|p| self.point2(*p)).collect();
        self.bezier(&points, domain)
    }

    /// A curve in space with the curves that it is in the parameters of surfaces.
    fn with_parameter_curves(&mut self, kind: &str, curve: usize, on: &[(usize, usize)]) -> usize {
        let context = self.add("GEOMETRIC_REPRESENTATION_CONTEXT('','',2)");
        let pcurves: Vec<usize> = on
            .iter()
            .map(|(surface, item)| {
                let definition = self.add(format!("DEFINITIONAL_REPRESENTATION('',(#{item}),#{context})"));
                self.add(format!("PCURVE('',#{surface},#{definition})"))
            })
            .collect();
        self.add(format!("{kind}('',#{curve},({}),.PCURVE_S1.)", numbers(&pcurves)))
    }
}

fn numbers(of: &[usize]) -> String {
    of.iter().map(|k| format!("#{k}")).collect::<Vec<_>>().join(",")
}

fn pieces(surface: &SceneSurface) -> Vec<&TrimPiece> {
    surface.trims.as_ref().unwrap().loops().iter().flat_map(|l| l.pieces()).collect()
}

/// The corners of a triangle in the parameters of the saddle S(u, v) = (u, v, u·v), 0 ≤ u ≤ 2, 0 ≤ v ≤ 3.
const CORNERS: [[f64; 2]; 3] = [[0.2, 0.3], [1.7, 0.6], [0.9, 2.5]];

/// The part of the saddle inside a triangle; `sides` are the parameter curves of its sides, of which none may be left out.
fn saddle(sides: impl Fn(&mut Text) -> [usize; 3]) -> Import {
    let mut text = Text::default();
    let corners = [[0.0, 0.0], [0.0, 3.0], [2.0, 0.0], [2.0, 3.0]].map(|[u, v]| text.point([u, v, u * v]));
    let surface = text.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#{},#{}),(#{},#{})),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,2.),(0.,3.),.UNSPECIFIED.)",
        corners[0], corners[1], corners[2], corners[3]
    ));
    let vertices = CORNERS.map(|[u, v]| text.vertex([u, v, u * v]));
    let items = sides(&mut text);
    let edges: Vec<(usize, bool)> = (0..3)
        .map(|k| {
            let ([a, b], [c, d]) = (CORNERS[k], CORNERS[(k + 1) % 3]);
            // Over a line the saddle is quadratic.
            let middle = text.point([0.5 * (a + c), 0.5 * (b + d), 0.5 * (a * d + c * b)]);
            let points = [text.point([a, b, a * b]), middle, text.point([c, d, c * d])];
            let curve = text.bezier(&points, [0.0, 1.0]);
            let curve = text.with_parameter_curves("SURFACE_CURVE", curve, &[(surface, items[k])]);
            (text.edge([vertices[k], vertices[(k + 1) % 3]], curve), true)
        })
        .collect();
    let face = text.face(surface, &[&edges], true);
    let (context, shell) = (text.millimetres(), text.shell(&[face]));
    text.representation(&[shell], context);
    text.read().unwrap()
}

/// A line through two corners with the parameter 0 and 1 there, moved by `off` in v.
fn straight(text: &mut Text, k: usize, off: f64) -> usize {
    let ([a, b], [c, d]) = (CORNERS[k], CORNERS[(k + 1) % 3]);
    text.line2([a, b + off], [c - a, d - b])
}

fn middle(k: usize) -> DVec2 {
    0.5 * (DVec2::from(CORNERS[k]) + DVec2::from(CORNERS[(k + 1) % 3]))
}

#[test]
fn trims_are_the_parameter_curves_of_the_file_where_these_are_where_the_edges_are() {
    // One bent by less than the tolerance, which is some 6e-6 here, so that it is told from the image of the edge, and with
    // another parameter; and one that is a part of a longer one, with nearly the same parameter.
    let bend = 2e-6;
    let import = saddle(|text| {
        let [[a, b], [c, d]] = [CORNERS[1], CORNERS[2]];
        let bent = text.bezier2(&[[a, b], [0.5 * (a + c), 0.5 * (b + d) + bend], [c, d]], [5.0, 7.0]);
        let [[a, b], [c, d]] = [CORNERS[2], CORNERS[0]];
        let (x, y) = (c - a, d - b);
        let longer = [[a - 0.2 * x, b - 0.2 * y], [0.5 * (a + c), 0.5 * (b + d)], [c + 0.2 * x, d + 0.2 * y]];
        [straight(text, 0, 0.0), bent, text.bezier2(&longer, [-0.21, 1.19])]
    });
    assert!(import.report.healed.is_empty() && import.report.problems.is_empty(), "{:?}", import.report);
    let found = pieces(&import.scene.surfaces[0]);
    assert_eq!(found.len(), 3);
    let expected = [middle(0), middle(1) + DVec2::Y * 0.5 * bend, middle(2)];
    for (piece, expected) in found.iter().zip(expected) {
        assert!(piece.eval(0.5).distance(expected) < 1e-9, "{} {expected}", piece.eval(0.5));
    }
}

#[test]
fn a_parameter_curve_that_is_elsewhere_is_told_and_the_edge_pulled_back() {
    let off = 1e-3;
    let import = saddle(|text| [straight(text, 0, 0.0), straight(text, 1, off), straight(text, 2, 0.0)]);
    let [healed] = import.report.healed.as_slice() else { panic!("{:?}", import.report) };
    let (count, rest) = healed.split_once(" parameter curves that are up to ").unwrap();
    let distance: f64 = rest.split_once(" mm from their edges were left out").unwrap().0.parse().unwrap();
    // Beside the line by the distance to the next point of the curve: less than by v alone.
    assert!(count == "1" && 0.1 * off < distance && distance < 3.0 * off, "{healed}");
    assert!(is_triangle(&import.scene.surfaces[0]));
}

/// Whether the trims are the triangle between the corners, within the tolerance.
fn is_triangle(surface: &SceneSurface) -> bool {
    let off = |p: DVec2| {
        let side = |k: usize| {
            let (a, b) = (DVec2::from(CORNERS[k]), DVec2::from(CORNERS[(k + 1) % 3]));
            (p - a).perp_dot((b - a).normalize()).abs()
        };
        (0..3).map(side).fold(f64::INFINITY, f64::min)
    };
    let found = pieces(surface);
    let bounds = surface.trims.as_ref().unwrap().bounds();
    found.len() >= 3
        && found.iter().all(|p| (0..=8).all(|k| off(p.eval(f64::from(k) / 8.0)) < 1e-5))
        && bounds.0.distance(DVec2::new(0.2, 0.3)) < 1e-5
        && bounds.1.distance(DVec2::new(1.7, 2.5)) < 1e-5
}

#[test]
fn a_parameter_curve_that_is_none_is_told_and_the_edge_pulled_back() {
    let import = saddle(|text| {
        let points = [CORNERS[1], CORNERS[2]].map(|[u, v]| text.point([u, v, 0.0]));
        [straight(text, 0, 0.0), text.bezier(&points, [0.0, 1.0]), straight(text, 2, 0.0)]
    });
    let [healed] = import.report.healed.as_slice() else { panic!("{:?}", import.report) };
    assert!(
        healed.starts_with("1 parameter curves were not understood") && healed.contains("two coordinates"),
        "{healed}"
    );
    assert!(is_triangle(&import.scene.surfaces[0]));
}

/// A plate with a round hole, in centimetres and degrees, and in a plane whose axes are not its sides.
#[test]
fn on_a_plane_parameters_are_lengths() {
    let (side, radius, smaller) = (2.0, 0.5, 0.5 - 1e-6);
    let mut text = Text::default();
    let origin = DVec2::new(0.3, -0.2);
    let x = DVec2::new(0.6, 0.8);
    // In the axes of the plane.
    let own = |p: DVec2| [(p - origin).dot(x), (p - origin).dot(x.perp())];
    let turned = |d: DVec2| [d.dot(x), d.dot(x.perp())];
    let frame = text.frame([origin.x, origin.y, 0.0], [0.0, 0.0, 1.0], [x.x, x.y, 0.0]);
    let plane = text.add(format!("PLANE('',#{frame})"));
    let corners = [DVec2::ZERO, DVec2::X * side, DVec2::splat(side), DVec2::Y * side];
    let vertices = corners.map(|p| text.vertex([p.x, p.y, 0.0]));
    let mut outer = Vec::new();
    for k in 0..4 {
        let (a, d) = (corners[k], corners[(k + 1) % 4] - corners[k]);
        let (p, direction) = (text.point([a.x, a.y, 0.0]), text.direction([d.x, d.y, 0.0]));
        let vector = text.add(format!("VECTOR('',#{direction},1.)"));
        let line = text.add(format!("LINE('',#{p},#{vector})"));
        let image = text.line2(own(a), turned(d.normalize()));
        let curve = text.with_parameter_curves("SURFACE_CURVE", line, &[(plane, image)]);
        outer.push((text.edge([vertices[k], vertices[(k + 1) % 4]], curve), true));
    }
    let start = text.vertex([1.0 + radius, 1.0, 0.0]);
    let round = text.frame([1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let circle = text.add(format!("CIRCLE('',#{round},{radius:?})"));
    let (centre, axis) = (text.point2(own(DVec2::ONE)), turned(DVec2::X));
    let axis = text.add(format!("DIRECTION('',({:?},{:?}))", axis[0], axis[1]));
    let placed = text.add(format!("AXIS2_PLACEMENT_2D('',#{centre},#{axis})"));
    let image = text.add(format!("CIRCLE('',#{placed},{smaller:?})"));
    let circle = text.with_parameter_curves("SURFACE_CURVE", circle, &[(plane, image)]);
    let hole = text.edge([start, start], circle);
    let face = text.face(plane, &[&outer, &[(hole, false)]], true);
    let shell = text.shell(&[face]);
    let context = centimetres_and_degrees(&mut text);
    text.representation(&[shell], context);
    let import = text.read().unwrap();
    assert!(import.report.healed.is_empty() && import.report.problems.is_empty(), "{:?}", import.report);
    let surface = &import.scene.surfaces[0];
    let on_hole: Vec<f64> = pieces(surface)
        .iter()
        .flat_map(|p| [0.2, 0.5, 0.9].map(|s| p.eval(s)))
        .map(|uv| surface.surface.eval(uv.x, uv.y).distance(DVec3::new(10.0, 10.0, 0.0)))
        .filter(|d| *d < 8.0)
        .collect();
    assert_eq!(on_hole.len(), 12);
    assert!(on_hole.iter().all(|d| (d - 10.0 * smaller).abs() < 1e-12), "{on_hole:?}");
}

fn centimetres_and_degrees(text: &mut Text) -> usize {
    let radian = text.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))");
    let degree = text.add(format!("PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925),#{radian})"));
    text.context(
        "(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.))",
        &format!("(CONVERSION_BASED_UNIT('DEGREE',#{degree}) NAMED_UNIT(*) PLANE_ANGLE_UNIT())"),
    )
}

/// The side of a cylinder, in degrees, whose upper circle has the height `upper` among the parameters.
fn tube_in_degrees(upper: f64) -> Import {
    let (radius, height) = (1.5, 4.0);
    let mut text = Text::default();
    let frame = text.frame([0.0; 3], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let surface = text.add(format!("CYLINDRICAL_SURFACE('',#{frame},{radius:?})"));
    let v = [text.vertex([radius, 0.0, 0.0]), text.vertex([radius, 0.0, height])];
    let circles = [0, 1].map(|k| {
        let frame = text.frame([0.0, 0.0, height * k as f64], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let circle = text.add(format!("CIRCLE('',#{frame},{radius:?})"));
        // The x axis of the cylinder is a quarter turn on.
        let image = text.line2([-90.0, upper * k as f64], [1.0, 0.0]);
        let circle = text.with_parameter_curves("SURFACE_CURVE", circle, &[(surface, image)]);
        text.edge([v[k], v[k]], circle)
    });
    let (p, d) = (text.point([radius, 0.0, 0.0]), text.direction([0.0, 0.0, 1.0]));
    let vector = text.add(format!("VECTOR('',#{d},1.)"));
    let line = text.add(format!("LINE('',#{p},#{vector})"));
    let sides = [-90.0, 270.0].map(|u| (surface, text.line2([u, 0.0], [0.0, 1.0])));
    let seam = text.with_parameter_curves("SEAM_CURVE", line, &sides);
    let seam = text.edge(v, seam);
    let face = text.face(surface, &[&[(circles[0], true), (seam, true), (circles[1], false), (seam, false)]], true);
    let shell = text.shell(&[face]);
    let context = centimetres_and_degrees(&mut text);
    text.representation(&[shell], context);
    text.read().unwrap()
}

#[test]
fn on_a_cylinder_parameters_are_an_angle_and_a_length() {
    let import = tube_in_degrees(4.0);
    assert!(import.report.healed.is_empty() && import.report.problems.is_empty(), "{:?}", import.report);
    assert!(import.scene.surfaces[0].trims.as_ref().unwrap().is_whole());
    let import = tube_in_degrees(3.9);
    assert_eq!(
        import.report.healed,
        ["1 parameter curves that are up to 1.000e0 mm from their edges were left out, and the edges pulled back"]
    );
    assert!(import.scene.surfaces[0].trims.as_ref().unwrap().is_whole());
}

/// Curves over isoparametric lines of what is round, by the equations of the standard.
#[test]
fn lines_of_constant_parameters_are_circles_and_straight_lines() {
    let frame = Frame::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 2.0), DVec3::X).unwrap();
    let [x, y, z] = frame.axes();
    let out = |u: f64| x * u.cos() + y * u.sin();
    let units = Units::default();
    let cone = Parameters::Cone { frame, radius: 2.0, slope: 0.5 };
    let torus = Parameters::Torus { frame, major: 3.0, minor: 1.0 };
    let on_cone = |u: f64, v: f64| frame.origin() + out(u) * (2.0 + 0.5 * v) + z * v;
    let on_torus = |u: f64, v: f64| frame.origin() + out(u) * (3.0 + v.cos()) + z * v.sin();
    for (a, b) in
        [([0.3, 1.0], [0.3, -2.0]), ([0.3, 1.0], [4.0, 1.0]), ([4.0, 1.0], [0.3, 1.0]), ([0.5, 0.2], [0.5, 3.0])]
    {
        let image = shape::line(DVec3::new(a[0], a[1], 0.0), DVec3::new(b[0], b[1], 0.0)).unwrap();
        for (parameters, at) in [(cone, &on_cone as &dyn Fn(f64, f64) -> DVec3), (torus, &on_torus)] {
            let lifted = parameters.lifted(&image, &units).unwrap();
            let [t0, t1] = lifted.domain();
            // Arcs have their middle angle in the middle of their parameter.
            for (t, s) in [(t0, 0.0), (0.5 * (t0 + t1), 0.5), (t1, 1.0)] {
                let expected = at(a[0] + (b[0] - a[0]) * s, a[1] + (b[1] - a[1]) * s);
                assert!(lifted.eval(t).distance(expected) < 1e-12, "{parameters:?} {a:?} {b:?} {s}");
            }
        }
    }
    // What is not such a line is no curve that could be written down.
    let knots = KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let slanted =
        Curve::new(knots, vec![DVec3::ZERO.extend(1.0), DVec3::new(FRAC_PI_2, 1.0, 0.0).extend(1.0)]).unwrap();
    assert!(cone.lifted(&slanted, &units).is_none() && torus.lifted(&slanted, &units).is_none());
}

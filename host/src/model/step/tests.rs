//! Small files made here, whose drawings are known.

use std::fmt::Write as _;

use glam::DVec3;
use penvis_core::scene::SceneSurface;

use super::*;

mod composites;
mod pcurves;

/// A file's entities as they are written.
#[derive(Default)]
struct Text {
    data: String,
    count: usize,
}

impl Text {
    /// Adds an entity; its number.
    fn add(&mut self, entity: impl AsRef<str>) -> usize {
        self.count += 1;
        writeln!(self.data, "#{} = {};", self.count, entity.as_ref()).unwrap();
        self.count
    }

    fn point(&mut self, p: [f64; 3]) -> usize {
        self.add(format!("CARTESIAN_POINT('',({:?},{:?},{:?}))", p[0], p[1], p[2]))
    }

    fn direction(&mut self, d: [f64; 3]) -> usize {
        self.add(format!("DIRECTION('',({:?},{:?},{:?}))", d[0], d[1], d[2]))
    }

    fn vertex(&mut self, p: [f64; 3]) -> usize {
        let point = self.point(p);
        self.add(format!("VERTEX_POINT('',#{point})"))
    }

    fn frame(&mut self, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> usize {
        let (o, z, x) = (self.point(origin), self.direction(z), self.direction(x));
        self.add(format!("AXIS2_PLACEMENT_3D('',#{o},#{z},#{x})"))
    }

    fn edge(&mut self, ends: [usize; 2], curve: usize) -> usize {
        self.add(format!("EDGE_CURVE('',#{},#{},#{curve},.T.)", ends[0], ends[1]))
    }

    fn straight(&mut self, ends: [usize; 2]) -> usize {
        // Where a line passes and how its parameter runs says nothing of an edge that is straight.
        let (p, d) = (self.point([0.0; 3]), self.direction([1.0, 0.0, 0.0]));
        let vector = self.add(format!("VECTOR('',#{d},1.)"));
        let line = self.add(format!("LINE('',#{p},#{vector})"));
        self.edge(ends, line)
    }

    /// A face of loops of edges, each with whether it runs forward.
    fn face(&mut self, surface: usize, loops: &[&[(usize, bool)]], same_sense: bool) -> usize {
        let mut bounds = Vec::new();
        for edges in loops {
            let oriented: Vec<String> = edges
                .iter()
                .map(|&(e, forward)| {
                    let flag = if forward { "T" } else { "F" };
                    format!("#{}", self.add(format!("ORIENTED_EDGE('',*,*,#{e},.{flag}.)")))
                })
                .collect();
            let ring = self.add(format!("EDGE_LOOP('',({}))", oriented.join(",")));
            bounds.push(format!("#{}", self.add(format!("FACE_BOUND('',#{ring},.T.)"))));
        }
        let sense = if same_sense { "T" } else { "F" };
        self.add(format!("ADVANCED_FACE('',({}),#{surface},.{sense}.)", bounds.join(",")))
    }

    /// A context with these units of length and angle.
    fn context(&mut self, length: &str, angle: &str) -> usize {
        let (length, angle) = (self.add(length), self.add(angle));
        self.add(format!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle})) REPRESENTATION_CONTEXT('',''))"
        ))
    }

    fn millimetres(&mut self) -> usize {
        self.context(
            "(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))",
            "(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))",
        )
    }

    fn representation(&mut self, items: &[usize], context: usize) -> usize {
        let items: Vec<String> = items.iter().map(|i| format!("#{i}")).collect();
        self.add(format!("SHAPE_REPRESENTATION('',({}),#{context})", items.join(",")))
    }

    fn shell(&mut self, faces: &[usize]) -> usize {
        let faces: Vec<String> = faces.iter().map(|i| format!("#{i}")).collect();
        let shell = self.add(format!("OPEN_SHELL('',({}))", faces.join(",")));
        self.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"))
    }

    fn whole(&self) -> String {
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
             FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
            self.data
        )
    }

    fn read(&self) -> Result<Import, ReadError> {
        let mut source = Source::from_bytes("part", self.whole().into_bytes()).unwrap();
        assert!((FORMAT.looks_like)(&source));
        read(&mut source, &Reading::new(&()))
    }
}

/// A square of side `a` in the plane z = 0, with its corner in the origin.
fn square(text: &mut Text, a: f64) -> usize {
    let v = [[0.0, 0.0], [a, 0.0], [a, a], [0.0, a]].map(|[x, y]| text.vertex([x, y, 0.0]));
    let edges: Vec<(usize, bool)> = (0..4).map(|k| (text.straight([v[k], v[(k + 1) % 4]]), true)).collect();
    let frame = text.frame([5.0, 7.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
    let plane = text.add(format!("PLANE('',#{frame})"));
    text.face(plane, &[&edges], true)
}

/// The lateral face of a cylinder from z = 0 to `height`, with its seam at x = `radius`, and the edges of its circles.
fn tube(text: &mut Text, radius: f64, height: f64) -> (usize, [usize; 2]) {
    let v = [text.vertex([radius, 0.0, 0.0]), text.vertex([radius, 0.0, height])];
    let circles = [0, 1].map(|k| {
        let frame = text.frame([0.0, 0.0, height * k as f64], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let circle = text.add(format!("CIRCLE('',#{frame},{radius:?})"));
        text.edge([v[k], v[k]], circle)
    });
    let seam = text.straight(v);
    let frame = text.frame([0.0, 0.0, 3.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let surface = text.add(format!("CYLINDRICAL_SURFACE('',#{frame},{radius:?})"));
    let face = text.face(surface, &[&[(circles[0], true), (seam, true), (circles[1], false), (seam, false)]], true);
    (face, circles)
}

/// The box of the control points of what is drawn, and whether each surface is whole.
fn extent(surfaces: &[SceneSurface]) -> ([f64; 3], [f64; 3]) {
    let points = surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
    let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    (lo.to_array(), hi.to_array())
}

fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
    DVec3::from(a).distance(DVec3::from(b)) < 1e-9
}

#[test]
fn a_square_and_a_tube_are_whole_surfaces() {
    let mut text = Text::default();
    let (face, (tube, _)) = (square(&mut text, 2.0), tube(&mut text, 1.5, 4.0));
    let (context, shell) = (text.millimetres(), text.shell(&[face, tube]));
    text.representation(&[shell], context);
    let import = text.read().unwrap();
    assert_eq!(import.report.unit.as_deref(), Some("millimetre"));
    assert_eq!(
        import.report.kinds.iter().map(|(k, n)| (k.as_str(), *n)).collect::<Vec<_>>(),
        [("cylinder", 1), ("plane", 1)]
    );
    assert!(import.report.problems.is_empty() && import.report.healed.is_empty(), "{:?}", import.report);
    let surfaces = &import.scene.surfaces;
    assert!(surfaces.iter().all(|s| s.trims.as_ref().is_some_and(|t| t.is_whole())));
    let (lo, hi) = extent(&surfaces[..1]);
    assert!(is_near(lo, [0.0; 3]) && is_near(hi, [2.0, 2.0, 0.0]), "{lo:?} {hi:?}");
    let (lo, hi) = extent(&surfaces[1..]);
    assert!(is_near(lo, [-1.5, -1.5, 0.0]) && is_near(hi, [1.5, 1.5, 4.0]), "{lo:?} {hi:?}");
}

#[test]
fn lengths_are_millimetres_and_angles_radians() {
    let mut text = Text::default();
    let face = square(&mut text, 2.0);
    let shell = text.shell(&[face]);
    // Inches as they are written: by a measure that itself has a unit.
    let metre = text.add("(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))");
    let inch = text.add(format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{metre})"));
    let radian = text.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))");
    let degree = text.add(format!("PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.01745329),#{radian})"));
    let context = text.context(
        &format!("(CONVERSION_BASED_UNIT('INCH',#{inch}) LENGTH_UNIT() NAMED_UNIT(*))"),
        &format!("(CONVERSION_BASED_UNIT('DEGREE',#{degree}) NAMED_UNIT(*) PLANE_ANGLE_UNIT())"),
    );
    text.representation(&[shell], context);
    let import = text.read().unwrap();
    assert_eq!(import.report.unit.as_deref(), Some("inch"));
    let (_, hi) = extent(&import.scene.surfaces);
    assert!(is_near(hi, [50.8, 50.8, 0.0]), "{hi:?}");
}

/// A cone with its apex, in degrees: the part of it from the apex to a circle.
#[test]
fn a_cone_ends_in_its_apex() {
    let mut text = Text::default();
    let v = text.vertex([1.0, 0.0, 0.0]);
    let frame = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let circle = text.add(format!("CIRCLE('',#{frame},1.)"));
    let edge = text.edge([v, v], circle);
    // It widens downwards: 45 degrees, radius 2 at z = -1.
    let frame = text.frame([0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]);
    let cone = text.add(format!("CONICAL_SURFACE('',#{frame},2.,45.)"));
    let apex = text.vertex([0.0, 0.0, 1.0]);
    let ring = text.add(format!("VERTEX_LOOP('',#{apex})"));
    let face = text.face(cone, &[&[(edge, true)]], true);
    let bound = text.add(format!("FACE_BOUND('',#{ring},.T.)"));
    let old = format!("#{face} = ADVANCED_FACE('',(");
    text.data = text.data.replace(&old, &format!("{old}#{bound},"));
    let shell = text.shell(&[face]);
    let radian = text.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))");
    let degree = text.add(format!("PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925),#{radian})"));
    let context = text.context(
        "(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))",
        &format!("(CONVERSION_BASED_UNIT('DEGREE',#{degree}) NAMED_UNIT(*) PLANE_ANGLE_UNIT())"),
    );
    text.representation(&[shell], context);
    let import = text.read().unwrap();
    let (lo, hi) = extent(&import.scene.surfaces);
    assert!(is_near(lo, [-1.0, -1.0, 0.0]) && is_near(hi, [1.0, 1.0, 1.0]), "{lo:?} {hi:?} {:?}", import.report);
    assert!(import.scene.surfaces[0].trims.as_ref().unwrap().is_whole());
}

/// Half a sphere, its loop the equator, or that and its pole.
#[test]
fn what_is_left_of_the_equator_is_one_half_of_a_sphere() {
    for same_sense in [true, false] {
        let mut text = Text::default();
        let v = text.vertex([2.0, 0.0, 0.0]);
        let frame = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let circle = text.add(format!("CIRCLE('',#{frame},2.)"));
        let edge = text.edge([v, v], circle);
        let sphere = text.add(format!("SPHERICAL_SURFACE('',#{frame},2.)"));
        let face = text.face(sphere, &[&[(edge, true)]], same_sense);
        let (context, shell) = (text.millimetres(), text.shell(&[face]));
        text.representation(&[shell], context);
        let import = text.read().unwrap();
        let (lo, hi) = extent(&import.scene.surfaces);
        // Seen from outside the loop runs round the upper half; from inside round the lower one.
        let z = if same_sense { [0.0, 2.0] } else { [-2.0, 0.0] };
        assert!((lo[2] - z[0]).abs() < 1e-9 && (hi[2] - z[1]).abs() < 1e-9, "{lo:?} {hi:?} {:?}", import.report);
    }
}

#[test]
fn components_stand_where_they_are_placed() {
    let mut text = Text::default();
    let face = square(&mut text, 2.0);
    let shell = text.shell(&[face]);
    let context = text.millimetres();
    let own = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let part = text.representation(&[own, shell], context);
    // One turned upright and moved, one at the side of it, in an assembly in centimetres.
    let upright = text.frame([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
    let aside = text.frame([0.0, 3.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let centimetres = text.context(
        "(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.CENTI.,.METRE.))",
        "(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))",
    );
    let whole = text.representation(&[upright, aside], centimetres);
    for place in [upright, aside] {
        let map = text.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{own},#{place})"));
        text.add(format!(
            "(REPRESENTATION_RELATIONSHIP('','',#{part},#{whole}) REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{map}) SHAPE_REPRESENTATION_RELATIONSHIP())"
        ));
    }
    let import = text.read().unwrap();
    let surfaces = &import.scene.surfaces;
    assert_eq!(surfaces.len(), 2, "{:?}", import.report);
    let (lo, hi) = extent(&surfaces[..1]);
    assert!(is_near(lo, [10.0, 0.0, 0.0]) && is_near(hi, [12.0, 0.0, 2.0]), "{lo:?} {hi:?}");
    let (lo, hi) = extent(&surfaces[1..]);
    assert!(is_near(lo, [-2.0, 30.0, 0.0]) && is_near(hi, [0.0, 32.0, 0.0]), "{lo:?} {hi:?}");
    // Both have edges of their own.
    let edges = |s: &SceneSurface| -> Vec<u32> {
        let loops = s.trims.as_ref().unwrap().loops();
        loops.iter().flat_map(|l| l.pieces()).filter_map(|p| p.edge()).collect()
    };
    assert!(edges(&surfaces[0]).iter().all(|e| !edges(&surfaces[1]).contains(e)));
}

#[test]
fn a_component_of_itself_is_refused() {
    let mut text = Text::default();
    let face = square(&mut text, 2.0);
    let shell = text.shell(&[face]);
    let context = text.millimetres();
    let own = text.frame([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let root = text.representation(&[own], context);
    let a = text.representation(&[own, shell], context);
    let b = text.representation(&[own], context);
    let map = text.add(format!("ITEM_DEFINED_TRANSFORMATION('','',#{own},#{own})"));
    for [inner, outer] in [[a, root], [a, b], [b, a]] {
        text.add(format!(
            "(REPRESENTATION_RELATIONSHIP('','',#{inner},#{outer}) REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{map}) SHAPE_REPRESENTATION_RELATIONSHIP())"
        ));
    }
    let message = text.read().unwrap_err().to_string();
    assert!(message.contains("a component 64 deep, or of itself"), "{message}");
}

#[test]
fn polygons_share_the_sides_between_the_same_points() {
    let mut text = Text::default();
    let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
        .map(|p| text.point(p));
    let mut facet = |corners: [usize; 4], z: [f64; 3]| {
        let list: Vec<String> = corners.iter().map(|&k| format!("#{}", p[k])).collect();
        let ring = text.add(format!("POLY_LOOP('',({}))", list.join(",")));
        let bound = text.add(format!("FACE_OUTER_BOUND('',#{ring},.T.)"));
        let frame = text.frame([0.0; 3], z, [1.0, 0.0, 0.0]);
        let plane = text.add(format!("PLANE('',#{frame})"));
        text.add(format!("FACE_SURFACE('',(#{bound}),#{plane},.T.)"))
    };
    let faces = [facet([0, 1, 2, 3], [0.0, 0.0, 1.0]), facet([1, 0, 5, 4], [0.0, 1.0, 0.0])];
    let shell = text.add(format!("CLOSED_SHELL('',(#{},#{}))", faces[0], faces[1]));
    let body = text.add(format!("FACETED_BREP('',#{shell})"));
    let context = text.millimetres();
    text.representation(&[body], context);
    let import = text.read().unwrap();
    let edges = |s: &SceneSurface| -> Vec<u32> {
        s.trims.as_ref().unwrap().loops()[0].pieces().iter().filter_map(|p| p.edge()).collect()
    };
    let [a, b] = [0, 1].map(|k| edges(&import.scene.surfaces[k]));
    assert_eq!((a.len(), b.len()), (4, 4));
    assert_eq!(a.iter().filter(|e| b.contains(e)).count(), 1);
}

#[test]
fn what_is_not_understood_is_counted_and_what_is_wrong_is_told_by_its_place() {
    let mut text = Text::default();
    let good = square(&mut text, 2.0);
    let bad = square(&mut text, 1.0);
    text.data =
        text.data.replacen(&format!("#{bad} = ADVANCED_FACE('',(#"), &format!("#{bad} = ADVANCED_FACE('',(#9"), 1);
    let shell = text.shell(&[good, bad]);
    let curves = text.add("GEOMETRIC_CURVE_SET('',(#1,#2))");
    let csg = text.add("CSG_SOLID('',#1)");
    let context = text.millimetres();
    text.representation(&[shell, curves, csg], context);
    let import = text.read().unwrap();
    assert_eq!(import.scene.surfaces.len(), 1);
    let skipped: Vec<(&str, usize)> = import.report.skipped.iter().map(|(k, n)| (k.as_str(), *n)).collect();
    assert_eq!(skipped, [("CARTESIAN_POINT", 1), ("CSG_SOLID", 1), ("VERTEX_POINT", 1)]);
    let [problem] = import.report.problems.as_slice() else { panic!("{:?}", import.report.problems) };
    assert!(
        problem.contains(&format!("#{bad} ADVANCED_FACE")) && problem.contains("which is not in the file"),
        "{problem}"
    );
}

#[test]
fn loops_that_run_the_wrong_way_round_are_turned() {
    let mut text = Text::default();
    let face = square(&mut text, 2.0);
    // The other sense has what is round the square.
    let (before, line) = text.data.split_at(text.data.find(&format!("#{face} = ")).unwrap());
    text.data = before.to_owned() + &line.replace(",.T.)", ",.F.)");
    let (context, shell) = (text.millimetres(), text.shell(&[face]));
    text.representation(&[shell], context);
    let import = text.read().unwrap();
    assert_eq!(import.report.healed, ["1 faces whose loops ran the wrong way round were turned"]);
    let (lo, hi) = extent(&import.scene.surfaces);
    assert!(is_near(lo, [0.0; 3]) && is_near(hi, [2.0, 2.0, 0.0]), "{lo:?} {hi:?}");
}

/// Splines whose knots the file leaves out, as those that it gives.
#[test]
fn knots_that_are_implied_are_those_of_the_standard() {
    let mut text = Text::default();
    let points: Vec<String> =
        (0..7).map(|k| format!("#{}", text.point([f64::from(k), f64::from(k * k), 0.0]))).collect();
    let list = points.join(",");
    let kinds = [
        (
            format!("BEZIER_CURVE('',3,({list}),.UNSPECIFIED.,.F.,.F.)"),
            vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0],
        ),
        (
            format!("QUASI_UNIFORM_CURVE('',3,({list}),.UNSPECIFIED.,.F.,.F.)"),
            vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0],
        ),
        (format!("UNIFORM_CURVE('',3,({list}),.UNSPECIFIED.,.F.,.F.)"), (-3..8).map(f64::from).collect()),
    ];
    for (written, knots) in kinds {
        let number = text.add(&written);
        let mut source = Source::from_bytes("curve", text.whole().into_bytes()).unwrap();
        let file = Exchange::parse(&mut source).unwrap();
        let entity = file.entities().find(|e| e.id() == number as u64).unwrap();
        match curve::basis(entity, &units::Units::default()).unwrap().shape {
            curve::Shape::Spline(curve, _) => assert_eq!(curve.knots().as_slice(), knots, "{written}"),
            other => panic!("{other:?}"),
        }
    }
}

/// Edges of each conic, between two of its points, against its equation.
#[test]
fn conics_run_through_the_points_of_their_equations() {
    let mut text = Text::default();
    let frame = text.frame([1.0, 2.0, 3.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let numbers = [
        text.add(format!("ELLIPSE('',#{frame},3.,2.)")),
        text.add(format!("PARABOLA('',#{frame},0.5)")),
        text.add(format!("HYPERBOLA('',#{frame},3.,2.)")),
    ];
    let mut source = Source::from_bytes("curve", text.whole().into_bytes()).unwrap();
    let file = Exchange::parse(&mut source).unwrap();
    let at = [
        (|t: f64| [3.0 * t.cos(), 2.0 * t.sin()]) as fn(f64) -> [f64; 2],
        |t| [0.5 * t * t, t],
        |t| [3.0 * t.cosh(), 2.0 * t.sinh()],
    ];
    let off = [
        (|x: f64, y: f64| x * x / 9.0 + y * y / 4.0 - 1.0) as fn(f64, f64) -> f64,
        |x, y| x - 0.5 * y * y,
        |x, y| x * x / 9.0 - y * y / 4.0 - 1.0,
    ];
    let origin = DVec3::new(1.0, 2.0, 3.0);
    for (k, number) in numbers.into_iter().enumerate() {
        let entity = file.entities().find(|e| e.id() == number as u64).unwrap();
        let shape = curve::basis(entity, &units::Units::default()).unwrap().shape;
        let ends = [-0.7, 1.1].map(|t| origin + DVec3::new(at[k](t)[0], at[k](t)[1], 0.0));
        for forward in [true, false] {
            let [a, b] = if forward { ends } else { [ends[1], ends[0]] };
            let curves = shape.between([a, b], false, forward).unwrap();
            let [curve::Arc { curve, .. }] = curves.as_slice() else { panic!("{} curves", curves.len()) };
            let [t0, t1] = curve.domain();
            assert!(curve.eval(t0).distance(a) < 1e-12 && curve.eval(t1).distance(b) < 1e-12);
            for i in 0..=20 {
                let p = curve.eval(t0 + (t1 - t0) * f64::from(i) / 20.0) - origin;
                assert!(off[k](p.x, p.y).abs() < 1e-12 && p.z.abs() < 1e-12, "{k}: {p}");
            }
        }
    }
}

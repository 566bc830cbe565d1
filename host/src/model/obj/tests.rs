use std::fmt::Write as _;

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::shape;
use proptest::prelude::*;

use super::*;
use crate::builtin;
use crate::model::format_of;

fn import(text: &str) -> Result<Import, ReadError> {
    let mut source = Source::from_bytes("thing", text.as_bytes().to_vec())?;
    read(&mut source, &Reading::new(&()))
}

fn message(text: &str) -> String {
    import(text).unwrap_err().to_string()
}

/// The unit cube, each face turned outwards.
const CUBE: &str = "\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
";

/// A surface as OBJ has it, its vertices first.
fn surface_text(surface: &Surface) -> String {
    let (nu, nv) = (surface.knots_u().control_count(), surface.knots_v().control_count());
    let mut text = String::new();
    for h in surface.homogeneous() {
        let _ = writeln!(text, "v {:?} {:?} {:?} {:?}", h.x / h.w, h.y / h.w, h.z / h.w, h.w);
    }
    let ([a, b], [c, d]) = (surface.domain_u(), surface.domain_v());
    let _ = write!(text, "cstype rat bspline\ndeg {} {}\nsurf {a} {b} {c} {d}", surface.degree_u(), surface.degree_v());
    for iv in 0..nv {
        for iu in 0..nu {
            let _ = write!(text, " {}", (iu * nv + iv) as i64 - (nu * nv) as i64);
        }
        text += " \\\n";
    }
    for (direction, knots) in [("u", surface.knots_u()), ("v", surface.knots_v())] {
        let _ = write!(text, "\nparm {direction}");
        knots.as_slice().iter().for_each(|k| _ = write!(text, " {k:?}"));
    }
    text + "\nend\n"
}

#[test]
fn polygons_are_facets() {
    let cube = import(CUBE).unwrap();
    assert_eq!((cube.scene.name.as_str(), cube.scene.surfaces.len()), ("thing", 6));
    assert_eq!(cube.report.kinds["quadrilateral"], 6);
    assert_eq!((cube.report.healed.len(), cube.report.skipped.len()), (0, 0));
    // Fronts are where corners go round counterclockwise.
    for s in &cube.scene.surfaces {
        let (p, du, dv) = s.surface.derivatives(0.5, 0.5);
        assert!(du.cross(dv).dot(p - 0.5) > 0.4);
    }
    // Numbers from the end, textures and normals, comments, other ends of lines, lines that go on.
    let other = CUBE.replace("f 4 3 2 1", "f -5/1 -6 \\\n-7/2/3 -8//1 # floor").replace('\n', "\r\n");
    let other = format!("# made by hand\r\nmtllib a.mtl\r\n\r\no\r\nusemtl red\r\nvt 0 0\r\nvn 0 0 1\r\n{other}");
    assert_eq!(import(&other).unwrap().scene, cube.scene);
}

#[test]
fn polygons_of_any_shape_are_planes_with_trims() {
    let text = "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n";
    let l = import(text).unwrap().scene.surfaces.remove(0);
    let trims = l.trims.unwrap();
    let inside = |p: DVec3| {
        // Where the point is in (u, v): the surface is a parallelogram.
        let (o, du, dv) = l.surface.derivatives(0.0, 0.0);
        let d = p - o;
        trims.contains(DVec2::new(d.dot(du) / du.length_squared(), d.dot(dv) / dv.length_squared()))
    };
    for (x, y, expected) in [(0.5, 0.5, true), (2.5, 0.5, true), (0.5, 1.5, true), (1.5, 1.5, false), (2.9, 1.1, false)]
    {
        assert_eq!(inside(DVec3::new(x, y, 0.0)), expected, "{x} {y}");
    }
    // A square with a square hole, joined to it by a side that is there twice.
    let text = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    let frame = import(text).unwrap().scene.surfaces.remove(0);
    assert_eq!(frame.trims.unwrap().loops().len(), 2);
}

#[test]
fn polygons_that_are_not_flat_are_parted_and_told() {
    let read = import("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    assert_eq!(read.scene.surfaces.len(), 2);
    assert_eq!(read.report.healed, ["parted 1 facet that is not flat, by at most 1.2e-1, into triangles"]);
    // What six decimals make of a flat one is flat.
    let read =
        import("v 0.1 0.2 0.333333\nv 10.1 0.2 0.333333\nv 10.1 10.2 0.333334\nv 0.1 10.2 0.333333\nf 1 2 3 4\n");
    let read = read.unwrap();
    assert_eq!((read.scene.surfaces.len(), read.report.healed.len()), (1, 0));
    // But whole numbers are meant.
    assert_eq!(import("v 0 0 0\nv 900 0 0\nv 900 900 1\nv 0 900 0\nf 1 2 3 4\n").unwrap().scene.surfaces.len(), 2);
    let crossed = import("v 0 0 0\nv 2 1 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\nf 1 2 3 4\n").unwrap();
    assert_eq!(crossed.scene.surfaces.len(), 1);
    assert_eq!(crossed.report.problems, ["left out 1 facet whose sides cross, the first at line 6"]);
}

#[test]
fn what_is_not_drawn_is_counted() {
    let text = format!("{CUBE}l 1 2 3\np 1\np 2\ns 1\ns off\ncurv2 1\nend\nfrobnicate 1\nusemtl blue\n");
    let text = text.replace("curv2 1", "vp 0 0\nvp 1 1\ncstype bezier\ndeg 1\ncurv2 1 2\nparm u 0 1");
    let report = import(&text).unwrap().report;
    let expected = [
        ("curves in parameters without a surface (curv2)", 1),
        ("lines (l)", 1),
        ("points (p)", 2),
        ("smoothing groups (s)", 1),
        ("statements frobnicate", 1),
    ];
    assert_eq!(report.skipped.iter().map(|(k, &n)| (k.as_str(), n)).collect::<Vec<_>>(), expected);
}

#[test]
fn the_teapot_comes_back_from_its_text() {
    let teapot = builtin::load("teapot").unwrap().scene;
    let text: String = teapot.surfaces.iter().map(|s| surface_text(&s.surface)).collect();
    let read = import(&format!("g teapot\n{text}{CUBE}")).unwrap();
    assert_eq!(read.scene.surfaces.len(), 6 + teapot.surfaces.len());
    assert_eq!((read.report.kinds["free-form surface"], read.report.kinds["quadrilateral"]), (32, 6));
    for (read, own) in read.scene.surfaces[6..].iter().zip(&teapot.surfaces) {
        assert_eq!((&read.surface, read.name.as_str(), read.facet), (&own.surface, "teapot", None));
    }
}

#[test]
fn a_sphere_is_cut_to_the_window_that_is_asked_for() {
    let sphere = shape::sphere(&shape::Frame::WORLD, 2.0).unwrap();
    let text = surface_text(&sphere);
    let close = |a: &Surface, b: &Surface| {
        (0..=8).all(|i| {
            (0..=8).all(|j| {
                let ([a0, a1], [b0, b1]) = (b.domain_u(), b.domain_v());
                let (u, v) = (a0 + (a1 - a0) * f64::from(i) / 8.0, b0 + (b1 - b0) * f64::from(j) / 8.0);
                a.eval(u, v).distance(b.eval(u, v)) < 1e-12
            })
        })
    };
    let whole = import(&text).unwrap().scene.surfaces.remove(0).surface;
    assert!(close(&whole, &sphere));
    let ([a, b], [c, d]) = (sphere.domain_u(), sphere.domain_v());
    let (low, high, top) = (a + 0.3 * (b - a), a + 0.6 * (b - a), c + 0.7 * (d - c));
    let part = text.replacen(&format!("surf {a} {b} {c} {d}"), &format!("surf {low} {high} {c} {top}"), 1);
    let part = import(&part).unwrap().scene.surfaces.remove(0).surface;
    assert_eq!((part.domain_u(), part.domain_v()), ([low, high], [c, top]));
    assert!(close(&sphere, &part));
}

/// The square from 0 to 1 as a Bézier patch, with curves in its parameters: 1 a square loop, 2 a circle of radius a quarter.
const TRIMMED: &str = "\
v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0
vp 0.1 0.1\nvp 0.9 0.1\nvp 0.9 0.9\nvp 0.1 0.9
vp 0.75 0.5\nvp 0.75 0.75 0.70710678118654752\nvp 0.5 0.75\nvp 0.25 0.75 0.70710678118654752\nvp 0.25 0.5
vp 0.25 0.25 0.70710678118654752\nvp 0.5 0.25\nvp 0.75 0.25 0.70710678118654752
cstype bspline\ndeg 1\ncurv2 1 2 3 4 1\nparm u 0 0 1 2 3 4 4\nend
cstype rat bezier\ndeg 2\ncurv2 5 6 7 8 9 10 11 12 5\nparm u 0 1 2 3 4\nend
cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1
trim 0 4 1\nhole 4 2 2 2 0 2\nend
";

#[test]
fn trims_and_holes_are_parts_of_curves_in_parameters() {
    let read = import(TRIMMED).unwrap();
    let trims = read.scene.surfaces[0].trims.clone().unwrap();
    for (u, v, expected) in [
        (0.05, 0.5, false),
        (0.15, 0.15, true),
        (0.5, 0.5, false),
        (0.5, 0.76, true),
        (0.34, 0.34, false),
        (0.31, 0.31, true),
    ] {
        assert_eq!(trims.contains(DVec2::new(u, v)), expected, "{u} {v}");
    }
    // Without an outer bound the border is one.
    let only_hole = import(&TRIMMED.replace("trim 0 4 1\n", "")).unwrap();
    let trims = only_hole.scene.surfaces[0].trims.clone().unwrap();
    assert!(trims.contains(DVec2::new(0.05, 0.5)) && !trims.contains(DVec2::new(0.5, 0.5)));
}

#[test]
fn content_tells_the_format() {
    let format = |text: &str| {
        let source = Source::from_bytes("thing", text.as_bytes().to_vec()).unwrap();
        format_of(&source, std::path::Path::new("thing")).map(|f| f.name)
    };
    assert_eq!(format(CUBE), Some("OBJ"));
    assert_eq!(format(&format!("# a\nmtllib b \\\n c\n{CUBE}")), Some("OBJ"));
    assert_eq!(format("g\nv 1 2\n"), None);
    assert_eq!(format("v = 3\nf = 4\n"), None);
    assert_eq!(format("to whom it may concern\n"), None);
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let cube = |from: &str, to: &str| CUBE.replacen(from, to, 1);
    let trimmed = |from: &str, to: &str| {
        assert!(TRIMMED.contains(from), "{from}");
        TRIMMED.replacen(from, to, 1)
    };
    let table: Vec<(String, &str)> = vec![
        (String::new(), "is empty"),
        ("v 0 0 0\n".into(), "has no face and no surface; there is nothing to draw"),
        ("v 0 0 0\nv 1 0 0\nf 1 2 1\n".into(), "has no face with an area; there is nothing to draw"),
        (cube("v 1 0 0", "v 1 0"), "line 2: has 2 numbers; a vertex has x, y and z"),
        (cube("v 1 0 0", "v 1 0 nan"), "line 2: `nan` is not a finite number"),
        (cube("v 1 0 0", "v 1 0 -inf"), "line 2: `-inf` is not a finite number"),
        (cube("v 1 0 0", "v 1 0 x"), "line 2: `x` is not a number"),
        (cube("v 1 0 0", "v 1 2 3 4 5 6 7 8"), "line 2: has more numbers than a vertex with a weight or a colour"),
        (cube("f 4 3", "f 9 3"), "line 9: refers to vertex 9 of 8 that are there so far"),
        (cube("f 4 3", "f -9 3"), "line 9: refers to vertex -9 of 8 that are there so far"),
        (cube("f 4 3", "f 0 3"), "line 9: refers to vertex 0 of 8 that are there so far"),
        (cube("f 4 3", "f 1000000000 3"), "line 9: refers to vertex 1000000000 of 8 that are there so far"),
        (cube("f 4 3", "f 9223372036854775808 3"), "line 9: `9223372036854775808` is not the number of a vertex"),
        (cube("f 4 3 2 1", "f 4 3"), "line 9: has 2 corners; a face has three or more"),
        (cube("f 4 3 2 1", "f 4 a 2"), "line 9: `a` is not the number of a vertex"),
        (format!("{CUBE}f 1 2 3 \\"), "line 15: goes on, but the file ends; it is cut off"),
        (
            (0..17).map(|k| format!("word{k}\n")).collect(),
            "line 17: `word16` is one unknown keyword too many; this is no OBJ file",
        ),
        (trimmed("hole 4 2 2 2 0 2\nend\n", ""), "line 29: begins an element that has no `end`; the file is cut off"),
        (trimmed("deg 1\ncurv2", "deg 0\ncurv2"), "line 18: `0` is not a degree from 1 to 9"),
        (trimmed("deg 1\ncurv2", "deg 1000000000\ncurv2"), "line 18: `1000000000` is not a degree from 1 to 9"),
        (
            trimmed("cstype bspline", "cstype nurbs"),
            "line 17: names the basis `nurbs`; there are bezier, bspline, cardinal, taylor, bmatrix",
        ),
        (
            trimmed("parm u 0 0 1 2 3 4 4", "parm u 0 0 1 3 2 4 4"),
            "line 21: ends the element of line 19, which knot 4 is 2",
        ),
        (
            trimmed("parm u 0 0 1 2 3 4 4", "parm u 0 0 1 2 4 4"),
            "line 21: ends the element of line 19, which has 5 control points, but 6 knots of degree 1 ask for 4",
        ),
        (
            trimmed("parm u 0 1 2 3 4\n", "parm u 0 1 2 3\n"),
            "line 26: ends the element of line 24, which has 4 parameters, but 4 pieces have 5 ends",
        ),
        (trimmed("0.75 0.75 0.70710678118654752", "0.75 0.75 0"), "which control point 1 has weight 0"),
        (trimmed("0.75 0.75 0.70710678118654752", "0.75 0.75 -1"), "which control point 1 has weight -1"),
        (
            trimmed("end\ncstype rat bezier", "cstype rat bezier"),
            "line 23: begins an element, but that of line 19 has no `end`",
        ),
        (
            trimmed("surf 0 1 0 1 1 2 3 4", "surf 0 1 0 1 1 2 3"),
            "which has 3 control points, but its parameters v ask for 2 rows",
        ),
        (trimmed("surf 0 1 0 1 1 2 3 4", "surf 0 1 0 1"), "which has no control points"),
        (trimmed("surf 0 1 0 1 1 2 3 4", "surf 0 1"), "has no control points"),
        (
            trimmed("surf 0 1 0 1 1 2 3 4", "surf 0 2 0 1 1 2 3 4"),
            "which is asked for from 0 to 2 in u, but is there from 0 to 1",
        ),
        (trimmed("deg 1 1", "deg 1"), "which has no degree in both directions; `deg` comes first"),
        (trimmed("parm v 0 1", "parm w 0 1"), "does not begin with a direction, u or v"),
        (trimmed("parm v 0 1\n", "parm v\n"), "which has too few parameters v (`parm v`)"),
        (
            trimmed("trim 0 4 1", "trim 0 3 1"),
            "ends a surface whose trims are wrong, those of line 32: trim loop 0: curve 0 ends at (0.1, 0.9)",
        ),
        (
            trimmed("trim 0 4 1", "trim 0 5 1"),
            "ends a surface whose loop of line 32 is asked for from 0 to 5 in a curve, but is there from 0 to 4",
        ),
        (trimmed("trim 0 4 1", "trim 0 4 3"), "line 32: refers to curve 3 of 2 that are there so far"),
        (
            trimmed("trim 0 4 1", "trim 0 4"),
            "line 32: does not list parts of curves, each by two parameters and a curve",
        ),
        ("trim 0 1 1\n".into(), "line 1: `trim` belongs between `surf` or `curv2` and `end`"),
        (
            "v 0 0 0\nsurf 0 1 0 1 1\nend\n".into(),
            "line 3: ends the element of line 2, which has no basis; `cstype` comes first",
        ),
    ];
    for (text, expected) in table {
        let message = message(&text);
        assert!(message.contains(expected) && !message.contains('\n'), "{message:?}, not {expected:?}");
    }
}

#[test]
fn a_line_without_end_is_refused_in_bounded_memory() {
    let endless = "v ".to_owned() + &"1 ".repeat(3 << 20);
    assert!(message(&endless).starts_with("line 1: is longer than 4194304 bytes"));
    let endless = format!("g {}\\\n", "a".repeat(1 << 20)).repeat(40);
    assert!(message(&endless).starts_with("line 1: goes on over lines for more than"), "{}", message(&endless));
}

proptest! {
    #[test]
    fn mutated_files_never_panic(
        which in 0_usize..2, at in any::<prop::sample::Index>(), len in 0_usize..30,
        with in "[-0-9 .\\\\/\nefvpa-z]{0,12}",
    ) {
        let mut text = [CUBE, TRIMMED][which].to_owned();
        let at = at.index(text.len());
        let end = (at + len).min(text.len());
        text.replace_range(at..end, &with);
        let _ = import(&text);
    }
}

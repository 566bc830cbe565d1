use glam::DVec2;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::stroke::CurveKind;
use penvis_core::view::Camera;
use proptest::prelude::*;

use super::*;
use crate::builtin;
use crate::model::format_of;

/// A file with most of what is read, comments and attributes where they may stand.
const TREE: &str = r#"
A comment, "of any words.
[OBJECT [COLOR 4] [rgb "200,100]"] ALL
    [OBJECT [width [deep 1] 0.5] SHEET
        Three points along u and two along v.
        [SURFACE BSPLINE [a] 3 2 3 2 E3
            [KV 0 0 0 2 2 2]
            [KV [b 1] 0 0 1 1]
            [0 0 0] [[c 1] 1 0 1]
            [2 0 0]
            [0 3 0] [1 3 1] [2 3 0]
        ]
        [CURVE BEZIER 2 E2 [0 0] [1 1]]
    ]
    [OBJECT NONE
        [SURFACE BEZIER 2 2 P3
            [1 0 0 5] [2 2 0 10]
            [4 0 4 20] [1 1 1 5]
        ]
    ]
    [OBJECT ROOF
        [POLYGON [PLANE 0 0 1 0] 4 [0 0 8] [[NORMAL 0 0 1] 2 0 8] [2 2 8] [0 2 8]]
        [POLYSTRIP 4 [0 0 9] [2 0 9] [0 2 9] [2 2 9]]
    ]
    [OBJECT VALUES [NUMBER 4] [STRING "[not a block"] [FRACTAL [deep [er]] 3]]
]
"#;

/// A bilinear sheet over [0, 4] × [0, 2], trimmed to the square [1, 3] × [0, 2] less a round hole about (2, 1).
const TRIMMED: &str = "[OBJECT SHEET
  [TRIMSRF
    [SURFACE BSPLINE 2 2 2 2 E3 [KV 0 0 4 4] [KV 0 0 2 2] [0 0 0] [4 0 0] [0 2 0] [4 2 0]]
    [TRIMCRV
      [TRIMCRVSEG
        [CURVE BEZIER 2 E2 [1 0] [3 0]]
        [CURVE BEZIER 2 E3 [1 0 0] [3 0 0]]]
      [TRIMCRVSEG [CURVE BSPLINE 4 2 E2 [KV 0 0 1 2 3 3] [3 0] [3 2] [1 2] [1 0]]]]
    [TRIMCRV
      [TRIMCRVSEG [CURVE BSPLINE 9 3 P3 [KV 0 0 0 1 1 2 2 3 3 4 4 4]
        [1 2.5 1 0] [0.7071068 1.7677670 1.0606602 0] [1 2 1.5 0] [0.7071068 1.0606602 1.0606602 0] [1 1.5 1 0]
        [0.7071068 1.0606602 0.3535534 0] [1 2 0.5 0] [0.7071068 1.7677670 0.3535534 0] [1 2.5 1 0]]]]]]";

/// A floor and a wall that meet along y = 0, each 2 × 1; their common edge is a parabola in the floor's parameters, and a
/// straight line in the wall's. The loop of the floor goes round clockwise. The wall has a hole.
const MODEL: &str = "[OBJECT CORNER
  [MODEL 2 8
    [MDLTSRF 1
      [SURFACE BEZIER 2 2 E3 [0 0 0] [2 0 0] [0 1 0] [2 1 0]]
      [MDLLOOP -4 -3 -2 -1]]
    [MDLTSRF 2
      [SURFACE BEZIER 2 2 E3 [0 0 0] [2 0 0] [0 0 1] [2 0 1]]
      [MDLLOOP 1 5 6 7]
      [MDLLOOP 8]]
    [MDLTSEG 7 1 2
      [CURVE BEZIER 3 E2 [0 0] [0.5 0.001] [1 0]]
      [CURVE BEZIER 2 E2 [0 0] [1 0]]
      [CURVE BEZIER 2 E3 [0 0 0] [2 0 0]]]
    [MDLTSEG 1 1 0 [CURVE BEZIER 2 E2 [1 0] [1 1]]]
    [MDLTSEG 1 1 0 [CURVE BEZIER 2 E2 [1 1] [0 1]]]
    [MDLTSEG 2 0 1 [CURVE BEZIER 2 E2 [0 1] [0 0]]]
    [MDLTSEG 1 2 0 [CURVE BEZIER 2 E2 [1 0] [1 1]]]
    [MDLTSEG 1 2 0 [CURVE BEZIER 2 E2 [1 1] [0 1]]]
    [MDLTSEG 1 2 0 [CURVE BEZIER 2 E2 [0 1] [0 0]]]
    [MDLTSEG 1 2 0 [CURVE BSPLINE 4 2 E2 [KV 0 0 1 2 3 3] [0.4 0.4] [0.6 0.4] [0.5 0.6] [0.4 0.4]]]]]";

fn import(text: &str) -> Result<Import, ReadError> {
    let mut source = Source::from_bytes("tree", text.as_bytes().to_vec())?;
    read(&mut source, &Reading::new(&()))
}

fn message(text: &str) -> String {
    import(text).unwrap_err().to_string()
}

/// A file of one surface.
fn surface(block: &str) -> Surface {
    import(&format!("[OBJECT A {block}]")).unwrap().scene.surfaces.swap_remove(0).surface
}

#[test]
fn a_tree_of_objects_is_read() {
    let Import { scene, report, .. } = import(TREE).unwrap();
    assert_eq!(scene.name, "tree");
    let names: Vec<&str> = scene.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["ROOF", "ROOF", "ROOF", "SHEET", "ALL"]);
    assert_eq!(
        report.kinds.into_iter().collect::<Vec<_>>(),
        [("free-form surface".to_owned(), 2), ("quadrilateral".to_owned(), 1), ("triangle".to_owned(), 2)]
    );
    assert_eq!(
        report.skipped.into_iter().collect::<Vec<_>>(),
        [("blocks FRACTAL".to_owned(), 1), ("curves (CURVE)".to_owned(), 1)]
    );
    let sheet = &scene.surfaces[3].surface;
    assert_eq!((sheet.degree_u(), sheet.degree_v(), sheet.domain_u()), (2, 1, [0.0, 2.0]));
    for (u, v, expected) in [(2.0, 0.0, [2.0, 0.0, 0.0]), (0.0, 1.0, [0.0, 3.0, 0.0]), (1.0, 0.5, [1.0, 1.5, 0.5])] {
        assert_eq!(sheet.eval(u, v).to_array(), expected);
    }
    // Coordinates are multiplied by the weights, which come first.
    let rational = &scene.surfaces[4].surface;
    assert_eq!(rational.eval(1.0, 0.0).to_array(), [1.0, 0.0, 5.0]);
    assert_eq!(rational.eval(0.0, 1.0).to_array(), [0.0, 1.0, 5.0]);
    assert_eq!(rational.eval(0.0, 0.5).to_array(), [0.0, 0.8, 5.0]);
}

#[test]
fn the_triangles_of_a_strip_face_one_way() {
    let scene = import("[OBJECT A [POLYSTRIP 5 [0 0 0] [1 0 0] [0 1 0] [1 1 0] [0 2 0]]]").unwrap().scene;
    assert_eq!(scene.surfaces.len(), 3);
    for s in scene.surfaces {
        let (_, du, dv) = s.surface.derivatives(0.5, 0.5);
        assert!(du.cross(dv).z > 0.0);
    }
}

#[test]
fn a_period_goes_on_with_its_first_points() {
    // Three points of degree 2 about a tube, which is closed and smooth where it begins.
    let tube = surface(
        "[SURFACE BSPLINE 3 2 3 2 E3 [KVP -2 -1 0 1 2 3 4 5] [KV 0 0 1 1]
        [0 0 0] [2 0 0] [0 2 0] [0 0 1] [2 0 1] [0 2 1]]",
    );
    assert_eq!((tube.knots_u().control_count(), tube.domain_u()), (5, [0.0, 3.0]));
    for v in [0.0, 0.5, 1.0] {
        assert!(tube.eval(0.0, v).distance(tube.eval(3.0, v)) < 1e-12);
        assert!(tube.derivatives(0.0, v).1.distance(tube.derivatives(3.0, v).1) < 1e-12);
    }
    assert_eq!(tube.eval(0.0, 0.0).to_array(), [1.0, 0.0, 0.0]);
}

#[test]
fn trims_keep_what_is_inside_by_the_even_odd_rule() {
    let scene = import(TRIMMED).unwrap().scene;
    let trims = scene.surfaces[0].trims.as_ref().unwrap();
    assert_eq!(trims.loops().len(), 2);
    for (u, v, kept) in [(0.5, 1.0, false), (1.2, 1.0, true), (2.0, 1.0, false), (2.3, 1.3, false), (2.4, 1.4, true)] {
        assert_eq!(trims.contains(DVec2::new(u, v)), kept, "({u}, {v})");
    }
}

#[test]
fn surfaces_of_a_model_share_their_edges() {
    let scene = import(MODEL).unwrap().scene;
    let names: Vec<&str> = scene.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["CORNER", "CORNER"]);
    let trims: Vec<&Trims> = scene.surfaces.iter().map(|s| s.trims.as_ref().unwrap()).collect();
    // Pieces are parts of curves: those that follow one another along an edge are one.
    let shared = |trims: &Trims| {
        let mut runs: Vec<(DVec2, DVec2, u32)> = Vec::new();
        for p in trims.loops().iter().flat_map(|l| l.pieces()) {
            match (runs.last_mut(), p.edge()) {
                (Some(run), Some(edge)) if run.2 == edge && run.1 == p.from() => run.1 = p.to(),
                (_, Some(edge)) => runs.push((p.from(), p.to(), edge)),
                _ => {}
            }
        }
        runs
    };
    // The surface is on the left of its edges, so that the two go along the common one in opposite directions in space,
    // or in the same direction in parameters.
    for trims in &trims {
        assert_eq!(shared(trims), [(DVec2::ZERO, DVec2::X, 0)]);
        assert!(trims.loops().iter().flat_map(|l| l.pieces()).all(|p| p.keeps_left() == Some(true)));
    }
    assert!(trims[0].contains(DVec2::new(0.5, 0.1)) && !trims[0].contains(DVec2::new(0.5, 0.0001)));
    assert!(trims[1].contains(DVec2::new(0.2, 0.5)) && !trims[1].contains(DVec2::new(0.5, 0.5)));
    // The common edge is inked once, although its sides are up to 0.0005 apart.
    let camera = Camera::orthographic(DVec3::new(0.3, 1.0, 1.0), DVec3::Z).unwrap();
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let traced = Prepared::new(&scene, &camera, &options, &()).unwrap().trace(1e-6, &()).unwrap();
    let ink = |is_crease: bool| -> f64 {
        let wanted = traced.strokes.iter().filter(|s| (s.kind == CurveKind::Crease) == is_crease);
        wanted.flat_map(|s| s.points.windows(2)).map(|w| w[0].model.distance(w[1].model)).sum()
    };
    assert!((ink(true) - 2.0).abs() < 1e-4, "{}", ink(true));
    // Three sides of each, and a hole.
    assert!((ink(false) - (4.0 + 4.0 + 0.4 + 2.0 * 0.08_f64.sqrt())).abs() < 1e-4, "{}", ink(false));
    // Two models have nothing in common.
    let twice = import(&MODEL.repeat(2)).unwrap().scene;
    let edges: Vec<u32> = twice.surfaces.iter().map(|s| shared(s.trims.as_ref().unwrap())[0].2).collect();
    assert_eq!(edges, [0, 0, 1, 1]);
    // A seam is gone along once each way.
    let tube = "[OBJECT A [MODEL 1 3 [MDLTSRF 1
        [SURFACE BSPLINE 3 2 2 2 E3 [KV 0 0 1 2 2] [KV 0 0 1 1] [0 0 0] [1 1 0] [0 0 0] [0 0 1] [1 1 1] [0 0 1]]
        [MDLLOOP 1 2 3 -2]]
        [MDLTSEG 1 1 0 [CURVE BEZIER 2 E2 [0 0] [2 0]]]
        [MDLTSEG 3 1 1 [CURVE BEZIER 2 E2 [2 0] [2 1]] [CURVE BEZIER 2 E2 [0 0] [0 1]]]
        [MDLTSEG 1 1 0 [CURVE BEZIER 2 E2 [2 1] [0 1]]]]]";
    let scene = import(tube).unwrap().scene;
    assert_eq!(
        shared(scene.surfaces[0].trims.as_ref().unwrap()),
        [(DVec2::new(2.0, 0.0), DVec2::new(2.0, 1.0), 0), (DVec2::new(0.0, 1.0), DVec2::ZERO, 0)]
    );
}

#[test]
fn the_teapot_comes_back_as_it_was_written() {
    let teapot = builtin::load("teapot").unwrap().scene;
    let mut text = "[OBJECT TEAPOT\n".to_owned();
    for s in &teapot.surfaces {
        let (m, n, points) = (s.surface.degree_u(), s.surface.degree_v(), s.surface.homogeneous());
        text += &format!("[SURFACE BEZIER {} {} P3\n", m + 1, n + 1);
        for (i, j) in (0..=n).flat_map(|j| (0..=m).map(move |i| (i, j))) {
            let p = points[i * (n + 1) + j];
            text += &format!("[{:?} {:?} {:?} {:?}]\r\n", p.w, p.x, p.y, p.z);
        }
        text += "]\n";
    }
    let read = import(&(text + "]")).unwrap().scene.surfaces;
    assert_eq!(read.len(), 32);
    for (read, own) in read.iter().zip(&teapot.surfaces) {
        assert_eq!((read.name.as_str(), &read.surface), ("TEAPOT", &own.surface));
    }
}

#[test]
fn the_first_block_tells_the_format() {
    let format = |text: &str, name: &str| {
        let source = Source::from_bytes("tree", text.as_bytes().to_vec()).unwrap();
        format_of(&source, std::path::Path::new(name)).map(|f| f.name)
    };
    assert_eq!(format(TREE, "tree"), Some("ITD"));
    assert_eq!(format(TREE, "tree.dat"), Some("ITD"));
    assert_eq!(format("[object]\nname = 3", "tree"), None);
    assert_eq!(format("[1, 2, 3]", "tree"), None);
    assert_eq!(format("x", "tree.ITD"), Some("ITD"));
}

#[test]
fn what_is_not_drawn_is_named_and_counted() {
    let with = |block: &str| import(&format!("{TRIMMED}[OBJECT B {block}]")).unwrap().report.skipped;
    for (block, expected) in [
        ("[POLYLINE 2 [0 0 0] [1 1 1]]", "polylines (POLYLINE)"),
        ("[SURFACE BEZIER 2 2 E1 [0] [1] [2] [3]]", "surfaces of points E1"),
        ("[SURFACE POWER 2 2 E3 [0 0 0] [1 0 0] [0 1 0] [1 1 0]]", "surfaces of the basis POWER"),
        (
            "[TRIMSRF [SURFACE BEZIER 2 2 E5 [0 0 0 0 0] [0 0 0 0 0] [0 0 0 0 0] [0 0 0 0 0]]
              [TRIMCRV [TRIMCRVSEG [CURVE BEZIER 2 E2 [0 0] [1 1]]]]]",
            "surfaces of points E5",
        ),
        (
            "[TRIMSRF [SURFACE BEZIER 2 2 E3 [0 0 0] [1 0 0] [0 1 0] [1 1 0]]
              [TRIMCRV [TRIMCRVSEG [CURVE POWER 2 E2 [0 0] [1 1]]]]]",
            "surfaces whose trims are curves of the basis POWER",
        ),
        ("[INSTANCE A 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]", "instances (INSTANCE)"),
    ] {
        assert_eq!(with(block).into_iter().collect::<Vec<_>>(), [(expected.to_owned(), 1)]);
    }
    let only = message("[OBJECT A [CURVE BEZIER 2 E2 [0 0] [1 1]] [CURVE BEZIER 2 E2 [0 0] [1 1]]]");
    assert_eq!(only, "has no surface and no polygon, but 2 curves (CURVE); there is nothing to draw");
    let unknown: String = (0..17).map(|k| format!("[K{k} 1]")).collect();
    let told = message(&format!("[OBJECT A {unknown}]"));
    assert_eq!(told, "line 1: `K16` is one unknown keyword too many; this is no file of IRIT");
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    let tree = |from: &str, to: &str| TREE.replacen(from, to, 1);
    let trimmed = |from: &str, to: &str| TRIMMED.replacen(from, to, 1);
    let model = |from: &str, to: &str| MODEL.replacen(from, to, 1);
    let table = [
        (
            model("MODEL 2 8", "MODEL 3 8"),
            "line 2: begins a MODEL of 3 surfaces, but has 2; it is cut off or its head wrong",
        ),
        (
            model("MODEL 2 8", "MODEL 2 1000000000"),
            "line 2: begins a MODEL of 1000000000 segments, but has 8; it is cut off or its head wrong",
        ),
        (model("MDLTSRF 2", "MDLTSRF 3"), "line 9: ends the MDLTSRF of line 6 after 2 of 3 loops"),
        (model("MDLLOOP 8", "MDLLOOP 9"), "line 9: refers to segment 9 of 8 that the model has"),
        (model("MDLLOOP 8", "MDLLOOP 0"), "line 9: refers to segment 0 of 8 that the model has"),
        (
            model("MDLLOOP 8", "MDLLOOP -9223372036854775808"),
            "line 9: refers to segment -9223372036854775808 of 8 that the model has",
        ),
        (model("MDLLOOP 8", "MDLLOOP 2"), "line 9: refers to segment 2, which has no curve in surface 2"),
        (model("MDLLOOP 8", "MDLLOOP x"), "line 9: has `x` where the number of a segment is expected"),
        (
            model("MDLLOOP 8", "MDLLOOP 5"),
            "line 9: has an MDLLOOP that is wrong: trim loop 1: curve 0 ends at (1, 1), but the next one begins at (1, 0); make the curves meet end to end, and the last one the first",
        ),
        (model("MDLTSEG 7 1 2", "MDLTSEG 7 1 3"), "line 10: refers to surface 3 of 2 that the model has"),
        (model("MDLTSEG 7 1 2", "MDLTSEG 8 1 2"), "line 10: has `8` where a mask of curves, 0 to 7, is expected"),
        (
            model("MDLTSEG 1 1 0", "MDLTSEG 5 1 0"),
            "line 14: ends the MDLTSEG of line 14, which lacks a curve that its mask announces",
        ),
        (String::new(), "is empty"),
        ("\n".to_owned(), "has no surface and no polygon; there is nothing to draw"),
        (tree("E3", "E0"), "line 6: has `E0` where a type of points, such as E3 or P3, is expected"),
        (tree("3 2 3 2 E3", "3 2 3 11 E3"), "line 6: has order 11, degree plus 1; there are 2 to 10"),
        (tree("3 2 3 2 E3", "3 2 3 1 E3"), "line 6: has order 1, degree plus 1; there are 2 to 10"),
        (
            tree("3 2 3 2 E3", "100000 10000 3 2 E3"),
            "line 6: announces more than 16777216 control points; no pen can draw so much, so correct or simplify it",
        ),
        (
            tree("3 2 3 2 E3", "9223372036854775807 9223372036854775807 3 2 E3"),
            "line 6: announces more than 16777216 control points; no pen can draw so much, so correct or simplify it",
        ),
        (tree("3 2 3 2 E3", "3 -2 3 2 E3"), "line 6: has `-2` where a number of control points is expected"),
        (tree("3 2 3 2 E3", "3 2 E3"), "line 6: has `E3` where an order is expected"),
        (tree("0 0 0 2 2 2", "0 0 0 2 2"), "line 7: has 5 knots along u, but 3 control points of order 3 have 6 knots"),
        (
            tree("0 0 0 2 2 2", "0 0 0 2 2 2 2"),
            "line 7: has more knots along u, but 3 control points of order 3 have 6 knots",
        ),
        (
            tree("KV 0 0 0", "KVP 0 0 0"),
            "line 7: has 6 knots along u, but 3 control points of a period of order 3 have 8 knots",
        ),
        (
            tree("0 0 0 2 2 2", "0 0 0 2 1 2"),
            "line 7: has wrong knots along u: knot 4 is 1, less than knot 3 before it; sort the knots",
        ),
        (tree("0 0 0 2 2 2", "0 0 nan 2 2 2"), "line 7: `nan` is not a finite number"),
        (tree("[KV 0", "[KW 0"), "line 7: has `KW` where KV or KVP is expected"),
        (tree("[2 0 0]", "[2 0 1e999]"), "line 10: `1e999` is not a finite number"),
        (tree("[2 0 0]", "[2 0]"), "line 10: has 2 numbers in a control point of type E3, which has 3 numbers"),
        (
            tree("[2 0 0]", "[2 0 0 1]"),
            "line 10: has `1` where `]` of a control point of type E3, which has 3 numbers, is expected",
        ),
        (tree("[2 0 0]", "2 0 0"), "line 10: has `2` where a control point is expected"),
        (tree("[2 0 0]", ""), "line 12: ends after 5 of 6 control points"),
        (tree("[2 0 0]", "[2 0 0] [2 0 0]"), "line 11: has `[` where `]` after 6 control points is expected"),
        (tree("[2 2 0 10]", "[0 2 0 10]"), "line 17: has weight 0; weights must be positive and finite"),
        (tree("[2 2 0 10]", "[-2 2 0 10]"), "line 17: has weight -2; weights must be positive and finite"),
        (tree("0] 4 [0 0 8]", "0] 2 [0 0 8]"), "line 22: announces 2 points; polygons and strips have 3 to 65536"),
        (
            tree("0] 4 [0 0 8]", "0] 1000000000 [0 0 8]"),
            "line 22: announces 1000000000 points; polygons and strips have 3 to 65536",
        ),
        (tree("0] 4 [0 0 8]", "0] 5 [0 0 8]"), "line 22: ends after 4 of 5 points"),
        (tree("0] 4 [0 0 8]", "0] 3 [0 0 8]"), "line 22: has `[` where `]` after 3 points is expected"),
        (tree("[0 0 8]", "[0 0]"), "line 22: has 2 numbers; a point has x, y and z"),
        (tree("[0 0 8]", "[0 0 x]"), "line 22: `x` is not a number"),
        (tree(" ROOF", ""), "line 22: has POLYGON where the object of line 21 has no name yet"),
        (
            tree(" VALUES [NUMBER 4] [STRING", " [STRING"),
            "line 25: has `]` where the name of the object of line 25 is expected",
        ),
        (format!("{TREE}]"), "line 27: has `]`, but no block is open"),
        (
            TREE.trim_end().strip_suffix(']').unwrap().to_owned(),
            "line 25: is the last, but the block that begins on line 3 has no `]`; the file is cut off, so get it anew",
        ),
        (tree("[STRING \"[not a block\"]", "[STRING \"x]"), "line 25: begins a string that does not end on its line"),
        ("[X ".repeat(1000), "line 1: opens a block within 256 others; no model is nested so deep"),
        ("[OBJECT A".repeat(1000), "line 1: opens a block within 256 others; no model is nested so deep"),
        (
            trimmed("BEZIER 2 E2 [1 0] [3 0]", "BEZIER 2 E1 [1] [3]"),
            "line 6: has a curve of points E1; one in parameters has u and v",
        ),
        (
            trimmed("[1 0] [3 0]", "[1 0] [2.9 0]"),
            "line 4: begins a TRIMCRV that is wrong: trim loop 0: curve 0 ends at (2.9, 0), but the next one begins at (3, 0); make the curves meet end to end, and the last one the first",
        ),
        (
            trimmed("[1 2.5 1 0]", "[1 5 1 0]").replace("[1 2.5 1 0]", "[1 5 1 0]"),
            "line 9: begins a TRIMCRV that is wrong: trim loop 1: curve 0 reaches (5, 1), outside the surface's parameter range; clip it to the range",
        ),
    ];
    for (text, expected) in table {
        assert_eq!(message(&text), expected);
    }
    let (before, after) = (TRIMMED.find("[SURFACE").unwrap(), TRIMMED.find("[TRIMCRV").unwrap());
    let own = &TRIMMED[before..after];
    let without = TRIMMED.replace(own, "");
    assert_eq!(message(&without), "line 11: ends the TRIMSRF of line 2, which has no surface");
    let twice = TRIMMED.replace(own, &own.repeat(2));
    assert_eq!(message(&twice), "line 4: has another surface in the TRIMSRF of line 2");
    let bare = trimmed("[CURVE BEZIER 2 E2 [1 0] [3 0]]\n        [CURVE BEZIER 2 E3 [1 0 0] [3 0 0]]", "");
    assert_eq!(message(&bare), "line 6: ends the TRIMCRVSEG of line 5, which has no curve");
}

proptest! {
    #[test]
    fn mutated_files_never_panic(
        which in 0_usize..3, at in any::<prop::sample::Index>(), len in 0_usize..30,
        with in "([-0-9. \n\\[\\]\"eEPK]|OBJECT |CURVE |KVP ){0,8}",
    ) {
        let mut text = [TREE, TRIMMED, MODEL][which].to_owned();
        let at = at.index(text.len());
        let end = (at + len).min(text.len());
        text.replace_range(at..end, &with);
        let _ = import(&text);
    }
}

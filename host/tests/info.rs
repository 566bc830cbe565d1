//! What `penvis info` says of models in files.

mod common;

use std::fs;
use std::path::Path;

use common::penvis;
use serde_json::{Value, json};

fn told(folder: &Path, words: &str) -> String {
    let output = penvis(folder, words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A tent of two facets whose ridge was rounded apart, a facet without area, one whose sides cross, and a line.
const TENT: &str = "v 0 0 0
v 0 3 0
v 1 0 1
v 1 3 1
v 1.00000006 0 1
v 1.00000006 3 1
v 2 0 0
v 2 3 0
o tent
f 1 3 4 2
f 5 7 8 6
f 1 2 1
o bow
v 5 0 0
v 6 1 0
v 6 0 0
v 5 2 0
f 9 10 11 12
l 1 8
";

#[test]
fn what_was_healed_and_what_was_not_understood_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tent.obj"), TENT).unwrap();
    let text = told(folder.path(), "info tent.obj");
    let lines: Vec<&str> = text.lines().collect();
    let expected = [
        "tent: 2 surfaces, 2 Bézier patches",
        "file      tent.obj: OBJ, no unit of length",
        "kind      quadrilateral: 2",
        "healed    welded 2 corners to others, at most 6.0e-8 away",
        "healed    dropped 1 facet without area",
        "skipped   lines (l): 1, not understood",
        "problem   left out 1 facet whose sides cross, the first at line 18",
        "degree    1 × 1, polynomial: 2 surfaces, 2 patches",
        "mesh      2 facets",
        "extent x  0 to 2",
        "extent y  0 to 3",
        "extent z  0 to 1",
        "open      6 edges 11.65685 long in all, of 2 surfaces",
        "shared    1 edge 3 long in all at an angle; no edges without",
        "view      none stored; iso is used: parallel, eye direction (1, -1, 1), up (0, 0, 1)",
        "name      surfaces 0 to 1: tent",
    ];
    assert_eq!(lines, expected);
}

#[test]
fn a_scene_is_told_file_by_file_and_the_same_in_json() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tent.obj"), TENT).unwrap();
    let scene = "name = 'camp'\n[[object]]\nname = 'tent'\nmodel = 'tent.obj'\narray = { count = 2, step = [0, 4, 0] }\n[[object]]
cylinder = { radius = 1, height = 2 }\ntranslate = [-2, 0, 0]\n[camera]\nview = 'front'\n";
    fs::write(folder.path().join("camp.toml"), scene).unwrap();
    let text = told(folder.path(), "info camp.toml");
    for line in [
        "file      camp.toml: scene, surfaces 0 to 6, no unit of length",
        "kind      camp.toml: cylinder: 1",
        "kind      camp.toml: plane: 2",
        "file      tent.obj: OBJ, surfaces 0 to 1, no unit of length",
        "healed    tent.obj: dropped 1 facet without area",
        "extent x  -3 to 2",
        "extent y  -1 to 7",
        "view      parallel, eye direction (0, -1, 0), up (0, 0, 1)",
        "name      surfaces 2 to 3: tent 2/tent",
    ] {
        assert!(text.lines().any(|own| own == line), "no line {line:?} in\n{text}");
    }
    let value: Value = serde_json::from_str(&told(folder.path(), "info camp.toml --json")).unwrap();
    assert_eq!((&value["name"], &value["surfaces"], &value["facets"]), (&json!("camp"), &json!(7), &json!(4)));
    assert_eq!(value["files"][1]["skipped"], json!({"lines (l)": 1}));
    assert_eq!(value["files"][1]["healed"].as_array().unwrap().len(), 2);
    assert_eq!(value["files"][1]["surfaces"], 2);
    let round = 4.0 * std::f64::consts::PI;
    let open = &value["edges"]["open"];
    assert_eq!((&open["count"], &value["edges"]["open_surfaces"]), (&json!(12), &json!([0, 1, 2, 3])));
    let sharp = value["edges"]["sharp"]["length"].as_f64().unwrap();
    assert!((sharp - (6.0 + round)).abs() < 1e-9, "{sharp}");
    assert_eq!(value["view"]["eye_direction"], json!([0.0, -1.0, 0.0]));
}

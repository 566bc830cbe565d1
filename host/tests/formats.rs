//! Model files of every format, from the command line.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::penvis;
use serde_json::Value;

/// A folder with a file of tests/data in it.
fn folder_with(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    fs::copy(data.join(name), folder.path().join(name)).unwrap();
    folder
}

/// Length in space of what a command draws, by kind.
fn ink(folder: &Path, words: &str) -> BTreeMap<String, f64> {
    let done = penvis(folder, &format!("draw {words} -o drawn.json"));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let drawing: Value = serde_json::from_slice(&fs::read(folder.join("drawn.json")).unwrap()).unwrap();
    let mut ink = BTreeMap::new();
    for polyline in drawing["polylines"].as_array().unwrap() {
        let points: Vec<[f64; 3]> = serde_json::from_value(polyline["points"].clone()).unwrap();
        let length: f64 =
            points.windows(2).map(|w| (0..3).map(|k| (w[1][k] - w[0][k]).powi(2)).sum::<f64>().sqrt()).sum();
        *ink.entry(polyline["kind"].as_str().unwrap().to_owned()).or_default() += length;
    }
    ink
}

#[test]
fn a_house_of_triangles_is_drawn_by_its_edges() {
    let folder = folder_with("house.stl");
    let slope = 8_f64.sqrt();
    // Floor, wall, gable and roof; from the front the gable alone.
    let front = ink(folder.path(), "house.stl --view front");
    assert_eq!(front.keys().collect::<Vec<_>>(), ["crease"]);
    assert!((front["crease"] - (4.0 + 3.0 + 3.0 + 2.0 * slope)).abs() < 1e-9, "{front:?}");
    let above = ink(folder.path(), "house.stl --view 1,-1,0.8");
    let expected = (4.0 + 6.0) + 3.0 * 3.0 + 6.0 + 2.0 * slope + 6.0 + slope;
    assert!((above["crease"] - expected).abs() < 1e-9, "{above:?}, not {expected}");
    // Roof and wall meet at 45 degrees, all others at a right angle.
    let smooth = ink(folder.path(), "house.stl --view 1,-1,0.8 --crease-angle 60");
    assert!((smooth["crease"] - (expected - 6.0)).abs() < 1e-9, "{smooth:?}");
}

#[test]
fn a_plate_with_a_hole_hides_and_shows_what_is_behind_it() {
    let folder = folder_with("plate.obj");
    // Straight from above: the outline of the saddle, which is a circle there, and what of the plate is beside it.
    let top = ink(folder.path(), "plate.obj --view top --iso 0");
    assert_eq!(top.keys().collect::<Vec<_>>(), ["boundary", "crease"]);
    assert!((top["crease"] - 24.0).abs() < 1e-6, "{top:?}");
    // From below the hole, and the saddle through it is all inside.
    let below = ink(folder.path(), "plate.obj --view bottom --iso 0");
    let side = 2.0 * 1.5 * (std::f64::consts::PI / 12.0).sin();
    assert_eq!(below.keys().collect::<Vec<_>>(), ["crease"]);
    assert!((below["crease"] - (24.0 + 12.0 * side)).abs() < 1e-4, "{below:?}");
}

#[test]
fn what_is_cut_off_is_refused_in_one_line() {
    let folder = folder_with("house.stl");
    let text = fs::read(folder.path().join("house.stl")).unwrap();
    fs::write(folder.path().join("cut.stl"), &text[..1000]).unwrap();
    fs::write(folder.path().join("empty.stl"), "").unwrap();
    let binary = [&[0; 80][..], &1_000_000_000_u32.to_le_bytes(), &[0; 50]].concat();
    fs::write(folder.path().join("short.stl"), binary).unwrap();
    for (name, expected) in [
        ("cut.stl", "cut.stl: line "),
        ("empty.stl", "empty.stl: is empty"),
        ("short.stl", "short.stl: header: announces 1000000000 triangles, but its 134 bytes hold 1;"),
    ] {
        let done = penvis(folder.path(), &format!("draw {name} -o a.svg"));
        let told = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success() && told.starts_with(&format!("error: {expected}")), "{told}");
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(!folder.path().join("a.svg").exists());
    }
}

//! Scenes, from the command line to the paper.

mod common;

use std::fs;
use std::path::Path;

use common::penvis;
use serde_json::Value;

/// What a command that must succeed tells.
fn done(folder: &Path, words: &str) -> String {
    let output = penvis(folder, words);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{words}: {told}");
    told
}

fn drawing(folder: &Path, words: &str) -> Value {
    done(folder, &format!("draw {words} -o drawn.json"));
    serde_json::from_slice(&fs::read(folder.join("drawn.json")).unwrap()).unwrap()
}

/// Length in space, largest coordinates, of the polylines for which something holds.
fn ink(drawing: &Value, holds: impl Fn(&Value) -> bool) -> f64 {
    let polylines = drawing["polylines"].as_array().unwrap().iter().filter(|p| holds(p));
    let length = |polyline: &Value| -> f64 {
        let points: Vec<[f64; 3]> = serde_json::from_value(polyline["points"].clone()).unwrap();
        points.windows(2).map(|w| (0..3).map(|k| (w[1][k] - w[0][k]).powi(2)).sum::<f64>().sqrt()).sum()
    };
    polylines.map(length).sum()
}

#[test]
fn the_scene_to_begin_with_is_written_once_and_draws_as_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let told = done(folder.path(), "scene --init");
    assert!(told.starts_with("wrote scene.toml; ") && told.contains("penvis draw scene.toml -o scene.svg"), "{told}");
    let text = fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    assert_eq!(String::from_utf8(penvis(folder.path(), "scene").stdout).unwrap(), text);
    let again = penvis(folder.path(), "scene --init scene.toml");
    assert!(!again.status.success());
    let told = String::from_utf8(again.stderr).unwrap();
    assert!(told.starts_with("error: scene.toml is there already") && told.lines().count() == 1, "{told}");
    assert_eq!(fs::read_to_string(folder.path().join("scene.toml")).unwrap(), text);

    // Coarser than it says, for the sake of time: what the command line says goes before it.
    let drawing = drawing(folder.path(), "scene.toml --iso 1 --tolerance 0.2");
    assert_eq!((&drawing["name"], &drawing["page"]["width_mm"]), (&Value::from("still life"), &Value::from(297.0)));
    for pen in [1, 2] {
        assert!(ink(&drawing, |p| p["pen"] == pen) > 10.0);
    }
    let kinds = ["boundary", "crease", "silhouette", "iso"];
    assert!(kinds.iter().skip(1).all(|kind| ink(&drawing, |p| p["kind"] == *kind) > 1.0));

    // What is commented out is right too, but for what goes in the place of something else.
    let more = text.replace("# up =", "up =").replace("# perspective =", "perspective =");
    assert!(more != text);
    fs::write(folder.path().join("more.toml"), more).unwrap();
    done(folder.path(), "info more.toml");
}

#[test]
fn each_object_has_its_pen_and_its_curves_in_every_output() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    fs::write(folder.path().join("parts/square.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    let scene = "
[style]
iso = 0
[[object]]
model = 'parts/square.obj'
pen = 2
array = { count = 3, step = [2, 0, 0] }
[[object]]
rectangle = { size = [10, 6] }
translate = [2, 0, -1]
hidden = 'layer'
[[object]]
disk = { radius = 0.25 }
translate = [8, 8, 0]
pen = 4
curves = []
[camera]
view = 'top'
[page]
paper = 'a4'
orientation = 'portrait'
margin = 20
";
    fs::write(folder.path().join("parts.toml"), scene).unwrap();
    let found = drawing(folder.path(), "parts.toml");
    assert_eq!((&found["page"]["width_mm"], &found["page"]["height_mm"]), (&Value::from(210.0), &Value::from(297.0)));
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a}, not {b}");
    // Three squares with four sides; the rectangle lies below them, and its border beyond.
    near(ink(&found, |p| p["pen"] == 2), 12.0);
    near(ink(&found, |p| p["pen"] == 1), 32.0);
    near(ink(&found, |p| p["pen"] != 1 && p["pen"] != 2), 0.0);
    // From below the squares are hidden, and left out; the rectangle keeps what is hidden of it, which is nothing.
    let below = drawing(folder.path(), "parts.toml --view bottom --landscape");
    assert_eq!(below["page"]["width_mm"], 297.0);
    near(ink(&below, |_| true), 32.0);
    let layer = drawing(folder.path(), "parts.toml --view bottom --hidden layer");
    near(ink(&layer, |p| p["pen"] == 5 && p["layer"] == "hidden"), 12.0);
    // A pen that draws nothing is still the object's: what is hidden is drawn beyond the highest one.

    done(folder.path(), "draw parts.toml --landscape -o a.plt -o a.gcode -o a.svg");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (hpgl, gcode) = (read("a.plt"), read("a.gcode"));
    let order = |text: &str, first: &str, second: &str| {
        let at = |word| text.find(word).unwrap_or_else(|| panic!("no {word}"));
        assert!(at(first) < at(second) && text.matches(second).count() == 1);
    };
    order(&hpgl, "SP1;", "SP2;");
    order(&gcode, "G1 X", "(pen 2)");
}

/// A saddle cut to a triangle with a triangular hole, above a square.
const TRIMMED: &str = r#"{"surfaces": [
  {"degree_u": 1, "degree_v": 1, "knots_u": [2, 2, 3, 3], "knots_v": [0, 0, 1, 1],
   "control_points": [[[0, 0, 0, 1], [0, 1, 1, 1]], [[1, 0, 1, 1], [1, 1, 0, 1]]],
   "trim_loops": [
     [{"degree": 1, "knots": [0, 0, 1, 2, 3, 3], "control_points": [[2.1, 0, 1], [3, 0.3, 1], [2.4, 1, 1], [2.1, 0, 1]]}],
     [{"degree": 1, "knots": [0, 0, 1, 2, 3, 3], "control_points": [[2.3, 0.3, 1], [2.6, 0.4, 1], [2.4, 0.6, 1], [2.3, 0.3, 1]]}]]},
  {"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
   "control_points": [[[0, 0, -0.4, 1], [0, 1, -0.4, 1]], [[1, 0, -0.4, 1], [1, 1, -0.4, 1]]]}]}"#;

#[test]
fn a_scene_that_is_mirrored_is_drawn_as_its_mirror_image() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("trimmed.json"), TRIMMED).unwrap();
    let write = |name: &str, model: &str, scale: &str| {
        fs::write(folder.path().join(name), format!("[[object]]\nmodel = '{model}'\nscale = {scale}\n")).unwrap();
    };
    for (model, kinds) in [("knight", ["crease", "silhouette"]), ("trimmed.json", ["boundary", "iso"])] {
        write("plain.toml", model, "1");
        write("mirrored.toml", model, "[-1, 1, 1]");
        let plain = drawing(folder.path(), "plain.toml --view 1,-2,1.7 --iso 3 --hidden layer");
        let mirrored = drawing(folder.path(), "mirrored.toml --view -1,-2,1.7 --iso 3 --hidden layer");
        for kind in kinds {
            for visible in [true, false] {
                let [a, b] = [&plain, &mirrored].map(|d| ink(d, |p| p["kind"] == kind && p["visible"] == visible));
                assert!(a > 0.0, "{model} {kind} {visible}");
                assert!((a - b).abs() <= 1e-3 * a, "{model} {kind} {visible}: {a} and {b}");
            }
        }
    }
}

#[test]
fn no_output_replaces_a_part_of_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let part = r#"{"surfaces": [{"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
        "control_points": [[[0, 0, 0, 1], [0, 1, 0, 1]], [[1, 0, 0, 1], [1, 1, 0, 1]]]}]}"#;
    fs::write(folder.path().join("part.json"), part).unwrap();
    fs::write(folder.path().join("all.toml"), "[[object]]\nmodel = 'part.json'\n").unwrap();
    for words in ["draw all.toml -o part.json", "draw all.toml -o a.svg --stats part.json"] {
        let output = penvis(folder.path(), words);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && told.starts_with("error: part.json: is a part of the scene"), "{told}");
        assert_eq!(fs::read_to_string(folder.path().join("part.json")).unwrap(), part);
    }
}

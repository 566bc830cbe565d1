//! Drawings from files, drawn and plotted again: from outside, by the binary.

mod common;

use std::fs;

use common::{files, penvis};
use serde_json::Value;
use tempfile::TempDir;

/// Runs it, and returns what it says.
fn told(folder: &TempDir, words: &str) -> String {
    let done = penvis(folder.path(), words);
    let told = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{words}: {told}");
    told
}

/// A folder with a bilinear patch that bulges, seen from above and aside.
fn folder_with_model() -> TempDir {
    let model = r#"{"name": "sail", "surfaces": [{
        "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
        "control_points": [[[0, 0, 0, 1], [0, 1, 1, 1]], [[1, 0, 1, 1], [1, 1, 0, 1]]]}],
        "view": {"eye_direction": [0.3, -0.2, 1.0], "up": [0, 1, 0]}}"#;
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("model.json"), model).unwrap();
    folder
}

fn drawing(folder: &TempDir, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap()
}

/// The strokes of a drawing JSON, in no order and without their directions.
fn strokes(folder: &TempDir, name: &str) -> Vec<String> {
    let drawing = drawing(folder, name);
    let mut strokes: Vec<String> = drawing["polylines"]
        .as_array()
        .unwrap()
        .iter()
        .map(|line| {
            let there = line["page"].to_string();
            let back =
                Value::from(line["page"].as_array().unwrap().iter().rev().cloned().collect::<Vec<_>>()).to_string();
            format!("{} {} {} {}", line["kind"], line["layer"], line["pen"], there.min(back))
        })
        .collect();
    strokes.sort_unstable();
    strokes
}

#[test]
fn a_drawing_is_drawn_again_as_it_is() {
    let folder = folder_with_model();
    let run = |words: &str| drop(told(&folder, words));
    run("draw model.json --iso 3 --hidden layer -o a.json");
    run("draw a.json -o b.json");
    let first = strokes(&folder, "a.json");
    assert!(first.len() > 5);
    assert_eq!(first, strokes(&folder, "b.json"));

    // Another pen for a layer, and half as large on another sheet.
    run("draw a.json --pen iso=4 --scale 1:2 --paper a5 -o c.json");
    let third = strokes(&folder, "c.json");
    assert_eq!(third.len(), first.len());
    assert!(third.iter().all(|line| line.contains(r#" "iso" 4 "#) == line.starts_with(r#""iso" "iso""#)), "{third:?}");
    let width = |name: &str| {
        let drawing = drawing(&folder, name);
        let lines = drawing["polylines"].as_array().unwrap().iter().flat_map(|line| line["page"].as_array().unwrap());
        let x: Vec<f64> = lines.map(|p| p[0].as_f64().unwrap()).collect();
        x.iter().copied().fold(f64::MIN, f64::max) - x.iter().copied().fold(f64::MAX, f64::min)
    };
    assert!((width("c.json") - 0.5 * width("a.json")).abs() < 1e-9);

    run("plot a.json --port sim --sim-out ink.png");
    assert!(fs::read(folder.path().join("ink.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn what_a_drawing_cannot_be_asked_is_refused() {
    let folder = folder_with_model();
    assert!(penvis(folder.path(), "draw model.json -o a.json").status.success());
    let before = fs::read(folder.path().join("a.json")).unwrap();
    for (words, expected) in [
        ("draw a.json --iso 3 -o b.svg", "--iso is for models"),
        ("draw a.json --view front -o b.svg", "--view is for models"),
        ("draw a.json --shade lambert -o b.svg", "--shade is for models"),
        ("draw a.json --render -o b.png", "--render is for models"),
        ("plot a.json --hidden dashed --port sim", "--hidden is for models"),
        ("draw a.json model.json -o b.svg", "is a drawing, and model.json is none"),
        ("draw a.json --pen silhouettte=2 -o b.svg", "has no layer `silhouettte`"),
        ("draw a.json --scale 3:1 -o b.svg", "mm"),
        ("draw a.json -o a.json", "a.json"),
    ] {
        let done = penvis(folder.path(), words);
        let told = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success(), "{words}");
        assert!(told.contains(expected) && told.lines().count() == 1, "{words}: {told}");
    }
    assert_eq!(files(&folder), ["a.json"]);
    assert_eq!(fs::read(folder.path().join("a.json")).unwrap(), before);

    for (text, expected) in [
        (r#"{"page":{"width_mm":100,"height_mm":100},"polylines":[{"kind":"iso","page":[[1,2]]}]}"#, "polylines[0]"),
        (
            r#"{"page":{"width_mm":100,"height_mm":100},"polylines":[{"kind":"iso","page":[[1,2],[1e9,2]]}]}"#,
            "polylines[0]",
        ),
        (r#"{"page":{"width_mm":0,"height_mm":100},"polylines":[]}"#, "page"),
        (r#"{"page":{"width_mm":100,"height_mm":100},"polylines":[{"kind":"iso","#, "polylines"),
    ] {
        fs::write(folder.path().join("bad.json"), text).unwrap();
        let done = penvis(folder.path(), "draw bad.json -o b.svg");
        let told = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success() && told.contains("bad.json") && told.contains(expected), "{text}: {told}");
    }
}

const SVG: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
  width="200mm" height="100mm" viewBox="0 0 200 100">
<g inkscape:groupmode="layer" inkscape:label="frame" fill="none" stroke="#123456"><rect x="20" y="20" width="160" height="60"/></g>
<g inkscape:groupmode="layer" inkscape:label="disc" fill="teal"><circle cx="100" cy="50" r="20"/></g>
<text>no</text>
</svg>"##;

/// The strokes of a layer as lists of points.
fn layer(drawing: &Value, name: &str) -> Vec<Vec<[f64; 2]>> {
    let lines = drawing["polylines"].as_array().unwrap().iter().filter(|line| line["layer"] == name);
    lines.map(|line| serde_json::from_value(line["page"].clone()).unwrap()).collect()
}

#[test]
fn an_svg_is_drawn_where_and_as_large_as_it_is() {
    let folder = folder_with_model();
    fs::write(folder.path().join("art.svg"), SVG).unwrap();
    let said = told(&folder, "draw art.svg -o a.json -o again.svg -o a.gcode -o a.png");
    assert!(said.contains("warning: art.svg: 1 × text is not drawn"), "{said}");
    let a = drawing(&folder, "a.json");
    assert_eq!(a["page"]["width_mm"].as_f64().map(f64::round), Some(200.0));
    assert!(a["polylines"][0].get("kind").is_none());
    let [frame, disc] = ["frame", "disc"].map(|name| layer(&a, name).remove(0));
    let near = |p: &[f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-9;
    for corner in [[20.0, 20.0], [180.0, 20.0], [180.0, 80.0], [20.0, 80.0]] {
        assert!(frame.iter().any(|p| near(p, corner)), "{frame:?}");
    }
    assert!(disc.len() > 50 && disc.iter().all(|p| ((p[0] - 100.0).hypot(p[1] - 50.0) - 20.0).abs() < 1e-9));
    // Its layers, their names and their colours are there again.
    let again = fs::read_to_string(folder.path().join("again.svg")).unwrap();
    for part in [r#"width="200mm" height="100mm""#, r#"label="frame""#, "#123456", r#"label="disc""#, "#008080"] {
        assert!(again.contains(part), "{part}: {again}");
    }
    let gcode = fs::read_to_string(folder.path().join("a.gcode")).unwrap();
    assert!(gcode.contains("X180 Y20") && gcode.contains("M0"), "{gcode}");
    // A circle is a few arcs, and a frame is none.
    let count = |words: &[&str]| gcode.lines().filter(|line| words.iter().any(|word| line.starts_with(word))).count();
    assert!((2..8).contains(&count(&["G2 ", "G3 "])) && count(&["G1 "]) == 4, "{gcode}");
}

#[test]
fn a_drawing_is_put_on_another_sheet_with_curves_as_fine_there() {
    let folder = folder_with_model();
    fs::write(folder.path().join("art.svg"), SVG).unwrap();
    told(&folder, "draw art.svg --paper a3 --width 320mm --tolerance 0.1 --pen disc=2,frame=3 -o b.json");
    let b = drawing(&folder, "b.json");
    assert_eq!(b["page"]["width_mm"], 420.0);
    let disc = layer(&b, "disc").remove(0);
    let centre = [210.0, 148.5];
    for w in disc.windows(2) {
        let middle = [(w[0][0] + w[1][0]) / 2.0 - centre[0], (w[0][1] + w[1][1]) / 2.0 - centre[1]];
        let sagitta = 40.0 - middle[0].hypot(middle[1]);
        assert!(sagitta > 0.0 && sagitta <= 0.1, "{sagitta}");
    }
    let pens: Vec<_> = b["polylines"].as_array().unwrap().iter().map(|line| &line["pen"]).collect();
    assert_eq!(pens, [2, 3]);

    let message = |words: &str| String::from_utf8(penvis(folder.path(), words).stderr).unwrap();
    assert!(message("draw art.svg --scale 3:1 -o c.svg").contains("does not fit inside the margins"));
    assert!(message("draw art.svg --margin 30 -o c.svg").contains("does not fit inside the margins"));
    told(&folder, "draw art.svg --margin 30 --clip -o c.json");
    let c = drawing(&folder, "c.json");
    let all = ["frame", "disc"].map(|name| layer(&c, name).concat()).concat();
    assert!(all.iter().all(|[x, y]| (30.0..=170.0).contains(x) && (30.0..=70.0).contains(y)), "{all:?}");
}

#[test]
fn files_for_plotters_are_drawn_and_go_to_plotters_of_other_languages() {
    let folder = folder_with_model();
    fs::write(folder.path().join("art.svg"), SVG).unwrap();
    told(&folder, "draw art.svg --tolerance 0.02 -o art.gcode");
    // On all that the plotter reaches, with a layer for each pen.
    told(&folder, "draw art.gcode -o b.json");
    let b = drawing(&folder, "b.json");
    assert_eq!((layer(&b, "pen1").len(), layer(&b, "pen2").len()), (1, 1));
    let [low, high] =
        [f64::min, f64::max].map(|end| layer(&b, "pen1").concat().iter().map(|p| p[0]).reduce(end).unwrap());
    assert!((high - low - 160.0).abs() < 1e-9, "{low} to {high}");
    // As it is, laid out anew, and in another language.
    let plain = told(&folder, "plot art.gcode --port sim:grbl --sim-out a.svg --device grbl-servo --preflight");
    assert!(!plain.contains("fit"), "{plain}");
    let said = told(&folder, "plot art.gcode --pen 1 --paper a5 --scale 1:2 --port sim --sim-out b.svg");
    // Half of 566 mm.
    assert!(said.contains(" 283 mm of ink,"), "{said}");
    let said = told(&folder, "plot art.gcode --paper a4 --port sim:hpgl7475a --sim-out c.svg");
    assert!(said.contains(" 566 mm of ink,"), "{said}");
    told(&folder, "draw art.gcode --paper a4 -o d.plt");
    let said = told(&folder, "plot d.plt --pen 1 --port sim --sim-out d.svg");
    assert!(said.contains(" 566 mm of ink,"), "{said}");
}

#[test]
fn drawings_are_drawn_together_and_plotted() {
    let folder = folder_with_model();
    fs::write(folder.path().join("art.svg"), SVG).unwrap();
    let line =
        r#"{"page":{"width_mm":100,"height_mm":150},"polylines":[{"layer":"line","pen":3,"page":[[5,5],[50,5]]}]}"#;
    fs::write(folder.path().join("line.json"), line).unwrap();
    told(&folder, "draw art.svg line.json -o both.json");
    let both = drawing(&folder, "both.json");
    assert_eq!(
        (both["page"]["width_mm"].as_f64().map(f64::round), &both["page"]["height_mm"]),
        (Some(200.0), &150.0.into())
    );
    assert_eq!([layer(&both, "frame").len(), layer(&both, "line").len()], [1, 1]);

    let said = told(&folder, "plot art.svg --pen 1 --port sim --sim-out ink.svg");
    // 2 · (160 + 60) mm and 40 π.
    assert!(said.contains(" 566 mm of ink,") && said.contains("art.svg: 1 × text"), "{said}");
    assert!(fs::read_to_string(folder.path().join("ink.svg")).unwrap().contains("<path"));
}

#[test]
fn marks_and_a_title_are_drawn_beside_the_picture() {
    let folder = folder_with_model();
    let scene = "[[object]]\nmodel = \"model.json\"\npen = 3\n[page]\nmarks = true\ntitle = \"Sail: 1\"\n";
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    told(&folder, "draw scene.toml --iso 2 --hidden layer --pen title=7 -o a.json");
    let a = drawing(&folder, "a.json");
    let pens = |name: &str| -> Vec<u64> {
        let lines = a["polylines"].as_array().unwrap().iter().filter(|line| line["layer"] == name);
        lines.map(|line| line["pen"].as_u64().unwrap()).collect()
    };
    // The picture's pen, that of what is hidden, and the title's; a cross is two strokes.
    assert_eq!([3, 4, 7].map(|pen| pens("marks").iter().filter(|p| **p == pen).count()), [8; 3]);
    assert_eq!(pens("marks").len(), 24);
    assert!(pens("title").len() > 6 && pens("title").iter().all(|pen| *pen == 7));
    // Nothing of the picture is where they are.
    for name in ["boundary", "iso"] {
        assert!(layer(&a, name).concat().iter().all(|p| p[0] >= 22.0 && p[1] >= 22.0), "{name}");
    }
    assert!(layer(&a, "title").concat().iter().all(|p| p[0] >= 22.0 && (15.0..22.0).contains(&(p[1] + 1e-9))));

    fs::write(folder.path().join("art.svg"), SVG).unwrap();
    told(&folder, "draw art.svg --title Art --marks --pen marks=2 -o b.json");
    let b = drawing(&folder, "b.json");
    assert_eq!((layer(&b, "marks").len(), layer(&b, "frame").len()), (8, 1));
    for (words, expected) in [
        ("draw model.json --title \u{3b1} -o c.svg", "there is no letter for 'α'"),
        ("pack model.json --marks -o c.pv", "a board draws the model alone"),
        ("draw model.json --paper 30x30mm --margin 5 --title much-too-long-for-it -o c.svg", "make it shorter"),
    ] {
        let done = penvis(folder.path(), words);
        let told = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success() && told.contains(expected) && told.lines().count() == 1, "{words}: {told}");
    }
}

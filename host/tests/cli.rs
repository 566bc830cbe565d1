//! The binary from outside: what it writes, what it says, and what it leaves behind.

mod common;

use std::fs;
use std::process::Command;

use common::{files, penvis};
use glam::DVec2;
use penvis_core::pipeline::Prepared;
use penvis_firmware::scene::StoredScene;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A bilinear patch that bulges, seen from above and aside.
fn model() -> Value {
    json!({"name": "sail", "surfaces": [{
        "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
        "control_points": [[[0, 0, 0, 1], [0, 1, 1, 1]], [[1, 0, 1, 1], [1, 1, 0, 1]]]}],
        "view": {"eye_direction": [0.3, -0.2, 1.0], "up": [0, 1, 0]}})
}

fn folder_with(model: &Value) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("model.json"), model.to_string()).unwrap();
    folder
}

#[test]
fn every_format_is_written_in_one_run() {
    let folder = folder_with(&model());
    let words = "draw model.json -o a.svg -o a.gcode -o a.nc -o a.hpgl -o a.plt -o a.png -o a.json --stats s.json \
                 --paper 100x80mm --iso 3 --device dxy1100";
    // The sheet is none of the plotter's, and it speaks no G-code.
    let refused = penvis(folder.path(), words);
    assert!(!refused.status.success());
    assert!(files(&folder).is_empty());

    let words =
        "draw model.json -o a.svg -o a.gcode -o a.nc -o a.hpgl -o a.plt -o a.png -o a.json --stats s.json --iso 3";
    let done = penvis(folder.path(), words);
    let told = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{told}");
    assert!(told.starts_with("sail: ") && told.contains(" mm of ink, "), "{told}");
    let lines: Vec<_> = told.lines().collect();
    // The sum, its layers, and how visibility was decided.
    let [_, layers @ .., visibility] = &lines[..] else { panic!("{told}") };
    let mut names: Vec<_> = layers.iter().filter_map(|line| line.split(" with pen 1: ").next()).collect();
    names.sort_unstable();
    assert!(names == ["  boundary", "  iso"] && visibility.starts_with("visibility: "), "{told}");
    assert!(told.contains("none undecided"), "{told}");
    assert!(done.stdout.is_empty());
    assert_eq!(files(&folder), ["a.gcode", "a.hpgl", "a.json", "a.nc", "a.plt", "a.png", "a.svg", "s.json"]);

    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a.gcode"), read("a.nc"));
    assert_eq!(read("a.hpgl"), read("a.plt"));
    assert!(read("a.svg").starts_with(b"<?xml") && read("a.png").starts_with(b"\x89PNG"));
    let drawing: Value = serde_json::from_slice(&read("a.json")).unwrap();
    assert_eq!((&drawing["name"], &drawing["isos"]), (&json!("sail"), &json!(3)));
    let polylines = drawing["polylines"].as_array().unwrap();
    let of_kind = |kind: &str| polylines.iter().filter(|p| p["kind"] == kind).count();
    assert!(of_kind("boundary") > 0 && of_kind("iso") > 0);
    let stats: Value = serde_json::from_slice(&read("s.json")).unwrap();
    assert_eq!(stats["strokes"]["count"], polylines.len());
    assert!(stats["seconds"]["total"].as_f64().unwrap() > 0.0);
}

#[test]
fn polylines_lie_on_the_surface_and_on_the_page() {
    let folder = folder_with(&model());
    assert!(penvis(folder.path(), "draw model.json -o a.json --paper 120x100 --margin 10 --view top").status.success());
    let drawing: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let numbers =
        |value: &Value| -> Vec<f64> { value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    for polyline in drawing["polylines"].as_array().unwrap() {
        let points = polyline["points"].as_array().unwrap();
        let page = polyline["page"].as_array().unwrap();
        assert_eq!(points.len(), page.len());
        for (point, page) in points.iter().zip(page) {
            let ([x, y, z], [a, b]) = (numbers(point)[..].try_into().unwrap(), numbers(page)[..].try_into().unwrap());
            // z = x + y − 2xy; and the unit square becomes 80 mm in the middle of the sheet.
            assert!((z - (x + y - 2.0 * x * y)).abs() < 1e-9);
            assert!((a - (20.0 + 80.0 * x)).abs() < 1e-6 && (b - (10.0 + 80.0 * y)).abs() < 1e-6, "{x} {y}: {a} {b}");
        }
    }
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    let folder = folder_with(&model());
    for name in ["a.json", "b.json"] {
        assert!(penvis(folder.path(), &format!("draw model.json -o {name}")).status.success());
    }
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("a.json"), read("b.json"));
}

#[test]
fn bad_models_leave_one_line_and_no_file() {
    type Case = (&'static str, Value, &'static str);
    let table: &[Case] = &[
        ("/surfaces/0/knots_u/2", json!(-1), "error: model.json: surface 0: knots_u[2]: "),
        (
            "/surfaces/0/control_points/1/0/3",
            json!(0),
            "error: model.json: surface 0: control_points[1][0]: has weight 0",
        ),
        ("/surfaces/0/control_points/1/0", json!([1, 2]), "error: model.json: surface 0: control_points[1][0]"),
        ("/surfaces/0/degree_v", json!(77), "error: model.json: surface 0: degree_v: "),
        ("/surfaces", json!([]), "error: model.json: surfaces: is empty"),
        ("/view/up", json!([0.3, -0.2, 1.0]), "error: model.json: view: "),
    ];
    for (place, value, expected) in table {
        let mut model = model();
        *model.pointer_mut(place).unwrap() = value.clone();
        let folder = folder_with(&model);
        refused(&folder, "draw model.json -o a.svg -o a.json --stats s.json", expected);
        refused(&folder, "info model.json", expected);
    }
}

#[test]
fn trims_are_drawn_and_counted_and_what_is_wrong_with_one_is_named() {
    let mut model = model();
    let triangle = |tip: f64| {
        json!([{"degree": 1, "knots": [0, 0, 1, 2, 3, 3],
                "control_points": [[0.2, 0.2, 1], [0.7, 0.3, 1], [0.4, 0.8, 1], [0.2, tip, 1]]}])
    };
    model["surfaces"][0]["trim_loops"] = json!([triangle(0.2)]);
    let folder = folder_with(&model);
    let output = penvis(folder.path(), "draw model.json --iso 0 -o a.json --stats s.json");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read =
        |name: &str| -> Value { serde_json::from_str(&fs::read_to_string(folder.path().join(name)).unwrap()).unwrap() };
    assert_eq!(read("s.json")["model"]["trims"], 1);
    // The surface is z = u + v − 2 u v over (u, v) = (x, y); its own borders are cut off.
    let drawing = read("a.json");
    let points = drawing["polylines"].as_array().unwrap().iter().flat_map(|p| p["points"].as_array().unwrap());
    for p in points {
        let [x, y, z] = [0, 1, 2].map(|k| p[k].as_f64().unwrap());
        assert!((0.2..=0.7).contains(&x) && (0.2..=0.8).contains(&y), "{p}");
        assert!((z - (x + y - 2.0 * x * y)).abs() < 1e-9, "{p}");
    }
    model["surfaces"][0]["trim_loops"] = json!([triangle(0.3)]);
    refused(&folder_with(&model), "draw model.json -o a.svg", "error: model.json: surface 0: trim_loops[0][0]: ");
}

#[test]
fn bad_commands_leave_one_line_and_no_file() {
    let folder = folder_with(&model());
    let table = [
        ("draw model.json -o a.svg -o a.pdf", "error: a.pdf: unknown kind of file; the extensions are .svg, "),
        ("draw nothing -o a.svg", "error: there is no file `nothing` and no built-in model"),
        ("draw model.json -o nowhere/a.svg", "error: nowhere/a.svg: there is no folder nowhere"),
        ("draw model.json -o a.svg -o model.json", "error: model.json: is the model"),
        ("draw model.json -o a.svg --view 0,0,0", "error: --view 0,0,0: "),
        ("draw model.json -o a.svg --view top --up 0,0,1", "error: --view, --up: the up vector is parallel"),
        ("draw model.json -o a.svg --margin 200", "error: a margin of 200 mm leaves no room"),
        ("draw model.json -o a.plt --device hp7475a --margin 0", "error: a.plt: the drawing has ink at "),
        ("draw model.json -o a.plt --hidden layer --device nobody", "error: there is no device `nobody`"),
        ("info nothing", "error: there is no file `nothing`"),
    ];
    for (words, expected) in table {
        refused(&folder, words, expected);
    }
}

/// Runs a command that must fail with one line on standard error and without a file.
fn refused(folder: &TempDir, words: &str, expected: &str) {
    let output = penvis(folder.path(), words);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success(), "{words}");
    assert!(told.starts_with(expected), "{words} gave {told:?}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(files(folder).is_empty(), "{words} left {:?}", files(folder));
}

#[test]
fn hidden_curves_are_kept_when_asked_for() {
    // A square below another one, so that most of it is hidden from above.
    let mut model = model();
    let square = |z: f64, a: f64, b: f64| {
        json!({"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
               "control_points": [[[a, a, z, 1], [a, b, z, 1]], [[b, a, z, 1], [b, b, z, 1]]]})
    };
    model["surfaces"] = json!([square(0.0, 0.2, 0.8), square(1.0, 0.0, 1.0)]);
    let folder = folder_with(&model);
    let drawn = |how: &str| -> Vec<Value> {
        let done = penvis(folder.path(), &format!("draw model.json -o a.json --view top --iso 0 --hidden {how}"));
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let drawing: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
        assert_eq!(drawing["isos"], 0);
        drawing["polylines"].as_array().unwrap().clone()
    };
    assert!(drawn("omit").iter().all(|p| p["surface"] == 1 && p["visible"] == true && p["qi"] == 0));
    let hidden = |how: &str| drawn(how).into_iter().filter(|p| p["layer"] == "hidden").collect::<Vec<_>>();
    for how in ["layer", "dashed"] {
        let hidden = hidden(how);
        assert!(
            !hidden.is_empty() && hidden.iter().all(|p| p["surface"] == 0 && p["visible"] == false && p["qi"] == 1)
        );
    }
    assert!(hidden("dashed").len() > 5 * hidden("layer").len());
}

#[test]
fn info_tells_what_there_is() {
    let folder = folder_with(&model());
    let told = |words: &str| String::from_utf8(penvis(folder.path(), words).stdout).unwrap();
    assert!(told("info model.json").starts_with("sail: 1 surface, 1 Bézier patch\n"));
    assert!(told("info --list").lines().any(|line| line.starts_with("teapot ")));
}

#[test]
fn hidden_curves_are_told_apart_by_the_sheets_before_them() {
    let folder = tempfile::tempdir().unwrap();
    let layers = |words: &str| -> std::collections::BTreeSet<(String, u64, u64)> {
        let done = penvis(folder.path(), &format!("draw linked_tori -o a.json --iso 2 {words}"));
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let drawing: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
        let lines = drawing["polylines"].as_array().unwrap().iter().filter(|l| l["visible"] == false);
        lines
            .map(|l| (l["layer"].as_str().unwrap().to_owned(), l["pen"].as_u64().unwrap(), l["qi"].as_u64().unwrap()))
            .collect()
    };
    let named = |list: &[(&str, u64, u64)]| list.iter().map(|&(l, p, q)| (l.to_owned(), p, q)).collect();
    assert!(layers("").is_empty() && layers("--qi 0").is_empty());
    assert_eq!(layers("--qi 2"), named(&[("hidden-1", 2, 1), ("hidden-2", 3, 2)]));
    assert_eq!(layers("--qi 1 --hidden dashed"), named(&[("hidden-1", 1, 1)]));
    assert!(layers("--hidden layer").iter().all(|(layer, pen, _)| layer == "hidden" && *pen == 2));
    let refused = penvis(folder.path(), "draw saddle -o b.svg --qi 1 --hidden omit");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("leaves nothing to --qi"));
}

#[test]
fn both_ways_to_visibility_draw_the_same() {
    let folder = tempfile::tempdir().unwrap();
    for way in ["rays", "propagate"] {
        let done = penvis(folder.path(), &format!("draw pawn -o {way}.gcode --visibility {way}"));
        assert!(done.status.success());
    }
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("rays.gcode") == read("propagate.gcode"));
}

#[test]
fn the_time_limit_ends_a_drawing_with_nothing_written() {
    let folder = tempfile::tempdir().unwrap();
    let done = penvis(folder.path(), "draw spring -o a.svg --stats s.json --time-limit 0.01");
    let told = String::from_utf8(done.stderr).unwrap();
    assert!(!done.status.success() && told.starts_with("error: --time-limit: 0.01 s were over while "), "{told}");
    assert!(files(&folder).is_empty());
    let refused = penvis(folder.path(), "draw spring -o a.svg --time-limit 0");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--time-limit 0: is not a time"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_drawing_with_nothing_written() {
    use std::process::Stdio;
    use std::thread::sleep;
    use std::time::Duration;

    let folder = tempfile::tempdir().unwrap();
    // Minutes of work.
    let words = "draw spring -o a.svg --iso 1000 --stats s.json";
    let mut child = Command::new(env!("CARGO_BIN_EXE_penvis"))
        .args(words.split_whitespace())
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    sleep(Duration::from_millis(700));
    assert!(child.try_wait().unwrap().is_none(), "it ended before the signal");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let done = child.wait_with_output().unwrap();
    let told = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(130), "{told}");
    assert!(told.starts_with("error: stopped by Ctrl-C while ") && told.lines().count() == 1, "{told}");
    assert!(files(&folder).is_empty());
}

#[test]
fn the_number_of_cores_changes_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    for way in ["rays", "propagate"] {
        let drawn = |cores: &str| {
            let words = format!("draw missile -o {cores}.json --qi 3 --visibility {way}");
            let mut command = Command::new(env!("CARGO_BIN_EXE_penvis"));
            command.args(words.split_whitespace()).current_dir(folder.path()).env("RAYON_NUM_THREADS", cores);
            assert!(command.output().unwrap().status.success());
            fs::read(folder.path().join(format!("{cores}.json"))).unwrap()
        };
        assert_eq!(drawn("1"), drawn("3"), "{way}");
    }
}

#[test]
fn isocurves_are_as_far_apart_as_asked_and_come_in_layers() {
    let folder = folder_with(&model());
    let words = "draw model.json -o a.json -o a.svg -o a.gcode --stats s.json --iso-spacing 2 --iso-levels 3 \
                 --iso-direction v --curves boundary,iso";
    let done = penvis(folder.path(), words);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let read = |name: &str| -> Value { serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap() };
    let (drawing, stats) = (read("a.json"), read("s.json"));
    assert_eq!(drawing["isos"], 0);
    let mut layers: Vec<String> =
        drawing["polylines"].as_array().unwrap().iter().map(|p| p["layer"].as_str().unwrap().to_owned()).collect();
    layers.dedup();
    assert_eq!(layers, ["boundary", "iso-1", "iso-2", "iso-3"]);
    let svg = fs::read_to_string(folder.path().join("a.svg")).unwrap();
    assert!(svg.contains("inkscape:label=\"iso-2\""));
    let [curves, distances] = ["curves", "distances"].map(|key| stats["isocurves"][key].as_u64().unwrap());
    assert!(curves > 60, "{curves}");
    assert_eq!(distances, 2 * curves - 3);

    let shaded = penvis(folder.path(), "draw model.json -o b.json --shade lambert --light 1,0,1 --pen-width 0.5");
    assert!(shaded.status.success(), "{}", String::from_utf8_lossy(&shaded.stderr));
    assert!(!read("b.json")["polylines"].as_array().unwrap().is_empty());

    let both = penvis(folder.path(), "draw model.json -o b.json --iso 4 --iso-spacing 1");
    assert!(String::from_utf8_lossy(&both.stderr).contains("cannot be used with"));
}

#[test]
fn a_fault_whose_place_the_seed_decides_happens() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.gcode"), "G21\nG90\nM3S1000\nG1X5F3000\nG1Y5\nM3S0\nG0X0Y0\n").unwrap();
    fs::write(folder.path().join("job.plt"), "IN;SP1;PA0,0;PD400,0,400,400;PU;SP0;").unwrap();
    for seed in 1..=6 {
        for (job, port) in [("job.gcode", "sim:grbl"), ("job.plt", "sim:hpgl7475a")] {
            for fault in ["corrupted", "lost-answer", "missing-ok"] {
                let output = penvis(folder.path(), &format!("plot {job} --port {port} --fault {fault} --seed {seed}"));
                let said = String::from_utf8_lossy(&output.stderr).into_owned();
                assert!(said.contains(&format!("fault {fault}@")), "{port}, {fault}, seed {seed}: {said}");
            }
        }
    }
}

#[test]
fn a_packed_scene_holds_the_model_and_its_place_on_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let said = penvis(folder.path(), "pack saddle --iso 3 --paper a5 -o saddle.bin");
    assert!(said.status.success(), "{said:?}");
    let stored = StoredScene::unpack(&fs::read(folder.path().join("saddle.bin")).unwrap()).unwrap();
    assert_eq!((stored.scene.name.as_str(), stored.looks[0].style.isos, stored.looks[0].pen), ("saddle", 3, 1));
    assert_eq!(stored.program.start, "G21\nG90\nG17\nG94\n");
    assert_eq!(stored.program.up, "M3 S0\nG4 P0.15\n");
    // The picture fills the sheet of 210 mm by 148 mm up to its margin in one direction, and is in its middle.
    let camera = stored.sight.camera().unwrap();
    let prepared = Prepared::styled(&stored.scene, &camera, &stored.options, stored.styles(), &()).unwrap();
    let [low, high] = prepared.extent().map(|corner| stored.program.to_machine(corner));
    assert!((low + high - DVec2::new(210.0, 148.0)).length() < 1e-9, "{low} {high}");
    let free = low.min_element();
    assert!((free - 14.8).abs() < 1e-3, "{low} {high}");
    for (words, expected) in [
        ("--shade lambert", "--iso N"),
        ("--hidden dashed", "--hidden layer"),
        ("--qi 2", "--hidden layer"),
        ("--device hp7475a", "draws by G-code"),
    ] {
        let said = penvis(folder.path(), &format!("pack saddle -o other.bin {words}"));
        let message = String::from_utf8(said.stderr).unwrap();
        assert!(!said.status.success() && message.contains(expected), "{words}: {message}");
        assert!(!folder.path().join("other.bin").exists());
    }
}

/// Ways with the pen up in mm, and the file.
fn travelled(words: &str) -> (f64, Vec<u8>) {
    let folder = folder_with(&model());
    let done = penvis(folder.path(), &format!("draw model.json --iso 12 -o a.gcode --stats s.json {words}"));
    assert!(done.status.success(), "{words}: {}", String::from_utf8_lossy(&done.stderr));
    let stats: Value = serde_json::from_slice(&fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    (stats["strokes"]["travel_mm"].as_f64().unwrap(), fs::read(folder.path().join("a.gcode")).unwrap())
}

#[test]
fn the_order_is_searched_for_as_asked_and_always_found_again() {
    let (searched, file) = travelled("--order-by distance --order-seed 3");
    assert_eq!(travelled("--order-by distance --order-seed 3").1, file);
    let (first, other) = travelled("--order-by distance --optimize 0");
    assert!(searched <= first && file != other, "{searched} mm after a search, {first} mm before it");
}

#[test]
fn regions_are_written_with_the_drawing() {
    let folder = folder_with(&model());
    let words = "draw model.json -o a.json --iso 0 --paper 100x80mm --margin 10 --emit-regions";
    for file in ["r.json", "r.svg"] {
        let done = penvis(folder.path(), &format!("{words} {file}"));
        let told = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.success() && told.contains("\nregions: 1 surfaces, 1 loops, "), "{told}");
    }
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (drawing, regions): (Value, Value) =
        (serde_json::from_str(&read("a.json")).unwrap(), serde_json::from_str(&read("r.json")).unwrap());
    assert_eq!(
        (&regions["name"], &regions["view"], &regions["page"]),
        (&drawing["name"], &drawing["view"], &drawing["page"])
    );
    assert_eq!((&regions["undecided"], &regions["regions"][0]["surface"]), (&json!([]), &json!(0)));
    let points = |edges: &Value, field: &str| -> Vec<DVec2> {
        let of = |edge: &Value| edge[field].as_array().unwrap().clone();
        let all = edges.as_array().unwrap().iter().flat_map(of);
        all.map(|p| DVec2::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap())).collect()
    };
    let edges = &regions["regions"][0]["loops"][0];
    let (page, uv) = (points(edges, "page"), points(edges, "uv"));
    assert_eq!(page.len(), uv.len());
    let area = page.windows(2).map(|w| 0.5 * w[0].perp_dot(w[1])).sum::<f64>();
    assert!((area - regions["regions"][0]["area_mm2"].as_f64().unwrap()).abs() < 1e-6 * area && area > 100.0, "{area}");
    // The border is ink: each of its points lies on a stroke, to the tolerance.
    let ink = points(&drawing["polylines"], "page");
    assert!(page.iter().all(|p| ink.windows(2).any(|w| {
        let d = w[1] - w[0];
        let along = ((*p - w[0]).dot(d) / d.length_squared().max(1e-12)).clamp(0.0, 1.0);
        p.distance(w[0] + d * along) < 0.03
    })));
    assert!(read("r.svg").contains("<path id=\"surface-0\" fill=\"#"));

    for (words, expected) in [
        (
            "draw model.json -o a.svg --emit-regions r.png",
            "error: r.png: --emit-regions writes .svg or .json; choose one of these extensions\n",
        ),
        ("draw model.json -o a.svg --emit-regions a.svg", "error: a.svg: is asked for twice\n"),
        (
            "draw a.json -o a.svg --emit-regions r.svg",
            "error: --emit-regions is for models, and a.json is a drawing: its strokes are as they are; leave it out\n",
        ),
    ] {
        let refused = penvis(folder.path(), words);
        assert!(!refused.status.success());
        assert_eq!(String::from_utf8(refused.stderr).unwrap(), expected);
    }
}

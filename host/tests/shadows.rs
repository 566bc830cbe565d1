//! Shadows, from the command line to the paper.

mod common;

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use common::penvis;
use glam::DVec2;
use serde_json::Value;

fn run(folder: &Path, words: &str) -> String {
    let output = penvis(folder, &format!("draw {words}"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{words}: {said}");
    said
}

/// The hatch lines of a drawing in mm.
fn hatches(folder: &Path, words: &str) -> Vec<Vec<DVec2>> {
    run(folder, &format!("{words} --optimize 0 --merge 0 -o drawn.json"));
    let json: Value = serde_json::from_slice(&fs::read(folder.join("drawn.json")).unwrap()).unwrap();
    let page = |p: &Value| -> Vec<DVec2> {
        let points: Vec<[f64; 2]> = serde_json::from_value(p["page"].clone()).unwrap();
        points.into_iter().map(DVec2::from).collect()
    };
    json["polylines"].as_array().unwrap().iter().filter(|p| p["kind"] == "hatch").map(page).collect()
}

fn ink_mm(lines: &[Vec<DVec2>]) -> f64 {
    lines.iter().flat_map(|page| page.windows(2)).map(|w| w[0].distance(w[1])).sum()
}

/// Seen from the front, with the light from above half of it is dark.
const BALL: &str = "[[object]]\nsphere = { radius = 1 }\n[camera]\nview = [0, -1, 0]\n";

const HATCHED: &str = "ball.toml --width 100mm --fill hatch --fill-pitch 2 --fill-gap 0";

#[test]
fn shadows_alone_are_filled_and_with_a_tone_they_are_darkest() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("ball.toml"), BALL).unwrap();
    let disk = PI * 50.0 * 50.0;
    let of = |words: &str| hatches(folder, &format!("{HATCHED} {words}"));
    let whole = of("");
    let dark = of("--shadows --light 0,1,0");
    assert!((2.0 * ink_mm(&dark) - disk / 2.0).abs() < 0.01 * disk, "{} mm", ink_mm(&dark));
    assert!(dark.iter().flatten().all(|p| p.y <= 105.0 + 0.02), "the lower half of a sheet of 210 mm");
    assert_eq!(of("--shadows --light 0,0,1").len(), 0);
    assert!((ink_mm(&of("--shadows --light 0,0,-1")) - ink_mm(&whole)).abs() < 1e-6);
    // Where all is dark anyway, the border of the shadow divides no line.
    let black = of("--shadows --light 0,1,0 --shade 1");
    assert!((ink_mm(&black) - ink_mm(&of("--shade 1"))).abs() < 1e-6);
    assert_eq!(black.len(), of("--shade 1").len());
    // Where nothing else is, there are the shadows.
    assert!((ink_mm(&of("--shadows --light 0,1,0 --shade 0")) - ink_mm(&dark)).abs() < 0.01 * ink_mm(&dark));
    let half = ink_mm(&of("--shadows --light 0,1,0 --shade 0.5"));
    assert!((half - 0.75 * ink_mm(&whole)).abs() < 0.02 * ink_mm(&whole), "{half}");
}

#[test]
fn shadows_are_written_beside_regions() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("ball.toml"), BALL).unwrap();
    let said = run(
        folder,
        "ball.toml --width 100mm --shadows --light 0,1,0 --emit-regions shapes.json -o drawn.svg --curves silhouette",
    );
    assert!(said.contains("shadows: 1 surfaces, 3927 mm²\n"), "{said}");
    let json: Value = serde_json::from_slice(&fs::read(folder.join("shapes.json")).unwrap()).unwrap();
    let [shadow] = &json["shadows"].as_array().unwrap()[..] else { panic!("one shadow: {json}") };
    let area = shadow["area_mm2"].as_f64().unwrap();
    assert!((area - PI * 1250.0).abs() < 3.0 && shadow["surface"] == 0, "{area}");
    for own in shadow["loops"].as_array().unwrap() {
        let (page, uv) = (own["page"].as_array().unwrap(), own["uv"].as_array().unwrap());
        assert!(page.len() == uv.len() && page.len() > 20);
    }
    assert_eq!(json["undecided_shadows"].as_array().map(Vec::len), Some(0));
    run(folder, "ball.toml --width 100mm --shadows --light 0,1,0 --emit-regions shapes.svg -o drawn.svg");
    let svg = fs::read_to_string(folder.join("shapes.svg")).unwrap();
    assert!(svg.contains("<g id=\"shadows\"") && svg.contains("<path id=\"shadow-0\""), "{svg}");
    run(folder, "ball.toml --emit-regions shapes.json -o drawn.svg");
    let json: Value = serde_json::from_slice(&fs::read(folder.join("shapes.json")).unwrap()).unwrap();
    assert!(json.get("shadows").is_none() && json.get("undecided_shadows").is_none());
}

#[test]
fn shadows_that_darken_nothing_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("ball.toml"), BALL).unwrap();
    run(folder, "ball.toml -o ball.json");
    for (words, told) in [
        ("draw ball.toml --shadows -o x.svg", "--fill hatch"),
        ("draw ball.toml --shadows --shade lambert -o x.svg", "--emit-regions"),
        ("draw ball.toml --shadows --fill none -o x.svg", "--shadows: nothing is filled"),
        ("draw ball.json --shadows -o x.svg", "--shadows"),
        ("draw ball.toml --shadows --render -o x.png", "--shadows"),
        ("pack ball.toml --shadows -o x.pvs", "--shadows: a board draws no shadows"),
    ] {
        let output = penvis(folder, words);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && error.contains(told), "{words}: {error}");
        assert!(!folder.join("x.svg").exists());
    }
}

//! Fills, from the command line to the paper.

mod common;

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use common::penvis;
use glam::DVec2;
use serde_json::Value;

/// The polylines of a drawing on the paper, in mm, with their kinds and pens.
struct Drawn(Vec<(String, u64, Vec<DVec2>)>);

fn drawn(folder: &Path, words: &str) -> Drawn {
    let output = penvis(folder, &format!("draw {words} --optimize 0 -o drawn.json"));
    assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&fs::read(folder.join("drawn.json")).unwrap()).unwrap();
    let polyline = |p: &Value| {
        let page: Vec<[f64; 2]> = serde_json::from_value(p["page"].clone()).unwrap();
        assert_eq!(p["points"].as_array().unwrap().len(), page.len());
        (
            p["kind"].as_str().unwrap().to_owned(),
            p["pen"].as_u64().unwrap(),
            page.into_iter().map(DVec2::from).collect(),
        )
    };
    Drawn(json["polylines"].as_array().unwrap().iter().map(polyline).collect())
}

impl Drawn {
    fn hatches(&self) -> impl Iterator<Item = &[DVec2]> {
        self.0.iter().filter(|(kind, ..)| kind == "hatch").map(|(.., page)| &page[..])
    }

    fn outlines(&self) -> impl Iterator<Item = &[DVec2]> {
        self.0.iter().filter(|(kind, ..)| kind != "hatch" && kind != "iso").map(|(.., page)| &page[..])
    }

    /// Length of the fills in mm.
    fn ink_mm(&self) -> f64 {
        self.hatches().flat_map(|page| page.windows(2)).map(|w| w[0].distance(w[1])).sum()
    }

    /// Distance in mm between the fills and the outlines where they are nearest.
    fn nearest_mm(&self) -> f64 {
        let segments: Vec<[DVec2; 2]> = self.outlines().flat_map(|l| l.windows(2)).map(|w| [w[0], w[1]]).collect();
        let hatches = self.hatches().flat_map(|l| l.windows(2)).map(|w| [w[0], w[1]]);
        let mut nearest = f64::INFINITY;
        for h in hatches {
            let (low, high) = (h[0].min(h[1]), h[0].max(h[1]));
            // What is farther off than the nearest so far by its box alone is not looked at.
            let near = |s: &&[DVec2; 2]| {
                let away = (low - s[0].max(s[1])).max(s[0].min(s[1]) - high);
                away.max_element() < nearest
            };
            nearest = segments.iter().filter(near).map(|s| apart(h, *s)).fold(nearest, f64::min);
        }
        nearest
    }
}

/// Distance of two segments.
fn apart(a: [DVec2; 2], b: [DVec2; 2]) -> f64 {
    let side = |[p, q]: [DVec2; 2], x: DVec2| (q - p).perp_dot(x - p);
    if side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0 {
        return 0.0;
    }
    let from = |x: DVec2, [p, q]: [DVec2; 2]| {
        let d = q - p;
        x.distance(p + d * ((x - p).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
    };
    from(a[0], b).min(from(a[1], b)).min(from(b[0], a)).min(from(b[1], a))
}

const BALL: &str = "[[object]]\nsphere = { radius = 1 }\n[camera]\nview = [0, -1, 0]\n";

#[test]
fn a_ball_is_covered_by_as_much_ink_as_its_disk_takes() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.toml"), BALL).unwrap();
    let ink = |words: &str| drawn(folder.path(), &format!("ball.toml --width 100mm {words}")).ink_mm();
    let (disk, rim) = (PI * 50.0 * 50.0, PI * 100.0);
    let whole = ink("--fill hatch --fill-pitch 2 --fill-gap 0");
    println!("{whole} mm at 2 mm on {disk} mm²");
    assert!((2.0 * whole - disk).abs() < 0.01 * disk, "{whole}");
    let gap = ink("--fill hatch --fill-pitch 2 --fill-gap 3 --fill-angle 17");
    assert!((2.0 * gap - PI * 47.0 * 47.0).abs() < 0.01 * disk && gap < whole - rim / 2.0, "{gap}");
    let cross = ink("--fill cross --fill-pitch 2 --fill-gap 0");
    assert!((cross - 2.0 * whole).abs() < 0.01 * whole, "{cross} {whole}");
    // At half the darkness there is every second line; where the light falls there is none.
    let half = ink("--fill hatch --fill-pitch 2 --fill-gap 0 --shade 0.5");
    assert!((half - whole / 2.0).abs() < 0.02 * whole, "{half} {whole}");
    let lit = ink("--fill hatch --fill-pitch 2 --fill-gap 0 --shade lambert");
    assert!(lit > 0.2 * whole && lit < 0.7 * whole, "{lit} {whole}");
}

#[test]
fn objects_have_fills_and_pens_of_their_own_and_what_is_hidden_has_none() {
    let folder = tempfile::tempdir().unwrap();
    // Seen from above: half of the square lies under the other.
    let scene = "
[[object]]
rectangle = { size = [4, 4] }
pen = { hatch = 3 }
fill = { kind = 'hatch', angle = 0, pitch = 1, gap = 0 }
[[object]]
rectangle = { size = [4, 4] }
translate = [2, 0, 1]
[camera]
view = 'top'
";
    fs::write(folder.path().join("two.toml"), scene).unwrap();
    let own = drawn(folder.path(), "two.toml --scale 10:1");
    // Twenty millimetres of the square are seen, and forty lines go across.
    let ink = own.ink_mm();
    assert!((ink - 20.0 * 40.0).abs() <= 20.0, "{ink}");
    assert!(own.0.iter().all(|(kind, pen, _)| *pen == if kind == "hatch" { 3 } else { 1 }));
    assert!(own.0.iter().any(|(kind, ..)| kind == "iso"), "the other has isocurves");
    let none = drawn(folder.path(), "two.toml --scale 10:1 --fill none");
    assert_eq!(none.ink_mm(), 0.0);
}

#[test]
fn rings_are_as_much_ink_as_a_disk_takes_and_keep_their_distance() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.toml"), BALL).unwrap();
    // Circles at 1, 3, 5, … mm from the rim of a disk with a radius of 50 mm.
    let own = drawn(folder.path(), "ball.toml --width 100mm --fill contour --fill-pitch 2 --fill-gap 1");
    assert_eq!(own.hatches().count(), 25);
    let whole = own.ink_mm();
    assert!((2.0 * whole - PI * 50.0 * 50.0).abs() < 0.01 * whole, "{whole}");
    assert!(own.hatches().all(|ring| ring.first() == ring.last()));
    // Without a gap of their own they are as far from the rim as from one another.
    let usual = drawn(folder.path(), "ball.toml --width 100mm --fill contour --fill-pitch 2");
    assert!((usual.nearest_mm() - 2.0).abs() < 0.02, "{}", usual.nearest_mm());
    let half = drawn(folder.path(), "ball.toml --width 100mm --fill contour --fill-pitch 1 --fill-gap 0.5 --shade 0.5")
        .ink_mm();
    assert!((half - PI * 50.0 * 50.0 / 2.0).abs() < 0.03 * half, "{half}");
}

#[test]
fn isocurves_are_a_pitch_apart_on_average_and_are_no_other_isocurves() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.toml"), BALL).unwrap();
    let own = drawn(folder.path(), "ball.toml --width 100mm --fill iso --fill-pitch 1 --fill-gap 0.5");
    let disk = PI * 50.0 * 50.0;
    assert!((own.ink_mm() - disk).abs() < 0.05 * disk, "{}", own.ink_mm());
    assert!(own.0.iter().all(|(kind, ..)| kind != "iso"), "the usual ones are not asked for");
    let both =
        drawn(folder.path(), "ball.toml --width 100mm --fill iso --fill-pitch 1 --fill-gap 0.5 --iso 3 --pen hatch=2");
    let isos = both.0.iter().filter(|(kind, ..)| kind == "iso").count();
    assert!(isos > 0 && both.0.iter().all(|(kind, pen, _)| *pen == if kind == "hatch" { 2 } else { 1 }));
    assert!((both.ink_mm() - own.ink_mm()).abs() < 0.02 * disk, "{} {}", both.ink_mm(), own.ink_mm());
    let twice =
        drawn(folder.path(), "ball.toml --width 100mm --fill iso --fill-pitch 1 --fill-gap 0.5 --iso-direction both");
    assert!((twice.ink_mm() - 2.0 * disk).abs() < 0.1 * disk, "{}", twice.ink_mm());
    let half =
        drawn(folder.path(), "ball.toml --width 100mm --fill iso --fill-pitch 1 --fill-gap 0 --shade 0.5").ink_mm();
    assert!((half - disk / 2.0).abs() < 0.05 * disk, "{half}");
}

#[test]
fn surfaces_have_isocurves_of_their_own_pitch_where_they_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    // Seen from above: half of the square lies under the other.
    let scene = "
[[object]]
rectangle = { size = [40, 40] }
pen = { hatch = 3 }
fill = { kind = 'iso', pitch = 2, gap = 0, direction = 'u' }
[[object]]
rectangle = { size = [40, 40] }
translate = [20, 0, 1]
pen = { hatch = 4 }
fill = { kind = 'iso', pitch = 0.5, gap = 1, direction = 'v' }
[camera]
view = 'top'
";
    fs::write(folder.path().join("two.toml"), scene).unwrap();
    let own = drawn(folder.path(), "two.toml --scale 1:1");
    let ink = |wanted: u64| -> f64 {
        let lines = own.0.iter().filter(|(kind, pen, _)| kind == "hatch" && *pen == wanted);
        lines.flat_map(|(.., page)| page.windows(2)).map(|w| w[0].distance(w[1])).sum()
    };
    // An isocurve a pitch but for the outermost, which are outlines.
    assert!((ink(3) - 20.0 * 20.0).abs() <= 4.0 * 20.0, "{}", ink(3));
    assert!((ink(4) - 38.0 * 76.0).abs() <= 8.0 * 38.0, "{}", ink(4));
}

#[test]
fn there_is_as_much_ink_as_it_is_dark() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("square.toml"), "[[object]]\nrectangle = { size = [1, 1] }\n[camera]\nview = 'top'\n")
        .unwrap();
    for kind in ["hatch", "cross"] {
        let ink = |words: &str| {
            let page = "--width 160mm --fill-pitch 0.5 --fill-gap 0 --fill-angle 0";
            drawn(folder.path(), &format!("square.toml {page} --fill {kind} {words}")).ink_mm()
        };
        let whole = ink("");
        for dark in [0.05, 0.1, 0.3, 0.45, 0.6, 0.7, 0.85, 0.95] {
            let share = ink(&format!("--shade {dark}")) / whole;
            println!("{kind} {dark}: {share}");
            assert!((share - dark).abs() < 0.01, "{kind} {dark}: {share}");
        }
    }
}

#[test]
fn flat_faces_have_their_lines_equally_far_apart() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("box.toml"), "[[object]]\nbox = { size = [3, 2, 1] }\nsurface.top = { pen = 2 }\n").unwrap();
    let words = "box.toml --width 160mm --fill hatch --fill-pitch 0.5 --fill-gap 0 --fill-angle 0 --light 2,0.3,1";
    let top = |drawn: Drawn| -> Vec<f64> {
        let own = drawn.0.into_iter().filter(|(kind, pen, _)| kind == "hatch" && *pen == 2);
        let mut heights: Vec<f64> = own.map(|(.., page)| page[0].y).collect();
        heights.sort_by(f64::total_cmp);
        heights
    };
    let whole = top(drawn(folder, words));
    for shade in ["lambert", "0.37"] {
        let heights = top(drawn(folder, &format!("{words} --shade {shade}")));
        let pitch = heights[1] - heights[0];
        assert!(heights.windows(2).all(|w| (w[1] - w[0] - pitch).abs() < 1e-6), "{shade}: {heights:?}");
        let share = heights.len() as f64 / whole.len() as f64;
        assert!(pitch > 0.6 && (share * pitch - 0.5).abs() < 0.02 * pitch, "{shade}: {pitch}, {share}");
    }
    // In the shadow of nothing the lines are the same.
    let shadows = top(drawn(folder, &format!("{words} --shade lambert --shadows")));
    assert_eq!(shadows.len(), top(drawn(folder, &format!("{words} --shade lambert"))).len());
}

#[test]
fn fills_keep_their_gap_from_all_outlines_of_models() {
    let folder = tempfile::tempdir().unwrap();
    let gap = 0.4;
    for kind in ["hatch", "cross --fill-angle 0", "contour", "iso", "iso --shade lambert"] {
        let mut worst = f64::INFINITY;
        for model in ["torus", "vase", "pawn", "teapot", "teapot --view front", "vase --view top"] {
            let own = drawn(folder.path(), &format!("{model} --fill {kind} --fill-pitch 4 --fill-gap {gap}"));
            let nearest = own.nearest_mm();
            println!("{kind}, {model}: {} lines, {:.0} mm, {nearest} mm", own.hatches().count(), own.ink_mm());
            assert!(own.ink_mm() > 500.0, "{kind}, {model}: {}", own.ink_mm());
            worst = worst.min(nearest);
        }
        println!("{kind}: nearest to an outline: {worst} mm of {gap} mm");
        assert!(worst > gap - 0.01, "{kind}: {worst}");
    }
}

/// Whether a point is inside loops by the even-odd rule, or within `near` of one of their sides.
fn is_inside(p: DVec2, loops: &[Vec<DVec2>], near: f64) -> bool {
    let sides = loops.iter().flat_map(|own| own.iter().zip(own.iter().cycle().skip(1)));
    let mut inside = false;
    for (a, b) in sides {
        if apart([p, p], [*a, *b]) <= near {
            return true;
        }
        if (a.y <= p.y) != (b.y <= p.y) {
            inside ^= a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) > p.x;
        }
    }
    inside
}

#[test]
fn fills_are_where_something_is_seen_and_isocurves_where_their_surface_is() {
    let folder = tempfile::tempdir().unwrap();
    for (model, kind) in [
        ("linked_tori", "contour"),
        ("linked_tori", "iso"),
        ("vase --view top", "iso"),
        ("teapot", "iso"),
        ("teapot", "contour"),
    ] {
        let own = drawn(folder.path(), &format!("{model} --fill {kind} --fill-pitch 4 --emit-regions regions.json"));
        let json: Value = serde_json::from_slice(&fs::read(folder.path().join("regions.json")).unwrap()).unwrap();
        let shape = |region: &Value| {
            let points = |own: &Value| -> Vec<DVec2> {
                let edges = own.as_array().unwrap().iter();
                let page = |edge: &Value| -> Vec<[f64; 2]> { serde_json::from_value(edge["page"].clone()).unwrap() };
                edges.flat_map(page).map(DVec2::from).collect()
            };
            let loops: Vec<Vec<DVec2>> = region["loops"].as_array().unwrap().iter().map(points).collect();
            (region["surface"].as_u64().unwrap(), loops)
        };
        let shapes: Vec<(u64, Vec<Vec<DVec2>>)> = json["regions"].as_array().unwrap().iter().map(shape).collect();
        let drawing: Value = serde_json::from_slice(&fs::read(folder.path().join("drawn.json")).unwrap()).unwrap();
        let surfaces = drawing["polylines"].as_array().unwrap().iter().map(|p| p["surface"].as_u64().unwrap());
        let mut count = 0;
        for ((_, _, page), surface) in own.0.iter().zip(surfaces).filter(|((kind, ..), _)| kind == "hatch") {
            for w in page.windows(2) {
                let p = w[0].midpoint(w[1]);
                // Strokes of neighbours that meet are one, and have the surface of the one.
                let of = |s: &&(u64, Vec<Vec<DVec2>>)| kind == "contour" || s.0 == surface || model != "linked_tori";
                assert!(shapes.iter().filter(of).any(|(_, loops)| is_inside(p, loops, 0.02)), "{model} {kind}: {p}");
                count += 1;
            }
        }
        println!("{model} {kind}: {count} places");
        assert!(count > 100, "{count}");
    }
}

#[test]
fn surfaces_of_an_object_have_fills_and_pens_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "
[[object]]
box = { size = [40, 40, 40] }
fill = { kind = 'hatch', angle = 0, pitch = 1, gap = 0 }
pen = { hatch = 2 }
surface.top = { fill = { kind = 'contour', pitch = 2, gap = 1 }, pen = { hatch = 3 } }
surface.right = { fill = 'none' }
[camera]
view = [1, -1, 1]
";
    fs::write(folder.path().join("box.toml"), scene).unwrap();
    let own = drawn(folder.path(), "box.toml --scale 1:1");
    let of = |wanted: u64| own.0.iter().filter(move |(kind, pen, _)| kind == "hatch" && *pen == wanted);
    // Each face is seen at a third of the way round: its area is that of the square over the square root of three.
    let face = 40.0 * 40.0 / 3.0_f64.sqrt();
    let ink =
        |wanted: u64| -> f64 { of(wanted).flat_map(|(.., page)| page.windows(2)).map(|w| w[0].distance(w[1])).sum() };
    assert!((ink(2) - face).abs() < 0.03 * face, "{} {face}", ink(2));
    assert!((2.0 * ink(3) - face).abs() < 0.1 * face, "{} {face}", ink(3));
    assert!(of(3).all(|(.., page)| page.first() == page.last()));
    // The right side has none, and the pens of the outlines are as they were.
    assert!(own.0.iter().all(|(kind, pen, _)| *pen == 1 || kind == "hatch"));
    let middle =
        own.outlines().flatten().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p.x), b.max(p.x)]);
    let middle = middle[0].midpoint(middle[1]);
    assert!(of(2).all(|(.., page)| page.iter().all(|p| p.x < middle + 0.1)), "hatching is on the left only");
    // What the command line asks for goes before all of it.
    let all = drawn(folder.path(), "box.toml --scale 1:1 --fill cross");
    assert!(all.ink_mm() > 2.0 * own.ink_mm(), "{} {}", all.ink_mm(), own.ink_mm());
}

#[test]
fn facets_that_have_no_isocurves_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    fs::write(folder.path().join("tetra.obj"), corners).unwrap();
    let said = |words: &str| {
        let output = penvis(folder.path(), &format!("draw tetra.obj {words} -o x.svg"));
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let told = said("--fill iso");
    assert!(told.contains("4 facets of meshes are not filled"), "{told}");
    assert!(!said("--fill contour").contains("not filled"));
}

#[test]
fn what_is_no_fill_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for (words, told) in [
        ("--fill dots", "--fill dots: is not one of hatch, cross, contour, iso, none"),
        ("--fill hatch --fill-pitch 0", "--fill-pitch 0: is not a distance in mm from 0.01 to 1000"),
        ("--fill hatch --fill-gap=-1", "--fill-gap"),
        ("--fill iso --iso-direction w", "--iso-direction w: is not one of u, v, both, auto"),
        ("--fill hatch --iso-direction u", "goes with --iso-spacing, --shade or --fill iso"),
        ("--curves hatch", "--fill"),
    ] {
        let output = penvis(folder.path(), &format!("draw torus {words} -o x.svg"));
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && error.contains(told) && error.lines().count() == 1, "{words}: {error}");
    }
}

//! `penvis draw --render` from outside: a picture that lies on the page as the drawing does.

mod common;

use std::fs;
use std::path::Path;
use std::process::Output;

use common::penvis;
use tiny_skia::Pixmap;

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn picture(folder: &Path, name: &str) -> Pixmap {
    Pixmap::decode_png(&fs::read(folder.join(name)).unwrap()).unwrap()
}

#[test]
fn the_picture_fills_the_outline_of_the_drawing() {
    let folder = tempfile::tempdir().unwrap();
    let common = "draw torus --view 1,-2,1.5 --perspective 30 --paper 60x50mm --margin 5 --light 0,0,1";
    let rendered = penvis(folder.path(), &format!("{common} -o r.png -o s.png --render"));
    assert!(rendered.status.success(), "{}", told(&rendered));
    let line = told(&rendered);
    assert!(line.starts_with("torus: 354 × 295 pixels at 150 dpi, ") && line.lines().count() == 1, "{line}");
    let drawn = penvis(folder.path(), &format!("{common} --curves silhouette --pen-width 0.1 -o d.png"));
    assert!(drawn.status.success(), "{}", told(&drawn));
    assert_eq!(fs::read(folder.path().join("r.png")).unwrap(), fs::read(folder.path().join("s.png")).unwrap());

    let (rendered, drawn) = (picture(folder.path(), "r.png"), picture(folder.path(), "d.png"));
    let paper = rendered.pixel(0, 0).unwrap();
    let extent = |p: &Pixmap| {
        let width = p.width() as usize;
        let inked: Vec<usize> = (0..p.pixels().len()).filter(|&k| p.pixels()[k] != paper).collect();
        let columns = || inked.iter().map(|k| k % width);
        [columns().min(), columns().max(), inked.iter().map(|k| k / width).min(), inked.iter().map(|k| k / width).max()]
            .map(|x| x.unwrap() as f64 * 300.0 / width as f64)
    };
    // In units in which the page is 300 wide, to a pixel of the picture and the width of the pen.
    for (a, b) in extent(&rendered).into_iter().zip(extent(&drawn)) {
        assert!((a - b).abs() < 1.8, "{:?} {:?}", extent(&rendered), extent(&drawn));
    }
    // The light is where the eye is: bright towards the eye, dark at the rim.
    let brightest = rendered.pixels().iter().filter(|&&p| p != paper).map(|p| p.green()).max().unwrap();
    let darkest = rendered.pixels().iter().map(|p| p.green()).min().unwrap();
    assert!(brightest > 220 && darkest < 90 && darkest > 40, "{brightest} {darkest}");
}

#[test]
fn what_is_no_picture_is_refused_before_anything_is_painted() {
    let folder = tempfile::tempdir().unwrap();
    let refused = penvis(folder.path(), "draw sphere -o a.png -o a.svg --render");
    assert!(!refused.status.success());
    assert_eq!(
        told(&refused),
        "error: a.svg: --render paints pictures and draws no strokes; give a .png, or leave --render out\n"
    );
    let refused = penvis(folder.path(), "draw sphere -o a.png --stats s.json --render");
    assert!(!refused.status.success() && told(&refused).contains("--stats"), "{}", told(&refused));
    let late = penvis(folder.path(), "draw teapot -o a.png --render --time-limit 0.2 --paper 2000x2000mm");
    assert!(!late.status.success() && told(&late).contains("--time-limit: 0.2 s were over while"), "{}", told(&late));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

//! HPGL files read again by a program no one here wrote: hp2xx (Debian: apt-get install hp2xx).

use std::fs;
use std::io::ErrorKind;
use std::process::Command;

use glam::DVec2;
use penvis::device::find;
use penvis::drawing::Drawing;
use penvis::emit;
use penvis_tests::ink::Ink;
use penvis_tests::plotter::draw;
use penvis_tests::skip::skip;

/// Largest distance in mm: half the diagonal of a plotter unit, and the millionth of a number that hp2xx leaves out.
const DEVIATION_MM: f64 = 0.0125 * std::f64::consts::SQRT_2 + 1e-3;

/// The polylines in mm that hp2xx finds in HPGL, with the lower left corner of all its ink at the origin; `None`, with a word about it,
/// where it is not installed.
///
/// # Panics
/// Where it is not installed although `PENVIS_REQUIRE_EMULATOR` is set, or complains.
fn read_again(hpgl: &str) -> Option<Vec<Vec<DVec2>>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [job, told] = ["job.plt", "told.txt"].map(|name| folder.path().join(name));
    fs::write(&job, hpgl).expect("a temporary file");
    // In the size of the paper, as a list of points.
    let output = Command::new("hp2xx").args(["-q", "-t", "-m", "gpt", "-f"]).args([&told, &job]).output();
    let output = match output {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            skip("hp2xx", "install it (Debian: apt-get install hp2xx)");
            return None;
        }
        output => output.expect("hp2xx runs"),
    };
    assert!(output.status.success(), "hp2xx: {}", String::from_utf8_lossy(&output.stderr));
    let mut lines: Vec<Vec<DVec2>> = Vec::new();
    let mut up = true;
    for line in fs::read_to_string(told).expect("what hp2xx has written").lines() {
        match line.trim() {
            "#PU" => up = true,
            "#PD" => up = false,
            line => {
                let Some((x, y)) = line.split_once(char::is_whitespace) else { continue };
                let (Ok(x), Ok(y)) = (x.parse(), y.trim().parse()) else { continue };
                let point = DVec2::new(x, y);
                match lines.last_mut() {
                    Some(line) if !up => line.push(point),
                    _ => lines.push(vec![point]),
                }
            }
        }
    }
    lines.retain(|line| line.len() > 1);
    Some(lines)
}

/// The drawing moved so that the lower left corner of its ink is at the origin.
fn at_the_origin(drawing: &Drawing) -> Drawing {
    let mut moved = drawing.clone();
    let points = || drawing.polylines.iter().flat_map(|line| &line.page);
    let low = points().fold(DVec2::INFINITY, |low, p| low.min(*p));
    moved.polylines.iter_mut().flat_map(|line| &mut line.page).for_each(|p| *p -= low);
    moved
}

#[test]
fn hp2xx_reads_what_is_drawn() {
    for model in ["teapot", "torus"] {
        let drawing = draw(&[model, "--paper", "a4"]).drawing;
        let mut bytes = Vec::new();
        // Points in digits, and encoded.
        for name in ["dxy1300", "hpgl2"] {
            let hpgl = emit::hpgl(&drawing, &find(name).expect("a built-in device")).expect("HPGL");
            bytes.push(hpgl.len());
            let Some(lines) = read_again(&hpgl) else { return };
            let mut read = drawing.clone();
            read.polylines.truncate(1);
            let one = read.polylines.pop().expect("a stroke");
            read.polylines = lines
                .into_iter()
                .map(|page| {
                    let mut line = one.clone();
                    line.page = page;
                    line
                })
                .collect();
            let (wanted, got) = (Ink::new(&at_the_origin(&drawing)), Ink::new(&read));
            for (a, b) in [(&wanted, &got), (&got, &wanted)] {
                let (off, place) = a.farthest_from(b).expect("ink");
                // Each corner is rounded, and so is the one at the origin.
                assert!(off <= 2.0 * DEVIATION_MM, "{model}, {name}: {off} mm off at {place}");
            }
        }
        println!("{model}: {} bytes in digits, {} encoded", bytes[0], bytes[1]);
        assert!(bytes[1] < bytes[0], "{bytes:?}");
    }
}

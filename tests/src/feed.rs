//! Bytes that may be anything, for everything that reads. The fuzz targets and the test of their saved inputs share it.
//!
//! What is fed must end without a panic. What is refused must be refused in one line that a terminal can show, whatever
//! the bytes were.

mod machine;

use std::cell::Cell;

use penvis::device::{self, Device};
use penvis::drawing::{self, DrawingFormat};
use penvis::journal;
use penvis::model::{FORMATS, Import, ModelFormat, ReadError, Reading, Source, Watch};
use penvis::preflight;
use penvis::protocol;
use penvis_firmware::scene::{self, StoredScene};

/// Most characters of a message: it may quote the file, but not all of it.
const LONGEST_MESSAGE: usize = 1000;

/// Devices whose languages jobs are held against, one each.
const JOB_DEVICES: [&str; 3] = ["grbl-servo", "marlin-servo", "hp7475a"];

/// The formats of drawings, by the names of their fuzz targets.
const DRAWINGS: [(&str, DrawingFormat); 4] = [
    ("drawing-json", DrawingFormat::Json),
    ("svg", DrawingFormat::Svg),
    ("drawn-gcode", DrawingFormat::Gcode),
    ("drawn-hpgl", DrawingFormat::Hpgl),
];

/// What reads bytes, by the names of the fuzz targets and of the folders of their inputs: the model formats, those of drawings, and
/// then jobs for plotters, device profiles, journals of plots, scenes for boards, and what the firmware hears on its line (as lines, as words of G-code, as HPGL) and finds in its memory.
#[must_use]
pub fn names() -> Vec<String> {
    FORMATS
        .iter()
        .map(slug)
        .chain(DRAWINGS.map(|(name, _)| name.to_owned()))
        .chain(["job", "device", "journal", "firmware", "packed", "gcode", "hpgl", "storage"].map(str::to_owned))
        .collect()
}

/// Name of the fuzz target of a model format.
#[must_use]
pub fn slug(format: &ModelFormat) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    format.name.chars().map(word).collect()
}

/// Feeds bytes to the reader of this name.
///
/// # Panics
/// If there is no such reader, or it does what it must not.
pub fn feed(name: &str, bytes: &[u8]) {
    match name {
        "job" => job(bytes),
        "device" => profile(bytes),
        "journal" => drop(journal::parse(bytes).map_err(|error| is_a_line(&error.to_string()))),
        "packed" => packed(bytes),
        "firmware" => machine::lines(bytes),
        "gcode" => machine::gcode(bytes),
        "hpgl" => machine::hpgl(bytes),
        "storage" => machine::storage(bytes),
        _ => match (FORMATS.iter().find(|f| slug(f) == name), DRAWINGS.iter().find(|(own, _)| *own == name)) {
            (Some(format), _) => drop(model(format, bytes)),
            (None, Some((_, format))) => drawing(*format, bytes),
            (None, None) => panic!("nothing is called {name}; these are: {}", names().join(", ")),
        },
    }
}

/// Counts how often it is told of progress.
#[derive(Default)]
struct Counter(Cell<usize>);

impl Watch for Counter {
    fn progress(&self, done: usize, total: usize) {
        assert!(done <= total, "{done} of {total}");
        self.0.set(self.0.get() + 1);
    }
}

/// Reads a model of this format.
///
/// # Errors
/// What the reader says, which is one line.
///
/// # Panics
/// If the reader panics, says more than a line, or works on a small file for long.
pub fn model(format: &ModelFormat, bytes: &[u8]) -> Result<Import, ReadError> {
    let counter = Counter::default();
    let mut source = Source::from_bytes("fed", bytes.to_vec())?;
    let result = format.read(&mut source, &Reading::new(&counter));
    let steps = counter.0.get();
    assert!(steps <= 1000 + bytes.len(), "{steps} steps for {} bytes", bytes.len());
    match &result {
        Ok(import) => {
            let r = &import.report;
            r.healed.iter().chain(&r.problems).chain(r.skipped.keys()).chain(r.kinds.keys()).for_each(|m| is_a_line(m));
        }
        Err(error) => is_a_line(&error.to_string()),
    }
    result
}

/// Reads a drawing: all of its strokes are on some paper, however it is written.
fn drawing(format: DrawingFormat, bytes: &[u8]) {
    let mut source = Source::from_bytes("fed", bytes.to_vec()).expect("memory does not fail");
    let [gcode, hpgl] = ["grbl-servo", "hp7475a"].map(|name| device::find(name).expect("a built-in profile"));
    let reading = drawing::Reading { tolerance_mm: 0.1, gcode: &gcode, hpgl: &hpgl, stops: &|| false };
    match format.read(&mut source, &reading) {
        Ok(found) => {
            found.notes.iter().for_each(|note| is_a_line(note));
            for line in &found.drawing.polylines {
                assert!(line.page.len() >= 2 && line.points.len() == line.page.len(), "{} points", line.page.len());
                assert!(line.page.iter().all(|p| p.is_finite() && p.abs().max_element() <= 1e4), "a point on no paper");
                assert!(
                    line.pen >= 1 && !line.layer.chars().any(char::is_control),
                    "{} with pen {}",
                    line.layer,
                    line.pen
                );
            }
        }
        Err(error) => is_a_line(&error.to_string()),
    }
}

/// Checks a job as for sending it, in all languages.
fn job(bytes: &[u8]) {
    for name in JOB_DEVICES {
        let device = device::find(name).expect("a built-in profile");
        preflight::job(bytes, &device).iter().for_each(|finding| is_a_line(&finding.to_string()));
        match protocol::start(bytes, &device, device.baud) {
            Ok(mut conversation) => {
                conversation.protocol.tick(std::time::Duration::ZERO);
                let _ = conversation.protocol.take_output();
            }
            Err(error) => is_a_line(&error.to_string()),
        }
    }
}

/// Reads a device profile.
fn profile(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    // What it inherits from is another file.
    if !text.contains("inherits") {
        match Device::from_toml(&text, "fed") {
            Ok(_) => {}
            Err(error) => is_a_line(&error.to_string()),
        }
    }
}

/// Unpacks a scene as it is, and as records whose length and checksum are right: no fuzzer finds a checksum.
fn packed(bytes: &[u8]) {
    for bytes in [Some(bytes.to_vec()), scene::frame(bytes)].into_iter().flatten() {
        match StoredScene::unpack(&bytes) {
            Ok(stored) => {
                let again = stored.pack().and_then(|bytes| StoredScene::unpack(&bytes));
                assert!(again.is_ok_and(|again| again == stored), "packed again it is another scene");
            }
            Err(error) => is_a_line(&error.to_string()),
        }
    }
}

fn is_a_line(message: &str) {
    assert!(!message.trim().is_empty(), "an empty message");
    assert!(!message.chars().any(char::is_control), "not one line: {message:?}");
    assert!(message.chars().count() <= LONGEST_MESSAGE, "{} characters: {message:.200}…", message.chars().count());
}

//! A stored scene as lines of G-code, stroke by stroke as they are ready.

use core::fmt::{self, Write};
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use glam::DVec2;
use heapless::String;
use penvis_core::extract::Styles;
use penvis_core::pipeline::{DrawOptions, Monitor, PictureError, Stage, trace_each};
use penvis_core::stop::Stopped;
use penvis_core::stroke::Stroke;

use super::{Program, SceneError, StoredScene};
use crate::line::LINE_CHARS;
use crate::number::write_fixed;

/// A line of G-code without its end.
pub type Line = String<LINE_CHARS>;

/// Decimals of coordinates in mm, as in the host's files.
const DECIMALS: u8 = 3;

/// Why a scene is not drawn, or not to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The bytes are no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The camera does not see it.
    #[error(transparent)]
    Picture(PictureError),
    /// The lines were not wanted any more, or the monitor stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<PictureError> for DrawError {
    fn from(error: PictureError) -> Self {
        match error {
            PictureError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Picture(error),
        }
    }
}

/// What was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figures {
    /// Strokes.
    pub strokes: u32,
    /// Vertices of all strokes.
    pub points: u32,
    /// FNV-1a, 64 bits, over the vertices' screen coordinates x and y as little-endian f64, in the order in which they are drawn: equal
    /// on two machines if and, but for chance, only if they drew the same strokes to the bit.
    pub hash: u64,
}

impl Figures {
    const NONE: Self = Self { strokes: 0, points: 0, hash: 0xcbf2_9ce4_8422_2325 };

    fn add(&mut self, stroke: &Stroke) {
        self.strokes = self.strokes.saturating_add(1);
        // More do not fit into memory.
        self.points = self.points.saturating_add(stroke.points.len() as u32);
        for byte in stroke.points.iter().flat_map(|p| [p.screen.x, p.screen.y]).flat_map(f64::to_le_bytes) {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// Computes the strokes of a stored scene and hands out the lines that draw them. `cells` is [`DrawOptions::cells`]; it changes no
/// stroke. With several pens everything is computed once for each: a board has time while a pen is changed, and no memory for the
/// strokes of the others.
///
/// # Errors
/// If the bytes are no scene, it cannot be seen, `monitor` stops it, or `line` returns false.
pub fn draw(
    bytes: &[u8],
    cells: usize,
    monitor: &dyn Monitor,
    line: &mut dyn FnMut(&Line) -> bool,
) -> Result<Figures, DrawError> {
    let mut figures = Figures::NONE;
    let mut drawn = 0;
    let until = Until { monitor, wanted: AtomicBool::new(true) };
    loop {
        // The scene is in memory only while its patches are made.
        let StoredScene { scene, sight, looks, options, tolerance, program } = StoredScene::unpack(bytes)?;
        let pens = || looks.iter().flat_map(|look| [Some(look.pen), look.hidden]).flatten();
        let mut writer = Writer { program: &program, until: &until, line };
        if drawn == 0 {
            writer.lines(&program.start);
            writer.lines(&program.up);
        }
        // Pens count from 1.
        let Some(pen) = pens().filter(|pen| *pen > drawn).min() else { break };
        if drawn > 0
            && let Some((_, lines)) = program.changes.iter().find(|(of, _)| *of == pen)
        {
            writer.lines(lines);
        }
        drawn = pen;
        let styles = Styles::new(looks.iter().map(|look| look.style).collect());
        let camera = sight.camera().map_err(SceneError::from)?;
        let options = DrawOptions { cells, ..options };
        let is_last = pens().max() == Some(pen);
        let mut scene = Some(scene);
        let mut unpacked = || match scene.take() {
            Some(scene) => Ok(scene),
            None => Ok(StoredScene::unpack(bytes)?.scene),
        };
        trace_each::<DrawError>(&mut unpacked, &camera, &options, styles, tolerance, &until, &mut |stroke| {
            let look = looks.get(stroke.style);
            if look.and_then(|look| if stroke.qi == 0 { Some(look.pen) } else { look.hidden }) == Some(pen) {
                figures.add(&stroke);
                writer.stroke(&stroke);
            }
        })?;
        if is_last {
            writer.travel([0; 2]);
            writer.lines(&program.end);
            break;
        }
    }
    if until.stops() { Err(Stopped.into()) } else { Ok(figures) }
}

/// Stops also when lines are not wanted any more.
struct Until<'a> {
    monitor: &'a dyn Monitor,
    wanted: AtomicBool,
}

impl Monitor for Until<'_> {
    fn begin(&self, stage: Stage) {
        self.monitor.begin(stage);
    }

    fn stops(&self) -> bool {
        !self.wanted.load(Relaxed) || self.monitor.stops()
    }
}

/// Strokes as lines.
struct Writer<'a> {
    program: &'a Program,
    until: &'a Until<'a>,
    line: &'a mut dyn FnMut(&Line) -> bool,
}

impl Writer<'_> {
    /// Hands out one line, unless an earlier one was not wanted.
    fn line(&mut self, write: impl FnOnce(&mut Line) -> fmt::Result) {
        let mut line = Line::new();
        // Lines of a program are no longer than a line, and the others have some thirty characters.
        if self.until.wanted.load(Relaxed) && write(&mut line).is_ok() && !(self.line)(&line) {
            self.until.wanted.store(false, Relaxed);
        }
    }

    fn lines(&mut self, lines: &str) {
        lines.lines().for_each(|text| self.line(|line| line.write_str(text)));
    }

    fn travel(&mut self, to: [i64; 2]) {
        self.line(|line| coordinates(line, "G0", to));
    }

    fn stroke(&mut self, stroke: &Stroke) {
        let mut points = stroke.points.iter().map(|p| rounded(self.program.to_machine(p.screen)));
        let Some(mut at) = points.next() else { return };
        self.travel(at);
        self.lines(&self.program.down);
        let mut feed = Some(self.program.draw_feed);
        for next in points {
            if next == at {
                continue;
            }
            at = next;
            // The feed is modal; a pen on the Z axis has changed it.
            let feed = feed.take();
            self.line(|line| {
                coordinates(line, "G1", at)?;
                let Some(feed) = feed else { return Ok(()) };
                line.write_str("F")?;
                write_fixed(line, feed, 1)
            });
        }
        self.lines(&self.program.up);
    }
}

/// In units of the last decimal. Saturates.
fn rounded(at: DVec2) -> [i64; 2] {
    let scale = libm::pow(10.0, f64::from(DECIMALS));
    [at.x, at.y].map(|x| libm::round(x * scale) as i64)
}

fn coordinates(line: &mut Line, command: &str, [x, y]: [i64; 2]) -> fmt::Result {
    let scale = libm::pow(10.0, f64::from(DECIMALS));
    write!(line, "{command}X")?;
    write_fixed(line, x as f64 / scale, DECIMALS)?;
    line.write_str("Y")?;
    write_fixed(line, y as f64 / scale, DECIMALS)
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;
    use alloc::vec::Vec;

    use penvis_core::pipeline::Prepared;

    use super::super::stored::tests::scene;
    use super::*;

    fn drawn(stored: &StoredScene, cells: usize) -> (Figures, Vec<alloc::string::String>) {
        let mut lines = Vec::new();
        let figures = draw(&stored.pack().unwrap(), cells, &(), &mut |line| {
            lines.push(line.to_string());
            true
        });
        (figures.unwrap(), lines)
    }

    #[test]
    fn the_strokes_are_those_of_the_pipeline_whatever_the_cells() {
        let mut stored = scene();
        stored.looks[1].hidden = None;
        let (figures, lines) = drawn(&stored, 0);
        assert_eq!(drawn(&stored, usize::MAX), (figures, lines.clone()));
        let camera = stored.sight.camera().unwrap();
        let prepared = Prepared::styled(&stored.scene, &camera, &stored.options, stored.styles(), &()).unwrap();
        let mut expected = Figures::NONE;
        for stroke in prepared.trace(stored.tolerance, &()).unwrap().strokes.iter().filter(|s| s.qi == 0) {
            expected.add(stroke);
        }
        assert_eq!(figures, expected);
        assert!(figures.strokes >= 10, "{figures:?}");
        assert_eq!(lines[..4], ["G21", "G90", "M3 S0", "M3 S0"]);
        assert_eq!(lines[lines.len() - 2..], ["G0X0.000Y0.000", "M5"]);
        let count = |start: &str| lines.iter().filter(|line| line.starts_with(start)).count();
        assert_eq!(count("M3 S1000"), figures.strokes as usize);
        assert_eq!(lines.iter().filter(|line| line.ends_with("F2000.0")).count(), figures.strokes as usize);
        assert!(count("G1X") > 100);
    }

    #[test]
    fn pens_follow_one_another() {
        let (_, lines) = drawn(&scene(), 0);
        let change = lines.iter().position(|line| line == "M0").unwrap();
        assert_eq!(lines.iter().filter(|line| *line == "M0").count(), 1);
        assert!((20..lines.len() - 5).contains(&change), "{change} of {}", lines.len());
        assert_eq!(lines.iter().filter(|line| *line == "M5").count(), 1);
    }

    #[test]
    fn it_ends_when_lines_are_not_wanted() {
        let mut left = 10;
        let result = draw(&scene().pack().unwrap(), 0, &(), &mut |_| {
            left -= 1;
            left > 0
        });
        assert_eq!((result, left), (Err(DrawError::Stopped(Stopped)), 0));
    }

    #[test]
    fn damaged_bytes_are_not_drawn() {
        let mut bytes = scene().pack().unwrap();
        bytes[40] ^= 1;
        let result = draw(&bytes, 0, &(), &mut |_| panic!("nothing is drawn"));
        assert!(matches!(result, Err(DrawError::Scene(SceneError::Checksum { .. }))));
    }
}

//! What obeys the orders on the desk: keeps the scene that is sent, and draws it.

use core::fmt::Write;

use heapless::{String, Vec};
use penvis_core::pipeline::{Monitor, PictureError};

use super::desk::{Answer, Order};
use super::draw::{DrawError, Line, draw};
use super::file::announced;
use crate::error::Error;

/// The surroundings of a studio.
pub trait Surroundings: Monitor {
    /// Offers a line of the drawing until it is taken, while the rest of the machine works. False if the drawing is not wanted any more.
    fn line(&self, line: &Line) -> bool;

    /// The most memory that was in use at once so far, bytes; 0 if it is not counted.
    fn heap_peak(&self) -> usize {
        0
    }

    /// Time since any moment, ms; 0 if there is no clock.
    fn now_ms(&self) -> u32 {
        0
    }
}

/// A scene of up to `N` bytes, as it was sent, and what is done with it.
#[derive(Debug)]
pub struct Studio<const N: usize> {
    scene: Vec<u8, N>,
    /// None where it is empty: a studio to which nothing was given is zeros, which a static of it need not keep in the flash.
    stored: Option<&'static [u8]>,
    cells: usize,
}

impl<const N: usize> Studio<N> {
    /// A studio to which nothing has been sent yet; until then its scene is what `stored` begins with, if that is one: the memory of a board, with anything after the scene or
    /// in place of it. `cells` is
    /// [`DrawOptions::cells`](penvis_core::pipeline::DrawOptions::cells): as many as there is memory for.
    #[must_use]
    pub const fn new(stored: &'static [u8], cells: usize) -> Self {
        Self { scene: Vec::new(), stored: if stored.is_empty() { None } else { Some(stored) }, cells }
    }

    /// Says where a scene may be stored. A static studio that is told so when it is first used, and begins with nothing stored and no cells, is all zeros, and
    /// takes no flash for its memory.
    pub fn set_stored(&mut self, stored: &'static [u8]) {
        self.stored = (!stored.is_empty()).then_some(stored);
    }

    /// Does what was asked for. Takes long if that is a drawing.
    pub fn obey(&mut self, order: &Order, surroundings: &dyn Surroundings) -> Answer {
        match order {
            Order::Clear => {
                self.scene.clear();
                said("", Ok(()))
            }
            Order::Append(bytes) => self.append(bytes),
            Order::Tell => {
                let mut text = String::new();
                // There is room for three numbers.
                let _ = write!(text, "[PV:{},{},{}]", self.scene.len(), N, self.stored().len());
                Answer { text, result: Ok(()) }
            }
            Order::Trace => self.draw(surroundings, &mut |_| true),
            Order::Draw => self.draw(surroundings, &mut |line| surroundings.line(line)),
        }
    }

    /// A scene that will not fit is refused as soon as its header tells.
    fn append(&mut self, bytes: &[u8]) -> Answer {
        let fits = self.scene.extend_from_slice(bytes).is_ok();
        let needed = match announced(&self.scene) {
            Ok(needed) => needed.unwrap_or(0),
            Err(error) => {
                self.scene.clear();
                return told(&error, Error::SceneInvalid);
            }
        };
        let needed = if fits { needed } else { needed.max(self.scene.len() + bytes.len()) };
        if needed > N {
            self.scene.clear();
            return told(&format_args!("the scene needs {needed} bytes and {N} are available"), Error::SceneTooLarge);
        }
        said("", Ok(()))
    }

    /// The scene in `stored`, as long as its header says; none if there is no header. Whether it is whole is seen when it is drawn.
    fn stored(&self) -> &'static [u8] {
        let stored = self.stored.unwrap_or_default();
        let length = announced(stored).ok().flatten().unwrap_or(0);
        stored.get(..length).unwrap_or(stored)
    }

    fn draw(&self, surroundings: &dyn Surroundings, line: &mut dyn FnMut(&Line) -> bool) -> Answer {
        let bytes = if self.scene.is_empty() { self.stored() } else { &self.scene };
        if bytes.is_empty() {
            return told(&"there is no scene; send one with $PV=", Error::SceneInvalid);
        }
        // As a monitor: the trait has it as its supertrait.
        let watch = Watch(surroundings);
        let started = surroundings.now_ms();
        match draw(bytes, self.cells, &watch, line) {
            Ok(figures) => {
                let mut text = String::new();
                let (heap, ms) = (surroundings.heap_peak(), surroundings.now_ms().wrapping_sub(started));
                // There is room for four numbers and sixteen digits.
                let _ = write!(text, "[PV:{},{},{:016x},{heap},{ms}]", figures.strokes, figures.points, figures.hash);
                Answer { text, result: Ok(()) }
            }
            Err(DrawError::Scene(error)) => told(&error, Error::SceneInvalid),
            Err(DrawError::Picture(PictureError::View(error))) => told(&error, Error::SceneInvalid),
            Err(error) => told(&error, Error::DrawingStopped),
        }
    }
}

/// The answer after memory ran out: so many more bytes were needed while so many of all were in use.
#[must_use]
pub fn out_of_memory(needed: usize, used: usize, all: usize) -> Answer {
    told(&format_args!("the scene needs {needed} bytes more while {used} of {all} are in use"), Error::OutOfMemory)
}

struct Watch<'a>(&'a dyn Surroundings);

impl Monitor for Watch<'_> {
    fn begin(&self, stage: penvis_core::pipeline::Stage) {
        self.0.begin(stage);
    }

    fn stops(&self) -> bool {
        self.0.stops()
    }
}

fn said(text: &str, result: Result<(), Error>) -> Answer {
    Answer { text: String::try_from(text).unwrap_or_default(), result }
}

/// A message before an error. What does not fit is cut off.
fn told(message: &dyn core::fmt::Display, error: Error) -> Answer {
    let mut text = String::new();
    // Each character that fits is one, and one is left for the bracket.
    struct Cut<'a>(&'a mut String<{ super::desk::ANSWER_CHARS }>);
    impl Write for Cut<'_> {
        fn write_str(&mut self, piece: &str) -> core::fmt::Result {
            // Messages quote names; senders want printable ASCII.
            for c in piece.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }) {
                if self.0.len() + 1 < self.0.capacity() {
                    self.0.push(c).map_err(|_| core::fmt::Error)?;
                }
            }
            Ok(())
        }
    }
    let mut cut = Cut(&mut text);
    // It takes everything.
    let _ = write!(cut, "[MSG:{message}").and_then(|()| text.push(']').map_err(|_| core::fmt::Error));
    Answer { text, result: Err(error) }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::super::desk::CHUNK_BYTES;
    use super::super::stored::tests::scene;
    use super::*;

    struct Nobody;

    impl Monitor for Nobody {}

    impl Surroundings for Nobody {
        fn line(&self, _: &Line) -> bool {
            true
        }
    }

    fn send<const N: usize>(studio: &mut Studio<N>, bytes: &[u8]) -> Result<(), (alloc::string::String, Error)> {
        for chunk in bytes.chunks(CHUNK_BYTES) {
            let answer = studio.obey(&Order::Append(Vec::from_slice(chunk).unwrap()), &Nobody);
            answer.result.map_err(|error| (answer.text.to_string(), error))?;
        }
        Ok(())
    }

    #[test]
    fn a_scene_is_sent_and_drawn() {
        let bytes = scene().pack().unwrap();
        let mut studio = Studio::<4096>::new(&[], 0);
        let none = studio.obey(&Order::Draw, &Nobody);
        assert_eq!(
            (none.text.as_str(), none.result),
            ("[MSG:there is no scene; send one with $PV=]", Err(Error::SceneInvalid))
        );
        send(&mut studio, &bytes).unwrap();
        let told = studio.obey(&Order::Tell, &Nobody);
        assert_eq!(told.text, alloc::format!("[PV:{},4096,0]", bytes.len()).as_str());
        let figures = draw(&bytes, 0, &(), &mut |_| true).unwrap();
        let answer = studio.obey(&Order::Trace, &Nobody);
        assert_eq!(answer.result, Ok(()));
        let expected = alloc::format!("[PV:{},{},{:016x},0,0]", figures.strokes, figures.points, figures.hash);
        assert_eq!(answer.text, expected.as_str());
        assert_eq!(studio.obey(&Order::Draw, &Nobody), answer);
        assert_eq!(studio.obey(&Order::Clear, &Nobody).result, Ok(()));
        assert_eq!(studio.obey(&Order::Draw, &Nobody).result, Err(Error::SceneInvalid));
    }

    #[test]
    fn a_stored_scene_is_drawn_until_one_is_sent() {
        let bytes = scene().pack().unwrap();
        let figures = draw(&bytes, 0, &(), &mut |_| true).unwrap();
        // What flash is where nothing was written.
        let mut memory = bytes.clone();
        memory.resize(bytes.len() + 100, 0xff);
        let mut studio = Studio::<4096>::new(memory.leak(), 0);
        assert_eq!(studio.obey(&Order::Tell, &Nobody).text, alloc::format!("[PV:0,4096,{}]", bytes.len()).as_str());
        let answer = studio.obey(&Order::Draw, &Nobody);
        let expected = alloc::format!("[PV:{},{},{:016x},0,0]", figures.strokes, figures.points, figures.hash);
        assert_eq!((answer.text.as_str(), answer.result), (expected.as_str(), Ok(())));
        send(&mut studio, &bytes[..64]).unwrap();
        assert_eq!(studio.obey(&Order::Draw, &Nobody).result, Err(Error::SceneInvalid), "half of one that was sent");
        assert_eq!(studio.obey(&Order::Clear, &Nobody).result, Ok(()));
        assert_eq!(studio.obey(&Order::Draw, &Nobody), answer);

        let mut damaged = bytes.clone();
        damaged[40] ^= 1;
        let mut studio = Studio::<4096>::new(damaged.leak(), 0);
        assert_eq!(studio.obey(&Order::Draw, &Nobody).result, Err(Error::SceneInvalid));
        let mut studio = Studio::<4096>::new(bytes[..bytes.len() - 1].to_vec().leak(), 0);
        assert_eq!(studio.obey(&Order::Draw, &Nobody).result, Err(Error::SceneInvalid), "its end is not there");
        let mut studio = Studio::<4096>::new(&[0xff; 64], 0);
        assert_eq!(studio.obey(&Order::Tell, &Nobody).text, "[PV:0,4096,0]");
        assert!(studio.obey(&Order::Draw, &Nobody).text.starts_with("[MSG:there is no scene"));
    }

    #[test]
    fn a_scene_that_is_too_long_or_none_is_refused_when_its_header_is_there() {
        let bytes = scene().pack().unwrap();
        let mut studio = Studio::<512>::new(&[], 0);
        let (text, error) = send(&mut studio, &bytes).unwrap_err();
        let expected = alloc::format!("[MSG:the scene needs {} bytes and 512 are available]", bytes.len());
        assert_eq!((text, error), (expected, Error::SceneTooLarge));
        let (text, error) = send(&mut studio, b"GIF89a").unwrap_err();
        assert!(text.starts_with("[MSG:this is no stored scene") && text.ends_with(']'), "{text}");
        assert_eq!(error, Error::SceneInvalid);
        let half = &bytes[..400];
        send(&mut studio, &half[..16]).unwrap_err();
        let mut studio = Studio::<4096>::new(&[], 0);
        send(&mut studio, half).unwrap();
        let answer = studio.obey(&Order::Draw, &Nobody);
        assert!(answer.text.contains("400 bytes and its header says"), "{}", answer.text);
        assert_eq!(answer.result, Err(Error::SceneInvalid));
        // More than was announced.
        send(&mut studio, &bytes[400..]).unwrap();
        let mut more = studio.obey(&Order::Append(Vec::from_slice(b"x").unwrap()), &Nobody);
        assert_eq!(more.result, Ok(()));
        more = studio.obey(&Order::Draw, &Nobody);
        assert_eq!(more.result, Err(Error::SceneInvalid));
    }

    #[test]
    fn messages_fit_and_are_plain() {
        let answer = told(&"ü".repeat(500), Error::SceneInvalid);
        assert_eq!((answer.text.len(), answer.text.ends_with("?]")), (super::super::desk::ANSWER_CHARS, true));
        assert_eq!(
            out_of_memory(4096, 100_000, 102_400).text,
            "[MSG:the scene needs 4096 bytes more while 100000 of 102400 are in use]"
        );
    }
}

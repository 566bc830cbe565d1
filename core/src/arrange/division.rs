//! Arcs that are not kept, but made again: only how often their parts of the curve were halved is.
//!
//! ```text
//!      part 0          part 1           halved  2 2 1 0     an arc of depth d is the 2⁻ᵈ-th part of its
//!    |--|--|----|----------------|                          part and begins where the one before it ends
//! ```

use alloc::boxed::Box;
use alloc::vec::Vec;

use glam::{DVec3, DVec4};

use super::arc::{Arc, Control};
use super::arcs::OneCurve;
use super::cover::{Covering, Node, Part};

/// Places of a part: as many as it can have arcs.
pub(super) const WHOLE: u32 = 1 << 16;

/// Marks a depth whose arc has not the error of most.
const OWN_ERROR: u8 = 1 << 7;

/// How the parts of a curve were halved.
#[derive(Clone, Debug)]
pub(super) struct Division {
    /// Of each arc in order.
    depths: Box<[u8]>,
    /// Of the arcs that are marked.
    errors: Box<[f64]>,
}

impl Division {
    /// Number of arcs.
    pub(super) fn len(&self) -> usize {
        self.depths.len()
    }

    /// The arcs in order.
    pub(super) fn walk<'a>(&'a self, covering: Covering<'a>) -> Walk<'a> {
        let (depths, errors) = (&self.depths, &self.errors);
        Walk { covering, depths, errors, number: 0, part: None, place: 0, last: None }
    }
}

/// Takes how often the parts of a curve are halved.
#[derive(Default)]
pub(super) struct Divider {
    depths: Vec<u8>,
    errors: Vec<f64>,
}

impl Divider {
    /// The next arc, with how often its part was halved, 16 times at the most, its error, and that of most arcs.
    pub(super) fn push(&mut self, depth: u32, error: f64, usual: f64) {
        let own = error.to_bits() != usual.to_bits();
        self.depths.push(depth as u8 | if own { OWN_ERROR } else { 0 });
        self.errors.extend(own.then_some(error));
    }

    /// What it took.
    pub(super) fn take(&mut self) -> Division {
        let division = Division { depths: Box::from(&*self.depths), errors: Box::from(&*self.errors) };
        self.depths.clear();
        self.errors.clear();
        division
    }
}

/// The arcs of one curve in order, each made when it is asked for, in one or two evaluations of the curve.
#[derive(Clone)]
pub(super) struct Walk<'a> {
    covering: Covering<'a>,
    depths: &'a [u8],
    errors: &'a [f64],
    /// The part that is being walked along, and what it is once it was needed.
    number: usize,
    part: Option<Part>,
    /// Where the next arc begins in it.
    place: u32,
    /// There, if the arc before was made.
    last: Option<Node>,
}

/// Where an arc is: the number of its part, its place in it, its length there and its error.
type Stretch = (usize, u32, u32, f64);

impl Walk<'_> {
    /// Goes on over one arc.
    fn step(&mut self) -> Option<Stretch> {
        let (&code, depths) = self.depths.split_first()?;
        if self.place == 0 {
            self.number = self.covering.next_part(self.number)?;
            self.part = None;
        }
        self.depths = depths;
        let mut error = self.covering.usual_error();
        if code & OWN_ERROR != 0 {
            let (&own, errors) = self.errors.split_first()?;
            (error, self.errors) = (own, errors);
        }
        let (number, place, length) = (self.number, self.place, WHOLE >> (code & !OWN_ERROR));
        self.place += length;
        if self.place >= WHOLE {
            self.place = 0;
            self.number += 1;
        }
        Some((number, place, length, error))
    }

    fn arc(&mut self, (number, place, length, error): Stretch) -> Arc {
        let covering = self.covering;
        match self.part.get_or_insert_with(|| covering.part(number)) {
            Part::Line(whole) => half_at(whole, place, length),
            Part::Segment(t) => {
                let from = self.last.take().filter(|_| place > 0).unwrap_or_else(|| covering.node(*t, place));
                let to = covering.node(*t, place + length);
                self.last = Some(to);
                covering.between(from, to, error)
            }
        }
    }
}

impl Iterator for Walk<'_> {
    type Item = Arc;

    fn next(&mut self) -> Option<Arc> {
        let stretch = self.step()?;
        Some(self.arc(stretch))
    }

    /// Makes no arc that is passed over.
    fn nth(&mut self, n: usize) -> Option<Arc> {
        for _ in 0..n {
            self.step()?;
            self.last = None;
        }
        self.next()
    }
}

/// The part of an arc that halving brings out at a place.
fn half_at(whole: &Arc, place: u32, length: u32) -> Arc {
    let (mut arc, mut begin, mut size) = (whole.clone(), 0, WHOLE);
    while size > length {
        size /= 2;
        let (l, r) = arc.halves();
        arc = if place < begin + size { l } else { r };
        if place >= begin + size {
            begin += size;
        }
    }
    arc
}

/// Arcs that were made last, so that those that many others come near are made once. Curves that follow one another come near the same.
#[derive(Default)]
pub(super) struct Recent {
    slots: Vec<Option<Made>>,
}

/// An arc that was made of a segment.
#[derive(Clone)]
struct Made {
    /// Its number among the arcs of active curves.
    number: usize,
    t: [f64; 2],
    error: f64,
    points: [DVec3; 4],
}

/// Arcs that are remembered: 16 KB of them.
const SLOTS: usize = 128;

impl Recent {
    /// The arc `k` of a curve, which has the number `number` among all.
    pub(super) fn arc(&mut self, curve: OneCurve<'_>, k: usize, number: usize) -> Option<Arc> {
        if !curve.is_dear() {
            return curve.arc(k);
        }
        if self.slots.is_empty() {
            self.slots.resize(SLOTS, None);
        }
        let slot = &mut self.slots[number % SLOTS];
        if let Some(made) = slot.as_ref().filter(|made| made.number == number) {
            let control: Control = made.points.iter().map(|p| p.extend(1.0)).collect();
            return Some(Arc::over(made.points.into_iter(), curve.index(), made.t, control, made.error));
        }
        let arc = curve.arc(k)?;
        if let [a, b, c, d] = arc.points[..] {
            let points = [a, b, c, d].map(DVec4::truncate);
            *slot = Some(Made { number, t: arc.t, error: arc.error, points });
        }
        Some(arc)
    }
}

#[cfg(test)]
mod tests {
    use alloc::format;
    use alloc::vec;

    use super::*;
    use crate::arrange::Arcs;
    use crate::pipeline::{DrawOptions, Prepared};
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, torus};
    use crate::stop::Stop;
    use crate::view::Camera;

    #[test]
    fn arcs_that_are_made_again_are_those_that_are_kept_to_the_bit() {
        let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let scene = Scene { name: "ring".into(), surfaces: vec![SceneSurface::new("ring", ring)] };
        let camera = Camera::orthographic(DVec3::new(0.3, -0.8, 0.4), DVec3::Z).unwrap();
        let prepared = Prepared::new(&scene, &camera, &DrawOptions::default(), &()).unwrap();
        let (curves, g) = (prepared.curves(), prepared.geometry());
        let [kept, made] = [true, false].map(|keep| Arcs::new(curves, &g, 1e-9, keep, Stop::NEVER));
        let [kept, made] = [kept.with(curves, g), made.with(curves, g)];
        // The shortest decimals of a number tell its sign and its bits.
        let all: Vec<_> = kept.iter().map(|arc| format!("{arc:?}")).collect();
        assert!(made.iter().map(|arc| format!("{arc:?}")).eq(all.iter().cloned()));
        let (mut recent, mut number, mut errors) = (Recent::default(), 0, 0);
        for curve in 0..curves.len() {
            let made = made.one(curve);
            assert_eq!(kept.one(curve).count(), made.count());
            for k in 0..made.count() {
                // From the beginning, and from what was made last.
                for _ in 0..2 {
                    let arc = recent.arc(made, k, number).unwrap();
                    assert_eq!(format!("{arc:?}"), all[number], "{curve} {k}");
                    errors += usize::from(made.is_dear() && arc.error != made.iter().next().unwrap().error);
                }
                number += 1;
            }
            assert!(made.arc(made.count()).is_none());
        }
        assert!(number > 500 && errors > 10, "{number} {errors}");
    }
}

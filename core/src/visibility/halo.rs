//! Haloed lines: a curve that passes behind another one is cut back beside it (Appel, Rohlf and Stein 1979, *The haloed line effect for
//! hidden line elimination*).
//!
//! There, whatever is nearer covers what is near it on the screen. Curves that meet in space would so cut off each other's ends, and a
//! curve along a crease would vanish beside it. Here a gap begins at a crossing only: where a curve passes behind an outline, and as far along
//! what is drawn of it as it stays within the gap of that outline, which is followed on both sides of the crossing; but not over a place
//! where it meets the outline of its own surface.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::{Sighting, Subject};
use crate::arrange::Cut;
use crate::grid::Grid;

/// Chords of outlines, as part of the gap: a curve that turns no faster than a circle of the gap's radius is within 1/2000 of it.
const CHORD: f64 = 1.0 / 16.0;

/// Shortest chords, of the size of the scene.
const SHORTEST: f64 = 1e-5;

/// The end of a gap is found to this part of it.
const PRECISION: f64 = 1e-3;

/// Lengths along curves are known to this factor.
const LENGTHS: f64 = 2.5;

/// Steps along one curve at the most.
const STEPS: usize = 4096;

/// How far an outline is followed from where it is nearest, in gaps: what is farther along it is another part of it.
const AROUND: f64 = 2.0;

/// Chords that are looked at from one place at the most: some hundred where each is as long as it is meant to be.
const LOOKS: usize = 1024;

/// What is left of sightings when the curves of those with no more than `deepest` sheets in front are cut back by `gap` (screen units) where
/// they pass behind outlines that are drawn. Curves that meet an outline in space are not cut. Cost: linear in the ink of outlines over the
/// gap, and in the number of crossings.
pub fn halo(subject: &Subject<'_>, sightings: Vec<Sighting>, gap: f64, deepest: u32) -> Vec<Sighting> {
    let drawn = drawn(subject, &sightings, deepest);
    let ink = Ink::new(subject, &drawn, gap);
    let gaps = Gaps::new(subject, &ink, drawn).all(gap);
    let mut out = Vec::with_capacity(sightings.len());
    for sighting in sightings {
        let first = gaps.partition_point(|g| g.0 < sighting.curve);
        let own = gaps[first..].iter().take_while(|g| g.0 == sighting.curve).map(|g| g.1);
        if sighting.qi > deepest {
            out.push(sighting);
        } else {
            out.extend(without(sighting.t, own).map(|t| Sighting { t, ..sighting.clone() }));
        }
    }
    out
}

/// What is drawn of each curve, in order, cut where it meets outlines of its own surfaces.
fn drawn(subject: &Subject<'_>, sightings: &[Sighting], deepest: u32) -> Vec<Vec<[f64; 2]>> {
    let mut drawn: Vec<Vec<[f64; 2]>> = alloc::vec![Vec::new(); subject.curves.len()];
    for sighting in sightings.iter().filter(|s| s.qi <= deepest) {
        match drawn[sighting.curve].last_mut() {
            Some(last) if last[1] == sighting.t[0] && !subject.curves[sighting.curve].splits.contains(&last[1]) => {
                last[1] = sighting.t[1];
            }
            _ => drawn[sighting.curve].push(sighting.t),
        }
    }
    drawn
}

/// What is left of an interval without others, which are in order of their beginnings.
fn without(t: [f64; 2], holes: impl Iterator<Item = [f64; 2]>) -> impl Iterator<Item = [f64; 2]> {
    let mut left = Vec::new();
    let mut from = t[0];
    for hole in holes {
        left.push([from, hole[0].min(t[1])]);
        from = from.max(hole[1]);
    }
    left.push([from, t[1]]);
    left.into_iter().filter(|[a, b]| a < b)
}

/// The outlines that are drawn, as chords.
struct Ink {
    chords: Vec<[DVec3; 2]>,
    strips: Vec<Strip>,
    /// For the beginning and the end of each strip, what goes on there.
    joints: Vec<[Vec<Joint>; 2]>,
    contact: f64,
}

/// Chords of one curve that follow one another.
struct Strip {
    curve: usize,
    /// Interval of the curve's parameter, and lengths along it at its ends.
    t: [f64; 2],
    length: [f64; 2],
    /// Index of the first chord, and their number.
    first: usize,
    count: usize,
}

/// A strip, and whether it is met at its end.
type Joint = (usize, bool);

/// A chord: strip, and number in it.
type Place = (usize, usize);

impl Ink {
    fn new(subject: &Subject<'_>, drawn: &[Vec<[f64; 2]>], gap: f64) -> Self {
        let chord = (CHORD * gap).max(SHORTEST * subject.geometry.view.size());
        let (mut chords, mut strips) = (Vec::new(), Vec::new());
        let active = drawn.iter().enumerate().filter(|(k, _)| subject.curves[*k].active);
        for (curve, &t) in active.flat_map(|(k, parts)| parts.iter().map(move |t| (k, t))) {
            let (path, table) = (&subject.curves[curve], &subject.arrangement.lengths[curve]);
            let length = t.map(|t| table.length_at(t));
            let count = libm::ceil((length[1] - length[0]) / chord).max(1.0);
            let place = |k: f64| {
                let at =
                    if k == count { t[1] } else { table.param_at(length[0] + (length[1] - length[0]) * (k / count)) };
                path.point(&subject.geometry, at.clamp(t[0], t[1]))
            };
            let count = count as usize;
            strips.push(Strip { curve, t, length, first: chords.len(), count });
            let mut a = place(0.0);
            for k in 1..=count {
                let b = place(k as f64);
                chords.push([a, b]);
                a = b;
            }
        }
        let contact = subject.reach();
        let joints = joints(&chords, &strips, contact);
        Self { chords, strips, joints, contact }
    }

    /// The chord of a curve at a parameter, if it is drawn there.
    fn chord(&self, subject: &Subject<'_>, curve: usize, t: f64) -> Option<Place> {
        let first = self.strips.partition_point(|s| s.curve < curve);
        let own = self.strips[first..].iter().take_while(|s| s.curve == curve);
        let (k, strip) = own.enumerate().find(|(_, s)| s.t[0] <= t && t <= s.t[1])?;
        let [from, to] = strip.length;
        let part = (subject.arrangement.lengths[curve].length_at(t) - from) / (to - from).max(f64::MIN_POSITIVE);
        Some((first + k, ((part * strip.count as f64) as usize).min(strip.count - 1)))
    }

    /// The chords within a length along the ink of one, itself included.
    fn around(&self, (strip, chord): Place, reach: f64, out: &mut Vec<Place>) {
        out.clear();
        out.push((strip, chord));
        let mut ways = Vec::new();
        ways.extend([(strip, chord, true, reach), (strip, chord, false, reach)]);
        while let Some((mut strip, mut chord, mut forwards, mut left)) = ways.pop() {
            while left > 0.0 && out.len() < LOOKS {
                let is_last = if forwards { chord + 1 == self.strips[strip].count } else { chord == 0 };
                if is_last {
                    let mut others = self.joints[strip][usize::from(forwards)].iter();
                    let Some(&(next, at_end)) = others.next() else { break };
                    let entry = |strip: usize, at_end: bool| if at_end { self.strips[strip].count - 1 } else { 0 };
                    for &(other, at_end) in others {
                        let chord = entry(other, at_end);
                        out.push((other, chord));
                        ways.push((other, chord, !at_end, left - self.length((other, chord))));
                    }
                    (strip, chord, forwards) = (next, entry(next, at_end), !at_end);
                } else {
                    chord = if forwards { chord + 1 } else { chord - 1 };
                }
                out.push((strip, chord));
                left -= self.length((strip, chord));
            }
        }
    }

    fn ends(&self, (strip, chord): Place) -> [DVec3; 2] {
        self.chords[self.strips[strip].first + chord]
    }

    fn length(&self, place: Place) -> f64 {
        let [a, b] = self.ends(place);
        a.xy().distance(b.xy())
    }

    /// The distance from a point to a chord on the screen, if the chord is nearer to the eye there.
    fn distance(&self, place: Place, p: DVec3) -> Option<f64> {
        let [a, b] = self.ends(place);
        let (way, to) = (b - a, p - a);
        let length = way.xy().length_squared();
        let along = if length > 0.0 { (to.xy().dot(way.xy()) / length).clamp(0.0, 1.0) } else { 0.0 };
        let foot = a + along * way;
        (foot.z > p.z + self.contact).then_some(foot.xy().distance(p.xy()))
    }
}

/// Which ends of strips are one place.
fn joints(chords: &[[DVec3; 2]], strips: &[Strip], contact: f64) -> Vec<[Vec<Joint>; 2]> {
    let ends = |s: &Strip| [chords[s.first][0], chords[s.first + s.count - 1][1]];
    let places: Vec<DVec3> = strips.iter().flat_map(ends).collect();
    let grid = Grid::new(places.iter().map(|p| (p.xy(), p.xy())));
    let mut near = Vec::new();
    let mut at = |k: usize| {
        let margin = DVec2::splat(contact);
        grid.near(places[k].xy() - margin, places[k].xy() + margin, &mut near);
        let others = near.iter().map(|&j| j as usize);
        let others = others.filter(|&j| j != k && places[j].distance(places[k]) <= contact);
        others.map(|j| (j / 2, j % 2 == 1)).collect::<Vec<_>>()
    };
    (0..strips.len()).map(|k| [at(2 * k), at(2 * k + 1)]).collect()
}

/// Where a gap begins: curve, parameter, whether it goes on forwards, and the chord of the outline that is nearest there.
type Start = (usize, f64, bool, Place);

/// The parts of curves that pass behind outlines.
struct Gaps<'a> {
    subject: &'a Subject<'a>,
    ink: &'a Ink,
    /// What is drawn of each curve.
    drawn: Vec<Vec<[f64; 2]>>,
    /// Ends of curves, with the parameter there.
    ends: Vec<(usize, f64, DVec3)>,
    at: Grid,
}

impl<'a> Gaps<'a> {
    fn new(subject: &'a Subject<'a>, ink: &'a Ink, drawn: Vec<Vec<[f64; 2]>>) -> Self {
        let inked = subject.curves.iter().enumerate().filter(|(_, curve)| curve.inked);
        let ends = inked.flat_map(|(k, curve)| curve.domain.map(|t| (k, t, curve.point(&subject.geometry, t))));
        let ends: Vec<_> = ends.collect();
        let at = Grid::new(ends.iter().map(|(_, _, p)| (p.xy(), p.xy())));
        Self { subject, ink, drawn, ends, at }
    }

    /// All of them: curve and interval of its parameter, in order.
    fn all(&self, gap: f64) -> Vec<(usize, [f64; 2])> {
        let mut starts: Vec<Start> = Vec::new();
        for piece in &self.subject.arrangement.pieces {
            for cut in &piece.entered {
                // The outline itself may be hidden there, or not wanted.
                if let Cut::Crossing { with, at, nearer: true } = *cut
                    && self.subject.curves[piece.curve].inked
                    && let Some(chord) = self.ink.chord(self.subject, with, at)
                {
                    starts.extend([false, true].map(|forwards| (piece.curve, piece.t[0], forwards, chord)));
                }
            }
        }
        let mut gaps = Vec::new();
        let mut passed = alloc::vec![[false; 2]; self.subject.curves.len()];
        while let Some(start) = starts.pop() {
            if self.subject.stop.is_wanted() {
                break;
            }
            let (curve, from, forwards, _) = start;
            let Some((to, chord)) = self.follow(start, gap) else { continue };
            gaps.push((curve, [from.min(to), from.max(to)]));
            // A curve goes on as another one where its surface ends.
            if let Some(chord) = chord
                && !core::mem::replace(&mut passed[curve][usize::from(forwards)], true)
            {
                self.go_on(curve, to, chord, &mut starts);
            }
        }
        gaps.sort_by(|a, b| a.0.cmp(&b.0).then(a.1[0].total_cmp(&b.1[0])));
        gaps
    }

    /// The parameter at which a curve leaves the gap beside an outline, or ends; there with the chord that is nearest. None if it is not drawn
    /// where it is to begin.
    fn follow(&self, (curve, start, forwards, mut nearest): Start, gap: f64) -> Option<(f64, Option<Place>)> {
        let (path, table) = (&self.subject.curves[curve], &self.subject.arrangement.lengths[curve]);
        let holds = |[a, b]: &[f64; 2]| if forwards { *a <= start && start < *b } else { *a < start && start <= *b };
        let [first, last] = self.drawn[curve].iter().copied().find(holds)?;
        let (end, direction) = if forwards { (last, 1.0) } else { (first, -1.0) };
        let total = table.length_at(end);
        let (mut t, mut length) = (start, table.length_at(start));
        let (mut near, mut own) = (Vec::new(), Vec::new());
        for _ in 0..STEPS {
            let p = path.point(&self.subject.geometry, t);
            self.ink.around(nearest, AROUND * gap, &mut near);
            // What goes on from the curve itself is not another one that it passes behind.
            if let Some(place) = self.ink.chord(self.subject, curve, t) {
                self.ink.around(place, AROUND * gap, &mut own);
            }
            let others = near.iter().filter(|place| !own.contains(place));
            let distances = others.filter_map(|&place| self.ink.distance(place, p).map(|distance| (distance, place)));
            let Some((distance, place)) = distances.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            let left = gap - distance;
            if left <= PRECISION * gap {
                break;
            }
            nearest = place;
            if t == end {
                return Some((end, path.domain.contains(&end).then_some(nearest)));
            }
            length += direction * left / LENGTHS;
            t = if (length - total) * direction >= 0.0 { end } else { table.param_at(length).clamp(first, last) };
        }
        Some((t, None))
    }

    /// Begins gaps on the curves that begin or end where one ends.
    fn go_on(&self, curve: usize, end: f64, chord: Place, starts: &mut Vec<Start>) {
        let p = self.subject.curves[curve].point(&self.subject.geometry, end);
        let (reach, mut near) = (self.subject.reach(), Vec::new());
        self.at.near(p.xy() - DVec2::splat(reach), p.xy() + DVec2::splat(reach), &mut near);
        for &k in &near {
            let (other, t, q) = self.ends[k as usize];
            if p.distance(q) <= reach && (other, t) != (curve, end) {
                starts.push((other, t, t == self.subject.curves[other].domain[0], chord));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_are_left_out() {
        let left = |t, holes: &[[f64; 2]]| without(t, holes.iter().copied()).collect::<Vec<_>>();
        assert_eq!(left([0.0, 9.0], &[]), [[0.0, 9.0]]);
        assert_eq!(left([0.0, 9.0], &[[2.0, 3.0], [2.5, 4.0], [8.0, 12.0]]), [[0.0, 2.0], [4.0, 8.0]]);
        assert_eq!(left([0.0, 9.0], &[[-1.0, 1.0], [1.0, 10.0]]), [] as [[f64; 2]; 0]);
        assert_eq!(left([0.0, 9.0], &[[-5.0, -4.0], [10.0, 11.0]]), [[0.0, 9.0]]);
    }
}

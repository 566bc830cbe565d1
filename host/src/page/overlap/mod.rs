//! Ink that is there already, left out.

mod kept;

use glam::DVec2;

use super::walk::Walk;
use crate::drawing::Polyline;
use crate::page::is_on_paper;
use kept::{Kept, Piece};

/// Shortest part in mm that is cut off an end of a stroke. Where a curve runs into another one, it comes near it shortly before, and nothing is gained
/// by ending it there.
const SHORTEST_END_MM: f64 = 1.0;

/// Shortest part in mm that is cut out of the middle of a stroke: about what a pen draws in the time that the lift takes which it costs.
const SHORTEST_MIDDLE_MM: f64 = 10.0;

/// Length in mm along a stroke within which it is not compared with itself, so that corners are none of it again.
const SELF_MM: f64 = 1.0;

/// Draws once what strokes of a pen have in common: leaves out strokes, and parts of strokes, that are within `within_mm` of ink that is kept; all of it
/// is. Of two strokes, the visible one is kept, or that with fewer sheets in front of it, of a lower level, of a kind that comes before the other, the
/// longer one, or else the first.
///
/// Whole strokes are left out whatever their length, parts at their ends from 1 mm on, and others from 10 mm on, since they cost a lift. Strokes whose
/// vertices are no places on paper stay as they are, and so do hidden ones unless `hidden` is said. `stops` is asked now and then whether to leave the
/// rest as it is.
///
/// Cost: O(n log n) in the segments, as long as few of them share a place.
#[must_use]
pub fn draw_once(polylines: Vec<Polyline>, within_mm: f64, hidden: bool, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
    if !(within_mm > 0.0 && within_mm.is_finite()) {
        return polylines;
    }
    drawn_once(polylines, within_mm, hidden, stops).0
}

/// How many strokes are done between two questions whether to stop.
const STROKES_A_QUESTION: usize = 1024;

/// What is left, and how many pieces of ink were looked at.
fn drawn_once(polylines: Vec<Polyline>, within: f64, hidden: bool, stops: &dyn Fn() -> bool) -> (Vec<Polyline>, u64) {
    let is_compared = |p: &Polyline| (p.visible || hidden) && p.page.len() >= 2 && is_on_paper(&p.page);
    let mut turns: Vec<usize> = (0..polylines.len()).filter(|&k| is_compared(&polylines[k])).collect();
    let lengths: Vec<f64> = polylines.iter().map(Polyline::length_mm).collect();
    let class = |p: &Polyline| (!p.visible, p.qi, p.level, p.kind.map_or(usize::MAX, |kind| kind as usize));
    turns.sort_by(|&a, &b| {
        class(&polylines[a]).cmp(&class(&polylines[b])).then_with(|| lengths[b].total_cmp(&lengths[a]))
    });
    let segments = turns.iter().map(|&k| polylines[k].page.len() - 1).sum();
    let mut kept = Kept::new(within, segments, turns.iter().map(|&k| lengths[k]).sum());
    // What is left of strokes of which something is cut.
    let mut left: Vec<Option<Vec<Polyline>>> = vec![None; polylines.len()];
    for (turn, &k) in turns.iter().enumerate() {
        if turn % STROKES_A_QUESTION == 0 && stops() {
            break;
        }
        let polyline = &polylines[k];
        let cuts = Stroke::new(k as u32, polyline, within).cuts(&mut kept);
        if !cuts.is_empty() {
            left[k] = Some(without(polyline, &cuts));
        }
    }
    let parts = polylines.into_iter().zip(left).flat_map(|(whole, parts)| parts.unwrap_or_else(|| vec![whole]));
    (parts.collect(), kept.looks)
}

/// A part of a stroke by lengths in mm along it.
type Span = [f64; 2];

/// A polyline without parts of it, in their order.
fn without(polyline: &Polyline, cuts: &[Span]) -> Vec<Polyline> {
    let mut walk = Walk::new(polyline);
    let mut parts = Vec::with_capacity(cuts.len() + 1);
    let mut from = 0.0;
    for &[low, high] in cuts.iter().chain(&[[f64::INFINITY; 2]]) {
        // Beyond its end a walk stays there.
        let part = (low > from).then(|| walk.cut(from, low));
        parts.extend(part.filter(|p| p.page.windows(2).any(|w| w[0] != w[1])));
        from = high;
    }
    parts
}

/// A stroke that is being compared with the ink that is kept.
struct Stroke<'a> {
    number: u32,
    polyline: &'a Polyline,
    within: f64,
    /// Its length in mm.
    length: f64,
    is_closed: bool,
}

impl<'a> Stroke<'a> {
    fn new(number: u32, polyline: &'a Polyline, within: f64) -> Self {
        let is_closed = polyline.page.len() > 2 && polyline.page.first() == polyline.page.last();
        Self { number, polyline, within, length: polyline.length_mm(), is_closed }
    }

    /// The parts to be cut out of it, in their order; the rest of it is added to what is kept.
    ///
    /// A part that is covered is only kept when it is known where it ends, and until then it covers nothing itself. So what is cut is always near to
    /// something that is kept, and not only to something else that is cut.
    fn cuts(&self, kept: &mut Kept) -> Vec<Span> {
        let mut cuts = Vec::new();
        let mut covered = Covered::default();
        let mut spans = Vec::new();
        let mut uncut = Uncut { pen: self.polyline.pen, last: None };
        let mut from = 0.0;
        for (k, ends) in self.polyline.page.windows(2).enumerate() {
            let segment = Piece { stroke: self.number, from, ends: [ends[0], ends[1]] };
            let to = from + segment.length();
            spans.clear();
            kept.near(uncut.pen, segment.ends, |piece| spans.extend(self.common(&segment, piece)));
            spans.sort_unstable_by(|a: &Span, b| a[0].total_cmp(&b[0]));
            let part = |[low, high]: Span| {
                let at = |along: f64| match along {
                    a if a <= from => ends[0],
                    a if a >= to => ends[1],
                    a => ends[0].lerp(ends[1], (a - from) / (to - from)),
                };
                (k, Piece { from: low, ends: [at(low), at(high)], ..segment })
            };
            let mut done = from;
            for &[low, high] in &spans {
                if low > done {
                    cuts.extend(self.end(&mut covered, &mut uncut, kept));
                    uncut.add(part([done, low]), kept);
                }
                if high > done {
                    let span = [low.max(done), high];
                    covered.add(span, part(span));
                    done = high;
                }
            }
            if done < to {
                cuts.extend(self.end(&mut covered, &mut uncut, kept));
                uncut.add(part([done, to]), kept);
            }
            uncut.flush(kept);
            from = to;
        }
        cuts.extend(self.end(&mut covered, &mut uncut, kept));
        uncut.flush(kept);
        cuts
    }

    /// Ends a part that is covered: returns it if it is cut out, or keeps it.
    fn end(&self, covered: &mut Covered, uncut: &mut Uncut, kept: &mut Kept) -> Option<Span> {
        let Covered { span: Some([low, high]), pieces } = std::mem::take(covered) else { return None };
        let (is_first, is_last) = (low <= 0.0, high >= self.length);
        let least = match (is_first, is_last) {
            (true, true) => 0.0,
            (false, false) => SHORTEST_MIDDLE_MM,
            // Where it begins is no end of a closed stroke.
            _ if self.is_closed => SHORTEST_MIDDLE_MM,
            _ => SHORTEST_END_MM,
        };
        if high - low >= least {
            return Some([low, high]);
        }
        pieces.into_iter().for_each(|piece| uncut.add(piece, kept));
        None
    }

    /// The part of a segment of the stroke that a piece of ink covers.
    fn common(&self, segment: &Piece, piece: &Piece) -> Option<Span> {
        let length = segment.length();
        let [low, high] = span_within(segment.ends, length, piece.ends, self.within)?;
        let (mut low, mut high) = (segment.from + low, segment.from + high);
        if piece.stroke == self.number {
            // Only what is far enough along the stroke, either way round if it is closed.
            low = low.max(piece.from + piece.length() + SELF_MM);
            if self.is_closed {
                high = high.min(self.length + piece.from - SELF_MM);
            }
        }
        (low < high).then_some([low, high])
    }
}

/// Parts of a stroke on their way to what is kept: those of a segment that follow one another go there as one, so that what crosses it does not make
/// more of it.
struct Uncut {
    pen: u32,
    /// The last one, and the number of its segment.
    last: Option<(usize, Piece)>,
}

impl Uncut {
    fn add(&mut self, (segment, piece): (usize, Piece), kept: &mut Kept) {
        match &mut self.last {
            Some((of, last)) if *of == segment && last.ends[1] == piece.ends[0] => last.ends[1] = piece.ends[1],
            _ => {
                self.flush(kept);
                self.last = Some((segment, piece));
            }
        }
    }

    fn flush(&mut self, kept: &mut Kept) {
        if let Some((_, last)) = self.last.take() {
            kept.add(self.pen, last);
        }
    }
}

/// A part of a stroke that is covered, as far as it goes yet.
#[derive(Default)]
struct Covered {
    span: Option<Span>,
    /// With the numbers of their segments.
    pieces: Vec<(usize, Piece)>,
}

impl Covered {
    fn add(&mut self, [low, high]: Span, piece: (usize, Piece)) {
        self.span = Some([self.span.map_or(low, |span| span[0]), high]);
        self.pieces.push(piece);
    }
}

/// The part of a segment, by lengths from its beginning, that is within a distance of another one: of the points of a strip and of the disks at its ends,
/// which are convex together. None if there is no such part, or the segment is a point.
fn span_within([a, b]: [DVec2; 2], length: f64, [p, q]: [DVec2; 2], within: f64) -> Option<Span> {
    if length == 0.0 {
        return None;
    }
    let along = (b - a) / length;
    let reach = p.distance(q);
    let axis = if reach > 0.0 { (q - p) / reach } else { DVec2::X };
    // In the frame of the other segment, which lies on the x axis.
    let turned = |v: DVec2| DVec2::new(axis.dot(v), axis.perp_dot(v));
    let (start, step) = (turned(a - p), turned(along));
    let strip = {
        let slab = |start: f64, step: f64, low: f64, high: f64| {
            if step == 0.0 {
                return (low..=high).contains(&start).then_some([0.0, length]);
            }
            let (s, t) = ((low - start) / step, (high - start) / step);
            Some([s.min(t), s.max(t)])
        };
        let (x, y) = (slab(start.x, step.x, 0.0, reach), slab(start.y, step.y, -within, within));
        x.zip(y).map(|(x, y)| [x[0].max(y[0]), x[1].min(y[1])])
    };
    let disk = |centre: DVec2| {
        let (foot, off) = ((centre - start).dot(step), (centre - start).perp_dot(step));
        let half = within * within - off * off;
        (half >= 0.0).then(|| [foot - half.sqrt(), foot + half.sqrt()])
    };
    let parts = [strip, disk(DVec2::ZERO), disk(DVec2::new(reach, 0.0))];
    let parts = parts.into_iter().flatten().filter(|part| part[0] <= part[1]);
    let [low, high] = parts.reduce(|s, t| [s[0].min(t[0]), s[1].max(t[1])])?;
    let (low, high) = (low.max(0.0), high.min(length));
    (low < high).then_some([low, high])
}

#[cfg(test)]
mod tests;

//! What a simulated plotter drew.

use glam::DVec2;
use penvis_firmware::AXES;

use crate::device::Placement;
use crate::drawing::{Drawing, LAYER, Page, Polyline};
use crate::pens::Pens;

/// A run of the pen, from one change of it to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Whether it drew.
    pub pen_down: bool,
    /// Number of the pen in the holder.
    pub pen: u32,
    /// Where it went, in mm from the machine's start: a point where each block of the planner ends, and within a block points of its steps,
    /// left out where the path passes within half a step of them.
    /// Two or more; a dot is the same point twice.
    pub points: Vec<DVec2>,
}

impl Trace {
    /// Its length in mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.points.windows(2).map(|ends| ends[0].distance(ends[1])).sum()
    }
}

/// What a simulated plotter drew.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// In the order of time; each begins where the one before ends.
    pub traces: Vec<Trace>,
    /// Virtual time in s, from power on to the last byte.
    pub duration_s: f64,
    /// Step pulses of each axis.
    pub steps: [u64; AXES],
    /// Where it ended, in steps from the start.
    pub position: [i64; AXES],
    /// Bytes that the receive buffer had no room for.
    pub lost_bytes: u32,
}

impl Recording {
    /// Length drawn in mm.
    #[must_use]
    pub fn ink_mm(&self) -> f64 {
        self.length_mm(true)
    }

    /// Length moved with the pen up, in mm.
    #[must_use]
    pub fn travel_mm(&self) -> f64 {
        self.length_mm(false)
    }

    fn length_mm(&self, pen_down: bool) -> f64 {
        let traces = self.traces.iter().filter(|trace| trace.pen_down == pen_down);
        // From 0 on: the sum of nothing would be -0.
        traces.map(Trace::length_mm).fold(0.0, |all, length| all + length)
    }

    /// How often the pen was put down.
    #[must_use]
    pub fn lifts(&self) -> usize {
        self.traces.iter().filter(|trace| trace.pen_down).count()
    }

    /// The ink as a drawing, on a page that lay in the machine as `placement` says.
    #[must_use]
    pub fn drawing(&self, name: &str, page: Page, placement: &Placement) -> Drawing {
        let polylines = self.traces.iter().filter(|trace| trace.pen_down).map(|trace| {
            let page: Vec<DVec2> = trace.points.iter().map(|point| placement.to_page(*point)).collect();
            Polyline::stroke(LAYER, trace.pen, page)
        });
        let polylines = polylines.collect();
        Drawing { name: name.to_owned(), page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines }
    }
}

//! What a drawing takes: ink, travel, lifts and time, layer by layer.

use glam::DVec2;
use serde::Serialize;

use crate::device::{Device, Hpgl, Language, Pen};
use crate::drawing::Drawing;
use crate::emit::{self, Run};
use crate::page::Measure;
use crate::protocol::hpgl::Job;
use crate::straight;
use crate::trace::{Pace, Timer, hpgl};

/// Grid on which ends of strokes meet, in mm: the decimals of G-code.
const GRID_MM: f64 = 0.001;

/// Decimals of G-code.
const DECIMALS: usize = 3;

/// What a layer takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LayerEstimate {
    /// Name of the layer.
    pub layer: String,
    /// Number of the pen.
    pub pen: u32,
    /// Length of the ink in mm.
    pub ink_mm: f64,
    /// Length of the ways with the pen up in mm, each counted to the stroke after it.
    pub travel_mm: f64,
    /// Times that the pen is lowered.
    pub lifts: u64,
    /// Time in s.
    pub seconds: f64,
}

/// What a drawing takes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Its layers, each with a pen, in the order in which they begin.
    pub layers: Vec<LayerEstimate>,
    /// Way in mm from the last stroke to the plotter's zero, where the job goes there.
    pub home_mm: f64,
    /// Time in s that this takes, or putting the pen back.
    pub home_s: f64,
}

impl Estimate {
    /// What `device` takes for a drawing, by the firmware's planner: with the device's acceleration, junction deviation and look-ahead, and no faster than its
    /// line brings the moves. The time at which a hand changes pens is not in it.
    ///
    /// Cost: linear in the vertices and in the time, which is cut into slices of 2.5 ms.
    #[must_use]
    pub fn new(drawing: &Drawing, device: &Device) -> Self {
        let runs = emit::runs(drawing, GRID_MM, |p| p);
        let mut timer = Timer::new(&Pace::of(device), runs.len() + 1);
        let mut estimate = Self::default();
        let mut places = Vec::with_capacity(runs.len());
        let (mut at, mut held) = ([0, 0], None);
        for (index, run) in runs.iter().enumerate() {
            let (Some(first), Some(last)) = (run.points.first(), run.points.last()) else { continue };
            if held != Some(run.pen)
                && let Language::Hpgl(language) = &device.language
            {
                timer.dwell(language.change_s);
            }
            held = Some(run.pen);
            let feed = drawing.pens.draw_feed(run.pen, device.draw_feed);
            time(&mut timer, index, (run, drawing.slack_mm), at, feed, device);
            let place = estimate.place(&drawing.polylines[run.polyline].layer, run.pen);
            places.push((index, place));
            let layer = &mut estimate.layers[place];
            layer.travel_mm += way(at, *first).length();
            layer.ink_mm += run.points.windows(2).map(|w| way(w[0], w[1]).length()).sum::<f64>();
            layer.lifts += 1;
            at = *last;
        }
        timer.piece(runs.len(), 6);
        match &device.language {
            Language::Grbl(_) | Language::Marlin(_) => {
                timer.go(way(at, [0, 0]).extend(0.0), travel_feed(device));
                estimate.home_mm = way(at, [0, 0]).length();
            }
            Language::Hpgl(language) => {
                if held.is_some_and(|pen| puts_back(device, language, pen)) {
                    timer.dwell(language.change_s);
                }
            }
        }
        let seconds = timer.finish();
        for (index, place) in places {
            estimate.layers[place].seconds += seconds[index];
        }
        estimate.home_s = seconds[runs.len()];
        estimate
    }

    /// Time in s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.layers.iter().map(|layer| layer.seconds).sum::<f64>() + self.home_s
    }

    /// Length of all ways with the pen up in mm.
    #[must_use]
    pub fn travel_mm(&self) -> f64 {
        self.layers.iter().map(|layer| layer.travel_mm).sum::<f64>() + self.home_mm
    }

    /// Index of a layer with a pen.
    fn place(&mut self, name: &str, pen: u32) -> usize {
        let known = self.layers.iter().position(|layer| layer.layer == name && layer.pen == pen);
        known.unwrap_or_else(|| {
            let layer = name.to_owned();
            self.layers.push(LayerEstimate { layer, pen, ink_mm: 0.0, travel_mm: 0.0, lifts: 0, seconds: 0.0 });
            self.layers.len() - 1
        })
    }
}

/// What the ways between strokes take on a device: its lifts and its travel, without what the line adds.
#[must_use]
pub fn travel_time(device: &Device) -> Measure {
    let (lift_s, of_axes) = match &device.language {
        Language::Grbl(gcode) | Language::Marlin(gcode) => {
            (lift_seconds(&gcode.pen, device.acceleration).iter().sum(), travel_feed(device).is_none())
        }
        Language::Hpgl(language) => (2.0 * language.lift_s, true),
    };
    Measure::Time { lift_s, speed: device.travel_feed / 60.0, acceleration: device.acceleration, of_axes }
}

/// Follows the pen from `at` through a stroke and up from it.
fn time(timer: &mut Timer, index: usize, (run, slack_mm): (&Run, f64), at: [i64; 2], feed: f64, device: &Device) {
    let Some((first, rest)) = run.points.split_first() else { return };
    let travel = way(at, *first).extend(0.0);
    match &device.language {
        Language::Grbl(gcode) | Language::Marlin(gcode) => {
            timer.piece(index, line_bytes(*first));
            timer.go(travel, travel_feed(device));
            let lines = |timer: &mut Timer, lines: Vec<String>, seconds: f64| {
                lines.iter().for_each(|line| timer.piece(index, line.len()));
                timer.dwell(seconds);
                timer.ask();
            };
            let [raise_s, lower_s] = lift_seconds(&gcode.pen, device.acceleration);
            lines(timer, gcode.pen_down(), lower_s);
            let mut from = *first;
            for piece in emit::moves(run, slack_mm, gcode) {
                timer.piece(index, piece.text().len());
                piece.ways(from, gcode).iter().for_each(|way| timer.go(way.extend(0.0), Some(feed)));
                from = piece.end();
            }
            lines(timer, gcode.pen_up(), raise_s);
        }
        Language::Hpgl(language) => {
            // Coordinates are in the plotter's units there.
            let units = |p: &[i64; 2]| p.map(|mm| (mm as f64 * GRID_MM / language.unit_mm).round() as i64);
            timer.piece(index, "PU;".len() + hpgl::difference_bytes(units(&at), &[units(first)], false));
            timer.go_by_axis(travel, device.travel_feed);
            timer.ask();
            timer.dwell(language.lift_s);
            let mut from = *first;
            for list in rest.chunks(language.list_points.max(1)) {
                let points: Vec<_> = list.iter().map(units).collect();
                timer.piece(index, hpgl::difference_bytes(units(&from), &points, language.encoded));
                for point in list {
                    timer.go_by_axis(way(from, *point).extend(0.0), feed);
                    from = *point;
                }
            }
            timer.dwell(language.lift_s);
            timer.ask();
        }
    }
}

/// Whether the instructions after a drawing put this pen back, or take another one.
fn puts_back(device: &Device, language: &Hpgl, pen: u32) -> bool {
    let mut state = hpgl::State::unknown();
    state.pen = Some(pen);
    Job::new(device.fill(&language.end, pen).as_bytes()).is_ok_and(|end| {
        end.instructions().iter().for_each(|instruction| {
            state.follow(instruction);
        });
        state.pen != Some(pen)
    })
}

/// Feed in mm/min with the pen up; none where each axis goes as fast as it can.
fn travel_feed(device: &Device) -> Option<f64> {
    (!matches!(device.language, Language::Grbl(_))).then_some(device.travel_feed)
}

fn way(a: [i64; 2], b: [i64; 2]) -> DVec2 {
    DVec2::new((b[0] - a[0]) as f64, (b[1] - a[1]) as f64) * GRID_MM
}

/// Bytes of a line with a move.
fn line_bytes(to: [i64; 2]) -> usize {
    "G1 X Y".len() + to.map(|x| emit::decimal(x as f64 * GRID_MM, DECIMALS).len()).iter().sum::<usize>()
}

/// Time in s to raise and to lower a pen.
fn lift_seconds(pen: &Pen, acceleration: f64) -> [f64; 2] {
    match *pen {
        Pen::Servo { raise_s, lower_s, .. } => [raise_s, lower_s],
        Pen::Z { up_mm, down_mm, feed, soft_mm, soft_feed } => {
            let seconds = |length: f64, feed: f64| straight::seconds(length, feed / 60.0, acceleration);
            let height = up_mm - down_mm;
            [seconds(height, feed), seconds(height - soft_mm, feed) + seconds(soft_mm, soft_feed)]
        }
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::{Boundary, Iso};

    use super::*;
    use crate::device::find;
    use crate::emit::tests::{drawing, polyline};

    fn two_squares_and_a_line() -> Drawing {
        let lines = vec![
            polyline(Boundary, 1, &[[3.0, 4.0], [13.0, 4.0], [13.0, 14.0]]),
            polyline(Iso, 1, &[[13.0, 14.0001], [13.0, 24.0]]),
            polyline(Iso, 1, &[[3.0, 24.0], [3.0, 4.0]]),
        ];
        drawing(297.0, 210.0, lines)
    }

    #[test]
    fn strokes_that_meet_are_one_lift() {
        let estimate = Estimate::new(&two_squares_and_a_line(), &find("grbl-servo").unwrap());
        let found: Vec<_> =
            estimate.layers.iter().map(|l| (l.layer.as_str(), l.ink_mm, l.travel_mm, l.lifts)).collect();
        assert_eq!(found, [("boundary", 30.0, 5.0, 1), ("iso", 20.0, 10.0, 1)]);
        assert_eq!((estimate.home_mm, estimate.travel_mm()), (5.0, 20.0));
    }

    #[test]
    fn the_estimate_holds_moves_and_lifts() {
        let mut device = find("grbl-servo").unwrap();
        (device.draw_feed, device.travel_feed, device.acceleration, device.baud) = (600.0, 600.0, 1e6, 100_000_000);
        let seconds = Estimate::new(&two_squares_and_a_line(), &device).seconds();
        // 50 mm of ink and 10 of travel at 10 mm/s, 5 there and 5 back with the longer axis at that, and 0.35 s for each of two lifts.
        assert!((seconds - (5.0 + 1.0 + 0.8 + 0.7)).abs() < 1e-2, "{seconds}");
        let hp = Estimate::new(&two_squares_and_a_line(), &find("hp7475a").unwrap()).seconds();
        // The pen is taken from its stall first, and put back at the end.
        assert!(hp > 6.4 && hp < 7.5, "{hp}");
    }
}

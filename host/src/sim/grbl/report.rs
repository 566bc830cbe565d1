//! Status reports.

use std::fmt::Write;

use glam::DVec3;

use super::{Grbl, Lock};

const MM_PER_INCH: f64 = 25.4;

/// Reports that are to come before these fields are told again: they rarely change.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counters {
    pub(super) offset: u32,
    pub(super) overrides: u32,
}

impl Grbl {
    /// What it does, in GRBL's words.
    pub(super) fn state(&self) -> &'static str {
        if self.lock == Lock::Sleep {
            "Sleep"
        } else if self.lock != Lock::None {
            "Alarm"
        } else if self.homing {
            "Home"
        } else if self.check {
            "Check"
        } else if self.jogging {
            "Jog"
        } else if self.motion.is_held() {
            match (self.door, self.motion.is_moving()) {
                (true, true) => "Door:2",
                (true, false) => "Door:0",
                (false, true) => "Hold:1",
                (false, false) => "Hold:0",
            }
        } else if self.motion.is_done() {
            "Idle"
        } else {
            "Run"
        }
    }

    /// Numbers of three axes: in mm with three decimals, or in inches with four.
    pub(super) fn triple(&self, mm: DVec3) -> String {
        let inches = self.settings.is_on(13);
        let [x, y, z] = if inches { mm / MM_PER_INCH } else { mm }.to_array();
        let decimals = if inches { 4 } else { 3 };
        format!("{x:.decimals$},{y:.decimals$},{z:.decimals$}")
    }

    /// Answers `?`.
    pub(super) fn status(&mut self) {
        let state = self.state();
        let offset = DVec3::from(self.parser.modal.offset(&self.parser.places).map(f64::from));
        let mask = self.settings.get(10) as u32;
        let position = self.machine_position();
        let mut text = format!("<{state}|");
        let place = if mask & 1 != 0 { ("MPos", position) } else { ("WPos", position - offset) };
        // Writing to a string cannot fail.
        let _ = write!(text, "{}:{}", place.0, self.triple(place.1));
        if mask & 2 != 0 {
            let _ = write!(text, "|Bf:{},{}", self.motion.room(), self.ring_size - self.ring.len());
        }
        let spindle = self.spindle.unwrap_or(0.0) * self.overrides[2] as f32 / 100.0;
        let _ = write!(text, "|FS:{:.0},{spindle:.0}", self.motion.speed() * 60.0);
        let busy = self.motion.is_moving();
        if self.counters.offset > 0 {
            self.counters.offset -= 1;
        } else {
            self.counters.offset = if busy { 29 } else { 9 };
            // The overrides wait for the next report.
            self.counters.overrides = self.counters.overrides.max(1);
            let _ = write!(text, "|WCO:{}", self.triple(offset));
        }
        if self.counters.overrides > 0 {
            self.counters.overrides -= 1;
        } else {
            self.counters.overrides = if busy { 19 } else { 9 };
            let [feed, rapid, spindle] = self.overrides;
            let _ = write!(text, "|Ov:{feed},{rapid},{spindle}");
            if self.spindle.is_some() {
                text.push_str(if self.parser.modal.spindle == Some(4) { "|A:C" } else { "|A:S" });
            }
        }
        text.push_str(">\r\n");
        self.say(&text);
    }

    /// What `$#` tells.
    pub(super) fn parameters(&self) -> String {
        let places = &self.parser.places;
        let modal = &self.parser.modal;
        let names = ["G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30"];
        let line =
            |name: &str, place: [f32; 3]| format!("[{name}:{}]\r\n", self.triple(DVec3::from(place.map(f64::from))));
        let mut text: String = names.iter().zip(places).map(|(name, place)| line(name, *place)).collect();
        text.push_str(&line("G92", modal.g92));
        let _ = write!(text, "[TLO:{:.3}]\r\n[PRB:{}:0]\r\n", modal.tool_length, self.triple(DVec3::ZERO));
        text
    }
}

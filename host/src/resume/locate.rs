//! Asks a GRBL controller where its pen is, before anything is drawn.
//!
//! ```text
//!  Greeting ── banner, or 2 s of silence ──> Asking ── `?`: still moving ──> (wait) ── at rest ──> Lines ── all answered ──> Settling ──> Over
//!                                            Asking ── Hold:0 ── 0x18, which keeps the position ──> Asking
//! ```
//!
//! A plotter that was left in the middle of a job goes on until its buffers are empty; and it may be told to wait in the
//! middle of them. It counts as at rest when it has not moved for longer than the job ever waits.

use std::collections::VecDeque;
use std::time::Duration;

use glam::DVec3;

use crate::protocol::grbl::is_banner;
use crate::protocol::{Control, Event, Fault, Input, Outbox, Place, Progress, Protocol, Unit};

/// Time from opening the port in which a banner may come.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// Time between status requests.
const POLL_INTERVAL: Duration = Duration::from_millis(200);
/// A controller that is asked answers in milliseconds; after a reset it may take as long as its boot loader.
const SILENCE_MAX: Duration = Duration::from_secs(6);
/// Homing answers nothing until it is done.
const LINE_MAX: Duration = Duration::from_secs(180);
/// What was in the buffers of a plotter is drawn in this time, or it is waited for no longer.
const REST_MAX: Duration = Duration::from_secs(1800);
/// Reports without the offset of the coordinates after which it is taken for unknown: it is in every thirtieth at the least.
const OFFSET_REPORTS: u32 = 40;
/// Ends what a sender before us may have left half written, as a line that is refused.
const SPOIL: &str = "#";
const STATUS: u8 = b'?';
const RESET: u8 = 0x18;

/// Where a controller says that its pen is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Whether it has restarted since it was connected: what it says of its place is where it was switched on.
    pub restarted: bool,
    /// Whether it is locked (alarm): its place is not to be relied on.
    pub locked: bool,
    /// Place in the coordinates in force, mm.
    pub place: Option<DVec3>,
    /// Place in those of the machine, mm.
    pub machine: Option<DVec3>,
}

/// A conversation that finds out where the pen is; with lines, it sends these first, each when the one before it is answered.
#[derive(Debug)]
pub struct Locate {
    phase: Phase,
    since: Duration,
    lines: VecDeque<String>,
    settle: Duration,
    baud: u32,
    input: Input,
    outbox: Outbox,
    found: Found,
    offset: Option<DVec3>,
    reports: u32,
    /// Whether a reset of ours is under way, the banner of which is no restart.
    resets: bool,
    last_heard: Duration,
    last_poll: Duration,
    /// What it reported last, and since when.
    still: Option<(String, Duration)>,
    told: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Greeting,
    Asking,
    /// Waiting for the answer to a line; whether that may be an error.
    Lines {
        spoils: bool,
    },
    Settling,
    Over,
}

impl Locate {
    /// Asks a controller at a port that was just opened. `settle`: the longest time that a job stands still by itself.
    #[must_use]
    pub fn new(lines: Vec<String>, settle: Duration, baud: u32) -> Self {
        let mut lines: VecDeque<String> = lines.into();
        if !lines.is_empty() {
            lines.push_front(SPOIL.to_owned());
        }
        Self {
            phase: Phase::Greeting,
            since: Duration::ZERO,
            lines,
            settle: settle + Duration::from_secs(1),
            baud,
            input: Input::default(),
            outbox: Outbox::default(),
            found: Found::default(),
            offset: None,
            reports: 0,
            resets: false,
            last_heard: Duration::ZERO,
            last_poll: Duration::ZERO,
            still: None,
            told: false,
        }
    }

    /// What was found, once the conversation is done.
    #[must_use]
    pub fn found(&self) -> Found {
        self.found
    }

    fn enter(&mut self, phase: Phase, now: Duration) {
        self.phase = phase;
        self.since = now;
        self.last_heard = now;
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.outbox.tell(Event::Failed(fault));
    }

    fn poll(&mut self, now: Duration) {
        self.outbox.write(&[STATUS]);
        self.last_poll = now;
    }

    fn line(&mut self, line: &str, now: Duration) {
        if let Some(report) = line.strip_prefix('<').and_then(|rest| rest.strip_suffix('>')) {
            self.report(report, now);
        } else if is_banner(line) {
            self.banner(now);
        } else if let Phase::Lines { spoils } = self.phase {
            if line == "ok" || (spoils && line.starts_with("error:")) {
                self.next_line(now);
            } else if let Some(code) = line.strip_prefix("error:").or(line.strip_prefix("ALARM:")) {
                let state = format!("error {code}");
                self.fail(Fault::NotReady { state, advice: "it refuses to be homed or unlocked; see its manual" });
            }
        }
    }

    fn banner(&mut self, now: Duration) {
        match self.phase {
            Phase::Over => {}
            Phase::Lines { .. } => {
                let at = self.place();
                self.fail(Fault::Restarted { at });
            }
            _ => {
                self.found.restarted |= !self.resets;
                self.resets = false;
                self.offset = None;
                self.still = None;
                self.poll(now);
                self.enter(Phase::Asking, now);
            }
        }
    }

    fn report(&mut self, report: &str, now: Duration) {
        let mut fields = report.split('|');
        let state = fields.next().unwrap_or_default().to_owned();
        let (mut place, mut machine) = (None, None);
        for field in fields {
            match field.split_once(':') {
                Some(("MPos", value)) => machine = vector(value),
                Some(("WPos", value)) => place = vector(value),
                Some(("WCO", value)) => self.offset = vector(value),
                _ => {}
            }
        }
        self.reports += 1;
        if let Some(offset) = self.offset {
            place = place.or(machine.map(|at: DVec3| at - offset));
            machine = machine.or(place.map(|at| at + offset));
        }
        self.found.place = place;
        self.found.machine = machine;
        if !matches!(self.phase, Phase::Asking | Phase::Settling) {
            return;
        }
        // Other fields (buffers, overrides) change at rest too.
        let now_still = format!("{state} {machine:?}");
        match &self.still {
            Some((last, _)) if *last == now_still => {}
            _ => self.still = Some((now_still, now)),
        }
        let stood = self.still.as_ref().map_or(Duration::ZERO, |(_, since)| now.saturating_sub(*since));
        match state.split(':').next().unwrap_or_default() {
            "Idle" if stood >= self.settle => self.rests(now),
            "Alarm" if stood >= POLL_INTERVAL => {
                self.found.locked = true;
                self.rests(now);
            }
            "Idle" | "Alarm" | "Run" | "Jog" | "Home" => {
                if state != "Idle" && !self.told && stood.is_zero() {
                    self.told = true;
                    self.outbox.tell(Event::Message(format!("{state}; waiting until it is at rest")));
                }
            }
            "Hold" if state.ends_with(":1") => {}
            "Hold" if !self.resets => {
                self.resets = true;
                self.outbox.write(&[RESET]);
                self.since = now;
            }
            "Hold" => {}
            _ => self.fail(Fault::NotReady { state, advice: "bring it to Idle first" }),
        }
    }

    /// It does not move any more.
    fn rests(&mut self, now: Duration) {
        if self.phase == Phase::Asking && !self.lines.is_empty() {
            return self.next_line(now);
        }
        if self.offset.is_none() && self.found.place.is_none() && self.reports < OFFSET_REPORTS {
            return;
        }
        self.phase = Phase::Over;
        self.outbox.tell(Event::Done);
    }

    fn next_line(&mut self, now: Duration) {
        match self.lines.pop_front() {
            Some(line) => {
                self.outbox.line(&line);
                self.enter(Phase::Lines { spoils: line == SPOIL }, now);
            }
            None => {
                self.found.locked = false;
                self.still = None;
                self.offset = None;
                self.reports = 0;
                self.poll(now);
                self.enter(Phase::Settling, now);
            }
        }
    }
}

/// `x,y,z` in mm; more axes are left aside.
fn vector(text: &str) -> Option<DVec3> {
    let mut numbers = text.split(',').map(|number| number.trim().parse::<f64>().ok().filter(|x| x.is_finite()));
    Some(DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??))
}

impl Protocol for Locate {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        if !bytes.is_empty() {
            self.last_heard = now;
        }
        for &byte in bytes {
            if let Some(line) = self.input.take(byte) {
                self.line(&line, now);
            }
        }
        self.tick(now);
    }

    fn tick(&mut self, now: Duration) {
        let elapsed = now.saturating_sub(self.since);
        let silent = now.saturating_sub(self.last_heard);
        match self.phase {
            Phase::Greeting if elapsed >= BANNER_WAIT => {
                self.poll(now);
                self.enter(Phase::Asking, now);
            }
            Phase::Asking | Phase::Settling if silent > SILENCE_MAX => {
                let baud = self.baud;
                self.fail(Fault::NoAnswer { baud });
            }
            Phase::Asking | Phase::Settling if elapsed > REST_MAX => {
                self.fail(Fault::NotReady { state: "moving".into(), advice: "wait until it rests, then resume" });
            }
            Phase::Asking | Phase::Settling if now.saturating_sub(self.last_poll) >= POLL_INTERVAL => self.poll(now),
            Phase::Lines { .. } if elapsed > LINE_MAX => {
                let at = self.place();
                self.fail(Fault::Silent { at, seconds: elapsed.as_secs() });
            }
            _ => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn control(&mut self, control: Control, _now: Duration) {
        if control == Control::Stop && self.phase != Phase::Over {
            if matches!(self.phase, Phase::Lines { .. }) {
                // Homing is broken off; nothing else is under way.
                self.outbox.write(&[RESET]);
            }
            let at = self.place();
            self.fail(Fault::Cancelled { at });
        }
    }

    fn progress(&self) -> Progress {
        Progress::default()
    }

    fn place(&self) -> Place {
        Place { unit: Unit::Line, number: 0, text: String::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAIT: Duration = Duration::from_millis(100);

    /// A controller that answers each `?` with the next of its reports (the last for ever), and each line with an answer.
    fn talk(lines: &[&str], banner: bool, reports: &[&str], answers: &[&str]) -> (Found, Vec<Event>, String) {
        let mut locate = Locate::new(lines.iter().map(|l| (*l).to_owned()).collect(), Duration::ZERO, 9600);
        let (mut now, mut sent, mut events) = (Duration::ZERO, String::new(), Vec::new());
        let (mut reports, mut answers) = (reports.iter().peekable(), answers.iter());
        if banner {
            locate.receive(b"\r\nGrbl 1.1h ['$' for help]\r\n", now);
        }
        while now < REST_MAX + LINE_MAX && events.last().is_none_or(|e| matches!(e, Event::Message(_))) {
            now += WAIT;
            locate.tick(now);
            let output = locate.take_output();
            for &byte in &output {
                match byte {
                    STATUS => {
                        let report = if reports.len() > 1 { reports.next() } else { reports.peek().copied() };
                        if let Some(report) = report {
                            locate.receive(format!("<{report}>\r\n").as_bytes(), now);
                        }
                    }
                    RESET => locate.receive(b"Grbl 1.1h ['$' for help]\r\n", now),
                    b'\n' => {
                        let answer = answers.next().copied().unwrap_or_default();
                        locate.receive(format!("{answer}\r\n").as_bytes(), now);
                    }
                    _ => {}
                }
            }
            sent.extend(output.iter().filter(|b| **b != STATUS).map(|b| *b as char));
            events.extend(std::iter::from_fn(|| locate.take_event()));
        }
        (locate.found(), events, sent)
    }

    #[test]
    fn the_place_is_that_of_the_coordinates_in_force() {
        let table: &[(&[&str], Option<[f64; 3]>)] = &[
            (&["Idle|MPos:5.000,7.000,0.000|FS:0,0|WCO:1.000,2.000,3.000"], Some([4.0, 5.0, -3.0])),
            (&["Idle|WPos:5.000,7.000,0.000|FS:0,0"], Some([5.0, 7.0, 0.0])),
            (&["Idle|MPos:5,7,0|WCO:0,0,1", "Idle|MPos:5,7,0|Ov:100,100,100"], Some([5.0, 7.0, -1.0])),
            (&["Idle|MPos:5.000,7.000,0.000"], None),
            (&["Idle|MPos:5.000,x,0.000|WCO:0,0,0"], None),
        ];
        for (reports, place) in table {
            let (found, events, sent) = talk(&[], false, reports, &[]);
            assert_eq!((found.place, events, sent.as_str()), (place.map(DVec3::from_array), vec![Event::Done], ""));
            assert!(!found.restarted && !found.locked);
        }
    }

    #[test]
    fn a_plotter_that_still_draws_is_waited_for() {
        let reports =
            ["Run|MPos:1,0,0|WCO:0,0,0", "Run|MPos:2,0,0", "Idle|MPos:3,0,0", "Run|MPos:4,0,0", "Idle|MPos:9,0,0"];
        let (found, events, _) = talk(&[], false, &reports, &[]);
        assert_eq!(found.place, Some(DVec3::new(9.0, 0.0, 0.0)));
        assert!(matches!(&events[..], [Event::Message(text), Event::Done] if text.starts_with("Run")), "{events:?}");
    }

    #[test]
    fn a_plotter_that_is_held_is_reset_and_that_is_no_restart() {
        let reports = ["Hold:1|MPos:1,0,0", "Hold:0|MPos:2,0,0", "Idle|MPos:2,0,0|WCO:0,0,0"];
        let (found, events, sent) = talk(&[], false, &reports, &[]);
        assert_eq!((found.place, found.restarted, sent.as_str()), (Some(DVec3::new(2.0, 0.0, 0.0)), false, "\u{18}"));
        assert_eq!(events, [Event::Done]);
    }

    #[test]
    fn restarts_and_locks_are_told() {
        let (found, events, _) = talk(&[], true, &["Idle|MPos:0,0,0|WCO:0,0,0"], &[]);
        assert!(found.restarted && !found.locked && events == [Event::Done]);
        let (found, events, _) = talk(&[], true, &["Alarm|MPos:0,0,0|WCO:0,0,0"], &[]);
        assert!(found.restarted && found.locked && events.last() == Some(&Event::Done));
    }

    #[test]
    fn lines_are_sent_at_rest_one_after_the_other() {
        let reports = ["Alarm|MPos:0,0,0|WCO:0,0,0", "Alarm|MPos:0,0,0", "Idle|MPos:0,0,0|WCO:-1,0,0"];
        let (found, events, sent) = talk(&["$X", "G92X0Y0"], true, &reports, &["error:1", "ok", "ok"]);
        assert_eq!((sent.as_str(), events.last()), ("#\n$X\nG92X0Y0\n", Some(&Event::Done)));
        assert_eq!((found.place, found.locked), (Some(DVec3::new(1.0, 0.0, 0.0)), false));
        let (_, events, _) = talk(&["$H"], true, &reports, &["error:1", "error:5"]);
        assert!(matches!(events.last(), Some(Event::Failed(Fault::NotReady { .. }))), "{events:?}");
    }

    #[test]
    fn every_wait_is_bounded() {
        assert!(matches!(talk(&[], false, &[], &[]).1[..], [Event::Failed(Fault::NoAnswer { baud: 9600 })]));
        let for_ever = talk(&[], false, &["Run|MPos:0,0,0|WCO:0,0,0"], &[]).1;
        assert!(matches!(for_ever.last(), Some(Event::Failed(Fault::NotReady { .. }))));
        let silent = talk(&["$H"], false, &["Idle|MPos:0,0,0|WCO:0,0,0"], &["ok"]).1;
        assert!(matches!(silent.last(), Some(Event::Failed(Fault::Silent { .. }))), "{silent:?}");
        let door = talk(&[], false, &["Door:0|MPos:0,0,0"], &[]).1;
        assert!(matches!(door.last(), Some(Event::Failed(Fault::NotReady { .. }))));
    }
}

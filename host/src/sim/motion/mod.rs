//! Timed straight moves, as simulated controllers other than the firmware make them.
//!
//! ```text
//!  speed |    ____
//!        |   /    \        each move comes to rest at its end; a hold brakes within the move,
//!        |  /      \  /\   a change of the speed plans the rest of it anew from place and speed
//!        |_/________\/__\___ time
//! ```
//!
//! Ends are exact: a move that is over leaves the pen at its target and nowhere else. To rest at every corner makes curves slower than
//! a controller with look-ahead draws them, and no other.

mod pencil;

use std::collections::VecDeque;

use glam::DVec3;

pub(super) use pencil::{Pencil, Sense};

use super::Recording;

const NS_PER_S: f64 = 1e9;

/// No move is slower, in mm/s: GRBL's limit too (1 mm/min).
const SLOWEST: f64 = 1.0 / 60.0;

/// A straight move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Move {
    /// Where it ends, in mm of the mechanism.
    pub(super) target: DVec3,
    /// Speed in mm/s.
    pub(super) speed: f64,
    /// Acceleration in mm/s².
    pub(super) acceleration: f64,
    /// Whether the second of the two speed factors is for it.
    pub(super) rapid: bool,
}

/// Part of a move with one acceleration.
#[derive(Clone, Copy, Debug)]
struct Phase {
    seconds: f64,
    /// In mm/s².
    acceleration: f64,
}

/// How the move under way goes on.
#[derive(Clone, Debug)]
struct Profile {
    from: DVec3,
    length: f64,
    /// Time in ns at which the phases begin.
    begun: u64,
    /// Place (mm from `from`) and speed (mm/s) at that time.
    place: f64,
    speed: f64,
    phases: Vec<Phase>,
    /// Time in ns at which they end.
    ends: u64,
}

impl Profile {
    fn new(from: DVec3, length: f64, begun: u64, [place, speed]: [f64; 2], phases: Vec<Phase>) -> Self {
        let seconds: f64 = phases.iter().map(|phase| phase.seconds).sum();
        let ends = begun.saturating_add((seconds * NS_PER_S).ceil() as u64);
        Self { from, length, begun, place, speed, phases, ends }
    }

    /// Place and speed at a time.
    fn at(&self, now: u64) -> [f64; 2] {
        let mut left = now.saturating_sub(self.begun) as f64 / NS_PER_S;
        let (mut place, mut speed) = (self.place, self.speed);
        for phase in &self.phases {
            let t = left.min(phase.seconds);
            place += (speed + 0.5 * phase.acceleration * t) * t;
            speed = (speed + phase.acceleration * t).max(0.0);
            left -= t;
        }
        [place.min(self.length), speed]
    }
}

/// The phases that bring a move with this place and speed to rest at its end.
fn to_the_end(rest: f64, speed: f64, most: f64, acceleration: f64) -> Vec<Phase> {
    let braking = |from: f64, to: f64| Phase { seconds: (from - to) / acceleration, acceleration: -acceleration };
    let distance = |a: f64, b: f64| (a * a - b * b).abs() / (2.0 * acceleration);
    let mut phases = Vec::with_capacity(3);
    let peak = if speed > most {
        phases.push(braking(speed, most));
        most
    } else {
        let peak = (acceleration * rest + 0.5 * speed * speed).max(0.0).sqrt().min(most).max(speed);
        phases.push(Phase { seconds: (peak - speed) / acceleration, acceleration });
        peak
    };
    let cruise = rest - distance(peak, speed) - distance(peak, 0.0);
    if cruise > 0.0 && peak > 0.0 {
        phases.push(Phase { seconds: cruise / peak, acceleration: 0.0 });
    }
    phases.push(braking(peak, 0.0));
    phases
}

/// A queue of moves, and the mechanism that makes them.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    /// Time in ns since power on.
    now: u64,
    /// Moves that it holds at most, the one under way among them.
    capacity: usize,
    moves: VecDeque<Move>,
    under_way: Option<Profile>,
    held: bool,
    /// Factors of the speed, of ordinary and of rapid moves.
    factors: [f64; 2],
    pencil: Pencil,
}

impl Motion {
    /// At rest at (0, 0, 0).
    pub(super) fn new(capacity: usize, pencil: Pencil) -> Self {
        Self { now: 0, capacity, moves: VecDeque::new(), under_way: None, held: false, factors: [1.0; 2], pencil }
    }

    /// Time in ns since power on.
    pub(super) fn now(&self) -> u64 {
        self.now
    }

    /// Moves that there is room for.
    pub(super) fn room(&self) -> usize {
        self.capacity.saturating_sub(self.moves.len())
    }

    /// Whether no move is left.
    pub(super) fn is_done(&self) -> bool {
        self.moves.is_empty()
    }

    /// Whether it moves at this moment.
    pub(super) fn is_moving(&self) -> bool {
        self.under_way.is_some()
    }

    /// Adds a move behind all others. The caller has looked for [`room`](Self::room).
    pub(super) fn push(&mut self, next: Move) {
        self.moves.push_back(next);
        self.start(self.now);
    }

    /// Where it is, in mm of the mechanism.
    pub(super) fn position(&self) -> DVec3 {
        match (&self.under_way, self.moves.front()) {
            (Some(profile), Some(front)) if profile.length > 0.0 => {
                profile.from.lerp(front.target, profile.at(self.now)[0] / profile.length)
            }
            _ => self.pencil.at(),
        }
    }

    /// Where the last of its moves ends.
    pub(super) fn planned(&self) -> DVec3 {
        self.moves.back().map_or_else(|| self.pencil.at(), |last| last.target)
    }

    /// Its speed in mm/s.
    pub(super) fn speed(&self) -> f64 {
        self.under_way.as_ref().map_or(0.0, |profile| profile.at(self.now)[1])
    }

    /// When the move under way ends, or rests for a hold.
    pub(super) fn next_event(&self) -> u64 {
        self.under_way.as_ref().map_or(u64::MAX, |profile| profile.ends)
    }

    /// Lets time come to `now`.
    pub(super) fn advance(&mut self, now: u64) {
        while let Some(ends) = self.under_way.as_ref().map(|profile| profile.ends).filter(|ends| *ends <= now) {
            self.now = ends;
            if self.held {
                self.pencil.go(self.position());
                self.under_way = None;
            } else {
                self.under_way = None;
                if let Some(done) = self.moves.pop_front() {
                    self.pencil.go(done.target);
                }
                self.start(ends);
            }
        }
        self.now = now;
    }

    /// Begins the first move, if none is under way.
    fn start(&mut self, now: u64) {
        if self.held || self.under_way.is_some() {
            return;
        }
        while let Some(front) = self.moves.front() {
            let (from, target) = (self.pencil.at(), front.target);
            let length = from.distance(target);
            if length > 0.0 {
                let phases = to_the_end(length, 0.0, self.most(front), front.acceleration);
                self.under_way = Some(Profile::new(from, length, now, [0.0; 2], phases));
                return;
            }
            self.moves.pop_front();
        }
    }

    fn most(&self, of: &Move) -> f64 {
        (of.speed * self.factors[usize::from(of.rapid)]).max(SLOWEST)
    }

    /// Plans the rest of the move under way anew, from where it is.
    fn plan_again(&mut self) {
        let (Some(profile), Some(front)) = (&self.under_way, self.moves.front()) else { return };
        let [place, speed] = profile.at(self.now);
        let phases = if self.held {
            vec![Phase { seconds: speed / front.acceleration, acceleration: -front.acceleration }]
        } else {
            to_the_end(profile.length - place, speed, self.most(front), front.acceleration)
        };
        self.under_way = Some(Profile::new(profile.from, profile.length, self.now, [place, speed], phases));
    }

    /// Comes to rest as soon as it can, and stays there.
    pub(super) fn hold(&mut self) {
        if !self.held {
            self.held = true;
            self.plan_again();
        }
    }

    /// Goes on after a hold.
    pub(super) fn resume(&mut self) {
        if self.held {
            self.held = false;
            self.plan_again();
            self.start(self.now);
        }
    }

    /// Whether it is held, at rest or on the way there.
    pub(super) fn is_held(&self) -> bool {
        self.held
    }

    /// Moves at these parts of the speed from now on: ordinary and rapid moves.
    pub(super) fn set_factors(&mut self, factors: [f64; 2]) {
        self.factors = factors;
        if !self.held {
            self.plan_again();
        }
    }

    /// Stops dead and forgets all moves. Motors that are stopped in motion lose steps: the mechanism runs on for a quarter of the way that
    /// braking takes. The place at which it stopped, as the controller counts.
    pub(super) fn abort(&mut self) -> DVec3 {
        let at = self.position();
        self.pencil.go(at);
        if let (Some(profile), Some(front)) = (self.under_way.take(), self.moves.front()) {
            let [place, speed] = profile.at(self.now);
            let slip = (speed * speed / (8.0 * front.acceleration)).min(profile.length - place);
            let along = (front.target - profile.from) / profile.length;
            self.pencil.go(at + along * slip);
        }
        self.moves.clear();
        self.held = false;
        at
    }

    /// Raises or lowers a pen at once, wherever it is.
    pub(super) fn set_pen_down(&mut self, down: bool) {
        self.pencil.go(self.position());
        self.pencil.set_down(down);
    }

    /// Puts another pen into the holder.
    pub(super) fn take_pen(&mut self, pen: u32) {
        self.pencil.take(pen);
    }

    /// All that was drawn up to now.
    pub(super) fn recording(&self, lost_bytes: u32) -> Recording {
        self.pencil.recording(self.position(), self.now as f64 / NS_PER_S, lost_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion() -> Motion {
        Motion::new(3, Pencil::new(Sense::Told, DVec3::splat(80.0)))
    }

    fn to(x: f64) -> Move {
        Move { target: DVec3::new(x, 0.0, 0.0), speed: 100.0, acceleration: 1000.0, rapid: false }
    }

    /// Lets time come to the next event, and tells it in s.
    fn next(motion: &mut Motion) -> f64 {
        let at = motion.next_event();
        motion.advance(at);
        at as f64 / NS_PER_S
    }

    #[test]
    fn moves_take_their_time_and_end_exactly() {
        let mut m = motion();
        m.push(to(100.0));
        m.push(to(97.5));
        m.push(to(97.5));
        assert_eq!(m.room(), 0);
        // 100 mm at 100 mm/s, and 0.1 s for speeding up and braking.
        assert!((next(&mut m) - 1.1).abs() < 1e-8);
        assert_eq!(m.position(), DVec3::new(100.0, 0.0, 0.0));
        // 2.5 mm: half of it at 1000 mm/s² takes 50 ms. The move to where it is takes none.
        assert!((next(&mut m) - 1.2).abs() < 1e-8);
        assert_eq!((m.position().x, m.is_done(), m.next_event()), (97.5, true, u64::MAX));
    }

    #[test]
    fn a_hold_brakes_and_a_resumed_move_ends_where_it_should() {
        let mut m = motion();
        m.push(to(100.0));
        m.advance(500_000_000);
        let before = m.position().x;
        m.hold();
        next(&mut m);
        assert!((m.position().x - before - 5.0).abs() < 1e-6 && !m.is_moving() && !m.is_done());
        assert_eq!(m.next_event(), u64::MAX);
        m.resume();
        next(&mut m);
        assert_eq!(m.position().x, 100.0);
    }

    #[test]
    fn a_hold_that_is_resumed_while_it_brakes_loses_nothing() {
        let mut m = motion();
        m.push(to(100.0));
        m.advance(500_000_000);
        m.hold();
        m.advance(520_000_000);
        m.resume();
        assert!((m.speed() - 80.0).abs() < 1e-6);
        next(&mut m);
        assert_eq!(m.position().x, 100.0);
    }

    #[test]
    fn the_speed_can_change_on_the_way() {
        for factor in [0.5, 2.0] {
            let mut m = motion();
            m.push(to(100.0));
            m.advance(500_000_000);
            let before = m.position().x;
            m.set_factors([factor, 1.0]);
            assert_eq!(m.position().x, before);
            m.advance(700_000_000);
            assert!((m.speed() - 100.0 * factor).abs() < 1e-6, "{}", m.speed());
            next(&mut m);
            assert_eq!(m.position().x, 100.0);
        }
    }

    #[test]
    fn motors_that_are_stopped_in_motion_run_on() {
        let mut m = motion();
        m.push(to(100.0));
        m.advance(500_000_000);
        let counted = m.abort();
        assert!((m.position().x - counted.x - 1.25).abs() < 1e-6);
        assert!(m.is_done() && m.next_event() == u64::MAX);
        let counted = m.abort();
        assert_eq!(counted, m.position());
    }

    #[test]
    fn a_pen_that_moves_too_early_leaves_its_ink_there() {
        let mut m = motion();
        m.push(to(100.0));
        m.advance(550_000_000);
        m.set_pen_down(true);
        next(&mut m);
        m.set_pen_down(false);
        let recording = m.recording(0);
        assert!((recording.ink_mm() - 50.0).abs() < 1e-6, "{} mm", recording.ink_mm());
    }
}

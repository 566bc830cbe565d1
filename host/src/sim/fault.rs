//! Faults by name: what goes wrong on a simulated line and with the plotter behind it.

use std::fmt;
use std::str::FromStr;

use fastrand::Rng;
use thiserror::Error;

use super::peer::{Peer, Trouble};

const NS_PER_MS: u64 = 1_000_000;
const NS_PER_S: u64 = 1_000_000_000;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// A byte on its way to the plotter is lost.
    Lost,
    /// A byte on its way to the plotter arrives twice.
    Doubled,
    /// A byte on its way to the plotter arrives as another one.
    Corrupted,
    /// A byte from the plotter is lost.
    LostAnswer,
    /// A byte from the plotter arrives twice.
    DoubledAnswer,
    /// A byte from the plotter arrives as another one.
    CorruptedAnswer,
    /// An acknowledgement, and all that follows it, arrives up to 20 s late.
    DelayedOk,
    /// An acknowledgement never arrives.
    MissingOk,
    /// The plotter refuses a line with which nothing is wrong.
    Error,
    /// A limit switch is hit in motion.
    Alarm,
    /// The plotter's power drops for a moment, in motion.
    Reset,
    /// The cable is pulled out.
    Unplug,
    /// The plotter freezes, or goes on but answers nothing, or takes no more bytes.
    Stall,
    /// Somebody holds the plotter to change its pen, and lets it go on up to two minutes later.
    PenChange,
}

/// What the place of a fault is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Count {
    Sent,
    Answered,
    Acknowledged,
}

/// All faults: name, kind, what the place is counted in.
const FAULTS: [(&str, FaultKind, Count); 14] = [
    ("lost", FaultKind::Lost, Count::Sent),
    ("doubled", FaultKind::Doubled, Count::Sent),
    ("corrupted", FaultKind::Corrupted, Count::Sent),
    ("lost-answer", FaultKind::LostAnswer, Count::Answered),
    ("doubled-answer", FaultKind::DoubledAnswer, Count::Answered),
    ("corrupted-answer", FaultKind::CorruptedAnswer, Count::Answered),
    ("delayed-ok", FaultKind::DelayedOk, Count::Acknowledged),
    ("missing-ok", FaultKind::MissingOk, Count::Acknowledged),
    ("error", FaultKind::Error, Count::Sent),
    ("alarm", FaultKind::Alarm, Count::Sent),
    ("reset", FaultKind::Reset, Count::Sent),
    ("unplug", FaultKind::Unplug, Count::Sent),
    ("stall", FaultKind::Stall, Count::Sent),
    ("pen-change", FaultKind::PenChange, Count::Sent),
];

impl FaultKind {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        FAULTS.iter().map(|(_, kind, _)| *kind)
    }

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        FAULTS.iter().find(|(_, kind, _)| *kind == self).map_or("", |(name, ..)| name)
    }

    fn count(self) -> Count {
        FAULTS.iter().find(|(_, kind, _)| *kind == self).map_or(Count::Sent, |(.., count)| *count)
    }
}

/// A fault as it is asked for: `NAME` or `NAME@N`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// Where, counted from 1: bytes sent to the plotter; for `…-answer`, bytes from it; for `…-ok`, acknowledgements. None: by the seed.
    pub at: Option<u64>,
}

/// A fault that there is not.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FaultError {
    /// No such name.
    #[error("--fault: there is no fault `{name}`; it is one of {}", FAULTS.map(|(name, ..)| name).join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// No such place.
    #[error("--fault {name}@{place}: the place is a number from 1")]
    Place {
        /// The fault.
        name: String,
        /// The place asked for.
        place: String,
    },
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (name, place) = text.split_once('@').map_or((text, None), |(name, place)| (name, Some(place)));
        let known = FAULTS.iter().find(|(known, ..)| *known == name);
        let (_, kind, _) = known.ok_or_else(|| FaultError::Unknown { name: name.to_owned() })?;
        let at = match place {
            None => None,
            Some(place) => {
                let bad = || FaultError::Place { name: name.to_owned(), place: place.to_owned() };
                Some(place.parse().ok().filter(|n| *n > 0).ok_or_else(bad)?)
            }
        };
        Ok(Self { kind: *kind, at })
    }
}

/// How much has gone over a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Bytes to the plotter.
    pub sent: u64,
    /// Bytes from it.
    pub answered: u64,
    /// Acknowledgements from it, whole.
    pub acknowledged: u64,
}

impl Traffic {
    fn of(self, count: Count) -> u64 {
        match count {
            Count::Sent => self.sent,
            Count::Answered => self.answered,
            Count::Acknowledged => self.acknowledged,
        }
    }
}

/// A fault that has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Struck {
    /// What went wrong.
    pub kind: FaultKind,
    /// Where, as in [`Fault::at`].
    pub at: u64,
    /// When, in ns since power on.
    pub time: u64,
}

impl fmt::Display for Struck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{} at {:.3} s", self.kind.name(), self.at, self.time as f64 / NS_PER_S as f64)
    }
}

/// A fault with its place.
#[derive(Clone, Copy, Debug)]
struct Planned {
    kind: FaultKind,
    at: u64,
    /// When it strikes, once its place is reached, ns. The place was reached when it is set.
    due: Option<u64>,
    over: bool,
}

/// What a port does from now on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Broken {
    #[default]
    Not,
    /// Reads and writes are a broken pipe.
    Pipe,
    /// Reads and writes give nothing: the way some systems show an unplugged device.
    Nothing,
    /// Nothing comes from the plotter.
    Mute,
    /// No byte is taken.
    Full,
}

/// The faults of a line.
#[derive(Clone, Debug)]
pub struct Faults {
    planned: Vec<Planned>,
    rng: Rng,
    pub(super) traffic: Traffic,
    pub(super) broken: Broken,
    struck: Vec<Struck>,
    /// Bytes of an answer that may be an acknowledgement, with the times of their arrival.
    answer: Vec<(u64, u8)>,
    /// Nothing arrives from the plotter before this time, ns.
    late_until: u64,
}

impl Default for Faults {
    fn default() -> Self {
        Self::new(&[], 0, Traffic::default())
    }
}

impl Faults {
    /// These faults, at places that the seed decides where none is given: within the traffic that is expected.
    #[must_use]
    pub fn new(faults: &[Fault], seed: u64, expected: Traffic) -> Self {
        let mut rng = Rng::with_seed(seed);
        let planned = faults
            .iter()
            .map(|fault| {
                let drawn = rng.u64(1..=expected.of(fault.kind.count()).max(1));
                Planned { kind: fault.kind, at: fault.at.unwrap_or(drawn), due: None, over: false }
            })
            .collect();
        Self {
            planned,
            rng,
            traffic: Traffic::default(),
            broken: Broken::Not,
            struck: Vec::new(),
            answer: Vec::new(),
            late_until: 0,
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.planned.is_empty()
    }

    /// The faults that have happened, in the order of time.
    #[must_use]
    pub fn struck(&self) -> &[Struck] {
        &self.struck
    }

    /// Takes the fault of the kind whose place in the traffic is this one.
    fn strikes(&mut self, kinds: &[FaultKind], time: u64) -> Option<FaultKind> {
        let traffic = self.traffic;
        let planned = self.planned.iter_mut().find(|planned| {
            !planned.over && kinds.contains(&planned.kind) && planned.at == traffic.of(planned.kind.count())
        })?;
        planned.over = true;
        self.struck.push(Struck { kind: planned.kind, at: planned.at, time });
        Some(planned.kind)
    }

    fn other_than(&mut self, byte: u8) -> u8 {
        // Noise on a line turns one bit, mostly.
        let mask = if self.rng.u8(0..4) > 0 { 1 << self.rng.u8(0..8) } else { self.rng.u8(1..) };
        byte ^ mask
    }

    /// A byte goes to the plotter: what arrives there.
    pub(super) fn arrives_at_plotter(&mut self, byte: u8, now: u64) -> ([u8; 2], usize) {
        self.traffic.sent += 1;
        let arrived = match self.strikes(&[FaultKind::Lost, FaultKind::Doubled, FaultKind::Corrupted], now) {
            Some(FaultKind::Lost) => ([0; 2], 0),
            Some(FaultKind::Doubled) => ([byte; 2], 2),
            Some(_) => ([self.other_than(byte), 0], 1),
            None => ([byte, 0], 1),
        };
        let sent = self.traffic.sent;
        for planned in &mut self.planned {
            let waits = !planned.over && planned.due.is_none() && planned.kind.count() == Count::Sent;
            if waits && planned.at <= sent {
                let delay = match planned.kind {
                    // In motion: so let some of it begin.
                    FaultKind::Alarm | FaultKind::Reset => self.rng.u64(0..500 * NS_PER_MS),
                    _ => 0,
                };
                planned.due = Some(now.saturating_add(delay));
            }
        }
        arrived
    }

    /// When the next fault of those whose place is reached strikes.
    pub(super) fn next_due(&self) -> u64 {
        self.planned.iter().filter(|planned| !planned.over).filter_map(|planned| planned.due).min().unwrap_or(u64::MAX)
    }

    /// Lets faults strike that are due.
    pub(super) fn strike(&mut self, peer: &mut dyn Peer, now: u64) {
        for planned in &mut self.planned {
            if planned.over || planned.due.is_none_or(|due| due > now) {
                continue;
            }
            if matches!(planned.kind, FaultKind::Alarm | FaultKind::Reset) && !peer.is_moving() {
                planned.due = Some(now.saturating_add(10 * NS_PER_MS));
                continue;
            }
            planned.over = true;
            self.struck.push(Struck { kind: planned.kind, at: planned.at, time: now });
            match planned.kind {
                FaultKind::Error => peer.suffer(Trouble::Error),
                FaultKind::Alarm => peer.suffer(Trouble::Alarm),
                FaultKind::Reset => peer.suffer(Trouble::Reset),
                FaultKind::PenChange => peer.suffer(Trouble::PenChange { ns: self.rng.u64(NS_PER_S..120 * NS_PER_S) }),
                FaultKind::Unplug => self.broken = if self.rng.bool() { Broken::Pipe } else { Broken::Nothing },
                FaultKind::Stall => match self.rng.u8(0..3) {
                    0 => peer.suffer(Trouble::Hang),
                    1 => self.broken = Broken::Mute,
                    _ => self.broken = Broken::Full,
                },
                // These strike where a byte goes by.
                FaultKind::Lost
                | FaultKind::Doubled
                | FaultKind::Corrupted
                | FaultKind::LostAnswer
                | FaultKind::DoubledAnswer
                | FaultKind::CorruptedAnswer
                | FaultKind::DelayedOk
                | FaultKind::MissingOk => {}
            }
        }
    }

    /// A byte comes from the plotter and arrives at this time (ns): what is added to the inbox.
    pub(super) fn comes_from_plotter(
        &mut self,
        byte: u8,
        arrival: u64,
        peer: &dyn Peer,
        inbox: &mut impl Extend<(u64, u8)>,
    ) {
        self.traffic.answered += 1;
        let kinds = [FaultKind::LostAnswer, FaultKind::DoubledAnswer, FaultKind::CorruptedAnswer];
        let (bytes, count) = match self.strikes(&kinds, arrival) {
            Some(FaultKind::LostAnswer) => ([0; 2], 0),
            Some(FaultKind::DoubledAnswer) => ([byte; 2], 2),
            Some(_) => ([self.other_than(byte), 0], 1),
            None => ([byte, 0], 1),
        };
        self.answer.extend(bytes.iter().take(count).map(|byte| (arrival, *byte)));
        let text: Vec<u8> = self.answer.iter().map(|(_, byte)| *byte).collect();
        let whole = peer.is_whole_answer(&text);
        // What can become no acknowledgement any more is let through.
        if !whole && peer.begins_acknowledgement(&text) {
            return;
        }
        let mut answer = std::mem::take(&mut self.answer);
        if whole && peer.begins_acknowledgement(&text) {
            self.traffic.acknowledged += 1;
            match self.strikes(&[FaultKind::DelayedOk, FaultKind::MissingOk], arrival) {
                Some(FaultKind::MissingOk) => answer.clear(),
                Some(_) => self.late_until = arrival.saturating_add(self.rng.u64(NS_PER_S..20 * NS_PER_S)),
                None => {}
            }
        }
        if self.broken != Broken::Mute {
            let late = self.late_until;
            inbox.extend(answer.into_iter().map(|(at, byte)| (at.max(late), byte)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_named() {
        for kind in FaultKind::all() {
            assert_eq!(kind.name().parse(), Ok(Fault { kind, at: None }));
        }
        assert_eq!("reset@12".parse(), Ok(Fault { kind: FaultKind::Reset, at: Some(12) }));
        for (text, part) in
            [("lots", "there is no fault `lots`; it is one of lost, "), ("lost@0", "--fault lost@0"), ("lost@x", "@x")]
        {
            let message = text.parse::<Fault>().unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn a_seed_decides_the_place() {
        let expected = Traffic { sent: 1000, answered: 100, acknowledged: 10 };
        let places = |seed| {
            let faults: Vec<_> = FaultKind::all().map(|kind| Fault { kind, at: None }).collect();
            Faults::new(&faults, seed, expected).planned.iter().map(|p| p.at).collect::<Vec<_>>()
        };
        assert_eq!(places(1), places(1));
        assert_ne!(places(1), places(2));
        for (kind, at) in FaultKind::all().zip(places(3)) {
            assert!((1..=expected.of(kind.count())).contains(&at));
        }
    }
}

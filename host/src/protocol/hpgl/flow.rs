//! How much may be sent now: what the handshakes come to.

use std::time::Duration;

use crate::device::Handshake;

/// Bytes of the buffer that stay free, for a question where the plotter is (6 bytes), and repetitions of it (3 each).
pub(crate) const RESERVE: usize = 16;
/// Fewer free bytes than this might be an answer to `OE;`: where `ESC.B` is asked there are more.
pub(super) const FREE_MIN: usize = 9;
/// Most bytes that may wait in the port itself where the plotter stops the line: they come after it has said so.
const AHEAD_MAX: usize = 32;
/// Most bytes of a block, and free bytes at which the plotter stops the line.
const BLOCK_MAX: usize = 512;
/// Bits of a byte on the line.
const BITS: f64 = 10.0;

/// What an answer to `ESC.B` comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Free {
    /// More is free than was known.
    More,
    /// More may be free; the next answer decides.
    Unconfirmed,
    /// No more is free than was known.
    Same,
}

/// Bytes on their way to a plotter.
#[derive(Debug)]
pub(super) struct Flow {
    /// Which handshake is spoken. Never the automatic one.
    pub(super) handshake: Handshake,
    /// Size of the buffer in bytes.
    pub(super) buffer: usize,
    /// Bytes that were sent, and those of them that have left the buffer for certain.
    sent: u64,
    consumed: u64,
    /// Bytes that have left the buffer as the last `ESC.B` told.
    told: u64,
    /// The plotter said that it takes no more (Xoff).
    pub(super) stopped: bool,
    /// What the plotter's own line says, if that is looked at.
    pub(super) ready: Option<bool>,
    /// Bytes that the plotter has room for, as it said.
    granted: usize,
    /// When all bytes are through the line.
    through: Duration,
    baud: u32,
}

impl Flow {
    pub(super) fn new(buffer: usize, baud: u32) -> Self {
        Self {
            handshake: Handshake::Oa,
            buffer,
            sent: 0,
            consumed: 0,
            told: 0,
            stopped: false,
            ready: None,
            granted: 0,
            through: Duration::ZERO,
            baud: baud.max(1),
        }
    }

    /// Bytes that were sent in all.
    pub(super) fn sent(&self) -> u64 {
        self.sent
    }

    /// Bytes of a block, which is also the room at which the plotter stops the line.
    pub(super) fn block(&self) -> usize {
        (self.buffer / 2).clamp(1, BLOCK_MAX)
    }

    /// Whether so many bytes may be sent now. `within` is whether they go on with an instruction in the middle of which no
    /// question can be put: then a plotter that stops the line itself is trusted. Else what was sent and is not known to be
    /// out of the buffer never exceeds it, so that a lost Xoff does no harm.
    pub(super) fn may_send(&self, bytes: usize, within: bool, now: Duration) -> bool {
        let counted = self.has_room(bytes);
        let paced =
            self.through.saturating_sub(now).as_secs_f64() <= self.seconds((self.block() / 4).min(AHEAD_MAX) as f64);
        match self.handshake {
            Handshake::XonXoff => !self.stopped && paced && (counted || within),
            Handshake::EnqAck => bytes <= self.granted && (counted || within),
            Handshake::Hardware => self.ready == Some(true) && paced && (counted || within),
            Handshake::EscB | Handshake::Oa | Handshake::Auto => counted && self.ready != Some(false),
        }
    }

    /// Whether so many bytes fit into what is known to be free.
    pub(super) fn has_room(&self, bytes: usize) -> bool {
        self.on_the_way().saturating_add(bytes) <= self.buffer.saturating_sub(RESERVE)
    }

    /// Bytes that were sent and may still be in the buffer.
    fn on_the_way(&self) -> usize {
        usize::try_from(self.sent - self.consumed).unwrap_or(usize::MAX)
    }

    /// Whether a question of so many bytes may be put once more. Where `ESC.B` tells the room, that will show; else what is known
    /// to be free may be all too little, as the answer that would have told was lost.
    pub(super) fn may_repeat(&self, bytes: usize) -> bool {
        self.handshake != Handshake::EscB || self.on_the_way().saturating_add(bytes + FREE_MIN) <= self.buffer
    }

    /// So many bytes go out.
    pub(super) fn send(&mut self, bytes: usize, now: Duration) {
        self.sent += bytes as u64;
        self.granted = self.granted.saturating_sub(bytes);
        self.through = self.through.max(now) + self.time_of(bytes);
    }

    /// Time that is left until all bytes are through the line.
    pub(super) fn backlog(&self, now: Duration) -> Duration {
        self.through.saturating_sub(now)
    }

    /// Time that so many bytes take on the line.
    pub(super) fn time_of(&self, bytes: usize) -> Duration {
        Duration::from_secs_f64(self.seconds(bytes as f64))
    }

    fn seconds(&self, bytes: f64) -> f64 {
        bytes * BITS / f64::from(self.baud)
    }

    /// The bytes up to this count have left the buffer. True if that was not known.
    pub(super) fn consume(&mut self, up_to: u64) -> bool {
        let new = up_to.min(self.sent) > self.consumed;
        self.consumed = self.consumed.max(up_to.min(self.sent));
        if self.consumed == self.sent {
            // An Xon or an acknowledgement that was lost is no longer needed.
            self.stopped = false;
            self.granted = self.granted.max(self.block());
        }
        new
    }

    /// So many bytes were free behind the bytes up to this count. Two answers in a row must agree, for a digit that the line
    /// has changed would let the buffer overflow: the smaller one counts.
    pub(super) fn free(&mut self, free: usize, sent: u64) -> Free {
        let held = self.buffer.saturating_sub(free) as u64;
        let told = sent.saturating_sub(held);
        let sure = told.min(self.told);
        self.told = told;
        if self.consume(sure) {
            Free::More
        } else if told > self.consumed {
            Free::Unconfirmed
        } else {
            Free::Same
        }
    }

    /// Bytes that the plotter has granted.
    pub(super) fn granted(&self) -> usize {
        self.granted
    }

    /// The plotter has room for a block.
    pub(super) fn grant(&mut self) {
        self.granted = self.block();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flow(handshake: Handshake) -> Flow {
        Flow { handshake, ..Flow::new(100, 9600) }
    }

    #[test]
    fn what_is_not_out_of_the_buffer_counts() {
        for handshake in [Handshake::EscB, Handshake::Oa] {
            let mut flow = flow(handshake);
            assert!(flow.may_send(84, false, Duration::ZERO) && !flow.may_send(85, false, Duration::ZERO));
            flow.send(84, Duration::ZERO);
            assert!(!flow.may_send(1, false, Duration::ZERO));
            assert_eq!(flow.free(38, 84), Free::Unconfirmed);
            assert_eq!(flow.free(90, 84), Free::More, "what both tell");
            assert!(flow.may_send(22, false, Duration::ZERO) && !flow.may_send(23, false, Duration::ZERO));
            assert_eq!((flow.free(38, 84), flow.free(38, 84)), (Free::Same, Free::Same));
            assert!(flow.may_repeat(29) && flow.may_repeat(30) == (handshake == Handshake::Oa));
            assert!(flow.consume(84) && flow.may_send(84, false, Duration::ZERO));
        }
    }

    #[test]
    fn a_line_that_the_plotter_stops_is_not_filled_ahead() {
        let mut flow = flow(Handshake::XonXoff);
        flow.send(50, Duration::ZERO);
        assert!(!flow.may_send(1, false, Duration::ZERO));
        assert!(flow.may_send(1, false, Duration::from_millis(45)));
        flow.stopped = true;
        assert!(!flow.may_send(1, false, Duration::from_secs(1)));
        flow.consume(50);
        assert!(flow.may_send(1, false, Duration::from_secs(1)), "an empty buffer needs no Xon");
        let mut flow = Flow { ready: Some(false), ..self::flow(Handshake::Hardware) };
        assert!(!flow.may_send(1, false, Duration::ZERO));
        flow.ready = Some(true);
        assert!(flow.may_send(1, false, Duration::ZERO));
    }

    #[test]
    fn blocks_are_granted() {
        let mut flow = flow(Handshake::EnqAck);
        assert!(!flow.may_send(1, false, Duration::ZERO));
        flow.grant();
        assert!(flow.may_send(50, false, Duration::ZERO) && !flow.may_send(51, false, Duration::ZERO));
        flow.send(50, Duration::ZERO);
        assert!(!flow.may_send(1, false, Duration::ZERO));
    }

    #[test]
    fn a_lost_xoff_does_no_harm() {
        let mut flow = flow(Handshake::XonXoff);
        let later = Duration::from_secs(9);
        flow.send(84, Duration::ZERO);
        assert!(!flow.may_send(3, false, later));
        assert!(flow.may_send(3, true, later), "a label can only be sent on");
    }
}

//! The conversation that sends the rest of a job, in the numbers of the whole one.

use std::time::Duration;

use super::Rest;
use crate::protocol::{Control, Event, Outbox, Place, Progress, Protocol};

/// Sends the rest of a job. Messages name pieces as the whole job counts them; progress stays in pieces of what is sent.
///
/// For languages whose pieces are counted as they come. Lines of G-code have their own numbers.
pub struct Renumbered {
    inner: Box<dyn Protocol>,
    added: usize,
    skipped: usize,
}

impl Renumbered {
    /// Renumbers a conversation that sends `rest`.
    #[must_use]
    pub fn new(inner: Box<dyn Protocol>, rest: &Rest) -> Self {
        Self { inner, added: rest.added, skipped: rest.skipped }
    }

    /// From the number of a piece that is sent to that of the whole job.
    fn number(&self, sent: usize) -> usize {
        // Those that set the state are counted with the first that is sent again.
        if sent == 0 { 0 } else { self.skipped + sent.saturating_sub(self.added).max(1) }
    }
}

impl Protocol for Renumbered {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        self.inner.receive(bytes, now);
    }

    fn tick(&mut self, now: Duration) {
        self.inner.tick(now);
    }

    fn outbox(&mut self) -> &mut Outbox {
        self.inner.outbox()
    }

    fn take_event(&mut self) -> Option<Event> {
        let mut event = self.inner.take_event();
        if let Some(Event::Failed(fault)) = &mut event {
            fault.renumber(&|sent| self.number(sent));
        }
        event
    }

    fn control(&mut self, control: Control, now: Duration) {
        self.inner.control(control, now);
    }

    fn progress(&self) -> Progress {
        self.inner.progress()
    }

    fn place(&self) -> Place {
        let mut place = self.inner.place();
        place.number = self.number(place.number);
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;
    use crate::protocol::{Fault, start};

    #[test]
    fn faults_name_pieces_of_the_whole() {
        let device = find("hp7475a").unwrap();
        let inner = start(b"IN;PU1,1;PD2,2;", &device, 9600).unwrap().protocol;
        let protocol = Renumbered::new(inner, &Rest { job: Vec::new(), added: 2, skipped: 40 });
        for (number, expected) in [(0, 0), (1, 41), (2, 41), (3, 41), (4, 42)] {
            assert_eq!(protocol.number(number), expected);
        }
        let mut fault = Fault::Astray { first: 3, last: 5, found: String::new(), wanted: String::new() };
        fault.renumber(&|sent| protocol.number(sent));
        assert!(matches!(fault, Fault::Astray { first: 41, last: 43, .. }), "{fault:?}");
    }
}

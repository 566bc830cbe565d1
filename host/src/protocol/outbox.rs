//! What a conversation has ready for its caller.

use std::collections::VecDeque;

use super::Event;

/// Bytes to be written and events, each in the order in which they were put in.
#[derive(Debug, Default)]
pub struct Outbox {
    bytes: Vec<u8>,
    events: VecDeque<Event>,
}

impl Outbox {
    /// Puts bytes behind the others.
    pub(crate) fn write(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Puts a line behind the others, with its end.
    pub(crate) fn line(&mut self, text: &str) {
        self.write(text.as_bytes());
        self.write(b"\n");
    }

    /// Puts an event behind the others.
    pub(crate) fn tell(&mut self, event: Event) {
        self.events.push_back(event);
    }

    /// Forgets the bytes that were not taken.
    pub(crate) fn discard_bytes(&mut self) {
        self.bytes.clear();
    }

    /// Takes all bytes; empty when there are none.
    pub fn take_bytes(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes)
    }

    /// Takes the oldest event; none when nothing has happened.
    pub fn take_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }
}

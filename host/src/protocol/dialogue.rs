//! Steps of conversations that the tests of all protocols share.

use std::time::Duration;

use super::{Event, Protocol};

/// Says something to the protocol one byte at a time, so that no border between reads matters.
pub(super) fn say(protocol: &mut dyn Protocol, text: &str, now: Duration) {
    for byte in text.bytes() {
        protocol.receive(&[byte], now);
    }
}

/// Lets so many ms pass, one by one; the time (ms) at their end.
pub(super) fn wait(protocol: &mut dyn Protocol, from: u64, ms: u64) -> u64 {
    for at in from + 1..=from + ms {
        protocol.tick(Duration::from_millis(at));
    }
    from + ms
}

/// The next event must be a failure whose message holds all of these words.
pub(super) fn assert_fails(protocol: &mut dyn Protocol, words: &[&str], step: usize) {
    match protocol.take_event() {
        Some(Event::Failed(fault)) => {
            let message = fault.to_string();
            for word in words {
                assert!(message.contains(word), "step {step}: {message:?} has no {word:?}");
            }
        }
        other => panic!("step {step}: {other:?}"),
    }
}

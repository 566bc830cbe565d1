//! Tests that need a program that may not be there.

use std::env;

/// Ends the test that needs `what` was not to be had, for `reason`: with a word if that is allowed, else with a failure.
///
/// # Panics
/// Where it is not possible although `PENVIS_REQUIRE_EMULATOR` is set.
pub fn skip(what: &str, reason: &str) {
    assert!(env::var_os("PENVIS_REQUIRE_EMULATOR").is_none(), "no {what}: {reason}");
    eprintln!("skipped, no {what}: {reason}");
}

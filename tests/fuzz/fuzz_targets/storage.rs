//! Fuzzes what the firmware finds in its memory, and cuts of the power while it writes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("storage", bytes));

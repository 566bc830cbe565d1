//! Fuzzes scenes packed for boards.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("packed", bytes));

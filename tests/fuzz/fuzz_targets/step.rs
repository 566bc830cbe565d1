//! Fuzzes boundary representations in STEP.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("step", bytes));

//! Fuzzes jobs for plotters, in G-code and in HPGL.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("job", bytes));

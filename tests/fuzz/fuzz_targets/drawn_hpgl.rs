//! Fuzzes the reader of HPGL as a drawing.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("drawn-hpgl", bytes));

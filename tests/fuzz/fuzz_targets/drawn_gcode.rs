//! Fuzzes the reader of G-code as a drawing.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("drawn-gcode", bytes));

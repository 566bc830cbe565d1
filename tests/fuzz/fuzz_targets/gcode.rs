//! Fuzzes the firmware with words of G-code and `$` commands.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("gcode", bytes));

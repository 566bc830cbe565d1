//! Fuzzes the reader of SVG.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("svg", bytes));

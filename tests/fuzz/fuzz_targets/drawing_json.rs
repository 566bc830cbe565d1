//! Fuzzes the reader of drawings in JSON.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("drawing-json", bytes));

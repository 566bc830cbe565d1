//! Fuzzes models in STL, text and binary.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("stl", bytes));

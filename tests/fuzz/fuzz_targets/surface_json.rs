//! Fuzzes models in surface JSON.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("surface-json", bytes));

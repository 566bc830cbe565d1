//! Fuzzes models in ITD, the data trees of IRIT.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("itd", bytes));

//! Fuzzes journals of unfinished plots.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("journal", bytes));

//! Fuzzes models in BPT, lists of Bézier patches.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("bpt", bytes));

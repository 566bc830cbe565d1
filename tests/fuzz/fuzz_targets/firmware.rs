//! Fuzzes what the firmware hears on its line.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("firmware", bytes));

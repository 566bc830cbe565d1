//! Fuzzes what the firmware hears as HPGL.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("hpgl", bytes));

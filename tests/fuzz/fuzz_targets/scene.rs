//! Fuzzes scenes in TOML. Fed from memory they refer to no files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("scene", bytes));

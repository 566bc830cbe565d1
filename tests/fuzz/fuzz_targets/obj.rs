//! Fuzzes models in OBJ, with polygons and free-form surfaces.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| penvis_tests::feed::feed("obj", bytes));

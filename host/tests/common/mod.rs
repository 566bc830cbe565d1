//! Running the binary.
#![allow(dead_code, reason = "each test file is a crate of its own and uses its own part of this")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// Runs penvis in a folder.
pub(crate) fn penvis(folder: &Path, words: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_penvis")).args(words.split_whitespace()).current_dir(folder).output().unwrap()
}

/// Names of the files that are there, but for the model.
pub(crate) fn files(folder: &TempDir) -> Vec<String> {
    let names = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.filter(|name| name != "model.json").collect();
    names.sort();
    names
}

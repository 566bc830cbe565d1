//! The `penvis` command.
fn main() {}

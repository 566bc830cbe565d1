//! Reads models, computes drawings, writes them, and streams them to a plotter.
pub mod builtin;
pub mod command;
pub mod device;
pub mod drawing;
pub mod emit;
pub mod model;
pub mod page;
pub mod protocol;
pub mod sim;
pub mod stream;

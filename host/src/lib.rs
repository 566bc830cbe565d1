//! Reads models, computes drawings, writes them, and streams them to a plotter.
//!
//! | module | does |
//! |---|---|
//! | [`cli`], [`options`], [`isocurves`] | the command line as typed, and what it means |
//! | [`style`], [`settle`] | what scenes and the command line ask for, and what comes of it |
//! | [`command`] | one module for each subcommand |
//! | [`model`], [`builtin`] | surfaces and a view, from files or by name |
//! | [`compute`] | runs the stages of the core, with their times in [`stats`] |
//! | [`page`], [`pens`], [`drawing`] | strokes on paper: scale, place, dashes, pens, order |
//! | [`fill`] | visible regions covered with lines |
//! | [`shadow`] | what is visible and not lit |
//! | [`marking`] | registration marks and a title on the sheet |
//! | [`redraw`] | a drawing from a file, drawn again |
//! | [`store`] | a scene with its drawing's options, for a board that draws it by itself |
//! | [`interrupt`] | Ctrl-C |
//! | [`emit`], [`output`] | SVG, G-code, HPGL, PNG and JSON, written whole or not at all |
//! | [`device`] | plotters as data |
//! | [`trace`], [`estimate`], `straight` | what a job does, piece by piece, and how long it and a drawing take |
//! | [`preflight`] | what would go wrong with a job, said before it is sent |
//! | [`protocol`], [`stream`], [`sim`] | a job on its way to a plotter, real or simulated |
//! | [`journal`], [`resume`] | what is drawn of an unfinished plot, on the disk, and what is left of it |
pub mod args;
pub mod builtin;
pub mod cli;
pub mod command;
pub mod compute;
pub mod device;
pub mod drawing;
pub mod emit;
pub mod error;
pub mod estimate;
pub mod fill;
pub mod interrupt;
pub mod isocurves;
pub mod journal;
pub mod marking;
mod message;
pub mod model;
pub mod options;
pub mod output;
pub mod page;
pub mod pens;
pub mod preflight;
pub mod progress;
pub mod protocol;
pub mod redraw;
pub mod regions;
pub mod render;
pub mod resume;
pub mod settle;
pub mod shadow;
pub mod sim;
pub mod stats;
pub mod store;
mod straight;
pub mod stream;
pub mod style;
pub mod trace;

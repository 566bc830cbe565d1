//! What crosses the crates of penvis: means to check the whole against something that shares no code with it.

pub mod agreement;
pub mod cover;
pub mod faults;
pub mod feed;
pub mod ink;
pub mod models;
pub mod oracle;
pub mod plotter;
pub mod raster;
pub mod regions;
pub mod shadow;
pub mod skip;
pub mod stages;
pub mod strokes;
pub mod subdivision;
pub mod views;

//! The curves of a surface that a drawing shows.

pub mod facing;
pub mod silhouette;
pub mod zero_set;

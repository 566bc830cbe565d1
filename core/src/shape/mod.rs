//! Exact constructors: curves, and planes, quadrics, tori, ruled surfaces, extrusions and solids of revolution.
//!
//! Conics are rational quadratics, so every point is on the true circle, cone or torus to rounding. Full and quarter
//! turns use no trigonometry at all.
//!
//! Conventions. In a surface of revolution u runs round the axis, counterclockwise seen from the tip of the axis, and v
//! along the profile; both from 0 to 1 unless said otherwise. Full turns have breaks at u = ¼, ½ and ¾. The normal
//! S_u × S_v points out of the closed shapes.

mod curves;
mod error;
mod frame;
mod revolution;
mod swept;

pub use curves::{arc, circle, line, polyline};
pub use error::ShapeError;
pub use frame::Frame;
pub use revolution::{annulus, cone, cylinder, disk, revolution, sphere, torus};
pub use swept::{extrusion, plane, ruled};

#[cfg(test)]
mod tests;

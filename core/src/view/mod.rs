//! The camera, and the scene as homogeneous Bézier patches seen along −z.
//!
//! A camera is a projective map that sends the eye to z = +∞. Rational surfaces are closed under such maps, so
//! perspective is exact: the homogeneous control points are transformed once, and every later stage sees an
//! orthographic scene in which *nearer* means *larger z*.

mod camera;
mod patch;
mod scene;

pub use camera::{Camera, CameraError};
pub use patch::{Jet, MAX_DEGREE, Patch};
pub(crate) use patch::{curve_jet, curve_point};
pub(crate) use patch::{halve_net, net_box, net_extent, net_jet};
pub use scene::{SurfaceGrid, ViewError, ViewScene};

//! Checked knot vectors, and rational B-spline curves and surfaces on them.
//!
//! Constructors check once: finite numbers, positive weights, knots that do not decrease, multiplicities that do not
//! tear the surface. What they return is legal, and no later operation can fail on it, except where it is told a
//! parameter outside the domain, a degree out of range, or a projective map that sends a part to infinity.
//!
//! Everything is computed in homogeneous coordinates with the weight multiplied in (x·w, y·w, z·w, w), where a rational
//! curve is a polynomial one in four dimensions, and by convex combinations of control points (blossoms whose arguments
//! stay in one span, Böhm's insertion), so that rounding is never amplified.
//!
//! Notation: degree p, knots t₀ ≤ … ≤ tₘ, control points d₀ … dₙ, m = n + p + 1, domain [tₚ, tₙ₊₁].

mod curve;
mod de_boor;
mod error;
mod knots;
mod lower;
mod nearest;
mod refine;
mod surface;
#[cfg(test)]
mod tests;

pub use curve::{BezierSegment, Curve};
pub use error::{Direction, NurbsError};
pub use knots::KnotVector;
pub use lower::{MAX_LOWERED_DEGREE, lowered_curve, lowered_surface};
pub use surface::{Surface, SurfaceJet};

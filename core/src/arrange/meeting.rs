//! What two arcs have in common on the screen.

/// A meeting of two arcs on the screen, by curve parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Meeting {
    /// They cross, or touch at an end.
    Crossing { a: f64, b: f64, za: f64, zb: f64 },
    /// They run within the resolution of each other over an interval of the first: coincident, or tangent.
    Overlap { a: [f64; 2], b: [f64; 2], za: f64, zb: f64 },
}

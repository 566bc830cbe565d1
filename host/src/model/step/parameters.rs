//! What the parameters of a file's surfaces are (ISO 10303-42, 4.4.68 to 4.4.77).

use std::f64::consts::TAU;

use glam::{DMat4, DVec2, DVec3};
use penvis_core::nurbs::Curve;
use penvis_core::shape::{self, Frame};

use super::units::{Units, matrix};

/// The parameters that a file's surface has.
#[derive(Clone, Copy, Debug)]
pub(super) enum Parameters {
    /// Those of the surface that is drawn.
    Own,
    /// Lengths along the x and y axes.
    Plane(Frame),
    /// The angle round the z axis, and the length along it; the radius grows with that by the slope. A cylinder if there is none.
    Cone { frame: Frame, radius: f64, slope: f64 },
    /// The angle round the z axis, and the one round the tube; a sphere if the axis is in the middle of the tube.
    Torus { frame: Frame, major: f64, minor: f64 },
    /// Others, by which no curve is read.
    Other,
}

/// How far the parameter of an isoparametric curve may change: what is left of fifteen digits.
const CONSTANT: f64 = 1e-9;

impl Parameters {
    /// The curve in space, in millimetres, over a curve in the file's parameters. None if there is none that is rational, or
    /// that is drawn: on what is round those over lines of constant parameters are.
    pub(super) fn lifted(&self, image: &Curve, units: &Units) -> Option<Curve> {
        if let Self::Plane(frame) = self {
            return image.transformed(matrix(frame) * DMat4::from_scale(DVec3::splat(units.length))).ok();
        }
        let (ends, constant) = isoparametric(image)?;
        match *self {
            Self::Own | Self::Plane(_) | Self::Other => None,
            Self::Cone { frame, radius, slope } => {
                let [a, b] = ends.map(|e| DVec2::new(e.x * units.angle, e.y * units.length));
                let at = |e: DVec2| {
                    let (sin, cos) = e.x.sin_cos();
                    let r = radius + slope * e.y;
                    matrix(&frame).transform_point3(DVec3::new(r * cos, r * sin, e.y))
                };
                if constant == 0 {
                    return shape::line(at(a), at(b)).ok();
                }
                ring(&frame, a.y, radius + slope * a.y, [a.x, b.x])
            }
            Self::Torus { frame, major, minor } => {
                let [a, b] = ends.map(|e| e * units.angle);
                if constant == 1 {
                    return ring(&frame, minor * a.y.sin(), major + minor * a.y.cos(), [a.x, b.x]);
                }
                let [x, y, z] = frame.axes();
                let out = x * a.x.cos() + y * a.x.sin();
                // Round the tube from its outer equator towards z.
                let tube = Frame::new(frame.origin() + out * major, out.cross(z), out).ok()?;
                ring(&tube, 0.0, minor, [a.y, b.y])
            }
        }
    }
}

/// The arc at a height of a frame, between two angles.
fn ring(frame: &Frame, height: f64, radius: f64, [from, to]: [f64; 2]) -> Option<Curve> {
    let [x, _, z] = frame.axes();
    let centre = Frame::new(frame.origin() + z * height, z, x).ok()?;
    let sweep = to - from;
    // A whole turn of rounded angles.
    let sweep = if (sweep.abs() - TAU).abs() <= CONSTANT * TAU { TAU.copysign(sweep) } else { sweep };
    shape::arc(&centre, radius, from, sweep).ok()
}

/// The ends of a curve of constant u or v that runs one way, and which of the two is constant.
fn isoparametric(image: &Curve) -> Option<([DVec2; 2], usize)> {
    let clamped = image.clamped();
    let points: Vec<DVec2> = clamped.homogeneous().iter().map(|h| DVec2::new(h.x, h.y) / h.w).collect();
    let (first, last) = (*points.first()?, *points.last()?);
    let constant = usize::from((last.x - first.x).abs() > (last.y - first.y).abs());
    let (length, rises) = ((last - first)[1 - constant].abs(), last[1 - constant] > first[1 - constant]);
    let is_line = points.iter().all(|p| (p[constant] - first[constant]).abs() <= CONSTANT * length)
        && points.windows(2).all(|w| (w[0][1 - constant] <= w[1][1 - constant]) == rises);
    is_line.then_some(([first, last], constant))
}

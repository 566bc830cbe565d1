//! A missile, as in Ruan, Zhang and Yong (2006, fig. 8): a body of revolution with two sets of four fins.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DMat4, DVec3, DVec4};
use penvis_core::scene::SceneSurface;

use super::turned::{arcs, spline, turn};
use super::{bezier, part};
use crate::model::View;

/// One fin, symmetric about a plane through the axis, with a rhombic section that tapers from root to tip.
struct Fin {
    name: &'static str,
    root: Section,
    tip: Section,
}

struct Section {
    /// Distance from the axis.
    radius: f64,
    /// Trailing edge, greatest thickness and leading edge, measured along the axis from the tail.
    along: [f64; 3],
    half_thickness: f64,
}

/// The roots lie inside the body, and inside the wall of the nozzle, so that no fin ends in the air.
const FINS: [Fin; 2] = [
    Fin {
        name: "tail fin",
        root: Section { radius: 0.34, along: [0.15, 0.7, 1.5], half_thickness: 0.045 },
        tip: Section { radius: 1.35, along: [0.0, 0.25, 0.6], half_thickness: 0.025 },
    },
    Fin {
        name: "wing",
        root: Section { radius: 0.42, along: [2.5, 3.2, 4.4], half_thickness: 0.05 },
        tip: Section { radius: 1.3, along: [2.6, 2.85, 3.2], half_thickness: 0.025 },
    },
];

/// The body is turned about the z axis; then all is laid down with the nose along +x.
pub(super) fn surfaces() -> Option<Vec<SceneSurface>> {
    const THROAT: (f64, f64) = (0.14, 0.5);
    const EXIT: (f64, f64) = (0.3, 0.0);
    const TAIL: (f64, f64) = (0.38, 0.0);
    const AFT: (f64, f64) = (0.5, 0.7);
    const SHOULDER: (f64, f64) = (0.5, 6.0);
    let bell = [THROAT, (0.17, 0.4), (0.25, 0.25), (0.29, 0.1), EXIT];
    let mut surfaces = vec![
        part("bulkhead", turn(&spline(&[(0.0, 0.5), THROAT])?)?),
        part("nozzle", turn(&spline(&bell)?)?),
        part("exit", turn(&spline(&[EXIT, TAIL])?)?),
        part("boat tail", turn(&spline(&[TAIL, AFT])?)?),
        part("body", turn(&spline(&[AFT, SHOULDER])?)?),
        // A tangent ogive: radius 4.25, since 3.75² + 2² = 4.25² and 3.75 + 0.5 = 4.25.
        part("nose", turn(&arcs((-3.75, 6.0), &[SHOULDER, (0.0, 8.0)])?)?),
    ];
    for fin in &FINS {
        for (quarter, (x, y)) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].into_iter().enumerate() {
            let span = DVec3::new(x, y, 0.0) * FRAC_1_SQRT_2;
            surfaces.extend(fin.surfaces(&format!("{} {}", fin.name, quarter + 1), span)?);
        }
    }
    // z to x, x to y, y to z: a rotation that changes no bit of any coordinate.
    let laid = DMat4::from_cols(DVec4::Y, DVec4::Z, DVec4::X, DVec4::W);
    for s in &mut surfaces {
        s.surface = s.surface.transformed(laid).ok()?;
    }
    Some(surfaces)
}

impl Fin {
    /// Four flanks, the root and the tip. `span` is the unit vector from the axis to the tip.
    fn surfaces(&self, name: &str, span: DVec3) -> Option<Vec<SceneSurface>> {
        // Round the section: trailing edge, one side, leading edge, other side.
        let rhombus = |section: &Section| {
            let [trailing, thickest, leading] = section.along.map(|z| span * section.radius + DVec3::Z * z);
            let side = DVec3::Z.cross(span) * section.half_thickness;
            [trailing, thickest + side, leading, thickest - side].map(|p| p.extend(1.0))
        };
        let (root, tip) = (rhombus(&self.root), rhombus(&self.tip));
        let mut surfaces = Vec::with_capacity(6);
        for k in 0..4 {
            let next = (k + 1) % 4;
            let flank = bezier([[root[k], tip[k]], [root[next], tip[next]]])?;
            surfaces.push(part(format!("{name} flank {}", k + 1), flank));
        }
        surfaces.push(part(format!("{name} root"), bezier([[root[0], root[1]], [root[3], root[2]]])?));
        surfaces.push(part(format!("{name} tip"), bezier([[tip[0], tip[3]], [tip[1], tip[2]]])?));
        Some(surfaces)
    }
}

pub(super) fn view() -> View {
    View::orthographic(DVec3::new(-0.75, -1.0, 0.45))
}

//! Isocurves that are equally far apart in the parameter.

use alloc::vec;
use alloc::vec::Vec;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::kind::CurveKind;
use super::on_line::{corners, facing_zeros};
use super::style::Styles;
use super::trimmed::cut_to_trims;
use crate::line::{Axis, Line};
use crate::view::ViewScene;

/// Where an isocurve runs. It takes little room, and the curve can be made again at any time, the same to the bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct IsoLine {
    surface: usize,
    axis: Axis,
    value: f64,
}

/// The isocurves of all surfaces whose styles want them, in order; facets of meshes have none.
pub(crate) fn iso_lines(view: &ViewScene, styles: &Styles) -> Vec<IsoLine> {
    let wanted = |&surface: &usize| view.facet(surface).is_none() && styles.of(surface).curves.iso;
    let surfaces = || (0..view.surfaces().len()).filter(wanted);
    let mut out = Vec::with_capacity(surfaces().map(|surface| 2 * styles.of(surface).isos as usize).sum());
    for surface in surfaces() {
        let (grid, isos) = (&view.surfaces()[surface], styles.of(surface).isos);
        for (axis, breaks) in [(Axis::U, &grid.u_breaks), (Axis::V, &grid.v_breaks)] {
            let (mut a, mut b) = (breaks[0], breaks[breaks.len() - 1]);
            if let Some(trims) = view.trims(surface) {
                let (lo, hi) = trims.bounds();
                (a, b) = if axis == Axis::U { (lo.x, hi.x) } else { (lo.y, hi.y) };
            }
            let value = |k: u32| a + (b - a) * (f64::from(k) + 0.5) / f64::from(isos);
            out.extend((0..isos).map(|k| IsoLine { surface, axis, value: value(k) }));
        }
    }
    out
}

impl IsoLine {
    /// The curve, as it is without trims.
    pub(crate) fn curve(&self, g: &Geometry<'_>) -> SurfaceCurve {
        let Self { surface, axis, value } = *self;
        let line = Line::new(g.view, surface, axis, value, false);
        let domain = line.domain();
        let mut splits = facing_zeros(g, &line, domain);
        splits.extend(corners(g, &line));
        SurfaceCurve {
            kind: CurveKind::Iso,
            surface,
            surfaces: vec![surface],
            path: Path::Line(line),
            domain,
            active: false,
            inked: true,
            style: surface,
            level: 0,
            sides: Vec::new(),
            gap: 0.0,
            splits,
        }
    }

    /// The parts of the curve that the trims of its surface keep.
    pub(crate) fn parts(&self, g: &Geometry<'_>) -> Vec<SurfaceCurve> {
        // What trims keep of an isoparametric line is always known.
        cut_to_trims(g, vec![self.curve(g)]).0
    }
}

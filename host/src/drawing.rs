//! A drawing: strokes on paper, in millimetres, in the order in which they are drawn.

mod file;
mod flatten;
mod gcode;
mod hpgl;
pub mod json;
pub(crate) mod simplify;
pub mod svg;
mod traced;

pub use file::{DrawingFormat, Found, Reading};

use glam::{DVec2, DVec3};
use penvis_core::stroke::{Certainty, CurveKind};

use crate::pens::Pens;

/// Layer of strokes of which nothing is known.
pub const LAYER: &str = "ink";

/// The sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Page {
    /// Width in mm.
    pub width_mm: f64,
    /// Height in mm.
    pub height_mm: f64,
}

/// One polyline on paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// What the curve is; none of a stroke that comes of no surface.
    pub kind: Option<CurveKind>,
    /// Index of the surface in the model.
    pub surface: usize,
    /// Name of its layer.
    pub layer: String,
    /// Pen number, from 1.
    pub pen: u32,
    /// Turn among what the pen draws: 0 first, then the levels of adaptive isocurves from 1, the coarsest.
    pub level: u32,
    /// Whether it is drawn as visible ink.
    pub visible: bool,
    /// Quantitative invisibility: sheets in front of it.
    pub qi: u32,
    /// How its visibility was decided.
    pub certainty: Certainty,
    /// Vertices in model space; as many as `page`.
    pub points: Vec<DVec3>,
    /// Vertices on the paper in mm, y up, origin at the lower left. Two or more; closed when the last equals the first.
    pub page: Vec<DVec2>,
}

impl Polyline {
    /// Its length on the paper in mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        length_mm(&self.page)
    }

    /// A stroke of which nothing is known but its place: it comes of no surface, and is visible ink in the plane of the paper.
    #[must_use]
    pub fn stroke(layer: impl Into<String>, pen: u32, page: Vec<DVec2>) -> Self {
        Self {
            kind: None,
            surface: 0,
            layer: layer.into(),
            pen,
            level: 0,
            visible: true,
            qi: 0,
            certainty: Certainty::Proven,
            points: page.iter().map(|p| p.extend(0.0)).collect(),
            page,
        }
    }
}

/// Length of a polyline on the paper in mm.
pub(crate) fn length_mm(page: &[DVec2]) -> f64 {
    page.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// What the pen is to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Name of the model.
    pub name: String,
    /// The sheet.
    pub page: Page,
    /// Isocurves a direction, if they are as many on all surfaces; 0 for none.
    pub isos: u32,
    /// The pens that draw it.
    pub pens: Pens,
    /// How much farther from the curves the ink may be than its polylines are, mm: what these leave of the chord error.
    pub slack_mm: f64,
    /// In drawing order. Hidden ones are here only when they are wanted on the paper.
    pub polylines: Vec<Polyline>,
}

impl Drawing {
    /// Lower left and upper right corner of the ink on the page, in mm; none if there is none.
    #[must_use]
    pub fn extent(&self) -> Option<[DVec2; 2]> {
        let points = self.polylines.iter().flat_map(|polyline| &polyline.page);
        points.fold(None, |extent: Option<[DVec2; 2]>, &p| {
            Some(extent.map_or([p, p], |[low, high]| [low.min(p), high.max(p)]))
        })
    }
}

//! Files from drawings. Every emitter is a pure function of the drawing, and of the plotter where the language has one.

mod arc;
mod fit;
mod gcode;
mod grid;
mod hpgl;
mod json;
mod number;
mod png;
mod regions;
mod svg;

use std::path::Path;

use thiserror::Error;

pub(crate) use fit::{SLACK_PART, moves};
pub use gcode::gcode;
pub use grid::{Run, runs};
pub use hpgl::hpgl;
pub use json::json;
pub(crate) use number::decimal;
pub use png::{DPI, Pixels, RENDER_DPI, png, shaded};
pub use regions::{RegionFormat, regions_json, regions_svg};
pub use svg::svg;

use crate::device::{Device, Placement};
use crate::drawing::Drawing;

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Scalable vector graphics, a layer for each kind.
    Svg,
    /// G-code.
    Gcode,
    /// HPGL.
    Hpgl,
    /// A picture of the inked paper.
    Png,
    /// The drawing with its geometry and visibility.
    Json,
}

/// Extensions and what they mean.
const EXTENSIONS: [(&str, Format); 7] = [
    ("svg", Format::Svg),
    ("gcode", Format::Gcode),
    ("nc", Format::Gcode),
    ("hpgl", Format::Hpgl),
    ("plt", Format::Hpgl),
    ("png", Format::Png),
    ("json", Format::Json),
];

impl Format {
    /// The format that the extension of a path stands for, in upper or lower case.
    #[must_use]
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        EXTENSIONS.iter().find(|(known, _)| *known == extension).map(|(_, format)| *format)
    }

    /// The known extensions, for messages.
    #[must_use]
    pub fn extensions() -> String {
        EXTENSIONS.map(|(extension, _)| format!(".{extension}")).join(", ")
    }
}

/// Why a drawing cannot be written for a plotter or as a picture.
#[derive(Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EmitError {
    /// The plotter speaks another language.
    #[error("`{device}` speaks {speaks}, not {wanted}; choose another --device (`penvis devices` lists them)")]
    Language {
        /// The device.
        device: String,
        /// What it speaks.
        speaks: &'static str,
        /// What the file is to be.
        wanted: &'static str,
    },
    /// The page does not fit the plotter.
    #[error(transparent)]
    Place(#[from] crate::device::PlaceError),
    /// A stroke leaves the reach of the plotter.
    #[error(
        "the drawing has ink at ({x:.1}, {y:.1}) mm of the page, which `{device}` does not reach; give a larger --margin"
    )]
    Reach {
        /// The device.
        device: String,
        /// Where on the page, in mm from the left.
        x: f64,
        /// Where on the page, in mm from below.
        y: f64,
    },
    /// A pen is to be pressed harder than the plotter can.
    #[error(
        "pen {pen} is to be pressed with force {force}, and `{device}` knows 1 to {forces}; change `force` in the scene"
    )]
    Force {
        /// The pen.
        pen: u32,
        /// The force wanted.
        force: u32,
        /// The device.
        device: String,
        /// Its largest one.
        forces: u32,
    },
    /// A line of the profile or a coordinate makes a line too long for the controller.
    #[error(
        "the line `{line}` is longer than the {limit} characters that `{device}` takes; shorten it in the device profile"
    )]
    Line {
        /// The line.
        line: String,
        /// Limit in characters.
        limit: usize,
        /// The device.
        device: String,
    },
    /// The picture cannot be made.
    #[error("a picture of {width_mm} × {height_mm} mm cannot be made; choose a smaller --paper")]
    Picture {
        /// Width of the page in mm.
        width_mm: f64,
        /// Height of the page in mm.
        height_mm: f64,
    },
}

/// Refuses ink that the machine does not reach. Rounding to its unit may move a point by half of it.
fn check_reach(drawing: &Drawing, device: &Device, place: &Placement, unit_mm: f64) -> Result<(), EmitError> {
    for point in drawing.polylines.iter().flat_map(|p| &p.page) {
        if !place.reaches(*point, unit_mm / 2.0) {
            return Err(EmitError::Reach { device: device.name.clone(), x: point.x, y: point.y });
        }
    }
    Ok(())
}

#[cfg(test)]
pub(crate) mod tests {
    use glam::DVec2;
    use penvis_core::stroke::{Certainty, CurveKind};

    use super::*;
    use crate::drawing::{Page, Polyline};
    use crate::pens::Pens;

    /// A polyline of one kind through page points in mm.
    pub(crate) fn polyline(kind: CurveKind, pen: u32, page: &[[f64; 2]]) -> Polyline {
        Polyline {
            kind: Some(kind),
            surface: 0,
            layer: kind.name().into(),
            pen,
            level: 0,
            visible: true,
            qi: 0,
            certainty: Certainty::Proven,
            points: page.iter().map(|p| DVec2::from(*p).extend(0.5)).collect(),
            page: page.iter().map(|p| DVec2::from(*p)).collect(),
        }
    }

    /// A drawing on a sheet.
    pub(crate) fn drawing(width_mm: f64, height_mm: f64, polylines: Vec<Polyline>) -> Drawing {
        Drawing {
            name: "t".into(),
            page: Page { width_mm, height_mm },
            isos: 0,
            pens: Pens::default(),
            slack_mm: 0.0,
            polylines,
        }
    }

    #[test]
    fn extensions_name_formats() {
        let of = |path: &str| Format::of_path(Path::new(path));
        assert_eq!(of("a/b.NC"), Some(Format::Gcode));
        assert_eq!(of("b.plt"), Some(Format::Hpgl));
        assert_eq!(of("b.tar.json"), Some(Format::Json));
        for unknown in ["b.pdf", "b", ".svg", "svg", ""] {
            assert_eq!(of(unknown), None, "{unknown}");
        }
        assert!(Format::extensions().contains(".hpgl, .plt"));
    }
}

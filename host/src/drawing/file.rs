//! Files that hold drawings.

use std::collections::BTreeMap;
use std::path::Path;

use super::{Drawing, gcode, hpgl, json, svg};
use crate::device::Device;
use crate::emit::Format;
use crate::model::{ReadError, Source, View};

/// Largest file in bytes that is read as a whole.
const LARGEST: u64 = 256 << 20;

/// How a file is read.
#[derive(Clone, Copy)]
pub struct Reading<'a> {
    /// Largest distance in mm between a curve and its polyline on the page of the file, positive.
    pub tolerance_mm: f64,
    /// The plotter for which G-code is, if its pen is that of the file.
    pub gcode: &'a Device,
    /// The plotter for which HPGL is.
    pub hpgl: &'a Device,
    /// Asked now and then whether to stop.
    pub stops: &'a dyn Fn() -> bool,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The drawing.
    pub drawing: Drawing,
    /// The view that it was drawn with, if it says so.
    pub view: Option<View>,
    /// Colours of its pens (red, green, blue), as far as it has such.
    pub colours: BTreeMap<u32, [u8; 3]>,
    /// What is in it and not drawn, each a line.
    pub notes: Vec<String>,
}

/// What a drawing is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DrawingFormat {
    /// What [`emit::json`](crate::emit::json) writes.
    Json,
    /// Scalable vector graphics.
    Svg,
    /// G-code for a plotter.
    Gcode,
    /// HPGL for a plotter.
    Hpgl,
}

impl DrawingFormat {
    /// That of a file, by its extension, and by what is in it where that says nothing; none of a file that is no drawing, or not there.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        if !path.is_file() {
            return None;
        }
        match Format::of_path(path)? {
            Format::Svg => Some(Self::Svg),
            Format::Json => Source::open(path).is_ok_and(|source| json::looks_like(&source)).then_some(Self::Json),
            Format::Gcode => Some(Self::Gcode),
            Format::Hpgl => Some(Self::Hpgl),
            Format::Png => None,
        }
    }

    /// What users call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Json => "drawing JSON",
            Self::Svg => "SVG",
            Self::Gcode => "G-code",
            Self::Hpgl => "HPGL",
        }
    }

    /// Whether it holds curves, which are made into polylines in reading.
    #[must_use]
    pub fn has_curves(self) -> bool {
        match self {
            Self::Svg | Self::Gcode => true,
            Self::Json | Self::Hpgl => false,
        }
    }

    /// Reads a drawing.
    ///
    /// # Errors
    /// [`ReadError`] with the place, whatever the bytes are.
    pub fn read(self, source: &mut Source, reading: &Reading<'_>) -> Result<Found, ReadError> {
        // JSON is read piece by piece.
        if self != Self::Json && source.length() > LARGEST {
            return Err(ReadError::TooLarge { limit: LARGEST });
        }
        match self {
            Self::Json => {
                let (drawing, view) = json::read(source)?;
                Ok(Found { drawing, view, colours: BTreeMap::new(), notes: Vec::new() })
            }
            Self::Svg => svg::read(source, reading),
            Self::Gcode => gcode::read(source, reading.gcode, reading),
            Self::Hpgl => hpgl::read(source, reading.hpgl, reading),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::device;

    /// What is read of a text within a tolerance in mm, for a plotter if it is for one.
    pub(in crate::drawing) fn read(
        format: DrawingFormat,
        text: &str,
        device: &str,
        tolerance_mm: f64,
    ) -> Result<Found, String> {
        let mut source = Source::from_bytes("fed", text.as_bytes().to_vec()).unwrap();
        let device = device::find(device).unwrap();
        let reading = Reading { tolerance_mm, gcode: &device, hpgl: &device, stops: &|| false };
        format.read(&mut source, &reading).map_err(|error| error.to_string())
    }
}

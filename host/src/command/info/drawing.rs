//! What a drawing holds.

use std::path::Path;

use serde::Serialize;

use super::{count, line, short};
use crate::device;
use crate::drawing::{Drawing, DrawingFormat, Reading};
use crate::error::Error;
use crate::interrupt;
use crate::redraw;

/// Most layers that the text lists; what is longer is for programs.
const MOST_LAYERS: usize = 100;

/// What there is to say of a drawing.
#[derive(Debug, Serialize)]
pub(super) struct DrawingFacts {
    file: String,
    format: &'static str,
    name: String,
    page: [f64; 2],
    strokes: usize,
    points: usize,
    ink_mm: f64,
    /// Lower left and upper right ends of the ink on the page, in mm.
    extent_mm: Option<[[f64; 2]; 2]>,
    layers: Vec<LayerFacts>,
    notes: Vec<String>,
}

/// What a pen draws on a layer.
#[derive(Debug, Serialize)]
struct LayerFacts {
    layer: String,
    pen: u32,
    strokes: usize,
    ink_mm: f64,
}

impl DrawingFacts {
    /// Reads a drawing. Files for plotters are read as those of common ones.
    ///
    /// # Errors
    /// If it cannot be read, or Ctrl-C ends it.
    pub(super) fn of(path: &Path, format: DrawingFormat) -> Result<Self, Error> {
        let file = path.display().to_string();
        let (gcode, hpgl) = (device::find(device::DEFAULT)?, device::find(device::DEFAULT_HPGL)?);
        let reading = Reading { tolerance_mm: 0.01, gcode: &gcode, hpgl: &hpgl, stops: &interrupt::is_wanted };
        let found = redraw::read(path, format, &reading)?;
        Ok(Self::new(file, format.name(), &found.drawing, found.notes))
    }

    fn new(file: String, format: &'static str, drawing: &Drawing, notes: Vec<String>) -> Self {
        let mut layers: Vec<LayerFacts> = Vec::new();
        for polyline in &drawing.polylines {
            let place = layers.iter().position(|l| l.layer == polyline.layer && l.pen == polyline.pen);
            let place = place.unwrap_or_else(|| {
                let layer = polyline.layer.clone();
                layers.push(LayerFacts { layer, pen: polyline.pen, strokes: 0, ink_mm: 0.0 });
                layers.len() - 1
            });
            layers[place].strokes += 1;
            layers[place].ink_mm += polyline.length_mm();
        }
        Self {
            file,
            format,
            name: drawing.name.clone(),
            page: [drawing.page.width_mm, drawing.page.height_mm],
            strokes: drawing.polylines.len(),
            points: drawing.polylines.iter().map(|p| p.page.len()).sum(),
            ink_mm: layers.iter().fold(0.0, |sum, layer| sum + layer.ink_mm),
            extent_mm: drawing.extent().map(|ends| ends.map(|end| end.to_array())),
            layers,
            notes,
        }
    }

    /// It as text.
    pub(super) fn describe(&self) -> String {
        let mut text = format!(
            "{}: {}, {}, {} mm of ink\n",
            self.name,
            count(self.strokes, "stroke"),
            count(self.points, "point"),
            short(self.ink_mm)
        );
        line(&mut text, "file", format!("{}: {}", self.file, self.format));
        line(&mut text, "page", format!("{} × {} mm", short(self.page[0]), short(self.page[1])));
        if let Some([low, high]) = self.extent_mm {
            for (axis, k) in [("x", 0), ("y", 1)] {
                line(&mut text, &format!("extent {axis}"), format!("{} to {} mm", short(low[k]), short(high[k])));
            }
        }
        for LayerFacts { layer, pen, strokes, ink_mm } in self.layers.iter().take(MOST_LAYERS) {
            let what = format!("{layer}: pen {pen}, {}, {} mm", count(*strokes, "stroke"), short(*ink_mm));
            line(&mut text, "layer", what);
        }
        if self.layers.len() > MOST_LAYERS {
            line(&mut text, "layer", format!("{} more; --json lists all", self.layers.len() - MOST_LAYERS));
        }
        self.notes.iter().for_each(|note| line(&mut text, "skipped", note));
        text
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::{Boundary, Iso};

    use super::*;
    use crate::emit::tests::{drawing, polyline};

    #[test]
    fn layers_are_told_with_their_pens_and_lengths() {
        let lines = vec![
            polyline(Iso, 1, &[[10.0, 20.0], [40.0, 60.0]]),
            polyline(Boundary, 2, &[[1.0, 1.0], [1.0, 1.5]]),
            polyline(Iso, 1, &[[10.0, 20.0], [20.0, 20.0], [20.0, 21.0]]),
        ];
        let facts = DrawingFacts::new("a.svg".into(), "SVG", &drawing(100.0, 80.5, lines), vec!["a note".into()]);
        let expected = "\
t: 3 strokes, 7 points, 61.5 mm of ink
file      a.svg: SVG
page      100 × 80.5 mm
extent x  1 to 40 mm
extent y  1 to 60 mm
layer     iso: pen 1, 2 strokes, 61 mm
layer     boundary: pen 2, 1 stroke, 0.5 mm
skipped   a note
";
        assert_eq!(facts.describe(), expected);
        let json = serde_json::to_value(&facts).unwrap();
        assert_eq!((&json["layers"][0]["strokes"], &json["extent_mm"][1][0]), (&2.into(), &40.0.into()));
    }
}

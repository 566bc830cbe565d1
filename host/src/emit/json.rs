//! The drawing JSON.

use glam::{DVec2, DVec3};
use penvis_core::stroke::CurveKind;
use serde::{Serialize, Serializer};

use crate::drawing::{Drawing, Page, Polyline};
use crate::model::View;
use crate::model::view::ViewJson;

#[derive(Serialize)]
struct DrawingJson<'a> {
    name: &'a str,
    view: ViewJson,
    isos: u32,
    page: PageJson,
    polylines: Vec<PolylineJson<'a>>,
}

/// The size of a sheet.
#[derive(Serialize)]
pub(super) struct PageJson {
    width_mm: f64,
    height_mm: f64,
}

impl From<Page> for PageJson {
    fn from(page: Page) -> Self {
        Self { width_mm: page.width_mm, height_mm: page.height_mm }
    }
}

#[derive(Serialize)]
struct PolylineJson<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<&'static str>,
    surface: usize,
    layer: &'a str,
    pen: u32,
    visible: bool,
    qi: u32,
    certainty: &'static str,
    #[serde(serialize_with = "model_points")]
    points: &'a [DVec3],
    #[serde(serialize_with = "page_points")]
    page: &'a [DVec2],
}

fn model_points<S: Serializer>(points: &[DVec3], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(points.iter().map(DVec3::to_array))
}

/// Points of a plane as pairs.
pub(super) fn page_points<S: Serializer>(points: &[DVec2], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(points.iter().map(DVec2::to_array))
}

impl<'a> From<&'a Polyline> for PolylineJson<'a> {
    fn from(polyline: &'a Polyline) -> Self {
        Self {
            kind: polyline.kind.map(CurveKind::name),
            surface: polyline.surface,
            layer: &polyline.layer,
            pen: polyline.pen,
            visible: polyline.visible,
            qi: polyline.qi,
            certainty: polyline.certainty.name(),
            points: &polyline.points,
            page: &polyline.page,
        }
    }
}

/// The drawing as JSON: every polyline with its points in the model and, y up, on the page in mm; numbers read back to the
/// bit. `view` is the one it was drawn with.
///
/// # Errors
/// None that the drawing could cause; what the serializer says is handed on.
pub fn json(drawing: &Drawing, view: &View) -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string(&DrawingJson {
        name: &drawing.name,
        view: (*view).into(),
        isos: drawing.isos,
        page: drawing.page.into(),
        polylines: drawing.polylines.iter().map(PolylineJson::from).collect(),
    })?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::Certainty;
    use penvis_core::stroke::CurveKind::Silhouette;

    use super::super::tests::{drawing, polyline};
    use super::*;

    #[test]
    fn the_fields_are_those_of_the_format() {
        let mut line = polyline(Silhouette, 1, &[[1.0, 2.5], [3.0, 4.0]]);
        (line.surface, line.visible, line.qi, line.certainty) = (7, false, 2, Certainty::Tolerance);
        line.layer = "hidden".into();
        let mut drawing = drawing(297.0, 210.0, vec![line]);
        drawing.isos = 8;
        let expected = concat!(
            r#"{"name":"t","view":{"eye_direction":[1.0,-1.0,1.0],"up":[0.0,0.0,1.0],"projection":"orthographic"},"#,
            r#""isos":8,"page":{"width_mm":297.0,"height_mm":210.0},"polylines":[{"kind":"silhouette","surface":7,"#,
            r#""layer":"hidden","pen":1,"visible":false,"qi":2,"certainty":"tolerance","#,
            r#""points":[[1.0,2.5,0.5],[3.0,4.0,0.5]],"page":[[1.0,2.5],[3.0,4.0]]}]}"#,
            "\n"
        );
        assert_eq!(json(&drawing, &View::ISOMETRIC).unwrap(), expected);
    }
}

//! The drawing JSON reader: what [`emit::json`](crate::emit::json) writes.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use penvis_core::stroke::{Certainty, CurveKind};
use serde::Deserialize;

use super::{Drawing, Page, Polyline};
use crate::model::view::ViewJson;
use crate::model::{Fault, ReadError, Source, View};
use crate::pens::Pens;
use crate::style::{self, MOST_PENS};

/// Largest coordinate on paper and side of a sheet in mm. No plotter here reaches so far.
const LONGEST_MM: f64 = 10_000.0;

/// Layers of adaptive isocurves begin so; their levels follow, from 1.
const LEVELS: &str = "iso-";

#[derive(Deserialize)]
struct DrawingJson {
    name: Option<String>,
    view: Option<ViewJson>,
    #[serde(default)]
    isos: u32,
    page: PageJson,
    polylines: Vec<PolylineJson>,
}

#[derive(Deserialize)]
struct PageJson {
    width_mm: f64,
    height_mm: f64,
}

#[derive(Deserialize)]
struct PolylineJson {
    kind: Option<String>,
    #[serde(default)]
    surface: usize,
    layer: Option<String>,
    pen: Option<u32>,
    #[serde(default = "yes")]
    visible: bool,
    #[serde(default)]
    qi: u32,
    certainty: Option<CertaintyJson>,
    points: Option<Vec<[f64; 3]>>,
    page: Vec<[f64; 2]>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum CertaintyJson {
    Proven,
    Tolerance,
    Undecided,
}

fn yes() -> bool {
    true
}

/// Whether a file is a drawing in JSON: `polylines` is a key near its beginning, and `surfaces`, which models have, is none.
#[must_use]
pub fn looks_like(source: &Source) -> bool {
    let head = source.head();
    head.trim_ascii_start().first() == Some(&b'{') && has_key(head, b"\"polylines\"") && !has_key(head, b"\"surfaces\"")
}

/// A quoted word is a key if a colon follows it; within a string its quotes would be escaped.
fn has_key(text: &[u8], quoted: &[u8]) -> bool {
    let is_key =
        |at: usize| text.get(at + quoted.len()..).is_some_and(|rest| rest.trim_ascii_start().first() == Some(&b':'));
    text.windows(quoted.len()).enumerate().any(|(at, word)| word == quoted && is_key(at))
}

/// The drawing in a file, and the view that it was drawn with, if it says so. A file without `name` is named after itself, a
/// polyline without `layer` is on that of its kind, or else on [`LAYER`](super::LAYER), one without `pen` is for the first, and one without `points` lies in the plane of the paper.
///
/// Cost and memory: linear in the file.
///
/// # Errors
/// [`ReadError`] with the place, whatever the bytes are.
pub fn read(source: &mut Source) -> Result<(Drawing, Option<View>), ReadError> {
    let stem = source.stem().to_owned();
    let mut json = serde_json::Deserializer::from_reader(source.text()?);
    let file: DrawingJson = serde_path_to_error::deserialize(&mut json)
        .map_err(|e| Fault::at(e.path().to_string(), e.inner().to_string()))?;
    json.end().map_err(|e| Fault::whole(e.to_string()))?;
    let page = Page { width_mm: file.page.width_mm, height_mm: file.page.height_mm };
    if ![page.width_mm, page.height_mm].iter().all(|side| (1.0..=LONGEST_MM).contains(side)) {
        return Err(Fault::at("page", format!("is no sheet; give sides of 1 to {LONGEST_MM} mm")).into());
    }
    let view = file.view.map(View::from);
    if let Some(view) = &view {
        view.camera().map_err(|e| Fault::at("view", e.to_string()))?;
    }
    let polylines = file.polylines.into_iter().enumerate();
    let polylines = polylines
        .map(|(index, json)| polyline(json).map_err(|problem| Fault::at(format!("polylines[{index}]"), problem)))
        .collect::<Result<_, Fault>>()?;
    let pens = Pens::new(BTreeMap::new(), crate::pens::DEFAULT_WIDTH_MM);
    Ok((Drawing { name: file.name.unwrap_or(stem), page, isos: file.isos, pens, slack_mm: 0.0, polylines }, view))
}

/// A polyline, checked.
///
/// # Errors
/// What is wrong with it and what to do.
fn polyline(json: PolylineJson) -> Result<Polyline, String> {
    let kind = json.kind.as_deref().map(style::kind).transpose()?;
    let layer = json.layer.unwrap_or_else(|| kind.map_or(super::LAYER, CurveKind::name).to_owned());
    let pen = json.pen.unwrap_or(1);
    if !(1..=MOST_PENS).contains(&pen) {
        return Err(format!("pen {pen} is none; give a number from 1 to {MOST_PENS}"));
    }
    let page: Vec<DVec2> = json.page.into_iter().map(DVec2::from).collect();
    if page.len() < 2 {
        return Err(format!("page has {} points; give two or more, a dot twice the same", page.len()));
    }
    if !page.iter().all(|p| p.abs().max_element() <= LONGEST_MM) {
        return Err(format!("page has a coordinate of more than {LONGEST_MM} mm; no paper is so large"));
    }
    let points: Vec<DVec3> = match json.points {
        Some(points) if points.len() == page.len() => points.into_iter().map(DVec3::from).collect(),
        Some(points) => {
            return Err(format!("has {} points and {} on the page; give as many", points.len(), page.len()));
        }
        None => page.iter().map(|p| p.extend(0.0)).collect(),
    };
    let certainty = match json.certainty {
        None | Some(CertaintyJson::Proven) => Certainty::Proven,
        Some(CertaintyJson::Tolerance) => Certainty::Tolerance,
        Some(CertaintyJson::Undecided) => Certainty::Undecided,
    };
    // Levels are drawn one after the other, and in the file their layers tell them.
    let level = layer.strip_prefix(LEVELS).and_then(|level| level.parse().ok()).unwrap_or(0);
    let (surface, visible, qi) = (json.surface, json.visible, json.qi);
    Ok(Polyline { kind, surface, layer, pen, level, visible, qi, certainty, points, page })
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::{Iso, Silhouette};

    use super::*;
    use crate::emit::{self, tests::drawing, tests::polyline};

    fn read(text: &str) -> Result<(Drawing, Option<View>), String> {
        let mut source = Source::from_bytes("fed", text.as_bytes().to_vec()).unwrap();
        assert!(looks_like(&source), "{text}");
        super::read(&mut source).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let mut hidden = polyline(Silhouette, 3, &[[0.1, 1.0 / 3.0], [2.0, 70.0], [0.1, 1.0 / 3.0]]);
        (hidden.surface, hidden.visible, hidden.qi, hidden.certainty) = (7, false, 2, Certainty::Undecided);
        hidden.layer = "hidden-2".into();
        let mut level = polyline(Iso, 1, &[[1.0, 2.0], [3.0, 4.0]]);
        (level.level, level.layer) = (2, "iso-2".into());
        let mut drawn = drawing(297.0, 210.0, vec![hidden, level]);
        drawn.isos = 5;
        let (again, view) = read(&emit::json(&drawn, &View::ISOMETRIC).unwrap()).unwrap();
        assert_eq!((again, view), (drawn, Some(View::ISOMETRIC)));
    }

    #[test]
    fn what_is_not_said_is_as_usual() {
        let text = r#"{"page": {"width_mm": 99, "height_mm": 50}, "polylines" : [{"kind": "trim", "page": [[1, 2], [3, 4]]}]}"#;
        let (found, view) = read(text).unwrap();
        let line = &found.polylines[0];
        assert_eq!((found.name.as_str(), view, line.layer.as_str(), line.pen), ("fed", None, "boundary", 1));
        assert_eq!((line.points[1], line.visible), (DVec3::new(3.0, 4.0, 0.0), true));
        let (found, _) = read(&text.replace(r#""kind": "trim", "#, "")).unwrap();
        assert_eq!(found.polylines, [Polyline::stroke("ink", 1, vec![DVec2::new(1.0, 2.0), DVec2::new(3.0, 4.0)])]);
        // What is not known is not written either.
        assert_eq!(read(&emit::json(&found, &View::ISOMETRIC).unwrap()).unwrap().0, found);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let file = |page: &str, line: &str| format!(r#"{{"page": {{{page}}}, "polylines": [{{{line}}}]}}"#);
        let (sheet, ends) = (r#""width_mm": 99, "height_mm": 50"#, r#""page": [[1, 2], [3, 4]]"#);
        let line = |rest: &str| file(sheet, &format!(r#""kind": "iso", {rest}"#));
        let table = [
            (file(r#""width_mm": 99"#, ""), "page: missing field `height_mm`"),
            (file(r#""width_mm": 0, "height_mm": 9"#, &format!(r#""kind": "iso", {ends}"#)), "page: is no sheet"),
            (file(sheet, &format!(r#""kind": "edge", {ends}"#)), "polylines[0]: `edge` is not one of boundary"),
            (line(r#""page": [[1, 2]]"#), "polylines[0]: page has 1 points"),
            (line(r#""page": [[1, 2], [3, 1e5]]"#), "polylines[0]: page has a coordinate of more than 10000 mm"),
            (line(r#""page": [[1, 2], [3, 1e999]]"#), "number out of range"),
            (line(&format!(r#""points": [[1, 2, 3]], {ends}"#)), "polylines[0]: has 1 points and 2 on the page"),
            (line(&format!(r#""pen": 0, {ends}"#)), "polylines[0]: pen 0 is none"),
            (line(&format!(r#""certainty": "no", {ends}"#)), "polylines[0].certainty: unknown variant `no`"),
        ];
        for (text, expected) in table {
            let message = read(&text).unwrap_err();
            assert!(message.contains(expected) && !message.contains('\n'), "{text} gave {message:?}");
        }
    }

    #[test]
    fn models_are_no_drawings() {
        for text in [
            r#"{"name": "\"polylines\": 3", "surfaces": []}"#,
            r#"{"polylines": 1, "surfaces": []}"#,
            r#"["polylines"]"#,
        ] {
            assert!(!looks_like(&Source::from_bytes("fed", text.into()).unwrap()), "{text}");
        }
    }
}

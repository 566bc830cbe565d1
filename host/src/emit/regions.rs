//! Visible regions as files: filled shapes in SVG, and all that is known of them in JSON.

use std::fmt::Write as _;

use glam::DVec2;
use serde::Serialize;

use super::Format;
use super::json::{PageJson, page_points};
use super::number::decimal;
use super::svg::{DECIMALS, escape};
use crate::model::View;
use crate::model::view::ViewJson;
use crate::regions::{Shape, ShapeEdge, Shapes};
use crate::shadow::{ShadowLoop, ShadowShape, ShadowShapes, UndecidedShadow};

/// What a file of regions holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegionFormat {
    /// One filled path a surface.
    Svg,
    /// Loops with points on the page and in the surface's parameters.
    Json,
}

impl RegionFormat {
    /// The format that the extension of a path stands for, in upper or lower case.
    #[must_use]
    pub fn of_path(path: &std::path::Path) -> Option<Self> {
        match Format::of_path(path)? {
            Format::Svg => Some(Self::Svg),
            Format::Json => Some(Self::Json),
            Format::Gcode | Format::Hpgl | Format::Png => None,
        }
    }
}

/// The regions as SVG: user units are mm, one path a surface with its holes, filled by the even-odd rule with a colour of its own, and
/// titled with the surface's name. Shadows are a group of their own over them, of darker paths. `command` is what made it, for the description.
#[must_use]
pub fn regions_svg(shapes: &Shapes, shadows: Option<&ShadowShapes>, command: &str) -> String {
    let (width, height) = (decimal(shapes.page.width_mm, 4), decimal(shapes.page.height_mm, 4));
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" \
         height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<desc>{}</desc>\n\
         <g fill-rule=\"evenodd\" stroke=\"none\">\n",
        escape(&shapes.name),
        escape(command)
    );
    for shape in &shapes.shapes {
        let [r, g, b] = color(shape.surface);
        // Writing to a string cannot fail.
        let _ = write!(text, "<path id=\"surface-{}\" fill=\"#{r:02x}{g:02x}{b:02x}\" d=\"", shape.surface);
        for edges in &shape.loops {
            outline(&mut text, edges.iter().flat_map(|e| &e.page), shapes.page.height_mm);
        }
        let _ = writeln!(text, "\"><title>{}</title></path>", escape(&shape.name));
    }
    text.push_str("</g>\n");
    if let Some(shadows) = shadows {
        shadow_group(&mut text, shadows, shapes.page.height_mm);
    }
    text.push_str("</svg>\n");
    text
}

/// The shadows, each in its surface's colour at half the light.
fn shadow_group(text: &mut String, shadows: &ShadowShapes, height_mm: f64) {
    text.push_str("<g id=\"shadows\" fill-rule=\"evenodd\" stroke=\"none\">\n");
    for shape in &shadows.shapes {
        let [r, g, b] = color(shape.surface).map(|x| x / 2);
        let _ = write!(text, "<path id=\"shadow-{}\" fill=\"#{r:02x}{g:02x}{b:02x}\" d=\"", shape.surface);
        for own in &shape.loops {
            outline(text, own.page.iter(), height_mm);
        }
        let _ = writeln!(text, "\"><title>{}</title></path>", escape(&shape.name));
    }
    text.push_str("</g>\n");
}

/// A closed subpath; where one edge goes on from another the point is there once.
fn outline<'a>(text: &mut String, page: impl Iterator<Item = &'a DVec2>, height_mm: f64) {
    let place = |p: &DVec2| (decimal(p.x, DECIMALS), decimal(height_mm - p.y, DECIMALS));
    let mut points: Vec<(String, String)> = page.map(place).collect();
    points.dedup();
    if points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    for (k, (x, y)) in points.iter().enumerate() {
        let command = match k {
            0 => "M",
            1 => "L",
            _ => " ",
        };
        let _ = write!(text, "{command}{x},{y}");
    }
    if !points.is_empty() {
        text.push('Z');
    }
}

/// A colour for a surface: hues a golden section apart, so that neighbours differ, neither dark nor pale.
fn color(surface: usize) -> [u8; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (surface as f64 * GOLDEN).fract() * 6.0;
    // Three waves a third of the circle apart.
    [0.0, 4.0, 2.0].map(|shift| {
        let at = (hue + shift) % 6.0;
        let share = (2.0 - (at - 3.0).abs()).clamp(-1.0, 1.0);
        (170.0 - 60.0 * share) as u8
    })
}

#[derive(Serialize)]
struct ShapesJson<'a> {
    name: &'a str,
    view: ViewJson,
    page: PageJson,
    regions: Vec<RegionJson<'a>>,
    undecided: Vec<UndecidedJson>,
    #[serde(flatten)]
    shadows: Option<ShadowsJson<'a>>,
}

#[derive(Serialize)]
struct ShadowsJson<'a> {
    shadows: Vec<ShadowJson<'a>>,
    undecided_shadows: Vec<UndecidedShadowJson>,
}

#[derive(Serialize)]
struct ShadowJson<'a> {
    surface: usize,
    name: &'a str,
    area_mm2: f64,
    loops: Vec<ShadowLoopJson<'a>>,
}

#[derive(Serialize)]
struct ShadowLoopJson<'a> {
    #[serde(serialize_with = "page_points")]
    page: &'a [DVec2],
    #[serde(serialize_with = "page_points")]
    uv: &'a [DVec2],
}

#[derive(Serialize)]
struct UndecidedShadowJson {
    page: Option<[f64; 2]>,
    surface: Option<usize>,
    why: &'static str,
}

#[derive(Serialize)]
struct RegionJson<'a> {
    surface: usize,
    name: &'a str,
    area_mm2: f64,
    loops: Vec<Vec<EdgeJson<'a>>>,
}

#[derive(Serialize)]
struct EdgeJson<'a> {
    kind: &'static str,
    own: bool,
    #[serde(serialize_with = "page_points")]
    page: &'a [DVec2],
    #[serde(serialize_with = "page_points")]
    uv: &'a [DVec2],
}

#[derive(Serialize)]
struct UndecidedJson {
    page: [f64; 2],
    surface: Option<usize>,
    why: &'static str,
}

impl<'a> From<&'a Shape> for RegionJson<'a> {
    fn from(shape: &'a Shape) -> Self {
        Self {
            surface: shape.surface,
            name: &shape.name,
            area_mm2: shape.area_mm2,
            loops: shape.loops.iter().map(|l| l.iter().map(EdgeJson::from).collect()).collect(),
        }
    }
}

impl<'a> From<&'a ShapeEdge> for EdgeJson<'a> {
    fn from(edge: &'a ShapeEdge) -> Self {
        Self { kind: edge.kind.name(), own: edge.own, page: &edge.page, uv: &edge.uv }
    }
}

impl<'a> From<&'a ShadowShapes> for ShadowsJson<'a> {
    fn from(shadows: &'a ShadowShapes) -> Self {
        let own = |l: &'a ShadowLoop| ShadowLoopJson { page: &l.page, uv: &l.uv };
        let shape = |s: &'a ShadowShape| ShadowJson {
            surface: s.surface,
            name: &s.name,
            area_mm2: s.area_mm2,
            loops: s.loops.iter().map(own).collect(),
        };
        let undecided = |u: &UndecidedShadow| UndecidedShadowJson {
            page: u.page.map(|p| p.to_array()),
            surface: u.surface,
            why: u.why,
        };
        Self {
            shadows: shadows.shapes.iter().map(shape).collect(),
            undecided_shadows: shadows.undecided.iter().map(undecided).collect(),
        }
    }
}

/// The regions as JSON: every loop, edge by edge, with its points on the page in mm (y up) and in the surface's parameters; numbers read back to
/// the bit. `view` is the one that they are seen with. Shadows are a list of their own.
///
/// # Errors
/// None that the regions could cause; what the serializer says is handed on.
pub fn regions_json(shapes: &Shapes, shadows: Option<&ShadowShapes>, view: &View) -> Result<String, serde_json::Error> {
    let undecided =
        shapes.undecided.iter().map(|u| UndecidedJson { page: u.page.to_array(), surface: u.surface, why: u.why });
    let mut text = serde_json::to_string(&ShapesJson {
        name: &shapes.name,
        view: (*view).into(),
        page: shapes.page.into(),
        regions: shapes.shapes.iter().map(RegionJson::from).collect(),
        undecided: undecided.collect(),
        shadows: shadows.map(ShadowsJson::from),
    })?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use penvis_core::extract::CurveKind;

    use super::*;
    use crate::drawing::Page;
    use crate::regions::Undecided;

    /// A triangle of two edges.
    fn shapes() -> Shapes {
        let edge = |kind, own, points: &[[f64; 2]]| ShapeEdge {
            kind,
            own,
            page: points.iter().map(|p| DVec2::from(*p)).collect(),
            uv: points.iter().map(|p| 0.5 * DVec2::from(*p)).collect(),
        };
        let edges = vec![
            edge(CurveKind::Silhouette, true, &[[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]),
            edge(CurveKind::Boundary, false, &[[4.0, 3.0], [0.0, 0.0]]),
        ];
        Shapes {
            name: "a&b".into(),
            page: Page { width_mm: 20.0, height_mm: 10.0 },
            shapes: vec![Shape { surface: 3, name: "x/lid".into(), area_mm2: 6.0, loops: vec![edges] }],
            undecided: vec![Undecided { page: DVec2::ONE, surface: None, why: "so" }],
        }
    }

    #[test]
    fn a_surface_is_one_filled_path() {
        let expected = r##"<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" width="20mm" height="10mm" viewBox="0 0 20 10">
<title>a&amp;b</title>
<desc>penvis</desc>
<g fill-rule="evenodd" stroke="none">
<path id="surface-3" fill="#COLOR" d="M0,10L4,10 4,7Z"><title>x/lid</title></path>
</g>
</svg>
"##;
        let [r, g, b] = color(3);
        assert_eq!(
            regions_svg(&shapes(), None, "penvis"),
            expected.replace("COLOR", &format!("{r:02x}{g:02x}{b:02x}"))
        );
        assert!((0..50).all(|k| color(k) != color(k + 1)));
    }

    fn shadows() -> ShadowShapes {
        let corners = [[1.0, 0.0], [4.0, 0.0], [4.0, 3.0]].map(DVec2::from);
        let own = ShadowLoop { page: corners.to_vec(), uv: corners.map(|p| 0.5 * p).to_vec() };
        let shape = ShadowShape { surface: 3, name: "x/lid".into(), area_mm2: 4.5, loops: vec![own] };
        ShadowShapes {
            shapes: vec![shape],
            undecided: vec![UndecidedShadow { page: None, surface: Some(3), why: "so" }],
        }
    }

    #[test]
    fn shadows_are_darker_paths_and_a_list_of_their_own() {
        let svg = regions_svg(&shapes(), Some(&shadows()), "penvis");
        let [r, g, b] = color(3).map(|x| x / 2);
        let group = format!(
            "<g id=\"shadows\" fill-rule=\"evenodd\" stroke=\"none\">\n<path id=\"shadow-3\" fill=\"#{r:02x}{g:02x}{b:02x}\" \
             d=\"M1,10L4,10 4,7Z\"><title>x/lid</title></path>\n</g>\n</svg>\n"
        );
        assert!(svg.ends_with(&group), "{svg}");
        let json = regions_json(&shapes(), Some(&shadows()), &View::ISOMETRIC).unwrap();
        let list = concat!(
            r#""shadows":[{"surface":3,"name":"x/lid","area_mm2":4.5,"loops":[{"page":[[1.0,0.0],[4.0,0.0],[4.0,3.0]],"#,
            r#""uv":[[0.5,0.0],[2.0,0.0],[2.0,1.5]]}]}],"undecided_shadows":[{"page":null,"surface":3,"why":"so"}]}"#,
            "\n"
        );
        assert!(json.ends_with(list), "{json}");
    }

    #[test]
    fn the_fields_of_a_region_are_those_of_the_format() {
        let expected = concat!(
            r#"{"name":"a&b","view":{"eye_direction":[1.0,-1.0,1.0],"up":[0.0,0.0,1.0],"projection":"orthographic"},"#,
            r#""page":{"width_mm":20.0,"height_mm":10.0},"regions":[{"surface":3,"name":"x/lid","area_mm2":6.0,"#,
            r#""loops":[[{"kind":"silhouette","own":true,"page":[[0.0,0.0],[4.0,0.0],[4.0,3.0]],"#,
            r#""uv":[[0.0,0.0],[2.0,0.0],[2.0,1.5]]},{"kind":"boundary","own":false,"page":[[4.0,3.0],[0.0,0.0]],"#,
            r#""uv":[[2.0,1.5],[0.0,0.0]]}]]}],"undecided":[{"page":[1.0,1.0],"surface":null,"why":"so"}]}"#,
            "\n"
        );
        assert_eq!(regions_json(&shapes(), None, &View::ISOMETRIC).unwrap(), expected);
    }
}

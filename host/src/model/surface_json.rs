//! The surface JSON reader.

use std::io::BufRead;

use glam::DVec4;
use penvis_core::nurbs::{Curve, KnotVector, NurbsError, Surface};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::trim::Trims;
use serde::Deserialize;
use serde_path_to_error::{Path, Segment};

use super::fault::Fault;
use super::format::ModelFormat;
use super::import::Import;
use super::view::{View, ViewJson};

/// Surfaces with their control points, knots and trims, as JSON.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "surface JSON",
    extensions: &["json"],
    looks_like: |source| source.head().trim_ascii_start().first() == Some(&b'{'),
    read: |source, _| {
        let stem = source.stem().to_owned();
        let (scene, view) = read(source.text()?, &stem)?;
        Ok(Import { scene, view, ..Import::default() })
    },
};

#[derive(Deserialize)]
struct FileJson {
    name: Option<String>,
    surfaces: Vec<SurfaceJson>,
    view: Option<ViewJson>,
}

#[derive(Deserialize)]
struct SurfaceJson {
    name: Option<String>,
    degree_u: usize,
    degree_v: usize,
    knots_u: Vec<f64>,
    knots_v: Vec<f64>,
    control_points: Vec<Vec<[f64; 4]>>,
    trim_loops: Option<Vec<Vec<TrimCurveJson>>>,
}

#[derive(Deserialize)]
struct TrimCurveJson {
    degree: usize,
    knots: Vec<f64>,
    control_points: Vec<[f64; 3]>,
}

/// A fault in a field of a surface, or of the file.
fn fault(surface: Option<usize>, field: &str, problem: String) -> Fault {
    let place = match (surface, field) {
        (None, field) => field.to_owned(),
        (Some(surface), "") => format!("surface {surface}"),
        (Some(surface), field) => format!("surface {surface}: {field}"),
    };
    Fault { place, problem }
}

/// The scene and the view of a surface JSON file. `stem` names the model when the file does not.
///
/// Keys that are not known are ignored. An empty list of trim loops keeps the whole surface, as none does.
///
/// # Errors
/// The first [`Fault`], whatever the bytes are.
fn read(text: impl BufRead, stem: &str) -> Result<(Scene, Option<View>), Fault> {
    let mut json = serde_json::Deserializer::from_reader(text);
    let file: FileJson = serde_path_to_error::deserialize(&mut json).map_err(|e| fault_of_path(e.path(), e.inner()))?;
    json.end().map_err(|e| Fault::whole(e.to_string()))?;
    if file.surfaces.is_empty() {
        return Err(Fault::at("surfaces", "is empty; a model has a surface or more"));
    }
    let view = file.view.map(View::from);
    if let Some(view) = &view {
        view.camera().map_err(|e| Fault::at("view", e.to_string()))?;
    }
    let mut surfaces = Vec::with_capacity(file.surfaces.len());
    for (index, surface) in file.surfaces.into_iter().enumerate() {
        let name = surface.name.clone().unwrap_or_else(|| format!("surface {index}"));
        let fault = |(field, problem): (String, String)| fault(Some(index), &field, problem);
        let (surface, trims) = checked(surface).map_err(fault)?;
        surfaces.push(SceneSurface { trims, ..SceneSurface::new(name, surface) });
    }
    Ok((Scene { name: file.name.unwrap_or_else(|| stem.to_owned()), surfaces }, view))
}

/// The path `surfaces[3].knots_u[5]` as surface and field.
fn fault_of_path(path: &Path, error: &serde_json::Error) -> Fault {
    let segments: Vec<_> = path.iter().collect();
    let (surface, rest) = match segments.as_slice() {
        [Segment::Map { key }, Segment::Seq { index }, rest @ ..] if key == "surfaces" => (Some(*index), rest),
        all => (None, all),
    };
    let mut field = String::new();
    for segment in rest {
        match segment {
            Segment::Seq { index } => field.push_str(&format!("[{index}]")),
            Segment::Map { key: name } | Segment::Enum { variant: name } => {
                if !field.is_empty() {
                    field.push('.');
                }
                field.push_str(name);
            }
            // What stands there could not be told.
            Segment::Unknown => {}
        }
    }
    fault(surface, &field, error.to_string())
}

/// The checked surface and its trims, or the field and what is wrong with it.
fn checked(json: SurfaceJson) -> Result<(Surface, Option<Trims>), (String, String)> {
    let fault = |field: &str, problem: String| Err((field.to_owned(), problem));
    let knots_u = knots(json.knots_u, json.degree_u, "u")?;
    let knots_v = knots(json.knots_v, json.degree_v, "v")?;
    let (nu, nv) = (knots_u.control_count(), knots_v.control_count());
    if json.control_points.len() != nu {
        return fault(
            "control_points",
            format!(
                "has {} rows, but knots_u and degree_u ask for {nu} (knots − degree − 1)",
                json.control_points.len()
            ),
        );
    }
    let mut points = Vec::with_capacity(nu * nv);
    for (iu, row) in json.control_points.into_iter().enumerate() {
        if row.len() != nv {
            return fault(
                &format!("control_points[{iu}]"),
                format!("has {} points, but knots_v and degree_v ask for {nv} (knots − degree − 1)", row.len()),
            );
        }
        points.extend(row.into_iter().map(DVec4::from));
    }
    let surface = Surface::new(knots_u, knots_v, points).map_err(|error| match error {
        NurbsError::Weight { index, weight } => (
            format!("control_points[{}][{}]", index / nv, index % nv),
            format!("has weight {weight}; weights must be positive and finite"),
        ),
        NurbsError::PointNotFinite { index } => (
            format!("control_points[{}][{}]", index / nv, index % nv),
            "overflows with its weight; make coordinates or weight smaller".into(),
        ),
        other => ("control_points".into(), other.to_string()),
    })?;
    let loops = json.trim_loops.filter(|loops| !loops.is_empty());
    let trims = loops.map(|loops| trims(loops, &surface)).transpose()?;
    Ok((surface, trims))
}

/// The checked trims, or the field and what is wrong with it.
fn trims(loops: Vec<Vec<TrimCurveJson>>, surface: &Surface) -> Result<Trims, (String, String)> {
    let mut all = Vec::with_capacity(loops.len());
    for (index, curves) in loops.into_iter().enumerate() {
        let curve = |(k, json)| trim_curve(json, &format!("trim_loops[{index}][{k}]"));
        all.push(curves.into_iter().enumerate().map(curve).collect::<Result<Vec<Curve>, _>>()?);
    }
    Trims::new(surface, &all).map_err(|error| {
        let field = match error.place() {
            (Some(index), Some(curve)) => format!("trim_loops[{index}][{curve}]"),
            (Some(index), None) => format!("trim_loops[{index}]"),
            (None, _) => "trim_loops".to_owned(),
        };
        (field, error.to_string())
    })
}

/// One trim curve, a curve of (u, v, 0); `place` is where it stands in the surface.
fn trim_curve(json: TrimCurveJson, place: &str) -> Result<Curve, (String, String)> {
    let knots = KnotVector::new(json.knots, json.degree)
        .map_err(|error| (format!("{place}.{}", knot_field(&error, "degree", "knots")), error.to_string()))?;
    let expected = knots.control_count();
    if json.control_points.len() != expected {
        let count = json.control_points.len();
        return Err((
            format!("{place}.control_points"),
            format!("has {count} points, but knots and degree ask for {expected} (knots − degree − 1)"),
        ));
    }
    let points = json.control_points.into_iter().map(|[u, v, w]| DVec4::new(u, v, 0.0, w)).collect();
    Curve::new(knots, points).map_err(|error| match error {
        NurbsError::Weight { index, weight } => (
            format!("{place}.control_points[{index}]"),
            format!("has weight {weight}; weights must be positive and finite"),
        ),
        NurbsError::PointNotFinite { index } => (
            format!("{place}.control_points[{index}]"),
            "overflows with its weight; make coordinates or weight smaller".into(),
        ),
        other => (format!("{place}.control_points"), other.to_string()),
    })
}

fn knots(knots: Vec<f64>, degree: usize, direction: &str) -> Result<KnotVector, (String, String)> {
    let names = [format!("degree_{direction}"), format!("knots_{direction}")];
    KnotVector::new(knots, degree).map_err(|error| (knot_field(&error, &names[0], &names[1]), error.to_string()))
}

/// The field that an error in a knot vector is about, of those for the degree and for the knots.
fn knot_field(error: &NurbsError, degree: &str, knots: &str) -> String {
    match error {
        NurbsError::Degree { .. } => degree.to_owned(),
        NurbsError::KnotNotFinite { index, .. }
        | NurbsError::KnotDecreases { index, .. }
        | NurbsError::Multiplicity { index, .. } => format!("{knots}[{index}]"),
        _ => knots.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::{Value, json};

    use super::*;

    fn bilinear() -> Value {
        json!({"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
               "control_points": [[[0, 0, 0, 1], [0, 1, 0, 1]], [[1, 0, 0, 1], [1, 1, 1, 2]]]})
    }

    fn model() -> Value {
        json!({"name": "m", "extra": {"kept": false}, "surfaces": [bilinear(), bilinear()],
               "view": {"eye_direction": [1.0, -1.6, 0.75], "up": [0, 0, 1], "projection": "orthographic"}})
    }

    fn read_value(value: &Value) -> Result<(Scene, Option<View>), Fault> {
        read(value.to_string().as_bytes(), "file")
    }

    #[test]
    fn a_model_is_read_with_its_view() {
        let (scene, view) = read_value(&model()).unwrap();
        assert_eq!((scene.name.as_str(), scene.surfaces.len()), ("m", 2));
        assert_eq!(scene.surfaces[1].name, "surface 1");
        // At the far corner the weight is 2, and the point is not multiplied by it.
        assert_eq!(scene.surfaces[0].surface.eval(1.0, 1.0), glam::DVec3::ONE);
        assert_eq!(view.unwrap().eye_direction.y, -1.6);
        let bare = json!({"surfaces": [bilinear()]});
        let (scene, view) = read_value(&bare).unwrap();
        assert_eq!((scene.name.as_str(), view), ("file", None));
    }

    #[test]
    fn faults_name_the_surface_and_the_field() {
        type Case = (&'static str, Value, &'static [&'static str]);
        let table: &[Case] = &[
            ("/surfaces/1/knots_u/2", json!(-1), &["surface 1: knots_u[2]: ", "less than"]),
            ("/surfaces/1/knots_v", json!([0, 0, 1]), &["surface 1: knots_v: "]),
            ("/surfaces/1/knots_v", json!([0, 0, 0, 1]), &["surface 1: knots_v: ", "domain"]),
            (
                "/surfaces/1/knots_v",
                json!([0, 0, 0.5, 1, 1]),
                &["surface 1: control_points[0]: has 2 points", "ask for 3"],
            ),
            ("/surfaces/0/knots_u", json!([0, 0, 0.5, 1, 1]), &["surface 0: control_points: has 2 rows"]),
            ("/surfaces/0/knots_u/1", json!("a"), &["surface 0: knots_u[1]: ", "invalid type", "line 1 column"]),
            ("/surfaces/1/degree_u", json!(0), &["surface 1: degree_u: "]),
            ("/surfaces/1/degree_u", json!(-3), &["surface 1: degree_u: "]),
            ("/surfaces/1/degree_v", json!(4_000_000_000_u64), &["surface 1: degree_v: "]),
            ("/surfaces/1/control_points/1", json!([[1, 0, 0, 1]]), &["surface 1: control_points[1]: has 1 points"]),
            ("/surfaces/1/control_points/1/0", json!([1, 0, 0]), &["surface 1: control_points[1][0]", "4"]),
            ("/surfaces/1/control_points/1/0/3", json!(0), &["surface 1: control_points[1][0]: has weight 0"]),
            ("/surfaces/1/control_points/0/1/3", json!(-2.5), &["surface 1: control_points[0][1]: has weight -2.5"]),
            ("/surfaces/1/control_points", json!([]), &["surface 1: control_points: has 0 rows"]),
            ("/surfaces/1", json!({"degree_u": 1}), &["surface 1: ", "missing field"]),
            ("/surfaces", json!([]), &["surfaces: is empty"]),
            ("/view/up", json!([1.0, -1.6, 0.75]), &["view: ", "parallel"]),
            ("/view/projection", json!("fisheye"), &["view.projection", "fisheye"]),
            ("/view/eye_direction", json!([0, 0, 0]), &["view: ", "no direction"]),
        ];
        for (place, value, words) in table {
            let mut model = model();
            *model.pointer_mut(place).unwrap() = value.clone();
            let message = read_value(&model).unwrap_err().to_string();
            for word in *words {
                assert!(message.contains(word), "{place} = {value} gave {message:?}, without {word:?}");
            }
        }
    }

    #[test]
    fn overflow_is_refused_where_it_is() {
        let text = model().to_string().replacen("[1,1,1,2]", "[1,1e999,1,2]", 1);
        let message = read(text.as_bytes(), "file").unwrap_err().to_string();
        assert!(
            message.starts_with("surface 0: control_points[1][1]") && message.contains("out of range"),
            "{message}"
        );
        let text = model().to_string().replacen("[1,1,1,2]", "[1,1e308,1,2]", 1);
        let message = read(text.as_bytes(), "file").unwrap_err().to_string();
        assert!(message.starts_with("surface 0: control_points[1][1]: overflows"), "{message}");
    }

    #[test]
    fn syntax_errors_have_line_and_column() {
        for bad in ["", "{", "[1]", "nul", "{\"surfaces\": [{]}", "\u{feff}{}", &"[".repeat(100_000)] {
            let message = read(bad.as_bytes(), "file").unwrap_err().to_string();
            assert!(message.contains("line 1 column"), "{message}");
            assert!(!message.contains('\n'));
        }
        let twice = format!("{}\n{{}}", model());
        assert!(read(twice.as_bytes(), "file").unwrap_err().to_string().contains("line 2 column 1"));
    }

    #[test]
    fn words_of_the_file_do_not_break_the_line() {
        let mut model = model();
        model["view"]["projection"] = json!(format!("fish\neye \u{1b}[31m{}", "x".repeat(10_000)));
        let message = read_value(&model).unwrap_err().to_string();
        assert!(message.starts_with("view.projection: unknown variant `fish eye [31mxxx"), "{message}");
        assert!(!message.contains(char::is_control) && message.chars().count() < 1000, "{message}");
    }

    /// A triangle in two curves, the second of them rational.
    fn triangle() -> Value {
        json!([
            {"degree": 1, "knots": [0, 0, 1, 2, 2], "control_points": [[0.5, 0.75, 1], [0.25, 0.25, 1], [0.75, 0.25, 1]]},
            {"degree": 2, "knots": [0, 0, 0, 1, 1, 1],
             "control_points": [[0.75, 0.25, 1], [0.75, 0.5, 2], [0.5, 0.75, 1]]}
        ])
    }

    #[test]
    fn trim_loops_are_read_and_empty_ones_are_none() {
        let mut model = model();
        model["surfaces"][0]["trim_loops"] = json!([]);
        model["surfaces"][1]["trim_loops"] = json!([triangle()]);
        let (scene, _) = read_value(&model).unwrap();
        assert!(scene.surfaces[0].trims.is_none());
        let trims = scene.surfaces[1].trims.as_ref().unwrap();
        assert_eq!(trims.loops().len(), 1);
        assert_eq!(trims.bounds().0.to_array(), [0.25, 0.25]);
    }

    #[test]
    fn what_is_wrong_with_a_trim_loop_is_named() {
        let found = |pointer: &str, value: Value| {
            let mut model = model();
            model["surfaces"][1]["trim_loops"] = json!([triangle(), triangle()]);
            *model.pointer_mut(&format!("/surfaces/1/trim_loops{pointer}")).unwrap() = value;
            read_value(&model).unwrap_err().to_string()
        };
        let begins = |pointer: &str, value: Value, place: &str| {
            let message = found(pointer, value);
            assert!(message.starts_with(&format!("surface 1: trim_loops{place}: ")), "{message}");
        };
        begins("/1/0/degree", json!(0), "[1][0].degree");
        begins("/1/0/knots/1", json!(3), "[1][0].knots[2]");
        begins("/1/1/control_points", json!([[0, 0, 1]]), "[1][1].control_points");
        begins("/1/1/control_points/1/2", json!(-1), "[1][1].control_points[1]");
        begins("/1/1/control_points/2/0", json!(0.6), "[1][1]");
        begins("/1/0/control_points/1/0", json!(-0.25), "[1][0]");
        begins("/1", json!([]), "[1]");
        begins("/1/0/control_points/1", json!("a"), "[1][0].control_points[1]");
    }

    /// Every place of a JSON value, as pointers.
    fn places(value: &Value, at: &str, out: &mut Vec<String>) {
        out.push(at.to_owned());
        match value {
            Value::Array(items) => items.iter().enumerate().for_each(|(k, v)| places(v, &format!("{at}/{k}"), out)),
            Value::Object(items) => items.iter().for_each(|(k, v)| places(v, &format!("{at}/{k}"), out)),
            _ => {}
        }
    }

    fn junk() -> impl Strategy<Value = Value> {
        prop_oneof![
            Just(Value::Null),
            Just(json!([])),
            Just(json!({})),
            Just(json!([[[[]]]])),
            Just(json!("perspective")),
            any::<bool>().prop_map(Value::from),
            any::<i64>().prop_map(Value::from),
            any::<f64>().prop_map(|x| json!(x)),
            prop::sample::select(vec![0.0, -0.0, 1.0, 1e308, -1e308, 5e-324, f64::EPSILON]).prop_map(|x| json!(x)),
            prop::collection::vec(-2.0..2.0, 0..9).prop_map(|x| json!(x)),
        ]
    }

    proptest! {
        #[test]
        fn mutated_models_never_panic(mutations in prop::collection::vec((any::<prop::sample::Index>(), junk()), 1..4)) {
            let mut model = model();
            model["surfaces"][0]["trim_loops"] = json!([triangle()]);
            for (index, junk) in mutations {
                let mut all = Vec::new();
                places(&model, "", &mut all);
                *model.pointer_mut(&all[index.index(all.len())]).unwrap() = junk;
            }
            let _ = read_value(&model);
        }

        #[test]
        fn mutated_bytes_never_panic(
            at in any::<prop::sample::Index>(), len in 0_usize..40, with in prop::collection::vec(any::<u8>(), 0..20)
        ) {
            let mut model = model();
            model["surfaces"][0]["trim_loops"] = json!([triangle()]);
            let mut bytes = model.to_string().into_bytes();
            let at = at.index(bytes.len());
            let end = (at + len).min(bytes.len());
            bytes.splice(at..end, with);
            let _ = read(&*bytes, "file");
        }
    }
}

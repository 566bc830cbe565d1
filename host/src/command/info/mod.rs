//! `penvis info`: what a model or a drawing holds.

mod drawing;
mod facts;

use std::fmt::Write as _;

use glam::DVec3;
use penvis_core::stop::Stop;
use serde::Serialize;

use self::drawing::DrawingFacts;
use self::facts::{EdgeCount, Facts, FileFacts, Named};
use crate::builtin;
use crate::compute;
use crate::error::Error;
use crate::interrupt;
use crate::model::{Model, Projection, View};
use crate::progress::Progress;
use crate::redraw;

/// Tells what models or drawings hold, or lists the built-in models.
#[derive(Clone, Debug, clap::Args)]
pub struct InfoArgs {
    /// Built-in models, model files or scenes, of which several are taken as one scene; or drawings, of which each is told by itself
    #[arg(required_unless_present = "list", value_name = "MODEL|DRAWING")]
    pub models: Vec<String>,
    /// List the built-in models
    #[arg(long, conflicts_with = "models")]
    pub list: bool,
    /// Say it in JSON, for other programs
    #[arg(long, conflicts_with = "list")]
    pub json: bool,
}

/// Prints what was asked for.
///
/// # Errors
/// If a model cannot be read, Ctrl-C ends it, or output fails.
pub fn run(args: &InfoArgs) -> Result<(), Error> {
    if args.list {
        return Ok(super::print(&list())?);
    }
    if let Some(drawings) = redraw::drawings(&args.models)? {
        let facts: Vec<_> =
            drawings.iter().map(|(path, format)| DrawingFacts::of(path, *format)).collect::<Result<_, Error>>()?;
        let text = match &facts[..] {
            [facts] if args.json => json(facts)?,
            facts if args.json => json(facts)?,
            facts => facts.iter().map(DrawingFacts::describe).collect(),
        };
        return Ok(super::print(&text)?);
    }
    let progress = Progress::start();
    let model = compute::read(&args.models, None, None, &progress)?;
    progress.stage("looking for open edges");
    let facts = facts(&model)?;
    drop(progress);
    let text = if args.json { json(&facts)? } else { describe(&facts) };
    Ok(super::print(&text)?)
}

/// Most names that the text lists; what is longer is for programs.
const MOST_NAMES: usize = 100;

fn facts(model: &Model) -> Result<Facts, Error> {
    Facts::of(model, Stop::when(&interrupt::is_wanted))
        .map_err(|_| Error::Interrupted { doing: "looking for open edges".into() })
}

fn json(facts: &(impl Serialize + ?Sized)) -> Result<String, Error> {
    let text = serde_json::to_string_pretty(facts).map_err(std::io::Error::from)?;
    Ok(text + "\n")
}

fn list() -> String {
    let width = builtin::names().map(|(name, _)| name.len()).max().unwrap_or(0);
    builtin::names().map(|(name, description)| format!("{name:width$}  {description}\n")).collect()
}

/// A line of the description: a word and what it says.
fn line(text: &mut String, word: &str, what: impl std::fmt::Display) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{word:9} {what}");
}

fn describe(facts: &Facts) -> String {
    let mut text =
        format!("{}: {}, {}\n", facts.name, count(facts.surfaces, "surface"), count(facts.patches, "Bézier patch"));
    for file in &facts.files {
        describe_file(&mut text, file, facts.files.len() > 1);
    }
    for d in &facts.degrees {
        let rational = if d.rational { "rational" } else { "polynomial" };
        let (members, pieces) = (count(d.surfaces, "surface"), count(d.patches, "patch"));
        line(&mut text, "degree", format!("{} × {}, {rational}: {members}, {pieces}", d.degree_u, d.degree_v));
    }
    if facts.trimmed.surfaces > 0 {
        let (members, loops) = (count(facts.trimmed.surfaces, "surface"), count(facts.trimmed.loops, "loop"));
        line(&mut text, "trimmed", format!("{members}, by {loops}"));
    }
    if facts.facets > 0 {
        line(&mut text, "mesh", count(facts.facets, "facet"));
    }
    if let Some(extent) = facts.extent {
        for (axis, k) in [("x", 0), ("y", 1), ("z", 2)] {
            line(
                &mut text,
                &format!("extent {axis}"),
                format!("{} to {}", short(extent.low[k]), short(extent.high[k])),
            );
        }
    }
    if let Some(edges) = &facts.edges {
        let mut of = String::new();
        if edges.open.count > 0 {
            of = format!(", of {}", count(edges.open_surfaces.len(), "surface"));
        }
        line(&mut text, "open", format!("{}{of}", edge_count(edges.open)));
        line(
            &mut text,
            "shared",
            format!("{} at an angle; {} without", edge_count(edges.sharp), edge_count(edges.smooth)),
        );
    }
    let own = if facts.view_is_own { "" } else { "none stored; iso is used: " };
    line(&mut text, "view", format!("{own}{}", view(&facts.view.clone().into())));
    for Named { name, first, last } in facts.names.iter().take(MOST_NAMES) {
        let surfaces = if first == last { format!("surface {first}") } else { format!("surfaces {first} to {last}") };
        line(&mut text, "name", format!("{surfaces}: {name}"));
    }
    if facts.names.len() > MOST_NAMES {
        line(&mut text, "name", format!("{} more; --json lists all", facts.names.len() - MOST_NAMES));
    }
    let in_files: usize = facts.files.iter().map(|file| file.problems.len()).sum();
    if facts.problems.is_empty() && in_files == 0 {
        line(&mut text, "problems", "none");
    }
    for problem in &facts.problems {
        line(&mut text, "problem", problem);
    }
    text
}

/// What the reader of a file says; with its surfaces if it is one of `several`.
fn describe_file(text: &mut String, file: &FileFacts, several: bool) {
    let mut about = format!("{}: {}", file.file, file.format);
    if several && file.surfaces > 0 {
        let last = file.first_surface + file.surfaces - 1;
        let _ = write!(about, ", surfaces {} to {last}", file.first_surface);
    }
    match &file.unit {
        Some(unit) => {
            let _ = write!(about, ", lengths in {unit}, mm here");
        }
        None => about.push_str(", no unit of length"),
    }
    line(text, "file", about);
    let of = if several { format!("{}: ", file.file) } else { String::new() };
    for (kind, number) in &file.kinds {
        line(text, "kind", format!("{of}{kind}: {number}"));
    }
    for healed in &file.healed {
        line(text, "healed", format!("{of}{healed}"));
    }
    for (what, number) in &file.skipped {
        line(text, "skipped", format!("{of}{what}: {number}, not understood"));
    }
    for problem in &file.problems {
        line(text, "problem", format!("{of}{problem}"));
    }
}

/// A number of edges with their length.
fn edge_count(edges: EdgeCount) -> String {
    match edges.count {
        0 => "no edges".to_owned(),
        n => format!("{} {} long in all", count(n, "edge"), short(edges.length)),
    }
}

fn count(n: usize, what: &str) -> String {
    let plural = match (n, what.ends_with("ch")) {
        (1, _) => "",
        (_, true) => "es",
        (_, false) => "s",
    };
    format!("{n} {what}{plural}")
}

/// A number with six digits at most.
fn short(x: f64) -> String {
    let text = format!("{x:.5}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn triple(p: DVec3) -> String {
    format!("({}, {}, {})", short(p.x), short(p.y), short(p.z))
}

fn view(view: &View) -> String {
    let up = triple(view.up);
    match view.projection {
        Projection::Orthographic => format!("parallel, eye direction {}, up {up}", triple(view.eye_direction)),
        Projection::Perspective { eye, target } => {
            format!("perspective, eye {}, target {}, up {up}", triple(eye), triple(target))
        }
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::nurbs::Curve;
    use penvis_core::shape::polyline;
    use penvis_core::trim::Trims;

    use super::*;
    use crate::model::{self, Reading};
    use penvis_core::scene::SceneSurface;

    fn loaded(names: &[&str]) -> Model {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        model::load(&names, &Reading::new(&())).unwrap()
    }

    fn told(names: &[&str]) -> String {
        describe(&facts(&loaded(names)).unwrap())
    }

    #[test]
    fn the_list_has_every_model() {
        assert_eq!(list().lines().count(), builtin::names().count());
        assert!(list().contains("teapot"));
    }

    #[test]
    fn a_model_is_described() {
        let text = told(&["saddle"]);
        assert!(
            text.starts_with("saddle: 1 surface, 1 Bézier patch\ndegree    3 × 3, polynomial: 1 surface, 1 patch\n"),
            "{text}"
        );
        assert!(text.contains("\nextent x  -1 to 1\n") && text.ends_with("problems  none\n"), "{text}");
        assert!(text.contains("parallel, eye direction"), "{text}");
    }

    #[test]
    fn a_surface_that_is_there_twice_is_a_problem() {
        let text = told(&["saddle", "saddle"]);
        assert!(text.contains("problem   surface 1 is the same as surface 0"), "{text}");
    }

    #[test]
    fn trims_are_counted_and_parts_of_one_surface_are_no_problem() {
        let mut model = loaded(&["box"]);
        let surface = model.scene.surfaces[0].surface.clone();
        let triangle = |x: f64| {
            let corners = [[x, 0.1], [x + 0.3, 0.1], [x, 0.9], [x, 0.1]].map(|c| DVec3::new(c[0], c[1], 0.0));
            vec![polyline(&corners).unwrap()]
        };
        let part = |loops: &[Vec<Curve>]| SceneSurface {
            trims: Some(Trims::new(&surface, loops).unwrap()),
            ..SceneSurface::new("part", surface.clone())
        };
        model.scene.surfaces = vec![part(&[triangle(0.1), triangle(0.6)]), part(&[triangle(0.3)])];
        let text = describe(&facts(&model).unwrap());
        assert!(text.contains("\ntrimmed   2 surfaces, by 3 loops\n") && text.ends_with("problems  none\n"), "{text}");
        model.scene.surfaces.push(part(&[triangle(0.3)]));
        assert!(describe(&facts(&model).unwrap()).contains("surface 2 is the same as surface 1"));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([short(-0.000001), short(100.0), short(1.0 / 3.0), short(-2.5)], ["0", "100", "0.33333", "-2.5"]);
    }

    #[test]
    fn edges_are_open_sharp_or_smooth_and_have_their_lengths() {
        use std::f64::consts::PI;
        let edges = |name: &str| facts(&loaded(&[name])).unwrap().edges.unwrap();
        let cube = edges("box");
        assert_eq!([cube.open.count, cube.sharp.count, cube.smooth.count], [0, 12, 0]);
        assert!((cube.sharp.length - 4.0 * (3.0 + 2.0 + 1.5)).abs() < 1e-12, "{}", cube.sharp.length);
        // Two rims of four quarters each, and the seams of side and lids.
        let can = edges("cylinder");
        assert_eq!(can.open.count, 0);
        assert!((can.sharp.length - 4.0 * PI).abs() < 1e-9 && (can.smooth.length - 4.5).abs() < 1e-9, "{can:?}");
        let saddle = edges("saddle");
        assert_eq!((saddle.open.count, saddle.open_surfaces.as_slice()), (4, &[0][..]));
        // Each side is a parabola of height 1 over a base of 2: √5 + asinh(2) / 2.
        let side = 5_f64.sqrt() + 0.5 * 2_f64.asinh();
        assert!((saddle.open.length - 4.0 * side).abs() < 1e-6, "{} {side}", saddle.open.length);
        assert!(told(&["saddle"]).contains("open      4 edges 11.8"), "{}", told(&["saddle"]));
    }

    #[test]
    fn the_extent_is_that_of_the_surfaces_and_not_of_their_control_points() {
        let text = told(&["torus"]);
        assert!(text.contains("extent x  -4 to 4\nextent y  -4 to 4\nextent z  -1 to 1\n"), "{text}");
    }

    #[test]
    fn what_is_said_is_the_same_in_json() {
        let facts = facts(&loaded(&["teapot"])).unwrap();
        let value: serde_json::Value = serde_json::from_str(&json(&facts).unwrap()).unwrap();
        assert_eq!((&value["surfaces"], &value["degrees"][0]["degree_u"]), (&32.into(), &3.into()));
        assert_eq!(value["files"], serde_json::json!([]));
        assert!(value["edges"]["open"]["length"].as_f64().unwrap() > 0.0);
        assert_eq!(value["view"]["projection"], "orthographic");
    }
}

//! `penvis info`: what a model holds.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::DVec3;
use penvis_core::nurbs::Surface;
use penvis_core::scene::SceneSurface;

use crate::builtin;
use crate::error::Error;
use crate::model::{self, Model, Projection, Reading, View};

/// Tells what models hold, or lists the built-in ones.
#[derive(Clone, Debug, clap::Args)]
pub struct InfoArgs {
    /// Built-in models or model files; several are taken as one scene
    #[arg(required_unless_present = "list", value_name = "MODEL")]
    pub models: Vec<String>,
    /// List the built-in models
    #[arg(long, conflicts_with = "models")]
    pub list: bool,
}

/// Prints what was asked for.
///
/// # Errors
/// If a model cannot be read, or output fails.
pub fn run(args: &InfoArgs) -> Result<(), Error> {
    let text = if args.list { list() } else { describe(&model::load(&args.models, &Reading::new(&()))?) };
    Ok(super::print(&text)?)
}

fn list() -> String {
    let width = builtin::names().map(|(name, _)| name.len()).max().unwrap_or(0);
    builtin::names().map(|(name, description)| format!("{name:width$}  {description}\n")).collect()
}

/// What a group of surfaces has in common: degrees, and whether it is rational.
type Sort = (usize, usize, bool);

fn describe(model: &Model) -> String {
    let surfaces: Vec<&Surface> = model.scene.surfaces.iter().map(|s| &s.surface).collect();
    let patches = |s: &Surface| (s.knots_u().breaks().len() - 1) * (s.knots_v().breaks().len() - 1);
    let total: usize = surfaces.iter().map(|s| patches(s)).sum();
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ =
        writeln!(text, "{}: {}, {}", model.scene.name, count(surfaces.len(), "surface"), count(total, "Bézier patch"));

    let mut sorts: BTreeMap<Sort, (usize, usize)> = BTreeMap::new();
    for s in &surfaces {
        let entry = sorts.entry((s.degree_u(), s.degree_v(), is_rational(s))).or_default();
        *entry = (entry.0 + 1, entry.1 + patches(s));
    }
    for ((u, v, rational), (members, pieces)) in sorts {
        let rational = if rational { "rational" } else { "polynomial" };
        let (members, pieces) = (count(members, "surface"), count(pieces, "patch"));
        let _ = writeln!(text, "degree    {u} × {v}, {rational}: {members}, {pieces}");
    }
    let trims: Vec<usize> =
        model.scene.surfaces.iter().filter_map(|s| s.trims.as_ref()).map(|t| t.loops().len()).collect();
    if !trims.is_empty() {
        let (members, loops) = (count(trims.len(), "surface"), count(trims.iter().sum(), "loop"));
        let _ = writeln!(text, "trimmed   {members}, by {loops}");
    }
    let (low, high) = control_box(surfaces.iter().copied());
    for (axis, k) in [("x", 0), ("y", 1), ("z", 2)] {
        let _ = writeln!(text, "control {axis} {} to {}", short(low[k]), short(high[k]));
    }
    let _ = writeln!(text, "view      {}", model.view.as_ref().map_or("none stored; iso is used".to_owned(), view));
    for (index, part) in model.scene.surfaces.iter().enumerate() {
        if part.name != format!("surface {index}") {
            let _ = writeln!(text, "name      surface {index}: {}", part.name);
        }
    }
    let problems = problems(&model.scene.surfaces);
    if problems.is_empty() {
        text.push_str("problems  none\n");
    }
    for problem in problems {
        let _ = writeln!(text, "problem   {problem}");
    }
    text
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

fn is_rational(surface: &Surface) -> bool {
    let weights = || surface.homogeneous().iter().map(|h| h.w);
    weights().any(|w| Some(w) != weights().next())
}

fn control_points(surface: &Surface) -> impl Iterator<Item = DVec3> {
    surface.homogeneous().iter().map(|h| h.truncate() / h.w)
}

fn control_box<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> (DVec3, DVec3) {
    surfaces
        .flat_map(control_points)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// What is legal, and still not likely meant.
fn problems(parts: &[SceneSurface]) -> Vec<String> {
    let mut found = Vec::new();
    let mut seen: BTreeMap<Vec<u64>, Vec<usize>> = BTreeMap::new();
    for (index, SceneSurface { surface, trims, .. }) in parts.iter().enumerate() {
        let (low, high) = control_box(std::iter::once(surface));
        if low == high {
            found.push(format!("surface {index} is the single point {}; remove it", triple(low)));
        }
        // Bits, because numbers have no total order; two zeros that differ in sign are not worth a rule.
        let bits = |x: &f64| x.to_bits();
        let mut key: Vec<u64> = surface.homogeneous().iter().flat_map(|h| h.to_array()).map(|x| bits(&x)).collect();
        key.extend(surface.knots_u().as_slice().iter().chain(surface.knots_v().as_slice()).map(bits));
        let alike = seen.entry(key).or_default();
        match alike.iter().find(|&&first| parts[first].trims == *trims) {
            Some(first) => found.push(format!("surface {index} is the same as surface {first}; remove one of them")),
            None => alike.push(index),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use penvis_core::nurbs::Curve;
    use penvis_core::shape::polyline;
    use penvis_core::trim::Trims;

    use super::*;

    #[test]
    fn the_list_has_every_model() {
        assert_eq!(list().lines().count(), builtin::names().count());
        assert!(list().contains("teapot"));
    }

    #[test]
    fn a_model_is_described() {
        let text = describe(&model::load(&["saddle".into()], &Reading::new(&())).unwrap());
        assert!(
            text.starts_with("saddle: 1 surface, 1 Bézier patch\ndegree    3 × 3, polynomial: 1 surface, 1 patch\n"),
            "{text}"
        );
        assert!(text.contains("\ncontrol x -1 to 1\n") && text.ends_with("problems  none\n"), "{text}");
        assert!(text.contains("parallel, eye direction"), "{text}");
    }

    #[test]
    fn a_surface_that_is_there_twice_is_a_problem() {
        let text = describe(&model::load(&["saddle".into(), "saddle".into()], &Reading::new(&())).unwrap());
        assert!(text.contains("problem   surface 1 is the same as surface 0"), "{text}");
    }

    #[test]
    fn trims_are_counted_and_parts_of_one_surface_are_no_problem() {
        let mut model = model::load(&["box".into()], &Reading::new(&())).unwrap();
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
        let text = describe(&model);
        assert!(text.contains("\ntrimmed   2 surfaces, by 3 loops\n") && text.ends_with("problems  none\n"), "{text}");
        model.scene.surfaces.push(part(&[triangle(0.3)]));
        assert!(describe(&model).contains("surface 2 is the same as surface 1"));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([short(-0.000001), short(100.0), short(1.0 / 3.0), short(-2.5)], ["0", "100", "0.33333", "-2.5"]);
    }
}

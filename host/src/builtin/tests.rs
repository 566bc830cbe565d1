use glam::DVec3;

use super::*;

/// An edge of a surface, sampled at equal steps of its parameter.
struct Edge {
    surface: usize,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

/// Two edges in the same place.
struct Join {
    surfaces: (usize, usize),
    /// Largest angle between the tangent planes, in degrees.
    angle: f64,
}

const SAMPLES: u32 = 12;

fn corners(scene: &Scene) -> (DVec3, DVec3) {
    let points = scene.surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// The edges that are no poles.
fn edges(scene: &Scene) -> Vec<Edge> {
    let (low, high) = corners(scene);
    let tiny = 1e-12 * (high - low).length();
    let mut edges = Vec::new();
    for (index, SceneSurface { surface, .. }) in scene.surfaces.iter().enumerate() {
        let ([u0, u1], [v0, v1]) = (surface.domain_u(), surface.domain_v());
        for side in 0..4 {
            let samples = (0..=SAMPLES).map(|k| {
                let s = f64::from(k) / f64::from(SAMPLES);
                let (u, v) = (u0 + s * (u1 - u0), v0 + s * (v1 - v0));
                let (p, du, dv) = match side {
                    0 => surface.derivatives(u0, v),
                    1 => surface.derivatives(u1, v),
                    2 => surface.derivatives(u, v0),
                    _ => surface.derivatives(u, v1),
                };
                (p, du.cross(dv).normalize_or_zero())
            });
            let (points, normals): (Vec<_>, Vec<_>) = samples.unzip();
            if points.iter().any(|p| p.distance(points[0]) > tiny) {
                edges.push(Edge { surface: index, points, normals });
            }
        }
    }
    edges
}

/// The joins of a model, and how many edges are free. Fails if three edges meet in one place.
fn joins(scene: &Scene) -> (Vec<Join>, usize) {
    let (low, high) = corners(scene);
    let tolerance = 4e-15 * (high - low).length();
    let edges = edges(scene);
    let mut joins = Vec::new();
    let mut uses = vec![0; edges.len()];
    for (i, a) in edges.iter().enumerate() {
        for (j, b) in edges.iter().enumerate().skip(i + 1) {
            let count = a.points.len();
            let meets = |index: &dyn Fn(usize) -> usize| {
                (0..count).all(|k| a.points[k].distance(b.points[index(k)]) <= tolerance)
            };
            let angle = |index: &dyn Fn(usize) -> usize| {
                let sine = |k: usize| a.normals[k].cross(b.normals[index(k)]).length();
                (0..count).map(sine).fold(0.0, f64::max).min(1.0).asin().to_degrees()
            };
            let (forwards, backwards) = (|k: usize| k, |k: usize| count - 1 - k);
            let angle = if meets(&forwards) {
                angle(&forwards)
            } else if meets(&backwards) {
                angle(&backwards)
            } else {
                continue;
            };
            uses[i] += 1;
            uses[j] += 1;
            joins.push(Join { surfaces: (a.surface, b.surface), angle });
        }
    }
    assert!(uses.iter().all(|&n| n <= 1), "{}: three edges in one place", scene.name);
    (joins, uses.iter().filter(|&&n| n == 0).count())
}

#[test]
fn every_name_loads_in_any_case_with_a_legal_view() {
    let mut seen = Vec::new();
    for (name, description) in names() {
        let model = load(name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(load(&name.to_uppercase()).as_ref(), Some(&model));
        assert_eq!(model.scene.name, name);
        assert!(!model.scene.surfaces.is_empty() && !description.is_empty() && !description.contains('\n'));
        let camera = model.view.camera().unwrap();
        let (low, high) = corners(&model.scene);
        let size = (high - low).max_element();
        assert!(size.is_finite() && size > 1.0 && size < 100.0, "{name}: {size}");
        for s in &model.scene.surfaces {
            let points = s.surface.homogeneous();
            assert!(points.iter().all(|h| camera.project(h.truncate() / h.w).is_some()), "{name}: {} behind", s.name);
        }
        assert!(!seen.contains(&name));
        seen.push(name);
    }
    assert!(load("no such model").is_none());
}

/// Name, surfaces, Bézier patches, free edges.
const SHAPES: &[(&str, usize, usize, usize)] =
    &[("teapot", 32, 32, 16), ("saddle", 1, 1, 4), ("wiggle", 1, 121, 4), ("discont", 1, 2, 4), ("spring", 96, 96, 8)];

#[test]
fn surfaces_patches_and_free_edges_are_as_designed() {
    for &(name, surfaces, patches, free) in SHAPES {
        let scene = load(name).unwrap().scene;
        let count: usize = scene.surfaces.iter().map(|s| s.surface.bezier_patches(0).len()).sum();
        assert_eq!((scene.surfaces.len(), count, joins(&scene).1), (surfaces, patches, free), "{name}");
    }
    assert_eq!(SHAPES.len(), MODELS.len());
}

#[test]
fn the_spring_is_smooth_across_every_seam() {
    let (joins, _) = joins(&load("spring").unwrap().scene);
    assert_eq!(joins.len(), (4 * 96 - 8) / 2);
    for join in joins {
        assert!(join.angle < 1e-5, "{:?}: {}°", join.surfaces, join.angle);
    }
}

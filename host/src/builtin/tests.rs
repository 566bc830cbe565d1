use glam::DVec3;

use super::*;

/// An edge of a surface, sampled at equal steps of its parameter.
struct Edge {
    surface: usize,
    /// Whether the surface is to the left, seen from its positive side.
    left: bool,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

/// Two edges in the same place.
struct Join {
    surfaces: (usize, usize),
    /// Largest angle between the tangent planes, in degrees.
    angle: f64,
    /// Whether both surfaces have their positive sides on one side.
    oriented: bool,
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
                edges.push(Edge { surface: index, left: side == 1 || side == 2, points, normals });
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
            let (angle, oriented) = if meets(&forwards) {
                (angle(&forwards), a.left != b.left)
            } else if meets(&backwards) {
                (angle(&backwards), a.left == b.left)
            } else {
                continue;
            };
            uses[i] += 1;
            uses[j] += 1;
            joins.push(Join { surfaces: (a.surface, b.surface), angle, oriented });
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
const SHAPES: &[(&str, usize, usize, usize)] = &[
    // The mouth, the rim of the lid, and both ends of handle and spout, which run into the body.
    ("teapot", 32, 32, 16),
    ("pawn", 5, 68, 0),
    ("queen", 8, 92, 0),
    ("rook", 8, 64, 0),
    ("knight", 7, 112, 0),
    ("goblet", 5, 80, 0),
    // The ends of the handles.
    ("vase", 8, 88, 4),
    ("missile", 54, 76, 0),
    ("saddle", 1, 1, 4),
    ("wiggle", 1, 121, 4),
    ("discont", 1, 2, 4),
    ("spring", 96, 96, 8),
    ("sphere", 1, 8, 0),
    ("torus", 1, 16, 0),
    ("linked_tori", 2, 32, 0),
    ("cylinder", 3, 12, 0),
    ("cone", 2, 8, 0),
    ("box", 6, 6, 0),
];

#[test]
fn surfaces_patches_and_free_edges_are_as_designed() {
    for &(name, surfaces, patches, free) in SHAPES {
        let scene = load(name).unwrap().scene;
        let count: usize = scene.surfaces.iter().map(|s| s.surface.bezier_patches(0).len()).sum();
        assert_eq!((scene.surfaces.len(), count, joins(&scene).1), (surfaces, patches, free), "{name}");
    }
    assert_eq!(SHAPES.len(), MODELS.len());
}

/// Volume by the divergence theorem, from `n` × `n` facets a surface.
fn volume(scene: &Scene) -> f64 {
    const N: u32 = 40;
    let mut volume = 0.0;
    for SceneSurface { surface, .. } in &scene.surfaces {
        let ([u0, u1], [v0, v1]) = (surface.domain_u(), surface.domain_v());
        let at = |i: u32, j: u32| {
            let (s, t) = (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
            surface.eval(u0 + s * (u1 - u0), v0 + t * (v1 - v0))
        };
        for i in 0..N {
            for j in 0..N {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                volume += (a.dot(b.cross(c)) + a.dot(c.cross(d))) / 6.0;
            }
        }
    }
    volume
}

#[test]
fn positive_sides_agree_and_point_out_of_solids() {
    for &(name, .., free) in SHAPES {
        let scene = load(name).unwrap().scene;
        assert!(joins(&scene).0.iter().all(|join| join.oriented), "{name}");
        if free == 0 {
            assert!(volume(&scene) > 0.0, "{name}");
        }
    }
    let expect = |name: &str, volume_expected: f64| {
        let v = volume(&load(name).unwrap().scene);
        assert!((v / volume_expected - 1.0).abs() < 0.02, "{name}: {v}, not {volume_expected}");
    };
    use std::f64::consts::PI;
    expect("sphere", PI * 4.0 / 3.0);
    expect("torus", 2.0 * PI * PI * 3.0);
    expect("linked_tori", 2.0 * 2.0 * PI * PI * 3.0 * 0.64);
    expect("cylinder", PI * 2.5);
    expect("cone", PI * 0.8);
    expect("box", 9.0);
}

fn index(scene: &Scene, name: &str) -> usize {
    scene.surfaces.iter().position(|s| s.name == name).unwrap()
}

/// Largest angle between two surfaces along their joins, in degrees.
fn angle_between(model: &str, a: &str, b: &str) -> f64 {
    let scene = load(model).unwrap().scene;
    let pair = (index(&scene, a), index(&scene, b));
    let between = |join: &&Join| join.surfaces == pair || join.surfaces == (pair.1, pair.0);
    let angles: Vec<f64> = joins(&scene).0.iter().filter(between).map(|join| join.angle).collect();
    assert!(!angles.is_empty(), "{model}: {a} does not meet {b}");
    angles.into_iter().fold(0.0, f64::max)
}

#[test]
fn seams_are_smooth_and_creases_sharp() {
    for (model, a, b) in [
        ("goblet", "outside", "lip"),
        ("goblet", "lip", "inside"),
        ("vase", "outside", "lip"),
        ("vase", "lip", "inside"),
        ("vase", "right handle upper", "right handle lower"),
        ("vase", "left handle upper", "left handle lower"),
        ("missile", "body", "nose"),
        ("sphere", "sphere", "sphere"),
        ("torus", "torus", "torus"),
        ("pawn", "head", "head"),
        ("teapot", "body upper 1", "body lower 1"),
        ("teapot", "spout 1", "spout 2"),
    ] {
        assert!(angle_between(model, a, b) < 1e-5, "{model}: {a}, {b}: {}°", angle_between(model, a, b));
    }
    for (model, a, b) in [
        ("pawn", "underside", "foot"),
        ("pawn", "foot", "body"),
        ("pawn", "body", "collar"),
        ("pawn", "collar", "head"),
        ("goblet", "underside", "edge"),
        ("goblet", "edge", "outside"),
        ("vase", "underside", "outside"),
        ("missile", "boat tail", "body"),
        ("missile", "exit", "nozzle"),
        ("missile", "wing 1 flank 1", "wing 1 flank 2"),
        ("missile", "tail fin 3 flank 4", "tail fin 3 flank 1"),
    ] {
        assert!(angle_between(model, a, b) > 5.0, "{model}: {a}, {b}: {}°", angle_between(model, a, b));
    }
}

/// A closed curve in (distance from the axis, place along it): the profile of a solid of revolution, and the axis.
fn profile(scene: &Scene, names: &[&str], axis: DVec3) -> Vec<(f64, f64)> {
    const N: u32 = 4000;
    let mut polygon = Vec::new();
    for name in names {
        let surface = &scene.surfaces[index(scene, name)].surface;
        let [v0, v1] = surface.domain_v();
        polygon.extend((0..=N).map(|k| {
            let p = surface.eval(surface.domain_u()[0], v0 + (v1 - v0) * f64::from(k) / f64::from(N));
            (p.reject_from_normalized(axis).length(), p.dot(axis))
        }));
    }
    polygon
}

fn is_inside(polygon: &[(f64, f64)], (r, z): (f64, f64)) -> bool {
    let mut inside = false;
    for (i, &(r1, z1)) in polygon.iter().enumerate() {
        let (r0, z0) = polygon[(i + polygon.len() - 1) % polygon.len()];
        if (z0 > z) != (z1 > z) && r < r0 + (z - z0) / (z1 - z0) * (r1 - r0) {
            inside = !inside;
        }
    }
    inside
}

#[test]
fn handles_end_inside_the_wall_of_the_vase() {
    let scene = load("vase").unwrap().scene;
    let wall = profile(&scene, &["underside", "outside", "lip", "inside"], DVec3::Z);
    assert!(is_inside(&wall, (0.3, 0.06)) && !is_inside(&wall, (0.3, 1.0)) && !is_inside(&wall, (1.6, 1.5)));
    for (name, v) in [("upper", 0.0), ("lower", 1.0)] {
        for side in ["right", "left"] {
            let handle = &scene.surfaces[index(&scene, &format!("{side} handle {name}"))].surface;
            for k in 0..40 {
                let p = handle.eval(f64::from(k) / 40.0, v);
                assert!(is_inside(&wall, (p.truncate().length(), p.z)), "{side} {name} {k}: {p}");
            }
            let middle = handle.eval(0.0, 0.5);
            assert!(!is_inside(&wall, (middle.truncate().length(), middle.z)));
        }
    }
}

#[test]
fn fins_are_rooted_in_the_body_of_the_missile() {
    let scene = load("missile").unwrap().scene;
    let body = profile(&scene, &["bulkhead", "nozzle", "exit", "boat tail", "body", "nose"], DVec3::X);
    assert!(is_inside(&body, (0.2, 3.0)) && !is_inside(&body, (0.1, 0.2)));
    let mut roots = 0;
    for s in scene.surfaces.iter().filter(|s| s.name.ends_with("root")) {
        roots += 1;
        for i in 0..=10 {
            for j in 0..=10 {
                let p = s.surface.eval(f64::from(i) / 10.0, f64::from(j) / 10.0);
                assert!(is_inside(&body, (p.reject_from_normalized(DVec3::X).length(), p.x)), "{}: {p}", s.name);
            }
        }
    }
    assert_eq!(roots, 8);
}

#[test]
fn the_spring_is_smooth_across_every_seam() {
    let (joins, _) = joins(&load("spring").unwrap().scene);
    assert_eq!(joins.len(), (4 * 96 - 8) / 2);
    for join in joins {
        assert!(join.angle < 1e-5, "{:?}: {}°", join.surfaces, join.angle);
    }
}

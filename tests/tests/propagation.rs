//! Visibility carried from piece to piece against visibility asked for piece by piece.

use glam::DVec3;
use penvis::builtin;
use penvis_core::extract::CurveSet;
use penvis_core::pipeline::{DrawOptions, Prepared, Stats};
use penvis_core::scene::Scene;
use penvis_core::view::Camera;
use penvis_core::visibility::{Certainty, Method, Sighting};
use penvis_tests::agreement::visible_parts;

/// From general directions, along axes and diagonals, and barely off an axis.
const VIEWS: [DVec3; 12] = [
    DVec3::new(0.31, -0.85, 0.42),
    DVec3::new(-0.7, -0.2, 0.35),
    DVec3::new(0.5, 0.6, -0.4),
    DVec3::new(-0.1, 0.9, 0.8),
    DVec3::new(0.05, -0.1, 1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::X,
    DVec3::NEG_Y,
    DVec3::Z,
    DVec3::new(1e-3, -2e-3, 1.0),
    DVec3::new(1e-6, -1.0, 2e-6),
];

fn seen(scene: &Scene, camera: &Camera, visibility: Method) -> (Vec<Sighting>, Stats) {
    let curves = CurveSet { section: true, ..CurveSet::default() };
    let options = DrawOptions { curves, deepest: u32::MAX, visibility, ..DrawOptions::default() };
    Prepared::new(scene, camera, &options, &()).expect("a picture").sightings(&()).expect("nothing stops it")
}

#[test]
fn both_ways_see_the_same() {
    let mut rays = [0, 0];
    let mut contradictions = 0;
    let mut wrong = Vec::new();
    for (name, _) in builtin::names() {
        let scene = builtin::load(name).expect("a built-in model").scene;
        for eye in VIEWS {
            let up = if eye.truncate().length() < 1e-2 { DVec3::Y } else { DVec3::Z };
            let camera = Camera::orthographic(eye, up).expect("a camera");
            let (a, asked) = seen(&scene, &camera, Method::Rays);
            let (b, told) = seen(&scene, &camera, Method::Propagate);
            let count = |s: &Stats| s.visibility.rays_active + s.visibility.rays_passive;
            contradictions += told.visibility.disagreements;
            rays = [rays[0] + count(&asked), rays[1] + count(&told)];
            // What rays do not decide is seen exactly along an edge of something nearer, and either answer is one.
            let mut left = b.iter().peekable();
            let mut differ = Vec::new();
            for s in &a {
                let here = |t: &&Sighting| t.curve == s.curve && t.t[0] < s.t[1];
                while let Some(t) = left.next_if(here) {
                    if t.qi != s.qi && s.certainty == Certainty::Proven {
                        differ.push((s.curve, s.t, s.qi, t.qi));
                    }
                }
            }
            if !differ.is_empty() {
                wrong.push(format!(
                    "{name} from {eye}: {} of {}: {:?}",
                    differ.len(),
                    a.len(),
                    &differ[..differ.len().min(3)]
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(contradictions, 0);
    assert!(rays[1] * 10 < rays[0], "{rays:?}");
}

/// Leaving out what cannot hide one another changes no part of any curve, but saves pairs of arcs.
#[test]
fn clusters_change_nothing() {
    let mut pairs = [0, 0];
    for (name, _) in builtin::names() {
        let scene = builtin::load(name).expect("a built-in model").scene;
        for eye in [VIEWS[0], VIEWS[2], VIEWS[7], VIEWS[9]] {
            let up = if eye.truncate().length() < 1e-2 { DVec3::Y } else { DVec3::Z };
            let camera = Camera::orthographic(eye, up).expect("a camera");
            let [a, b] = [false, true].map(|clusters| {
                let options = DrawOptions { clusters, ..DrawOptions::default() };
                let prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
                prepared.sightings(&()).expect("nothing stops it")
            });
            assert_eq!(visible_parts(&a.0), visible_parts(&b.0), "{name} from {eye}");
            pairs = [pairs[0] + a.1.arrange.pairs_near, pairs[1] + b.1.arrange.pairs_near];
        }
    }
    assert!(pairs[1] < pairs[0], "{pairs:?}");
}

/// A line touches the silhouette of its own surface close to a cusp, where the nearer branch crosses it at the same place,
/// or so it looks: the crossing was once taken for the contact, and what is linked over it contradicted itself.
#[test]
fn beside_a_cusp_the_nearer_branch_hides_what_touches_the_farther() {
    for (name, eye) in [
        ("goblet", DVec3::new(-0.7, -0.2, 0.35)),
        ("teapot", DVec3::new(0.31, -0.85, 0.42)),
        ("spring", DVec3::new(-0.7, -0.2, 0.35)),
    ] {
        let scene = builtin::load(name).expect("a built-in model").scene;
        let camera = Camera::orthographic(eye, DVec3::Z).expect("a camera");
        assert_eq!(seen(&scene, &camera, Method::Propagate).1.visibility.disagreements, 0, "{name}");
    }
}

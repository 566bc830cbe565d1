//! Sight lines fired with and without propagation (Elber and Cohen 1989, table 3), at 8 isocurves a direction: the
//! paper's four models, and all the others. Without propagation a piece of a curve takes one or more.
//!
//!     cargo run --release -p penvis-tests --example rays

use penvis::builtin;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::visibility::Method;
use penvis_tests::agreement::visible_parts;

fn main() {
    println!(
        "| model | pieces | propagation: active | passive | rays only: active | passive | contradictions | same picture |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|---|");
    let paper = ["discont", "saddle", "wiggle", "pawn"];
    let others = builtin::names().map(|(name, _)| name).filter(|name| !paper.contains(name));
    for name in paper.into_iter().chain(others) {
        let model = builtin::load(name).expect("a built-in model");
        let camera = model.view.camera().expect("a camera");
        let [(told, a), (asked, b)] = [Method::Propagate, Method::Rays].map(|visibility| {
            let options = DrawOptions { visibility, ..DrawOptions::default() };
            let prepared = Prepared::new(&model.scene, &camera, &options, &()).expect("a picture");
            prepared.sightings(&()).expect("nothing stops it")
        });
        let (a, b) = (&a.visibility, &b.visibility);
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} | {} |",
            asked.len(),
            a.rays_active,
            a.rays_passive,
            b.rays_active,
            b.rays_passive,
            a.disagreements,
            if visible_parts(&told) == visible_parts(&asked) { "yes" } else { "NO" }
        );
    }
}

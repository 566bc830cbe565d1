//! Silhouettes traced on the zero set, by adaptive subdivision and by non-adaptive subdivision, to one tolerance:
//! `cargo bench -p penvis-tests --bench silhouette`.

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use penvis::builtin;
use penvis_core::extract::facing::facing_of_all;
use penvis_core::extract::silhouette::{SilhouetteOptions, silhouettes};
use penvis_core::stop::Stop;
use penvis_core::view::ViewScene;
use penvis_tests::subdivision::{PAPER, subdivide};

fn extraction(c: &mut Criterion) {
    for (name, _) in PAPER {
        let mut group = c.benchmark_group(name);
        group.sample_size(10).measurement_time(Duration::from_secs(3));
        let model = builtin::load(name).expect("a built-in model");
        let view = ViewScene::new(&model.scene, &model.view.camera().expect("a camera")).expect("a view");
        let options = SilhouetteOptions { chord: 2e-4 * view.size(), normal_angle: 0.2 };
        group.bench_function("traced", |b| {
            b.iter(|| silhouettes(view.patches(), &facing_of_all(view.patches(), Stop::NEVER).0, options, Stop::NEVER));
        });
        for (way, adaptive) in [("adaptive", true), ("non-adaptive", false)] {
            let cells =
                || -> usize { view.patches().iter().map(|p| subdivide(p, options.chord, adaptive).cells).sum() };
            group.bench_function(way, |b| b.iter(cells));
        }
        group.finish();
    }
}

criterion_group!(benches, extraction);
criterion_main!(benches);

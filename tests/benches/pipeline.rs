//! How long the stages take: `cargo bench -p penvis-tests`. With `RAYON_NUM_THREADS=1` on one core.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use penvis::drawing::Polyline;
use penvis::isocurves::Isocurves;
use penvis::page::{Depths, Inks, Joining, Layout, PenPath, lay_out};
use penvis::{builtin, emit};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_tests::plotter::{draw, options, plot, simulated};
use penvis_tests::strokes::hatches;

/// The teapot is the figure to watch; the others are perspective, many small patches, and interlocking outlines.
const MODELS: [&str; 4] = ["teapot", "pawn", "spring", "linked_tori"];

fn stages(c: &mut Criterion) {
    for name in MODELS {
        let mut group = c.benchmark_group(name);
        group.sample_size(10).measurement_time(Duration::from_secs(4));
        let model = builtin::load(name).expect("a built-in model");
        let camera = model.view.camera().expect("a camera");
        let wanted = DrawOptions::default();
        let prepare = || Prepared::new(&model.scene, &camera, &wanted, &()).expect("the model is in front of the eye");
        let prepared = prepare();
        let asked = options(&[name]);
        let (page, margin_mm) = asked.sheet.settle().expect("a sheet");
        let layout = Layout::fit(prepared.extent(), page, margin_mm).expect("it fits");
        let tolerance = layout.to_screen_length(asked.sheet.settled_tolerance_mm());
        let traced = prepared.trace(tolerance, &()).expect("nothing stops it");
        group.bench_function("project, stitch and extract", |b| b.iter(prepare));
        group.bench_function("split and see", |b| b.iter(|| prepared.sightings(&()).expect("nothing stops it")));
        group.bench_function("split, see and chain", |b| {
            b.iter(|| prepared.trace(tolerance, &()).expect("nothing stops it"))
        });
        let lay_out = || lay_out(black_box(&traced.strokes), &layout, &Inks::default(), Depths::Together, 1);
        group.bench_function("lay out", |b| b.iter(|| PenPath::default().through(lay_out(), &|| false)));
        group.finish();
    }
}

/// Isocurves half a millimetre apart on A4: choosing them, and the whole picture.
fn isocurves(c: &mut Criterion) {
    let mut group = c.benchmark_group("isocurves");
    group.sample_size(10).measurement_time(Duration::from_secs(4));
    for name in MODELS {
        let model = builtin::load(name).expect("a built-in model");
        let camera = model.view.camera().expect("a camera");
        let wanted = DrawOptions { isos: 0, ..DrawOptions::default() };
        let prepare = || Prepared::new(&model.scene, &camera, &wanted, &()).expect("the model is in front of the eye");
        let asked = options(&[name, "--iso-spacing", "0.5"]);
        let (page, margin_mm) = asked.sheet.settle().expect("a sheet");
        let layout = Layout::fit(prepare().extent(), page, margin_mm).expect("it fits");
        let Some(Isocurves::Adaptive(adaptive)) = asked.isocurves else { unreachable!("a spacing is given") };
        let even = adaptive.on_screen(&layout);
        group.bench_function(BenchmarkId::new("cover", name), |b| {
            b.iter_batched(
                prepare,
                |mut prepared| prepared.cover(&even, &()).expect("nothing stops it"),
                BatchSize::PerIteration,
            );
        });
        group.bench_function(BenchmarkId::new("model to drawing", name), |b| {
            b.iter(|| draw(&[name, "--iso-spacing", "0.5"]));
        });
    }
    group.finish();
}

fn end_to_end(c: &mut Criterion) {
    let mut group = c.benchmark_group("model to G-code");
    group.sample_size(10).measurement_time(Duration::from_secs(4));
    let device = simulated();
    for name in MODELS {
        group.bench_function(name, |b| {
            b.iter(|| emit::gcode(&draw(&[name]).drawing, &device).expect("G-code"));
        });
    }
    group.finish();
}

fn simulation(c: &mut Criterion) {
    let mut group = c.benchmark_group("simulated plotter");
    group.sample_size(10);
    let device = simulated();
    let job = emit::gcode(&draw(&["saddle"]).drawing, &device).expect("G-code");
    group.bench_function("saddle", |b| b.iter(|| plot(black_box(&job), &device).expect("plotted")));
    group.finish();
}

/// Strokes of which each is there twice and meets others, drawn once and joined.
fn joining(c: &mut Criterion) {
    let mut group = c.benchmark_group("joining");
    group.sample_size(10);
    for count in [1_000, 10_000, 100_000] {
        let lines = hatches(count / 2).into_iter().chain(hatches(count / 2));
        let strokes: Vec<_> = lines.map(|line| Polyline::stroke("ink", 1, line)).collect();
        let joining = Joining { same_mm: 0.01, gap_mm: 0.1, chord_mm: 0.001, hidden: false };
        group.throughput(Throughput::Elements(strokes.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter_batched(|| strokes.clone(), |strokes| joining.join(strokes, &|| false), BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, stages, isocurves, joining, end_to_end, simulation);
criterion_main!(benches);

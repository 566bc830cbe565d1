//! From a scene to strokes with little memory: what can be made again is not kept.
//!
//! Rays decide each piece of a curve by itself. So curves are split and forgotten one after the other, and then looked at so; what is kept of each are
//! the intervals that may be drawn. Isocurves, which are most of the curves and change no other's visibility, are there one at a time
//! only, and are made again when they are drawn. Where visibility goes from piece to piece
//! ([`Method::Propagate`]), all pieces are needed at once, and the curves with them.

use alloc::vec::Vec;

use super::picture::tolerance;
use super::{DrawOptions, FIT, Kept, Monitor, PictureError, Prepared, Stage, Stats};
use crate::arrange::{Arcs, ArrangeStats, OneByOne, Piece, lengths};
use crate::extract::chain::SilhouetteChains;
use crate::extract::{Geometry, IsoLine, Styles, SurfaceCurve, iso_lines};
use crate::scene::Scene;
use crate::stitch::STITCH;
use crate::stop::{Stop, Stopped};
use crate::stroke::{self, Stroke, StrokePoint};
use crate::view::{Camera, ViewScene};
use crate::visibility::{Cracks, Method, RayScratch, Sighting, Subject, Surroundings, VisibilityStats, classify_one};

/// The strokes of [`Prepared::styled`] and [`Prepared::trace`] one after the other, the same to the bit, for machines with little
/// memory: no stroke is kept, nor anything that can be made again. `scene` is asked for the scene twice, in the beginning and before strokes are
/// made, and has to give the same one; in between only what is seen of it is in memory. Takes about twice the
/// time: every arc and isocurve is made several times, and every stroke flattened twice.
///
/// With [`Method::Rays`], places of doubt are not told, only counted.
///
/// # Errors
/// If the scene is empty or reaches the eye plane, or the monitor stops it, or `scene` fails.
pub fn trace_each<E: From<PictureError>>(
    scene: &mut dyn FnMut() -> Result<Scene, E>,
    camera: &Camera,
    options: &DrawOptions,
    styles: Styles,
    tolerance: f64,
    monitor: &dyn Monitor,
    draw: &mut dyn FnMut(Stroke),
) -> Result<Stats, E> {
    monitor.begin(Stage::View);
    let view = ViewScene::new(&scene()?, camera).map_err(PictureError::from)?;
    let stopped = |stopped: Stopped| E::from(stopped.into());
    let (prepared, isos, runs, stats) = match options.visibility {
        Method::Rays => {
            let mut prepared = Prepared::seen_as(view, options, styles, Kept::NoIsos, monitor).map_err(stopped)?;
            prepared.view.forget_model();
            let isos = iso_lines(&prepared.view, &prepared.styles);
            let (runs, stats) = runs_one_by_one(&mut prepared, &isos, monitor).map_err(stopped)?;
            (prepared, isos, runs, stats)
        }
        Method::Propagate => {
            let mut prepared = Prepared::seen_as(view, options, styles, Kept::Curves, monitor).map_err(stopped)?;
            let split = prepared.picture().split(prepared.curve_arcs(), monitor).map_err(stopped)?;
            prepared.arcs = Arcs::default();
            let seen = |_: &Subject<'_>, sightings, counts| (sightings, prepared.with(counts));
            let seen = prepared.picture().seen(split, monitor, seen);
            let (mut sightings, stats): (Vec<Sighting>, Stats) = seen.map_err(stopped)?;
            sightings.retain(|s| s.qi <= options.deepest);
            let runs = stroke::runs(&sightings);
            (prepared, Vec::new(), runs, stats)
        }
    };
    let Prepared { mut view, forms, curves, stitching, chains, arcs, .. } = prepared;
    drop((stitching, chains, arcs));
    monitor.begin(Stage::Stroke);
    if options.visibility == Method::Rays && !view.recall_model(&scene()?) {
        return Err(PictureError::Changed.into());
    }
    let mut drawing = Drawing { g: Geometry { view: &view, forms: &forms }, curves: &curves, isos: &isos, last: None };
    let mut outlines = Vec::with_capacity(runs.len());
    for run in &runs {
        if monitor.stops() {
            return Err(stopped(Stopped));
        }
        let outline = stroke::outline(drawing.points(run, tolerance));
        outlines.push(stroke::stroke(drawing.curve(run.curve), run, outline));
    }
    let gap = 2.0 * STITCH * view.size();
    let mut ended = false;
    stroke::chain_each(&outlines, gap, gap, &mut |k| drawing.points(&runs[k], tolerance), &mut |s| {
        draw(s);
        ended = monitor.stops();
        !ended
    });
    if ended { Err(stopped(Stopped)) } else { Ok(stats) }
}

/// What has to be decided, curve by curve.
#[derive(Default)]
struct Pieces {
    /// The intervals of all curves.
    t: Vec<[f64; 2]>,
    /// How many each curve has.
    counts: Vec<u32>,
}

impl Pieces {
    /// Adds a curve: of its pieces those that are inked, and not drawn by another curve.
    fn push(&mut self, curve: &SurfaceCurve, pieces: &[Piece]) {
        let before = self.t.len();
        let wanted = pieces.iter().filter(|piece| curve.inked && piece.covered_by.is_none());
        self.t.extend(wanted.map(|piece| piece.t));
        // Memory ends long before the numbers do.
        self.counts.push((self.t.len() - before) as u32);
    }

    /// The intervals of each curve.
    fn by_curve(&self) -> impl Iterator<Item = &[[f64; 2]]> {
        let mut rest = &self.t[..];
        self.counts.iter().map(move |&count| {
            let (own, others) = rest.split_at(count as usize);
            rest = others;
            own
        })
    }
}

/// Hands out every curve with its number, in the order in which [`Prepared`] has them. Isocurves have the numbers from that of all others on.
fn each_curve(
    prepared: &Prepared,
    isos: &[IsoLine],
    look: &mut dyn FnMut(usize, &SurfaceCurve) -> Result<(), Stopped>,
) -> Result<(), Stopped> {
    let (g, curves) = (prepared.geometry(), &prepared.curves);
    let (before, sections) = curves.split_at(prepared.before_sections);
    for (k, curve) in before.iter().enumerate() {
        look(k, curve)?;
    }
    for (k, line) in isos.iter().enumerate() {
        for part in line.parts(&g) {
            look(curves.len() + k, &part)?;
        }
    }
    for (k, curve) in (before.len()..).zip(sections) {
        look(k, curve)?;
    }
    Ok(())
}

/// What is drawn of each curve, by its number: first all curves are split, one after the other, and then what splits them is given back and the
/// pieces are looked at.
fn runs_one_by_one(
    prepared: &mut Prepared,
    isos: &[IsoLine],
    monitor: &dyn Monitor,
) -> Result<(Vec<Sighting>, Stats), Stopped> {
    let stops = || monitor.stops();
    let stop = Stop::when(&stops);
    monitor.begin(Stage::Arrange);
    let (mut pieces, arrange) = split_one_by_one(prepared, isos, stop)?;
    // Sight lines need neither arcs nor what links go along.
    prepared.arcs = Arcs::default();
    prepared.chains = SilhouetteChains::default();
    pieces.t.shrink_to_fit();
    pieces.counts.shrink_to_fit();
    monitor.begin(Stage::Visibility);
    let (picture, g) = (prepared.picture(), prepared.geometry());
    let occluders = picture.occluders(stop);
    stop.check()?;
    let cracks = Cracks::new(&prepared.view, &prepared.stitching, occluders.resolution());
    let around = Surroundings { geometry: g, stitching: &prepared.stitching, occluders: &occluders, cracks: &cracks };
    let options = picture.classifying();
    let (mut scratch, mut runs, mut visibility) = (RayScratch::new(), Vec::new(), VisibilityStats::default());
    let (fit, resolution) = (FIT * prepared.view.size(), tolerance(&prepared.view).resolution);
    let mut pieces = pieces.by_curve();
    each_curve(prepared, isos, &mut |number, curve| {
        stop.check()?;
        let own = pieces.next().unwrap_or_default();
        if !own.is_empty() {
            let lengths = lengths(curve, g, fit, resolution);
            let of = (number, curve, &lengths);
            let mut seen = classify_one(around, &options, of, own, &mut scratch, &mut visibility);
            seen.retain(|s| s.qi <= prepared.options.deepest);
            runs.extend(stroke::runs(&seen));
        }
        Ok(())
    })?;
    runs.shrink_to_fit();
    Ok((runs, prepared.with((arrange, visibility))))
}

/// The pieces of all curves.
fn split_one_by_one(prepared: &Prepared, isos: &[IsoLine], stop: Stop<'_>) -> Result<(Pieces, ArrangeStats), Stopped> {
    let (picture, g) = (prepared.picture(), prepared.geometry());
    let (patches, clusters) = (picture.covering_patches(), picture.clusters(stop));
    let later = isos.iter().take_while(|_| !stop.is_wanted()).flat_map(|line| line.parts(&g));
    let (arcs, tolerance) = (prepared.curve_arcs(), tolerance(&prepared.view));
    let mut splitter = OneByOne::new(arcs, later, &patches, &prepared.stitching, &clusters, tolerance);
    let (mut all, mut stats) = (Pieces::default(), ArrangeStats::default());
    each_curve(prepared, isos, &mut |number, curve| {
        stop.check()?;
        let is_kept = number < prepared.curves.len();
        let (pieces, counted) = if is_kept { splitter.split(number) } else { splitter.split_later(curve) };
        stats.add(counted);
        all.push(curve, &pieces);
        Ok(())
    })?;
    Ok((all, stats))
}

/// Curves that are being drawn.
struct Drawing<'a> {
    g: Geometry<'a>,
    curves: &'a [SurfaceCurve],
    isos: &'a [IsoLine],
    /// The isocurve that was drawn last, with its number.
    last: Option<(usize, SurfaceCurve)>,
}

impl Drawing<'_> {
    /// The curve with this number: one that is kept, or an isocurve, without regard to trims.
    fn curve(&mut self, number: usize) -> &SurfaceCurve {
        let Some(iso) = number.checked_sub(self.curves.len()) else { return &self.curves[number] };
        if self.last.as_ref().is_none_or(|(k, _)| *k != iso) {
            self.last = None;
        }
        &self.last.get_or_insert_with(|| (iso, self.isos[iso].curve(&self.g))).1
    }

    /// The vertices of a run.
    fn points(&mut self, run: &Sighting, tolerance: f64) -> Vec<StrokePoint> {
        let g = self.g;
        stroke::polyline(&g, self.curve(run.curve), run.t, tolerance)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;
    use glam::DVec3;

    use super::*;
    use crate::extract::{CurveSet, Style};
    use crate::scene::SceneSurface;
    use crate::shape::{Frame, plane, polyline, sphere, torus};
    use crate::trim::{TrimCurve, Trims};

    /// A ring, and a ball that sticks into a plate with a hole behind it.
    fn scene() -> Scene {
        let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let ball = sphere(&Frame::at(DVec3::new(2.0, 3.2, 1.0)).unwrap(), 0.9).unwrap();
        let plate = plane(DVec3::new(-4.0, 3.0, -4.0), DVec3::X * 8.0, DVec3::Z * 8.0).unwrap();
        let ends = |corners: &[[f64; 2]]| -> Vec<TrimCurve> {
            let corners: Vec<DVec3> = corners.iter().map(|&[x, y]| DVec3::new(x, y, 0.0)).collect();
            corners.windows(2).map(|w| TrimCurve { curve: polyline(w).unwrap(), edge: None }).collect()
        };
        let rim = ends(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]);
        let hole = ends(&[[0.1, 0.3], [0.4, 0.9], [0.7, 0.75], [0.1, 0.3]]);
        let trims = Some(Trims::oriented(&plate, [false; 2], &[rim, hole]).unwrap());
        let plate = SceneSurface { trims, ..SceneSurface::new("plate", plate) };
        let surfaces = vec![SceneSurface::new("ring", ring), SceneSurface::new("ball", ball), plate];
        Scene { name: "still life".into(), surfaces }
    }

    fn strokes(
        camera: &Camera,
        options: &DrawOptions,
        styles: Styles,
        tolerance: f64,
        monitor: &dyn Monitor,
        draw: &mut dyn FnMut(Stroke),
    ) -> Result<Stats, PictureError> {
        trace_each(&mut || Ok(scene()), camera, options, styles, tolerance, monitor, draw)
    }

    #[test]
    fn a_scene_that_is_another_one_the_second_time_is_refused() {
        let camera = Camera::orthographic(DVec3::new(0.3, -0.8, 0.4), DVec3::Z).unwrap();
        for left_out in 0..3 {
            let mut first = Some(scene());
            let mut give = || {
                Ok(first.take().unwrap_or_else(|| {
                    let mut other = scene();
                    other.surfaces.remove(left_out);
                    other
                }))
            };
            let styles = Styles::uniform(Style { curves: CurveSet::NONE, isos: 0 });
            let options = DrawOptions { cells: 0, ..DrawOptions::default() };
            let draw = &mut |_| panic!("nothing is drawn");
            let result = trace_each(&mut give, &camera, &options, styles, 1e-3, &(), draw);
            assert_eq!(result, Err(PictureError::Changed));
        }
    }

    #[test]
    fn strokes_and_counts_are_those_of_curves_that_are_all_kept_to_the_bit() {
        let camera = Camera::orthographic(DVec3::new(0.3, -0.8, 0.4), DVec3::Z).unwrap();
        let curves = CurveSet { section: true, smooth: true, ..CurveSet::default() };
        let styles = || Styles::uniform(Style { curves, isos: 3 });
        for (visibility, deepest, cells) in [
            (Method::Rays, 0, 0),
            (Method::Rays, 1, 64),
            (Method::Rays, u32::MAX, usize::MAX),
            // Isocurves end at smooth joins, which are drawn here.
            (Method::Propagate, 0, 3),
        ] {
            let options = DrawOptions { visibility, deepest, cells, ..DrawOptions::default() };
            let whole = Prepared::styled(&scene(), &camera, &options, styles(), &()).unwrap().trace(1e-3, &()).unwrap();
            let mut one_by_one = Vec::new();
            let draw = &mut |stroke| one_by_one.push(stroke);
            let stats = strokes(&camera, &options, styles(), 1e-3, &(), draw).unwrap();
            assert_eq!(one_by_one, whole.strokes, "{visibility:?} {cells}");
            let mut expected = whole.stats;
            if visibility == Method::Rays {
                expected.visibility.tolerated.clear();
                expected.visibility.undecided.clear();
            }
            assert_eq!(stats, expected, "{visibility:?} {cells}");
            // Isocurves of a trimmed plate in several parts, and sections, which come after them.
            assert!(stats.arrange.curves > 20 && stats.arrange.piercings > 0 && one_by_one.len() > 20, "{stats:?}");
        }
    }

    #[test]
    fn it_ends_when_no_more_strokes_are_wanted() {
        struct Enough(core::sync::atomic::AtomicBool);
        impl Monitor for Enough {
            fn stops(&self) -> bool {
                self.0.load(core::sync::atomic::Ordering::Relaxed)
            }
        }
        let camera = Camera::orthographic(DVec3::new(0.3, -0.8, 0.4), DVec3::Z).unwrap();
        let enough = Enough(false.into());
        let mut drawn = 0;
        let styles = Styles::uniform(Style { curves: CurveSet::default(), isos: 3 });
        let result = strokes(&camera, &DrawOptions::default(), styles, 1e-3, &enough, &mut |_| {
            drawn += 1;
            enough.0.store(drawn == 3, core::sync::atomic::Ordering::Relaxed);
        });
        assert_eq!((result, drawn), (Err(Stopped.into()), 3));
    }
}

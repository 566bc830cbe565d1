//! Curves as polylines.

use alloc::vec::Vec;

use glam::DVec3;

use super::{Stroke, StrokePoint};
use crate::extract::{Geometry, Path, SurfaceCurve};
use crate::stop::Stop;
use crate::visibility::Sighting;

/// Polylines of the sightings, neighbours of one curve with equal visibility joined. Each chord stays within
/// `tolerance` (screen units) of its curve, on the screen and in space, measured at three inner points; vertices lie on
/// the curves. (A curve in a plane through the sight line is straight on the screen, but its polyline is of use in space
/// as well.)
#[must_use]
pub fn flatten(
    g: &Geometry<'_>,
    curves: &[SurfaceCurve],
    sightings: &[Sighting],
    tolerance: f64,
    stop: Stop<'_>,
) -> Vec<Stroke> {
    let runs = runs(sightings);
    // A closed curve seen from end to end is one closed stroke; one cut at its seam only is joined there by chaining.
    let line = |s: &Sighting| {
        let curve = &curves[s.curve];
        stroke(curve, s, if stop.is_wanted() { Vec::new() } else { polyline(g, curve, s.t, tolerance) })
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        runs.par_iter().map(line).collect()
    }
    #[cfg(not(feature = "parallel"))]
    runs.iter().map(line).collect()
}

/// Sightings of one curve with equal visibility that follow one another made one.
pub(crate) fn runs(sightings: &[Sighting]) -> Vec<Sighting> {
    let mut runs: Vec<Sighting> = Vec::with_capacity(sightings.len());
    for s in sightings {
        match runs.last_mut() {
            Some(last) if last.curve == s.curve && last.qi == s.qi && last.t[1] == s.t[0] => {
                last.t[1] = s.t[1];
                last.certainty = last.certainty.max(s.certainty);
            }
            _ => runs.push(s.clone()),
        }
    }
    runs
}

/// The stroke of a run of a curve, with these vertices.
pub(crate) fn stroke(curve: &SurfaceCurve, run: &Sighting, points: Vec<StrokePoint>) -> Stroke {
    let SurfaceCurve { kind, surface, style, level, .. } = *curve;
    Stroke { kind, surface, style, level, qi: run.qi, certainty: run.certainty, points }
}

/// The vertices of the part of a curve over the interval `t`.
pub(crate) fn polyline(g: &Geometry<'_>, curve: &SurfaceCurve, t: [f64; 2], tolerance: f64) -> Vec<StrokePoint> {
    let mut vertices = Vec::new();
    // Half the tolerance here, half for the vertices that thinning leaves out.
    walk(g, curve, t, 0.5 * tolerance, &mut |(t, p)| {
        let uv = curve.uv(g, t);
        vertices.push(StrokePoint { screen: p.truncate(), model: g.view.model_point(curve.surface, uv) });
    });
    thin(vertices, tolerance)
}

/// Places of a curve from one parameter to another, ends included, with chords within `tolerance` as in [`flatten`]: parameters
/// and positions in view space.
pub(crate) fn places(g: &Geometry<'_>, curve: &SurfaceCurve, t: [f64; 2], tolerance: f64) -> Vec<(f64, DVec3)> {
    let mut out = Vec::new();
    walk(g, curve, t, tolerance, &mut |place| out.push(place));
    out
}

/// Hands on what [`places`] collects.
fn walk(g: &Geometry<'_>, curve: &SurfaceCurve, t: [f64; 2], tolerance: f64, out: &mut dyn FnMut((f64, DVec3))) {
    let mut stops = Vec::new();
    stops.push(t[0]);
    match &curve.path {
        Path::Line(line) => stops.extend(line.spans.iter().map(|s| s.t[0])),
        Path::Traced(c) => stops.extend((0..c.segment_count()).map(|k| k as f64)),
        Path::Section(c) => stops.extend((0..c.arcs.len()).map(|k| k as f64)),
        Path::Trim(line) => stops.extend((0..line.spans.len()).map(|k| k as f64)),
    }
    stops.retain(|&x| x == t[0] || (t[0] < x && x < t[1]));
    stops.push(t[1]);
    let refining = Refining { g, curve, tolerance };
    let place = |x: f64| (x, curve.point(g, x));
    let mut from = place(t[0]);
    out(from);
    for &stop in &stops[1..] {
        let to = place(stop);
        refining.refine(from, to, out, 0);
        from = to;
    }
}

/// A curve that is becoming a polyline.
struct Refining<'a> {
    g: &'a Geometry<'a>,
    curve: &'a SurfaceCurve,
    tolerance: f64,
}

impl Refining<'_> {
    /// Hands on the places after `a` up to and including `b` that the polyline needs.
    fn refine(&self, a: (f64, DVec3), b: (f64, DVec3), out: &mut dyn FnMut((f64, DVec3)), depth: u32) {
        const DEEPEST: u32 = 16;
        let Self { g, curve, tolerance } = *self;
        // The screen is the first two coordinates of view space: near in space is near on the screen.
        let off = |f: f64| from_chord(curve.point(g, a.0 + f * (b.0 - a.0)), a.1, b.1);
        if depth >= DEEPEST || [0.5, 0.25, 0.75].iter().all(|&f| off(f) <= tolerance) {
            out(b);
            return;
        }
        let t = 0.5 * (a.0 + b.0);
        let m = (t, curve.point(g, t));
        self.refine(a, m, out, depth + 1);
        self.refine(m, b, out, depth + 1);
    }
}

/// Distance of `x` from the segment from `p` to `q`.
pub(crate) fn from_chord(x: DVec3, p: DVec3, q: DVec3) -> f64 {
    let d = q - p;
    let along = if d == DVec3::ZERO { 0.0 } else { ((x - p).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    (x - p - d * along).length()
}

/// Leaves out vertices that are within half the tolerance of the chord that replaces them (Douglas and Peucker 1973).
fn thin(mut points: Vec<StrokePoint>, tolerance: f64) -> Vec<StrokePoint> {
    let mut keep = alloc::vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut stack = alloc::vec![(0, points.len() - 1)];
    while let Some((a, b)) = stack.pop() {
        let mut worst = (0.5 * tolerance, None);
        for (k, v) in points.iter().enumerate().take(b).skip(a + 1) {
            let on_screen =
                from_chord(v.screen.extend(0.0), points[a].screen.extend(0.0), points[b].screen.extend(0.0));
            let off = on_screen.max(from_chord(v.model, points[a].model, points[b].model));
            if off > worst.0 {
                worst = (off, Some(k));
            }
        }
        if let Some(k) = worst.1 {
            keep[k] = true;
            stack.push((a, k));
            stack.push((k, b));
        }
    }
    let mut keep = keep.into_iter();
    points.retain(|_| keep.next().unwrap_or(true));
    points.shrink_to_fit();
    points
}

#[cfg(test)]
mod tests {
    use super::super::{Certainty, CurveKind};
    use super::*;
    use crate::extract::facing::facing_of_all;
    use crate::extract::silhouette::Silhouettes;
    use crate::extract::{CurveOptions, CurveSet, Style, Styles};
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, sphere};
    use crate::stitch::{StitchOptions, Stitching};
    use crate::view::{Camera, ViewScene};
    use alloc::vec;

    /// The polylines of a sphere's isocurves, whole, at a tolerance.
    fn parallels(tolerance: f64) -> Vec<Stroke> {
        let surface = sphere(&Frame::WORLD, 1.0).unwrap();
        let scene = Scene { name: "s".into(), surfaces: vec![SceneSurface::new("s", surface)] };
        let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::new(1.0, 0.4, 0.3), DVec3::Z).unwrap()).unwrap();
        let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
        let g = Geometry { view: &view, forms: &forms };
        let stitching = Stitching::new(&view, &StitchOptions { distance: 1e-6, angle: 0.01 }, Stop::NEVER);
        let styles = Styles::uniform(Style { curves: CurveSet::default(), isos: 4 });
        let options = CurveOptions { styles: &styles, angle: 0.01, contact: 1e-6 };
        let all = crate::extract::curves(&g, &stitching, &Silhouettes::default(), &options, Stop::NEVER);
        let isos: Vec<SurfaceCurve> = all.into_iter().filter(|c| c.kind == CurveKind::Iso).collect();
        let sighting = |(k, c): (usize, &SurfaceCurve)| {
            let [a, b] = c.domain;
            let m = 0.3 * a + 0.7 * b;
            // Two neighbours of one visibility: they are to become one polyline.
            [[a, m], [m, b]].map(|t| Sighting { curve: k, t, qi: 0, certainty: Certainty::Proven })
        };
        let sightings: Vec<Sighting> = isos.iter().enumerate().flat_map(sighting).collect();
        flatten(&g, &isos, &sightings, tolerance, Stop::NEVER)
    }

    #[test]
    fn vertices_lie_on_the_sphere_and_chords_sink_by_no_more_than_the_tolerance() {
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let strokes = parallels(tolerance);
            assert_eq!(strokes.len(), 8);
            for s in &strokes {
                for p in &s.points {
                    assert!((p.model.length() - 1.0).abs() < 1e-12);
                }
                for w in s.points.windows(2) {
                    let middle = (w[0].model + w[1].model) / 2.0;
                    assert!(1.0 - middle.length() <= tolerance, "{tolerance}: {}", 1.0 - middle.length());
                }
            }
        }
    }

    #[test]
    fn a_tenth_of_the_tolerance_costs_about_three_times_the_vertices() {
        let count = |t: f64| parallels(t).iter().map(|s| s.points.len()).sum::<usize>() as f64;
        let ratio = count(1e-5) / count(1e-4);
        assert!((2.0..5.0).contains(&ratio), "{ratio}");
    }
}

//! The fills of a picture: visible regions covered, each with its fill, and the lines that go on over smooth joins made one.

use glam::{DVec2, DVec3};
use penvis_core::extract::adaptive::Tone;
use penvis_core::probe::{Probe, Shading};
use penvis_core::visibility::RayScratch;
use rayon::prelude::*;

use super::clear::Gap;
use super::contour::rings;
use super::dark::{divide, in_shadow};
use super::hatch::{Grid, Run, hatch};
use super::offset::OffsetError;
use super::placed;
use super::tone::{darker, threshold};
use super::{Area, Fill, FillKind};
use crate::page::Layout;

/// Lines shorter than this share of the pitch are left out: a pen makes dots of them. More is left out where a tone lets lines end
/// anywhere.
pub(super) const SHORTEST: f64 = 0.25;
pub(super) const SHORTEST_TONED: f64 = 1.0;

/// What a tone is looked at by, in pitches.
pub(super) const LOOK: f64 = 1.0;

/// What is known of the picture that is filled.
#[derive(Clone, Copy)]
pub struct Canvas<'a> {
    /// Finds the places on the surfaces.
    pub probe: &'a Probe<'a>,
    /// Where the picture lies on the paper.
    pub layout: &'a Layout,
    /// What makes lines end.
    pub tone: Option<Tone>,
    /// Largest distance in mm between borders and the polygons that stand for them.
    pub tolerance_mm: f64,
    /// The shadows of surfaces, if it matters where they are: all lines are drawn in them, and out of them only what a tone asks for.
    pub shadows: Option<&'a [Area]>,
}

/// A line of a fill.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Index of the surface on which it begins.
    pub surface: usize,
    /// Number of the pen of its fill.
    pub pen: u32,
    /// Its vertices on the paper in mm, two or more; closed when the last equals the first.
    pub page: Vec<DVec2>,
    /// The places on the surfaces there, in model space.
    pub points: Vec<DVec3>,
}

/// A run with the surfaces on which it begins and ends.
#[derive(Clone, Copy)]
struct Stretch {
    run: Run,
    surfaces: [usize; 2],
}

/// One set of parallel lines, and for which part of the darkness it stands.
struct Set {
    grid: Grid,
    darkness: [f64; 2],
}

/// The lines of the fills of all areas, fill by fill, but for isocurves. `fills` has the fill of each surface by its index; nearer to a line of `outlines` than
/// its gap there is nothing. Where `stops` says so, the rest is left out.
///
/// Cost: that of [`hatch`] and [`Gap`], or of [`rings`], and a sight line for each vertex, or with a tone for each pitch of the lines.
///
/// # Errors
/// If regions are too large on the paper for lines along their contours.
pub fn cover(
    areas: &[Area],
    fills: &[Option<Fill>],
    outlines: &[&[DVec2]],
    canvas: &Canvas<'_>,
    stops: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Line>, OffsetError> {
    let of = |area: &Area| fills.get(area.surface).copied().flatten();
    let mut kinds: Vec<Fill> = Vec::new();
    for fill in areas.iter().filter_map(of) {
        if !kinds.contains(&fill) {
            kinds.push(fill);
        }
    }
    let shading = canvas.tone.map(|tone| canvas.probe.shading(tone));
    let mut lines = Vec::new();
    for fill in &kinds {
        let own: Vec<&Area> = areas.iter().filter(|area| of(area).as_ref() == Some(fill)).collect();
        if fill.kind == FillKind::Contour {
            let found = rings(&own, outlines, fill, canvas.tolerance_mm, stops)?;
            lines.extend(placed::lines(&found, &own, fill, shading.as_ref(), canvas, stops));
        }
        for set in sets(fill) {
            let gap = Gap::new(&set.grid, outlines.iter().copied(), fill.gap_mm);
            let cover = |area: &&Area| {
                if stops() {
                    return Vec::new();
                }
                let runs = gap.clear(&hatch(&area.loops, &set.grid));
                let runs = shaded(&runs, area.surface, fill, &set, shading.as_ref(), canvas);
                runs.into_iter().map(|run| Stretch { run, surfaces: [area.surface; 2] }).collect()
            };
            let stretches: Vec<Vec<Stretch>> = own.par_iter().map(cover).collect();
            let joined = join(stretches.into_iter().flatten().collect(), 2.0 * canvas.tolerance_mm);
            let shortest = fill.pitch_mm * if shading.is_some() { SHORTEST_TONED } else { SHORTEST };
            let found = joined.par_iter().filter(|s| s.run.length_mm() >= shortest && !stops());
            let found = found.map_init(RayScratch::new, |scratch, s| line(s, &set.grid, fill.pen, canvas, scratch));
            lines.extend(found.collect::<Vec<_>>().into_iter().flatten());
        }
    }
    Ok(lines)
}

/// The sets of parallel lines of a fill.
fn sets(fill: &Fill) -> Vec<Set> {
    let set = |degrees: f64, darkness| Set { grid: Grid::new(degrees, fill.pitch_mm), darkness };
    match fill.kind {
        FillKind::Hatch => vec![set(fill.degrees, [0.0, 1.0])],
        FillKind::Cross => vec![set(fill.degrees, [0.0, 0.5]), set(fill.degrees + 90.0, [0.5, 1.0])],
        FillKind::Contour | FillKind::Iso => Vec::new(),
    }
}

/// The parts of runs that are drawn: those in shadow, and of the others those where it is dark enough for their lines, in no order.
fn shaded(
    runs: &[Run],
    surface: usize,
    fill: &Fill,
    set: &Set,
    shading: Option<&Shading<'_>>,
    canvas: &Canvas<'_>,
) -> Vec<Run> {
    let toned = |runs: &[Run]| shading.map(|shading| toned(runs, surface, fill, set, shading, canvas));
    let Some(shadows) = canvas.shadows else { return toned(runs).unwrap_or_else(|| runs.to_vec()) };
    let own = shadows.iter().filter(|area| area.surface == surface).flat_map(|area| area.loops.iter().cloned());
    let dark = in_shadow(&own.collect::<Vec<_>>(), &set.grid, 2.0 * canvas.tolerance_mm);
    let [mut drawn, lit] = divide(runs, &dark, 2.0 * canvas.tolerance_mm);
    drawn.extend(toned(&lit).unwrap_or_default());
    drawn
}

/// The parts of runs where it is dark enough for their lines.
fn toned(runs: &[Run], surface: usize, fill: &Fill, set: &Set, shading: &Shading<'_>, canvas: &Canvas<'_>) -> Vec<Run> {
    let mut scratch = RayScratch::new();
    let [light, dark] = set.darkness;
    let steps = [LOOK * fill.pitch_mm, canvas.tolerance_mm];
    let parts = runs.iter().flat_map(|run| {
        let mut darkness = |along: f64| {
            let screen = canvas.layout.to_screen(set.grid.place(run.line, along));
            let place = canvas.probe.place(surface, screen, &mut scratch)?;
            Some((shading.darkness(surface, place.uv) - light) / (dark - light))
        };
        let parts = darker(run.along, threshold(run.line), steps, &mut darkness);
        parts.into_iter().map(|along| {
            let whole = [0, 1].map(|k| run.joins[k] && along[k] == run.along[k]);
            Run { along, joins: whole, ..*run }
        })
    });
    parts.collect()
}

/// Makes one of stretches of a line that meet at a smooth join, where the polygons of the two sides may be so far apart.
fn join(mut stretches: Vec<Stretch>, apart_mm: f64) -> Vec<Stretch> {
    stretches.sort_by(|a, b| a.run.line.cmp(&b.run.line).then(a.run.along[0].total_cmp(&b.run.along[0])));
    let mut joined: Vec<Stretch> = Vec::with_capacity(stretches.len());
    for next in stretches {
        match joined.last_mut() {
            Some(last)
                if last.run.line == next.run.line
                    && last.run.joins[1]
                    && next.run.joins[0]
                    && (next.run.along[0] - last.run.along[1]).abs() <= apart_mm =>
            {
                (last.run.along[1], last.run.joins[1]) = (next.run.along[1], next.run.joins[1]);
                last.surfaces[1] = next.surfaces[1];
            }
            _ => joined.push(next),
        }
    }
    joined
}

/// A stretch with the places on its surfaces: a sight line for each end, or where it misses the surface, on whose border it may lie, ever farther
/// in. `None` if nothing of the surface is found: it is a sliver no wider than the tolerance.
fn line(stretch: &Stretch, grid: &Grid, pen: u32, canvas: &Canvas<'_>, scratch: &mut RayScratch) -> Option<Line> {
    let Stretch { run, surfaces } = stretch;
    let half = run.length_mm() / 2.0;
    let mut end = |k: usize| {
        let inwards = if k == 0 { 1.0 } else { -1.0 };
        let mut by = 0.0;
        while by <= half {
            let screen = canvas.layout.to_screen(grid.place(run.line, run.along[k] + inwards * by));
            if let Some(place) = canvas.probe.place(surfaces[k], screen, scratch) {
                return Some(place.model);
            }
            by = if by == 0.0 { 1e-3 * canvas.tolerance_mm } else { 4.0 * by };
        }
        None
    };
    let points = vec![end(0)?, end(1)?];
    let page = run.along.map(|along| grid.place(run.line, along)).to_vec();
    Some(Line { surface: surfaces[0], pen, page, points })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_on_over_smooth_joins_and_over_no_others() {
        let stretch = |surface, along, joins| Stretch { run: Run { line: 3, along, joins }, surfaces: [surface; 2] };
        let given = vec![
            stretch(2, [5.0, 7.0], [true, false]),
            stretch(0, [0.0, 2.0], [false, true]),
            stretch(1, [2.004, 5.001], [true, true]),
            stretch(4, [7.0, 9.0], [true, false]),
        ];
        let joined = join(given, 0.01);
        let found: Vec<_> = joined.iter().map(|s| (s.run.along, s.surfaces)).collect();
        assert_eq!(found, [([0.0, 7.0], [0, 2]), ([7.0, 9.0], [4, 4])]);
    }
}

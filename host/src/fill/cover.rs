//! The fills of a picture: visible regions covered, each with its fill, and the lines that go on over smooth joins made one.

use std::collections::BTreeMap;

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
use super::{Area, Fill, FillKind, even};
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
            let covering = Covering { fill, set: &set, gap: &gap, outlines, shading: shading.as_ref(), canvas };
            let found: Vec<Vec<(Grid, Stretch)>> =
                own.par_iter().map(|area| if stops() { Vec::new() } else { covering.stretches(area) }).collect();
            // Lines go on in one grid only.
            let mut by_pitch: BTreeMap<u64, (Grid, Vec<Stretch>)> = BTreeMap::new();
            for (grid, stretch) in found.into_iter().flatten() {
                by_pitch.entry(grid.pitch_mm().to_bits()).or_insert((grid, Vec::new())).1.push(stretch);
            }
            let shortest = fill.pitch_mm * if shading.is_some() { SHORTEST_TONED } else { SHORTEST };
            for (grid, stretches) in by_pitch.into_values() {
                let joined = join(stretches, 2.0 * canvas.tolerance_mm);
                let found = joined.par_iter().filter(|s| s.run.length_mm() >= shortest && !stops());
                let found = found.map_init(RayScratch::new, |scratch, s| line(s, &grid, fill.pen, canvas, scratch));
                lines.extend(found.collect::<Vec<_>>().into_iter().flatten());
            }
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

/// One set of lines, and what they cover.
struct Covering<'a> {
    fill: &'a Fill,
    set: &'a Set,
    /// The gap of the set's grid to the outlines.
    gap: &'a Gap,
    outlines: &'a [&'a [DVec2]],
    shading: Option<&'a Shading<'a>>,
    canvas: &'a Canvas<'a>,
}

impl Covering<'_> {
    /// The lines on an area, each with the grid that it is of, in no order.
    fn stretches(&self, area: &Area) -> Vec<(Grid, Stretch)> {
        let grid = self.set.grid;
        let [shadow, light] = self.divided(area, &grid, self.gap);
        let mut out: Vec<(Grid, Run)> = Vec::new();
        let mut add = |grid: Grid, runs: Vec<Run>| out.extend(runs.into_iter().map(|run| (grid, run)));
        match (self.shading, self.one_tone(area, &light)) {
            (None, _) if self.canvas.shadows.is_some() => {}
            (None, _) => add(grid, light),
            (Some(_), Some(share)) if share <= 0.0 => {}
            (Some(_), Some(share)) if share < 1.0 => {
                let spread = grid.spread(share);
                let near = even::beside(area, self.outlines, self.fill.gap_mm);
                let [_, light] = self.divided(area, &spread, &Gap::new(&spread, near, self.fill.gap_mm));
                add(spread, light);
            }
            (Some(_), Some(_)) => add(grid, light),
            (Some(shading), None) => add(grid, self.toned(area, &light, shading)),
        }
        add(grid, shadow);
        let surfaces = [area.surface; 2];
        out.into_iter().map(|(grid, run)| (grid, Stretch { run, surfaces })).collect()
    }

    /// The parts of a grid's lines on an area in shadow, and those in the light. Where shadows do not matter all is in the light.
    fn divided(&self, area: &Area, grid: &Grid, gap: &Gap) -> [Vec<Run>; 2] {
        let runs = gap.clear(&hatch(&area.loops, grid));
        let Some(shadows) = self.canvas.shadows else { return [Vec::new(), runs] };
        let own = shadows.iter().filter(|s| s.surface == area.surface).flat_map(|s| s.loops.iter().cloned());
        let apart = 2.0 * self.canvas.tolerance_mm;
        divide(&runs, &in_shadow(&own.collect::<Vec<_>>(), grid, apart), apart)
    }

    /// The share of the lines that is drawn, if it is one for the whole area: 0 and less for none of them, 1 and more for all.
    fn one_tone(&self, area: &Area, runs: &[Run]) -> Option<f64> {
        let shading = self.shading?;
        if let Some(Tone::Flat(dark)) = self.canvas.tone {
            return Some(self.share(dark));
        }
        if even::goes_on(area) {
            return None;
        }
        let mut scratch = RayScratch::new();
        let mut look = |run: &Run, along: f64| self.look(area.surface, run.line, along, shading, &mut scratch);
        even::darkness(runs, LOOK * self.fill.pitch_mm, &mut look)
    }

    /// The parts of runs where it is dark enough for their lines.
    fn toned(&self, area: &Area, runs: &[Run], shading: &Shading<'_>) -> Vec<Run> {
        let mut scratch = RayScratch::new();
        let steps = [LOOK * self.fill.pitch_mm, self.canvas.tolerance_mm];
        let parts = runs.iter().flat_map(|run| {
            let mut look = |along: f64| self.look(area.surface, run.line, along, shading, &mut scratch);
            let parts = darker(run.along, threshold(run.line), steps, &mut look);
            parts.into_iter().map(|along| {
                let whole = [0, 1].map(|k| run.joins[k] && along[k] == run.along[k]);
                Run { along, joins: whole, ..*run }
            })
        });
        parts.collect()
    }

    /// How much of the set's ink is wanted at a place of a line: none from 0 down, all from 1 up.
    fn look(
        &self,
        surface: usize,
        line: i64,
        along: f64,
        shading: &Shading<'_>,
        scratch: &mut RayScratch,
    ) -> Option<f64> {
        let screen = self.canvas.layout.to_screen(self.set.grid.place(line, along));
        let place = self.canvas.probe.place(surface, screen, scratch)?;
        Some(self.share(shading.darkness(surface, place.uv)))
    }

    fn share(&self, darkness: f64) -> f64 {
        let [light, dark] = self.set.darkness;
        (darkness - light) / (dark - light)
    }
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

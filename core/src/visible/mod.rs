//! The visible part of every surface as closed loops on the screen and in its parameters (Ruan, Zhang and Yong 2006, *Visible
//! region extraction from a sequence of rational Bézier surfaces*).
//!
//! What the earlier stages see of all boundaries, creases, silhouettes, smooth joins and sections are the edges of the picture's
//! planar map (`planar`). Sight lines say which surface is nearest on either side of each (`sides`); an edge borders the
//! regions of the one and of the other, unless that is the same part of one surface. The borders are walked into loops
//! (`walk`), their points found on the surfaces (`border`), and loops that have gone on with another sheet put right (`sheets`).
//!
//! Nothing is intersected here: where one edge ends on another is known from splitting. Nor is anything closed in silence: a
//! vertex that more edges of a region enter than leave shows that an edge is missing or what lies beside it is wrong, and is
//! listed.

mod border;
mod planar;
mod sheets;
mod sides;
mod uncovered;
mod walk;

use alloc::vec::Vec;

use glam::DVec2;

use crate::extract::CurveKind;
use crate::view::Camera;
use crate::visibility::{ClassifyOptions, RayScratch, Sighting, Subject};
use border::Border;
use sheets::Sheets;
use walk::Half;

/// What is visible of a scene, surface by surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VisibleRegions {
    /// The surfaces of which something is visible, in increasing order. No two overlap by more than
    /// the tolerance, to which each has chords of its own.
    pub regions: Vec<VisibleRegion>,
    /// Places at which a border is not known. A loop goes straight over a gap there of no more than 0.002 of the picture's size; what of a border
    /// could not be closed even so is left out.
    pub undecided: Vec<UndecidedBorder>,
    /// Counts.
    pub stats: VisibleStats,
}

/// What is visible of one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleRegion {
    /// Index of the surface in the scene.
    pub surface: usize,
    /// Its border, with the region on the left (y up): outer loops run counter-clockwise, holes clockwise, and there may be
    /// several of both. Filled by the nonzero rule or by the even-odd rule it is the same.
    ///
    /// Where both sides of a line belong to the region, but are different parts of the surface, two edges run along it, one
    /// in each direction: where the surface hides a part of itself, and along the seam of a closed surface, at which it is cut
    /// so that its loops are closed in the parameters as well.
    pub loops: Vec<VisibleLoop>,
}

/// A closed line that borders a region.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleLoop {
    /// Its edges, each beginning at the screen point at which the one before it ends, and the first one at the end of the last. In the
    /// parameters they do so too, to the precision of the points, but for a pole: there the loop goes on along the side that
    /// collapses to the point.
    pub edges: Vec<VisibleEdge>,
}

/// A part of one curve of the picture, as the border of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleEdge {
    /// What the curve is: a [`Boundary`](CurveKind::Boundary), [`Crease`](CurveKind::Crease) or
    /// [`Silhouette`](CurveKind::Silhouette), which a drawing shows as a line, a [`Smooth`](CurveKind::Smooth) join, which it does
    /// not show, or a [`Section`](CurveKind::Section).
    pub kind: CurveKind,
    /// Whether the surface of the region ends in the curve; if not, it goes on behind another surface, or behind another part
    /// of itself.
    pub own: bool,
    /// Two points or more, in the direction of the loop, ends included.
    pub points: Vec<BorderPoint>,
}

/// A point of a border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BorderPoint {
    /// On the screen.
    pub screen: DVec2,
    /// Parameters of the region's surface.
    pub uv: DVec2,
}

/// A place at which a border is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndecidedBorder {
    /// On the screen.
    pub at: DVec2,
    /// The surface whose border it is, if that is known.
    pub surface: Option<usize>,
    /// Why.
    pub why: &'static str,
}

/// What finding regions counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VisibleStats {
    /// Visible parts of curves.
    pub parts: u64,
    /// Edges that they were split into where one passes behind another, or ends in it.
    pub edges: u64,
    /// Edges that border nothing: both sides are one part of one surface.
    pub inner: u64,
    /// Vertices.
    pub vertices: u64,
    /// Sight lines for the surfaces beside edges, for points on the surfaces behind them, and for pieces that a hidden curve covers.
    pub rays: u64,
}

impl VisibleRegion {
    /// Its area on the screen, by the polygons of its loops. It is short of the true one by no more than two thirds of the
    /// length of the border times the tolerance.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.loops.iter().map(VisibleLoop::area).sum()
    }
}

impl VisibleLoop {
    /// All points in order; where two edges meet, both have the point.
    pub fn points(&self) -> impl Iterator<Item = &BorderPoint> {
        self.edges.iter().flat_map(|e| &e.points)
    }

    /// The area inside on the screen, by Green's theorem; negative for a hole.
    #[must_use]
    pub fn area(&self) -> f64 {
        // About a point of the loop, so that far from the origin no digits are lost.
        let Some(origin) = self.points().next().map(|p| p.screen) else { return 0.0 };
        let chords = self.edges.iter().flat_map(|e| e.points.windows(2));
        chords.map(|w| 0.5 * (w[0].screen - origin).perp_dot(w[1].screen - origin)).sum()
    }
}

/// How finely borders are made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderOptions<'a> {
    /// Largest distance of a chord from the border, screen units.
    pub(crate) tolerance: f64,
    /// Largest turn of the normal between neighbouring points, radians.
    pub(crate) normal_angle: f64,
    /// Places within this of one another are one, screen units.
    pub(crate) contact: f64,
    /// How straight borders are between neighbouring points in the parameters, if that is asked for.
    pub(crate) straight: Option<Straight<'a>>,
}

/// How straight borders are in the parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Straight<'a> {
    /// Who looks at the chords.
    pub(crate) camera: &'a Camera,
    /// Largest distance of a chord in the parameters, and of a straight one, from the border on this camera's screen.
    pub(crate) tolerance: f64,
}

/// The visible regions of all surfaces, from all that is seen of the curves that can border them; `asking` is how it was asked for.
pub(crate) fn visible_regions(
    subject: &Subject<'_>,
    sightings: &[Sighting],
    asking: &ClassifyOptions,
    options: BorderOptions<'_>,
) -> VisibleRegions {
    let (visible, asked) = uncovered::visible(subject, sightings, asking, &options);
    let map = planar::map(subject, &visible, options.tolerance, options.contact);
    let (sides, rays) = sides::sides(subject, &map, options.tolerance);
    let inner = map.edges.iter().zip(&sides).filter(|(e, s)| s.as_ref().is_some_and(|s| walk::is_inner(subject, e, s)));
    let mut out = VisibleRegions {
        stats: VisibleStats {
            parts: map.parts as u64,
            edges: map.edges.len() as u64,
            inner: inner.count() as u64,
            vertices: map.vertices.len() as u64,
            rays: asked + rays,
        },
        ..VisibleRegions::default()
    };
    for edge in map.edges.iter().zip(&sides).filter(|(_, s)| s.is_none()).map(|(e, _)| e) {
        let at = edge.places[edge.places.len() / 2].1.truncate();
        let why = "sight lines beside an edge do not agree on what is nearest there";
        out.undecided.push(UndecidedBorder { at, surface: None, why });
    }
    let halves: Vec<(usize, Vec<Half>)> = walk::halves(subject, &map, &sides).into_iter().collect();
    let region = |scratch: &mut RayScratch, (surface, halves): &(usize, Vec<Half>)| {
        let before = scratch.stats.rays;
        let mut undecided = Vec::new();
        let mut doubt = |at: DVec2, why| undecided.push(UndecidedBorder { at, surface: Some(*surface), why });
        let walked = walk::walk(subject, &map, halves);
        for &vertex in &walked.open {
            doubt(map.vertices[vertex], "a border of the surface does not go on here as often as it comes");
        }
        let mut edge = |half: &Half| {
            let edge = &map.edges[half.edge];
            let mut border = Border {
                subject,
                edge,
                beside: &half.beside,
                right: half.reversed,
                options,
                scratch: &mut *scratch,
                missing: None,
            };
            let mut points = border.points();
            if let Some(at) = border.missing {
                doubt(at, "no point of the surface was found behind another one's edge");
            }
            if half.reversed {
                points.reverse();
            }
            VisibleEdge { kind: subject.curves[edge.curve].kind, own: half.beside.sheet.is_some(), points }
        };
        let walked =
            walked.loops.iter().map(|own| VisibleLoop { edges: own.iter().map(&mut edge).collect() }).collect();
        let near = walk::WIDEST_GAP * subject.geometry.view.size();
        let tolerance = options.tolerance + options.contact;
        let sheets = Sheets { subject, surface: *surface, near, tolerance };
        let mut loops = sheets.own(walked);
        // Where loops are not asked to be polygons in the parameters it is of no matter.
        for at in loops.iter().filter(|_| options.straight.is_some()).flat_map(|own| sheets.changes(own)) {
            doubt(at, "the border goes on with another part of the surface here");
        }
        loops.iter_mut().for_each(|own| over_gaps(&mut own.edges));
        (VisibleRegion { surface: *surface, loops }, undecided, scratch.stats.rays - before)
    };
    #[cfg(feature = "parallel")]
    let all: Vec<_> = {
        use rayon::prelude::*;
        halves.par_iter().map_init(RayScratch::default, region).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let all: Vec<_> = {
        let mut scratch = RayScratch::default();
        halves.iter().map(|own| region(&mut scratch, own)).collect()
    };
    for (region, undecided, rays) in all {
        out.stats.rays += rays;
        out.undecided.extend(undecided);
        if !region.loops.is_empty() {
            out.regions.push(region);
        }
    }
    out
}

/// Goes on to the beginning of the next edge where an edge ends before it.
fn over_gaps(edges: &mut [VisibleEdge]) {
    for k in 0..edges.len() {
        let next = edges[(k + 1) % edges.len()].points.first().copied();
        let points = &mut edges[k].points;
        if let (Some(next), Some(last)) = (next, points.last())
            && last.screen != next.screen
        {
            points.push(next);
        }
    }
}

#[cfg(test)]
mod tests;

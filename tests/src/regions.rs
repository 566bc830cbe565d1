//! Visible regions held against the painted preview, pixel by pixel.
//!
//! What is painted into a pixel is the nearest of points of the surfaces, which are found by isocurves and distances, with
//! nothing of the curves, the crossings and the sight lines that regions are made of. It is nowhere farther than the nearest surface
//! within half a pixel, but may be of another one: where one lies closely behind another and both are steep, the nearest of
//! some points of the one may be nearer than that of some of the other. So where region and paint differ, the triangles of the
//! [oracle](crate::oracle) say what is nearest in the middle of the pixel.

use glam::DVec2;
use penvis_core::pipeline::Prepared;
use penvis_core::render::{PixelGrid, Raster};
use penvis_core::visible::{VisibleRegion, VisibleRegions};

use crate::oracle::{Nearest, Oracle};

/// What the pixels say of regions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Pixels farther than one from every border.
    pub clear: usize,
    /// Of these, pixels that another surface, or none, was painted into than the one whose region holds them, and in whose middle the
    /// oracle does not see that one surely.
    pub wrong: usize,
    /// Of these, pixels that another surface was painted into, though in their middle the oracle sees that whose region holds them.
    pub steep: usize,
    /// Of these, pixels whose middle is in several regions. At a border that two share chords of the one and of the other are within the tolerance
    /// of it, and a middle may be between them.
    pub shared: usize,
    /// Area of all regions, in pixels.
    pub area: f64,
}

/// Compares each pixel; `oracle` is asked for where they differ.
#[must_use]
pub fn against<'a>(
    prepared: &Prepared,
    regions: &VisibleRegions,
    raster: &Raster,
    oracle: impl Fn() -> &'a Oracle,
) -> Agreement {
    let grid = &raster.grid;
    let view = prepared.geometry().view;
    let near = near_borders(regions, grid);
    let mut owners: Vec<Option<usize>> = vec![None; grid.width * grid.height];
    let mut out = Agreement::default();
    for region in &regions.regions {
        out.area += region.area() / grid.pixel.powi(2);
        for k in inside(region, grid) {
            out.shared += usize::from(owners[k].is_some() && !near[k]);
            owners[k] = Some(region.surface);
        }
    }
    for k in (0..owners.len()).filter(|&k| !near[k]) {
        let painted = raster.samples[k].map(|s| view.patches()[s.patch].surface);
        out.clear += 1;
        if painted != owners[k] {
            let held = owners[k].map_or(Nearest::Nothing, Nearest::Surface);
            let seen = oracle().nearest(grid.centre(k % grid.width, k / grid.width));
            *if seen == held { &mut out.steep } else { &mut out.wrong } += 1;
        }
    }
    out
}

/// The pixels whose middles are in a region, by the even-odd rule.
fn inside(region: &VisibleRegion, grid: &PixelGrid) -> Vec<usize> {
    let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); grid.height];
    for [a, b] in segments(region, grid) {
        let (lo, hi) = if a.y <= b.y { (a, b) } else { (b, a) };
        // Rows whose middles lie from the lower end on up to the upper one, that excluded.
        let row = |y: f64| (y - 0.5).ceil().max(0.0) as usize;
        for (y, row) in crossings.iter_mut().enumerate().take(row(hi.y)).skip(row(lo.y)) {
            let y = y as f64 + 0.5;
            row.push(lo.x + (hi.x - lo.x) * (y - lo.y) / (hi.y - lo.y));
        }
    }
    let mut out = Vec::new();
    for (y, row) in crossings.iter_mut().enumerate() {
        row.sort_by(f64::total_cmp);
        for pair in row.chunks_exact(2) {
            let [from, to] = [pair[0], pair[1]].map(|x| ((x - 0.5).ceil().max(0.0) as usize).min(grid.width));
            out.extend((from..to).map(|x| y * grid.width + x));
        }
    }
    out
}

/// The chords of a region's border, in pixels to the right and down.
fn segments(region: &VisibleRegion, grid: &PixelGrid) -> impl Iterator<Item = [DVec2; 2]> {
    let edges = region.loops.iter().flat_map(|l| &l.edges);
    edges.flat_map(|e| e.points.windows(2)).map(|w| [w[0], w[1]].map(|p| grid.place(p.screen)))
}

/// For each pixel whether its middle is within a pixel of a border.
fn near_borders(regions: &VisibleRegions, grid: &PixelGrid) -> Vec<bool> {
    let mut near = vec![false; grid.width * grid.height];
    for [a, b] in regions.regions.iter().flat_map(|r| segments(r, grid)) {
        let range = |lo: f64, hi: f64, count: usize| {
            let from = ((lo - 1.5).ceil().max(0.0) as usize).min(count);
            from..(((hi + 0.5).floor() + 1.0).max(0.0) as usize).clamp(from, count)
        };
        for y in range(a.y.min(b.y), a.y.max(b.y), grid.height) {
            for x in range(a.x.min(b.x), a.x.max(b.x), grid.width) {
                let q = DVec2::new(x as f64, y as f64) + 0.5;
                let d = b - a;
                let along = if d == DVec2::ZERO { 0.0 } else { ((q - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
                near[y * grid.width + x] |= q.distance(a + d * along) <= 1.0;
            }
        }
    }
    near
}

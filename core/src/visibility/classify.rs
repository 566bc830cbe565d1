//! Quantitative invisibility of every piece: by rays, or from piece to piece.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::propagate::propagate;
use super::{Certainty, Cracks, Exclusion, Occluders, RayScratch};
use crate::arrange::{Arrangement, CurveArcs, LengthTable, Piece};
use crate::extract::chain::SilhouetteChains;
use crate::extract::{Geometry, Path, SurfaceCurve};
use crate::stitch::Stitching;
use crate::stop::Stop;

/// Where the visibility of a piece comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Every piece is asked for by rays, several along a long one.
    #[default]
    Rays,
    /// One ray decides for all pieces that are linked to the one it was fired at, and no ray is needed for what is linked
    /// to the outline of the picture. Where two ways to a piece disagree, rays decide.
    Propagate,
}

/// How visibility is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassifyOptions {
    /// Where the answers come from.
    pub method: Method,
    /// Largest distance between two rays along a piece, screen units. A piece has one visibility by construction, but
    /// for surfaces that pierce each other; rays this close find where.
    pub spacing: f64,
    /// Width on the screen to which such a change is located.
    pub resolution: f64,
    /// Whether hidden pieces are wanted with their exact number of sheets, or only as hidden.
    pub count_hidden: bool,
}

/// Directions in which the outermost point of the picture is a start. No axis is among them: there a whole edge may be
/// outermost, and all of its points lie before or behind others.
const DIRECTIONS: [f64; 6] = [0.31, 1.37, 2.42, 3.53, 4.49, 5.61];

/// Distance from the end of a piece, in resolutions, at which a point counts as clearly inside.
const MARGIN: f64 = 64.0;

/// Extent of an outermost place, of the size. Along a curve of radius R, what is no farther in than the margin m reaches
/// over 2 √(2 R m); surfaces lie one behind the other at greater distances than that, or their outlines coincide.
const OUTLYING: f64 = 1e-2;

impl ClassifyOptions {
    /// Distance from the end of a piece, screen units, at which a point counts as clearly inside. Locating changes is ten times
    /// finer than telling crossings apart.
    pub(super) fn margin(&self) -> f64 {
        10.0 * MARGIN * self.resolution
    }
}

/// The places where a picture reaches farthest out, at which propagation starts: curve and parameter of each. Afterwards the arcs
/// of the curves are not needed any more.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outermost(Vec<(usize, f64)>);

impl Outermost {
    /// Those of a picture of this size, in the fixed directions in which there is one such place; none if pieces are asked for by
    /// rays alone. Cost: linear in the number of arcs.
    #[must_use]
    pub fn new(arcs: CurveArcs<'_>, size: f64, options: &ClassifyOptions) -> Self {
        if options.method == Method::Rays {
            return Self::default();
        }
        let directions = DIRECTIONS.map(|angle| DVec2::new(libm::cos(angle), libm::sin(angle)));
        let places = arcs.outermost(directions, options.margin(), OUTLYING * size);
        Self(places.into_iter().flatten().collect())
    }
}

/// What is asked about: everything that earlier stages made.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// What evaluates the curves.
    pub geometry: Geometry<'a>,
    /// All curves.
    pub curves: &'a [SurfaceCurve],
    /// Where they are outermost.
    pub outermost: &'a Outermost,
    /// The silhouettes among them, chained.
    pub chains: &'a SilhouetteChains,
    /// Their pieces.
    pub arrangement: &'a Arrangement,
    /// Which boundaries coincide.
    pub stitching: &'a Stitching,
    /// The surfaces.
    pub occluders: &'a Occluders<'a>,
    /// Where they do not quite meet.
    pub cracks: &'a Cracks<'a>,
    /// When to stop.
    pub stop: Stop<'a>,
}

/// What sight lines are sent through, and tell a curve's own sheets from others.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// What evaluates the curves.
    pub geometry: Geometry<'a>,
    /// Which boundaries coincide.
    pub stitching: &'a Stitching,
    /// The surfaces.
    pub occluders: &'a Occluders<'a>,
    /// Where they do not quite meet.
    pub cracks: &'a Cracks<'a>,
}

impl Surroundings<'_> {
    /// Stitched curves agree to this, in view space; anything farther is another part of the side.
    fn reach(&self) -> f64 {
        1e-5 * self.geometry.view.size()
    }
}

impl<'a> Subject<'a> {
    /// What sight lines are sent through.
    pub(crate) fn surroundings(&self) -> Surroundings<'a> {
        let Self { geometry, stitching, occluders, cracks, .. } = *self;
        Surroundings { geometry, stitching, occluders, cracks }
    }

    /// Stitched curves agree to this, in view space; anything farther is another part of the side.
    pub(super) fn reach(&self) -> f64 {
        self.surroundings().reach()
    }

    /// The pieces whose insides hold the outermost places of the picture: nothing lies in front of them.
    pub(super) fn outermost(&self, margin: f64) -> impl Iterator<Item = usize> {
        self.outermost.0.iter().filter_map(move |&(curve, t)| {
            let table = &self.arrangement.lengths[curve];
            let l = table.length_at(t);
            self.arrangement.pieces.iter().position(|p| {
                let [a, b] = p.t.map(|x| table.length_at(x));
                p.curve == curve && !p.coincident && a + margin < l && l < b - margin
            })
        })
    }

    /// Whether a piece has to be decided: it is inked, and no other curve draws the same line.
    pub(super) fn wanted(&self, piece: &Piece) -> bool {
        piece.covered_by.is_none() && self.curves[piece.curve].inked
    }
}

/// A part of a curve with its quantitative invisibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Index of the curve.
    pub curve: usize,
    /// Interval of the curve's parameter.
    pub t: [f64; 2],
    /// Sheets in front. Exact for visible parts; for hidden ones only if asked for.
    pub qi: u32,
    /// How it was decided.
    pub certainty: Certainty,
}

/// A place where visibility rests on a tolerance, or could not be decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubt {
    /// The place in model space.
    pub at: DVec3,
    /// Why.
    pub why: &'static str,
}

/// What classifying counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VisibilityStats {
    /// Rays to points of active curves.
    pub rays_active: u64,
    /// Rays to points of passive curves.
    pub rays_passive: u64,
    /// Pieces whose visibility came from another one, or from the outline, without a ray.
    pub propagated: u64,
    /// Pieces along which rays disagreed, so that a change was sought and found inside, and links between pieces that
    /// disagreed, so that rays decided.
    pub disagreements: u64,
    /// Parts of curves by how their visibility was decided: proven, by a tolerance, undecided.
    pub decided: [u64; 3],
    /// A place of each part that was decided by a tolerance.
    pub tolerated: Vec<Doubt>,
    /// A place of each piece about which nothing could be decided.
    pub undecided: Vec<Doubt>,
}

impl VisibilityStats {
    fn add(&mut self, other: Self) {
        self.rays_active += other.rays_active;
        self.rays_passive += other.rays_passive;
        self.propagated += other.propagated;
        self.disagreements += other.disagreements;
        self.tolerated.extend(other.tolerated);
        self.undecided.extend(other.undecided);
    }
}

/// Decides the visibility of every piece that has to be inked, in the order of the pieces. Pieces drawn by another curve
/// are left out.
#[must_use]
pub fn classify(subject: &Subject<'_>, options: &ClassifyOptions) -> (Vec<Sighting>, VisibilityStats) {
    let pieces = &subject.arrangement.pieces;
    let mut stats = VisibilityStats::default();
    let known = match options.method {
        Method::Rays => Vec::new(),
        Method::Propagate => propagate(subject, options, &mut stats),
    };
    let by_rays = |k: &usize| known.get(*k).copied().flatten().is_none();
    let wanted = (0..pieces.len()).filter(|&k| subject.wanted(&pieces[k]));
    let (asked, told): (Vec<usize>, Vec<usize>) = wanted.partition(by_rays);
    let mut all: Vec<(usize, Sighting)> = Vec::with_capacity(pieces.len());
    for k in told {
        if let Some(qi) = known[k] {
            all.push((k, Sighting { curve: pieces[k].curve, t: pieces[k].t, qi, certainty: Certainty::Proven }));
        }
    }
    ask_all(subject, options, &asked, &mut |k, seen, counted| {
        all.extend(seen.into_iter().map(|sighting| (k, sighting)));
        stats.add(counted);
    });
    all.sort_by_key(|a| a.0);
    let all: Vec<Sighting> = all.into_iter().map(|a| a.1).collect();
    for s in &all {
        stats.decided[s.certainty as usize] += 1;
    }
    (all, stats)
}

/// Decides the visibility of pieces of one curve by rays, as [`classify`] does that of all curves: those over the intervals `pieces`, in their order. The curve has the
/// index `index` in what is told. What is counted is added to `stats`, without the places of doubt, which take the model and memory.
#[must_use]
pub fn classify_one(
    around: Surroundings<'_>,
    options: &ClassifyOptions,
    (index, curve, lengths): (usize, &SurfaceCurve, &LengthTable),
    pieces: &[[f64; 2]],
    scratch: &mut RayScratch,
    stats: &mut VisibilityStats,
) -> Vec<Sighting> {
    let mut seen = Vec::new();
    for &t in pieces {
        let of = OnePiece { index, curve, t, table: lengths };
        let mut watch = Watch { places: false, ..Watch::new(around, options, of, scratch) };
        seen.extend(watch.piece());
        stats.add(watch.stats);
    }
    for sighting in &seen {
        stats.decided[sighting.certainty as usize] += 1;
    }
    seen
}

/// Fires rays along pieces, by their indices, and hands on what they tell in that order.
fn ask_all(
    subject: &Subject<'_>,
    options: &ClassifyOptions,
    pieces: &[usize],
    told: &mut dyn FnMut(usize, Vec<Sighting>, VisibilityStats),
) {
    let look = |scratch: &mut RayScratch, k: &usize| {
        if subject.stop.is_wanted() {
            return (Vec::new(), VisibilityStats::default());
        }
        let mut watch = Watch::of(subject, options, *k, scratch);
        let seen = watch.piece();
        (seen, watch.stats)
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        let all: Vec<_> = pieces.par_iter().map_init(RayScratch::default, look).collect();
        pieces.iter().zip(all).for_each(|(&k, (seen, counted))| told(k, seen, counted));
    }
    // One after the other, so that what they tell is in memory once.
    #[cfg(not(feature = "parallel"))]
    {
        let mut scratch = RayScratch::default();
        for k in pieces {
            let (seen, counted) = look(&mut scratch, k);
            told(*k, seen, counted);
        }
    }
}

/// One answer along a piece.
#[derive(Clone, Copy, Debug)]
struct Sample {
    t: f64,
    qi: u32,
    clear: bool,
    contact: bool,
}

/// A piece of a curve along which lengths are known.
struct OnePiece<'a> {
    index: usize,
    curve: &'a SurfaceCurve,
    t: [f64; 2],
    table: &'a LengthTable,
}

pub(super) struct Watch<'a> {
    around: Surroundings<'a>,
    options: &'a ClassifyOptions,
    /// Index of the curve in what is told.
    index: usize,
    curve: &'a SurfaceCurve,
    t: [f64; 2],
    table: &'a LengthTable,
    scratch: &'a mut RayScratch,
    /// Whether places of doubt are told.
    places: bool,
    pub(super) stats: VisibilityStats,
}

/// Rays along one piece at the most; beyond it a piece is long enough that finer sampling is another stage's work.
const MOST_SAMPLES: usize = 256;

impl<'a> Watch<'a> {
    /// The piece with this index.
    pub(super) fn of(
        subject: &'a Subject<'a>,
        options: &'a ClassifyOptions,
        piece: usize,
        scratch: &'a mut RayScratch,
    ) -> Self {
        let Piece { curve: index, t, .. } = subject.arrangement.pieces[piece];
        let (curve, table) = (&subject.curves[index], &subject.arrangement.lengths[index]);
        Self::new(subject.surroundings(), options, OnePiece { index, curve, t, table }, scratch)
    }

    fn new(
        around: Surroundings<'a>,
        options: &'a ClassifyOptions,
        OnePiece { index, curve, t, table }: OnePiece<'a>,
        scratch: &'a mut RayScratch,
    ) -> Self {
        Self { around, options, index, curve, t, table, scratch, places: true, stats: VisibilityStats::default() }
    }

    /// The answer of one ray to the piece, if there is a clear one.
    pub(super) fn once(&mut self) -> Option<u32> {
        let [a, b] = self.t;
        let sample = self.clear_sample(self.table.length_at(a), self.table.length_at(b), 0, 1);
        sample.clear.then_some(sample.qi)
    }

    fn piece(&mut self) -> Vec<Sighting> {
        let [a, b] = self.t;
        let (la, lb) = (self.table.length_at(a), self.table.length_at(b));
        let count = (libm::ceil((lb - la) / self.options.spacing) as usize).clamp(1, MOST_SAMPLES);
        let mut samples = Vec::with_capacity(count);
        for k in 0..count {
            samples.push(self.clear_sample(la, lb, k, count));
        }
        // Answers that met something at a fold or a border give way to the clear ones beside them.
        if samples.iter().any(|s| s.clear) {
            samples.retain(|s| s.clear);
        }
        let clear = samples[0].clear;
        let certainty = match (clear, samples.iter().any(|s| s.contact)) {
            (true, false) => Certainty::Proven,
            _ => Certainty::Tolerance,
        };
        let mut out = Vec::new();
        let mut start = a;
        let mut changes = 0;
        let (curve, geometry, places) = (self.curve, self.around.geometry, self.places);
        let doubt = |t: f64, why: &'static str| {
            let doubt = || Doubt { at: curve.model_point(&geometry, t), why };
            places.then(doubt)
        };
        for w in samples.windows(2) {
            if self.key(w[0].qi) != self.key(w[1].qi) {
                let t = self.locate_change(w[0], w[1]);
                out.push(self.sighting([start, t], w[0].qi, Certainty::Tolerance));
                start = t;
                changes += 1;
            }
        }
        let last = samples[samples.len() - 1];
        if changes > 0 {
            self.stats.disagreements += 1;
            out.push(self.sighting([start, b], last.qi, Certainty::Tolerance));
            if clear {
                let why = "rays differ along a piece; the change between them was located";
                self.stats.tolerated.extend(out.iter().filter_map(|s| doubt(0.5 * (s.t[0] + s.t[1]), why)));
            } else {
                for s in &mut out {
                    s.certainty = Certainty::Undecided;
                }
                self.stats.undecided.extend(doubt(last.t, "every sight line meets a fold or a border"));
            }
        } else {
            if certainty == Certainty::Tolerance {
                let why =
                    if clear { "a surface passes through the curve" } else { "sight lines meet a fold or a border" };
                self.stats.tolerated.extend(doubt(last.t, why));
            }
            out.push(self.sighting([start, b], last.qi, certainty));
        }
        out
    }

    fn sighting(&self, t: [f64; 2], qi: u32, certainty: Certainty) -> Sighting {
        Sighting { curve: self.index, t, qi, certainty }
    }

    /// What is to be told apart: the number of sheets, or only visible from hidden.
    fn key(&self, qi: u32) -> u32 {
        if self.options.count_hidden { qi } else { qi.min(1) }
    }

    /// A clear answer inside part `k` of `count` of the piece, or the last unclear one.
    fn clear_sample(&mut self, la: f64, lb: f64, k: usize, count: usize) -> Sample {
        let mut sample = Sample { t: self.t[0], qi: 0, clear: false, contact: false };
        for f in [0.47, 0.31, 0.68, 0.16, 0.86] {
            sample = self.ask(self.table.param_at(la + (lb - la) * (k as f64 + f) / count as f64));
            if sample.clear {
                break;
            }
        }
        sample
    }

    /// Bisects between two rays that disagree until the change is located to the resolution.
    fn locate_change(&mut self, a: Sample, b: Sample) -> f64 {
        let (mut lo, mut hi) = (self.table.length_at(a.t), self.table.length_at(b.t));
        let (mut tlo, mut thi) = (a.t, b.t);
        while hi - lo > self.options.resolution {
            let m = 0.5 * (lo + hi);
            let t = self.table.param_at(m);
            if t <= tlo || t >= thi {
                break;
            }
            let qi = self.ask(t).qi;
            if self.key(qi) == self.key(a.qi) { (lo, tlo) = (m, t) } else { (hi, thi) = (m, t) }
        }
        0.5 * (tlo + thi)
    }

    fn ask(&mut self, t: f64) -> Sample {
        if self.curve.active {
            self.stats.rays_active += 1;
        } else {
            self.stats.rays_passive += 1;
        }
        let p = self.curve.point(&self.around.geometry, t);
        let exclusions = self.exclusions(t, p);
        let answer = self.around.occluders.query_among(p, &exclusions, self.around.cracks, self.scratch);
        Sample { t, qi: answer.qi, clear: answer.clear, contact: answer.contact }
    }

    /// The point's own places on its surfaces, which must not count as being in front of it: by identity in parameter
    /// space, on the curve's surface and on whatever is stitched to it there.
    fn exclusions(&self, t: f64, p: DVec3) -> Vec<Exclusion> {
        let uv = self.curve.uv(&self.around.geometry, t);
        let own = self.curve.surface;
        if let Path::Section(section) = &self.curve.path {
            // Neither of its two surfaces is in front of it there.
            let places = self.curve.both_uv(&self.around.geometry, section, t);
            let exclusion = |(&surface, uv): (&usize, DVec2)| {
                let radius = self.parameter_size(surface, uv) * SECTION_RADIUS;
                Exclusion { surface, uv, radius }
            };
            return self.curve.surfaces.iter().zip(places).map(exclusion).collect();
        }
        let traced = matches!(self.curve.path, Path::Traced(_));
        let radius = if traced { self.fold_radius(t, uv) } else { self.parameter_size(own, uv) * LINE_RADIUS };
        let mut out = Vec::with_capacity(4);
        out.push(Exclusion { surface: own, uv, radius });
        let reach = self.around.reach();
        let mut add = |side: usize, reach: f64| {
            let path = &self.around.stitching.sides[side].path;
            let (ts, d) = path.nearest(self.around.geometry.view, p);
            if d <= reach {
                out.push(self.exclusion_of_side(side, ts, d));
            }
        };
        for &s in &self.curve.sides {
            add(s, f64::INFINITY);
        }
        if self.curve.sides.is_empty() {
            let grid = &self.around.geometry.view.surfaces()[own];
            let (u, v) = (&grid.u_breaks, &grid.v_breaks);
            let gaps = [uv.x - u[0], u[u.len() - 1] - uv.x, uv.y - v[0], v[v.len() - 1] - uv.y];
            for (k, gap) in gaps.iter().enumerate() {
                let r = if k < 2 { radius.x } else { radius.y };
                if *gap <= r {
                    for edge in self.around.stitching.edges_of(4 * own + k) {
                        for &partner in &edge.partners {
                            add(partner, reach);
                        }
                    }
                }
            }
        }
        out
    }

    /// Round the place `t` of a side that is `distance` from the same edge on another surface. Where that is wide, because
    /// the model's shared edges are loose, so is what is left out: as far again.
    fn exclusion_of_side(&self, side: usize, t: f64, distance: f64) -> Exclusion {
        let path = &self.around.stitching.sides[side].path;
        let view = self.around.geometry.view;
        let (surface, uv) = (path.surface(), path.uv(t));
        let (patch, local) = path.place(view, t);
        let (size, jet) = (self.parameter_size(surface, uv), view.patches()[patch].jet(local.x, local.y));
        let speed = DVec2::new(jet.du.length(), jet.dv.length());
        let wide = |d: usize| if speed[d] > 0.0 { (2.0 * distance / speed[d]).min(0.5) } else { 0.0 };
        let radius = DVec2::new(wide(0), wide(1)).max(DVec2::splat(PARTNER_RADIUS)) * size;
        Exclusion { surface, uv, radius }
    }

    /// Size of the patch that holds `uv`, in surface parameters.
    fn parameter_size(&self, surface: usize, uv: DVec2) -> DVec2 {
        let (patch, _) = self.around.geometry.view.locate(surface, uv, [false; 2]);
        self.around.geometry.view.patches()[patch].parameter_size()
    }

    /// Half-widths round a point of a silhouette inside which every root is the point itself: a double root, which
    /// rounding (2⁻⁵³ of the picture) pulls apart by the square root of that, some 10⁻⁸, and more where the fold is
    /// flat. A quarter of the way to the ends of the piece at most, where a cusp may be.
    fn fold_radius(&self, t: f64, uv: DVec2) -> DVec2 {
        let [a, b] = self.t;
        let (p, q) = (self.curve.uv(&self.around.geometry, a), self.curve.uv(&self.around.geometry, b));
        let size = self.parameter_size(self.curve.surface, uv);
        let room = ((p - uv) / size).length().min(((q - uv) / size).length());
        let closed = a == self.curve.domain[0] && b == self.curve.domain[1] && (p - q).length() == 0.0;
        let room = if closed || t <= a || t >= b { FOLD_RADIUS } else { 0.25 * room };
        size * FOLD_RADIUS.min(room)
    }
}

/// Exclusion round a point of an isoparametric line, of the patch's parameter size: a simple root is good to some
/// 10⁻¹³, and next to a fold the second root is farther away than this unless the point is within its square.
const LINE_RADIUS: f64 = 1e-7;

/// Exclusion round a point of a section on both of its surfaces: it is good to rounding over the angle between them.
const SECTION_RADIUS: f64 = 1e-6;

/// Exclusion round the same point on a stitched neighbour, which is known to the stitching tolerance only.
const PARTNER_RADIUS: f64 = 1e-4;

/// Exclusion round a point of a silhouette; see [`Watch::fold_radius`].
const FOLD_RADIUS: f64 = 1e-4;

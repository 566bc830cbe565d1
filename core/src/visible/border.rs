//! Points of a border, on the screen and on the region's surface.
//!
//! Where the surface ends in the edge its parameters come with the curve. Where it goes on behind, they are those of the surface on
//! the sight line (the paper's section *Calculation of the mutual-occlusion region*), followed from the place that was looked at,
//! so that of several sheets of one surface it is always the same.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::planar::{Edge, nearest};
use super::sheets::goes_straight_on;
use super::sides::{Beside, Sheet, apart};
use super::{BorderOptions, BorderPoint, Straight};
use crate::extract::SurfaceCurve;
use crate::visibility::{RayScratch, Subject};

/// Halvings of a chord at the most: near a fold the normal turns with the root of the distance.
const DEEPEST: u32 = 12;

/// Largest step between neighbours, of the parameter range, beyond which it is doubtful that they are on one sheet.
const WIDEST: f64 = 0.05;

/// Parts of the chord by which a point is moved inwards if the surface is not met at its end. The chord is then as short as the
/// contact tolerance, to which the ends of edges are known.
const INWARDS: [f64; 4] = [1e-4, 1e-2, 0.1, 0.5];

/// Within this part of the parameter range of its end a place counts as one on the seam of a closed surface.
const ON_SEAM: f64 = 1e-6;

/// How far aside a point is moved, in contact tolerances, if the surface is not met at the edge.
const ASIDE: [f64; 3] = [1.0, 4.0, 16.0];

/// A place of the border.
#[derive(Clone, Copy)]
struct Place {
    t: f64,
    p: DVec3,
    uv: DVec2,
}

/// An edge as the border of a region.
pub(super) struct Border<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) edge: &'a Edge,
    pub(super) beside: &'a Beside,
    /// Whether the region lies on the right of the edge in its own direction.
    pub(super) right: bool,
    pub(super) options: BorderOptions<'a>,
    pub(super) scratch: &'a mut RayScratch,
    /// The first place at which no point of the surface was found.
    pub(super) missing: Option<DVec2>,
}

impl Border<'_> {
    fn curve(&self) -> &SurfaceCurve {
        &self.subject.curves[self.edge.curve]
    }

    /// The points in the direction of the edge.
    pub(super) fn points(&mut self) -> Vec<BorderPoint> {
        let places = &self.edge.places;
        let t = self.beside.t;
        let p = self.curve().point(&self.subject.geometry, t);
        let beside = Place { t, p, uv: self.beside.uv };
        let found = self.uv((t, p), beside, true);
        if found.is_none() {
            self.missing = Some(p.truncate());
        }
        let middle = Place { uv: found.unwrap_or(beside.uv), ..beside };
        let after = places.partition_point(|x| x.0 <= t);
        let mut out: Vec<Place> = Vec::with_capacity(places.len() + 1);
        let mut from = middle;
        for &(t, p) in places[..after].iter().rev().filter(|x| x.0 < t) {
            from = self.advance(from, (t, p), &mut out, 0);
        }
        out.reverse();
        out.push(middle);
        from = middle;
        for &(t, p) in &places[after..] {
            from = self.advance(from, (t, p), &mut out, 0);
        }
        out.into_iter().map(|x| BorderPoint { screen: x.p.truncate(), uv: x.uv }).collect()
    }

    /// Appends what leads from one place to the next, that included, and returns it.
    fn advance(&mut self, from: Place, (t, p): (f64, DVec3), out: &mut Vec<Place>, depth: u32) -> Place {
        let last = depth >= DEEPEST || from.p.truncate().distance(p.truncate()) <= self.options.contact;
        let found = self.uv((t, p), from, last);
        let to = Place { t, p, uv: found.unwrap_or(from.uv) };
        let turn = self.turn(from.uv, to.uv);
        let bent = turn > self.options.normal_angle
            // An arc of so much turn rises so far over its chord.
            || 0.125 * turn * self.chord(from, to) > self.options.tolerance
            || apart(self.subject, self.beside.surface, from.uv, to.uv) > WIDEST
            || (!last && self.strays(from, to));
        // Where it is not found once it is sought no more closely: the edge borders another surface there.
        let sought = found.is_none() && self.missing.is_none();
        if (bent || sought) && !last {
            let m = 0.5 * (from.t + t);
            let middle = self.curve().point(&self.subject.geometry, m);
            let from = self.advance(from, (m, middle), out, depth + 1);
            return self.advance(from, (t, p), out, depth + 1);
        }
        if found.is_none() {
            self.missing.get_or_insert(p.truncate());
        }
        out.push(to);
        to
    }

    /// Whether the chord between two places strays too far from the border half-way, on the surface or straight across, as the camera sees it
    /// that asks for this.
    fn strays(&mut self, from: Place, to: Place) -> bool {
        let Some(Straight { camera, tolerance }) = self.options.straight else { return false };
        let t = 0.5 * (from.t + to.t);
        let p = self.curve().point(&self.subject.geometry, t);
        // Where it is not found it is sought nearer by, as ends of chords are.
        let Some(uv) = self.uv((t, p), from, false) else { return self.missing.is_none() };
        let (view, surface) = (self.subject.geometry.view, self.beside.surface);
        let seen = |uv: DVec2| camera.project(view.model_point(surface, uv)).map(DVec3::truncate);
        let (Some(a), Some(b), Some(c)) = (seen(from.uv), seen(to.uv), seen(uv)) else { return false };
        let (d, length) = (b - a, a.distance_squared(b));
        if length == 0.0 {
            return seen(0.5 * (from.uv + to.uv)).is_some_and(|m| m.distance(c).max(a.distance(c)) > tolerance);
        }
        let mut share = ((c - a).dot(d) / length).clamp(0.0, 1.0);
        if c.distance(a + share * d) > tolerance {
            return true;
        }
        // The chord in the parameters passes the place sooner or later than a straight one.
        let mut off = f64::INFINITY;
        for _ in 0..3 {
            let Some(m) = seen(from.uv + share * (to.uv - from.uv)) else { return false };
            off = off.min(m.distance(c));
            share = (share + (c - m).dot(d) / length).clamp(0.0, 1.0);
        }
        off > tolerance
    }

    /// Parameters of the surface at a place, near those of the place before it.
    fn uv(&mut self, place: (f64, DVec3), before: Place, last: bool) -> Option<DVec2> {
        self.found(place, before, last).map(|uv| self.over_seam(uv, before.uv))
    }

    /// Of the parameters of a place on the seam of a closed surface, at which it ends twice, those that are nearer to `before`.
    fn over_seam(&self, uv: DVec2, before: DVec2) -> DVec2 {
        let (view, surface) = (self.subject.geometry.view, self.beside.surface);
        let far = |uv: DVec2| apart(self.subject, surface, uv, before);
        if far(uv) <= WIDEST {
            return uv;
        }
        let grid = &view.surfaces()[surface];
        let twin = |uv: DVec2, along_u: bool| {
            let breaks = if along_u { &grid.u_breaks } else { &grid.v_breaks };
            let (at, low, high) = (if along_u { uv.x } else { uv.y }, breaks[0], breaks[breaks.len() - 1]);
            let near = ON_SEAM * (high - low);
            let other = if at - low <= near {
                high
            } else if high - at <= near {
                low
            } else {
                at
            };
            if along_u { DVec2::new(other, uv.y) } else { DVec2::new(uv.x, other) }
        };
        let mut best = uv;
        for along_u in [true, false] {
            let other = twin(best, along_u);
            let is_one =
                || view.model_point(surface, other).distance(view.model_point(surface, best)) <= self.options.contact;
            if far(other) < far(best) && is_one() {
                best = other;
            }
        }
        best
    }

    /// As [`uv`](Self::uv), on the seam of a closed surface on either side. Beside a silhouette that runs along a join of surfaces, no
    /// farther from it than what counts as one place, the other surface is met a little aside. Exactly at a fold or a cusp, where edges
    /// end, the sight line may miss the sheet that is followed, and aside of it meet another sheet of the same surface: there the place is moved
    /// towards the one before, the `last` time it is asked for, and aside only if that does not help.
    fn found(&mut self, (t, p): (f64, DVec3), before: Place, last: bool) -> Option<DVec2> {
        let (subject, surface) = (self.subject, self.beside.surface);
        if let Some(sheet) = self.beside.sheet {
            return Some(sheet.uv(subject, self.curve(), t, p, Some(before.uv)));
        }
        let (q, inwards) = (p.truncate(), before.p.truncate());
        let inwards = INWARDS.iter().filter(|_| last).map(|f| q + (inwards - q) * *f);
        let places = &self.edge.places;
        let is_end = [places.first(), places.last()].into_iter().flatten().any(|end| end.0 == t);
        let aside = self.aside((t, q), before, is_end);
        let aside = |allowed: bool| ASIDE.iter().filter(move |_| allowed).map(move |f| q + aside * *f);
        let facing = facing(subject, surface, self.beside.uv);
        let screen = subject.geometry.view.jet(surface, before.uv, [false; 2]).p.truncate();
        let from = BorderPoint { screen, uv: before.uv };
        let tolerance = self.options.tolerance + self.options.contact;
        let goes_on = |screen, uv| goes_straight_on(subject, surface, [from, BorderPoint { screen, uv }], tolerance);
        // Of the sheet that is followed, and, where it is not met, of any.
        let mut best: [Option<(f64, DVec2)>; 2] = [None; 2];
        for q in core::iter::once(q).chain(aside(!is_end)).chain(inwards).chain(aside(is_end && last)) {
            for hit in subject.occluders.hits(q, self.scratch).iter().filter(|h| h.surface == surface) {
                let far = apart(subject, surface, hit.uv, before.uv);
                let other = hit.grazing || self::facing(subject, surface, hit.uv) * facing < 0.0;
                let best = &mut best[usize::from(other)];
                if best.is_none_or(|b| far < b.0) {
                    *best = Some((far, hit.uv));
                }
            }
            if best[0].is_some_and(|b| !last || goes_on(q, b.1)) {
                break;
            }
        }
        let near = best[0].filter(|b| b.0 <= WIDEST).or(best[1].filter(|b| b.0 <= WIDEST)).or(best[0]).or(best[1]);
        let near = near.map(|b| b.1).or_else(|| self.uv_along_others(p, before.uv).filter(|_| last));
        // Where the surface itself ends hardly before the edge does: its end is one place with the edge's.
        let is_one = is_end && last && before.p.truncate().distance(p.truncate()) <= self.options.contact;
        near.or(Some(before.uv).filter(|_| is_one))
    }

    /// The step to the region's side of a place, as long as the contact tolerance.
    fn aside(&self, (t, q): (f64, DVec2), before: Place, is_end: bool) -> DVec2 {
        // At a cusp a silhouette has no direction on the screen but that of its chords.
        let chord = (q - before.p.truncate()) * if t < before.t { -1.0 } else { 1.0 };
        let chord = chord.try_normalize().filter(|_| is_end);
        let along = || self.curve().jet(&self.subject.geometry, t).1.truncate().normalize_or_zero();
        let left = chord.unwrap_or_else(along).perp();
        self.options.contact * if self.right { -left } else { left }
    }

    /// Parameters of the surface at a place by the other curves of the edge, if it has their line: the silhouette of one patch
    /// leaves the join with the next, and that one is met beside it no more, though it is still one place.
    fn uv_along_others(&self, p: DVec3, before: DVec2) -> Option<DVec2> {
        let (subject, surface) = (self.subject, self.beside.surface);
        let g = &subject.geometry;
        let on = |(index, places): &(usize, Vec<(f64, DVec3)>)| {
            let curve = &subject.curves[*index];
            let point = |t: f64| curve.point(g, t).truncate();
            let near = places.windows(2).map(|w| nearest(point, p.truncate(), [w[0].0, w[1].0], 0.0));
            let t = near.min_by(|a, b| a.1.total_cmp(&b.1))?.0;
            let side = curve.sides.iter().find(|&&s| subject.stitching.sides[s].path.surface() == surface);
            let sheet = if curve.surface == surface { Some(Sheet::Path) } else { side.map(|&s| Sheet::Side(s)) };
            sheet.map(|sheet| sheet.uv(subject, curve, t, curve.point(g, t), Some(before)))
        };
        self.edge.others.iter().find_map(on)
    }

    /// Angle between the normals at two places, radians; 0 where one has none.
    fn turn(&self, a: DVec2, b: DVec2) -> f64 {
        let view = self.subject.geometry.view;
        let [m, n] = [a, b].map(|uv| view.model_jet(self.beside.surface, uv, [false; 2]).normal().normalize_or_zero());
        if m == DVec3::ZERO || n == DVec3::ZERO { 0.0 } else { libm::atan2(m.cross(n).length(), m.dot(n)) }
    }

    /// Distance of two places on the surface in view space.
    fn chord(&self, a: Place, b: Place) -> f64 {
        let view = self.subject.geometry.view;
        let [p, q] = [a, b].map(|x| view.jet(self.beside.surface, x.uv, [false; 2]).p);
        p.distance(q)
    }
}

/// 1 where the parameters of a surface turn counter-clockwise on the screen, −1 where they turn clockwise, 0 where they do not turn. The two
/// sheets of a fold differ in it, and all along an edge, which no fold of the sheet behind it ends inside of, it is the same.
fn facing(subject: &Subject<'_>, surface: usize, uv: DVec2) -> f64 {
    let z = subject.geometry.view.jet(surface, uv, [false; 2]).normal().z;
    if z == 0.0 { 0.0 } else { z.signum() }
}

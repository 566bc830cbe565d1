//! Points of a border, on the screen and on the region's surface.
//!
//! Where the surface ends in the edge its parameters come with the curve. Where it goes on behind, they are those of the surface on
//! the sight line (the paper's section *Calculation of the mutual-occlusion region*), followed from the place that was looked at,
//! so that of several sheets of one surface it is always the same.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::planar::Edge;
use super::sides::{Beside, apart};
use super::{BorderOptions, BorderPoint};
use crate::extract::SurfaceCurve;
use crate::visibility::{RayScratch, Subject};

/// Halvings of a chord at the most: near a fold the normal turns with the root of the distance.
const DEEPEST: u32 = 12;

/// Largest step between neighbours, of the parameter range, beyond which it is doubtful that they are on one sheet.
const WIDEST: f64 = 0.05;

/// Parts of the chord by which a point is moved inwards if the surface is not met at its end. The chord is then as short as the
/// contact tolerance, to which the ends of edges are known.
const INWARDS: [f64; 4] = [1e-4, 1e-2, 0.1, 0.5];

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
    pub(super) options: BorderOptions,
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
            || apart(self.subject, self.beside.surface, from.uv, to.uv) > WIDEST;
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

    /// Parameters of the surface at a place, near those of the place before it. Beside a silhouette that runs along a join of surfaces, no
    /// farther from it than what counts as one place, the other surface is met a little aside. Exactly at a fold or a cusp, where edges
    /// end, the sight line may miss the sheet that is followed, and aside of it meet another sheet of the same surface: there the place is moved
    /// towards the one before, the `last` time it is asked for, and aside only if that does not help.
    fn uv(&mut self, (t, p): (f64, DVec3), before: Place, last: bool) -> Option<DVec2> {
        let (subject, surface) = (self.subject, self.beside.surface);
        if let Some(sheet) = self.beside.sheet {
            return Some(sheet.uv(subject, self.curve(), t, p, Some(before.uv)));
        }
        let (q, inwards) = (p.truncate(), before.p.truncate());
        let left = self.curve().jet(&subject.geometry, t).1.truncate().normalize_or_zero().perp();
        let aside = if self.right { -left } else { left } * self.options.contact;
        let aside = |allowed: bool| ASIDE.iter().filter(move |_| allowed).map(move |f| q + aside * *f);
        let inwards = INWARDS.iter().filter(|_| last).map(|f| q + (inwards - q) * *f);
        let places = &self.edge.places;
        let is_end = [places.first(), places.last()].into_iter().flatten().any(|end| end.0 == t);
        let mut best: Option<(f64, DVec2)> = None;
        for q in core::iter::once(q).chain(aside(!is_end)).chain(inwards).chain(aside(is_end && last)) {
            let hits = subject.occluders.hits(q, self.scratch).iter().filter(|h| h.surface == surface);
            let near = hits.map(|h| (apart(subject, surface, h.uv, before.uv), h.uv));
            best = near.chain(best).min_by(|a, b| a.0.total_cmp(&b.0));
            if best.is_some_and(|b| b.0 <= WIDEST || !last) {
                break;
            }
        }
        best.map(|b| b.1)
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

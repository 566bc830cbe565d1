//! An independent judge of visibility.
//!
//! It shares no code with the rays, the splitting or the camera of the core: surfaces are evaluated from their knots and
//! control points by the definition of B-splines, cut into small triangles in view space, and a point is judged by the
//! triangles that cover it on the screen.
//!
//! Of a trimmed surface the triangles are a constrained Delaunay triangulation of the parameters that the trims keep, by
//! the even-odd rule over chords of their curves. Borders that coincide in space share their vertices, so that an edge of
//! the model is one edge of triangles, whatever the parameters on its two sides.
//!
//! # Reach
//!
//! A triangle stands for the surface above its parameters; the distance e between the two is measured. Where the eye
//! meets triangles only farther than a few e from any *transition* (an edge at which the mesh ends or folds on the
//! screen) the surfaces have the same number of sheets as the triangles, since the one moves into the other without an
//! edge passing the point. So the verdict is exact but for features smaller than a cell, and it is withheld:
//!
//! - where a transition in front of the point, or at its depth, passes within the error on the screen
//!   ([`Doubt::Transition`]);
//! - where a sheet that is not the point's own lies at the point's depth, within the error along the sight line, which
//!   is large on steep triangles ([`Doubt::Contact`]); so the very places where surfaces pierce one another are not
//!   judged, only their surroundings;
//! - where the point's own neighbourhood on its surface is more than the sheet, the edge or the fold that it claims to lie
//!   on: near cusps, right behind its own fold, and where a sliver of its own surface may hide it, thinner than the
//!   error ([`Doubt::OwnSheet`]).
//!
//! The own neighbourhood is found by parameters and adjacency: what is joined to the point's cell within a small disc on
//! the screen, however deep it reaches, up to edges at an angle other than the one the point lies on. It never hides the point. On two rings in the disc it must look like a sheet
//! (covered once everywhere), the edge of one (once or not), or, if the point lies on a silhouette or a sharp edge, a
//! fold (twice or not).

mod grid;
mod mesh;
mod nearest;
mod outline;
mod sight;
mod spline;
mod trimmed;

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::scene::Scene;

use grid::Grid;
use mesh::{Mesh, Transition};
pub use nearest::Nearest;
pub use sight::Sight;
pub use trimmed::Model;

/// Cells must come this near to the surface, as a part of the scene's size, or be as many as [`MOST_TRIANGLES`].
const CHORD: f64 = 1e-4;

/// Most triangles of a scene; some 400 bytes each.
const MOST_TRIANGLES: usize = 400_000;

/// Errors are measured at the middles of sides only, and slopes are those of flat triangles.
const SAFETY: f64 = 2.0;

/// Least distance on the screen and in depth that is judged, of the scene's size: covers rounding and joints of surfaces.
const LEAST: f64 = 1e-6;

/// Radius of the disc in which a point's own neighbourhood is sought, in radii of the inner ring on which it is looked at.
const DISC: f64 = 2.5;

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Position in model space.
    pub point: DVec3,
    /// Index of its surface.
    pub surface: usize,
    /// Parameters on the surface.
    pub uv: DVec2,
    /// What it is there.
    pub site: Site,
}

/// Where on a surface a point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// Inside a sheet, or on a free edge.
    Sheet,
    /// On an edge at which surfaces meet at an angle.
    Crease,
    /// Where the surface turns away from the eye.
    Silhouette,
}

/// What the oracle sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is in front.
    Visible,
    /// This many sheets are in front, at least one.
    Hidden(u32),
    /// Too near to call.
    Ambiguous(Doubt),
}

/// Why a verdict is withheld.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// A fold or an end of a sheet in front passes too near.
    Transition,
    /// A sheet passes at the point's own depth.
    Contact,
    /// The point's own neighbourhood may hide it.
    OwnSheet,
}

/// A scene, tessellated and seen from one eye.
pub struct Oracle {
    sight: Sight,
    surfaces: Vec<Surface>,
    mesh: Mesh,
    triangles: Grid,
    transitions: Grid,
}

impl Oracle {
    /// Tessellates until no triangle is farther than 10⁻⁴ of the scene's size from its surface, or there are 400 000
    /// triangles. The same division is used for all surfaces, so that what meets along equal parameters is joined. Where
    /// any is trimmed, each is divided for itself, and joined to others along borders; see [`Model`].
    #[must_use]
    pub fn new(scene: &Scene, sight: impl Into<Sight>) -> Self {
        let sight = sight.into();
        if scene.surfaces.iter().any(|s| s.trims.is_some()) {
            return Self::seen(scene, &Model::new(scene), sight);
        }
        let mut parts = 12;
        let mesh = loop {
            let mesh = Mesh::new(scene, &sight, parts);
            let error = mesh.triangles.iter().map(|t| t.error).fold(0.0, f64::max);
            let next = parts * 3 / 2;
            let grown = mesh.triangles.len() * next * next / (parts * parts);
            if error <= CHORD * mesh.size || grown > MOST_TRIANGLES {
                break mesh;
            }
            parts = next;
        };
        Self::of(scene, mesh, sight)
    }

    /// A scene that is tessellated already; for several views of one with trimmed surfaces.
    #[must_use]
    pub fn seen(scene: &Scene, model: &Model, sight: impl Into<Sight>) -> Self {
        let sight = sight.into();
        Self::of(scene, Mesh::seen(model, &sight), sight)
    }

    fn of(scene: &Scene, mesh: Mesh, sight: Sight) -> Self {
        let least = LEAST * mesh.size;
        let triangles = Grid::new(mesh.triangles.len(), |k| {
            let [a, b, c] = mesh.corners(k as u32).map(DVec3::truncate);
            let margin = DVec2::splat(SAFETY * mesh.triangles[k].error + least);
            [a.min(b).min(c) - margin, a.max(b).max(c) + margin]
        });
        let transitions = Grid::new(mesh.transitions.len(), |k| {
            let t = &mesh.transitions[k];
            let [a, b] = t.ends.map(DVec3::truncate);
            let margin = DVec2::splat(SAFETY * t.error + least);
            [a.min(b) - margin, a.max(b) + margin]
        });
        let surfaces = scene.surfaces.iter().map(|s| s.surface.clone()).collect();
        Self { sight, surfaces, mesh, triangles, transitions }
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Greatest measured distance of a triangle from its surface, of the scene's size.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        self.mesh.triangles.iter().map(|t| t.error).fold(0.0, f64::max) / self.mesh.size
    }

    /// Whether the point is seen, or how many sheets are in front of it. Microseconds.
    ///
    /// # Panics
    /// If the scene has no such surface.
    #[must_use]
    pub fn judge(&self, place: &Place) -> Verdict {
        let p = self.sight.project(place.point);
        let home = self.mesh.at(place.surface, place.uv.x, place.uv.y);
        let own = match self.neighbourhood(&home, p, place.site) {
            Some((own, ring))
                if self.is_simple(&own, p.truncate(), ring, place.site)
                    && (place.site != Site::Silhouette || self.is_plain_fold(place, p, ring)) =>
            {
                own
            }
            _ => return Verdict::Ambiguous(Doubt::OwnSheet),
        };
        if self.is_near_transition(p, &own) {
            return Verdict::Ambiguous(Doubt::Transition);
        }
        self.count(p, &own)
    }

    /// Whether a triangle covers a point of the screen.
    #[must_use]
    pub fn covers(&self, q: DVec2) -> bool {
        self.triangles.at(q).iter().any(|&t| self.mesh.covers(t, q))
    }

    /// Places on the screen within a stated distance of which there must be a visible outline, the end of a sheet or a
    /// fold: edges of triangles that nothing hides and round which the surface is seen on one side only, on both rings.
    /// Since the rings are farther from the edge than the triangles from the surface, the surface ends or folds in
    /// between.
    #[must_use]
    pub fn visible_outline(&self) -> Vec<(DVec2, f64)> {
        let seen = |t: &Transition| {
            let p = 0.5 * (t.ends[0] + t.ends[1]);
            let q = p.truncate();
            let (own, radius) = self.neighbourhood(&t.triangles, p, Site::Crease)?;
            let one_sided = [radius, 2.0 * radius].iter().all(|&r| {
                let seen = self.ring(&own, q, r);
                seen == Some([true, true, false]) || seen == Some([true, false, true])
            });
            // Where the surface folds, the edge of the mesh zigzags in depth by as much as its triangles span: only what is
            // visible there at either depth is surely visible.
            let depths = t.triangles.iter().flat_map(|&k| self.mesh.corners(k)).map(|c| c.z);
            let deepest = DVec3::new(p.x, p.y, depths.fold(p.z, f64::min));
            let visible = |p: DVec3| self.count(p, &own) == Verdict::Visible;
            let hidden = self.is_near_transition(p, &own) || !visible(p) || !visible(deepest);
            (one_sided && !hidden).then_some((q, radius))
        };
        self.mesh.transitions.iter().filter_map(seen).collect()
    }

    /// What is joined to the triangles `home` within a disc round `p`, and the radius of a ring in the disc that is
    /// farther from `p` than the triangles are from the surface. It ends at edges at an angle, but for the one that `p`
    /// lies on.
    fn neighbourhood(&self, home: &[u32], p: DVec3, site: Site) -> Option<(Vec<u32>, f64)> {
        let error = |own: &[u32]| own.iter().map(|&t| self.mesh.triangles[t as usize].error).fold(0.0, f64::max);
        let ring = |own: &[u32]| SAFETY * error(own) + LEAST * self.mesh.size;
        let off = |[a, b]: [DVec3; 2]| {
            let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (a + (b - a) * along).distance(p)
        };
        // Close to a corner other edges are near too, but not as near.
        let nearest = match site {
            Site::Crease => self.mesh.sharp_edges(home).map(off).fold(f64::INFINITY, f64::min) + LEAST * self.mesh.size,
            Site::Sheet | Site::Silhouette => f64::NEG_INFINITY,
        };
        let near = |radius: f64| self.mesh.around(home, p, DISC * radius, |edge| off(edge) <= nearest.min(radius));
        let radius = ring(&near(ring(home))?);
        Some((near(radius)?, radius))
    }

    /// Whether the own neighbourhood covers some places of a ring round `q` not, once, twice; none if more often.
    fn ring(&self, own: &[u32], q: DVec2, radius: f64) -> Option<[bool; 3]> {
        const RING: u32 = 24;
        let mut seen = [false; 3];
        for k in 0..RING {
            // Off the directions in which edges of the mesh like to run.
            let at = q + radius * DVec2::from_angle(0.123 + TAU * f64::from(k) / f64::from(RING));
            *seen.get_mut(self.covering(own, at))? = true;
        }
        Some(seen)
    }

    /// How many of the triangles cover a point.
    fn covering(&self, own: &[u32], q: DVec2) -> usize {
        own.iter().filter(|&&t| self.mesh.covers(t, q)).count()
    }

    /// Whether the own neighbourhood looks, on the ring and on one of twice the radius, as it should.
    fn is_simple(&self, own: &[u32], q: DVec2, radius: f64, site: Site) -> bool {
        let middle = self.covering(own, q);
        // A sliver of surface that turns away unseen by the triangles could hide the point.
        let sure = || own.iter().all(|&t| self.mesh.faces_surely(t));
        [radius, 2.0 * radius].iter().all(|&radius| {
            let seen = self.ring(own, q, radius);
            let sheet = seen == Some([false, true, false]) && middle == 1;
            let edge = seen == Some([true, true, false]) && middle <= 1;
            let fold = seen == Some([true, false, true]);
            match site {
                Site::Sheet => (sheet || edge) && sure(),
                Site::Crease => (sheet || fold) && sure(),
                Site::Silhouette => fold && self.runs_across(own, q),
            }
        })
    }

    /// Whether the neighbourhood's own folds run across the sight line rather than along it: where they turn along it is
    /// a cusp, and sheets cross over in less than the error.
    fn runs_across(&self, own: &[u32], q: DVec2) -> bool {
        const STEEPEST: f64 = 10.0;
        let all = self.transitions.at(q).iter().map(|&k| &self.mesh.transitions[k as usize]);
        all.filter(|t| t.triangles.iter().all(|k| own.contains(k))).all(|t| {
            let d = t.ends[1] - t.ends[0];
            d.z.abs() <= STEEPEST * d.truncate().length()
        })
    }

    /// Whether the surface turns back at the point of a silhouette, and keeps to one side of it until it is out of the rings:
    /// near a cusp it turns once more, and a sheet thinner than the rings may hide the point. Asked of the surface itself,
    /// along the sight line's direction in its parameters.
    fn is_plain_fold(&self, place: &Place, p: DVec3, radius: f64) -> bool {
        const STEP: f64 = 1e-6;
        let surface = &self.surfaces[place.surface];
        let ([u0, u1], [v0, v1]) = (surface.domain_u(), surface.domain_v());
        let (lo, hi) = (DVec2::new(u0, v0), DVec2::new(u1, v1));
        let at = |uv: DVec2| self.sight.project(spline::point(surface, uv)).truncate();
        let slope = |d: DVec2| {
            let (a, b) = ((place.uv - d).max(lo), (place.uv + d).min(hi));
            (at(b) - at(a)) / (b - a).max_element()
        };
        let (du, dv) = (slope(STEP * DVec2::X * (hi - lo)), slope(STEP * DVec2::Y * (hi - lo)));
        // On a fold both run along it on the screen.
        let scale = hi - lo;
        let along = if du.length() * scale.x > dv.length() * scale.y { du } else { dv }.normalize_or_zero();
        let way = DVec2::new(-dv.dot(along), du.dot(along));
        let way = way / (way / scale).abs().max_element();
        if !way.is_finite() {
            return false;
        }
        let rounding = 1e-3 * LEAST * self.mesh.size;
        let mut side = 0.0;
        for back in [-1.0, 1.0] {
            for k in (0..=16).rev() {
                let uv = place.uv + back * way * f64::from(-k).exp2();
                if uv.cmplt(lo).any() || uv.cmpgt(hi).any() {
                    break;
                }
                let off = (at(uv) - p.truncate()).perp_dot(along);
                if off.abs() <= rounding {
                    continue;
                }
                if side == 0.0 {
                    side = off.signum();
                } else if side != off.signum() {
                    return false;
                }
                if off.abs() > 3.0 * radius {
                    break;
                }
            }
        }
        true
    }

    /// Whether an edge that ends or folds a sheet, not behind the point and not its own, passes within the error.
    fn is_near_transition(&self, p: DVec3, own: &[u32]) -> bool {
        let least = LEAST * self.mesh.size;
        self.transitions.at(p.truncate()).iter().any(|&k| {
            let t = &self.mesh.transitions[k as usize];
            let [a, b] = t.ends;
            let distance = p.truncate().distance(mesh::nearest(a.truncate(), b.truncate(), p.truncate()).0);
            // Folded triangles are steep: their whole length may lie along the sight line.
            distance <= SAFETY * t.error + least
                && a.z.max(b.z) > p.z - t.side - least
                && !t.triangles.iter().all(|k| own.contains(k))
        })
    }

    /// Counts what covers the point and is nearer, but for its own neighbourhood.
    fn count(&self, p: DVec3, own: &[u32]) -> Verdict {
        let (q, least) = (p.truncate(), LEAST * self.mesh.size);
        let mut sheets = 0;
        for &t in self.triangles.at(q) {
            let reach = SAFETY * self.mesh.triangles[t as usize].error + least;
            if self.mesh.distance(t, q) > reach || own.contains(&t) {
                continue;
            }
            let [a, b, c] = self.mesh.corners(t);
            let normal = (b - a).cross(c - a);
            let height = a.z - (q - a.truncate()).dot(normal.truncate()) / normal.z;
            let slope = normal.truncate().length() / normal.z.abs();
            let low = a.z.min(b.z).min(c.z);
            let high = a.z.max(b.z).max(c.z);
            if high + reach >= p.z && !self.mesh.faces_surely(t) {
                return Verdict::Ambiguous(Doubt::Transition);
            }
            if !self.mesh.covers(t, q) {
                continue;
            }
            // On a sheet as steep as that the error along the sight line is not more than the triangle.
            let margin = reach * (1.0 + slope);
            if (height - margin).max(low - reach) > p.z {
                sheets += 1;
            } else if (height + margin).min(high + reach) >= p.z {
                return Verdict::Ambiguous(Doubt::Contact);
            }
        }
        if sheets == 0 { Verdict::Visible } else { Verdict::Hidden(sheets) }
    }
}

#[cfg(test)]
mod tests;

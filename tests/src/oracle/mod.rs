//! An independent judge of visibility.
//!
//! It shares no code with the rays, the splitting or the camera of the core: surfaces are evaluated from their knots and
//! control points by the definition of B-splines, cut into small triangles in view space, and a point is judged by the
//! triangles that cover it on the screen.
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
//! - where the point's own neighbourhood on its surface is more than a sheet or the fold that it claims to lie on: near
//!   cusps, and right behind its own fold ([`Doubt::OwnSheet`]).
//!
//! The own neighbourhood is found by parameters and adjacency: what is joined to the point's cell within three of its
//! sides in space. It never hides the point. On a ring round the point it must look like a sheet (covered once
//! everywhere), the edge of one (once or not), or, if the point lies on a silhouette or a sharp edge, a fold (twice or
//! not).

mod grid;
mod mesh;
mod sight;
mod spline;

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use penvis_core::scene::Scene;

use grid::Grid;
use mesh::Mesh;
pub use sight::Sight;

/// Cells must come this near to the surface, as a part of the scene's size, or be as many as [`MOST_TRIANGLES`].
const CHORD: f64 = 1e-4;

/// Most triangles of a scene; some 400 bytes each.
const MOST_TRIANGLES: usize = 400_000;

/// Errors are measured at the middles of sides only, and slopes are those of flat triangles.
const SAFETY: f64 = 3.0;

/// Least distance on the screen and in depth that is judged, of the scene's size: covers rounding and joints of surfaces.
const LEAST: f64 = 1e-6;

/// Radius of a point's own neighbourhood, in longest sides of its triangles.
const OWN_SIDES: f64 = 3.0;

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Position in model space.
    pub point: DVec3,
    /// Index of its surface.
    pub surface: usize,
    /// Parameters on the surface.
    pub uv: DVec2,
    /// Whether the point lies on a silhouette or on a sharp edge, where a surface may fold on the screen.
    pub fold: bool,
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
    mesh: Mesh,
    triangles: Grid,
    transitions: Grid,
}

impl Oracle {
    /// Tessellates until no triangle is farther than 10⁻⁴ of the scene's size from its surface, or there are 400 000
    /// triangles. The same division is used for all surfaces, so that what meets along equal parameters is joined.
    #[must_use]
    pub fn new(scene: &Scene, sight: impl Into<Sight>) -> Self {
        let sight = sight.into();
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
        let least = LEAST * mesh.size;
        let triangles = Grid::new(mesh.triangles.len(), |k| {
            let [a, b, c] = mesh.corners(k as u32).map(DVec3::truncate);
            [a.min(b).min(c), a.max(b).max(c)]
        });
        let transitions = Grid::new(mesh.transitions.len(), |k| {
            let t = &mesh.transitions[k];
            let [a, b] = t.ends.map(DVec3::truncate);
            let margin = DVec2::splat(SAFETY * t.error + least);
            [a.min(b) - margin, a.max(b) + margin]
        });
        Self { sight, mesh, triangles, transitions }
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Greatest distance of a triangle from its surface, as measured and doubled, of the scene's size.
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
        let side = home.iter().map(|&t| self.mesh.triangles[t as usize].side).fold(0.0, f64::max);
        let own = self.mesh.around(&home, p, OWN_SIDES * side);
        if !self.is_simple(&own, p.truncate(), place.fold) {
            return Verdict::Ambiguous(Doubt::OwnSheet);
        }
        if self.is_near_transition(p, &own) {
            return Verdict::Ambiguous(Doubt::Transition);
        }
        self.count(p, &own)
    }

    /// Whether the own neighbourhood looks, on a ring outside the error, like one sheet, its edge, or a fold.
    fn is_simple(&self, own: &[u32], q: DVec2, fold: bool) -> bool {
        const RING: u32 = 24;
        let error = own.iter().map(|&t| self.mesh.triangles[t as usize].error).fold(0.0, f64::max);
        let radius = SAFETY * error + LEAST * self.mesh.size;
        let (mut fewest, mut most, mut ones) = (usize::MAX, 0, false);
        for k in 0..RING {
            // Off the directions in which edges of the mesh like to run.
            let at = q + radius * DVec2::from_angle(0.123 + TAU * f64::from(k) / f64::from(RING));
            let n = own.iter().filter(|&&t| self.mesh.covers(t, at)).count();
            (fewest, most, ones) = (fewest.min(n), most.max(n), ones || n == 1);
        }
        match (fewest, most) {
            (0 | 1, 1) => true,
            // Between the surface and the outline of its triangles there is no third possibility; a one on the ring
            // means that a boundary or a cusp is near too.
            (0, 2) => fold && !ones,
            _ => false,
        }
    }

    /// Whether an edge that ends or folds a sheet, not behind the point and not its own, passes within the error.
    fn is_near_transition(&self, p: DVec3, own: &[u32]) -> bool {
        let least = LEAST * self.mesh.size;
        self.transitions.at(p.truncate()).iter().any(|&k| {
            let t = &self.mesh.transitions[k as usize];
            let [a, b] = t.ends;
            let chord = (b - a).truncate();
            let along = ((p - a).truncate().dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
            let nearest = if along.is_finite() { a + (b - a) * along } else { if a.z > b.z { a } else { b } };
            let distance = (p - nearest).truncate().length();
            // Folded triangles are steep: their whole length may lie along the sight line.
            distance <= SAFETY * t.error + least
                && a.z.max(b.z) > p.z - t.side - least
                && !t.triangles.iter().any(|k| own.contains(k))
        })
    }

    /// Counts what covers the point and is nearer, but for its own neighbourhood.
    fn count(&self, p: DVec3, own: &[u32]) -> Verdict {
        let (q, least) = (p.truncate(), LEAST * self.mesh.size);
        let mut sheets = 0;
        for &t in self.triangles.at(q) {
            if !self.mesh.covers(t, q) || own.contains(&t) {
                continue;
            }
            let [a, b, c] = self.mesh.corners(t);
            let normal = (b - a).cross(c - a);
            let height = a.z - (q - a.truncate()).dot(normal.truncate()) / normal.z;
            let slope = normal.truncate().length() / normal.z.abs();
            let error = self.mesh.triangles[t as usize].error;
            // On a sheet as steep as that the error along the sight line is not more than the triangle.
            let low = a.z.min(b.z).min(c.z);
            let high = a.z.max(b.z).max(c.z);
            let margin = SAFETY * error * (1.0 + slope) + least;
            let reach = SAFETY * error + least;
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

//! Polygons: what lies in a plane, what is convex, and what has to be parted.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::{has_area, vector_area};

/// Most corners of a polygon that is parted into triangles, whose number of steps is the square.
const MOST_PARTED: usize = 4096;

/// What becomes of a polygon.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// Triangle, or a flat convex quadrilateral: a patch of its own.
    Patch,
    /// Flat, and else of any shape: a part of a plane.
    Flat,
    /// Not flat, by at most the distance: triangles, by positions in the list of corners.
    Parted(Vec<[usize; 3]>, f64),
    /// Crosses itself, or winds so that no triangle can be cut off.
    Crossed,
}

/// The plane of a polygon, with the fingers of the right hand curled along its corners.
pub(super) struct Plane {
    /// A point of it.
    pub(super) origin: DVec3,
    /// Unit vectors in it, and its normal.
    pub(super) x: DVec3,
    pub(super) y: DVec3,
    pub(super) normal: DVec3,
}

impl Plane {
    /// The plane through the middle of the corners, normal to the polygon's vector area (Newell); none without area.
    pub(super) fn of(points: &[DVec3]) -> Option<Self> {
        let normal = vector_area(points.iter().copied()).try_normalize()?;
        // Relative to a corner, so that a polygon far from the origin keeps its digits.
        let first = *points.first()?;
        let origin = first + points.iter().map(|&p| p - first).sum::<DVec3>() / points.len() as f64;
        let (x, y) = normal.any_orthonormal_pair();
        Some(Self { origin, x, y, normal })
    }

    /// Coordinates of the foot of a point.
    pub(super) fn flat(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(d.dot(self.x), d.dot(self.y))
    }
}

/// Says what is to become of a polygon with an area, whose corners `corners` are at `points`. Cost: as the square of the
/// corners at worst.
pub(super) fn shape(corners: &[u32], points: &[DVec3], tolerance: f64) -> Shape {
    if points.len() == 3 {
        return Shape::Patch;
    }
    let Some(plane) = Plane::of(points) else { return Shape::Crossed };
    let flat: Vec<DVec2> = points.iter().map(|&p| plane.flat(p)).collect();
    if crosses(corners, &flat) {
        return Shape::Crossed;
    }
    let off = points.iter().map(|&p| (p - plane.origin).dot(plane.normal).abs()).fold(0.0, f64::max);
    if off <= tolerance {
        let convex = points.len() == 4
            && (0..4).all(|k| {
                let (a, b, c) = (points[(k + 3) % 4], points[k], points[(k + 1) % 4]);
                (b - a).cross(c - b).dot(plane.normal) > 0.0 && has_area([a, b, c].into_iter(), tolerance)
            });
        return if convex { Shape::Patch } else { Shape::Flat };
    }
    parted(corners, &flat).map_or(Shape::Crossed, |triangles| Shape::Parted(triangles, off))
}

/// Twice the signed area of a triangle, positive if it goes round counterclockwise.
fn area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether two sides of a closed polygon cross inside both. By a sweep along x.
fn crosses(corners: &[u32], flat: &[DVec2]) -> bool {
    let n = flat.len();
    let ends = |k: usize| [flat[k], flat[(k + 1) % n]];
    let mut order: Vec<usize> = (0..n).collect();
    let low = |k: usize| ends(k)[0].x.min(ends(k)[1].x);
    order.sort_by(|&i, &j| low(i).total_cmp(&low(j)));
    for (place, &i) in order.iter().enumerate() {
        let [a, b] = ends(i);
        let high = a.x.max(b.x);
        for &j in order[place + 1..].iter().take_while(|&&j| low(j) <= high) {
            let shares = |k: usize| [corners[j], corners[(j + 1) % n]].contains(&corners[k]);
            let [c, d] = ends(j);
            if shares(i) || shares((i + 1) % n) || a.y.max(b.y) < c.y.min(d.y) || c.y.max(d.y) < a.y.min(b.y) {
                continue;
            }
            let opposite = |x: f64, y: f64| x < 0.0 && y > 0.0 || x > 0.0 && y < 0.0;
            if opposite(area(a, b, c), area(a, b, d)) && opposite(area(c, d, a), area(c, d, b)) {
                return true;
            }
        }
    }
    false
}

/// Triangles of a polygon that goes round counterclockwise in the plane, by cutting off ears; none if there is none to cut
/// off. A quadrilateral is parted along its shorter diagonal if both lie inside.
fn parted(corners: &[u32], flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let n = flat.len();
    if n > MOST_PARTED {
        return None;
    }
    let mut left: Vec<usize> = (0..n).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    let is_ear = |left: &[usize], k: usize| {
        let m = left.len();
        let [a, b, c] = [left[(k + m - 1) % m], left[k], left[(k + 1) % m]];
        let [p, q, r] = [flat[a], flat[b], flat[c]];
        let inside = |x: DVec2| area(p, q, x) >= 0.0 && area(q, r, x) >= 0.0 && area(r, p, x) >= 0.0;
        let same = |o: usize| [a, b, c].iter().any(|&own| corners[own] == corners[o]);
        area(p, q, r) > 0.0 && !left.iter().any(|&o| !same(o) && inside(flat[o]))
    };
    let mut k = 0;
    if n == 4 && (0..4).all(|k| is_ear(&left, k)) && flat[1].distance(flat[3]) > flat[0].distance(flat[2]) {
        k = 1;
    }
    let mut tried = 0;
    while left.len() > 3 {
        let m = left.len();
        k %= m;
        if is_ear(&left, k) {
            triangles.push([left[(k + m - 1) % m], left[k], left[(k + 1) % m]]);
            left.remove(k);
            tried = 0;
        } else {
            k += 1;
            tried += 1;
            if tried > m {
                return None;
            }
        }
    }
    triangles.push([left[0], left[1], left[2]]);
    Some(triangles)
}

/// The loops that bound a polygon: a side that it goes along in both directions bounds nothing, and is there to join a hole
/// to the outside. Each loop is a list of positions in the list of corners.
pub(super) fn loops(corners: &[u32]) -> Vec<Vec<usize>> {
    let n = corners.len();
    let mut sorted = corners.to_vec();
    sorted.sort_unstable();
    if sorted.windows(2).all(|w| w[0] != w[1]) {
        return vec![(0..n).collect()];
    }
    // Both directions of a side together, one before the other.
    let side = |k: usize| (corners[k], corners[(k + 1) % n]);
    let key = |k: usize| {
        let (a, b) = side(k);
        (a.min(b), a.max(b), a < b)
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&k| (key(k), k));
    let mut from: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for both in order.chunk_by(|&i, &j| key(i).0 == key(j).0 && key(i).1 == key(j).1) {
        let split = both.partition_point(|&k| !key(k).2);
        let (back, forth) = both.split_at(split);
        let paired = back.len().min(forth.len());
        for &k in back[paired..].iter().chain(&forth[paired..]) {
            from.entry(side(k).0).or_default().push(k);
        }
    }
    let mut out = Vec::new();
    while let Some((&start, _)) = from.first_key_value() {
        let (mut ring, mut at) = (Vec::new(), start);
        // Sides begin where others end, so that there is one to go on with until the loop is closed.
        while let Some(sides) = from.get_mut(&at) {
            let Some(k) = sides.pop() else { break };
            if sides.is_empty() {
                from.remove(&at);
            }
            ring.push(k);
            at = side(k).1;
            if at == start {
                break;
            }
        }
        if ring.len() > 2 {
            out.push(ring);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points(flat: &[[f64; 2]]) -> Vec<DVec3> {
        flat.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
    }

    fn shape_of(points: &[DVec3]) -> Shape {
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        shape(&corners, points, 1e-9)
    }

    #[test]
    fn shapes() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(shape_of(&points(&square)), Shape::Patch);
        let dart = [[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]];
        assert_eq!(shape_of(&points(&dart)), Shape::Flat);
        let straight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]];
        assert_eq!(shape_of(&points(&straight)), Shape::Flat);
        let bow = [[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.5]];
        assert_eq!(shape_of(&points(&bow)), Shape::Crossed);
        let mut bent = points(&square);
        bent[2].z = 0.5;
        let Shape::Parted(triangles, off) = shape_of(&bent) else { panic!() };
        assert_eq!((triangles.len(), triangles.concat().len()), (2, 6));
        assert!(off > 0.1 && off < 0.2, "{off}");
        // Along the shorter diagonal.
        let mut long = points(&[[0.0, 0.0], [3.0, -1.0], [6.0, 0.0], [3.0, 1.0]]);
        long[0].z = 0.1;
        let Shape::Parted(triangles, _) = shape_of(&long) else { panic!() };
        assert!(triangles.iter().all(|t| t.contains(&1) && t.contains(&3)), "{triangles:?}");
        // Round the other way in the plane, but not seen from the front.
        long.reverse();
        assert!(matches!(shape_of(&long), Shape::Parted(..)));
    }

    #[test]
    fn a_hole_is_a_loop_of_its_own() {
        // A square from 0 to 3, by a bridge from 0 to 4 joined to the hole 4 5 6 7.
        assert_eq!(loops(&[0, 1, 2, 3]), [[0, 1, 2, 3]]);
        let mut found: Vec<Vec<u32>> = loops(&[0, 1, 2, 3, 0, 4, 5, 6, 7, 4])
            .into_iter()
            .map(|ring| {
                let mut ring: Vec<u32> = ring.into_iter().map(|k| [0, 1, 2, 3, 0, 4, 5, 6, 7, 4][k]).collect();
                ring.sort_unstable();
                ring
            })
            .collect();
        found.sort();
        assert_eq!(found, [[0, 1, 2, 3], [4, 5, 6, 7]]);
        // A spike bounds nothing.
        assert_eq!(loops(&[0, 1, 2, 3, 2]).len(), 1);
        assert_eq!(loops(&[0, 1, 2, 3, 2])[0].len(), 3);
    }

    proptest! {
        /// Star-shaped polygons of any radii, lifted out of their plane: as many triangles as there should be, all turned as
        /// the polygon is, of the same area together.
        #[test]
        fn triangles_cover_a_polygon(radii in prop::collection::vec(0.2_f64..1.0, 4..40), lift in 0.001_f64..0.1) {
            let n = radii.len();
            let at = |(k, r): (usize, &f64)| {
                let angle = std::f64::consts::TAU * k as f64 / n as f64;
                DVec3::new(r * angle.cos(), r * angle.sin(), if k % 2 == 0 { lift } else { 0.0 })
            };
            let corners: Vec<DVec3> = radii.iter().enumerate().map(at).collect();
            let Shape::Parted(triangles, _) = shape_of(&corners) else {
                return Err(TestCaseError::fail("not parted"));
            };
            prop_assert_eq!(triangles.len(), n - 2);
            let plane = Plane::of(&corners).unwrap();
            let flat: Vec<DVec2> = corners.iter().map(|&p| plane.flat(p)).collect();
            let areas: Vec<f64> = triangles.iter().map(|t| area(flat[t[0]], flat[t[1]], flat[t[2]])).collect();
            prop_assert!(areas.iter().all(|&a| a > 0.0));
            let whole: f64 = (0..n).map(|k| flat[k].perp_dot(flat[(k + 1) % n])).sum();
            prop_assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9);
        }
    }
}

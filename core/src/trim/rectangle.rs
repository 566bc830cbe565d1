//! Trims that keep a rectangle of parameters.

use glam::DVec2;

use super::trims::SAME;
use super::{TrimLoop, TrimPiece, Trims};
use crate::nurbs::{NurbsError, Surface};

/// Parameters this near to a side of the box of the loops, of the range, are on it: what rounding in a file of fifteen
/// digits, and in the feet of its points, leaves of an isoparametric curve.
const ON_SIDE: f64 = 1e-9;

impl Trims {
    /// `surface` cut to the box of the loops, with the loops as its border, if what is kept of it is that box: it is then a
    /// whole surface, of which much more can be proven. None if what is kept has another shape, or is all there is.
    ///
    /// Faces of boundary representations are bounded by isoparametric curves more often than not. Pieces are moved by no more
    /// than 10⁻⁹ of the range, and keep their shared edges.
    #[must_use]
    pub fn rectangle(&self, surface: &Surface) -> Option<(Surface, Self)> {
        let (lo, hi) = self.bounds();
        let [loop_] = self.loops.as_slice() else { return None };
        if (lo, hi) == (self.lo, self.hi) || lo.cmpge(hi).any() {
            return None;
        }
        let near = (ON_SIDE * (self.hi - self.lo)).max(SAME * (hi - lo));
        let side = |p: &TrimPiece| {
            let (low, high) = p.bounds();
            (0..2).find(|&d| {
                [lo, hi].iter().any(|x| (low[d] - x[d]).abs() <= near[d] && (high[d] - x[d]).abs() <= near[d])
            })
        };
        // Four sides round a box, each passed once: their lengths are those of the box.
        let mut run = DVec2::ZERO;
        for p in &loop_.pieces {
            let d = side(p)?;
            run[1 - d] += (p.to()[1 - d] - p.from()[1 - d]).abs();
        }
        let round = 2.0 * (hi - lo);
        if ((run - round).abs().cmpgt(8.0 * near)).any() || !self.contains(0.5 * (lo + hi)) {
            return None;
        }
        let cut = cut(surface, lo, hi).ok()?;
        let snapped = |mut x: DVec2| {
            for d in 0..2 {
                for line in [lo[d], hi[d]] {
                    if (x[d] - line).abs() <= near[d] {
                        x[d] = line;
                    }
                }
            }
            x
        };
        let straight = |p: &TrimPiece| TrimPiece::straight(snapped(p.from()), snapped(p.to())).with_edge(p.edge());
        let pieces = loop_.pieces.iter().map(straight).filter(|p| p.from() != p.to()).collect();
        let mut trims = Self { loops: alloc::vec![TrimLoop { pieces }], lo, hi };
        trims.find_kept_sides();
        trims.is_whole().then_some((cut, trims))
    }
}

/// The part of a surface between two corners of its parameter range.
fn cut(surface: &Surface, lo: DVec2, hi: DVec2) -> Result<Surface, NurbsError> {
    let mut part = surface.clone();
    if lo.x > part.domain_u()[0] {
        part = part.split_u(lo.x)?.1;
    }
    if hi.x < part.domain_u()[1] {
        part = part.split_u(hi.x)?.0;
    }
    if lo.y > part.domain_v()[0] {
        part = part.split_v(lo.y)?.1;
    }
    if hi.y < part.domain_v()[1] {
        part = part.split_v(hi.y)?.0;
    }
    Ok(part)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use glam::DVec3;

    use super::*;
    use crate::shape::{Frame, cylinder, polyline};
    use crate::trim::TrimCurve;

    fn trims(surface: &Surface, corners: &[[f64; 2]]) -> Trims {
        let points: Vec<DVec3> = corners.iter().chain(&corners[..1]).map(|&[u, v]| DVec3::new(u, v, 0.0)).collect();
        let sides = points.windows(2).zip(0..);
        let curves = sides.map(|(w, edge)| TrimCurve { curve: polyline(w).unwrap(), edge: Some(edge) }).collect();
        Trims::oriented(surface, [true, false], &[curves]).unwrap()
    }

    #[test]
    fn a_rectangle_becomes_a_whole_surface_with_its_edges() {
        let whole = cylinder(&Frame::WORLD, 2.0, 3.0).unwrap();
        let t = trims(&whole, &[[0.125, 0.25], [0.625 + 1e-11, 0.25], [0.625, 0.5], [0.125, 1.0], [0.125, 0.5]]);
        assert!(t.rectangle(&whole).is_none(), "a slanted side");
        let t = trims(&whole, &[[0.125, 0.25], [0.625 + 1e-11, 0.25], [0.625, 1.0], [0.125, 1.0], [0.125, 0.5]]);
        let (part, border) = t.rectangle(&whole).unwrap();
        assert!(border.is_whole());
        assert_eq!(part.domain_u(), [0.125, 0.625 + 1e-11]);
        assert_eq!(part.domain_v(), [0.25, 1.0]);
        for [u, v] in [[0.125, 0.25], [0.3, 0.7], [0.625, 1.0]] {
            assert!(part.eval(u, v).distance(whole.eval(u, v)) < 1e-14);
        }
        let edges: Vec<usize> = border.border_edges().iter().map(Vec::len).collect();
        assert_eq!(edges, [2, 1, 1, 1]);
    }

    #[test]
    fn what_is_no_rectangle_stays_as_it_is() {
        let whole = cylinder(&Frame::WORLD, 2.0, 3.0).unwrap();
        let hole = [[0.1, 0.2], [0.1, 0.5], [0.4, 0.5], [0.4, 0.2]];
        assert!(trims(&whole, &hole).rectangle(&whole).is_none(), "a hole");
        let step = [[0.1, 0.2], [0.4, 0.2], [0.4, 0.5], [0.2, 0.5], [0.2, 0.3], [0.1, 0.3]];
        assert!(trims(&whole, &step).rectangle(&whole).is_none(), "an L");
        assert!(trims(&whole, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]).rectangle(&whole).is_none(), "all");
    }
}

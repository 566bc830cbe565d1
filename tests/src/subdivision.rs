//! Silhouettes by subdivision alone, as Elber and Cohen (1989, §3, table 1) compare them: every patch is halved until it
//! is flat, and the flat pieces that can hold a silhouette are collected. Adaptively, what cannot hold one is not
//! halved further.

use glam::DVec4;
use penvis_core::extract::facing::{Facing, facing};
use penvis_core::view::Patch;

/// What a subdivision did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Subdivision {
    /// Pieces looked at, the patch itself among them.
    pub cells: usize,
    /// Flat pieces that can hold a silhouette.
    pub found: usize,
}

/// Halves `patch` until its pieces are flat to `flatness` (view units). Whether a piece can hold a silhouette is asked of
/// every piece if `adaptive`, else of the flat ones only.
#[must_use]
pub fn subdivide(patch: &Patch, flatness: f64, adaptive: bool) -> Subdivision {
    let mut done = Subdivision::default();
    let mut stack = vec![patch.clone()];
    while let Some(piece) = stack.pop() {
        done.cells += 1;
        let can_hold = |piece: &Patch| facing(piece).facing == Facing::Mixed;
        if adaptive && !can_hold(&piece) {
            continue;
        }
        let [u, v] = bends(&piece);
        if u + v <= flatness {
            done.found += usize::from(adaptive || can_hold(&piece));
            continue;
        }
        stack.extend(halves(&piece, u >= v));
    }
    done
}

/// How far the control points are from evenly spaced ones on straight rows in u, and on straight columns in v.
fn bends(patch: &Patch) -> [f64; 2] {
    let (p, q, w) = (patch.degree_u, patch.degree_v, patch.degree_v + 1);
    let at = |i: usize, j: usize| {
        let h = patch.points[i * w + j];
        h.truncate() / h.w
    };
    let mut bend = [0.0_f64; 2];
    for i in 0..=p {
        for j in 0..=q {
            let (s, t) = (i as f64 / p as f64, j as f64 / q as f64);
            bend[0] = bend[0].max(at(i, j).distance(at(0, j).lerp(at(p, j), s)));
            bend[1] = bend[1].max(at(i, j).distance(at(i, 0).lerp(at(i, q), t)));
        }
    }
    bend
}

fn halves(patch: &Patch, in_u: bool) -> [Patch; 2] {
    let (p, q, w) = (patch.degree_u, patch.degree_v, patch.degree_v + 1);
    let (mut low, mut high) = (patch.clone(), patch.clone());
    // One row or column after the other, by de Casteljau.
    let (rows, degree, step, stride) = if in_u { (q + 1, p, w, 1) } else { (p + 1, q, 1, w) };
    for row in 0..rows {
        let at = |k: usize| row * stride + k * step;
        let mut c: Vec<DVec4> = (0..=degree).map(|k| patch.points[at(k)]).collect();
        for k in 0..=degree {
            low.points[at(k)] = c[0];
            high.points[at(degree - k)] = c[degree - k];
            for m in 0..degree - k {
                c[m] = (c[m] + c[m + 1]) * 0.5;
            }
        }
    }
    let range = if in_u { patch.u } else { patch.v };
    let middle = 0.5 * (range[0] + range[1]);
    if in_u {
        (low.u, high.u) = ([range[0], middle], [middle, range[1]]);
    } else {
        (low.v, high.v) = ([range[0], middle], [middle, range[1]]);
    }
    [low, high]
}

/// Time of the non-adaptive subdivision over that of the adaptive one in the paper's table 1.
pub const PAPER: [(&str, f64); 6] =
    [("saddle", 5.7), ("discont", 3.6), ("pawn", 5.4), ("queen", 3.4), ("rook", 4.0), ("knight", 2.1)];

#[cfg(test)]
mod tests {
    use penvis::builtin;
    use penvis_core::view::ViewScene;

    use super::*;

    #[test]
    fn adaptive_subdivision_saves_what_it_did_in_the_paper() {
        for (name, paper) in PAPER {
            let model = builtin::load(name).expect("a built-in model");
            let view = ViewScene::new(&model.scene, &model.view.camera().expect("a camera")).expect("a view");
            let sum = |adaptive| {
                let parts = view.patches().iter().map(|p| subdivide(p, 2e-4 * view.size(), adaptive));
                parts.fold((0, 0), |(cells, found), s| (cells + s.cells, found + s.found))
            };
            let (all, few) = (sum(false), sum(true));
            assert_eq!(all.1, few.1, "{name}: what is skipped holds no silhouette");
            assert!(all.0 as f64 >= paper * few.0 as f64, "{name}: {} and {} cells", all.0, few.0);
        }
    }
}

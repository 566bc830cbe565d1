//! Where two patches intersect: both are subdivided until they are apart, or so flat for the angle between them that they
//! meet in one short arc, from border to border.

use alloc::vec::Vec;

use glam::{DMat3, DVec2, DVec3, DVec4};

use super::cell::{Cell, Slab};

/// A point of an intersection: parameters of the first and of the second patch.
pub(super) type Both = DVec4;

/// An arc of the intersection of two patches, from border to border of a pair of cells: local parameters of the patches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Short {
    pub(super) ends: [Both; 2],
}

/// Largest thickness of a cell, by its width and the sine of the angle between the two, at which it counts as flat: the
/// tangent planes of the two then stay apart all over them, and the intersection runs one way.
const FLAT: f64 = 0.1;

/// Smallest sine of the angle between two cells at which they cross; what is left out is as long as surfaces take to part
/// by this angle.
const STEEP: f64 = 1e-4;

/// Size of a pair of cells, by the contact distance, that is not cut further.
const SPECK: f64 = 1.0 / 8.0;

/// Pairs of cells looked at for one pair of patches at the most. An intersection takes some hundred; more are needed where
/// two surfaces touch without crossing.
const MOST_PAIRS: u32 = 1 << 16;

pub(super) struct Search {
    /// Cells nearer than this in space touch.
    contact: f64,
    pairs: u32,
    pub(super) found: Vec<Short>,
    /// Places in the first patch where it is not known how the two intersect.
    pub(super) undecided: Vec<[DVec2; 2]>,
}

/// What two cells have in common.
enum Common {
    Nothing,
    Arc(Short),
    Unknown,
}

impl Search {
    pub(super) fn new(contact: f64) -> Self {
        Self { contact, pairs: 0, found: Vec::new(), undecided: Vec::new() }
    }

    pub(super) fn meet(&mut self, a: &Cell, b: &Cell) {
        self.pairs += 1;
        if !a.is_near(b) {
            return;
        }
        let (sa, sb) = (a.slab(), b.slab());
        let apart = |s: &Option<Slab>, other: &Cell| {
            s.is_some_and(|s| {
                let [lo, hi] = other.along(s.origin, s.normal);
                lo > s.height[1] || hi < s.height[0]
            })
        };
        if apart(&sa, b) || apart(&sb, a) {
            return;
        }
        if let (Some(sa), Some(sb)) = (sa, sb) {
            let sine = sa.normal.cross(sb.normal).length();
            let flat = |s: &Slab| s.thickness() <= FLAT * sine * s.width;
            if sine > STEEP && flat(&sa) && flat(&sb) {
                match common((a, &sa), (b, &sb)) {
                    Common::Nothing => return,
                    Common::Arc(short) => {
                        self.found.push(short);
                        return;
                    }
                    Common::Unknown => {}
                }
            }
        }
        let (size_a, size_b) = (a.size(), b.size());
        if size_a.max(size_b) <= SPECK * self.contact {
            // They touch here, or what they have in common is bridged when arcs are strung together.
            return;
        }
        if self.pairs >= MOST_PAIRS {
            // One place stands for the rest of the pair.
            if self.undecided.is_empty() {
                self.undecided.push([a.from, a.to]);
            }
            return;
        }
        if size_a >= size_b {
            a.parts().iter().for_each(|part| self.meet(part, b));
        } else {
            b.parts().iter().for_each(|part| self.meet(a, part));
        }
    }
}

/// Two cells that are flat for the angle between them: the arc enters and leaves over borders of them.
fn common((a, sa): (&Cell, &Slab), (b, sb): (&Cell, &Slab)) -> Common {
    let mut ends: Vec<(Both, DVec3)> = Vec::new();
    let mut unsettled = false;
    for fixed in 0..4 {
        for high in [false, true] {
            // A border on one side of the other cell is not crossed.
            let (cell, other) = if fixed < 2 { (a, sb) } else { (b, sa) };
            let heights = || cell.border(fixed % 2, high).map(|p| (p - other.origin).dot(other.normal));
            if heights().all(|h| h > other.height[1]) || heights().all(|h| h < other.height[0]) {
                continue;
            }
            // An arc that nearly runs along the border may cross it twice, and either place may be met first.
            let along = fixed ^ 1;
            for start in [0.5, 0.0, 1.0] {
                let mut from = DVec4::splat(0.5);
                from[fixed] = if high { 1.0 } else { 0.0 };
                from[along] = start;
                let border = on_border(a, b, fixed, from);
                match border {
                    Border::Outside { .. } => {}
                    Border::Unsettled => unsettled = true,
                    Border::At { place, .. } => {
                        let p = a.jet(DVec2::new(place.x, place.y))[0];
                        // A corner is found on both of its borders.
                        let near = SAME * (a.size() + b.size());
                        if ends.iter().all(|e| e.1.distance(p) > near) {
                            ends.push((place, p));
                        }
                    }
                }
                if let Border::Outside { steep: true } | Border::At { steep: true, .. } = border {
                    break;
                }
            }
        }
    }
    match ends[..] {
        [] | [_] if unsettled => Common::Unknown,
        // A corner in common, or nothing.
        [] | [_] => Common::Nothing,
        [(x, p), (y, q)] => {
            let ([_, au, av], [_, bu, bv]) = (a.jet(DVec2::splat(0.5)), b.jet(DVec2::splat(0.5)));
            // All arcs run to the left of the second surface's normal, seen along the first one's.
            let along = au.cross(av).cross(bu.cross(bv));
            let [x, y] = [x, y].map(|x| {
                let (la, lb) = (a.local(DVec2::new(x.x, x.y)), b.local(DVec2::new(x.z, x.w)));
                DVec4::new(la.x, la.y, lb.x, lb.y)
            });
            Common::Arc(Short { ends: if along.dot(q - p) >= 0.0 { [x, y] } else { [y, x] } })
        }
        _ => Common::Unknown,
    }
}

/// Points of a border nearer together than this part of the cells are one.
const SAME: f64 = 1e-7;

/// Sine of the angle between arc and border below which there is no telling whether the one crosses the other.
const GRAZING: f64 = 1e-7;

/// The same above which they cross once: flat cells bend by less.
const CLEAR: f64 = 0.5;

enum Border {
    Outside {
        steep: bool,
    },
    At {
        place: Both,
        /// The arc clearly crosses the border.
        steep: bool,
    },
    /// The arc runs along the border, and crosses it nowhere, or twice close together.
    Unsettled,
}

/// Where the intersection passes a border, on which parameter number `fixed` (u and v of the first, of the second cell)
/// keeps its value: Newton's method in the other three. The cells are flat, so that it does not lead far.
fn on_border(a: &Cell, b: &Cell, fixed: usize, from: Both) -> Border {
    /// A point on a border of one cell is on a border of its neighbour, and found from both.
    const SLACK: f64 = 1e-9;
    let mut x = from;
    let (mut settled, mut steep) = (false, false);
    for _ in 0..20 {
        let ([p, pu, pv], [q, qu, qv]) = (a.jet(DVec2::new(x.x, x.y)), b.jet(DVec2::new(x.z, x.w)));
        let all = [pu, pv, -qu, -qv];
        let free = [0, 1, 2, 3].into_iter().filter(|&k| k != fixed);
        let mut columns = [DVec3::ZERO; 3];
        for (column, k) in columns.iter_mut().zip(free.clone()) {
            *column = all[k];
        }
        let jacobian = DMat3::from_cols(columns[0], columns[1], columns[2]);
        // The sine of the angle between border and arc, in the surface that the border is of.
        let normals = [pu.cross(pv), qu.cross(qv)];
        let (border, other) = (all[fixed ^ 1], normals[usize::from(fixed < 2)]);
        let sine = normals[0].cross(normals[1]).length() / (normals[0].length() * normals[1].length());
        let slant = border.dot(other).abs() / (border.length() * other.length() * sine);
        steep = slant > CLEAR;
        if slant.is_nan() || slant <= GRAZING {
            return Border::Unsettled;
        }
        let step = jacobian.inverse() * (q - p);
        for (k, d) in free.zip(step.to_array()) {
            x[k] += d;
        }
        if !x.is_finite() || x.abs().max_element() > 16.0 {
            // It may have been led astray.
            return Border::Outside { steep: false };
        }
        if step.abs().max_element() <= 1e-13 {
            settled = true;
            break;
        }
        // Close enough to be sure that it settles; rounding may keep the steps from vanishing.
        settled = step.abs().max_element() <= 1e-9;
    }
    let inside = x.cmpge(DVec4::splat(-SLACK)).all() && x.cmple(DVec4::splat(1.0 + SLACK)).all();
    match (settled, inside) {
        (true, true) => Border::At { place: x.clamp(DVec4::ZERO, DVec4::ONE), steep },
        (true, false) => Border::Outside { steep },
        (false, _) => Border::Unsettled,
    }
}

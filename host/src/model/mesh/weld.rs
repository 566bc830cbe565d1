//! Points that are nearly the same.

use std::collections::HashMap;

use glam::DVec3;

/// Which point stands for each.
pub(super) struct Welded {
    /// For every point the one that stands for it: itself, or one before it.
    pub(super) target: Vec<u32>,
    /// Points that another stands for.
    pub(super) moved: usize,
    /// Farthest of them from the one that does.
    pub(super) farthest: f64,
}

/// Lets each point stand for those after it that are no farther than `tolerance` from it, unless an earlier one does. So
/// no point is moved by more, and chains of near points do not shrink into one. Cost: eight look-ups a point.
pub(super) fn weld(points: &[DVec3], tolerance: f64) -> Welded {
    let mut welded = Welded { target: Vec::with_capacity(points.len()), moved: 0, farthest: 0.0 };
    // Cells as wide as the ball round a point, which then meets two of them in each direction. Coordinates are at most
    // 2²³ tolerances.
    let width = 2.0 * tolerance;
    let cell = |p: DVec3| if width > 0.0 { (p / width).floor().to_array().map(|x| x as i64) } else { [0; 3] };
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(points.len());
    for (index, &p) in points.iter().enumerate() {
        let index = index as u32;
        if width == 0.0 {
            welded.target.push(index);
            continue;
        }
        let (low, high) = (cell(p - tolerance), cell(p + tolerance));
        let mut nearest: Option<(u32, f64)> = None;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    for &q in cells.get(&[x, y, z]).into_iter().flatten() {
                        let distance = p.distance(points[q as usize]);
                        // The first one, whatever the order of the cells.
                        if distance <= tolerance && nearest.is_none_or(|(first, _)| q < first) {
                            nearest = Some((q, distance));
                        }
                    }
                }
            }
        }
        match nearest {
            Some((q, distance)) => {
                welded.target.push(q);
                welded.moved += 1;
                welded.farthest = welded.farthest.max(distance);
            }
            None => {
                welded.target.push(index);
                cells.entry(cell(p)).or_default().push(index);
            }
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn points_in_a_row_do_not_shrink_into_one() {
        let row: Vec<DVec3> = (0..5).map(|k| DVec3::X * f64::from(k)).collect();
        let welded = weld(&row, 1.0);
        assert_eq!((welded.target, welded.moved, welded.farthest), (vec![0, 0, 2, 2, 4], 2, 1.0));
        assert_eq!(weld(&row, 0.5).target, [0, 1, 2, 3, 4]);
        assert_eq!(weld(&[DVec3::ZERO; 2], 0.0).target, [0, 1]);
    }

    proptest! {
        /// Against all pairs: who stands for a point is the first that is near and stands for itself.
        #[test]
        fn all_pairs_agree(
            points in prop::collection::vec(prop::array::uniform3(-20_i32..20), 1..60), tolerance in 0.1_f64..3.0
        ) {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::from(p.map(f64::from)) * 0.5).collect();
            let welded = weld(&points, tolerance);
            let mut target: Vec<u32> = Vec::new();
            for (i, p) in points.iter().enumerate() {
                let near = |&q: &usize| target[q] as usize == q && p.distance(points[q]) <= tolerance;
                let found = (0..i).find(near);
                target.push(found.unwrap_or(i) as u32);
            }
            prop_assert_eq!(&welded.target, &target);
            let moved = (0..points.len()).filter(|&i| target[i] as usize != i);
            prop_assert_eq!(welded.moved, moved.count());
        }
    }
}

//! Polylines by the way along them.

use glam::DVec2;

/// A polyline with the way to each of its vertices.
pub(super) struct Along<'a> {
    page: &'a [DVec2],
    /// Lengths up to the vertices in mm.
    lengths: Vec<f64>,
}

impl<'a> Along<'a> {
    pub(super) fn new(page: &'a [DVec2]) -> Self {
        let mut lengths = Vec::with_capacity(page.len());
        let mut length = 0.0;
        for (k, p) in page.iter().enumerate() {
            length += k.checked_sub(1).map_or(0.0, |before| page[before].distance(*p));
            lengths.push(length);
        }
        Self { page, lengths }
    }

    /// Its length in mm.
    pub(super) fn length_mm(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    /// The way up to a vertex in mm.
    pub(super) fn up_to(&self, vertex: usize) -> f64 {
        self.lengths[vertex]
    }

    /// The place so far along it; its ends for what lies beyond.
    pub(super) fn at(&self, mm: f64) -> DVec2 {
        self.value(self.page, DVec2::lerp, mm)
    }

    /// What is between the values at the vertices, so far along it.
    fn value<T: Copy>(&self, values: &[T], lerp: fn(T, T, f64) -> T, mm: f64) -> T {
        let next = self.lengths.partition_point(|&length| length < mm).clamp(1, self.page.len() - 1);
        let [low, high] = [self.lengths[next - 1], self.lengths[next]];
        let share = if high > low { ((mm - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        lerp(values[next - 1], values[next], share)
    }

    /// The values along the part between two places: at its ends, and at the vertices between them.
    fn part<T: Copy>(&self, values: &[T], lerp: fn(T, T, f64) -> T, [from, to]: [f64; 2]) -> Vec<T> {
        let inner = self.lengths.partition_point(|&l| l <= from)..self.lengths.partition_point(|&l| l < to);
        let mut part = vec![self.value(values, lerp, from)];
        part.extend(values.get(inner).unwrap_or_default());
        part.push(self.value(values, lerp, to));
        part
    }

    /// Parts of it, in order and apart.
    pub(super) fn parts(&self, parts: &[[f64; 2]]) -> Vec<Vec<DVec2>> {
        self.parts_of(self.page, DVec2::lerp, parts)
    }

    /// The values along parts of it, in order and apart, given those at its vertices. Of a polyline that is closed, the last and the first part are
    /// one if they meet where it begins.
    pub(super) fn parts_of<T: Copy>(&self, values: &[T], lerp: fn(T, T, f64) -> T, parts: &[[f64; 2]]) -> Vec<Vec<T>> {
        let whole = [0.0, self.length_mm()];
        let is_closed = self.page.first() == self.page.last();
        match parts {
            [first, inner @ .., last] if is_closed && first[0] == whole[0] && last[1] == whole[1] => {
                let mut over = self.part(values, lerp, *last);
                over.pop();
                over.extend(self.part(values, lerp, *first));
                inner.iter().map(|part| self.part(values, lerp, *part)).chain([over]).collect()
            }
            _ => parts.iter().map(|part| self.part(values, lerp, *part)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_vertices_between_their_ends() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]].map(DVec2::from);
        let along = Along::new(&square);
        assert_eq!((along.length_mm(), along.at(6.0), along.up_to(3)), (16.0, DVec2::new(4.0, 2.0), 12.0));
        assert_eq!((along.at(-1.0), along.at(17.0)), (square[0], square[0]));
        let part = |ends| along.parts(&[ends]).remove(0);
        assert_eq!(part([2.0, 9.0]), [[2.0, 0.0], [4.0, 0.0], [4.0, 4.0], [3.0, 4.0]].map(DVec2::from));
        assert_eq!(part([0.0, 16.0]), square);
        assert_eq!(part([4.0, 8.0]), square[1..3]);
        // The beginning of a closed line is no end.
        let two = along.parts(&[[0.0, 1.0], [5.0, 6.0], [15.0, 16.0]]);
        assert_eq!(
            two,
            [vec![[4.0, 1.0], [4.0, 2.0]], vec![[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]]]
                .map(|part| part.into_iter().map(DVec2::from).collect::<Vec<_>>())
        );
        let heights = along.parts_of(&[0.0, 1.0, 2.0, 3.0, 0.0], |a, b, share| a + (b - a) * share, &[[2.0, 9.0]]);
        assert_eq!(heights, [[0.5, 1.0, 2.0, 2.25]]);
        let open = Along::new(&square[..3]);
        assert_eq!(open.parts(&[[0.0, 1.0], [7.0, 8.0]]).len(), 2);
    }
}

//! Points in a k-d tree from which they can be taken out: the nearest ones of a place.

use glam::DVec2;

/// Most points in a leaf.
const LEAF: usize = 8;

/// A balanced tree over points; indices are those of the list that it was made of.
///
/// Building costs O(n log n), a search O(log n + k) on average, for any distribution of the points.
pub(super) struct KdTree<'a> {
    points: &'a [DVec2],
    /// Indices of points; those of a node are adjacent.
    items: Vec<u32>,
    /// Place of each point in `items`.
    place: Vec<u32>,
    nodes: Vec<Node>,
    /// Leaf of each point.
    leaf: Vec<u32>,
}

struct Node {
    low: DVec2,
    high: DVec2,
    /// Range in `items`; of a leaf, what is left in it.
    start: u32,
    end: u32,
    /// The first child; the second follows at `second`. 0 for a leaf.
    first: u32,
    second: u32,
    parent: u32,
    /// Points left.
    left: u32,
}

impl<'a> KdTree<'a> {
    /// Of the points with these indices.
    pub(super) fn new(points: &'a [DVec2], items: Vec<u32>) -> Self {
        let mut tree =
            Self { points, place: vec![0; points.len()], leaf: vec![0; points.len()], nodes: Vec::new(), items };
        let count = tree.items.len();
        if count > 0 {
            tree.split(0, count, 0);
        }
        for (place, &item) in tree.items.iter().enumerate() {
            tree.place[item as usize] = place as u32;
        }
        tree
    }

    fn split(&mut self, start: usize, end: usize, parent: u32) -> u32 {
        let points = self.points;
        let items = &mut self.items[start..end];
        let at = |i: &u32| points[*i as usize];
        let low = items.iter().map(at).fold(DVec2::INFINITY, DVec2::min);
        let high = items.iter().map(at).fold(DVec2::NEG_INFINITY, DVec2::max);
        let node = self.nodes.len() as u32;
        let (s, e) = (start as u32, end as u32);
        self.nodes.push(Node { low, high, start: s, end: e, first: 0, second: 0, parent, left: e - s });
        if end - start <= LEAF {
            for &item in &*items {
                self.leaf[item as usize] = node;
            }
            return node;
        }
        let middle = (end - start) / 2;
        let axis = usize::from(high.y - low.y > high.x - low.x);
        // Ties by index, so that the tree does not depend on the order of what it is made of.
        items.select_nth_unstable_by(middle, |a, b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(b)));
        let first = self.split(start, start + middle, node);
        let second = self.split(start + middle, end, node);
        self.nodes[node as usize].first = first;
        self.nodes[node as usize].second = second;
        node
    }

    /// Takes a point out that is in.
    pub(super) fn remove(&mut self, item: u32) {
        let mut node = self.leaf[item as usize] as usize;
        let last = self.nodes[node].end - 1;
        let place = self.place[item as usize];
        self.items.swap(place as usize, last as usize);
        self.place[self.items[place as usize] as usize] = place;
        self.place[item as usize] = last;
        self.nodes[node].end = last;
        loop {
            self.nodes[node].left -= 1;
            if node == 0 {
                break;
            }
            node = self.nodes[node].parent as usize;
        }
    }

    /// The `count` nearest points that are left and `wanted`, with their squared distances, nearest first; ties go to the lower index.
    pub(super) fn nearest(&self, at: DVec2, count: usize, wanted: impl Fn(u32) -> bool, found: &mut Vec<(f64, u32)>) {
        found.clear();
        if !self.nodes.is_empty() && count > 0 {
            self.search(0, at, count, &wanted, found);
        }
    }

    fn search(&self, node: u32, at: DVec2, count: usize, wanted: &impl Fn(u32) -> bool, found: &mut Vec<(f64, u32)>) {
        let node = &self.nodes[node as usize];
        if node.first == 0 {
            for &item in &self.items[node.start as usize..node.end as usize] {
                let candidate = (at.distance_squared(self.points[item as usize]), item);
                if (found.len() < count || candidate < found[count - 1]) && wanted(item) {
                    found.truncate(count - 1);
                    let place = found.partition_point(|f| *f < candidate);
                    found.insert(place, candidate);
                }
            }
            return;
        }
        let distance = |child: u32| {
            let n = &self.nodes[child as usize];
            if n.left == 0 { f64::INFINITY } else { at.distance_squared(at.clamp(n.low, n.high)) }
        };
        let mut children = [(distance(node.first), node.first), (distance(node.second), node.second)];
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (distance, child) in children {
            // A node as far as the last one found may hold one of a lower index.
            if distance < f64::INFINITY && (found.len() < count || distance <= found[count - 1].0) {
                self.search(child, at, count, wanted, found);
            }
        }
    }
}

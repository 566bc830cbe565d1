//! The Utah teapot.

use glam::{DVec3, DVec4};
use penvis_core::scene::SceneSurface;

use super::teapot_data::{PATCHES, VERTICES};
use super::{bezier, part};
use crate::model::View;

/// Part and number of patches, in the order of the data.
const PARTS: [(&str, usize); 7] =
    [("rim", 4), ("body upper", 4), ("body lower", 4), ("handle", 4), ("spout", 4), ("lid", 8), ("bottom", 4)];

pub(super) fn surfaces() -> Option<Vec<SceneSurface>> {
    let names = PARTS.iter().flat_map(|&(name, count)| (1..=count).map(move |k| format!("{name} {k}")));
    let nets = PATCHES.iter().map(|net| {
        let vertex = |k: usize| {
            let [x, y, z] = VERTICES[usize::from(net[k]) - 1];
            DVec4::new(x, y, z, 1.0)
        };
        std::array::from_fn::<_, 4, _>(|iu| std::array::from_fn::<_, 4, _>(|iv| vertex(4 * iu + iv)))
    });
    names.zip(nets).map(|(name, net)| Some(part(name, bezier(net)?))).collect()
}

pub(super) fn view() -> View {
    View::orthographic(DVec3::new(1.0, -1.6, 0.75))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_is_the_customary_listing() {
        let mut used: Vec<u16> = PATCHES.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        assert_eq!(used.len(), 302);
        assert_eq!((used[0], used[301]), (1, 306));
        let unused: Vec<u16> = (1..=306).filter(|k| !used.contains(k)).collect();
        assert_eq!(unused, [205, 206, 216, 223]);
        let mut points: Vec<[u64; 3]> =
            used.iter().map(|&k| VERTICES[usize::from(k) - 1].map(|x| (x + 0.0).to_bits())).collect();
        points.sort_unstable();
        points.dedup();
        assert_eq!(points.len(), 290);
    }

    #[test]
    fn the_data_is_mirrored_in_the_plane_of_handle_and_spout() {
        for &[x, y, z] in &VERTICES {
            assert!(VERTICES.iter().any(|v| v[0] == x && v[1] == -y && v[2] == z), "({x}, {y}, {z})");
        }
        let extent = |k: usize| {
            VERTICES.iter().map(|v| v[k]).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
        };
        assert_eq!([extent(0), extent(1), extent(2)], [(-3.0, 3.525), (-2.0, 2.0), (0.0, 3.15)]);
    }

    #[test]
    fn every_patch_has_its_part() {
        let surfaces = surfaces().unwrap();
        assert_eq!(surfaces.len(), 32);
        assert_eq!(surfaces[12].name, "handle 1");
        assert_eq!(surfaces[16].name, "spout 1");
        assert_eq!(surfaces[31].name, "bottom 4");
    }
}

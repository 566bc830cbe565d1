//! The surfaces of a model, in model space and any unit.

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

use glam::DMat4;

use crate::nurbs::{NurbsError, Surface};
use crate::trim::Trims;

/// A surface with the name that messages use for it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSurface {
    /// Name from the model file, or one made from the index.
    pub name: String,
    /// The surface.
    pub surface: Surface,
    /// The part of it that there is; all of it where there is none.
    pub trims: Option<Trims>,
    /// What it stands for, if it is a facet of a mesh.
    pub facet: Option<Facet>,
}

impl SceneSurface {
    /// An untrimmed surface that stands for itself.
    #[must_use]
    pub fn new(name: impl Into<String>, surface: Surface) -> Self {
        Self { name: name.into(), surface, trims: None, facet: None }
    }

    /// The image under an affine map, with its trims and the shared edges that they name. Positive sides go with the map:
    /// what points out of a solid points out of its image. So where the map mirrors, u runs backwards, for the normal
    /// S_u × S_v turns round.
    ///
    /// # Errors
    /// If a coordinate overflows, or the map is projective and a weight is not positive after it.
    pub fn transformed(&self, map: DMat4) -> Result<Self, NurbsError> {
        let surface = self.surface.transformed(map)?;
        let mirrors = map.determinant() < 0.0;
        let surface = if mirrors { surface.reversed_u() } else { surface };
        let trims = self.trims.as_ref().map(|trims| if mirrors { trims.reversed_u() } else { trims.clone() });
        Ok(Self { name: self.name.clone(), surface, trims, facet: self.facet })
    }
}

/// A facet of a mesh, which stands for a part of a smooth surface: where two of them meet at a small angle there is no
/// edge, and their parameters mean nothing, so that they have no isocurves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Two facets that meet at no more than this angle, in radians, meet smoothly; where those of two meshes differ, the
    /// smaller one counts.
    pub crease_angle: f64,
}

/// What is to be drawn. Surfaces carry no topology but the shared edges that their trims name: coincident boundaries are found
/// by geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name of the model.
    pub name: String,
    /// The surfaces; their index identifies them in every later stage.
    pub surfaces: Vec<SceneSurface>,
}

impl Scene {
    /// The surfaces of several scenes as one, in their order. Shared edges of different scenes stay different ones: they are
    /// numbered anew, from 0, in the order in which they occur.
    #[must_use]
    pub fn joined(name: impl Into<String>, scenes: impl IntoIterator<Item = Self>) -> Self {
        let (mut surfaces, mut next) = (Vec::new(), 0_u32);
        for scene in scenes {
            let mut numbers = BTreeMap::new();
            let mut number = |edge: u32| {
                *numbers.entry(edge).or_insert_with(|| {
                    let own = next;
                    // Memory ends long before the numbers do.
                    next = next.wrapping_add(1);
                    own
                })
            };
            for mut surface in scene.surfaces {
                surface.trims = surface.trims.map(|trims| trims.with_edges(&mut number));
                surfaces.push(surface);
            }
        }
        Self { name: name.into(), surfaces }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::{Curve, KnotVector};
    use crate::shape::{plane, polyline};
    use crate::trim::TrimCurve;
    use alloc::vec;
    use glam::{DVec2, DVec3};

    /// A square whose sides have these numbers.
    fn square(numbers: [u32; 4]) -> Scene {
        let surface = plane(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
        let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y, DVec3::ZERO];
        let side = |(w, edge): (&[DVec3], u32)| TrimCurve { curve: polyline(w).unwrap(), edge: Some(edge) };
        let sides = corners.windows(2).zip(numbers).map(side).collect();
        let trims = Some(Trims::oriented(&surface, [false; 2], &[sides]).unwrap());
        Scene { name: "square".into(), surfaces: vec![SceneSurface { trims, ..SceneSurface::new("s", surface) }] }
    }

    fn numbers(surface: &SceneSurface) -> Vec<u32> {
        let trims = surface.trims.as_ref().unwrap();
        trims.loops().iter().flat_map(|l| l.pieces()).filter_map(|p| p.edge()).collect()
    }

    #[test]
    fn shared_edges_of_two_scenes_stay_apart() {
        let mut first = square([7, u32::MAX, 3, 0]);
        first.surfaces.extend(square([3, 9, 9, 7]).surfaces);
        let joined = Scene::joined("both", [first, square([0, 3, 7, 1])]);
        let found: Vec<Vec<u32>> = joined.surfaces.iter().map(numbers).collect();
        // What was one edge within a scene is still one, and nothing else is.
        assert_eq!(found, [vec![0, 1, 2, 3], vec![2, 4, 4, 0], vec![5, 6, 7, 8]]);
        assert_eq!((joined.name.as_str(), joined.surfaces.len()), ("both", 3));
    }

    /// A bulging patch of degree 1 × 2 on parameters that are not from 0 to 1, cut by a triangle with a round side.
    fn trimmed() -> SceneSurface {
        let [ku, kv] =
            [(1, [2.0, 5.0]), (2, [-1.0, 0.5])].map(|(degree, range)| KnotVector::bezier(degree, range).unwrap());
        let net =
            [[0.0, 0.0, 0.0], [0.0, 1.0, 2.0], [0.0, 3.0, 0.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [2.0, 3.0, 0.5]];
        let surface = Surface::new(ku, kv, net.map(|p| DVec3::from(p).extend(1.0)).to_vec()).unwrap();
        let corners = [[2.0, -1.0], [5.0, -1.0], [2.0, 0.5], [2.0, -1.0]].map(|c| DVec3::new(c[0], c[1], 0.0));
        let side = |k: usize, bulge: f64| {
            let middle = 0.5 * (corners[k] + corners[k + 1]) + DVec3::new(bulge, bulge, 0.0);
            let points = [corners[k], middle, corners[k + 1]].map(|p| p.extend(1.0)).to_vec();
            let curve = Curve::new(KnotVector::bezier(2, [0.0, 1.0]).unwrap(), points).unwrap();
            TrimCurve { curve, edge: Some(k as u32) }
        };
        let sides = vec![side(0, 0.0), side(1, -0.3), side(2, 0.0)];
        let trims = Trims::oriented(&surface, [false; 2], &[sides]).unwrap();
        SceneSurface { trims: Some(trims), ..SceneSurface::new("part", surface) }
    }

    #[test]
    fn the_image_of_a_surface_has_the_image_of_its_front_and_of_its_trims() {
        let part = trimmed();
        let maps = [
            DMat4::from_scale(DVec3::new(1.0, -2.0, 0.5)),
            DMat4::from_rotation_x(0.7) * DMat4::from_scale(DVec3::new(3.0, 2.0, 0.5)),
            DMat4::from_translation(DVec3::new(5.0, 6.0, 7.0)) * DMat4::from_scale(-DVec3::ONE),
        ];
        for map in maps {
            let mirrors = map.determinant() < 0.0;
            let image = part.transformed(map).unwrap();
            let (old, new) = (part.trims.as_ref().unwrap(), image.trims.as_ref().unwrap());
            let (mut inside, mut outside) = (0, 0);
            for k in 0..400 {
                let at = DVec2::new(
                    2.0 + 3.0 * (f64::from(k % 20) + 0.5) / 20.0,
                    -1.0 + 1.5 * (f64::from(k / 20) + 0.5) / 20.0,
                );
                let there = DVec2::new(if mirrors { 7.0 - at.x } else { at.x }, at.y);
                assert_eq!(old.contains(at), new.contains(there), "{at}");
                (inside, outside) = if old.contains(at) { (inside + 1, outside) } else { (inside, outside + 1) };
                let (p, du, dv) = part.surface.derivatives(at.x, at.y);
                let (q, eu, ev) = image.surface.derivatives(there.x, there.y);
                assert!(q.abs_diff_eq(map.transform_point3(p), 1e-12), "{at}");
                // A step off the front of the surface is one off the front of its image.
                assert!(eu.cross(ev).dot(map.transform_vector3(du.cross(dv))) > 0.0, "{at}");
            }
            assert!(inside > 50 && outside > 50, "{inside} {outside}");
            assert_eq!(numbers(&part), numbers(&image));
            // What is on the border of the parameter range is so still, and what is kept lies on the same side in space.
            let borders = |s: &SceneSurface| s.trims.as_ref().unwrap().border_edges().map(|b| b.len());
            let [low, high, rest @ ..] = borders(&part);
            assert_eq!(
                borders(&image),
                if mirrors { [high, low, rest[0], rest[1]] } else { [low, high, rest[0], rest[1]] }
            );
            let sides =
                |t: &Trims| -> Vec<bool> { t.loops()[0].pieces().iter().filter_map(|p| p.keeps_left()).collect() };
            assert_eq!(sides(old), sides(new).into_iter().map(|left| left != mirrors).collect::<Vec<_>>());
        }
        let back = part.transformed(maps[0]).unwrap().transformed(maps[0].inverse()).unwrap();
        assert_eq!(back.trims, part.trims);
    }
}

//! The surfaces of a model, in model space and any unit.

use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

use crate::nurbs::Surface;
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
    use crate::shape::{plane, polyline};
    use crate::trim::TrimCurve;
    use alloc::vec;
    use glam::DVec3;

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
}

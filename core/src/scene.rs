//! The surfaces of a model, in model space and any unit.

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

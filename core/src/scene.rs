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
}

/// What is to be drawn. Surfaces carry no topology: coincident boundaries are found by geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name of the model.
    pub name: String,
    /// The surfaces; their index identifies them in every later stage.
    pub surfaces: Vec<SceneSurface>,
}

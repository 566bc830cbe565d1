//! The visible regions of a model on its page.

use glam::DVec2;
use penvis_core::extract::CurveKind;
use penvis_core::scene::Scene;
use penvis_core::visible::{VisibleEdge, VisibleRegions};

use crate::drawing::Page;
use crate::page::Layout;

/// Largest turn of a surface's normal between neighbouring points of a border, radians: 10 degrees.
pub(crate) const NORMAL_ANGLE: f64 = std::f64::consts::PI / 18.0;

/// What is visible of every surface, on the page.
#[derive(Clone, Debug)]
pub struct Shapes {
    /// Name of the model.
    pub name: String,
    /// The sheet.
    pub page: Page,
    /// The shapes of the surfaces of which something is visible, in their order.
    pub shapes: Vec<Shape>,
    /// Places at which a border is not known.
    pub undecided: Vec<Undecided>,
}

/// What is visible of one surface.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Index of the surface.
    pub surface: usize,
    /// Its name; that of an object of a scene goes before it.
    pub name: String,
    /// Area in mm².
    pub area_mm2: f64,
    /// Outer loops counter-clockwise (y up), holes clockwise.
    pub loops: Vec<Vec<ShapeEdge>>,
}

/// A part of a curve that borders a shape.
#[derive(Clone, Debug)]
pub struct ShapeEdge {
    /// What the curve is.
    pub kind: CurveKind,
    /// Whether the surface ends there; if not, it goes on behind another one, or behind itself.
    pub own: bool,
    /// Points on the page in mm, y up, from the lower left corner.
    pub page: Vec<DVec2>,
    /// Parameters of the surface at the points.
    pub uv: Vec<DVec2>,
}

/// A place at which a border is not known.
#[derive(Clone, Debug)]
pub struct Undecided {
    /// On the page in mm.
    pub page: DVec2,
    /// The surface whose border it is, if that is known.
    pub surface: Option<usize>,
    /// Why.
    pub why: &'static str,
}

impl Shapes {
    /// The regions laid out.
    #[must_use]
    pub fn new(regions: &VisibleRegions, scene: &Scene, layout: &Layout, page: Page) -> Self {
        let edge = |e: &VisibleEdge| ShapeEdge {
            kind: e.kind,
            own: e.own,
            page: e.points.iter().map(|p| layout.to_page(p.screen)).collect(),
            uv: e.points.iter().map(|p| p.uv).collect(),
        };
        let unit_mm = 1.0 / layout.to_screen_length(1.0);
        let shapes = regions.regions.iter().map(|region| Shape {
            surface: region.surface,
            name: scene.surfaces.get(region.surface).map(|s| s.name.clone()).unwrap_or_default(),
            area_mm2: region.area() * unit_mm * unit_mm,
            loops: region.loops.iter().map(|l| l.edges.iter().map(edge).collect()).collect(),
        });
        let undecided =
            regions.undecided.iter().map(|u| Undecided { page: layout.to_page(u.at), surface: u.surface, why: u.why });
        Self { name: scene.name.clone(), page, shapes: shapes.collect(), undecided: undecided.collect() }
    }

    /// The line that says what they are: shapes, loops, area, and what is undecided.
    #[must_use]
    pub fn summary(&self) -> String {
        let loops: usize = self.shapes.iter().map(|s| s.loops.len()).sum();
        let area = self.shapes.iter().fold(0.0, |sum, shape| sum + shape.area_mm2);
        let undecided = match self.undecided.len() {
            0 => "none undecided".to_owned(),
            n => format!("{n} places undecided, listed in the .json"),
        };
        format!("regions: {} surfaces, {loops} loops, {area:.0} mm², {undecided}", self.shapes.len())
    }
}

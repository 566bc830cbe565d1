//! Shadows on the page.

use glam::DVec2;
use penvis_core::scene::Scene;

use super::{Shadow, Shadows};
use crate::fill::{Area, Loop};
use crate::page::Layout;

/// The shadows of a picture on its page.
#[derive(Clone, Debug, Default)]
pub struct ShadowShapes {
    /// The shapes of the surfaces that have any, in their order.
    pub shapes: Vec<ShadowShape>,
    /// Places at which the border of what is visible or of what is lit is not known.
    pub undecided: Vec<UndecidedShadow>,
}

/// What of one surface is visible and in shadow.
#[derive(Clone, Debug)]
pub struct ShadowShape {
    /// Index of the surface.
    pub surface: usize,
    /// Its name; that of an object of a scene goes before it.
    pub name: String,
    /// Area in mm².
    pub area_mm2: f64,
    /// Outer loops counter-clockwise (y up), holes clockwise.
    pub loops: Vec<ShadowLoop>,
}

/// A closed line; its last point is joined to the first.
#[derive(Clone, Debug)]
pub struct ShadowLoop {
    /// Points on the page in mm, y up, from the lower left corner.
    pub page: Vec<DVec2>,
    /// Parameters of the surface at the points.
    pub uv: Vec<DVec2>,
}

/// A place at which it is not known where a shadow ends.
#[derive(Clone, Debug)]
pub struct UndecidedShadow {
    /// On the page in mm, if it is known where that is.
    pub page: Option<DVec2>,
    /// The surface whose visible or lit part it borders, if that is known.
    pub surface: Option<usize>,
    /// Why.
    pub why: &'static str,
}

impl ShadowShapes {
    /// The shadows laid out.
    #[must_use]
    pub fn new(found: &Shadows, scene: &Scene, layout: &Layout) -> Self {
        let unit_mm = 1.0 / layout.to_screen_length(1.0);
        let shape = |shadow: &Shadow| {
            let loops: Vec<ShadowLoop> = shadow
                .loops
                .iter()
                .map(|own| ShadowLoop {
                    page: own.iter().map(|p| layout.to_page(p.screen)).collect(),
                    uv: own.iter().map(|p| p.uv).collect(),
                })
                .collect();
            ShadowShape {
                surface: shadow.surface,
                name: scene.surfaces.get(shadow.surface).map(|s| s.name.clone()).unwrap_or_default(),
                area_mm2: shadow.area() * unit_mm * unit_mm,
                loops,
            }
        };
        let undecided = found.undecided.iter().map(|u| UndecidedShadow {
            page: u.at.map(|at| layout.to_page(at)),
            surface: u.surface,
            why: u.why,
        });
        Self { shapes: found.shadows.iter().map(shape).collect(), undecided: undecided.collect() }
    }

    /// The shapes as areas of fills.
    #[must_use]
    pub fn areas(&self) -> Vec<Area> {
        let border = |own: &ShadowLoop| Loop::bordered(own.page.clone());
        let area = |s: &ShadowShape| Area { surface: s.surface, loops: s.loops.iter().map(border).collect() };
        self.shapes.iter().map(area).collect()
    }

    /// The line that says what they are: surfaces and area.
    #[must_use]
    pub fn summary(&self) -> String {
        let area = self.shapes.iter().fold(0.0, |sum, shape| sum + shape.area_mm2);
        format!("shadows: {} surfaces, {area:.0} mm²", self.shapes.len())
    }
}

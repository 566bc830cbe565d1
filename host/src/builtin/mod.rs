//! Models that come with the program, by name.
//!
//! All are exact: data of record (the teapot), or formulas. Surfaces that meet have the same boundary curve, but for
//! rounding in its evaluation (under 4·10⁻¹⁵ of the model's size), so that stitching finds every seam and crease.
//! Positive sides point out of solids. Lengths have no unit.

mod chess;
mod fields;
mod missile;
mod solids;
mod spring;
mod teapot;
mod teapot_data;
mod turned;
mod vase;

use glam::DVec4;
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::scene::{Scene, SceneSurface};

pub(crate) use self::solids::SIDES_OF_A_BOX;
use crate::model::View;

/// A built-in model.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Its surfaces.
    pub scene: Scene,
    /// Where it is seen from unless the user says otherwise.
    pub view: View,
}

struct Entry {
    name: &'static str,
    description: &'static str,
    /// `None` would mean that a constructor refused the formula's own numbers; the tests load every entry.
    build: fn() -> Option<Vec<SceneSurface>>,
    view: fn() -> View,
}

const MODELS: &[Entry] = &[
    Entry {
        name: "teapot",
        description: "the Utah teapot: 32 bicubic Bézier patches (Newell 1975)",
        build: teapot::surfaces,
        view: teapot::view,
    },
    Entry {
        name: "pawn",
        description: "a chess pawn, five surfaces of revolution",
        build: turned::pawn,
        view: turned::pawn_view,
    },
    Entry {
        name: "queen",
        description: "a chess queen, eight surfaces of revolution",
        build: chess::queen,
        view: chess::queen_view,
    },
    Entry {
        name: "rook",
        description: "a chess rook, eight surfaces of revolution",
        build: chess::rook,
        view: chess::rook_view,
    },
    Entry {
        name: "knight",
        description: "a chess knight: head, mane and ears of free form on a turned foot",
        build: chess::knight,
        view: chess::knight_view,
    },
    Entry {
        name: "goblet",
        description: "a goblet, five surfaces of revolution",
        build: turned::goblet,
        view: turned::goblet_view,
    },
    Entry {
        name: "vase",
        description: "a vase of surfaces of revolution with two swept handles, after Ruan, Zhang and Yong 2006",
        build: vase::surfaces,
        view: vase::view,
    },
    Entry {
        name: "missile",
        description: "a missile with a nozzle, four wings and four tail fins, after Ruan, Zhang and Yong 2006",
        build: missile::surfaces,
        view: missile::view,
    },
    Entry {
        name: "saddle",
        description: "the hyperbolic paraboloid z = x² − y² as one bicubic patch",
        build: fields::saddle,
        view: fields::saddle_view,
    },
    Entry {
        name: "wiggle",
        description: "crossing waves as one bicubic B-spline height field",
        build: fields::wiggle,
        view: fields::wiggle_view,
    },
    Entry {
        name: "discont",
        description: "two wings in one surface, with a break of the tangent plane between them",
        build: fields::discont,
        view: fields::discont_view,
    },
    Entry {
        name: "spring",
        description: "a coil spring of 96 rational Bézier patches, after Ruan, Zhang and Yong 2006",
        build: spring::surfaces,
        view: spring::view,
    },
    Entry { name: "sphere", description: "the unit sphere", build: solids::sphere, view: solids::sphere_view },
    Entry { name: "torus", description: "a torus of radii 3 and 1", build: solids::torus, view: solids::upright_view },
    Entry {
        name: "linked_tori",
        description: "two tori, each through the hole of the other",
        build: solids::linked_tori,
        view: solids::linked_tori_view,
    },
    Entry { name: "cylinder", description: "a closed cylinder", build: solids::cylinder, view: solids::upright_view },
    Entry { name: "cone", description: "a closed cone", build: solids::cone, view: solids::upright_view },
    Entry {
        name: "box",
        description: "a box of six rectangles along the axes",
        build: solids::cuboid,
        view: solids::cuboid_view,
    },
];

/// Name and one-line description of every built-in model.
pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
    MODELS.iter().map(|entry| (entry.name, entry.description))
}

/// The model of that name, in any case; `None` if there is none.
#[must_use]
pub fn load(name: &str) -> Option<Model> {
    let entry = MODELS.iter().find(|entry| entry.name.eq_ignore_ascii_case(name))?;
    let surfaces = (entry.build)()?;
    Some(Model { scene: Scene { name: entry.name.to_owned(), surfaces }, view: (entry.view)() })
}

fn part(name: impl Into<String>, surface: Surface) -> SceneSurface {
    SceneSurface::new(name, surface)
}

/// One Bézier patch on the unit square. `net[iu][iv]` are points (x, y, z, w), not multiplied by w.
fn bezier<const NU: usize, const NV: usize>(net: [[DVec4; NV]; NU]) -> Option<Surface> {
    let [ku, kv] = [NU, NV].map(|count| KnotVector::bezier(count - 1, [0.0, 1.0]));
    Surface::new(ku.ok()?, kv.ok()?, net.into_iter().flatten().collect()).ok()
}

#[cfg(test)]
mod tests;

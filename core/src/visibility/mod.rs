//! Quantitative invisibility: how many sheets of surface lie strictly in front of a point.
//!
//! After the camera all sight lines are parallel to z, so the question is a point query on the screen with a depth.
//! [`Occluders`] cuts the patches into cells, each proven to be met at most once by any sight line, and puts them into
//! a bounding hierarchy; [`Occluders::query`] walks it. Most cells are answered by an affine enclosure of the root alone,
//! without solving for it (in the spirit of lemma 5.1 of Elber and Cohen 1989, *Hidden curve removal for free form
//! surfaces*); the rest by Newton's method under a certificate, and near folds by further subdivision.
//!
//! A piece of a curve has one quantitative invisibility. It is asked for by rays, or carried over from pieces that it is
//! linked to; see [`Method`].
//!
//! Where the sides of one edge are apart, or overlap, a sight line meets what it would if they were one; see [`Cracks`].
//!
//! What a point lies on is excluded by identity, surface and parameters, never by an offset in depth.

mod certainty;
mod classify;
mod coverage;
mod crack;
mod halo;
mod hierarchy;
mod leaf;
mod links;
mod nets;
mod pole;
mod propagate;
mod ray;

pub use certainty::Certainty;
pub use classify::{
    ClassifyOptions, Doubt, Method, Outermost, Sighting, Subject, Surroundings, VisibilityStats, classify, classify_one,
};
pub use crack::Cracks;
pub use halo::halo;
pub use hierarchy::Occluders;
pub(crate) use links::fold_lies_left;
pub use ray::{Exclusion, Hit, RayAnswer, RayScratch, RayStats, Unclear};

#[cfg(test)]
mod tests;

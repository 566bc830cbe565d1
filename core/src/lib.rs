//! Exact hidden-curve removal for free-form surfaces.
//!
//! The crate turns a [`Scene`](scene::Scene) of rational B-spline surfaces and a [`Camera`](view::Camera) into the
//! visible strokes of a line drawing, without replacing the surfaces by polygons. The modules are the stages, in the
//! order in which data passes through them; none knows anything of a later one.
//!
//! | module | gives |
//! |---|---|
//! | [`bernstein`] | polynomials in Bernstein form: arithmetic, bounds, roots, zero sets |
//! | [`stop`] | a way to stop a long computation |
//! | [`nurbs`] | checked knot vectors, curves and surfaces |
//! | [`shape`] | exact planes, quadrics, tori, ruled surfaces, extrusions, solids of revolution |
//! | [`trim`] | which part of a surface there is |
//! | [`pull_back`] | parameter curves of space curves on surfaces |
//! | [`scene`] | the surfaces of a model |
//! | [`view`] | camera, and homogeneous Bézier patches with the eye at z = +∞ |
//! | [`mod@line`], [`trim_line`] | lines of constant u or v, and along trim curves |
//! | [`extent`] | how far the scene reaches |
//! | [`stitch`] | which boundaries coincide: free edges, creases, smooth seams |
//! | [`extract`] | boundary, crease, silhouette and isoparametric curves |
//! | [`arrange`] | the curves split where their visibility can change |
//! | [`visibility`] | quantitative invisibility of every piece |
//! | [`stroke`] | visible pieces flattened and chained |
//! | [`visible`] | instead of strokes: the visible part of every surface as a region |
//! | [`probe`] | places of surfaces behind points of the screen, and their tone |
//! | [`render`] | instead of strokes: the surfaces painted into a z-buffer |
//!
//! [`pipeline`] runs them in order:
//!
//! ```
//! use glam::DVec3;
//! use penvis_core::{pipeline, scene, shape, view};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let torus = shape::torus(&shape::Frame::WORLD, 3.0, 1.0)?;
//! let surfaces = vec![scene::SceneSurface::new("torus", torus)];
//! let scene = scene::Scene { name: "ring".into(), surfaces };
//! let camera = view::Camera::orthographic(DVec3::new(1.0, -2.0, 1.0), DVec3::Z)?;
//! let prepared = pipeline::Prepared::new(&scene, &camera, &pipeline::DrawOptions::default(), &())?;
//! let strokes = prepared.trace(0.001, &())?.strokes;
//! assert!(strokes.iter().all(|s| s.qi == 0 && s.points.len() >= 2));
//! # Ok(())
//! # }
//! ```
//!
//! `no_std` with `alloc`. Feature `std` adds convenience, `parallel` spreads work over cores; neither changes a bit of
//! the result.
#![no_std]

extern crate alloc;
#[cfg(feature = "std")]
extern crate std;

pub mod arrange;
pub mod bernstein;
mod disjoint;
pub mod extent;
pub mod extract;
mod grid;
pub mod line;
pub mod nurbs;
pub mod pipeline;
pub mod probe;
pub mod pull_back;
pub mod render;
pub mod scene;
pub mod shape;
pub mod stitch;
pub mod stop;
pub mod stroke;
pub mod trim;
pub mod trim_line;
pub mod view;
pub mod visibility;
pub mod visible;

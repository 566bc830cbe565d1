//! The whole scene in view space.

use alloc::string::String;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::{Camera, Jet, Patch};
use crate::nurbs::{KnotVector, Surface};
use crate::scene::{Facet, Scene};
use crate::trim::{BorderEdge, Trims};

/// Why a scene cannot be seen from a camera.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// Part of a surface is at or behind the eye plane, where perspective has no image.
    #[error("surface {index} ({name}) reaches the eye plane; move the eye back or use a parallel projection")]
    BehindEye {
        /// Index of the surface.
        index: usize,
        /// Its name.
        name: String,
    },
    /// A control point leaves the range of finite numbers.
    #[error("surface {index} ({name}) has control points too large to be projected; scale the model down")]
    Overflow {
        /// Index of the surface.
        index: usize,
        /// Its name.
        name: String,
    },
    /// There is nothing to draw.
    #[error("the model has no surfaces")]
    Empty,
}

/// Where the patches of one surface are.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceGrid {
    /// Index of the first patch; the others follow, v fastest.
    pub first: usize,
    /// Distinct knots in u, ends of the domain included.
    pub u_breaks: Vec<f64>,
    /// Distinct knots in v, ends of the domain included.
    pub v_breaks: Vec<f64>,
    /// Interior knots in u where the surface is merely continuous, so that its normal may jump.
    pub u_corners: Vec<f64>,
    /// Interior knots in v where the surface is merely continuous.
    pub v_corners: Vec<f64>,
}

impl SurfaceGrid {
    /// Patch columns in u.
    #[must_use]
    pub fn count_u(&self) -> usize {
        self.u_breaks.len() - 1
    }

    /// Patch rows in v.
    #[must_use]
    pub fn count_v(&self) -> usize {
        self.v_breaks.len() - 1
    }

    /// Index of the patch in column `i`, row `j`.
    #[must_use]
    pub fn patch(&self, i: usize, j: usize) -> usize {
        self.first + i * self.count_v() + j
    }
}

/// The scene as homogeneous Bézier patches seen along −z, and the same patches in model space for angles.
#[derive(Clone, Debug)]
pub struct ViewScene {
    camera: Camera,
    patches: Vec<Patch>,
    model: Vec<Patch>,
    surfaces: Vec<SurfaceGrid>,
    trims: Vec<Option<Trims>>,
    borders: Vec<[Vec<BorderEdge>; 4]>,
    facets: Vec<Option<Facet>>,
    lo: DVec3,
    hi: DVec3,
}

impl ViewScene {
    /// Decomposes every surface into Bézier patches and projects them. Cost: linear in the control points.
    ///
    /// # Errors
    /// If there is no surface, or one of them reaches the eye plane (any weight W ≤ 0 after projection).
    pub fn new(scene: &Scene, camera: &Camera) -> Result<Self, ViewError> {
        if scene.surfaces.is_empty() {
            return Err(ViewError::Empty);
        }
        let matrix = camera.matrix();
        let (mut patches, mut model, mut surfaces) = (Vec::new(), Vec::new(), Vec::new());
        let mut trims = Vec::with_capacity(scene.surfaces.len());
        let mut borders = Vec::with_capacity(scene.surfaces.len());
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (index, s) in scene.surfaces.iter().enumerate() {
            let surface = with_even_weights(&s.surface);
            let own = surface.bezier_patches(index);
            let (ku, kv) = (surface.knots_u(), surface.knots_v());
            borders.push(s.trims.as_ref().map_or_else(Default::default, Trims::border_edges));
            let cut = |t: &Trims| t.cut_at(&ku.breaks(), &kv.breaks());
            trims.push(s.trims.as_ref().filter(|t| !t.is_whole()).map(cut));
            surfaces.push(SurfaceGrid {
                first: patches.len(),
                u_breaks: ku.breaks(),
                v_breaks: kv.breaks(),
                u_corners: corners(ku),
                v_corners: corners(kv),
            });
            for m in own {
                let mut p = m.clone();
                for h in &mut p.points {
                    *h = matrix * *h;
                    if !h.is_finite() {
                        return Err(ViewError::Overflow { index, name: s.name.clone() });
                    }
                    if h.w <= 0.0 {
                        return Err(ViewError::BehindEye { index, name: s.name.clone() });
                    }
                    let e = h.truncate() / h.w;
                    lo = lo.min(e);
                    hi = hi.max(e);
                }
                patches.push(p);
                model.push(m);
            }
        }
        patches.shrink_to_fit();
        model.shrink_to_fit();
        let facets = scene.surfaces.iter().map(|s| s.facet).collect();
        Ok(Self { camera: *camera, patches, model, surfaces, trims, borders, facets, lo, hi })
    }

    /// Gives the patches in model space back, which nothing may ask for until [`recall_model`](Self::recall_model).
    pub(crate) fn forget_model(&mut self) {
        self.model = Vec::new();
    }

    /// Makes the patches in model space again, of the scene that they were of, the same to the bit. False if it is another one.
    pub(crate) fn recall_model(&mut self, scene: &Scene) -> bool {
        self.model.reserve_exact(self.patches.len());
        for (index, s) in scene.surfaces.iter().enumerate() {
            self.model.extend(with_even_weights(&s.surface).bezier_patches(index));
        }
        let alike = |(p, m): (&Patch, &Patch)| {
            let parts = |x: &Patch| (x.surface, x.degree_u, x.degree_v, x.points.len());
            parts(p) == parts(m) && p.u == m.u && p.v == m.v
        };
        self.model.len() == self.patches.len() && self.patches.iter().zip(&self.model).all(alike)
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// All patches in view space, surface by surface.
    #[must_use]
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// One patch, by its index in [`patches`](Self::patches), in model space.
    #[must_use]
    pub fn model_patch(&self, index: usize) -> &Patch {
        &self.model[index]
    }

    /// Patch layout of every surface.
    #[must_use]
    pub fn surfaces(&self) -> &[SurfaceGrid] {
        &self.surfaces
    }

    /// The trims of a surface, if they cut anything off; no piece of a trim curve leaves a patch.
    #[must_use]
    pub fn trims(&self, surface: usize) -> Option<&Trims> {
        self.trims[surface].as_ref()
    }

    /// The parts of a surface's borders u low, u high, v low and v high that are sides of shared edges, as its trims name
    /// them, in no order.
    #[must_use]
    pub fn border_edges(&self, surface: usize) -> &[Vec<BorderEdge>; 4] {
        &self.borders[surface]
    }

    /// What a surface stands for, if it is a facet of a mesh.
    #[must_use]
    pub fn facet(&self, surface: usize) -> Option<Facet> {
        self.facets[surface]
    }

    /// Largest angle between the tangent planes of two surfaces that meet smoothly, in radians: that of the facets if
    /// both are, else `angle`.
    #[must_use]
    pub fn smooth_angle(&self, surfaces: [usize; 2], angle: f64) -> f64 {
        match surfaces.map(|s| self.facets[s]) {
            [Some(a), Some(b)] => a.crease_angle.min(b.crease_angle),
            _ => angle,
        }
    }

    /// Diagonal of the control points' box in view space: the unit of every relative tolerance.
    #[must_use]
    pub fn size(&self) -> f64 {
        (self.hi - self.lo).length().max(f64::MIN_POSITIVE)
    }

    /// Farthest and nearest z of the control points, between which the whole scene lies.
    #[must_use]
    pub fn depth(&self) -> [f64; 2] {
        [self.lo.z, self.hi.z]
    }

    /// The patch that holds `uv` and the local place in it. On a knot line the patch is the upper one unless
    /// `below` asks for the lower one, per direction.
    #[must_use]
    pub fn locate(&self, surface: usize, uv: DVec2, below: [bool; 2]) -> (usize, DVec2) {
        let grid = &self.surfaces[surface];
        let i = span(&grid.u_breaks, uv.x, below[0]);
        let j = span(&grid.v_breaks, uv.y, below[1]);
        let patch = grid.patch(i, j);
        (patch, self.patches[patch].to_local(uv))
    }

    /// Position and derivatives in view space, by local parameters of the patch that holds `uv`.
    #[must_use]
    pub fn jet(&self, surface: usize, uv: DVec2, below: [bool; 2]) -> Jet {
        let (patch, l) = self.locate(surface, uv, below);
        self.patches[patch].jet(l.x, l.y)
    }

    /// Position and derivatives in model space, by local parameters of the patch that holds `uv`.
    #[must_use]
    pub fn model_jet(&self, surface: usize, uv: DVec2, below: [bool; 2]) -> Jet {
        let (patch, l) = self.locate(surface, uv, below);
        self.model[patch].jet(l.x, l.y)
    }

    /// Position on a surface in model space.
    #[must_use]
    pub fn model_point(&self, surface: usize, uv: DVec2) -> DVec3 {
        let (patch, l) = self.locate(surface, uv, [false; 2]);
        self.model[patch].eval(l.x, l.y)
    }
}

/// Largest ratio of weights along a patch. Products of three weights enter the facing polynomial, whose coefficients then
/// keep within 2¹⁸ of each other: what its rounding, relative to the largest, hides of the smallest is still nothing.
const WEIGHT_RATIO: f64 = 64.0;

/// Halvings of a span for the sake of its weights: a ratio of 10⁶ asks for seven.
const MAX_HALVINGS: usize = 32;

/// The same surface with knots inserted until the weights within each patch are of like size. A rational surface may be
/// parametrised as unevenly as it likes (its weights times 1, c, c², … run through the same points at another speed), and
/// one patch's numbers would then not be known to one precision.
fn with_even_weights(surface: &Surface) -> Surface {
    let mut even = surface.clone();
    for _ in 0..MAX_HALVINGS {
        let [u, v] = uneven_spans(&even);
        let mut refined = Ok(even.clone());
        for middle in &u {
            refined = refined.and_then(|s| s.insert_knot_u(*middle, 1));
        }
        for middle in &v {
            refined = refined.and_then(|s| s.insert_knot_v(*middle, 1));
        }
        match refined {
            Ok(refined) if !(u.is_empty() && v.is_empty()) => even = refined,
            // Even enough, or so narrow that there is no number between the ends of a span.
            _ => break,
        }
    }
    even
}

/// Middles of the spans in u and in v along which the weights of a patch differ too much.
fn uneven_spans(surface: &Surface) -> [Vec<f64>; 2] {
    let patches = surface.bezier_patches(0);
    let mut middles = [Vec::new(), Vec::new()];
    for patch in &patches {
        let w = patch.degree_v + 1;
        let uneven = |weights: &mut dyn Iterator<Item = f64>| {
            let (lo, hi) = weights.fold((f64::INFINITY, 0.0_f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
            hi > WEIGHT_RATIO * lo
        };
        if (0..w).any(|j| uneven(&mut patch.points.iter().skip(j).step_by(w).map(|h| h.w))) {
            middles[0].push(0.5 * (patch.u[0] + patch.u[1]));
        }
        if patch.points.chunks_exact(w).any(|row| uneven(&mut row.iter().map(|h| h.w))) {
            middles[1].push(0.5 * (patch.v[0] + patch.v[1]));
        }
    }
    middles.map(|mut m| {
        m.sort_by(f64::total_cmp);
        m.dedup();
        m
    })
}

/// Interior knots of full multiplicity.
fn corners(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let inner = &breaks[1..breaks.len() - 1];
    inner.iter().copied().filter(|&t| knots.multiplicity(t) >= knots.degree()).collect()
}

/// Index of the interval of `breaks` that holds `t`; outside ones are clamped.
fn span(breaks: &[f64], t: f64, below: bool) -> usize {
    let after = if below { breaks.partition_point(|&b| b < t) } else { breaks.partition_point(|&b| b <= t) };
    after.saturating_sub(1).min(breaks.len() - 2)
}

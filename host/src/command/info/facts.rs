//! What is known of a model before it is drawn.

use std::collections::BTreeMap;

use glam::DVec3;
use penvis_core::extent::extent;
use penvis_core::nurbs::Surface;
use penvis_core::scene::SceneSurface;
use penvis_core::stitch::{Edge, EdgeClass, SidePath, StitchOptions, Stitching};
use penvis_core::stop::{Stop, Stopped};
use penvis_core::view::{Camera, ViewScene};
use serde::Serialize;

use crate::model::view::ViewJson;
use crate::model::{Model, ModelFile, View, ViewChoice};

/// Corners of the box are found to this part of the size of the model: more digits than are shown.
const EXTENT_PRECISION: f64 = 1e-9;

/// What is known of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Facts {
    pub(super) name: String,
    pub(super) surfaces: usize,
    pub(super) patches: usize,
    pub(super) files: Vec<FileFacts>,
    /// Surfaces by degrees.
    pub(super) degrees: Vec<Degrees>,
    pub(super) trimmed: Trimmed,
    /// Surfaces that are facets of meshes.
    pub(super) facets: usize,
    /// Corners of the box of what there is of the surfaces; none if nothing is left of them.
    pub(super) extent: Option<Extent>,
    pub(super) edges: Option<Edges>,
    /// The view that it is drawn from if nothing else is asked for.
    pub(super) view: ViewJson,
    /// Whether that is the model's own.
    pub(super) view_is_own: bool,
    /// Successive surfaces of one name.
    pub(super) names: Vec<Named>,
    /// What is legal, and still not likely meant.
    pub(super) problems: Vec<String>,
}

/// What the reader of a file says of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FileFacts {
    pub(super) file: String,
    pub(super) format: &'static str,
    /// Index of the first surface that comes from it.
    pub(super) first_surface: usize,
    pub(super) surfaces: usize,
    /// The unit of lengths in the file; they are millimetres here. None if it does not say, and they are as they are.
    pub(super) unit: Option<String>,
    pub(super) kinds: BTreeMap<String, usize>,
    pub(super) healed: Vec<String>,
    pub(super) skipped: BTreeMap<String, usize>,
    pub(super) problems: Vec<String>,
}

/// Surfaces that have degrees in common.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Degrees {
    pub(super) degree_u: usize,
    pub(super) degree_v: usize,
    /// Whether weights differ.
    pub(super) rational: bool,
    pub(super) surfaces: usize,
    pub(super) patches: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Trimmed {
    pub(super) surfaces: usize,
    pub(super) loops: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Extent {
    pub(super) low: [f64; 3],
    pub(super) high: [f64; 3],
}

/// Where surfaces end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Edges {
    /// Edges that no other surface, and no other side of the same one, shares.
    pub(super) open: EdgeCount,
    /// Shared ones at an angle.
    pub(super) sharp: EdgeCount,
    /// Shared ones without an angle.
    pub(super) smooth: EdgeCount,
    /// The surfaces that have open ones.
    pub(super) open_surfaces: Vec<usize>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(super) struct EdgeCount {
    pub(super) count: usize,
    pub(super) length: f64,
}

/// Successive surfaces of one name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Named {
    pub(super) name: String,
    pub(super) first: usize,
    pub(super) last: usize,
}

impl Facts {
    /// Finds out. Cost: that of stitching.
    ///
    /// # Errors
    /// If it is stopped.
    pub(super) fn of(model: &Model, stop: Stop<'_>) -> Result<Self, Stopped> {
        let parts = &model.scene.surfaces;
        let mut problems = problems(parts);
        let (mut reach, mut edges) = (None, None);
        match seen(model) {
            Ok(view) => {
                let found = extent(&view, EXTENT_PRECISION * view.size(), stop)?;
                reach = found.map(|[low, high]| Extent { low: low.to_array(), high: high.to_array() });
                let stitching = Stitching::new(&view, &StitchOptions::of(&view), stop);
                stop.check()?;
                edges = Some(Edges::of(&view, &stitching));
            }
            Err(problem) => problems.push(problem),
        }
        let trims = parts.iter().filter_map(|part| part.trims.as_ref()).map(|trims| trims.loops().len());
        Ok(Self {
            name: model.scene.name.clone(),
            surfaces: parts.len(),
            patches: parts.iter().map(|part| patches(&part.surface)).sum(),
            files: model.files.iter().map(FileFacts::of).collect(),
            degrees: degrees(parts),
            trimmed: Trimmed { surfaces: trims.clone().count(), loops: trims.sum() },
            facets: parts.iter().filter(|part| part.facet.is_some()).count(),
            extent: reach,
            edges,
            view: model.aim.resolve(model.view, &model.scene).into(),
            view_is_own: model.view.is_some() || model.aim != ViewChoice::default(),
            names: names(parts),
            problems,
        })
    }
}

/// The model in a view that turns it and nothing else.
fn seen(model: &Model) -> Result<ViewScene, String> {
    let View { eye_direction, up, .. } = View::ISOMETRIC;
    let camera = Camera::orthographic(eye_direction, up).map_err(|error| error.to_string())?;
    ViewScene::new(&model.scene, &camera).map_err(|error| error.to_string())
}

impl FileFacts {
    fn of(file: &ModelFile) -> Self {
        let report = file.report.clone();
        Self {
            file: file.file.clone(),
            format: file.format,
            first_surface: file.surfaces.start,
            surfaces: file.surfaces.len(),
            unit: report.unit,
            kinds: report.kinds,
            healed: report.healed,
            skipped: report.skipped,
            problems: report.problems,
        }
    }
}

fn patches(s: &Surface) -> usize {
    (s.knots_u().breaks().len() - 1) * (s.knots_v().breaks().len() - 1)
}

fn is_rational(surface: &Surface) -> bool {
    let weights = || surface.homogeneous().iter().map(|h| h.w);
    weights().any(|w| Some(w) != weights().next())
}

fn degrees(parts: &[SceneSurface]) -> Vec<Degrees> {
    let mut sorts: BTreeMap<(usize, usize, bool), (usize, usize)> = BTreeMap::new();
    for SceneSurface { surface, .. } in parts {
        let sort = (surface.degree_u(), surface.degree_v(), is_rational(surface));
        let (members, pieces) = sorts.entry(sort).or_default();
        (*members, *pieces) = (*members + 1, *pieces + patches(surface));
    }
    let degrees = |((degree_u, degree_v, rational), (surfaces, patches))| Degrees {
        degree_u,
        degree_v,
        rational,
        surfaces,
        patches,
    };
    sorts.into_iter().map(degrees).collect()
}

fn names(parts: &[SceneSurface]) -> Vec<Named> {
    let mut names: Vec<Named> = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        match names.last_mut() {
            Some(last) if last.name == part.name && last.last + 1 == index => last.last = index,
            // One that is made from the index says nothing more.
            _ if part.name == format!("surface {index}") => {}
            _ => names.push(Named { name: part.name.clone(), first: index, last: index }),
        }
    }
    names
}

impl Edges {
    fn of(view: &ViewScene, stitching: &Stitching) -> Self {
        let [mut open, mut sharp, mut smooth] = [EdgeCount::default(); 3];
        let mut open_surfaces = Vec::new();
        for edge in stitching.edges.iter().filter(|edge| edge.owner()) {
            let path = &stitching.sides[edge.side].path;
            let counted = match edge.class {
                EdgeClass::Boundary => {
                    open_surfaces.push(path.surface());
                    &mut open
                }
                EdgeClass::Crease => &mut sharp,
                EdgeClass::Smooth => &mut smooth,
            };
            counted.count += 1;
            counted.length += length(view, path, edge);
        }
        open_surfaces.sort_unstable();
        open_surfaces.dedup();
        Self { open, sharp, smooth, open_surfaces }
    }
}

/// Places of Gauss's rule of five points in the interval from -1 to 1, and their weights, by sign of the place.
const GAUSS: [(f64, f64); 5] = [
    (0.0, 128.0 / 225.0),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Parts of a polynomial piece over which its speed is integrated. The error of the rule falls with the tenth power of them:
/// a quarter of a circle has more digits than are shown.
const PARTS: u32 = 4;

/// Length of an edge. The view turns the model, and lengths stay.
fn length(view: &ViewScene, path: &SidePath, edge: &Edge) -> f64 {
    let [from, to] = edge.t;
    let mut cuts = vec![from];
    cuts.extend(path.breaks().into_iter().filter(|&t| t > from && t < to));
    cuts.push(to);
    let mut sum = 0.0;
    for ends in cuts.windows(2) {
        let half = 0.5 * (ends[1] - ends[0]) / f64::from(PARTS);
        for k in 0..PARTS {
            let middle = ends[0] + half * f64::from(2 * k + 1);
            sum +=
                GAUSS.iter().map(|&(at, weight)| weight * path.jet(view, middle + at * half).1.length()).sum::<f64>()
                    * half;
        }
    }
    sum
}

/// What is legal, and still not likely meant.
fn problems(parts: &[SceneSurface]) -> Vec<String> {
    let mut found = Vec::new();
    let mut seen: BTreeMap<Vec<u64>, Vec<usize>> = BTreeMap::new();
    for (index, SceneSurface { surface, trims, .. }) in parts.iter().enumerate() {
        let points = surface.homogeneous().iter().map(|h| h.truncate() / h.w);
        let (low, high) =
            points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if low == high {
            found.push(format!("surface {index} is the single point {}; remove it", super::triple(low)));
        }
        // Bits, because numbers have no total order; two zeros that differ in sign are not worth a rule.
        let bits = |x: &f64| x.to_bits();
        let mut key: Vec<u64> = surface.homogeneous().iter().flat_map(|h| h.to_array()).map(|x| bits(&x)).collect();
        key.extend(surface.knots_u().as_slice().iter().chain(surface.knots_v().as_slice()).map(bits));
        let alike = seen.entry(key).or_default();
        match alike.iter().find(|&&first| parts[first].trims == *trims) {
            Some(first) => found.push(format!("surface {index} is the same as surface {first}; remove one of them")),
            None => alike.push(index),
        }
    }
    found
}

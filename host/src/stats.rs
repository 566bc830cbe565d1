//! What a run counted and how long it took: the stats JSON.

use std::time::Duration;

use penvis_core::extract::UndecidedPart;
use penvis_core::pipeline::{self, Stage};
use penvis_core::visibility;
use serde::Serialize;

use crate::device::Device;
use crate::drawing::Drawing;
use crate::estimate::{Estimate, LayerEstimate};

/// Counts and times of one run, as `--stats` writes them.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// The model.
    pub model: ModelStats,
    /// Time of each stage in s.
    pub seconds: Seconds,
    /// Extraction of silhouettes.
    pub silhouette: SilhouetteStats,
    /// Extraction of sections.
    pub section: SectionStats,
    /// Adaptive isocurves.
    pub isocurves: IsocurveStats,
    /// Splitting.
    pub arrange: ArrangeStats,
    /// Visibility.
    pub visibility: VisibilityStats,
    /// What the pen draws.
    pub strokes: StrokeStats,
    /// Time that the plotter will take, in s.
    pub estimate_s: f64,
    /// What each layer takes.
    pub layers: Vec<LayerEstimate>,
    /// Largest memory of the process in bytes; `null` where the system does not tell.
    pub peak_bytes: Option<u64>,
}

/// Size of the model.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ModelStats {
    /// Surfaces.
    pub surfaces: u64,
    /// Bézier patches.
    pub patches: u64,
    /// Trim loops of all surfaces.
    pub trims: u64,
}

/// Time of each stage in s.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading models.
    pub read: f64,
    /// Projection.
    pub view: f64,
    /// Coincident boundaries.
    pub stitch: f64,
    /// Curves.
    pub extract: f64,
    /// Splitting.
    pub arrange: f64,
    /// Visibility.
    pub visibility: f64,
    /// Flattening and chaining.
    pub stroke: f64,
    /// Painting and shading, instead of the last three.
    #[serde(skip)]
    pub render: f64,
    /// Laying out and ordering.
    pub page: f64,
    /// Making the files.
    pub emit: f64,
    /// From the start to the last file.
    pub total: f64,
}

impl Seconds {
    /// Adds to a stage of the core.
    pub fn add(&mut self, stage: Stage, time: Duration) {
        let seconds = match stage {
            Stage::View => &mut self.view,
            Stage::Stitch => &mut self.stitch,
            Stage::Extract => &mut self.extract,
            Stage::Arrange => &mut self.arrange,
            Stage::Visibility => &mut self.visibility,
            Stage::Stroke => &mut self.stroke,
            Stage::Render => &mut self.render,
        };
        *seconds += time.as_secs_f64();
    }
}

/// Extraction of silhouettes.
#[derive(Clone, Debug, Serialize)]
pub struct SilhouetteStats {
    /// Cells of the subdivision.
    pub cells: u64,
    /// Deepest of them.
    pub depth_max: u64,
    /// Connected silhouettes of the scene, over patches and surfaces.
    pub components: u64,
    /// Closed ones among them.
    pub loops: u64,
    /// Cusps.
    pub cusps: u64,
    /// Places where two silhouettes cross on the surface.
    pub crossings: u64,
    /// Secant steps of a walk to the silhouette, on average; 0 without walks.
    pub secant_mean: f64,
    /// Secant steps of the longest walk.
    pub secant_max: u64,
    /// Places where the topology is undecided.
    pub undecided: u64,
    /// Those places.
    pub undecided_places: Vec<UndecidedPlace>,
}

/// Extraction of sections, the curves in which surfaces intersect.
#[derive(Clone, Debug, Serialize)]
pub struct SectionStats {
    /// Places where it is not known how two surfaces intersect.
    pub undecided_places: Vec<UndecidedPlace>,
}

/// A part of a surface in which it is not known how a silhouette or a section runs.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct UndecidedPlace {
    /// Index of the surface in the model.
    pub surface: usize,
    /// Range of the surface's parameter u.
    pub u: [f64; 2],
    /// Range of the surface's parameter v.
    pub v: [f64; 2],
    /// The middle of the part, in model space.
    pub at: [f64; 3],
    /// Diagonal of the part's box, model units.
    pub size: f64,
}

/// Adaptive isocurves.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct IsocurveStats {
    /// Isocurves, hidden parts included, with the two at the ends of each surface.
    pub curves: u64,
    /// Distances of pairs of them that were formed.
    pub distances: u64,
    /// Strips between two of them that were held against the ruled surface.
    pub ruled_tests: u64,
}

/// Splitting.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ArrangeStats {
    /// Curves.
    pub curves: u64,
    /// Pairs of strips that are near each other.
    pub pairs_near: u64,
    /// Subdivisions.
    pub subdivisions: u64,
    /// Newton steps.
    pub newton: u64,
    /// Crossings on the screen.
    pub crossings: u64,
    /// Coincident intervals.
    pub overlaps: u64,
    /// Pieces of curves.
    pub pieces: u64,
}

/// Visibility.
#[derive(Clone, Debug, Serialize)]
pub struct VisibilityStats {
    /// Rays to silhouettes and boundaries.
    pub rays_active: u64,
    /// Rays to other curves.
    pub rays_passive: u64,
    /// Pieces that took over their neighbour's visibility.
    pub propagated: u64,
    /// Pieces along which rays disagreed, and links between pieces that did.
    pub disagreements: u64,
    /// Parts of curves whose visibility is proven.
    pub proven: u64,
    /// A place of each part whose visibility rests on a tolerance, and on which.
    pub tolerance: Vec<Doubt>,
    /// Places that are not decided.
    pub undecided: Vec<Doubt>,
}

impl VisibilityStats {
    /// The line that says how visibility was decided.
    #[must_use]
    pub fn summary(&self) -> String {
        let undecided = match self.undecided.len() {
            0 => "none undecided".to_owned(),
            n => format!("{n} undecided"),
        };
        let rays = self.rays_active + self.rays_passive;
        let carried = if self.propagated > 0 { format!(", {} carried over", self.propagated) } else { String::new() };
        format!(
            "visibility: {} parts of curves proven, {} by tolerance, {undecided} ({rays} rays{carried})",
            self.proven,
            self.tolerance.len()
        )
    }
}

/// A place whose visibility rests on a tolerance or is not decided.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Doubt {
    /// The place in model space.
    pub at: [f64; 3],
    /// Why.
    pub why: &'static str,
}

/// What the pen draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StrokeStats {
    /// Polylines.
    pub count: u64,
    /// Length with the pen down in mm.
    pub ink_mm: f64,
    /// Length with the pen up in mm: from the page's lower left corner through all strokes and back.
    pub travel_mm: f64,
    /// Times that the pen is raised; strokes that meet are drawn without.
    pub lifts: u64,
    /// Vertices.
    pub points: u64,
}

impl Stats {
    /// Gathers the counts of the core and of a drawing, with the time that `device` will take for it.
    #[must_use]
    pub fn new(core: &pipeline::Stats, seconds: Seconds, drawing: &Drawing, device: &Device) -> Self {
        let (silhouette, arrange, visibility) = (&core.silhouette, &core.arrange, &core.visibility);
        let estimate = Estimate::new(drawing, device);
        let strokes = StrokeStats {
            count: drawing.polylines.len() as u64,
            // The sum of no numbers would be −0.
            ink_mm: estimate.layers.iter().fold(0.0, |sum, layer| sum + layer.ink_mm),
            travel_mm: estimate.travel_mm(),
            lifts: estimate.layers.iter().map(|layer| layer.lifts).sum(),
            points: drawing.polylines.iter().map(|p| p.page.len() as u64).sum(),
        };
        let place = |part: &UndecidedPart| UndecidedPlace {
            surface: part.surface,
            u: part.u,
            v: part.v,
            at: part.at.into(),
            size: part.size,
        };
        let doubts = |places: &[visibility::Doubt]| -> Vec<Doubt> {
            places.iter().map(|place| Doubt { at: place.at.into(), why: place.why }).collect()
        };
        Self {
            model: ModelStats { surfaces: core.surfaces, patches: core.patches, trims: core.trims },
            seconds,
            silhouette: SilhouetteStats {
                cells: silhouette.cells as u64,
                depth_max: silhouette.depth_max.into(),
                components: core.chains.components as u64,
                loops: core.chains.loops as u64,
                cusps: core.chains.cusps as u64,
                crossings: silhouette.crossings as u64,
                secant_mean: silhouette.steps as f64 / silhouette.walks.max(1) as f64,
                secant_max: silhouette.steps_max as u64,
                undecided: core.silhouette_undecided.len() as u64,
                undecided_places: core.silhouette_undecided.iter().map(place).collect(),
            },
            section: SectionStats { undecided_places: core.section_undecided.iter().map(place).collect() },
            isocurves: IsocurveStats {
                curves: core.adaptive.curves,
                distances: core.adaptive.distances,
                ruled_tests: core.adaptive.ruled_tests,
            },
            arrange: ArrangeStats {
                curves: arrange.curves,
                pairs_near: arrange.pairs_near,
                subdivisions: arrange.subdivisions,
                newton: arrange.newton,
                crossings: arrange.crossings,
                overlaps: arrange.overlaps,
                pieces: arrange.pieces,
            },
            visibility: VisibilityStats {
                rays_active: visibility.rays_active,
                rays_passive: visibility.rays_passive,
                propagated: visibility.propagated,
                disagreements: visibility.disagreements,
                proven: visibility.decided[0],
                tolerance: doubts(&visibility.tolerated),
                undecided: doubts(&visibility.undecided),
            },
            strokes,
            estimate_s: estimate.seconds(),
            layers: estimate.layers,
            peak_bytes: peak_bytes(),
        }
    }

    /// How many places are not decided.
    #[must_use]
    pub fn undecided(&self) -> u64 {
        let places = self.section.undecided_places.len() + self.visibility.undecided.len();
        self.silhouette.undecided + places as u64
    }

    /// A line of warning for each stage that left places undecided, with the first few of them.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let places = |places: &[UndecidedPlace]| {
            places.iter().map(|p| (p.at, format!("surface {}, {} wide", p.surface, short(p.size)))).collect::<Vec<_>>()
        };
        let silhouettes = places(&self.silhouette.undecided_places);
        let sections = places(&self.section.undecided_places);
        let sights = self.visibility.undecided.iter().map(|p| (p.at, p.why.to_owned()));
        [
            ("the course of silhouettes", silhouettes),
            ("the intersection of surfaces", sections),
            ("visibility", sights.collect()),
        ]
        .into_iter()
        .filter(|(_, places)| !places.is_empty())
        .map(|(what, places)| warning(what, &places))
        .collect()
    }

    /// The stats JSON.
    ///
    /// # Errors
    /// None that the numbers could cause; what the serializer says is handed on.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// What is undecided at places, and what is known of the first of them.
pub(crate) fn warning<const N: usize>(what: &str, places: &[([f64; N], String)]) -> String {
    const SHOWN: usize = 3;
    let place = |(at, about): &([f64; N], String)| format!("({}) ({about})", at.map(short).join(", "));
    let shown: Vec<_> = places.iter().take(SHOWN).map(place).collect();
    let count = match places.len() {
        1 => "1 place".to_owned(),
        n => format!("{n} places"),
    };
    let rest = if places.len() > SHOWN { ", …" } else { "" };
    format!("{what} is undecided at {count}: {}{rest}", shown.join(", "))
}

/// A number to four significant digits, without an exponent where it is of everyday size.
fn short(x: f64) -> String {
    let digits = format!("{x:.3e}");
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) { digits.parse::<f64>().unwrap_or(x).to_string() } else { digits }
}

/// Largest resident memory of this process in bytes, where the system tells it in /proc.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use penvis_core::stroke::CurveKind::{Boundary, Iso};

    use super::*;
    use crate::device::find;
    use crate::emit::tests::{drawing, polyline};

    fn two_squares_and_a_line() -> Drawing {
        let lines = vec![
            polyline(Boundary, 1, &[[3.0, 4.0], [13.0, 4.0], [13.0, 14.0]]),
            polyline(Iso, 1, &[[13.0, 14.0001], [13.0, 24.0]]),
            polyline(Iso, 1, &[[3.0, 24.0], [3.0, 4.0]]),
        ];
        drawing(297.0, 210.0, lines)
    }

    #[test]
    fn warnings_tell_silhouettes_from_visibility_and_show_the_first_places() {
        let device = find("penvis").unwrap();
        let mut core = pipeline::Stats::default();
        let stats = |core: &pipeline::Stats| Stats::new(core, Seconds::default(), &two_squares_and_a_line(), &device);
        assert!(stats(&core).warnings().is_empty());
        let at = DVec3::new(1.0, -0.25, 1e-7);
        let part = UndecidedPart { surface: 7, u: [0.0, 0.5], v: [0.25, 1.0], at, size: 3e-9, screen_size: 2e-9 };
        core.silhouette_undecided = vec![part; 5];
        core.visibility.undecided = vec![visibility::Doubt { at: DVec3::ZERO, why: "a reason" }];
        let stats = stats(&core);
        let place = "(1, -0.25, 1.000e-7) (surface 7, 3.000e-9 wide)";
        let first = format!("the course of silhouettes is undecided at 5 places: {place}, {place}, {place}, …");
        assert_eq!(stats.warnings(), [first, "visibility is undecided at 1 place: (0, 0, 0) (a reason)".to_owned()]);
        assert_eq!((stats.undecided(), stats.silhouette.undecided), (6, 5));
        let json: serde_json::Value = serde_json::from_str(&stats.json().unwrap()).unwrap();
        let listed = &json["silhouette"]["undecided_places"][4];
        let expected = r#"{"surface":7,"u":[0.0,0.5],"v":[0.25,1.0],"at":[1.0,-0.25,1e-7],"size":3e-9}"#;
        assert_eq!(*listed, serde_json::from_str::<serde_json::Value>(expected).unwrap());
    }

    #[test]
    fn an_empty_drawing_has_no_ink_and_not_minus_none() {
        let empty = drawing(297.0, 210.0, Vec::new());
        let stats = Stats::new(&pipeline::Stats::default(), Seconds::default(), &empty, &find("penvis").unwrap());
        assert!(crate::compute::summary("none", &stats).starts_with("none: 0 strokes, 0 mm of ink, 0 mm of travel"));
    }

    #[test]
    fn the_fields_are_those_of_the_format() {
        let stats = Stats::new(
            &pipeline::Stats::default(),
            Seconds::default(),
            &two_squares_and_a_line(),
            &find("penvis").unwrap(),
        );
        let json: serde_json::Value = serde_json::from_str(&stats.json().unwrap()).unwrap();
        let keys = |at: &str| {
            let mut keys: Vec<_> = json.pointer(at).unwrap().as_object().unwrap().keys().cloned().collect();
            keys.sort();
            keys.join(" ")
        };
        assert_eq!(
            keys(""),
            "arrange estimate_s isocurves layers model peak_bytes seconds section silhouette strokes visibility"
        );
        assert_eq!(keys("/model"), "patches surfaces trims");
        assert_eq!(keys("/seconds"), "arrange emit extract page read stitch stroke total view visibility");
        assert_eq!(
            keys("/silhouette"),
            "cells components crossings cusps depth_max loops secant_max secant_mean undecided undecided_places"
        );
        assert_eq!(keys("/isocurves"), "curves distances ruled_tests");
        assert_eq!(keys("/arrange"), "crossings curves newton overlaps pairs_near pieces subdivisions");
        assert_eq!(keys("/visibility"), "disagreements propagated proven rays_active rays_passive tolerance undecided");
        assert_eq!(keys("/strokes"), "count ink_mm lifts points travel_mm");
    }
}

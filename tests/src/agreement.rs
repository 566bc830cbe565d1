//! The pipeline's visibility held against the oracle's.

use glam::DVec3;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_core::stroke::CurveKind;
use penvis_core::visibility::Sighting;

use crate::oracle::{Doubt, Oracle, Place, Site, Verdict};
use penvis::model::View;

/// Where along a part of a curve it is looked at, as fractions of its parameter. Its ends are transitions.
const LOOKS: [f64; 3] = [0.19, 0.53, 0.84];

/// A place where pipeline and oracle see different numbers of sheets.
#[derive(Clone, Debug)]
pub struct Disagreement {
    /// Kind of the curve.
    pub kind: CurveKind,
    /// Index of the curve.
    pub curve: usize,
    /// Parameter on the curve.
    pub t: f64,
    /// Interval of the curve's parameter that the pipeline holds for equally visible.
    pub part: [f64; 2],
    /// Surface of the curve.
    pub surface: usize,
    /// The place in model space.
    pub at: DVec3,
    /// Sheets in front according to the pipeline.
    pub pipeline: u32,
    /// Sheets in front according to the oracle.
    pub oracle: u32,
}

/// Outcome of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    /// Places judged alike.
    pub agreed: usize,
    /// Places that the oracle did not judge, by [`Doubt`]: transition, contact, own sheet.
    pub doubts: [usize; 3],
    /// Places judged differently.
    pub disagreements: Vec<Disagreement>,
    /// Length in space of the curves for which the judged places stand.
    pub judged_length: f64,
    /// Length of the curves that was looked at.
    pub length: f64,
}

impl Agreement {
    /// Part of the curves' length that the oracle did not judge.
    #[must_use]
    pub fn ambiguous(&self) -> f64 {
        if self.length > 0.0 { 1.0 - self.judged_length / self.length } else { 0.0 }
    }
}

/// Prepares the scene, and compares what the pipeline sees with what an oracle of the same scene sees; see [`against`].
///
/// # Panics
/// If the scene cannot be seen from the view.
#[must_use]
pub fn compare(scene: &Scene, view: &View, options: &DrawOptions) -> Agreement {
    let camera = view.camera().expect("the view is legal");
    let prepared = Prepared::new(scene, &camera, options, &()).expect("the scene is in front of the eye");
    against(&prepared, &Oracle::new(scene, view), options.deepest > 0)
}

/// Looks at every part of every inked curve, as the pipeline splits and sees them, and asks the oracle for the same
/// places. `exact` compares the numbers of sheets, which the pipeline must have been asked for; else only hidden is told
/// from visible.
#[must_use]
pub fn against(prepared: &Prepared, oracle: &Oracle, exact: bool) -> Agreement {
    let (sightings, _) = prepared.sightings(&()).expect("nothing stops it");
    let g = prepared.geometry();
    let mut out = Agreement::default();
    for s in &sightings {
        let curve = &prepared.curves()[s.curve];
        let at = |f: f64| s.t[0] + f * (s.t[1] - s.t[0]);
        let ways = [0.0, LOOKS[0], LOOKS[1], LOOKS[2], 1.0].map(|f| curve.model_point(&g, at(f)));
        let length: f64 = ways.windows(2).map(|w| w[0].distance(w[1])).sum();
        out.length += length;
        for f in LOOKS {
            let t = at(f);
            let (point, uv) = (curve.model_point(&g, t), curve.uv(&g, t));
            let seen = match oracle.judge(&Place { point, surface: curve.surface, uv, site: site(curve.kind) }) {
                Verdict::Visible => 0,
                Verdict::Hidden(n) => n,
                Verdict::Ambiguous(doubt) => {
                    let slot = match doubt {
                        Doubt::Transition => 0,
                        Doubt::Contact => 1,
                        Doubt::OwnSheet => 2,
                    };
                    out.doubts[slot] += 1;
                    continue;
                }
            };
            out.judged_length += length / LOOKS.len() as f64;
            let agree = if exact { seen == s.qi } else { (seen == 0) == (s.qi == 0) };
            if agree {
                out.agreed += 1;
            } else {
                out.disagreements.push(Disagreement {
                    kind: curve.kind,
                    curve: s.curve,
                    t,
                    part: s.t,
                    surface: curve.surface,
                    at: point,
                    pipeline: s.qi,
                    oracle: seen,
                });
            }
        }
    }
    out
}

/// The visible parts of curves, by curve and interval of its parameter, neighbours made one: what of a picture does not
/// depend on how it was decided.
#[must_use]
pub fn visible_parts(sightings: &[Sighting]) -> Vec<(usize, [f64; 2])> {
    let mut parts: Vec<(usize, [f64; 2])> = Vec::new();
    for s in sightings.iter().filter(|s| s.qi == 0) {
        match parts.last_mut() {
            Some((curve, t)) if *curve == s.curve && t[1] == s.t[0] => t[1] = s.t[1],
            _ => parts.push((s.curve, s.t)),
        }
    }
    parts
}

/// What the points of a curve are to the oracle.
#[must_use]
pub fn site(kind: CurveKind) -> Site {
    match kind {
        CurveKind::Silhouette => Site::Silhouette,
        CurveKind::Crease => Site::Crease,
        _ => Site::Sheet,
    }
}

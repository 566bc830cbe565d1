//! Isocurves besides those of a drawing: what surfaces are filled with.

use alloc::vec;
use alloc::vec::Vec;

use super::{Monitor, Prepared, Stage};
use crate::extract::SurfaceCurve;
use crate::extract::adaptive::{AdaptiveOptions, adaptive_curves, cover};
use crate::stitch::STITCH;
use crate::stop::{Stop, Stopped};
use crate::stroke::{Stroke, chain, flatten};

/// Surfaces that are covered with isocurves in the same way.
#[derive(Clone, Debug, PartialEq)]
pub struct IsoSet {
    /// Indices of the surfaces, increasing.
    pub surfaces: Vec<usize>,
    /// What their isocurves are like; of one level.
    pub options: AdaptiveOptions,
}

impl Prepared {
    /// Whether a surface is a facet of a mesh, which has no adaptive isocurves.
    #[must_use]
    pub fn is_facet(&self, surface: usize) -> bool {
        self.view.facet(surface).is_some()
    }

    /// The visible parts of adaptive isocurves of some surfaces, set by set, whatever else of them is wanted on paper: strokes with chords within
    /// `tolerance` (screen units). What is coincident is there once, in the first set that has it. The facets of meshes have none.
    ///
    /// Cost: that of [`trace`](Self::trace) for the isocurves, and of splitting for the curves that decide where they are seen.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn isocurves(
        &self,
        sets: &[IsoSet],
        tolerance: f64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Vec<Stroke>>, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        monitor.begin(Stage::Extract);
        let (g, size) = (self.geometry(), self.view.size());
        let hides = |curve: &&SurfaceCurve| curve.active;
        let mut curves: Vec<SurfaceCurve> = self.curves.iter().filter(hides).cloned().collect();
        for curve in &mut curves {
            curve.inked = false;
        }
        for (number, set) in (0..).zip(sets) {
            let wanted = |s: usize| set.surfaces.binary_search(&s).is_ok() && !self.is_facet(s);
            let found = cover(&g, &self.stitching, &wanted, &self.styles, &set.options, stop);
            stop.check()?;
            curves.extend(adaptive_curves(&g, &found).into_iter().map(|curve| SurfaceCurve { level: number, ..curve }));
        }
        let mut sightings = self.seen_instead(&curves, monitor, |_, sightings, _| sightings)?;
        monitor.begin(Stage::Stroke);
        sightings.retain(|s| s.qi == 0);
        let strokes = flatten(&g, &curves, &sightings, tolerance, stop);
        stop.check()?;
        let gap = 2.0 * STITCH * size;
        let mut by_set = vec![Vec::new(); sets.len()];
        for stroke in chain(strokes, gap, gap) {
            if let Some(own) = by_set.get_mut(stroke.level as usize) {
                own.push(Stroke { level: 0, ..stroke });
            }
        }
        stop.check()?;
        Ok(by_set)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::{DrawOptions, FIT};
    use super::*;
    use crate::arrange::Arcs;
    use crate::extract::CurveKind;
    use crate::extract::adaptive::{Direction, Spacing};
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, sphere, torus};
    use crate::view::Camera;

    fn set(surfaces: &[usize], spacing: f64) -> IsoSet {
        let options = AdaptiveOptions {
            spacing,
            measured: Spacing::Screen,
            direction: Direction::Auto,
            tone: None,
            levels: 1,
            shortest: spacing / 4.0,
        };
        IsoSet { surfaces: surfaces.to_vec(), options }
    }

    #[test]
    fn each_set_has_its_spacing_and_the_drawing_stays_as_it_is() {
        let ball = sphere(&Frame::WORLD, 0.9).unwrap();
        let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let surfaces = vec![SceneSurface::new("ball", ball), SceneSurface::new("ring", ring)];
        let scene = Scene { name: "planet".into(), surfaces };
        let camera = Camera::orthographic(DVec3::new(0.2, -1.0, 0.6), DVec3::Z).unwrap();
        let prepared = Prepared::new(&scene, &camera, &DrawOptions { isos: 0, ..DrawOptions::default() }, &()).unwrap();
        let before = prepared.trace(1e-3, &()).unwrap().strokes;
        let found = prepared.isocurves(&[set(&[0], 0.1), set(&[1], 0.5)], 1e-3, &()).unwrap();
        assert_eq!(found.len(), 2);
        for (own, surface) in found.iter().zip([0, 1]) {
            assert!(own.iter().all(|s| s.surface == surface && s.kind == CurveKind::Iso && s.qi == 0 && s.level == 0));
        }
        let length = |strokes: &[Stroke]| -> f64 {
            let chords = strokes.iter().flat_map(|s| s.points.windows(2));
            chords.map(|w| w[0].screen.distance(w[1].screen)).sum()
        };
        // The ball's disk, of which the ring hides a part, by lines between half the spacing and all of it apart.
        let disk = core::f64::consts::PI * 0.81;
        assert!((0.3 * disk / 0.1..2.2 * disk / 0.1).contains(&length(&found[0])), "{}", length(&found[0]));
        let coarse = prepared.isocurves(&[set(&[0], 0.2)], 1e-3, &()).unwrap();
        assert!(length(&coarse[0]) < 0.7 * length(&found[0]));
        // As the same curves are seen when they are a part of the drawing.
        let options = DrawOptions { isos: 1, ..DrawOptions::default() };
        let mut other = Prepared::new(&scene, &camera, &options, &()).unwrap();
        other.curves.retain(|c| c.kind != CurveKind::Iso);
        other.arcs = Arcs::new(&other.curves, &other.geometry(), FIT * other.view.size(), true, Stop::NEVER);
        other.cover(&set(&[], 0.3).options, &()).unwrap();
        let drawn = other.trace(1e-3, &()).unwrap().strokes;
        let drawn: Vec<Stroke> = drawn.into_iter().filter(|s| s.kind == CurveKind::Iso).collect();
        let both = prepared.isocurves(&[set(&[0, 1], 0.3)], 1e-3, &()).unwrap();
        assert!((length(&both[0]) - length(&drawn)).abs() < 1e-9 * length(&drawn));
        assert_eq!(prepared.trace(1e-3, &()).unwrap().strokes, before);
    }
}

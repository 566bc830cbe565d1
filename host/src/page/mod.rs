//! From the screen to the paper: scale, place, dash and order the strokes.
//!
//! [`lay_out`] puts the strokes of a picture on the paper, [`PenPath`] orders what is there for the pen.

mod clip;
mod dash;
mod ink;
mod join;
mod layout;
mod merge;
mod order;
mod overlap;
mod path;
mod placing;
mod sheet;
mod walk;

pub use clip::{Window, clip};
pub use dash::{DashPattern, dash};
pub use ink::{Ink, Inks, KindPens};
pub use join::join;
pub use layout::{Layout, LayoutError};
pub use merge::merge;
pub use order::{Effort, Measure, Rest, Visit, order, route};
pub use overlap::draw_once;
pub use path::{Joining, PathChoice, PenPath, Shares};
pub use placing::{Placing, Position, Size, length_mm, position, scale};
pub use sheet::{Orientation, SheetError, default_margin_mm, sheet};

use glam::DVec2;
use penvis_core::stroke::{CurveKind, Stroke};

use crate::drawing::{Page, Polyline};

/// Farthest that anything is from the origin in mm: what is farther, or no number, is no place on paper.
const FARTHEST_MM: f64 = 1e6;

/// Whether all vertices are places on paper.
fn is_on_paper(page: &[DVec2]) -> bool {
    page.iter().all(|p| p.abs().cmplt(DVec2::splat(FARTHEST_MM)).all())
}

/// Layer of everything that is hidden.
pub const HIDDEN_LAYER: &str = "hidden";

/// What becomes of strokes that have something in front of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Hidden {
    /// Left out.
    #[default]
    Omit,
    /// Drawn in dashes with the same pen.
    Dashed(DashPattern),
    /// Drawn in full, as a layer of its own and with the pen after the last one of what is visible.
    Layer,
}

/// How hidden strokes are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Depths {
    /// Not at all: one layer, one dash pattern.
    #[default]
    Together,
    /// By the number n of sheets in front: a layer `hidden-n` with the n-th pen after the last one of what is visible, or
    /// dashes a fraction 1/n as long.
    Apart,
}

/// Puts strokes on the paper, dashes or drops the hidden ones, and cuts off what lies outside the layout's window. Isocurves of `levels` levels are on a
/// layer `iso-k` for each, from 1, the coarsest.
///
/// The layer is the name of the kind, `iso-k`, `hidden`, or `hidden-n`. Cost: linear in the vertices.
#[must_use]
pub fn lay_out(strokes: &[Stroke], layout: &Layout, inks: &Inks, depths: Depths, levels: u32) -> Vec<Polyline> {
    let mut polylines = Vec::with_capacity(strokes.len());
    for stroke in strokes.iter().filter(|stroke| stroke.points.len() >= 2) {
        let visible = stroke.qi == 0;
        let Ink { hidden, .. } = inks.of(stroke.style);
        if visible {
            let name = stroke.kind.name();
            let (level, layer) = if stroke.kind == CurveKind::Iso && levels > 1 {
                let level = stroke.level + 1;
                (level, format!("{name}-{level}"))
            } else {
                (0, name.to_owned())
            };
            let pen = inks.visible(stroke.style, stroke.kind, &layer);
            polylines.push(Polyline { level, ..polyline(stroke, layout, &layer, pen) });
            continue;
        }
        let (layer, depth) = match depths {
            Depths::Together => (HIDDEN_LAYER.to_owned(), 1),
            Depths::Apart => (format!("{HIDDEN_LAYER}-{}", stroke.qi), stroke.qi),
        };
        let own = inks.hidden(stroke.style, &layer);
        match hidden {
            Hidden::Omit => {}
            Hidden::Dashed(pattern) => {
                let pattern = DashPattern { dash_mm: pattern.dash_mm / f64::from(depth), ..pattern };
                let pen = own.unwrap_or_else(|| inks.visible(stroke.style, stroke.kind, stroke.kind.name()));
                dash(&polyline(stroke, layout, &layer, pen), pattern, &mut polylines);
            }
            Hidden::Layer => {
                let pen = own.unwrap_or_else(|| inks.last_pen().saturating_add(depth));
                polylines.push(polyline(stroke, layout, &layer, pen));
            }
        }
    }
    if let Some(window) = layout.window() {
        let whole = std::mem::take(&mut polylines);
        whole.into_iter().for_each(|polyline| clip(polyline, window, &mut polylines));
    }
    polylines
}

fn polyline(stroke: &Stroke, layout: &Layout, layer: &str, pen: u32) -> Polyline {
    Polyline {
        kind: Some(stroke.kind),
        surface: stroke.surface,
        layer: layer.to_owned(),
        pen,
        level: 0,
        visible: stroke.qi == 0,
        qi: stroke.qi,
        certainty: stroke.certainty,
        points: stroke.points.iter().map(|p| p.model).collect(),
        page: stroke.points.iter().map(|p| layout.to_page(p.screen)).collect(),
    }
}

/// The upright rectangle inside the margins.
#[must_use]
fn inside(page: Page, margin_mm: f64) -> glam::DVec2 {
    glam::DVec2::new(page.width_mm, page.height_mm) - 2.0 * margin_mm
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};
    use penvis_core::stroke::{Certainty, StrokePoint};

    use super::*;

    fn stroke(kind: CurveKind, qi: u32, ends: [[f64; 2]; 2]) -> Stroke {
        let point = |p: [f64; 2]| StrokePoint { screen: p.into(), model: DVec3::new(p[0], p[1], 7.0) };
        Stroke {
            kind,
            surface: 3,
            style: 3,
            level: 0,
            qi,
            certainty: Certainty::Proven,
            points: ends.map(point).to_vec(),
        }
    }

    #[test]
    fn levels_are_layers_in_order_after_the_outlines() {
        let page = Page { width_mm: 120.0, height_mm: 120.0 };
        let layout = Layout::fit([DVec2::ZERO, DVec2::ONE], page, 10.0).unwrap();
        let strokes = [2, 0, 1, 0].iter().enumerate().map(|(k, &level)| {
            let x = 0.2 * k as f64 + 0.1;
            Stroke { level, ..stroke(CurveKind::Iso, 0, [[x, 0.1], [x, 0.9]]) }
        });
        let mut strokes: Vec<Stroke> = strokes.collect();
        strokes.push(stroke(CurveKind::Boundary, 0, [[1.0, 1.0], [0.9, 1.0]]));
        let found = lay_out(&strokes, &layout, &Inks::default(), Depths::Together, 3);
        let path = PenPath { hatched_mm: Some(0.3), ..PenPath::default() };
        let found = path.through(found, &|| false);
        let layers: Vec<_> = found.iter().map(|p| p.layer.as_str()).collect();
        assert_eq!(layers, ["boundary", "iso-1", "iso-1", "iso-2", "iso-3"]);
    }

    #[test]
    fn hidden_strokes_are_dropped_dashed_or_put_on_a_layer() {
        let page = Page { width_mm: 120.0, height_mm: 120.0 };
        let layout = Layout::fit([DVec2::ZERO, DVec2::ONE], page, 10.0).unwrap();
        let strokes = [
            stroke(CurveKind::Boundary, 0, [[0.0, 0.0], [1.0, 0.0]]),
            stroke(CurveKind::Iso, 2, [[0.0, 1.0], [1.0, 1.0]]),
        ];
        let omitted = lay_out(&strokes, &layout, &Inks::default(), Depths::Together, 1);
        assert_eq!(omitted.len(), 1);
        assert_eq!(omitted[0].page, [DVec2::new(10.0, 10.0), DVec2::new(110.0, 10.0)]);
        assert_eq!((omitted[0].layer.as_str(), omitted[0].pen, omitted[0].surface), ("boundary", 1, 3));

        let layered = lay_out(&strokes, &layout, &Inks::hiding(Hidden::Layer), Depths::Together, 1);
        assert_eq!(layered.len(), 2);
        assert_eq!((layered[1].layer.as_str(), layered[1].pen, layered[1].visible), ("hidden", 2, false));

        let apart = lay_out(&strokes, &layout, &Inks::hiding(Hidden::Layer), Depths::Apart, 1);
        assert_eq!((apart[1].layer.as_str(), apart[1].pen), ("hidden-2", 3));

        let dashed =
            lay_out(&strokes, &layout, &Inks::hiding(Hidden::Dashed(DashPattern::default())), Depths::Together, 1);
        let hidden: Vec<_> = dashed.iter().filter(|p| !p.visible).collect();
        assert!(hidden.len() > 10 && hidden.iter().all(|p| p.qi == 2 && p.pen == 1 && p.layer == "hidden"));

        let finer = lay_out(&strokes, &layout, &Inks::hiding(Hidden::Dashed(DashPattern::default())), Depths::Apart, 1);
        let finer: Vec<_> = finer.iter().filter(|p| !p.visible).collect();
        assert!(finer.len() > hidden.len() && finer.iter().all(|p| p.pen == 1 && p.layer == "hidden-2"));
    }

    #[test]
    fn each_surface_has_its_own_pen_and_its_own_way_with_what_is_hidden() {
        let page = Page { width_mm: 120.0, height_mm: 120.0 };
        let layout = Layout::fit([DVec2::ZERO, DVec2::ONE], page, 10.0).unwrap();
        let of = |style: usize, qi: u32| Stroke { style, ..stroke(CurveKind::Boundary, qi, [[0.0, 0.0], [1.0, 0.0]]) };
        let strokes = [of(0, 0), of(0, 1), of(1, 0), of(1, 1), of(2, 0), of(2, 2)];
        let dashed = Hidden::Dashed(DashPattern::default());
        let inks = Inks::new(vec![Ink::new(4, Hidden::Layer), Ink::new(2, dashed), Ink::new(3, Hidden::Omit)]);
        let found = PenPath::default().through(lay_out(&strokes, &layout, &inks, Depths::Apart, 1), &|| false);
        let mut pens: Vec<(&str, u32)> = found.iter().map(|p| (p.layer.as_str(), p.pen)).collect();
        pens.dedup();
        // Pen by pen; the hidden layer is beyond all of them, and the dashes are the surface's own.
        assert_eq!(pens, [("boundary", 2), ("hidden-1", 2), ("boundary", 3), ("boundary", 4), ("hidden-1", 5)]);
    }
}

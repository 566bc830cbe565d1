//! One region of a surface less another one, as polygons in the surface's parameters.
//!
//! A region lies on the left of its border on the screen. Where the parameters turn there as the screen does it lies on the left in the
//! parameters too, and where the eye sees the other side of the surface it lies on the right. So in the parameters borders wind once round what is
//! seen of the one side, and once the other way round what is seen of the other. Each side is subtracted for itself: light on the far side of a
//! sheet does not light the near one.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::ContourDirection;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::overlay::{FloatOverlay, OverlayOptions};
use penvis_core::view::ViewScene;
use penvis_core::visible::{BorderPoint, VisibleRegion};

/// A closed line in the parameters, both from 0 to 1.
type Ring = Vec<[f64; 2]>;

/// The parts of `visible` that are not in `lit`, a region of the same surface on another screen, as loops with the inside on the left on the screen of
/// `view`. Parts are left out whose area there is no more than their border is long times `tolerance`.
///
/// Cost: O(n log n) in the corners of both and in their crossings.
pub(super) fn less(
    visible: &VisibleRegion,
    lit: Option<&VisibleRegion>,
    view: &ViewScene,
    tolerance: f64,
) -> Vec<Vec<BorderPoint>> {
    let surface = visible.surface;
    let grid = &view.surfaces()[surface];
    let ends = |breaks: &[f64]| [breaks.first(), breaks.last()].map(|b| b.copied().unwrap_or_default());
    let [[u0, u1], [v0, v1]] = [ends(&grid.u_breaks), ends(&grid.v_breaks)];
    let (low, size) = (DVec2::new(u0, v0), DVec2::new(u1 - u0, v1 - v0));
    let rings = |region: &VisibleRegion| -> Vec<Ring> { region.loops.iter().map(|own| ring(own, low, size)).collect() };
    let subject = rings(visible);
    let clip = lit.map(rings).unwrap_or_default();
    let at = |p: &[f64; 2]| {
        let uv = low + DVec2::from_array(*p) * size;
        BorderPoint { screen: view.jet(surface, uv, [false; 2]).p.truncate(), uv }
    };
    let mut loops = Vec::new();
    for rule in [FillRule::Positive, FillRule::Negative] {
        for shape in difference(&subject, &clip, rule) {
            let own: Vec<Vec<BorderPoint>> = shape.iter().map(|ring| ring.iter().map(at).collect()).collect();
            let (area, length) = (own.iter().map(|l| area(l)).sum::<f64>(), own.iter().map(|l| length(l)).sum::<f64>());
            if area.abs() > tolerance * length {
                loops.extend(own.into_iter().map(|mut own| {
                    if rule == FillRule::Negative {
                        own.reverse();
                    }
                    own
                }));
            }
        }
    }
    loops
}

/// The corners of a loop.
fn ring(own: &penvis_core::visible::VisibleLoop, low: DVec2, size: DVec2) -> Ring {
    let mut ring: Ring = own.points().map(|p| ((p.uv - low) / size).to_array()).collect();
    ring.dedup();
    ring
}

/// What is inside the subject by the rule and not inside the clip, as shapes of an outer ring, counter-clockwise, and its holes.
fn difference(subject: &Vec<Ring>, clip: &Vec<Ring>, rule: FillRule) -> Vec<Vec<Ring>> {
    let mut options: OverlayOptions<f64, i64> = OverlayOptions::default();
    options.output_direction = ContourDirection::CounterClockwise;
    // A straight line in the parameters is none on the screen: all of its corners are needed.
    options.preserve_input_collinear = true;
    options.preserve_output_collinear = true;
    options.clean_result = false;
    let mut overlay: FloatOverlay<[f64; 2], i64> =
        FloatOverlay::from_subj_and_clip_custom(subject, clip, options, Default::default());
    overlay.overlay(OverlayRule::Difference, rule)
}

/// The area inside on the screen, negative if it runs clockwise.
pub(super) fn area(own: &[BorderPoint]) -> f64 {
    let Some(origin) = own.first().map(|p| p.screen) else { return 0.0 };
    sides(own).map(|[a, b]| 0.5 * (a - origin).perp_dot(b - origin)).sum()
}

/// Length on the screen.
fn length(own: &[BorderPoint]) -> f64 {
    sides(own).map(|[a, b]| a.distance(b)).sum()
}

fn sides(own: &[BorderPoint]) -> impl Iterator<Item = [DVec2; 2]> {
    own.iter().zip(own.iter().cycle().skip(1)).map(|(a, b)| [a.screen, b.screen])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Ring {
        vec![[low, low], [high, low], [high, high], [low, high]]
    }

    fn turned(mut ring: Ring) -> Ring {
        ring.reverse();
        ring
    }

    fn area(shapes: &[Vec<Ring>]) -> f64 {
        let of = |ring: &Ring| -> f64 {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
        };
        shapes.iter().flatten().map(of).sum()
    }

    #[test]
    fn each_side_has_a_light_of_its_own() {
        let (whole, inner) = (square(0.0, 1.0), square(0.25, 0.75));
        let of =
            |subject: &Ring, clip: &Ring, rule| area(&difference(&vec![subject.clone()], &vec![clip.clone()], rule));
        assert_eq!(of(&whole, &inner, FillRule::Positive), 0.75);
        assert_eq!(of(&whole, &turned(inner.clone()), FillRule::Positive), 1.0);
        assert_eq!(of(&turned(whole.clone()), &turned(inner.clone()), FillRule::Negative), 0.75);
        assert_eq!(of(&turned(whole.clone()), &inner, FillRule::Negative), 1.0);
        assert_eq!(of(&whole, &inner, FillRule::Negative), 0.0);
        assert_eq!(of(&whole, &whole, FillRule::Positive), 0.0);
    }

    #[test]
    fn corners_in_straight_runs_stay() {
        let side: Vec<[f64; 2]> = (0..=16).map(|k| [f64::from(k) / 16.0, 0.0]).collect();
        let ring: Ring = side.iter().copied().chain([[1.0, 1.0], [0.0, 1.0]]).collect();
        let left = difference(&vec![ring], &vec![square(0.25, 0.5)], FillRule::Positive);
        let corners: Vec<[f64; 2]> = left.iter().flatten().flatten().copied().collect();
        assert!(side.iter().all(|p| corners.contains(p)), "{corners:?}");
    }
}

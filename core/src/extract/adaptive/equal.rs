//! Surfaces on which a tone asks for the same everywhere: a plane in one light. There as many equally spaced isocurves as
//! make the tone are more even than halving, which knows powers of two only.

use glam::DVec2;

use super::domain;
use super::tone::Shade;
use crate::extract::Geometry;
use crate::line::Axis;

/// Places in each direction at which a surface is looked at: in the middles of equal parts, and at the ends.
const PLACES: usize = 9;

/// Largest ratio of the densest place to the sparsest that counts as the same.
const RATIO: f64 = 1.1;

/// The number of equal strips, at least 1, into which isocurves have to divide a surface for its tone, `spacing` apart where
/// it is darkest; `None` if other places ask for other numbers.
pub(super) fn equal_strips(g: &Geometry<'_>, surface: usize, axis: Axis, shade: &Shade, spacing: f64) -> Option<u64> {
    let (s, t) = domain(g, surface, axis);
    let (mut least, mut most, mut sum) = (f64::INFINITY, 0.0_f64, 0.0);
    for k in 0..PLACES * PLACES {
        let [x, y] = [k / PLACES, k % PLACES].map(|i| i as f64 / (PLACES - 1) as f64);
        let (s, t) = (s[0] + (s[1] - s[0]) * x, t[0] + (t[1] - t[0]) * y);
        let uv = if axis == Axis::U { DVec2::new(s, t) } else { DVec2::new(t, s) };
        let wanted = gap(g, surface, axis, uv) * shade.darkness(g, surface, uv) / spacing;
        (least, most, sum) = (least.min(wanted), most.max(wanted), sum + wanted);
    }
    let mean = sum / (PLACES * PLACES) as f64 * (s[1] - s[0]);
    // A cast saturates, and makes 0 of what is not a number.
    (most <= RATIO * least).then(|| (libm::round(mean) as u64).max(1))
}

/// Distance on the screen across the isocurve through a place, for each unit of the parameter that is constant on it; nothing
/// where the isocurve has no direction.
fn gap(g: &Geometry<'_>, surface: usize, axis: Axis, uv: DVec2) -> f64 {
    let (index, local) = g.view.locate(surface, uv, [false; 2]);
    let patch = &g.view.patches()[index];
    let jet = patch.jet(local.x, local.y);
    let [du, dv] = [jet.du.truncate(), jet.dv.truncate()];
    let (across, along, width) = match axis {
        Axis::U => (du, dv, patch.u[1] - patch.u[0]),
        Axis::V => (dv, du, patch.v[1] - patch.v[0]),
    };
    across.perp_dot(along.normalize_or_zero()).abs() / width
}

//! Lines of a fill that run over several surfaces: where they are dark enough, and the places on the surfaces under their vertices.

use glam::DVec2;
use penvis_core::probe::{Place, Shading};
use penvis_core::visibility::RayScratch;
use rayon::prelude::*;

use super::along::Along;
use super::contour::Ring;
use super::cover::{Canvas, LOOK, Line, SHORTEST, SHORTEST_TONED};
use super::shaded::{Shade, between, united};
use super::tone::{darker, threshold};
use super::{Area, Fill};

/// The rings of a fill as lines, open where a tone ends them, or the border of a shadow if there is none. `areas` are those that it fills.
///
/// Cost: a sight line for each vertex, and with a tone one for each pitch of the lines.
pub(super) fn lines(
    rings: &[Ring],
    areas: &[&Area],
    fill: &Fill,
    shading: Option<&Shading<'_>>,
    canvas: &Canvas<'_>,
    stops: &(dyn Fn() -> bool + Sync),
) -> Vec<Line> {
    let is_one = |surface: usize| areas.binary_search_by_key(&surface, |area| area.surface).is_ok();
    let shortest = fill.pitch_mm * if shading.is_some() { SHORTEST_TONED } else { SHORTEST };
    let shade = canvas.shadows.map(|shadows| Shade::new(shadows, &is_one));
    let work = |scratch: &mut RayScratch, ring: &Ring| -> Vec<Line> {
        if stops() {
            return Vec::new();
        }
        let mut behind = |page: DVec2| canvas.probe.nearest(&is_one, canvas.layout.to_screen(page), scratch);
        let along = Along::new(&ring.page);
        let whole = [0.0, along.length_mm()];
        let dark = shade.as_ref().map_or_else(Vec::new, |shade| shade.parts(&ring.page, &along, canvas.tolerance_mm));
        let lit = match shading {
            Some(shading) => {
                let mut darkness = |mm: f64| {
                    let (surface, place) = behind(along.at(mm))?;
                    Some(shading.darkness(surface, place.uv))
                };
                let steps = [LOOK * fill.pitch_mm, canvas.tolerance_mm];
                let mut toned = |part| darker(part, threshold(ring.number), steps, &mut darkness);
                between(whole, &dark).into_iter().flat_map(&mut toned).collect()
            }
            // Out of shadows nothing is filled where these are all that is asked for.
            None if shade.is_some() => Vec::new(),
            None => vec![whole],
        };
        let parts = along.parts(&united([dark, lit].concat()));
        let long = parts.into_iter().filter(|page| Along::new(page).length_mm() >= shortest);
        long.filter_map(|page| line(page, fill.pen, canvas.tolerance_mm, &mut behind)).collect()
    };
    rings.par_iter().map_init(RayScratch::new, work).collect::<Vec<_>>().into_iter().flatten().collect()
}

/// A polyline with the places under its vertices: where a sight line meets nothing, as it may on a border, a place ever farther along the line. `None` if
/// nothing is met at all: it runs in a sliver no wider than the tolerance.
fn line(
    page: Vec<DVec2>,
    pen: u32,
    tolerance_mm: f64,
    behind: &mut dyn FnMut(DVec2) -> Option<(usize, Place)>,
) -> Option<Line> {
    let along = Along::new(&page);
    let whole = along.length_mm();
    let mut found = |vertex: usize| {
        let at = along.up_to(vertex);
        let mut by = 1e-3 * tolerance_mm;
        let mut place = behind(page[vertex]);
        while place.is_none() && by <= whole {
            place = [at + by, at - by].into_iter().find_map(|at| behind(along.at(at)));
            by *= 4.0;
        }
        place
    };
    let places: Vec<(usize, Place)> = (0..page.len()).map(&mut found).collect::<Option<_>>()?;
    let surface = places.first()?.0;
    let points = places.iter().map(|(_, place)| place.model).collect();
    Some(Line { surface, pen, page, points })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_vertex_on_a_border_has_the_place_beside_it_along_the_line() {
        let page: Vec<DVec2> = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]].map(DVec2::from).to_vec();
        // Two surfaces, and nothing just where they meet.
        let mut behind = |p: DVec2| {
            let place = Place { uv: p, model: DVec3::new(p.x, p.y, 5.0) };
            ((p.x - 1.0).abs() > 1e-4).then_some((usize::from(p.x > 1.0), place))
        };
        let line = line(page.clone(), 2, 0.01, &mut behind).unwrap();
        assert_eq!((line.surface, line.pen, &line.page), (0, 2, &page));
        assert!(line.points[1].distance(DVec3::new(1.0, 0.0, 5.0)) < 1e-3, "{:?}", line.points);
        assert!(super::line(page, 2, 0.01, &mut |_| None).is_none());
    }
}

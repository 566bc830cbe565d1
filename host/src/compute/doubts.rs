//! What is not known of regions that something drawn depends on.

use penvis_core::visible::VisibleRegions;

use crate::page::Layout;
use crate::settle::Settled;
use crate::shadow::{ShadowShapes, UndecidedShadow};
use crate::stats::warning;

/// The line that says where it is not known how far fills go, if that is so anywhere.
pub(super) fn of_fills(regions: &VisibleRegions, settled: &Settled, layout: &Layout) -> Option<String> {
    let is_filled = |surface: Option<usize>| surface.is_none_or(|s| settled.fills.get(s).is_some_and(Option::is_some));
    let places = regions.undecided.iter().filter(|u| is_filled(u.surface));
    let places: Vec<_> = places.map(|u| (layout.to_page(u.at).to_array(), about(u.surface, u.why))).collect();
    (!places.is_empty()).then(|| warning("the border of fills (mm on the page)", &places))
}

/// The lines that say where it is not known how far shadows go.
pub(super) fn of_shadows(shadows: &ShadowShapes) -> Vec<String> {
    let placed = |u: &UndecidedShadow| Some((u.page?.to_array(), about(u.surface, u.why)));
    let places: Vec<_> = shadows.undecided.iter().filter_map(placed).collect();
    let beyond = shadows.undecided.len() - places.len();
    let mut notes = Vec::new();
    if !places.is_empty() {
        notes.push(warning("the border of shadows (mm on the page)", &places));
    }
    if beyond > 0 {
        notes.push(format!(
            "undecided places of the border of shadows of which it is not known where they are seen: {beyond}"
        ));
    }
    notes
}

fn about(surface: Option<usize>, why: &str) -> String {
    surface.map_or_else(|| why.to_owned(), |surface| format!("surface {surface}: {why}"))
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn undecided_places_of_shadows_are_told_with_where_they_are() {
        let at = |page, surface| UndecidedShadow { page, surface, why: "so" };
        let undecided = vec![at(Some(DVec2::new(12.5, 3.0)), Some(4)), at(None, None), at(Some(DVec2::ONE), None)];
        let found = of_shadows(&ShadowShapes { shapes: Vec::new(), undecided });
        let first =
            "the border of shadows (mm on the page) is undecided at 2 places: (12.5, 3) (surface 4: so), (1, 1) (so)";
        let second = "undecided places of the border of shadows of which it is not known where they are seen: 1";
        assert_eq!(found, [first, second]);
        assert_eq!(of_shadows(&ShadowShapes::default()), [""; 0]);
    }
}

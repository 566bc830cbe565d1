//! Where a page lies in a plotter.

use glam::{DVec2, Vec2Swizzles};
use thiserror::Error;

use super::{Axes, Device, Language, Origin};
use crate::drawing::Page;
use crate::page::Window;

/// Slack in mm when a sheet is compared with a named size: paper is cut to half a millimetre, and inch sizes are rounded.
const SHEET_SLACK_MM: f64 = 0.5;

/// A page does not fit a plotter.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PlaceError {
    /// Larger than the reach.
    #[error(
        "the page of {width_mm} × {height_mm} mm is larger than the reach of `{device}`, {x_mm} × {y_mm} mm; choose a smaller --paper or another --device"
    )]
    TooLarge {
        /// Width of the page in mm.
        width_mm: f64,
        /// Height of the page in mm.
        height_mm: f64,
        /// The device.
        device: String,
        /// Its reach along x in mm.
        x_mm: f64,
        /// Its reach along y in mm.
        y_mm: f64,
    },
    /// Not one of its sheets.
    #[error("`{device}` has no sheet of {width_mm} × {height_mm} mm; its papers are {papers}; choose one with --paper")]
    NoSuchPaper {
        /// Width of the page in mm.
        width_mm: f64,
        /// Height of the page in mm.
        height_mm: f64,
        /// The device.
        device: String,
        /// Its papers.
        papers: String,
    },
}

/// The map from a page (mm, y up, origin at its lower left corner) to a plotter (mm, origin at the machine's zero, axes as its
/// controller counts them).
///
/// A page that only fits when it is turned is turned a quarter to the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Whether the page is turned.
    pub turned: bool,
    /// Height of the page in mm, which a turned page has along x.
    page_height_mm: f64,
    /// The machine's zero on the sheet as it lies, in mm from its lower left corner.
    pub origin_mm: DVec2,
    /// Smallest coordinates that the machine reaches, in its own mm.
    pub min_mm: DVec2,
    /// Largest coordinates that the machine reaches, in its own mm.
    pub max_mm: DVec2,
    /// How the controller's axes lie.
    axes: Axes,
}

impl Placement {
    /// A point of the page in the machine's mm.
    #[must_use]
    pub fn to_machine(&self, page: DVec2) -> DVec2 {
        let lying = if self.turned { DVec2::new(self.page_height_mm - page.y, page.x) } else { page };
        self.axes.apply(lying - self.origin_mm)
    }

    /// A point of the machine in mm of the page: the inverse of [`to_machine`](Self::to_machine) up to rounding.
    #[must_use]
    pub fn to_page(&self, machine: DVec2) -> DVec2 {
        let lying = self.axes.undo(machine) + self.origin_mm;
        if self.turned { DVec2::new(lying.y, self.page_height_mm - lying.x) } else { lying }
    }

    /// The part of the page's plane that the machine reaches, in mm of the page.
    #[must_use]
    pub fn reach(&self) -> Window {
        let (one, other) = (self.to_page(self.min_mm), self.to_page(self.max_mm));
        Window { low: one.min(other), high: one.max(other) }
    }

    /// Whether the machine reaches a point (of the page), up to `slack_mm`.
    #[must_use]
    pub fn reaches(&self, page: DVec2, slack_mm: f64) -> bool {
        let at = self.to_machine(page);
        at.cmpge(self.min_mm - slack_mm).all() && at.cmple(self.max_mm + slack_mm).all()
    }
}

impl Axes {
    /// From the operator's axes to the controller's.
    fn apply(self, at: DVec2) -> DVec2 {
        (if self.swap { at.yx() } else { at }) * self.signs()
    }

    /// From the controller's axes to the operator's.
    fn undo(self, at: DVec2) -> DVec2 {
        let at = at * self.signs();
        if self.swap { at.yx() } else { at }
    }

    fn signs(self) -> DVec2 {
        let sign = |inverted: bool| if inverted { -1.0 } else { 1.0 };
        DVec2::new(sign(self.invert_x), sign(self.invert_y))
    }
}

impl Device {
    /// The page of what tells none: all that the plotter reaches, or its first sheet.
    #[must_use]
    pub fn whole_page(&self) -> Page {
        let sheet = match self.language {
            Language::Hpgl(_) => self.papers.first().map(|paper| paper.size_mm),
            _ => None,
        };
        let [width_mm, height_mm] = sheet.or(self.travel_mm).unwrap_or_default();
        Page { width_mm, height_mm }
    }

    /// How a page lies in this plotter: upright when it fits so, else turned a quarter to the left.
    ///
    /// # Errors
    /// [`PlaceError`] when it fits neither way.
    pub fn place(&self, page: Page) -> Result<Placement, PlaceError> {
        let upright = DVec2::new(page.width_mm, page.height_mm);
        match &self.language {
            Language::Grbl(_) | Language::Marlin(_) => self.place_anywhere(upright),
            Language::Hpgl(hpgl) => self.place_on_paper(upright, hpgl.unit_mm),
        }
    }

    fn place_anywhere(&self, page: DVec2) -> Result<Placement, PlaceError> {
        let reach = self.travel_mm.map_or(DVec2::INFINITY, DVec2::from);
        for (turned, lying) in [(false, page), (true, page.yx())] {
            // Written so that a size which is not a number fits nowhere.
            if lying.cmple(reach + SHEET_SLACK_MM).all() {
                let origin_mm = lying
                    * match self.origin {
                        Origin::LowerLeft => DVec2::ZERO,
                        Origin::UpperLeft => DVec2::Y,
                        Origin::LowerRight => DVec2::X,
                        Origin::UpperRight => DVec2::ONE,
                    };
                let axes = self.axes;
                let (one, other) = (axes.apply(-origin_mm), axes.apply(lying - origin_mm));
                let (min_mm, max_mm) = (one.min(other), one.max(other));
                return Ok(Placement { turned, page_height_mm: page.y, origin_mm, min_mm, max_mm, axes });
            }
        }
        Err(PlaceError::TooLarge {
            width_mm: page.x,
            height_mm: page.y,
            device: self.name.clone(),
            x_mm: reach.x,
            y_mm: reach.y,
        })
    }

    fn place_on_paper(&self, page: DVec2, unit_mm: f64) -> Result<Placement, PlaceError> {
        for (turned, lying) in [(false, page), (true, page.yx())] {
            for paper in &self.papers {
                if (lying - DVec2::from(paper.size_mm)).abs().max_element() <= SHEET_SLACK_MM {
                    let corner = |end: usize| DVec2::new(f64::from(paper.x_range[end]), f64::from(paper.y_range[end]));
                    return Ok(Placement {
                        turned,
                        page_height_mm: page.y,
                        origin_mm: DVec2::from(paper.origin_mm),
                        min_mm: corner(0) * unit_mm,
                        max_mm: corner(1) * unit_mm,
                        axes: Axes::default(),
                    });
                }
            }
        }
        let papers: Vec<_> =
            self.papers.iter().map(|p| format!("{} ({} × {} mm)", p.name, p.size_mm[0], p.size_mm[1])).collect();
        Err(PlaceError::NoSuchPaper {
            width_mm: page.x,
            height_mm: page.y,
            device: self.name.clone(),
            papers: papers.join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::find;
    use super::*;

    const A4: Page = Page { width_mm: 297.0, height_mm: 210.0 };
    const A4_PORTRAIT: Page = Page { width_mm: 210.0, height_mm: 297.0 };

    #[test]
    fn to_page_undoes_to_machine() {
        for name in super::super::names() {
            for page in [A4, A4_PORTRAIT] {
                let place = find(name).unwrap().place(page).unwrap();
                for point in [DVec2::ZERO, DVec2::new(12.5, 200.0)] {
                    assert!((place.to_page(place.to_machine(point)) - point).length() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_portrait_page_is_turned_to_the_left_on_an_hp() {
        let place = find("hp7475a").unwrap().place(A4_PORTRAIT).unwrap();
        assert!(place.turned);
        // The page's lower left corner comes to the sheet's lower right one.
        assert_eq!(place.to_machine(DVec2::ZERO) + place.origin_mm, DVec2::new(297.0, 0.0));
        assert_eq!(place.to_machine(DVec2::new(210.0, 297.0)) + place.origin_mm, DVec2::new(0.0, 210.0));
    }

    #[test]
    fn corners_of_origin() {
        let mut device = find("grbl-servo").unwrap();
        device.travel_mm = Some([297.0, 210.0]);
        for (origin, at) in [
            (Origin::LowerLeft, [0.0, 0.0]),
            (Origin::UpperLeft, [0.0, -210.0]),
            (Origin::LowerRight, [-297.0, 0.0]),
            (Origin::UpperRight, [-297.0, -210.0]),
        ] {
            device.origin = origin;
            let place = device.place(A4).unwrap();
            assert_eq!(place.to_machine(DVec2::ZERO), DVec2::from(at));
            assert!(place.reaches(DVec2::new(297.0, 210.0), 0.0) && !place.reaches(DVec2::new(297.0, 210.1), 0.0));
        }
    }

    #[test]
    fn axes_are_swapped_and_then_inverted() {
        let axes = |swap, invert_x, invert_y| Axes { swap, invert_x, invert_y };
        for (axes, at) in [
            (axes(false, false, false), [297.0, 100.0]),
            (axes(true, false, false), [100.0, 297.0]),
            (axes(true, true, false), [-100.0, 297.0]),
            (axes(false, false, true), [297.0, -100.0]),
        ] {
            let mut device = find("grbl-servo").unwrap();
            device.axes = axes;
            let place = device.place(A4).unwrap();
            let point = DVec2::new(297.0, 100.0);
            assert_eq!(place.to_machine(point), DVec2::from(at), "{axes:?}");
            assert_eq!(place.to_page(place.to_machine(point)), point);
            assert!(place.reaches(point, 0.0) && !place.reaches(DVec2::new(-1.0, 0.0), 0.0));
        }
    }

    #[test]
    fn pages_that_do_not_fit_are_refused() {
        let odd = Page { width_mm: 100.0, height_mm: 100.0 };
        let huge = Page { width_mm: 1000.0, height_mm: 100.0 };
        let nan = Page { width_mm: f64::NAN, height_mm: 100.0 };
        assert!(find("hp7475a").unwrap().place(odd).unwrap_err().to_string().contains("a4 (297 × 210 mm)"));
        assert!(find("grbl-servo").unwrap().place(huge).unwrap_err().to_string().contains("1000 × 100 mm"));
        assert!(find("grbl-servo").unwrap().place(nan).is_err());
        assert!(find("hp7475a").unwrap().place(nan).is_err());
    }
}

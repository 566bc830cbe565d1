//! The pens: what their ink looks like, and how they are moved.

use std::collections::BTreeMap;

/// Ink of the pens 1, 2, …, of which nothing is said; more pens begin again.
const INKS: [[u8; 3]; 6] = [[0, 0, 0], [200, 40, 40], [30, 80, 180], [30, 130, 60], [200, 120, 20], [120, 50, 150]];

/// Width in mm of pens of which nothing is said: a fine liner.
pub const DEFAULT_WIDTH_MM: f64 = 0.3;

/// What is known of a pen; the rest is as for all pens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pen {
    /// Width of its line in mm, positive.
    pub width_mm: Option<f64>,
    /// Its ink: red, green, blue.
    pub color: Option<[u8; 3]>,
    /// Speed in mm/s at which it draws, positive, instead of the plotter's.
    pub speed_mm_s: Option<f64>,
    /// Force with which it is pressed on the paper, in the steps of plotters that can be told one (`FS` of HPGL).
    pub force: Option<u32>,
}

/// The pens of a drawing, by number from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Pens {
    own: BTreeMap<u32, Pen>,
    /// Width in mm of the pens that have none of their own.
    common_width_mm: f64,
}

impl Default for Pens {
    /// Fine liners, of which nothing else is known.
    fn default() -> Self {
        Self::new(BTreeMap::new(), DEFAULT_WIDTH_MM)
    }
}

impl Pens {
    /// Pens of which some are described, all others `width_mm` wide.
    #[must_use]
    pub fn new(own: BTreeMap<u32, Pen>, width_mm: f64) -> Self {
        Self { own, common_width_mm: width_mm }
    }

    /// Width of a pen's line in mm.
    #[must_use]
    pub fn width_mm(&self, pen: u32) -> f64 {
        self.get(pen).width_mm.unwrap_or(self.common_width_mm)
    }

    /// Ink of a pen: red, green, blue.
    #[must_use]
    pub fn color(&self, pen: u32) -> [u8; 3] {
        self.get(pen).color.unwrap_or(INKS[pen.saturating_sub(1) as usize % INKS.len()])
    }

    /// Feed in mm/min at which a pen draws, on a plotter that draws at `usual` feed otherwise.
    #[must_use]
    pub fn draw_feed(&self, pen: u32, usual: f64) -> f64 {
        self.get(pen).speed_mm_s.map_or(usual, |speed| speed * 60.0)
    }

    /// Force of a pen, if it has its own.
    #[must_use]
    pub fn force(&self, pen: u32) -> Option<u32> {
        self.get(pen).force
    }

    /// Whether any pen has its own speed, so that each must be told its speed when it is taken.
    #[must_use]
    pub fn have_speeds(&self) -> bool {
        self.own.values().any(|pen| pen.speed_mm_s.is_some())
    }

    fn get(&self, pen: u32) -> Pen {
        self.own.get(&pen).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_said_of_a_pen_is_as_usual() {
        let red = Pen { color: Some([255, 0, 0]), speed_mm_s: Some(20.0), ..Pen::default() };
        let pens = Pens::new(BTreeMap::from([(2, red)]), 0.5);
        assert_eq!((pens.width_mm(2), pens.color(2), pens.draw_feed(2, 900.0)), (0.5, [255, 0, 0], 1200.0));
        assert_eq!((pens.width_mm(1), pens.color(1), pens.draw_feed(1, 900.0)), (0.5, [0, 0, 0], 900.0));
        assert_eq!((pens.color(7), pens.force(2), pens.have_speeds()), (INKS[0], None, true));
        assert!(!Pens::default().have_speeds());
    }
}

//! Strokes of a pen that is followed.

use std::collections::BTreeMap;

use glam::DVec2;

use super::file::Found;
use super::flatten::Flattener;
use super::{Drawing, LAYER, Page, Polyline};
use crate::device::{Device, Placement};
use crate::model::Fault;
use crate::pens::Pens;

/// Collects what a plotter's pens draw, from the places where they are in its own millimetres.
pub(super) struct Traced {
    page: Page,
    placement: Placement,
    out: Flattener,
    /// The pen that is down, and whether it has drawn anything.
    down: Option<(u32, bool)>,
    /// Where it is, in mm of the machine.
    at: DVec2,
    strokes: Vec<(u32, Vec<DVec2>)>,
}

impl Traced {
    /// On the page of a device that says none: all that it reaches, or its first sheet.
    ///
    /// # Errors
    /// If the device has no such page.
    pub(super) fn new(device: &Device, out: Flattener) -> Result<Self, Fault> {
        let page = device.whole_page();
        if !(page.width_mm > 0.0 && page.height_mm > 0.0) {
            let problem = format!("says no page, and `{}` says no travel_mm; add that to its profile", device.name);
            return Err(Fault::whole(problem));
        }
        let placement = device.place(page).map_err(|error| Fault::whole(error.to_string()))?;
        Ok(Self { page, placement, out, down: None, at: DVec2::ZERO, strokes: Vec::new() })
    }

    /// A pen is down at a place; nothing if it was before.
    ///
    /// # Errors
    /// As for all that follows: if a place is on no paper, or they are too many; what is wrong.
    pub(super) fn lower(&mut self, at: DVec2, pen: u32) -> Result<(), String> {
        if self.down.is_some_and(|(down, _)| down == pen) && self.at == at {
            return Ok(());
        }
        self.lift()?;
        (self.down, self.at) = (Some((pen, false)), at);
        self.out.move_to(self.placement.to_page(at))
    }

    /// The pen that is down draws a line.
    pub(super) fn line(&mut self, to: DVec2) -> Result<(), String> {
        self.drawn(to);
        self.out.line_to(self.placement.to_page(to))
    }

    /// The pen that is down draws an arc about a centre, counter-clockwise by an angle in radians.
    pub(super) fn arc(&mut self, centre: DVec2, angle: f64, to: DVec2) -> Result<(), String> {
        let from = self.at - centre;
        let middle = self.placement.to_page(centre);
        let axes = [from, from.perp()].map(|axis| self.placement.to_page(centre + axis) - middle);
        self.drawn(to);
        self.out.arc_to(middle, axes, 0.0, angle, self.placement.to_page(to))
    }

    fn drawn(&mut self, to: DVec2) {
        self.at = to;
        if let Some((_, has_drawn)) = &mut self.down {
            *has_drawn = true;
        }
    }

    /// No pen is down. One that has drawn nothing since it was lowered has made a dot.
    pub(super) fn lift(&mut self) -> Result<(), String> {
        let Some((pen, has_drawn)) = self.down.take() else { return Ok(()) };
        if !has_drawn {
            self.out.line_to(self.placement.to_page(self.at))?;
        }
        self.strokes.extend(self.out.take().into_iter().map(|points| (pen, points)));
        Ok(())
    }

    /// The drawing: what each pen draws is a layer, unless there is only one.
    ///
    /// # Errors
    /// If nothing is drawn.
    pub(super) fn found(self, name: &str, notes: Vec<String>) -> Result<Found, Fault> {
        if self.strokes.is_empty() {
            let why = if notes.is_empty() { String::new() } else { format!(": {}", notes.join("; ")) };
            return Err(Fault::whole(format!("draws nothing that can be followed{why}")));
        }
        let first = self.strokes.first().map(|(pen, _)| *pen);
        let is_one = self.strokes.iter().all(|(pen, _)| Some(*pen) == first);
        let polylines = self.strokes.into_iter().map(|(pen, points)| {
            let layer = if is_one { LAYER.to_owned() } else { format!("pen{pen}") };
            Polyline::stroke(layer, pen, points)
        });
        let polylines = polylines.collect();
        let drawing = Drawing {
            name: name.to_owned(),
            page: self.page,
            isos: 0,
            pens: Pens::default(),
            slack_mm: 0.0,
            polylines,
        };
        Ok(Found { drawing, view: None, colours: BTreeMap::new(), notes })
    }
}

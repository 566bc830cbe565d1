//! What the controller tells of itself.

use super::report::{Place, Status};
use crate::trace::gcode::Modal;

/// What the controller tells of itself before and while it draws.
#[derive(Clone, Debug, Default)]
pub(super) struct Told {
    /// Its state before the job; none if it does not answer `$G`, and then nothing can be verified.
    pub(super) modal: Option<Modal>,
    /// Steps/mm of the axes ($100 to $102).
    pub(super) steps_per_mm: [Option<f64>; 3],
    /// Millimetres in a unit of reports ($13).
    pub(super) unit_mm: f64,
    /// Blocks of the planner.
    pub(super) blocks: Option<usize>,
    /// Times that `$G` was asked before the job.
    pub(super) asked: u32,
    /// `WCO`, in mm.
    pub(super) origin: Option<[f64; 3]>,
    /// Another one that was told once since.
    pub(super) other_origin: Option<[f64; 3]>,
    /// How often it was told.
    pub(super) origins_told: u32,
    /// Whether it computes positions with 64 bits.
    pub(super) double: bool,
    /// Whether the F of `$G` is not the feed that was sent, in spite of all.
    pub(super) other_feed: bool,
}

impl Told {
    /// A state as it is told, with the feed in mm/min.
    pub(super) fn in_mm(&self, modal: Modal) -> Modal {
        Modal { feed: modal.feed.map(|feed| feed * self.unit_mm), ..modal }
    }

    /// The place of the job's origin is told. A report may be mangled: another place than before is believed when it is told
    /// again, or when it explains where the machine is.
    pub(super) fn origin_told(&mut self, origin: [f64; 3]) {
        let origin = origin.map(|value| value * self.unit_mm);
        if self.origin.is_none_or(|known| known == origin) || self.other_origin == Some(origin) {
            self.origin = Some(origin);
            self.other_origin = None;
        } else {
            self.other_origin = Some(origin);
        }
        self.origins_told = self.origins_told.saturating_add(1);
    }

    /// Takes the other origin for the right one.
    pub(super) fn take_other_origin(&mut self) {
        self.origin = self.other_origin.take().or(self.origin);
    }

    /// Where the machine is from the job's origin, mm; none while the report does not tell, or the origin is not known.
    pub(super) fn place(&self, status: &Status) -> Option<[f64; 3]> {
        self.place_from(status, self.origin)
    }

    /// The same, if the other origin is the right one.
    pub(super) fn other_place(&self, status: &Status) -> Option<[f64; 3]> {
        self.place_from(status, Some(self.other_origin?))
    }

    fn place_from(&self, status: &Status, origin: Option<[f64; 3]>) -> Option<[f64; 3]> {
        match status.position? {
            Place::Work(at) => Some(at.map(|value| value * self.unit_mm)),
            Place::Machine(at) => {
                let origin = origin?;
                Some([0, 1, 2].map(|axis| at[axis] * self.unit_mm - origin[axis]))
            }
        }
    }
}

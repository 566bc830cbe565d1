//! Holds the feed of the machine against that of the job, where its state is asked for.
//!
//! A feed that was changed on the way does no harm to where the ink is. So it is no reason to stop: its user is told, and it is set
//! again.

use std::time::Duration;

use super::{Event, Grbl, QUERY, What};
use crate::emit::decimal;
use crate::trace::gcode::{Modal, Units};

/// Decimals of a feed that is sent again, in mm/min or inches/min.
const DECIMALS: usize = 3;

impl Grbl {
    /// Whether the feed in the state that was found is the wanted one, or is not verified any more. Else false, and an answer is to
    /// be waited for: to the same question, or to the feed that is set again.
    pub(super) fn feed_is_settled(&mut self, state: &Modal, found: &Modal, now: Duration) -> bool {
        let Some((wanted, found)) = difference(state, found, self.told.unit_mm).filter(|_| !self.told.other_feed)
        else {
            return true;
        };
        let (first, last) = (self.plan.start(self.part), self.plan.check(self.part).map_or(0, |check| check.end));
        let lines = [first, last.saturating_sub(1)].map(|line| self.place_of(line).number);
        let Some(checking) = &mut self.checking else { return false };
        checking.misses += 1;
        if checking.misses == 1 {
            // The report itself may have been changed on the way.
            self.ask_again(now);
            return false;
        }
        let text = if checking.feed_sent {
            self.told.other_feed = true;
            format!(
                "the plotter tells a feed of {found:.0} mm/min where {wanted:.0} was sent; its feed is not verified"
            )
        } else {
            checking.feed_sent = true;
            checking.misses = 0;
            let feed = decimal(wanted / state.units.map_or(1.0, Units::mm), DECIMALS);
            checking.queue.extend([(format!("F{feed}"), What::Errand), (QUERY.to_owned(), What::Query)]);
            format!(
                "the plotter took a feed of {found:.0} and not {wanted:.0} mm/min in lines {} to {}: a byte was lost or changed on the \
                 line; what they drew is in its place, but was drawn at the wrong speed, and the feed is set again",
                lines[0], lines[1]
            )
        };
        self.outbox.tell(Event::Warning(text));
        if self.told.other_feed {
            return true;
        }
        self.advance_check(now);
        false
    }
}

/// The wanted and the found feed (mm/min) where they differ, as far as both are known. `unit_mm` is the unit of reports.
fn difference(wanted: &Modal, found: &Modal, unit_mm: f64) -> Option<(f64, f64)> {
    /// F is reported without decimals in mm/min, and with one in inches/min; and it is read as a float of 32 bits.
    const ROUNDING: f64 = 0.51;
    const FLOAT_ERROR: f64 = 2.4e-7;
    let (wanted, found) = (wanted.feed?, found.feed?);
    let rounding = if unit_mm == 1.0 { ROUNDING } else { ROUNDING / 10.0 * unit_mm };
    ((wanted - found).abs() > rounding + FLOAT_ERROR * wanted.abs()).then_some((wanted, found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feeds_differ_beyond_their_rounding() {
        let feed = |feed: Option<f64>| Modal { feed, ..Modal::default() };
        let table = [
            (Some(2000.4), Some(2000.0), 1.0, false),
            (Some(2000.0), Some(200.0), 1.0, true),
            (Some(2000.0), Some(2001.0), 1.0, true),
            // 78.7 inches are 1998.98 mm.
            (Some(2000.0), Some(78.7 * 25.4), 25.4, false),
            (Some(2000.0), Some(78.6 * 25.4), 25.4, true),
            (None, Some(200.0), 1.0, false),
            (Some(200.0), None, 1.0, false),
        ];
        for (wanted, found, unit_mm, differ) in table {
            let difference = difference(&feed(wanted), &feed(found), unit_mm);
            assert_eq!(difference.is_some(), differ, "{wanted:?} {found:?}");
        }
    }
}

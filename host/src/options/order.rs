//! The options of the path of the pen: the order of strokes, what is joined, and how curves are written.

use super::{Arcs, OptionError, bad};
use crate::args::PathArgs;
use crate::device::Device;
use crate::estimate;
use crate::page::{Effort, Measure, PathChoice};

/// Longest search in s. A plot takes less.
const LONGEST_S: f64 = 86_400.0;

/// Widest gap in mm over which ends may be joined. Wider ones are no pen's ink.
const WIDEST_GAP_MM: f64 = 10.0;

/// What is to become small between strokes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrderBy {
    /// The time that lifts and travel take.
    Time,
    /// The length of the travel.
    Distance,
}

/// What is asked of the path of the pen, as far as the command line says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderOptions {
    /// Time for the search in s, see [`Effort::seconds`].
    pub seconds: f64,
    /// What is to become small.
    pub by: OrderBy,
    /// Seed of the search.
    pub seed: u64,
    /// Largest gap in mm over which ends of strokes are joined, 0 for none.
    pub merge_mm: Option<f64>,
    /// Whether curves are written as arcs.
    pub arcs: Arcs,
}

impl OrderOptions {
    /// Checks the arguments.
    ///
    /// # Errors
    /// [`OptionError`] with the option and what it takes.
    pub fn new(args: &PathArgs) -> Result<Self, OptionError> {
        if !(0.0..=LONGEST_S).contains(&args.optimize) {
            let problem = format!("is not a time from 0 to {LONGEST_S} s; 1 is a good one");
            return Err(bad("--optimize", args.optimize, problem));
        }
        let by = match args.order_by.as_str() {
            "time" => OrderBy::Time,
            "distance" => OrderBy::Distance,
            other => return Err(bad("--order-by", other, "is not one of time, distance")),
        };
        if let Some(mm) = args.merge.filter(|mm| !(0.0..=WIDEST_GAP_MM).contains(mm)) {
            let problem = format!(
                "is not a length from 0 to {WIDEST_GAP_MM} mm; 0.1 is a good one, and 0 leaves strokes as they are"
            );
            return Err(bad("--merge", mm, problem));
        }
        Ok(Self { seconds: args.optimize, by, seed: args.order_seed, merge_mm: args.merge, arcs: args.arcs })
    }

    /// The path through a drawing that a device draws.
    #[must_use]
    pub fn path(&self, device: &Device) -> PathChoice {
        let measure = match self.by {
            OrderBy::Time => estimate::travel_time(device),
            OrderBy::Distance => Measure::Distance,
        };
        let effort = Effort { measure, seconds: self.seconds, seed: self.seed };
        PathChoice { effort, merge_mm: self.merge_mm }
    }
}

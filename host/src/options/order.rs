//! The options of the order of strokes.

use super::{OptionError, bad};
use crate::args::PathArgs;
use crate::device::Device;
use crate::estimate;
use crate::page::{Effort, Measure};

/// Longest search in s. A plot takes less.
const LONGEST_S: f64 = 86_400.0;

/// What is to become small between strokes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrderBy {
    /// The time that lifts and travel take.
    Time,
    /// The length of the travel.
    Distance,
}

/// How good the order of strokes is to be, as far as the command line says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderOptions {
    /// Time for the search in s, see [`Effort::seconds`].
    pub seconds: f64,
    /// What is to become small.
    pub by: OrderBy,
    /// Seed of the search.
    pub seed: u64,
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
        Ok(Self { seconds: args.optimize, by, seed: args.order_seed })
    }

    /// The effort for a drawing that a device draws.
    #[must_use]
    pub fn effort(&self, device: &Device) -> Effort {
        let measure = match self.by {
            OrderBy::Time => estimate::travel_time(device),
            OrderBy::Distance => Measure::Distance,
        };
        Effort { measure, seconds: self.seconds, seed: self.seed }
    }
}

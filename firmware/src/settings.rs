//! The `$n=value` settings.

use crate::axis::{AXES, Axes};
use crate::error::Error;
use crate::kinematics::{Hanging, Kinematics};
use crate::pen::PenMotion;
use crate::stopwatch::Mechanics;

/// Highest step rate of one motor that settings may ask for, in steps per second; with a pulse of `$0` µs no more than 500,000 / `$0` either, so that the step signal
/// is low for as long as it is high.
///
/// A step costs [`crate::Stepper::tick`] 55 instructions on a Cortex-M4F, and a segment 120 more. With the processor's own 24 cycles to take an interrupt and to end it, and about as many
/// instructions again for the timer, that is some 150 cycles: at 168 MHz a million steps a second would leave no time for anything else, and 200,000 take a fifth. A
/// Cortex-M0+ at 125 MHz, whose instructions do less, spends less than half of its time at that rate.
pub const MAX_STEP_RATE: f64 = 200_000.0;

/// Largest distance of a motor from the origin in steps, so that the difference of two targets fits i32.
const MAX_STEPS: f64 = 1_073_741_823.0;

/// Everything that `$$` lists. Only [`Settings::set`] changes a value of a machine's, so all of them are in range.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// `$0`: width of a step pulse, µs, 1 to 255.
    pub(crate) pulse_us: u8,
    /// `$1`: ms from the last step until the motors are released, 0 to 255; 255 holds them for ever.
    pub(crate) idle_delay_ms: u8,
    /// `$2`: axes whose step signal is inverted, bits 0 to 2.
    pub(crate) invert_steps: u8,
    /// `$3`: axes whose direction signal is inverted, bits 0 to 2.
    pub(crate) invert_directions: u8,
    /// `$4`: the enable signal is inverted: high energises.
    pub(crate) invert_enable: bool,
    /// `$5`: limit switches are normally closed.
    pub(crate) invert_limits: bool,
    /// `$6`: kept for senders that set it; there is no probe.
    pub(crate) invert_probe: bool,
    /// `$10`: status report: bit 0 machine (1) or work (0) position, bit 1 buffer fields.
    pub(crate) report_mask: u8,
    /// `$11`: junction deviation, mm, ≥ 0: how far a circle tangent to both lines of a corner stays from its vertex; sets the corner's speed.
    pub(crate) junction_deviation: f64,
    /// `$12`: largest distance between an arc and its chords, mm, > 0.
    pub(crate) arc_tolerance: f64,
    /// `$13`: report positions in inches.
    pub(crate) report_inches: bool,
    /// `$20`: refuse targets outside of [`Settings::reach`].
    pub(crate) soft_limits: bool,
    /// `$21`: a limit switch that closes while the machine moves stops it: ALARM:1.
    pub(crate) hard_limits: bool,
    /// `$22`: bit 0, `$H` homes, and the machine is locked until it has; bit 3 (as in grblHAL), home is the origin instead of the end of the travel.
    pub(crate) homing: u8,
    /// `$23`: axes that home towards the negative end, bits 0 to 2.
    pub(crate) home_negative: u8,
    /// `$24`: mm/min at which the switch is located.
    pub(crate) home_feed: f64,
    /// `$25`: mm/min at which the switch is sought.
    pub(crate) home_seek: f64,
    /// `$26`: ms of rest between the motions of homing, for the switch to come to rest too; 0 to 10000.
    pub(crate) home_debounce: u16,
    /// `$27`: mm from the switch at which homing ends.
    pub(crate) home_pull_off: f64,
    /// `$30`: S of the highest pen level, ≥ 0.
    pub(crate) spindle_max: f64,
    /// `$31`: S of the lowest pen level, ≥ 0.
    pub(crate) spindle_min: f64,
    /// `$32`: laser mode: changes of the pen ride with the motion and do not stop it.
    pub(crate) laser_mode: bool,
    /// `$41` (as in grblHAL): a hold that has come to rest lifts the pen, and going on puts it down first.
    pub(crate) parking: bool,
    /// `$44` (as in grblHAL): axes that have a home switch, bits 0 to 2. Z homes first, then X and Y together.
    pub(crate) home_axes: u8,
    /// `$450`: the language from the next start or reset: 0 by the first bytes, 1 G-code, 2 HPGL.
    pub(crate) language: u8,
    /// `$451`: HPGL plotter unit, mm, 0.001 to 1.
    pub(crate) plotter_unit: f64,
    /// `$452`: time that HPGL gives the pen to go up or down, ms, 0 to 10000.
    pub(crate) pen_delay: u16,
    /// `$100`–`$102`: steps per mm, > 0.
    pub(crate) steps_per_mm: [f64; AXES],
    /// `$110`–`$112`: maximum rate, mm/min, > 0.
    pub(crate) max_rate: [f64; AXES],
    /// `$120`–`$122`: acceleration, mm/s², > 0.
    pub(crate) acceleration: [f64; AXES],
    /// `$130`–`$132`: travel, mm, > 0.
    pub(crate) travel: [f64; AXES],
    /// `$140`–`$142`: jerk, mm/s³; S-curves if that of X and of Y is above 0, else trapezoids. Then accelerations are the same in all directions, those of the slowest axis.
    pub(crate) jerk: [f64; AXES],
    /// `$500`: how the motors move the pen, 0 to 2.
    pub(crate) kinematics: Kinematics,
    /// `$501`–`$503`: of a pen that hangs, mm; kept also when it does not.
    pub(crate) hanging: Hanging,
    /// `$510`, `$511`: how fast the pen moves while S rises and while it falls, in S a second; 0: at once.
    pub(crate) pen_rates: [f64; 2],
    /// `$512`: ms that the pen then takes to settle, 0 to 10,000.
    pub(crate) pen_settle_ms: u16,
}

impl Default for Settings {
    /// An A3 plotter with 80 steps per mm.
    fn default() -> Self {
        Self {
            pulse_us: 10,
            idle_delay_ms: 255,
            invert_steps: 0,
            invert_directions: 0,
            invert_enable: false,
            invert_limits: false,
            invert_probe: false,
            report_mask: 3,
            junction_deviation: 0.01,
            arc_tolerance: 0.002,
            report_inches: false,
            soft_limits: false,
            hard_limits: false,
            homing: 0,
            home_negative: 0b111,
            home_feed: 100.0,
            home_seek: 1500.0,
            home_debounce: 50,
            home_pull_off: 2.0,
            spindle_max: 1000.0,
            spindle_min: 0.0,
            laser_mode: false,
            parking: false,
            home_axes: 0b011,
            language: 0,
            plotter_unit: 0.025,
            pen_delay: 150,
            steps_per_mm: [80.0, 80.0, 80.0],
            max_rate: [12_000.0, 12_000.0, 3_000.0],
            acceleration: [1000.0, 1000.0, 500.0],
            travel: [430.0, 310.0, 50.0],
            jerk: [0.0; AXES],
            kinematics: Kinematics::Cartesian,
            hanging: Hanging::default(),
            pen_rates: [0.0; 2],
            pen_settle_ms: 0,
        }
    }
}

/// The numbers that `$$` lists, in its order.
pub(crate) const SETTING_IDS: [u16; 49] = [
    0, 1, 2, 3, 4, 5, 6, 10, 11, 12, 13, 20, 21, 22, 23, 24, 25, 26, 27, 30, 31, 32, 41, 44, 100, 101, 102, 110, 111,
    112, 120, 121, 122, 130, 131, 132, 140, 141, 142, 450, 451, 452, 500, 501, 502, 503, 510, 511, 512,
];

/// `$22`: `$H` homes.
const HOMING: u8 = 1 << 0;
/// `$22`: home is the origin.
const HOME_IS_ORIGIN: u8 = 1 << 3;

impl Settings {
    /// Those of another machine, whose steps are as fine as this one's.
    pub(crate) fn of(mechanics: &Mechanics) -> Self {
        let Mechanics { max_rate, acceleration, junction_deviation } = *mechanics;
        Self { max_rate, acceleration, junction_deviation, ..Self::default() }
    }

    /// The value of `$id` and the decimals it is printed with, or `None` for a number that is not a setting.
    #[must_use]
    pub fn get(&self, id: u16) -> Option<(f64, u8)> {
        let flag = |on: bool| (f64::from(u8::from(on)), 0);
        Some(match id {
            0 => (f64::from(self.pulse_us), 0),
            1 => (f64::from(self.idle_delay_ms), 0),
            2 => (f64::from(self.invert_steps), 0),
            3 => (f64::from(self.invert_directions), 0),
            4 => flag(self.invert_enable),
            5 => flag(self.invert_limits),
            6 => flag(self.invert_probe),
            10 => (f64::from(self.report_mask), 0),
            11 => (self.junction_deviation, 3),
            12 => (self.arc_tolerance, 3),
            13 => flag(self.report_inches),
            20 => flag(self.soft_limits),
            21 => flag(self.hard_limits),
            22 => (f64::from(self.homing), 0),
            23 => (f64::from(self.home_negative), 0),
            24 => (self.home_feed, 3),
            25 => (self.home_seek, 3),
            26 => (f64::from(self.home_debounce), 0),
            27 => (self.home_pull_off, 3),
            30 => (self.spindle_max, 3),
            31 => (self.spindle_min, 3),
            32 => flag(self.laser_mode),
            41 => flag(self.parking),
            44 => (f64::from(self.home_axes), 0),
            450 => (f64::from(self.language), 0),
            451 => (self.plotter_unit, 5),
            452 => (f64::from(self.pen_delay), 0),
            100..=142 => (*self.table(id)?, 3),
            500 => match self.kinematics {
                Kinematics::Cartesian => (0.0, 0),
                Kinematics::CoreXy => (1.0, 0),
                Kinematics::Hanging(_) => (2.0, 0),
            },
            501 => (self.hanging.motor_distance, 3),
            502 => (self.hanging.origin_right, 3),
            503 => (self.hanging.origin_below, 3),
            510 => (self.pen_rates[0], 3),
            511 => (self.pen_rates[1], 3),
            512 => (f64::from(self.pen_settle_ms), 0),
            _ => return None,
        })
    }

    /// Sets `$id`.
    ///
    /// # Errors
    /// [`Error::InvalidStatement`] for an unknown number, [`Error::NegativeValue`] for a value outside the range in the field's documentation (`$30` …),
    /// [`Error::PulseTooShort`], and [`Error::StepRateTooHigh`] when an axis
    /// would exceed [`MAX_STEP_RATE`]. The settings are unchanged then.
    pub fn set(&mut self, id: u16, value: f64) -> Result<(), Error> {
        if !value.is_finite() || value < 0.0 {
            return Err(Error::NegativeValue);
        }
        match id {
            0 if value < 1.0 => return Err(Error::PulseTooShort),
            0 => {
                let changed = Self { pulse_us: byte(value)?, ..self.clone() };
                *self = changed.checked()?;
            }
            1 => self.idle_delay_ms = byte(value)?,
            2 => self.invert_steps = byte(value)? & 0b111,
            3 => self.invert_directions = byte(value)? & 0b111,
            4 => self.invert_enable = value != 0.0,
            5 => self.invert_limits = value != 0.0,
            6 => self.invert_probe = value != 0.0,
            10 => self.report_mask = byte(value)?,
            11 => self.junction_deviation = value,
            12 => self.arc_tolerance = positive(value)?,
            13 => self.report_inches = value != 0.0,
            20 => self.soft_limits = value != 0.0,
            21 => self.hard_limits = value != 0.0,
            22 => self.homing = byte(value)? & (HOMING | HOME_IS_ORIGIN),
            23 => self.home_negative = byte(value)? & 0b111,
            24 => self.home_feed = positive(value)?,
            25 => self.home_seek = positive(value)?,
            26 => self.home_debounce = milliseconds(value)?,
            27 => self.home_pull_off = positive(value)?,
            30 => self.spindle_max = value,
            31 => self.spindle_min = value,
            32 => self.laser_mode = value != 0.0,
            41 => self.parking = value != 0.0,
            44 => self.home_axes = byte(value)? & 0b111,
            450 if value > 2.0 => return Err(Error::NegativeValue),
            450 => self.language = value as u8,
            451 if !(0.001..=1.0).contains(&value) => return Err(Error::NegativeValue),
            451 => self.plotter_unit = value,
            452 => self.pen_delay = milliseconds(value)?,
            100..=142 => {
                let mut changed = self.clone();
                let value = if id >= 140 && value == 0.0 { value } else { positive(value)? };
                *changed.table_mut(id).ok_or(Error::InvalidStatement)? = value;
                *self = changed.checked()?;
            }
            500..=503 => {
                let mut changed = self.clone();
                match id {
                    500 => {
                        changed.kinematics = match value {
                            0.0 => Kinematics::Cartesian,
                            1.0 => Kinematics::CoreXy,
                            2.0 => Kinematics::Hanging(self.hanging),
                            _ => return Err(Error::NegativeValue),
                        }
                    }
                    501 => changed.hanging.motor_distance = positive(value)?,
                    502 => changed.hanging.origin_right = length(value)?,
                    _ => changed.hanging.origin_below = positive(value)?,
                }
                if !changed.hanging.is_possible() {
                    return Err(Error::NegativeValue);
                }
                if let Kinematics::Hanging(cords) = &mut changed.kinematics {
                    *cords = changed.hanging;
                }
                *self = changed.checked()?;
            }
            510 => self.pen_rates[0] = value,
            511 => self.pen_rates[1] = value,
            512 if value <= 10_000.0 => self.pen_settle_ms = value as u16,
            512 => return Err(Error::NegativeValue),
            _ => return Err(Error::InvalidStatement),
        }
        Ok(())
    }

    /// These settings, if no motor is faster than it may be.
    fn checked(self) -> Result<Self, Error> {
        let rates = self.kinematics.motor_rates(self.max_rate);
        let most = MAX_STEP_RATE.min(500_000.0 / f64::from(self.pulse_us)) * 60.0;
        if (0..AXES).any(|motor| self.steps_per_mm[motor] * rates[motor] > most) {
            return Err(Error::StepRateTooHigh);
        }
        Ok(self)
    }

    /// Acceleration and jerk along every path in X and Y, and in Z if that takes part, mm/s² and mm/s³; none if the jerk is not limited.
    pub(crate) fn ramp(&self, with_z: bool) -> Option<(f32, f32)> {
        let [x, y, z] = self.jerk;
        (x > 0.0 && y > 0.0).then(|| {
            let least = |[x, y, z]: [f64; AXES], z_counts: bool| if z_counts { x.min(y).min(z) } else { x.min(y) };
            (least(self.acceleration, with_z) as f32, least(self.jerk, with_z && z > 0.0) as f32)
        })
    }

    /// How the pen moves by itself; in laser mode at once, since it rides with the motion.
    pub(crate) fn pen_motion(&self) -> PenMotion {
        let mut motion = PenMotion::default();
        let range = self.spindle_max - self.spindle_min;
        if !self.laser_mode && range > 0.0 {
            // Saturates; a speed that is asked for is never taken for none.
            let levels = |rate: f64| if rate > 0.0 { ((rate / range * f64::from(u16::MAX)) as u32).max(1) } else { 0 };
            motion.rise = levels(self.pen_rates[0]);
            motion.fall = levels(self.pen_rates[1]);
        }
        if !self.laser_mode {
            motion.settle_ms = self.pen_settle_ms;
        }
        motion
    }

    /// How the motors move the pen (`$500`–`$503`).
    #[must_use]
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// What the motors have wound at so many steps from the origin, mm.
    pub(crate) fn wound(&self, steps: [f64; AXES]) -> [f64; AXES] {
        core::array::from_fn(|motor| steps[motor] / self.steps_per_mm[motor])
    }

    /// Where the pen is when the motors are so many steps from the origin, mm.
    #[must_use]
    pub fn pen(&self, steps: [f64; AXES]) -> [f64; AXES] {
        self.kinematics.pen(self.wound(steps))
    }

    /// Steps from the origin, each rounded to nearest, when the pen is at `mm`; saturates.
    pub(crate) fn steps(&self, mm: [f64; AXES]) -> [i32; AXES] {
        let wound = self.kinematics.motors(mm);
        core::array::from_fn(|motor| libm::round(wound[motor] * self.steps_per_mm[motor]) as i32)
    }

    /// Whether the pen can be at `target`, and the steps there can be counted.
    pub(crate) fn reaches(&self, target: [f64; AXES]) -> bool {
        self.are_counted(self.kinematics.motors(target)) && self.kinematics.reaches(target)
    }

    /// Whether the steps can be counted wherever no coordinate is more than `reach` mm.
    pub(crate) fn counts(&self, reach: f64) -> bool {
        self.are_counted(self.kinematics.motor_rates([reach; AXES]))
    }

    fn are_counted(&self, wound: [f64; AXES]) -> bool {
        (0..AXES).all(|motor| (wound[motor] * self.steps_per_mm[motor]).abs() <= MAX_STEPS)
    }

    /// Steps per mm of each motor (`$100`–`$102`).
    #[must_use]
    pub fn steps_per_mm(&self) -> [f64; AXES] {
        self.steps_per_mm
    }

    fn table(&self, id: u16) -> Option<&f64> {
        let axis = usize::from(id % 10);
        match id / 10 {
            10 => self.steps_per_mm.get(axis),
            11 => self.max_rate.get(axis),
            12 => self.acceleration.get(axis),
            13 => self.travel.get(axis),
            14 => self.jerk.get(axis),
            _ => None,
        }
    }

    fn table_mut(&mut self, id: u16) -> Option<&mut f64> {
        let axis = usize::from(id % 10);
        match id / 10 {
            10 => self.steps_per_mm.get_mut(axis),
            11 => self.max_rate.get_mut(axis),
            12 => self.acceleration.get_mut(axis),
            13 => self.travel.get_mut(axis),
            14 => self.jerk.get_mut(axis),
            _ => None,
        }
    }

    /// Whether `$H` homes (`$22`). A pen that hangs on cords does not: its cords have no ends.
    pub(crate) fn can_home(&self) -> bool {
        self.homing & HOMING != 0 && !matches!(self.kinematics, Kinematics::Hanging(_))
    }

    /// The axes that home (`$44`).
    pub(crate) fn homing_axes(&self) -> Axes {
        if self.can_home() { Axes::from_bits(self.home_axes) } else { Axes::NONE }
    }

    /// Whether `axis` homes towards its negative end (`$23`).
    pub(crate) fn homes_down(&self, axis: usize) -> bool {
        Axes::from_bits(self.home_negative).contains(axis)
    }

    /// The machine position of `axis` after homing, mm: the pull-off (`$27`) from the end of the travel, or the origin (`$22`, bit 3).
    ///
    /// As in GRBL the travel lies below the origin, so home is near 0 at the positive end and near −travel at the negative.
    pub(crate) fn home(&self, axis: usize) -> f64 {
        let travel = self.travel.get(axis).copied().unwrap_or(0.0);
        match (self.homing & HOME_IS_ORIGIN != 0, self.homes_down(axis)) {
            (true, _) => 0.0,
            (false, true) => self.home_pull_off - travel,
            (false, false) => -self.home_pull_off,
        }
    }

    /// Lowest and highest machine position of `axis`, mm. Of an axis that homes: −travel to 0, as in GRBL, or when home is the origin, the travel from it away from
    /// the switch. Else the start is 0, and the sheet lies in 0 to travel; Z may go either way.
    pub(crate) fn reach(&self, axis: usize) -> [f64; 2] {
        let travel = self.travel.get(axis).copied().unwrap_or(0.0);
        if self.homing_axes().contains(axis) {
            if self.homing & HOME_IS_ORIGIN != 0 && self.homes_down(axis) { [0.0, travel] } else { [-travel, 0.0] }
        } else if axis == 2 {
            [-travel, travel]
        } else {
            [0.0, travel]
        }
    }

    /// Whether `target` (machine mm) can be reached, and lies in the reach of all axes or soft limits are off.
    pub(crate) fn in_travel(&self, target: [f64; AXES]) -> bool {
        let within = !self.soft_limits
            || target.into_iter().enumerate().all(|(axis, mm)| {
                let [low, high] = self.reach(axis);
                (low..=high).contains(&mm)
            });
        within && self.kinematics.reaches(target)
    }
}

/// Scales and limits below a millionth are as senseless as zero, and would overflow what is computed from them in f32.
fn positive(value: f64) -> Result<f64, Error> {
    if (1e-6..=1e9).contains(&value) { Ok(value) } else { Err(Error::NegativeValue) }
}

/// A distance that may be nothing.
fn length(value: f64) -> Result<f64, Error> {
    if value <= 1e9 { Ok(value) } else { Err(Error::NegativeValue) }
}

/// Up to 10 s.
fn milliseconds(value: f64) -> Result<u16, Error> {
    if value <= 10_000.0 { Ok(value as u16) } else { Err(Error::NegativeValue) }
}

fn byte(value: f64) -> Result<u8, Error> {
    if value <= 255.0 { Ok(value as u8) } else { Err(Error::NegativeValue) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_setting_reads_back() {
        let mut s = Settings::default();
        for id in SETTING_IDS {
            let (value, _) = s.get(id).unwrap();
            s.set(id, value).unwrap();
        }
        assert_eq!(s, Settings::default());
        s.set(101, 40.0).unwrap();
        assert_eq!(s.steps_per_mm, [80.0, 40.0, 80.0]);
    }

    #[test]
    fn kinematics_keep_their_measures() {
        let mut s = Settings::default();
        for (id, value) in [(501, 800.0), (500, 2.0), (502, 250.0), (500, 0.0), (503, 300.0), (500, 2.0)] {
            s.set(id, value).unwrap();
            assert_eq!(s.get(id).unwrap().0, value);
        }
        let cords = Hanging { motor_distance: 800.0, origin_right: 250.0, origin_below: 300.0 };
        assert_eq!(s.kinematics(), &Kinematics::Hanging(cords));
        // 80 steps a mm and pulses of 10 µs: 50,000 steps a second are 37,500 mm/min. A belt of a CoreXY takes the sum of both axes.
        let mut s = Settings::default();
        s.set(110, 20_000.0).unwrap();
        s.set(111, 20_000.0).unwrap();
        assert_eq!(s.set(500, 1.0), Err(Error::StepRateTooHigh));
        s.set(111, 17_500.0).unwrap();
        s.set(500, 1.0).unwrap();
        assert_eq!(s.set(111, 17_501.0), Err(Error::StepRateTooHigh));
        assert_eq!(s.set(0, 11.0), Err(Error::StepRateTooHigh));
        s.set(0, 2.0).unwrap();
        s.set(111, 100_000.0).unwrap();
        assert_eq!(s.set(111, 131_000.0), Err(Error::StepRateTooHigh), "200,000 steps a second at most");
    }

    #[test]
    fn refusals() {
        let mut s = Settings::default();
        for (id, value, error) in [
            (0, 0.5, Error::PulseTooShort),
            (0, 300.0, Error::NegativeValue),
            (11, -1.0, Error::NegativeValue),
            (12, 0.0, Error::NegativeValue),
            (24, 0.0, Error::NegativeValue),
            (26, 10_001.0, Error::NegativeValue),
            (450, 3.0, Error::NegativeValue),
            (451, 0.0, Error::NegativeValue),
            (99, 1.0, Error::InvalidStatement),
            (103, 1.0, Error::InvalidStatement),
            (100, 0.0, Error::NegativeValue),
            (100, 1000.0, Error::StepRateTooHigh),
            (110, 1e6, Error::StepRateTooHigh),
            (120, f64::NAN, Error::NegativeValue),
            (500, 3.0, Error::NegativeValue),
            (501, 0.0, Error::NegativeValue),
            (503, 1.0, Error::NegativeValue),
        ] {
            assert_eq!(s.set(id, value), Err(error), "${id}={value}");
        }
        assert_eq!(s, Settings::default());
    }
    #[test]
    fn the_reach_lies_where_home_is() {
        let mut s = Settings::default();
        assert_eq!([0, 1, 2].map(|axis| s.reach(axis)), [[0.0, 430.0], [0.0, 310.0], [-50.0, 50.0]]);
        s.set(22, 1.0).unwrap();
        s.set(23, 1.0).unwrap();
        assert_eq!([0, 1, 2].map(|axis| s.reach(axis)), [[-430.0, 0.0], [-310.0, 0.0], [-50.0, 50.0]]);
        assert_eq!([s.home(0), s.home(1)], [-428.0, -2.0]);
        s.set(22, 9.0).unwrap();
        assert_eq!([s.reach(0), s.reach(1)], [[0.0, 430.0], [-310.0, 0.0]]);
        assert_eq!([s.home(0), s.home(1)], [0.0, 0.0]);
    }
}

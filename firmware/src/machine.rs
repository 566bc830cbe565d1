//! Controller and stepper in one, for a context that runs both.

use embedded_storage::nor_flash::NorFlash;

use crate::axis::AXES;
use crate::controller::Controller;
use crate::hal::Hardware;
use crate::settings::Settings;
use crate::stepper::{StepSink, Stepper};
use crate::storage::NoStorage;

/// The whole firmware: bytes in, steps out, in real or in virtual time.
///
/// ```
/// use penvis_firmware::{Axes, Hardware, Machine, Pen, Settings};
///
/// #[derive(Default)]
/// struct Count(u32);
/// impl Hardware for Count {
///     fn set_directions(&mut self, _: Axes) {}
///     fn step(&mut self, axes: Axes) {
///         self.0 += u32::from(axes.contains(0));
///     }
///     fn set_pen(&mut self, _: Pen) {}
/// }
///
/// let mut machine: Machine<Count> = Machine::new(Count::default(), Settings::default());
/// let mut answers = Vec::new();
/// for &byte in b"G1 X10 F3000\n" {
///     machine.receive(byte);
/// }
/// while !machine.is_idle() {
///     while machine.poll() {}
///     answers.extend(std::iter::from_fn(|| machine.transmit()));
///     machine.tick(); // on a board: when the µs it returned last have passed
/// }
/// assert_eq!(answers, b"\r\nGrbl 1.1h ['$' for help]\r\nok\r\n");
/// assert_eq!(machine.hardware().0, 800);
/// assert!((0.2..0.3).contains(&(machine.now() as f64 * 1e-6))); // 10 mm at 50 mm/s and 1000 mm/s²
/// ```
///
/// `BLOCKS` is the number of blocks the planner looks ahead (GRBL's 15 by default; 64 where RAM allows), `F` the memory for what outlives switching off.
#[derive(Debug)]
pub struct Machine<H, const BLOCKS: usize = 15, F = NoStorage> {
    controller: Controller<BLOCKS, F>,
    stepper: Stepper<H>,
}

impl<H: Hardware, const BLOCKS: usize> Machine<H, BLOCKS> {
    /// A machine at rest at the origin, which has just sent its banner. It forgets everything when it is switched off.
    pub fn new(hardware: H, settings: Settings) -> Self {
        Self::with_storage(hardware, settings, NoStorage)
    }
}

impl<H: Hardware, const BLOCKS: usize, F: NorFlash> Machine<H, BLOCKS, F> {
    /// A machine with what `flash` holds: see [`Controller::with_storage`].
    pub fn with_storage(hardware: H, defaults: Settings, flash: F) -> Self {
        Self { controller: Controller::with_storage(defaults, flash), stepper: Stepper::new(hardware) }
    }

    /// Takes one byte from the port: see [`Controller::receive`].
    pub fn receive(&mut self, byte: u8) {
        self.controller.receive(byte);
    }

    /// The next byte for the port, if there is one.
    pub fn transmit(&mut self) -> Option<u8> {
        self.controller.transmit()
    }

    /// One turn of the main loop: see [`Controller::poll`]. Returns true when calling again at once would do more.
    pub fn poll(&mut self) -> bool {
        self.controller.poll(&mut self.stepper)
    }

    /// The step interrupt, due at [`Machine::next_event`]: see [`Stepper::tick`]. Returns the ticks of the timer (≥ 1) until the next.
    /// Between two ticks [`Machine::poll`] must have returned false, or the steps run dry.
    pub fn tick(&mut self) -> u32 {
        self.stepper.tick()
    }

    /// Time of the last tick, in ticks of the hardware's timer (µs, unless [`Hardware::TICKS_PER_US`] says otherwise) since the start.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.stepper.now()
    }

    /// Time at which the next tick is due, in ticks of the timer since the start. While idle, calls are [`crate::IDLE_US`] apart.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        self.stepper.next_event()
    }

    /// What connects the controller with what computes drawings: see [`Controller::desk_mut`].
    #[cfg(feature = "scene")]
    pub fn desk_mut(&mut self) -> &mut crate::scene::Desk {
        self.controller.desk_mut()
    }

    /// Whether nothing is left to do or to send. A held motion, a dwell and a line without its end's answer are something to do; a partial line is not.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.controller.is_idle(&self.stepper)
    }

    /// Whether no step, dwell or pen change is outstanding at the stepper.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.stepper.is_idle()
    }

    /// Position in steps from the origin.
    #[must_use]
    pub fn position(&self) -> [i32; AXES] {
        self.stepper.position()
    }

    /// The settings in force.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        self.controller.settings()
    }

    /// Bytes lost since the start because the receive ring was full.
    #[must_use]
    pub fn lost_bytes(&self) -> u32 {
        self.controller.lost_bytes()
    }

    /// Bytes that the receive ring has room for.
    #[must_use]
    pub fn rx_free(&self) -> usize {
        self.controller.rx_free()
    }

    /// The level of the ready line (DTR) for HPGL's hardware handshake: see [`Controller::is_ready`].
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.controller.is_ready()
    }

    /// The memory for what outlives switching off.
    #[must_use]
    pub fn storage(&self) -> &F {
        self.controller.storage()
    }

    /// The hardware.
    #[must_use]
    pub fn hardware(&self) -> &H {
        self.stepper.hardware()
    }

    /// The hardware, to take out what it recorded.
    pub fn hardware_mut(&mut self) -> &mut H {
        self.stepper.hardware_mut()
    }

    /// Gives the hardware back.
    pub fn into_hardware(self) -> H {
        self.stepper.into_hardware()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axes, Pen};

    struct None;

    impl Hardware for None {
        fn set_directions(&mut self, _: Axes) {}
        fn step(&mut self, _: Axes) {}
        fn set_pen(&mut self, _: Pen) {}
    }

    /// The figures of the crate's documentation; they hold on 32-bit boards too, where only the queues' lengths are smaller.
    #[test]
    fn ram_is_as_documented() {
        #[cfg(feature = "scene")]
        let desk = size_of::<crate::scene::Desk>();
        #[cfg(not(feature = "scene"))]
        let desk = 0;
        assert!(desk <= 512);
        assert!(size_of::<Machine<None>>() <= 6 * 1024 + desk);
        assert!(size_of::<Machine<None, 64>>() <= 9 * 1024 + desk);
        assert!(size_of::<Stepper<None>>() <= 1024);
        assert!(size_of::<crate::storage::Stored>() <= 1024);
    }
}

//! Bytes for the firmware: on its line, in two languages, and in its memory.
//!
//! Whatever they are, it does not panic, every line and instruction takes bounded time, and when it is locked by an alarm and stands still its pen is up.

// The one of the firmware's own tests.
#[path = "../../../firmware/tests/common/flash.rs"]
mod flash;

use penvis_firmware::{Axes, Hardware, Machine, Pen, Settings};

use flash::RamFlash;

/// Step interrupts in which the firmware must have answered, or be about something that takes longer.
const MOST_TICKS: u32 = 20_000;

/// Turns of the main loop between two step interrupts: more would be a loop without end.
const MOST_TURNS: u32 = 100_000;

/// Bytes between two looks at the state.
const LOOK_EVERY: usize = 32;

/// A plotter with a limit switch at the lower end of each axis.
#[derive(Debug, Default)]
struct Parts {
    position: [i32; 3],
    negative: Axes,
    pen: Pen,
}

/// Steps at and below which a switch is closed.
const SWITCH: i32 = -40;

impl Hardware for Parts {
    fn set_directions(&mut self, negative: Axes) {
        self.negative = negative;
    }

    fn step(&mut self, axes: Axes) {
        for axis in (0..3).filter(|axis| axes.contains(*axis)) {
            self.position[axis] += if self.negative.contains(axis) { -1 } else { 1 };
        }
    }

    fn set_pen(&mut self, pen: Pen) {
        self.pen = pen;
    }

    fn limits(&mut self) -> Axes {
        let mut closed = Axes::NONE;
        (0..3).filter(|axis| self.position[*axis] <= SWITCH).for_each(|axis| closed.insert(axis));
        closed
    }
}

/// A machine, and what it has said since it was last looked at.
struct Sim {
    machine: Machine<Parts, 15, RamFlash>,
    said: Vec<u8>,
    ticks: u32,
}

impl Sim {
    fn new(changes: &[(u16, f64)], memory: RamFlash) -> Self {
        let mut settings = Settings::default();
        for &(id, value) in changes {
            settings.set(id, value).expect("a setting in its range");
        }
        Self { machine: Machine::with_storage(Parts::default(), settings, memory), said: Vec::new(), ticks: 0 }
    }

    /// Lets the main loop work until it waits.
    fn settle(&mut self) {
        let mut turns = 0;
        while self.machine.poll() {
            self.said.extend(std::iter::from_fn(|| self.machine.transmit()));
            turns += 1;
            assert!(turns < MOST_TURNS, "the main loop has no end");
        }
        self.said.extend(std::iter::from_fn(|| self.machine.transmit()));
    }

    /// The main loop, and a step interrupt. False when it has had its time.
    fn turn(&mut self) -> bool {
        self.settle();
        self.machine.tick();
        self.ticks += 1;
        self.ticks < MOST_TICKS
    }

    /// Hears the bytes at the pace at which it reads them. False when it has had its time.
    fn hear(&mut self, bytes: &[u8]) -> bool {
        for &byte in bytes {
            while self.machine.rx_free() == 0 {
                if !self.turn() {
                    return false;
                }
            }
            self.machine.receive(byte);
        }
        true
    }

    /// Has it hear all, and looks at it now and then. `question` is a real-time question, and `locked` tells whether its answer says that it is locked.
    fn run(&mut self, bytes: &[u8], question: &[u8], locked: impl Fn(&str) -> bool) {
        let mut goes_on = true;
        for part in bytes.chunks(LOOK_EVERY) {
            goes_on = goes_on && self.hear(part);
            self.look(question, &locked);
        }
        while goes_on && !self.machine.is_idle() && self.turn() {}
        self.look(question, &locked);
        assert_eq!(self.machine.lost_bytes(), 0);
        let steps: Vec<i32> = self.machine.hardware().position.to_vec();
        assert!(steps.iter().all(|s| s.abs() < i32::MAX / 2), "{steps:?}");
    }

    /// When it is locked and stands still, its pen is up.
    fn look(&mut self, question: &[u8], locked: impl Fn(&str) -> bool) {
        self.settle();
        self.said.clear();
        question.iter().for_each(|byte| self.machine.receive(*byte));
        self.settle();
        let answer = String::from_utf8_lossy(&self.said).into_owned();
        if locked(&answer) && self.machine.is_still() {
            // What was handed to the stepper last is still to be done.
            self.turn();
            if self.machine.is_still() {
                assert_eq!(self.machine.hardware().pen, Pen::Off, "{answer}");
            }
        }
    }
}

fn is_alarm(report: &str) -> bool {
    report.contains("<Alarm") || report.contains("<Sleep")
}

/// Bytes as they are.
pub(super) fn lines(bytes: &[u8]) {
    let mut sim = Sim::new(&[(450, 1.0)], RamFlash::default());
    sim.run(bytes, b"?", is_alarm);
    assert!(sim.said.is_ascii());
}

/// Words of which lines are made, one a byte.
const WORDS: &[&str] = &[
    "\n",
    "G0",
    "G1",
    "G2",
    "G3",
    "G4P0.01",
    "G10L2P1",
    "G10L20P0",
    "G17",
    "G18",
    "G19",
    "G20",
    "G21",
    "G28",
    "G28.1",
    "G30",
    "G30.1",
    "G43.1",
    "G49",
    "G53",
    "G54",
    "G55",
    "G59",
    "G61",
    "G80",
    "G90",
    "G91",
    "G92",
    "G92.1",
    "G93",
    "G94",
    "M0",
    "M2",
    "M3",
    "M4",
    "M5",
    "M7",
    "M8",
    "M9",
    "N5",
    "S0",
    "S500",
    "S1000",
    "T1",
    "X0",
    "X5",
    "X-5",
    "X.01",
    "X500",
    "Y0",
    "Y7.5",
    "Y-3",
    "Z0",
    "Z1",
    "I2",
    "J-2",
    "K1",
    "R5",
    "R-5",
    "F100",
    "F6000",
    "F1",
    "$H\n",
    "$X\n",
    "$J=",
    "$SLP\n",
    "$C\n",
    "$RST=#\n",
    "$N0=",
    "$I=",
    "$21=1\n",
    "$20=1\n",
    "$22=9\n",
    "$22=0\n",
    "$41=1\n",
    "$32=1\n",
    "$32=0\n",
    "$100=20\n",
    "$$\n",
    "$#\n",
    "$G\n",
    "!",
    "~",
    "?",
    "(c)",
    ";",
    "/",
];

/// Real-time bytes after the words.
const SIGNS: &[u8] = &[0x18, 0x84, 0x85, 0x90, 0x91, 0x92, 0x95, 0x97, 0x99, 0x9a, 0x9b, 0x9e, 0xa0, 0xa1];

/// Each byte is a word, a real-time byte, or a while of motion.
pub(super) fn gcode(bytes: &[u8]) {
    let mut sim = Sim::new(&[(450, 1.0), (21, 1.0), (22, 9.0), (130, 8.0), (131, 8.0), (27, 0.5)], RamFlash::default());
    for part in bytes.chunks(LOOK_EVERY) {
        for &byte in part {
            let index = usize::from(byte);
            if let Some(word) = WORDS.get(index) {
                if !sim.hear(word.as_bytes()) {
                    return;
                }
            } else if let Some(sign) = SIGNS.get(index - WORDS.len()) {
                sim.machine.receive(*sign);
                sim.settle();
            } else if !(0..byte).all(|_| sim.turn()) {
                return;
            }
        }
        sim.look(b"?", is_alarm);
    }
    sim.run(b"\n", b"?", is_alarm);
}

/// HPGL, after a byte that says whether the machine homes, and whether it knows the language by itself.
pub(super) fn hpgl(bytes: &[u8]) {
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let (language, homing) = (if first & 1 == 0 { 2.0 } else { 0.0 }, if first & 2 == 0 { 0.0 } else { 9.0 });
    let changes = [(450, language), (22, homing), (21, 1.0), (452, 1.0), (130, 50.0), (131, 40.0), (27, 0.5)];
    let mut sim = Sim::new(&changes, RamFlash::default());
    let mut goes_on = true;
    for part in bytes.chunks(LOOK_EVERY) {
        goes_on = goes_on && sim.hear_hpgl(part);
        sim.settle();
    }
    while goes_on && !sim.machine.is_idle() && sim.turn() {}
    sim.said.clear();
    // Whatever was half said of device control, and whether it is programmed off, ends here; and if it is G-code, that asks too.
    for byte in b"::\x1b.(\x1b.R\x1b.O?" {
        sim.machine.receive(*byte);
    }
    sim.settle();
    let answer = String::from_utf8_lossy(&sim.said).into_owned();
    let status = answer.split('\r').filter_map(|line| line.trim().parse::<u32>().ok()).next_back();
    if status.is_some_and(|status| status & 32 != 0) || is_alarm(&answer) {
        for _ in 0..4 {
            sim.turn();
        }
        if sim.machine.is_still() {
            assert_eq!(sim.machine.hardware().pen, Pen::Off, "{answer}");
        }
    }
}

impl Sim {
    /// Like [`Sim::hear`], where `ESC.@` may have made the buffer smaller than what waits in it.
    fn hear_hpgl(&mut self, bytes: &[u8]) -> bool {
        for &byte in bytes {
            let mut patience = 2000;
            while self.machine.rx_free() == 0 && patience > 0 {
                patience -= 1;
                if !self.turn() {
                    return false;
                }
            }
            self.machine.receive(byte);
        }
        true
    }
}

/// The memory: the first two bytes say after how many bytes of work the power goes, the rest is what is stored, laid over two records as they are written.
pub(super) fn storage(bytes: &[u8]) {
    let Some(([a, b], bytes)) = bytes.split_first_chunk() else { return };
    // Two good records.
    let mut sim = Sim::new(&[], RamFlash::default());
    sim.run(b"$100=40\nG10L2P1X5\n", b"?", is_alarm);
    let mut memory = sim.machine.storage().clone();
    for (into, byte) in memory.bytes.iter_mut().zip(bytes) {
        *into ^= byte;
    }
    let before = parameters(memory.clone());
    // A write that may be cut off.
    let mut cut = memory.clone();
    cut.left = usize::from(u16::from_le_bytes([*a, *b]));
    let mut sim = Sim::new(&[], cut);
    sim.settle();
    sim.said.clear();
    sim.hear(b"\n$X\nG10L2P2Y3\n");
    sim.settle();
    while !sim.machine.is_idle() && sim.turn() {}
    let done = String::from_utf8_lossy(&sim.said).ends_with("ok\r\n");
    let mut after = sim.machine.storage().clone();
    after.left = usize::MAX;
    let after = parameters(after);
    if done {
        assert!(after.contains("[G55:"), "{after}");
    } else {
        assert!(after == before || after.contains("[G55:") && after.contains(",3.000,"), "{before}\n{after}");
    }
}

/// What a machine with this memory tells of it.
fn parameters(memory: RamFlash) -> String {
    let mut sim = Sim::new(&[], memory);
    sim.settle();
    // Start-up lines take their time.
    while !sim.machine.is_idle() && sim.turn() {}
    sim.machine.receive(0x18);
    sim.settle();
    sim.said.clear();
    sim.hear(b"$#\n$N\n");
    while !sim.machine.is_idle() && sim.turn() {}
    String::from_utf8_lossy(&sim.said).into_owned()
}

//! The firmware on emulated boards: built for their processors, run in QEMU, spoken to over serial ports.
//!
//! What is needed beside a host's compiler are its bare-metal target and `qemu-system-arm`. Where one is missing the tests say so and pass, unless
//! `PENVIS_REQUIRE_EMULATOR` is set: then they fail.

mod qemu;

use qemu::{Board, Emulator};

/// Boots, introduces itself, and says which firmware it is.
#[test]
fn boards_boot_and_answer() {
    for board in [Board::Mps2An386, Board::Mps2An500] {
        let Some(mut emulator) = Emulator::boot(board) else { return };
        assert_eq!(emulator.read_line(), "");
        assert_eq!(emulator.read_line(), "Grbl 1.1h ['$' for help]");
        emulator.send(b"$I\n");
        assert_eq!(emulator.read_line(), "[VER:1.1h.penvis:]");
        assert!(emulator.read_line().starts_with("[OPT:"));
        assert_eq!(emulator.read_line(), "ok");
    }
}

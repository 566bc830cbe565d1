//! What an HPGL plotter's numbers mean.

use super::flow::FREE_MIN;

/// `ESC.O`: the buffer is empty.
pub(super) const STATUS_EMPTY: u32 = 8;
/// `ESC.O`: what holds the plotter, and what its user is told.
pub(super) const HALTS: [(u32, &str); 2] = [
    (16, "VIEW is pressed: the plotter goes on when it is pressed again"),
    (32, "the paper lever is raised: the plotter goes on when paper is loaded"),
];
/// `ESC.E`: output was asked for before the last one was read, which our own questions may do; it loses no instruction.
pub(super) const OUTPUT_OVERLAPS: u32 = 10;

/// Whether a number may be one of `OE;` for an error.
pub(super) fn is_error(number: usize) -> bool {
    (1..FREE_MIN).contains(&number)
}

/// The meaning of `OE;`'s number.
#[must_use]
pub(super) fn instruction_error(number: u32) -> &'static str {
    match number {
        1 => "an unknown instruction",
        2 => "a wrong number of parameters",
        3 => "a parameter out of range",
        5 => "an unknown character set",
        6 => "a position out of range",
        _ => "see its manual",
    }
}

/// The meaning of `ESC.E`'s number.
#[must_use]
pub(super) fn line_error(number: u32) -> &'static str {
    match number {
        OUTPUT_OVERLAPS => "output asked for before the last one was read",
        11 => "an unknown device control instruction",
        12 | 13 => "a wrong parameter of a device control instruction",
        14 => "too many parameters of a device control instruction",
        15 => "a framing, parity or overrun error: look at --baud and the cable",
        16 => "its buffer overflowed and bytes were lost",
        _ => "see its manual",
    }
}

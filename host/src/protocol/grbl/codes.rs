//! What GRBL 1.1's numbers mean.

/// The meaning of `error:n`.
#[must_use]
pub(super) fn error(code: u32) -> &'static str {
    match code {
        1 => "a word must begin with a letter",
        2 => "a number is missing or badly written",
        3 => "unknown `$` command",
        4 => "a value is negative that must be positive",
        5 => "homing is not switched on ($22)",
        6 => "the step pulse must be 3 µs or longer",
        7 => "the settings could not be read and were restored to their defaults",
        8 => "this `$` command works only while the plotter is idle",
        9 => "G-code is locked after an alarm: home with `$H` or unlock with `$X`",
        10 => "soft limits need homing ($22)",
        11 => "the line is too long",
        12 => "the step rate is beyond what the controller can do",
        13 => "the safety door is open",
        14 => "a start-up line is too long to be stored",
        15 => "a jog leaves the machine's travel",
        16 => "a jog command is incomplete or holds something else",
        17 => "laser mode needs a PWM output",
        18 => "homing is not set up",
        20 => "unsupported or unknown command",
        21 => "two commands of one modal group in a line",
        22 => "the feed rate was never set",
        23 => "this command takes a whole number",
        24 => "two commands in a line both want the axis words",
        25 => "a word is repeated",
        26 => "this command needs axis words",
        27 => "the line number is out of range",
        28 => "a value that this command needs is missing",
        29 => "only the work coordinate systems G54 to G59 exist",
        30 => "G53 goes only with G0 and G1",
        31 => "axis words that no command uses",
        32 => "an arc needs axis words of its plane",
        33 => "the target is not valid for this arc or probe",
        34 => "no arc of this radius reaches the target",
        35 => "an arc needs its centre within the plane",
        36 => "words that no command uses",
        37 => "G43.1 is set for another axis",
        38 => "the tool number is too large",
        _ => "a number of this controller's own; see its manual",
    }
}

/// The meaning of `ALARM:n`.
#[must_use]
pub(super) fn alarm(code: u32) -> &'static str {
    match code {
        1 => "a hard limit switch was hit",
        2 => "a move would leave the travel (soft limit)",
        3 => "it was reset while it moved",
        4 => "the probe was not in its initial state",
        5 => "the probe found nothing",
        6 => "homing was interrupted by a reset",
        7 => "homing was interrupted by the safety door",
        8 => "homing did not leave the limit switch",
        9 => "homing did not find the limit switch",
        10 => "homing did not find the second limit switch of an axis with two motors",
        _ => "a number of this controller's own; see its manual",
    }
}

/// Whether a word is one of the states of GRBL and its kin, other than idle; anything else in a report is noise.
#[must_use]
pub(super) fn is_busy_state(state: &str) -> bool {
    matches!(state, "Alarm" | "Run" | "Jog" | "Home" | "Hold" | "Door" | "Check" | "Sleep" | "Tool")
}

/// What to do about a state in which a job cannot begin.
#[must_use]
pub(super) fn advice(state: &str) -> &'static str {
    match state {
        "Alarm" => "look at the machine, then home it with `$H` or unlock it with `$X`",
        "Run" | "Jog" | "Home" => "wait until it has come to rest",
        "Hold" => "resume it (`~`) or reset it (Ctrl-X)",
        "Door" => "close the safety door",
        "Check" => "leave the check mode with `$C`",
        "Sleep" => "reset it",
        _ => "bring it to `Idle`",
    }
}

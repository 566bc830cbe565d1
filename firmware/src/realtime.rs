//! Real-time commands: single bytes that are obeyed at once, wherever they stand, and never enter a line.

/// A change to an override, in percent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Override {
    /// Set to this percentage.
    Set(u8),
    /// Add this percentage.
    Add(i8),
}

impl Override {
    /// What it makes of `percent`: 10 to 200.
    #[must_use]
    pub fn apply(self, percent: u8) -> u8 {
        match self {
            Self::Set(percent) => percent,
            Self::Add(change) => percent.saturating_add_signed(change),
        }
        .clamp(10, 200)
    }
}

/// A real-time command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RealTime {
    /// `?`: answer with a status report.
    StatusReport,
    /// `~`: resume.
    CycleStart,
    /// `!`: stop with deceleration, keeping the position.
    FeedHold,
    /// 0x18: forget everything.
    SoftReset,
    /// 0x84: the safety door is open: stop, and lift the pen.
    Door,
    /// 0x85: cancel a jog.
    JogCancel,
    /// 0x90–0x94: feed override, 10 to 200 %.
    Feed(Override),
    /// 0x95–0x97: rapid override, 100, 50 or 25 %.
    Rapid(u8),
    /// 0x99–0x9D: spindle override, 10 to 200 %: how far S lowers the pen.
    Pen(Override),
    /// 0x9E: lifts the pen while the machine holds, and puts it down again.
    TogglePen,
    /// 0xA0: flood on or off.
    ToggleFlood,
    /// 0xA1: mist on or off.
    ToggleMist,
    /// Any other byte from 0x80 up: dropped.
    Unassigned,
}

impl RealTime {
    /// The command that `byte` is, or `None` when the byte belongs to a line.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Option<Self> {
        Some(match byte {
            b'?' => Self::StatusReport,
            b'~' => Self::CycleStart,
            b'!' => Self::FeedHold,
            0x18 => Self::SoftReset,
            0x84 => Self::Door,
            0x85 => Self::JogCancel,
            0x90 => Self::Feed(Override::Set(100)),
            0x91 => Self::Feed(Override::Add(10)),
            0x92 => Self::Feed(Override::Add(-10)),
            0x93 => Self::Feed(Override::Add(1)),
            0x94 => Self::Feed(Override::Add(-1)),
            0x95 => Self::Rapid(100),
            0x96 => Self::Rapid(50),
            0x97 => Self::Rapid(25),
            0x99 => Self::Pen(Override::Set(100)),
            0x9a => Self::Pen(Override::Add(10)),
            0x9b => Self::Pen(Override::Add(-10)),
            0x9c => Self::Pen(Override::Add(1)),
            0x9d => Self::Pen(Override::Add(-1)),
            0x9e => Self::TogglePen,
            0xa0 => Self::ToggleFlood,
            0xa1 => Self::ToggleMist,
            0x80.. => Self::Unassigned,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_printable_but_three_belongs_to_lines() {
        for byte in 0..=u8::MAX {
            let real_time = matches!(byte, b'?' | b'~' | b'!' | 0x18 | 0x80..);
            assert_eq!(RealTime::from_byte(byte).is_some(), real_time, "{byte:#x}");
        }
    }
}

//! What a line or a motion can be refused for, with GRBL 1.1's numbers.

use core::fmt;

macro_rules! numbered {
    ($(#[$doc:meta])* $name:ident { $($(#[$var_doc:meta])* $var:ident = $n:literal, $text:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum $name { $($(#[$var_doc])* #[doc = $text] $var = $n,)* }

        impl $name {
            /// The number that the sender sees.
            #[must_use]
            pub const fn code(self) -> u8 {
                self as u8
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self { $(Self::$var => $text,)* })
            }
        }

        impl core::error::Error for $name {}
    };
}

numbered! {
    /// Why a line was answered with `error:n`. Nothing of such a line has been obeyed.
    Error {
        ExpectedCommandLetter = 1, "a word must start with a letter";
        BadNumber = 2, "the number after a letter is missing or malformed";
        InvalidStatement = 3, "the `$` command is unknown or malformed";
        NegativeValue = 4, "the value must not be negative (or zero, for a scale or a limit)";
        HomingDisabled = 5, "homing is off: set $22=1 and $44 if there are home switches, else move the pen to the origin by hand";
        PulseTooShort = 6, "the step pulse must last at least 3 µs";
        StorageFailed = 7, "the stored settings are damaged (the defaults are in force), or could not be written";
        NotIdle = 8, "this command needs the machine idle or in alarm: wait for the motion to end";
        Locked = 9, "locked by an alarm: send $X first";
        LineOverflow = 11, "the line has more than 79 characters after stripping";
        StepRateTooHigh = 12, "steps per mm times the maximum rate exceeds the step rate of the firmware";
        TravelExceeded = 15, "the jog would leave the travel of the machine";
        InvalidJog = 16, "a jog needs an F word and only G20 G21 G53 G90 G91 besides";
        UnsupportedCommand = 20, "the G or M code or the word is not supported";
        ModalGroupViolation = 21, "two codes of one modal group on a line";
        UndefinedFeedRate = 22, "no feed rate: give F before or on the first G1, G2 or G3";
        NotInteger = 23, "the code or value must be a whole number";
        AxisCommandConflict = 24, "two codes of the line both want the axis words";
        WordRepeated = 25, "a word is repeated";
        NoAxisWords = 26, "the code needs axis words";
        InvalidLineNumber = 27, "the line number exceeds 10000000";
        ValueWordMissing = 28, "the code needs a value word (P for G4)";
        NoSuchSystem = 29, "there are the coordinate systems P1 to P6 (G54 to G59), and P0 for the one in use";
        G53NeedsRapidOrLinear = 30, "G53 works only with G0 and G1";
        AxisWordsUnused = 31, "axis words, but no motion mode is active";
        NoAxisWordsInPlane = 32, "the arc has no axis word in its plane";
        InvalidTarget = 33, "the target cannot be reached: radii differ, the end is the start, or it is out of range";
        ArcRadius = 34, "no circle of radius R passes through start and end";
        NoOffsetsInPlane = 35, "the arc has neither R nor a centre offset in its plane";
        UnusedWords = 36, "value words that nothing on the line uses";
        ToolLengthNotZ = 37, "G43.1 needs a Z word and no other axis";
        ToolNumberTooLarge = 38, "the tool number exceeds 255";
        SceneInvalid = 90, "the stored scene is none, is damaged, or cannot be seen";
        SceneTooLarge = 91, "the stored scene is longer than the room for it";
        OutOfMemory = 92, "drawing the stored scene needs more memory than there is";
        DrawingStopped = 93, "drawing the stored scene was stopped";
    }
}

numbered! {
    /// Why the machine stopped and locked itself, as `ALARM:n`.
    Alarm {
        HardLimit = 1, "a limit switch closed: the position may be lost; reset, then $H or $X";
        SoftLimit = 2, "a target beyond the travel of the machine: reset, then $X";
        AbortedInMotion = 3, "reset while moving: the position is lost";
        HomingReset = 6, "reset while homing";
        HomingDoor = 7, "the safety door opened while homing";
        HomingPullOff = 8, "the home switch stayed closed after the pull-off: raise $27 or look at the wiring";
        HomingNotFound = 9, "no home switch within one and a half times the travel: look at $23, $44, $130 and the wiring";
    }
}

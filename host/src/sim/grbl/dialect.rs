//! Where GRBL's descendants differ from it.

/// Whose firmware it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Dialect {
    /// GRBL 1.1h on a board with eight bits.
    Grbl,
    /// grblHAL: one answer for `\r\n`, and after an error none of the lines that follow is carried out.
    GrblHal,
    /// FluidNC: one answer for `\r\n`, long lines cut off, and a greeting of its own.
    FluidNc,
}

impl Dialect {
    /// The name of its port.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Grbl => "grbl",
            Self::GrblHal => "grblhal",
            Self::FluidNc => "fluidnc",
        }
    }

    /// Bytes of the receive ring.
    pub(super) fn ring(self) -> usize {
        match self {
            Self::Grbl => 128,
            Self::GrblHal => 1024,
            Self::FluidNc => 256,
        }
    }

    /// Blocks of the planner.
    pub(super) fn blocks(self) -> usize {
        match self {
            Self::GrblHal => 35,
            Self::Grbl | Self::FluidNc => 15,
        }
    }

    /// Characters of a line.
    pub(super) fn line_max(self) -> usize {
        match self {
            Self::Grbl => 79,
            Self::GrblHal => 256,
            Self::FluidNc => 254,
        }
    }

    /// Whether a line that is too long is cut off and not refused.
    pub(super) fn cuts_lines_off(self) -> bool {
        self == Self::FluidNc
    }

    /// Whether each of `\r` and `\n` ends a line, also when one follows the other.
    pub(super) fn ends_lines_twice(self) -> bool {
        self == Self::Grbl
    }

    /// Whether lines after an error are refused with it, until an empty one or a `$` command that is not.
    pub(super) fn refuses_on(self) -> bool {
        self == Self::GrblHal
    }

    /// Whether it hears nothing while it stores settings.
    pub(super) fn is_deaf_while_storing(self) -> bool {
        self == Self::Grbl
    }

    /// What it says after a reset.
    pub(super) fn banner(self) -> &'static str {
        match self {
            Self::Grbl => "\r\nGrbl 1.1h ['$' for help]\r\n",
            Self::GrblHal => "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n",
            Self::FluidNc => "\r\nGrbl 3.7 [FluidNC v3.7.8 (noradio) '$' for help]\r\n",
        }
    }

    /// What `$I` tells.
    pub(super) fn build(self, blocks: usize, ring: usize) -> String {
        match self {
            Self::Grbl => format!("[VER:1.1h.20190830:]\r\n[OPT:V,{blocks},{ring}]\r\n"),
            Self::GrblHal => format!(
                "[VER:1.1f.20240817:]\r\n[OPT:VNMSL,{blocks},{ring},3,0]\r\n[NEWOPT:ENUMS,RT-,SD]\r\n[FIRMWARE:grblHAL]\r\n"
            ),
            Self::FluidNc => "[VER:3.7 FluidNC v3.7.8:]\r\n[OPT:MPHS]\r\n[MSG: Machine: plotter]\r\n".to_owned(),
        }
    }
}

//! How sure an answer is.

/// How a visibility was decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Certainty {
    /// Every step had a certificate.
    Proven,
    /// Some step rested on a stated tolerance.
    Tolerance,
    /// Not decided; listed with its place.
    Undecided,
}

impl Certainty {
    /// The word for it in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Proven => "proven",
            Self::Tolerance => "tolerance",
            Self::Undecided => "undecided",
        }
    }
}

//! The `$` commands.

use crate::error::Error;
use crate::number;

/// What `$RST=` restores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Restore {
    /// `$`
    Settings,
    /// `#`: coordinate systems, the places of G28 and G30, and G92.
    Offsets,
    /// `*`: these, start-up lines and the text of `$I=`.
    All,
}

/// A parsed `$` line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SystemCommand<'a> {
    /// `$`
    Help,
    /// `$$`
    Settings,
    /// `$#`
    Parameters,
    /// `$G`
    Modal,
    /// `$I`
    Version,
    /// `$I=text`
    Name(&'a [u8]),
    /// `$N`
    StartupLines,
    /// `$N0=line`, `$N1=line`
    StartupLine(usize, &'a [u8]),
    /// `$C`
    CheckMode,
    /// `$X`
    Unlock,
    /// `$H`, and `$HX` for one axis.
    Home(Option<usize>),
    /// `$SLP`
    Sleep,
    /// `$RST=`
    Restore(Restore),
    /// `$n=value`
    Set(u16, f64),
}

/// Parses a stripped line that starts with `$` (but not `$J=`, which is G-code).
///
/// # Errors
/// [`Error::InvalidStatement`]; [`Error::BadNumber`] for a malformed setting.
pub(crate) fn parse(line: &[u8]) -> Result<SystemCommand<'_>, Error> {
    Ok(match line {
        b"$" => SystemCommand::Help,
        b"$$" => SystemCommand::Settings,
        b"$#" => SystemCommand::Parameters,
        b"$G" => SystemCommand::Modal,
        b"$I" => SystemCommand::Version,
        [b'$', b'I', b'=', name @ ..] => SystemCommand::Name(name),
        b"$N" => SystemCommand::StartupLines,
        [b'$', b'N', index @ b'0'..=b'1', b'=', line @ ..] => {
            SystemCommand::StartupLine(usize::from(index - b'0'), line)
        }
        b"$C" => SystemCommand::CheckMode,
        b"$X" => SystemCommand::Unlock,
        b"$H" => SystemCommand::Home(None),
        [b'$', b'H', axis @ b'X'..=b'Z'] => SystemCommand::Home(Some(usize::from(axis - b'X'))),
        b"$SLP" => SystemCommand::Sleep,
        b"$RST=$" => SystemCommand::Restore(Restore::Settings),
        b"$RST=#" => SystemCommand::Restore(Restore::Offsets),
        b"$RST=*" => SystemCommand::Restore(Restore::All),
        [b'$', setting @ ..] if setting.first().is_some_and(u8::is_ascii_digit) => {
            let (id, rest) = number::parse(setting).ok_or(Error::BadNumber)?;
            let [b'=', value @ ..] = rest else { return Err(Error::InvalidStatement) };
            let (value, rest) = number::parse(value).ok_or(Error::BadNumber)?;
            if !rest.is_empty() || id > f64::from(u16::MAX) || id != libm::floor(id) {
                return Err(Error::InvalidStatement);
            }
            SystemCommand::Set(id as u16, value)
        }
        _ => return Err(Error::InvalidStatement),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table() {
        for (line, expect) in [
            ("$", Ok(SystemCommand::Help)),
            ("$$", Ok(SystemCommand::Settings)),
            ("$100=80.5", Ok(SystemCommand::Set(100, 80.5))),
            ("$13=-1", Ok(SystemCommand::Set(13, -1.0))),
            ("$100", Err(Error::InvalidStatement)),
            ("$100=", Err(Error::BadNumber)),
            ("$1.5=3", Err(Error::InvalidStatement)),
            ("$65536=3", Err(Error::InvalidStatement)),
            ("$HY", Ok(SystemCommand::Home(Some(1)))),
            ("$HA", Err(Error::InvalidStatement)),
            ("$N1=G20", Ok(SystemCommand::StartupLine(1, b"G20"))),
            ("$N2=G20", Err(Error::InvalidStatement)),
            ("$I=", Ok(SystemCommand::Name(b""))),
            ("$1=3X", Err(Error::InvalidStatement)),
            ("$Q", Err(Error::InvalidStatement)),
            ("$RST=#", Ok(SystemCommand::Restore(Restore::Offsets))),
        ] {
            assert_eq!(parse(line.as_bytes()), expect, "{line}");
        }
    }
}

//! The `$` commands.

use crate::error::Error;
use crate::number;

/// A parsed `$` line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SystemCommand {
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
    /// `$N`: there are no start-up lines, and both are listed as empty.
    StartupLines,
    /// `$C`
    CheckMode,
    /// `$X`
    Unlock,
    /// `$H`
    Home,
    /// `$RST=$` and `$RST=*`
    RestoreSettings,
    /// `$RST=#`
    ClearOffsets,
    /// `$n=value`
    Set(u16, f64),
}

/// Parses a stripped line that starts with `$` (but not `$J=`, which is G-code).
///
/// # Errors
/// [`Error::InvalidStatement`]; [`Error::BadNumber`] for a malformed setting.
pub(crate) fn parse(line: &[u8]) -> Result<SystemCommand, Error> {
    Ok(match line {
        b"$" => SystemCommand::Help,
        b"$$" => SystemCommand::Settings,
        b"$#" => SystemCommand::Parameters,
        b"$G" => SystemCommand::Modal,
        b"$I" => SystemCommand::Version,
        b"$N" => SystemCommand::StartupLines,
        b"$C" => SystemCommand::CheckMode,
        b"$X" => SystemCommand::Unlock,
        b"$H" => SystemCommand::Home,
        b"$RST=$" | b"$RST=*" => SystemCommand::RestoreSettings,
        b"$RST=#" => SystemCommand::ClearOffsets,
        [b'$', setting @ ..] if setting.first().is_some_and(u8::is_ascii_digit) => {
            let (id, rest) = number::parse(setting).ok_or(Error::BadNumber)?;
            let [b'=', value @ ..] = rest else { return Err(Error::InvalidStatement) };
            let (value, rest) = number::parse(value).ok_or(Error::BadNumber)?;
            if !rest.is_empty() || id > 255.0 || id != libm::floor(id) {
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
            ("$256=3", Err(Error::InvalidStatement)),
            ("$1=3X", Err(Error::InvalidStatement)),
            ("$Q", Err(Error::InvalidStatement)),
            ("$RST=#", Ok(SystemCommand::ClearOffsets)),
        ] {
            assert_eq!(parse(line.as_bytes()), expect, "{line}");
        }
    }
}

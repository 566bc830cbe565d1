//! Lines as they go over the line: numbered and with their checksum to Marlin, and what Marlin says.

/// A line with its number and checksum, and its end.
pub(super) fn numbered(number: u32, text: &str) -> String {
    let line = format!("N{number}{text}");
    let checksum = line.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("{line}*{checksum}\n")
}

/// What Marlin says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer<'a> {
    /// A line was taken: that of this number, where it tells.
    Ok(Option<u32>),
    /// It wants the lines from this number on.
    Resend(u32),
    /// It has begun anew.
    Start,
    /// It has stopped for good.
    Halted,
    /// Something else is wrong.
    Error(&'a str),
    /// It does not know this command.
    Unknown(&'a str),
    /// It is alive, and waits for somebody.
    BusyForUser,
    /// x, y and z, mm.
    Where([f64; 3]),
    /// Something that its user may want to read.
    Message(&'a str),
    /// Nothing of interest, or noise.
    Other,
}

/// Reads a line of Marlin's.
pub(super) fn parse(line: &str) -> Answer<'_> {
    if let Some(rest) = line.strip_prefix("ok") {
        return ok(rest);
    }
    if let Some(number) = line.strip_prefix("Resend:").or_else(|| line.strip_prefix("rs ")) {
        return number.trim().parse().map_or(Answer::Other, Answer::Resend);
    }
    if let Some(text) = line.strip_prefix("Error:") {
        let text = text.trim();
        if text.contains("halted") || text.contains("kill") {
            return Answer::Halted;
        }
        // A Resend follows.
        let line_fault = text.contains("Last Line") || text.contains("hecksum") || text.contains("Line Number");
        return if line_fault { Answer::Other } else { Answer::Error(text) };
    }
    if line == "start" {
        return Answer::Start;
    }
    if let Some(text) = line.strip_prefix("echo:").map(str::trim) {
        if let Some(command) = text.strip_prefix("Unknown command:") {
            return Answer::Unknown(command.trim().trim_matches('"'));
        }
        return match text.strip_prefix("busy:") {
            Some(doing) if doing.contains("user") => Answer::BusyForUser,
            _ => Answer::Other,
        };
    }
    if let Some(text) = line.strip_prefix("//action:") {
        return Answer::Message(text);
    }
    place(line).map_or(Answer::Other, Answer::Where)
}

/// `ok`, or with `ADVANCED_OK` `ok N12 P15 B3`.
fn ok(rest: &str) -> Answer<'_> {
    let mut number = None;
    for word in rest.split_whitespace() {
        let mut chars = word.chars();
        let (letter, value) = (chars.next(), chars.as_str().parse::<u32>());
        match (letter, value) {
            (Some('N'), Ok(value)) => number = Some(value),
            (Some('P' | 'B'), Ok(_)) => {}
            // Temperatures may follow; anything else is noise.
            (Some('T'), _) => break,
            _ => return Answer::Other,
        }
    }
    if rest.is_empty() || rest.starts_with(' ') { Answer::Ok(number) } else { Answer::Other }
}

/// `X:10.00 Y:20.00 Z:0.00 E:0.00 Count X:800 Y:1600 Z:0`.
fn place(line: &str) -> Option<[f64; 3]> {
    let (planned, _) = line.split_once(" Count ")?;
    let mut place = [None; 3];
    for word in planned.split_whitespace() {
        let (axis, value) = word.split_once(':')?;
        let slot = match axis {
            "X" => 0,
            "Y" => 1,
            "Z" => 2,
            _ => continue,
        };
        place[slot] = Some(value.parse::<f64>().ok().filter(|value| value.is_finite())?);
    }
    match place {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_marlins_manual() {
        // RepRap's own example: N3 T0*57.
        assert_eq!(numbered(3, " T0"), "N3 T0*57\n");
        assert_eq!(numbered(1000, "M110N1000"), "N1000M110N1000*108\n".replace("108", &checksum("N1000M110N1000")));
    }

    fn checksum(text: &str) -> String {
        text.bytes().fold(0, |sum, byte| sum ^ byte).to_string()
    }

    #[test]
    fn answers() {
        let table = [
            ("ok", Answer::Ok(None)),
            ("ok N12 P15 B3", Answer::Ok(Some(12))),
            ("ok P15 B3", Answer::Ok(None)),
            ("ok T:20.0 /0.0", Answer::Ok(None)),
            ("okk", Answer::Other),
            ("ok ?12", Answer::Other),
            ("ok Nx", Answer::Other),
            ("Resend: 7", Answer::Resend(7)),
            ("Resend:7", Answer::Resend(7)),
            ("Resend: x", Answer::Other),
            ("Error:checksum mismatch, Last Line: 6", Answer::Other),
            ("Error:Line Number is not Last Line Number+1, Last Line: 6", Answer::Other),
            ("Error:Printer halted. kill() called!", Answer::Halted),
            ("Error:Something", Answer::Error("Something")),
            ("start", Answer::Start),
            ("echo:Unknown command: \"G5\"", Answer::Unknown("G5")),
            ("echo:busy: processing", Answer::Other),
            ("echo:busy: paused for user", Answer::BusyForUser),
            ("X:10.00 Y:-2.50 Z:0.00 E:0.00 Count X:800 Y:-200 Z:0", Answer::Where([10.0, -2.5, 0.0])),
            ("X:10.00 Y:-2..50 Z:0.00 E:0.00 Count X:800 Y:-200 Z:0", Answer::Other),
            ("X:10.00 Y:-2.50 E:0.00 Count X:800", Answer::Other),
            ("//action:notification hello", Answer::Message("notification hello")),
            ("", Answer::Other),
        ];
        for (line, expected) in table {
            assert_eq!(parse(line), expected, "{line}");
        }
    }
}

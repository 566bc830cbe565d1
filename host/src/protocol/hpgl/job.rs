//! An HPGL job as it goes over the line, cut into instructions.

use thiserror::Error;

use super::encoded;

const ESC: u8 = 0x1b;
/// Ends a label unless `DT` says otherwise.
const ETX: u8 = 0x03;

/// A job that may be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    instructions: Vec<Vec<u8>>,
}

/// A job that must not be sent.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JobError {
    /// Not HPGL.
    #[error("this is not HPGL: instruction {number} begins with {begin:?}, and must begin with two letters")]
    NotHpgl {
        /// Number of the instruction, from 1.
        number: usize,
        /// What stands there.
        begin: String,
    },
    /// Nothing to send.
    #[error("there is no HPGL instruction in it")]
    Empty,
}

impl Job {
    /// Cuts HPGL into instructions. Each ends in `;` (labels in their terminator).
    ///
    /// Left out are device control instructions (`ESC . …`), which would disturb the handshake, and output instructions (`OA`, `OI`, …),
    /// whose replies nobody waits for. Neither draws anything. Encoded polylines (`PE`) are written out where it is known in
    /// which mode and where the plotter begins them.
    ///
    /// # Errors
    /// [`JobError`].
    pub fn new(hpgl: &[u8]) -> Result<Self, JobError> {
        let mut instructions = Vec::new();
        let mut terminator = ETX;
        let mut rest = hpgl;
        while let Some(&first) = rest.first() {
            if first == ESC {
                rest = after_device_control(rest);
                continue;
            }
            if first == b';' || first.is_ascii_whitespace() || first.is_ascii_control() {
                rest = &rest[1..];
                continue;
            }
            let Some(mnemonic) = rest.get(..2).filter(|m| m.iter().all(u8::is_ascii_alphabetic)) else {
                let begin = String::from_utf8_lossy(&rest[..rest.len().min(8)]).into_owned();
                return Err(JobError::NotHpgl { number: instructions.len() + 1, begin });
            };
            let mnemonic = mnemonic.to_ascii_uppercase();
            let length = 2 + parameters(&mnemonic, &rest[2..], terminator);
            let mut instruction = rest[..length].to_vec();
            rest = &rest[length..];
            if mnemonic == b"DT" {
                terminator = match instruction.get(2) {
                    Some(&byte) if byte != b';' => byte,
                    _ => ETX,
                };
            }
            if mnemonic[0] == b'O' {
                continue;
            }
            if !is_label(&mnemonic) && !instruction.ends_with(b";") {
                instruction.push(b';');
            }
            instructions.push(instruction);
        }
        let instructions = encoded::written_out(instructions);
        if instructions.is_empty() { Err(JobError::Empty) } else { Ok(Self { instructions }) }
    }

    /// The instructions with their ends; at least one.
    #[must_use]
    pub fn instructions(&self) -> &[Vec<u8>] {
        &self.instructions
    }
}

/// Instructions whose text runs to the label terminator.
fn is_label(mnemonic: &[u8]) -> bool {
    matches!(mnemonic, b"LB" | b"BL" | b"WD")
}

/// Bytes of the parameters that follow a mnemonic, with their end when it is `;` or the label terminator.
fn parameters(mnemonic: &[u8], rest: &[u8], terminator: u8) -> usize {
    let through = |end: Option<usize>| end.map_or(rest.len(), |at| at + 1);
    if is_label(mnemonic) {
        return through(rest.iter().position(|byte| *byte == terminator));
    }
    // Encoded coordinates and terminators may be letters: only `;` ends them.
    if mnemonic == b"PE" {
        return through(rest.iter().position(|byte| *byte == b';'));
    }
    if mnemonic == b"DT" || mnemonic == b"SM" {
        return match rest {
            [b';', ..] => 1,
            [_, b';', ..] => 2,
            _ => rest.len().min(1),
        };
    }
    match rest.iter().position(|byte| *byte == b';' || *byte == ESC || byte.is_ascii_alphabetic()) {
        Some(at) if rest[at] == b';' => at + 1,
        Some(at) => at,
        None => rest.len(),
    }
}

/// What follows a device control instruction.
fn after_device_control(rest: &[u8]) -> &[u8] {
    let Some(&kind) = rest.get(2).filter(|_| rest[1] == b'.') else {
        return &rest[1..];
    };
    let after = &rest[3..];
    if !matches!(kind, b'@' | b'H' | b'I' | b'M' | b'N' | b'P' | b'Q' | b'S' | b'T') {
        return after;
    }
    // Parameters are numbers between `;`, and end in `:`; without any, nothing follows.
    let end = after.iter().position(|byte| !(byte.is_ascii_digit() || *byte == b';')).unwrap_or(after.len());
    match after.get(end) {
        Some(b':') => &after[end + 1..],
        _ => after,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_cut() {
        let table: &[(&[u8], &[&str])] = &[
            (b"IN;SP1;PU0,0;PD10,10,20,20;", &["IN;", "SP1;", "PU0,0;", "PD10,10,20,20;"]),
            (b"IN;\r\nSP1;\r\n", &["IN;", "SP1;"]),
            (b"INSP1PU0 0PD10,-10", &["IN;", "SP1;", "PU0 0;", "PD10,-10;"]),
            (b"pu;;pd;", &["pu;", "pd;"]),
            (b"LBPU;1\x03PU;", &["LBPU;1\x03", "PU;"]),
            (b"DT#;LBa;b#PU;", &["DT#;", "LBa;b#", "PU;"]),
            (b"DT;LBa\x03", &["DT;", "LBa\x03"]),
            (b"PE<=aPU7;PU;", &["PE<=aPU7;", "PU;"]),
            (b"IN;PU5,5;PE7a_a`;PU;", &["IN;", "PU5,5;", "PD6,5,7,5;", "PU;"]),
            (b"SM*;PD1,1;SM;", &["SM*;", "PD1,1;", "SM;"]),
            (b"\x1b.@;1:\x1b.(IN;OA;\x1b.B\x1b.I80;0;17:PU;OE;\x1b.K", &["IN;", "PU;"]),
        ];
        for (hpgl, expected) in table {
            let job = Job::new(hpgl).unwrap();
            let texts: Vec<_> = job.instructions().iter().map(|i| String::from_utf8_lossy(i).into_owned()).collect();
            assert_eq!(texts, *expected, "{:?}", String::from_utf8_lossy(hpgl));
        }
    }

    #[test]
    fn what_is_not_hpgl_is_refused() {
        assert_eq!(Job::new(b" ;\n\x1b.B"), Err(JobError::Empty));
        assert!(matches!(Job::new(b"IN;12,3"), Err(JobError::NotHpgl { number: 2, .. })));
        // Counted as in the file, whatever an encoded polyline becomes.
        assert!(matches!(Job::new(b"IN;PU5,5;PE<==aaaa;12,3"), Err(JobError::NotHpgl { number: 4, .. })));
        assert!(matches!(Job::new(b"G21\nG90"), Err(JobError::NotHpgl { number: 1, .. })));
        assert!(matches!(Job::new(b"I"), Err(JobError::NotHpgl { .. })));
        for cut in [&b"\x1b"[..], b"\x1b.", b"\x1b.@", b"LB", b"DT", b"PE<"] {
            let _ = Job::new(cut);
        }
    }
}

//! Asks what is at a port, by questions that move nothing.

use std::io::{ErrorKind, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, SerialPort};

use crate::message::one_line;

/// Speeds that are tried, with what is asked there, how long an answer is waited for, and how it begins.
const ROUNDS: &[(u32, &[Question])] = &[
    (
        115_200,
        &[
            // Boards that are reset by opening the port have a boot loader to run through.
            Question { bytes: b"", wait: Duration::from_secs(2) },
            // GRBL and its kin report at once; to others it is a line not ended.
            Question { bytes: b"?", wait: Duration::from_millis(500) },
            Question { bytes: b"\n$I\n", wait: Duration::from_millis(700) },
            Question { bytes: b"M115\n", wait: Duration::from_secs(1) },
        ],
    ),
    (9600, &[Question { bytes: b"OI;", wait: Duration::from_millis(1500) }]),
];

/// Bytes of an answer that are kept.
const ANSWER_MAX: usize = 4096;

struct Question {
    bytes: &'static [u8],
    wait: Duration,
}

/// What answers at a port, in words.
pub(super) fn probe(path: &str) -> String {
    match ask(path) {
        Ok(Some(what)) => what,
        Ok(None) => "nothing answers".to_owned(),
        Err(e) => format!("cannot be asked: {}", one_line(&e.to_string())),
    }
}

fn ask(path: &str) -> Result<Option<String>, serialport::Error> {
    for (baud, questions) in ROUNDS {
        let mut port = serialport::new(path, *baud).timeout(Duration::from_millis(20)).open()?;
        let mut heard = Vec::new();
        for question in *questions {
            port.write_all(question.bytes)?;
            listen(port.as_mut(), question.wait, &mut heard)?;
            if let Some(what) = identify(&heard) {
                return Ok(Some(format!("{what}, at {baud} baud")));
            }
        }
        // What is not taken yet must not be waited for when the port is closed.
        port.clear(ClearBuffer::Output)?;
    }
    Ok(None)
}

fn listen(port: &mut dyn SerialPort, wait: Duration, heard: &mut Vec<u8>) -> Result<(), serialport::Error> {
    let since = Instant::now();
    let mut buffer = [0; 256];
    while since.elapsed() < wait && heard.len() < ANSWER_MAX {
        match port.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => heard.extend_from_slice(&buffer[..count]),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(e) => return Err(e.into()),
        }
    }
    Ok(())
}

/// Who says this; none as long as that is not clear.
fn identify(heard: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(heard);
    let lines = || text.split(['\r', '\n']).map(str::trim).filter(|line| !line.is_empty());
    let find = |test: &dyn Fn(&str) -> bool| lines().find(|line| test(line)).map(one_line);
    let marlin = find(&|line| line.starts_with("FIRMWARE_NAME:"));
    if let Some(line) = marlin {
        let name = line.trim_start_matches("FIRMWARE_NAME:").split(" SOURCE_CODE_URL").next().unwrap_or_default();
        return Some(format!("Marlin ({}): --device marlin-servo or marlin-z", name.trim()));
    }
    let banner = find(&|line| line.contains("'$' for help") || line.starts_with("[VER:"));
    let device = |line: &str| {
        let line = line.to_ascii_lowercase();
        if line.contains("fluidnc") {
            "fluidnc"
        } else if line.contains("hal") {
            "grblhal"
        } else {
            "grbl-servo or grbl-z"
        }
    };
    if let Some(line) = banner {
        return Some(format!("{line}: --device {}", device(&line)));
    }
    if find(&|line| line.starts_with('<') && line.ends_with('>') && line.contains('|')).is_some() {
        return Some("GRBL or one of its kin: --device grbl-servo, grbl-z, grblhal or fluidnc".to_owned());
    }
    // The answer to `OI;`: a model such as 7475A, or DXY-1100.
    let model = find(&|line| {
        let digits = line.chars().filter(char::is_ascii_digit).count();
        digits >= 3 && line.len() <= 12 && line.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | ','))
    });
    model.map(|model| format!("an HPGL plotter, {model}: --device hp{} or the nearest", model.to_ascii_lowercase()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_tell_who_gives_them() {
        let table = [
            ("\r\nGrbl 1.1h ['$' for help]\r\n", Some("Grbl 1.1h ['$' for help]: --device grbl-servo or grbl-z")),
            ("\r\n[VER:1.1f.20230101 grblHAL:]\r\n", Some("--device grblhal")),
            ("\r\nGrbl 3.7 [FluidNC v3.7 (wifi) '$' for help]\r\n", Some("--device fluidnc")),
            ("<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n", Some("GRBL or one of its kin")),
            (
                "FIRMWARE_NAME:Marlin 2.1.2 (x) SOURCE_CODE_URL:y MACHINE_TYPE:z\nok\n",
                Some("Marlin (Marlin 2.1.2 (x))"),
            ),
            ("7475A\r", Some("an HPGL plotter, 7475A: --device hp7475a")),
            ("echo:Unknown command: \"$I\"\nok\n", None),
            ("start\necho: something\n", None),
            ("error:1\r\nok\r\n", None),
            ("", None),
        ];
        for (heard, expected) in table {
            let what = identify(heard.as_bytes());
            match expected {
                Some(expected) => assert!(what.clone().unwrap_or_default().contains(expected), "{heard:?}: {what:?}"),
                None => assert_eq!(what, None, "{heard:?}"),
            }
        }
    }

    #[test]
    fn a_port_that_is_none_is_told_in_a_line() {
        let what = probe("/dev/nowhere");
        assert!(what.starts_with("cannot be asked: ") && !what.contains('\n'), "{what}");
    }
}

//! grbl-streamer by M. Franzl, from the Python package index, in an environment of its own.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

use penvis_tests::skip::skip;

/// The package and the one that it needs, as of the day this was written: what it does must not depend on the day it runs.
const PACKAGES: [&str; 3] = ["grbl-streamer==2.0.2", "gcode-machine==1.0.3", "pyserial==3.5"];

/// A Python that has the package, installed now if it was not; `None`, with a word about it, where that is not possible.
pub(crate) fn python() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("grbl-streamer");
    let python = folder.join("bin/python");
    let whole = folder.join("whole");
    if !whole.exists() {
        let mut environment = Command::new("python3");
        environment.args(["-m", "venv", "--clear"]).arg(&folder);
        let mut install = Command::new(&python);
        install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(PACKAGES);
        for command in [&mut environment, &mut install] {
            if let Err(reason) = run(command) {
                skip("sender", &format!("Python with venv and a package index are needed: {reason}"));
                return None;
            }
        }
        fs::write(whole, "").expect("a folder of this build");
    }
    Some(python)
}

/// Streams `job` to the controller at `port` and returns what the sender says in the end.
///
/// # Panics
/// If it complains.
pub(crate) fn stream(python: &Path, port: &str, job: &str) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("job.gcode");
    fs::write(&file, job).expect("a temporary file");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/emulator/stream.py");
    run(Command::new(python).arg(script).arg(port).arg(file)).expect("a sender that does not complain")
}

/// What a command prints, or what it complains of.
fn run(command: &mut Command) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|e: io::Error| format!("{name}: {e}"))?;
    let said = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if output.status.success() {
        Ok(said)
    } else {
        Err(format!("{name}: {said} {}", String::from_utf8_lossy(&output.stderr).trim()))
    }
}

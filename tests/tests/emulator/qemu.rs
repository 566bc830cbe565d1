//! Building an image and running it in QEMU.

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use std::{env, fs, thread};

/// Longest time that anything may take to boot or to answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// An emulated board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Board {
    /// Cortex-M4 with an f32 unit.
    Mps2An386,
    /// Cortex-M7 with an f64 unit.
    Mps2An500,
}

impl Board {
    /// Its name, in QEMU and in the firmware.
    fn name(self) -> &'static str {
        match self {
            Self::Mps2An386 => "mps2-an386",
            Self::Mps2An500 => "mps2-an500",
        }
    }
}

/// The image of `board`, built now if it is out of date; or why it cannot be built here.
fn image(board: Board) -> Result<PathBuf, String> {
    // Cargo would have them wait for one another anyway, without the output's being in order.
    static BUILDING: Mutex<()> = Mutex::new(());
    let _one = BUILDING.lock().unwrap();

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.ci/firmware");
    let built = Command::new(&script)
        .arg(board.name())
        // Set for this test by the cargo that runs it.
        .env_remove("CARGO_TARGET_DIR")
        .output()
        .map_err(|e| format!("{} cannot be run: {e}", script.display()))?;
    let complaint = String::from_utf8_lossy(&built.stderr).into_owned();
    match built.status.code() {
        Some(0) => {
            let said = String::from_utf8(built.stdout).unwrap();
            Ok(PathBuf::from(said.trim().split_once(' ').unwrap().1))
        }
        Some(3) => Err(complaint.trim().to_owned()),
        _ => panic!("the firmware of {} does not build:\n{complaint}", board.name()),
    }
}

/// A board that runs.
pub(crate) struct Emulator {
    child: Child,
    /// Holds the sockets and the trace.
    _folder: tempfile::TempDir,
    port: BufReader<UnixStream>,
}

impl Emulator {
    /// Switches `board` on, with this program at its port; `None`, with a word about it, where that is not possible.
    ///
    /// # Panics
    /// Where it is not possible although `PENVIS_REQUIRE_EMULATOR` is set.
    pub(crate) fn boot(board: Board) -> Option<Self> {
        match Self::try_boot(board) {
            Ok(emulator) => Some(emulator),
            Err(reason) => {
                assert!(env::var_os("PENVIS_REQUIRE_EMULATOR").is_none(), "no emulated board: {reason}");
                eprintln!("skipped, no emulated board: {reason}");
                None
            }
        }
    }

    fn try_boot(board: Board) -> Result<Self, String> {
        let image = image(board)?;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name).display().to_string();
        let mut child = Command::new("qemu-system-arm")
            .args(["-M", board.name(), "-display", "none", "-monitor", "none", "-semihosting"])
            // A count of instructions is the time, and nobody waits for it to pass.
            .args(["-icount", "shift=5,sleep=off"])
            // The board starts when this program has opened the port, so that nothing it says is lost.
            .args(["-chardev", &format!("socket,id=port,path={},server=on,wait=on", at("port"))])
            .args(["-serial", "chardev:port"])
            .args(["-serial", &format!("file:{}", at("trace"))])
            .args(["-serial", "null"])
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .stdout(fs::File::create(at("output")).unwrap())
            .stderr(fs::File::create(at("errors")).unwrap())
            .spawn()
            .map_err(|e| match e.kind() {
                ErrorKind::NotFound => {
                    "there is no qemu-system-arm: install it (Debian: apt-get install qemu-system-arm)".to_owned()
                }
                _ => format!("qemu-system-arm cannot be run: {e}"),
            })?;
        let deadline = Instant::now() + PATIENCE;
        let port = loop {
            match UnixStream::connect(at("port")) {
                Ok(port) => break port,
                Err(e) => {
                    let ended = child.try_wait().unwrap();
                    if ended.is_some() || Instant::now() > deadline {
                        let _ = child.kill();
                        panic!("QEMU offers no port ({e}): {}", fs::read_to_string(at("errors")).unwrap());
                    }
                    thread::sleep(Duration::from_millis(20));
                }
            }
        };
        port.set_read_timeout(Some(PATIENCE)).unwrap();
        Ok(Self { child, _folder: folder, port: BufReader::new(port) })
    }

    /// Sends `bytes`.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.port.get_mut().write_all(bytes).unwrap();
    }

    /// The next line it says, without its end.
    pub(crate) fn read_line(&mut self) -> String {
        let mut line = Vec::new();
        self.port.read_until(b'\n', &mut line).expect("an answer in time");
        assert!(line.ends_with(b"\r\n"), "a whole line: {:?}", String::from_utf8_lossy(&line));
        line.truncate(line.len() - 2);
        String::from_utf8(line).unwrap()
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself; nothing else can be done about it here.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

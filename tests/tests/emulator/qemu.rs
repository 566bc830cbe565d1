//! Building an image and running it in QEMU.

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use std::{fs, thread};

use penvis_tests::skip::skip;

/// Longest time that a board may take to boot or to answer.
const PATIENCE: Duration = Duration::from_secs(120);

/// Longest time that a board is left running.
const LIFE: Duration = Duration::from_secs(1500);

/// Where the emulated boards have a stored scene.
const SCENE: u32 = (4 << 20) - (64 << 10);

/// An emulated board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Board {
    /// Cortex-M4 with an f32 unit.
    Mps2An386,
    /// Cortex-M7 with an f64 unit.
    Mps2An500,
    /// [`Board::Mps2An386`] with the core on it.
    Mps2An386Scene,
    /// [`Board::Mps2An500`] with the core on it.
    Mps2An500Scene,
}

impl Board {
    /// Its name in the firmware.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Mps2An386 => "mps2-an386",
            Self::Mps2An500 => "mps2-an500",
            Self::Mps2An386Scene => "mps2-an386-scene",
            Self::Mps2An500Scene => "mps2-an500-scene",
        }
    }

    /// Its name in QEMU.
    fn machine(self) -> &'static str {
        match self {
            Self::Mps2An386 | Self::Mps2An386Scene => "mps2-an386",
            Self::Mps2An500 | Self::Mps2An500Scene => "mps2-an500",
        }
    }
}

/// The image of a board, built now if it is out of date; `None`, with a word about it, where it cannot be built.
pub(crate) fn image(name: &str) -> Option<PathBuf> {
    // Cargo would have them wait for one another anyway.
    static BUILDING: Mutex<()> = Mutex::new(());
    let _one = BUILDING.lock();

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.ci/firmware");
    let built = Command::new(&script)
        .arg(name)
        // Set for this test by the cargo that runs it.
        .env_remove("CARGO_TARGET_DIR")
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}", script.display()));
    let complaint = String::from_utf8_lossy(&built.stderr).into_owned();
    match built.status.code() {
        Some(0) => {
            let said = String::from_utf8(built.stdout).expect("a path of this project");
            let (_, path) = said.trim().split_once(' ').expect("a board and its image");
            Some(PathBuf::from(path))
        }
        Some(3) => {
            skip("firmware", complaint.trim());
            None
        }
        _ => panic!("the firmware of {name} does not build:\n{complaint}"),
    }
}

/// A line from a board, or to it.
pub(crate) struct Line(BufReader<UnixStream>);

impl Line {
    fn connect(path: &Path) -> std::io::Result<Self> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Self(BufReader::new(stream)))
    }

    /// Sends `bytes`.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.0.get_mut().write_all(bytes).expect("the board listens");
    }

    /// The next line it says, without its end.
    pub(crate) fn read(&mut self) -> String {
        let mut line = Vec::new();
        self.0.read_until(b'\n', &mut line).expect("an answer in time");
        let Some(b'\n') = line.pop() else { panic!("the board has ended: {}", String::from_utf8_lossy(&line)) };
        String::from_utf8(line).expect("text").trim_end_matches('\r').to_owned()
    }

    /// Reads up to the greeting after a start.
    pub(crate) fn skip_greeting(&mut self) {
        while !self.read().starts_with("Grbl ") {}
    }

    /// Sends `request` and returns the lines up to `ok` or an error, this included.
    pub(crate) fn ask(&mut self, request: &str) -> Vec<String> {
        self.send(format!("{request}\n").as_bytes());
        let mut answer = Vec::new();
        loop {
            answer.push(self.read());
            if answer.last().is_some_and(|line| line == "ok" || line.starts_with("error:")) {
                return answer;
            }
        }
    }
}

/// How the board's port is offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Port {
    /// To this program: the board starts when it is connected, so that nothing it says is lost.
    Line,
    /// As a pseudo terminal, for programs that open serial ports. The board starts at once.
    Terminal,
}

/// A board that runs.
pub(crate) struct Emulator {
    folder: tempfile::TempDir,
    terminal: Option<PathBuf>,
    line: Option<Line>,
    monitor: Option<Line>,
    ender: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Emulator {
    /// Switches `board` on; `None`, with a word about it, where that is not possible.
    ///
    /// # Panics
    /// Where it is not possible although `PENVIS_REQUIRE_EMULATOR` is set.
    pub(crate) fn boot(board: Board, port: Port) -> Option<Self> {
        Self::boot_with(board, port, &[])
    }

    /// The same with `scene` in its flash.
    pub(crate) fn boot_with(board: Board, port: Port, scene: &[u8]) -> Option<Self> {
        let image = image(board.name())?;
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("scene"), scene).expect("a file");
        let socket = |id: &str, wait| format!("socket,id={id},path={},server=on,wait={wait}", at(id).display());
        let port_device = match port {
            Port::Line => socket("port", "on"),
            Port::Terminal => "pty,id=port".to_owned(),
        };
        let spawned = Command::new("qemu-system-arm")
            .args(["-M", board.machine(), "-display", "none", "-monitor", "none", "-semihosting"])
            // A count of instructions is the time, and nobody waits for it to pass.
            .args(["-icount", "shift=5,sleep=off"])
            .args(["-chardev", &socket("monitor", "off")])
            .args(["-chardev", &format!("file,id=trace,path={}", at("trace").display())])
            .args(["-chardev", &port_device])
            .args(["-serial", "chardev:port", "-serial", "chardev:trace", "-serial", "chardev:monitor"])
            .arg("-kernel")
            .arg(image)
            .args((!scene.is_empty()).then(|| ["-device".to_owned(), loader(&at("scene"))]).into_iter().flatten())
            .stdin(Stdio::null())
            .stdout(fs::File::create(at("output")).expect("a file"))
            .stderr(fs::File::create(at("errors")).expect("a file"))
            .spawn();
        let mut child = match spawned {
            Ok(child) => child,
            Err(e) if e.kind() == ErrorKind::NotFound => {
                skip("emulator", "install qemu-system-arm (Debian: apt-get install qemu-system-arm)");
                return None;
            }
            Err(e) => panic!("qemu-system-arm: {e}"),
        };
        let said = || ["output", "errors"].map(|name| fs::read_to_string(at(name)).unwrap_or_default()).concat();
        let terminal = |said: String| {
            let (_, rest) = said.split_once("redirected to ")?;
            Some(PathBuf::from(rest.split_once(' ')?.0))
        };
        let deadline = Instant::now() + PATIENCE;
        let (line, terminal) = loop {
            let line = (port == Port::Line).then(|| Line::connect(&at("port")).ok()).flatten();
            let terminal = (port == Port::Terminal).then(|| terminal(said())).flatten();
            if line.is_some() || terminal.is_some() {
                break (line, terminal);
            }
            let ended = child.try_wait().expect("a child");
            if ended.is_some() || Instant::now() > deadline {
                let _ = child.kill();
                panic!("QEMU offers no port: {}", said());
            }
            thread::sleep(Duration::from_millis(20));
        };
        let monitor = Line::connect(&at("monitor")).ok();
        Some(Self { folder, terminal, line, monitor, ender: Some(ends(child)) })
    }

    /// The board's port, of [`Port::Line`].
    pub(crate) fn line(&mut self) -> &mut Line {
        self.line.as_mut().expect("a board booted with Port::Line")
    }

    /// The path of the board's port, of [`Port::Terminal`].
    pub(crate) fn terminal(&self) -> &str {
        let path = self.terminal.as_deref().expect("a board booted with Port::Terminal");
        path.to_str().expect("a path of QEMU's")
    }

    /// The answer of the board's monitor to a request of one byte.
    pub(crate) fn measure(&mut self, request: u8) -> String {
        let monitor = self.monitor.as_mut().expect("QEMU's second socket");
        monitor.send(&[request]);
        monitor.read()
    }

    /// Resets the processor, and waits until the firmware greets.
    pub(crate) fn restart(&mut self) {
        self.monitor.as_mut().expect("QEMU's second socket").send(b"r");
        self.line().skip_greeting();
    }

    /// What the board has traced so far.
    pub(crate) fn trace(&self) -> Vec<u8> {
        fs::read(self.folder.path().join("trace")).expect("QEMU's file")
    }
}

/// Puts a file into flash, where `firmware/build.rs` has scenes lie.
fn loader(scene: &Path) -> String {
    format!("loader,file={},addr={SCENE:#x},force-raw=on", scene.display())
}

/// A thread that ends `child` when it is told to, or when its time is over: whoever waits for it then sees that it is gone.
fn ends(mut child: Child) -> (Sender<()>, JoinHandle<()>) {
    let (sender, receiver) = mpsc::channel();
    let thread = thread::spawn(move || {
        if let Err(RecvTimeoutError::Timeout) = receiver.recv_timeout(LIFE) {
            eprintln!("the emulated board has run for {LIFE:?}, and is ended");
        }
        // It may have ended by itself.
        let _ = child.kill();
        let _ = child.wait();
    });
    (sender, thread)
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.ender.take() {
            drop(sender);
            let _ = thread.join();
        }
    }
}

//! A journal that is being written.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::JournalError;
use super::Reached;
use super::format::{self, Contents, Head, RECORD, Record};
use crate::options::folder;

/// Most bytes of a journal: far more than a plotter draws in a month.
const LARGEST: u64 = 1 << 32;

/// Time between two records: a plot of a day has some hundred thousand of them, six megabytes.
const INTERVAL: Duration = Duration::from_millis(250);

/// Time between two waits for the disk. A power cut costs the record of so much time, and the pen draws it twice.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// Milliseconds since 1970.
#[must_use]
pub fn now_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// Reads a journal.
///
/// # Errors
/// [`JournalError`]: it cannot be read, or is damaged.
pub fn read(path: &Path) -> Result<Contents, JournalError> {
    let fault = |source| JournalError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_end(&mut bytes)).map_err(fault)?;
    if bytes.len() as u64 > LARGEST {
        return Err(fault(io::ErrorKind::FileTooLarge.into()));
    }
    format::parse(&bytes).map_err(|source| JournalError::Format { path: path.to_owned(), source })
}

/// A journal on the disk to which records are added.
///
/// Each record goes to the system at once, so that the end of the program loses none; the disk is waited for by a thread of
/// its own, for some disks take a second, and the plotter would stand still meanwhile.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    seed: u32,
    header_bytes: u64,
    /// Records written.
    records: u32,
    /// The last record, and when it was written.
    last: Option<(Record, Instant)>,
    disk: Disk,
}

impl Journal {
    /// Begins a journal: when this returns, it is on the disk under its name with the job in it. With `replace`, one that is
    /// there already is discarded.
    ///
    /// # Errors
    /// [`JournalError::Unfinished`] if there is one already; or that it cannot be written.
    pub fn create(path: &Path, head: &Head, job: &[u8], replace: bool) -> Result<Self, JournalError> {
        let fault = |source: io::Error| match source.kind() {
            io::ErrorKind::AlreadyExists => JournalError::Unfinished { path: path.to_owned() },
            _ => JournalError::Write { path: path.to_owned(), source },
        };
        let (bytes, seed) = format::header(head, job).map_err(|e| fault(e.into()))?;
        let folder = folder(path);
        let mut file = tempfile::Builder::new().prefix(".penvis-").tempfile_in(folder).map_err(fault)?;
        file.write_all(&bytes).and_then(|()| file.as_file().sync_all()).map_err(fault)?;
        let kept = if replace { file.persist(path) } else { file.persist_noclobber(path) };
        let file = kept.map_err(|e| fault(e.error))?;
        sync_folder(folder).map_err(fault)?;
        Self::new(path, file, seed, bytes.len(), None, 0)
    }

    /// Goes on with a journal that was read, behind its last good record.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn reopen(path: &Path, contents: &Contents) -> Result<Self, JournalError> {
        let fault = |source| JournalError::Write { path: path.to_owned(), source };
        let file = OpenOptions::new().read(true).write(true).open(path).map_err(fault)?;
        let length = contents.header_bytes as u64 + u64::from(contents.records) * RECORD as u64;
        file.set_len(length).and_then(|()| file.sync_all()).map_err(fault)?;
        Self::new(path, file, contents.seed, contents.header_bytes, contents.last, contents.records)
    }

    fn new(
        path: &Path,
        file: File,
        seed: u32,
        header_bytes: usize,
        last: Option<Record>,
        records: u32,
    ) -> Result<Self, JournalError> {
        let fault = |source| JournalError::Write { path: path.to_owned(), source };
        let disk = file.try_clone().and_then(|file| Disk::start(file, records)).map_err(fault)?;
        let last = last.map(|record| (record, Instant::now()));
        Ok(Self { path: path.to_owned(), file, seed, header_bytes: header_bytes as u64, records, last, disk })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a record is due: so many pieces are more than were noted, and the last note is some time ago.
    #[must_use]
    pub fn is_due(&self, executed: u64) -> bool {
        self.last.map_or(executed > 0, |(last, when)| executed > last.executed && when.elapsed() >= INTERVAL)
    }

    /// Notes how far the job is, and that the plotter has acknowledged `ahead` pieces more than are executed. What was noted once
    /// is not taken back so, as a job that goes on begins further back: no more pieces than before are left aside.
    ///
    /// # Errors
    /// [`JournalError::Write`]: the disk is full or gone. What was noted before is still good, and a later note may succeed.
    pub fn note(&mut self, reached: Reached, ahead: u64) -> Result<(), JournalError> {
        if self.last.is_some_and(|(last, _)| reached.executed <= last.executed) {
            return self.disk.fault().map_or(Ok(()), |source| Err(self.fault(source)));
        }
        self.append(reached, ahead)
    }

    /// Takes back what was noted beyond: it is drawn, and in the wrong place.
    ///
    /// # Errors
    /// [`JournalError::Write`], as [`note`](Self::note).
    pub fn take_back(&mut self, reached: Reached, ahead: u64) -> Result<(), JournalError> {
        if self.last.is_none_or(|(last, _)| last.executed <= reached.executed) {
            return self.disk.fault().map_or(Ok(()), |source| Err(self.fault(source)));
        }
        self.append(reached, ahead)
    }

    fn fault(&self, source: io::Error) -> JournalError {
        JournalError::Write { path: self.path.clone(), source }
    }

    fn append(&mut self, reached: Reached, ahead: u64) -> Result<(), JournalError> {
        let Reached { executed, pen, position } = reached;
        let ahead = u32::try_from(ahead).unwrap_or(u32::MAX);
        let record = Record { executed, ahead, pen, position, time_ms: now_ms() };
        let synced = self.disk.synced.load(Ordering::Acquire);
        let fault = |source| JournalError::Write { path: self.path.clone(), source };
        if self.records == u32::MAX {
            return self.disk.fault().map_or(Ok(()), |source| Err(fault(source)));
        }
        let bytes = format::record(&record, self.records, synced, self.seed);
        // A write that failed half-way is written over by the next one.
        let at = self.header_bytes + u64::from(self.records) * RECORD as u64;
        self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.write_all(&bytes)).map_err(fault)?;
        self.records += 1;
        self.last = Some((record, Instant::now()));
        self.disk.ask(self.records);
        self.disk.fault().map_or(Ok(()), |source| Err(fault(source)))
    }

    /// Waits until all that was noted is on the disk.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn close(mut self) -> Result<(), JournalError> {
        self.disk.ask = None;
        self.file.sync_data().map_err(|source| JournalError::Write { path: self.path.clone(), source })
    }

    /// Takes the journal away: its job is done.
    ///
    /// # Errors
    /// [`JournalError::Write`].
    pub fn remove(mut self) -> Result<(), JournalError> {
        self.disk.ask = None;
        let done = fs::remove_file(&self.path).and_then(|()| sync_folder(folder(&self.path)));
        done.map_err(|source| JournalError::Write { path: self.path.clone(), source })
    }
}

/// Makes a name in a folder last.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Names last by themselves where folders cannot be opened.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Waits for the disk, in a thread.
#[derive(Debug)]
struct Disk {
    /// Records that are on the disk.
    synced: Arc<AtomicU32>,
    /// What went wrong last, until it is told.
    fault: Arc<Mutex<Option<io::Error>>>,
    ask: Option<SyncSender<u32>>,
}

impl Disk {
    fn start(file: File, synced: u32) -> io::Result<Self> {
        let synced = Arc::new(AtomicU32::new(synced));
        let fault = Arc::new(Mutex::new(None));
        let (ask, asked) = mpsc::sync_channel::<u32>(1);
        let (known, told) = (Arc::clone(&synced), Arc::clone(&fault));
        let work = move || {
            while let Ok(records) = asked.recv() {
                match file.sync_data() {
                    Ok(()) => known.store(records, Ordering::Release),
                    Err(e) => *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(e),
                }
                thread::sleep(SYNC_INTERVAL);
            }
        };
        // It ends by itself when nobody can ask any more, and holds nothing that is waited for.
        thread::Builder::new().name("journal".into()).spawn(work)?;
        Ok(Self { synced, fault, ask: Some(ask) })
    }

    /// Has these records brought to the disk. While one wish waits already, the next one will do for both.
    fn ask(&mut self, records: u32) {
        let Some(ask) = &self.ask else { return };
        match ask.try_send(records) {
            Ok(()) | Err(TrySendError::Full(_)) => {}
            Err(TrySendError::Disconnected(_)) => self.ask = None,
        }
    }

    fn fault(&self) -> Option<io::Error> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head() -> Head {
        Head { name: "job".into(), profile: String::new(), baud: 9600, pieces: 50, begun_ms: now_ms() }
    }

    fn at(executed: u64, pen: u32, position: Option<[f64; 3]>) -> Reached {
        Reached { executed, pen, position }
    }

    fn begun() -> (tempfile::TempDir, PathBuf, Journal) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("job.journal");
        let journal = Journal::create(&path, &head(), b"IN;", false).unwrap();
        (folder, path, journal)
    }

    #[test]
    fn a_journal_is_read_while_it_is_written_and_gone_when_it_is_done() {
        let (folder, path, mut journal) = begun();
        assert_eq!(read(&path).unwrap().last, None);
        assert!(!journal.is_due(0) && journal.is_due(1));
        journal.note(at(3, 1, Some([1.0, 2.0, 0.0])), 0).unwrap();
        assert!(!journal.is_due(4), "too soon");
        journal.note(at(7, 2, None), 9).unwrap();
        // A job that is begun again further back takes nothing back.
        journal.note(at(5, 1, None), 0).unwrap();
        let contents = read(&path).unwrap();
        assert_eq!((&contents.job[..], contents.records), (&b"IN;"[..], 2));
        assert!(matches!(contents.last, Some(Record { executed: 7, ahead: 9, pen: 2, position: None, .. })));
        // What was drawn in the wrong place is.
        journal.take_back(at(9, 1, None), 0).unwrap();
        assert_eq!(read(&path).unwrap().records, 2);
        journal.take_back(at(5, 1, None), 0).unwrap();
        let contents = read(&path).unwrap();
        assert_eq!((contents.records, contents.last.unwrap().executed), (3, 5));
        journal.remove().unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_torn_tail_is_written_over() {
        let (_folder, path, mut journal) = begun();
        journal.note(at(3, 1, None), 0).unwrap();
        journal.close().unwrap();
        let mut bytes = fs::read(&path).unwrap();
        bytes.extend_from_slice(&[0xff; 100]);
        fs::write(&path, bytes).unwrap();
        let mut journal = Journal::reopen(&path, &read(&path).unwrap()).unwrap();
        journal.note(at(4, 1, None), 0).unwrap();
        journal.close().unwrap();
        let contents = read(&path).unwrap();
        assert_eq!((contents.records, contents.last.unwrap().executed), (2, 4));
    }

    #[test]
    fn an_unfinished_plot_is_not_forgotten_unless_asked() {
        let (folder, path, mut journal) = begun();
        journal.note(at(3, 1, None), 0).unwrap();
        drop(journal);
        let refused = Journal::create(&path, &head(), b"PU;", false).unwrap_err();
        assert!(matches!(refused, JournalError::Unfinished { .. }), "{refused}");
        assert_eq!(read(&path).unwrap().last.unwrap().executed, 3);
        Journal::create(&path, &head(), b"PU;", true).unwrap();
        assert_eq!((read(&path).unwrap().last, fs::read_dir(folder.path()).unwrap().count()), (None, 1));
    }

    #[test]
    fn faults_are_told_in_a_line() {
        let (folder, path, _journal) = begun();
        let nowhere = folder.path().join("none/job.journal");
        let mut bytes = fs::read(&path).unwrap();
        bytes[40] ^= 1;
        fs::write(&path, bytes).unwrap();
        let table = [
            (read(&nowhere).unwrap_err(), "none/job.journal cannot be read"),
            (Journal::create(&nowhere, &head(), b"PU;", false).unwrap_err(), "none/job.journal cannot be written"),
            (read(&path).unwrap_err(), "is damaged at byte 0 or behind it"),
        ];
        for (error, expected) in table {
            let message = error.to_string();
            assert!(message.contains(expected) && !message.contains('\n'), "{message}");
        }
    }
}

//! Keeps a journal while a job goes on.

use super::{Journal, JournalError};
use crate::protocol::{Control, Progress};
use crate::stream::Observer;

/// How far the job of the journal is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Pieces of the job that are executed.
    pub executed: u64,
    /// The pen in the holder.
    pub pen: u32,
    /// Place after the last of these pieces, in mm; none where it is unknown.
    pub position: Option<[f64; 3]>,
}

/// Notes what is executed, and passes everything on to another observer.
pub struct Noting<'a> {
    observer: &'a mut dyn Observer,
    journal: &'a mut Journal,
    /// From the pieces executed of what is sent to how far the job of the journal is.
    reached: &'a dyn Fn(usize) -> Reached,
    /// Pieces of the job of the journal.
    total: usize,
    progress: Progress,
    /// Whether the user was told that the journal cannot be written.
    told: bool,
}

impl<'a> Noting<'a> {
    /// An observer that keeps `journal`, of a job of `total` pieces, and passes everything on to `observer`, in pieces of
    /// that job.
    #[must_use]
    pub fn new(
        observer: &'a mut dyn Observer,
        journal: &'a mut Journal,
        reached: &'a dyn Fn(usize) -> Reached,
        total: usize,
    ) -> Self {
        Self { observer, journal, reached, total, progress: Progress::default(), told: false }
    }

    /// Notes how far the job is at its end, whenever the last note was.
    pub fn finish(mut self) {
        self.write();
    }

    fn write(&mut self) {
        let noted = self.journal.note((self.reached)(self.progress.executed), self.ahead());
        // The plot goes on: half a drawing with the pen at rest is no better for whoever waits for it.
        self.tell(noted);
    }

    /// Pieces of the job that the plotter has acknowledged beyond those that are executed.
    fn ahead(&self) -> u64 {
        let [acknowledged, executed] =
            [self.progress.acknowledged, self.progress.executed].map(|pieces| (self.reached)(pieces).executed);
        acknowledged.saturating_sub(executed)
    }

    fn tell(&mut self, noted: Result<(), JournalError>) {
        match noted {
            Err(error) if !self.told => {
                self.told = true;
                self.observer.warn(&format!("{error}; until it can be, --resume would go further back than needed"));
            }
            Err(_) => {}
            Ok(()) => self.told = false,
        }
    }
}

impl Observer for Noting<'_> {
    fn progress(&mut self, progress: Progress) {
        let falls = progress.executed < self.progress.executed;
        self.progress = progress;
        if falls {
            let taken_back = self.journal.take_back((self.reached)(progress.executed), self.ahead());
            self.tell(taken_back);
        }
        let whole = |pieces| usize::try_from((self.reached)(pieces).executed).unwrap_or(usize::MAX);
        self.observer.progress(Progress {
            acknowledged: whole(progress.acknowledged),
            executed: whole(progress.executed),
            total: self.total,
        });
    }

    fn message(&mut self, text: &str) {
        self.observer.message(text);
    }

    fn note(&mut self, text: &str) {
        self.observer.note(text);
    }

    fn warn(&mut self, text: &str) {
        self.observer.warn(text);
    }

    fn control(&mut self) -> Option<Control> {
        let executed = self.progress.executed;
        if executed > 0 && self.journal.is_due((self.reached)(executed).executed) {
            self.write();
        }
        self.observer.control()
    }

    fn prompt(&mut self, comment: &str) -> bool {
        // A pen change may take all night.
        self.write();
        self.observer.prompt(comment)
    }

    fn paused(&mut self, rests: bool) {
        self.write();
        self.observer.paused(rests);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Head, read};
    use super::*;

    /// Notes what it is warned of.
    #[derive(Default)]
    struct Listener(Vec<String>);

    impl Observer for Listener {
        fn progress(&mut self, _: Progress) {}
        fn message(&mut self, _: &str) {}
        fn warn(&mut self, text: &str) {
            self.0.push(text.to_owned());
        }
        fn control(&mut self) -> Option<Control> {
            None
        }
        fn prompt(&mut self, _: &str) -> bool {
            true
        }
        fn paused(&mut self, _: bool) {}
    }

    #[test]
    fn only_what_is_executed_is_noted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let head = Head { name: "a".into(), profile: String::new(), baud: 9600, pieces: 100, begun_ms: 0 };
        let mut journal = Journal::create(&path, &head, b"G21", false).unwrap();
        let reached = |count: usize| Reached { executed: count as u64 + 10, pen: 3, position: None };
        let mut listener = Listener::default();
        let mut noting = Noting::new(&mut listener, &mut journal, &reached, 100);
        noting.progress(Progress { acknowledged: 9, executed: 0, total: 90 });
        noting.control();
        assert_eq!(read(&path).unwrap().last, None);
        noting.progress(Progress { acknowledged: 9, executed: 4, total: 90 });
        noting.control();
        assert_eq!(read(&path).unwrap().last.map(|last| (last.executed, last.pen)), Some((14, 3)));
        noting.progress(Progress { acknowledged: 9, executed: 5, total: 90 });
        noting.control();
        assert_eq!(read(&path).unwrap().last.map(|last| last.executed), Some(14), "not so often");
        noting.write();
        assert_eq!(read(&path).unwrap().last.map(|last| last.executed), Some(15));
        noting.progress(Progress { acknowledged: 9, executed: 2, total: 90 });
        noting.finish();
        assert_eq!(read(&path).unwrap().last.map(|last| (last.executed, last.ahead)), Some((12, 7)), "taken back");
        assert!(listener.0.is_empty());
    }
}

//! Where the bytes of a model come from.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::fault::ReadError;

/// Most bytes that are read into memory as a whole, so that a wrong path (a device, a disk image) does not fill it.
const LARGEST_WHOLE: u64 = 1 << 30;

/// Bytes by which the format of a file is told.
const HEAD: u64 = 1 << 16;

/// A model file, or the bytes of one.
pub struct Source {
    stem: String,
    path: Option<PathBuf>,
    len: u64,
    head: Vec<u8>,
    content: Box<dyn Content>,
}

/// What a file and bytes in memory have in common.
trait Content: Read + Seek {}

impl<T: Read + Seek> Content for T {}

impl Source {
    /// A file.
    ///
    /// # Errors
    /// What the system says.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        if file.metadata()?.is_dir() {
            return Err(io::Error::from(io::ErrorKind::IsADirectory));
        }
        let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Ok(Self { path: Some(path.to_owned()), ..Self::new(stem, Box::new(file))? })
    }

    /// The bytes of a file; `stem` is its name without its extension, after which the model is named if it has no name.
    ///
    /// # Errors
    /// None that memory gives.
    pub fn from_bytes(stem: &str, bytes: Vec<u8>) -> io::Result<Self> {
        Self::new(stem.to_owned(), Box::new(Cursor::new(bytes)))
    }

    fn new(stem: String, mut content: Box<dyn Content>) -> io::Result<Self> {
        let len = content.seek(SeekFrom::End(0))?;
        content.rewind()?;
        let mut head = Vec::new();
        content.as_mut().take(HEAD).read_to_end(&mut head)?;
        Ok(Self { stem, path: None, len, head, content })
    }

    /// Name of the file without its extension.
    #[must_use]
    pub fn stem(&self) -> &str {
        &self.stem
    }

    /// Where the file is; none of bytes that are in no file.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Length in bytes.
    #[must_use]
    pub fn length(&self) -> u64 {
        self.len
    }

    /// The first bytes, 64 KiB at most.
    #[must_use]
    pub fn head(&self) -> &[u8] {
        &self.head
    }

    /// All bytes.
    ///
    /// # Errors
    /// [`ReadError::TooLarge`] for more than a GiB, or what the system says.
    pub fn bytes(&mut self) -> Result<Vec<u8>, ReadError> {
        self.content.rewind()?;
        let mut bytes = Vec::new();
        self.content.as_mut().take(LARGEST_WHOLE + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > LARGEST_WHOLE {
            return Err(ReadError::TooLarge { limit: LARGEST_WHOLE });
        }
        Ok(bytes)
    }

    /// The bytes one after the other, for a format whose reader holds in the end about as much as it reads.
    ///
    /// # Errors
    /// As [`bytes`](Self::bytes).
    pub fn text(&mut self) -> Result<impl BufRead + '_, ReadError> {
        if self.len > LARGEST_WHOLE {
            return Err(ReadError::TooLarge { limit: LARGEST_WHOLE });
        }
        Ok(self.stream()?)
    }

    /// The bytes one after the other, from the beginning, without holding them all.
    ///
    /// # Errors
    /// What the system says.
    pub fn stream(&mut self) -> io::Result<impl BufRead + '_> {
        self.content.rewind()?;
        Ok(BufReader::with_capacity(1 << 16, &mut self.content))
    }
}

//! A memory in RAM, for what is stored: its supply may fail.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use penvis_firmware::RECORD_BYTES;

/// A memory of the size of two records, in pages of 64 bytes, whose supply fails after so many bytes of work.
#[derive(Clone, Debug)]
pub(crate) struct RamFlash {
    pub(crate) bytes: Vec<u8>,
    /// Bytes that can still be erased or written.
    pub(crate) left: usize,
}

impl Default for RamFlash {
    /// Erased, and fed for ever.
    fn default() -> Self {
        Self { bytes: vec![0xff; 2 * RECORD_BYTES], left: usize::MAX }
    }
}

impl RamFlash {
    fn work(&mut self, at: usize, value: u8) -> Result<(), NorFlashErrorKind> {
        self.left = self.left.checked_sub(1).ok_or(NorFlashErrorKind::Other)?;
        self.bytes[at] = value;
        Ok(())
    }
}

impl ErrorType for RamFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for RamFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, at: u32, into: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        into.copy_from_slice(&self.bytes[at as usize..][..into.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for RamFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 64;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        (from as usize..to as usize).try_for_each(|at| self.work(at, 0xff))
    }

    fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        bytes.iter().enumerate().try_for_each(|(k, byte)| self.work(at as usize + k, *byte))
    }
}

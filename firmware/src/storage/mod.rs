//! What outlives switching off: settings, coordinate systems, stored positions, start-up lines and the text of `$I=`.
//!
//! They are kept in any memory with the interface of `embedded-storage`'s [`NorFlash`]: the flash of a microcontroller, or an EEPROM whose
//! driver calls half of it a page. Two slots take turns, so that the last record stays whole while the next is being written:
//!
//! ```text
//! slot 0  ┌────────┬──────────────────────┐     slot 1  ┌────────┬──────────────────────┐
//!         │ header │ record, sequence 7   │             │ header │ record, sequence 8   │   8 counts
//!         └────────┴──────────────────────┘             └────────┴──────────────────────┘
//! save:   erase slot 0, write the record, and its header last; then 9 counts
//! ```
//!
//! Guarantees:
//! 1. A cut of the power at any moment of [`Slots::save`] leaves the record before it or the new one, never a mixture: a slot counts only with its magic number, a length that fits
//!    and the CRC-32 of sequence number, length and record, and the slot with the other record is not touched.
//! 2. Nothing is written when the record is what is stored already.
//! 3. Whatever the memory holds, loading ends with a valid record or with the defaults.

mod record;
mod slots;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

pub(crate) use record::{SYSTEMS, Stored, StoredLine};
pub(crate) use slots::{Loaded, Slots};
pub use slots::{RECORD_BYTES, slot_bytes};

/// The memory of a machine that has none: everything is forgotten when it is switched off.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoStorage;

/// There is no memory to read or write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoStorageError;

impl NorFlashError for NoStorageError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl ErrorType for NoStorage {
    type Error = NoStorageError;
}

impl ReadNorFlash for NoStorage {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, _: &mut [u8]) -> Result<(), NoStorageError> {
        Err(NoStorageError)
    }

    fn capacity(&self) -> usize {
        0
    }
}

impl NorFlash for NoStorage {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = 1;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), NoStorageError> {
        Err(NoStorageError)
    }

    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), NoStorageError> {
        Err(NoStorageError)
    }
}

//! RAM as storage, which outlives a reset of the processor but not switching off: for trials of what a board keeps in flash.

use core::sync::atomic::{AtomicU8, Ordering::Relaxed};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use penvis_firmware::RECORD_BYTES;

/// Two slots of a page each.
const BYTES: usize = 2 * RECORD_BYTES;

/// What is erased, inverted: so the memory of zeros with which the emulator begins counts as erased. Atomic only because nobody knows what is in there at the start.
#[unsafe(link_section = ".uninit.kept")]
#[allow(unsafe_code, reason = "the start must leave this section as it is")]
static INVERTED: [AtomicU8; BYTES] = [const { AtomicU8::new(0) }; BYTES];

/// The memory's user, of whom there is one.
#[derive(Debug)]
pub(crate) struct Kept;

/// The bytes from `offset` on.
fn at(offset: u32) -> impl Iterator<Item = &'static AtomicU8> {
    INVERTED.iter().skip(offset as usize)
}

impl ErrorType for Kept {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Kept {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        for (byte, cell) in bytes.iter_mut().zip(at(offset)) {
            *byte = !cell.load(Relaxed);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for Kept {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = RECORD_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        for cell in at(from).take((to - from) as usize) {
            cell.store(0, Relaxed);
        }
        Ok(())
    }

    /// As a flash does: bits are only cleared.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (byte, cell) in bytes.iter().zip(at(offset)) {
            cell.store(cell.load(Relaxed) | !byte, Relaxed);
        }
        Ok(())
    }
}

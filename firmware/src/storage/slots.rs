//! Two slots that take turns.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage::nor_flash::NorFlash;

use super::record::{LONGEST, Stored};
use crate::settings::Settings;

/// Bytes that a record takes, with its header, at the most.
pub const RECORD_BYTES: usize = 1024;

/// Bytes of the header: magic number, sequence number, length of the record, CRC-32 of these two and of the record.
const HEADER: usize = 16;

const MAGIC: [u8; 4] = *b"pnvs";

/// Where the header ends when the record is written before it: a multiple of every usual write size.
const _: () = assert!(LONGEST + HEADER <= RECORD_BYTES, "the record outgrows its slot");

/// Bytes of a slot in a memory that is erased in pages of so many bytes: storage needs twice as many, from address 0 of the memory it is given.
#[must_use]
pub const fn slot_bytes(erase_size: usize) -> usize {
    RECORD_BYTES.div_ceil(erase_size) * erase_size
}

/// What a memory holds.
#[derive(Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "it lasts for a moment at the start")]
pub(crate) enum Loaded {
    /// The last record that was saved.
    Record(Stored),
    /// Nothing was ever saved, or there is no memory.
    Nothing,
    /// Something that is no record, or it cannot be read.
    Damaged,
}

/// What stands at the beginning of a slot.
#[derive(Clone, Copy, Debug)]
struct Header {
    sequence: u32,
    length: usize,
    crc: u32,
}

/// The two slots of a memory.
#[derive(Debug)]
pub(crate) struct Slots<F> {
    flash: F,
    /// Slot and sequence number of the record that counts.
    last: Option<(u32, u32)>,
}

impl<F: NorFlash> Slots<F> {
    const SLOT: usize = slot_bytes(F::ERASE_SIZE);

    /// What is written last, and so holds the header: whole write units.
    const FIRST: usize = {
        assert!(
            F::READ_SIZE > 0 && RECORD_BYTES.is_multiple_of(F::READ_SIZE),
            "reads of a size that does not divide a record"
        );
        assert!(
            F::WRITE_SIZE > 0 && RECORD_BYTES.is_multiple_of(F::WRITE_SIZE),
            "writes of a size that does not divide a record"
        );
        HEADER.div_ceil(F::WRITE_SIZE) * F::WRITE_SIZE
    };

    pub(crate) fn new(flash: F) -> Self {
        Self { flash, last: None }
    }

    pub(crate) fn flash(&self) -> &F {
        &self.flash
    }

    fn has_room(&self) -> bool {
        self.flash.capacity() >= 2 * Self::SLOT
    }

    fn address(slot: u32) -> u32 {
        // Two slots of a 32-bit address space.
        slot * Self::SLOT as u32
    }

    /// Reads both slots, and takes the newer record. Costs a read and a CRC of [`RECORD_BYTES`] for each.
    pub(crate) fn load(&mut self, defaults: &Settings) -> Loaded {
        self.last = None;
        if !self.has_room() {
            return Loaded::Nothing;
        }
        let (mut found, mut blank) = (None, true);
        for slot in 0..2 {
            let mut bytes = [0; RECORD_BYTES];
            if self.flash.read(Self::address(slot), &mut bytes).is_err() {
                blank = false;
                continue;
            }
            blank &= bytes.iter().take(HEADER).all(|b| *b == 0xff);
            let Some((sequence, record)) = check(&bytes) else { continue };
            // The numbers wrap: the newer is ahead by less than half of them.
            let newer = self.last.is_none_or(|(_, last)| sequence.wrapping_sub(last) as i32 > 0);
            if newer && let Some(stored) = Stored::decode(record, defaults) {
                self.last = Some((slot, sequence));
                found = Some(stored);
            }
        }
        match found {
            Some(stored) => Loaded::Record(stored),
            None if blank => Loaded::Nothing,
            None => Loaded::Damaged,
        }
    }

    /// Saves `stored` if it is not what the last record holds. Costs the erasure of a slot and the writing of up to [`RECORD_BYTES`]; the caller waits.
    ///
    /// # Errors
    /// The memory failed, or does not hold now what was written. The last record still counts. Without a memory there is nothing to do, and no error.
    pub(crate) fn save(&mut self, stored: &Stored) -> Result<(), SaveError> {
        if !self.has_room() {
            return Ok(());
        }
        let record = stored.encode::<LONGEST>().ok_or(SaveError)?;
        let mut bytes = [0xff; RECORD_BYTES];
        let mut old = [0; RECORD_BYTES];
        if let Some((slot, _)) = self.last {
            self.flash.read(Self::address(slot), &mut old).map_err(|_| SaveError)?;
            if check(&old).is_some_and(|(_, old)| *old == *record) {
                return Ok(());
            }
        }
        let (slot, sequence) = self.last.map_or((0, 1), |(slot, sequence)| (1 - slot, sequence.wrapping_add(1)));
        fill(&mut bytes, sequence, &record).ok_or(SaveError)?;
        let (from, used) = (Self::address(slot), (HEADER + record.len()).next_multiple_of(F::WRITE_SIZE));
        self.flash.erase(from, from + Self::SLOT as u32).map_err(|_| SaveError)?;
        let (first, rest) = bytes.split_at_checked(Self::FIRST).ok_or(SaveError)?;
        let rest = rest.get(..used.saturating_sub(Self::FIRST)).ok_or(SaveError)?;
        self.flash.write(from + Self::FIRST as u32, rest).map_err(|_| SaveError)?;
        self.flash.write(from, first).map_err(|_| SaveError)?;
        self.flash.read(from, &mut old).map_err(|_| SaveError)?;
        if check(&old).is_none_or(|(_, new)| *new != *record) {
            return Err(SaveError);
        }
        self.last = Some((slot, sequence));
        Ok(())
    }
}

/// The memory does not take what is to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SaveError;

fn crc(sequence: u32, record: &[u8]) -> u32 {
    const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    digest.update(&sequence.to_le_bytes());
    digest.update(&(record.len() as u32).to_le_bytes());
    digest.update(record);
    digest.finalize()
}

/// Sequence number and record of a slot, when all is well with it.
fn check(bytes: &[u8; RECORD_BYTES]) -> Option<(u32, &[u8])> {
    let (header, rest) = bytes.split_first_chunk::<HEADER>()?;
    let [m0, m1, m2, m3, s0, s1, s2, s3, l0, l1, l2, l3, c0, c1, c2, c3] = *header;
    if [m0, m1, m2, m3] != MAGIC {
        return None;
    }
    let header = Header {
        sequence: u32::from_le_bytes([s0, s1, s2, s3]),
        length: u32::from_le_bytes([l0, l1, l2, l3]) as usize,
        crc: u32::from_le_bytes([c0, c1, c2, c3]),
    };
    let record = rest.get(..header.length)?;
    (crc(header.sequence, record) == header.crc).then_some((header.sequence, record))
}

/// Writes header and record into `bytes`.
fn fill(bytes: &mut [u8; RECORD_BYTES], sequence: u32, record: &[u8]) -> Option<()> {
    let (header, rest) = bytes.split_first_chunk_mut::<HEADER>()?;
    let words = [u32::from_le_bytes(MAGIC), sequence, record.len() as u32, crc(sequence, record)];
    for (into, word) in header.chunks_exact_mut(4).zip(words) {
        into.copy_from_slice(&word.to_le_bytes());
    }
    rest.get_mut(..record.len())?.copy_from_slice(record);
    Some(())
}

#[cfg(test)]
mod tests {
    use std::vec;
    use std::vec::Vec;

    use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};
    use proptest::prelude::*;

    use super::*;

    /// Flash that is erased to ones and written to zeros, with a supply that fails after so many bytes have been erased or written: the last byte comes out as
    /// anything.
    #[derive(Clone, Debug)]
    struct Flash<const WRITE: usize> {
        bytes: Vec<u8>,
        left: usize,
        garbage: u8,
    }

    const PAGE: usize = 256;

    impl<const WRITE: usize> Flash<WRITE> {
        fn new() -> Self {
            Self { bytes: vec![0xff; 2 * RECORD_BYTES], left: usize::MAX, garbage: 0 }
        }

        /// One byte of work; an error when the power goes.
        fn work(&mut self, at: usize, value: u8) -> Result<(), NorFlashErrorKind> {
            if self.left == 0 {
                self.bytes[at] &= self.garbage;
                return Err(NorFlashErrorKind::Other);
            }
            self.left -= 1;
            self.bytes[at] = value;
            Ok(())
        }
    }

    impl<const WRITE: usize> ErrorType for Flash<WRITE> {
        type Error = NorFlashErrorKind;
    }

    impl<const WRITE: usize> ReadNorFlash for Flash<WRITE> {
        const READ_SIZE: usize = 4;

        fn read(&mut self, at: u32, into: &mut [u8]) -> Result<(), NorFlashErrorKind> {
            assert!(at.is_multiple_of(4) && into.len().is_multiple_of(4));
            into.copy_from_slice(&self.bytes[at as usize..at as usize + into.len()]);
            Ok(())
        }

        fn capacity(&self) -> usize {
            self.bytes.len()
        }
    }

    impl<const WRITE: usize> NorFlash for Flash<WRITE> {
        const WRITE_SIZE: usize = WRITE;
        const ERASE_SIZE: usize = PAGE;

        fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
            assert!((from as usize).is_multiple_of(PAGE) && (to as usize).is_multiple_of(PAGE));
            (from as usize..to as usize).try_for_each(|at| self.work(at, 0xff))
        }

        fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
            assert!((at as usize).is_multiple_of(WRITE) && bytes.len().is_multiple_of(WRITE));
            for (k, byte) in bytes.iter().enumerate() {
                let at = at as usize + k;
                assert_eq!(self.bytes[at], 0xff, "{at} is written without being erased");
                self.work(at, *byte)?;
            }
            Ok(())
        }
    }

    /// The `n`th of records that all differ.
    fn version(n: u32) -> Stored {
        let mut stored = Stored::new(Settings::default());
        stored.systems[0] = [f64::from(n), 0.0, -f64::from(n)];
        stored.startup[0].extend_from_slice(&b"G54G21G90"[..n as usize % 10]).unwrap();
        stored
    }

    fn loaded<const W: usize>(flash: Flash<W>) -> Loaded {
        Slots::new(flash).load(&Settings::default())
    }

    fn turns<const W: usize>() {
        let mut slots = Slots::new(Flash::<W>::new());
        assert_eq!(slots.load(&Settings::default()), Loaded::Nothing);
        for n in 0..5 {
            slots.save(&version(n)).unwrap();
            assert_eq!(loaded(slots.flash.clone()), Loaded::Record(version(n)));
        }
        slots.flash.left = 0;
        slots.save(&version(4)).expect("what is stored already is not written");
        assert_eq!(slots.save(&version(5)), Err(SaveError));
    }

    #[test]
    fn slots_take_turns_whatever_the_size_of_a_write() {
        turns::<1>();
        turns::<8>();
        turns::<256>();
    }

    /// Cuts the power at every byte of erasing and writing.
    fn cuts<const W: usize>(garbage: u8) {
        for saved in 0..3 {
            let mut slots = Slots::new(Flash::<W>::new());
            (0..saved).for_each(|n| slots.save(&version(n)).unwrap());
            let before = loaded(slots.flash.clone());
            let mut whole = slots.flash.clone();
            whole.left = usize::MAX;
            let mut done = false;
            for cut in 0.. {
                let mut flash = slots.flash.clone();
                (flash.left, flash.garbage) = (cut, garbage);
                let mut slots = Slots { flash, last: slots.last };
                done = slots.save(&version(saved)).is_ok();
                slots.flash.left = usize::MAX;
                let after = slots.load(&Settings::default());
                if done {
                    assert_eq!(after, Loaded::Record(version(saved)));
                    break;
                }
                // A first record that was cut off is damage, and the defaults are what was there before.
                let old = after == before || (saved == 0 && after == Loaded::Damaged);
                assert!(old || after == Loaded::Record(version(saved)), "{saved} saved, cut at {cut}: {after:?}");
                // And the machine goes on from there.
                slots.save(&version(9)).unwrap();
                assert_eq!(loaded(slots.flash), Loaded::Record(version(9)), "{saved} saved, cut at {cut}");
            }
            assert!(done);
        }
    }

    #[test]
    fn a_cut_at_any_byte_leaves_the_old_record_or_the_new() {
        cuts::<1>(0x00);
        cuts::<1>(0xa5);
        cuts::<4>(0xff);
        cuts::<256>(0x0f);
    }

    #[test]
    fn sequence_numbers_wrap() {
        let mut slots = Slots::new(Flash::<1>::new());
        slots.save(&version(1)).unwrap();
        slots.last = Some((0, u32::MAX));
        slots.save(&version(2)).unwrap();
        let mut bytes = [0xff; RECORD_BYTES];
        fill(&mut bytes, u32::MAX, &version(1).encode::<LONGEST>().unwrap()).unwrap();
        slots.flash.bytes[..RECORD_BYTES].copy_from_slice(&bytes);
        assert_eq!(loaded(slots.flash), Loaded::Record(version(2)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_record_or_none(
            bytes in prop::collection::vec(any::<u8>(), 2 * RECORD_BYTES),
            flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8u8), 0..4),
        ) {
            let mut flash = Flash::<1> { bytes, left: usize::MAX, garbage: 0 };
            prop_assert_eq!(loaded(flash.clone()), Loaded::Damaged);
            let mut slots = Slots::new(Flash::<1>::new());
            slots.save(&version(1)).unwrap();
            slots.save(&version(2)).unwrap();
            flash.bytes.clone_from(&slots.flash.bytes);
            let used = HEADER + version(2).encode::<LONGEST>().unwrap().len();
            for (at, bit) in flips {
                // Up to four flipped bits in one slot: a CRC-32 finds all of them.
                flash.bytes[RECORD_BYTES + at.index(used)] ^= 1 << bit;
            }
            let (changed, found) = (flash.bytes != slots.flash.bytes, loaded(flash));
            prop_assert_eq!(found, Loaded::Record(version(if changed { 1 } else { 2 })));
        }
    }
}

//! The stored record as bytes, and back.
//!
//! ```text
//! format (1) │ settings: count (2), each number (2) and value (8) │ positions: 8 × 3 × 8 │ lines: 3 × length (1) and characters
//! ```
//!
//! All little-endian. Settings go by their numbers, so a firmware with more of them reads the record of one with fewer: what is not there keeps its default.

use heapless::Vec;

use crate::axis::AXES;
use crate::line::LINE_CHARS;
use crate::settings::{SETTING_IDS, Settings};

/// Coordinate systems G54 to G59.
pub(crate) const SYSTEMS: usize = 6;

/// First byte of a record. Another layout gets another number.
const FORMAT: u8 = 1;

/// Bytes of a setting in a record.
const SETTING_BYTES: usize = 2 + 8;

/// Positions in a record: the coordinate systems, G28 and G30.
const POSITIONS: usize = SYSTEMS + 2;

/// The longest record: every setting, and lines that are full.
pub(super) const LONGEST: usize =
    1 + 2 + SETTING_IDS.len() * SETTING_BYTES + POSITIONS * AXES * 8 + 3 * (1 + LINE_CHARS);

/// Largest coordinate that a record may hold, mm: beyond it, steps overflow with any scale that is allowed.
const LARGEST: f64 = 1e9;

/// A line that is stored: stripped and in upper case.
pub(crate) type StoredLine = Vec<u8, LINE_CHARS>;

/// Everything that outlives switching off.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stored {
    pub(crate) settings: Settings,
    /// Origins of G54 to G59, machine mm.
    pub(crate) systems: [[f64; AXES]; SYSTEMS],
    /// Where G28 and G30 go, machine mm.
    pub(crate) places: [[f64; AXES]; 2],
    /// `$N0` and `$N1`.
    pub(crate) startup: [StoredLine; 2],
    /// `$I=`.
    pub(crate) name: StoredLine,
}

impl Stored {
    /// These settings, all positions at the origin, no lines.
    pub(crate) fn new(settings: Settings) -> Self {
        Self {
            settings,
            systems: [[0.0; AXES]; SYSTEMS],
            places: [[0.0; AXES]; 2],
            startup: [StoredLine::new(), StoredLine::new()],
            name: StoredLine::new(),
        }
    }

    fn positions(&self) -> impl Iterator<Item = f64> + '_ {
        self.systems.iter().chain(&self.places).flatten().copied()
    }

    /// The record; `None` when it is longer than `N`.
    pub(super) fn encode<const N: usize>(&self) -> Option<Vec<u8, N>> {
        let mut out = Vec::new();
        out.push(FORMAT).ok()?;
        let settings = || SETTING_IDS.iter().filter_map(|&id| Some((id, self.settings.get(id)?.0)));
        out.extend_from_slice(&u16::try_from(settings().count()).ok()?.to_le_bytes()).ok()?;
        for (id, value) in settings() {
            out.extend_from_slice(&id.to_le_bytes()).ok()?;
            out.extend_from_slice(&value.to_le_bytes()).ok()?;
        }
        for value in self.positions() {
            out.extend_from_slice(&value.to_le_bytes()).ok()?;
        }
        for line in self.startup.iter().chain([&self.name]) {
            out.push(u8::try_from(line.len()).ok()?).ok()?;
            out.extend_from_slice(line).ok()?;
        }
        Some(out)
    }

    /// What a record holds, on top of `defaults`; `None` when anything in it is not as [`Stored::encode`] writes it, or out of range.
    pub(super) fn decode(record: &[u8], defaults: &Settings) -> Option<Self> {
        let mut bytes = Reader(record);
        let mut stored = Self::new(defaults.clone());
        if bytes.take(1)? != [FORMAT] {
            return None;
        }
        let count = usize::from(bytes.u16()?);
        let settings = bytes.take(count.checked_mul(SETTING_BYTES)?)?;
        // The step rate bounds a scale and a maximum rate together: one may only fit once the other has been lowered, so there are two rounds.
        let mut complete = false;
        for _ in 0..2 {
            complete = true;
            let mut round = Reader(settings);
            while let (Some(id), Some(value)) = (round.u16(), round.f64()) {
                // A setting that this firmware does not have was one of another's.
                complete &= !SETTING_IDS.contains(&id) || stored.settings.set(id, value).is_ok();
            }
        }
        if !complete {
            return None;
        }
        for value in stored.systems.iter_mut().chain(&mut stored.places).flatten() {
            *value = bytes.f64().filter(|v| v.abs() <= LARGEST)?;
        }
        for line in stored.startup.iter_mut().chain([&mut stored.name]) {
            let [length] = *bytes.take(1)? else { return None };
            let text = bytes.take(usize::from(length))?;
            // What a line editor lets through.
            if !text.iter().all(|b| b.is_ascii_graphic() && !b.is_ascii_lowercase()) {
                return None;
            }
            *line = Vec::from_slice(text).ok()?;
        }
        bytes.0.is_empty().then_some(stored)
    }
}

/// Takes bytes from the front.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn f64(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sample() -> Stored {
        let mut stored = Stored::new(Settings::default());
        // Neither fits with the default of the other.
        stored.settings.set(110, 1200.0).unwrap();
        stored.settings.set(100, 800.0).unwrap();
        stored.systems[1] = [1.5, -2.25, 0.1];
        stored.places[1] = [100.0, 0.0, 7.0];
        stored.startup[0] = Vec::from_slice(b"G21G54").unwrap();
        stored.name = Vec::from_slice(&[b'A'; LINE_CHARS]).unwrap();
        stored
    }

    #[test]
    fn reads_back() {
        let record = sample().encode::<LONGEST>().unwrap();
        assert_eq!(Stored::decode(&record, &Settings::default()), Some(sample()));
        let full = Stored { startup: [sample().name, sample().name], ..sample() };
        assert_eq!(full.encode::<LONGEST>().unwrap().len(), LONGEST, "the bound is reached");
    }

    #[test]
    fn a_record_of_another_firmware_is_read_by_its_numbers() {
        let mut record = sample().encode::<{ LONGEST + SETTING_BYTES }>().unwrap();
        let count = u16::from_le_bytes([record[1], record[2]]) + 1;
        record[1..3].copy_from_slice(&count.to_le_bytes());
        // $30000=0; each goes before the one before it.
        for byte in [0x30, 0x75, 0, 0, 0, 0, 0, 0, 0, 0].into_iter().rev() {
            record.insert(3, byte).unwrap();
        }
        assert_eq!(Stored::decode(&record, &Settings::default()), Some(sample()), "one more setting than there is");
        let fewer =
            Stored::decode(&[&[FORMAT, 0, 0][..], &[0; POSITIONS * AXES * 8 + 3]].concat(), &Settings::default());
        assert_eq!(fewer, Some(Stored::new(Settings::default())), "none at all");
    }

    proptest! {
        #[test]
        fn any_change_is_read_or_refused(at in any::<prop::sample::Index>(), byte: u8, cut in any::<prop::sample::Index>()) {
            let mut record = sample().encode::<LONGEST>().unwrap();
            let at = at.index(record.len());
            record[at] = byte;
            if let Some(read) = Stored::decode(&record, &Settings::default()) {
                prop_assert!(read.encode::<LONGEST>().is_some());
                prop_assert!(read.positions().all(f64::is_finite));
            }
            prop_assert_eq!(Stored::decode(&record[..cut.index(record.len())], &Settings::default()), None);
        }
    }
}

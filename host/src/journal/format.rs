//! The bytes of a journal, without I/O.
//!
//! ```text
//!  offset  bytes
//!       0     16  magic
//!      16      4  version of the format
//!      20      4  length of the head, H
//!      24      8  length of the job, J
//!      32      H  the head: JSON
//!    32+H      J  the job, in the language of the plotter, byte for byte
//!  32+H+J      4  CRC-32 of all before it
//!  36+H+J     60  records, one after the other
//! ```
//!
//! Numbers are little-endian. A record is always as long, so that one that is damaged does not hide where the next begins:
//!
//! ```text
//!       0      4  CRC-32 of the 56 bytes behind it, begun with that of the header: a record of another journal is none
//!       4      4  number of the record, from 0
//!       8      4  records that were on the disk for certain when this one was written
//!      12      4  pen
//!      16      8  pieces executed
//!      24      8  time in ms since 1970
//!      32     24  position x, y, z in mm, NaN where unknown
//!      56      4  pieces acknowledged beyond those
//! ```
//!
//! What a power cut leaves of the records that were not on the disk yet is anything: cut off, zeros, the last one whole and the
//! one before it not. So what follows the last good record is dropped, unless a later one tells that the damaged one had been
//! on the disk: then the disk or somebody has changed it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

const MAGIC: [u8; 16] = *b"penvis journal\n\x1a";
const VERSION: u32 = 1;
/// Bytes before the head.
const PREAMBLE: usize = 32;
/// Bytes of a checksum.
const CRC: usize = 4;
/// Bytes of a record.
pub(super) const RECORD: usize = 60;

/// What a job is, as far as it does not change while it is drawn.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// What messages call the job.
    pub name: String,
    /// The profile of the plotter with everything that it inherits, in TOML.
    pub profile: String,
    /// Speed of the line in baud.
    pub baud: u32,
    /// Pieces (lines or instructions) of the job.
    pub pieces: u64,
    /// When it was begun, in ms since 1970.
    pub begun_ms: u64,
}

/// How far a job was at some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Pieces of the job that were carried out, motion included.
    pub executed: u64,
    /// The pen in the holder.
    pub pen: u32,
    /// Pieces beyond these that the plotter had acknowledged, and may have carried out since.
    pub ahead: u32,
    /// Place of the pen after the last of these pieces, in mm of the job's coordinate system; none where it is unknown.
    pub position: Option<[f64; 3]>,
    /// When, in ms since 1970.
    pub time_ms: u64,
}

/// What is in a journal.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// What the job is.
    pub head: Head,
    /// The job itself.
    pub job: Vec<u8>,
    /// The last record; none when nothing is known to be drawn.
    pub last: Option<Record>,
    /// Good records.
    pub(super) records: u32,
    /// Bytes of the header.
    pub(super) header_bytes: usize,
    /// CRC of the header.
    pub(super) seed: u32,
}

/// Why bytes are no journal that can be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FormatError {
    /// Something else.
    #[error("is no journal of a plot")]
    Other,
    /// Of a later version of the program.
    #[error(
        "has version {found} and this program reads version {VERSION}; resume with the program that began the plot"
    )]
    Version {
        /// Its version.
        found: u32,
    },
    /// It ends too early.
    #[error("ends at byte {at}, within the job; begin anew with --restart")]
    Cut {
        /// Its length in bytes.
        at: usize,
    },
    /// A byte is not what it was.
    #[error("is damaged at byte {at} or behind it; begin anew with --restart")]
    Damaged {
        /// Where the damaged part begins.
        at: usize,
    },
}

/// The header of a journal, and the CRC that its records begin with.
///
/// # Errors
/// If the head cannot be written as JSON.
pub(super) fn header(head: &Head, job: &[u8]) -> Result<(Vec<u8>, u32), serde_json::Error> {
    let text = serde_json::to_vec(head)?;
    let mut bytes = Vec::with_capacity(PREAMBLE + text.len() + job.len() + CRC);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    // A head is a name and a profile: far below 4 GiB. Were it not, the CRC would be of another length and refuse it.
    bytes.extend_from_slice(&(text.len() as u32).to_le_bytes());
    bytes.extend_from_slice(&(job.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&text);
    bytes.extend_from_slice(job);
    let seed = crc32fast::hash(&bytes);
    bytes.extend_from_slice(&seed.to_le_bytes());
    Ok((bytes, seed))
}

/// The bytes of record `index` when `synced` of those before it are on the disk.
pub(super) fn record(record: &Record, index: u32, synced: u32, seed: u32) -> [u8; RECORD] {
    let mut bytes = [0; RECORD];
    let mut at = CRC;
    let mut put = |field: &[u8]| {
        bytes[at..at + field.len()].copy_from_slice(field);
        at += field.len();
    };
    put(&index.to_le_bytes());
    put(&synced.to_le_bytes());
    put(&record.pen.to_le_bytes());
    put(&record.executed.to_le_bytes());
    put(&record.time_ms.to_le_bytes());
    for coordinate in record.position.unwrap_or([f64::NAN; 3]) {
        put(&coordinate.to_le_bytes());
    }
    put(&record.ahead.to_le_bytes());
    let crc = checksum(seed, &bytes[CRC..]);
    bytes[..CRC].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Reads a journal.
///
/// # Errors
/// [`FormatError`]: the bytes are no journal, or one that was damaged after it was on the disk.
pub fn parse(bytes: &[u8]) -> Result<Contents, FormatError> {
    // A short beginning of a journal is a journal that was cut off.
    let begin = &bytes[..bytes.len().min(MAGIC.len())];
    if !MAGIC.starts_with(begin) || begin.is_empty() {
        return Err(FormatError::Other);
    }
    let cut = FormatError::Cut { at: bytes.len() };
    let mut fields = Fields(bytes.get(MAGIC.len()..).unwrap_or_default());
    let version = fields.u32().ok_or(cut.clone())?;
    if version != VERSION {
        return Err(FormatError::Version { found: version });
    }
    let (head_bytes, job_bytes) = fields.u32().zip(fields.u64()).ok_or(cut.clone())?;
    let lengths = usize::try_from(head_bytes).ok().zip(usize::try_from(job_bytes).ok());
    let ends = lengths.and_then(|(head, job)| {
        let head = PREAMBLE.checked_add(head)?;
        Some((head, head.checked_add(job)?))
    });
    let (head_end, job_end) = ends.ok_or(cut.clone())?;
    let crc = bytes.get(job_end..).and_then(|rest| Fields(rest).u32()).ok_or(cut)?;
    let damaged = FormatError::Damaged { at: 0 };
    let (Some(checked), Some(text), Some(job)) =
        (bytes.get(..job_end), bytes.get(PREAMBLE..head_end), bytes.get(head_end..job_end))
    else {
        return Err(damaged);
    };
    if crc32fast::hash(checked) != crc {
        return Err(damaged);
    }
    let head: Head = serde_json::from_slice(text).map_err(|_| FormatError::Damaged { at: PREAMBLE })?;
    let header_bytes = job_end + CRC;
    let (last, records) = records(&bytes[header_bytes..], header_bytes, crc, head.pieces)?;
    Ok(Contents { job: job.to_vec(), head, last, records, header_bytes, seed: crc })
}

/// The last of the good records, and their count. `offset` is where they begin in the file.
fn records(bytes: &[u8], offset: usize, seed: u32, pieces: u64) -> Result<(Option<Record>, u32), FormatError> {
    let mut last: Option<Record> = None;
    let mut count: u32 = 0;
    let mut damaged = None;
    for (index, bytes) in bytes.chunks_exact(RECORD).enumerate() {
        let at = offset + index * RECORD;
        let Some((record, synced)) = u32::try_from(index).ok().and_then(|index| read_record(bytes, index, seed)) else {
            damaged.get_or_insert((index, at));
            continue;
        };
        match damaged {
            Some((index, at)) if synced as usize > index => return Err(FormatError::Damaged { at }),
            Some(_) => {}
            // What is checked and still says what cannot be was not written by this program.
            None if record.executed > pieces => return Err(FormatError::Damaged { at }),
            None => {
                last = Some(record);
                count += 1;
            }
        }
    }
    Ok((last, count))
}

/// A record and how many before it were on the disk; none if it is not record `index` of this journal.
fn read_record(bytes: &[u8], index: u32, seed: u32) -> Option<(Record, u32)> {
    let (crc, rest) = bytes.split_at_checked(CRC)?;
    if checksum(seed, rest).to_le_bytes() != crc {
        return None;
    }
    let mut fields = Fields(rest);
    if fields.u32()? != index {
        return None;
    }
    let synced = fields.u32()?;
    let pen = fields.u32()?;
    let executed = fields.u64()?;
    let time_ms = fields.u64()?;
    let position = [fields.f64()?, fields.f64()?, fields.f64()?];
    let position = position.iter().all(|x| x.is_finite()).then_some(position);
    let ahead = fields.u32()?;
    Some((Record { executed, ahead, pen, position, time_ms }, synced))
}

fn checksum(seed: u32, bytes: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new_with_initial(seed);
    hasher.update(bytes);
    hasher.finalize()
}

/// Numbers one after the other; none when there are no more.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*field)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn head(pieces: u64) -> Head {
        Head { name: "a job".into(), profile: "name = \"x\"\n".into(), baud: 115_200, pieces, begun_ms: 1 }
    }

    fn at(executed: u64) -> Record {
        let position = executed.is_multiple_of(3).then_some([executed as f64, -1.5, 0.0]);
        Record { executed, ahead: 5, pen: 2, position, time_ms: 7 }
    }

    /// A journal with records, each with what was on the disk before it, and the length of its header.
    fn journal(synced: &[u32]) -> (Vec<u8>, usize) {
        let (mut bytes, seed) = header(&head(100), b"G21\nG1X1\n").unwrap();
        let header_bytes = bytes.len();
        for (index, synced) in synced.iter().enumerate() {
            bytes.extend_from_slice(&record(&at(3 + 2 * index as u64), index as u32, *synced, seed));
        }
        (bytes, header_bytes)
    }

    #[test]
    fn what_is_written_is_read() {
        let (bytes, header_bytes) = journal(&[0, 0, 2]);
        let contents = parse(&bytes).unwrap();
        assert_eq!((&contents.head, &contents.job[..]), (&head(100), &b"G21\nG1X1\n"[..]));
        assert_eq!((contents.last, contents.records, contents.header_bytes), (Some(at(7)), 3, header_bytes));
        let (bytes, _) = journal(&[]);
        assert_eq!(parse(&bytes).unwrap().last, None);
        let (bytes, _) = journal(&[0]);
        assert_eq!(parse(&bytes).unwrap().last.unwrap().position, Some([3.0, -1.5, 0.0]));
    }

    #[test]
    fn a_journal_cut_off_anywhere_is_what_was_written_before() {
        let (bytes, header_bytes) = journal(&[0, 1, 1, 3]);
        for length in 0..header_bytes {
            let expected = if length == 0 { FormatError::Other } else { FormatError::Cut { at: length } };
            assert_eq!(parse(&bytes[..length]), Err(expected));
        }
        for length in header_bytes..=bytes.len() {
            let whole = (length - header_bytes) / RECORD;
            let contents = parse(&bytes[..length]).unwrap();
            assert_eq!(contents.records as usize, whole);
            assert_eq!(contents.last, (whole > 0).then(|| at(1 + 2 * whole as u64)));
        }
    }

    #[test]
    fn what_was_not_on_the_disk_may_be_anything() {
        // Record 1 is lost, record 2 is whole and does not claim that 1 was safe.
        let (mut bytes, header_bytes) = journal(&[0, 1, 1]);
        let second = header_bytes + RECORD;
        bytes[second..second + RECORD].fill(0);
        assert_eq!(parse(&bytes).unwrap().last, Some(at(3)));
        let (mut bytes, _) = journal(&[0, 1, 2]);
        bytes[second + 20] ^= 1;
        assert_eq!(parse(&bytes), Err(FormatError::Damaged { at: second }));
    }

    #[test]
    fn records_of_another_journal_or_another_place_are_none() {
        let (bytes, header_bytes) = journal(&[0, 1]);
        let mut doubled = bytes.clone();
        doubled.extend_from_slice(&bytes[header_bytes..]);
        assert_eq!(parse(&doubled).unwrap(), parse(&bytes).unwrap());
        let (mut other, seed) = header(&head(99), b"G21\nG1X1\n").unwrap();
        assert_ne!(seed, parse(&bytes).unwrap().seed);
        other.extend_from_slice(&bytes[header_bytes..]);
        assert_eq!(parse(&other).unwrap().records, 0);
    }

    #[test]
    fn what_was_noted_may_be_taken_back() {
        let (mut bytes, seed) = header(&head(100), b"G21").unwrap();
        bytes.extend_from_slice(&record(&at(9), 0, 0, seed));
        bytes.extend_from_slice(&record(&at(8), 1, 1, seed));
        assert_eq!(parse(&bytes).unwrap().last, Some(at(8)));
    }

    #[test]
    fn what_cannot_be_is_damage() {
        let (mut bytes, seed) = header(&head(100), b"G21").unwrap();
        let at_record = bytes.len();
        bytes.extend_from_slice(&record(&at(101), 0, 0, seed));
        assert_eq!(parse(&bytes), Err(FormatError::Damaged { at: at_record }));
        assert_eq!(parse(b"G21\n"), Err(FormatError::Other));
        let (mut bytes, _) = journal(&[]);
        bytes[MAGIC.len()] = 9;
        assert_eq!(parse(&bytes), Err(FormatError::Version { found: 9 }));
        // A length that no file has asks for no memory.
        let (mut bytes, _) = journal(&[]);
        bytes[24..32].fill(0xff);
        assert!(matches!(parse(&bytes), Err(FormatError::Cut { .. })));
    }

    proptest! {
        /// Changed bytes are an error or a state that was there earlier, never one that was not.
        #[test]
        fn changed_bytes_never_claim_more(
            lags in proptest::collection::vec(0_u32..3, 0..12),
            changes in proptest::collection::vec((any::<proptest::sample::Index>(), 1_u8..), 1..4),
        ) {
            let synced: Vec<u32> = lags.iter().enumerate().map(|(i, lag)| (i as u32).saturating_sub(*lag)).collect();
            let (mut bytes, header_bytes) = journal(&synced);
            let whole = bytes.clone();
            for (place, flip) in changes {
                let place = place.index(bytes.len());
                bytes[place] ^= flip;
            }
            prop_assume!(bytes != whole);
            let first = bytes.iter().zip(&whole).position(|(a, b)| a != b).unwrap_or(0);
            match parse(&bytes) {
                Err(_) => {}
                Ok(contents) => {
                    prop_assert!(first >= header_bytes);
                    prop_assert_eq!(&contents.job[..], &b"G21\nG1X1\n"[..]);
                    let before = (first - header_bytes) / RECORD;
                    prop_assert_eq!(contents.records as usize, before);
                    prop_assert!(synced.iter().enumerate().all(|(i, s)| i <= before || *s as usize <= before
                        || bytes[header_bytes + i * RECORD..][..RECORD] != whole[header_bytes + i * RECORD..][..RECORD]));
                }
            }
        }

        #[test]
        fn any_bytes_end_in_a_result(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&bytes);
            let mut begun = MAGIC.to_vec();
            begun.extend_from_slice(&VERSION.to_le_bytes());
            begun.extend_from_slice(&bytes);
            let _ = parse(&begun);
        }
    }
}

//! The frame of a stored scene: what it is, how long, and whether it arrived whole.
//!
//! ```text
//! byte  0   4   magic, "PVSC"
//!       4   2   version of the format, u16, little-endian
//!       6   2   zero
//!       8   4   length of what follows the header in bytes, u32, little-endian
//!      12   4   CRC-32 (IEEE) of what follows the header, u32, little-endian
//!      16       records in postcard: the head, then surface after surface
//! ```

use alloc::vec::Vec;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use penvis_core::nurbs::NurbsError;
use penvis_core::trim::TrimError;
use penvis_core::view::CameraError;

/// Bytes before the records.
pub const HEADER_BYTES: usize = 16;

/// Version of the format that this code writes, and the only one that it reads.
pub const VERSION: u16 = 1;

const MAGIC: &[u8; 4] = b"PVSC";

/// Without a table, which would be most of what this takes in flash.
fn checksum(records: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(records)
}

/// Why bytes are no stored scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The first bytes are others.
    #[error("this is no stored scene: it does not begin with PVSC; make one with `penvis pack`")]
    Magic,
    /// Another version of the format.
    #[error("the scene is stored in version {version} of the format, and this reads version {VERSION}; pack it anew")]
    Version {
        /// The version found.
        version: u16,
    },
    /// There are not as many bytes as the header says.
    #[error("the scene has {found} bytes and its header says {expected}; send all of it, and nothing else")]
    Length {
        /// Bytes there are.
        found: usize,
        /// Bytes there should be.
        expected: usize,
    },
    /// The checksum is another one.
    #[error("the scene is damaged: its checksum is {found:08x} and its header says {expected:08x}; send it again")]
    Checksum {
        /// CRC-32 of the records.
        found: u32,
        /// CRC-32 in the header.
        expected: u32,
    },
    /// A record ends early, or holds what no record holds.
    #[error("the {record} of the scene is not as `penvis pack` writes it; pack it anew")]
    Record {
        /// Which record.
        record: Place,
    },
    /// More than fits.
    #[error("the scene has more than 4 GB")]
    TooLarge,
    /// A number is not finite, or out of range.
    #[error("the {what} of the scene is out of range; pack it anew")]
    Range {
        /// What it is.
        what: &'static str,
    },
    /// A line for the plotter is too long or not plain.
    #[error("the scene has a line for the plotter that is longer than 79 characters or not printable ASCII")]
    Line,
    /// The view is none.
    #[error("the view of the scene: {0}")]
    View(#[from] CameraError),
    /// A surface is none.
    #[error("surface {index} of the scene: {source}")]
    Surface {
        /// Index of the surface.
        index: usize,
        /// What is wrong.
        source: NurbsError,
    },
    /// The trims of a surface are none.
    #[error("the trims of surface {index} of the scene: {source}")]
    Trims {
        /// Index of the surface.
        index: usize,
        /// What is wrong.
        source: TrimError,
    },
}

/// A record of a stored scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The head.
    Head,
    /// The surface of this index.
    Surface(usize),
    /// What comes after the last surface.
    End,
}

impl core::fmt::Display for Place {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Head => f.write_str("head"),
            Self::Surface(index) => write!(f, "surface {index}"),
            Self::End => f.write_str("end"),
        }
    }
}

/// A stored scene of these records, whatever they are; `None` if they are 4 GB or more.
#[must_use]
pub fn frame(records: &[u8]) -> Option<Vec<u8>> {
    let length = u32::try_from(records.len()).ok()?;
    let mut out = Vec::with_capacity(HEADER_BYTES + records.len());
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&VERSION.to_le_bytes());
    out.extend_from_slice(&[0, 0]);
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&checksum(records).to_le_bytes());
    out.extend_from_slice(records);
    Some(out)
}

/// The records in a frame, once its length and its checksum are right.
pub(super) fn records(bytes: &[u8]) -> Result<&[u8], SceneError> {
    let (Some(header), Some(records)) = (bytes.first_chunk::<HEADER_BYTES>(), bytes.get(HEADER_BYTES..)) else {
        return Err(if bytes.starts_with(MAGIC) {
            SceneError::Length { found: bytes.len(), expected: HEADER_BYTES }
        } else {
            SceneError::Magic
        });
    };
    let [m0, m1, m2, m3, v0, v1, z0, z1, l0, l1, l2, l3, c0, c1, c2, c3] = *header;
    if [m0, m1, m2, m3] != *MAGIC {
        return Err(SceneError::Magic);
    }
    let version = u16::from_le_bytes([v0, v1]);
    if version != VERSION || [z0, z1] != [0, 0] {
        return Err(SceneError::Version { version });
    }
    let length = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
    if records.len() != length {
        return Err(SceneError::Length { found: bytes.len(), expected: length.saturating_add(HEADER_BYTES) });
    }
    let (found, expected) = (checksum(records), u32::from_le_bytes([c0, c1, c2, c3]));
    if found == expected { Ok(records) } else { Err(SceneError::Checksum { found, expected }) }
}

/// Bytes that the whole scene will have, as soon as its header is there.
///
/// # Errors
/// If the header is none, or of another version.
pub fn announced(bytes: &[u8]) -> Result<Option<usize>, SceneError> {
    match records(bytes) {
        Ok(_) => Ok(Some(bytes.len())),
        Err(SceneError::Length { expected, .. }) if bytes.len() >= HEADER_BYTES => Ok(Some(expected)),
        Err(SceneError::Length { .. }) => Ok(None),
        Err(SceneError::Magic) if bytes.len() < MAGIC.len() && MAGIC.starts_with(bytes) => Ok(None),
        Err(SceneError::Checksum { .. }) => Ok(Some(bytes.len())),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_held_against_its_length_and_checksum() {
        let whole = frame(b"123456789").unwrap();
        assert_eq!(records(&whole), Ok(&b"123456789"[..]));
        // The check value of CRC-32 as in Ethernet.
        assert_eq!(whole[12..16], 0xcbf4_3926_u32.to_le_bytes());
        for length in 0..whole.len() {
            let part = &whole[..length];
            assert!(records(part).is_err(), "{length}");
            assert_eq!(announced(part), Ok((length >= HEADER_BYTES).then_some(whole.len())), "{length}");
        }
        for at in 0..whole.len() {
            let mut other = whole.clone();
            other[at] ^= 0x10;
            let error = records(&other).unwrap_err();
            match at {
                0..4 => assert_eq!(error, SceneError::Magic),
                4..8 => assert!(matches!(error, SceneError::Version { .. })),
                8..12 => assert!(matches!(error, SceneError::Length { .. })),
                _ => assert!(matches!(error, SceneError::Checksum { .. })),
            }
        }
    }
}

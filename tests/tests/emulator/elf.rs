//! What an image takes of a board, by its ELF file.

/// Bytes.
pub(crate) struct Size {
    /// What is stored: code, constants, first values of variables.
    pub(crate) flash: u64,
    /// Variables.
    pub(crate) ram: u64,
}

/// Where RAM begins on every Cortex-M.
const RAM: u32 = 0x2000_0000;

/// Sizes of a 32-bit little-endian image, from its loadable segments.
///
/// # Panics
/// If it is none.
pub(crate) fn size(image: &[u8]) -> Size {
    assert_eq!(image.get(..6), Some(&b"\x7fELF\x01\x01"[..]), "a 32-bit little-endian ELF file");
    let half = |at: usize| usize::from(u16::from_le_bytes([image[at], image[at + 1]]));
    let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| image[at + i]));
    let (table, entry, count) = (word(28) as usize, half(42), half(44));
    let mut size = Size { flash: 0, ram: 0 };
    for segment in (0..count).map(|k| table + k * entry).filter(|&at| word(at) == 1) {
        size.flash += u64::from(word(segment + 16));
        if word(segment + 8) >= RAM {
            size.ram += u64::from(word(segment + 20));
        }
    }
    size
}

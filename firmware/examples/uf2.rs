//! Makes of the Pico's image a file that can be dropped on its drive, which it offers by USB when it is plugged in with BOOTSEL held.
//!
//! ```text
//! cargo run -p penvis-firmware --example uf2 -- target/thumbv6m-none-eabi/firmware/pico pico.uf2
//! ```
//!
//! The form is Microsoft's (<https://github.com/microsoft/uf2>): blocks of 512 bytes, each with 256 bytes of flash and where they belong.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::{env, fs};

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const END: u32 = 0x0ab1_6f30;
/// The field for the file's size names the processor instead.
const FAMILY_PRESENT: u32 = 0x2000;
const RP2040: u32 = 0xe48b_ff56;

/// Bytes of flash in a block: what the processor programs at once.
const PAGE: u32 = 256;
/// Bytes of a block from the beginning of its data to its last word.
const DATA: usize = 476;

/// Where the flash of an RP2040 is.
const FLASH: std::ops::Range<u32> = 0x1000_0000..0x1100_0000;

/// Type of a segment that is loaded.
const LOAD: u32 = 1;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [elf, uf2] = &arguments[..] else {
        eprintln!("error: two names are needed, the image's (ELF) and the new file's (UF2)");
        return ExitCode::from(2);
    };
    let made = fs::read(elf)
        .map_err(|e| format!("{elf}: {e}"))
        .and_then(|image| pages(&image).map_err(|e| format!("{elf}: {e}")))
        .and_then(|pages| fs::write(uf2, blocks(&pages)).map_err(|e| format!("{uf2}: {e}")));
    match made {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// The pages of flash that a 32-bit little-endian ELF file fills, by their address; what lies between its segments is zero.
fn pages(image: &[u8]) -> Result<BTreeMap<u32, [u8; PAGE as usize]>, String> {
    let cut = || "the file ends in the middle of a table or a segment".to_owned();
    let word = |at: usize| -> Result<u32, String> {
        let bytes = image.get(at..at + 4).ok_or_else(cut)?;
        Ok(bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)))
    };
    if image.get(..6) != Some(b"\x7fELF\x01\x01") {
        return Err("this is no 32-bit little-endian ELF file".to_owned());
    }
    let (table, entry, count) = (word(28)? as usize, (word(42)? & 0xffff) as usize, (word(44)? & 0xffff) as usize);
    let mut pages = BTreeMap::new();
    for at in (0..count).map(|k| table + k * entry) {
        let (kind, offset, address, size) =
            (word(at)?, word(at + 4)? as usize, word(at + 12)?, word(at + 16)? as usize);
        if kind != LOAD || size == 0 {
            continue;
        }
        if !FLASH.contains(&address) {
            return Err(format!(
                "a segment belongs to {address:#x}, which is no flash of an RP2040: is this the Pico's image?"
            ));
        }
        let bytes = image.get(offset..offset + size).ok_or_else(cut)?;
        for (place, byte) in (address..).zip(bytes) {
            pages.entry(place - place % PAGE).or_insert([0; PAGE as usize])[(place % PAGE) as usize] = *byte;
        }
    }
    Ok(pages)
}

fn blocks(pages: &BTreeMap<u32, [u8; PAGE as usize]>) -> Vec<u8> {
    let mut file = Vec::new();
    for (number, (address, page)) in (0..).zip(pages) {
        let count = pages.len() as u32;
        for word in [MAGIC[0], MAGIC[1], FAMILY_PRESENT, *address, PAGE, number, count, RP2040] {
            file.extend_from_slice(&word.to_le_bytes());
        }
        file.extend_from_slice(page);
        file.resize(file.len() + DATA - page.len(), 0);
        file.extend_from_slice(&END.to_le_bytes());
    }
    file
}

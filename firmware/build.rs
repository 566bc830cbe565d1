//! Writes the linker's map of memory for the board whose feature is on; on a host there is nothing to do.

use std::path::PathBuf;
use std::{env, fs};

/// Regions as `memory.x` of `cortex-m-rt` wants them. The stack begins at the end of RAM. `_scene` is where boards that draw stored scenes find one in their flash, of up to 64 KB;
/// nothing of the program is there, so that one can be flashed without it.
fn memory(board: &str) -> Option<&'static str> {
    Some(match board {
        // QEMU's model of both images has 4 MB of each.
        "MPS2_AN386" | "MPS2_AN500" => {
            "MEMORY {
    FLASH : ORIGIN = 0x00000000, LENGTH = 4M - 64K
    RAM   : ORIGIN = 0x20000000, LENGTH = 4M
}
_scene = ORIGIN(FLASH) + LENGTH(FLASH);
"
        }
        // The ROM loads the first 256 bytes, which set up the flash for the rest. The last 8 KB of flash hold the settings, and the 64 KB
        // before them a scene. RAM is the four striped banks and the two small ones after them.
        "PICO" => {
            "MEMORY {
    BOOT2 : ORIGIN = 0x10000000, LENGTH = 0x100
    FLASH : ORIGIN = 0x10000100, LENGTH = 2048K - 0x100 - 64K - 8K
    RAM   : ORIGIN = 0x20000000, LENGTH = 264K
}
_scene = ORIGIN(FLASH) + LENGTH(FLASH);
SECTIONS {
    .boot2 ORIGIN(BOOT2) : { KEEP(*(.boot2)) } > BOOT2
} INSERT BEFORE .text;
"
        }
        // The vectors have the first sector, of 16 KB; the next two hold the settings.
        "BLACK_PILL" => {
            "MEMORY {
    FLASH : ORIGIN = 0x08000000, LENGTH = 512K
    RAM   : ORIGIN = 0x20000000, LENGTH = 128K
}
_stext = ORIGIN(FLASH) + 48K;
"
        }
        _ => return None,
    })
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let boards: Vec<&str> = env::vars()
        .filter_map(|(name, _)| name.strip_prefix("CARGO_FEATURE_BOARD_").map(str::to_owned))
        .collect::<Vec<_>>()
        .leak()
        .iter()
        .map(String::as_str)
        .collect();
    match boards[..] {
        // The library alone.
        [] => (),
        [board] => {
            let map =
                memory(board).unwrap_or_else(|| panic!("build.rs has no memory map for the board {board}: add one"));
            let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
            fs::write(out.join("memory.x"), map).expect("OUT_DIR can be written");
            println!("cargo::rustc-link-search={}", out.display());
            println!("cargo::rustc-link-arg-bins=-Tlink.x");
            // Sections begin where they are meant to, not at the next page.
            println!("cargo::rustc-link-arg-bins=--nmagic");
        }
        _ => panic!("one board at a time: {boards:?}"),
    }
}

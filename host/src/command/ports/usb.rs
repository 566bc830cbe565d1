//! What is behind a USB port, by its numbers.
//!
//! Numbers of vendors and products are those of <http://www.linux-usb.org/usb.ids>, of Arduino's `boards.txt`
//! (<https://github.com/arduino/ArduinoCore-avr>), of Espressif's documentation of the USB serial controller in its chips, and of
//! Evil Mad Scientist's documentation of the EiBotBoard.

/// A vendor's product, and what it is in.
struct Known {
    vendor: u16,
    /// None: any.
    product: Option<u16>,
    chip: &'static str,
    guess: &'static str,
}

const fn known(vendor: u16, product: u16, chip: &'static str, guess: &'static str) -> Known {
    Known { vendor, product: Some(product), chip, guess }
}

const fn vendor(vendor: u16, chip: &'static str, guess: &'static str) -> Known {
    Known { vendor, product: None, chip, guess }
}

/// On boards of the kind of Arduino.
const ARDUINO: &str = "a board with GRBL, most likely: --device grbl-servo or grbl-z";
/// In cables.
const CABLE: &str =
    "an adapter cable, or an older board: for HP and Roland plotters --device hp7475a, hp7470a, dxy1100";
/// On boards with an ESP32.
const ESP32: &str = "a board with an ESP32, most likely FluidNC: --device fluidnc";
/// On boards that run grblHAL.
const HAL: &str = "a board that grblHAL runs on: --device grblhal";

/// The first that fits is the one.
const TABLE: &[Known] = &[
    known(0x1a86, 0x7523, "CH340", ARDUINO),
    known(0x1a86, 0x5523, "CH341", ARDUINO),
    known(0x1a86, 0x55d3, "CH343", ESP32),
    known(0x1a86, 0x55d4, "CH9102", ESP32),
    known(0x10c4, 0xea60, "CP210x", ESP32),
    known(0x303a, 0x1001, "ESP32 with USB of its own", ESP32),
    vendor(0x2341, "Arduino", ARDUINO),
    vendor(0x2a03, "Arduino", ARDUINO),
    known(0x0403, 0x6001, "FTDI FT232", CABLE),
    known(0x0403, 0x6015, "FTDI FT-X", CABLE),
    vendor(0x0403, "FTDI", CABLE),
    known(0x067b, 0x2303, "Prolific PL2303", CABLE),
    vendor(0x067b, "Prolific", CABLE),
    known(0x0483, 0x5740, "STM32", HAL),
    known(0x2e8a, 0x000a, "Raspberry Pi Pico", HAL),
    known(0x16c0, 0x0483, "Teensy", HAL),
    known(0x1d50, 0x6029, "Marlin", "a board with Marlin: --device marlin-servo or marlin-z"),
    known(0x04d8, 0xfd92, "EiBotBoard", "an AxiDraw or its kin, whose language penvis does not speak"),
];

/// The chip with these numbers, and what it is in, most likely.
pub(super) fn guess(vendor: u16, product: u16) -> Option<(&'static str, &'static str)> {
    let fits = |known: &&Known| known.vendor == vendor && known.product.is_none_or(|other| other == product);
    TABLE.iter().find(fits).map(|known| (known.chip, known.guess))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::names;

    #[test]
    fn products_come_before_their_vendors() {
        assert_eq!(guess(0x0403, 0x6015).unwrap().0, "FTDI FT-X");
        assert_eq!(guess(0x0403, 1).unwrap().0, "FTDI");
        assert_eq!(guess(0x2341, 0x0043).unwrap().0, "Arduino");
        assert_eq!(guess(0x1a86, 1), None);
        for (k, known) in TABLE.iter().enumerate() {
            let same =
                |other: &Known| other.vendor == known.vendor && other.product.is_none_or(|p| Some(p) == known.product);
            assert!(!TABLE[..k].iter().any(same), "{} is never found", known.chip);
        }
    }

    #[test]
    fn guesses_name_devices_that_there_are() {
        for known in TABLE {
            let Some((_, list)) = known.guess.split_once("--device ") else { continue };
            for name in list.replace(" or ", ", ").split(", ") {
                assert!(names().contains(&name), "{name}");
            }
        }
    }
}

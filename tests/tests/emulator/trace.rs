//! The path of an emulated board's pen, rebuilt from what it traced: see `firmware/boards/mps2/trace.rs` for the form.

use glam::DVec2;
use penvis::sim::{Recording, Trace};
use penvis_firmware::AXES;

/// Level above which the servo has the pen down: half way between those of the simulated plotter's profile.
const BORDER: u16 = 0x8000;

/// Reads a trace to its end. Every step becomes a point, at `step_mm` from the one before.
///
/// # Errors
/// Where it is not one: at what byte, and why.
pub(crate) fn recording(bytes: &[u8], step_mm: [f64; 2], ticks_per_us: f64) -> Result<Recording, String> {
    let mut reader = Reader { bytes, at: 0 };
    let mut recording = Recording::default();
    let mut negative = 0u8;
    let mut ticks = 0u64;
    let mut trace = Trace { pen: 1, pen_down: false, points: vec![DVec2::ZERO] };
    while let Some(what) = reader.byte() {
        let at = reader.at - 1;
        ticks += reader.number().ok_or(format!("byte {at}: a record without its time"))?;
        let (kind, bits) = (what >> 3, what & 7);
        match (kind, bits) {
            (0, axes) => {
                for axis in (0..AXES).filter(|axis| axes & 1 << axis != 0) {
                    recording.steps[axis] += 1;
                    recording.position[axis] += if negative & 1 << axis == 0 { 1 } else { -1 };
                }
                let [x, y, _] = recording.position.map(|steps| steps as f64);
                trace.points.push(DVec2::new(x * step_mm[0], y * step_mm[1]));
            }
            (1, axes) => negative = axes,
            (2, 0 | 1) => {
                let level = if bits == 0 {
                    0
                } else {
                    let bytes =
                        reader.byte().zip(reader.byte()).ok_or(format!("byte {at}: a pen without its level"))?;
                    u16::from_le_bytes([bytes.0, bytes.1])
                };
                let pen_down = level >= BORDER;
                if pen_down != trace.pen_down {
                    let from = trace.points.last().copied().unwrap_or_default();
                    let next = Trace { pen: 1, pen_down, points: vec![from] };
                    close(&mut recording, std::mem::replace(&mut trace, next));
                }
            }
            (3, 0 | 1) => {}
            (3, 2) => return Err(format!("byte {at}: records lost")),
            _ => return Err(format!("byte {at}: {what:#x} begins no record")),
        }
    }
    close(&mut recording, trace);
    recording.duration_s = ticks as f64 / ticks_per_us * 1e-6;
    Ok(recording)
}

/// Keeps a trace that drew or went anywhere; a dot is the same point twice.
fn close(recording: &mut Recording, mut trace: Trace) {
    if trace.points.len() == 1 && trace.pen_down {
        trace.points.push(trace.points[0]);
    }
    if trace.points.len() > 1 {
        recording.traces.push(trace);
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    /// LEB128.
    fn number(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }
}

#[test]
fn traces_are_read_to_the_byte() {
    // Pen down after 200 ticks, a step of both axes, one of x back, up again.
    let bytes = [0x11, 0xc8, 0x01, 0xff, 0xff, 0x03, 0x05, 0x09, 0x00, 0x01, 0x19, 0x10, 0x01];
    let got = recording(&bytes, [0.5, 0.25], 25.0).unwrap();
    assert_eq!((got.steps, got.position), ([2, 1, 0], [0, 1, 0]));
    let points = [DVec2::ZERO, DVec2::new(0.5, 0.25), DVec2::new(0.0, 0.25)];
    assert_eq!(got.traces, [Trace { pen: 1, pen_down: true, points: points.to_vec() }]);
    assert!((got.duration_s - (200 + 5 + 25 + 1) as f64 / 25e6).abs() < 1e-12);

    for end in [1, 2, 4, 10] {
        assert!(recording(&bytes[..end], [1.0, 1.0], 25.0).unwrap_err().contains("without"), "{end}");
    }
    assert!(recording(&[0x1a, 0], [1.0, 1.0], 25.0).unwrap_err().contains("lost"));
    assert!(recording(&[0x20, 0], [1.0, 1.0], 25.0).unwrap_err().contains("begins no record"));
}

//! What holds for every simulated plotter.

use std::io::Read;

use proptest::prelude::*;

use super::{SimName, SimPort};
use crate::device::find;

const NAMES: [&str; 6] =
    ["sim", "sim:grbl,$22=1", "sim:grblhal", "sim:fluidnc", "sim:marlin,inch=1", "sim:hpgl7475a,buffer=60"];

/// All that comes until nothing has come for as long as a read waits.
pub(super) fn hear_all(port: &mut SimPort) -> String {
    let mut text = Vec::new();
    let mut buffer = [0; 64];
    while let Ok(count) = port.read(&mut buffer) {
        text.extend_from_slice(&buffer[..count]);
    }
    String::from_utf8(text).unwrap()
}

/// What lines to plotters are made of, and what may become of them on the way.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        4 => prop::sample::select(vec![
            "G0", "G1", "G2", "G3", "G4", "G10", "G20", "G28", "G53", "G54", "G90", "G91", "G92", "G93", "M0", "M3", "M5", "M30",
            "M110", "M114", "M280", "M400", "M410", "N1", "*7", "X", "Y", "Z", "I", "J", "R", "F", "S", "P", "L2", "\n", "\n", "\r\n",
            "$H\n", "$X\n", "$$\n", "$J=G91X", "$32=", "$100=", "$N0=", "IN;", "SP1;", "PU", "PD", "PA", "PR", "CI", "AA", "SC", "IP", "IW",
            "LB", "OA;", "OE;", "VS", ";", ",", "\x1b.B", "\x1b.I80;0;17:", "\x1b.K", "\x1b.@", "\x1b.R",
        ])
        .prop_map(|text| text.as_bytes().to_vec()),
        3 => (-2000_i32..2000).prop_map(|n| (f64::from(n) / 8.0).to_string().into_bytes()),
        1 => prop::collection::vec(any::<u8>(), 1..4),
        1 => "[0-9]{30,60}".prop_map(String::into_bytes),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Nothing that arrives makes one panic, or work for ever without time going on.
    #[test]
    fn whatever_arrives_is_borne(name in prop::sample::select(NAMES.to_vec()), pieces in prop::collection::vec(piece(), 1..120)) {
        let name = SimName::parse(name).unwrap().unwrap();
        let mut peer = name.peer(&find(name.default_device()).unwrap()).unwrap();
        let mut now = 0;
        let mut settle = |peer: &mut Box<dyn super::Peer>, until: u64| {
            for _ in 0..2_000 {
                let mut left = 1_000_000;
                while peer.work() && left > 0 {
                    left -= 1;
                }
                assert!(left > 0, "it works without an end");
                while peer.transmit().is_some() {}
                if now == until {
                    break;
                }
                now = peer.next_event().clamp(now, until);
                peer.advance(now);
            }
        };
        let mut time = 2_000_000_000;
        settle(&mut peer, time);
        for byte in pieces.into_iter().flatten() {
            peer.receive(byte);
            time += 1_000_000;
            settle(&mut peer, time);
        }
        settle(&mut peer, time + 60_000_000_000);
        let recording = peer.recording();
        for trace in &recording.traces {
            prop_assert!(trace.points.len() > 1 && trace.points.iter().all(|point| point.is_finite()));
        }
    }
}

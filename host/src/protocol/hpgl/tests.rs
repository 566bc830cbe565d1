//! Conversations with a plotter that has a small buffer.

use proptest::prelude::*;

use super::*;

/// A plotter with a buffer, that draws one byte each time it is let.
struct Plotter {
    buffer: VecDeque<u8>,
    size: usize,
    knows_space: bool,
    overflowed: bool,
    drawn: Vec<u8>,
    pending: Vec<u8>,
}

impl Plotter {
    fn new(size: usize, knows_space: bool) -> Self {
        Self { buffer: VecDeque::new(), size, knows_space, overflowed: false, drawn: Vec::new(), pending: Vec::new() }
    }

    fn take(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut reply = Vec::new();
        for &byte in bytes {
            self.pending.push(byte);
            match self.pending.as_slice() {
                [0x1b] | [0x1b, b'.'] => {}
                [0x1b, b'.', what] => {
                    let answer = match what {
                        b'B' => Some(self.size - self.buffer.len()),
                        b'O' => Some(if self.buffer.is_empty() { 8 } else { 0 }),
                        b'E' => Some(if self.overflowed { 16 } else { 0 }),
                        _ => None,
                    };
                    if let (Some(answer), true) = (answer, self.knows_space) {
                        reply.extend(format!("{answer}\r").bytes());
                    }
                    self.pending.clear();
                }
                _ => {
                    self.pending.clear();
                    if self.buffer.len() < self.size {
                        self.buffer.push_back(byte);
                    } else {
                        self.overflowed = true;
                    }
                }
            }
        }
        reply
    }

    fn draw(&mut self, bytes: usize) -> Vec<u8> {
        let mut reply = Vec::new();
        for _ in 0..bytes {
            let Some(byte) = self.buffer.pop_front() else { break };
            self.drawn.push(byte);
            if self.drawn.ends_with(b"OA;") {
                self.drawn.truncate(self.drawn.len() - 3);
                reply.extend(b"100,200,0\r");
            } else if self.drawn.ends_with(b"OE;") {
                self.drawn.truncate(self.drawn.len() - 3);
                reply.extend(b"0\r");
            }
        }
        reply
    }
}

/// Runs a job to its end; the event at the end, and what was drawn.
fn run(hpgl: &[u8], mut plotter: Plotter, bytes_per_tick: usize) -> (Event, Plotter) {
    let options = Options { buffer_bytes: plotter.size, baud: 9600 };
    let mut protocol = Hpgl::new(Job::new(hpgl).unwrap(), options);
    for ms in (0..100_000_000).step_by(10) {
        let now = Duration::from_millis(ms);
        protocol.tick(now);
        let reply = plotter.take(&protocol.take_output());
        protocol.receive(&reply, now);
        let reply = plotter.draw(bytes_per_tick);
        protocol.receive(&reply, now);
        if let Some(event @ (Event::Done | Event::Failed(_))) = protocol.take_event() {
            return (event, plotter);
        }
    }
    panic!("no end");
}

fn long_job() -> Vec<u8> {
    let mut hpgl = b"IN;SP1;".to_vec();
    for i in 0..500 {
        hpgl.extend(format!("PU{i},0;PD{i},100,{i},200;").bytes());
    }
    hpgl.extend(b"PU;SP0;");
    hpgl
}

#[test]
fn every_byte_arrives_and_nothing_overflows() {
    for (size, knows_space) in [(60, true), (255, true), (1024, true), (15_358, true), (60, false), (1024, false)] {
        let (event, plotter) = run(&long_job(), Plotter::new(size, knows_space), 3);
        assert_eq!(event, Event::Done, "buffer of {size}");
        assert!(!plotter.overflowed && plotter.buffer.is_empty());
        assert_eq!(plotter.drawn, long_job());
    }
}

#[test]
fn an_instruction_longer_than_the_buffer_goes_in_parts() {
    let hpgl = format!("PU;PD{}1,1;PU;", "100,200,".repeat(100)).into_bytes();
    for knows_space in [true, false] {
        let (event, plotter) = run(&hpgl, Plotter::new(60, knows_space), 1);
        assert_eq!(event, Event::Done);
        assert!(!plotter.overflowed);
        assert_eq!(plotter.drawn, hpgl);
    }
}

#[test]
fn a_buffer_smaller_than_the_profile_says_is_respected_where_it_is_told() {
    let options = Options { buffer_bytes: 1024, baud: 9600 };
    let mut protocol = Hpgl::new(Job::new(&long_job()).unwrap(), options);
    protocol.tick(Duration::ZERO);
    assert_eq!(protocol.take_output(), b"\x1b.R\x1b.K\x1b.B");
    protocol.receive(b"60\r", Duration::ZERO);
    let out = protocol.take_output();
    assert!(out.starts_with(b"IN;SP1;PU0,0;") && out.ends_with(b";\x1b.B") && out.len() <= 63);
    protocol.receive(b"10\r", Duration::ZERO);
    assert!(protocol.take_output().is_empty());
    protocol.tick(POLL_INTERVAL);
    assert_eq!(protocol.take_output(), b"\x1b.B");
}

#[test]
fn failures() {
    // Nobody there.
    let mut protocol = Hpgl::new(Job::new(b"IN;").unwrap(), Options { buffer_bytes: 60, baud: 9600 });
    let mut event = None;
    for s in 0..60 {
        protocol.tick(Duration::from_secs(s));
        event = event.or(protocol.take_event());
    }
    assert_eq!(event, Some(Event::Failed(Fault::NoAnswer { baud: 9600 })));

    // It falls silent.
    let mut protocol = Hpgl::new(Job::new(&long_job()).unwrap(), Options { buffer_bytes: 60, baud: 9600 });
    protocol.tick(Duration::ZERO);
    protocol.receive(b"60\r", Duration::ZERO);
    protocol.tick(Duration::from_secs(10));
    let Some(Event::Failed(fault)) = protocol.take_event() else { panic!("it goes on") };
    assert!(fault.to_string().contains("instruction 8"), "{fault}");

    // It reports an overflow.
    let mut plotter = Plotter::new(60, true);
    plotter.overflowed = true;
    let (event, _) = run(b"IN;PU;", plotter, 1);
    let Event::Failed(fault) = event else { panic!("{event:?}") };
    assert!(fault.to_string().contains("line error 16"), "{fault}");
}

#[test]
fn its_user_is_told_of_a_halt_once() {
    let mut protocol = Hpgl::new(Job::new(b"IN;").unwrap(), Options { buffer_bytes: 60, baud: 9600 });
    protocol.tick(Duration::ZERO);
    protocol.receive(b"60\r", Duration::ZERO);
    for i in 1..10 {
        protocol.tick(Duration::from_secs(i));
        protocol.receive(b"16\r", Duration::from_secs(i));
    }
    assert!(matches!(protocol.take_event(), Some(Event::Message(text)) if text.contains("VIEW")));
    assert_eq!(protocol.take_event(), None);
}

#[test]
fn cancelling_aborts_what_is_buffered() {
    let mut protocol = Hpgl::new(Job::new(&long_job()).unwrap(), Options { buffer_bytes: 60, baud: 9600 });
    protocol.tick(Duration::ZERO);
    protocol.receive(b"60\r", Duration::ZERO);
    protocol.control(Control::Stop, Duration::ZERO);
    assert_eq!(protocol.take_output(), b"\x1b.KPU;SP0;");
    assert!(matches!(protocol.take_event(), Some(Event::Failed(Fault::Cancelled { .. }))));
}

proptest! {
    #[test]
    fn noise_does_no_harm(noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..20), 0..40)) {
        let mut protocol = Hpgl::new(Job::new(&long_job()).unwrap(), Options { buffer_bytes: 60, baud: 9600 });
        for (i, bytes) in noise.iter().enumerate() {
            protocol.receive(bytes, Duration::from_millis(300 * i as u64));
        }
    }
}

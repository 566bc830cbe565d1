//! Conversations with a plotter that has a small buffer, over good lines and bad ones.

use std::collections::VecDeque;

use proptest::prelude::*;

use super::*;

/// What a plotter knows.
#[derive(Clone, Copy, Debug, Default)]
struct Knows {
    space: bool,
    xon: bool,
    enq: bool,
    dtr: bool,
    /// It tells what it is after `IN;` only.
    wants_in: bool,
}

const SPACE: Knows = Knows { space: true, xon: true, enq: true, dtr: true, wants_in: false };
const XON_XOFF: Knows = Knows { space: false, ..SPACE };
const ENQ_ACK: Knows = Knows { xon: false, ..XON_XOFF };
const DTR: Knows = Knows { enq: false, ..ENQ_ACK };
const NONE: Knows = Knows { dtr: false, ..DTR };

/// A mangled byte, by its number from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mangle {
    Lost,
    Doubled,
    Changed(u8),
}

/// A line that mangles one byte.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    count: usize,
    fault: Option<(usize, Mangle)>,
}

impl Line {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            match self.fault.filter(|(at, _)| *at == self.count).map(|(_, mangle)| mangle) {
                None => out.push(byte),
                Some(Mangle::Lost) => {}
                Some(Mangle::Doubled) => out.extend([byte, byte]),
                Some(Mangle::Changed(bit)) => out.push(byte ^ (1 << bit)),
            }
            self.count += 1;
        }
        out
    }
}

/// A line that the pen drew, or a dot.
type Ink = ([i64; 2], [i64; 2]);

/// A plotter that draws some bytes each time it is let.
struct Plotter {
    knows: Knows,
    size: usize,
    buffer: VecDeque<u8>,
    control: Vec<u8>,
    word: Vec<u8>,
    at: [i64; 2],
    down: bool,
    absolute: bool,
    begun: bool,
    ink: Vec<Ink>,
    overflowed: bool,
    error: u32,
    xoff_below: Option<usize>,
    stopped: bool,
    block: Option<usize>,
    enquired: bool,
    out: Vec<u8>,
    speeds: Vec<i64>,
    pens: Vec<i64>,
    aborted: bool,
}

impl Plotter {
    fn new(size: usize, knows: Knows) -> Self {
        Self {
            knows,
            size,
            buffer: VecDeque::new(),
            control: Vec::new(),
            word: Vec::new(),
            at: [77, 7],
            down: false,
            absolute: true,
            begun: false,
            ink: Vec::new(),
            overflowed: false,
            error: 0,
            xoff_below: None,
            stopped: false,
            block: None,
            enquired: false,
            out: Vec::new(),
            speeds: Vec::new(),
            pens: Vec::new(),
            aborted: false,
        }
    }

    fn free(&self) -> usize {
        self.size - self.buffer.len()
    }

    fn say(&mut self, number: impl std::fmt::Display) {
        self.out.extend(format!("{number}\r").bytes());
    }

    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if !self.control.is_empty() {
                self.control.push(byte);
                self.obey();
            } else if byte == 0x1b {
                self.control.push(byte);
            } else if byte == ENQ && self.block.is_some() {
                self.enquired = true;
            } else if self.free() > 0 {
                self.buffer.push_back(byte);
            } else {
                self.overflowed = true;
            }
            self.shake_hands();
        }
    }

    fn shake_hands(&mut self) {
        if self.enquired && self.block.is_some_and(|block| self.free() >= block) {
            self.enquired = false;
            self.out.push(ACK);
        }
        if let Some(limit) = self.xoff_below {
            if !self.stopped && self.free() < limit {
                self.stopped = true;
                self.out.push(XOFF);
            } else if self.stopped && self.free() >= (limit + self.size) / 2 {
                self.stopped = false;
                self.out.push(XON);
            }
        }
    }

    /// Device control.
    fn obey(&mut self) {
        let control = self.control.clone();
        let [_, dot, rest @ ..] = control.as_slice() else { return };
        let Some((kind, rest)) = rest.split_first() else { return };
        if *dot != b'.' {
            return self.control.clear();
        }
        let parameters = matches!(kind, b'I' | b'N' | b'H' | b'@' | b'M');
        if parameters && rest.last() != Some(&b':') {
            return;
        }
        self.control.clear();
        let text = String::from_utf8_lossy(rest).trim_end_matches(':').to_owned();
        let first = text.split(';').next().and_then(|number| number.parse().ok());
        match kind {
            b'B' if self.knows.space => self.say(self.free()),
            b'L' if self.knows.space => self.say(self.size),
            b'O' if self.knows.space => self.say(if self.buffer.is_empty() { 8 } else { 0 }),
            b'E' if self.knows.space => self.say(if self.overflowed { 16 } else { 0 }),
            b'I' if self.knows.xon => self.xoff_below = first,
            b'H' if self.knows.enq => self.block = first,
            b'R' => (self.xoff_below, self.block, self.stopped) = (None, None, false),
            b'K' => {
                self.aborted = self.begun;
                self.buffer.clear();
                self.word.clear();
            }
            _ => {}
        }
    }

    fn draw(&mut self, bytes: usize) {
        for _ in 0..bytes {
            let Some(byte) = self.buffer.pop_front() else { break };
            self.parse(byte);
        }
        self.shake_hands();
    }

    fn parse(&mut self, byte: u8) {
        if self.word.starts_with(b"LB") {
            if byte == 3 {
                self.word.clear();
            } else {
                self.word.push(byte);
            }
            return;
        }
        if byte == b';' {
            let word = std::mem::take(&mut self.word);
            return self.carry_out(&word);
        }
        if byte.is_ascii_alphabetic() && self.word.len() >= 2 {
            let word = std::mem::take(&mut self.word);
            self.carry_out(&word);
        }
        self.word.push(byte);
    }

    fn carry_out(&mut self, word: &[u8]) {
        if word.is_empty() {
            return;
        }
        let text = String::from_utf8_lossy(word).into_owned();
        let numbers: Option<Vec<i64>> = match text.get(2..) {
            Some("") => Some(Vec::new()),
            Some(list) => list.split(',').map(|number| number.parse().ok()).collect(),
            None => None,
        };
        let Some(numbers) = numbers else {
            self.error = 1;
            return;
        };
        match &text[..2] {
            "IN" => (self.down, self.absolute, self.begun) = (false, true, true),
            "PU" | "PD" | "PA" | "PR" => {
                match &text[..2] {
                    "PU" => self.down = false,
                    "PD" => self.down = true,
                    mode => self.absolute = mode == "PA",
                }
                if !numbers.len().is_multiple_of(2) {
                    self.error = 2;
                    return;
                }
                for pair in numbers.chunks(2) {
                    let to =
                        if self.absolute { [pair[0], pair[1]] } else { [self.at[0] + pair[0], self.at[1] + pair[1]] };
                    if self.down {
                        self.ink.push((self.at, to));
                    }
                    self.at = to;
                }
            }
            "OA" => {
                let [x, y] = self.at;
                self.say(format!("{x},{y},{}", u8::from(self.down)));
            }
            "OE" => {
                self.say(self.error);
                self.error = 0;
            }
            "OI" if self.begun || !self.knows.wants_in => self.say("7475A"),
            "VS" => self.speeds.extend(numbers),
            "SP" => self.pens.extend(numbers),
            "LT" | "OI" => {}
            _ => self.error = 1,
        }
    }
}

/// What a plotter draws that is told all of the job at once.
fn drawn(hpgl: &[u8]) -> Vec<Ink> {
    let mut plotter = Plotter::new(1 << 20, NONE);
    plotter.take(hpgl);
    plotter.draw(1 << 20);
    assert_eq!(plotter.error, 0);
    plotter.ink
}

fn options(size: usize, handshake: Handshake) -> Options {
    Options {
        name: "hp7475a".into(),
        buffer_bytes: size,
        list_points: 32,
        encoded: false,
        pens: 6,
        handshake,
        speeds: Some((38.0, 38)),
        baud: 9600,
    }
}

/// A job on its way to a plotter.
struct Run {
    protocol: Hpgl,
    plotter: Plotter,
    to: Line,
    from: Line,
    bytes_per_tick: usize,
    events: Vec<Event>,
    ms: u64,
}

impl Run {
    fn new(hpgl: &[u8], plotter: Plotter, handshake: Handshake) -> Self {
        let protocol = Hpgl::new(Job::new(hpgl).unwrap(), options(plotter.size, handshake));
        let (to, from) = (Line::default(), Line::default());
        Self { protocol, plotter, to, from, bytes_per_tick: 3, events: Vec::new(), ms: 0 }
    }

    fn step(&mut self) {
        let now = Duration::from_millis(self.ms);
        if self.protocol.watches_lines() {
            let ready = self.plotter.knows.dtr && self.plotter.free() > self.plotter.size / 4;
            self.protocol.lines(Lines { clear_to_send: ready, data_set_ready: false }, now);
        }
        self.protocol.tick(now);
        let bytes = self.protocol.take_output();
        self.plotter.take(&self.to.carry(&bytes));
        self.plotter.draw(self.bytes_per_tick);
        let reply = std::mem::take(&mut self.plotter.out);
        self.protocol.receive(&self.from.carry(&reply), now);
        while let Some(event) = self.protocol.take_event() {
            self.events.push(event);
        }
        self.ms += 10;
    }

    /// To the end; the event there.
    fn finish(&mut self) -> Event {
        while self.ms < 20_000_000 {
            self.step();
            if let Some(event @ (Event::Done | Event::Failed(_))) = self.events.last() {
                return event.clone();
            }
        }
        panic!("no end");
    }
}

fn long_job(strokes: usize) -> Vec<u8> {
    let mut hpgl = b"IN;SP1;".to_vec();
    for i in 0..strokes {
        hpgl.extend(format!("PU{},0;PD{i},100,{},200;PD{i},201;", 3 * i, i + 7).bytes());
    }
    hpgl.extend(b"PU;SP0;");
    hpgl
}

const SIZES: [usize; 4] = [60, 255, 1024, 15_358];

#[test]
fn every_handshake_draws_all_and_overflows_nothing() {
    let job = long_job(200);
    for size in SIZES {
        for (handshake, knows) in [
            (Handshake::EscB, SPACE),
            (Handshake::XonXoff, XON_XOFF),
            (Handshake::EnqAck, ENQ_ACK),
            (Handshake::Hardware, DTR),
            (Handshake::Oa, NONE),
        ] {
            let mut run = Run::new(&job, Plotter::new(size, knows), handshake);
            let event = run.finish();
            assert_eq!(event, Event::Done, "{handshake:?}, {size} bytes");
            assert!(!run.plotter.overflowed && run.plotter.buffer.is_empty(), "{handshake:?}, {size} bytes");
            assert_eq!(run.plotter.ink, drawn(&job), "{handshake:?}, {size} bytes");
            let progress = run.protocol.progress();
            assert_eq!((progress.acknowledged, progress.executed), (progress.total, progress.total));
        }
    }
}

#[test]
fn the_handshake_is_found_in_order() {
    let job = long_job(30);
    let table = [
        (SPACE, Handshake::EscB),
        (XON_XOFF, Handshake::XonXoff),
        (ENQ_ACK, Handshake::EnqAck),
        (DTR, Handshake::Oa),
        (NONE, Handshake::Oa),
    ];
    for (knows, expected) in table {
        let mut run = Run::new(&job, Plotter::new(255, knows), Handshake::Auto);
        assert_eq!(run.finish(), Event::Done, "{knows:?}");
        assert_eq!(run.protocol.handshake(), expected);
        assert_eq!(run.plotter.ink, drawn(&job));
        // The plotter's line, where it is wired, holds up what is sent all the same.
        assert_eq!(run.protocol.watches_lines(), matches!((knows.enq, knows.dtr), (false, true)));
    }
}

#[test]
fn a_plotter_that_was_booting_is_told_of_the_handshake_again() {
    for (handshake, knows) in [(Handshake::EnqAck, ENQ_ACK), (Handshake::XonXoff, XON_XOFF)] {
        let mut run = Run::new(&long_job(30), Plotter::new(255, knows), handshake);
        while run.ms < 1000 {
            run.protocol.tick(Duration::from_millis(run.ms));
            run.protocol.take_output();
            run.ms += 10;
        }
        assert_eq!(run.finish(), Event::Done);
        assert!(run.plotter.block.is_some() || run.plotter.xoff_below.is_some(), "{handshake:?}");
    }
}

#[test]
fn a_handshake_that_is_asked_for_is_not_replaced() {
    let mut run = Run::new(b"IN;", Plotter::new(255, NONE), Handshake::EscB);
    assert_eq!(run.finish(), Event::Failed(Fault::NoAnswer { baud: 9600 }));
    // Nothing is sent to a plotter that is never ready.
    let mut run = Run::new(b"IN;PA1,1;", Plotter::new(255, NONE), Handshake::Hardware);
    let event = run.finish();
    assert!(matches!(event, Event::Failed(Fault::Silent { .. })), "{event:?}");
    assert!(run.plotter.ink.is_empty());
}

#[test]
fn the_plotter_says_what_it_is() {
    for wants_in in [false, true] {
        let plotter = Plotter::new(255, Knows { wants_in, ..SPACE });
        let mut run = Run::new(b"IN;PA1,1;", plotter, Handshake::Auto);
        run.protocol.options.name = "dxy1100".into();
        assert_eq!(run.finish(), Event::Done);
        assert!(matches!(&run.events[0], Event::Warning(text) if text.contains("`7475A`")), "{:?}", run.events);
        // A job that does not begin anew is not begun anew.
        let plotter = Plotter::new(255, Knows { wants_in, ..SPACE });
        let mut run = Run::new(b"PU;PA1,1;", plotter, Handshake::Auto);
        assert_eq!(run.finish(), Event::Done);
        assert!(run.events.len() == 1 && !run.plotter.begun, "it is a 7475A: {:?}", run.events);
    }
}

#[test]
fn long_instructions_go_in_parts() {
    let lists = format!("IN;PA0,0;PD{}1,1;PU;", "100,200,0,0,".repeat(100)).into_bytes();
    for knows in [SPACE, NONE] {
        let mut run = Run::new(&lists, Plotter::new(60, knows), Handshake::Auto);
        assert_eq!(run.finish(), Event::Done);
        assert!(!run.plotter.overflowed);
        assert_eq!(run.plotter.ink, drawn(&lists));
    }
    let label = format!("IN;PA0,0;LB{}\x03PA5,5;PD6,6;", "a b".repeat(100)).into_bytes();
    let mut run = Run::new(&label, Plotter::new(60, SPACE), Handshake::Auto);
    assert_eq!(run.finish(), Event::Done);
    assert_eq!(run.plotter.ink, [([5, 5], [6, 6])]);
    // No question can be put within a label: nobody knows when there is room for its rest.
    let mut run = Run::new(&label, Plotter::new(60, NONE), Handshake::Auto);
    assert_eq!(run.finish(), Event::Failed(Fault::LineTooLong { line: 3, length: 303, limit: 60 }));
}

#[test]
fn whatever_a_byte_suffers_nothing_is_silently_wrong() {
    let job = long_job(8);
    let expected = drawn(&job);
    let (mut done, mut failed) = (0, 0);
    for (handshake, knows, size) in [
        (Handshake::EscB, SPACE, 60),
        (Handshake::XonXoff, XON_XOFF, 255),
        (Handshake::EnqAck, ENQ_ACK, 255),
        (Handshake::Oa, NONE, 60),
    ] {
        for at in (0..900).step_by(7) {
            for mangle in [Mangle::Lost, Mangle::Doubled, Mangle::Changed(0), Mangle::Changed(4), Mangle::Changed(2)] {
                for to_the_plotter in [true, false] {
                    let mut run = Run::new(&job, Plotter::new(size, knows), handshake);
                    let line = if to_the_plotter { &mut run.to } else { &mut run.from };
                    line.fault = Some((at, mangle));
                    match run.finish() {
                        Event::Done => {
                            done += 1;
                            assert_eq!(run.plotter.ink, expected, "{handshake:?} {mangle:?} at {at}, {to_the_plotter}");
                        }
                        Event::Failed(fault) => {
                            failed += 1;
                            // A mangled answer stops the job only where no other tells the same: of a pen, and of errors.
                            let alone = matches!(fault, Fault::Astray { .. } | Fault::Erred { .. });
                            assert!(to_the_plotter || alone, "{handshake:?} {mangle:?} at {at}: {fault}");
                            if let Fault::Astray { first, last, .. } = fault {
                                assert!(first <= last && last - first <= 4, "{first} to {last}");
                            }
                        }
                        event => panic!("{event:?}"),
                    }
                }
            }
        }
    }
    assert!(done > 1000 && failed > 200, "{done} {failed}");
}

#[test]
fn it_rests_at_the_end_of_a_stroke() {
    let job = long_job(50);
    let mut run = Run::new(&job, Plotter::new(255, SPACE), Handshake::Auto);
    while run.protocol.progress().executed < 20 {
        run.step();
    }
    run.protocol.control(Control::Hold, Duration::from_millis(run.ms));
    for _ in 0..200_000 {
        run.step();
    }
    assert_eq!(run.events, [Event::Paused]);
    assert!(!run.plotter.down && run.plotter.buffer.is_empty());
    let progress = run.protocol.progress();
    assert!(progress.executed > 20 && progress.executed < progress.total, "{progress:?}");
    run.protocol.control(Control::Resume, Duration::from_millis(run.ms));
    assert_eq!(run.finish(), Event::Done);
    assert!(run.events.contains(&Event::Resumed));
    assert_eq!(run.plotter.ink, drawn(&job));
}

#[test]
fn it_waits_for_a_pen_that_it_does_not_hold() {
    let job = [&long_job(5)[..], b"SP7;PU5,5;PD9,9;PU;SP0;"].concat();
    let whole = drawn(&job);
    for (size, knows) in [(60, SPACE), (255, XON_XOFF), (60, NONE)] {
        let mut run = Run::new(&job, Plotter::new(size, knows), Handshake::Auto);
        let waits = Event::Prompt("put pen 7 into holder 1".into());
        while !run.events.contains(&waits) {
            run.step();
        }
        // All that comes before is drawn, and the pen put away; the user takes an hour.
        assert_eq!((run.plotter.ink.len(), run.plotter.down), (whole.len() - 1, false));
        assert_eq!(run.plotter.pens, [1, 0, 0]);
        assert_eq!(run.protocol.progress().executed, long_job(5).split(|byte| *byte == b';').count() - 1);
        run.ms += 3_600_000;
        run.protocol.control(Control::Resume, Duration::from_millis(run.ms));
        assert_eq!(run.finish(), Event::Done);
        assert_eq!((&run.plotter.ink, &run.plotter.pens[3..]), (&whole, &[1, 0][..]));
        assert_eq!(run.events, [waits, Event::Done]);
    }
}

#[test]
fn the_speed_is_changed_while_it_draws() {
    let mut run = Run::new(&long_job(50), Plotter::new(255, SPACE), Handshake::Auto);
    while run.protocol.progress().executed < 20 {
        run.step();
    }
    for percent in [50, 200, 100] {
        run.protocol.control(Control::Speed(percent), Duration::from_millis(run.ms));
        run.step();
    }
    assert_eq!(run.finish(), Event::Done);
    assert_eq!(run.plotter.speeds, [19, 38, 38]);
}

#[test]
fn stopping_aborts_what_is_buffered() {
    let mut run = Run::new(&long_job(50), Plotter::new(255, SPACE), Handshake::Auto);
    while run.protocol.progress().executed < 20 {
        run.step();
    }
    run.protocol.control(Control::Stop, Duration::from_millis(run.ms));
    let event = run.finish();
    for _ in 0..5 {
        run.step();
    }
    assert!(matches!(event, Event::Failed(Fault::Cancelled { .. })));
    assert!(run.plotter.aborted && !run.plotter.down && run.plotter.buffer.is_empty());
}

#[test]
fn failures() {
    // Nobody is there.
    let mut protocol = Hpgl::new(Job::new(b"IN;").unwrap(), options(60, Handshake::Auto));
    let mut event = None;
    for s in 0..600 {
        protocol.tick(Duration::from_millis(100 * s));
        event = event.or(protocol.take_event());
    }
    assert_eq!(event, Some(Event::Failed(Fault::NoAnswer { baud: 9600 })));

    // It falls silent.
    let mut run = Run::new(&long_job(50), Plotter::new(60, SPACE), Handshake::Auto);
    while run.protocol.progress().executed < 20 {
        run.step();
    }
    run.plotter.knows.space = false;
    run.bytes_per_tick = 0;
    let Event::Failed(fault) = run.finish() else { panic!("it goes on") };
    assert!(matches!(&fault, Fault::Silent { at, .. } if at.number >= 21), "{fault}");

    // It reports an overflow.
    let mut run = Run::new(b"IN;PU;", Plotter::new(60, SPACE), Handshake::Auto);
    while !matches!(run.protocol.phase, Phase::Finishing) {
        run.step();
    }
    run.plotter.overflowed = true;
    let Event::Failed(fault) = run.finish() else { panic!("it is done") };
    assert!(fault.to_string().contains("line error 16"), "{fault}");
}

#[test]
fn errors_of_what_was_drawn_before_are_none_of_the_job() {
    let mut plotter = Plotter::new(255, SPACE);
    plotter.error = 3;
    assert_eq!(Run::new(b"IN;PU;", plotter, Handshake::Auto).finish(), Event::Done);
    let mut run = Run::new(b"IN;PU;QQ;", Plotter::new(255, SPACE), Handshake::Auto);
    let Event::Failed(fault) = run.finish() else { panic!("it is done") };
    assert!(fault.to_string().contains("a part of instruction 3: error 1, an unknown instruction"), "{fault}");
}

#[test]
fn its_user_is_told_of_a_halt_once_and_it_waits_for_as_long_as_it_likes() {
    let mut protocol = Hpgl::new(Job::new(b"IN;PA1,1;").unwrap(), options(60, Handshake::EscB));
    let mut answers: VecDeque<&[u8]> = VecDeque::from([&b"60\r"[..], b"60\r", b"5,5,0\r", b"0\r", b"0\r", b"7475A\r"]);
    let mut events = Vec::new();
    for tick in 0..20_000 {
        let now = Duration::from_millis(100 * tick);
        protocol.tick(now);
        let asked = protocol.take_output();
        if asked.ends_with(b"\x1b.O") {
            protocol.receive(b"16\r", now);
        } else if !asked.is_empty()
            && let Some(answer) = answers.pop_front()
        {
            protocol.receive(answer, now);
        }
        events.extend(protocol.take_event());
    }
    assert!(matches!(&events[..], [Event::Message(text)] if text.contains("VIEW")), "{events:?}");
}

/// A conversation with a plotter that has been asked for its state (`ESC.O`), while it has not come to the question behind the job.
fn asked_twice() -> (Hpgl, Duration) {
    let mut protocol = Hpgl::new(Job::new(b"IN;PA1,1;").unwrap(), options(60, Handshake::EscB));
    let mut answers: VecDeque<&[u8]> = VecDeque::from([&b"60\r"[..], b"60\r", b"5,5,0\r", b"0\r", b"0\r", b"7475A\r"]);
    let mut now = Duration::ZERO;
    loop {
        now += Duration::from_millis(100);
        protocol.tick(now);
        let asked = protocol.take_output();
        if asked.ends_with(b"\x1b.O") {
            return (protocol, now);
        }
        match answers.pop_front().filter(|_| !asked.is_empty()) {
            Some(answer) => protocol.receive(answer, now),
            None => assert!(now < Duration::from_secs(10)),
        }
    }
}

#[test]
fn a_number_that_answers_either_of_two_questions_is_settled_by_what_follows() {
    let halted =
        |protocol: &mut Hpgl| matches!(protocol.take_event(), Some(Event::Message(text)) if text.contains("VIEW"));
    // Both are 0, and then the place.
    let (mut protocol, now) = asked_twice();
    protocol.receive(b"0\r0\r1,1,0\r", now);
    assert_eq!((protocol.executed, protocol.answers.expects_error()), (2, false));
    // The answer to `OE;` comes first, or last.
    for replies in [&b"0\r16\r1,1,0\r"[..], b"16\r0\r1,1,0\r", b"0\r1,1,0\r16\r"] {
        let (mut protocol, now) = asked_twice();
        protocol.receive(replies, now);
        assert!(halted(&mut protocol) && protocol.executed == 2, "{}", String::from_utf8_lossy(replies));
    }
    // An error, whatever came before it, is known before the place.
    for replies in [&b"0\r3\r1,1,0\r"[..], b"3\r0\r1,1,0\r", b"16\r3\r1,1,0\r"] {
        let (mut protocol, now) = asked_twice();
        protocol.receive(replies, now);
        let events = std::iter::from_fn(|| protocol.take_event());
        assert!(matches!(events.last(), Some(Event::Failed(Fault::Erred { first: 1, last: 2, code: 3, .. }))));
        assert_eq!(protocol.executed, 0);
    }
    // What might be an error and was the other question's answer, mangled, counts as nothing when that has no answer.
    let (mut protocol, now) = asked_twice();
    protocol.receive(b"3\r1,1,0\r", now);
    assert_eq!((protocol.executed, protocol.take_event()), (0, None));
    let now = now + ANSWER_WAIT + Duration::from_secs(1);
    protocol.tick(now);
    assert_eq!((protocol.executed, protocol.take_output()), (2, b"\x1b.O".to_vec()));
    protocol.receive(b"8\r", now);
    assert_eq!(protocol.phase, Phase::Finishing);
    // Nothing follows it: the plotter is at work, and answers the next question for its state.
    let (mut protocol, now) = asked_twice();
    protocol.receive(b"0\r", now);
    let now = now + Duration::from_secs(1);
    protocol.tick(now);
    protocol.tick(now + STATUS_INTERVAL);
    assert_eq!(protocol.take_output(), b"\x1b.O");
    protocol.receive(b"0\r1,1,0\r8\r", now + STATUS_INTERVAL);
    assert_eq!((protocol.executed, protocol.answers.expects_error()), (2, false));
}

proptest! {
    #[test]
    fn noise_does_no_harm(noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..20), 0..40)) {
        let mut protocol = Hpgl::new(Job::new(&long_job(50)).unwrap(), options(60, Handshake::Auto));
        for (i, bytes) in noise.iter().enumerate() {
            protocol.receive(bytes, Duration::from_millis(300 * i as u64));
        }
    }
}

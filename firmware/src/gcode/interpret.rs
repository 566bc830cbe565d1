//! One line of G-code: checks of its words, and the actions they ask for.

use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::arc::Centre;
use crate::gcode::words::{AXIS_LETTERS, AxisUse, OFFSET_LETTERS, Words, read_words};
use crate::gcode::{Actions, Arc, Distance, FeedMode, GcodeState, Keep, Motion, Path, PenOrder, Speed, Spindle};
use crate::settings::Settings;
use crate::storage::Stored;

/// Largest N word.
const MAX_LINE_NUMBER: f64 = 10_000_000.0;

/// Interprets one stripped line.
///
/// Returns the state after it and what is to be done. Cost: linear in the length of the line; the arc alone needs transcendental functions.
///
/// # Errors
/// GRBL's number for the first thing wrong, in GRBL's order: the words one by one, then the line as a whole.
pub(crate) fn interpret(line: &[u8], state: &GcodeState, stored: &Stored) -> Result<(GcodeState, Actions), Error> {
    let mut new = state.clone();
    let mut words = read_words(line, &mut new)?;

    if let Some(n) = words.take(b'N') {
        if n > MAX_LINE_NUMBER {
            return Err(Error::InvalidLineNumber);
        }
        if n != libm::floor(n) {
            return Err(Error::NotInteger);
        }
        new.line = n as u32;
    }
    let feed = words.take(b'F');
    if let (Some(f), FeedMode::PerMinute) = (feed, new.feed_mode) {
        new.feed = f * new.units.mm();
    }
    if let Some(s) = words.take(b'S') {
        new.speed = s;
    }
    if let Some(t) = words.take(b'T') {
        if t > 255.0 {
            return Err(Error::ToolNumberTooLarge);
        }
        if t != libm::floor(t) {
            return Err(Error::NotInteger);
        }
        new.tool = t as u8;
    }

    let mut actions = Actions { flow: words.flow, ..Actions::default() };
    if words.dwell {
        actions.dwell = Some(words.take(b'P').ok_or(Error::ValueWordMissing)?);
    }

    let any_axis = words.has_axes();
    if any_axis && words.axis_use.is_none() {
        words.axis_use = Some(AxisUse::Motion);
    }
    if words.absolute && !matches!(new.motion, Motion::Rapid | Motion::Linear) {
        return Err(Error::G53NeedsRapidOrLinear);
    }
    if !any_axis && matches!(words.axis_use, Some(AxisUse::SetOffset | AxisUse::SetSystem | AxisUse::ToolLength)) {
        return Err(Error::NoAxisWords);
    }
    let mm = new.units.mm();
    match words.axis_use {
        Some(AxisUse::SetOffset) => {
            // The work position becomes the values: what is missing to that is G92's.
            let rest = GcodeState { offset: [0.0; AXES], ..new.clone() }.work_offset(&stored.systems);
            for (axis, &letter) in AXIS_LETTERS.iter().enumerate() {
                if let Some(value) = words.take(letter) {
                    new.offset[axis] = state.position[axis] - rest[axis] - value * mm;
                }
            }
        }
        Some(AxisUse::SetSystem) => actions.keep = Some(set_system(&mut words, &new, stored)?),
        Some(AxisUse::ToolLength) => {
            new.tool_length = words.take(b'Z').ok_or(Error::ToolLengthNotZ)? * mm;
            if words.has_axes() {
                return Err(Error::ToolLengthNotZ);
            }
        }
        Some(AxisUse::GoToPlace(place)) => {
            let there = stored.places.get(place).copied().unwrap_or_default();
            // Without axis words all axes go; else those that are named, and the others stay.
            let goes = AXIS_LETTERS.map(|letter| !any_axis || words.has(letter));
            let via = if any_axis { Some(target(&mut words, &new, stored)?) } else { None };
            let mut end = state.position;
            for axis in (0..AXES).filter(|&axis| goes[axis]) {
                end[axis] = there[axis];
            }
            in_range(end, &stored.settings)?;
            actions.motion = Some(Path::Line { via, target: end, speed: Speed::Rapid });
            new.position = end;
        }
        Some(AxisUse::Motion) => actions.motion = motion(&mut words, &mut new, feed, stored)?,
        None => {}
    }
    if let Some(place) = words.keep_place {
        actions.keep = Some(Keep::Place(place, state.position));
    }
    if words.clear_offset {
        new.offset = [0.0; AXES];
    }
    if words.present != 0 {
        return Err(Error::UnusedWords);
    }

    let pen = |s: &GcodeState| if s.spindle == Spindle::Off { PenOrder::Off } else { PenOrder::Speed(s.speed) };
    if pen(&new) != pen(state) {
        actions.pen = Some(pen(&new));
    }
    Ok((new, actions))
}

/// G10 L2 and L20: the origin of a coordinate system.
fn set_system(words: &mut Words, new: &GcodeState, stored: &Stored) -> Result<Keep, Error> {
    let (Some(p), Some(l)) = (words.take(b'P'), words.take(b'L')) else { return Err(Error::ValueWordMissing) };
    if p != libm::floor(p) {
        return Err(Error::NotInteger);
    }
    let system = match p {
        0.0 => new.system,
        1.0..=6.0 => p as usize - 1,
        _ => return Err(Error::NoSuchSystem),
    };
    let here = match l {
        2.0 if !words.has(b'R') => false,
        20.0 => true,
        _ => return Err(Error::UnsupportedCommand),
    };
    let mut origin = stored.systems.get(system).copied().unwrap_or_default();
    // What of a work position is not the coordinate system's.
    let mut rest = new.offset;
    rest[2] += new.tool_length;
    for (axis, &letter) in AXIS_LETTERS.iter().enumerate() {
        if let Some(value) = words.take(letter) {
            let value = value * new.units.mm();
            origin[axis] = if here { new.position[axis] - rest[axis] - value } else { value };
        }
    }
    in_range(origin, &stored.settings)?;
    Ok(Keep::System(system, origin))
}

/// Interprets what follows `$J=`: a straight motion at its own feed, after which only the position differs.
///
/// # Errors
/// [`Error::InvalidJog`] for anything but F, N, axis words, G20, G21, G53, G90 and G91; [`Error::UndefinedFeedRate`] and [`Error::NoAxisWords`] when those are missing;
/// [`Error::TravelExceeded`] beyond the soft limits.
pub(crate) fn interpret_jog(line: &[u8], state: &GcodeState, stored: &Stored) -> Result<(GcodeState, Actions), Error> {
    let mut scratch = GcodeState { motion: Motion::Linear, ..state.clone() };
    let mut words = read_words(line, &mut scratch)?;
    // Groups 3 and 6, and of group 0 only G53.
    let allowed = 1 << 3 | 1 << 6 | u32::from(words.absolute);
    if words.groups & !allowed != 0 || words.axis_use.is_some() {
        return Err(Error::InvalidJog);
    }
    words.take(b'N');
    // A jog's feed is its own, and always a minute's.
    scratch.feed_mode = FeedMode::PerMinute;
    scratch.feed = words.take(b'F').unwrap_or(0.0) * scratch.units.mm();
    let path = motion(&mut words, &mut scratch, None, stored)?.ok_or(Error::NoAxisWords)?;
    if words.present != 0 {
        return Err(Error::InvalidJog);
    }
    if !stored.settings.in_travel(scratch.position) {
        return Err(Error::TravelExceeded);
    }
    let new = GcodeState { position: scratch.position, ..state.clone() };
    Ok((new, Actions { motion: Some(path), ..Actions::default() }))
}

/// Refuses a place where the pen cannot be, or whose steps would overflow.
pub(crate) fn in_range(mm: [f64; AXES], settings: &Settings) -> Result<(), Error> {
    if settings.reaches(mm) { Ok(()) } else { Err(Error::InvalidTarget) }
}

/// Where the axis words lead, machine mm; they count as used.
fn target(words: &mut Words, new: &GcodeState, stored: &Stored) -> Result<[f64; AXES], Error> {
    let (mm, offset) = (new.units.mm(), new.work_offset(&stored.systems));
    let mut target = new.position;
    for (axis, &letter) in AXIS_LETTERS.iter().enumerate() {
        if let Some(value) = words.take(letter) {
            target[axis] = match new.distance {
                _ if words.absolute => value * mm,
                Distance::Absolute => value * mm + offset[axis],
                Distance::Incremental => new.position[axis] + value * mm,
            };
        }
    }
    in_range(target, &stored.settings)?;
    Ok(target)
}

/// The motion of the line, if it has axis words; the state's position moves to its end. `feed` is the line's F word, which G93 wants on each.
fn motion(words: &mut Words, new: &mut GcodeState, feed: Option<f64>, stored: &Stored) -> Result<Option<Path>, Error> {
    let clockwise = match new.motion {
        Motion::Cancelled => return Err(Error::AxisWordsUnused),
        Motion::ArcClockwise => Some(true),
        Motion::ArcCounterClockwise => Some(false),
        Motion::Rapid | Motion::Linear => None,
    };
    let any_axis = words.has_axes();
    let feed = match new.feed_mode {
        FeedMode::PerMinute => new.feed,
        FeedMode::InverseTime if any_axis => feed.unwrap_or(0.0),
        // Nothing moves, so nothing lasts a time.
        FeedMode::InverseTime => 1.0,
    };
    if new.motion != Motion::Rapid && feed == 0.0 {
        return Err(Error::UndefinedFeedRate);
    }
    if !any_axis {
        return if clockwise.is_some() { Err(Error::NoAxisWords) } else { Ok(None) };
    }
    let speed = |length: f64| match (new.motion, new.feed_mode) {
        (Motion::Rapid, _) => Speed::Rapid,
        (_, FeedMode::PerMinute) => Speed::Feed(feed),
        (_, FeedMode::InverseTime) => Speed::Feed(feed * length),
    };
    let mm = new.units.mm();
    let [a, b, _] = new.plane.axes();
    if clockwise.is_some() && !(words.has(AXIS_LETTERS[a]) || words.has(AXIS_LETTERS[b])) {
        return Err(Error::NoAxisWordsInPlane);
    }
    let start = new.position;
    let target = target(words, new, stored)?;
    let path = match clockwise {
        None => {
            let square: f64 = target.iter().zip(start).map(|(t, s)| (t - s) * (t - s)).sum();
            Path::Line { via: None, target, speed: speed(libm::sqrt(square)) }
        }
        Some(clockwise) => {
            let centre = match words.take(b'R') {
                Some(r) => Centre::Radius(r * mm),
                None => {
                    let offset = [words.take(OFFSET_LETTERS[a]), words.take(OFFSET_LETTERS[b])];
                    if offset == [None, None] {
                        return Err(Error::NoOffsetsInPlane);
                    }
                    Centre::Offset(offset.map(|o| o.unwrap_or(0.0) * mm))
                }
            };
            let settings = &stored.settings;
            let mut arc = Arc::new(start, target, new.plane, centre, clockwise, settings.arc_tolerance, Speed::Rapid)?;
            arc.speed = speed(arc.length());
            if !settings.counts(arc.reach()) {
                return Err(Error::InvalidTarget);
            }
            Path::Arc(arc)
        }
    };
    new.position = target;
    Ok(Some(path))
}

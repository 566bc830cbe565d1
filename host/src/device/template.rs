//! Lines of a profile with placeholders in them.

use super::gcode::{Wrong, wrong};
use super::{Device, Language, Pen};
use crate::emit::decimal;

/// Placeholders of G-code profiles, with what stands for them.
const GCODE: &[&str] = &["pen", "up", "down", "draw_feed", "travel_feed", "travel_x", "travel_y"];
/// Placeholders of HPGL profiles.
const HPGL: &[&str] = &["pen", "speed"];

/// Millimetres a minute in a centimetre a second.
pub(crate) const MM_MIN_PER_CM_S: f64 = 600.0;

/// A piece of a template.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part<'a> {
    Text(&'a str),
    Placeholder(&'a str),
}

/// A template in pieces: `{name}` is a placeholder, `{{` and `}}` are braces.
fn parts(template: &str) -> Result<Vec<Part<'_>>, String> {
    let mut parts = Vec::new();
    let mut rest = template;
    while let Some(at) = rest.find(['{', '}']) {
        let (text, brace) = rest.split_at(at);
        parts.push(Part::Text(text));
        if let Some(after) = brace.strip_prefix("{{") {
            parts.push(Part::Text("{"));
            rest = after;
        } else if let Some(after) = brace.strip_prefix("}}") {
            parts.push(Part::Text("}"));
            rest = after;
        } else if let Some((name, after)) = brace.strip_prefix('{').and_then(|open| open.split_once('}')) {
            parts.push(Part::Placeholder(name));
            rest = after;
        } else {
            return Err(format!("has a brace without its partner in `{template}`; `{{{{` and `}}}}` stand for braces"));
        }
    }
    parts.push(Part::Text(rest));
    Ok(parts)
}

/// Refuses a template with a placeholder that is none.
pub(super) fn check(key: &str, template: &str, gcode: bool) -> Result<(), Wrong> {
    let known = if gcode { GCODE } else { HPGL };
    for part in parts(template).map_err(|problem| wrong(key, problem))? {
        if let Part::Placeholder(name) = part
            && !known.contains(&name)
        {
            return Err(wrong(key, format!("has `{{{name}}}` in it; the placeholders are {{{}}}", known.join("}, {"))));
        }
    }
    Ok(())
}

impl Device {
    /// A line of the profile (`start`, `end`, `pen_change`) with its placeholders filled in, while `pen` is the pen at work.
    #[must_use]
    pub fn fill(&self, template: &str, pen: u32) -> String {
        // The templates of a profile were checked when it was read; another one is left as it is.
        let Ok(parts) = parts(template) else { return template.to_owned() };
        parts
            .into_iter()
            .map(|part| match part {
                Part::Text(text) => text.to_owned(),
                Part::Placeholder(name) => self.value(name, pen).unwrap_or_else(|| format!("{{{name}}}")),
            })
            .collect()
    }

    fn value(&self, name: &str, pen: u32) -> Option<String> {
        let travel = |axis: usize| self.travel_mm.map(|mm| decimal(mm[axis], 3));
        let level = |up: bool| {
            Some(match self.language.gcode()?.pen {
                Pen::Servo { up: level, .. } if up => level.to_string(),
                Pen::Servo { down: level, .. } => level.to_string(),
                Pen::Z { up_mm: height, .. } if up => decimal(height, 3),
                Pen::Z { down_mm: height, .. } => decimal(height, 3),
            })
        };
        match (name, &self.language) {
            ("pen", _) => Some(pen.to_string()),
            ("speed", Language::Hpgl(_)) => Some(decimal(self.draw_feed / MM_MIN_PER_CM_S, 0)),
            ("up", _) => level(true),
            ("down", _) => level(false),
            ("draw_feed", _) => Some(decimal(self.draw_feed, 1)),
            ("travel_feed", _) => Some(decimal(self.travel_feed, 1)),
            ("travel_x", _) => travel(0),
            ("travel_y", _) => travel(1),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::find;
    use super::*;

    #[test]
    fn placeholders_are_filled_in() {
        let table = [
            ("grbl-servo", "M0 (pen {pen})", "M0 (pen 3)"),
            ("grbl-servo", "M3 S{up}", "M3 S0"),
            ("grbl-servo", "{{{pen}}} {{}}", "{3} {}"),
            ("grbl-servo", "G0 X{travel_x} Y{travel_y} F{travel_feed}", "G0 X420 Y297 F5000"),
            ("grbl-z", "G1 Z{down} F{draw_feed}", "G1 Z0 F2000"),
            ("hp7475a", "SP{pen};VS{speed};", "SP3;VS38;"),
        ];
        for (device, template, expected) in table {
            assert_eq!(find(device).unwrap().fill(template, 3), expected);
        }
    }

    #[test]
    fn every_placeholder_has_a_value() {
        for name in super::super::names() {
            let device = find(name).unwrap();
            let known = if device.language.gcode().is_some() { GCODE } else { HPGL };
            for placeholder in known {
                assert!(device.value(placeholder, 1).is_some(), "{name}: {placeholder}");
            }
        }
    }

    #[test]
    fn what_is_no_placeholder_is_refused() {
        for (template, gcode, expected) in [
            ("M0 (pen {pn})", true, "`{pn}`"),
            ("M3 S{up", true, "brace"),
            ("M3 S}", true, "brace"),
            ("SP{up};", false, "{pen}, {speed}"),
        ] {
            let fault = check("gcode.start[0]", template, gcode).unwrap_err();
            assert!(fault.problem.contains(expected) && fault.key == "gcode.start[0]", "{fault:?}");
        }
    }
}

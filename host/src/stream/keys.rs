//! What the keys do while a plot goes on.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use crate::protocol::Control;

/// What the keys do, in a line.
pub(super) const HELP: &str = "space pauses at the end of the stroke (twice: at once) and goes on, + and - change the speed, \
                               q ends; u and d lift and lower the pen while paused";

/// Steps of the speed, and its range, in percent.
const SPEED_STEP: u16 = 10;
const SPEED_RANGE: (u16, u16) = (10, 200);

/// What a key asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Wish {
    /// Of the plotter, with what the user is told; nothing, where the plotter's side tells.
    Plotter(Control, Option<String>),
    /// As Ctrl-C.
    Interrupt,
}

/// Where the user has brought the plot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    Going,
    /// It is to pause at the end of the stroke.
    Pausing,
    /// It is to hold at once.
    Holding,
    Resting,
}

/// From keys to wishes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keys {
    stage: Stage,
    speed: u16,
}

impl Keys {
    pub(super) fn new() -> Self {
        Self { stage: Stage::Going, speed: 100 }
    }

    /// The plotter rests, or goes on.
    pub(super) fn paused(&mut self, rests: bool) {
        self.stage = if rests { Stage::Resting } else { Stage::Going };
    }

    /// What a key that was pressed asks for; none if nothing now.
    pub(super) fn press(&mut self, key: KeyEvent) -> Option<Wish> {
        let KeyCode::Char(letter) = key.code else { return None };
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (letter == 'c').then_some(Wish::Interrupt);
        }
        let (control, text) = match letter {
            ' ' => self.space()?,
            'q' | 'Q' => (Control::Stop, Some("ending the plot, pen up".to_owned())),
            '+' | '=' => self.speed(self.speed.saturating_add(SPEED_STEP))?,
            '-' | '_' => self.speed(self.speed.saturating_sub(SPEED_STEP))?,
            'u' | 'd' | 'U' | 'D' if self.stage == Stage::Resting => {
                let (down, steps) = (letter.is_ascii_lowercase(), if matches!(letter, 'u' | 'U') { 1 } else { -1 });
                (Control::PenHeight { down, steps }, None)
            }
            _ => return None,
        };
        Some(Wish::Plotter(control, text))
    }

    fn space(&mut self) -> Option<(Control, Option<String>)> {
        let (stage, control, text) = match self.stage {
            Stage::Going => (Stage::Pausing, Control::Pause, "pausing at the end of the stroke; space again: at once"),
            Stage::Pausing => (Stage::Holding, Control::Hold, "holding"),
            Stage::Holding => return None,
            Stage::Resting => (Stage::Resting, Control::Resume, "going on"),
        };
        self.stage = stage;
        Some((control, Some(text.to_owned())))
    }

    fn speed(&mut self, percent: u16) -> Option<(Control, Option<String>)> {
        let percent = percent.clamp(SPEED_RANGE.0, SPEED_RANGE.1);
        if percent == self.speed {
            return None;
        }
        self.speed = percent;
        Some((Control::Speed(percent), Some(format!("speed {percent} %"))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controls(keys: &mut Keys, letters: &str) -> Vec<Option<Control>> {
        let press = |letter| match keys.press(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::NONE)) {
            Some(Wish::Plotter(control, text)) => {
                assert_eq!(text.is_none(), matches!(control, Control::PenHeight { .. }));
                Some(control)
            }
            other => {
                assert_eq!(other, None);
                None
            }
        };
        letters.chars().map(press).collect()
    }

    #[test]
    fn space_pauses_then_holds_then_goes_on() {
        let mut keys = Keys::new();
        assert_eq!(controls(&mut keys, "   "), [Some(Control::Pause), Some(Control::Hold), None]);
        keys.paused(true);
        assert_eq!(controls(&mut keys, " "), [Some(Control::Resume)]);
        keys.paused(false);
        assert_eq!(controls(&mut keys, " "), [Some(Control::Pause)]);
    }

    #[test]
    fn the_speed_stays_in_its_range() {
        let mut keys = Keys::new();
        let speeds = controls(&mut keys, "+=-");
        assert_eq!(speeds, [110, 120, 110].map(|percent| Some(Control::Speed(percent))));
        assert_eq!(controls(&mut keys, &"-".repeat(20)).iter().flatten().last(), Some(&Control::Speed(10)));
        assert_eq!(controls(&mut keys, &"+".repeat(30)).iter().flatten().last(), Some(&Control::Speed(200)));
        assert_eq!(controls(&mut keys, "+"), [None]);
    }

    #[test]
    fn heights_change_at_rest_only() {
        let mut keys = Keys::new();
        assert_eq!(controls(&mut keys, "ud"), [None, None]);
        keys.paused(true);
        let height = |down, steps| Some(Control::PenHeight { down, steps });
        let expected = [height(true, 1), height(true, -1), height(false, 1), height(false, -1)];
        assert_eq!(controls(&mut keys, "udUD"), expected);
    }

    #[test]
    fn ctrl_c_is_an_interrupt_and_q_is_not() {
        let mut keys = Keys::new();
        let key = |letter, modifiers| KeyEvent::new(KeyCode::Char(letter), modifiers);
        assert_eq!(keys.press(key('c', KeyModifiers::CONTROL)), Some(Wish::Interrupt));
        assert_eq!(keys.press(key('q', KeyModifiers::CONTROL)), None);
        assert_eq!(keys.press(key('c', KeyModifiers::NONE)), None);
        assert_eq!(keys.press(KeyEvent::new(KeyCode::Enter, KeyModifiers::NONE)), None);
        assert_eq!(controls(&mut keys, "q"), [Some(Control::Stop)]);
    }
}

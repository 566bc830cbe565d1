//! Text of single strokes: the roman simplex letters of the Hershey fonts.

use glam::DVec2;

/// The letters, with whom they are from.
const SIMPLEX: &str = include_str!("simplex.jhf");

/// The first character that there is.
const FIRST: char = ' ';

/// Height of capitals in units of the font: from the line at 9 below the middle to 12 above it.
const CAPITAL: f64 = 21.0;

/// How far below the middle the line is on which letters stand.
const BASE: f64 = 9.0;

/// A letter.
struct Glyph {
    /// Its left and right ends.
    ends: [f64; 2],
    /// Strokes, y up from the line on which it stands.
    strokes: Vec<Vec<DVec2>>,
}

/// The strokes of a text of one line from (0, 0) on, where its first letter stands, with capitals so high in mm; and its width in mm.
///
/// # Errors
/// The first character that there is no letter for.
pub(super) fn strokes(text: &str, capital_mm: f64) -> Result<(Vec<Vec<DVec2>>, f64), char> {
    let scale = capital_mm / CAPITAL;
    let mut at = 0.0;
    let mut all = Vec::new();
    for character in text.chars() {
        let glyph = glyph(character).ok_or(character)?;
        let [left, right] = glyph.ends;
        let place = |p: &DVec2| (*p + DVec2::new(at - left, 0.0)) * scale;
        all.extend(glyph.strokes.iter().map(|stroke| stroke.iter().map(place).collect::<Vec<_>>()));
        at += right - left;
    }
    Ok((all, at * scale))
}

/// The letter of a character.
fn glyph(character: char) -> Option<Glyph> {
    let index = u32::from(character).checked_sub(u32::from(FIRST))?;
    let line = SIMPLEX.lines().filter(|line| !line.starts_with('#')).nth(index as usize)?;
    let coordinate = |byte: u8| f64::from(byte) - f64::from(b'R');
    let mut pairs = line.as_bytes().get(8..)?.chunks_exact(2);
    let ends = pairs.next()?;
    let mut strokes = vec![Vec::new()];
    for pair in pairs {
        if pair == b" R" {
            strokes.push(Vec::new());
        } else if let Some(stroke) = strokes.last_mut() {
            stroke.push(DVec2::new(coordinate(pair[0]), BASE - coordinate(pair[1])));
        }
    }
    strokes.retain(|stroke| stroke.len() > 1);
    Some(Glyph { ends: [coordinate(ends[0]), coordinate(ends[1])], strokes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_character_has_a_letter() {
        for character in ' '..='~' {
            let found = glyph(character).unwrap_or_else(|| panic!("no {character}"));
            assert!(found.ends[1] > found.ends[0] && found.strokes.is_empty() == (character == ' '), "{character}");
            for p in found.strokes.iter().flatten() {
                assert!((-8.0..=26.0).contains(&p.y) && p.x.abs() <= 16.0, "{character}: {p}");
            }
        }
        assert_eq!(SIMPLEX.lines().filter(|line| !line.starts_with('#')).count(), 95);
        for character in ['\n', '\u{7f}', 'é', '\u{1f58a}'] {
            assert_eq!(strokes(&format!("a{character}"), 3.0).unwrap_err(), character);
        }
    }

    #[test]
    fn letters_stand_on_a_line_one_after_the_other() {
        let (one, width) = strokes("H", 21.0).unwrap();
        // Two posts and a bar.
        let posts: Vec<_> = one.iter().filter(|stroke| stroke[0].x == stroke[1].x).collect();
        assert_eq!((one.len(), posts.len()), (3, 2));
        assert!(posts.iter().all(|p| (p[0].y - p[1].y).abs() == 21.0 && p[0].y.min(p[1].y) == 0.0), "{one:?}");
        let (two, both) = strokes("HH", 21.0).unwrap();
        assert_eq!((two.len(), both), (6, 2.0 * width));
        assert_eq!(two[3][0], one[0][0] + DVec2::new(width, 0.0));
        assert_eq!(strokes("HH", 2.1).unwrap().1, both / 10.0);
        assert_eq!(strokes("", 3.0).unwrap(), (Vec::new(), 0.0));
    }
}

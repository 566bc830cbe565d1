//! What files and libraries say, in messages of one line.

/// Characters of what is not our own text that a message shows.
const MOST: usize = 400;

/// The text in one line that a terminal can show: runs of blanks and control characters are one blank, and what is too
/// long for a message is cut off.
pub(crate) fn one_line(text: &str) -> String {
    let mut out = String::new();
    for (count, c) in text.trim_matches(is_gap).chars().enumerate() {
        if count == MOST {
            out.push('…');
            break;
        }
        if !is_gap(c) {
            out.push(c);
        } else if !out.ends_with(' ') {
            out.push(' ');
        }
    }
    out
}

fn is_gap(c: char) -> bool {
    c.is_whitespace() || c.is_control()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_that_is_not_too_long() {
        let table = [
            ("all is well", "all is well"),
            (" two\r\n   lines\n", "two lines"),
            ("\u{1b}[31mred\u{7}\0", "[31mred"),
            ("größer als 3 µm", "größer als 3 µm"),
            ("", ""),
            ("\n\n", ""),
        ];
        for (text, expected) in table {
            assert_eq!(one_line(text), expected);
        }
        let long = one_line(&"é".repeat(10 * MOST));
        assert_eq!(long.chars().count(), MOST + 1);
        assert!(long.ends_with('…'));
    }
}

//! Bytes of a plotter as lines.

/// The line that is being received.
#[derive(Debug, Default)]
pub(crate) struct Input(Vec<u8>);

impl Input {
    /// Longest line that is kept; the rest of a longer one is dropped.
    const MOST: usize = 1024;

    /// Takes a byte of the line.
    pub(crate) fn push(&mut self, byte: u8) {
        if self.0.len() < Self::MOST {
            self.0.push(byte);
        }
    }

    /// The line ends here: it, without blanks around it.
    pub(crate) fn end(&mut self) -> String {
        let line = std::mem::take(&mut self.0);
        String::from_utf8_lossy(&line).trim().to_owned()
    }

    /// Takes a byte of lines that end in `\n`; the line that it ends.
    pub(crate) fn take(&mut self, byte: u8) -> Option<String> {
        if byte == b'\n' {
            return Some(self.end());
        }
        self.push(byte);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_cut_and_kept_within_bounds() {
        let mut input = Input::default();
        let lines: Vec<_> = b" ok\r\n\nerror:2\r\nrest".iter().filter_map(|byte| input.take(*byte)).collect();
        assert_eq!(lines, ["ok", "", "error:2"]);
        assert_eq!(input.end(), "rest");
        (0..5000).for_each(|_| input.push(b'x'));
        assert_eq!(input.end().len(), Input::MOST);
    }
}

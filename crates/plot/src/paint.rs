//! Colours for terminals, and none elsewhere.

use std::io::IsTerminal;

/// Whether and how to colour.
#[derive(Clone, Copy, Debug)]
pub struct Paint {
    on: bool,
}

impl Paint {
    /// Never colours.
    pub const OFF: Self = Self { on: false };

    /// Colours if `stream` is a terminal and the user did not forbid it (NO_COLOR, TERM=dumb).
    pub fn for_stream(stream: &impl IsTerminal) -> Self {
        let forbidden = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
            || std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Self { on: stream.is_terminal() && !forbidden }
    }

    /// Whether it colours.
    pub const fn is_on(self) -> bool {
        self.on
    }

    /// Something that went well.
    pub fn good(self, text: &str) -> String {
        self.coloured("32", text)
    }

    /// Something that went wrong.
    pub fn bad(self, text: &str) -> String {
        self.coloured("31;1", text)
    }

    /// A heading.
    pub fn strong(self, text: &str) -> String {
        self.coloured("1", text)
    }

    /// Something of less interest.
    pub fn dim(self, text: &str) -> String {
        self.coloured("2", text)
    }

    fn coloured(self, code: &str, text: &str) -> String {
        if self.on && !text.is_empty() { format!("\x1b[{code}m{text}\x1b[0m") } else { text.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_appear_only_when_on() {
        assert_eq!(Paint::OFF.bad("no"), "no");
        assert_eq!(Paint { on: true }.good("ok"), "\x1b[32mok\x1b[0m");
    }
}

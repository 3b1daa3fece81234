//! Text of others as it may be shown: what would steer a terminal is made visible.

/// `text` with its control characters escaped, but for the ends of lines: file names, machine files and commands may carry
/// sequences that a terminal obeys.
pub(crate) fn plain(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() && letter != '\n' {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn escape_sequences_are_shown_and_words_stay_as_they_are() {
        assert_eq!(plain("a\u{1b}[31mred\u{9b}2J\u{7}\r"), "a\\u{1b}[31mred\\u{9b}2J\\u{7}\\r");
        assert_eq!(plain("two\nlines, N·m"), "two\nlines, N·m");
    }
}

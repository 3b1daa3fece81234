//! Text of others as it may be shown: what would steer a terminal is made visible.

pub(crate) use words::plain;

/// Characters of one argument that are repeated in a message.
const MOST_REPEATED: usize = 120;

/// `text` with what it repeats of overlong arguments cut: `aaa.. (10000 characters)`.
pub(crate) fn with_arguments_cut(text: &str, arguments: impl IntoIterator<Item = String>) -> String {
    let mut shown = text.to_owned();
    for argument in arguments {
        // Of `--option=VALUE` and `NAME=VALUE` the value may stand alone.
        for part in [argument.as_str(), argument.split_once('=').map_or("", |(_, value)| value)] {
            let length = part.chars().count();
            if length > MOST_REPEATED {
                let begin: String = part.chars().take(MOST_REPEATED / 2).collect();
                let cut = format!("{begin}.. ({length} characters)");
                shown = shown.replace(part, &cut).replace(&plain(part), &plain(&cut));
            }
        }
    }
    shown
}

/// The same with the arguments of this process.
pub(crate) fn short(text: &str) -> String {
    with_arguments_cut(text, std::env::args_os().skip(1).map(|argument| argument.to_string_lossy().into_owned()))
}

#[cfg(test)]
mod tests {
    use super::{plain, with_arguments_cut};

    #[test]
    fn an_argument_of_ten_thousand_characters_is_cut_wherever_it_is_repeated() {
        let long = "x".repeat(10_000);
        let text = format!("'{long}' is not a node-ID; tip: to pass '{long}' as a value, use '-- {long}'");
        let cut = with_arguments_cut(&text, [long.clone(), "read".to_owned()]);
        assert!(cut.len() < 400 && cut.contains("(10000 characters)' is not a node-ID"), "{cut}");
        let cut = with_arguments_cut(
            &format!("'{long}' is not a number"),
            [format!("--set=a={long}"), format!("--jobs={long}")],
        );
        assert!(cut.len() < 200, "{cut}");
        assert_eq!(with_arguments_cut("'four' is not a node-ID", ["four".to_owned()]), "'four' is not a node-ID");
    }

    #[test]
    fn escape_sequences_are_shown_and_words_stay_as_they_are() {
        assert_eq!(plain("a\u{1b}[31mred\u{9b}2J\u{7}\r"), "a\\u{1b}[31mred\\u{9b}2J\\u{7}\\r");
        assert_eq!(plain("two\nlines, N·m"), "two\nlines, N·m");
    }
}

//! The text of a line: its label, the numbers that it shows.

/// What a line does, and the text for the reader behind two blanks or more.
pub(super) fn split_label(line: &str) -> (&str, &str) {
    let (head, label) = line.split_once("  ").unwrap_or((line, ""));
    (head.trim(), label.trim())
}

/// Columns between bars.
pub(super) fn columns(text: &str) -> Vec<String> {
    text.split('|').map(|cell| cell.trim().to_owned()).collect()
}

/// A number as its form asks: `+` a sign, `.2` decimals, `X` or `04X` hexadecimal, `le` the
/// bytes of 32 bits, the low one first; `None` if the form is another.
pub(super) fn formatted(value: f64, form: &str) -> Option<String> {
    if let Some(width) = form.strip_suffix('X') {
        let width: usize = if width.is_empty() { 0 } else { width.parse().ok()? };
        return Some(format!("{:0width$X}", value as u32));
    }
    if form == "le" {
        return Some((value as i32).to_le_bytes().map(|byte| format!("{byte:02X}")).concat());
    }
    let (signed, rest) = form.strip_prefix('+').map_or((false, form), |rest| (true, rest));
    let decimals = match rest.strip_prefix('.') {
        Some(digits) => Some(digits.parse::<usize>().ok()?),
        None if rest.is_empty() => None,
        None => return None,
    };
    Some(match (signed, decimals) {
        (true, Some(decimals)) => format!("{value:+.decimals$}"),
        (true, None) => format!("{value:+}"),
        (false, Some(decimals)) => format!("{value:.decimals$}"),
        (false, None) => format!("{value}"),
    })
}

/// Whether a word is a number in hexadecimal, as `0Fh`: what is compared with it is shown so too.
pub(super) fn is_hexadecimal(word: &str) -> bool {
    word.starts_with(|first: char| first.is_ascii_digit()) && hexadecimal(word).is_some()
}

/// The value of `60FFh`.
pub(super) fn hexadecimal(word: &str) -> Option<u32> {
    u32::from_str_radix(word.strip_suffix('h')?, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_as_their_form_asks() {
        let shown = |value, form| formatted(value, form).expect("a form");
        assert_eq!(shown(31989.2, "+.0"), "+31989");
        assert_eq!(shown(50_000.0, "+"), "+50000");
        assert_eq!(shown(8.2749, ".2"), "8.27");
        assert_eq!((shown(255.0, "04X"), shown(7.0, "X")), ("00FF".into(), "7".into()));
        assert_eq!(formatted(1.0, "e"), None);
    }

    #[test]
    fn a_label_stands_behind_two_blanks() {
        assert_eq!(split_label("> 604#40  read  it"), ("> 604#40", "read  it"));
        assert_eq!(split_label("+ 5 ms"), ("+ 5 ms", ""));
        assert!(is_hexadecimal("0Fh") && !is_hexadecimal("15") && !is_hexadecimal("each"));
    }
}

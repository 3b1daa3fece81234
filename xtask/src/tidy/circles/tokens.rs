//! The names and marks of code, one after another.

/// A name, or one mark. `::` is one token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Token<'a> {
    pub(super) text: &'a str,
    /// Where it begins, in bytes.
    pub(super) at: usize,
}

impl Token<'_> {
    pub(super) fn is_name(&self) -> bool {
        self.text.starts_with(|first: char| first.is_alphabetic() || first == '_')
    }
}

/// The tokens of code whose comments and literals are blank. Numbers and lifetimes are left out.
pub(super) fn tokens(code: &str) -> Vec<Token<'_>> {
    let part_of_name = |char: char| char.is_alphanumeric() || char == '_';
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(first) = code[at..].chars().next() {
        let rest = &code[at..];
        let length = if part_of_name(first) {
            rest.find(|char| !part_of_name(char)).unwrap_or(rest.len())
        } else if rest.starts_with("::") || rest.starts_with("r#") {
            2
        } else {
            first.len_utf8()
        };
        let is_lifetime = at > 0 && code.as_bytes()[at - 1] == b'\'';
        if !first.is_whitespace() && !first.is_ascii_digit() && !is_lifetime {
            tokens.push(Token { text: &rest[..length], at });
        }
        at += length;
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_marks_are_distinguished_and_lifetimes_and_numbers_left_out() {
        let texts: Vec<&str> = tokens("use a::b_2; f::<'a>(0x1F, x.y)").iter().map(|token| token.text).collect();
        assert_eq!(texts, ["use", "a", "::", "b_2", ";", "f", "::", "<", "'", ">", "(", ",", "x", ".", "y", ")"]);
    }
}

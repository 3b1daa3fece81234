//! A Rust file taken apart just far enough: which bytes are code, which are comment, which are text in quotes, and
//! which lie inside `#[cfg(test)]`.
//!
//! This is a lexer for comments and literals, not a parser. It knows line and nested block comments, strings with
//! escapes, raw strings, byte and C strings, and distinguishes a character from a lifetime.

/// A Rust file and its views. Each view has the file's length and line breaks, with everything else blanked.
pub(crate) struct Source {
    pub(crate) path: String,
    pub(crate) text: String,
    /// Code only: comments and the insides of literals are spaces.
    pub(crate) code: String,
    /// Code that ships: `code` without items under `#[cfg(test)]`.
    pub(crate) shipped: String,
    /// Comments only.
    pub(crate) comments: String,
    /// The offsets of the line breaks.
    breaks: Vec<usize>,
}

impl Source {
    pub(crate) fn new(path: &str, text: &str) -> Self {
        let kinds = classify(text.as_bytes());
        let code = view(text, &kinds, TextKind::Code);
        let shipped = without_tests(&code);
        Self {
            path: path.to_owned(),
            text: text.to_owned(),
            shipped,
            comments: view(text, &kinds, TextKind::Comment),
            breaks: text.match_indices('\n').map(|(at, _)| at).collect(),
            code,
        }
    }

    /// The crate's folder name if this is a file of `crates/NAME/src`, and neither its tests in a folder of their own nor the
    /// program of a crate that is a library else.
    pub(crate) fn library(&self) -> Option<&str> {
        let (name, rest) = self.path.strip_prefix("crates/")?.split_once('/')?;
        let ships = rest.starts_with("src/") && !rest.starts_with("src/tests/");
        (ships && (name == "cli" || rest != "src/main.rs")).then_some(name)
    }

    /// The 1-based line of a byte offset.
    pub(crate) fn line_of(&self, offset: usize) -> usize {
        self.breaks.partition_point(|&at| at < offset) + 1
    }
}

/// The offsets of `word` in `code`, not as a part of a longer name.
pub(crate) fn occurrences(code: &str, word: &str) -> Vec<usize> {
    let is_name = |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
    let bytes = code.as_bytes();
    let (opens_with_name, closes_with_name) = (is_name(word.as_bytes().first()), is_name(word.as_bytes().last()));
    let whole = |&at: &usize| {
        let joined_before = opens_with_name && at > 0 && is_name(bytes.get(at - 1));
        let joined_after = closes_with_name && is_name(bytes.get(at + word.len()));
        !joined_before && !joined_after
    };
    code.match_indices(word).map(|(at, _)| at).filter(whole).collect()
}

/// The offset of the brace that closes the one at `open`, or the end of `code`.
pub(crate) fn closing_brace(code: &str, open: usize) -> usize {
    let mut depth = 0_usize;
    for (at, byte) in code.bytes().enumerate().skip(open) {
        match byte {
            b'{' => depth += 1,
            b'}' => depth = depth.saturating_sub(1),
            _ => continue,
        }
        if depth == 0 {
            return at;
        }
    }
    code.len()
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TextKind {
    Code,
    Comment,
    Text,
}

fn classify(bytes: &[u8]) -> Vec<TextKind> {
    let mut kinds = vec![TextKind::Code; bytes.len()];
    let mut at = 0;
    while at < bytes.len() {
        let (kind, length) = token(bytes, at);
        kinds[at..at + length].fill(kind);
        at += length;
    }
    kinds
}

/// The kind and the length of what begins at `at`.
fn token(bytes: &[u8], at: usize) -> (TextKind, usize) {
    let rest = &bytes[at..];
    let within_name = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
    if rest.starts_with(b"//") {
        (TextKind::Comment, rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len()))
    } else if rest.starts_with(b"/*") {
        (TextKind::Comment, block_comment(rest))
    } else if let Some(length) = raw_string(rest).filter(|_| !within_name) {
        (TextKind::Text, length)
    } else if rest[0] == b'"' {
        (TextKind::Text, quoted(rest))
    } else if rest[0] == b'\'' {
        character(rest).map_or((TextKind::Code, 1), |length| (TextKind::Text, length))
    } else {
        (TextKind::Code, 1)
    }
}

fn block_comment(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0_usize, 0);
    while at < rest.len() {
        match rest.get(at..at + 2) {
            Some(b"/*") => (depth, at) = (depth + 1, at + 2),
            Some(b"*/") => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            return at;
        }
    }
    rest.len()
}

/// The length of `r"…"`, `r#"…"#`, `br"…"` and their like, if one begins here.
fn raw_string(rest: &[u8]) -> Option<usize> {
    let prefix = if rest[0] == b'b' || rest[0] == b'c' { 1 } else { 0 };
    if rest.get(prefix) != Some(&b'r') {
        return None;
    }
    let hashes = rest[prefix + 1..].iter().take_while(|&&byte| byte == b'#').count();
    let open = prefix + 1 + hashes;
    if rest.get(open) != Some(&b'"') {
        return None;
    }
    let mut close = vec![b'"'];
    close.resize(1 + hashes, b'#');
    let body = rest[open + 1..].windows(close.len()).position(|window| window == close);
    Some(body.map_or(rest.len(), |body| open + 1 + body + close.len()))
}

fn quoted(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() {
        match rest[at] {
            b'\\' => at += 2,
            b'"' => return at + 1,
            _ => at += 1,
        }
    }
    rest.len()
}

/// The length of a character literal, or `None` for a lifetime.
fn character(rest: &[u8]) -> Option<usize> {
    if rest.get(1) == Some(&b'\\') {
        let close = rest.iter().skip(3).position(|&byte| byte == b'\'')?;
        return Some(close + 4);
    }
    // One character of up to four bytes, then the closing quote.
    let close = rest.iter().skip(2).take(4).position(|&byte| byte == b'\'')? + 2;
    let one = std::str::from_utf8(&rest[1..close]).ok()?.chars().count() == 1;
    one.then_some(close + 1)
}

fn view(text: &str, kinds: &[TextKind], wanted: TextKind) -> String {
    let keep = |(byte, kind): (u8, &TextKind)| if *kind == wanted || byte == b'\n' { byte } else { b' ' };
    let bytes: Vec<u8> = text.bytes().zip(kinds).map(keep).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Blanks each item under `#[cfg(test)]` or a condition that includes `test`, up to its closing brace or semicolon.
fn without_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(";
    let mut bytes = code.as_bytes().to_vec();
    let mut from = 0;
    while let Some(found) = code[from..].find(MARK) {
        let start = from + found;
        let attribute_end = code[start..].find(']').map_or(code.len(), |length| start + length + 1);
        from = attribute_end;
        if is_test_condition(&code[start..attribute_end]) {
            from = item_end(code, attribute_end);
            bytes[start..from].iter_mut().filter(|byte| **byte != b'\n').for_each(|byte| *byte = b' ');
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn is_test_condition(attribute: &str) -> bool {
    !occurrences(attribute, "test").is_empty() && !attribute.contains("not(test)")
}

fn item_end(code: &str, from: usize) -> usize {
    match code[from..].find(['{', ';']) {
        Some(at) if code.as_bytes()[from + at] == b'{' => (closing_brace(code, from + at) + 1).min(code.len()),
        Some(at) => from + at + 1,
        None => code.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(text: &str) -> String {
        Source::new("a.rs", text).code.trim_end().to_owned()
    }

    #[test]
    fn comments_and_strings_are_not_code() {
        assert_eq!(code("a(); // b()"), "a();");
        assert_eq!(code("a(/* b /* c */ d */);"), format!("a({});", " ".repeat(17)));
        assert_eq!(code(r#"a("b\"c()");"#), format!("a({});", " ".repeat(8)));
        assert_eq!(code(r##"a(r#"b"c"#);"##), format!("a({});", " ".repeat(8)));
    }

    #[test]
    fn a_lifetime_is_code_and_a_quote_in_quotes_is_not_a_string() {
        assert_eq!(code("fn f<'a>(x: &'a str) {}"), "fn f<'a>(x: &'a str) {}");
        assert_eq!(code(r#"f('"'); g()"#), "f(   ); g()");
        assert_eq!(code(r"f('\''); g()"), "f(    ); g()");
    }

    #[test]
    fn views_keep_the_lines() {
        let source = Source::new("a.rs", "/* a\nb */\nc();\n");
        assert_eq!(source.code.lines().count(), 3);
        assert_eq!(source.line_of(source.code.find("c()").unwrap()), 3);
    }

    #[test]
    fn test_modules_do_not_ship() {
        let source = Source::new("a.rs", "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { {} } }\nfn c() {}\n");
        assert!(source.shipped.contains("fn a") && source.shipped.contains("fn c"));
        assert!(!source.shipped.contains("fn b"));
        assert!(source.code.contains("fn b"));
        let source = Source::new("a.rs", "#[cfg(all(test, unix))]\nfn a() {}\n#[cfg(not(test))]\nfn b() {}\n");
        assert!(!source.shipped.contains("fn a") && source.shipped.contains("fn b"));
    }

    #[test]
    fn a_folder_of_tests_does_not_ship() {
        let library = |path: &str| Source::new(path, "").library().map(str::to_owned);
        assert_eq!(library("crates/sim/src/world/tests.rs").as_deref(), Some("sim"));
        assert_eq!(library("crates/sim/src/tests/world.rs"), None);
    }

    #[test]
    fn a_word_is_found_only_as_a_whole() {
        assert_eq!(occurrences("std::x; nostd::y; (std::z)", "std::"), [0, 19]);
        assert_eq!(occurrences("tokio; tokios; my_tokio", "tokio"), [0]);
    }
}

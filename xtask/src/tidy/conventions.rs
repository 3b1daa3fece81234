//! Conventions of names, documentation and attributes.

use super::finding::Finding;
use super::source::{Source, occurrences};

/// Every file begins with its documentation, or has one item with its own.
pub(super) fn module_docs(source: &Source) -> Vec<Finding> {
    if source.text.lines().any(|line| line.starts_with("//!")) || first_item(&source.text).starts_with("///") {
        return Vec::new();
    }
    vec![finding(
        source,
        1,
        "module_docs",
        "neither the file nor its first item is documented".to_owned(),
        "a reader wants to know what a file is before how it works",
        "begin with `//!` lines: what it is in the standard, what goes in and out, what it does not do",
    )]
}

/// The line where the first item begins, past attributes, modules and imports.
fn first_item(text: &str) -> &str {
    let mut importing = false;
    for line in text.lines() {
        let imports = importing
            || ["use ", "pub use ", "pub(crate) use ", "mod ", "pub mod "].iter().any(|word| line.starts_with(word));
        importing = imports && !line.trim_end().ends_with(';');
        if !(imports || line.trim().is_empty() || line.starts_with("#")) {
            return line;
        }
    }
    ""
}

/// A test's name is a sentence: at least three words.
pub(super) fn test_names(source: &Source) -> Vec<Finding> {
    let mut found = Vec::new();
    for at in occurrences(&source.code, "#[test]") {
        let rest = &source.code[at..];
        let Some(name) = rest.split_once("fn ").map(|(_, rest)| rest.split('(').next().unwrap_or_default().trim())
        else {
            continue;
        };
        // A macro's placeholder has no name yet; the macro's caller gives it one.
        if name.matches('_').count() < 2 && !name.starts_with('$') {
            found.push(finding(
                source,
                source.line_of(at),
                "test_names",
                format!("test `{name}`"),
                "the name of a failed test is all that a reader sees first",
                "name it as a sentence: what, under which condition, does what",
            ));
        }
    }
    found
}

/// A lint that is allowed and a test that is ignored each say why.
pub(super) fn reasons(source: &Source) -> Vec<Finding> {
    let mut found = Vec::new();
    for word in ["#[allow(", "#![allow("] {
        for at in occurrences(&source.code, word) {
            let attribute = source.code[at..].split(']').next().unwrap_or_default();
            if !attribute.contains("reason") {
                found.push(reason_missing(
                    source,
                    at,
                    "a lint is allowed",
                    "add reason = \"...\", or use the lint's advice",
                ));
            }
        }
    }
    for at in occurrences(&source.code, "#[ignore]") {
        found.push(reason_missing(source, at, "a test is ignored", "write #[ignore = \"why\"], or make it run"));
    }
    found
}

fn reason_missing(source: &Source, at: usize, what: &str, remedy: &'static str) -> Finding {
    const WHY: &str = "an exception without a reason stays for ever";
    finding(source, source.line_of(at), "reasons", format!("{what} without a reason"), WHY, remedy)
}

/// Spellings that the field does not use, with the one it does. `docs` may still name them as aliases.
const FIELD_WORDS: &[(&str, &str)] = &[
    ("ControlWord", "write Controlword"),
    ("StatusWord", "write Statusword"),
    ("control_word", "write controlword"),
    ("status_word", "write statusword"),
    ("profiled_position", "write profile_position"),
    ("profiled_velocity", "write profile_velocity"),
    ("actual_pos", "write position_actual_value"),
    ("actual_vel", "write velocity_actual_value"),
    ("bootup", "write boot_up"),
    ("utils", "name the thing that it does"),
    ("helpers", "name the thing that it does"),
];

/// The standard's words in the standard's spelling.
pub(super) fn field_words(source: &Source) -> Vec<Finding> {
    let mut found = Vec::new();
    for &(word, remedy) in FIELD_WORDS {
        for at in occurrences(&source.code, word) {
            let why = "one thing has one name, the standard's, so that a search finds all of it";
            found.push(finding(source, source.line_of(at), "field_words", format!("`{word}`"), why, remedy));
        }
    }
    found
}

/// Comments that are drawn instead of written.
pub(super) fn banners(source: &Source) -> Vec<Finding> {
    let is_banner = |line: &str| {
        let drawn = line.trim().trim_start_matches('/').trim();
        drawn.len() >= 10 && drawn.chars().all(|char| "-=*#~_/+".contains(char))
    };
    let lines = source.comments.lines().enumerate().filter(|(_, line)| is_banner(line));
    lines
        .map(|(at, _)| {
            let why = "a file that needs sections is two files";
            finding(source, at + 1, "banners", "a banner".to_owned(), why, "remove it, or split the file")
        })
        .collect()
}

fn finding(
    source: &Source,
    line: usize,
    rule: &'static str,
    what: String,
    why: &'static str,
    remedy: &'static str,
) -> Finding {
    Finding { path: source.path.clone(), line, rule, what, why, remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(rule: fn(&Source) -> Vec<Finding>, text: &str) -> usize {
        rule(&Source::new("crates/can/src/a.rs", text)).len()
    }

    #[test]
    fn a_file_without_module_documentation_is_found() {
        assert_eq!(count(module_docs, "use core::fmt;\n"), 1);
        assert_eq!(count(module_docs, "use core::fmt;\n\nconst A: u8 = 1;\n/// B.\npub struct B;\n"), 1);
        assert_eq!(count(module_docs, "#![no_std]\n\n//! What it is.\n"), 0);
        assert_eq!(count(module_docs, "use a::{\n    b,\n    c,\n};\n\n/// What it is.\npub struct A;\n"), 0);
    }

    #[test]
    fn a_test_whose_name_is_no_sentence_is_found() {
        assert_eq!(count(test_names, "#[test]\nfn parse() {}"), 1);
        assert_eq!(count(test_names, "#[test]\nfn a_frame_without_data_parses() {}"), 0);
        assert_eq!(count(test_names, "#[test]\nfn $sentence() {}"), 0);
    }

    #[test]
    fn exceptions_without_a_reason_are_found() {
        assert_eq!(count(reasons, "#[allow(dead_code)]\nfn f() {}"), 1);
        assert_eq!(count(reasons, "#[allow(dead_code, reason = \"a test reads it\")]\nfn f() {}"), 0);
        assert_eq!(count(reasons, "#[ignore]\nfn f() {}"), 1);
        assert_eq!(count(reasons, "#[ignore = \"needs a motor\"]\nfn f() {}"), 0);
    }

    #[test]
    fn every_foreign_spelling_is_found_and_an_alias_in_the_documentation_is_not() {
        for (word, _) in FIELD_WORDS {
            assert_eq!(count(field_words, &format!("struct A {{ a: {word} }}")), 1, "{word}");
        }
        assert_eq!(count(field_words, "#[doc(alias = \"control_word\")]\nstruct Controlword;"), 0);
    }

    #[test]
    fn a_banner_is_found_and_a_table_in_a_comment_is_not() {
        assert_eq!(count(banners, "// ---------------\n"), 1);
        assert_eq!(count(banners, "//! |---|---|\n//! | a | b |\n"), 0);
    }
}

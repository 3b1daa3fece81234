//! What code may not say: clocks, threads, printing and statics where the design has none, and work left undone.

use super::dependencies::NO_STD;
use super::finding::Finding;
use super::source::{Source, occurrences};

/// A word, the crates that may say it all the same, and why the others may not.
struct Banned {
    word: &'static str,
    allowed_in: &'static [&'static str],
    why: &'static str,
    remedy: &'static str,
}

const CLOCK: &str = "time is an argument, so that a run repeats to the last bit; only transport reads a clock";
const TAKE_NOW: &str = "take `now: Instant` as an argument, or move this to transport";
const PRINTING: &str = "a library that prints cannot be used without a terminal";
const RETURN_IT: &str = "return the fact, and let the caller show it";

const BANNED: &[Banned] = &[
    Banned { word: "std::time::Instant", allowed_in: &["transport"], why: CLOCK, remedy: TAKE_NOW },
    Banned { word: "Instant::now", allowed_in: &["transport"], why: CLOCK, remedy: TAKE_NOW },
    Banned { word: "SystemTime", allowed_in: &["transport"], why: CLOCK, remedy: TAKE_NOW },
    Banned {
        word: "thread::sleep",
        allowed_in: &[],
        why: "a sleep is a hidden clock and makes tests slow and flaky",
        remedy: "keep a deadline and report it from poll_timeout",
    },
    Banned {
        word: "tokio",
        allowed_in: &["transport", "host", "console", "foxglove", "serve", "studio", "web", "cli", "python"],
        why: "the core is sans-IO and runs under any runtime or none",
        remedy: "write a Station or a plain future; the run loops are in transport",
    },
    Banned { word: "println!", allowed_in: &["cli"], why: PRINTING, remedy: RETURN_IT },
    Banned { word: "eprintln!", allowed_in: &["cli"], why: PRINTING, remedy: RETURN_IT },
    Banned { word: "print!", allowed_in: &["cli"], why: PRINTING, remedy: RETURN_IT },
    Banned { word: "eprint!", allowed_in: &["cli"], why: PRINTING, remedy: RETURN_IT },
    Banned { word: "dbg!", allowed_in: &[], why: PRINTING, remedy: "remove it" },
    Banned {
        word: "static mut",
        allowed_in: &[],
        why: "state outside a value means one node per program",
        remedy: "put the state into the struct that it belongs to",
    },
    Banned {
        word: ".unwrap()",
        allowed_in: &[],
        why: "a panic without a reason cannot be judged by the reader",
        remedy: "return an error, or write expect(\"why this cannot happen\")",
    },
];

/// Banned words in the code that the crates ship.
pub(super) fn in_code(source: &Source) -> Vec<Finding> {
    let Some(library) = source.library() else { return Vec::new() };
    let mut found = Vec::new();
    for banned in BANNED.iter().filter(|banned| !banned.allowed_in.contains(&library)) {
        let occurrences = occurrences(&source.shipped, banned.word).into_iter();
        // `&'static mut` is not a `static mut`.
        for at in occurrences.filter(|at| !source.shipped[..*at].ends_with('\'')) {
            found.push(finding(source, at, "banned", banned.word, banned.why, banned.remedy));
        }
    }
    found
}

/// `std` in a crate that must run without one, and a missing `#![no_std]`.
pub(super) fn std_in_core(source: &Source) -> Vec<Finding> {
    const WHY: &str = "this crate runs on microcontrollers, without an operating system";
    if !source.library().is_some_and(|library| NO_STD.contains(&library)) {
        return Vec::new();
    }
    let words = ["std::", "extern crate std", "extern crate alloc", "alloc::"];
    let mut found: Vec<Finding> = words
        .iter()
        .flat_map(|word| occurrences(&source.shipped, word).into_iter().map(move |at| (at, *word)))
        .map(|(at, word)| finding(source, at, "no_std", word, WHY, "use core, libm or heapless"))
        .collect();
    if source.path.ends_with("/src/lib.rs") && occurrences(&source.code, "no_std").is_empty() {
        found.push(finding(
            source,
            0,
            "no_std",
            "no #![no_std]",
            WHY,
            "add #![no_std] below the crate's documentation",
        ));
    }
    found
}

/// What reads or waits by the clock.
const CLOCKS: [&str; 6] =
    ["thread::sleep", "time::sleep", "time::timeout", "Instant::now", "recv_timeout", "set_read_timeout"];

/// A clock in a test without its reason in a comment on the line before. What virtual time can show needs none.
pub(super) fn clocks_of_tests(source: &Source) -> Vec<Finding> {
    const WHY: &str =
        "a test that waits by the clock is slow, and one with a bound by it fails where the machine is busy";
    const REMEDY: &str = "let virtual time pass, or wait until it is so (`processes::wait_for`); \
                          else say on the line before why it must be the clock";
    if source.library().is_some() || ["xtask/", "benches/"].iter().any(|folder| source.path.starts_with(folder)) {
        return Vec::new();
    }
    let lines: Vec<&str> = source.text.lines().collect();
    let calls = CLOCKS.iter().flat_map(|word| found_in(&source.code, word));
    let unexplained = calls.filter(|(at, _)| {
        let line = source.line_of(*at);
        !line.checked_sub(2).is_some_and(|before| lines[before].trim_start().starts_with("//"))
    });
    unexplained.map(|(at, word)| finding(source, at, "clock", word, WHY, REMEDY)).collect()
}

/// Work left undone: in code by macro, in comments by word.
pub(super) fn left_undone(source: &Source) -> Vec<Finding> {
    const WHY: &str = "the project ships whole things, not places where a thing will be";
    const REMEDY: &str = "write it, or omit it and document that";
    let in_code = ["todo!", "unimplemented!"].iter().flat_map(|word| found_in(&source.code, word));
    let in_comments = ["TODO", "FIXME", "XXX", "HACK"].iter().flat_map(|word| found_in(&source.comments, word));
    in_code.chain(in_comments).map(|(at, word)| finding(source, at, "undone", word, WHY, REMEDY)).collect()
}

fn found_in<'a>(view: &str, word: &'a str) -> Vec<(usize, &'a str)> {
    occurrences(view, word).into_iter().map(|at| (at, word)).collect()
}

fn finding(
    source: &Source,
    at: usize,
    rule: &'static str,
    word: &str,
    why: &'static str,
    remedy: &'static str,
) -> Finding {
    Finding { path: source.path.clone(), line: source.line_of(at), rule, what: format!("`{word}`"), why, remedy }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_file(rule: fn(&Source) -> Vec<Finding>, path: &str, text: &str) -> Vec<(usize, String)> {
        rule(&Source::new(path, text)).into_iter().map(|finding| (finding.line, finding.what)).collect()
    }

    #[test]
    fn a_clock_in_a_core_crate_is_found_and_in_transport_it_is_not() {
        let text = "\nfn f() { let now = std::time::Instant::now(); }\n";
        assert!(in_file(in_code, "crates/sim/src/a.rs", text).contains(&(2, "`Instant::now`".into())));
        assert_eq!(in_file(in_code, "crates/transport/src/a.rs", text), []);
        assert_eq!(in_file(in_code, "crates/sim/src/a.rs", "use std::time::Duration;"), []);
    }

    #[test]
    fn every_banned_word_is_found_in_some_crate() {
        for banned in BANNED {
            let text = format!("fn f() {{ {} }}", banned.word);
            let found = in_file(in_code, "crates/plant/src/a.rs", &text);
            assert!(found.contains(&(1, format!("`{}`", banned.word))), "{}", banned.word);
        }
    }

    #[test]
    fn tests_and_comments_may_say_what_they_like() {
        let text = "// println!\n#[cfg(test)]\nmod tests { fn f() { println!(); x.unwrap(); } }\n";
        assert_eq!(in_file(in_code, "crates/plant/src/a.rs", text), []);
    }

    #[test]
    fn a_core_crate_may_not_lean_on_std() {
        let text = "#![no_std]\nuse std::vec::Vec;\n";
        assert_eq!(in_file(std_in_core, "crates/can/src/lib.rs", text), [(2, "`std::`".into())]);
        assert_eq!(in_file(std_in_core, "crates/sim/src/lib.rs", text), []);
        assert_eq!(in_file(std_in_core, "crates/can/src/lib.rs", "fn a() {}"), [(1, "`no #![no_std]`".into())]);
    }

    #[test]
    fn work_left_undone_is_found_in_code_and_in_comments() {
        assert_eq!(in_file(left_undone, "xtask/src/a.rs", "fn f() { todo!() }"), [(1, "`todo!`".into())]);
        assert_eq!(in_file(left_undone, "tests/a.rs", "\n// FIXME later"), [(2, "`FIXME`".into())]);
        assert_eq!(in_file(left_undone, "tests/a.rs", "let text = \"FIXME\";"), []);
    }

    #[test]
    fn a_clock_in_a_test_needs_its_reason_on_the_line_before() {
        let found = |path: &str, text: &str| in_file(clocks_of_tests, path, text).len();
        assert_eq!(found("tests/a.rs", "fn f() {\n    std::thread::sleep(LONG);\n}"), 1);
        assert_eq!(found("tests/a.rs", "fn f() {\n    // It boots.\n    std::thread::sleep(LONG);\n}"), 0);
        assert_eq!(found("crates/cli/src/a.rs", "fn f() {\n    tokio::time::sleep(LONG);\n}"), 0);
        for word in CLOCKS {
            assert_eq!(found("crates/sim/tests/a.rs", &format!("fn f() {{\n    {word}(LONG);\n}}")), 1, "{word}");
        }
    }
}

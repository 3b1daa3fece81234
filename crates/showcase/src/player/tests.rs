//! Lines and files of a few lines, on the bench of a ZLAC8030L.

use std::rc::Rc;

use super::play;
use crate::bench::{Bench, Finished};
use crate::error::Error;

fn bench() -> Bench {
    let drives = [(&devices::zltech::ZLAC8030L, 4)];
    Bench::new(&drives, can::Bitrate::K500, Rc::new(|_: &str| {})).expect("a drive")
}

fn played(text: &str) -> Result<Finished, Error> {
    let mut bench = bench();
    play(&mut bench, "x.can", text, false).map(|()| bench.finish())
}

/// The first line of the error.
fn refused(text: &str) -> String {
    match played(text) {
        Ok(_) => String::from("it was played"),
        Err(error) => error.to_string().lines().next().unwrap_or_default().to_owned(),
    }
}

/// What `text` comes to, shown in a row.
fn value(text: &str) -> String {
    let finished =
        played(&format!("step  it\nlet x = {text}\nmoved  {{x}}\n")).unwrap_or_else(|error| panic!("{error}"));
    finished.rows[0].moved.clone()
}

#[test]
fn expressions_follow_the_rules_of_arithmetic() {
    for (text, expected) in [
        ("1 + 2 * 3 - 8 / 4", "5"),
        ("(1 + 2) * -3", "-9"),
        ("0FFh & 3Ch", "60"),
        ("10 - 3 - 2", "5"),
        ("off(157, 80)", "-3"),
        ("sqrt(abs(-16))", "4"),
        ("not(0) + known(NaN)", "1"),
    ] {
        assert_eq!(value(text), expected, "{text}");
    }
}

#[test]
fn an_object_is_read_from_the_drive_and_a_meter_from_the_machine() {
    // As delivered: node-ID 4 (3.1), and 48 V at the supply.
    let text =
        "+ 500 ms silent\nstep  it\n? [1018h:00] >= 1\n! 4 supply 40\n+ 2 s silent\n? supply = 40 ±0.5 V  supply\n";
    let finished = played(text).unwrap_or_else(|error| panic!("{error}"));
    let checks = &finished.rows[0].checks;
    assert!(checks.iter().all(|check| check.ok), "{checks:?}");
    assert_eq!(checks[0].expected, "1018h:00 ≥ 1");
    assert_eq!(checks[1].expected, "supply 40 ±0.500 V");
}

#[test]
fn a_definition_is_done_for_each_row_in_its_own_names() {
    let text = "let a = 7\ndef show a b\n    step  {a} and {b:04X}\neach show\n    1 | 0Ah\n    x y | 255\nstep  {a}\n";
    let finished = played(text).unwrap_or_else(|error| panic!("{error}"));
    let steps: Vec<_> = finished.rows.iter().map(|row| row.step.as_str()).collect();
    assert_eq!(steps, ["1 and 000A", "x y and 00FF", "7"]);
}

#[test]
fn a_line_that_cannot_be_done_is_named_with_what_was_expected() {
    for (text, expected) in [
        ("# a remark\n\nhello\n", "x.can:3: 'hello' does not begin a line here"),
        ("do it\n", "x.can:1: 'it' is not defined"),
        ("def it a\n    step  {a}\ndo it 1 | 2\n", "x.can:3: expected 1 values for 'it', got 2"),
        ("def it\n    do it\ndo it\n", "x.can:2: 'it' uses itself"),
        ("def it\n    hello\ndo it\n", "x.can:2: 'hello' does not begin a line here"),
        ("+ 5 minutes\n", "x.can:1: expected a time such as 500 ms or 1.5 s, got '5 minutes'"),
        ("+ 0 - 5 ms\n", "x.can:1: -0.005 s is not a length of time"),
        ("? speed = 1\n", "x.can:1: 'speed' is not known here"),
        ("? [6041] = 1\n", "x.can:1: expected an object such as 606Ch or 1600h:01, got '6041'"),
        ("? 1 ~ 1\n", "x.can:1: expected = <= or >= in '1 ~ 1'"),
        ("? cos(1) = 1\n", "x.can:1: 'cos' is not a function of 1 values"),
        ("> 604\n", "x.can:1: expected a frame such as 604#2F60600003000000, got '604'"),
        ("step  it\n    + 5 ms\n", "x.can:2: unexpected indentation"),
        ("step  {1\n", "x.can:1: expected '}'"),
        ("drive zlim42c 4\n", "x.can:1: expected 'drive zlac8030l 4'"),
        ("drive zlac8030l 5\n", "x.can:1: expected 'drive zlac8030l 4'"),
    ] {
        assert_eq!(refused(text), expected, "{text}");
    }
}

#[test]
fn what_differs_is_a_row_that_is_not_as_expected() {
    let text = "+ 500 ms silent\n> 604#4000100000000000  device type\n< 584#4300100092010200\nis 0 | yes | no\n\
                same a | b  letters\nheard 704#05 since 0\n? 1 = 2\n";
    let finished = played(text).unwrap_or_else(|error| panic!("{error}"));
    let seen: Vec<_> = finished.rows[0].checks.iter().map(|check| (check.seen.as_str(), check.ok)).collect();
    let expected = [("4300100092010400", false), ("no", false), ("a", false), ("704#00", false), ("1", false)];
    assert_eq!(seen, expected);
}

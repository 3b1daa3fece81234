//! The commands of pages of the handbook on the bus that the page has `ferrodrive sim` serve. Other pages, whose commands need no bus or
//! speak to the simulator's terminal, are followed in `tests/processes/tests/real_time/handbook.rs`.

use super::virtual_bus::{VirtualBus, without_bus};
use crate::scope::command_line;

/// What the pages call the simulator's bus.
const SERVED: &str = "--bus socketcand://127.0.0.1:29536/can0";

/// The words of the commands in the blocks of `sh` of a page.
fn commands(page: &str) -> Vec<Vec<String>> {
    let text = processes::page(&format!("handbook/{page}"));
    let mut language = None;
    let mut found = Vec::new();
    for line in text.lines() {
        match (line.strip_prefix("```"), language) {
            (Some(begin), None) => language = Some(begin),
            (Some(_), Some(_)) => language = None,
            (None, Some("sh")) => found.extend(line.strip_prefix("ferrodrive ").map(words)),
            // A block without a language is not run: a command in it would be true by luck.
            (None, Some("")) => assert!(!line.starts_with("ferrodrive "), "{page}: not in a block of sh: {line}"),
            _ => {}
        }
    }
    found
}

fn words(line: &str) -> Vec<String> {
    line.split(" #").next().unwrap_or_default().split_whitespace().map(str::to_owned).collect()
}

/// The values of `--drive`.
fn drives<'a>(words: &[&'a str]) -> Vec<&'a str> {
    words.windows(2).filter(|pair| pair[0] == "--drive").map(|pair| pair[1]).collect()
}

/// Does what a page says, from top to bottom; how many commands that were.
fn follow(page: &str) -> usize {
    let mut bench = None;
    let commands = commands(page);
    for command in &commands {
        let line = command.join(" ");
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        if words[0] == "sim" {
            let taken = command_line().try_get_matches_from(std::iter::once("ferrodrive").chain(words.iter().copied()));
            assert!(taken.is_ok(), "{page}: {line}: {taken:?}");
            bench = Some(VirtualBus::of(&drives(&words)));
            continue;
        }
        let ended = match (line.strip_prefix(SERVED), &bench) {
            (Some(rest), Some(bench)) => bench.run(&rest.split_whitespace().collect::<Vec<_>>()),
            (Some(_), None) => panic!("{page}: {line}: nothing serves this bus yet"),
            (None, _) => without_bus(&words),
        };
        assert_eq!(ended.status, Some(0), "{page}: {line}: {}{}", ended.out, ended.err);
    }
    commands.len()
}

#[test]
fn every_command_of_the_page_on_lss_ends_well() {
    assert_eq!(follow("lss.md"), 7);
}

#[test]
fn every_command_of_the_page_on_adapters_ends_well() {
    assert_eq!(follow("adapters.md"), 3);
}

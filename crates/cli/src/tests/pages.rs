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

/// The lines of every page, also of one whose commands are not run: each is a command line, with the options that its command has.
#[test]
fn every_command_of_every_page_is_one_that_the_parser_takes() {
    let docs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let mut parser = command_line();
    let mut taken = 0;
    for folder in [docs.clone(), docs.join("handbook"), docs.join("..")] {
        let entries = std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path());
        for path in entries.filter(|path| path.extension().is_some_and(|ending| ending == "md")) {
            let text = std::fs::read_to_string(&path).expect("UTF-8");
            let blocks = text.split("\n```").skip(1).step_by(2);
            for line in blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix("ferrodrive ")) {
                let line = line.split(" #").next().unwrap_or_default();
                // What a shell makes of it: a pipe, an ampersand and files that a data sheet is read from are not there.
                let is_of_shell = |word: &String| ["|", "&", ">", ">>"].contains(&word.as_str());
                let words: Vec<_> = quoted(line).into_iter().take_while(|word| !is_of_shell(word)).collect();
                if words.iter().any(|word| word.ends_with(".eds") || word.contains(".eds@") || word == "..") {
                    continue;
                }
                let parsed = parser.try_get_matches_from_mut(["ferrodrive".to_owned()].into_iter().chain(words));
                let is_help = parsed.as_ref().is_err_and(|error| !error.use_stderr());
                assert!(parsed.is_ok() || is_help, "{}: {line}: {}", path.display(), parsed.unwrap_err());
                taken += 1;
            }
        }
    }
    assert!(taken > 150, "{taken}");
}

/// The words of a line, of which some may stand in quotation marks.
fn quoted(line: &str) -> Vec<String> {
    let parts = line.split('\'').enumerate();
    parts
        .flat_map(|(n, part)| if n % 2 == 1 { vec![part] } else { part.split_whitespace().collect() })
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_command_of_the_page_on_lss_ends_well() {
    assert_eq!(follow("lss.md"), 7);
}

#[test]
fn every_command_of_the_page_on_adapters_ends_well() {
    assert_eq!(follow("adapters.md"), 3);
}

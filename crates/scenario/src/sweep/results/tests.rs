//! Files that are cut, split and merged, against the one that a single process writes.

use std::io;
use std::path::Path;

use super::{MergeError, Reader, ResultsError, RunResult, head, merge};
use crate::Scenario;
use crate::sweep::{Shard, Summary, Sweep, SweepReport};

/// A parameter of numbers and one of words, of which some make no sense; a figure, and an expectation that is met by some.
const TEXT: &str = "
    title = 'Näher'
    end = '300ms'
    [machine]
    drive = [{ model = 'zlac8030l', node = 4 }]
    [parameters]
    volts = 24
    part = 'supply'
    [sweep]
    volts = [22, 24.5]
    part = ['supply', 'nothing']
    [[step]]
    at = '10ms'
    do = '4 {part} {volts}'
    [[expect]]
    at = '200ms'
    that = '4 supply > 23'
    [figures]
    lowest = 'min 4 supply'
";

fn sweep(seeds: u64) -> Sweep {
    let scenario = Scenario::parse(TEXT, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    Sweep::new(scenario, 1..=seeds).expect("a sweep")
}

/// The results of all runs, made once.
fn results(sweep: &Sweep) -> Vec<RunResult> {
    (0..sweep.runs()).map(|number| RunResult::new(sweep, number, &sweep.run(number))).collect()
}

fn file(sweep: &Sweep, shard: Shard, results: &[RunResult]) -> String {
    let numbers = (0..shard.share(sweep.runs())).map(|nth| shard.number(nth));
    let lines: String = numbers.map(|number| results[number as usize].to_line()).collect();
    head(sweep, shard) + &lines
}

fn merged(sweep: &Sweep, parts: &[String]) -> Result<String, MergeError<io::Error>> {
    let mut whole = head(sweep, Shard::WHOLE);
    let take = |line: &str, _: &RunResult| {
        whole.push_str(line);
        Ok(())
    };
    merge(sweep, parts.iter().map(String::as_bytes), take)?;
    Ok(whole)
}

#[test]
fn a_line_has_its_key_what_came_and_the_first_that_was_not_so() {
    let sweep = sweep(1);
    let results = results(&sweep);
    assert_eq!(results.len(), 4);
    let lines: Vec<serde_json::Value> =
        results.iter().map(|it| serde_json::from_str(&it.to_line()).expect("JSON")).collect();
    // The parameters change in the order of the alphabet: part first, then volts.
    assert_eq!(lines[0]["values"], serde_json::json!({ "part": "supply", "volts": 22.0 }));
    assert_eq!((&lines[0]["passed"], &lines[0]["asked"]), (&false.into(), &"4 supply > 23".into()));
    assert_eq!(lines[2]["values"]["volts"], 24.5);
    assert_eq!((&lines[2]["passed"], &lines[2]["seen"]), (&true.into(), &serde_json::Value::Null));
    // What cannot be made has failed, with the place in the file, and has neither figures nor a digest.
    assert!(
        lines[1]["seen"].as_str().is_some_and(|seen| seen.contains("line 14") && seen.contains("nothing")),
        "{}",
        lines[1]
    );
    assert_eq!((&lines[1]["figures"]["lowest"], &lines[1]["digest"]), (&().into(), &().into()));
    let head: serde_json::Value = serde_json::from_str(&head(&sweep, Shard::WHOLE)).expect("JSON");
    let names: Vec<&str> =
        head["columns"].as_array().expect("columns").iter().filter_map(|it| it[0].as_str()).collect();
    assert_eq!(
        names,
        ["run", "seed", "values.part", "values.volts", "passed", "end_s", "figures.lowest", "digest", "asked", "seen"]
    );
    let kinds = ["string", "double"];
    assert_eq!([&head["columns"][2][1], &head["columns"][3][1]], kinds);
}

/// What a process leaves that is killed at any moment is a beginning of its file: each of them is gone on with to the same bytes.
#[test]
fn a_file_that_was_cut_at_any_byte_goes_on_to_the_same_bytes() {
    let sweep = sweep(3).of_shard(Shard::new(2, 3).expect("a shard"));
    let results = results(&sweep);
    let whole = file(&sweep, sweep.shard(), &results);
    let mut cuts = 0;
    for cut in 0..=whole.len() {
        let left = &whole.as_bytes()[..cut];
        let reader = Reader::of_shard(&sweep, sweep.shard(), left).unwrap_or_else(|error| panic!("{cut}: {error}"));
        let (kept, runs) = match reader {
            None => (0, None),
            Some(mut reader) => {
                while reader.next_result().unwrap_or_else(|error| panic!("{cut}: {error}")).is_some() {}
                (reader.bytes() as usize, Some(reader.runs()))
            }
        };
        let mut gone_on = String::from_utf8(left[..kept].to_vec()).expect("whole lines are UTF-8");
        if runs.is_none() {
            gone_on.push_str(&head(&sweep, sweep.shard()));
        }
        for nth in runs.unwrap_or(0)..sweep.share() {
            gone_on.push_str(&results[sweep.shard().number(nth) as usize].to_line());
        }
        assert_eq!(gone_on, whole, "cut at byte {cut}");
        // Nothing that was whole is made again.
        assert_eq!(runs.map_or(0, |runs| runs + 1), left.iter().filter(|byte| **byte == b'\n').count() as u64);
        cuts += 1;
    }
    assert!(cuts > 200, "{cuts}");
}

#[test]
fn parts_of_any_number_and_in_any_order_make_the_table_and_the_summary_of_one_process() {
    let sweep = sweep(4);
    let results = results(&sweep);
    let whole = file(&sweep, Shard::WHOLE, &results);
    let mut one = Summary::default();
    results.iter().for_each(|result| one.add(&sweep, result));
    for count in 1..=sweep.runs() + 3 {
        let shards = (1..=count).rev().filter_map(|index| Shard::new(index, count));
        let parts: Vec<String> = shards.map(|shard| file(&sweep, shard, &results)).collect();
        let mut summary = Summary::default();
        let mut text = head(&sweep, Shard::WHOLE);
        let take = |line: &str, result: &RunResult| -> Result<(), io::Error> {
            text.push_str(line);
            summary.add(&sweep, result);
            Ok(())
        };
        merge(&sweep, parts.iter().map(String::as_bytes), take).unwrap_or_else(|error| panic!("{count}: {error}"));
        assert_eq!(text, whole, "{count} parts");
        let report = |summary| SweepReport::new(Path::new("a.toml"), &sweep, summary);
        assert_eq!(report(&summary), report(&one), "{count} parts");
    }
}

#[test]
fn parts_that_are_not_there_there_twice_or_not_whole_are_named() {
    let sweep = sweep(2);
    let results = results(&sweep);
    let part = |index, count| file(&sweep, Shard::new(index, count).expect("a shard"), &results);
    let refused = |parts: &[String]| merged(&sweep, parts).expect_err("refused").to_string();
    assert_eq!(refused(&[part(1, 3), part(3, 3)]), "expected 3 parts, one of each shard; shard 2/3 is there 0 times");
    assert_eq!(
        refused(&[part(1, 2), part(2, 2), part(2, 2)]),
        "expected 2 parts, one of each shard; shard 2/2 is there 2 times"
    );
    assert!(refused(&[part(1, 2), part(2, 3)]).starts_with("line 1: it is shard 2/3"));
    let torn = part(2, 2);
    let torn = torn[..torn.len() - 1].to_owned();
    assert_eq!(refused(&[part(1, 2), torn]), "shard 2/2 has 3 of its 4 runs");
    assert!(refused(&[part(1, 2), String::new()]).starts_with("line 1: expected the head"));
    let more = part(2, 2) + &results[0].to_line();
    assert_eq!(refused(&[part(1, 2), more]), "line 6: expected no line after the last run");
}

/// Each of these has a place and a remedy, and none is cut as if it were torn.
#[test]
fn a_file_of_another_sweep_or_kind_is_refused_with_its_place_and_what_to_do() {
    let sweep = sweep(2);
    let results = results(&sweep);
    let whole = file(&sweep, Shard::WHOLE, &results);
    let refused = |text: &str| -> (u64, String, String) {
        let found = Reader::of_shard(&sweep, Shard::WHOLE, text.as_bytes()).and_then(|reader| {
            let mut reader = reader.expect("a head");
            while reader.next_result()?.is_some() {}
            Ok(())
        });
        match found {
            Err(ResultsError::Line { line, what, next }) => (line, what, next),
            other => panic!("{other:?}"),
        }
    };
    for kind in ["notes of mine", "{\"form\":1}\n", "\n\n", "{\"shard\":\"1/1\"}\n"] {
        let (line, what, next) = refused(kind);
        assert!(line == 1 && next.contains("another"), "{kind}: {what}; {next}");
    }
    let scenario = |text: &str| Scenario::parse(text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    let set = [("part".to_owned(), "supply".to_owned())].into();
    let mut mechanical = scenario(TEXT);
    mechanical.fidelity = Some(sim::Fidelity::Mechanical);
    let others = [
        ("hash of the scenario", Sweep::new(scenario(&TEXT.replace("> 23", "> 22")), 1..=2)),
        ("--seeds", Sweep::new(scenario(TEXT), 1..=3)),
        ("parameters", Sweep::new(scenario(TEXT).with(&set).expect("a parameter"), 1..=2)),
        ("--fidelity", Sweep::new(mechanical, 1..=2)),
    ];
    for (named, other) in others {
        let (line, what, next) = refused(&head(&other.expect("a sweep"), Shard::WHOLE));
        assert!(line == 1 && what.contains(named) && !next.is_empty(), "{named}: {what}; {next}");
    }
    let (_, what, next) = refused(&whole.replacen(env!("CARGO_PKG_VERSION"), "0.0.1", 1));
    assert!(what.contains("version of ferrodrive: \"0.0.1\" in the file") && next.contains("that version"), "{what}");
    let (_, what, next) = refused(&head(&sweep, Shard::new(2, 2).expect("a shard")));
    assert!(what.contains("2/2") && next.contains("--shard 2/2"), "{what}; {next}");

    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    let without_third = [&lines[..2], &lines[3..]].concat().concat();
    let (line, what, next) = refused(&without_third);
    assert!(line == 3 && what.contains("expected the result of run 1") && what.contains("run 2"), "{what}");
    assert!(next.starts_with("delete line 3"), "{next}");
    let twice = [&lines[..3], &lines[2..]].concat().concat();
    assert_eq!(refused(&twice).0, 4);
    let zeros = [lines[0], lines[1], "\0\0\0\0\n", lines[3]].concat();
    assert_eq!(refused(&zeros).0, 3);
    let other_value = whole.replacen("\"volts\":22.0", "\"volts\":23.0", 1);
    assert_eq!(refused(&other_value).0, 2);
    let endless = lines[0].to_owned() + &"x".repeat((1 << 20) + 5);
    assert_eq!(refused(&endless).0, 2);
}

/// The machine file decides as the scenario does.
#[test]
fn a_machine_file_that_was_changed_is_another_sweep() {
    let scratch = tempfile::tempdir().expect("a folder");
    let folder = scratch.path();
    let head_of = |machine: &str| {
        std::fs::write(folder.join("machine.toml"), machine).expect("written");
        let scenario = Scenario::parse("machine = 'machine.toml'\nend = '1s'\n", folder);
        head(&Sweep::new(scenario.unwrap_or_else(|bad| panic!("{bad}")), 1..=1).expect("a sweep"), Shard::WHOLE)
    };
    let one = "drive = [{ model = 'zlac8030l', node = 4 }]\n";
    let (first, second, third) = (head_of(one), head_of(&one.replace('4', "5")), head_of(one));
    assert_eq!(first, third);
    assert_ne!(first, second);
}

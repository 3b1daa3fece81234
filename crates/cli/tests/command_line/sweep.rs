//! The results of a sweep as a file: shards, what goes on after a kill, and how the parts come together. Files that are cut at each
//! byte are asked in the library (`crates/scenario/src/sweep/results/tests.rs`).

#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use std::path::Path;
use std::process::Stdio;

use processes::{command, done, ferrodrive, scratch, wait_until};

/// A bus that loses frames at random: each seed is another run. Runs below 22 V fail.
const RANDOM: &str = "
title = 'Frames are lost'
end = '400ms'
[machine]
timing = 'ideal'
drive = [{ model = 'zlac8030l', node = 4 }]
[parameters]
volts = 24
[sweep]
volts = [20, 24]
[[step]]
at = '0s'
do = ['bus corrupt 0.2', '4 supply {volts}']
[[host]]
start = '10ms'
do = { do = '4 read 1000', within = '1s' }
[[expect]]
at = '300ms'
that = '4 supply > 22'
[figures]
answered = 'time host'
";

fn lines(path: &str) -> usize {
    std::fs::read(path).map_or(0, |bytes| bytes.iter().filter(|byte| **byte == b'\n').count())
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn shards_that_were_killed_go_on_and_make_the_table_and_the_summary_of_one_process() {
    let folder = scratch("sweep-killed");
    let scenario = folder.write("random.toml", RANDOM);
    let sweep = ["run", &scenario, "--seeds", "1..40", "--json"];
    let one = folder.path("one.jsonl");
    let whole = ferrodrive(&[&sweep[..], &["-o", &one]].concat());
    assert_eq!((whole.status, lines(&one)), (Some(1), 81), "{}", whole.err);
    let found = whole.json();
    assert_eq!((&found["passed"], &found["failed"], &found["seeds_differ"]), (&40.into(), &40.into(), &true.into()));
    assert_eq!((&found["values"][0]["value"], &found["values"][0]["failed"]), (&"20".into(), &40.into()));

    let mut parts = Vec::new();
    let mut kills = 0;
    for shard in ["1/2", "2/2"] {
        let part = folder.path(&format!("part-{}.jsonl", &shard[..1]));
        let arguments = [&sweep[..], &["--shard", shard, "--jobs", "1", "-o", &part, "--resume"]].concat();
        for killed_at in [1, 12, 31] {
            let mut child = command(&arguments).stdout(Stdio::null()).spawn().expect("the program runs");
            wait_until("it has some results", || lines(&part) > killed_at);
            let before = lines(&part);
            child.kill().expect("killed");
            child.wait().expect("ended");
            assert!(lines(&part) >= before, "nothing that was there is lost");
            kills += 1;
        }
        let ended = ferrodrive(&arguments);
        assert_eq!(ended.status, Some(1), "{}", ended.err);
        let report = ended.json();
        assert_eq!((&report["shard"], &report["runs"], &report["complete"]), (&shard.into(), &40.into(), &true.into()));
        parts.push(part);
    }
    assert_eq!(kills, 6);
    let table = folder.path("table.jsonl");
    let merged = ferrodrive(&[&sweep[..], &["-o", &table, "--merge", &parts[1], &parts[0]]].concat());
    assert_eq!(merged.json(), found);
    assert_eq!(read(&table), read(&one));
}

#[test]
fn a_whole_file_is_not_written_again_and_is_judged_as_before() {
    let folder = scratch("sweep-whole");
    let scenario = folder.write("random.toml", RANDOM);
    let results = folder.path("results.jsonl");
    let arguments = ["run", &scenario, "--seeds", "1..2", "-o", &results, "--resume"];
    let first = ferrodrive(&arguments);
    let written = read(&results);
    let second = ferrodrive(&arguments);
    assert_eq!((first.status, &first.out), (Some(1), &second.out));
    assert!(first.out.contains("2 of 4 runs passed, 2 failed"), "{}", first.out);
    assert_eq!(read(&results), written);
    // A value that is set is not swept.
    let set = folder.path("set.jsonl");
    let ended = done(&["run", &scenario, "--seeds", "1..2", "--set", "volts=24", "-o", &set, "--json"]);
    assert_eq!((ended.json()["values"].as_array().map(Vec::len), lines(&set)), (Some(0), 3));
}

#[test]
fn what_cannot_be_gone_on_with_or_merged_is_refused_with_its_place_and_stays_as_it_is() {
    let folder = scratch("sweep-refused");
    let scenario = folder.write("random.toml", RANDOM);
    let results = folder.path("results.jsonl");
    let sweep = ["run", &scenario, "--seeds", "1..2"];
    let refused = |arguments: &[&str], status: i32, said: [&str; 2]| {
        let ended = ferrodrive(&[&sweep[..], arguments].concat());
        assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
        said.iter().for_each(|said| assert!(ended.err.contains(said), "{arguments:?}: {said}: {}", ended.err));
    };
    ferrodrive(&[&sweep[..], &["-o", &results]].concat());
    let written = read(&results);
    refused(&["-o", &results], 1, ["already exists", "--resume continues it"]);
    refused(&["--set", "volts=24", "-o", &results, "--resume"], 1, ["line 1: the parameters", "give the same --set"]);
    refused(&["--shard", "1/2", "-o", &results, "--resume"], 1, ["line 1: it has shard 1/1", "give --shard 1/1"]);
    std::fs::write(&scenario, RANDOM.replace("400ms", "500ms")).unwrap();
    refused(&["-o", &results, "--resume"], 1, ["hash of the scenario", "with these files as they were"]);
    std::fs::write(&scenario, RANDOM).unwrap();
    assert_eq!(read(&results), written);

    // A digest that this build does not give.
    let digest = written.split("\"digest\":\"").last().and_then(|rest| rest.get(..16)).expect("a digest");
    let other = folder.write("other.jsonl", &written.replace(digest, "0123456789abcdef"));
    refused(&["-o", &other, "--resume"], 1, ["line 5: run 3 gives another result now", "data sheets"]);
    let notes = folder.write("notes.jsonl", "what I wanted to do");
    refused(&["-o", &notes, "--resume"], 1, ["line 1: expected the head", "another name"]);
    assert_eq!(read(&notes), "what I wanted to do");
    let nowhere = folder.path("nowhere/results.jsonl");
    refused(&["-o", &nowhere], 1, ["cannot write the results", "its folder exists"]);

    let half = folder.path("half.jsonl");
    ferrodrive(&[&sweep[..], &["--shard", "1/2", "-o", &half]].concat());
    refused(&["--merge", &half], 1, ["shard 2/2 is there 0 times", "each part once"]);
    let torn = folder.path("torn.jsonl");
    ferrodrive(&[&sweep[..], &["--shard", "2/2", "-o", &torn]].concat());
    std::fs::write(&torn, read(&torn).trim_end()).unwrap();
    let table = folder.path("table.jsonl");
    let go_on = format!("ferrodrive run {scenario} --seeds 1..2 --shard 2/2 -o {torn} --resume");
    refused(&["-o", &table, "--merge", &half, &torn], 1, ["shard 2/2 has 1 of its 2 runs", &go_on]);
    let part = format!("{table}.part");
    let is_left = |path: &str| Path::new(path).exists();
    assert!(!is_left(&table) && !is_left(&part), "a table that is not whole is not left");
    // What a merge that was killed leaves is not the table, and is not taken for one that is whole.
    std::fs::write(&part, "head").unwrap();
    refused(&["-o", &table, "--merge", &half, &torn], 1, [".part already exists", "then remove it"]);
    assert!(!is_left(&table) && read(&part) == "head");
    std::fs::remove_file(&part).unwrap();
    refused(&["-o", &half, "--merge", &half, &torn], 1, ["half.jsonl already exists", "another --output"]);
    refused(&["--merge", &table], 1, ["cannot use the results", "can be read"]);

    refused(&["-o", "results.txt"], 2, ["NAME.jsonl", "results.txt"]);
    refused(&["--shard", "3/2"], 2, ["3/8", "3/2"]);
    refused(&["--resume"], 2, ["--output", "required"]);
    let once = ferrodrive(&["run", &scenario, "-o", &results]);
    assert!(once.status == Some(2) && once.err.contains("--seeds"), "{}", once.err);
}

#[cfg(unix)]
#[test]
fn two_processes_do_not_write_one_file() {
    let folder = scratch("sweep-lock");
    let scenario = folder.write("random.toml", RANDOM);
    let results = folder.path("results.jsonl");
    let arguments = ["run", &scenario, "--seeds", "1..100000", "--jobs", "1", "-o", &results, "--resume"];
    let mut first = command(&arguments).stdout(Stdio::null()).spawn().expect("the program runs");
    wait_until("it writes", || lines(&results) > 1);
    let second = ferrodrive(&arguments);
    first.kill().expect("killed");
    first.wait().expect("ended");
    assert!(second.status == Some(1) && second.err.contains("being written by another process"), "{}", second.err);
}

/// Each engine of the handbook's page, by its own lines with few seeds: four shards that make the table of one process.
#[test]
fn the_lines_of_each_engine_in_the_handbook_make_the_table_of_one_process() {
    const SWEEP: &str = "ferrodrive run step_loss.toml";
    let folder = scratch("sweep-page");
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/step_loss.toml");
    let run = |place: &Path, words: &str| {
        let parts = (1..=4).map(|shard| format!("part-{shard}.jsonl")).collect::<Vec<_>>().join(" ");
        let words = words.replace("1..100000", "1..3").replace("part-*.jsonl", &parts);
        let words: Vec<&str> = words.split_whitespace().skip(1).collect();
        let ended = command(&words).current_dir(place).output().expect("the program runs");
        assert!(ended.status.success(), "{words:?}: {}", String::from_utf8_lossy(&ended.stderr));
    };
    let text = processes::page("handbook/sweeps.md");
    let mut engines = 0;
    for (number, section) in text.split("\n## ").enumerate() {
        let title = section.lines().next().unwrap_or_default();
        let place = folder.join(number.to_string());
        std::fs::create_dir(&place).unwrap();
        std::fs::copy(example, place.join("step_loss.toml")).unwrap();
        let lines = section.lines().filter_map(|line| line.find(SWEEP).map(|at| &line[at..]));
        let lines = lines.map(|line| line.split(" ||").next().unwrap_or_default());
        let lines: Vec<&str> = lines.map(|line| line.split(" :::").next().unwrap_or_default()).collect();
        for line in &lines {
            let placeholder = ["{}", "${{ matrix.shard }}", "$I"].into_iter().find(|it| line.contains(it));
            match placeholder {
                None => run(&place, line),
                Some(it) => (1..=4).for_each(|shard: u32| run(&place, &line.replace(it, &shard.to_string()))),
            }
        }
        let seeds = match lines.first() {
            None => continue,
            Some(line) if line.contains("1..20") => "1..20",
            Some(_) => "1..3",
        };
        if !lines.iter().any(|line| line.contains("--merge")) {
            run(&place, &format!("{SWEEP} --seeds {seeds} --merge part-*.jsonl -o results.jsonl"));
        }
        run(&place, &format!("{SWEEP} --seeds {seeds} -o one.jsonl"));
        let read = |name: &str| std::fs::read(place.join(name)).expect("results");
        assert_eq!(read("results.jsonl"), read("one.jsonl"), "{title}");
        engines += 1;
    }
    assert_eq!(engines, 5, "the page's beginning, GNU parallel, a matrix, Slurm, Kubernetes");
}

/// The same as the shells of the engines get them: the lines of GNU parallel with GNU parallel, where it is installed, the script of an
/// array and the command of a pod with what Slurm and Kubernetes set for each.
#[cfg(unix)]
#[test]
fn the_shells_of_the_engines_run_their_lines_as_the_handbook_has_them() {
    let text = processes::page("handbook/sweeps.md");
    let section = |title: &str| text.split("\n## ").find(|it| it.starts_with(title)).expect("a section");
    let block = |title: &str| section(title).split("```").nth(1).and_then(|it| it.split_once('\n')).expect("a block").1;
    let is_gnu = command_of("parallel", &["--version"]).output().is_ok_and(|it| it.stdout.starts_with(b"GNU parallel"));
    if !is_gnu {
        eprintln!("skipped for GNU parallel: it is not installed here");
    }
    let parallel: Vec<String> = if is_gnu { vec![block("GNU parallel").to_owned()] } else { Vec::new() };
    let array = (1..=4).map(|task| format!("export SLURM_ARRAY_TASK_ID={task}\n{}", block("An array of Slurm")));
    // Its lines are one text (YAML 1.2.2, 7.3.3).
    let pod = block("An indexed job of Kubernetes").split_once("args:\n").expect("its arguments").1;
    let pod: Vec<&str> = pod.lines().map(|line| line.trim_start().trim_start_matches("- ")).collect();
    let pods = (0..4).map(|index| format!("export JOB_COMPLETION_INDEX={index}\n{}", pod.join(" ")));
    for (engine, scripts) in [("parallel", parallel), ("array", array.collect()), ("pods", pods.collect())] {
        let folder = scratch(&format!("sweep-shell-{engine}"));
        let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/step_loss.toml");
        std::fs::copy(example, folder.join("step_loss.toml")).unwrap();
        for script in &scripts {
            let script = script.replace("1..100000", "1..3");
            let ended = command_of("bash", &["-e", "-c", &script]).current_dir(&*folder).output().expect("bash");
            assert!(ended.status.success(), "{script}: {}", String::from_utf8_lossy(&ended.stderr));
        }
        if scripts.is_empty() {
            continue;
        }
        let run = |words: &[&str]| {
            let words = [&["run", "step_loss.toml", "--seeds", "1..3"], words].concat();
            assert!(command(&words).current_dir(&*folder).output().expect("the program runs").status.success());
        };
        run(&["-o", "one.jsonl"]);
        if engine != "parallel" {
            let parts = ["part-1.jsonl", "part-2.jsonl", "part-3.jsonl", "part-4.jsonl"];
            run(&[&["--merge"], &parts[..], &["-o", "results.jsonl"]].concat());
        }
        assert_eq!(read(&folder.path("results.jsonl")), read(&folder.path("one.jsonl")), "{engine}");
    }
}

/// A program that finds `ferrodrive` on its PATH.
#[cfg(unix)]
fn command_of(program: &str, arguments: &[&str]) -> std::process::Command {
    let own = Path::new(processes::program()).parent().expect("its folder").to_owned();
    let others = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([own].into_iter().chain(std::env::split_paths(&others))).expect("a PATH");
    let mut command = std::process::Command::new(program);
    command.args(arguments).env("PATH", path).env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE");
    command
}

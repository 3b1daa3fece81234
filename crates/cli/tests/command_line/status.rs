//! The exit status by one rule, over all commands: 0 done; 1 it was tried and did not come out, or a file is missing or bad; 2 the
//! command line itself makes no sense, in any case or for the model of its node. With it goes one line of JSON of one form.

use processes::{done, ferrodrive, scratch};
use serde_json::Value;

use super::lines::OF_A_MACHINE;

/// Ends with `status` and one line of JSON that says why and what to do; its error.
#[track_caller]
fn failed(arguments: &[&str], status: i32) -> Value {
    let ended = ferrodrive(&[&["--json"], arguments].concat());
    assert_eq!(ended.status, Some(status), "{arguments:?}: {}{}", ended.out, ended.err);
    assert_eq!(ended.out.lines().count(), 1, "{arguments:?}: {}", ended.out);
    let said = ended.json();
    let error = &said["error"];
    assert_eq!(said["ok"], false, "{arguments:?}: {said}");
    assert!(error["message"].as_str().is_some_and(|text| !text.is_empty()), "{arguments:?}: {said}");
    assert!(error["next"].as_str().is_some_and(|text| !text.is_empty()), "{arguments:?} says what to do: {said}");
    assert_eq!(error["kind"] == "usage", status == 2, "{arguments:?}: {said}");
    error.clone()
}

/// Every command, as the help lists them.
fn commands() -> Vec<String> {
    let help = done(&["-h"]).out;
    let groups = help.lines().skip_while(|line| *line != "Simulate:").take_while(|line| !line.is_empty());
    let names = groups.filter(|line| line.starts_with("  ")).flat_map(str::split_whitespace);
    names.filter(|name| *name != "help").map(ToOwned::to_owned).collect()
}

#[test]
fn an_option_that_is_not_there_is_a_2_of_every_command() {
    let commands = commands();
    assert!(commands.len() > 50, "{commands:?}");
    for name in &commands {
        failed(&[name, "--no-such-option"], 2);
    }
}

#[test]
fn a_machine_file_that_is_missing_or_bad_is_a_1_of_every_command_that_takes_one() {
    let directory = scratch("bad_machine");
    let bad = directory.join("bad.toml");
    std::fs::write(&bad, "[[drive]]\nmodel = 'toaster'\nnode = 4\n").unwrap();
    for name in commands() {
        let takes_one = done(&[&name, "-h"]).out.contains(" --machine");
        let line = OF_A_MACHINE.iter().find(|line| line.split(' ').next() == Some(&name));
        assert_eq!(takes_one, line.is_some(), "{name}");
        let Some(line) = line else { continue };
        if name == "top" {
            // It has no --json.
            assert_eq!(ferrodrive(&["--machine", "/no/such/machine.toml", "top"]).status, Some(1));
            continue;
        }
        for file in ["/no/such/machine.toml", bad.to_str().unwrap()] {
            let words = [&["--machine", file], &line.split(' ').collect::<Vec<_>>()[..]].concat();
            let error = failed(&words, 1);
            assert_eq!(error["kind"], "bad_file", "{words:?}: {error}");
        }
    }
}

/// A line of each way to name a file that is read.
const INPUTS: &[&str] = &[
    "boot FOLDER/m.toml",
    "boot FOLDER/m.dcf",
    "program 4 FOLDER/m.bin",
    "supervise FOLDER/m.toml",
    "plan FOLDER/m.toml",
    "check FOLDER/m.toml",
    "check FOLDER/bus.yml",
    "group move FOLDER/m.toml 4=90deg",
    "drive-base FOLDER/m.toml --linear 0.2 --for 1s",
    "--bus sim:FOLDER/m.toml scan",
    "--bus log:FOLDER/a.log dump",
    "run FOLDER/s.toml",
    "params apply 4 FOLDER/p.toml",
    "params plan 4 FOLDER/p.dcf",
    "params verify 4 FOLDER/p.bin",
    "params diff 4 FOLDER/p.toml",
    "params diff FOLDER/p.dcf FOLDER/p.toml",
    "decode FOLDER/a.log",
    "convert FOLDER/a.log b.asc",
    "replay FOLDER/a.log",
    "replay FOLDER/a.log --skip-motion",
    "plot FOLDER/run.csv",
    "eds lint FOLDER/a.eds",
    "eds show FOLDER/a.eds",
    "eds diff FOLDER/a.eds zlac8030l",
    "dcf 4 --eds FOLDER/a.eds",
    "--model 4=FOLDER/a.eds scan",
    "sim --drive FOLDER/a.eds@4",
    "init --drive FOLDER/a.eds@4",
    "eds FOLDER/a.eds",
    "objects FOLDER/a.eds",
    "write 4 6060 --from FOLDER/a.bin",
    "studio --listen 127.0.0.1:0 --password-file FOLDER/password",
];

#[test]
fn an_input_file_that_is_missing_is_a_1() {
    for line in INPUTS {
        let line = line.replace("FOLDER", "/no/such");
        let error = failed(&line.split(' ').collect::<Vec<_>>(), 1);
        assert_eq!(error["kind"], "bad_file", "{line}: {error}");
    }
}

/// A pipe that nothing writes to would be waited for, and a device may never end.
#[cfg(unix)]
#[test]
fn an_input_that_is_not_a_regular_file_is_a_1_and_not_waited_for() {
    let directory = scratch("not_regular");
    let token = ["studio --listen 127.0.0.1:0 --token-file FOLDER/token"];
    let lines: Vec<_> = INPUTS.iter().chain(&token).copied().collect();
    for kind in ["folder", "pipe", "device"] {
        let folder = directory.join(kind);
        std::fs::create_dir(&folder).unwrap();
        for word in lines.iter().flat_map(|line| line.split(' ')) {
            let Some((_, name)) = word.split_once("FOLDER/") else { continue };
            let path = folder.join(name.trim_end_matches("@4"));
            match kind {
                _ if path.symlink_metadata().is_ok() => {}
                "folder" => std::fs::create_dir(path).unwrap(),
                "pipe" => assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success()),
                _ => std::os::unix::fs::symlink("/dev/zero", path).unwrap(),
            }
        }
        for line in &lines {
            let line = line.replace("FOLDER", folder.to_str().unwrap());
            let error = failed(&line.split(' ').collect::<Vec<_>>(), 1);
            assert_eq!(error["kind"], "bad_file", "{line}: {error}");
        }
    }
}

#[test]
fn a_data_sheet_that_is_none_is_a_1_wherever_it_is_named() {
    let directory = scratch("bad_sheet");
    let sheet = directory.join("bad.eds");
    std::fs::write(&sheet, "no data sheet\n").unwrap();
    let (of_node, of_drive) = (format!("4={}", sheet.display()), format!("{}@4", sheet.display()));
    for line in
        [&["--model", &of_node, "state", "4"][..], &["sim", "--drive", &of_drive], &["init", "--drive", &of_drive]]
    {
        let error = failed(line, 1);
        assert_eq!(error["kind"], "bad_file", "{line:?}: {error}");
        assert!(error["message"].as_str().is_some_and(|text| text.contains("bad.eds")), "{error}");
        let shown = ferrodrive(line);
        assert!(shown.status == Some(1) && shown.err.contains("  next:    "), "{line:?}: {}", shown.err);
    }
    // Without a file in it the word itself makes no sense.
    failed(&["--model", "4=zlac8030", "scan"], 2);
}

#[test]
fn what_a_drive_does_not_take_is_a_1_however_it_is_asked_for() {
    for line in ["velocity 4 20000rpm", "write 4 60FF 1001", "torque 4 31A", "move 4 1e15deg"] {
        failed(&line.split(' ').collect::<Vec<_>>(), 1);
    }
}

/// Words alone make no sense: neither a file nor a bus is needed to see that.
#[test]
fn words_that_make_no_sense_together_are_a_2() {
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    for line in [
        "--timeout 0s scan",
        "studio --listen foo",
        "studio --listen 127.0.0.1:99999",
        "studio --token-file -",
        "gateway --listen foo",
        "params plan 4 note.txt",
        "params diff 4 note.txt",
        "params diff note.txt other.txt",
        "params backup 4 -o x.txt",
        "params apply 4 p.toml --journal -",
        "--log x.txt scan",
        "--log - scan",
        "convert a.log -",
        "run s.toml --junit -",
        "run s.toml --junit x.xyz",
        "run s.toml --seeds 1..2 -o x.xyz",
        "conform 4 --html x.xyz",
        "conform 4 --junit x.html",
        "tune 4 --picture x.xyz",
        "tune 4 -o x.html",
        "report 4 -o x.xyz",
        "capture 4 velocity -o x.xyz",
        "test-motion 4 steps -o x.xyz",
        "fmu zlac8030l@4 -o x.xyz",
        "tune 2 -o x.svg",
        "--json completions bash",
        "--json man-pages pages",
        "run s.toml --clock manual",
        "run s.toml --jobs 2",
        "sim --drive zlac8030l@4 --state -",
        "sim --drive zlac8030l@4 --modbus 127.0.0.1:0",
        "man-pages -",
        "pdo plan 4 tpdo1=statusword --cycle 0s",
        "group move 4=90deg --period 0s",
        "group move 4=90deg --group zz",
        "plan --cycle 0s",
        "latency 4 --sync 0s",
        "--bus sim init --drive zlac8030l@4",
        "drive-base BASE --for 1s",
        "drive-base --linear 0.2 --for 1s",
    ] {
        let line = line.replace("BASE", base);
        failed(&line.split(' ').collect::<Vec<_>>(), 2);
    }
    assert!(!std::path::Path::new("-").exists());
}

#[test]
fn a_file_whose_folder_is_missing_is_a_1_before_anything_is_done() {
    for line in ["demo -o /no/such/x.svg", "conform 4 --html /no/such/x.html", "conform 4 --junit /no/such/x.xml"] {
        let line: Vec<_> = line.split(' ').collect();
        assert_eq!(failed(&line, 1)["kind"], "file", "{line:?}");
        // Work that has begun is shown on standard error.
        let shown = ferrodrive(&line).err;
        assert!(shown.starts_with("error: cannot write"), "{line:?}: {shown}");
    }
}

#[test]
fn a_variable_that_is_empty_counts_as_not_set() {
    for (variable, line) in
        [("FERRODRIVE_BUS", "state 4"), ("FERRODRIVE_MACHINE", "state 4"), ("FERRODRIVE_CONTROL", "world now")]
    {
        let without = processes::command(&line.split(' ').collect::<Vec<_>>()).output().unwrap();
        let with = processes::command(&line.split(' ').collect::<Vec<_>>()).env(variable, "").output().unwrap();
        assert_eq!((with.status, with.stdout, with.stderr), (without.status, without.stdout, without.stderr));
    }
}

/// Those that need nothing but the bus of the command's own.
#[test]
fn examples_of_the_help_on_the_bus_of_its_own_run() {
    for command in ["nmt", "emcy", "torque", "home", "velocity", "move", "state", "explain"] {
        let help = done(&[command, "-h"]).out;
        let lines = help.lines().filter_map(|line| line.trim().strip_prefix("ferrodrive "));
        for line in lines.filter(|line| !line.contains("--bus") && !line.contains("  #")) {
            done(&line.split(' ').collect::<Vec<_>>());
        }
    }
}

/// The same of those that write files, in a folder in which there are those that they read.
#[test]
fn examples_of_the_help_of_what_is_captured_moved_and_drawn_run() {
    let folder = scratch("examples_with_files");
    let run = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        let output = processes::command(&words).current_dir(&folder).output().unwrap();
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    };
    // Fast enough for its frequency response to be that of a mass.
    let motion = "--speed 60rpm --time 40ms --acceleration 6000rpm/s --period 2ms --capture current_demand,position";
    run(&format!("test-motion 4 prbs {motion} -o run.mcap"));
    for command in ["capture", "test-motion", "tune"] {
        let help = done(&[command, "-h"]).out;
        let lines = help.lines().filter_map(|line| line.trim().strip_prefix("ferrodrive "));
        for line in lines.filter(|line| !line.contains("--bus") && !line.contains('\'')) {
            run(line);
        }
    }
}

/// With the words and the model of a node it is seen: before anything is written.
#[test]
fn words_that_the_model_of_a_node_does_not_have_are_a_2() {
    let directory = scratch("not_of_the_model");
    let record = directory.join("x.csv");
    for line in ["write 4 6040 70000", "read 4 statuswort", "record 4 nosuch -o FILE", "pdo plan 4 tpdo9=statusword"] {
        let line = line.replace("FILE", record.to_str().unwrap());
        failed(&line.split(' ').collect::<Vec<_>>(), 2);
    }
    assert!(!record.exists());
    // Without a node there is not a model either.
    for line in ["write 9 6040 70000", "read 9 statuswort", "explain 9", "state 9"] {
        let error = failed(&line.split(' ').collect::<Vec<_>>(), 1);
        assert_eq!(error["kind"], "no_answer", "{line}: {error}");
    }
}

#[test]
fn what_only_a_file_or_a_bus_shows_is_a_1() {
    let directory = scratch("shown_by_a_file");
    let (machine, garbage) = (directory.join("machine.toml"), directory.join("garbage.log"));
    let text = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n\n[[drive]]\nmodel = 'zlac8030l'\nnode = 5\n\n\
                [[group]]\nname = 'wheels'\naxes = [{ node = 4 }]\n";
    std::fs::write(&machine, text).unwrap();
    std::fs::write(&garbage, "no frame\nnor this\n").unwrap();
    for (line, kind) in [
        ("replay GARBAGE", "no_log"),
        ("replay GARBAGE --skip-motion", "no_log"),
        ("convert GARBAGE GARBAGE.asc", "no_log"),
        ("drive-base MACHINE --linear 0.2 --for 1s", "bad_file"),
        ("group move MACHINE 4=90deg --group zz", "bad_file"),
        ("group move MACHINE 5=90deg --group wheels", "bad_file"),
        ("group move MACHINE 4=90deg 5=90deg", "bad_file"),
        ("boot MACHINE --node 99", "bad_file"),
        ("boot --node 99", "not_booted"),
        ("sim --machine MACHINE --modbus 127.0.0.1:0", "bad_file"),
        ("plan --mode 99=pv", "no_answer"),
    ] {
        let line = line.replace("MACHINE", machine.to_str().unwrap()).replace("GARBAGE", garbage.to_str().unwrap());
        let error = failed(&line.split(' ').collect::<Vec<_>>(), 1);
        assert_eq!(error["kind"], kind, "{line}: {error}");
    }
}

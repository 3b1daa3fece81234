//! One machine file, one way to give it: `--machine FILE` on every command, which the environment may set; `--bus sim:FILE` is its
//! short form, and a file as an argument means the same.

use processes::{command, done, ferrodrive, scratch};

const ONE: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 9\n";
const ANOTHER: &str = "[[drive]]\nmodel = 'cia402'\nnode = 7\n";

#[test]
fn the_drives_of_a_machine_file_are_there_however_it_is_given() {
    let directory = scratch("machine_ways");
    let (file, other) = (directory.join("one.toml"), directory.join("another.toml"));
    std::fs::write(&file, ONE).unwrap();
    std::fs::write(&other, ANOTHER).unwrap();
    let (path, another) = (file.to_str().unwrap(), other.to_str().unwrap());
    let short = format!("sim:{path}");
    let by_option = done(&["--json", "--machine", path, "scan"]).out;
    assert_eq!(by_option, done(&["--json", "--bus", &short, "scan"]).out);
    assert!(by_option.contains("\"node\":9") && !by_option.contains("\"node\":4"), "{by_option}");
    let environment = |words: &[&str]| {
        let output = command(words).env("FERRODRIVE_MACHINE", path).output().unwrap();
        assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(by_option, environment(&["--json", "scan"]));
    // What the command line names is stronger than the environment.
    let short = format!("sim:{another}");
    for words in [&["--json", "--machine", another, "scan"][..], &["--json", "--bus", &short, "scan"]] {
        let out = environment(words);
        assert!(out.contains("\"node\":7") && !out.contains("\"node\":9"), "{out}");
    }
    for name in ["boot", "plan", "check", "supervise"] {
        let more: &[&str] = if name == "supervise" { &["--for", "2s"] } else { &[] };
        let with = |words: &[&str]| done(&[&["--json", name], words, more].concat()).out;
        let expected = with(&[path]);
        assert_eq!(expected, with(&["--machine", path]), "{name}");
        assert_eq!(expected, with(&["--machine", path, path]), "{name}");
        assert_eq!(expected, environment(&[&["--json", name], more].concat()), "{name}");
    }
    done(&["--machine", path, "group", "move", "9=10deg"]);
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    done(&["--machine", base, "drive-base", "--linear", "0.2", "--for", "200ms"]);
}

#[test]
fn two_machine_files_are_refused() {
    let directory = scratch("two_machines");
    let (file, other) = (directory.join("one.toml"), directory.join("another.toml"));
    std::fs::write(&file, ONE).unwrap();
    std::fs::write(&other, ANOTHER).unwrap();
    let (path, another) = (file.to_str().unwrap(), other.to_str().unwrap());
    let short = format!("sim:{another}");
    for words in [
        &["--bus", &short, "scan"][..],
        &["boot", another],
        &["plan", another],
        &["check", another],
        &["group", "move", another, "7=10deg"],
    ] {
        let ended = ferrodrive(&[&["--machine", path], words].concat());
        assert_eq!(ended.status, Some(2), "{words:?}: {}", ended.err);
        assert!(
            ended.err.contains("two machine files") && ended.err.contains("one of them"),
            "{words:?}: {}",
            ended.err
        );
    }
}

/// The values of a machine file are not a file of parameters: the remedy is a command that can be typed.
#[test]
fn what_deviates_from_a_machine_file_is_applied_with_that_file() {
    let directory = scratch("machine_verified");
    let file = directory.join("machine.toml");
    std::fs::write(&file, format!("{ONE}heartbeat = '100ms'\n")).unwrap();
    let ended = ferrodrive(&["--machine", file.to_str().unwrap(), "params", "verify", "9"]);
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    assert!(ended.err.contains("1 of 1 object has another value than the machine file"), "{}", ended.err);
    assert!(ended.err.contains("ferrodrive params apply 9, with the same machine file"), "{}", ended.err);
}

//! Wrong command lines end with status 2 and say what was wrong and what is expected.

mod common;

use common::ferrodrive;

#[track_caller]
fn refused(arguments: &[&str], parts: &[&str]) {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(2), "{arguments:?}: {}", ended.err);
    assert!(ended.out.is_empty(), "{arguments:?} printed {}", ended.out);
    for part in parts {
        assert!(ended.err.contains(part), "{arguments:?} should say {part:?}, but says: {}", ended.err);
    }
}

#[test]
fn no_command_and_unknown_commands_are_refused() {
    refused(&[], &["Usage:"]);
    refused(&["reed", "4", "6064"], &["unrecognized subcommand", "read"]);
    refused(&["scan", "--jsn"], &["--json"]);
}

#[test]
fn nodes_are_checked() {
    refused(&["read", "0", "6064"], &["there is no node 0", "1 to 127", "e.g. 4"]);
    refused(&["read", "128", "6064"], &["there is no node 128"]);
    refused(&["state", "four"], &["'four' is no node-ID"]);
    refused(&["nmt", "everybody", "start"], &["or the word all"]);
    refused(&["nmt", "4", "begin"], &["pre-operational"]);
}

#[test]
fn objects_and_values_are_checked() {
    refused(&["read", "4", "60644"], &["is no object", "position_actual_value"]);
    refused(&["read", "4", "6064:100"], &["sub-index", "00 to FF"]);
    refused(&["read", "4", "position_actual_vale"], &["did you mean position_actual_value?"]);
    refused(&["write", "4", "6040", "65536"], &["0 to 65535"]);
    refused(&["write", "4", "6040", "on"], &["expected a number"]);
    refused(&["write", "4", "6060", "profile_velocty"], &["did you mean profile velocity?"]);
    refused(&["write", "4", "60FF", "5A"], &["r/min"]);
    refused(&["write", "4", "5FFF", "1"], &["u16:15"]);
}

#[test]
fn quantities_are_checked() {
    refused(&["velocity", "4", "fast"], &["60rpm"]);
    refused(&["velocity", "4", "60deg"], &["60rpm"]);
    refused(&["move", "4", "1.5"], &["whole numbers"]);
    refused(&["move", "4", "90deg", "--profile-velocity", "0"], &["more than zero"]);
    refused(&["move", "4", "90deg", "--acceleration", "5"], &["no unit", "500ms"]);
    refused(&["torque", "4", "1000"], &["no unit", "1.5A"]);
    refused(&["home", "4"], &["--method"]);
    refused(&["--timeout", "2", "scan"], &["no unit", "500ms"]);
}

#[test]
fn what_is_beyond_the_drives_limits_is_refused_before_anything_moves() {
    refused(&["velocity", "4", "20000rpm"], &["out of range"]);
    refused(&["torque", "4", "31A"], &["out of range", "-30000 to 30000"]);
}

#[test]
fn buses_are_checked() {
    refused(&["--bus", "http://x", "scan"], &["socketcand://HOST:PORT/can0", "slcan://HOST:PORT"]);
    refused(&["--bus", "socketcand://localhost:99999/can0", "scan"], &["'99999' is no port"]);
    refused(&["--bus", "sim:/nowhere/machine.toml", "scan"], &["/nowhere/machine.toml", "[[drive]]"]);
    refused(&["--bus", "log:trace.log", "scan"], &["nobody there can answer", "dump"]);
}

#[test]
fn simulator_arguments_are_checked_before_anything_listens() {
    let serve = ["--serve", "socketcand://127.0.0.1:0"];
    let refused_sim = |drives: &[&str], parts: &[&str]| {
        let arguments: Vec<&str> = ["sim"].iter().chain(&serve).chain(drives).copied().collect();
        refused(&arguments, parts);
    };
    refused_sim(&[], &["--drive"]);
    refused_sim(&["--drive", "zlac8030@4"], &["did you mean zlac8030l?"]);
    refused_sim(&["--drive", "zlac8030l"], &["MODEL@NODE", "zlac8030l@4"]);
    refused_sim(&["--drive", "zlac8030l@0"], &["1 to 127"]);
    refused_sim(&["--drive", "zlac8030l@4", "--drive", "zlac8030l@4"], &["two drives at node 4"]);
    refused_sim(&["--drive", "zlac8030l@4", "--bitrate", "7k"], &["500k"]);
    refused_sim(&["--drive", "zlac8030l@4", "--serve", "tcp://127.0.0.1:1"], &["socketcand://HOST:PORT"]);
}

#[test]
fn models_and_shells_are_checked() {
    refused(&["objects", "zlac"], &["did you mean zlac8030l?"]);
    refused(&["completions", "csh"], &["bash", "fish", "zsh"]);
    refused(&["--model", "4", "scan"], &["NODE=MODEL", "4=zlac8030l"]);
}

/// Linux interfaces cannot be opened yet, so none of them is an example: `can0` is what a server calls its bus only.
#[test]
fn no_help_shows_a_bus_that_is_refused() {
    let commands = ferrodrive(&["--help"]).out;
    let commands = commands.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<String> = commands.filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names.iter().filter(|name| *name != "help") {
        let help = ferrodrive(&[name, "--help"]).out;
        let bare = help.split([' ', ',', '\n']).find(|word| word.trim_start_matches('v').starts_with("can0"));
        assert_eq!(bare, None, "ferrodrive {name} --help");
    }
    refused(&["--bus", "bus!", "scan"], &["expected sim, sim:FILE.toml, socketcand://"]);
    assert!(ferrodrive(&["--bus", "can0", "scan"]).err.contains("use socketcand://HOST:29536/can0"));
}

//! Wrong command lines end with status 2 and say what was wrong and what is expected.

use processes::{done, ferrodrive, scratch};

#[track_caller]
fn refused(arguments: &[&str], parts: &[&str]) {
    ended_with(2, arguments, parts);
}

/// A file that is missing or bad, and a value that a drive or a machine does not take.
#[track_caller]
fn not_taken(arguments: &[&str], parts: &[&str]) {
    ended_with(1, arguments, parts);
}

#[track_caller]
fn ended_with(status: i32, arguments: &[&str], parts: &[&str]) {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
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

/// By the sense of a word in other tools, not by its spelling.
#[test]
fn words_of_other_tools_are_answered_with_the_command_that_does_it() {
    refused(&["candump", "can0"], &["tip: ferrodrive dump"]);
    refused(&["sdo", "read", "4", "6064"], &["tip: ferrodrive read 4 6064"]);
    refused(&["--bus", "sim", "fault", "4"], &["tip: ferrodrive explain 4"]);
    refused(&["velocity", "4", "60", "rpm"], &["did you mean: ferrodrive velocity 4 60rpm"]);
    refused(&["sim", "zlac8030l@4"], &["did you mean: ferrodrive sim --drive zlac8030l@4"]);
    let traced = ferrodrive(&["trace"]).err;
    assert!(traced.contains("tip: ferrodrive dump") && !traced.contains("torque"), "{traced}");
    let json = ferrodrive(&["--json", "get", "4", "6064"]).json();
    assert!(json["error"]["next"].as_str().unwrap().starts_with("ferrodrive read 4 6064"), "{json}");
}

#[test]
fn nodes_are_checked() {
    refused(&["read", "0", "6064"], &["there is no node 0", "1 to 127", "e.g. 4"]);
    refused(&["read", "128", "6064"], &["there is no node 128"]);
    refused(&["state", "four"], &["'four' is not a node-ID"]);
    refused(&["nmt", "everybody", "start"], &["or the word all"]);
    refused(&["nmt", "4", "begin"], &["pre-operational"]);
}

#[test]
fn objects_and_values_are_checked() {
    refused(&["read", "4", "60644"], &["is not an object", "position_actual_value"]);
    refused(&["read", "4", "6064:100"], &["sub-index", "00 to FF"]);
    refused(&["read", "4", "position_actual_vale"], &["did you mean position_actual_value?"]);
    refused(&["read", "4", "zzzz"], &["no object named 'zzzz'", "ferrodrive objects 4 WORD"]);
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
    refused(&["move", "4", "90deg", "--profile-velocity", "0"], &["above 0"]);
    refused(&["move", "4", "90deg", "--acceleration", "5"], &["no unit", "500ms"]);
    refused(&["torque", "4", "1000"], &["no unit", "1.5A"]);
    refused(&["home", "4"], &["--method"]);
    refused(&["--timeout", "2", "scan"], &["no unit", "500ms"]);
}

#[test]
fn what_is_beyond_the_drives_limits_is_refused_before_anything_moves() {
    not_taken(&["velocity", "4", "20000rpm"], &["out of range"]);
    not_taken(&["torque", "4", "31A"], &["out of range", "-30000 to 30000"]);
}

#[test]
fn buses_are_checked() {
    refused(&["--bus", "http://x", "scan"], &["socketcand://HOST:PORT/can0", "slcan://HOST:PORT"]);
    refused(&["--bus", "socketcand://localhost:99999/can0", "scan"], &["'99999' is not a port"]);
    not_taken(&["--bus", "sim:/nowhere/machine.toml", "scan"], &["/nowhere/machine.toml", "[[drive]]"]);
    refused(&["--bus", "log:trace.log", "scan"], &["no node can answer", "dump"]);
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

/// An option that has no effect on a command is refused where it is typed, with the reason; nothing is ignored.
#[test]
fn options_that_mean_nothing_are_refused_with_the_reason() {
    let sim = ["sim", "--drive", "zlac8030l@4"];
    let with = |more: &[&'static str]| [&sim[..], more].concat();
    refused(&with(&["--model", "4=zlac8030l"]), &["--model has no effect on sim", "--drive MODEL@NODE"]);
    refused(&with(&["--timeout", "1s"]), &["--timeout has no effect on sim", "waits for no answer"]);
    refused(&["demo", "--bus", "slcan://127.0.0.1:1"], &["--bus has no effect on demo", "buses of their own"]);
    refused(&["dump", "--timeout", "1s"], &["--timeout has no effect on dump", "--for TIME"]);
    refused(&["completions", "bash", "--timeout", "1s"], &["--timeout has no effect on completions"]);
    refused(&["objects", "zlac8030l", "--model", "4=zlac8030l"], &["the same on every bus"]);
    refused(&["readings", "zlim42c", "--timeout", "1s"], &["about a model"]);
    let two = ["--model", "4=zlac8030l", "--model", "4=zlim42c", "scan"];
    refused(&two, &["two models for node 4: zlac8030l and zlim42c", "give one --model 4=MODEL"]);
}

#[test]
fn machine_files_are_checked() {
    let directory = scratch("machine-files");
    let file = directory.join("machine.toml");
    let path = file.to_str().unwrap();
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n").unwrap();
    refused(&["sim", "--machine", path, "--drive", "zlim42c@4"], &["two drives at node 4"]);
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nswitches = { X0 = [1, 2, 3] }\n").unwrap();
    let bus = format!("sim:{path}");
    for arguments in [&["--bus", &bus, "scan"][..], &["sim", "--machine", path], &["--machine", path, "scan"]] {
        not_taken(
            arguments,
            &[
                "machine.toml:4:19: 'X0' is a list of 3; expected two bounds, [low, high]",
                "  4 | switches = { X0 = [1, 2, 3] }",
            ],
        );
    }
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nfaults = ['gear']\n").unwrap();
    not_taken(&["sim", "--machine", path], &["machine.toml:4:11: 'fault gear on' cannot be done"]);
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nbattery = true\n").unwrap();
    not_taken(&["sim", "--machine", path], &["cannot use the machine file", "line 4, column 11", "has no battery"]);
    std::fs::write(&file, format!("# {}", "x".repeat(1 << 20))).unwrap();
    not_taken(&["--bus", &bus, "scan"], &["larger than the limit of 1 MB"]);
    #[cfg(unix)]
    {
        let pipe = directory.join("pipe.toml");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let pipe = pipe.to_str().unwrap();
        not_taken(&["sim", "--machine", pipe], &["not a regular file"]);
        not_taken(&["--bus", &format!("sim:{pipe}"), "scan"], &["not a regular file"]);
    }
}

/// A terminal obeys ESC (1Bh) and CSI (9Bh): ECMA-48, 5.3 and 5.4.
#[test]
fn control_characters_of_others_are_not_echoed() {
    let directory = scratch("escape");
    let file = directory.join("machine.toml");
    let texts = [
        "[[drive]]\nmodel = 'zlac\u{1b}[31m'\nnode = 4\n",
        "[[drive]]\nmodel = \"zlac\\u001b[31m\"\nnode = 4\n",
        "\u{9b}2J = 1\n",
        "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nfaults = [\"\\u001b[2J\"]\n",
    ];
    let bus = format!("sim:{}", file.display());
    let machine = file.to_str().unwrap();
    let mut ended: Vec<_> = [
        &["\u{1b}[31mreed"][..],
        &["read", "4", "\u{1b}[31m6064"],
        &["--bus", "\u{1b}]0;title\u{7}", "scan"],
        &["--bus", "sim:/\u{1b}[31m.toml", "scan"],
        &["write", "4", "6060", "\u{9b}31m"],
        &["sim", "--drive", "\u{1b}[31m@4"],
        &["velocity", "4", "\u{1b}[31m"],
    ]
    .map(ferrodrive)
    .into();
    for text in texts {
        std::fs::write(&file, text).unwrap();
        ended.push(ferrodrive(&["--bus", &bus, "scan"]));
        ended.push(ferrodrive(&["sim", "--machine", machine]));
    }
    for ended in ended {
        let said = [ended.out, ended.err].concat();
        assert!(matches!(ended.status, Some(1 | 2)), "{said:?}");
        assert!(!said.contains(|c: char| c.is_control() && c != '\n'), "{said:?}");
    }
}

#[test]
fn models_and_shells_are_checked() {
    refused(&["objects", "zlac"], &["did you mean zlac8030l?"]);
    refused(&["completions", "csh"], &["bash", "fish", "zsh"]);
    refused(&["--model", "4", "scan"], &["NODE=MODEL", "4=zlac8030l"]);
}

#[test]
fn a_bus_that_cannot_be_opened_says_what_to_do() {
    refused(&["--bus", "bus!", "scan"], &["expected sim, sim:FILE.toml, can0, socketcand://"]);
    let said = ferrodrive(&["--bus", "nocan9", "scan"]).err;
    assert!(said.contains("bus nocan9") && (said.contains("modprobe") || said.contains("ip link")), "{said}");
}

#[test]
fn departures_from_the_standard_are_listed_with_their_object_and_what_to_do() {
    let text = done(&["objects", "zlac8030l", "--departures"]).out;
    for part in [
        "6083h:00  ramps are times, not accelerations",
        "write the time that the change of speed is to take",
        "the manual counts PDOs from 0: RPDO1 is its RPDO0",
        "store with 2 to 2009h:00, restore with 1",
    ] {
        assert!(text.contains(part), "{part:?} in {text}");
    }
    let list = done(&["--json", "objects", "zlim42c", "--departures"]).json();
    let rows = list["departures"].as_array().unwrap();
    let homing = rows.iter().find(|row| row["departure"] == "homing_shown_by").unwrap();
    assert_eq!(homing["object"], "6041h:00");
    assert_eq!(homing["remedy"], "found: bit 8 on, 10 on, 14 off; not found: bit 8 off, 10 on, 14 off");
    // Of a node of the embedded bus: its model is known.
    let of_node = done(&["--json", "objects", "2", "--departures"]).json();
    assert_eq!((&of_node["model"], &of_node["departures"]), (&list["model"], &list["departures"]));
    assert_eq!(ferrodrive(&["objects", "zlac8030l", "speed", "--departures"]).status, Some(2));
}

#[test]
fn a_log_of_no_known_form_is_neither_written_nor_read() {
    let folder = scratch("no_known_form");
    let path = |name: &str| folder.join(name).display().to_string();
    std::fs::write(path("a.log"), "(0.000000) can0 704#05\n").unwrap();
    refused(&["convert", &path("a.log"), &path("b.xyz")], &["no form of log", ".xyz", ".log (candump)", ".blf (BLF)"]);
    assert!(!folder.join("b.xyz").exists());
    // MCAP begins with its name between two bytes that no text has.
    std::fs::write(path("run.mcap"), b"\x89MCAP0\r\n\x01\x26\0\0\0\0\0\0\0").unwrap();
    std::fs::write(path("random.bin"), [7, 0, 200, 0, 13, 10, 255, 1]).unwrap();
    for (name, what) in
        [("run.mcap", "this is an MCAP file, a record of signals"), ("random.bin", "its bytes are not text")]
    {
        let ended = ferrodrive(&["decode", &path(name)]);
        assert_ne!(ended.status, Some(0), "{name}");
        assert!(ended.out.is_empty() && ended.err.contains(what), "{name}: {} {}", ended.out, ended.err);
    }
}

#[test]
fn a_twist_beyond_the_limits_of_a_base_is_refused_with_the_most_that_there_is() {
    let base = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");
    not_taken(
        &["drive-base", base, "--linear", "30", "--for", "1s"],
        &[
            "30 m/s and 0 rad/s is beyond the limits of [base]: 0.8 m/s",
            "give 0.8 m/s and 0 rad/s",
            "raise the limits in [base]",
        ],
    );
}

#[test]
fn an_overlong_argument_is_not_repeated_as_a_whole() {
    let long = "x".repeat(10_000);
    let set = format!("a={long}");
    for arguments in [&["read", &long, "6064"][..], &[&long], &["--bus", &long, "scan"], &["run", &long, "--set", &set]]
    {
        let ended = ferrodrive(arguments);
        assert!(matches!(ended.status, Some(1 | 2)), "{:?}", ended.status);
        assert!(ended.err.len() < 2_000 && ended.err.contains("10000 characters"), "{}", &ended.err[..500]);
        let json = ferrodrive(&[&["--json"], arguments].concat());
        assert!(json.out.len() < 2_000, "{}", json.out.len());
    }
}

/// Editors and shells of Windows put a byte order mark before UTF-8.
#[test]
fn a_byte_order_mark_before_a_machine_file_and_a_log_is_passed_over() {
    let directory = scratch("byte_order_mark");
    let (machine, log) = (directory.join("machine.toml"), directory.join("trace.log"));
    std::fs::write(&machine, "\u{feff}[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n").unwrap();
    done(&["--bus", &format!("sim:{}", machine.display()), "state", "4"]);
    std::fs::write(&log, "\u{feff}(0.001) can0 000#0104\n(0.002) can0 080#\n").unwrap();
    let decoded = done(&["decode", log.to_str().unwrap()]);
    assert!(decoded.out.contains("NMT") && !decoded.err.contains("line 1"), "{}{}", decoded.out, decoded.err);
}

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
    has_a_remedy(status, &[&["--json"], arguments].concat());
}

/// Ends with `status`, and one line of JSON with a kind, and with what to do.
#[track_caller]
fn has_a_remedy(status: i32, arguments: &[&str]) -> String {
    let ended = ferrodrive(arguments);
    assert_eq!((ended.status, ended.err.as_str()), (Some(status), ""), "{arguments:?}: {}", ended.out);
    let error = ended.json()["error"].clone();
    let text = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
    assert!(!text("next").is_empty() && !text("message").is_empty(), "{arguments:?} without a remedy: {error}");
    assert_eq!(text("kind") == "usage", status == 2, "{arguments:?}: {error}");
    text("kind")
}

/// What a file, a bus or a drive shows, each with the kind of its error.
const NOT_DONE: &[(&str, &str)] = &[
    ("write 4 6064 5", "aborted"),
    ("write 9 6060 3", "no_answer"),
    ("write 4 6060 --from FOLDER/empty.bin", "bad_file"),
    ("read 4 5FFF", "aborted"),
    ("watch 9 6064", "no_answer"),
    ("record 4 6064 -o /no/such/a.csv", "file"),
    ("record 4 6064 -o FOLDER/foreign.csv", "file"),
    ("move 4 10mm", "no_feed"),
    ("velocity 4 0.5m/s", "no_feed"),
    ("torque 2 500mA", "no_such_mode"),
    ("velocity 4 20000rpm", "out_of_limits"),
    ("group move 4=90deg --mode hm", "group"),
    ("group move 4=1e9turn", "out_of_limits"),
    ("group move 4=90deg --velocity 99999rpm", "out_of_limits"),
    ("latency 9 --count 5", "no_answer"),
    ("eds lint FOLDER/bad.eds", "lint"),
    ("eds show FOLDER/bad.eds", "not_an_eds"),
    ("eds show zlac8030l zzzz", "failed"),
    ("eds diff FOLDER/bad.eds zlac8030l", "not_an_eds"),
    ("dcf 4 --eds FOLDER/bad.eds", "not_an_eds"),
    ("boot FOLDER/bad.eds", "not_an_eds"),
    ("boot FOLDER/device.eds", "bad_file"),
    ("convert FOLDER/bad.eds FOLDER/b.log", "no_log"),
    ("convert FOLDER/a.log /no/such/b.log", "file"),
    ("sim --drive zlac8030l@4 --state FOLDER/a.log", "failed"),
    ("sim --drive zlac8030l@4 --serve socketcand://192.0.2.1:1", "bus"),
    ("sim --drive m4230e17b50@1 --modbus 192.0.2.1:1", "bus"),
    ("sim --drive m4230e17b50@1 --modbus rtu:///no/such/tty?baud=115200", "bus"),
    ("sim --drive zlac8030l@4 --control /no/such/socket", "control"),
    ("sim --drive zlac8030l@4 --record /no/such/a.csv", "file"),
    ("sim --drive zlac8030l@4 --log /no/such/a.log", "file"),
    ("params backup 4 -o /no/such/x.toml", "file"),
    ("params plan 4 FOLDER/p.toml", "bad_parameters"),
    ("params diff FOLDER/p.toml FOLDER/p.toml", "bad_parameters"),
    ("params rollback 4 /no/such/journal", "no_journal"),
    ("params rollback 4 FOLDER/p.toml", "bad_journal"),
    ("plot FOLDER/foreign.csv", "record"),
    ("home 4 --method 17", "no_such_mode"),
    ("nmt 9 start --wait 1s", "not_reached"),
    ("--bus socketcand://127.0.0.1:1/can0 explain 4", "bus"),
    ("demo --drive zlim42c -o /no/such/a.svg", "file"),
    ("objects zlac8030l zzzz", "failed"),
    ("boot --node 99", "not_booted"),
    ("plan --mode hm", "failed"),
    ("plan --cycle 250us --mode pv", "bus_load"),
    ("world --control 127.0.0.1:1 now", "control"),
    ("run FOLDER/a.log", "bad_file"),
    ("export dbc 9", "no_answer"),
    ("replay FOLDER/moves.log", "motion"),
    ("studio --listen 192.0.2.1:1", "failed"),
    ("studio --listen 127.0.0.1:0 --password-file FOLDER/empty.bin", "bad_file"),
    ("studio --listen 127.0.0.1:0 --token-file FOLDER/empty.bin", "bad_file"),
    ("--bus nocan9 scan", "bus"),
];

/// What the words show by themselves; the tables below have more.
const NO_SENSE: &[&str] = &[
    "write 4 6040 65536",
    "write 4 5FFF 1",
    "watch 4 zzzz",
    "record 4 zzzz -o a.csv",
    "pdo plan 4",
    "pdo plan 4 tpdo1=zzzz",
    "pdo plan 4 tpdo1=1000",
    "pdo plan 4 tpdo9=statusword",
    "pdo plan 4 tpdo1=statusword tpdo1=off",
    "pdo plan 4 tpdo1=statusword tpdo2=off --id 0x185",
    "pdo plan 4 tpdo1=statusword --inhibit 100s",
    "pdo apply 4 tpdo1=zzzz",
    "torque 2 2",
    "group move 4=90deg 4=10deg",
    "group move 4=90deg --period 1s",
    "group move 4=90deg --rounding 0s",
    "group move a.toml b.toml 4=1deg",
    "latency --sync 0s",
    "eds",
    "eds zlac8030l foo",
    "eds zlac8030l foo=bar",
    "eds zlac8030l 2014=99999999",
    "eds show nope",
    "convert a.log b.xyz",
    "sim --drive zlac8030l@4,2014=99999999",
    "sim --drive zlac8030l@4,9999=1",
    "sim --drive zlac8030l@4 --serve tcp://x",
    "sim --drive zlac8030l@4 --record a.csv --record-signals zzz",
    "params backup 4 -o x.txt",
    "sync --count 3",
    "check",
    "check a.log",
    "boot a.log",
    "init",
    "gateway",
    "replay -",
    "studio --listen 0.0.0.0:0",
];

#[test]
fn every_wrong_input_has_a_kind_and_a_remedy() {
    let folder = scratch("remedies");
    for (name, text) in [
        ("empty.bin", ""),
        ("bad.eds", "no data sheet\n"),
        ("foreign.csv", "name,price\n"),
        ("a.log", "(0.000000) can0 704#05\n"),
        ("moves.log", "(0.000000) can0 000#0104\n"),
        ("p.toml", "[values]\nnope = 1\n"),
    ] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    done(&["eds", "zlac8030l", "-o", folder.join("device.eds").to_str().unwrap()]);
    let words = |line: &str| format!("--json {}", line.replace("FOLDER", folder.to_str().unwrap()));
    for (line, kind) in NOT_DONE {
        assert_eq!(has_a_remedy(1, &words(line).split(' ').collect::<Vec<_>>()), *kind, "{line}");
    }
    // It prints nothing, and so nothing as JSON.
    assert_eq!(ferrodrive(&["man-pages", folder.join("a.log").to_str().unwrap()]).status, Some(1));
    for line in NO_SENSE {
        has_a_remedy(2, &words(line).split(' ').collect::<Vec<_>>());
    }
}

#[test]
fn no_command_and_unknown_commands_are_refused() {
    refused(&[], &["Usage:"]);
    refused(&["reed", "4", "6064"], &["unrecognized subcommand", "read"]);
    refused(&["scan", "--jsn"], &["--json"]);
}

#[test]
fn help_has_a_help_of_its_own() {
    assert_eq!(done(&["help", "-h"]).out, done(&["-h"]).out);
    assert_eq!(done(&["help", "--help"]).out, done(&["--help"]).out);
    assert_eq!(done(&["params", "help", "-h"]).out, done(&["params", "-h"]).out);
    assert_eq!(done(&["help", "move", "-h"]).out, done(&["move", "-h"]).out);
    // An option of the commands of one command alone is described there.
    assert!(done(&["lss", "scan", "-h"]).out.contains("--within <TIME>"));
}

/// By the sense of a word in other tools, not by its spelling.
#[test]
fn words_of_other_tools_are_answered_with_the_command_that_does_it() {
    refused(&["candump", "can0"], &["tip: ferrodrive --bus can0 dump"]);
    refused(&["conformance", "5"], &["tip: ferrodrive conform 5"]);
    refused(&["cct", "5"], &["tip: ferrodrive conform 5"]);
    refused(&["get", "5", "2000"], &["tip: ferrodrive read 5 2000"]);
    refused(&["eds", "check", "my.eds"], &["tip: ferrodrive eds lint my.eds"]);
    refused(&["pdo", "5"], &["tip: ferrodrive pdo show 5"]);
    refused(&["params", "frob"], &["tip: params has: backup, diff, plan, apply, verify, rollback"]);
    refused(&["scan", "can0"], &["did you mean: ferrodrive --bus can0 scan"]);
    refused(&["home", "2", "17"], &["did you mean: ferrodrive home 2 --method 17"]);
    refused(&["init", "machine.toml"], &["did you mean: ferrodrive init -o machine.toml"]);
    let applied = "a backup is written back by: ferrodrive params apply 4 before.dcf";
    refused(&["restore", "4", "before.dcf"], &["loads factory settings", applied]);
    refused(&["restore", "before.dcf"], &["loads factory settings", applied]);
    refused(&["estop", "4"], &["`ferrodrive estop` stops every drive", "ferrodrive quick-stop 4"]);
    refused(&["sdo", "read", "4", "6064"], &["tip: ferrodrive read 4 6064"]);
    refused(&["--bus", "sim", "fault", "4"], &["tip: ferrodrive --bus sim explain 4"]);
    refused(&["velocity", "4", "60", "rpm"], &["did you mean: ferrodrive velocity 4 60rpm"]);
    refused(&["sim", "zlac8030l@4"], &["did you mean: ferrodrive sim --drive zlac8030l@4"]);
    refused(&["mode", "4", "3"], &["tip: ferrodrive state 4"]);
    refused(&["params", "diff", "wheel.toml", "5"], &["ferrodrive params diff 5 wheel.toml"]);
    refused(&["params", "diff", "4", "500"], &["1 to 127"]);
    refused(&["models"], &["tip: ferrodrive objects"]);
    refused(&["run", "a.toml", "--seeds", "20"], &["a range of seeds FIRST..LAST, e.g. 1..1000"]);
    refused(&["conform", "4", "--only", "NMT"], &["SDO, PDO, OD", "STATE, TRANS"]);
    refused(&["start", "4"], &["tip: ferrodrive nmt 4 start"]);
    refused(
        &["diff", "a.eds", "b.eds"],
        &["tip: ferrodrive params diff a.eds b.eds", "ferrodrive eds diff a.eds b.eds"],
    );
    refused(&["VELOCITY", "4", "60rpm"], &["did you mean: ferrodrive velocity 4 60rpm"]);
    let traced = ferrodrive(&["trace"]).err;
    assert!(traced.contains("tip: ferrodrive dump") && !traced.contains("torque"), "{traced}");
    let json = ferrodrive(&["--json", "get", "4", "6064"]).json();
    assert!(json["error"]["next"].as_str().unwrap().starts_with("ferrodrive --json read 4 6064"), "{json}");
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
    refused(&["read", "4", "-2"], &["'-2' is not an object"]);
    let unknown = ferrodrive(&["read", "4", "6064", "-x"]).err;
    assert!(unknown.contains("unexpected argument '-x'") && !unknown.contains("-- -x"), "{unknown}");
    refused(&["read", "4", "60644"], &["is not an object", "position_actual_value"]);
    refused(&["read", "4", "6064:100"], &["sub-index", "00 to FF"]);
    refused(&["read", "4", "position_actual_vale"], &["did you mean position_actual_value?"]);
    refused(&["read", "4", "zzzz"], &["no object named 'zzzz'", "ferrodrive objects 4 WORD"]);
    refused(&["write", "4", "6040", "65536"], &["0 to 65535"]);
    refused(&["write", "4", "6040", "99999999999999999999"], &["99999999999999999999 does not fit 6040h:00"]);
    refused(&["write", "4", "6040", "on"], &["expected a number"]);
    refused(&["write", "4", "6060", "profile_velocty"], &["did you mean profile velocity?"]);
    refused(&["write", "4", "60FF", "5A"], &["r/min"]);
    refused(&["write", "4", "5FFF", "1"], &["u16:15"]);
    let frame = "no '#' between identifier and data; expected a frame such as 604#4041600000000000,";
    refused(&["send", "123"], &[frame]);
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
    refused(&["sync", "--counter", "0"], &["expected 2 to 240, got 0"]);
    refused(&["sync", "--count", "-2"], &["expected 1 or more, got -2"]);
    refused(&["home", "4", "--method", "first"], &["expected a whole number, -128 to 127, got 'first'"]);
    refused(&["run", "a.toml", "--jobs", "0"], &["expected 1 to 1024, got 0"]);
    refused(&["--timeout", "2", "scan"], &["no unit", "500ms"]);
    for (line, part) in [
        ("velocity 4 60rpm --for -1s", "a time is between 0 and a year"),
        ("move 4 90deg --acceleration -5s", "a ramp has no sign"),
        ("scan --timeout -5ms", "a time is between 0 and a year"),
        ("explain 4 --watch -1s", "a time is between 0 and a year"),
        ("move 4 90deg --profile-velocity -60rpm", "expected a profile velocity above 0"),
        ("scan --timeout 1ns", "no node answers in less than 1ms"),
        ("write 4 6040 0xZZ", "expected a number"),
    ] {
        refused(&line.split(' ').collect::<Vec<_>>(), &[part]);
    }
    for words in ["velocity 4 60rpm", "torque 4 1A", "record 4 6064 -o a.csv", "dump", "drive-base --linear 0.1"] {
        let words: Vec<_> = words.split(' ').chain(["--for", "0s"]).collect();
        refused(&words, &["expected a time above 0"]);
    }
}

#[test]
fn what_is_beyond_the_drives_limits_is_refused_before_anything_moves() {
    not_taken(&["velocity", "4", "20000rpm"], &["out of range"]);
    not_taken(&["move", "4", "1e300deg"], &["a value of more than 64 bits is out of range"]);
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
    let models = done(&["--json", "objects"]).json();
    let names: Vec<_> =
        models["models"].as_array().unwrap().iter().map(|model| model["name"].as_str().unwrap()).collect();
    for name in ["zlac8030l", "m8025e25b80", "zlim42c", "cia402", "io401"] {
        assert!(names.contains(&name) && done(&["objects"]).out.contains(name), "{names:?}");
    }
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
    refused(
        &["convert", &path("a.log"), &path("b.xyz")],
        &[".xyz is not a log format", ".log (candump)", ".blf (BLF)"],
    );
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

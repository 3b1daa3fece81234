//! What every command prints with `--json` is as docs/json.schema.json says, and docs/json.md names it.

use std::f64::consts::TAU;

use processes::{Ended, Simulator, ferrodrive, page, scratch};
use serde_json::{Value, json};

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/homing_stuck_switch.toml");

const BASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/base.toml");

/// Each command line, and the definition that each line of it is an instance of.
const COMMANDS: &[(&[&str], &str)] = &[
    (&["scan"], "scan"),
    (&["read", "4", "6064"], "value"),
    (&["read", "4", "1018:01"], "value"),
    (&["write", "4", "6060", "3"], "value"),
    (&["state", "1"], "state"),
    (&["explain", "4"], "explain"),
    (&["explain", "1", "--watch", "100ms"], "explain"),
    (&["explain", "9", "--watch", "100ms"], "explain"),
    (&["conform", "4"], "conform"),
    (&["conform", "1", "--only", "SDO,402"], "conform"),
    (&["conform", "--list"], "conform_list"),
    (&["conform", "4", "--only", "XYZ"], "failure"),
    (&["enable", "4"], "state"),
    (&["disable", "2"], "state"),
    (&["stop", "4"], "state"),
    (&["quick-stop", "4"], "state"),
    (&["estop"], "stop_all"),
    (&["quick-stop", "all"], "stop_all"),
    (&["stop", "all"], "stop_all"),
    (&["reset", "4"], "state"),
    (&["state", "all"], "states"),
    (&["reset", "all"], "states"),
    (&["velocity", "4", "60rpm", "--for", "200ms"], "motion"),
    (&["move", "4", "90deg"], "motion"),
    (&["torque", "4", "500mA"], "motion"),
    (&["nmt", "4", "start"], "nmt"),
    (&["nmt", "all", "reset"], "nmt"),
    (&["nmt", "2", "reset"], "nmt"),
    (&["nmt", "1", "start", "--wait"], "nmt"),
    (&["nmt", "all", "reset", "--wait", "2s"], "nmt"),
    (&["nmt", "4", "start", "--wait", "1s"], "failure"),
    (&["lss", "scan"], "failure"),
    (&["watch", "4", "6064", "statusword", "1018:01", "--count", "2"], "watch"),
    (&["read", "4", "1018:*", "1000..100A"], "value"),
    (&["read", "4", "9000..9FFF"], "failure"),
    (&["capture", "1", "velocity"], "failure"),
    (&["test-motion", "4", "steps", "--time", "1s"], "test_motion"),
    (&["test-motion", "4", "sine", "--by", "5deg", "--periods", "1"], "test_motion"),
    (&["tune", "4", "--loop", "position", "--apply"], "tune"),
    (&["tune", "2", "--load-inertia", "3e-5", "--apply"], "tune_ramps"),
    (&["tune", "2", "--margin", "0.5"], "failure"),
    (&["tune", "4", "--period", "50us"], "failure"),
    (&["pdo", "show", "1", "4"], "pdo_show"),
    (&["pdo", "plan", "4", "tpdo1=statusword,6064", "--type", "1"], "pdo_plan"),
    (&["pdo", "apply", "4", "tpdo1=statusword,6064", "--type", "1"], "params_apply"),
    (&["pdo", "plan", "4"], "failure"),
    (&["emcy", "show", "4"], "failure"),
    (&["sync", "--every", "10ms", "--count", "3"], "sync"),
    (&["time"], "time"),
    (&["send", "604#4041600000000000", "123#R"], "send"),
    (&["save", "4"], "store"),
    (&["restore", "2"], "store"),
    (&["objects", "zlac8030l"], "objects"),
    (&["objects", "4", "6081"], "objects"),
    (&["objects", "zlim42c", "--departures"], "departures"),
    (&["objects"], "models"),
    (&["readings", "m4230e17b50"], "readings"),
    (&["eds", "zlac8030l"], "eds"),
    (&["eds", "lint", "--list"], "eds_rules"),
    (&["dcf", "4"], "dcf"),
    (&["init", "--drive", "zlac8030l@4"], "init"),
    (&["init", "--bus", "sim"], "init"),
    (&["init"], "failure"),
    (&["params", "backup", "4"], "params_backup"),
    (&["params", "rollback", "4"], "failure"),
    (&["params", "apply", "4", "/no/such/file.toml"], "failure"),
    (&["latency", "4", "--count", "20"], "latency"),
    (&["group", "move", "1=10deg", "4=10deg"], "group_move"),
    (&["group", "move", "1=10deg", "--within", "1ms"], "failure"),
    (&["drive-base", BASE, "--linear", "0.2", "--for", "500ms"], "drive_base"),
    (&["drive-base"], "failure"),
    (&["boot"], "boot"),
    (&["boot", "--node", "9"], "boot"),
    (&["supervise", "--for", "2s"], "supervise"),
    (&["plan", "--mode", "4=pv"], "plan"),
    (&["plan", "--mode", "pv", "--cycle", "250us"], "plan"),
    (&["dump", "--for", "1s"], "frame"),
    (&["export", "dbc", "4"], "export"),
    (&["gateway"], "failure"),
    (&["studio", "--listen", "0.0.0.0:0"], "failure"),
    (&["run", SCENARIO], "run"),
    (&["run", SCENARIO, "--seeds", "1..2"], "sweep"),
    (&["run", SCENARIO, SCENARIO], "scenarios"),
    (&["run", SCENARIO, "/no/such/file.toml"], "scenarios"),
    (&["read", "9", "6064"], "failure"),
    (&["write", "4", "6064", "5"], "failure"),
    (&["home", "4", "--method", "17"], "failure"),
    (&["eds", "show", "/no/such/file.eds"], "failure"),
    (&["eds", "lint", "/no/such/file.eds"], "eds_lint"),
    (&["check", concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/machine.toml")], "check"),
    (&["check", "/no/such/bus.yml"], "failure"),
    (&["world", "now"], "failure"),
    (&["fly"], "failure"),
];

fn schema() -> Value {
    serde_json::from_str(&page("json.schema.json")).expect("the schema is JSON")
}

/// Holds lines of output to a definition, and what they say of success to the exit status.
#[track_caller]
fn hold(ended: &Ended, definition: &str, what: &str) -> Vec<Value> {
    let mut schema = schema();
    schema["anyOf"] = json!([{ "$ref": format!("#/$defs/{definition}") }]);
    let validator = jsonschema::validator_for(&schema).expect("the schema is one");
    assert!(!ended.out.is_empty(), "{what} prints nothing: {}", ended.err);
    let lines = ended.out.lines().map(|line| {
        let value: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{what}: {error} in {line}"));
        if let Some(error) = validator.iter_errors(&value).next() {
            panic!("{what}: {error} at {} in {line}", error.instance_path());
        }
        assert!(line.starts_with("{\"ok\":"), "{what}: {line}");
        assert_eq!(value["ok"] == true, ended.status == Some(0), "{what}: {:?} {line}", ended.status);
        value
    });
    lines.collect()
}

#[test]
fn each_command_prints_what_the_schema_says() {
    for (arguments, definition) in COMMANDS {
        let ended = ferrodrive(&[arguments, &["--json"][..]].concat());
        hold(&ended, definition, &format!("{arguments:?}"));
    }
}

#[test]
fn a_report_about_a_node_prints_what_the_schema_says() {
    let folder = scratch("schema-report");
    let page = &*folder.path("report.html");
    hold(&ferrodrive(&["report", "4", "-o", page, "--by", "somebody", "--json"]), "report", "report");
}

#[test]
fn a_failure_says_what_to_do_next() {
    let nowhere = ["--record", "/no/such/folder/a.csv"];
    for arguments in [
        &["plot", "/no/such/record.csv"][..],
        &["plot", "/no/such/record.txt"],
        &["plot", "/no/such/record.csv", "--from", "3", "--to", "2"],
        &["run", SCENARIO, nowhere[0], nowhere[1]],
        &["run", SCENARIO, nowhere[0], nowhere[1], "--record-signals", "speed_of_light"],
        &["run", SCENARIO, nowhere[0], "a.txt"],
        &["run", SCENARIO, "--junit", "/no/such/folder/a.xml"],
        &["run", SCENARIO, "--seeds", "1..2", nowhere[0], nowhere[1]],
        &["run", "/no/such/file.toml"],
        &["sim", "--drive", "zlac8030l@4", nowhere[0], nowhere[1]],
        &["sim", "--drive", "zlac8030l@4", "--log", "/no/such/folder/a.log"],
        &["events", "--control", "127.0.0.1:1", "--kind", "falt"],
        &["world", "now"],
    ] {
        let ended = ferrodrive(&[arguments, &["--json"]].concat());
        let [failure] = hold(&ended, "failure", &format!("{arguments:?}")).try_into().expect("one line");
        assert!(failure["error"]["next"].as_str().is_some_and(|next| !next.is_empty()), "{arguments:?}: {failure}");
    }
}

/// A record of another instrument: an inertia of 1/50 kg m² per (N m/A), excited by a current of many frequencies.
fn excited() -> String {
    let (mut text, mut speed, mut angle) = ("t_s,4.current_a,4.position_deg\n".to_owned(), 0.0_f64, 0.0);
    for row in 0..8000 {
        let time_s = f64::from(row) * 1e-3;
        // Phases by the square of the number keep the peak low.
        let tone = |tone: u32| (TAU * f64::from(tone) * time_s + f64::from(tone * tone)).sin();
        let current: f64 = (1..=60).map(tone).sum::<f64>() * 0.3;
        text += &format!("{time_s:.3},{current:.6},{angle:.6}\n");
        let rate = 50.0 * current - 2.0 * speed;
        angle += (1e-3 * (speed + 0.5e-3 * rate)).to_degrees();
        speed += 1e-3 * rate;
    }
    text
}

#[test]
fn files_and_logs_are_reported_in_the_same_form() {
    let directory = scratch("schema");
    let path = |name: &str| directory.join(name).to_str().expect("UTF-8").to_owned();
    let (sheet, log, odd) = (path("a.eds"), path("a.log"), path("odd.log"));
    let (blf, csv, values) = (path("a.blf"), path("a.csv"), path("a.toml"));
    std::fs::write(&values, "[values]\n1017 = 200\n6040 = 6\n").unwrap();
    let made = ferrodrive(&["eds", "zlac8030l", "--json"]).json()["eds"].as_str().expect("a text").to_owned();
    std::fs::write(&sheet, made).unwrap();
    // A heartbeat that is too slow is a warning, a bad node-ID an error.
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/machine.toml");
    let sim = format!("sim:{example}");
    let bus = path("bus.yml");
    let text = "master: {node_id: 127, heartbeat_producer: 100}\nwheel: {node_id: 4, dcf: a.eds, heartbeat_producer: 1000}\nx: {node_id: 0}\n";
    std::fs::write(&bus, text).unwrap();
    let captured = path("captured.csv");
    std::fs::write(&captured, excited()).unwrap();
    for (arguments, definition) in [
        (&["eds", "lint", &sheet][..], "eds_lint"),
        (&["check", &bus], "check"),
        (&["--bus", &sim, "check", example], "check"),
        (&["params", "diff", "4", &values], "params_diff"),
        (&["params", "plan", "4", &values], "params_plan"),
        (&["params", "verify", "4", &values], "params_verify"),
        (&["params", "apply", "4", &values, "--save", "--prove"], "params_apply"),
        (&["eds", "show", &sheet], "eds_show"),
        (&["eds", "diff", &sheet, "zlim42c"], "eds_diff"),
        (&["dump", "--for", "1s", "--log", &log], "frame"),
        (&["decode", &log], "frame"),
        (&["convert", &log, &blf], "convert"),
        (&["replay", &log, "--skip-motion"], "replay"),
        (&["record", "4", "606C", "--out", &csv, "--for", "100ms"], "record"),
        (&["capture", "4", "velocity", "--for", "50ms", "-o", &csv], "capture"),
        (&["tune", "4", "--capture", &captured], "tune_capture"),
        (&["tune", "4", "--capture", &captured, "--torque-constant", "0.5"], "tune_capture"),
        (&["tune", "5", "--capture", &captured], "failure"),
    ] {
        hold(&ferrodrive(&[arguments, &["--json"]].concat()), definition, &format!("{arguments:?}"));
    }
    for words in [&["eds", "zlac8030l", "-o"][..], &["export", "dbc", "4", "-o"]] {
        let path = path(if words[0] == "eds" { "b.eds" } else { "b.dbc" });
        hold(&ferrodrive(&[words, &[&path, "--json"]].concat()), words[0], &format!("{words:?}"));
    }
    for words in [&["plot", &csv][..], &["latency", "4", "--count", "20"]] {
        hold(&ferrodrive(&[words, &["-o", "-", "--json"]].concat()), words[0], &format!("{words:?}"));
    }
    let unread = path("unread.log");
    std::fs::write(&unread, "no frame\n").unwrap();
    let ended = ferrodrive(&["decode", &unread, "--json"]);
    let last = ended.out.trim_end().rsplit('\n').next().unwrap().to_owned();
    hold(&Ended { status: ended.status, out: last, err: String::new() }, "failure", "an error behind lines");
    let frames = std::fs::read_to_string(&log).unwrap();
    std::fs::write(&odd, format!("{frames}no frame\n")).unwrap();
    let bus = format!("log:{odd}");
    let ended = ferrodrive(&["--bus", &bus, "dump", "--json"]);
    let (reported, last) = ended.out.trim_end().rsplit_once('\n').unwrap();
    let (frames, skipped) = reported.rsplit_once('\n').unwrap();
    for (out, definition) in [(frames, "frame"), (skipped, "log_line"), (last, "log_summary")] {
        let part = Ended { status: ended.status, out: out.to_owned(), err: String::new() };
        hold(&part, definition, definition);
    }
}

#[test]
fn the_commands_of_a_running_simulator_print_the_same_form() {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--control", "127.0.0.1:0"]);
    let place = simulator.address("control");
    for (words, definition) in [
        (&["4", "get"][..], "world"),
        (&["now"], "world"),
        (&["help"], "world"),
        (&["4", "supply", "30"], "world"),
        (&["4", "battery", "off"], "failure"),
        (&["4", "dance"], "failure"),
    ] {
        let ended = ferrodrive(&[&["--json", "world", "--control", &place], words].concat());
        hold(&ended, definition, &format!("{words:?}"));
    }
}

#[test]
fn the_page_names_every_command_and_shows_a_failure() {
    let page = page("json.md");
    for (arguments, _) in COMMANDS.iter().filter(|(arguments, _)| arguments[0] != "fly") {
        assert!(page.contains(&format!("`{}", arguments[0])), "docs/json.md does not name {}", arguments[0]);
    }
    let printed = page.lines().find(|line| line.starts_with("{\"ok\":false")).expect("an example");
    let example = Ended { status: Some(1), out: printed.to_owned(), err: String::new() };
    hold(&example, "failure", "the example of the page");
}

/// The kinds of errors in the sources: `of_kind("..")`, `_KIND: &str = ".."`, `kind: ".."`, `new("..", ` of control errors, and the words of `fn kind`.
fn kinds_in(text: &str) -> Vec<String> {
    let word = |rest: &str| {
        let (word, _) = rest.split_once('"')?;
        (!word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c == '_')).then(|| word.to_owned())
    };
    let behind = |mark: &str| text.split(mark).skip(1).filter_map(word).collect::<Vec<_>>();
    let mut kinds = [
        behind("of_kind(\""),
        behind("_KIND: &str = \""),
        behind(" kind: \""),
        behind("\"kind\":\""),
        behind("Self::new(\""),
        behind("ControlError::new(\""),
    ]
    .concat();
    for body in text.split("fn kind(&self) -> &'static str {").skip(1) {
        let body = body.split("\n    }\n").next().unwrap_or_default();
        kinds.extend(body.split("=> \"").skip(1).filter_map(word));
    }
    kinds
}

/// Where a kind is not that of an error: of events, notes of a bus, bodies, and marks in a picture.
const KINDS_OF_OTHERS: [&str; 5] = [
    "master/src/supervise/event.rs",
    "transport/src/note/mod.rs",
    "sim/src/coupling.rs",
    "sim/src/world/bodies.rs",
    "recording/src/trail.rs",
];

fn sources(folder: &std::path::Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        if entry.is_dir() {
            sources(&entry, found);
        } else if KINDS_OF_OTHERS.iter().any(|other| entry.ends_with(other)) {
            // They have lists of their own.
        } else if entry.extension().is_some_and(|ending| ending == "rs") && !entry.ends_with("tests.rs") {
            let text = std::fs::read_to_string(&entry).expect("UTF-8");
            found.push(text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_owned());
        }
    }
}

#[test]
fn the_page_lists_every_kind_of_the_code_and_no_other() {
    let crates = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates");
    let mut texts = Vec::new();
    for one in std::fs::read_dir(&crates).expect("crates") {
        let folder = one.expect("an entry").path().join("src");
        if folder.is_dir() {
            sources(&folder, &mut texts);
        }
    }
    let mut of_code: Vec<String> = texts.iter().flat_map(|text| kinds_in(text)).collect();
    of_code.sort();
    of_code.dedup();
    assert!(of_code.len() > 50, "{of_code:?}");
    let page = page("json.md");
    let table = page.split_once("| `kind` | means |").expect("the table").1;
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let cells = rows.filter_map(|row| row.split('|').nth(1));
    let mut of_page: Vec<String> =
        cells.flat_map(|cell| cell.split(',').map(|kind| kind.trim().trim_matches('`').to_owned())).collect();
    of_page.sort();
    assert_eq!(of_page, of_code, "docs/json.md, left, and the sources");
}

//! The library as a page calls it, natively and in virtual time.

mod serial;

use std::path::Path;
use std::time::Duration;

use can::Instant;
use scenario::{Runner, Scenario};
use serde_json::{Value, json};
use web::{HostedWorld, Library, Request, Stored};

const MACHINE: &str = include_str!("../../machine.toml");
const WHEEL: &str = "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n";

/// A page that numbers its messages.
struct Page {
    world: HostedWorld,
    seq: u64,
}

impl Page {
    fn on(machine: &str) -> Self {
        let mut world = HostedWorld::open(machine, Duration::ZERO).expect("a machine");
        let sent = world.take_sent();
        let welcome: Value = serde_json::from_str(&sent[0]).expect("JSON");
        assert_eq!((&welcome["type"], &welcome["word"]), (&json!("welcome"), &json!("page")));
        Self { world, seq: 0 }
    }

    fn say(&mut self, mut command: Value) -> u64 {
        self.seq += 1;
        command["seq"] = self.seq.into();
        command["session"] = "page".into();
        self.world.say(&command.to_string());
        self.seq
    }

    /// Asks, and holds what moves until the answer has come.
    fn ask(&mut self, command: Value) -> Value {
        let seq = self.say(command);
        for _ in 0..100 {
            self.run(100);
            let sent =
                self.world.take_sent().into_iter().map(|line| serde_json::from_str::<Value>(&line).expect("JSON"));
            if let Some(answer) = sent.into_iter().find(|message| message["type"] == "answer" && message["seq"] == seq)
            {
                return answer;
            }
            self.say(json!({ "do": "alive" }));
        }
        panic!("no answer within 10 s");
    }

    fn must(&mut self, command: Value) -> Value {
        let answer = self.ask(command);
        assert_eq!(answer["ok"], true, "{answer}");
        answer
    }

    fn run(&mut self, ms: u64) {
        self.world.run_until(self.world.now() + Duration::from_millis(ms));
    }

    /// The true speed of a shaft, in r/min.
    fn speed(&mut self, node: u8) -> f64 {
        self.around(node)["velocity_rpm"].as_f64().expect("a speed")
    }

    /// What is true of a drive.
    fn around(&mut self, node: u8) -> Value {
        serde_json::from_str(&self.world.command(&format!("{node} get")).expect("a drive")).expect("JSON")
    }

    fn get(&self, path: &str) -> (u16, Value) {
        let answer = self.world.request(&Request { path: path.into() }, &[]);
        (answer.status, serde_json::from_slice(&answer.body).expect("JSON"))
    }
}

#[test]
fn the_machine_that_a_page_begins_with_is_found_and_each_of_its_drives_moves() {
    let mut page = Page::on(MACHINE);
    let (_, state) = page.get("/api/state");
    let nodes: Vec<_> = state["nodes"].as_array().expect("nodes").iter().map(|node| node["node"].clone()).collect();
    assert_eq!(nodes, [1, 2, 4, 5]);
    page.must(json!({ "do": "take_control" }));
    page.must(json!({ "do": "accept_unguarded", "node": 2 }));
    for node in [1, 2, 4, 5] {
        page.must(json!({ "do": "velocity", "node": node, "rpm": 30 }));
    }
    page.run(500);
    for node in [1, 2, 4, 5] {
        let speed = page.speed(node);
        assert!((speed.abs() - 30.0).abs() < 3.0, "node {node} turns at {speed} r/min");
    }
    // The joint lifts what the file says, behind its motor; the stepper's table closes the switch at its end.
    assert_eq!(page.around(1)["load_torque_nm"], 0.3);
    assert!(page.around(1)["current_a"].as_f64().is_some_and(|current| current > 0.05), "{}", page.around(1));
    assert_eq!(page.around(2)["inputs"]["X1"], 0);
    for _ in 0..100 {
        page.run(100);
        page.say(json!({ "do": "alive" }));
    }
    let stepper = page.around(2);
    assert_eq!((&stepper["inputs"]["X0"], &stepper["inputs"]["X1"]), (&json!(0), &json!(1)), "{stepper}");
    assert!(stepper["position"].as_i64().is_some_and(|counts| counts >= 8000), "{stepper}");
}

/// What a drive stores is handed out before the drive acknowledges it, and is there in the next world.
#[test]
fn what_a_drive_has_stored_is_there_when_it_is_put_back() {
    let read = json!({ "do": "read_objects", "node": 4, "objects": ["2013:01"] });
    let open = |stored: &[Stored], is_kept| {
        HostedWorld::open_with(WHEEL, Duration::ZERO, stored, is_kept).map(|(world, why)| (Page { world, seq: 0 }, why))
    };
    let (mut page, _) = open(&[], true).expect("a machine");
    let factory = page.must(read.clone())["result"]["values"].clone();
    page.must(json!({ "do": "take_control" }));
    assert_eq!(page.world.take_stores(), []);
    // The drive stores this object with the write: the answer to that waits.
    let write = json!({ "do": "write_parameters", "node": 4, "values": [{ "object": "2013:01", "value": "850" }] });
    let seq = page.say(write);
    let answer = |page: &mut Page| {
        page.run(100);
        let sent = page.world.take_sent();
        sent.iter().map(|line| serde_json::from_str::<Value>(line).expect("JSON")).find(|message| message["seq"] == seq)
    };
    assert_eq!(answer(&mut page), None, "it is not kept yet");
    let images = page.world.take_stores();
    let [image] = &images[..] else { panic!("one store, got {images:?}") };
    page.world.confirm_store(image.number, image.generation);
    assert_eq!(answer(&mut page).expect("an answer")["ok"], true);
    let changed = page.must(read.clone())["result"]["values"].clone();
    assert_ne!(changed, factory);
    let stored = Stored { number: image.number, model: image.model.to_owned(), image: image.bytes.clone() };
    let (mut again, unusable) = open(std::slice::from_ref(&stored), true).expect("a machine");
    assert_eq!((again.must(read.clone())["result"]["values"].clone(), unusable), (changed, vec![]));
    assert_eq!(again.world.take_stores(), [], "what was put back is kept");
    for bad in [
        Stored { model: "zlim42c".into(), ..stored.clone() },
        Stored { image: vec![1], ..stored.clone() },
        Stored { image: vec![], ..stored },
    ] {
        let (mut page, unusable) = open(&[bad], true).expect("a machine");
        assert!(
            unusable.len() == 1 && unusable[0].starts_with("what drive 4 has stored cannot be used"),
            "{unusable:?}"
        );
        assert_eq!(page.must(read.clone())["result"]["values"], factory);
    }
}

#[test]
fn what_a_page_moves_stops_when_it_falls_silent_and_when_it_joins_anew() {
    for silent in [true, false] {
        let mut page = Page::on(WHEEL);
        page.must(json!({ "do": "take_control" }));
        page.must(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
        assert!((page.speed(4) - 60.0).abs() < 3.0);
        if !silent {
            page.world.join();
        }
        // The presence span, and the ramp.
        page.run(if silent { 3000 + 1000 } else { 1000 });
        assert!(page.speed(4).abs() < 2.0, "silent: {silent}");
    }
}

#[test]
fn requests_are_answered_as_by_the_studio() {
    let mut page = Page::on(WHEEL);
    page.run(500);
    let (status, table) = page.get("/api/power-states");
    assert_eq!((status, table["states"].as_array().map(Vec::len)), (200, Some(8)), "CiA 402-2, 8.2 has eight states");
    let (status, trace) = page.get("/api/trace?count=3&node=4");
    assert_eq!((status, trace["lines"].as_array().map(Vec::len)), (200, Some(3)));
    let (status, identifiers) = page.get("/api/trace/identifiers?node=4");
    let of_pdo = identifiers["identifiers"].as_array().and_then(|all| all.iter().find(|one| one["id"] == "704"));
    assert_eq!((status, of_pdo.map(|one| one["last"]["kind"] == "heartbeat")), (200, Some(true)), "{identifiers}");
    let log = page.world.request(&Request { path: "/api/trace.log?node=4".into() }, &[]);
    let log = String::from_utf8(log.body).expect("text");
    assert!(log.lines().count() > 10 && log.starts_with('(') && log.contains(" can0 "), "{log}");
    for (path, status, kind) in [
        ("/api/trace?count=many", 400, "malformed"),
        ("/api/trace?nodes=4", 400, "malformed"),
        ("/api/series?objects=4", 400, "malformed"),
        ("/api/parameters.toml?node=0", 400, "malformed"),
        ("/api/recording.mcap", 501, "not_here"),
        ("/api/recording?name=x.csv", 501, "not_here"),
        ("/api/recording/identified?name=x.csv", 501, "not_here"),
        ("/api/trace/load?name=x.log", 501, "not_here"),
        ("/api/trace.asc", 501, "not_here"),
        ("/api/trace.blf", 501, "not_here"),
        ("/api/trace.pcapng", 501, "not_here"),
        ("/api/nothing", 404, "not_found"),
    ] {
        let (got, body) = page.get(path);
        assert_eq!((got, body["error"]["kind"].as_str()), (status, Some(kind)), "{path}: {body}");
    }
}

/// What a script of the page requests is answered or said not to be here: nothing is unknown.
#[test]
fn whatever_the_page_requests_is_known() {
    let page = Page::on(WHEEL);
    let scripts = concat!(env!("CARGO_MANIFEST_DIR"), "/../studio/page");
    let mut paths = std::collections::BTreeSet::new();
    for script in std::fs::read_dir(scripts).expect("the page").flatten().map(|entry| entry.path()) {
        let Ok(text) = std::fs::read_to_string(&script) else { continue };
        for part in text.split("/api/").skip(1) {
            let end = part.find(|char: char| !(char.is_ascii_alphanumeric() || "-./".contains(char)));
            let (path, rest) = part.split_at(end.unwrap_or(part.len()));
            // `/api/trace.${ending}` is one of several, which the table above has.
            if !rest.starts_with('$') && !path.is_empty() {
                paths.insert(path.to_owned());
            }
        }
    }
    // The page of a studio with a password.
    paths.remove("login");
    assert!(paths.len() > 8, "{paths:?}");
    for path in paths {
        let answer = page.world.request(&Request { path: format!("/api/{path}") }, &[]);
        assert_ne!(answer.status, 404, "{path}");
    }
}

fn call(library: &mut Library, head: &str, body: &str) -> (Value, String) {
    let answer = library.call(format!("{head}\n{body}").as_bytes());
    let text = String::from_utf8(answer).expect("text");
    let (head, body) = text.split_once('\n').expect("a line, and a body");
    (serde_json::from_str(head).expect("JSON"), body.to_owned())
}

#[test]
fn a_scenario_is_the_run_that_it_is_elsewhere() {
    let text = include_str!("../data/emergency_stop.toml");
    let scenario = Scenario::parse(text, Path::new("")).expect("a scenario");
    let native = Runner::new(&scenario, None).expect("its machine").run();
    let (head, _) = call(&mut Library::default(), r#"{"call":"scenario"}"#, text);
    assert_eq!(head["outcome"]["ok"], true);
    assert_eq!(head["outcome"]["digest"], format!("{:016x}", native.digest));
}

#[test]
fn a_data_sheet_that_is_handed_in_becomes_a_node() {
    let mut library = Library::default();
    let machine = "[[drive]]\nmodel = \"mine.eds\"\nnode = 9\n";
    let (refused, _) = call(&mut library, r#"{"call":"open"}"#, machine);
    assert_eq!(refused["error"]["kind"], "bad_file");
    let sheet = include_str!("../data/io401.eds");
    assert_eq!(call(&mut library, r#"{"call":"give","name":"mine.eds"}"#, sheet).0["ok"], true);
    assert_eq!(call(&mut library, r#"{"call":"open"}"#, machine).0["ok"], true);
    let (_, state) = call(&mut library, r#"{"call":"request","path":"/api/state"}"#, "");
    let state: Value = serde_json::from_str(&state).expect("JSON");
    assert_eq!(state["nodes"][0]["node"], 9, "{state}");
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_changed() {
    let mut library = Library::default();
    for (head, body, kind, says) in [
        ("", "", "malformed", "EOF"),
        ("{}", "", "malformed", "call"),
        (r#"{"call":"fly"}"#, "", "malformed", "fly"),
        (r#"{"call":"run","to_ns":1}"#, "", "no_world", "open one first"),
        (r#"{"call":"open"}"#, "[[drive]]\nmodel = 'zlac9'\nnode = 4\n", "bad_file", "line 2"),
        (r#"{"call":"scenario"}"#, "title = 1", "bad_file", "line 1"),
    ] {
        let (answer, _) = call(&mut library, head, body);
        assert_eq!(answer["error"]["kind"], kind, "{head}: {answer}");
        assert!(answer["error"]["message"].as_str().is_some_and(|text| text.contains(says)), "{head}: {answer}");
    }
    call(&mut library, r#"{"call":"open"}"#, WHEEL);
    for (line, kind) in [("4 fly", "usage"), ("7 get", "no_such_node"), ("run 1s", "usage")] {
        let (answer, _) = call(&mut library, r#"{"call":"world"}"#, line);
        assert_eq!(answer["error"]["kind"], kind, "{line}: {answer}");
    }
    let mut page = Page::on(WHEEL);
    let answer = page.ask(json!({ "do": "velocity", "node": 4, "rpm": 60 }));
    assert_eq!(answer["error"]["kind"], "not_in_control");
}

/// The clock of a page goes by fits and starts.
#[test]
fn how_time_is_cut_into_pieces_changes_nothing() {
    let run = |pieces: &[u64]| {
        let mut page = Page::on(WHEEL);
        let mut end = page.world.now();
        for piece in pieces {
            end += Duration::from_millis(*piece);
            page.world.run_until(end);
        }
        assert_eq!(page.world.now(), end);
        page.world.digest()
    };
    assert_eq!(run(&[1000]), run(&[1, 19, 480, 7, 493]));
    assert_ne!(run(&[1000]), run(&[1001]));
    assert!(Page::on(WHEEL).world.now() > Instant::from_millis(1000));
}

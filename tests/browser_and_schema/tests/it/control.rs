//! `ferrodrive sim --control`, over TCP and a Unix socket: several clients, slow ones, strange ones, and the two commands.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};

use processes::{PATIENCE, Simulator, command, done, ferrodrive, page, scratch};
use serde_json::{Value, json};

const DRIVE: [&str; 4] = ["--drive", "zlac8030l@4", "--control", "127.0.0.1:0"];

/// A client that holds every line that it gets to the schema.
struct Client {
    reader: BufReader<Box<dyn Read>>,
    writer: Box<dyn Write>,
    schema: jsonschema::Validator,
}

fn schema() -> Value {
    serde_json::from_str(&page("control.schema.json")).expect("the schema is JSON")
}

impl Client {
    fn connect(simulator: &Simulator) -> Self {
        let stream = stream(simulator);
        Self::over(stream.try_clone().unwrap(), stream)
    }

    fn over(reader: impl Read + 'static, writer: impl Write + 'static) -> Self {
        let schema = jsonschema::validator_for(&schema()).expect("the schema is one");
        Self { reader: BufReader::new(Box::new(reader)), writer: Box::new(writer), schema }
    }

    fn send(&mut self, line: &str) {
        self.writer.write_all(format!("{line}\n").as_bytes()).expect("it listens");
    }

    /// The next line; `None` when the connection is closed.
    fn next(&mut self) -> Option<Value> {
        let mut line = String::new();
        if self.reader.read_line(&mut line).expect("a line in time") == 0 {
            return None;
        }
        let value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"));
        assert!(self.schema.is_valid(&value), "not as the schema says: {line}");
        Some(value)
    }

    /// The answer to a request; news that come before it are kept apart.
    fn ask(&mut self, request: &Value) -> (Value, Vec<Value>) {
        self.send(&request.to_string());
        let mut news = Vec::new();
        loop {
            let line = self.next().expect("an answer");
            if line.get("ok").is_some() {
                return (line, news);
            }
            news.push(line);
        }
    }
}

fn stream(simulator: &Simulator) -> TcpStream {
    let stream = TcpStream::connect(simulator.address("control")).expect("it listens");
    // The watchdog's.
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

#[test]
fn requests_of_several_clients_are_answered_each_with_its_mark() {
    let mut simulator = Simulator::start(&DRIVE);
    let (mut one, mut two) = (Client::connect(&simulator), Client::connect(&simulator));
    let (hello, _) = one.ask(&json!({ "id": 1, "request": "hello", "name": "one" }));
    assert_eq!((&hello["id"], &hello["protocol"]), (&json!(1), &json!(1)));
    assert_eq!(two.ask(&json!({ "request": "subscribe", "events": { "kinds": ["stimulus"] } })).0["subscription"], 1);
    assert_eq!(one.ask(&json!({ "id": 2, "request": "world", "line": "4 supply 30" })).0["id"], 2);
    let event = two.next().unwrap();
    assert_eq!((&event["event"]["words"], &event["event"]["by"]), (&json!("supply 30"), &json!("one")));
    assert_eq!(simulator.ask("4 supply 31")["ok"], true);
    assert_eq!(two.next().unwrap()["event"]["by"], "standard input");
    assert_eq!(one.ask(&json!({ "request": "world", "line": "4 fly" })).0["error"]["kind"], "usage");
    assert_eq!(one.ask(&json!({ "request": "run", "for": "1ms" })).0["error"]["kind"], "clock");
    assert_eq!(simulator.ask("quit")["ok"], true);
    assert_eq!(simulator.wait(), Some(0));
}

#[cfg(unix)]
#[test]
fn a_unix_socket_serves_the_same_is_private_and_goes_with_the_simulator() {
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::net::UnixStream;

    let directory = scratch("control");
    let path = directory.join("bench.sock");
    let place = path.to_str().unwrap();
    let arguments = ["--drive", "zlac8030l@4", "--control", place];
    let mut simulator = Simulator::start(&arguments);
    assert!(simulator.ready.contains(&format!("control+unix://{place}")), "{}", simulator.ready);
    assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    let stream = UnixStream::connect(&path).unwrap();
    // The watchdog's.
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut client = Client::over(stream.try_clone().unwrap(), stream);
    assert_eq!(client.ask(&json!({ "id": 1, "request": "get", "node": 4 })).0["model"], "zlac8030l");
    assert_eq!(done(&["--json", "world", "--control", place, "4", "supply", "30"]).json()["ok"], true);
    // A second simulator does not take the place of the first.
    let refused = ferrodrive(&[&["sim"], &arguments[..]].concat());
    assert_eq!(refused.status, Some(1), "{}", refused.err);
    simulator.ask("quit");
    simulator.wait();
    assert!(!path.exists());
    // A socket left by a killed one is replaced; another kind of file is left alone.
    let mut killed = Simulator::start(&arguments);
    killed.kill();
    assert!(path.exists());
    drop(Simulator::start(&arguments));
    std::fs::remove_file(&path).unwrap();
    std::fs::write(&path, "precious").unwrap();
    assert_eq!(ferrodrive(&[&["sim"], &arguments[..]].concat()).status, Some(1));
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
}

#[test]
fn garbage_endless_lines_and_half_lines_do_no_harm() {
    let mut simulator = Simulator::start(&DRIVE);
    let mut client = Client::connect(&simulator);
    client.send("\u{1b}[2J{{{{");
    assert_eq!(client.next().unwrap()["error"]["kind"], "usage");
    client.send(&format!("{{{}", "[".repeat(30_000)));
    assert_eq!(client.next().unwrap()["error"]["kind"], "syntax");
    client.send(&"x".repeat(1 << 20));
    assert_eq!(client.next().unwrap()["error"]["kind"], "too_long");
    assert_eq!(client.ask(&json!({ "id": 5, "request": "now" })).0["id"], 5);
    // Cut short in the middle of a line: nothing of it is done. Cut behind one: it is answered.
    let mut cut = stream(&simulator);
    cut.write_all(b"4 supply 33\n4 supply 3").unwrap();
    cut.shutdown(Shutdown::Write).unwrap();
    let mut text = String::new();
    cut.read_to_string(&mut text).unwrap();
    assert_eq!(text.lines().count(), 1, "{text}");
    // The supply comes to its new voltage.
    std::thread::sleep(std::time::Duration::from_millis(50));
    let volts = simulator.ask("4 get")["supply_v"].as_f64().unwrap();
    assert!((volts - 33.0).abs() < 10.0, "{volts}");
}

#[test]
fn a_hundred_clients_are_served_at_once() {
    let simulator = Simulator::start(&DRIVE);
    let mut clients: Vec<Client> = (0..100).map(|_| Client::connect(&simulator)).collect();
    for client in &mut clients {
        client.send(r#"{"id":0,"request":"subscribe","events":{"kinds":["cable"]}}"#);
    }
    for client in &mut clients {
        assert_eq!(client.next().unwrap()["ok"], true);
    }
    clients[0].send("4 cable cut");
    for client in clients.iter_mut().skip(1) {
        assert_eq!(client.next().unwrap()["event"]["cut"], true);
    }
}

#[test]
fn beyond_this_machine_a_token_is_asked_for() {
    let place = ["--drive", "zlac8030l@4", "--control", "0.0.0.0:0"];
    let simulator = Simulator::start_heard(&place);
    let said = simulator.error("token");
    let token = said.split_whitespace().find(|word| word.len() == 32).expect("a token of 128 bits").to_owned();
    let port = simulator.address("control").rsplit_once(':').unwrap().1.to_owned();
    let address = format!("127.0.0.1:{port}");
    let world = |token: &[&str]| ferrodrive(&[&["--json", "world", "--control", &address], token, &["now"]].concat());
    let strange = world(&[]);
    assert_eq!((strange.status, &strange.json()["error"]["kind"]), (Some(1), &json!("token")));
    assert_eq!(world(&["--control-token", "00000000000000000000000000000000"]).status, Some(1));
    assert_eq!(world(&["--control-token", &token]).status, Some(0));
    let simulator = Simulator::start(&[&DRIVE[..], &["--control-token", "secret"]].concat());
    let stream = TcpStream::connect(simulator.address("control")).unwrap();
    // The watchdog's.
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut client = Client::over(stream.try_clone().unwrap(), stream);
    (0..3).for_each(|_| client.send("4 power cut"));
    (0..3).for_each(|_| assert_eq!(client.next().unwrap()["error"]["kind"], "token"));
    assert_eq!(client.next(), None);
}

#[test]
fn the_two_commands_speak_to_people_and_to_programs() {
    let simulator = Simulator::start(&DRIVE);
    let place = simulator.address("control");
    let mut events = command(&["events", "--control", &place, "--node", "4", "--kind", "stimulus", "--count", "2"])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut json = command(&["--json", "events", "--control", &place, "--kind", "stimulus", "--count", "1"])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // Until both listen their first event may be an earlier one than that of the test.
    while events.try_wait().unwrap().is_none() || json.try_wait().unwrap().is_none() {
        let answer = done(&["--json", "world", "--control", &place, "4", "load", "torque", "-2.5"]).json();
        assert_eq!(answer["ok"], true);
    }
    let mut text = String::new();
    events.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    assert!(text.lines().count() == 2 && text.contains(") node 4: load torque -2.5 (by ferrodrive "), "{text}");
    let mut text = String::new();
    json.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    let event: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&event["kind"], &event["words"]), (&json!("stimulus"), &json!("load torque -2.5")));
    assert!(done(&["world", "--control", &place, "4", "get"]).out.contains("model: zlac8030l"));
    for (arguments, status, kind) in [
        (&["world", "now"][..], 2, "usage"),
        (&["world", "--control", "127.0.0.1:1", "now"], 1, "control"),
        (&["world", "--control", "nowhere", "now"], 2, "usage"),
        (&["world", "--control", &place, "9", "get"], 1, "no_such_node"),
        (&["world", "--control", &place, "4", "supply"], 2, "usage"),
        (&["world", "--control", &place, "4", "battery", "off"], 1, "refused"),
        (&["world", "--control", &place, "quit"], 2, "usage"),
        (&["world", "--control", &place], 2, "usage"),
        (&["events", "--control", &place, "--kind", "falt"], 2, "usage"),
        (&["events", "--control", &place, "--node", "0"], 2, "usage"),
        (&["events", "--control", &place, "--count", "0"], 2, "usage"),
    ] {
        let ended = ferrodrive(&[arguments, &["--json"]].concat());
        assert_eq!((ended.status, &ended.json()["error"]["kind"]), (Some(status), &json!(kind)), "{arguments:?}");
    }
}

#[test]
fn with_the_clock_moved_by_hand_samples_are_exact_and_a_run_is_answered_when_it_is_over() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--clock", "manual"]].concat());
    let mut client = Client::connect(&simulator);
    let values = json!({ "request": "subscribe", "values": [{ "node": 4, "signals": ["supply_v"] }], "every": "3ms" });
    client.ask(&values);
    let (answer, news) = client.ask(&json!({ "id": "r", "request": "run", "for": "20ms" }));
    assert_eq!((&answer["id"], &answer["t"]), (&json!("r"), &json!(0.02)));
    let times: Vec<&Value> = news.iter().map(|line| &line["sample"]["t"]).collect();
    assert_eq!(times, [0.0, 0.003, 0.006, 0.009, 0.012, 0.015, 0.018].map(Value::from).iter().collect::<Vec<_>>());
    let (answer, news) = client.ask(&json!({ "request": "run", "until": "25ms" }));
    assert_eq!((&answer["t"], news.len()), (&json!(0.025), 2));
    client.send("run 5ms");
    client.send("now");
    // Two samples, the answer to the run, and that to `now`: at the end of the run or, as it need not wait, before.
    let lines: Vec<Value> = (0..4).filter_map(|_| client.next()).collect();
    assert_eq!(lines.iter().filter(|line| line.get("sample").is_some()).count(), 2, "{lines:?}");
    assert_eq!(lines.iter().filter(|line| line.get("frames").is_some()).count(), 1, "{lines:?}");
}

#[test]
fn a_client_that_does_not_read_learns_what_it_missed_and_holds_up_nobody() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--clock", "manual"]].concat());
    let (mut deaf, mut other) = (Client::connect(&simulator), Client::connect(&simulator));
    let signals = ["position_counts", "velocity_rpm", "current_a", "supply_v", "motor_c", "driver_c"];
    deaf.ask(&json!({ "request": "subscribe", "values": [{ "node": 4, "signals": signals }], "every": "100us" }));
    // 100,000 samples of some 200 bytes: more than any socket takes.
    let (answer, _) = other.ask(&json!({ "request": "run", "for": "10s" }));
    assert_eq!(answer["t"], 10.0);
    let mut dropped = 0;
    let mut seen = 0;
    loop {
        let line = deaf.next().expect("a line");
        dropped += line["dropped"]["values"].as_u64().unwrap_or(0);
        seen += u64::from(line.get("sample").is_some());
        if line["sample"]["t_ns"] == 10_000_000_000_u64 {
            break;
        }
    }
    assert!(dropped > 0);
    assert_eq!(seen + dropped, 100_001);
}

#[test]
fn the_requests_of_the_page_are_as_the_schema_says() {
    let mut schema = schema();
    let fields = schema.as_object_mut().unwrap();
    fields.remove("oneOf");
    fields.insert("$ref".to_owned(), json!("#/$defs/request"));
    let schema = jsonschema::validator_for(&schema).unwrap();
    // What a running simulator lists is what there is.
    let simulator = Simulator::start(&DRIVE);
    let (help, _) = Client::connect(&simulator).ask(&json!({ "request": "help" }));
    let listed = |key: &str| help[key].as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned());
    let forms: Vec<String> = listed("help").collect();
    assert!(!forms.is_empty() && listed("kinds").next().is_some(), "{help}");
    for request in forms.iter().flat_map(|line| line.split(" or ")) {
        let request = request.split(", with").next().unwrap();
        let value: Value = serde_json::from_str(request).unwrap_or_else(|error| panic!("{error} in {request}"));
        assert!(schema.is_valid(&value), "{request}");
    }
    assert!(!schema.is_valid(&json!({ "request": "fly" })));
    let page = page("control.md");
    for kind in listed("kinds") {
        assert!(page.contains(&format!("`{kind}`")), "docs/control.md does not name {kind}");
    }
    for line in page.lines().filter_map(|line| line.strip_prefix("> ")) {
        let value: Value = serde_json::from_str(line).unwrap();
        assert!(schema.is_valid(&value), "{line}");
    }
}

//! What a live bus says beside frames: seen through a server of socketcand that reports the errors on its bus.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::process::Stdio;

use processes::{command, ferrodrive, page};
use serde_json::{Value, json};

/// A server of socketcand that says `messages` to the first client, and keeps the connection until the client goes.
fn server(messages: &'static [&'static str]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let bus = format!("socketcand://{}/can0", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut client, _) = listener.accept().unwrap();
        client.set_nodelay(true).unwrap();
        let mut bytes = [0; 64];
        client.write_all(b"< hi >").unwrap();
        for _request in ["open", "rawmode"] {
            let _ = client.read(&mut bytes);
            client.write_all(b"< ok >").unwrap();
        }
        for message in messages {
            client.write_all(message.as_bytes()).unwrap();
        }
        while client.read(&mut bytes).is_ok_and(|read| read > 0) {}
    });
    bus
}

/// The first `count` lines that `dump` prints.
fn dumped(bus: &str, arguments: &[&str], count: usize) -> Vec<String> {
    let mut dump = command(&[&["--bus", bus, "dump"], arguments].concat());
    let mut dump = dump.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(dump.stdout.take().unwrap()).lines().take(count).map(Result::unwrap).collect();
    dump.kill().unwrap();
    dump.wait().unwrap();
    lines
}

/// Classes: `linux/can/error.h`, as socketcand sends them.
const TROUBLE: &[&str] =
    &["< error 020 1.000001 >", "< frame 704 1.000002 05 >", "< error 040 1.000003 >", "< error 100 1.000004 >"];

#[test]
fn dump_shows_each_note_among_the_frames() {
    let lines = dumped(&server(TROUBLE), &[], 4);
    for (line, part) in lines.iter().zip(["was not acknowledged", "704#05", "bus-off", "takes part again"]) {
        assert!(line.contains(part), "{part} in {lines:#?}");
    }
    assert_eq!(lines.len(), 4);
}

#[test]
fn a_note_is_a_line_of_json_with_its_kind() {
    let schema: Value = serde_json::from_str(&page("json.schema.json")).unwrap();
    let mut of_note = schema.clone();
    of_note["$ref"] = json!("#/$defs/bus_note");
    of_note.as_object_mut().unwrap().remove("oneOf");
    of_note.as_object_mut().unwrap().remove("anyOf");
    let validator = jsonschema::validator_for(&of_note).unwrap();
    let lines = dumped(&server(TROUBLE), &["--json"], 4);
    let values: Vec<Value> = lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
    let kinds: Vec<&Value> = values.iter().map(|value| &value["note"]).collect();
    assert_eq!(kinds, [&json!("error_frame"), &Value::Null, &json!("bus_off"), &json!("restarted")]);
    for value in values.iter().filter(|value| !value["note"].is_null()) {
        validator.validate(value).unwrap_or_else(|error| panic!("{error} in {value}"));
    }
}

#[test]
fn a_failure_names_what_the_bus_said_to_programs_too() {
    let bus = server(&["< error 020 1.000001 >", "< error 040 1.000002 >"]);
    let ended = ferrodrive(&["--bus", &bus, "--timeout", "300ms", "--json", "read", "4", "1000"]);
    let report: Value = serde_json::from_str(&ended.out).unwrap();
    let message = report["error"]["message"].as_str().unwrap();
    assert!(message.contains("did not answer") && message.contains("bus-off"), "{message}");
    assert_eq!(ended.err, "");
}

//! The control connection without sockets: requests, answers and subscriptions, exact in virtual time.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

use can::Instant;
use host::control::{Class, Control, MAX_LINE_LENGTH, Outcome, PROTOCOL, ReadLine, Sink};
use machine::file::Machine;
use serde_json::{Value, json};
use sim::World;
use sim::command::{Run, Service};

#[derive(Clone, Debug, Default)]
struct Inbox(Rc<RefCell<VecDeque<(Class, String)>>>);

impl Sink for Inbox {
    fn put(&mut self, class: Class, line: String) {
        self.0.borrow_mut().push_back((class, line));
    }
}

impl Inbox {
    fn all(&self) -> Vec<(Class, Value)> {
        let lines = std::mem::take(&mut *self.0.borrow_mut());
        lines.into_iter().map(|(class, line)| (class, serde_json::from_str(&line).expect("JSON"))).collect()
    }

    /// The only line.
    #[track_caller]
    fn only(&self) -> Value {
        let mut all = self.all();
        assert_eq!(all.len(), 1, "{all:?}");
        all.remove(0).1
    }
}

struct Bench {
    world: World,
    control: Control<Inbox>,
}

impl Bench {
    fn new(token: Option<&str>) -> Self {
        let machine = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n[[drive]]\nmodel = 'zlim42c'\nnode = 2";
        let mut world = Machine::parse(machine).unwrap().build().unwrap();
        world.add_probe();
        world.run_until(Instant::from_secs(1));
        Self { world, control: Control::new(token.map(str::to_owned)) }
    }

    fn join(&mut self, number: u64) -> Inbox {
        let inbox = Inbox::default();
        self.control.join(number, inbox.clone());
        inbox
    }

    fn say(&mut self, number: u64, line: &str) -> Outcome {
        self.control.handle(number, &ReadLine::Text(line.to_owned()), &mut self.world, Service::default())
    }

    #[track_caller]
    fn ask(&mut self, number: u64, inbox: &Inbox, request: &Value) -> Value {
        self.say(number, &request.to_string());
        let answers = inbox.all().into_iter().filter(|(class, _)| *class == Class::Answer);
        let answers: Vec<Value> = answers.map(|(_, answer)| answer).collect();
        assert_eq!(answers.len(), 1, "{request} was answered {answers:?}");
        answers[0].clone()
    }

    /// As the owner of the clock does it: no further than the next sample.
    fn run_for(&mut self, duration: Duration) {
        let end = self.world.now() + duration;
        while self.world.now() < end {
            let target = self.control.next_sample().map_or(end, |due| due.min(end));
            self.world.run_until(target);
            self.control.publish(&mut self.world);
        }
    }
}

#[test]
fn each_request_is_answered_once_with_its_own_mark() {
    let mut bench = Bench::new(None);
    let inbox = bench.join(1);
    let hello = bench.ask(1, &inbox, &json!({ "id": 1, "request": "hello", "name": "bench" }));
    assert_eq!((&hello["id"], &hello["protocol"]), (&json!(1), &json!(PROTOCOL)));
    assert_eq!(hello["nodes"], json!([{ "node": 4, "model": "zlac8030l" }, { "node": 2, "model": "zlim42c" }]));
    let now = bench.ask(1, &inbox, &json!({ "id": "now", "request": "now" }));
    assert_eq!((&now["id"], &now["ok"], &now["t"]), (&json!("now"), &json!(true), &json!(1.0)));
    let got = bench.ask(1, &inbox, &json!({ "id": 3, "request": "get", "node": 4 }));
    assert_eq!((&got["id"], &got["model"]), (&json!(3), &json!("zlac8030l")));
    for request in [
        json!({ "request": "world", "line": "4 supply 30" }),
        json!({ "request": "world", "node": 4, "command": ["supply", 31.5] }),
        json!({ "request": "world", "node": 4, "axis": 1, "command": ["supply", 32, "limit", 10] }),
    ] {
        let done = bench.ask(1, &inbox, &request);
        assert_eq!(done, json!({ "id": null, "ok": true, "t": 1.0 }), "{request}");
    }
    // A line as on standard input; a blank one and a comment have no answer.
    bench.say(1, "4 get");
    assert_eq!(inbox.only()["node"], 4);
    bench.say(1, "");
    bench.say(1, "# 4 get");
    assert!(inbox.all().is_empty());
    let help = bench.ask(1, &inbox, &json!({ "request": "help" }));
    assert!(help["kinds"].as_array().unwrap().contains(&json!("fault")), "{help}");
}

#[test]
fn what_makes_no_sense_is_refused_with_a_kind_and_changes_nothing() {
    let mut bench = Bench::new(None);
    let inbox = bench.join(1);
    let digest = bench.world.digest();
    for (line, kind) in [
        ("{", "syntax"),
        (r#"{"request":"now"} {"request":"now"}"#, "syntax"),
        (r#"{"id":1}"#, "usage"),
        (r#"{"request":5}"#, "usage"),
        (r#"{"request":"nwo"}"#, "usage"),
        (r#"{"request":"now","at":5}"#, "usage"),
        (r#"{"id":[1],"request":"now"}"#, "usage"),
        (r#"{"id":1.5,"request":"now"}"#, "usage"),
        (r#"{"request":"get","node":0}"#, "usage"),
        (r#"{"request":"get","node":300}"#, "usage"),
        (r#"{"request":"get","node":9}"#, "no_such_node"),
        (r#"{"request":"get","node":4,"axis":2}"#, "refused"),
        (r#"{"request":"world"}"#, "usage"),
        (r#"{"request":"world","line":"4 supply 30","node":4}"#, "usage"),
        (r#"{"request":"world","line":"4 supply\n2 supply 30"}"#, "usage"),
        (r#"{"request":"world","line":"quit"}"#, "usage"),
        (r#"{"request":"world","line":"9 supply 30"}"#, "no_such_node"),
        (r#"{"request":"world","line":"4 battery off"}"#, "refused"),
        (r#"{"request":"world","node":4,"command":[]}"#, "usage"),
        (r#"{"request":"world","node":4,"command":[["supply"]]}"#, "usage"),
        (r#"{"request":"run"}"#, "usage"),
        (r#"{"request":"run","for":"-1s"}"#, "usage"),
        (r#"{"request":"run","for":"until 5s"}"#, "usage"),
        ("run fast", "usage"),
        (r#"{"request":"run","for":"1e99s"}"#, "usage"),
        (r#"{"request":"subscribe"}"#, "usage"),
        (r#"{"request":"subscribe","events":{"kinds":["bot"]}}"#, "usage"),
        (r#"{"request":"subscribe","values":[],"every":"1ms"}"#, "usage"),
        (r#"{"request":"subscribe","values":[{"node":4,"signals":["velocity"]}],"every":"1ms"}"#, "usage"),
        (r#"{"request":"subscribe","values":[{"node":4,"signals":["supply_v"]}],"every":"1us"}"#, "usage"),
        (r#"{"request":"subscribe","values":[{"node":4,"signals":["supply_v"]}]}"#, "usage"),
        (r#"{"request":"subscribe","values":[{"node":9,"signals":["supply_v"]}],"every":"1ms"}"#, "no_such_node"),
        (r#"{"request":"subscribe","values":[{"node":4,"axis":9,"signals":["supply_v"]}],"every":"1ms"}"#, "refused"),
        (r#"{"request":"unsubscribe","subscription":1}"#, "usage"),
        ("5 supply", "usage"),
        ("body base slope 5", "no_such_body"),
        ("hello", "usage"),
    ] {
        bench.say(1, line);
        let answer = inbox.only();
        assert_eq!((&answer["ok"], &answer["error"]["kind"]), (&json!(false), &json!(kind)), "{line}: {answer}");
        assert!(!answer["error"]["message"].as_str().unwrap().is_empty());
        // What was asked of a drive or a body is answered by naming those there are, or what this one takes.
        if !["no_such_node", "no_such_body", "refused"].contains(&kind) {
            assert!(answer["error"]["next"].is_string(), "{line}: {answer} does not say what to do");
        }
    }
    bench.control.handle(1, &ReadLine::TooLong, &mut bench.world, Service::default());
    let long = inbox.only();
    assert!(long["error"]["kind"] == "too_long" && long["error"]["next"].is_string(), "{long}");
    bench.say(1, &format!(r#"{{"request":"world","line":"{}"}}"#, "x".repeat(MAX_LINE_LENGTH - 100)));
    let long = inbox.only();
    assert!(long["error"]["kind"] == "too_long" && long["error"]["next"].is_string(), "{long}");
    assert_eq!(bench.world.digest(), digest);
    // What a browser begins with ends the connection, before the lines that a page chose.
    let text = ReadLine::Text("POST / HTTP/1.1".into());
    let outcome = bench.control.handle(1, &text, &mut bench.world, Service::default());
    let refused = inbox.only();
    assert!(matches!(outcome, Outcome::Close) && refused["error"]["kind"] == "usage", "{refused}");
    assert!(refused["error"]["next"].is_string(), "{refused}");
    let deep = "[".repeat(50_000);
    bench.say(1, &format!(r#"{{"id":7,"request":"world","command":{deep}"#));
    assert_eq!(inbox.only()["error"]["kind"], "syntax");
}

#[test]
fn values_come_at_their_rate_to_the_nanosecond() {
    let mut bench = Bench::new(None);
    let inbox = bench.join(1);
    let request = json!({ "request": "subscribe", "every": "7ms",
        "values": [{ "node": 4, "signals": ["velocity_rpm", "statusword"] }, { "node": 2, "signals": ["motor_c"] }] });
    bench.say(1, &request.to_string());
    let first = inbox.all();
    assert_eq!(first[0].1, json!({ "id": null, "ok": true, "subscription": 1 }));
    // The first at once, then one each 7 ms: at 1.0 s, 1.007 s, .. 1.994 s, that is 143 in the first second.
    bench.run_for(Duration::from_secs(1));
    let samples: Vec<Value> = first.into_iter().skip(1).chain(inbox.all()).map(|(_, sample)| sample).collect();
    let times: Vec<u64> = samples.iter().map(|sample| sample["sample"]["t_ns"].as_u64().unwrap()).collect();
    let expected: Vec<u64> = (0..143).map(|n| 1_000_000_000 + n * 7_000_000).collect();
    assert_eq!(times, expected);
    // Node 2 has no such sensor.
    let values = &samples[5]["sample"]["values"];
    assert_eq!((&values["4"]["velocity_rpm"], &values["2"]["motor_c"]), (&json!(0.0), &Value::Null));
    assert!(values["4"]["statusword"].is_u64(), "{values}");
    bench.ask(1, &inbox, &json!({ "request": "unsubscribe", "subscription": 1 }));
    bench.run_for(Duration::from_secs(1));
    assert!(inbox.all().is_empty());
    assert_eq!(bench.control.next_sample(), None);
}

#[test]
fn subscriptions_do_not_change_the_run() {
    let digest = |subscribed: bool| {
        let mut bench = Bench::new(None);
        let _inbox = bench.join(1);
        if subscribed {
            let values = json!({ "request": "subscribe", "every": "300us",
                "values": [{ "node": 4, "signals": ["velocity_rpm"] }, { "node": 2, "signals": ["position_counts"] }] });
            bench.say(1, &values.to_string());
            bench.say(1, r#"{"request":"subscribe","events":{}}"#);
        }
        bench.run_for(Duration::from_micros(10_300));
        bench.say(1, "4 supply 90");
        bench.run_for(Duration::from_millis(500));
        bench.world.digest()
    };
    assert_eq!(digest(true), digest(false));
}

#[test]
fn of_two_clients_that_contradict_the_last_wins_and_both_hear_who_did_what() {
    let mut bench = Bench::new(None);
    let (one, two) = (bench.join(1), bench.join(2));
    bench.ask(1, &one, &json!({ "request": "hello", "name": "left hand" }));
    for (number, inbox) in [(1, &one), (2, &two)] {
        let events = json!({ "request": "subscribe", "events": { "nodes": [4], "kinds": ["stimulus"] } });
        assert_eq!(bench.ask(number, inbox, &events)["subscription"], 1);
    }
    bench.say(1, "4 supply 30");
    bench.say(2, "4 supply 40");
    bench.say(2, "2 supply 24");
    for inbox in [one, two] {
        let events = inbox.all().into_iter().filter(|(class, _)| *class == Class::Event);
        let stimuli: Vec<_> =
            events.map(|(_, line)| (line["event"]["words"].clone(), line["event"]["by"].clone())).collect();
        assert_eq!(
            stimuli,
            [(json!("supply 30"), json!("left hand")), (json!("supply 40"), json!("control client 2"))]
        );
    }
    bench.run_for(Duration::from_secs(1));
    assert!((bench.world.report(4).unwrap().supply_v - 40.0).abs() < 0.1);
}

#[test]
fn without_the_token_nothing_is_done_and_the_third_try_is_the_last() {
    let mut bench = Bench::new(Some("secret"));
    let inbox = bench.join(1);
    for line in ["4 power cut", r#"{"request":"hello"}"#] {
        assert_eq!(bench.say(1, line), Outcome::Answered);
        assert_eq!(inbox.only()["error"]["kind"], "token");
    }
    assert!(bench.world.report(4).unwrap().powered);
    assert_eq!(bench.say(1, r#"{"request":"hello","token":"secre"}"#), Outcome::Close);
    assert_eq!(inbox.only()["error"]["kind"], "token");
    // Lines of any kind are tries.
    let stranger = bench.join(3);
    let lines = ["x".repeat(1 << 20), "{{{".to_owned(), r#"{"request":"fly"}"#.to_owned()];
    let outcomes = lines.map(|line| bench.say(3, &line));
    assert_eq!(outcomes, [Outcome::Answered, Outcome::Answered, Outcome::Close]);
    assert!(stranger.all().iter().all(|(_, answer)| answer["error"]["kind"] == "token"));
    let honest = bench.join(2);
    assert_eq!(bench.ask(2, &honest, &json!({ "request": "hello", "token": "secret" }))["ok"], true);
    assert_eq!(bench.ask(2, &honest, &json!({ "request": "now" }))["ok"], true);
    // A wrong one takes the right one back.
    assert_eq!(bench.ask(2, &honest, &json!({ "request": "hello", "token": "" }))["ok"], false);
    assert_eq!(bench.ask(2, &honest, &json!({ "request": "now" }))["ok"], false);
}

#[test]
fn a_request_to_run_is_the_callers_and_is_answered_when_it_is_done() {
    let mut bench = Bench::new(None);
    let inbox = bench.join(1);
    let Outcome::Run(pending) = bench.say(1, r#"{"id":9,"request":"run","for":"20ms"}"#) else { panic!("no run") };
    assert_eq!(pending.run, Run::For(Duration::from_millis(20)));
    assert!(inbox.all().is_empty());
    bench.run_for(Duration::from_millis(20));
    bench.control.answer_run(&pending, Ok(r#"{"ok":true,"t":1.02}"#));
    assert_eq!(inbox.only(), json!({ "id": 9, "ok": true, "t": 1.02 }));
    let Outcome::Run(pending) = bench.say(1, r#"{"request":"run","until":"1.5s"}"#) else { panic!("no run") };
    assert_eq!(pending.run, Run::Until(Instant::from_millis(1500)));
    let Outcome::Run(pending) = bench.say(1, "run 5us") else { panic!("no run") };
    assert_eq!(pending.run, Run::For(Duration::from_micros(5)));
}

#[test]
fn a_client_has_a_bounded_number_of_subscriptions_and_they_end_with_it() {
    let mut bench = Bench::new(None);
    let inbox = bench.join(1);
    let events = json!({ "request": "subscribe", "events": {} });
    let mut granted = 0;
    while bench.ask(1, &inbox, &events)["ok"] == true {
        granted += 1;
    }
    assert_eq!(granted, 64);
    bench.control.leave(1, &mut bench.world);
    bench.say(1, "4 power cut");
    bench.run_for(Duration::from_millis(10));
    assert!(inbox.all().is_empty() && bench.control.is_empty());
    assert_eq!(bench.world.poll_event(), None);
}

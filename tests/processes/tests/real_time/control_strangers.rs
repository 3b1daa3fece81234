//! A control connection and those who have no business there: without the token, in numbers, in its path, and gone in the middle.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;

use processes::{PATIENCE, Simulator, ferrodrive, wait_until};
use serde_json::{Value, json};

const DRIVE: [&str; 4] = ["--drive", "zlac8030l@4", "--control", "127.0.0.1:0"];

/// A connection, by lines.
struct Line(BufReader<TcpStream>);

impl Line {
    fn connect(simulator: &Simulator) -> Self {
        let stream = TcpStream::connect(simulator.address("control")).expect("it listens");
        // The watchdog's.
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Self(BufReader::new(stream))
    }

    /// Sends a line; who is being sent away need not get it.
    fn send(&mut self, line: &str) {
        let _ = self.0.get_mut().write_all(format!("{line}\n").as_bytes());
    }

    /// The next line; `None` when the connection is closed.
    fn next(&mut self) -> Option<Value> {
        let mut line = String::new();
        match self.0.read_line(&mut line) {
            Ok(1..) => Some(serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"))),
            Ok(0) => None,
            // Closed with something unread.
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => None,
            Err(error) => panic!("{error}"),
        }
    }

    fn ask(&mut self, line: &str) -> Value {
        self.send(line);
        self.next().expect("an answer")
    }
}

#[test]
fn who_has_not_given_the_token_learns_nothing_and_is_sent_away_after_three_lines_of_any_kind() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--control-token", "secret"]].concat());
    let mut stranger = Line::connect(&simulator);
    for line in ["x".repeat(1 << 20), "{{{".to_owned(), r#"{"request":"fly"}"#.to_owned()] {
        let answer = stranger.ask(&line);
        assert_eq!(answer["error"]["kind"], "token", "{answer}");
    }
    assert_eq!(stranger.next(), None);
    let mut guesser = Line::connect(&simulator);
    for token in ["", "secre", "secrets"] {
        let answer = guesser.ask(&json!({ "request": "hello", "token": token }).to_string());
        assert_eq!(answer["error"]["kind"], "token", "{answer}");
    }
    assert_eq!(guesser.next(), None);
    let mut friend = Line::connect(&simulator);
    assert_eq!(friend.ask(r#"{"request":"hello","token":"secret"}"#)["ok"], true);
    assert_eq!(friend.ask("4 get")["node"], 4);
}

#[test]
fn who_says_nothing_is_sent_away_in_time_and_a_crowd_of_them_keeps_nobody_out() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--control-token", "secret"]].concat());
    let mut friend = Line::connect(&simulator);
    assert_eq!(friend.ask(r#"{"request":"hello","token":"secret"}"#)["ok"], true);
    let mut silent: Vec<Line> = (0..40).map(|_| Line::connect(&simulator)).collect();
    let mut late = Line::connect(&simulator);
    assert_eq!(late.ask(r#"{"request":"hello","token":"secret"}"#)["ok"], true);
    // The first ones made room, the others had their time; each gets the reason.
    for stranger in &mut silent {
        let reported = stranger.next().expect("a reason");
        assert_eq!(reported["error"]["kind"], "token", "{reported}");
        assert_eq!(stranger.next(), None);
    }
    // Who has given it stays, for all that it is silent.
    assert_eq!((friend.ask("now")["ok"].clone(), late.ask("now")["ok"].clone()), (json!(true), json!(true)));
}

#[cfg(unix)]
#[test]
fn a_path_that_is_somebody_elses_by_now_is_left_alone() {
    let directory = processes::scratch("control-path");
    let path = directory.join("bench.sock");
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--control", path.to_str().unwrap()]);
    std::fs::remove_file(&path).unwrap();
    let other = std::os::unix::net::UnixListener::bind(&path).unwrap();
    assert_eq!(simulator.ask("quit")["ok"], true);
    assert_eq!(simulator.wait(), Some(0));
    assert!(path.exists(), "the socket of another program");
    drop(other);
}

#[test]
fn quit_ends_a_run_that_would_take_for_ever_in_the_end_and_at_once_if_said_twice() {
    let mut waits = Simulator::start(&["--drive", "zlac8030l@4", "--clock", "manual"]);
    waits.send("run 10000min");
    waits.send("quit");
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--clock", "manual"]);
    for line in ["run 10000min", "4 supply 30", "run 10000min", "quit", "quit"] {
        simulator.send(line);
    }
    let answer =
        |line: String| serde_json::from_str::<Value>(&line).unwrap_or_else(|error| panic!("{error} in {line}"));
    let answers: Vec<Value> = (0..4).map(|_| answer(simulator.line())).collect();
    for (n, is_ok) in [false, true, false, true].into_iter().enumerate() {
        assert_eq!(answers[n]["ok"], is_ok, "{answers:#?}");
    }
    assert!(answers[0]["error"]["message"].as_str().unwrap().contains("the run was ended at"), "{answers:#?}");
    assert_eq!(simulator.wait(), Some(0));
    assert_eq!((answer(waits.line())["ok"].clone(), waits.wait()), (json!(false), Some(0)));
}

#[test]
fn a_run_ends_with_the_client_that_asked_for_it() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--clock", "manual"]].concat());
    let mut one = Line::connect(&simulator);
    one.send(r#"{"request":"run","for":"1000min"}"#);
    let mut two = Line::connect(&simulator);
    wait_until("time begins to move", || two.ask("now")["t"] != 0.0);
    assert_eq!(two.ask("run 1ms")["error"]["kind"], "clock");
    drop(one);
    wait_until("the run ends with its client", || two.ask("run 1ms")["ok"] == true);
    let (before, after) = (two.ask("now")["t"].clone(), two.ask("now")["t"].clone());
    assert_eq!(before, after, "time stands");
}

#[test]
fn of_two_clients_that_contradict_the_last_wins_and_both_hear_who_it_was() {
    let simulator = Simulator::start(&[&DRIVE[..], &["--clock", "manual"]].concat());
    let mut clients = [Line::connect(&simulator), Line::connect(&simulator)];
    for (name, client) in ["one", "two"].into_iter().zip(&mut clients) {
        client.ask(&json!({ "request": "hello", "name": name }).to_string());
        client.ask(r#"{"request":"subscribe","events":{"kinds":["stimulus"]}}"#);
    }
    let mut heard = [Vec::new(), Vec::new()];
    for round in 0..20 {
        for n in 0..2 {
            clients[n].send(&format!("4 supply {}", 30 + n));
            // Its answer, and the event; the other hears the event.
            for (of, count) in [(n, 2), (1 - n, 1)] {
                for _ in 0..count {
                    let line = clients[of].next().expect("a line");
                    if line.get("event").is_some() {
                        heard[of].push((line["event"]["words"].clone(), line["event"]["by"].clone()));
                    } else {
                        assert_eq!(line["ok"], true, "round {round}: {line}");
                    }
                }
            }
        }
    }
    assert_eq!(heard[0], heard[1]);
    assert_eq!((heard[0].len(), &heard[0][39]), (40, &(json!("supply 31"), json!("two"))));
    let [one, _] = &mut clients;
    one.send(r#"{"id":9,"request":"run","for":"1s"}"#);
    assert_eq!(one.next().expect("an answer")["id"], 9);
    let volts = one.ask("4 get")["supply_v"].as_f64().expect("a voltage");
    assert!((volts - 31.0).abs() < 0.5, "{volts}");
}

#[test]
fn an_empty_token_is_none() {
    let refused = ferrodrive(&[&["sim"], &DRIVE[..], &["--control-token", ""]].concat());
    assert_eq!(refused.status, Some(2), "{}", refused.err);
    assert!(refused.err.contains("is empty"), "{}", refused.err);
}

/// A line means the same wherever it is written: typed, sent by a program, or as the line of a request.
#[test]
fn a_line_that_is_not_obeyed_has_one_error_on_standard_input_and_on_the_control_connection() {
    let mut simulator = Simulator::start(&DRIVE);
    let mut line = Line::connect(&simulator);
    let long = "4 ".to_owned() + &"x".repeat(5_000);
    for (words, kind) in [
        ("fly", "usage"),
        ("4", "usage"),
        ("4 fly", "usage"),
        ("130 get", "usage"),
        ("9 get", "no_such_node"),
        ("9 load torque 1", "no_such_node"),
        ("4.2 get", "refused"),
        ("4 load torque 1e9", "refused"),
        ("4 load torque x", "usage"),
        ("4 input X9 1", "refused"),
        ("4 battery off", "refused"),
        ("4 set 6041 5", "refused"),
        ("body arm get", "no_such_body"),
        ("bus corrupt 9", "usage"),
        ("run 20ms", "clock"),
        ("run x", "usage"),
        (&long, "too_long"),
    ] {
        simulator.send(words);
        let typed: Value = serde_json::from_str(&simulator.line()).unwrap();
        let requested = json!({ "request": "world", "line": words }).to_string();
        for sent in [words, &requested] {
            let error = line.ask(sent)["error"].clone();
            assert_eq!(error, typed["error"], "{sent}");
            assert_eq!(error["kind"], kind, "{sent}");
            assert!(error["next"].is_string(), "{error}");
        }
    }
}

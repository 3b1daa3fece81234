//! A control connection and a crowd without the token. What is asked and answered there is `crates/host/tests/it/control.rs`.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;

use processes::{PATIENCE, Simulator};
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

//! `ferrodrive studio` as a process: its first line, who is let in, how it ends.

mod common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::time::Duration;

use common::{command, ferrodrive};
use serde_json::Value;

/// Far more than any answer takes.
const PATIENCE: Duration = Duration::from_secs(30);

/// A running studio; killed when dropped.
struct Studio {
    child: Child,
    address: String,
    token: String,
}

impl Studio {
    fn start(arguments: &[&str]) -> Self {
        let arguments = [arguments, &["studio", "--listen", "127.0.0.1:0"]].concat();
        let mut child = command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut ready = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
        let url = ready.trim().strip_prefix("studio http://").unwrap_or_else(|| panic!("{ready:?}"));
        let (address, token) = url.split_once("/?token=").unwrap_or_else(|| panic!("{ready:?}"));
        Self { address: address.to_owned(), token: token.to_owned(), child }
    }

    /// Sends a request and gives the whole answer.
    fn ask(&self, line: &str, headers: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}\r\n", self.address).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    fn state(&self) -> Value {
        let answer = self.ask("GET /api/state", &format!("Authorization: Bearer {}\r\n", self.token));
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200"), "{head}");
        serde_json::from_str(body).unwrap()
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_first_line_is_the_way_in_and_the_embedded_drives_are_there() {
    let studio = Studio::start(&[]);
    assert!(studio.ask("GET /", "").starts_with("HTTP/1.1 401"));
    let opened = studio.ask(&format!("GET /?token={}", studio.token), "");
    assert!(opened.starts_with("HTTP/1.1 303") && opened.contains("HttpOnly"), "{opened}");
    let until = std::time::Instant::now() + PATIENCE;
    let mut state = studio.state();
    // Asking all node-IDs takes a while.
    while state["nodes"]
        .as_array()
        .is_none_or(|nodes| nodes.len() < 3 || nodes.iter().any(|node| node["drive"].is_null()))
    {
        assert!(std::time::Instant::now() < until, "{state}");
        std::thread::sleep(Duration::from_millis(50));
        state = studio.state();
    }
    let nodes: Vec<_> = state["nodes"].as_array().unwrap().iter().map(|node| node["node"].as_u64()).collect();
    assert_eq!(nodes, [Some(1), Some(2), Some(4)]);
    assert_eq!(state["nodes"][2]["model"], "zlac8030l");
    // All is as it is delivered, without power on the motor.
    assert_eq!(state["nodes"][2]["drive"]["state"], "Switch on disabled");
}

#[cfg(unix)]
#[test]
fn it_ends_when_it_is_asked_to() {
    let mut studio = Studio::start(&[]);
    studio.state();
    let asked = std::process::Command::new("kill").arg(studio.child.id().to_string()).status().unwrap();
    assert!(asked.success());
    assert_eq!(studio.child.wait().unwrap().code(), Some(143));
}

#[test]
fn elsewhere_takes_a_password_and_says_what_that_means() {
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0"]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    assert!(ended.err.contains("--password-file") && ended.err.contains("can move the drives"), "{}", ended.err);
    let directory = common::scratch("studio");
    let short = directory.join("short");
    std::fs::write(&short, "hunter2\n").unwrap();
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0", "--password-file", short.to_str().unwrap()]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    assert!(ended.err.contains("at least 12"), "{}", ended.err);
    let missing = ferrodrive(&["studio", "--password-file", "/no/such/file"]);
    assert_eq!(missing.status, Some(1), "{}", missing.err);
    std::fs::remove_dir_all(directory).unwrap();
}

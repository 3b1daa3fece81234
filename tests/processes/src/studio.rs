//! `ferrodrive studio` as a process, and what it shows to a program.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

use serde_json::Value;

use crate::{PATIENCE, command, wait_for};

/// A running studio; killed when dropped.
pub struct Studio {
    /// The process.
    pub child: Child,
    /// Host and port.
    pub address: String,
    /// What lets a page in.
    pub token: String,
}

impl Studio {
    /// Starts one on a free port, and waits until it serves.
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_at("127.0.0.1:0", arguments, &[])
    }

    /// The same at an address, with arguments of its own behind those of every command.
    pub fn start_at(address: &str, arguments: &[&str], own: &[&str]) -> Self {
        let arguments = [arguments, &["studio", "--listen", address], own].concat();
        let mut child = command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut ready = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut ready).unwrap();
        let url = ready.trim().strip_prefix("studio http://").unwrap_or_else(|| panic!("{ready:?}"));
        let (address, token) = url.split_once("/?token=").unwrap_or_else(|| panic!("{ready:?}"));
        Self { address: address.to_owned(), token: token.to_owned(), child }
    }

    /// Sends a request and gives the whole answer.
    pub fn ask(&self, line: &str, headers: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        // The watchdog's.
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}\r\n", self.address).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    /// What it shows, as JSON.
    pub fn state(&self) -> Value {
        let answer = self.ask("GET /api/state", &format!("Authorization: Bearer {}\r\n", self.token));
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200"), "{head}");
        serde_json::from_str(body).unwrap()
    }

    /// Waits until what is shown is as wanted, and gives it.
    pub fn wait(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        wait_for(what, || {
            let state = self.state();
            if wanted(&state) { Ok(state) } else { Err(state.to_string()) }
        })
    }

    /// Waits until the three drives of the embedded bus are known. Asking all node-IDs takes a while.
    pub fn scanned(&self) -> Value {
        self.found(3)
    }

    /// The same of a bus with so many drives.
    pub fn found(&self, drives: usize) -> Value {
        self.wait(&format!("{drives} drives"), |state| {
            let nodes = state["nodes"].as_array();
            nodes.is_some_and(|nodes| nodes.len() == drives && nodes.iter().all(|node| !node["drive"].is_null()))
        })
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

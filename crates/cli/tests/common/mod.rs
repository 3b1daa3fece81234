//! Runs the built `ferrodrive`, for a moment or for a while.
#![allow(dead_code, reason = "each test file uses its part")]

pub(crate) mod raw_bus;

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::Value;

/// Longest wait for a line of a simulator.
const PATIENCE: Duration = Duration::from_secs(20);

/// How a command ended, and what it printed.
pub(crate) struct Ended {
    pub(crate) status: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Ended {
    /// Standard output as one JSON value.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error} in {:?} ({})", self.out, self.err))
    }
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ferrodrive"));
    command.args(arguments).env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE").env("NO_COLOR", "1");
    command
}

/// Runs a command line to its end.
pub(crate) fn ferrodrive(arguments: &[&str]) -> Ended {
    let output = command(arguments).stdin(Stdio::null()).output().expect("the binary runs");
    Ended {
        status: output.status.code(),
        out: String::from_utf8(output.stdout).expect("UTF-8"),
        err: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

/// Runs a command line that has to succeed.
pub(crate) fn done(arguments: &[&str]) -> Ended {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(0), "{arguments:?}: {}{}", ended.out, ended.err);
    ended
}

/// A running `ferrodrive sim`; killed when dropped.
pub(crate) struct Simulator {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    /// The first line.
    pub(crate) ready: String,
}

impl Simulator {
    /// Starts one and waits until it is ready.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        let mut child = command(&[&["sim"], arguments].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("the binary runs");
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let (sender, lines) = channel();
        std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        let input = child.stdin.take();
        let mut simulator = Self { child, input, lines, ready: String::new() };
        simulator.ready = simulator.line();
        simulator
    }

    /// The next line that it prints.
    pub(crate) fn line(&self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("a line in time")
    }

    /// Sends it a line.
    pub(crate) fn send(&mut self, line: &str) {
        let input = self.input.as_mut().expect("standard input is open");
        writeln!(input, "{line}").and_then(|()| input.flush()).expect("it reads");
    }

    /// Sends it a world command; the answer.
    pub(crate) fn ask(&mut self, line: &str) -> Value {
        self.send(line);
        let answer = self.line();
        serde_json::from_str(&answer).unwrap_or_else(|error| panic!("{error} in {answer:?}"))
    }

    /// Ends its standard input.
    pub(crate) fn close_input(&mut self) {
        self.input = None;
    }

    /// The address of the listener of a protocol, as its `ready` line names it.
    pub(crate) fn address(&self, protocol: &str) -> String {
        let prefix = format!("{protocol}://");
        let place = self.ready.split_whitespace().find_map(|word| word.strip_prefix(&prefix));
        place.unwrap_or_else(|| panic!("{protocol} in {:?}", self.ready)).to_owned()
    }

    /// A bus argument that reaches it.
    pub(crate) fn bus(&self, protocol: &str) -> String {
        let address = self.address(protocol);
        if protocol == "socketcand" { format!("socketcand://{address}/can0") } else { format!("slcan://{address}") }
    }

    /// Waits for its end; the exit status.
    pub(crate) fn wait(&mut self) -> Option<i32> {
        self.child.wait().expect("it ends").code()
    }

    /// True while it runs.
    pub(crate) fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("its state can be asked").is_none()
    }

    /// Ends it as a power failure would.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it ends");
    }

    /// Its process.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An empty directory of this test's own.
pub(crate) fn scratch(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("ferrodrive-cli-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the temporary directory can be written");
    path
}

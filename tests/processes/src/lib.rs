//! Runs the built `ferrodrive`, for a moment or for a while.

mod patience;
pub mod raw_bus;
pub mod studio;

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use serde_json::Value;

pub use patience::{PATIENCE, wait_for, wait_until};

/// How a command ended, and what it printed.
pub struct Ended {
    /// Its exit status; none if a signal ended it.
    pub status: Option<i32>,
    /// Its standard output.
    pub out: String,
    /// Its standard error.
    pub err: String,
}

impl Ended {
    /// Standard output as one JSON value.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error} in {:?} ({})", self.out, self.err))
    }
}

/// The built `ferrodrive`, beside the folder of the test programs. Cargo builds it for the tests of its own package; for others
/// `cargo build --bin ferrodrive` does, and `cargo xtask test`.
pub fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let test = std::env::current_exe().expect("this program has a path");
        let folder = test.parent().and_then(Path::parent).expect("test programs are in target/PROFILE/deps");
        let program = folder.join(format!("ferrodrive{}", std::env::consts::EXE_SUFFIX));
        assert!(program.is_file(), "{} is not built: cargo build --bin ferrodrive", program.display());
        program.into_os_string().into_string().expect("its path is UTF-8")
    })
}

/// Commands that need no node, or scan all node-IDs.
const NOT_PATIENT: [&str; 4] = ["sim", "dump", "scan", "init"];

/// The program with these arguments, and nothing of this environment that it would listen to. Who asks on a served bus waits longer
/// for an answer than a person would: on a busy machine the bus may be seconds behind.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(program());
    let served = arguments.windows(2).any(|pair| pair[0] == "--bus" && pair[1].contains("://"));
    if served && !arguments.iter().any(|word| *word == "--timeout" || NOT_PATIENT.contains(word)) {
        command.args(["--timeout", "60s"]);
    }
    command.args(arguments).env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE").env("NO_COLOR", "1");
    command
}

/// Runs a command line to its end.
pub fn ferrodrive(arguments: &[&str]) -> Ended {
    let output = command(arguments).stdin(Stdio::null()).output().expect("the binary runs");
    Ended {
        status: output.status.code(),
        out: String::from_utf8(output.stdout).expect("UTF-8"),
        err: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

/// Runs a command line to its end with this on its standard input.
pub fn fed(arguments: &[&str], input: impl AsRef<[u8]>) -> Ended {
    let mut command = command(arguments);
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary runs");
    child.stdin.take().expect("piped").write_all(input.as_ref()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    Ended {
        status: output.status.code(),
        out: String::from_utf8(output.stdout).expect("UTF-8"),
        err: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

/// Runs a command line that has to succeed.
pub fn done(arguments: &[&str]) -> Ended {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(0), "{arguments:?}: {}{}", ended.out, ended.err);
    ended
}

/// A running `ferrodrive sim`; killed when dropped.
pub struct Simulator {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    errors: Option<Receiver<String>>,
    /// The first line.
    pub ready: String,
}

/// The lines of a stream. Of a `deaf` reader's no more is read than is asked for, but for a few kB.
fn lines_of(stream: impl Read + Send + 'static, deaf: bool) -> Receiver<String> {
    let (sender, lines) = sync_channel(if deaf { 0 } else { 1 << 20 });
    let stream = BufReader::new(stream);
    std::thread::spawn(move || stream.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    lines
}

impl Simulator {
    /// Starts one and waits until it is ready.
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_with(arguments, Stdio::inherit(), false)
    }

    /// Starts one whose standard error is kept for [`error`](Self::error), and whose standard output is read only as far as
    /// it is asked for.
    pub fn start_deaf(arguments: &[&str]) -> Self {
        Self::start_with(arguments, Stdio::piped(), true)
    }

    /// Starts one whose standard error is kept for [`error`](Self::error).
    pub fn start_heard(arguments: &[&str]) -> Self {
        Self::start_with(arguments, Stdio::piped(), false)
    }

    /// Starts a scenario that is served, `ferrodrive run`, and waits until it is ready.
    pub fn start_scenario(arguments: &[&str]) -> Self {
        Self::spawn(command(&[&["run"], arguments].concat()), Stdio::piped(), false)
    }

    /// Drives that take no time, unless the test is about that.
    fn start_with(arguments: &[&str], errors: Stdio, deaf: bool) -> Self {
        let timing: &[&str] = if arguments.contains(&"--timing") { &[] } else { &["--timing", "ideal"] };
        Self::spawn(command(&[&["sim"], timing, arguments].concat()), errors, deaf)
    }

    fn spawn(mut command: Command, errors: Stdio, deaf: bool) -> Self {
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(errors).spawn().expect("the binary runs");
        let lines = lines_of(child.stdout.take().expect("piped"), deaf);
        let errors = child.stderr.take().map(|stream| lines_of(stream, false));
        let input = child.stdin.take();
        let mut simulator = Self { child, input, lines, errors, ready: String::new() };
        simulator.ready = simulator.line();
        simulator
    }

    /// The next line on its standard error that contains `part`.
    pub fn error(&self, part: &str) -> String {
        let errors = self.errors.as_ref().expect("standard error is kept");
        loop {
            // The watchdog's.
            let line = errors.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("no {part:?} on standard error"));
            if line.contains(part) {
                return line;
            }
        }
    }

    /// All lines left on the standard error of one that has ended.
    pub fn errors_left(&self) -> Vec<String> {
        self.errors.as_ref().expect("standard error is kept").iter().collect()
    }

    /// Its standard input, to write to it from elsewhere.
    pub fn take_input(&mut self) -> ChildStdin {
        self.input.take().expect("standard input is open")
    }

    /// Sends it a signal such as `-TERM`.
    pub fn signal(&self, signal: &str) {
        let sent = Command::new("kill").args([signal, &self.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "{signal} cannot be sent");
    }

    /// The next line that it prints.
    pub fn line(&self) -> String {
        // The watchdog's.
        self.lines.recv_timeout(PATIENCE).expect("a line")
    }

    /// All lines left on the standard output of one that ends.
    pub fn lines_left(&self) -> Vec<String> {
        self.lines.iter().collect()
    }

    /// Sends it a line.
    pub fn send(&mut self, line: &str) {
        let input = self.input.as_mut().expect("standard input is open");
        writeln!(input, "{line}").and_then(|()| input.flush()).expect("it reads");
    }

    /// Sends it a world command; the answer.
    pub fn ask(&mut self, line: &str) -> Value {
        self.send(line);
        let answer = self.line();
        serde_json::from_str(&answer).unwrap_or_else(|error| panic!("{error} in {answer:?}"))
    }

    /// The time of its drives.
    pub fn time(&mut self) -> Duration {
        let answer = self.ask("now");
        Duration::from_secs_f64(answer["t"].as_f64().unwrap_or_else(|| panic!("no time in {answer}")))
    }

    /// Waits until so much time has passed for its drives, which on a busy machine takes longer than that.
    pub fn pass(&mut self, time: Duration) {
        let end = self.time() + time;
        loop {
            let now = self.time();
            if now >= end {
                return;
            }
            // In real time, since a served bus follows the clock; never longer than what is left.
            std::thread::sleep(end - now);
        }
    }

    /// Ends its standard input.
    pub fn close_input(&mut self) {
        self.input = None;
    }

    /// The address of the listener of a protocol, as its `ready` line names it.
    pub fn address(&self, protocol: &str) -> String {
        let prefix = format!("{protocol}://");
        let place = self.ready.split_whitespace().find_map(|word| word.strip_prefix(&prefix));
        place.unwrap_or_else(|| panic!("{protocol} in {:?}", self.ready)).to_owned()
    }

    /// A bus argument that reaches it.
    pub fn bus(&self, protocol: &str) -> String {
        let address = self.address(protocol);
        if protocol == "socketcand" { format!("socketcand://{address}/can0") } else { format!("slcan://{address}") }
    }

    /// Waits for its end; the exit status.
    pub fn wait(&mut self) -> Option<i32> {
        self.child.wait().expect("it ends").code()
    }

    /// True while it runs.
    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("its state can be asked").is_none()
    }

    /// Ends it as a power failure would.
    pub fn kill(&mut self) {
        self.child.kill().expect("it can be killed");
        self.child.wait().expect("it ends");
    }

    /// Its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An empty directory of this test's own, gone with it; a test that fails leaves it to be looked at.
pub struct Scratch(PathBuf);

/// Makes one.
pub fn scratch(name: &str) -> Scratch {
    let path = std::env::temp_dir().join(format!("ferrodrive-cli-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the temporary directory can be written");
    Scratch(path)
}

impl Scratch {
    /// The path of a file in it, as text for a command line.
    pub fn path(&self, name: &str) -> String {
        self.join(name).to_str().expect("UTF-8").to_owned()
    }

    /// Writes a file; its path.
    pub fn write(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a file");
        path
    }

    /// Writes a file of parameters with these values.
    pub fn values(&self, name: &str, values: &str) -> String {
        self.write(name, &format!("[values]\n{values}"))
    }
}

impl std::ops::Deref for Scratch {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.0
    }
}

impl AsRef<Path> for Scratch {
    fn as_ref(&self) -> &Path {
        self
    }
}

impl AsRef<std::ffi::OsStr> for Scratch {
    fn as_ref(&self) -> &std::ffi::OsStr {
        self.as_os_str()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }
}

/// Started by `nohup` or the like, these tests and all that they start pass a hang-up over, which is as it should be.
fn hang_ups_are_passed_over() -> bool {
    const SIGHUP_BIT: u64 = 1;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & SIGHUP_BIT != 0)
}

/// True for a signal, `HUP` or `-HUP`, that what is started here does not pass over.
pub fn is_heard(signal: &str) -> bool {
    signal.trim_start_matches('-') != "HUP" || !hang_ups_are_passed_over()
}

/// A page of `docs`.
pub fn page(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

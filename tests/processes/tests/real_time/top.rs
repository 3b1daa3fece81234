//! `ferrodrive top` in a terminal that `script` (util-linux) makes: a held key moves a drive, and one that is released, or loses its
//! terminal, stops.
#![cfg(unix)]
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use std::io::{Read, Write};
use std::num::NonZero;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use processes::{Simulator, wait_for, wait_until};

const LINES: NonZero<u16> = NonZero::new(24).expect("it is not 0");
const COLUMNS: NonZero<u16> = NonZero::new(80).expect("it is not 0");

/// A terminal of 80 columns and 24 lines with the program in it; killed when dropped.
pub(super) struct Terminal {
    script: Child,
    keys: ChildStdin,
    /// What a person sees.
    screen: Arc<Mutex<vt100::Parser>>,
    /// Where the program keeps what it remembers, for as long as it runs.
    _cache: processes::Scratch,
}

impl Terminal {
    /// `None` where no terminal can be made.
    fn open(bus: &str) -> Option<Self> {
        Self::of(&format!("--bus {bus} top"))
    }

    /// The same with these arguments.
    pub(super) fn of(arguments: &str) -> Option<Self> {
        if Command::new("script").arg("--version").output().is_err() {
            eprintln!("skipped: there is no `script` here, which gives a command a terminal");
            return None;
        }
        let program = processes::program();
        let line = format!("stty cols 80 rows 24; exec {program} {arguments}");
        let mut script = Command::new("script");
        script.args(["-q", "-f", "-e", "-c", &line, "/dev/null"]).env("TERM", "xterm").env("NO_COLOR", "1");
        let cache = processes::scratch("top-cache");
        script.env("XDG_CACHE_HOME", &*cache);
        let mut script = script.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let (keys, mut output) = (script.stdin.take().unwrap(), script.stdout.take().unwrap());
        let screen = Arc::new(Mutex::new(vt100::Parser::new(LINES, COLUMNS, 0)));
        let shared = Arc::clone(&screen);
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count) = output.read(&mut bytes) {
                if count == 0 {
                    return;
                }
                shared.lock().unwrap().process(&bytes[..count]);
            }
        });
        Some(Self { script, keys, screen, _cache: cache })
    }

    /// The program itself, which is the one child of `script`.
    fn program(&self) -> u32 {
        let script = self.script.id();
        wait_for("the program", || {
            let children = std::fs::read_to_string(format!("/proc/{script}/task/{script}/children"));
            let first = children.map_err(|error| error.to_string())?;
            first.split_whitespace().next().and_then(|pid| pid.parse().ok()).ok_or_else(|| "none".to_owned())
        })
    }

    /// Continues the program: `script` stands still with it.
    fn go_on(&self, pid: u32) {
        wait_until("it goes on", || {
            signal("CONT", self.script.id());
            signal("CONT", pid);
            !is_stopped(pid)
        });
    }

    pub(super) fn press(&mut self, key: &str) {
        self.keys.write_all(key.as_bytes()).unwrap();
        self.keys.flush().unwrap();
    }

    /// Whether something is on the screen now.
    fn shows(&self, text: &str) -> bool {
        self.screen.lock().unwrap().screen().contents().contains(text)
    }

    /// Waits until something is on the screen.
    pub(super) fn wait_for(&self, text: &str) {
        wait_for(text, || {
            let seen = self.screen.lock().unwrap().screen().contents();
            if seen.contains(text) { Ok(()) } else { Err(format!("on the screen is\n{seen}")) }
        });
    }

    /// Waits for a drive. One that boots while the bus is scanned may be missed: then it is scanned again.
    fn wait_for_drive(&mut self, model: &str) {
        /// A scan takes some seconds; one in so many looks is followed by another.
        const LOOKS_A_SCAN: u32 = 600;
        let mut looks = 0;
        wait_until(model, || {
            looks += 1;
            if looks % LOOKS_A_SCAN == 0 {
                self.press("n");
            }
            self.shows(model)
        });
    }

    /// Holds a key as a keyboard does until this is true. A machine that is busy may hold repeats up, which ends the hold: then
    /// it is released, and held again.
    fn hold_until(&mut self, key: &str, mut done: impl FnMut() -> bool) {
        wait_until(&format!("what holding {key:?} does"), || {
            self.press(key);
            // A keyboard waits so long before it repeats.
            std::thread::sleep(Duration::from_millis(400));
            for repeat in 1..=60 {
                self.press(key);
                // And so long between repeats.
                std::thread::sleep(Duration::from_millis(30));
                if repeat % 10 == 0 && done() {
                    return true;
                }
            }
            // Longer than a hold is kept without repeats.
            std::thread::sleep(Duration::from_millis(1_300));
            false
        });
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.script.kill();
        let _ = self.script.wait();
    }
}

fn bench() -> (Simulator, String) {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    (simulator, bus)
}

fn position(simulator: &mut Simulator) -> i64 {
    simulator.ask("4 get")["position"].as_i64().unwrap()
}

/// It stands: a tenth of a turn a second is far more than a shaft at rest is moved by.
fn wait_until_it_stands(simulator: &mut Simulator) {
    wait_until("it stands", || {
        let before = position(simulator);
        simulator.pass(Duration::from_millis(300));
        position(simulator).abs_diff(before) < 20
    });
}

#[test]
fn a_key_that_is_held_jogs_and_let_go_stops() {
    let (mut simulator, bus) = bench();
    let Some(mut terminal) = Terminal::open(&bus) else { return };
    terminal.wait_for_drive("zlac8030l");
    let before = position(&mut simulator);
    // A press alone.
    terminal.press("l");
    // Longer than a press alone could count as a hold.
    std::thread::sleep(Duration::from_millis(1_500));
    assert!(position(&mut simulator).abs_diff(before) < 20, "a press moves nothing");
    // A turn is 4096 counts; to jog at 10 r/min for a tenth of it.
    terminal.hold_until("l", || position(&mut simulator) - before > 400);
    wait_until_it_stands(&mut simulator);
    let there = position(&mut simulator);
    terminal.hold_until("h", || position(&mut simulator) < there - 400);
    terminal.press(" ");
    wait_until_it_stands(&mut simulator);
    terminal.wait_for("stopped by a press of stop");
    terminal.press("q");
    let status = wait_for("q ends it", || terminal.script.try_wait().unwrap().ok_or_else(|| "it runs".to_owned()));
    assert!(status.success(), "{status}");
    // The screen is given back.
    assert!(!terminal.screen.lock().unwrap().screen().alternate_screen());
}

#[test]
fn a_terminal_that_is_lost_stops_what_it_moves() {
    let (mut simulator, bus) = bench();
    let Some(mut terminal) = Terminal::open(&bus) else { return };
    terminal.wait_for_drive("zlac8030l");
    let before = position(&mut simulator);
    terminal.hold_until("l", || position(&mut simulator) - before > 200);
    // The window closes: its processes are hung up.
    drop(terminal);
    wait_until_it_stands(&mut simulator);
}

/// By what others send it, and by Ctrl-Z: the shell has its terminal as it was, and nothing moves that the program, which stands still,
/// could not stop. Then it goes on where it was.
#[test]
fn a_suspended_program_leaves_a_terminal_that_can_be_used_and_a_drive_at_rest() {
    let (mut simulator, bus) = bench();
    let Some(mut terminal) = Terminal::open(&bus) else { return };
    terminal.wait_for_drive("zlac8030l");
    let pid = terminal.program();
    let is_raw = || !stty(pid).contains(" icanon") || !stty(pid).contains(" echo ");
    assert!(is_raw(), "keys come one by one");
    let before = position(&mut simulator);
    terminal.hold_until("l", || position(&mut simulator) - before > 200);
    signal("TSTP", pid);
    wait_until("it stands still", || is_stopped(pid));
    assert!(!is_raw(), "{}", stty(pid));
    wait_until_it_stands(&mut simulator);
    terminal.go_on(pid);
    wait_until("it draws again", || is_raw() && terminal.shows("ferrodrive top"));
    terminal.press("\x1a");
    wait_until("it stands still", || is_stopped(pid));
    assert!(!is_raw(), "{}", stty(pid));
    terminal.go_on(pid);
    // It moves again, and ends as ever.
    let before = position(&mut simulator);
    terminal.hold_until("l", || position(&mut simulator) - before > 200);
    terminal.press("q");
    let status = wait_for("q ends it", || terminal.script.try_wait().unwrap().ok_or_else(|| "it runs".to_owned()));
    assert!(status.success(), "{status}");
}

fn signal(name: &str, pid: u32) {
    assert!(Command::new("kill").args([format!("-{name}"), pid.to_string()]).status().unwrap().success());
}

/// Stopped by a signal, as Linux shows it.
fn is_stopped(pid: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    status.lines().any(|line| line.starts_with("State:\tT"))
}

/// How the terminal of a process is set.
fn stty(pid: u32) -> String {
    let place = format!("/proc/{pid}/fd/0");
    let shown = Command::new("stty").args(["-F", &place, "-a"]).output().unwrap();
    String::from_utf8_lossy(&shown.stdout).into_owned()
}

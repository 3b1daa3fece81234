//! On CAN interfaces of Linux. `cargo xtask vcan-test` boots a kernel that has them and runs these inside; elsewhere most are
//! left out.
//!
//! What is expected there: `vcan0` and `vcan1` (MTU 72), and `can0` and `can1`, two controllers on one bus, all up; the rights
//! to take them down; can-utils. One test at a time, as they share the interfaces.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use processes::{Ended, PATIENCE, Simulator, command, ferrodrive};
use serde_json::Value;

/// Runs a program of the system that has to succeed.
#[track_caller]
fn run(program: &str, arguments: &[&str]) {
    let ended = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let ended = ended.unwrap_or_else(|error| panic!("{program}: {error}"));
    assert!(ended.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&ended.stderr));
}

/// Takes an interface down, or sets it up.
fn set(interface: &str, state: &str) {
    run("ip", &["link", "set", interface, state]);
}

/// How long an answer is waited for: beside other steps a frame may take half a second through the emulated machine.
const PATIENT: &str = "5s";

#[track_caller]
fn on(bus: &str, arguments: &[&str]) -> Ended {
    let ended = ferrodrive(&[&["--bus", bus, "--timeout", PATIENT], arguments].concat());
    assert_eq!(ended.status, Some(0), "{bus} {arguments:?}: {}{}", ended.out, ended.err);
    ended
}

/// A program that prints lines until it is dropped.
struct Listener {
    child: Child,
    lines: Receiver<String>,
}

impl Listener {
    /// `ferrodrive --bus BUS dump --json`, once it listens: it has shown a frame that was sent for that.
    fn dump(bus: &str) -> Self {
        let mut listener = Self::start(&mut command(&["--bus", bus, "--json", "dump"]));
        // How long it takes to listen is not known; a frame that comes before is lost.
        loop {
            run("cansend", &[bus, "7E5#"]);
            // Then it is sent again.
            match listener.lines.recv_timeout(Duration::from_millis(100)) {
                Ok(line) => assert!(line.contains("7E5#"), "{line}"),
                Err(_) if listener.child.try_wait().unwrap().is_none() => continue,
                Err(_) => panic!("dump of {bus} has ended"),
            }
            break;
        }
        listener
    }

    fn start(command: &mut Command) -> Self {
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().expect("it runs");
        let stream = BufReader::new(child.stdout.take().expect("piped"));
        let (sender, lines) = channel();
        std::thread::spawn(move || stream.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child, lines }
    }

    fn line(&self) -> String {
        // The watchdog's.
        self.lines.recv_timeout(PATIENCE).expect("a line")
    }

    /// The next line of JSON that `wanted` holds for.
    fn find(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            let value = serde_json::from_str(&self.line()).expect("JSON");
            if wanted(&value) {
                return value;
            }
        }
    }

    /// The next note of this kind.
    fn note(&self, kind: &str) -> Value {
        self.find(|value| value["note"] == kind)
    }

    fn signal(&self, signal: &str) {
        run("kill", &[signal, &self.child.id().to_string()]);
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn on_somebodys_bus_time_is_not_ours_to_change() {
    for (word, value) in [("--speed", "2"), ("--speed", "max"), ("--clock", "manual")] {
        let refused = ferrodrive(&["--bus", "can0", "sim", "--drive", "zlac8030l@4", word, value]);
        assert_eq!(refused.status, Some(2), "{word} {value}: {}", refused.err);
        assert!(refused.err.contains("on can0 time passes by itself"), "{}", refused.err);
    }
}

/// Also where the kernel has no CAN, which is reported then.
#[test]
fn an_interface_that_no_machine_has_is_refused_by_name() {
    for arguments in [&["scan"][..], &["sim", "--drive", "zlac8030l@4"]] {
        let refused = ferrodrive(&[&["--bus", "nosuchcan"], arguments].concat());
        assert_eq!(refused.status, Some(1));
        assert!(refused.err.contains("nosuchcan") && refused.err.lines().count() < 5, "{}", refused.err);
    }
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn virtual_drives_on_vcan0_are_scanned_enabled_and_moved() {
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--bus", "vcan0"]);
    assert_eq!(simulator.ready, "ready vcan0");
    let found = on("vcan0", &["--json", "scan"]).json();
    assert_eq!(found["nodes"][0]["node"], 4, "{found}");
    on("vcan0", &["--model", "4=zlac8030l", "move", "4", "90deg"]);
    // "ZLAC8030L quick start guide V1.00", 200Bh: 1024 lines, so 4096 counts a turn, of which this is a quarter.
    let position = simulator.ask("4 get")["position"].as_f64().expect("a number");
    assert!((position - 1024.0).abs() <= 10.0, "{position}");
    on("vcan0", &["--model", "4=zlac8030l", "disable", "4"]);
    simulator.send("quit");
    while simulator.is_running() {
        // Looked at again and again.
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(simulator.wait(), Some(0));
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn can_utils_talk_to_a_virtual_drive() {
    let _simulator = Simulator::start(&["--drive", "zlac8030l@4", "--bus", "vcan0"]);
    let candump = Listener::start(Command::new("candump").args(["-L", "vcan0,584:7FF"]));
    // Upload of the device type (1000h), expedited: CiA 301, 7.2.4.3.5. It takes candump a moment to listen.
    let answer = loop {
        run("cansend", &["vcan0", "604#4000100000000000"]);
        // Then it is asked again.
        if let Ok(line) = candump.lines.recv_timeout(Duration::from_millis(500)) {
            break line;
        }
    };
    // Device profile 402 = 192h in the lower half: CiA 402, object 1000h.
    assert!(answer.contains("vcan0 584#430010009201"), "{answer}");
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn a_drive_on_one_controller_is_reached_through_the_other() {
    let _simulator = Simulator::start(&["--drive", "zlac8030l@4", "--bus", "can0"]);
    let found = on("can1", &["--json", "scan"]).json();
    assert_eq!(found["nodes"][0]["node"], 4, "{found}");
    on("can1", &["--model", "4=zlac8030l", "move", "4", "45deg"]);
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn an_interface_that_goes_down_is_waited_for() {
    let simulator = Simulator::start_heard(&["--drive", "zlac8030l@4", "--bus", "vcan1"]);
    let dump = Listener::dump("vcan1");
    set("vcan1", "down");
    let lost = dump.note("connection_lost");
    assert!(lost["text"].as_str().unwrap().contains("ip link set vcan1 up"), "{lost}");
    simulator.error("the connection to the bus is lost: vcan1 is down");
    let refused = ferrodrive(&["--bus", "vcan1", "scan"]);
    assert_eq!(refused.status, Some(1));
    assert!(refused.err.contains("vcan1 is down: ip link set vcan1 up"), "{}", refused.err);
    set("vcan1", "up");
    dump.note("connection_back");
    simulator.error("the connection to the bus is back");
    on("vcan1", &["read", "4", "1000"]);
    dump.find(|value| value["frame"].as_str().is_some_and(|frame| frame.starts_with("584#4300")));
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn an_interface_that_is_removed_and_made_again_is_found_again() {
    run("ip", &["link", "add", "vcan7", "type", "vcan"]);
    set("vcan7", "up");
    let dump = Listener::dump("vcan7");
    run("ip", &["link", "del", "vcan7"]);
    // The kernel takes it down before it removes it.
    dump.note("connection_lost");
    run("ip", &["link", "add", "vcan7", "type", "vcan"]);
    set("vcan7", "up");
    dump.note("connection_back");
    run("cansend", &["vcan7", "123#01"]);
    dump.find(|value| value["frame"] == "123#01");
    run("ip", &["link", "del", "vcan7"]);
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn what_the_controller_reports_is_shown() {
    let dump = Listener::dump("vcan0");
    // Error messages as a driver sends them (linux/can/error.h): flag 20000000h, class, bytes.
    for (message, kind) in [
        ("20000004#0004000000000000", "error_warning"),
        ("20000004#0010000000000000", "error_passive"),
        ("20000040#0000000000000000", "bus_off"),
        ("20000100#0000000000000000", "restarted"),
        ("20000004#0001000000000000", "overrun"),
        ("20000020#0000000000000000", "error_frame"),
    ] {
        run("cansend", &["vcan0", message]);
        dump.note(kind);
    }
    // Stuff errors, one after the other.
    for _ in 0..10 {
        run("cansend", &["vcan0", "20000088#0000040000000000"]);
    }
    dump.note("wrong_bit_rate");
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn fd_frames_are_reported_and_do_no_harm() {
    let dump = Listener::dump("vcan0");
    run("cansend", &["vcan0", "123##1112233"]);
    let note = dump.note("fd_frame");
    assert!(note["text"].as_str().unwrap().contains("123"), "{note}");
    run("cansend", &["vcan0", "124#44"]);
    dump.find(|value| value["frame"] == "124#44");
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn times_are_those_of_the_kernel_however_late_a_frame_is_read() {
    let dump = Listener::dump("vcan0");
    dump.signal("-STOP");
    run("cansend", &["vcan0", "101#"]);
    // The frame waits in the socket: it is read late.
    std::thread::sleep(Duration::from_millis(400));
    run("cansend", &["vcan0", "102#"]);
    dump.signal("-CONT");
    let at = |frame: &str| dump.find(|value| value["frame"] == frame)["t"].as_f64().expect("a number");
    let apart = at("101#") - at("102#");
    assert!(-apart >= 0.4, "{apart}");
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn frames_that_are_not_read_in_time_are_counted() {
    let dump = Listener::dump("vcan0");
    dump.signal("-STOP");
    // A socket of the kernel has room for some hundred frames.
    run("cangen", &["vcan0", "-g", "0", "-n", "5000", "-I", "222", "-L", "8", "-i"]);
    dump.signal("-CONT");
    // The count comes with the first frame that finds room again: one is sent until it does.
    let note = loop {
        run("cansend", &["vcan0", "333#"]);
        // Then one more.
        let lines = std::iter::from_fn(|| dump.lines.recv_timeout(Duration::from_millis(500)).ok());
        let mut values = lines.map(|line| serde_json::from_str::<Value>(&line).expect("JSON"));
        if let Some(note) = values.find(|value| value["note"] == "overrun") {
            break note;
        }
    };
    assert!(note["text"].as_str().unwrap().contains("received frames were lost"), "{note}");
}

/// One frame of node 5 for each of node 4, and what becomes of the identifier of a PDO that is moved while it is heard:
/// objects 1A00h and 1800h, CiA 301, 7.5.2.35 and 7.5.2.37.
#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn a_dump_of_one_node_has_the_kernel_keep_back_the_others() {
    let dump = Listener::start(command(&["--bus", "vcan0", "dump", "--node", "4"]).stderr(Stdio::piped()));
    // Sent again until it listens; a boot-up message is heard by it and no answer to anything.
    while dump.lines.recv_timeout(Duration::from_millis(100)).is_err() {
        run("cansend", &["vcan0", "704#00"]);
    }
    let moved = ["604#23001801BB020000", "584#6000180100000000", "604#2F001A0001000000", "584#60001A0000000000"];
    let mapped = ["604#23001A0110004160", "584#60001A0100000000"];
    for frame in moved.iter().chain(&mapped) {
        run("cansend", &["vcan0", "605#4041600000000000"]);
        run("cansend", &["vcan0", frame]);
    }
    // Its new identifier belongs to no node in the predefined connection set.
    let shown = loop {
        run("cansend", &["vcan0", "2BB#3706"]);
        // Then it is sent again.
        if let Ok(line) = dump.lines.recv_timeout(Duration::from_millis(200))
            && line.contains("2BB#3706")
        {
            break line;
        }
    };
    assert!(shown.contains("TPDO1 node 4: ") && shown.contains("statusword"), "{shown}");
    dump.signal("-INT");
    let mut dump = dump;
    let mut said = String::new();
    dump.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(said.contains("filtered out all but the identifiers of these nodes"), "{said}");
    assert!(!said.contains("5: ") && !said.contains("of them shown"), "a frame of node 5 came through: {said}");
}

/// A queueing discipline that holds each frame for a minute and has room for two takes the place of a controller that gets no
/// frame out: the emulated one has no bus that could be stuck.
#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn a_send_queue_that_nobody_empties_is_said_once() {
    run("tc", &["qdisc", "add", "dev", "vcan1", "root", "netem", "limit", "2", "delay", "60s"]);
    let refused = ferrodrive(&["--bus", "vcan1", "--timeout", "300ms", "scan"]);
    run("tc", &["qdisc", "del", "dev", "vcan1", "root"]);
    assert_eq!(refused.err.matches("the send queue is full").count(), 1, "{}", refused.err);
    assert!(refused.err.contains("txqueuelen"), "{}", refused.err);
    // The bus is as good as before.
    let _simulator = Simulator::start(&["--drive", "zlac8030l@4", "--bus", "vcan1"]);
    on("vcan1", &["read", "4", "1000"]);
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn an_interface_that_is_not_there_or_of_another_kind_is_said_with_those_that_are() {
    for (bus, text) in [("can9", "there is no interface can9"), ("lo", "lo is not a CAN interface")] {
        let refused = ferrodrive(&["--bus", bus, "scan"]);
        assert_eq!(refused.status, Some(1));
        assert!(refused.err.contains(text) && refused.err.contains("vcan0"), "{}", refused.err);
    }
}

/// Gives a line again that the machine did not let run for longer than the drive's watch allows: the drive has stopped then, as it has to.
fn done_when_it_runs(line: &[&str]) {
    loop {
        let ended = ferrodrive(line);
        if ended.status == Some(0) {
            return;
        }
        assert!(ended.err.contains("This program did not run for"), "{line:?}: {}{}", ended.out, ended.err);
    }
}

#[test]
#[ignore = "needs the interfaces of cargo xtask vcan-test"]
fn every_command_of_the_page_ends_well() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/handbook/socketcan.md");
    let page = std::fs::read_to_string(&page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
    let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    // The page makes vcan0, and a scan of can0 needs a node to find.
    run("ip", &["link", "del", "vcan0"]);
    let _other = Simulator::start(&["--drive", "zlac8030l@5", "--bus", "can1"]);
    let mut simulators = Vec::new();
    let mut commands = 0;
    for line in blocks.flat_map(str::lines) {
        let words: Vec<&str> = line.split_whitespace().skip_while(|word| *word == "sudo").collect();
        match words[..] {
            // The guest's modules are loaded.
            ["modprobe", ..] => {}
            ["ferrodrive", "--bus", bus, "sim", ref rest @ ..] => {
                simulators.push(Simulator::start(&[rest, &["--bus", bus]].concat()));
            }
            ["ferrodrive", ref arguments @ ..] => done_when_it_runs(&[&["--timeout", PATIENT], arguments].concat()),
            [program, ref arguments @ ..] => run(program, arguments),
            [] => continue,
        }
        commands += 1;
    }
    drop(simulators);
    // As the other tests want it.
    run("ip", &["link", "set", "vcan0", "down"]);
    run("ip", &["link", "set", "vcan0", "mtu", "72", "up"]);
    assert_eq!(commands, 14);
}

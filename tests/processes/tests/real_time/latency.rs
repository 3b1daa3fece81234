//! `ferrodrive latency` over TCP; `--realtime`.
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use processes::{Simulator, done, ferrodrive};
use serde_json::Value;

fn figure(report: &Value, what: &str, figure: &str) -> f64 {
    report[what][figure].as_f64().unwrap_or_else(|| panic!("{what} {figure} in {report}"))
}

#[test]
fn answers_and_sync_are_measured_over_tcp_and_the_text_has_its_bars() {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on_bus = |arguments: &[&str]| done(&[&["--bus", &bus, "--timeout", "2s"], arguments].concat());
    done(&["--bus", &bus, "--timeout", "10s", "read", "4", "1000"]);
    let report = on_bus(&["--json", "latency", "4", "--count", "30"]).json();
    assert_eq!(figure(&report, "sdo", "count"), 30.0);
    assert!(figure(&report, "sync", "count") >= 30.0, "{report}");
    let text = on_bus(&["latency", "4", "--count", "30"]).out;
    assert!(text.contains("SDO answer") && text.contains("SYNC period") && text.contains('#'), "{text}");
}

#[test]
fn a_tpdo_that_follows_sync_is_measured_and_is_no_faster_than_its_wire() {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on_bus = |arguments: &[&str]| done(&[&["--bus", &bus, "--timeout", "10s"], arguments].concat());
    on_bus(&["read", "4", "1000"]);
    // TPDO1 with 6041h behind each SYNC (1800h:02 = 1).
    for (object, value) in [("1A00:01", "0x60410010"), ("1A00:00", "1"), ("1800:02", "1")] {
        on_bus(&["--model", "4=zlac8030l", "write", "4", object, value]);
    }
    // Without NMT start nothing comes, and that is reported.
    let measured =
        |count: &str| done(&["--bus", &bus, "--timeout", "500ms", "--json", "latency", "4", "--count", count]).json();
    let silent = measured("3");
    assert!(silent["notes"].to_string().contains("operational"), "{silent}");
    on_bus(&["nmt", "4", "start"]);
    let report = measured("30");
    assert!(figure(&report, "pdo", "count") >= 10.0, "{report}");
    // 44 bits and two bytes, without stuff bits, at 500 kbit/s: 120 us. A simulator that got no processor time for a while catches up
    // what it is behind, and then one answer may come sooner by the computer's clock; not half of them.
    assert!(figure(&report, "pdo", "median_us") >= 120.0, "{report}");
}

#[test]
fn a_bus_with_a_motor_switched_on_is_sent_no_sync() {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on_bus = |arguments: &[&str]| done(&[&["--bus", &bus, "--timeout", "2s"], arguments].concat());
    done(&["--bus", &bus, "--timeout", "10s", "read", "4", "1000"]);
    on_bus(&["--model", "4=zlac8030l", "enable", "4"]);
    // Not only the node that is asked counts.
    let report = on_bus(&["--json", "latency", "4", "--count", "10"]).json();
    assert_eq!(report["producer"], Value::Null, "{report}");
    assert!(report["notes"][0].as_str().unwrap().contains("the motor of node 4 is switched on"), "{report}");
}

#[test]
fn real_time_is_entered_or_refused_with_what_to_do() {
    let ended = ferrodrive(&["--realtime", "read", "4", "6064"]);
    assert_eq!(ended.status, Some(2));
    assert!(ended.err.contains("--realtime has no effect on a virtual bus"), "{}", ended.err);
    let drive = ["--realtime", "sim", "--drive", "zlac8030l@4"];
    let ended = ferrodrive(&[&drive[..], &["--speed", "10"]].concat());
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    // A command with an answer, one without, and one that moves and is stopped when it fails.
    let commands: [(&[&str], i32); 3] = [
        (&["--timeout", "10s", "read", "4", "1000"], 0),
        (&["nmt", "4", "start"], 0),
        (&["--model", "4=zlac8030l", "velocity", "4", "30rpm", "--within", "1ms"], 1),
    ];
    for (command, status) in commands {
        let ended = ferrodrive(&[&["--bus", &bus, "--realtime"], command].concat());
        if ended.err.contains("may not") {
            assert!(ended.err.contains("limits.conf"), "{}", ended.err);
            return eprintln!("skipped: {}", ended.err);
        }
        assert_eq!(ended.status, Some(status), "{command:?}: {}", ended.err);
    }
}

/// setpriv and prlimit take away what root has: without CAP_SYS_NICE and a limit for priorities (sched(7)) there is no SCHED_FIFO, without
/// CAP_IPC_LOCK and a limit for locked memory (mlock(2)) no mlockall.
#[cfg(target_os = "linux")]
#[test]
fn a_user_who_may_not_run_in_real_time_is_shown_how_to_allow_it() {
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let without = |limits: &str, capabilities: &str, program: &str, arguments: &[&str]| {
        let mut command = std::process::Command::new("prlimit");
        command.args([limits, "setpriv", &format!("--bounding-set={capabilities}"), "--inh-caps=-all", program]);
        command.args(arguments).stdin(std::process::Stdio::null()).output()
    };
    let refusals = [
        ("--rtprio=0", "-sys_nice,-sys_resource", "SCHED_FIFO"),
        ("--memlock=65536", "-ipc_lock,-sys_resource", "mlockall"),
    ];
    for (limits, capabilities, said) in refusals {
        if !without(limits, capabilities, "true", &[]).is_ok_and(|ended| ended.status.success()) {
            return eprintln!("skipped: setpriv and prlimit do not work here");
        }
        let program = processes::program();
        let ended =
            without(limits, capabilities, program, &["--bus", &bus, "--realtime", "read", "4", "1000"]).unwrap();
        let text = String::from_utf8_lossy(&ended.stderr);
        // Where SCHED_FIFO is not permitted, that is reported first.
        assert_eq!(ended.status.code(), Some(1), "{limits}: {text}");
        assert!(text.contains(said) || text.contains("SCHED_FIFO"), "{limits}: {text}");
        assert!(text.contains("may not") && text.contains("setcap cap_sys_nice") && text.contains("rtprio"), "{text}");
        assert!(text.lines().count() < 8 && !text.contains("panicked"), "{text}");
    }
    // The drive has heard nothing of it, and answers others.
    done(&["--bus", &bus, "--timeout", "10s", "read", "4", "1000"]);
}

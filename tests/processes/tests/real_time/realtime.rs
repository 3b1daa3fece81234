//! `--realtime`: entered, or refused with what to do.
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use processes::{Simulator, done, ferrodrive};

#[test]
fn real_time_is_entered_or_refused_with_what_to_do() {
    let ended = ferrodrive(&["--realtime", "read", "4", "6064"]);
    assert_eq!(ended.status, Some(2));
    assert!(ended.err.contains("--realtime has no effect on a virtual bus"), "{}", ended.err);
    let drive = ["--realtime", "sim", "--drive", "zlac8030l@4"];
    let ended = ferrodrive(&[&drive[..], &["--speed", "10"]].concat());
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    // However late a busy machine looks, the speed is not reached.
    assert_eq!(simulator.ask("4 rotor lock")["ok"], true);
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

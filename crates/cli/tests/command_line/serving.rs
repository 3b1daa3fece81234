//! What `sim`, `run --serve`, `studio` and `top` refuse before they serve anything.

use std::net::TcpListener;
use std::path::PathBuf;
use std::process::Command;

use processes::{Scratch, Simulator, ferrodrive, scratch};

const DRIVE: [&str; 2] = ["--drive", "zlac8030l@4"];

/// A scenario of a ZLAC8030L at node 4 in a directory of the test's own.
fn scenario(name: &str, rest: &str) -> (Scratch, PathBuf) {
    let folder = scratch(name);
    let file = folder.join("scenario.toml");
    std::fs::write(&file, format!("machine = {{ drive = [{{ model = 'zlac8030l', node = 4 }}] }}\n{rest}")).unwrap();
    (folder, file)
}

#[test]
fn what_makes_no_sense_together_is_refused() {
    let (_folder, file) = scenario("served-refused", "end = '1s'\n");
    let file = file.to_str().unwrap();
    for (options, said) in [
        (&["--serve", "socketcand://127.0.0.1:0", "--seeds", "1..3"][..], "a sweep has many"),
        (&["--serve", "socketcand://127.0.0.1:0", "--clock", "manual"], "the time cannot be advanced"),
        (&["--speed", "10"], "--serve"),
        (&["--serve", "nowhere"], "nowhere"),
        (&["--jobs", "2"], "--jobs needs several runs"),
        (&[file, "--serve", "socketcand://127.0.0.1:0"], "takes one scenario, and there are 2"),
        (&[file, "--record", "a.csv"], "takes one scenario, and there are 2"),
    ] {
        let ended = ferrodrive(&[&["run", file], options].concat());
        assert_eq!(ended.status, Some(2), "{options:?}: {}", ended.err);
        assert!(ended.err.contains(said), "{options:?}: {}", ended.err);
    }
}

#[test]
fn only_a_live_bus_given_on_the_command_line_is_joined() {
    let drive = ["sim", "--drive", "zlac8030l@4", "--bus"];
    let ended = ferrodrive(&[&drive[..], &["sim"]].concat());
    assert_eq!(ended.status, Some(2));
    assert!(ended.err.contains("a live bus only"), "{}", ended.err);
    let ended = ferrodrive(&[&drive[..], &["socketcand://127.0.0.1:1/can0"]].concat());
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("cannot connect") && !ended.out.contains("ready"), "{}", ended.err);
}

#[test]
fn a_bus_that_is_not_there_is_a_failure_with_the_reason() {
    let ended = ferrodrive(&["--bus", "socketcand://127.0.0.1:1/can0", "scan"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("cannot connect"), "{}", ended.err);
}

#[test]
fn a_corrupt_image_is_reported_and_not_used() {
    let directory = scratch("corrupt");
    std::fs::write(directory.join("zlac8030l@4.eeprom"), "ferrodrive eeprom 1 zlac8030l 5\nwrong").unwrap();
    let ended = ferrodrive(&[&["sim"], &DRIVE[..], &["--state", directory.to_str().unwrap()]].concat());
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("corrupt") && ended.err.contains("zlac8030l@4.eeprom"), "{}", ended.err);
    assert!(!ended.out.contains("ready"));
}

#[test]
fn everything_that_the_drives_of_a_machine_file_do_not_take_is_told_at_once() {
    let place = scratch("sim-machine-problems");
    let file = place.join("two.toml");
    let drives = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nbattery = true\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n";
    std::fs::write(&file, format!("{drives}inputs = {{ Y9 = true }}\n")).unwrap();
    let ended = ferrodrive(&["sim", "--machine", file.to_str().unwrap(), "--serve", "socketcand://127.0.0.1:0"]);
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    for expected in ["line 4", "has no battery", "line 8", "X0, X1, X2, X3"] {
        assert!(ended.err.contains(expected), "{expected}: {}", ended.err);
    }
}

#[test]
fn an_empty_token_is_none() {
    let refused = ferrodrive(&[&["sim"], &DRIVE[..], &["--control", "127.0.0.1:0", "--control-token", ""]].concat());
    assert_eq!(refused.status, Some(2), "{}", refused.err);
    assert!(refused.err.contains("is empty"), "{}", refused.err);
}

#[test]
fn what_is_no_file_of_ours_is_refused_before_anything_is_written() {
    let place = scratch("foreign");
    let path = |name: &str| place.join(name).to_str().unwrap().to_owned();
    std::fs::create_dir(path("state")).unwrap();
    assert!(Command::new("mkfifo").arg(path("state/zlac8030l@4.eeprom")).status().unwrap().success());
    std::os::unix::fs::symlink(path("state"), path("link")).unwrap();
    std::fs::write(path("letter"), "Dear reader").unwrap();
    assert!(Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
    for (option, name, reason) in [
        ("--state", "state", "a FIFO"),
        ("--state", "link", "a symbolic link"),
        ("--state", "letter", "not a directory"),
        ("--log", "letter", "not a log of the format candump"),
        ("--log", "pipe", "a FIFO"),
        ("--log", "state", "a directory"),
    ] {
        let ended = ferrodrive(&[&["sim"], &DRIVE[..], &[option, &path(name)]].concat());
        assert_eq!(ended.status, Some(1), "{option} {name}");
        assert!(ended.err.contains(reason) && !ended.out.contains("ready"), "{option} {name}: {}", ended.err);
    }
    assert_eq!(std::fs::read(path("letter")).unwrap(), b"Dear reader");
}

#[test]
fn a_pace_that_cannot_be_is_refused_with_what_can() {
    for (arguments, said) in [
        (&["--speed", "0"][..], "0.001 to 100000"),
        (&["--speed", "2", "--clock", "manual"], "cannot be used with"),
        (&["--clock", "none"], "manual"),
        (&["--timing", "slow"], "device or ideal"),
    ] {
        let ended = ferrodrive(&[&["sim"], &DRIVE[..], arguments].concat());
        assert_eq!(ended.status, Some(2), "{arguments:?}");
        assert!(ended.err.contains(said), "{arguments:?}: {}", ended.err);
    }
}

#[test]
fn a_serial_number_is_one_of_a_device_that_has_it() {
    for (drive, reported) in
        [("cia402@4,1018:04=4294967296", "1018h:04 cannot be 4294967296"), ("zlac8030l@4,1018:04=7", "1018h:04")]
    {
        let refused = ferrodrive(&["sim", "--drive", drive]);
        assert_ne!(refused.status, Some(0), "{drive}");
        assert!(refused.err.contains(reported), "{}", refused.err);
    }
}

#[test]
fn a_model_without_lss_does_not_begin_without_a_node_id() {
    let refused = ferrodrive(&["sim", "--drive", "zlac8030l@4,node-id=none"]);
    assert_eq!(refused.status, Some(2));
    assert!(refused.err.contains("a zlac8030l has no LSS"), "{}", refused.err);
}

#[test]
fn elsewhere_takes_a_password_and_says_what_that_means() {
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0"]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    assert!(ended.err.contains("--password-file") && ended.err.contains("can move the drives"), "{}", ended.err);
    let directory = processes::scratch("studio");
    let short = directory.join("short");
    std::fs::write(&short, "hunter2\n").unwrap();
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0", "--password-file", short.to_str().unwrap()]);
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    assert!(ended.err.contains("at least 12"), "{}", ended.err);
    let missing = ferrodrive(&["studio", "--password-file", "/no/such/file"]);
    assert_eq!(missing.status, Some(1), "{}", missing.err);
}

#[test]
fn what_is_no_terminal_is_told_what_to_use() {
    let ended = ferrodrive(&["top"]);
    assert_eq!(ended.status, Some(2));
    assert!(ended.err.contains("not a terminal") && ended.err.contains("ferrodrive watch"), "{}", ended.err);
    let json = ferrodrive(&["--json", "top"]);
    assert_eq!(json.status, Some(2));
    assert!(format!("{}{}", json.out, json.err).contains("--json has no effect on top"), "{}{}", json.out, json.err);
}

#[test]
fn a_place_that_cannot_be_served_is_reported_before_it_is_ready() {
    let ended = ferrodrive(&["sim", "--drive", "m4230e17b50@2", "--modbus", "tcp://here"]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    let ended = ferrodrive(&["sim", "--drive", "m4230e17b50@2", "--modbus", "rtu:///dev/no-such-line"]);
    assert_eq!((ended.status, ended.out.as_str()), (Some(1), ""), "{}", ended.err);
    assert!(ended.err.contains("cannot serve rtu:///dev/no-such-line"), "{}", ended.err);
}

#[test]
fn a_simulator_that_nobody_can_reach_says_so_and_runs() {
    let mut simulator = Simulator::start_heard(&[&DRIVE[..], &["--clock", "manual"]].concat());
    assert_eq!(simulator.ready, "ready");
    assert!(simulator.error("no program can reach").contains("--serve"));
    assert_eq!(simulator.ask("now")["ok"], true);
}

#[test]
fn a_gateway_that_cannot_serve_says_why() {
    let embedded = ferrodrive(&["gateway"]);
    assert!(embedded.status == Some(2) && embedded.err.contains("cannot serve a virtual bus"), "{}", embedded.err);
    // Nothing is asked of the drive, whose time stands.
    let served = ["--clock", "manual", "--serve", "socketcand://127.0.0.1:0"];
    let simulator = Simulator::start(&[&DRIVE[..], &served].concat());
    let bus = simulator.bus("socketcand");
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let place = taken.local_addr().unwrap().to_string();
    let second = ferrodrive(&["--bus", &bus, "gateway", "--listen", &place]);
    assert!(second.status == Some(1) && second.err.contains("cannot listen at"), "{}", second.err);
    // An address of no machine (RFC 5737), and a word that is not an address.
    let nowhere = ferrodrive(&["--bus", &bus, "gateway", "--listen", "192.0.2.1:1"]);
    assert!(nowhere.status == Some(1) && nowhere.err.contains("cannot listen at 192.0.2.1:1"), "{}", nowhere.err);
    let word = ferrodrive(&["--bus", &bus, "gateway", "--listen", "here"]);
    assert!(word.status == Some(2) && word.err.contains("expected HOST:PORT"), "{}", word.err);
}

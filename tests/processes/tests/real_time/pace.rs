//! `ferrodrive sim` whose time passes faster than the clock's, or by hand, and whose drives take their time.

use std::time::{Duration, Instant};

use processes::{Simulator, command, ferrodrive};
use serde_json::{Value, json};

const MANUAL: [&str; 6] = ["--drive", "zlac8030l@4", "--clock", "manual", "--serve", "socketcand://127.0.0.1:0"];

fn simulator(arguments: &[&str]) -> Simulator {
    Simulator::start(&[&MANUAL[..], arguments].concat())
}

#[test]
fn moved_by_hand_time_stands_until_a_run_and_comes_to_where_it_says() {
    let mut simulator = simulator(&[]);
    // Time of the clock in which that of the drives stands.
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(simulator.ask("now")["t"], 0.0);
    assert_eq!(simulator.ask("run 20ms")["t"], 0.02);
    // Time of the clock in which that of the drives stands.
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(simulator.ask("run 5us")["t"], 0.020_005);
    assert_eq!(simulator.ask("run until 1.5s")["t"], 1.5);
    assert_eq!(simulator.ask("run until 1s")["t"], 1.5);
    assert_eq!(simulator.ask("now")["t"], 1.5);
    assert_eq!(simulator.ask("4 get")["behind_ms"], 0);
}

#[test]
fn lines_that_come_during_a_run_are_answered_after_it_each_once_and_in_their_order() {
    let mut simulator = simulator(&[]);
    for line in ["run 3s", "now", "4 power off", "run 1s", "now", "fly", "run 1ms"] {
        simulator.send(line);
    }
    let answers: Vec<Value> =
        (0..7).map(|_| serde_json::from_str(&simulator.line()).expect("a line of JSON")).collect();
    let times: Vec<&Value> = answers.iter().map(|answer| &answer["t"]).collect();
    let refused = &Value::Null;
    assert_eq!(times, [&json!(3.0), &json!(3.0), &json!(3.0), &json!(4.0), &json!(4.0), refused, &json!(4.001)]);
    assert_eq!(answers[2]["power"], "draining");
    assert_eq!(answers[3]["changes"][0]["power"], "off");
    simulator.send("run 1min");
    assert_eq!(simulator.ask("quit")["t"], 64.001, "the run's answer comes first");
    let last: Value = serde_json::from_str(&simulator.line()).expect("a line of JSON");
    assert_eq!(last["ok"], true);
    assert_eq!(simulator.wait(), Some(0));
}

#[test]
fn a_clients_frames_are_taken_while_time_stands_and_go_out_with_the_next_run() {
    let mut simulator = simulator(&[]);
    assert_eq!(simulator.ask("run 500ms")["t"], 0.5);
    let bus = simulator.bus("socketcand");
    let mut client = command(&["--bus", &bus, "--json", "read", "4", "1000h"]).spawn().expect("the binary runs");
    let mut frames = 0;
    // Few of these are needed; the rest is patience on a busy machine.
    for _ in 0..3000 {
        frames += simulator.ask("run 1ms")["frames"].as_u64().expect("a number");
        if let Some(status) = client.try_wait().expect("it can be asked") {
            assert!(status.success());
            assert!(frames >= 2, "a request and its answer");
            return;
        }
        // Looked at again and again.
        std::thread::sleep(Duration::from_millis(5));
    }
    let _ = client.kill();
    panic!("the client got no answer");
}

#[test]
fn a_drive_boots_in_its_time_unless_it_is_to_take_none() {
    let drives = ["--timing", "device", "--drive", "zlim42c@2,timing=ideal"];
    let mut simulator = simulator(&drives);
    let booted = simulator.ask("run 700ms");
    assert_eq!(
        (&simulator.ask("4 get")["power"], &simulator.ask("4 get")["statusword"]),
        (&json!("booting"), &json!(0))
    );
    assert_eq!(simulator.ask("2 get")["power"], "on");
    assert_eq!(booted["changes"], json!([]), "one was on from the beginning, the other boots still");
    let booted = simulator.ask("run 600ms");
    assert_eq!((&booted["changes"][0]["node"], &booted["changes"][0]["power"]), (&json!(4), &json!("on")));
    assert_eq!((&simulator.ask("4 get")["power"], &booted["frames"]), (&json!("on"), &json!(1)), "the boot-up message");
    assert_eq!(simulator.ask("4 power cycle")["power"], "cycling");
    let cycled = simulator.ask("run 20s");
    // It drains through its under-voltage, of which it sends an EMCY, and boots again.
    let powers: Vec<_> = cycled["changes"].as_array().expect("a list").iter().map(|change| &change["power"]).collect();
    assert_eq!((powers, &cycled["frames"]), (vec![&json!("on")], &json!(2)), "{cycled}");
}

#[test]
fn ten_times_as_fast_the_bus_is_ten_times_as_far() {
    const SPEED: f64 = 10.0;
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--speed", "10"]);
    let number = |answer: &Value, key: &str| answer[key].as_f64().expect("a number");
    // What the pace is of.
    let outer = Instant::now();
    let first = simulator.ask("now");
    // What the pace is of.
    let inner = Instant::now();
    // Time of the clock that the two paces are compared over.
    std::thread::sleep(Duration::from_millis(300));
    let inner_s = inner.elapsed().as_secs_f64();
    let second = simulator.ask("now");
    let outer_s = outer.elapsed().as_secs_f64();
    // Where the bus is and how far it is behind make where it should be. Both are given in whole milliseconds.
    let (reached, behind) = (number(&second, "t") - number(&first, "t"), number(&second, "behind_ms") * 1e-3);
    let behind_at_first = number(&first, "behind_ms") * 1e-3;
    assert!(
        reached + behind >= SPEED * inner_s - behind_at_first - 0.002,
        "{reached} s of {inner_s} s, {behind} s behind"
    );
    assert!(reached <= SPEED * outer_s + behind_at_first + 0.002, "{reached} s of {outer_s} s");
}

#[test]
fn as_fast_as_it_can_it_serves_clients_between_its_steps() {
    let place = ["--drive", "zlac8030l@4", "--speed", "max", "--serve", "socketcand://127.0.0.1:0"];
    let simulator = Simulator::start(&place);
    let read = ferrodrive(&["--bus", &simulator.bus("socketcand"), "--json", "read", "4", "1000h"]);
    assert_eq!(read.status, Some(0), "{}", read.err);
}

#[test]
fn what_cannot_be_is_refused_with_what_can() {
    let drive = ["sim", "--drive", "zlac8030l@4"];
    for (arguments, said) in [
        (&["--speed", "0"][..], "0.001 to 100000"),
        (&["--speed", "2", "--clock", "manual"], "cannot be used with"),
        (&["--clock", "none"], "manual"),
        (&["--timing", "slow"], "device or ideal"),
    ] {
        let ended = ferrodrive(&[&drive[..], arguments].concat());
        assert_eq!(ended.status, Some(2), "{arguments:?}");
        assert!(ended.err.contains(said), "{arguments:?}: {}", ended.err);
    }
    let mut simulator = Simulator::start(&drive[1..]);
    let refused = simulator.ask("run 20ms");
    assert!(refused["error"]["message"].as_str().is_some_and(|error| error.contains("--clock manual")), "{refused}");
    let refused = simulator.ask("run fast");
    assert!(refused["error"]["message"].as_str().is_some_and(|error| error.contains("run 20ms")), "{refused}");
}

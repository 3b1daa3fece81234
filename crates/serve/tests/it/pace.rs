//! Time that passes faster than the clock's, or by hand, and drives that take theirs.

use std::time::Duration;

use can::Instant;
use serde_json::{Value, json};
use serve::pacer::{Clock, Pacer, Speed};
use serve::service::Request;
use transport::RealTimeWorld;

use crate::bench::{Bench, SERVO, built, world};

fn by_hand() -> Pacer {
    Pacer::new(Clock::Manual, Speed::Times(1.0))
}

#[test]
fn moved_by_hand_time_stands_until_a_run_and_comes_to_where_it_says() {
    let mut bench = Bench::new(world(SERVO), by_hand());
    let mut ask = |line: &str| {
        // Time of the clock in which that of the drives stands.
        bench.clock += Duration::from_secs(50);
        bench.turn();
        bench.ask(line)
    };
    assert_eq!(ask("now")["t"], 0.0);
    assert_eq!(ask("run 20ms")["t"], 0.02);
    assert_eq!(ask("run 5us")["t"], 0.020_005);
    assert_eq!(ask("run until 1.5s")["t"], 1.5);
    assert_eq!(ask("run until 1s")["t"], 1.5);
    assert_eq!(ask("now")["t"], 1.5);
    assert_eq!(ask("4 get")["behind_ms"], 0);
}

#[test]
fn lines_that_come_during_a_run_are_answered_after_it_each_once_and_in_their_order() {
    let mut bench = Bench::new(world(SERVO), by_hand());
    let answers = bench.type_all(&["run 3s", "now", "4 power off", "run 1s", "now", "fly", "run 1ms"]);
    let times: Vec<&Value> = answers.iter().map(|answer| &answer["t"]).collect();
    let refused = &Value::Null;
    assert_eq!(times, [&json!(3.0), &json!(3.0), &json!(3.0), &json!(4.0), &json!(4.0), refused, &json!(4.001)]);
    assert_eq!(answers[2]["power"], "draining");
    assert_eq!(answers[3]["changes"][0]["power"], "off");
    let last = bench.type_all(&["run 1min", "quit"]);
    assert_eq!((&last[0]["t"], &last[1]["ok"]), (&json!(64.001), &json!(true)), "the run's answer comes first");
    assert_eq!(bench.ended, Some(Ok(())));
}

#[test]
fn a_clients_frames_are_taken_while_time_stands_and_go_out_with_the_next_run() {
    let mut bench = Bench::new(world(SERVO), by_hand());
    bench.ask("run 500ms");
    bench.heard();
    bench.join(1);
    bench.send(1, "604#4000100000000000");
    bench.clock = Instant::from_secs(100);
    bench.turn();
    assert_eq!(bench.heard(), [""; 0], "time stands");
    let run = bench.ask("run 10ms");
    let heard = bench.heard();
    assert_eq!(heard[0], "604#4000100000000000");
    // 1000h: device profile 402, a servo drive (CiA 402-1).
    assert!(heard[1].starts_with("584#43001000"), "{heard:?}");
    assert_eq!(run["frames"], 2);
}

#[test]
fn a_drive_boots_in_its_time_unless_it_is_to_take_none() {
    let ideal = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\noptions = { timing = 'ideal' }\n";
    let mut bench = Bench::new(built(&format!("timing = 'device'\n{SERVO}{ideal}")), by_hand());
    let booted = bench.ask("run 700ms");
    let got = bench.ask("4 get");
    assert_eq!((&got["power"], &got["statusword"]), (&json!("booting"), &json!(0)));
    assert_eq!(bench.ask("2 get")["power"], "on");
    assert_eq!(booted["changes"], json!([]), "one was on from the beginning, the other boots still");
    let booted = bench.ask("run 600ms");
    assert_eq!((&booted["changes"][0]["node"], &booted["changes"][0]["power"]), (&json!(4), &json!("on")));
    assert_eq!((&bench.ask("4 get")["power"], &booted["frames"]), (&json!("on"), &json!(1)), "the boot-up message");
    assert_eq!(bench.ask("4 power cycle")["power"], "cycling");
    let cycled = bench.ask("run 20s");
    // It drains through its under-voltage, of which it sends an EMCY, and boots again.
    let powers: Vec<_> = cycled["changes"].as_array().expect("a list").iter().map(|change| &change["power"]).collect();
    assert_eq!((powers, &cycled["frames"]), (vec![&json!("on")], &json!(2)), "{cycled}");
}

#[test]
fn ten_times_as_fast_the_bus_is_ten_times_as_far() {
    let mut bench = Bench::new(world(SERVO), Pacer::new(Clock::Real, Speed::Times(10.0)));
    for clock_ms in [0, 1, 300, 1234] {
        bench.clock = Instant::from_millis(clock_ms);
        bench.turn();
        let now = bench.ask("now");
        assert_eq!((now["t"].as_f64(), &now["behind_ms"]), (Some(clock_ms as f64 / 100.0), &json!(0)));
    }
}

#[test]
fn as_fast_as_it_can_it_serves_clients_between_its_steps() {
    let mut bench = Bench::new(world(SERVO), Pacer::new(Clock::Real, Speed::Max));
    bench.join(1);
    bench.turn();
    bench.send(1, "604#4000100000000000");
    let sent = bench.served.now();
    let mut heard = Vec::new();
    for _ in 0..20 {
        let before = bench.served.now();
        bench.turn();
        assert_eq!(bench.served.now(), before + Duration::from_millis(1), "the clock stands");
        heard.extend(bench.heard());
    }
    assert!(heard.iter().any(|frame| frame.starts_with("584#")), "{heard:?} within 20 ms after {sent:?}");
    // Without a client it goes with the clock.
    bench.leave(1);
    let stood = bench.served.now();
    bench.clock += Duration::from_millis(5);
    bench.turn();
    bench.clock += Duration::from_millis(5);
    bench.turn();
    assert_eq!(bench.served.now(), stood + Duration::from_millis(5));
}

#[test]
fn a_run_is_refused_where_time_passes_by_itself_and_one_that_is_not_a_time_anywhere() {
    let mut bench = Bench::new(world(SERVO), Pacer::new(Clock::Real, Speed::Times(1.0)));
    let message = |answer: Value| answer["error"]["message"].as_str().expect("an error").to_owned();
    let refused = message(bench.ask("run 20ms"));
    assert!(refused.contains("--clock manual"), "{refused}");
    let refused = message(bench.ask("run fast"));
    assert!(refused.contains("run 20ms"), "{refused}");
}

#[test]
fn quit_ends_a_run_that_would_take_for_ever_in_the_end_and_at_once_if_said_twice() {
    /// A run that no test would wait for.
    const LONG: &str = "run 10000min";
    let mut bench = Bench::new(world(SERVO), by_hand());
    for line in [LONG, "4 supply 30", LONG, "quit", "quit"] {
        bench.request(Request::Line(line.to_owned()));
    }
    let answers = bench.said();
    let is_ok: Vec<bool> = answers.iter().map(|answer| answer["ok"] == true).collect();
    assert_eq!(is_ok, [false, true, false, true], "{answers:#?}");
    assert!(answers[0]["error"]["message"].as_str().unwrap().contains("the run was ended at"), "{answers:#?}");
    assert_eq!(bench.ended, Some(Ok(())));
    // Said once it waits for 10 s of the clock, by which the records are looked for 100 times.
    let mut waits = Bench::new(world(SERVO), by_hand());
    for line in [LONG, "quit"] {
        waits.request(Request::Line(line.to_owned()));
    }
    for turn in 0..100 {
        assert_eq!(waits.ended, None, "turn {turn}");
        waits.request(Request::Keep);
    }
    let answers = waits.said();
    assert_eq!((&answers[0]["ok"], &answers[1]["ok"]), (&json!(false), &json!(true)), "{answers:?}");
    assert_eq!(waits.ended, Some(Ok(())));
}

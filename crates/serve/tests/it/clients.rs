//! Clients of the bus and of the control connection that contradict each other, or go in the middle.

use serde_json::{Value, json};
use serve::pacer::{Clock, Pacer, Speed};
use transport::RealTimeWorld;

use crate::bench::{Bench, SERVO, lines, world};

fn by_hand() -> Bench {
    Bench::new(world(SERVO), Pacer::new(Clock::Manual, Speed::Times(1.0)))
}

#[test]
fn a_run_ends_with_the_client_that_asked_for_it() {
    let mut bench = by_hand();
    let _one = bench.control(1);
    let two = bench.control(2);
    bench.says(1, r#"{"request":"run","for":"1000min"}"#);
    assert!(bench.served.is_running());
    bench.says(2, "run 1ms");
    assert_eq!(lines(&two)[0]["error"]["kind"], "clock");
    bench.request(serve::service::Request::Control(serve::control::ControlMessage::Left(1)));
    assert!(!bench.served.is_running());
    let stood = bench.served.now();
    bench.turn();
    assert_eq!(bench.served.now(), stood, "time stands");
    bench.says(2, "run 1ms");
    bench.turn();
    assert_eq!(lines(&two)[0]["ok"], true);
    assert_eq!(bench.served.now(), stood + std::time::Duration::from_millis(1));
}

#[test]
fn of_two_clients_that_contradict_the_last_wins_and_both_hear_who_it_was() {
    let mut bench = by_hand();
    let outboxes = [bench.control(1), bench.control(2)];
    for (number, name) in [(1, "one"), (2, "two")] {
        bench.says(number, &json!({ "request": "hello", "name": name }).to_string());
        bench.says(number, r#"{"request":"subscribe","events":{"kinds":["stimulus"]}}"#);
    }
    outboxes.iter().for_each(|outbox| drop(lines(outbox)));
    for _ in 0..20 {
        bench.says(1, "4 supply 30");
        bench.says(2, "4 supply 31");
    }
    let heard = outboxes.each_ref().map(|outbox| {
        let all = lines(outbox);
        let (events, answers): (Vec<Value>, Vec<Value>) = all.into_iter().partition(|line| line.get("event").is_some());
        assert!(answers.len() == 20 && answers.iter().all(|answer| answer["ok"] == true), "{answers:?}");
        let stimuli = events.iter().map(|line| (line["event"]["words"].clone(), line["event"]["by"].clone()));
        stimuli.collect::<Vec<_>>()
    });
    assert_eq!(heard[0], heard[1]);
    assert_eq!((heard[0].len(), &heard[0][39]), (40, &(json!("supply 31"), json!("two"))));
    bench.says(1, r#"{"id":9,"request":"run","for":"1s"}"#);
    bench.turn();
    assert_eq!(lines(&outboxes[0])[0]["id"], 9);
    let volts = bench.ask("4 get")["supply_v"].as_f64().expect("a voltage");
    assert!((volts - 31.0).abs() < 0.5, "{volts}");
}

#[test]
fn frames_of_clients_that_come_and_go_are_given_up_within_a_bound_and_counted() {
    let mut bench = by_hand();
    for client in 1..=300 {
        bench.join(client);
        (0..64).for_each(|_| bench.send(client, "300#0102030405060708"));
        bench.leave(client);
    }
    let lost = bench.ask("now")["frames_lost"].as_u64().expect("a number");
    // 4096 wait at most; one is under way.
    assert_eq!(lost, 300 * 64 - 4096 - 1);
    let warned = bench.warned();
    assert_eq!(warned.len(), 1, "said once: {warned:?}");
    assert!(warned[0].contains("more frames behind than the bus can carry"), "{warned:?}");
    // What has found room goes out.
    bench.ask("run 10s");
    assert_eq!(bench.heard().iter().filter(|frame| frame.starts_with("300#")).count(), 4097);
}

#[test]
fn clients_that_make_room_are_spoken_of_once() {
    let mut bench = by_hand();
    for client in 1..=3 {
        bench.join(client);
        bench.make_room(client);
    }
    let warned = bench.warned();
    assert!(warned.len() == 1 && warned[0].contains("idle make room"), "{warned:?}");
}

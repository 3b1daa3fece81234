//! A scenario whose host is a client of the bus.

use can::Instant;
use serde_json::Value;
use serve::pacer::{Clock, Pacer, Speed};
use transport::RealTimeWorld;

use crate::bench::Bench;

const MACHINE: &str = "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\n";

fn by_hand(rest: &str) -> Bench {
    Bench::following(&format!("{MACHINE}{rest}"), Pacer::new(Clock::Manual, Speed::Times(1.0)))
}

/// The outcome of one that is at its end.
fn outcome(bench: Bench) -> scenario::Outcome {
    assert_eq!(bench.ended, Some(Ok(())), "it is over");
    let (mut world, execution) = bench.served.into_course();
    execution.expect("it has one").conclude(&mut world)
}

#[test]
fn time_begins_with_the_first_client_and_what_is_open_at_the_limit_has_failed() {
    let pacer = Pacer::new(Clock::Real, Speed::Times(1.0)).waiting_for_a_client();
    let scenario = format!("{MACHINE}limit = '300ms'\n[[expect]]\nthat = '4 velocity > 5'\n");
    let mut bench = Bench::following(&scenario, pacer);
    bench.clock = Instant::from_secs(5);
    bench.turn();
    assert_eq!((bench.served.now(), &bench.ended), (Instant::ZERO, &None), "time stands still until a client comes");
    bench.join(1);
    for ms in 0..400 {
        bench.clock = Instant::from_millis(5000 + ms);
        bench.turn();
    }
    let outcome = outcome(bench);
    assert!(!outcome.passed());
    assert_eq!(
        (outcome.end, outcome.rows[0].seen.as_str()),
        (Instant::from_millis(300), "not by the end of the run: 0 r/min")
    );
}

#[test]
fn a_host_outside_meets_what_the_scenario_does_to_its_drive_and_the_end_is_that_of_the_scenario() {
    let mut bench = by_hand(
        "limit = '60s'\n[[step]]\nname = 'brown-out'\nwhen = '4 event target reached'\ndo = '4 supply 12'\n\
         [[expect]]\nthat = '4 event fault 0x0002'\nafter = 'brown-out'\nwithin = '200ms'\n\
         [[expect]]\nthat = '4 velocity = 60 +- 15'\n",
    );
    bench.join(1);
    bench.ask("run 1s");
    // Profile velocity, shutdown, switch on, enable operation, 60 r/min (CiA 402-2).
    for frame in ["2F60600003000000", "2B40600006000000", "2B40600007000000", "2B4060000F000000", "23FF60003C000000"] {
        bench.send(1, &format!("604#{frame}"));
        bench.ask("run 20ms");
    }
    bench.request(serve::service::Request::Line("run 60s".into()));
    bench.turn();
    let outcome = outcome(bench);
    assert!(outcome.passed(), "{:?}", outcome.rows);
    let fault = outcome.rows.iter().find(|row| row.asked == "4 event fault 0x0002").expect("a row");
    assert!(fault.seen.starts_with("node 4: fault 0002h"), "{fault:?}");
    assert!(outcome.end < Instant::from_secs(10), "all that is expected has been seen: {:?}", outcome.end);
}

#[test]
fn the_adapter_of_a_host_outside_can_be_cut_and_joined() {
    let mut bench = by_hand(
        "end = '3s'\n[[step]]\nname = 'cut'\nat = '1s'\ndo = 'host cut'\n[[step]]\nname = 'join'\nat = '2s'\ndo = 'host join'\n\
         [[expect]]\nnever = 'frame 604#'\nafter = 'cut'\nuntil = '2s'\n[[expect]]\nthat = 'frame 584#'\nafter = 'join'\n",
    );
    bench.join(1);
    bench.ask("run until 1.5s");
    bench.heard();
    bench.send(1, "604#4041600000000000");
    // The boot-up message was heard before the cut; of the answer nothing is before the cable is joined again.
    bench.ask("run until 1.9s");
    assert_eq!(bench.heard(), [""; 0]);
    bench.ask("run until 2.9s");
    let heard = bench.heard();
    assert!(heard.iter().any(|frame| frame.starts_with("584#")), "{heard:?}");
    bench.request(serve::service::Request::Line("run until 4s".into()));
    bench.turn();
    let outcome = outcome(bench);
    assert!(outcome.passed(), "{:?}", outcome.rows);
    assert_eq!(outcome.end, Instant::from_secs(3));
}

#[test]
fn moved_by_hand_two_runs_are_the_same_to_the_last_frame() {
    let digest = |looks_ms: &[u64]| {
        let mut bench = by_hand("end = '1s'\n[[step]]\nat = '500ms'\ndo = '4 supply 12'\n");
        bench.request(serve::service::Request::Line("run 5s".into()));
        // However often the clock lets the loop turn.
        for clock_ms in looks_ms {
            bench.clock = Instant::from_millis(*clock_ms);
            bench.turn();
        }
        let answers: Vec<Value> = bench.said();
        assert_eq!(answers[0]["t"], 1.0, "{answers:?}");
        let outcome = outcome(bench);
        assert_eq!(outcome.end, Instant::from_secs(1));
        outcome.digest
    };
    assert_eq!(digest(&[0]), digest(&[3, 700, 9000]));
}

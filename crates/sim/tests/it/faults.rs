//! Faults of single nodes, and seeds.

use std::time::Duration;

use crate::common::{Chatter, frame, heard, texts};
use can::{Bitrate, Instant};
use sim::World;
use sim::fault::{Babble, Corruption, Delay, NodeFaults, Overrun};
use sim::wire::ErrorState;

fn at_ms(millis: u64) -> Instant {
    Instant::from_millis(millis)
}

#[test]
fn a_silent_node_sends_nothing_acknowledges_nothing_and_hears() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_node_faults(b, NodeFaults { silent: true, ..NodeFaults::default() });
    world.send(b, frame("704#05")).unwrap();
    world.run_until(at_ms(2));
    assert!(texts(&world).is_empty());
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(50));
    assert_eq!(world.counters(a).state(), ErrorState::ErrorPassive, "it is not acknowledged");
    let c = world.add_probe();
    world.run_until(at_ms(51));
    assert_eq!(heard(&mut world, b), ["123#"]);
    world.set_node_faults(b, NodeFaults::default());
    world.run_until(at_ms(52));
    assert_eq!(heard(&mut world, c), ["123#", "704#05"]);
}

#[test]
fn a_late_node_answers_late_and_in_order() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    let late = Some(Delay::fixed(5_000_000));
    world.set_node_faults(a, NodeFaults { late, ..NodeFaults::default() });
    world.send(a, frame("704#05")).unwrap();
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(10));
    assert_eq!(crate::common::frames(&world)[0].0, 6_000_000);
    // Both were ready at once: an order by priority, as in any controller.
    assert_eq!(heard(&mut world, b), ["123#", "704#05"]);

    let late = Some(Delay { min_ns: 1_000_000, max_ns: 9_000_000 });
    world.set_node_faults(a, NodeFaults { late, ..NodeFaults::default() });
    let sent: Vec<String> = (0..20u8).map(|n| format!("123#{n:02X}")).collect();
    for text in &sent {
        world.send(a, frame(text)).unwrap();
        world.run_for(Duration::from_micros(500));
    }
    world.run_for(Duration::from_millis(20));
    assert_eq!(heard(&mut world, b), sent);
}

#[test]
fn a_babbling_node_starves_the_less_urgent_and_not_the_more_urgent() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    let babble = Some(Babble { frame: frame("100#"), gap_ns: 0 });
    world.set_node_faults(a, NodeFaults { babble, ..NodeFaults::default() });
    world.send(b, frame("704#05")).unwrap();
    world.send(c, frame("000#0104")).unwrap();
    world.run_until(at_ms(101));
    let seen = texts(&world);
    assert!(!seen.contains(&"704#05".to_string()));
    assert!(seen[..2].contains(&"000#0104".to_string()));
    let load = world.statistics().load_since(&Default::default());
    assert!(load > 0.98, "{load}");
    world.set_node_faults(a, NodeFaults::default());
    world.run_until(at_ms(102));
    assert_eq!(texts(&world).last().unwrap(), "704#05");
}

#[test]
fn a_slow_receiver_loses_what_its_buffer_cannot_hold() {
    let mut world = World::new(Bitrate::M1, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    let overrun = Some(Overrun { depth: 3, service_ns: 10_000_000 });
    world.set_node_faults(b, NodeFaults { overrun, ..NodeFaults::default() });
    for n in 0..6 {
        world.send(a, frame(&format!("12{n}#"))).unwrap();
    }
    world.run_until(at_ms(5));
    assert_eq!(heard(&mut world, b), ["120#", "121#", "122#"]);
    assert_eq!(world.overruns(b), 3);
    // It acknowledged them all.
    assert_eq!(world.counters(a).tec(), 0);
    world.run_until(at_ms(100));
    world.send(a, frame("126#")).unwrap();
    world.run_until(at_ms(101));
    assert_eq!(heard(&mut world, b), ["126#"]);
}

/// Ten nodes that talk, one late and one babbling, on a bus that loses one frame in twenty.
fn noisy_world(seed: u64) -> World {
    let mut world = World::new(Bitrate::K500, seed);
    for n in 0..10u16 {
        let period = Duration::from_micros(3_000 + 170 * u64::from(n));
        let text = format!("{:03X}#{:02X}00000000", 0x180 + n, n);
        let id = world.add_station(Chatter::new(frame(&text), at_ms(1), period));
        if n == 3 {
            let late = Some(Delay { min_ns: 0, max_ns: 2_000_000 });
            world.set_node_faults(id, NodeFaults { late, ..NodeFaults::default() });
        }
        if n == 4 {
            let babble = Some(Babble { frame: frame("7FF#"), gap_ns: 1_300_000 });
            world.set_node_faults(id, NodeFaults { babble, ..NodeFaults::default() });
        }
    }
    world.set_corruption(Corruption::with_probability(0.05));
    world
}

#[test]
fn the_same_seed_gives_the_same_run_and_another_seed_another() {
    let run = |seed| {
        let mut world = noisy_world(seed);
        world.run_until(at_ms(2_000));
        (world.digest(), crate::common::frames(&world))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
}

#[test]
fn the_size_of_the_strides_does_not_matter() {
    let mut whole = noisy_world(5);
    whole.run_until(at_ms(500));
    let mut steps = noisy_world(5);
    (0..5_000).for_each(|_| steps.run_for(Duration::from_micros(100)));
    assert_eq!(whole.digest(), steps.digest());
    assert_eq!(crate::common::frames(&whole), crate::common::frames(&steps));
}

#[test]
fn a_snapshot_resumes_with_identical_results_as_often_as_wanted() {
    let mut world = noisy_world(7);
    world.run_until(at_ms(321));
    let snapshot = world.snapshot();
    world.run_until(at_ms(900));
    for _ in 0..2 {
        let mut again = snapshot.clone();
        assert_eq!(again.now(), at_ms(321));
        again.run_until(at_ms(900));
        assert_eq!(again.digest(), world.digest());
    }
}

#[test]
fn about_the_asked_share_of_frames_is_disturbed_and_none_is_lost() {
    let mut world = World::new(Bitrate::M1, 11);
    let a = world.add_station(Chatter::new(frame("181#00"), at_ms(1), Duration::from_millis(1)));
    let b = world.add_station(Chatter::new(frame("182#00"), Instant::FAR_FUTURE, Duration::ZERO));
    world.set_corruption(Corruption::with_probability(0.1));
    world.run_until(Instant::from_secs(20));
    let statistics = world.statistics();
    // 20 000 frames; failures are geometric: 1/9 of that, and far from five standard deviations (about 250).
    assert!((statistics.errors as f64 - 20_000.0 / 9.0).abs() < 250.0, "{}", statistics.errors);
    let sent = world.station::<Chatter>(a).unwrap().transmitted;
    assert_eq!(world.station::<Chatter>(b).unwrap().heard, sent);
    assert!(sent >= 19_999);
}

/// ISO 11898-1, fault confinement: each transmit error counts 8, above 255 a node is off the bus, and 128 times 11 recessive
/// bits later it is back.
#[test]
fn a_bad_contact_drives_its_own_node_off_the_bus_and_mended_it_comes_back() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_node_faults(a, NodeFaults { corrupt: 1.0, ..NodeFaults::default() });
    world.send(a, frame("704#05")).unwrap();
    world.send(b, frame("123#")).unwrap();
    while world.counters(a).state() != ErrorState::BusOff {
        assert!(world.step(), "it fails for ever");
    }
    assert_eq!(world.statistics().errors, 32);
    assert_eq!(heard(&mut world, a), ["123#"], "the others' frames get through");
    let off = world.now();
    world.set_node_faults(a, NodeFaults::default());
    while world.counters(a).state() == ErrorState::BusOff {
        assert!(world.step(), "it stays off for ever");
    }
    assert!(
        world.now().nanos_since(off) >= 128 * 11 * 2_000 - 20 * 2_000,
        "the last of its bits may be recessive already"
    );
    world.run_until(at_ms(20));
    assert_eq!(heard(&mut world, b), ["704#05"]);
}

#[test]
fn faults_of_the_bus_are_world_commands_too() {
    let mut world = World::new(Bitrate::K500, 1);
    let id = world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1))).unwrap();
    world.add_probe(); // a node has to acknowledge
    let mut say = |line: &str| {
        let answer = sim::command::answer(&mut world, line).unwrap().json;
        assert!(answer.starts_with("{\"ok\":true"), "{line}: {answer}");
        world.node_faults(id).clone()
    };
    let faults = say("4 bus late 5 20");
    assert_eq!(faults.late, Some(Delay { min_ns: 5_000_000, max_ns: 20_000_000 }));
    let faults = say("4 bus babble 080# 0.5");
    assert!(faults.late.is_some() && faults.babble == Some(Babble { frame: frame("080#"), gap_ns: 500_000 }));
    assert!(say("4 bus silent on").silent && !say("4 bus silent off").silent);
    assert_eq!(say("4 bus late 5000µs 0.02s").late, faults.late, "times with their units");
    assert_eq!(say("4 bus late off").late, None);
    say("4 bus babble off");
    // The boot-up message is the first frame: destroyed once, it comes again.
    say("bus destroy 1 20");
    world.run_until(at_ms(2_000));
    assert_eq!((world.statistics().errors, texts(&world)), (1, vec!["704#00".to_owned()]));
}

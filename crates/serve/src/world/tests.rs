//! A served world that a test moves.

use sim::machine::zlac8030l;

use super::super::pacer::{Clock, Speed};
use super::*;

/// 2000h, which is stored with each write, becomes 700.
const WRITE_700: &str = "604#2B002000BC020000";

#[test]
fn moved_by_hand_time_stands_while_an_answer_waits_for_the_disk_so_that_none_shows_in_it() {
    let mut ends = Vec::new();
    for disk_ms in [0, 30, 200] {
        let mut world = World::new(Bitrate::K500, 1);
        let host = world.add_probe();
        world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the first");
        let pacer = Pacer::new(Clock::Manual, Speed::Times(1.0));
        let mut served = ServedWorld::new(world, pacer, false, Messages::silent());
        let (store_writer, kept) = StoreWriter::by_hand();
        served.keep_stores(store_writer);
        let turn = |served: &mut ServedWorld, clock_ms: u64| {
            let target = served.target(Instant::from_millis(clock_ms)).max(served.now());
            served.advance_to(target);
        };
        assert!(matches!(served.command("run 500ms"), Commanded::Begun));
        turn(&mut served, 1);
        served.take_run().expect("it is over");
        served.world.send(host, WRITE_700.parse().expect("a frame")).expect("a probe");
        assert!(matches!(served.command("run 1s"), Commanded::Begun));
        turn(&mut served, 2);
        let stood = served.now();
        assert!(stood < Instant::from_millis(1500), "{stood:?}: it waits for the disk");
        assert!(served.clock_at(stood).is_none() && served.wakes_at() == Some(Instant::from_millis(252)));
        turn(&mut served, 2 + disk_ms);
        assert_eq!((served.now(), served.take_run()), (stood, None));
        let (number, generation) = served.world.held_answers().next().expect("an answer waits");
        kept(number, generation);
        // One turn to take that in, one to go on.
        turn(&mut served, 3 + disk_ms);
        turn(&mut served, 3 + disk_ms);
        assert!(served.take_run().is_some_and(|answer| answer.contains("1.5")), "the run ends where it was to");
        let heard = std::iter::from_fn(|| served.take_heard());
        ends.push(heard.map(|heard| format!("{heard:?}")).collect::<Vec<_>>());
    }
    assert!(ends.iter().all(|end| *end == ends[0]), "the same frames at the same times: {ends:#?}");
    assert!(ends[0].iter().any(|heard| heard.contains("584")), "{:?}", ends[0]);
}

#[test]
fn an_error_on_the_wire_is_heard_by_clients() {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_probe();
    world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the first");
    let pacer = Pacer::new(Clock::Manual, Speed::Times(1.0));
    let mut served = ServedWorld::new(world, pacer, false, Messages::silent());
    assert!(matches!(served.command("bus corrupt 0.5"), Commanded::Done(_)));
    // Its boot-up message goes out until it gets through.
    assert!(matches!(served.command("run 3s"), Commanded::Begun));
    let target = served.target(Instant::from_millis(1));
    served.advance_to(target);
    let disturbed = served.world.statistics().errors;
    let heard: Vec<Heard> = std::iter::from_fn(|| served.take_heard()).collect();
    let errors = heard.iter().filter(|heard| matches!(heard, Heard::Error { .. })).count();
    assert!(errors > 0 && errors as u64 == disturbed, "{errors} of {disturbed}: {heard:?}");
}

#[test]
fn what_a_node_behind_a_cut_cable_tries_is_not_heard_by_clients() {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_probe();
    for node in [4, 5] {
        world.add_drive(node, Box::new(zlac8030l(node, 1))).expect("another");
    }
    let pacer = Pacer::new(Clock::Manual, Speed::Times(1.0));
    let mut served = ServedWorld::new(world, pacer, false, Messages::silent());
    // It boots alone: its boot-up message is never acknowledged.
    for command in ["4 cable cut", "4 power cycle"] {
        assert!(matches!(served.command(command), Commanded::Done(_)), "{command}");
    }
    assert!(matches!(served.command("run 3s"), Commanded::Begun));
    let target = served.target(Instant::from_millis(1));
    served.advance_to(target);
    let heard: Vec<_> = std::iter::from_fn(|| served.take_heard()).collect();
    assert!(!heard.iter().any(|heard| matches!(heard, Heard::Error { .. })), "{heard:?}");
    // That of the other was.
    let is_boot_up = |heard: &&Heard| matches!(heard, Heard::Carried { frame, .. } if frame.to_string() == "705#00");
    assert_eq!(heard.iter().filter(is_boot_up).count(), 1, "{heard:?}");
}

/// CAN has no means against two nodes that send the same frame at the same time: both have sent it (ISO 11898-1). A client whose frame
/// was one of them is served, and the next ones of it too.
#[test]
fn a_frame_that_a_drive_sends_as_well_at_the_same_time_is_the_clients_too() {
    let mut world = World::new(Bitrate::K500, 1);
    let drive = world.add_probe();
    world.add_probe();
    let pacer = Pacer::new(Clock::Manual, Speed::Times(1.0));
    let mut served = ServedWorld::new(world, pacer, false, Messages::silent());
    let client = ClientId::of(7);
    let frames: [Frame; 2] = ["707#05", "604#4041600000000000"].map(|text| text.parse().expect("a frame"));
    served.world.send(drive, frames[0]).expect("a probe");
    frames.iter().for_each(|frame| served.inject(client, frame));
    assert!(matches!(served.command("run 10ms"), Commanded::Begun));
    let target = served.target(Instant::from_millis(1));
    served.advance_to(target);
    let heard = std::iter::from_fn(|| served.take_heard()).filter_map(|heard| match heard {
        Heard::Carried { frame, from, .. } => Some((frame, from)),
        _ => None,
    });
    assert_eq!(heard.collect::<Vec<_>>(), frames.map(|frame| (frame, Some(client))));
}

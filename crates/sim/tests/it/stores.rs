//! Guarded stores: what a drive answers after a store waits until it has been kept, and nothing else waits.

use std::time::Duration;

use can::{Bitrate, Frame, Instant};
use sim::machine::zlac8030l;
use sim::{StationId, World};

/// 2000h, which is stored with each write (2010h is 0 as delivered), becomes 700 or 701.
const WRITE_700: &str = "604#2B002000BC020000";
const WRITE_701: &str = "604#2B002000BD020000";
/// The node's heartbeat every 10 ms: 1017h is stored too.
const BEAT: &str = "604#2B1710000A000000";
const READ: &str = "604#4000200000000000";

const TAKEN: &str = "584#6000200000000000";
const BROKEN: &str = "4 fault eeprom on";

fn world() -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let probe = world.add_probe();
    world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
    world.run_until(Instant::from_millis(500));
    (world, probe)
}

fn guarded() -> (World, StationId) {
    let (mut world, probe) = world();
    world.guard_stores();
    exchange(&mut world, probe, None, 0);
    (world, probe)
}

/// What is heard within some milliseconds, after a frame has been sent.
fn exchange(world: &mut World, probe: StationId, sent: Option<&str>, millis: u64) -> Vec<String> {
    if let Some(text) = sent {
        let frame: Frame = text.parse().unwrap();
        world.send(probe, frame).unwrap();
    }
    world.run_for(Duration::from_millis(millis));
    std::iter::from_fn(|| world.poll_received(probe)).map(|(_, frame)| frame.to_string()).collect()
}

/// Hands out what was stored and confirms it; how many stores that were.
fn keep(world: &mut World) -> usize {
    let images: Vec<_> = std::iter::from_fn(|| world.poll_store()).collect();
    for image in &images {
        world.confirm_store(image.number, image.generation);
    }
    images.len()
}

#[test]
fn an_answer_waits_for_its_store_while_heartbeats_go_on() {
    let (mut world, probe) = guarded();
    let heard = exchange(&mut world, probe, Some(BEAT), 5);
    assert!(heard.iter().all(|frame| frame == "704#7F"), "{heard:?}");
    assert_eq!(keep(&mut world), 1);
    assert!(exchange(&mut world, probe, None, 1).contains(&"584#6017100000000000".to_owned()));
    let heard = exchange(&mut world, probe, Some(WRITE_700), 100);
    assert!(heard.len() >= 9 && heard.iter().all(|frame| frame.starts_with("704#")), "{heard:?}");
    let held: Vec<_> = world.held_answers().collect();
    assert!(matches!(held[..], [(4, _)]), "{held:?}");
    let image = world.poll_store().unwrap();
    assert_eq!((image.number, image.model), (4, "zlac8030l"));
    assert_eq!(world.poll_store(), None);
    // What was kept before is not enough.
    world.confirm_store(4, image.generation - 1);
    assert!(!exchange(&mut world, probe, None, 20).contains(&TAKEN.to_owned()));
    world.confirm_store(4, image.generation);
    assert!(exchange(&mut world, probe, None, 1).contains(&TAKEN.to_owned()));
    assert_eq!(world.held_answers().next(), None);
    // The image is the one with the value in it.
    let mut copy = World::new(Bitrate::K500, 1);
    let probe = copy.add_probe();
    let mut drive = zlac8030l(4, 1);
    sim::VirtualDrive::load_nvm(&mut drive, &image.bytes).unwrap();
    copy.add_drive(4, Box::new(drive)).unwrap();
    exchange(&mut copy, probe, None, 500);
    assert!(exchange(&mut copy, probe, Some(READ), 2).contains(&"584#4B002000BC020000".to_owned()));
}

#[test]
fn without_a_store_a_guarded_drive_answers_at_the_same_nanosecond() {
    let ends = |(mut world, probe): (World, StationId)| {
        world.send(probe, READ.parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(3));
        world.log().iter().map(|event| event.at()).collect::<Vec<_>>()
    };
    assert_eq!(ends(guarded()), ends(world()));
}

#[test]
fn each_answer_waits_for_its_own_store_and_they_keep_their_order() {
    let (mut world, probe) = guarded();
    exchange(&mut world, probe, Some(WRITE_700), 5);
    let first = world.poll_store().unwrap();
    assert_eq!(exchange(&mut world, probe, Some(WRITE_701), 5), [""; 0]);
    assert_eq!(exchange(&mut world, probe, Some(READ), 5), [""; 0]);
    world.confirm_store(4, first.generation);
    assert_eq!(exchange(&mut world, probe, None, 2), [TAKEN]);
    assert!(!world.is_store_confirmed(4, world.unconfirmed_store(4).unwrap()));
    assert_eq!(keep(&mut world), 1);
    assert_eq!(exchange(&mut world, probe, None, 2), [TAKEN, "584#4B002000BD020000"]);
    assert_eq!(world.unconfirmed_store(4), None);
}

#[test]
fn a_store_that_does_not_come_is_not_waited_for() {
    let (mut world, probe) = guarded();
    assert!(sim::command::answer(&mut world, BROKEN).unwrap().json.contains("true"));
    exchange(&mut world, probe, None, 20);
    // An EEPROM that does not answer takes nothing; the drive shows it by its fault, not by silence.
    assert!(exchange(&mut world, probe, Some(WRITE_700), 5).contains(&TAKEN.to_owned()));
    assert_eq!(world.poll_store(), None);
}

#[test]
fn a_drive_that_loses_its_power_says_nothing_of_before() {
    let (mut world, probe) = guarded();
    exchange(&mut world, probe, Some(WRITE_700), 5);
    assert!(world.held_answers().next().is_some());
    world.set_power(4, false).unwrap();
    // Until its capacitor is empty.
    exchange(&mut world, probe, None, 2000);
    world.set_power(4, true).unwrap();
    keep(&mut world);
    let heard = exchange(&mut world, probe, None, 500);
    assert!(heard.contains(&"704#00".to_owned()) && !heard.contains(&TAKEN.to_owned()), "{heard:?}");
}

#[test]
fn an_answer_that_waits_for_its_store_is_void_after_a_reset() {
    for reset in ["000#8104", "000#8200"] {
        let (mut world, probe) = guarded();
        let heard = exchange(&mut world, probe, Some(BEAT), 5);
        assert!(heard.iter().all(|frame| frame == "704#7F"), "{heard:?}");
        let heard = exchange(&mut world, probe, Some(reset), 5);
        assert!(heard.contains(&"704#00".to_owned()), "{reset}: {heard:?}");
        keep(&mut world);
        let heard = exchange(&mut world, probe, None, 20);
        assert!(!heard.iter().any(|frame| frame.starts_with("584#")), "{reset}: {heard:?}");
    }
}

//! A full bus: 127 stations.

use std::time::Duration;

use crate::common::{Chatter, frame};
use can::{Bitrate, Instant};
use sim::machine::{MJointMachine, Zlac8030lMachine};
use sim::{StationId, World};

#[test]
fn a_hundred_and_twenty_seven_nodes_boot_at_once_in_the_order_of_their_identifiers() {
    let mut world = World::new(Bitrate::K500, 1);
    let boot_up = |node: u16| frame(&format!("{:03X}#00", 0x700 + node));
    let year = Duration::from_secs(31_536_000);
    // Added in a shuffled order: 50 is prime to 127.
    let ids: Vec<StationId> = (0..127u16)
        .map(|n| world.add_station(Chatter::new(boot_up(n * 50 % 127 + 1), Instant::from_millis(1), year)))
        .collect();
    world.run_until(Instant::from_millis(100));
    let expected: Vec<String> = (1..=127).map(|node| boot_up(node).to_string()).collect();
    assert_eq!(crate::common::texts(&world), expected);
    for pair in crate::common::frames(&world).windows(2) {
        assert_eq!(pair[1].0, pair[0].1 + 6_000, "back to back");
    }
    for id in ids {
        let station = world.station::<Chatter>(id).unwrap();
        assert_eq!((station.heard, station.transmitted), (126, 1));
    }
}

#[test]
fn a_station_that_never_serves_its_deadline_does_not_stop_the_world() {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_probe();
    let mut stuck = Chatter::new(frame("181#"), Instant::ZERO, Duration::ZERO);
    stuck.next = Instant::from_millis(1);
    world.add_station(stuck);
    world.run_until(Instant::from_millis(3));
    assert_eq!(world.now(), Instant::from_millis(3));
}

#[test]
fn a_world_can_move_to_another_thread() {
    fn send<T: Send>(_: &T) {}
    send(&World::new(Bitrate::K500, 1));
}

/// A thousand worlds of one drive are to fit where a few megabytes do: what is not used often is behind a pointer.
#[test]
fn a_drive_on_its_hardware_takes_no_more_than_11_and_a_half_kilobytes() {
    let sizes = [size_of::<Zlac8030lMachine>(), size_of::<MJointMachine>()];
    assert!(sizes.iter().all(|size| *size <= 23 * 512), "{sizes:?}");
}

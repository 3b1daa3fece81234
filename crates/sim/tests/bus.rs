//! The wire in virtual time: frame times, arbitration, acknowledge.

use can::{Bitrate, Frame, Instant, frame_bits};
use sim::World;
use sim::wire::WireEvent;

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

fn frames(world: &World) -> Vec<(u64, u64, String)> {
    let frames = world.log().iter().filter_map(|event| match event {
        WireEvent::Frame { start, end, frame, .. } => Some((start.as_nanos(), end.as_nanos(), frame.to_string())),
        _ => None,
    });
    frames.collect()
}

#[test]
fn a_frame_of_eight_bytes_takes_its_exact_bits() {
    // 555#AAAAAAAAAAAAAAAA: 44 + 64 bits, no run of five up to the end of the data except none:
    // RTR IDE r0 and DLC 1000 give three zeros; the CRC is counted by the can crate's own test.
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_tap(), world.add_tap());
    world.run_until(Instant::from_millis(1));
    world.send(a, frame("555#AAAAAAAAAAAAAAAA")).unwrap();
    world.run_until(Instant::from_millis(2));
    let bits = u64::from(frame_bits(&frame("555#AAAAAAAAAAAAAAAA")));
    assert!((108..=111).contains(&bits), "{bits}");
    let end = 1_000_000 + bits * 2_000;
    assert_eq!(frames(&world), [(1_000_000, end, "555#AAAAAAAAAAAAAAAA".to_string())]);
    assert_eq!(world.poll_received(b), Some((Instant::from_nanos(end), frame("555#AAAAAAAAAAAAAAAA"))));
    assert_eq!(world.poll_received(a), None);
}

#[test]
fn the_lowest_identifier_wins_and_the_next_follows_three_bits_later() {
    let mut world = World::new(Bitrate::M1, 1);
    let taps: Vec<_> = (0..4).map(|_| world.add_tap()).collect();
    world.run_until(Instant::from_millis(1));
    for (tap, text) in taps.iter().zip(["704#05", "181#0102", "000#0104", "601#4041600000000000"]) {
        world.send(*tap, frame(text)).unwrap();
    }
    world.run_until(Instant::from_millis(10));
    let seen = frames(&world);
    let order: Vec<_> = seen.iter().map(|(.., text)| text.as_str()).collect();
    assert_eq!(order, ["000#0104", "181#0102", "601#4041600000000000", "704#05"]);
    for pair in seen.windows(2) {
        assert_eq!(pair[1].0, pair[0].1 + 3_000);
    }
}

//! The wire in virtual time: frame times, arbitration, acknowledge, error confinement.

use crate::common::{errors, frame, frames, heard, states, texts};
use can::{Bitrate, Instant};
use sim::World;
use sim::fault::Corruption;
use sim::wire::{ControllerOptions, ErrorCause, ErrorState};

/// `123#`: 44 bits and one stuff bit (RTR, IDE, r0 and two bits of the DLC are five zeros; identifier
/// 00100100011 and CRC 110100001011000 have no run of five).
const BITS_123: u64 = 45;

/// An error flag of 6 bits, its delimiter of 8, the intermission of 3.
const ERROR_FRAME: u64 = 17;

/// Bits at 500 kbit/s in nanoseconds.
fn bits(count: u64) -> u64 {
    count * 2_000
}

fn at_ms(millis: u64) -> Instant {
    Instant::from_millis(millis)
}

#[test]
fn a_frame_of_eight_bytes_takes_its_exact_bits() {
    // 555#AAAAAAAAAAAAAAAA alternates from start of frame to the last data bit but for RTR, IDE and r0 (three
    // zeros): nothing to stuff. Its CRC is 111110111001110: one stuff bit. 44 + 64 + 1 bits.
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.send(a, frame("555#AAAAAAAAAAAAAAAA")).unwrap();
    world.run_until(at_ms(2));
    let end = 1_000_000 + bits(109);
    assert_eq!(frames(&world), [(1_000_000, end, "555#AAAAAAAAAAAAAAAA".to_string())]);
    assert_eq!(world.poll_received(b), Some((Instant::from_nanos(end), frame("555#AAAAAAAAAAAAAAAA"))));
    assert_eq!(world.poll_received(a), None, "a sender does not hear itself");
}

#[test]
fn the_lowest_identifier_wins_and_the_next_follows_three_bits_later() {
    let mut world = World::new(Bitrate::M1, 1);
    let probes: Vec<_> = (0..5).map(|_| world.add_probe()).collect();
    world.run_until(at_ms(1));
    for (probe, text) in probes.iter().zip(["704#05", "181#0102", "000#0104", "181#R2", "00000604#"]) {
        world.send(*probe, frame(text)).unwrap();
    }
    world.run_until(at_ms(10));
    let seen = frames(&world);
    let order: Vec<_> = seen.iter().map(|(.., text)| text.as_str()).collect();
    assert_eq!(order, ["000#0104", "00000604#", "181#0102", "181#R2", "704#05"]);
    for pair in seen.windows(2) {
        assert_eq!(pair[1].0, pair[0].1 + 3_000);
    }
}

#[test]
fn a_frame_offered_while_the_wire_is_taken_waits_even_if_it_is_urgent() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.send(a, frame("123#")).unwrap();
    world.run_until(Instant::from_nanos(1_010_000));
    world.send(b, frame("000#0104")).unwrap();
    world.run_until(at_ms(2));
    assert_eq!(texts(&world), ["123#", "000#0104"]);
    assert_eq!(frames(&world)[1].0, 1_000_000 + bits(BITS_123 + 3));
}

#[test]
fn mailboxes_give_the_urgent_frame_first_and_an_adapter_keeps_the_order_given() {
    #[derive(Clone)]
    struct Burst(Vec<&'static str>);
    impl can::Station for Burst {
        fn handle_frame(&mut self, _: &can::Frame, _: Instant) {}
        fn handle_timeout(&mut self, _: Instant) {}
        fn poll_transmit(&mut self) -> Option<can::Frame> {
            (!self.0.is_empty()).then(|| frame(self.0.remove(0)))
        }
        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }
    let burst = Burst(vec!["704#05", "184#01", "084#0000000000000000", "184#02"]);
    for (options, expected) in [
        (ControllerOptions::MICROCONTROLLER, ["084#0000000000000000", "184#01", "184#02", "704#05"]),
        (ControllerOptions::ADAPTER, ["704#05", "184#01", "084#0000000000000000", "184#02"]),
    ] {
        let mut world = World::new(Bitrate::K500, 1);
        world.add_probe();
        world.add_station_with(burst.clone(), options, Bitrate::K500);
        world.run_until(at_ms(5));
        assert_eq!(texts(&world), expected);
    }
}

#[test]
fn a_station_takes_part_after_eleven_recessive_bits() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, _) = (world.add_probe(), world.add_probe());
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(1));
    assert_eq!(frames(&world)[0].0, bits(11));
}

#[test]
fn a_lone_transmitter_becomes_error_passive_and_tries_for_ever() {
    let mut world = World::new(Bitrate::K500, 1);
    let a = world.add_probe();
    world.run_until(at_ms(1));
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(200));
    let errors = errors(&world);
    // The acknowledge slot ends 8 bits before the frame does; then an error frame, and 8 bits more once passive.
    let attempt = BITS_123 - 8 + ERROR_FRAME;
    assert_eq!(errors[0], (1_000_000 + bits(BITS_123 - 8), ErrorCause::NotAcknowledged));
    let gaps: Vec<u64> = errors.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(gaps[..15].iter().all(|gap| *gap == bits(attempt)));
    assert!(gaps[15..].iter().all(|gap| *gap == bits(attempt + 8)));
    assert_eq!(world.counters(a).tec(), 128);
    assert_eq!(states(&world, a), [(errors[15].0, ErrorState::ErrorPassive)]);
    assert!(frames(&world).is_empty());

    // A second node at last: the frame gets through.
    let b = world.add_probe();
    world.run_until(at_ms(201));
    assert_eq!(heard(&mut world, b), ["123#"]);
    assert_eq!(world.counters(a).tec(), 127);
    assert_eq!(world.counters(a).state(), ErrorState::ErrorActive);
}

#[test]
fn a_disturbed_frame_costs_an_error_frame_and_a_resend_and_is_delivered_once() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_corruption(Corruption::none().and_nth_at_bit(1, 30));
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(2));
    assert_eq!(errors(&world), [(1_000_000 + bits(30), ErrorCause::Disturbed)]);
    let start = 1_000_000 + bits(30 + ERROR_FRAME);
    assert_eq!(frames(&world), [(start, start + bits(BITS_123), "123#".to_string())]);
    assert_eq!(heard(&mut world, b), ["123#"]);
    // +8 -1 for the transmitter, +1 -1 for the receiver.
    assert_eq!((world.counters(a).tec(), world.counters(a).rec()), (7, 0));
    assert_eq!((world.counters(b).tec(), world.counters(b).rec()), (0, 0));
}

/// Disturbs the next `count` attempts in their twentieth bit.
fn disturb(count: u64) -> Corruption {
    (1..=count).fold(Corruption::none(), |corruption, n| corruption.and_nth_at_bit(n, 20))
}

/// When the 32nd attempt fails that began at 1 ms: error frames between them, and suspend transmission
/// from the 16th on, when the transmitter is error-passive.
const THIRTY_SECOND_ERROR: u64 = 31 * (20 + ERROR_FRAME) + 16 * 8 + 20;

#[test]
fn thirty_two_failures_in_a_row_lead_to_bus_off_and_1408_recessive_bits_back() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_corruption(disturb(32));
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(50));
    let errors = errors(&world);
    assert_eq!(errors.len(), 32);
    let bus_off = 1_000_000 + bits(THIRTY_SECOND_ERROR);
    // The wire is recessive from the end of the last error flag on.
    let back = bus_off + bits(6 + 128 * 11);
    assert_eq!(
        states(&world, a),
        [(errors[15].0, ErrorState::ErrorPassive), (bus_off, ErrorState::BusOff), (back, ErrorState::ErrorActive)]
    );
    // The mailbox keeps its frame.
    assert_eq!(frames(&world), [(back, back + bits(BITS_123), "123#".to_string())]);
    assert_eq!(world.counters(a).tec(), 0);
    assert_eq!(world.counters(b).rec(), 31);
}

#[test]
fn thirty_one_failures_do_not() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_corruption(disturb(31));
    world.send(a, frame("123#")).unwrap();
    world.run_until(at_ms(50));
    assert_eq!(states(&world, a).len(), 1, "error-passive only");
    assert_eq!(world.counters(a).tec(), 247);
    assert_eq!(heard(&mut world, b), ["123#"]);
}

#[test]
fn traffic_delays_the_return_from_bus_off() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, _c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.set_corruption(disturb(32));
    world.send(a, frame("123#")).unwrap();
    let recessive = 1_000_000 + bits(THIRTY_SECOND_ERROR + 6);
    // Ten sequences and five bits more have passed when another node sends.
    world.run_until(Instant::from_nanos(recessive + bits(115)));
    world.send(b, frame("123#")).unwrap();
    world.run_until(at_ms(50));
    // The frame's acknowledge delimiter, end of frame and intermission begin the next eleven.
    let back = recessive + bits(115 + BITS_123 - 8 + 118 * 11);
    assert_eq!(states(&world, a).last(), Some(&(back, ErrorState::ErrorActive)));
}

#[test]
fn the_same_frame_from_two_nodes_goes_through_as_one() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.send(a, frame("123#")).unwrap();
    world.send(b, frame("123#")).unwrap();
    world.run_until(at_ms(2));
    assert_eq!(heard(&mut world, c), ["123#"]);
    assert!(errors(&world).is_empty());
}

#[test]
fn one_identifier_with_two_contents_is_a_bit_error_until_both_are_passive() {
    // 555 with DLC 8 has nothing to stuff before the data, whose first bit is the 20th.
    let (dominant, recessive) = ("555#0000000000000000", "555#8000000000000000");
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.send(a, frame(recessive)).unwrap();
    world.send(b, frame(dominant)).unwrap();
    world.run_until(at_ms(100));
    let errors = errors(&world);
    assert_eq!(errors[0], (1_000_000 + bits(20), ErrorCause::Collision));
    assert_eq!(errors.len(), 16);
    // Then the node that reads a bit error sends recessive error flags only, and the other does not notice.
    assert_eq!(heard(&mut world, c), [dominant, recessive]);
    // 16 failures and two frames' luck: the dominant one ends at 127, the other had a 17th.
    assert_eq!(world.counters(b).tec(), 127);
    assert_eq!(world.counters(a).tec(), 135);
}

#[test]
fn a_node_cut_off_goes_on_alone_and_is_back_after_joining() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.cut(a);
    world.send(a, frame("123#")).unwrap();
    world.send(b, frame("704#05")).unwrap();
    world.run_until(at_ms(100));
    assert_eq!(heard(&mut world, c), ["704#05"]);
    assert_eq!(heard(&mut world, a), [""; 0]);
    assert_eq!(world.counters(a).tec(), 128);
    assert_eq!(world.counters(b).tec(), 0);
    world.join(a);
    world.run_until(at_ms(101));
    assert_eq!(heard(&mut world, c), ["123#"]);
    // Eleven recessive bits after the join.
    assert_eq!(frames(&world).last().unwrap().0, 100_000_000 + bits(11));
}

#[test]
fn cutting_a_sender_in_mid_frame_destroys_the_frame() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b, c) = (world.add_probe(), world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    world.send(a, frame("123#")).unwrap();
    world.run_until(Instant::from_nanos(1_000_000 + bits(20)));
    world.cut(a);
    world.run_until(at_ms(2));
    assert_eq!(errors(&world)[0], (1_000_000 + bits(20), ErrorCause::Abandoned));
    assert_eq!(world.counters(b).rec(), 1);
    assert_eq!(heard(&mut world, c), [""; 0]);
    world.join(a);
    world.run_until(at_ms(3));
    assert_eq!(heard(&mut world, c), ["123#"]);
}

#[test]
fn cutting_the_only_listener_before_the_acknowledge_slot_leaves_the_frame_unacknowledged() {
    for (bit, got_through) in [(BITS_123 - 10, false), (BITS_123 - 7, true)] {
        let mut world = World::new(Bitrate::K500, 1);
        let (a, b) = (world.add_probe(), world.add_probe());
        world.run_until(at_ms(1));
        world.send(a, frame("123#")).unwrap();
        world.run_until(Instant::from_nanos(1_000_000 + bits(bit)));
        world.cut(b);
        world.run_until(Instant::from_nanos(1_000_000 + bits(BITS_123)));
        assert_eq!(frames(&world).len() == 1, got_through, "cut at bit {bit}");
        assert_eq!(errors(&world).is_empty(), got_through, "cut at bit {bit}");
    }
}

#[test]
fn a_node_at_another_bit_rate_sees_and_makes_errors_only() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, b) = (world.add_probe(), world.add_probe());
    let period = std::time::Duration::from_millis(100);
    let odd = crate::common::Chatter::new(frame("704#05"), at_ms(500), period);
    let odd = world.add_station_with(odd, ControllerOptions::MICROCONTROLLER, Bitrate::K250);
    for n in 0..20u8 {
        world.run_until(at_ms(1 + u64::from(n)));
        world.send(a, frame(&format!("123#{n:02X}"))).unwrap();
    }
    world.run_until(at_ms(400));
    // As a listener it objects until it is error-passive, 9 an error; every frame gets through in the end.
    assert_eq!(heard(&mut world, b).len(), 20);
    assert_eq!(errors(&world).len(), 15);
    assert_eq!(world.counters(odd).state(), ErrorState::ErrorPassive);
    assert_eq!(world.counters(a).state(), ErrorState::ErrorActive);

    // As a transmitter it goes bus-off, 32 errors each time, and does not disturb the others for good.
    world.run_until(at_ms(520));
    assert!(states(&world, odd).iter().any(|(_, state)| *state == ErrorState::BusOff));
    world.send(a, frame("123#FF")).unwrap();
    world.run_until(at_ms(600));
    assert_eq!(heard(&mut world, b), ["123#FF"]);
    assert_ne!(world.counters(a).state(), ErrorState::BusOff);
    assert_eq!(world.counters(a).tec(), 0);
    assert_eq!(world.station::<crate::common::Chatter>(odd).unwrap().heard, 0);
}

#[test]
fn the_bus_load_is_the_share_of_time_the_wire_is_taken() {
    let mut world = World::new(Bitrate::K500, 1);
    let (a, _) = (world.add_probe(), world.add_probe());
    world.run_until(at_ms(1));
    let before = world.statistics();
    for _ in 0..10 {
        world.send(a, frame("123#")).unwrap();
    }
    world.run_until(at_ms(11));
    let after = world.statistics();
    assert_eq!(after.frames - before.frames, 10);
    let expected = 10.0 * bits(BITS_123 + 3) as f64 / 10e6;
    assert!((after.load_since(&before) - expected).abs() < 1e-12);
}

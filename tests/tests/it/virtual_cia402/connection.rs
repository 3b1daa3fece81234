//! The connection to the host, lost in every way that CiA 402-2 names for 6007h, and set-points that stay away.

use std::time::Duration;

use can::{Bitrate, Station};
use canopen::NodeId;
use devices::servo::CIA402;
use sim::World;
use sim::fault::Corruption;
use sim::machine::{Order, order};

use crate::virtual_cia402::bench::{Bench, TURN};
use crate::virtual_cia402::stops::turning;

/// How the connection is lost, and the error code of the fault that it is with 6007h = 1 (CiA 301, table 26).
const LOSSES: [(&str, i64); 5] =
    [("stopped", 0x8100), ("reset", 0x8100), ("bus-off", 0x8140), ("rpdo", 0x8250), ("guarding", 0x8130)];

/// Turning, and lost in this way.
fn lose(loss: &str, code: i64) -> Bench {
    let mut bench = turning(false);
    bench.set(&[(0x6007, 0, code)]);
    match loss {
        "stopped" => bench.frame("000#0205"),
        "reset" => bench.frame("000#8205"),
        "bus-off" => bench.machine.handle_bus_off(true, bench.now),
        "rpdo" => {
            // RPDO1, the controlword, within 20 ms; the first one begins the watch.
            bench.set(&[(0x1400, 5, 20)]);
            bench.frame("205#0F00");
        }
        _ => {
            bench.set(&[(0x100C, 0, 50), (0x100D, 0, 2)]);
            bench.frame("705#R");
            bench.sent.retain(|frame| frame.to_string() != "705#05");
        }
    }
    bench.run_ms(1000);
    bench
}

#[test]
fn every_loss_does_what_6007h_says() {
    for (loss, error) in LOSSES {
        // The bits of the state in the statusword: operation enabled, fault, switch on disabled twice (605Ah = 2).
        for (code, state, mask) in [(0, 0x27, 0x6F), (1, 0x08, 0x4F), (2, 0x40, 0x4F), (3, 0x40, 0x4F)] {
            let mut bench = lose(loss, code);
            let status = bench.machine.firmware().statusword(0).unwrap();
            assert_eq!(status & mask, state, "{loss}, 6007h = {code}: {status:04X}");
            assert_eq!(bench.rpm().abs() > 1000.0, code == 0, "{loss}, 6007h = {code}: {}", bench.rpm());
            bench.machine.handle_bus_off(false, bench.now);
            bench.frame("000#0105");
            bench.run_ms(5);
            assert_eq!(bench.read(0x603F, 0), if code == 1 { error } else { 0 }, "{loss}, 6007h = {code}");
            assert_eq!(bench.emcy().contains(&(error as u16)), code == 1 || error > 0x8100, "{loss}, 6007h = {code}");
        }
    }
}

#[test]
fn a_fault_for_a_loss_can_be_reset_when_the_connection_is_back() {
    for (loss, back) in [("stopped", "000#0105"), ("reset", "000#0105"), ("rpdo", "205#0000"), ("guarding", "705#R")] {
        let mut bench = lose(loss, 1);
        let lasts = loss != "reset" && loss != "stopped";
        if lasts {
            bench.control(0x00);
            bench.control(0x80);
            bench.run_ms(5);
            assert_eq!(bench.status() & 0x4F, 0x08, "{loss}: it is not back");
        }
        bench.frame(back);
        bench.control(0x00);
        bench.control(0x80);
        bench.run_ms(5);
        assert_eq!((bench.status() & 0x4F, bench.read(0x1001, 0)), (0x40, 0), "{loss}");
        assert_eq!(bench.emcy().last(), Some(&0), "{loss}");
    }
}

#[test]
fn a_host_that_resets_or_stops_a_node_that_is_not_enabled_has_not_lost_it() {
    let mut bench = Bench::new();
    for command in ["000#0205", "000#0105", "000#8205", "000#0105"] {
        bench.frame(command);
        bench.run_ms(20);
    }
    assert_eq!((bench.status() & 0x4F, bench.emcy()), (0x40, vec![]));
}

#[test]
fn reset_node_leaves_no_motor_driven() {
    for code in 0..=3 {
        let mut bench = turning(false);
        bench.set(&[(0x6007, 0, code)]);
        bench.frame("000#8105");
        bench.run_ms(1);
        assert_eq!(bench.machine.firmware().demand(0), Some(&drives::engine::axis::Demand::Off));
        // Friction alone stops it: see the option codes that leave the shaft free.
        bench.run_ms(200);
        assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
        assert_eq!(bench.status() & 0x4F, 0x40);
    }
}

/// A mode that follows set-points, its object in RPDO4 beside the controlword, and one period of 60C2h.
fn cyclic(mode: i64, object: i64, period_ms: i64) -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x60C2, 1, period_ms), (0x1403, 1, 0x8000_0505), (0x1603, 0, 0), (0x1603, 2, object)]);
    bench.set(&[(0x1603, 0, 2), (0x1403, 1, 0x505)]);
    bench.enable(mode);
    bench
}

/// Set-points of csv by RPDO4, one each so many ms.
fn feed_velocity(bench: &mut Bench, every_ms: u64, for_ms: u64) {
    let velocity: String = (10 * TURN as i32).to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
    for _ in 0..for_ms / every_ms {
        bench.frame(&format!("505#0F00{velocity}"));
        bench.run_ms(every_ms);
    }
}

#[test]
fn velocities_that_stay_away_bring_the_axis_to_rest_and_the_next_one_moves_it_again() {
    // In the rhythm of 60C2h; in another; in one of SYNC that is in 1006h.
    for (every_ms, sync_us, rests_within_ms) in [(2, 0, 4), (10, 0, 100), (10, 10_000, 30)] {
        let mut bench = cyclic(9, 0x60FF_0020, 2);
        bench.set(&[(0x1006, 0, sync_us)]);
        feed_velocity(&mut bench, every_ms, 400);
        assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
        // It slows down by 6084h from then on: 10 turns/s at 200 turns/s2 take 50 ms.
        let began = bench.run_until(300, |bench| bench.rpm() < 590.0).expect("it slows down");
        assert!(began < (rests_within_ms + every_ms + 5) as f64, "after {began} ms");
        bench.run_ms(100);
        assert!(bench.rpm().abs() < 1.0 && !bench.has(0x1000) && bench.status() & 0x6F == 0x27, "{}", bench.rpm());
        feed_velocity(&mut bench, every_ms, 200);
        assert!((bench.rpm() - 600.0).abs() < 6.0 && bench.has(0x1000), "{}", bench.rpm());
    }
}

#[test]
fn a_velocity_that_a_host_wrote_by_sdo_stays() {
    let mut bench = cyclic(9, 0x60FF_0020, 2);
    bench.set(&[(0x60FF, 0, 10 * TURN)]);
    bench.run_ms(2000);
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
}

#[test]
fn a_torque_that_stays_away_ends_too() {
    let mut bench = cyclic(10, 0x6071_0010, 2);
    for _ in 0..100 {
        bench.frame("505#0F006400");
        bench.run_ms(2);
    }
    assert!(bench.rpm() > 1000.0, "{}", bench.rpm());
    bench.run_ms(1000);
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
}

#[test]
fn velocities_are_led_to_along_a_straight_line_within_60c2h() {
    let mut bench = cyclic(9, 0x60FF_0020, 100);
    bench.set(&[(0x60FF, 0, 10 * TURN)]);
    bench.run_ms(50);
    // Half the way of a ramp of 100 ms: 300 r/min.
    assert!((bench.rpm() - 300.0).abs() < 15.0, "{}", bench.rpm());
    bench.run_ms(60);
    assert!((bench.rpm() - 600.0).abs() < 15.0, "{}", bench.rpm());
}

#[test]
fn guarding_is_answered_with_a_bit_that_alternates_unless_heartbeats_are_sent() {
    let mut bench = Bench::new();
    bench.sent.clear();
    for _ in 0..3 {
        bench.frame("705#R");
    }
    let answers: Vec<_> = bench.sent.drain(..).map(|frame| frame.to_string()).collect();
    assert_eq!(answers, ["705#05", "705#85", "705#05"]);
    bench.set(&[(0x1017, 0, 1000)]);
    bench.run_ms(5);
    bench.sent.clear();
    bench.frame("705#R");
    assert!(bench.sent.is_empty(), "{:?}", bench.sent);
}

#[test]
fn a_lost_connection_leaves_operational_as_1029h_says() {
    for (code, state) in [(0, "705#7F"), (1, "705#05"), (2, "705#04")] {
        let mut bench = Bench::new();
        bench.set(&[(0x1029, 1, code), (0x1016, 1, 0x0001_0032), (0x1017, 0, 10)]);
        bench.frame("701#05");
        bench.run_ms(100);
        assert_eq!(bench.sent.last().unwrap().to_string(), state, "1029h:01 = {code}");
    }
}

#[test]
fn bus_off_stops_the_motor_and_is_reported_when_the_bus_is_back() {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    let node = NodeId::new(5).unwrap();
    world.add_drive(5, order(&CIA402, &Order::new(&CIA402, node, Bitrate::K500)).unwrap()).unwrap();
    world.run_for(Duration::from_millis(300));
    // Profile velocity, 60FFh = 10 turns/s, enabled, and a heartbeat each 100 ms.
    let requests = [
        "000#0105",
        "605#2F60600003000000",
        "605#23FF600000001400",
        "605#2B40600006000000",
        "605#2B40600007000000",
        "605#2B4060000F000000",
        "605#2B17100064000000",
    ];
    for request in requests {
        world.send(host, request.parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(50));
    }
    world.run_for(Duration::from_millis(300));
    assert!((world.report(5).unwrap().velocity_rpm - 600.0).abs() < 6.0);
    while world.poll_received(host).is_some() {}
    // The next frame on the wire is a heartbeat: it is destroyed 32 times.
    world.set_corruption((1..=32).fold(Corruption::none(), |all, n| all.and_nth_at_bit(n, 20)));
    world.run_for(Duration::from_millis(300));
    let report = world.report(5).unwrap();
    assert_eq!((report.velocity_rpm.abs() < 1.0, report.error_code), (true, 0x8140), "{report:?}");
    let heard: Vec<String> =
        std::iter::from_fn(|| world.poll_received(host)).map(|(_, frame)| frame.to_string()).collect();
    assert!(heard.iter().any(|frame| frame.starts_with("085#4081")), "{heard:?}");
}

//! The modes that follow something at all times: torque, interpolated position, and the cyclic synchronous ones.

use crate::virtual_cia402::bench::{Bench, TURN};
use canopen::od::{Access, DefaultValue};
use canopen::{AbortCode, Mux};
use devices::servo::CIA402;
use sim::VirtualDrive;

/// Sends a set-point and SYNC every millisecond, and hands each period on.
fn cycle(bench: &mut Bench, periods: i64, mut set: impl FnMut(&mut Bench, i64)) {
    for period in 0..periods {
        set(bench, period);
        bench.sync();
        bench.run_ms(1);
    }
}

/// RPDO3 (controlword and target position), sent with each SYNC.
fn map_cyclic_position(bench: &mut Bench) {
    bench.set(&[(0x1402, 1, 0x8000_0405), (0x1402, 2, 1), (0x1402, 1, 0x405)]);
}

fn rpdo3(bench: &mut Bench, controlword: u16, position: i64) {
    let [a, b] = controlword.to_le_bytes();
    let p: String = (position as i32).to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
    bench.frame(&format!("405#{a:02X}{b:02X}{p}"));
}

/// A ramp of velocity and then a steady one, in increments after so many milliseconds.
fn way(ms: i64) -> i64 {
    // 10 turns/s after 100 ms.
    let (ramp, speed) = (100, 10.0 * TURN as f64 / 1000.0);
    let t = ms.min(ramp) as f64;
    (speed * t * t / (2.0 * ramp as f64) + speed * (ms - ramp).max(0) as f64).round() as i64
}

#[test]
fn cyclic_position_follows_the_set_points_one_period_late() {
    let mut bench = Bench::new();
    map_cyclic_position(&mut bench);
    bench.enable(8);
    assert_eq!(bench.status() & 0x1000, 0, "nothing to follow yet");
    let mut worst = 0;
    cycle(&mut bench, 400, |bench, period| {
        rpdo3(bench, 0x0F, way(period));
        if period > 150 {
            let lag = way(period - 1) - bench.read(0x6062, 0);
            worst = worst.max(lag.abs());
        }
    });
    assert!(bench.has(0x1000), "{:04X}", bench.status());
    // The demand is looked at between two supervision periods: half a millisecond at 1311 increments each.
    assert!(worst <= 1400, "{worst}");
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
    let error = bench.read(0x60F4, 0);
    assert!(error.abs() < TURN / 100, "{error}");
}

#[test]
fn a_missed_set_point_is_bridged_and_silence_stops_the_motion() {
    let mut bench = Bench::new();
    map_cyclic_position(&mut bench);
    bench.enable(8);
    cycle(&mut bench, 300, |bench, period| rpdo3(bench, 0x0F, way(period)));
    let before = bench.rpm();
    bench.run_ms(1);
    cycle(&mut bench, 50, |bench, period| rpdo3(bench, 0x0F, way(period + 301)));
    assert!((bench.rpm() - before).abs() < 20.0, "{} {before}", bench.rpm());
    assert!(bench.emcy().is_empty());
    bench.run_ms(500);
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
    assert_eq!(bench.status() & 0x6F, 0x27);
}

#[test]
fn cyclic_velocity_and_its_offset_add_up() {
    let mut bench = Bench::new();
    bench.enable(9);
    bench.set(&[(0x60FF, 0, 10 * TURN), (0x60B1, 0, 5 * TURN)]);
    bench.run_ms(200);
    assert!((bench.rpm() - 900.0).abs() < 9.0, "{}", bench.rpm());
    assert!(bench.has(0x1000));
    // Never faster than 6080h: 5000 r/min.
    bench.set(&[(0x607F, 0, 0xFFFF_FFFF), (0x60FF, 0, 200 * TURN)]);
    bench.run_ms(500);
    assert!((bench.rpm() - 5000.0).abs() < 50.0, "{}", bench.rpm());
    assert!(bench.has(0x0800), "internal limit");
}

#[test]
fn torque_is_thousandths_of_the_rated_one_and_accelerates_as_newton_has_it() {
    for mode in [4, 10] {
        let mut bench = Bench::new();
        // Ten times the rotor's inertia, so that the speed is not there at once.
        let inertia = 10.0 * bench.machine.assembly().motor(0).unwrap().model.rotor.inertia_kg_m2;
        bench.machine.assembly_mut().motor_mut(0).unwrap().rig.load.inertia_kg_m2 = inertia;
        bench.set(&[(0x6087, 0, 0)]);
        bench.enable(mode);
        bench.set(&[(0x6071, 0, 500)]);
        bench.run_ms(5);
        let before = bench.rpm();
        bench.run_ms(20);
        let acceleration = (bench.rpm() - before) * std::f64::consts::TAU / 60.0 / 0.020;
        let rotor = bench.machine.assembly().motor(0).unwrap().model.rotor;
        let expected = (0.5 * 1.27 - rotor.coulomb_nm) / (11.0 * rotor.inertia_kg_m2);
        assert!((acceleration / expected - 1.0).abs() < 0.05, "mode {mode}: {acceleration} {expected}");
        let torque = bench.read(0x6077, 0);
        assert!((torque - 500).abs() < 15, "{torque}");
    }
}

#[test]
fn torque_rises_along_its_slope_and_keeps_to_its_limits() {
    let mut bench = Bench::new();
    bench.machine.set_rotor_locked(true, bench.now).unwrap();
    bench.set(&[(0x6087, 0, 5000), (0x60E0, 0, 600), (0x6072, 0, 900)]);
    bench.enable(4);
    bench.set(&[(0x6071, 0, 1000)]);
    bench.run_ms(60);
    let rising = bench.read(0x6077, 0);
    assert!((rising - 300).abs() < 30, "5000 a second for 60 ms: {rising}");
    bench.run_ms(400);
    let held = bench.read(0x6077, 0);
    assert!((held - 600).abs() < 15, "60E0h: {held}");
    bench.set(&[(0x6071, 0, -1000)]);
    bench.run_ms(800);
    let held = bench.read(0x6077, 0);
    assert!((held + 900).abs() < 15, "6072h: {held}");
}

#[test]
fn interpolation_runs_while_bit_4_is_set() {
    let mut bench = Bench::new();
    bench.enable(7);
    cycle(&mut bench, 50, |bench, period| bench.set(&[(0x60C1, 1, way(period))]));
    assert!(!bench.has(0x1000) && bench.position().abs() < 100, "bit 4 is not set");
    let start = bench.position();
    bench.control(0x1F);
    cycle(&mut bench, 300, |bench, period| bench.set(&[(0x60C1, 1, start + way(period))]));
    assert!(bench.has(0x1000), "{:04X}", bench.status());
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
    bench.control(0x0F);
    bench.run_ms(300);
    assert!(bench.rpm().abs() < 1.0 && !bench.has(0x1000));
}

#[test]
fn a_cubic_path_is_as_late_as_one_more_set_point() {
    let mut bench = Bench::new();
    bench.set(&[(0x60C0, 0, -1), (0x60C2, 1, 4)]);
    bench.enable(8);
    for period in 0..150 {
        bench.set(&[(0x607A, 0, way(period * 4))]);
        bench.run_ms(4);
    }
    let late = way(149 * 4) - bench.read(0x6062, 0);
    // One period of 4 ms behind the last set-point, which came 4 ms ago, at 1311 increments a millisecond.
    assert!((late - 4 * 1311).abs() < 1311, "{late}");
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
}

#[test]
fn the_torque_offset_is_added_to_what_the_loops_ask_for() {
    for mode in [8, 9] {
        let mut bench = Bench::new();
        bench.machine.set_rotor_locked(true, bench.now).unwrap();
        bench.enable(mode);
        bench.set(&[(0x60B2, 0, 300)]);
        bench.run_ms(50);
        let torque = bench.read(0x6077, 0);
        assert!((torque - 300).abs() < 15, "mode {mode}: {torque}");
    }
}

#[test]
fn modes_that_6502h_does_not_name_are_refused() {
    let mut bench = Bench::new();
    for mode in [5, 12, -1] {
        assert_eq!(bench.write(0x6060, 0, mode), Err(canopen::AbortCode::INVALID_VALUE), "{mode}");
    }
    assert_eq!(bench.read(0x6060, 0), 0);
}

#[test]
fn slow_set_points_are_joined_and_the_last_one_is_where_it_ends() {
    let mut bench = Bench::new();
    map_cyclic_position(&mut bench);
    bench.set(&[(0x60C2, 1, 10)]);
    bench.enable(8);
    for step in 1..=150 {
        rpdo3(&mut bench, 0x0F, step * TURN / 20);
        bench.sync();
        bench.run_ms(10);
    }
    bench.run_ms(500);
    assert!((bench.position() - 150 * TURN / 20).abs() < TURN / 2, "{}", bench.position());
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
}

#[test]
fn set_points_that_come_in_bunches_are_caught_up_with() {
    let mut bench = Bench::new();
    bench.set(&[(0x60C2, 1, 10)]);
    bench.enable(8);
    let mut target = 0;
    for _ in 0..40 {
        for _ in 0..5 {
            target += TURN / 40;
            bench.set(&[(0x607A, 0, target)]);
        }
        bench.run_ms(50);
        let behind = target - bench.position();
        assert!(behind.abs() < TURN / 4, "{behind} behind {target}");
    }
    bench.run_ms(100);
    assert!((bench.position() - target).abs() < TURN / 500 && bench.emcy().is_empty(), "{}", bench.position());
}

#[test]
fn a_stream_of_positions_that_ends_leaves_the_shaft_on_the_last_one() {
    for period_ms in [1, 2, 4, 10] {
        for mode in [8, 7] {
            let mut bench = Bench::new();
            map_cyclic_position(&mut bench);
            bench.set(&[(0x60C2, 1, period_ms)]);
            bench.enable(mode);
            bench.control(0x1F);
            let periods = 200 / period_ms;
            for period in 1..=periods {
                let target = 60_000 * period / periods;
                match mode {
                    8 => rpdo3(&mut bench, 0x1F, target),
                    _ => bench.set(&[(0x60C1, 1, target)]),
                }
                bench.sync();
                bench.run_ms(period_ms as u64);
            }
            assert!(bench.rpm() > 100.0, "it turns at the end of the stream");
            bench.run_ms(500);
            let case = format!("mode {mode}, {period_ms} ms");
            assert!((bench.position() - 60_000).abs() <= 1, "{case}: {}", bench.position());
            assert_eq!(bench.read(0x6062, 0), 60_000, "{case}");
            assert!(bench.rpm().abs() < 0.5 && bench.has(0x1000), "{case}: {:04X}", bench.status());
        }
    }
}

/// Into ip with a buffer of so many places and a period of 20 ms, bit 4 not set yet.
fn buffered(places: i64, organisation: i64) -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x60C2, 1, 20), (0x60C4, 2, places), (0x60C4, 3, organisation), (0x60C4, 6, 1)]);
    bench.enable(7);
    bench
}

#[test]
fn set_points_wait_in_ip_and_are_taken_one_a_period() {
    let mut bench = buffered(8, 0);
    let start = bench.position();
    for n in 1..=8 {
        bench.set(&[(0x60C1, 1, start + n * TURN / 50)]);
    }
    assert_eq!(bench.read(0x60C4, 4), 8, "how many wait");
    assert_eq!(bench.write(0x60C1, 1, 0), Err(AbortCode::DEVICE_STATE), "full");
    bench.set(&[(0x60C4, 4, 0)]);
    assert_eq!(bench.read(0x60C4, 4), 8, "the position of a first-in-first-out buffer has no influence");
    bench.run_ms(100);
    assert!((bench.position() - start).abs() < 100, "bit 4 is not set");
    bench.control(0x1F);
    bench.run_ms(85);
    // Four periods and a bit: the fifth of eight is on its way, one turn a second.
    let way = (bench.position() - start) as f64 / (TURN as f64 / 50.0);
    assert!((3.5..4.5).contains(&way), "{way}");
    assert_eq!(bench.read(0x60C4, 4), 3);
    assert!((bench.rpm() - 60.0).abs() < 6.0, "{}", bench.rpm());
    bench.run_ms(400);
    assert_eq!(bench.read(0x60C4, 4), 0);
    assert!((bench.position() - start - 8 * TURN / 50).abs() < TURN / 10 && bench.rpm().abs() < 1.0);
}

#[test]
fn a_ring_of_set_points_is_gone_round_until_bit_4_falls() {
    let mut bench = buffered(2, 1);
    let start = bench.position();
    for (place, target) in [(0, 0), (1, TURN / 20)] {
        bench.set(&[(0x60C4, 4, place), (0x60C1, 1, start + target)]);
    }
    bench.control(0x1F);
    let (mut low, mut high, mut turns_round) = (0, 0, 0);
    let mut upwards = true;
    for _ in 0..400 {
        bench.run_ms(1);
        let at = bench.position() - start;
        (low, high) = (low.min(at), high.max(at));
        let turned = if upwards { bench.rpm() < -20.0 } else { bench.rpm() > 20.0 };
        turns_round += i32::from(turned);
        upwards ^= turned;
    }
    // Ten times up and ten times down in 400 ms.
    assert!((17..=21).contains(&turns_round), "{turns_round}");
    assert!(low > -TURN / 20 && high > TURN / 40 && high < TURN / 10, "{low} to {high}");
    bench.control(0x0F);
    bench.run_ms(200);
    assert!(bench.rpm().abs() < 1.0);
}

#[test]
fn a_buffer_that_is_cleared_or_changed_forgets_and_one_that_is_closed_takes_nothing() {
    let mut bench = buffered(4, 0);
    for change in [(0x60C4, 2, 5), (0x60C4, 3, 0), (0x60C4, 6, 0)] {
        bench.set(&[(0x60C1, 1, 10)]);
        assert_eq!(bench.read(0x60C4, 4), 1);
        bench.set(&[change]);
        assert_eq!(bench.read(0x60C4, 4), 0, "{change:X?}");
    }
    bench.set(&[(0x60C1, 1, 10)]);
    assert_eq!(bench.read(0x60C4, 4), 0, "60C4h:06 = 0: closed");
    bench.set(&[(0x60C4, 6, 1), (0x60C1, 1, 10)]);
    assert_eq!(bench.read(0x60C4, 4), 1);
}

#[test]
fn a_buffer_is_closed_as_delivered_and_its_clear_can_only_be_written() {
    let mut bench = Bench::new();
    let clear = CIA402.row(Mux::new(0x60C4, 6)).unwrap();
    let delivered = clear.default == DefaultValue::Value(0);
    assert!(clear.access == Access::WriteOnly && delivered, "CiA 402-2, interpolation data configuration");
    assert_eq!(bench.try_read(0x60C4, 6), Err(AbortCode::WRITE_ONLY));
    bench.enable(7);
    bench.set(&[(0x60C4, 2, 4), (0x60C1, 1, 10)]);
    assert_eq!(bench.read(0x60C4, 4), 0, "closed");
    bench.set(&[(0x60C4, 6, 1), (0x60C1, 1, 10)]);
    assert_eq!(bench.read(0x60C4, 4), 1, "open");
    // Of a single place there is nothing to close: each set-point acts as it comes.
    let start = bench.position();
    bench.set(&[(0x60C4, 6, 0), (0x60C4, 2, 1), (0x6040, 0, 0x1F), (0x60C1, 1, start + TURN / 100)]);
    bench.run_ms(100);
    assert!((bench.position() - start - TURN / 100).abs() < TURN / 500, "{}", bench.position() - start);
}

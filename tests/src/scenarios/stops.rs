//! Halt, quick stop, shutdown, disable operation and disable voltage in every mode that moves: how long the commanded
//! velocity takes to 0, and what goes on after it.
//!
//! 605Ah to 605Dh name the ramps (CiA 402-2, clause 8.4): slow down is 6084h, quick stop 6085h, and an emergency stop what
//! the drive's manual makes of it. How far a motor then truly turns is asked in the drives' own tests.

use std::time::Duration;

use crate::bench::{Bench, assert_within};
use crate::power_states::PowerSubject;

const LOOK: Duration = Duration::from_micros(500);
const REACHED: u16 = 1 << 10;

const SLOW_DOWN: i64 = 1;
const QUICK_STOP: i64 = 2;
const SLOW_DOWN_S: f64 = 0.3;
const QUICK_STOP_S: f64 = 0.05;

/// Commanded to turn at 120 r/min in a mode, far from any target or switch.
pub fn turning<S: PowerSubject>(mode: i64) -> Bench<S> {
    let mut bench = Bench::new();
    S::set_ramp(&mut bench, 0x6084, 300);
    S::set_ramp(&mut bench, 0x6085, 50);
    S::let_home(&mut bench);
    bench.enable_in(mode);
    match mode {
        1 => bench.move_by(100_000),
        3 => bench.set(0x60FF, 120),
        _ => bench.set(0x6040, 0x1F),
    };
    bench.run_ms(1000);
    goes_on(&mut bench, &format!("mode {mode}"));
    bench
}

#[track_caller]
fn goes_on<S: PowerSubject>(bench: &mut Bench<S>, at: &str) {
    assert_within(at, bench.report().velocity_demand_rpm.expect("enabled"), 120.0 - 1e-6, 120.0 + 1e-6);
    bench.goes_at(120);
}

/// The commanded velocity is 0 after the time of this ramp; `late_s` of it are over already.
#[track_caller]
fn stops<S: PowerSubject>(bench: &mut Bench<S>, at: &str, mode: i64, ramp: i64, late_s: f64) {
    let taken = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm.is_none_or(|rpm| rpm == 0.0));
    let seconds = match ramp {
        SLOW_DOWN if mode == 6 => S::HOMING_RAMP_S,
        SLOW_DOWN => SLOW_DOWN_S,
        QUICK_STOP => QUICK_STOP_S,
        _ => S::EMERGENCY_STOP_S,
    };
    assert_within(at, taken, seconds - late_s - 0.003, seconds - late_s + 0.0025);
    bench.run_ms(S::STANDS_AFTER_MS);
}

/// 605Dh.
pub fn halt_takes_the_ramp_of_605dh_in_every_mode_and_stays_enabled<S: PowerSubject>() {
    for (mode, option) in S::MOVING_MODES.iter().flat_map(|mode| [1, 2, 3].map(|option| (*mode, option))) {
        let at = format!("mode {mode}, 605Dh = {option}");
        let mut bench = turning::<S>(mode);
        let controlword = if mode == 3 { 0x10F } else { 0x15F };
        bench.set(0x605D, option).set(0x6040, controlword);
        if option == SLOW_DOWN {
            assert_eq!(bench.statusword() & (REACHED | S::RUNNING), S::RUNNING, "{at}: it slows down");
        }
        // The SDO answer takes 0.5 ms of it, the look at the statusword 1 ms more.
        stops(&mut bench, &at, mode, option, if option == SLOW_DOWN { 0.0015 } else { 0.0 });
        assert_eq!(bench.statusword() & (0x6F | REACHED | S::RUNNING), 0x27 | REACHED, "{at}: enabled, and it stands");
        bench.set(0x6040, controlword & 0xFF).run_ms(800);
        goes_on(&mut bench, &at);
    }
}

/// 605Ah = 5, 6, 7: nothing goes on by itself after it but a velocity.
pub fn quick_stop_takes_the_ramp_of_605ah_in_every_mode_and_holds<S: PowerSubject>() {
    for (mode, ramp) in S::MOVING_MODES.iter().flat_map(|mode| [1, 2, 3].map(|ramp| (*mode, ramp))) {
        let at = format!("mode {mode}, 605Ah = {}", ramp + 4);
        let mut bench = turning::<S>(mode);
        bench.set(0x605A, ramp + 4).set(0x6040, 0x02);
        stops(&mut bench, &at, mode, ramp, 0.0);
        bench.run_ms(500).shows(0x6F, 0x07).turns_about(0.0, 1.0);
        assert!(bench.is_energised(), "{at}: it holds");
        bench.set(0x6040, 0x0F).run_ms(800);
        assert_eq!(bench.statusword() & 0x6F, 0x27, "{at}: transition 16");
        match mode {
            3 => goes_on(&mut bench, &at),
            _ => drop(bench.turns_about(0.0, 1.0).seconds()),
        }
    }
}

/// 605Bh and 605Ch: with 1 the ramp comes first, with 0 the state changes at once. What was under way is over.
pub fn shutdown_and_disable_operation_ramp_down_before_they_act_or_act_at_once<S: PowerSubject>() {
    for mode in S::MOVING_MODES {
        for (object, controlword, state) in [(0x605B, 0x06, 0x21), (0x605C, 0x07, 0x23)] {
            let at = format!("mode {mode}, 6040h = {controlword:02X}h");
            let mut bench = turning::<S>(*mode);
            bench.set(object, 1).set(0x6040, controlword);
            assert_eq!(bench.statusword() & 0x6F, 0x27, "{at}: enabled on the ramp");
            stops(&mut bench, &at, *mode, SLOW_DOWN, 0.0015);
            assert_eq!(bench.statusword() & 0x6F, state, "{at}");
            bench.set(0x60FF, 0).set(0x6040, 0x0F).run_ms(300).shows(0x6F, 0x27).turns_about(0.0, 1.0);

            let mut bench = turning::<S>(*mode);
            bench.set(object, 0).set(0x6040, controlword);
            assert_eq!(bench.statusword() & 0x6F, state, "{at}: at once");
        }
    }
}

/// Transition 9: no ramp, no current.
pub fn disable_voltage_frees_the_motor_at_once_in_every_mode<S: PowerSubject>() {
    for mode in S::MOVING_MODES {
        let mut bench = turning::<S>(*mode);
        bench.set(0x6040, 0x00).shows(0x4F, 0x40);
        assert_eq!(bench.report().velocity_demand_rpm, None, "mode {mode}: no ramp");
        bench.run_ms(50);
        assert_within(&format!("A in mode {mode}"), bench.report().current_a, -1e-3, 1e-3);
    }
}

/// A halt is not an end.
pub fn a_halted_move_goes_on_to_its_target<S: PowerSubject>() {
    for option in [1, 2, 3] {
        let mut bench = Bench::<S>::new();
        bench.set(0x605D, option).enable_in(1).move_by(10_000).run_ms(800).set(0x6040, 0x15F).run_ms(1000);
        let halted = bench.get(0x6064);
        assert!((1000 * S::COUNTS..9000 * S::COUNTS).contains(&halted), "605Dh = {option}: {halted}");
        bench.shows(REACHED | S::RUNNING, REACHED).run_ms(500).is_at(halted, 5 * S::COUNTS);
        bench.set(0x6040, 0x5F).run_ms(3000).is_at(10_000 * S::COUNTS, S::IN_POSITION);
    }
}

/// At rest, where it is acknowledged at once, and on the way.
pub fn a_set_point_given_under_halt_waits_for_its_end<S: PowerSubject>() {
    for on_the_way in [false, true] {
        let mut bench = Bench::<S>::new();
        bench.enable_in(1);
        if on_the_way {
            bench.move_by(100_000).run_ms(800);
        }
        bench.set(0x6040, 0x10F).set(0x607A, 3000 * S::COUNTS).set(0x6040, 0x13F).run_ms(1000).shows(1 << 12, 1 << 12);
        let halted = bench.get(0x6064);
        assert!(on_the_way || halted.abs() <= 5 * S::COUNTS, "{halted}");
        bench
            .run_ms(500)
            .is_at(halted, 5 * S::COUNTS)
            .set(0x6040, 0x0F)
            .run_ms(4000)
            .is_at(3000 * S::COUNTS, S::IN_POSITION);
    }
}

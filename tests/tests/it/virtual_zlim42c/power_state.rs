//! Which power states energise the motor (200Bh), and bit 11.

use crate::virtual_zlim42c::bench::Bench;

/// The motor is energised.
const ENERGISED: u16 = 1 << 13;

#[test]
fn a_locked_shaft_stands_against_a_load_that_turns_a_free_one() {
    // 200Bh, not enabled. A tenth of the holding torque turns a motor that has its detent (0.012 N m) and its friction only.
    for (lock, stands) in [(0, false), (1, true)] {
        let mut bench = Bench::new();
        bench.set(0x200B, lock).run_ms(50);
        bench.set_load_torque(0.05).run_ms(200);
        let away = bench.report().rotor_position.expect("known here").abs();
        assert_eq!(away < 40, stands, "200Bh = {lock}: {away} pulses");
    }
}

#[test]
fn the_motor_carries_current_from_switched_on_and_when_locked() {
    for (state, locked, live) in [
        ("switch_on_disabled", 0, false),
        ("ready_to_switch_on", 0, false),
        ("switched_on", 0, true),
        ("operation_enabled", 0, true),
        ("quick_stop_active", 0, true),
        ("switch_on_disabled", 1, true),
        ("ready_to_switch_on", 1, true),
        ("fault", 1, false),
    ] {
        let mut bench = Bench::new();
        bench.set(0x200B, locked);
        bench.reach(state);
        bench.run_ms(50);
        let current_a = bench.report().current_a;
        assert_eq!(current_a > 0.5, live, "{state}, 200Bh = {locked}: {current_a} A");
        assert_eq!(bench.statusword() & ENERGISED != 0, live, "{state}, 200Bh = {locked}");
    }
}

#[test]
fn bit_11_mirrors_bit_4_of_the_controlword_in_every_state() {
    let mut bench = Bench::new();
    for (controlword, bit_11) in [(0x10, true), (0x06, false), (0x16, true), (0x0F, false), (0x1F, true)] {
        bench.set(0x6040, controlword);
        assert_eq!(bench.statusword() & 1 << 11 != 0, bit_11, "{controlword:02X}h");
    }
}

//! The power state machine on the running drive: every state with every event of the table, and the statuswords.

use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::power_states::lead_where_the_table_says;
use ferrodrive_tests::zlim42c::{EnergisedCell, power_states};

use crate::bench::Bench;

/// The motor is energised.
const ENERGISED: u16 = 1 << 13;

#[test]
fn every_event_in_every_state_leads_where_the_table_says() {
    let energised = |it: EnergisedCell| (it.cell, if it.bit_13_after { ENERGISED } else { 0 });
    let cells: Vec<_> = power_states().into_iter().map(energised).collect();
    lead_where_the_table_says::<Zlim42c>(&cells, ENERGISED);
}

#[test]
fn the_drive_says_that_it_has_booted_and_is_in_switch_on_disabled() {
    let mut bench = Bench::new();
    bench.hears(&["701#00"]).shows(0x6F, 0x60);
}

#[test]
fn the_statusword_of_each_state_is_that_of_the_readings() {
    // docs/drives/zlim42c.md, 5.3.1 and 5.3.2, without a mode. In quick stop active bit 10 tells that the motor stands.
    let patterns = [
        ("switch_on_disabled", 0x0270),
        ("ready_to_switch_on", 0x0231),
        ("switched_on", 0x2233),
        ("operation_enabled", 0x2237),
        ("quick_stop_active", 0x2217),
        ("fault", 0x0298),
    ];
    for (state, pattern) in patterns {
        let mut bench = Bench::in_state(state);
        bench.run_ms(50);
        assert_eq!(format!("{:04X}", bench.statusword()), format!("{pattern:04X}"), "{state}");
    }
}

#[test]
fn the_statusword_of_each_state_in_each_mode_at_rest() {
    // 5.3.4 to 5.3.6: bits 10 and 15 in position, bits 10 and 12 (speed is 0) in velocity, none in homing, where nothing has
    // been looked for; there is nothing to be reached before the drive is enabled.
    const REACHED: u16 = 1 << 10;
    const SPEED_IS_ZERO: u16 = 1 << 12;
    const IN_POSITION: u16 = 1 << 15;
    let states = [
        ("switch_on_disabled", 0x0270, false),
        ("ready_to_switch_on", 0x0231, false),
        ("switched_on", 0x2233, false),
        ("operation_enabled", 0x2237, true),
        ("quick_stop_active", 0x2217, true),
        ("fault", 0x0298, false),
    ];
    let modes = [(1, 0, REACHED | IN_POSITION), (3, SPEED_IS_ZERO, REACHED), (6, 0, 0)];
    for (mode, always, when_live) in modes {
        for (state, pattern, live) in states {
            let mut bench = Bench::new();
            bench.set(0x6060, mode);
            bench.reach(state);
            bench.run_ms(50);
            let expected = pattern | always | if live { when_live } else { 0 };
            assert_eq!(format!("{:04X}", bench.statusword()), format!("{expected:04X}"), "{state}, mode {mode}");
            assert_eq!(bench.get(0x6061), mode, "{state}");
        }
    }
}

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

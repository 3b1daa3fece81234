//! The power state machine on the running drive: every state with every event of the table, and the statuswords.

use ferrodrive_tests::bench::zlac8030l::Zlac8030l;
use ferrodrive_tests::power_states::lead_where_the_table_says;
use ferrodrive_tests::zlac8030l::power_states;

use crate::bench::Bench;

const REACHED: u16 = 1 << 10;
/// Speed is zero in profile velocity, set-point acknowledge in profile position.
const BIT_12: u16 = 1 << 12;
const IN_PLACE: u16 = 1 << 13;
const RUNNING: u16 = 1 << 14;
const MODE_BITS: u16 = REACHED | BIT_12 | IN_PLACE | RUNNING;

#[test]
fn every_event_in_every_state_leads_where_the_table_says() {
    let cells: Vec<_> = power_states().into_iter().map(|cell| (cell, 0)).collect();
    lead_where_the_table_says::<Zlac8030l>(&cells, 0);
}

#[test]
fn the_drive_says_that_it_has_booted_and_is_in_switch_on_disabled() {
    let mut bench = Bench::new();
    bench.hears(&["704#00"]).shows(0x6F, 0x60);
}

#[test]
fn the_statusword_of_each_state_has_bits_4_and_9_and_the_pattern_of_cia_402() {
    // docs/drives/zlac8030l.md, chapter 7. Bits 10 and above belong to the mode.
    let patterns = [
        ("switch_on_disabled", 0x0270),
        ("ready_to_switch_on", 0x0231),
        ("switched_on", 0x0233),
        ("operation_enabled", 0x0237),
        ("quick_stop_active", 0x0217),
        ("fault", 0x0298),
    ];
    for mode in [0, 1, 3, 4] {
        for (state, pattern) in patterns {
            let mut bench = Bench::new();
            bench.set(0x6060, mode);
            bench.reach(state);
            bench.run_ms(50);
            let statusword = bench.statusword();
            assert_eq!(statusword & 0x03FF, pattern, "mode {mode}, {state}: {statusword:04X}h");
            assert_eq!(statusword & 0xC000, 0, "{statusword:04X}h: neither running nor stopped from outside");
        }
    }
}

#[test]
fn a_drive_that_has_just_booted_shows_0670h_as_the_recorded_one_does() {
    assert_eq!(Bench::new().statusword(), 0x0670);
}

#[test]
fn in_profile_velocity_bits_10_12_and_14_tell_reached_standing_and_running() {
    let mut bench = Bench::new();
    bench.enable_in(3).run_ms(100);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | BIT_12, "at the target 0");
    bench.set(0x60FF, 100).run_ms(250);
    assert_eq!(bench.statusword() & MODE_BITS, RUNNING, "half way up the ramp");
    bench.run_ms(750);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | RUNNING, "at 100 r/min");
    bench.set(0x60FF, 0).run_ms(1000);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | BIT_12, "stopped");
}

#[test]
fn in_profile_position_bits_10_12_13_and_14_tell_reached_acknowledged_in_place_and_running() {
    let mut bench = Bench::new();
    bench.enable_in(1).run_ms(100);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | IN_PLACE, "nothing to do");
    bench.set(0x607A, 4096).set(0x6040, 0x1F);
    let taken = bench.statusword();
    assert_eq!(taken & (REACHED | BIT_12), BIT_12, "{taken:04X}h");
    bench.set(0x6040, 0x0F).run_ms(300);
    assert_eq!(bench.statusword() & (REACHED | BIT_12 | RUNNING), RUNNING, "under way, bit 4 is down");
    bench.run_ms(2000);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | IN_PLACE, "arrived");
}

#[test]
fn in_profile_torque_bits_10_and_14_tell_reached_and_running() {
    let mut bench = Bench::new();
    bench.set_rotor_locked(true).enable_in(4).set(0x6087, 1000).set(0x6071, 2000).run_ms(1000);
    assert_eq!(bench.statusword() & MODE_BITS, 0, "1 A of 2 A, a shaft that cannot turn");
    bench.run_ms(1500).shows(MODE_BITS, REACHED);
    bench.set_rotor_locked(false).run_ms(200);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | RUNNING);
}

#[test]
fn bit_15_tells_of_the_external_stop_whatever_the_mode() {
    for mode in [1, 3, 4] {
        let mut bench = Bench::new();
        bench.enable_in(mode).set_input(0, true).run_ms(20);
        assert_eq!(bench.statusword() & 0x8000, 0x8000, "mode {mode}");
        bench.reads(0x2003, 1);
        bench.set_input(0, false).run_ms(20);
        assert_eq!(bench.statusword() & 0x8000, 0, "mode {mode}");
    }
}

#[test]
fn a_fault_is_cleared_only_by_a_rising_bit_7_and_only_when_its_cause_is_gone() {
    let mut bench = Bench::in_state("switched_on");
    bench.break_down(true);
    assert_eq!((bench.get(0x603F), bench.get(0x1001)), (0x0200, 0x81), "Hall error; generic and manufacturer");
    bench.set(0x6040, 0x80);
    assert_eq!(bench.statusword() & 0xFF, 0x98, "the cause is still there");
    bench.break_down(false).set(0x6040, 0x80);
    assert_eq!(bench.statusword() & 0xFF, 0x98, "bit 7 did not rise");
    bench.set(0x6040, 0x00).set(0x6040, 0x80).shows(0xFF, 0x70).reads(0x603F, 0).reads(0x1001, 0);
}

#[test]
fn a_fault_and_its_end_are_told_by_emcy() {
    let mut bench = Bench::in_state("switch_on_disabled");
    bench.forget().break_down(true).break_down(false).set(0x6040, 0x80);
    let told: Vec<_> = bench.heard().into_iter().filter(|frame| frame.starts_with("084#")).collect();
    assert_eq!(told, ["084#0002810000000000", "084#0000000000000000"]);
}

#[test]
fn a_slow_wheel_is_a_running_one() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 3).run_ms(2000);
    assert_eq!(bench.statusword() & (BIT_12 | RUNNING), RUNNING, "3 r/min is not 0 r/min");
    bench.reads(0x2027, 1);
}

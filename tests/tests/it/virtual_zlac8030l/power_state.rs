//! Bits of the statusword that belong to the mode.

use crate::virtual_zlac8030l::bench::Bench;

const REACHED: u16 = 1 << 10;
/// Speed is zero in profile velocity, set-point acknowledge in profile position.
const BIT_12: u16 = 1 << 12;
const IN_PLACE: u16 = 1 << 13;
const RUNNING: u16 = 1 << 14;
const MODE_BITS: u16 = REACHED | BIT_12 | IN_PLACE | RUNNING;

#[test]
fn in_profile_velocity_bits_10_12_and_14_show_reached_standing_and_running() {
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
fn in_profile_position_bits_10_12_13_and_14_show_reached_acknowledged_in_place_and_running() {
    let mut bench = Bench::new();
    bench.enable_in(1).run_ms(100);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | IN_PLACE, "nothing to do");
    bench.set(0x607A, 4096).set(0x6040, 0x1F);
    let taken = bench.statusword();
    assert_eq!(taken & (REACHED | BIT_12), BIT_12, "{taken:04X}h");
    assert_eq!(bench.run_ms(200).statusword() & BIT_12, BIT_12, "bit 4 is still up");
    bench.set(0x6040, 0x0F).shows(BIT_12, 0).run_ms(300);
    assert_eq!(bench.statusword() & (REACHED | BIT_12 | RUNNING), RUNNING, "under way, bit 4 is down");
    bench.run_ms(2000);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | IN_PLACE, "arrived");
}

#[test]
fn in_profile_torque_bits_10_and_14_show_reached_and_running() {
    let mut bench = Bench::new();
    bench.set_rotor_locked(true).enable_in(4).set(0x6087, 1000).set(0x6071, 2000).run_ms(1000);
    assert_eq!(bench.statusword() & MODE_BITS, 0, "1 A of 2 A, a shaft that cannot turn");
    bench.run_ms(1500).shows(MODE_BITS, REACHED);
    bench.set_rotor_locked(false).run_ms(200);
    assert_eq!(bench.statusword() & MODE_BITS, REACHED | RUNNING);
}

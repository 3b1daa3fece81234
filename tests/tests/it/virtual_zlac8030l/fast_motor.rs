//! `motor=fast`: the other winding of the wheel motor, with which 200Ah, 6081h and 60FFh reach the 1000 r/min of chapter 9.

use plant::hub_motor::HubMotorModel;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

const MODEL: HubMotorModel = HubMotorModel::ZLLG65ASM250;
const TARGET_REACHED: u16 = 1 << 10;

fn fast() -> Bench {
    Bench::choosing("motor", "fast")
}

#[test]
fn at_48_v_the_fast_motor_reaches_1000_rpm_either_way_and_bit_10_comes() {
    let mut bench = fast();
    // A bare wheel gives 77 J back on its way down.
    bench.set((0x202E, 5), 1).enable_in(3);
    for target in [600, 1000, -1000] {
        bench.set(0x60FF, target).run_ms(2000);
        let goal = target as f64;
        bench.turns_at(goal - 3.0, goal + 3.0);
        assert_within("606Ch", bench.get(0x606C) as f64, goal * 10.0 - 30.0, goal * 10.0 + 30.0);
        assert_eq!((bench.statusword() & TARGET_REACHED, bench.get(0x603F)), (TARGET_REACHED, 0), "{target}");
    }
}

#[test]
fn a_position_move_at_1000_rpm_arrives_with_the_fast_motor() {
    let mut bench = fast();
    bench.set((0x202E, 5), 1).enable_in(1).set(0x6081, 1000).set(0x607A, 100_000).set(0x6040, 0x1F).run_ms(1000);
    bench.turns_at(990.0, 1010.0);
    bench.run_ms(2000).is_at(100000, 30).reads(0x603F, 0);
}

/// 48 V carry the slow motor to some 510 r/min: the way that it lags behind a faster move grows past 2017h.
#[test]
fn a_position_move_faster_than_the_slow_motor_follows_ends_out_of_tolerance() {
    let mut bench = Bench::choosing("motor", "slow");
    bench.enable_in(1).set(0x6081, 800).set(0x607A, 200_000).set(0x6040, 0x1F).run_ms(2000).reads(0x603F, 0x0020);
}

#[test]
fn the_fast_motor_needs_two_and_a_half_times_the_current_for_the_same_torque() {
    let mut bench = fast();
    bench.enable_in(3).set(0x60FF, 60).run_ms(800);
    bench.set_load_torque(3.0).run_ms(1500).turns_at(59.5, 60.5);
    let friction_nm = MODEL.rotor.coulomb_nm + MODEL.rotor.viscous_nm_s * 60.0 * core::f64::consts::PI / 30.0;
    let current_a = (3.0 + friction_nm) / MODEL.pmsm.torque_constant_nm_a();
    assert_within("6077h in 0.1 A", bench.get(0x6077) as f64, current_a * 10.0 - 2.5, current_a * 10.0 + 2.5);
}

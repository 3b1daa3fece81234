//! What a load does to a motor that is not enabled: nothing is infinite, and nothing is silent.

use std::time::Duration;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

#[test]
fn a_load_of_four_holding_torques_makes_the_free_shaft_run_away_until_its_bearings_seize_and_get_says_so() {
    let mut bench = Bench::new();
    bench.world("1 load torque 2");
    let (mut fastest, mut highest_v) = (0.0_f64, 0.0_f64);
    for _ in 0..20_000 {
        bench.run(Duration::from_micros(50));
        let report = bench.report();
        (fastest, highest_v) = (fastest.max(-report.velocity_rpm), highest_v.max(report.supply_v));
    }
    // 36,000 r/min, the makers' limit of such bearings; the suppressors hold the bus at some 50 V.
    assert_within("r/min", fastest, 34_000.0, 36_000.0);
    assert_within("V", highest_v, 40.0, 60.0);
    let reported = bench.world_answer("1 get");
    assert!(reported.contains("\"velocity_rpm\":0") && reported.contains("bearings seized"), "{reported}");
    assert_eq!(bench.get(0x603F), 0xFF01, "the drive saw the bus above 40 V (2.1)");
    // New bearings, and it works again.
    bench.world("1 load torque 0").world("1 rotor free").run_ms(2000);
    bench.set(0x2011, 1).enable_in(1).run_ms(200);
    bench.move_by(4000).run_ms(1500);
    let report = bench.report();
    assert_eq!((report.damage, report.position, report.error_code), (None, 4000, 0));
}

#[test]
fn a_hand_that_turns_the_free_shaft_meets_its_friction_and_lifts_the_bus_no_higher_than_the_suppressors_let_it() {
    // 0.05 N m: without a generator's load the drag of 0.1 mN m s would end it at 450 rad/s, 4300 r/min.
    let mut bench = Bench::new();
    bench.world("1 load torque -0.05").run_ms(3000);
    let report = bench.report();
    assert_within("r/min", report.velocity_rpm, 2000.0, 4200.0);
    assert_within("V", report.supply_v, 46.0, 53.0);
    assert_eq!((bench.get(0x603F), bench.report().damage), (0xFF01, None));
}

#[test]
fn a_supply_far_above_its_range_burns_the_board_and_get_says_so() {
    let mut bench = Bench::new();
    bench.world("1 supply 60");
    let burnt = bench.seconds_until(30.0, Duration::from_millis(10), |report| report.damage.is_some());
    // 6.6 A at 59 V heat 30 J/K by 125 K.
    assert_within("s", burnt, 8.0, 13.0);
    assert!(bench.world_answer("1 get").contains("transistor"), "what has burnt");
    bench.world("1 supply 24").world("1 fault bridge off").run_ms(1000);
    bench.set(0x2011, 1).set(0x2011, 1);
    assert_eq!((bench.report().damage, bench.get(0x603F)), (None, 0));
}

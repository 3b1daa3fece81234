//! The currents of 2005h and 2007h.

use ferrodrive_tests::zlim42c::figure;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

#[test]
fn the_vector_is_as_long_as_the_peak_of_2005h_and_half_of_it_at_rest() {
    for setting in 0..8 {
        let peak_a = figure("current", &setting.to_string(), "peak");
        for (lock, rest_a) in [(0, 0.5 * peak_a), (1, peak_a)] {
            let mut bench = Bench::new();
            bench.set(0x2005, setting).set(0x2007, lock).enable_in(1).run_ms(20);
            assert_within("A after switching on", bench.report().current_a, 0.97 * peak_a, 1.03 * peak_a);
            bench.run_ms(300);
            assert_within("A at rest", bench.report().current_a, 0.97 * rest_a, 1.03 * rest_a);
            bench.move_by(4000).run_ms(300);
            assert_within("A while it turns", bench.report().current_a, 0.95 * peak_a, 1.05 * peak_a);
        }
    }
}

#[test]
fn the_bus_voltage_reads_in_volts() {
    let mut bench = Bench::new();
    for supply_v in [20.0, 24.0, 30.0] {
        bench.set_supply(supply_v).run_ms(200).reads(0x2069, supply_v as i64);
    }
}

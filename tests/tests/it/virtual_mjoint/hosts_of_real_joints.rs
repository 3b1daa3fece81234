//! What programs for real joints of this family do and see, from public code and its notes: the joint here does the same.

use crate::virtual_mjoint::bench::{Bench, TURN};

/// 5.07.1: 10Fh is halt, with bit 5 = 0, and without bit 5 a target is only kept (5.06.1, the order of the steps).
#[test]
fn after_10fh_the_next_target_is_kept_and_the_one_after_2fh_runs() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x2F).set(0x607A, TURN).reaches(2000);
    bench.set(0x6040, 0x10F).set(0x607A, 3 * TURN).run_ms(500).is_at(TURN, 30);
    bench.set(0x6040, 0x2F).run_ms(500).is_at(TURN, 30);
    bench.set(0x607A, 3 * TURN).reaches(3000).is_at(3 * TURN, 30);
}

/// 5.11.2: the watch begins with the first heartbeat of the host, and this one sends none. No NMT command either (5.11.1).
#[test]
fn a_host_without_heartbeat_and_without_an_nmt_command_is_served_for_as_long_as_it_likes() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x2F).send("401#2F000364000000").run_ms(10_000).reads(0x260E, 0);
    let rpm = bench.report().velocity_rpm;
    assert!((rpm - 100.0).abs() < 2.0, "{rpm}");
}

//! The modes of the ZLAC8030L on a hub motor.

use crate::bench::Bench;
use crate::bench::hub_wheel::HubWheel;

#[test]
fn profile_velocity_reaches_its_target_in_the_acceleration_time_without_much_overshoot() {
    let mut bench = Bench::<HubWheel>::new();
    bench.enable(3);
    bench.write(0x60FF, 0, 100);
    let mut most: f64 = 0.0;
    for _ in 0..1500 {
        bench.run_ms(1);
        most = most.max(bench.rpm());
    }
    assert!((bench.rpm() - 100.0).abs() < 1.0, "{}", bench.rpm());
    assert!(most < 105.0, "{most}");
}

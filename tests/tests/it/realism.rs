//! Machines with the noise and the flaws of real ones: they still do what the manuals say, they differ as real ones do,
//! and the same seed gives the same run.

use ferrodrive_tests::bench::{mjoint, zlac8030l, zlim42c};
use sim::machine::Realism;
use sim::{Digest, World};

fn make_real(world: &mut World) {
    let numbers: Vec<u8> = world.drive_numbers().collect();
    for number in numbers {
        world.set_realism(number, Realism::Full).expect("a drive");
    }
}

fn wheel(realism: Realism) -> zlac8030l::Bench {
    let mut bench = zlac8030l::Bench::new();
    if realism == Realism::Full {
        make_real(&mut bench.world);
    }
    bench
}

/// TPDOs of an object that is sent when it changes, in a second of standing still.
fn tpdos_in_a_second(realism: Realism, record: i64) -> usize {
    let mut bench = wheel(realism);
    bench.map(0x1A00, &[record]).set((0x1800, 2), 0xFF).set((0x1800, 3), 0).set((0x1800, 5), 0).send("000#0100");
    bench.run_ms(500);
    bench.forget().run_ms(1000);
    bench.heard_of("184#").len()
}

#[test]
fn event_driven_tpdos_of_voltage_and_temperature_send_by_the_flicker_of_their_readings() {
    for record in [0x2029_0010, 0x2026_0110] {
        assert_eq!(tpdos_in_a_second(Realism::Ideal, record), 0, "{record:08X}h");
        let sent = tpdos_in_a_second(Realism::Full, record);
        assert!(sent > 10, "{record:08X}h was sent {sent} times");
    }
}

/// Mean and peak-to-peak of the true speed at 2 r/min, the slowest that is of use.
fn crawl(realism: Realism) -> (f64, f64) {
    let mut bench = wheel(realism);
    bench.set((0x202F, 5), 1).enable_in(3).set(0x60FF, 2).run_ms(4000);
    let (mut sum, mut least, mut most) = (0.0, f64::MAX, f64::MIN);
    for _ in 0..4000 {
        bench.run_ms(1);
        let rpm = bench.report().velocity_rpm;
        (sum, least, most) = (sum + rpm, rpm.min(least), rpm.max(most));
    }
    bench.reads(0x603F, 0);
    (sum / 4000.0, most - least)
}

#[test]
fn a_wheel_with_cogging_and_noise_crawls_less_evenly_and_as_far() {
    let (mean, ripple) = crawl(Realism::Full);
    let (_, smooth) = crawl(Realism::Ideal);
    assert!((mean - 2.0).abs() < 0.05, "{mean} r/min in the mean");
    assert!(ripple > 3.0 * smooth && ripple < 4.0, "{ripple} r/min from peak to peak, {smooth} without");
}

#[test]
fn a_real_wheel_reaches_a_position_and_keeps_it_within_some_counts() {
    let mut bench = wheel(Realism::Full);
    bench.set(0x6081, 120).enable_in(1).set(0x607A, 20_000).set(0x6040, 0x1F).run_ms(6000);
    let mut voltages: Vec<i64> = Vec::new();
    for _ in 0..50 {
        bench.run_ms(7);
        let position = bench.get(0x6064);
        assert!((position - 20_000).abs() <= 3, "{position}");
        voltages.push(bench.get(0x2029));
    }
    assert!(voltages.iter().any(|voltage| *voltage != voltages[0]), "nothing flickers: {voltages:?}");
    bench.reads(0x603F, 0);
}

#[test]
fn a_real_joint_and_a_real_stepper_turn_as_commanded_without_a_fault() {
    let mut joint = mjoint::Bench::new();
    make_real(&mut joint.world);
    joint.set(0x6060, 3).set(0x60FF, 600).set(0x6040, 0x0F).run_ms(2000);
    assert!((joint.report().velocity_rpm - 600.0).abs() < 12.0, "{:?}", joint.report());
    joint.reads(0x260E, 0);

    let mut stepper = zlim42c::Bench::new();
    make_real(&mut stepper.world);
    stepper.enable_in(3).set(0x60FF, 300).run_ms(2000);
    let angle = stepper.report().shaft_angle_rad;
    stepper.run_ms(1000);
    let turned = (stepper.report().shaft_angle_rad - angle) / core::f64::consts::TAU;
    assert!((turned - 5.0).abs() < 0.05, "{turned} turns in a second");
    stepper.reads(0x603F, 0);
}

#[test]
fn the_same_seed_gives_the_same_noise_and_a_clone_goes_on_with_it() {
    let run = |seed: u64| -> (Digest, Digest) {
        let mut world = World::new(can::Bitrate::K500, seed);
        world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1))).expect("a free number");
        make_real(&mut world);
        world.run_for(core::time::Duration::from_millis(300));
        let mut clone = world.clone();
        world.run_for(core::time::Duration::from_millis(300));
        clone.run_for(core::time::Duration::from_millis(300));
        (world.digest(), clone.digest())
    };
    let (first, its_clone) = run(1);
    assert_eq!((first, its_clone), run(1));
    assert_eq!(first, its_clone);
}

//! What users of such drives stumble over: mode changes, halts, set-points, sensors that break.

use sim::Component;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

#[test]
fn halt_set_during_a_mode_change_ends_without_a_jump() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 100).run_ms(800);
    bench.set(0x6040, 0x10F).set(0x6060, 1).set(0x607A, 0).run_ms(1000);
    assert_eq!(bench.get(0x6061), 1, "it stands under halt, so the mode has changed");
    let stands = bench.report().position;
    bench.set(0x6040, 0x0F).run_ms(1000);
    assert_within("counts after the halt", (bench.report().position - stands) as f64, -30.0, 30.0);
    bench.set(0x6040, 0x1F).run_ms(5000);
    assert_within("position after the set-point", bench.report().position as f64, -30.0, 30.0);
}

#[test]
fn a_move_left_behind_by_a_mode_change_under_halt_does_not_come_back() {
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x607A, 40_000).set(0x6040, 0x1F).run_ms(800);
    bench.set(0x6040, 0x10F).run_ms(1000);
    bench.set(0x6060, 3).set(0x6040, 0x0F).run_ms(1000);
    bench.set(0x6060, 1);
    let stands = bench.report().position;
    assert!(stands < 10_000);
    bench.run_ms(2000);
    assert_within("counts", (bench.report().position - stands) as f64, -30.0, 30.0);
}

#[test]
fn a_move_ended_by_quick_stop_fault_or_disabling_does_not_go_on_when_enabled_again() {
    for (name, controlwords) in
        [("quick stop", &[0x02, 0x0F][..]), ("disabled", &[0x00, 0x06, 0x07, 0x0F]), ("fault", &[])]
    {
        let mut bench = Bench::new();
        bench.enable_in(1).set(0x607A, 40_000).set(0x6040, 0x1F).run_ms(800);
        if name == "fault" {
            bench.set_fault(Component::Hall, true).run_ms(3000);
            bench.set_fault(Component::Hall, false).run_ms(50);
            bench.set(0x6040, 0x80).reads(0x603F, 0);
            bench.enable();
        }
        for controlword in controlwords {
            bench.set(0x6040, *controlword).run_ms(2500);
        }
        let stands = bench.report();
        assert!(stands.position < 15_000 && stands.velocity_rpm.abs() < 1.0, "{name}: {stands:?}");
        bench.run_ms(2000);
        assert_within(name, (bench.report().position - stands.position) as f64, -30.0, 30.0);
        assert_eq!(bench.statusword() & 0x6F, 0x27, "{name}: enabled");
        // A relative move counts from where it stands now.
        bench.set(0x607A, 4096).set(0x6040, 0x4F).set(0x6040, 0x5F).run_ms(2500);
        assert_within(name, (bench.report().position - stands.position) as f64, 4066.0, 4126.0);
    }
}

#[test]
fn a_new_target_or_speed_in_a_move_waits_for_the_next_set_point() {
    let mut bench = Bench::new();
    bench.enable_in(1).set(0x607A, 12_288).set(0x6040, 0x1F).run_ms(800);
    bench.set(0x607A, -5000).set(0x6081, 10).run_ms(400).turns_at(118.0, 122.0);
    bench.run_ms(2000).is_at(12288, 30);
}

#[test]
fn enabling_a_turning_wheel_catches_it_without_a_fault() {
    for mode in [1, 3, 4] {
        let mut bench = Bench::new();
        bench.set(0x2000, 0).set(0x6060, mode).set_load_torque(-1.0).run_ms(150);
        bench.set_load_torque(0.0);
        assert!(bench.report().velocity_rpm > 50.0);
        bench.enable().run_ms(3000);
        assert_eq!((bench.get(0x603F), bench.statusword() & 0x6F), (0, 0x27), "mode {mode}");
        bench.turns_at(-0.5, 0.5);
    }
}

#[test]
fn lines_and_direction_changed_while_enabled_wait_until_the_motor_is_free() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 60).run_ms(1000);
    bench.set(0x2001, 1).run_ms(1000);
    assert_within("speed", bench.report().velocity_rpm.abs(), 59.0, 61.0);
    bench.reads(0x603F, 0);
    let turned = bench.report().shaft_angle_rad;
    bench.run_ms(500);
    assert!(bench.report().shaft_angle_rad > turned, "still the old way");
}

#[test]
fn an_eeprom_that_cannot_be_written_is_reported_and_factory_settings_mend_it() {
    let mut bench = Bench::new();
    bench.set_fault(Component::Eeprom, true).run_ms(20).reads(0x603F, 0x0100).reads(0x1001, 0x81);
    bench.set_fault(Component::Eeprom, false).run_ms(5);
    bench.set(0x2009, 1).run_ms(20).reads(0x603F, 0).shows(0xFF, 0x70);
}

#[test]
fn a_broken_encoder_and_a_lost_phase_are_reported_once_the_motor_is_to_turn() {
    for (component, code) in [(Component::Encoder, 0x1000), (Component::Phase, 0x0004)] {
        let mut bench = Bench::new();
        bench.enable_in(3).set_fault(component, true).set(0x60FF, 60).run_ms(2500);
        let found = bench.get(0x603F);
        assert!(found & code != 0, "{component:?}: {found:04X}h");
    }
}

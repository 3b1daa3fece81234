//! What a stepper's field carries: as stiff and as weak at fidelity mechanical as at full, and by the closed forms of its motor.

use std::time::Duration;

use can::{CanId, Frame, Instant};
use plant::StepperMotorModel;
use plant::coupled::CommonShaftModel;
use sim::machine::zlim42c_82;
use sim::{CoupledShaft, Coupling, Fidelity, Place, Report, StationId, VirtualDrive, World};

use super::pair::{Act, NODE, Subject, hand, world, write};
use super::stepper::{Long, Short};

/// A drive that is enabled, and its host.
struct Table {
    world: World,
    host: StationId,
}

impl Table {
    /// Of this current setting (2005h), also at standstill, in a mode.
    fn new<S: Subject>(fidelity: Fidelity, setting: i64, mode: i64) -> Self {
        let (world, host) = world::<S>(fidelity);
        let mut table = Self { world, host };
        let values = [(0x2005, 2, setting), (0x2007, 2, 1), (0x6083, 4, 500), (0x6060, 1, mode)];
        for (index, size, value) in values.into_iter().chain([0x06, 0x07, 0x0F].map(|word| (0x6040, 2, word))) {
            table.act(write(index, size, value));
        }
        table.run_ms(50);
        table
    }

    fn act(&mut self, act: Act) {
        match act {
            Act::Frame(frame) => self.world.send(self.host, frame).expect("room at the host"),
            Act::Hand(stimulus) => {
                self.world.apply(Place::node(NODE), &stimulus).expect("a drive").expect("what it takes")
            }
        }
        self.run_ms(2);
    }

    fn run_ms(&mut self, ms: u64) {
        self.world.run_for(Duration::from_millis(ms));
    }

    fn report(&mut self) -> Report {
        self.world.report(NODE).expect("a drive")
    }

    /// Pulses that the rotor is behind.
    fn behind(&mut self) -> i64 {
        let report = self.report();
        report.position - report.rotor_position.expect("known here")
    }
}

fn both(of: impl Fn(Fidelity) -> f64) -> [f64; 2] {
    [Fidelity::Full, Fidelity::Mechanical].map(of)
}

/// The last load that a motor carries while it turns at this speed, N·m: one that grows to half of what its voltage and its current
/// allow by tenths of it, and on by hundredths, one every 40 ms. Its friction comes to that.
fn carried_nm<S: Subject>(
    fidelity: Fidelity,
    model: &StepperMotorModel,
    (setting, current_a): (i64, f64),
    rpm: i64,
) -> f64 {
    let rad_s = rpm.abs() as f64 * std::f64::consts::PI / 30.0;
    let resistance_ohm = model.stepper.resistance_ohm + model.rig.switch_resistance_ohm;
    let most_nm =
        model.stepper.pull_out_nm(24.0, resistance_ohm, rad_s).min(model.stepper.torque_constant_nm_a() * current_a);
    let mut table = Table::new::<S>(fidelity, setting, 3);
    table.act(write(0x60FF, 4, rpm));
    table.run_ms(900);
    let mut carried = 0.0;
    for percent in (10..50).step_by(10).chain(50..=115) {
        let torque_nm = f64::from(percent) * 0.01 * most_nm * rpm.signum() as f64;
        table.act(hand(&format!("load torque {torque_nm}")));
        table.run_ms(40);
        // Four full steps.
        if table.behind().abs() > 80 + rpm.abs() / 30 {
            break;
        }
        carried = torque_nm.abs();
    }
    carried
}

#[test]
#[allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]
fn the_pull_out_torque_is_the_same_at_every_speed() {
    let mut worst = 0.0_f64;
    for rpm in [20, 60, 300, -600, 1000, 1500, -2000] {
        for setting in [(3, 1.2), (7, 2.2)] {
            let short = both(|fidelity| carried_nm::<Short>(fidelity, &StepperMotorModel::ZLIM42_C_70, setting, rpm));
            let long = both(|fidelity| carried_nm::<Long>(fidelity, &StepperMotorModel::ZLIM42_C_82, setting, rpm));
            for (name, [full, mechanical]) in [("70 mm", short), ("82 mm", long)] {
                println!("{name}, {rpm} r/min, {} A: {full:.4} and {mechanical:.4} N·m", setting.1);
                worst = worst.max((mechanical / full - 1.0).abs());
                assert!(
                    (mechanical / full - 1.0).abs() <= 0.05,
                    "{name}, {rpm} r/min, {setting:?}: {full}, {mechanical} N·m"
                );
            }
        }
    }
    println!("{worst:.3} apart");
}

#[test]
#[allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]
fn a_load_at_standstill_turns_the_rotor_as_far() {
    for (setting, current_a) in [(3, 1.2), (7, 2.2)] {
        for share in [0.2, -0.5, 0.8] {
            let model = StepperMotorModel::ZLIM42_C_70;
            let load_nm = share * model.stepper.torque_constant_nm_a() * current_a;
            let turned = both(|fidelity| {
                let mut table = Table::new::<Short>(fidelity, setting, 1);
                table.act(hand(&format!("load torque {load_nm}")));
                table.run_ms(1000);
                table.report().shaft_angle_rad * f64::from(model.stepper.teeth)
            });
            println!("{current_a} A, {load_nm:.3} N·m: {turned:.4?} electrical rad");
            // Some per cent of a quarter of an electrical turn.
            assert!((turned[0] - turned[1]).abs() < 0.02, "{load_nm} N·m: {turned:?} rad");
            let held_nm = -(model.stepper.torque_constant_nm_a() * current_a * turned[1].sin()
                + model.stepper.detent_nm * (4.0 * turned[1]).sin());
            assert!((held_nm - load_nm).abs() <= model.rotor.coulomb_nm + 1e-3, "{load_nm} N·m: {held_nm} N·m");
        }
    }
}

#[test]
fn a_rotor_that_stands_under_a_load_creeps_by_not_a_bit() {
    let mut table = Table::new::<Short>(Fidelity::Mechanical, 3, 1);
    table.act(hand("load torque 0.1"));
    table.run_ms(2000);
    let stood = table.report();
    for _ in 0..5 {
        table.run_ms(1000);
        let stands = table.report();
        assert_eq!(stands.shaft_angle_rad.to_bits(), stood.shaft_angle_rad.to_bits());
        assert_eq!(stands.velocity_rpm, 0.0);
    }
    // Half of the current flows since it stands (2007h = 0).
    table.act(write(0x2007, 2, 0));
    table.run_ms(500);
    assert!((table.report().current_a - 0.6).abs() < 0.01, "{:?}", table.report());
}

#[test]
fn an_overloaded_rotor_slips_by_whole_turns_of_the_field_to_the_side_of_its_load() {
    for fidelity in [Fidelity::Full, Fidelity::Mechanical] {
        for torque_nm in [0.8_f64, -0.8] {
            let mut table = Table::new::<Short>(fidelity, 7, 1);
            table.act(hand("load inertia 0.00005"));
            table.act(hand(&format!("load torque {torque_nm}")));
            table.run_ms(5);
            table.act(hand("load torque 0"));
            table.run_ms(2000);
            let behind = table.behind();
            assert_eq!(
                (behind % 80, behind.signum() as f64),
                (0, torque_nm.signum()),
                "{fidelity}, {torque_nm} N·m: {behind}"
            );
        }
    }
}

#[test]
fn energies_close_and_are_those_of_full() {
    for (rpm, load) in [
        (100, "load torque 0.1"),
        (600, "load inertia 0.0001"),
        (1500, "load torque 0.02"),
        (-60, "load pulley 0.3 0.05"),
    ] {
        let heats = both(|fidelity| {
            let mut table = Table::new::<Short>(fidelity, 3, 3);
            table.act(hand(load));
            let first = table.report().physics.expect("known here");
            let missing_j = |table: &mut Table| {
                let now = table.report().physics.expect("known here");
                now.energy.balance_j() - first.energy.balance_j() - (now.stored_j - first.stored_j)
            };
            table.act(write(0x60FF, 4, rpm));
            let (mut worst, mut through) = (0.0_f64, 0.0);
            for ms in 0..200 {
                match ms {
                    100 => table.act(write(0x60FF, 4, 0)),
                    170 => table.act(write(0x6040, 2, 0)),
                    _ => table.run_ms(8),
                }
                worst = worst.max(missing_j(&mut table).abs());
                through = table.report().physics.expect("known here").energy.source_j - first.energy.source_j;
            }
            assert!(worst < 1e-3 * through, "{fidelity}, {rpm} r/min, {load}: {worst} J missing of {through} J");
            let energy = table.report().physics.expect("known here").energy;
            energy.winding_j - first.energy.winding_j
        });
        assert!((heats[0] / heats[1] - 1.0).abs() < 0.02, "{rpm} r/min, {load}: {heats:?} J");
    }
}

/// Two bare rotors on a shaft without inertia, both at the highest current: they swing about the field in less than three
/// milliseconds, which is no more than three of their steps.
#[test]
fn two_steppers_on_one_shaft_come_to_rest_where_they_do_at_full() {
    let settled = both(|fidelity| {
        let mut world = World::new(Long::BITRATE, 1);
        let host = world.add_probe();
        for node in [NODE, NODE + 1] {
            let mut drive = zlim42c_82(node, 1);
            drive.set_fidelity(fidelity, Instant::ZERO).expect("it has both");
            world.add_drive(node, Box::new(drive)).expect("a free number");
        }
        let shaft = Coupling::CommonShaft(CommonShaftModel { coulomb_nm: 0.002, ..CommonShaftModel::default() });
        let shafts = [NODE, NODE + 1].map(|node| CoupledShaft::direct(Place::node(node)));
        world.couple("shaft", &shaft, &shafts).expect("two free shafts");
        world.run_for(Duration::from_millis(50));
        let values = [(0x2005, 7), (0x2007, 1), (0x6060, 1), (0x6040, 0x06), (0x6040, 0x07), (0x6040, 0x0F)];
        for (index, value) in values {
            for node in [NODE, NODE + 1] {
                let Act::Frame(frame) = write(index, if index == 0x6060 { 1 } else { 2 }, value) else { continue };
                let id = CanId::standard(0x600 + u16::from(node));
                let data = frame.data().try_into().expect("eight bytes");
                world.send(host, Frame::full(id, data)).expect("room at the host");
                world.run_for(Duration::from_millis(3));
            }
        }
        let mut farthest = 0.0_f64;
        for torque_nm in [0.6, 0.0, -0.7, 0.3] {
            let load = format!("load torque {torque_nm}").parse().expect("a stimulus");
            world.apply(Place::node(NODE), &load).expect("a drive").expect("what it takes");
            for _ in 0..500 {
                world.run_for(Duration::from_millis(1));
                farthest = farthest.max(world.report(NODE).expect("a drive").shaft_angle_rad.abs());
            }
        }
        let report = world.report(NODE + 1).expect("a drive");
        assert!(report.velocity_rpm.abs() < 0.1, "{fidelity}: {report:?}");
        // Within a quarter of an electrical turn, of which there are 50 in a turn.
        assert!(farthest * 50.0 < std::f64::consts::FRAC_PI_2, "{fidelity}: {farthest} rad");
        report.shaft_angle_rad * 50.0
    });
    assert!((settled[0] - settled[1]).abs() < 0.02, "{settled:?} electrical rad");
}

//! Torques and energies of virtual drives: the book balances, and its rows are what closed forms give.

use std::time::Duration;

use can::Bitrate;
use drives::mjoint::Model;
use sim::command::answer;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::recorder::{Channel, Recorder, Signal};
use sim::{Place, World};

const WHEEL: u8 = 4;
const STEPPER: u8 = 2;
const JOINT: u8 = 1;
/// Standard acceleration of gravity (ISO 80000-3), m/s².
const GRAVITY_M_S2: f64 = 9.806_65;

/// A wheel, a stepper and a joint, none of them enabled.
fn world() -> World {
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(WHEEL, Box::new(zlac8030l(WHEEL, 1))).unwrap();
    world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, 1))).unwrap();
    let joint = mjoint(Model::named("m4230e17b50").unwrap(), JOINT, Bitrate::K500);
    world.add_drive(JOINT, Box::new(joint)).unwrap();
    world.run_for(Duration::from_millis(100));
    world
}

fn done(world: &mut World, line: &str) {
    let reported = answer(world, line).unwrap().json;
    assert!(reported.contains("\"ok\":true"), "{line}: {reported}");
}

/// Signals of one drive over time.
struct Samples(Recorder);

impl Samples {
    /// Records a drive for this time.
    fn take(world: &mut World, node: u8, time: Duration) -> Self {
        let channels = Signal::ALL.map(|signal| Channel { place: Place::node(node), signal });
        world.start_recording(Recorder::new(Duration::from_millis(1), channels));
        world.run_for(time);
        Self(world.stop_recording().unwrap())
    }

    fn of(&self, signal: Signal) -> Vec<f64> {
        self.0.samples(signal as usize).collect()
    }

    /// By how much it has changed from the first sample to the last.
    fn change(&self, signal: Signal) -> f64 {
        let samples = self.of(signal);
        samples[samples.len() - 1] - samples[0]
    }
}

fn near(what: &str, value: f64, expected: f64, relative: f64) {
    assert!((value - expected).abs() <= relative * expected.abs(), "{what}: {value}, not {expected}");
}

/// What came in, less where it went and what is stored more, at each sample since the first.
fn missing_j(samples: &Samples) -> Vec<f64> {
    let out = [
        Signal::ElectronicsEnergy,
        Signal::WindingHeat,
        Signal::SwitchesHeat,
        Signal::BleederHeat,
        Signal::FrictionHeat,
        Signal::LoadWork,
        Signal::StoredEnergy,
    ];
    let mut rest = samples.of(Signal::SourceEnergy);
    for signal in out {
        rest.iter_mut().zip(samples.of(signal)).for_each(|(rest, joules)| *rest -= joules);
    }
    let first = rest[0];
    rest.into_iter().map(|rest| rest - first).collect()
}

#[test]
fn what_comes_in_goes_out_or_is_stored_whatever_turns_the_shaft() {
    for (node, torque) in [(WHEEL, "-2"), (STEPPER, "-0.6"), (JOINT, "-40")] {
        for load in [format!("load torque {torque}"), "load pulley 3 0.05".to_owned(), "load inertia 0.01".to_owned()] {
            let mut world = world();
            done(&mut world, &format!("{node} {load}"));
            let samples = Samples::take(&mut world, node, Duration::from_secs(2));
            let through = samples.change(Signal::SourceEnergy).abs()
                + samples.change(Signal::LoadWork).abs()
                + samples.of(Signal::StoredEnergy)[0].abs();
            assert!(through > 0.1, "{node} {load}: {through} J");
            let worst = missing_j(&samples).into_iter().fold(0.0, |worst: f64, rest| worst.max(rest.abs()));
            assert!(worst < 1e-3 * through, "{node} {load}: {worst} J missing of {through} J");
        }
    }
}

#[test]
fn work_on_a_load_is_its_torque_times_the_way() {
    let mut world = world();
    done(&mut world, "4 load torque -2");
    let samples = Samples::take(&mut world, WHEEL, Duration::from_secs(1));
    assert!(samples.of(Signal::LoadTorque).iter().all(|torque| *torque == -2.0));
    let way_rad = samples.change(Signal::LoadAngle);
    assert!(way_rad > 1.0, "the load turns it: {way_rad} rad");
    near("work on the torque", samples.change(Signal::LoadWork), -2.0 * way_rad, 1e-3);
    // It is not driven: it has its speed from the load, less what friction took.
    near(
        "of the load's work",
        samples.change(Signal::StoredEnergy) + samples.change(Signal::FrictionHeat),
        2.0 * way_rad,
        0.02,
    );
}

#[test]
fn a_weight_that_falls_gives_its_height() {
    let mut world = world();
    done(&mut world, "4 load pulley 3 0.05");
    let samples = Samples::take(&mut world, WHEEL, Duration::from_millis(600));
    // Positive motion lifts it: it falls the other way.
    let fallen_m = -samples.change(Signal::LoadAngle) * 0.05;
    assert!(fallen_m > 0.05, "{fallen_m} m");
    near("torque of the weight", samples.of(Signal::LoadTorque)[100], 3.0 * GRAVITY_M_S2 * 0.05, 1e-9);
    near("work of the weight", samples.change(Signal::LoadWork), -3.0 * GRAVITY_M_S2 * fallen_m, 1e-3);
}

#[test]
fn a_shaft_that_stands_moves_no_energy_but_that_of_the_electronics() {
    let mut world = world();
    let samples = Samples::take(&mut world, WHEEL, Duration::from_secs(1));
    for still in [Signal::FrictionHeat, Signal::LoadWork, Signal::BleederHeat, Signal::ShaftAngle, Signal::MotorTorque]
    {
        assert_eq!(samples.change(still), 0.0, "{}", still.name());
    }
    near(
        "from the source",
        samples.change(Signal::SourceEnergy),
        samples.change(Signal::ElectronicsEnergy) + samples.change(Signal::SwitchesHeat),
        1e-3,
    );
    assert!(samples.change(Signal::ElectronicsEnergy) > 0.0);
}

//! What is identified of a drive is held to what its plant has, over a bus as a program has it; and so are the gains proposed.

use std::f64::consts::TAU;
use std::time::Duration;

use canopen::Mux;
use devices::{Description, Loops};
use host::tune::{Bounds, Found, Proposed, Setup, Twin, loops_of, measure, motor_of};
use master::Drive;
use master::cyclic::CyclicOptions;
use sim::{MotorData, Prng, World};
use tune::Wish;

const PERIOD: Duration = Duration::from_millis(1);

/// What hangs on a wheel.
#[derive(Clone, Debug)]
struct Load {
    inertia_kg_m2: f64,
    coulomb_nm: f64,
    viscous_nm_s: f64,
    stiffness_nm_rad: Option<f64>,
}

/// What the plant has: closed forms of its own equations (`plant::gear`, `plant::attachment`).
#[derive(Clone, Debug)]
struct Truth {
    inertia_kg_m2: f64,
    dry_nm: f64,
    viscous_nm_s: f64,
    /// Anti-resonance and resonance, Hz.
    elastic: Option<(f64, f64)>,
}

impl Load {
    /// Resonances from 15 to 100 Hz: what samples each millisecond and 4096 counts a turn show.
    fn random(random: &mut Prng, motor: &MotorData) -> Self {
        let rotor = motor.rotor.inertia_kg_m2;
        let mut between =
            |low: f64, high: f64| low * (high / low).powf(random.below(1 << 20) as f64 / f64::from(1 << 20));
        let inertia_kg_m2 = between(0.004, 0.1);
        let (coulomb_nm, viscous_nm_s) = (between(0.05, 0.6), between(0.002, 0.03));
        let reduced = 1.0 / (1.0 / (inertia_kg_m2 + 0.01 * rotor) + 1.0 / rotor);
        let stiffness_nm_rad = (TAU * between(15.0, 100.0)).powi(2) * reduced;
        Self {
            inertia_kg_m2,
            coulomb_nm,
            viscous_nm_s,
            stiffness_nm_rad: random.chance(0.5).then_some(stiffness_nm_rad),
        }
    }

    fn words(&self) -> Vec<String> {
        let Self { inertia_kg_m2, coulomb_nm, viscous_nm_s, stiffness_nm_rad } = self;
        let friction = format!("load friction {coulomb_nm} viscous {viscous_nm_s}");
        let gear = stiffness_nm_rad.map(|stiffness| format!("load gear 1 0 {stiffness}"));
        [format!("load inertia {inertia_kg_m2}"), friction].into_iter().chain(gear).collect()
    }

    fn truth(&self, motor: &MotorData) -> Truth {
        let rotor = motor.rotor;
        // The output wheel of a load's gear.
        let wheel = if self.stiffness_nm_rad.is_some() { 0.01 * rotor.inertia_kg_m2 } else { 0.0 };
        let load = self.inertia_kg_m2 + wheel;
        let hz = |square: f64| square.sqrt() / TAU;
        let both = |stiffness: f64| (hz(stiffness / load), hz(stiffness / load + stiffness / rotor.inertia_kg_m2));
        Truth {
            inertia_kg_m2: rotor.inertia_kg_m2 + load,
            dry_nm: rotor.coulomb_nm + self.coulomb_nm,
            viscous_nm_s: rotor.viscous_nm_s + self.viscous_nm_s,
            elastic: self.stiffness_nm_rad.map(both),
        }
    }
}

struct Measured {
    found: Found,
    setup: Setup,
    model: (&'static Description, &'static Loops),
}

/// `Err` where it is refused as unusable.
fn identified(world: &mut World, drive: &Drive, motor: &MotorData) -> Result<Measured, tune::Unusable> {
    let (model, loops) = loops_of(drive).unwrap();
    let run = async {
        let setup = Setup::begin(drive, (model, loops), None, |_| ()).await.unwrap();
        let measured = measure(drive, &setup, loops, (PERIOD, Bounds::default(), CyclicOptions::default())).await;
        (setup, measured)
    };
    let (setup, measured) = sim::block_on(world, run).unwrap();
    let found = Found::of(&measured.unwrap(), &setup, loops, motor)?;
    Ok(Measured { found, setup, model: (model, loops) })
}

fn relative(is: f64, should: f64) -> f64 {
    (is / should - 1.0).abs()
}

/// Fifty with `FERRODRIVE_MACHINES=50`, which takes half a minute of a core.
fn machines() -> usize {
    std::env::var("FERRODRIVE_MACHINES").ok().and_then(|text| text.parse().ok()).unwrap_or(5)
}

/// Inertia within 5 %, friction within 10 %, resonance within 2 %. An anti-resonance, where the motor moves by less than one of
/// its counts, within 5 %.
fn hold(number: usize, found: &Found, truth: &Truth) {
    let within = |what: &str, is: f64, should: f64, bound: f64| {
        assert!(
            relative(is, should) < bound,
            "machine {number}: {what} {is}, the plant has {should}, found {:?} {:?}",
            found.mechanics,
            found.friction
        );
    };
    within("inertia", found.inertia_kg_m2(), truth.inertia_kg_m2, 0.05);
    within("dry friction", found.dry_nm(), truth.dry_nm, 0.1);
    within("viscous friction", found.viscous_nm_s(), truth.viscous_nm_s, 0.1);
    assert_eq!(found.mechanics.elastic.is_some(), truth.elastic.is_some(), "machine {number}: {truth:?}");
    if let (Some(elastic), Some((anti_resonance_hz, resonance_hz))) = (found.mechanics.elastic, truth.elastic) {
        within("resonance", elastic.resonance_hz, resonance_hz, 0.02);
        within("anti-resonance", elastic.anti_resonance_hz, anti_resonance_hz, 0.05);
    }
}

#[test]
fn random_wheels_are_identified_and_gains_proposed_for_them_are_stable_and_nearly_always_better() {
    let model = devices::model("zlac8030l").unwrap();
    let motor = motor_of(model).unwrap();
    let loops = model.axes[0].loops.as_ref().unwrap();
    let mut random = Prng::new(11);
    let (mut worse, mut refused) = (Vec::new(), Vec::new());
    let count = machines();
    for number in 0..count {
        let load = Load::random(&mut random, &motor);
        let plant = Twin::with_load((model, loops), load.words(), &motor);
        let (mut world, drive) = plant.world().unwrap();
        let Measured { found, setup, model } = match identified(&mut world, &drive, &motor) {
            Ok(measured) => measured,
            Err(reason) => {
                refused.push(format!("{number}: {reason}"));
                continue;
            }
        };
        hold(number, &found, &load.truth(&motor));
        let proposed = Proposed::of(&found, &setup, model, Wish::PhaseMargin(40.0), false).unwrap();
        let after: Vec<(Mux, i64)> = proposed.gains.iter().map(|gain| (gain.object, gain.after)).collect();
        // The plant itself, with a step of the set-point and of the load.
        let how = (PERIOD, Bounds { current_a: 30.0, ..Bounds::default() });
        let (old, new) = (plant.try_out(&[], how).unwrap(), plant.try_out(&after, how).unwrap());
        // A slow loop may still be on its way at the end: it comes nearer, and does not swing.
        let off = |answer: &host::tune::StepResponse, last: usize| {
            let from = answer.speed_rpm.len() - last;
            (answer.speed_rpm[from..from + 100].iter().sum::<f64>() / 100.0 - answer.step_rpm.1).abs()
        };
        for answer in [&new.step, &new.load] {
            let (before, end, ripple_a) = (off(answer, 200), off(answer, 100), answer.ripple_a());
            assert!(end < before + 1.0, "machine {number} does not settle: {before} {end} {proposed:?}");
            assert!(ripple_a < 1.5, "machine {number} swings by {ripple_a} A: {proposed:?}");
        }
        if new.error() >= old.error() {
            worse.push(number);
        }
    }
    // A loop that swings with half of its gains and less excites a heavy wheel too little.
    assert!(refused.len() * 20 <= count, "refused: {refused:#?}");
    assert!(worse.len() * 10 <= count, "worse than as delivered: {worse:?} of {count}");
}

#[test]
fn what_is_written_for_a_measurement_is_put_back_and_a_bound_that_is_reached_stops_it() {
    let model = devices::model("zlac8030l").unwrap();
    let motor = motor_of(model).unwrap();
    let loops = model.axes[0].loops.as_ref().unwrap();
    let plant = Twin::with_load((model, loops), vec!["load inertia 0.02".into()], &motor);
    let (mut world, drive) = plant.world().unwrap();
    let objects = [Mux::new(0x6083, 0), Mux::new(0x1A01, 1), Mux::new(0x1801, 2), Mux::new(0x201D, 0)];
    let read = |world: &mut World| {
        let all = async {
            let mut values = Vec::new();
            for object in objects {
                values.push(drive.node().upload(object).await.unwrap().as_bytes().to_vec());
            }
            values
        };
        sim::block_on(world, all).unwrap()
    };
    let before = read(&mut world);
    let bounds = Bounds { travel_turns: 0.5, ..Bounds::default() };
    let run = async {
        let setup = Setup::begin(&drive, (model, loops), None, |_| ()).await.unwrap();
        let failure = measure(&drive, &setup, loops, (PERIOD, bounds, CyclicOptions::default())).await.unwrap_err();
        setup.put_back(&drive).await.unwrap();
        failure
    };
    let failure = sim::block_on(&mut world, run).unwrap();
    assert!(failure.because[0].contains("turns from where it stood, more than 0.5"), "{failure:?}");
    assert_eq!(read(&mut world), before);
    assert!(world.report(1).unwrap().velocity_rpm.abs() < 1.0);
}

#[test]
fn a_drive_without_gains_is_refused_with_what_is_possible_instead() {
    let model = devices::model("zlim42c").unwrap();
    let network = master::Network::new();
    let drive = Drive::new(network.node(canopen::NodeId::MIN), model);
    let failure = loops_of(&drive).unwrap_err();
    assert!(failure.what.contains("ZLIM42C") || failure.what.contains("ZLIM42-C"), "{failure:?}");
    assert!(failure.next[0].contains("ramps and currents"), "{failure:?}");
}

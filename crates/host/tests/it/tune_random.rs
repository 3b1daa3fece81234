//! Fifty wheels with loads of any kind: what is identified of each is held to what its plant has, over a bus as a program has it, and the
//! gains proposed are tried on that plant. The default is a few of them; `docs/fidelity.md` has the table of all.
#![allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]

use std::f64::consts::TAU;
use std::fmt;
use std::time::Duration;

use canopen::Mux;
use host::capture::Restorer;
use host::tune::{Bounds, Excursion, MoveRow, Request, TuneReport, Twin, find, motor_of};
use master::units::Rpm;
use master::{Error, MotionOptions};
use sim::{MotorData, Place, Prng};
use words::failure::Failure;

use crate::tune::{PERIOD, relative, request, tried, with_constant};

/// What the speed of a stable loop is off at most: the encoder has 4096 counts, and the load a spring.
const STABLE_RPM: f64 = 2.0;

/// Fifty with `FERRODRIVE_MACHINES=50`, which take a minute and a half of a core.
pub(crate) fn machines(usual: usize) -> usize {
    std::env::var("FERRODRIVE_MACHINES").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// The objects and values of a proposal.
pub(crate) fn proposed(report: &TuneReport) -> Vec<(Mux, i64)> {
    let object = |text: &str| {
        let (index, sub) = text.split_once("h:").unwrap();
        Mux::new(u16::from_str_radix(index, 16).unwrap(), sub.parse().unwrap())
    };
    report.gains.iter().map(|gain| (object(&gain.object), gain.after)).collect()
}

/// How a plant moves with these values; it is computed beside a world in which nothing happens.
pub(crate) fn moved(plant: &Twin, values: &[(Mux, i64)], highest_rpm: f64) -> MoveRow {
    let mut beside = sim::World::new(can::Bitrate::M1, 1);
    sim::block_on(&mut beside, plant.try_move(values, highest_rpm)).unwrap().unwrap()
}

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

/// What came of one of them.
struct Row {
    report: TuneReport,
    /// Relative differences of inertia, dry and viscous friction.
    off: [f64; 3],
    /// Of anti-resonance and resonance; `None` where the plant has none.
    elastic_off: Option<[f64; 2]>,
    /// A resonance was found where there is one, and none where there is none.
    is_alike: bool,
    /// How far from its speed the plant stays with what is proposed: see [`off_rpm`].
    off_rpm: f64,
    /// Errors on the plant, as delivered and with what is proposed.
    errors: [f64; 2],
    moves: [MoveRow; 2],
}

impl fmt::Display for Row {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| 100.0 * share;
        let [inertia, dry, viscous] = self.off.map(percent);
        let [anti, resonance] = self.elastic_off.map_or([f64::NAN; 2], |off| off.map(percent));
        let ([old, new], [before, after]) = (self.errors, self.moves);
        let TuneReport { gain_share, coherent, twin_off, peak_a, loop_delay_ms, .. } = &self.report;
        write!(
            out,
            "inertia {inertia:.1} % dry {dry:.1} % viscous {viscous:.1} % resonance {resonance:.1} % anti {anti:.1} %; share {gain_share} \
             coherent {coherent} twin {twin_off:.3} peak {peak_a:.1} A delay {loop_delay_ms:.2} ms; error {old:.2} to {new:.2}, move {:.2} {:?} to \
             {:.2} {:?}, {:.2} r/min off",
            before.overshoot_deg, before.settled_s, after.overshoot_deg, after.settled_s, self.off_rpm
        )
    }
}

/// How far the shaft of a plant with these gains is from 90 r/min at most, in the fourth second after a load has come on: by its own speed,
/// not by what the drive shows. A loop that is not stable has its limits by then.
fn off_rpm(plant: &Twin, values: &[(Mux, i64)], motor: &MotorData) -> f64 {
    let (mut world, drive) = plant.world().unwrap();
    let turn = async {
        for (object, value) in values {
            drive.node().download(*object, &(*value as u16).to_le_bytes()).await.unwrap();
        }
        drive.velocity(Rpm(90.0), MotionOptions { wait: false, ..MotionOptions::default() }).await.unwrap();
        drive.supervise(Duration::from_secs(1)).await
    };
    // A slow loop may not be there yet.
    let seen = sim::block_on(&mut world, turn).unwrap();
    assert!(seen.is_ok() || matches!(seen, Err(Error::NotReached(_))), "{seen:?}");
    let load = format!("load torque {}", 4.5 * motor.windings.torque_constant_nm_a());
    world.apply(Place::node(1), &load.parse().unwrap()).unwrap().unwrap();
    sim::block_on(&mut world, drive.supervise(Duration::from_secs(3))).unwrap().unwrap();
    let look = |_| {
        world.run_for(Duration::from_millis(1));
        (world.report(1).unwrap().velocity_rpm - 90.0).abs()
    };
    (0..700).map(look).fold(0.0, f64::max)
}

fn row(load: &Load, plant: &Twin, motor: &MotorData) -> Result<Row, Failure> {
    let (mut world, drive) = plant.world().unwrap();
    let request = Request { with_position: true, ..request() };
    let restorer = Restorer::of(&drive);
    let found = sim::block_on(&mut world, find((&drive, &restorer), &request, &mut Excursion::default()));
    let (report, _) = found.unwrap()?;
    let truth = load.truth(motor);
    let off = [
        relative(report.inertia_kg_m2, truth.inertia_kg_m2),
        relative(report.dry_friction_nm, truth.dry_nm),
        relative(report.viscous_friction_nm_s, truth.viscous_nm_s),
    ];
    let found = report.anti_resonance_hz.zip(report.resonance_hz);
    let elastic_off = truth.elastic.map(|(anti, resonance)| {
        found.map_or([f64::INFINITY; 2], |found| [relative(found.0, anti), relative(found.1, resonance)])
    });
    let after = proposed(&report);
    // The plant itself, with a step of the set-point and of the load, and a move.
    let how = (PERIOD, Bounds { current_a: 30.0, ..Bounds::default() });
    let (old, new) = (tried(plant, &[], how), tried(plant, &after, how));
    let moved = |values: &[(Mux, i64)]| moved(plant, values, 120.0);
    let off_rpm = off_rpm(plant, &after, motor);
    let is_alike = found.is_some() == truth.elastic.is_some();
    let (errors, moves) = ([old.error(), new.error()], [moved(&[]), moved(&after)]);
    Ok(Row { report, off, elastic_off, is_alike, off_rpm, errors, moves })
}

/// Inertia within 5 %, friction within 10 %, resonance within 2 %; an anti-resonance, where the motor moves by less than one of its
/// counts, within 5 %. Gains that are stable on every plant, and better than the delivered ones on nine of ten.
#[test]
fn random_wheels_are_identified_and_gains_proposed_for_them_are_stable_and_nearly_always_better() {
    let model = devices::model("zlac8030l").unwrap();
    let motor = motor_of(model).unwrap();
    let loops = model.axes[0].loops.as_ref().unwrap();
    let mut random = Prng::new(11);
    let (mut worse, mut refused, mut beyond) = (Vec::new(), Vec::new(), Vec::new());
    let count = machines(3);
    for number in 0..count {
        let load = Load::random(&mut random, &motor);
        let plant = Twin::with_load((model, loops), load.words(), with_constant(&motor));
        let row = match row(&load, &plant, &motor) {
            Ok(row) => row,
            Err(failure) => {
                println!("{number}: {failure}");
                refused.push(format!("{number}: {failure}"));
                continue;
            }
        };
        println!("{number}: {row}");
        let [inertia, dry, viscous] = row.off;
        let [anti, resonance] = row.elastic_off.unwrap_or_default();
        let is_found = inertia < 0.05 && dry < 0.1 && viscous < 0.1 && resonance < 0.02 && anti < 0.05 && row.is_alike;
        let [_, after] = row.moves;
        let moves = after.settled_s.is_some() && after.overshoot_deg < 0.1 * 270.0;
        // What passes the bound stops it: by one sample.
        let is_within = (0.3..1.05).contains(&(row.report.peak_a / Bounds::default().current_a));
        if !is_found || row.off_rpm > STABLE_RPM || !moves || !is_within || row.report.twin_off > 0.25 {
            beyond.push(format!("{number}: {row}, {load:?} {:?}", row.report.gains));
        }
        if row.errors[1] >= row.errors[0] {
            worse.push(number);
        }
    }
    println!("{count} wheels: {} refused, {} beyond, worse {worse:?}", refused.len(), beyond.len());
    assert!(beyond.is_empty(), "{beyond:#?}");
    assert!(refused.is_empty(), "{refused:#?}");
    assert!(worse.len() * 10 <= count, "worse than as delivered: {worse:?} of {count}");
}

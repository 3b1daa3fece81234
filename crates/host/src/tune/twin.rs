//! A virtual drive that is what was found, to try gains on.

use std::f64::consts::{SQRT_2, TAU};
use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use cia402::RAD_S_PER_RPM;
use devices::{AxisId, Description, Integral, Loops, Scale};
use master::cyclic::CyclicOptions;
use master::{Drive, Network};
use serde::Serialize;
use sim::machine::{Order, SpeedWorth, is_built_in, order};
use sim::{Fidelity, MotorData, OUTPUT_WHEEL_SHARE, Place, StepperData, World};
use tune::Disturbance;
use words::failure::Failure;

use super::bench::{Bench, Bounds, Excursion, Measurement, STEP_SHARE, StepResponse, excitation, write};
use super::found::Found;
use super::moves::{LOOKED_AT_S, MoveRow, TrialMove};
use super::readings::{Currents, Reader};

pub(super) const NODE: NodeId = NodeId::MIN;
const BOOT: Duration = Duration::from_secs(1);
/// How long the answer to a step and to a load is looked at.
const ANSWER_S: f64 = 0.5;
/// The load that comes on, by the current that holds it: a share of what is usual.
const LOAD_SHARE: f64 = 0.3;
/// The same of a motor with a reducer, at its output.
const OUTPUT_LOAD_A: f64 = 1.0;

/// A twin: what is built anew for each trial.
#[derive(Clone, Debug)]
pub struct Twin {
    model: &'static Description,
    loops: Loops,
    /// What hangs on its shaft, as words of a world.
    pub load: Vec<String>,
    /// Objects that have not their factory values.
    pub(super) values: Vec<(Mux, i64)>,
    /// What pushes its shaft in one direction, N m; positive against positive motion.
    load_nm: f64,
    /// Torque per ampere of its own demand.
    torque_constant_nm_a: f64,
    /// What its gains are worth, where its model does not say that.
    speed_worth: Option<SpeedWorth>,
    /// Turns of the motor for one of its output.
    ratio: f64,
}

/// How a drive behaves with some gains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// A step of the set-point.
    pub step: StepResponse,
    /// A load that comes on while it turns: the same, with no step.
    pub load: StepResponse,
}

impl Trial {
    /// Integral of the absolute error after both, in r/min s.
    pub fn error(&self) -> f64 {
        self.step.error() + self.load.error()
    }
}

/// What a virtual drive's motor is, of a model as it is delivered.
pub fn motor_of(model: &'static Description) -> Option<MotorData> {
    let order_of = Order::new(model, NODE, model.bitrate.unwrap_or(Bitrate::M1));
    order(model, &order_of).ok()?.motor(AxisId(0))
}

/// The same of a stepper.
pub(super) fn stepper_of(model: &'static Description) -> Option<StepperData> {
    let order_of = Order::new(model, NODE, model.bitrate.unwrap_or(Bitrate::M1));
    order(model, &order_of).ok()?.stepper(AxisId(0))
}

/// Torque of a virtual drive's motor per ampere that its demand shows, N m/A: `rated` is the quotient of its rated values.
pub fn constant_of((model, loops): (&Description, &Loops), motor: &MotorData, rated: Option<f64>) -> f64 {
    let of_amplitude = motor.windings.torque_constant_nm_a();
    match loops.demand.map(|demand| demand.scale) {
        Some(Scale::Rated { .. }) => rated.unwrap_or(of_amplitude),
        // A described servo shows an r.m.s. current.
        Some(_) if !is_built_in(model) => SQRT_2 * of_amplitude,
        _ => of_amplitude,
    }
}

fn unmade(model: &Description, reason: impl std::fmt::Display) -> Failure {
    Failure::new(format!("the twin of a {} cannot be made", model.title)).because(reason)
}

/// Present at the twin.
pub(super) fn bring_about(world: &mut World, stimulus: &sim::Stimulus) -> Result<(), String> {
    let applied = world.apply(Place::node(NODE.raw()), stimulus).map_err(|error| error.to_string())?;
    // A refusal would leave it without a load, which the comparison would not show.
    applied.map(drop).map_err(|refused| refused.to_string())
}

/// A world with one drive of a model, at whose shaft is what these words say.
pub(super) fn world_of(
    model: &'static Description,
    (fidelity, speed_worth): (Fidelity, Option<SpeedWorth>),
    load: &[String],
) -> Result<(World, Drive), Failure> {
    let mut world = World::new(Bitrate::M1, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let ordered = Order { fidelity, speed_worth, ..Order::new(model, NODE, Bitrate::M1) };
    let machine = order(model, &ordered).map_err(|error| unmade(model, error))?;
    world.add_drive(NODE.raw(), machine).map_err(|error| unmade(model, error))?;
    for words in load {
        let stimulus = words.parse().map_err(|error: sim::stimulus::StimulusError| unmade(model, error))?;
        bring_about(&mut world, &stimulus).map_err(|reason| unmade(model, reason))?;
    }
    Ok((world, Drive::new(network.node(NODE), model)))
}

impl Twin {
    /// The twin of what was found; `values` are the drive's own settings that matter. Its motor is the model's own, or one that is
    /// assumed: by the same current it speeds up as the drive does.
    pub fn new(
        (model, loops): (&'static Description, &Loops),
        found: &Found,
        (motor, torque_constant_nm_a): (&MotorData, f64),
        values: Vec<(Mux, i64)>,
    ) -> Self {
        let rotor = motor.rotor;
        let wheel = if found.mechanics.elastic.is_some() { OUTPUT_WHEEL_SHARE * rotor.inertia_kg_m2 } else { 0.0 };
        let inertia = found.mechanics.inertia_kg_m2(torque_constant_nm_a);
        let inertia = (inertia - rotor.inertia_kg_m2 - wheel).max(0.0);
        let torque = |current_a: f64| current_a * torque_constant_nm_a;
        let dry = torque(found.friction.dry_a) - rotor.coulomb_nm;
        let viscous = torque(found.friction.viscous_a_s_rad) - rotor.viscous_nm_s;
        let mut load = vec![
            format!("load inertia {inertia}"),
            format!("load friction {} viscous {}", dry.max(0.0), viscous.max(0.0)),
        ];
        if let Some(elastic) = found.mechanics.elastic {
            // Both masses against each other.
            let reduced = 1.0 / (1.0 / (inertia + wheel) + 1.0 / rotor.inertia_kg_m2);
            load.push(format!("load gear 1 0 {}", (TAU * elastic.resonance_hz).powi(2) * reduced));
        }
        let worth =
            |object: Mux| values.iter().find(|(mux, _)| *mux == object).map(|(_, value)| (*value).max(1) as f64);
        let amplitudes = torque_constant_nm_a / motor.windings.torque_constant_nm_a();
        let speed_worth = worth(loops.speed_proportional).zip(worth(loops.speed_integral.object()));
        let speed_worth = speed_worth.map(|(proportional, integral)| SpeedWorth {
            proportional: (amplitudes * found.own.proportional / proportional) as f32,
            integral: match loops.speed_integral {
                Integral::Gain(_) => (amplitudes * found.own.integral / integral) as f32,
                Integral::Time(_) => (found.own.proportional / (found.own.integral * integral)) as f32,
            },
        });
        let load_nm = torque(found.friction.load_a);
        let twin = Self::with_load((model, loops), load, (motor, torque_constant_nm_a));
        Self { values, load_nm, speed_worth, ..twin }
    }

    /// A virtual drive with a load of these words, whatever was found.
    pub fn with_load(
        (model, loops): (&'static Description, &Loops),
        load: Vec<String>,
        (motor, torque_constant_nm_a): (&MotorData, f64),
    ) -> Self {
        let ratio = motor.gear.map_or(1.0, |gear| gear.ratio);
        let (values, loops) = (Vec::new(), *loops);
        Self { model, loops, load, values, load_nm: 0.0, torque_constant_nm_a, speed_worth: None, ratio }
    }

    fn failed(&self, reason: impl std::fmt::Display) -> Failure {
        unmade(self.model, reason)
    }

    /// What stopped a trial of the twin says nothing of the drive, which is at rest by then.
    fn stopped(&self, failure: Failure) -> Failure {
        let what = format!("the twin of a {}, not the drive, failed its trial", self.model.title);
        // Its node and its advice are those of the twin.
        let failure = Failure { next: Vec::new(), subject: Default::default(), ..failure };
        Failure::new(what).after(failure).next("the drive is at rest, with what it had; nothing was proposed")
    }

    fn push(&self, world: &mut World, torque_nm: f64) -> Result<(), Failure> {
        let present = sim::Stimulus::LoadTorque(torque_nm);
        bring_about(world, &present).map_err(|reason| self.failed(reason))
    }

    /// A world with the twin alone, booted.
    ///
    /// # Errors
    /// The model cannot be built, or has not what hangs on its shaft.
    pub fn world(&self) -> Result<(World, Drive), Failure> {
        let (mut world, drive) = self.unbooted(Fidelity::Full)?;
        world.run_for(BOOT);
        Ok((world, drive))
    }

    async fn booted(&self, fidelity: Fidelity) -> Result<(World, Drive), Failure> {
        let (mut world, drive) = self.unbooted(fidelity)?;
        sim::pass_beside(&mut world, BOOT).await;
        Ok((world, drive))
    }

    fn unbooted(&self, fidelity: Fidelity) -> Result<(World, Drive), Failure> {
        let (mut world, drive) = world_of(self.model, (fidelity, self.speed_worth), &self.load)?;
        if self.load_nm != 0.0 {
            self.push(&mut world, self.load_nm)?;
        }
        Ok((world, drive))
    }

    async fn open(&self, drive: &Drive, values: &[(Mux, i64)], how: (Duration, Bounds)) -> Result<Bench, Failure> {
        self.write(drive, values).await?;
        Bench::open(drive, &self.loops, how.0, how.1, CyclicOptions::default(), Excursion::default()).await
    }

    /// The same measurement as of the drive.
    ///
    /// # Errors
    /// What stopped it.
    pub async fn measure(&self, values: &[(Mux, i64)], how: (Duration, Bounds)) -> Result<Measurement, Failure> {
        let (mut world, drive) = self.booted(Fidelity::Full).await?;
        let excitation = excitation(how.0)?;
        self.run(&mut world, async { self.open(&drive, values, how).await?.measure(&excitation).await }).await
    }

    /// How it behaves with these values of its gains: a step of the set-point, and a load.
    ///
    /// # Errors
    /// What stopped it.
    pub async fn try_out(&self, values: &[(Mux, i64)], how: (Duration, Bounds)) -> Result<Trial, Failure> {
        let (mut world, drive) = self.booted(Fidelity::Full).await?;
        let (step, load) = match self.loops.demand {
            Some(_) => self.trial_of_samples(&mut world, &drive, values, how).await?,
            None => self.trial_of_readings(&mut world, &drive, values, how.1).await?,
        };
        Ok(Trial { step, load })
    }

    /// See [`Bench::slow_ripple_a`], with these values of its gains; 0 of a drive that does not show what its speed loop asks for.
    ///
    /// # Errors
    /// What stopped it.
    pub(super) async fn slow_ripple_a(&self, values: &[(Mux, i64)], how: (Duration, Bounds)) -> Result<f64, Failure> {
        if self.loops.demand.is_none() {
            return Ok(0.0);
        }
        let (mut world, drive) = self.booted(Fidelity::Full).await?;
        let mut bench = self.run(&mut world, self.open(&drive, values, how)).await?;
        self.run(&mut world, bench.slow_ripple_a()).await
    }

    /// How it moves with these values of its gains, at half of this speed: the way takes three quarters of a second.
    ///
    /// # Errors
    /// What stopped it.
    pub async fn try_move(&self, values: &[(Mux, i64)], highest_rpm: f64) -> Result<MoveRow, Failure> {
        let (mut world, drive) = self.booted(Fidelity::Full).await?;
        let mut trial = TrialMove::new(highest_rpm);
        let angle = |world: &mut World| {
            let report = world.report(NODE.raw()).map_err(|error| self.failed(error))?;
            Ok::<f64, Failure>(report.shaft_angle_rad.to_degrees())
        };
        let from_deg = angle(&mut world)?;
        self.run(&mut world, async {
            self.write(&drive, values).await?;
            trial.begin(&drive, false).await
        })
        .await?;
        let began = world.now();
        while world.now() - began < Duration::from_secs_f64(LOOKED_AT_S) {
            sim::pass_beside(&mut world, Duration::from_millis(1)).await;
            trial.see((world.now() - began).as_secs_f64(), angle(&mut world)? - from_deg);
        }
        Ok(trial.row())
    }

    /// What it is disturbed by in a trial.
    pub(super) fn disturbance(&self, bounds: Bounds) -> Disturbance {
        let load_a = self.loops.demand.map_or(OUTPUT_LOAD_A, |_| LOAD_SHARE * self.loops.usual_a);
        Disturbance { step_rad_s: STEP_SHARE * bounds.speed_rpm * RAD_S_PER_RPM, load_a }
    }

    async fn trial_of_samples(
        &self,
        world: &mut World,
        drive: &Drive,
        values: &[(Mux, i64)],
        how: (Duration, Bounds),
    ) -> Result<(StepResponse, StepResponse), Failure> {
        let mut bench = self.run(world, self.open(drive, values, how)).await?;
        let step = self.run(world, bench.step_response(f64::MAX, ANSWER_S)).await?;
        self.push(world, self.load_nm + LOAD_SHARE * self.loops.usual_a * self.torque_constant_nm_a)?;
        let load = self.run(world, bench.hold_response(ANSWER_S)).await?;
        Ok((step, load))
    }

    async fn trial_of_readings(
        &self,
        world: &mut World,
        drive: &Drive,
        values: &[(Mux, i64)],
        bounds: Bounds,
    ) -> Result<(StepResponse, StepResponse), Failure> {
        let answer = Duration::from_secs_f64(ANSWER_S);
        let mut reader = Reader::of(drive, bounds, Excursion::default())?;
        self.run(world, self.write(drive, values)).await?;
        let step = self.run(world, reader.step_response(f64::MAX, answer)).await?;
        self.push(world, self.load_nm + OUTPUT_LOAD_A * self.torque_constant_nm_a * self.ratio)?;
        let load = self.run(world, reader.hold_response(answer)).await?;
        Ok((step, load))
    }

    /// The currents that it shows with its load.
    ///
    /// # Errors
    /// What stopped it.
    pub async fn currents(&self, bounds: Bounds) -> Result<Currents, Failure> {
        // What is shown is filtered: nothing of a current loop is seen in it.
        let (mut world, drive) = self.booted(Fidelity::Mechanical).await?;
        let mut reader = Reader::of(&drive, bounds, Excursion::default())?;
        self.run(&mut world, self.write(&drive, &[])).await?;
        self.run(&mut world, reader.measure()).await
    }

    async fn write(&self, drive: &Drive, values: &[(Mux, i64)]) -> Result<(), Failure> {
        let is_written = |object| self.model.row(object).is_some_and(|row| row.access.is_writable());
        let all = self.values.iter().chain(self.loops.without_ramps).chain(values);
        for (object, value) in all.filter(|(object, _)| is_written(*object)) {
            write(drive, *object, *value).await?;
        }
        Ok(())
    }

    async fn run<T>(&self, world: &mut World, what: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
        sim::run_beside(world, what).await.map_err(|error| self.failed(error))?.map_err(|failure| self.stopped(failure))
    }
}

//! A drive whose loops are seen by SDO alone: it turns by its own ramps, and speed, current and position are read one after the
//! other. What it and its load are is found by its twin, which is measured in the same way: its load is changed until both show
//! the same currents.
//!
//! No resonance is found so; that of the reducer follows from its data and the load. A weight that turns the shaft back by itself is
//! not distinguished from friction, since the current is shown without a sign.

use std::time::Duration;

use can::Instant;
use devices::{Loops, Quantity, StatedLoop};
use master::cyclic::NotAtRest;
use master::drive::SwitchedOff;
use master::units::{Ramp, Rpm};
use master::{Drive, MotionOptions};
use sim::{GearModel, MotorData};
use tune::{Elastic, Friction, Loop, Mechanics};
use words::failure::{Failure, both};

use super::bench::{Bounds, Excursion, STEP_SHARE, StepResponse};
use super::found::Found;
use super::moves::{LOOKED_AT_S, MoveRow, TrialMove};
use super::setup::Setup;
use crate::stopping::bring_to_rest;

/// Speeds at which friction is measured, as shares of the highest.
const STEADY_SHARES: [f64; 4] = [0.4, -0.4, 1.0, -1.0];
const SETTLING: Duration = Duration::from_millis(200);
const STEADY: Duration = Duration::from_millis(300);
/// How often the shaft is turned round, with this ramp, (r/min)/s.
const REVERSALS: u32 = 6;
const RAMP_RPM_S: f64 = 6000.0;
/// Shares of the speed between which it is looked at while it speeds up: what is shown is filtered, and comes late.
const WINDOW: [f64; 2] = [0.4, 0.85];
/// To which sides steps go.
const STEPS: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];
/// A speed that is so near on average has settled.
const SETTLED_SHARE: f64 = 0.01;
const PATIENCE: Duration = Duration::from_secs(2);

/// Currents that a drive shows, A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Currents {
    /// At 40 % of the highest speed and at all of it, either way: +40, -40, +100, -100 %.
    pub steady_a: [f64; 4],
    /// While it speeds up, either way.
    pub rising_a: f64,
    /// The share of the highest speed that it had then on average.
    pub at_share: f64,
}

/// One round of readings.
#[derive(Clone, Copy, Debug)]
struct ShaftReading {
    at: Instant,
    turns: f64,
    rpm: f64,
    current_a: f64,
}

/// A drive that is measured by what is read of it.
#[derive(Debug)]
pub struct Reader {
    drive: Drive,
    speed: Quantity,
    current: Quantity,
    bounds: Bounds,
    /// What this measurement had come to before, and has come to now.
    pub excursion: Excursion,
    is_guarded: bool,
}

impl Reader {
    /// Of a drive, whose gear as a machine file has it does not matter: it is its motor's shaft that is looked at.
    ///
    /// # Errors
    /// It does not show speed or current.
    pub fn of(drive: &Drive, bounds: Bounds, excursion: Excursion) -> Result<Self, Failure> {
        let id = drive.node().id();
        let model = drive.description();
        let units = model.and_then(|model| model.axes.first()).map(|axis| axis.units);
        let quantities = units.and_then(|units| units.actual_velocity.zip(units.actual_current));
        let (Some(model), Some((speed, current))) = (model, quantities) else {
            return Err(
                Failure::new(format!("node {id} cannot be measured: it shows no speed or no current")).at_node(id)
            );
        };
        let drive = Drive::new(drive.node().clone(), model);
        Ok(Self { drive, speed, current, bounds, excursion, is_guarded: false })
    }

    /// Has it stop by itself when this program dies, if that is asked for; until it was seen to stand.
    ///
    /// # Errors
    /// It does not answer, or refuses.
    pub async fn guard(&mut self, guard: Option<SwitchedOff>) -> Result<(), Failure> {
        if let Some(switched_off) = guard {
            let node = self.drive.node();
            self.is_guarded = node.network().guarded(node.id()).is_none();
            self.drive.guard(switched_off).await?;
        }
        Ok(())
    }

    fn now(&self) -> Instant {
        self.drive.node().network().now()
    }

    async fn look(&mut self) -> Result<ShaftReading, Failure> {
        let current_a = self.drive.read_quantity(self.current).await?.abs();
        let at = self.now();
        let rpm = self.drive.read_quantity(self.speed).await?;
        let position = self.drive.node().read::<i32>(cia402::object::POSITION_ACTUAL_VALUE).await?;
        let turns = f64::from(position) / self.drive.counts_per_turn().await?;
        let seen = self.excursion.reached(turns, current_a);
        self.bounds.keep(&seen, current_a, self.drive.node().id())?;
        self.excursion = seen;
        Ok(ShaftReading { at, turns, rpm, current_a })
    }

    /// Looks for this long.
    async fn watch(&mut self, time: Duration) -> Result<Vec<ShaftReading>, Failure> {
        let (until, mut readings) = (self.now() + time, Vec::new());
        while self.now() < until {
            readings.push(self.look().await?);
        }
        Ok(readings)
    }

    async fn turn(&mut self, rpm: f64, ramp: Option<Ramp>) -> Result<(), Failure> {
        let options = MotionOptions { acceleration: ramp, deceleration: ramp, wait: false, ..MotionOptions::default() };
        self.drive.velocity(Rpm(rpm), options).await?;
        Ok(())
    }

    /// Turns it, and looks until it has this speed.
    async fn reach(&mut self, rpm: f64) -> Result<Vec<ShaftReading>, Failure> {
        self.turn(rpm, Some(Ramp::RpmPerSecond(RAMP_RPM_S))).await?;
        let (until, mut readings) = (self.now() + PATIENCE, Vec::new());
        while self.now() < until {
            let reading = self.look().await?;
            readings.push(reading);
            if reading.rpm * rpm.signum() > 0.97 * rpm.abs() {
                return Ok(readings);
            }
        }
        let id = self.drive.node().id();
        let reason = format!("it did not come to {rpm:.0} r/min within {PATIENCE:?}");
        Err(Failure::new(format!("node {id}: the measurement was stopped"))
            .at_node(id)
            .because(reason)
            .next("give a lower --speed"))
    }

    /// Currents at steady speeds and while it speeds up.
    ///
    /// # Errors
    /// A bound was reached, or the drive refused. It is to be [`stop`](Self::stop)ped.
    pub async fn measure(&mut self) -> Result<Currents, Failure> {
        let speed = self.bounds.speed_rpm;
        let mut steady_a = [0.0; 4];
        for (current_a, share) in steady_a.iter_mut().zip(STEADY_SHARES) {
            self.reach(share * speed).await?;
            self.watch(SETTLING).await?;
            let readings = self.watch(STEADY).await?;
            *current_a = readings.iter().map(|reading| reading.current_a).sum::<f64>() / readings.len().max(1) as f64;
        }
        let (mut sum_a, mut shares, mut count) = (0.0, 0.0, 0.0_f64);
        for number in 0..REVERSALS {
            let to = if number % 2 == 0 { speed } else { -speed };
            let readings = self.reach(to).await?;
            let share = |reading: &ShaftReading| reading.rpm / to;
            for reading in readings.iter().filter(|reading| (WINDOW[0]..=WINDOW[1]).contains(&share(reading))) {
                (sum_a, shares, count) = (sum_a + reading.current_a, shares + share(reading), count + 1.0);
            }
            self.watch(SETTLING).await?;
        }
        let count = count.max(1.0);
        Ok(Currents { steady_a, rising_a: sum_a / count, at_share: shares / count })
    }

    /// Looks until it turns with this speed, and then until the motor passes its zero: another step begins likewise. What a reducer
    /// does to the speed repeats with the motor's turn, and a loop that is slow to settle would begin nearer to its end.
    async fn settle(&mut self, rpm: f64) -> Result<(), Failure> {
        let turn = Duration::from_secs_f64(60.0 / rpm.abs()).max(SETTLING);
        let until = self.now() + PATIENCE;
        loop {
            let readings = self.watch(turn).await?;
            let mean = readings.iter().map(|reading| reading.rpm).sum::<f64>() / readings.len().max(1) as f64;
            if (mean - rpm).abs() < SETTLED_SHARE * rpm.abs() || self.now() >= until {
                break;
            }
        }
        let whole = self.look().await?.turns.floor();
        while self.look().await?.turns.floor() == whole && self.now() < until + turn {}
        Ok(())
    }

    /// Steps of the set-point without a ramp, from half of the highest speed to three quarters, or by no more than this, to either
    /// side in turns: their mean. A reading comes some ms before or after a step takes effect, which one step alone would be judged by.
    ///
    /// # Errors
    /// See [`measure`](Self::measure).
    pub async fn step_response(&mut self, most_rpm: f64, time: Duration) -> Result<StepResponse, Failure> {
        let from = 0.5 * self.bounds.speed_rpm;
        let to = from + (STEP_SHARE * self.bounds.speed_rpm).min(most_rpm);
        let mut answers = Vec::new();
        // The last one forward: a load comes on at that speed.
        for side in STEPS {
            self.reach(side * from).await?;
            self.settle(side * from).await?;
            self.turn(side * to, Some(Ramp::Time(Duration::ZERO))).await?;
            answers.push(self.answer((from, to), side, time).await?);
        }
        Ok(mean(&answers))
    }

    /// The same without a step, at the speed after it: for a load that comes on.
    ///
    /// # Errors
    /// See [`measure`](Self::measure).
    pub async fn hold_response(&mut self, time: Duration) -> Result<StepResponse, Failure> {
        self.answer((0.0, 0.75 * self.bounds.speed_rpm), 1.0, time).await
    }

    async fn answer(&mut self, step_rpm: (f64, f64), side: f64, time: Duration) -> Result<StepResponse, Failure> {
        let readings = self.watch(time).await?;
        let whole = readings.first().zip(readings.last()).map_or(Duration::ZERO, |(first, last)| last.at - first.at);
        Ok(StepResponse {
            period_s: whole.as_secs_f64() / readings.len().saturating_sub(1).max(1) as f64,
            step_rpm,
            speed_rpm: readings.iter().map(|reading| side * reading.rpm).collect(),
            current_a: readings.iter().map(|reading| reading.current_a).collect(),
        })
    }

    /// A move, and back.
    ///
    /// # Errors
    /// See [`measure`](Self::measure).
    pub(super) async fn moves(&mut self, mut trial: TrialMove) -> Result<MoveRow, Failure> {
        let from_turns = self.look().await?.turns;
        trial.begin(&self.drive, false).await?;
        let began = self.now();
        while self.now() - began < Duration::from_secs_f64(LOOKED_AT_S) {
            let seen = self.look().await?;
            trial.see((seen.at - began).as_secs_f64(), (seen.turns - from_turns) * 360.0);
        }
        trial.begin(&self.drive, true).await?;
        self.watch(Duration::from_secs_f64(LOOKED_AT_S)).await?;
        Ok(trial.row())
    }

    /// At rest by its ramp, and without power.
    ///
    /// # Errors
    /// It was not seen to stand.
    pub async fn stop(self) -> Result<(), Failure> {
        self.stop_and_let_go().await?.map_or(Ok(()), Err)
    }

    /// The same. What was seen of a shaft that stands without power and did not under it: one that high gains hold may show counts
    /// of its encoder as a speed.
    ///
    /// # Errors
    /// It was not seen to stand without power.
    pub(super) async fn stop_and_let_go(self) -> Result<Option<Failure>, Failure> {
        let node = self.drive.node().id();
        let stood = self.drive.stop().await.map_err(|error| {
            let unseen = Failure::new(NotAtRest::NotSeen { node }.to_string()).of_kind("not_stopped").at_node(node);
            unseen.next(format!("ferrodrive estop, and ferrodrive explain {node}")).after(error.into())
        });
        // A load may turn a shaft without power: it is looked at once more.
        let stood = match bring_to_rest(&self.drive).await {
            Ok(()) => Ok(stood.err()),
            Err(failure) => both(Err(failure), stood),
        };
        if !self.is_guarded {
            return stood;
        }
        // One that may still be moving gets no further sign of life, and is left to its own watch.
        let network = self.drive.node().network();
        let stood = stood?;
        network.release_guards([node].into_iter().collect()).await?;
        Ok(stood)
    }
}

/// The mean of answers to one step, reading by reading, as far as all of them go.
fn mean(answers: &[StepResponse]) -> StepResponse {
    let count = answers.len() as f64;
    let shortest = answers.iter().map(|answer| answer.speed_rpm.len()).min().unwrap_or(0);
    let of = |values: fn(&StepResponse) -> &Vec<f64>| {
        (0..shortest).map(|at| answers.iter().map(|answer| values(answer)[at]).sum::<f64>() / count).collect()
    };
    StepResponse {
        period_s: answers.iter().map(|answer| answer.period_s).sum::<f64>() / count,
        step_rpm: answers.first().map_or((0.0, 0.0), |answer| answer.step_rpm),
        speed_rpm: of(|answer| &answer.speed_rpm),
        current_a: of(|answer| &answer.current_a),
    }
}

/// What hangs on the output of a reducer, to be found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputLoad {
    /// Its inertia, kg m².
    pub inertia_kg_m2: f64,
    /// Its dry friction, N m.
    pub dry_nm: f64,
    /// Its viscous friction, N m s/rad.
    pub viscous_nm_s: f64,
}

impl OutputLoad {
    /// As words of a world.
    pub fn words(&self) -> Vec<String> {
        let Self { inertia_kg_m2, dry_nm, viscous_nm_s } = self;
        vec![format!("load inertia {inertia_kg_m2}"), format!("load friction {dry_nm} viscous {viscous_nm_s}")]
    }

    /// Nearer to a load with these currents than that with the twin's.
    #[must_use]
    pub fn corrected(&self, (drive, twin): (&Currents, &Currents), how: &Shaft<'_>, speed_rpm: f64) -> Self {
        let off = |n: usize| drive.steady_a[n] - twin.steady_a[n];
        let speed = |share: f64| share * speed_rpm * cia402::RAD_S_PER_RPM;
        let (slow_a, fast_a) = (0.5 * (off(0) + off(1)), 0.5 * (off(2) + off(3)));
        let viscous_a_s = (fast_a - slow_a) / (speed(STEADY_SHARES[2]) - speed(STEADY_SHARES[0]));
        let dry_a = slow_a - viscous_a_s * speed(STEADY_SHARES[0]);
        // What is left is the inertia's.
        let rising_a = drive.rising_a - twin.rising_a - dry_a - viscous_a_s * speed(twin.at_share);
        let gear = how.gear;
        // The teeth lose their share of what they transmit.
        let at_output = how.torque_per_reading_nm_a() * gear.ratio / (1.0 + gear.mesh_loss);
        let output_rad_s2 = RAMP_RPM_S * cia402::RAD_S_PER_RPM / gear.ratio;
        Self {
            inertia_kg_m2: (self.inertia_kg_m2 + rising_a * at_output / output_rad_s2).max(0.0),
            dry_nm: (self.dry_nm + dry_a * at_output).max(0.0),
            viscous_nm_s: (self.viscous_nm_s + viscous_a_s * at_output * gear.ratio).max(0.0),
        }
    }
}

/// What is known of a motor with a reducer and of its speed loop.
#[derive(Clone, Copy, Debug)]
pub struct Shaft<'a> {
    /// Motor.
    pub motor: &'a MotorData,
    /// Reducer.
    pub gear: &'a GearModel,
    /// Loop.
    pub stated: &'a StatedLoop,
}

impl Shaft<'_> {
    fn torque_per_reading_nm_a(&self) -> f64 {
        self.motor.windings.torque_constant_nm_a() * self.stated.amplitude
    }

    /// All of it at the motor's shaft: the load, the reducer and the rotor.
    pub fn found(&self, load: &OutputLoad, setup: &Setup, loops: &Loops, off: f64) -> Found {
        let Self { motor, gear, stated } = self;
        let torque_constant_nm_a = motor.windings.torque_constant_nm_a();
        let (ratio, through) = (gear.ratio, (1.0 + gear.mesh_loss) / gear.ratio);
        let output_kg_m2 = load.inertia_kg_m2 + gear.output_inertia_kg_m2;
        let inertia_kg_m2 = motor.rotor.inertia_kg_m2 + output_kg_m2 / (ratio * ratio);
        let dry_nm = motor.rotor.coulomb_nm + gear.coulomb_nm + through * (gear.output_coulomb_nm + load.dry_nm);
        let viscous_nm_s = motor.rotor.viscous_nm_s + gear.viscous_nm_s + through * load.viscous_nm_s / ratio;
        // Both masses behind the spring of the reducer.
        let anti = (gear.stiffness_nm_rad / output_kg_m2).sqrt();
        let rotor_kg_m2 = motor.rotor.inertia_kg_m2 * ratio * ratio;
        let resonance = (gear.stiffness_nm_rad / output_kg_m2 + gear.stiffness_nm_rad / rotor_kg_m2).sqrt();
        let damping = |omega: f64| 0.5 * omega * gear.damping_nm_s_rad / gear.stiffness_nm_rad;
        let hz = |omega: f64| omega / std::f64::consts::TAU;
        let elastic = Elastic {
            anti_resonance_hz: hz(anti),
            anti_damping: damping(anti),
            resonance_hz: hz(resonance),
            damping: damping(resonance),
        };
        let mechanics = Mechanics {
            gain: torque_constant_nm_a / inertia_kg_m2,
            viscous_per_s: viscous_nm_s / inertia_kg_m2,
            elastic: Some(elastic),
            delay_s: 0.0,
            off,
        };
        let had = |object| setup.had(object).unwrap_or(1).max(1) as f64;
        let proportional = had(loops.speed_proportional) * stated.a_s_rad;
        let own = Loop {
            proportional,
            integral: proportional / (had(loops.speed_integral.object()) * stated.integral_s),
            filter_s: stated.filter_s,
            asked_late_s: 0.0,
            seen_late_s: stated.late_s,
            off: 0.0,
        };
        let per_a = 1.0 / torque_constant_nm_a;
        let friction =
            Friction { dry_a: dry_nm * per_a, viscous_a_s_rad: viscous_nm_s * per_a, load_a: 0.0, off_a: 0.0 };
        Found {
            response: None,
            mechanics,
            plant: mechanics,
            friction,
            own,
            gain_share: 1.0,
            filled: 0,
            larger: 1.0,
            torque_constant_nm_a,
        }
    }
}

impl Currents {
    /// The largest relative difference.
    pub fn off(&self, other: &Self) -> f64 {
        let all = |it: &Self| [&it.steady_a[..], &[it.rising_a]].concat();
        let pairs = all(self).into_iter().zip(all(other));
        pairs.map(|(one, other)| ((one - other) / one.abs().max(1e-6)).abs()).fold(0.0, f64::max)
    }
}

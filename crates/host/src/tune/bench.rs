//! A drive that is measured cycle by cycle, within bounds.

use std::time::Duration;

use canopen::NodeId;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use cia402::object::POSITION_ACTUAL_VALUE;
use cia402::{ModeOfOperation, RAD_S_PER_RPM};
use devices::Loops;
use master::core::{PdoMap, Signal};
use master::cyclic::{CyclicDrive, CyclicOptions, CyclicState, Demand, NotAtRest, Refusal};
use master::pdo::{PdoConfig, TimerUnits, TransmissionType};
use master::units::{Amperes, Rpm};
use master::{Drive, Network};
use serde::Serialize;
use tune::{Excitation, Samples, SteadyRun};
use words::failure::{Failure, both};

use super::gaps::Gaps;
use crate::stopping::bring_to_rest;

/// What the motion of a measurement keeps to. Beyond one of them it is stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Highest speed that is asked for.
    pub speed_rpm: f64,
    /// Most current that the speed loop may ask for, A.
    pub current_a: f64,
    /// Turns of the shaft to either side of where it stood.
    pub travel_turns: f64,
}

impl Bounds {
    /// Whether what was reached is within them.
    pub(super) fn keep(&self, seen: &Excursion, current_a: f64, id: NodeId) -> Result<(), Failure> {
        let stopped = |reason: String| {
            Failure::new(format!("node {id}: the measurement was stopped")).at_node(id).because(reason)
        };
        if current_a.abs() > self.current_a {
            let (asked, most) = (Amperes(current_a.abs()), Amperes(self.current_a));
            return Err(stopped(format!("its speed loop asked for {asked}, more than {most}"))
                .of_kind(CURRENT_KIND)
                .next("allow more with --current, or less speed with --speed"));
        }
        let (gone, most) = (seen.travel_turns, self.travel_turns);
        if gone > most {
            return Err(stopped(format!("the shaft is {gone:.1} turns from where it stood, more than {most}"))
                .of_kind("travel_bound")
                .next("allow more with --travel, or less speed with --speed"));
        }
        Ok(())
    }
}

impl Excursion {
    /// With what is seen now.
    pub(super) fn reached(mut self, turns: f64, current_a: f64) -> Self {
        let began = *self.began_turns.get_or_insert(turns);
        self.travel_turns = self.travel_turns.max((turns - began).abs());
        self.peak_a = self.peak_a.max(current_a.abs());
        self
    }
}

impl Default for Bounds {
    /// A wheel on a bench: 120 r/min, the 15 A that it is rated for, forty turns.
    fn default() -> Self {
        Self { speed_rpm: 120.0, current_a: 15.0, travel_turns: 40.0 }
    }
}

/// What was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// Currents at steady speeds.
    pub runs: Vec<SteadyRun>,
    /// The excitation and its answer.
    pub samples: Samples,
    /// What was asked for beside a steady speed, as a share of its peak.
    pub excitation: Excitation,
    /// Peak of the excitation, r/min.
    pub amplitude_rpm: f64,
    /// By how much the gains were lowered meanwhile: 1 for not at all.
    pub gain_share: f64,
    /// Samples that did not come in their cycle, and were put between their neighbours.
    pub filled: usize,
}

/// How far a shaft went since it was first looked at, over as many benches as a measurement takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Excursion {
    /// Where it stood, in turns.
    began_turns: Option<f64>,
    /// The most that the speed loop asked for, A.
    pub peak_a: f64,
    /// The farthest that the shaft was from where it had stood, in turns.
    pub travel_turns: f64,
}

/// How a drive answers a step of its set-point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepResponse {
    /// Time between two samples, s.
    pub period_s: f64,
    /// From which speed to which, r/min.
    pub step_rpm: (f64, f64),
    /// Speed, r/min.
    pub speed_rpm: Vec<f64>,
    /// Current demand, A.
    pub current_a: Vec<f64>,
}

impl StepResponse {
    /// Integral of the absolute error from the step on, in r/min s: the less, the better.
    pub fn error(&self) -> f64 {
        self.error_beyond(0.0)
    }

    /// The same without what the times at which a drive reads its position make of a steady speed, and whatever else swings fast in the
    /// second half.
    pub fn smooth_error(&self) -> f64 {
        let settled = &self.speed_rpm[self.speed_rpm.len() / 2..];
        self.error_beyond(mean(about_slow_mean(settled, self.period_s).map(f64::abs)))
    }

    fn error_beyond(&self, noise_rpm: f64) -> f64 {
        let error_rpm = mean(self.speed_rpm.iter().map(|speed| (self.step_rpm.1 - speed).abs()));
        (error_rpm - noise_rpm).max(0.0) * self.speed_rpm.len() as f64 * self.period_s
    }

    /// Root mean square of what the current does in the last half: that of a loop that is not stable does not end.
    pub fn ripple_a(&self) -> f64 {
        ripple(&self.current_a[self.current_a.len() / 2..], self.period_s)
    }
}

/// Root mean square of what swings.
fn ripple(values: &[f64], period_s: f64) -> f64 {
    mean(about_slow_mean(values, period_s).map(|off| off * off)).sqrt()
}

/// Values less a mean that follows slowly: what is still on its way to its end does not swing.
fn about_slow_mean(values: &[f64], period_s: f64) -> impl Iterator<Item = f64> {
    let span = ((SLOW_S / period_s) as usize).clamp(1, values.len().max(1));
    values.windows(span).map(move |window| window[span / 2] - window.iter().sum::<f64>() / span as f64)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, count), value| (sum + value, count + 1.0));
    sum / count.max(1.0)
}

/// What a failure is called where the current was at its bound.
pub(super) const CURRENT_KIND: &str = "current_bound";
/// And where a sample did not come in its cycle.
pub(super) const LATE_KIND: &str = "no_rate";
/// A step of the set-point, of the highest speed.
pub(super) const STEP_SHARE: f64 = 0.25;
/// Cycles until all TPDOs have come again.
const SKIPPED: usize = 2;
/// From one speed to the next, and until it is steady.
const RAMP_S: f64 = 0.3;
const SETTLING_S: f64 = 0.4;
const STEADY_S: f64 = 0.6;
/// Speeds at which friction is measured, as shares of the highest, there and back in turns.
const STEADY_SHARES: [f64; 6] = [0.35, -0.35, 1.0, -1.0, 0.65, -0.65];
/// Speed on which the excitation lies, as a share of the highest: the shaft never turns back, where dry friction would change its sign.
const BIAS_SHARE: f64 = 0.5;
/// Slow, as a share of the highest speed, and at least: drives count whole r/min (60FFh of the ZLAC8030L).
const SLOW_SHARE: f64 = 0.01;
const SLOW_RPM: f64 = 1.0;
/// The excitation's peak, as a share of the highest speed: to begin with, and at most.
const SMALL: f64 = 0.08;
const LARGEST: f64 = 0.4;
/// Share of the bound of the current that it may take.
pub(super) const ENOUGH_CURRENT: f64 = 0.7;
/// A current that swings by more than this share of its bound at a steady speed is that of a loop that is not stable.
pub(super) const SWINGS: f64 = 0.02;
/// Swings of a loop are faster than this.
const SLOW_S: f64 = 0.1;
/// A speed is taken from positions that are so far apart.
const SPEED_OVER_S: f64 = 8e-3;
const PERIOD_S: f64 = 2.0;
const PERIODS: usize = 6;
/// Periods that are looked at together, while it is measured, for whether the shaft still follows; the first of them is what came before.
const LOOKED_AT: usize = 4;
const LOWEST_HZ: f64 = 1.0;
/// Share of the sampling rate.
const HIGHEST: f64 = 0.125;
/// Time that a drive has to be enabled in.
const ENABLING_S: f64 = 2.0;
/// Time in which a shaft that is held comes to stand; after that its power is taken all the same.
const HOLDING_S: f64 = 1.0;
/// Time in which it has to be seen to stand without power.
const REST: Duration = Duration::from_secs(3);

/// A drive that is ready to be measured: enabled, its shaft held at no speed.
#[derive(Debug)]
pub struct Bench {
    network: Network,
    node: Drive,
    drive: CyclicDrive,
    position: Signal<i64>,
    current: Signal<i64>,
    counts_per_turn: f64,
    current_per_count: f64,
    bounds: Bounds,
    period: Duration,
    /// What this measurement had come to before, and has come to now.
    pub excursion: Excursion,
    /// By how much the gains are lowered: see [`Measurement`].
    pub gain_share: f64,
    /// What was asked for last, r/min.
    asked_rpm: f64,
    gaps: Gaps,
    /// Its guard began with this measurement, and ends with it.
    is_guarded: bool,
}

impl Bench {
    /// Maps what is measured, and enables the drive, whose set-points take effect at once. [`Setup`](super::Setup) puts it back.
    ///
    /// # Errors
    /// What the drive refuses, or that nothing shows the current that its speed loop asks for.
    pub async fn open(
        node: &Drive,
        loops: &Loops,
        period: Duration,
        bounds: Bounds,
        options: CyclicOptions,
        excursion: Excursion,
    ) -> Result<Self, Failure> {
        let failed = |reason: &dyn std::fmt::Display| {
            Failure::new(format!("node {} cannot be measured", node.node().id()))
                .at_node(node.node().id())
                .because(reason)
        };
        let mode = ModeOfOperation::PROFILE_VELOCITY;
        let demand = loops.demand.ok_or_else(|| {
            failed(&"no object shows the current that its speed loop asks for, with its sign")
                .next("feed a capture of another instrument in as a file")
        })?;
        node.configure_cyclic(mode).await.map_err(|error| failed(&error))?;
        // The second TPDO: the first has the statusword.
        let number = PdoNumber::at(1).unwrap_or(PdoNumber::FIRST);
        let model = node.description().ok_or_else(|| failed(&"its model is not known"))?;
        let record = |mux| model.row(mux).map(|row| MappingRecord { mux, bits: (row.data_type.size() * 8) as u8 });
        let map = PdoMap([POSITION_ACTUAL_VALUE, demand.object].into_iter().filter_map(record).collect());
        let config = PdoConfig::new(PdoId { direction: Direction::Tpdo, number }, map)
            .transmission(TransmissionType::EVERY_SYNC);
        node.node().configure_pdo(&config, TimerUnits::of(model)).await.map_err(|error| failed(&error))?;
        let is_guarded = options.guard.is_some() && node.node().network().guarded(node.node().id()).is_none();
        let drive = node.cyclic(mode, options).await.map_err(|error| failed(&error))?;
        let signal = |mux| node.node().signal_in(number, mux).map_err(|error| failed(&error));
        let network = node.node().network().clone();
        let mut it = Self {
            position: signal(POSITION_ACTUAL_VALUE)?,
            current: signal(demand.object)?,
            counts_per_turn: node.counts_per_turn().await?,
            network,
            node: node.clone(),
            drive,
            current_per_count: node.step_of(demand).await?,
            bounds,
            period,
            excursion,
            gain_share: 1.0,
            asked_rpm: 0.0,
            gaps: Gaps::default(),
            is_guarded,
        };
        it.network.sync(Some(period));
        match it.enable().await {
            Ok(()) => Ok(it),
            // It may have power by now.
            Err(failure) => both(Err(failure), it.stop().await),
        }
    }

    /// That more samples did not come in their cycles than may be missing.
    fn late(&self) -> Failure {
        self.late_by("a sample is missing: this program was late, or the bus has no room for the drive's TPDOs")
    }

    fn late_by(&self, reason: impl std::fmt::Display) -> Failure {
        self.stopped(reason).of_kind(LATE_KIND).next("give --realtime (Linux), or a longer --period")
    }

    fn cycle(&self) -> Option<u64> {
        self.network.cycle().map(|cycle| cycle.number)
    }

    /// The drive follows within [`ENABLING_S`].
    async fn enable(&mut self) -> Result<(), Failure> {
        // What came in the last cycle of a motion that was dropped counts as new until it comes again: its statusword shows power.
        for _ in 0..SKIPPED {
            self.network.next_sync().await.map_err(|error| self.stopped(error))?;
        }
        let (mut gaps, mut is_late) = (Gaps::default(), false);
        for _ in 0..self.cycles(ENABLING_S) {
            let (state, shown) = self.step(Demand::Hold).await?;
            if state.follows {
                return Ok(());
            }
            is_late |= gaps.cycles_before(self.cycle()) > 0 || shown.is_none();
        }
        if is_late {
            return Err(self.late());
        }
        let id = self.drive.node();
        Err(self.stopped("it was not enabled within 2 s").next(format!("ferrodrive explain {id}")))
    }

    fn cycles(&self, time_s: f64) -> usize {
        (time_s / self.period.as_secs_f64()).round() as usize
    }

    fn stopped(&self, reason: impl std::fmt::Display) -> Failure {
        Failure::new(format!("node {}: the measurement was stopped", self.drive.node()))
            .at_node(self.drive.node())
            .because(reason)
    }

    /// One cycle: what it is to do, and what it shows.
    async fn step(&mut self, demand: Demand) -> Result<(CyclicState, Option<(i64, i64)>), Failure> {
        self.network.next_sync().await.map_err(|error| self.stopped(error))?;
        let (state, position, current) = self.network.exchange(|io| {
            let state = self.drive.step(io, demand);
            (state, io.read_fresh(self.position, 1), io.read_fresh(self.current, 1))
        });
        Ok((state, position.zip(current)))
    }

    /// Asks for these speeds in r/min, one in each cycle, and samples what comes of it.
    ///
    /// # Errors
    /// A bound was reached, the drive refused, or a sample is missing. The drive is to be [`stop`](Self::stop)ped.
    pub async fn follow(&mut self, speeds_rpm: impl IntoIterator<Item = f64>) -> Result<Samples, Failure> {
        let mut samples = Samples { period_s: self.period.as_secs_f64(), ..Samples::default() };
        self.gaps.begin();
        self.follow_on(speeds_rpm, &mut samples).await?;
        Ok(samples)
    }

    /// The same, after what was sampled before, the last of it in this cycle.
    async fn follow_on(
        &mut self,
        speeds_rpm: impl IntoIterator<Item = f64>,
        samples: &mut Samples,
    ) -> Result<(), Failure> {
        let mut speeds_rpm = speeds_rpm.into_iter();
        loop {
            // The time of some has passed.
            let Some(asked) = speeds_rpm.nth(self.gaps.late()) else { return Ok(()) };
            let (state, shown) = self.step(Demand::Velocity(Rpm(asked))).await?;
            self.asked_rpm = asked;
            match state.refused {
                Some(refusal @ Refusal::Stopped(_)) => return Err(self.late_by(refusal)),
                Some(refusal) => return Err(self.stopped(refusal)),
                None => {}
            }
            let shown = shown.map(|(position, current)| {
                (position as f64 / self.counts_per_turn, current as f64 * self.current_per_count)
            });
            if let Some((turns, current_a)) = shown {
                self.keep_bounds(turns, current_a)?;
            }
            let shown = shown.map(|(turns, current_a)| (current_a, turns * std::f64::consts::TAU));
            let unseen = self.gaps.cycles_before(self.cycle());
            self.gaps.take(samples, unseen, (asked * RAD_S_PER_RPM, shown)).ok_or_else(|| self.late())?;
        }
    }

    fn keep_bounds(&mut self, turns: f64, current_a: f64) -> Result<(), Failure> {
        self.excursion = self.excursion.reached(turns, current_a);
        self.bounds.keep(&self.excursion, current_a, self.drive.node())
    }

    /// Comes to a speed without a step, and lets it settle.
    async fn approach(&mut self, rpm: f64) -> Result<(), Failure> {
        // With lower gains it takes longer, and swings more slowly on its way.
        let (from, ramp) = (self.asked_rpm, self.cycles(RAMP_S));
        let settling = self.cycles(SETTLING_S / self.gain_share.powf(1.5));
        self.follow((1..=ramp).map(|n| from + (rpm - from) * n as f64 / ramp as f64)).await?;
        self.follow(std::iter::repeat_n(rpm, settling)).await?;
        Ok(())
    }

    /// Turns steadily.
    async fn steady(&mut self, rpm: f64) -> Result<(SteadyRun, f64), Failure> {
        self.approach(rpm).await?;
        let samples = self.follow(std::iter::repeat_n(rpm, self.cycles(STEADY_S))).await?;
        let (first, last) = (samples.position_rad[0], samples.position_rad[samples.len() - 1]);
        let run = SteadyRun {
            speed_rad_s: (last - first) / ((samples.len() - 1) as f64 * samples.period_s),
            current_a: samples.current_a.iter().sum::<f64>() / samples.len() as f64,
        };
        Ok((run, ripple(&samples.current_a, samples.period_s)))
    }

    /// Whether the speed loop swings by itself at half of the highest speed.
    ///
    /// # Errors
    /// See [`follow`](Self::follow).
    pub async fn swings(&mut self) -> Result<bool, Failure> {
        let (_, ripple_a) = self.steady(BIAS_SHARE * self.bounds.speed_rpm).await?;
        Ok(ripple_a > SWINGS * self.bounds.current_a)
    }

    /// What the current does at a slow steady speed, where the encoder's counts come one by one: its root mean square about its mean, A.
    ///
    /// # Errors
    /// See [`follow`](Self::follow).
    pub async fn slow_ripple_a(&mut self) -> Result<f64, Failure> {
        Ok(self.steady((SLOW_SHARE * self.bounds.speed_rpm).max(SLOW_RPM)).await?.1)
    }

    /// Steady speeds, then an excitation that grows until it is seen well, within the bounds.
    ///
    /// # Errors
    /// See [`follow`](Self::follow).
    pub async fn measure(&mut self, excitation: &Excitation) -> Result<Measurement, Failure> {
        let mut runs = Vec::new();
        for share in STEADY_SHARES {
            runs.push(self.steady(share * self.bounds.speed_rpm).await?.0);
        }
        let bias = BIAS_SHARE * self.bounds.speed_rpm;
        self.approach(bias).await?;
        // One small period shows how much current it takes, and so how much larger it may be.
        let small_rpm = SMALL * self.bounds.speed_rpm;
        let before_a = std::mem::take(&mut self.excursion.peak_a);
        self.follow((0..excitation.len()).map(|n| bias + small_rpm * excitation.at(n))).await?;
        let factor = ENOUGH_CURRENT * self.bounds.current_a / self.excursion.peak_a.max(f64::MIN_POSITIVE);
        self.excursion.peak_a = self.excursion.peak_a.max(before_a);
        let amplitude_rpm = (small_rpm * factor).min(LARGEST * self.bounds.speed_rpm);
        let mut samples = Samples { period_s: self.period.as_secs_f64(), ..Samples::default() };
        self.gaps.begin();
        for period in 1..=PERIODS {
            let values = (0..excitation.len()).map(|n| bias + amplitude_rpm * excitation.at(n));
            self.follow_on(values, &mut samples).await?;
            // After the last one all of it is judged.
            if (LOOKED_AT..PERIODS).contains(&period) {
                let so_far = samples.first(period * excitation.len());
                self.keep_coherence(&so_far.last(LOOKED_AT * excitation.len()), excitation)?;
            }
        }
        // One whose time had passed may be behind the last period.
        let samples = samples.first(PERIODS * excitation.len());
        let (excitation, gain_share, filled) = (excitation.clone(), self.gain_share, self.gaps.filled());
        Ok(Measurement { runs, samples, excitation, amplitude_rpm, gain_share, filled })
    }

    /// What the shaft did in the last periods follows from what was asked for.
    fn keep_coherence(&self, samples: &Samples, excitation: &Excitation) -> Result<(), Failure> {
        let reason = match tune::response(samples, Some(excitation)) {
            Ok(response) if response.is_lost() => "the motion no longer follows from what is asked for".to_owned(),
            Ok(_) => return Ok(()),
            Err(error) => error.to_string(),
        };
        Err(self
            .stopped(reason)
            .of_kind("incoherent")
            .next("let nothing else push the shaft and nothing hold it, or allow more with --current"))
    }

    /// A step of the set-point, from half of the highest speed to three quarters, or by no more than this.
    ///
    /// # Errors
    /// See [`follow`](Self::follow).
    pub async fn step_response(&mut self, most_rpm: f64, time_s: f64) -> Result<StepResponse, Failure> {
        let from = 0.5 * self.bounds.speed_rpm;
        let step_rpm = (from, from + (STEP_SHARE * self.bounds.speed_rpm).min(most_rpm));
        self.approach(step_rpm.0).await?;
        self.answer(step_rpm, time_s).await
    }

    /// The same without a step, at the speed after it: for a load that comes on.
    ///
    /// # Errors
    /// See [`follow`](Self::follow).
    pub async fn hold_response(&mut self, time_s: f64) -> Result<StepResponse, Failure> {
        let rpm = 0.75 * self.bounds.speed_rpm;
        self.answer((0.0, rpm), time_s).await
    }

    async fn answer(&mut self, step_rpm: (f64, f64), time_s: f64) -> Result<StepResponse, Failure> {
        let samples = self.follow(std::iter::repeat_n(step_rpm.1, self.cycles(time_s))).await?;
        // One count in one sample is a large speed.
        let span = self.cycles(SPEED_OVER_S).max(1);
        let spans = samples.position_rad.windows(span + 1);
        let per_span = 1.0 / (span as f64 * samples.period_s * RAD_S_PER_RPM);
        let speed_rpm = spans.map(|positions| (positions[span] - positions[0]) * per_span).collect();
        Ok(StepResponse { period_s: samples.period_s, step_rpm, speed_rpm, current_a: samples.current_a })
    }

    /// No power, and no SYNC any more, once it stands; the guard that this measurement began ends.
    ///
    /// # Errors
    /// It was not seen to stand without power within 3 s.
    pub async fn stop(mut self) -> Result<(), Failure> {
        let stood = self.come_to_rest().await;
        self.network.sync(None);
        let node = self.drive.node();
        let moving = |why: NotAtRest| {
            Failure::new(why.to_string())
                .of_kind("not_stopped")
                .at_node(node)
                .next(format!("ferrodrive estop, and ferrodrive explain {node}"))
        };
        let stood = match stood {
            Ok(stood) => stood.map_err(moving),
            Err(failure) => Err(moving(NotAtRest::NotSeen { node }).after(failure)),
        };
        let stood = match stood {
            // Without cycles its set-points do not reach it, and without its TPDO nothing is seen: both by SDO.
            Err(failure) if bring_to_rest(&self.node).await.is_err() => Err(failure),
            _ => Ok(()),
        };
        // One that may still be moving gets no further sign of life, and is left to its own watch.
        stood.and(self.release().await)
    }

    /// Ends its cycles, and the guard that began with it.
    async fn release(&self) -> Result<(), Failure> {
        self.network.sync(None);
        if !self.is_guarded {
            return Ok(());
        }
        self.network.release_guards([self.drive.node()].into_iter().collect()).await.map_err(Failure::from)
    }

    /// Whether it was seen to stand without power.
    async fn come_to_rest(&mut self) -> Result<Result<(), NotAtRest>, Failure> {
        // First by its set-point: without power a wheel would run on. What stopped the measurement may stop this too.
        let (from, ramp) = (self.asked_rpm, self.cycles(RAMP_S));
        for n in (0..ramp).rev() {
            let down = Demand::Velocity(Rpm(from * n as f64 / ramp as f64));
            if self.step(down).await?.0.refused.is_some() {
                break;
            }
        }
        let stands = |drive: &CyclicDrive| drive.at_rest(Duration::ZERO) == Some(Ok(()));
        let mut is_held = true;
        for n in 0..self.cycles(REST.as_secs_f64()) {
            // What its load, or a loop that is not stable, keeps moving is not held for ever.
            is_held &= n < self.cycles(HOLDING_S) && !stands(&self.drive);
            let (state, _) = self.step(if is_held { Demand::Hold } else { Demand::Off }).await?;
            // Without power it has to stand anew.
            if !is_held && state.is_without_power() && stands(&self.drive) {
                return Ok(Ok(()));
            }
        }
        let node = self.drive.node();
        Ok(self.drive.at_rest(REST).unwrap_or(Err(NotAtRest::NotSeen { node })))
    }
}

/// The excitation of a measurement with this time between two samples.
///
/// # Errors
/// It cannot be made with that.
pub(super) fn excitation(period: Duration) -> Result<Excitation, Failure> {
    let sample_s = period.as_secs_f64();
    Excitation::new(sample_s, PERIOD_S, (LOWEST_HZ, HIGHEST / sample_s))
        .map_err(|error| Failure::new("the excitation cannot be made").because(error))
}

/// Writes a number to an object of whatever width.
pub(super) async fn write(drive: &Drive, object: canopen::Mux, value: i64) -> Result<(), Failure> {
    let row = drive.description().and_then(|model| model.row(object));
    let width = row.map_or(4, |row| row.data_type.size());
    Ok(drive.node().download(object, &value.to_le_bytes()[..width.min(8)]).await?)
}

/// A value as wide as its object.
pub(super) fn bytes(drive: &Drive, object: canopen::Mux, value: i64) -> Vec<u8> {
    let width = drive.description().and_then(|model| model.row(object)).map_or(2, |row| row.data_type.size());
    value.to_le_bytes()[..width.min(8)].to_vec()
}

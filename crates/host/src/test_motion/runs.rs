//! Runs of a test motion: set up, captured, watched, and ended.

use std::time::Duration;

use can::Instant;
use futures_util::future::{Either, select};
use master::cyclic::CyclicOptions;
use master::group::{AxisLimits, AxisSetup, Group, GroupError};
use master::units::{Ramp, Rpm};
use master::{Drive, MotionOptions};
use recording::Capture;
use serde::Serialize;
use std::pin::pin;
use words::failure::{Failure, both};

use super::{Followed, follow};
use crate::capture::merit::{self, Heating, Step};
use crate::capture::{Quantity, Restorer, Running, Span, Taken, Wanted, Way};
use crate::stopping::bring_to_rest;

/// How often it is looked where a shaft is that turns by its drive's own ramps.
const LOOK: Duration = Duration::from_millis(10);
/// The ramp that is reckoned with where the drive's own is taken.
const OWN_RAMP: Duration = Duration::from_secs(1);
/// The acceleration of a careful beginning, in turns/s^2: 600 (r/min)/s.
const ACCELERATION_TURNS_S2: f64 = 10.0;
/// How soon it is reached, in s.
const ROUNDING_S: f64 = 0.1;

/// What is sent in a run.
#[derive(Clone, Debug)]
pub enum Motion {
    /// Steps of velocity: see [`steps`].
    Steps {
        /// To this speed, and back to none.
        speed: Rpm,
        /// By this ramp, or the drive's own.
        ramp: Option<Ramp>,
        /// For so long, and as long at rest.
        hold: Duration,
    },
    /// Points, one in each cycle: see [`follow`].
    Points {
        /// Turns from where the shaft is.
        points: Vec<f64>,
        /// What they keep to.
        limits: AxisLimits,
        /// The cycle.
        period: Duration,
        /// How late the program may be, and what guards the drive.
        cyclic: CyclicOptions,
    },
}

/// How far from where it stood a shaft may come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// Where it stood, in turns.
    pub from_turns: f64,
    /// To either side.
    pub most_turns: f64,
}

/// What a run showed.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Null for steps, which have no set-point in cycles.
    pub followed: Option<Followed>,
    /// Up and down, of steps.
    pub steps: Vec<Step>,
    /// Why there are no figures of steps.
    pub no_steps: Option<String>,
    /// What the current heats.
    pub heating: Option<Heating>,
}

/// One run.
#[derive(Clone, Debug)]
pub struct Run {
    /// From 1 on.
    pub number: u32,
    /// What it showed.
    pub figures: Figures,
    /// What was captured.
    pub capture: Capture,
    /// How each of it came.
    pub ways: Vec<Way>,
    /// When its first row was taken.
    pub first_at: Instant,
}

impl Motion {
    /// What a capture of a run holds.
    pub fn span(&self) -> Span {
        let duration = match self {
            Self::Steps { speed: Rpm(rpm), ramp, hold } => {
                let ramp = match ramp {
                    Some(Ramp::Time(time)) => *time,
                    Some(Ramp::RpmPerSecond(rate)) => Duration::try_from_secs_f64(rpm.abs() / rate).unwrap_or(OWN_RAMP),
                    _ => OWN_RAMP,
                };
                hold.saturating_add(ramp).saturating_mul(2)
            }
            Self::Points { points, period, .. } => period.saturating_mul(points.len() as u32 + 2),
        };
        Span { duration, trigger: None, pre_trigger: Duration::ZERO }
    }

    /// Whether so many runs of points, each from where the one before ended, stay within so many turns.
    ///
    /// # Errors
    /// How far they go.
    pub fn check_travel(&self, count: u32, most_turns: f64) -> Result<(), String> {
        let Self::Points { points, .. } = self else { return Ok(()) };
        let net = points.last().copied().unwrap_or_default() * f64::from(count.saturating_sub(1));
        let most = points.iter().flat_map(|point| [*point, point + net]).fold(0.0_f64, |most, at| most.max(at.abs()));
        if most <= most_turns {
            return Ok(());
        }
        Err(format!("{count} runs of it go {most:.3} turns from where the shaft stands, and {most_turns} are allowed"))
    }
}

impl Travel {
    /// Around where a shaft stands now.
    ///
    /// # Errors
    /// The drive does not show it.
    pub async fn around(drive: &Drive, most_turns: f64) -> Result<Self, Failure> {
        Ok(Self { from_turns: turns(drive).await?, most_turns })
    }

    /// Looks once.
    async fn check(&self, drive: &Drive) -> Result<(), Failure> {
        let gone = (turns(drive).await? - self.from_turns).abs();
        if gone <= self.most_turns {
            return Ok(());
        }
        let id = drive.node().id();
        Err(Failure::new(format!("node {id}: the motion was stopped"))
            .of_kind("travel_bound")
            .at_node(id)
            .because(format!("the shaft was {gone:.3} turns from where it stood, more than {}", self.most_turns))
            .next("allow more with --travel, or turn for a shorter time with --time"))
    }

    /// Looks until it is too far.
    async fn watch(&self, drive: &Drive) -> Failure {
        loop {
            if let Err(failure) = self.check(drive).await {
                return failure;
            }
            drive.node().network().sleep(LOOK).await;
        }
    }
}

/// Where its shaft is.
async fn turns(drive: &Drive) -> Result<f64, Failure> {
    let angle = drive.state().await?.angle;
    angle.map(|degrees| degrees.0 / 360.0).ok_or_else(|| {
        let id = drive.node().id();
        Failure::new(format!("node {id} does not show its position")).at_node(id).next("leave --travel out")
    })
}

/// Has the drive turn at this speed for a while, and stops it: two steps of its velocity demand, by its own ramps or by this one. Where
/// it comes too far it is stopped at once. The drive stays enabled.
///
/// # Errors
/// Those of [`Drive::velocity`] and [`Drive::stop`]; that it came too far.
pub async fn steps(
    drive: &Drive,
    speed: Rpm,
    ramp: Option<Ramp>,
    hold: Duration,
    travel: Option<Travel>,
) -> Result<(), Failure> {
    let options = MotionOptions { acceleration: ramp, deceleration: ramp, wait: false, ..MotionOptions::default() };
    drive.velocity(speed, options).await?;
    let kept = match travel {
        None => drive.supervise(hold).await.map_err(Failure::from),
        Some(travel) => {
            let (supervised, watched) = (pin!(drive.supervise(hold)), pin!(travel.watch(drive)));
            match select(supervised, watched).await {
                Either::Left((kept, _)) => kept.map_err(Failure::from),
                Either::Right((failure, _)) => Err(failure),
            }
        }
    };
    both(kept, drive.stop().await.map_err(Failure::from))?;
    // What follows the stop belongs to the response.
    drive.node().network().sleep(hold).await;
    match travel {
        Some(travel) => travel.check(drive).await,
        None => Ok(()),
    }
}

/// Limits of a motion: its velocity, its acceleration in turns/s² (that of a careful beginning, 600 (r/min)/s, without one), reached
/// within 0.1 s, and how far the shaft may be from its set-point, in turns.
///
/// # Errors
/// What of them makes no sense.
pub fn limits(
    Rpm(velocity_rpm): Rpm,
    acceleration_turns_s2: Option<f64>,
    following_error_turns: f64,
) -> Result<AxisLimits, Failure> {
    let acceleration_turns_s2 = acceleration_turns_s2.unwrap_or(ACCELERATION_TURNS_S2);
    let limits = AxisLimits {
        range_turns: None,
        velocity_turns_s: velocity_rpm / 60.0,
        acceleration_turns_s2,
        jerk_turns_s3: acceleration_turns_s2 / ROUNDING_S,
        following_error_turns,
    };
    limits.check(1).map_err(|error| Failure::from(GroupError::of_path(error, None)))?;
    Ok(limits)
}

/// What is captured of a motion where nothing is named: what its figures need, as far as the model has it.
///
/// # Errors
/// The drive does not answer.
pub async fn usual_quantities(drive: &Drive) -> Result<Vec<String>, Failure> {
    let mut names = Vec::new();
    for name in ["velocity", "target_velocity", "current"] {
        match Quantity::named(drive, name).await {
            Ok(_) => names.push(name.to_owned()),
            Err(failure) if failure.kind == "no_such_quantity" => {}
            Err(failure) => return Err(failure),
        }
    }
    Ok(names)
}

enum Mover<'a> {
    Steps(Rpm, Option<Ramp>, Duration),
    Points(Box<Group>, &'a [f64]),
}

/// Makes runs, each captured, and ends the motion: the drive is at rest then, and without power. What was captured stays in `runs`,
/// also of a run that failed. What `wanted` has changed of the drive is in the restorer.
///
/// # Errors
/// What stopped it; that it was not seen to stand.
pub async fn run(
    (drive, motion): (&Drive, &Motion),
    (wanted, restorer): (&Wanted, &Restorer),
    (count, travel_turns): (u32, Option<f64>),
    runs: &mut Vec<Run>,
    mut begins: impl FnMut(u32),
) -> Result<(), Failure> {
    let travel = match travel_turns {
        Some(most_turns) => Some(Travel::around(drive, most_turns).await?),
        None => None,
    };
    // What is refused is refused before the way back has a motion to end: it would stop what others move.
    drive.check_unclaimed("test motion")?;
    let is_points = matches!(motion, Motion::Points { .. });
    if is_points {
        AxisSetup::best_mode(drive)?;
    }
    restorer.begin_motion(is_points);
    let mut mover = match motion {
        Motion::Steps { speed, ramp, hold } => Mover::Steps(*speed, *ramp, *hold),
        Motion::Points { points, limits, period, cyclic } => {
            let axis = AxisSetup { drive: drive.clone(), mode: AxisSetup::best_mode(drive)?, limits: limits.clone() };
            Mover::Points(Box::new(Group::open(&[axis], *period, *cyclic).await?), points)
        }
    };
    let moved = async {
        let mut running = match &mut mover {
            Mover::Steps(..) => wanted.begin(drive, restorer).await?,
            Mover::Points(group, _) => {
                let begun = group.beside(wanted.begin(drive, restorer)).await?;
                group.enable().await?;
                begun
            }
        };
        for number in 1..=count {
            begins(number);
            let (moved, taken) = once(drive, travel, &mut mover, &mut running).await;
            let failure = moved.as_ref().err().cloned().or(taken.cut_off);
            let figures = Figures::of(moved.ok().flatten(), &taken.capture);
            let ways = running.ways().to_vec();
            runs.push(Run { number, figures, capture: taken.capture, ways, first_at: taken.first_at });
            failure.map_or(Ok(()), Err)?;
        }
        Ok(())
    };
    let moved = moved.await;
    let ended = match mover {
        Mover::Steps(..) => bring_to_rest(drive).await,
        Mover::Points(mut group, _) => {
            let reason = if moved.is_err() { group.explain_stop().await } else { None };
            let closed = group.close().await.map_err(Failure::from);
            closed.map_err(|failure| reason.into_iter().fold(failure, Failure::because))
        }
    };
    restorer.end_motion();
    both(moved, ended)
}

async fn once(
    drive: &Drive,
    travel: Option<Travel>,
    mover: &mut Mover<'_>,
    running: &mut Running,
) -> (Result<Option<Followed>, Failure>, Taken) {
    match mover {
        Mover::Points(group, points) => {
            let (done, taken): (Result<_, GroupError>, _) = running.during(follow(group, points)).await;
            (done.map(Some).map_err(Failure::from), taken)
        }
        Mover::Steps(speed, ramp, hold) => {
            let (done, taken) = running.during(steps(drive, *speed, *ramp, *hold, travel)).await;
            (done.map(|()| None), taken)
        }
    }
}

impl Figures {
    /// What, how much, and how exactly: for people.
    pub fn rows(&self) -> Vec<[String; 3]> {
        let mut rows = Vec::new();
        let mut add = |what: String, value: String, grid: String| rows.push([what, value, grid]);
        if let Some(Followed { took_s, most_deg, rms_deg }) = self.followed {
            add("following error".into(), format!("{most_deg:.3} deg at most, {rms_deg:.3} deg r.m.s."), String::new());
            add("time".into(), format!("{took_s:.3} s"), String::new());
        }
        for step in &self.steps {
            let of = format!("{} to {} r/min", step.from, step.to);
            for (what, figure, unit, times) in [
                ("rise", &step.rise_s, "ms", 1e3),
                ("overshoot", &step.overshoot, "%", 100.0),
                ("settling", &step.settling_s, "ms", 1e3),
            ] {
                let (value, grid) = match figure {
                    merit::Figure::Is { value, grid } => {
                        (format!("{:.1} {unit}", value * times), format!("{:.1} {unit}", grid * times))
                    }
                    merit::Figure::Unknown { why } => (why.clone(), String::new()),
                };
                add(format!("{what}, {of}"), value, grid);
            }
        }
        if let Some(Heating { rms_a, a2s }) = self.heating {
            add("current".into(), format!("{rms_a:.3} A r.m.s., {a2s:.3} A²·s"), String::new());
        }
        rows
    }

    /// There are some.
    pub fn are_some(&self) -> bool {
        self.followed.is_some() || !self.steps.is_empty() || self.heating.is_some()
    }

    /// Those of a capture, and how its points were followed.
    pub fn of(followed: Option<Followed>, capture: &Capture) -> Self {
        let (steps, no_steps) = match (&followed, steps_of(capture)) {
            (Some(_), _) => (Vec::new(), None),
            (None, Ok(steps)) => (steps, None),
            (None, Err(why)) => (Vec::new(), Some(why)),
        };
        let current = capture.trace("current_a").map(|trace| capture.points(trace).collect::<Vec<_>>());
        let heating = current.and_then(|points| merit::heating(&points));
        Self { followed, steps, no_steps, heating }
    }
}

/// The figures of each change of the velocity demand.
fn steps_of(capture: &Capture) -> Result<Vec<Step>, String> {
    let demand = capture.trace("target_velocity_rpm").ok_or("target_velocity was not captured")?;
    let speed = capture.trace("velocity_rpm").ok_or("velocity was not captured")?;
    let demand: Vec<(f64, f64)> = capture.points(demand).collect();
    let speed: Vec<(f64, f64)> = capture.points(speed).collect();
    let changes = demand.windows(2).filter(|pair| pair[0].1 != pair[1].1);
    let changes: Vec<(f64, f64, f64)> = changes.map(|pair| (pair[1].0, pair[0].1, pair[1].1)).collect();
    let ends = changes.iter().skip(1).map(|(at, ..)| *at).chain([f64::INFINITY]);
    let parts = changes.iter().zip(ends).map(|((at, from, to), end)| {
        let part: Vec<(f64, f64)> = speed.iter().copied().filter(|(time, _)| *time < end).collect();
        merit::step(&part, *at, *from, *to)
    });
    parts.collect()
}

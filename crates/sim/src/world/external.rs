//! Exchanges with a physics engine outside, which moves the shafts of [`Coupling::External`](crate::Coupling::External).
//!
//! All such shafts of a world are exchanged together, in the order in which they were coupled. What a shaft does between two exchanges,
//! and how far off it is then, is said in [`plant::coupled::external`]. Time that passes outside of an exchange finds the shafts held
//! fast: nothing moves on while the engine stands.

use core::ops::Range;
use core::time::Duration;

use can::Instant;
use plant::coupled::{Body, ExternalData, ExternalModel, Rule};

use super::body::CoupledBody;
use super::member::Member;
use super::{StationId, World};
use crate::coupling::JOINT_ANGLE;
use crate::stimulus::Place;

/// A joint that comes further than its velocities explain by more than this was put elsewhere, rad.
const JUMP_RAD: f64 = 0.05;
/// The fastest that a joint may be said to be: more is a number that got lost, rad/s.
const FASTEST_RAD_S: f64 = 1e5;
/// The greatest torque at a joint, N·m.
const STRONGEST_NM: f64 = 1e9;

/// Why an exchange was not done: nothing was stored, and no time passed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExchangeError {
    /// The wrong number of values.
    #[error("expected {expected} values, one for each external shaft of the world, got {given}")]
    Length {
        /// How many shafts there are.
        expected: usize,
        /// How many values were given.
        given: usize,
    },
    /// The world has none.
    #[error("no shaft of this world is moved from outside; couple some as an external body first")]
    NoShafts,
    /// A step that does not fit.
    #[error("a step of {} s: expected a whole number of control periods of {} s, at most {} s", .dt.as_secs_f64(), .period.as_secs_f64(), MOST_S)]
    Step {
        /// The step.
        dt: Duration,
        /// A drive's control period.
        period: Duration,
    },
    /// Not a number, or one beyond all reason.
    #[error("{what} of joint {joint} is {value}; expected a number from {least:e} to {most:e}", least = -*.most)]
    Value {
        /// Which value.
        what: &'static str,
        /// Which joint, counted from 1.
        joint: usize,
        /// The value.
        value: f64,
        /// Its greatest size.
        most: f64,
    },
    /// The joint was put elsewhere.
    #[error(
        "joint {joint} is at {angle_rad} rad, {beyond_rad:.3} rad further than its velocities explain; where the engine puts a joint \
         elsewhere, restore the snapshot of the world that belongs to it, or couple the shafts with the angle that they have"
    )]
    Jump {
        /// Which joint, counted from 1.
        joint: usize,
        /// Where it is said to be.
        angle_rad: f64,
        /// How far that is beyond what can be.
        beyond_rad: f64,
    },
    /// The other form.
    #[error("these shafts take {takes} in; the other form is chosen where they are coupled")]
    Form {
        /// What they take.
        takes: &'static str,
    },
    /// The last exchange has time left.
    #[error("the last exchange is under way: {} s of it are to come", .left.as_secs_f64())]
    UnderWay {
        /// How much of it.
        left: Duration,
    },
}

/// The longest step, s.
const MOST_S: u64 = 1;

/// A shaft that is moved from outside, at its joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalShaft {
    /// The drive and its axis.
    pub place: Place,
    /// Turns of the joint per turn of the motor, signed.
    pub turns: f64,
    /// Inertia of the drive at the joint, kg·m²: what the engine has to have there beside its own.
    pub inertia_kg_m2: f64,
    /// Dry friction at the joint, brake included, N·m: the most that it gives.
    pub dry_nm: f64,
    /// Torque of the drive at the joint less its friction, the mean of the last exchange, N·m.
    pub torque_nm: f64,
    /// Where the shaft is, rad, and how fast it turns, rad/s.
    pub angle_rad: f64,
    /// See above.
    pub velocity_rad_s: f64,
}

/// What the engine gives.
#[derive(Clone, Copy, Debug)]
pub enum Given<'a> {
    /// Angle and velocity of each joint, rad and rad/s.
    Motion(&'a [f64], &'a [f64]),
    /// Torque at each joint, N·m.
    Torque(&'a [f64]),
}

impl World {
    /// Moves on by a step of the engine: where its joints are goes in, the mean torque of each drive over the step at its joint, less its
    /// friction, comes out. `angle_rad`, `velocity_rad_s` and `torque_nm` have a value for each external shaft.
    ///
    /// Goes with all rules but [`Rule::Torque`]. With [`Rule::Interpolate`] the step is the engine's last one, with the others its next
    /// one; in both cases the torque is meant for its next step.
    ///
    /// # Errors
    /// [`ExchangeError`]; nothing is stored then, and no time passes.
    pub fn exchange(
        &mut self,
        dt: Duration,
        (angle_rad, velocity_rad_s): (&[f64], &[f64]),
        torque_nm: &mut [f64],
    ) -> Result<(), ExchangeError> {
        self.same_length(torque_nm.len())?;
        self.begin_exchange(dt, Given::Motion(angle_rad, velocity_rad_s))?;
        self.run_for(dt);
        self.read_torques(torque_nm);
        Ok(())
    }

    /// The other form ([`Rule::Torque`]): a torque at each joint in, its angle and velocity at the end of the step out.
    ///
    /// # Errors
    /// [`ExchangeError`]; nothing is stored then, and no time passes.
    pub fn exchange_torque(
        &mut self,
        dt: Duration,
        torque_nm: &[f64],
        (angle_rad, velocity_rad_s): (&mut [f64], &mut [f64]),
    ) -> Result<(), ExchangeError> {
        self.same_length(angle_rad.len())?;
        self.same_length(velocity_rad_s.len())?;
        self.begin_exchange(dt, Given::Torque(torque_nm))?;
        self.run_for(dt);
        self.read_motions(angle_rad, velocity_rad_s);
        Ok(())
    }

    /// The half of an exchange before the time of its step passes, for programs whose world something else moves: `dt` has to pass
    /// now, and then the results are there.
    ///
    /// # Errors
    /// [`ExchangeError`]; nothing is stored then.
    pub fn begin_exchange(&mut self, dt: Duration, given: Given<'_>) -> Result<(), ExchangeError> {
        self.check_exchange(dt, given)?;
        let mut at = 0;
        for body in &mut self.bodies {
            if let Some(own) = body.own_shafts(at) {
                at = own.end;
                body.begin_exchange(dt, given.of(own));
            }
        }
        Ok(())
    }

    /// The mean torque of the last exchange at each joint, N·m, into as many places as there are shafts.
    pub fn read_torques(&mut self, torque_nm: &mut [f64]) {
        self.settle_all();
        let torques =
            self.externals().flat_map(|(_, model, data)| (0..model.count()).map(|joint| data.torque_nm(joint)));
        for (place, torque_nm) in torque_nm.iter_mut().zip(torques) {
            *place = torque_nm;
        }
    }

    /// Where the shafts are now, rad, and how fast they turn, rad/s.
    pub fn read_motions(&mut self, angle_rad: &mut [f64], velocity_rad_s: &mut [f64]) {
        self.settle_all();
        let shafts = self.externals().flat_map(|(_, model, data)| (0..model.count()).map(|joint| data.shaft(joint)));
        for ((angle, velocity), shaft) in angle_rad.iter_mut().zip(velocity_rad_s).zip(shafts) {
            (*angle, *velocity) = shaft;
        }
    }

    /// How many shafts are moved from outside.
    pub fn external_shaft_count(&self) -> usize {
        self.externals().map(|(_, model, _)| model.count()).sum()
    }

    /// Of the first machine of such shafts: when its next control period begins, and how long each is.
    pub fn next_external_period(&self) -> Option<(Instant, Duration)> {
        let (body, ..) = self.externals().next()?;
        Some((body.next, Duration::from_nanos(body.period_ns)))
    }

    /// The shafts that are moved from outside, in the order of the exchange.
    pub fn external_shafts(&mut self) -> Vec<ExternalShaft> {
        self.settle_all();
        let shafts: Vec<_> = self.externals().flat_map(|external| self.shafts_of(external)).collect();
        if shafts.iter().all(|shaft| shaft.inertia_kg_m2 > 0.0) {
            return shafts;
        }
        // A drive says what it has in its first control period: a copy of the world looks ahead.
        let mut copy = self.clone();
        copy.stop_recording();
        // A station may share its state with its copy, as a master does: in the copy its requests would be answered by drives that are not there.
        for i in 0..copy.members.len() {
            if matches!(copy.members[i], Member::Station(_)) {
                copy.remove(StationId(i));
            }
        }
        copy.run_for(Duration::from_millis(1));
        copy.settle_all();
        let later = copy.externals().flat_map(|external| copy.shafts_of(external));
        let known = |(shaft, later): (ExternalShaft, ExternalShaft)| ExternalShaft {
            inertia_kg_m2: later.inertia_kg_m2,
            dry_nm: later.dry_nm,
            ..shaft
        };
        shafts.into_iter().zip(later).map(known).collect()
    }

    fn shafts_of(&self, (body, model, data): (&CoupledBody, &ExternalModel, &ExternalData)) -> Vec<ExternalShaft> {
        let shaft = |joint: usize| {
            let own = body.shafts[joint];
            let node = match &self.members[own.station] {
                Member::Drive { number, .. } => *number,
                // It was taken off the bus.
                _ => 0,
            };
            let (angle_rad, velocity_rad_s) = data.shaft(joint);
            ExternalShaft {
                place: Place { node, axis: own.axis },
                turns: body.turns[joint],
                inertia_kg_m2: data.inertia_kg_m2(joint),
                dry_nm: data.dry_nm(joint),
                torque_nm: data.torque_nm(joint),
                angle_rad,
                velocity_rad_s,
            }
        };
        (0..model.count()).map(shaft).collect()
    }

    fn same_length(&self, given: usize) -> Result<(), ExchangeError> {
        let expected = self.external_shaft_count();
        if given == expected { Ok(()) } else { Err(ExchangeError::Length { expected, given }) }
    }

    /// Whether an exchange could begin now, for programs that have several worlds do it or none.
    ///
    /// # Errors
    /// [`ExchangeError`].
    pub fn check_exchange(&mut self, dt: Duration, given: Given<'_>) -> Result<(), ExchangeError> {
        self.settle_all();
        if self.external_shaft_count() == 0 {
            return Err(ExchangeError::NoShafts);
        }
        match given {
            Given::Motion(angle_rad, velocity_rad_s) => {
                self.same_length(angle_rad.len())?;
                self.same_length(velocity_rad_s.len())?;
            }
            Given::Torque(torque_nm) => self.same_length(torque_nm.len())?,
        }
        given.check()?;
        let mut at = 0;
        for body in &self.bodies {
            if let Some(own) = body.own_shafts(at) {
                body.check_exchange(dt, given.of(own.clone()), at)?;
                at = own.end;
            }
        }
        Ok(())
    }

    fn externals(&self) -> impl Iterator<Item = (&CoupledBody, &ExternalModel, &ExternalData)> {
        self.bodies.iter().filter_map(|coupled| match &coupled.body {
            Body::External(model, data) => Some((coupled, model, data)),
            _ => None,
        })
    }
}

impl CoupledBody {
    /// Its shafts among those of all external bodies, of which `at` come before it; `None` for another machine.
    fn own_shafts(&self, at: usize) -> Option<Range<usize>> {
        match &self.body {
            Body::External(model, _) => Some(at..at + model.count()),
            _ => None,
        }
    }

    /// Whether an exchange of its own shafts, as many as it has, could begin; `before` shafts are counted before its own.
    pub(super) fn check_exchange(&self, dt: Duration, given: Given<'_>, before: usize) -> Result<(), ExchangeError> {
        let Body::External(model, data) = &self.body else { return Err(ExchangeError::NoShafts) };
        let period = Duration::from_nanos(self.period_ns);
        if dt.is_zero() || !dt.as_nanos().is_multiple_of(period.as_nanos()) || dt > Duration::from_secs(MOST_S) {
            return Err(ExchangeError::Step { dt, period });
        }
        if data.periods_left() > 0 {
            return Err(ExchangeError::UnderWay { left: period * data.periods_left() });
        }
        match (given, model.rule() == Rule::Torque) {
            (Given::Motion(angle_rad, velocity_rad_s), false) => {
                for joint in 0..model.count() {
                    let motion = (angle_rad[joint], velocity_rad_s[joint]);
                    let beyond_rad = model.unexplained_rad(data, dt.as_secs_f64(), joint, motion);
                    if beyond_rad > JUMP_RAD {
                        return Err(ExchangeError::Jump { joint: before + joint + 1, angle_rad: motion.0, beyond_rad });
                    }
                }
                Ok(())
            }
            (Given::Torque(_), true) => Ok(()),
            (_, true) => Err(ExchangeError::Form { takes: "a torque" }),
            (_, false) => Err(ExchangeError::Form { takes: "an angle and a velocity" }),
        }
    }

    /// Begins an exchange of its own shafts that was checked.
    pub(super) fn begin_exchange(&mut self, dt: Duration, given: Given<'_>) {
        let Body::External(model, data) = &mut self.body else { return };
        let step = (dt.as_secs_f64(), (dt.as_nanos() / u128::from(self.period_ns)) as u32);
        match given {
            Given::Motion(angle_rad, velocity_rad_s) => {
                let mut joints = [(0.0, 0.0); plant::coupled::MOST];
                for (joint, motion) in
                    joints.iter_mut().zip(angle_rad.iter().copied().zip(velocity_rad_s.iter().copied()))
                {
                    *joint = motion;
                }
                model.begin_motion(data, step, &joints[..model.count()]);
            }
            Given::Torque(torque_nm) => model.begin_torque(data, step, torque_nm),
        }
    }
}

impl Given<'_> {
    /// Whether the values are numbers that can be.
    ///
    /// # Errors
    /// [`ExchangeError::Value`] of the first that cannot.
    pub fn check(&self) -> Result<(), ExchangeError> {
        match self {
            Self::Motion(angle_rad, velocity_rad_s) => {
                check_values("the angle", angle_rad, JOINT_ANGLE.greatest)?;
                check_values("the velocity", velocity_rad_s, FASTEST_RAD_S)
            }
            Self::Torque(torque_nm) => check_values("the torque", torque_nm, STRONGEST_NM),
        }
    }

    /// Those of some of the shafts.
    fn of(&self, own: Range<usize>) -> Self {
        match *self {
            Self::Motion(angle_rad, velocity_rad_s) => Self::Motion(&angle_rad[own.clone()], &velocity_rad_s[own]),
            Self::Torque(torque_nm) => Self::Torque(&torque_nm[own]),
        }
    }
}

fn check_values(what: &'static str, values: &[f64], most: f64) -> Result<(), ExchangeError> {
    // What is not a number is not in any range.
    match values.iter().position(|value| !(-most..=most).contains(value)) {
        None => Ok(()),
        Some(i) => Err(ExchangeError::Value { what, joint: i + 1, value: values[i], most }),
    }
}

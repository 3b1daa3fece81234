//! Shafts that a physics engine moves: it owns the masses behind them, and has steps of its own.
//!
//! Each shaft is a coordinate of its own, with the drive at one end and the engine at the other. At an exchange the engine says where its
//! joint is, and the shaft is moved for one step of the engine, in as many control periods as fit into it; out comes the mean torque of
//! the drive at the joint, less all its own friction. The engine has the drive's inertia too (its *armature*), so that the torque
//! neither counts it twice nor lets a stiff loop act on too little mass. With [`Rule::Torque`] it is the other way round: the engine gives
//! a torque, and the shaft's motion comes out.
//!
//! What a shaft does between two exchanges is a [`Rule`]. With `a` the joint's acceleration, `j` its change per time, `s` the change of
//! that, and `dt` from one exchange to the next, the shaft is off by at most, at the end of a step:
//!
//! | rule | angle | torque | energy of an oscillation at `w` |
//! |---|---|---|---|
//! | [`Hold`](Rule::Hold) | `a dt²/2` | that of the step to come | kept |
//! | [`Interpolate`](Rule::Interpolate) | `ds/dt dt⁴/384` | one step late | grows by `w² dt` per second |
//! | [`Integrate`](Rule::Integrate) | `5 j dt³/12` | that of the step to come | kept |
//! | [`Torque`](Rule::Torque) | none | that of the engine, one step late | |
//!
//! Beyond the step that was exchanged nothing moves: the shaft is held fast, at the angle that it has, until the next exchange.
//!
//! Dry friction is what stops the joint within the step and holds it against the load, and no more than there is. The load is known from
//! the last step: what the joint's acceleration shows beyond the torque that was handed out. A brake holds a joint of the engine so
//! within a few steps. `inertia` is the least that the joint may have for that to be stable: the drive's own, and what is stated beside.

use super::friction::MOST;
use crate::shaft::{Motion, Push};

/// What a shaft does between two exchanges.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Rule {
    /// Motion in, torque out: turns on at the velocity given, for the step to come.
    Hold,
    /// Motion in, torque out: turns from the last angle and velocity to the present ones, in the step that is over. The torque is of that
    /// step.
    Interpolate,
    /// Motion in, torque out: turns by the drive's torque and the load of the last step, with its own inertia, for the step to come.
    #[default]
    Integrate,
    /// Torque in, motion out: turns by the drive's torque and the one given, with all the inertia there is.
    Torque,
}

impl Rule {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Hold, Self::Interpolate, Self::Integrate, Self::Torque];
    /// The words of the rules.
    pub const NAMES: &'static str = "hold, interpolate, integrate or torque";

    /// As people type it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Interpolate => "interpolate",
            Self::Integrate => "integrate",
            Self::Torque => "torque",
        }
    }
}

impl core::str::FromStr for Rule {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::ALL.into_iter().find(|rule| rule.word() == text).ok_or(())
    }
}

/// What never changes about such shafts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExternalModel {
    rule: Rule,
    inertia_kg_m2: [f64; MOST],
    first_rad: [f64; MOST],
    count: usize,
}

/// Their state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExternalData {
    joints: [Joint; MOST],
    /// Control periods of this exchange that are still to come, and all of them.
    left: u32,
    periods: u32,
    /// How long the exchange before this one was, s.
    before_s: f64,
}

/// One joint.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Joint {
    /// Where the shaft is.
    angle_rad: f64,
    velocity_rad_s: f64,
    /// What the engine gave last, and before that.
    given: Given,
    past: Given,
    /// Torque of the load: of the last step, or given.
    load_nm: f64,
    /// Added to the mean velocity, so that the shaft comes to where the engine's joint is.
    drift_rad_s: f64,
    /// Torque that was handed out for the step.
    handed_nm: f64,
    /// What the exchange has summed up so far: torque less viscous friction, dry friction.
    torque_nm: f64,
    friction_nm: f64,
    /// Dry friction that acts in this exchange, where the motion is not ours.
    holding_nm: f64,
    /// Of the drive, as it was last: inertia at the joint with what is stated beside it, dry friction.
    inertia_kg_m2: f64,
    own_kg_m2: f64,
    dry_nm: f64,
}

/// An angle and a velocity.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Given {
    angle_rad: f64,
    velocity_rad_s: f64,
}

impl ExternalModel {
    /// A shaft for each of `joints`: where the joint stands when it is joined, rad, and inertia there beside the drive's own, kg·m². That
    /// is what the drive moves with [`Rule::Torque`]; else what the engine is known to have there at least, 0 if nothing is known.
    /// `None` without a joint, or with more than [`MOST`].
    pub fn new(rule: Rule, joints: &[(f64, f64)]) -> Option<Self> {
        let mut model = Self { rule, inertia_kg_m2: [0.0; MOST], first_rad: [0.0; MOST], count: joints.len() };
        if joints.is_empty() || joints.len() > MOST {
            return None;
        }
        for (i, (first_rad, inertia_kg_m2)) in joints.iter().enumerate() {
            (model.first_rad[i], model.inertia_kg_m2[i]) = (*first_rad, *inertia_kg_m2);
        }
        Some(model)
    }

    /// What the shafts do between two exchanges.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// For each: where it stands first, rad, and the inertia beside the drive's own, kg·m².
    pub fn joints(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.first_rad.iter().copied().zip(self.inertia_kg_m2).take(self.count)
    }

    /// The joints where they stand first, at rest.
    pub fn at_rest(&self) -> ExternalData {
        let mut data = ExternalData::default();
        for (joint, first_rad) in data.joints.iter_mut().zip(self.first_rad).take(self.count) {
            joint.angle_rad = first_rad;
            joint.given.angle_rad = first_rad;
            joint.past.angle_rad = first_rad;
        }
        data
    }

    /// Begins an exchange of `periods` control periods, `dt_s` together, with the joints where the engine has them.
    pub fn begin_motion(&self, data: &mut ExternalData, (dt_s, periods): (f64, u32), joints: &[(f64, f64)]) {
        let since_s = self.since_s(data, dt_s);
        for (joint, &(angle_rad, velocity_rad_s)) in data.joints.iter_mut().zip(joints) {
            if since_s > 0.0 {
                let acceleration = (velocity_rad_s - joint.given.velocity_rad_s) / since_s;
                joint.load_nm = joint.inertia_kg_m2 * acceleration - joint.handed_nm;
            }
            joint.past = joint.given;
            joint.given = Given { angle_rad, velocity_rad_s };
            let behind_rad_s = (angle_rad - joint.angle_rad) / dt_s;
            match self.rule {
                Rule::Hold => joint.drift_rad_s = velocity_rad_s + behind_rad_s,
                _ => joint.drift_rad_s = behind_rad_s,
            }
            if self.rule != Rule::Interpolate {
                joint.velocity_rad_s = velocity_rad_s;
            }
        }
        data.begin(dt_s, periods);
    }

    /// Begins an exchange in which the engine gives a torque at each joint.
    pub fn begin_torque(&self, data: &mut ExternalData, (dt_s, periods): (f64, u32), torque_nm: &[f64]) {
        for (joint, torque_nm) in data.joints.iter_mut().zip(torque_nm) {
            joint.load_nm = *torque_nm;
            joint.drift_rad_s = 0.0;
        }
        data.begin(dt_s, periods);
    }

    /// How far the engine's joint has come since the last exchange beyond what its velocities then and now explain, rad.
    pub fn unexplained_rad(
        &self,
        data: &ExternalData,
        dt_s: f64,
        joint: usize,
        (angle_rad, velocity_rad_s): (f64, f64),
    ) -> f64 {
        let Given { angle_rad: before_rad, velocity_rad_s: before_rad_s } = data.joints[joint].given;
        let explained = (velocity_rad_s.abs() + before_rad_s.abs()) * self.since_s(data, dt_s);
        ((angle_rad - before_rad).abs() - explained).max(0.0)
    }

    /// How long the engine's step between the last exchange and this one was, 0 before the first.
    fn since_s(&self, data: &ExternalData, dt_s: f64) -> f64 {
        if self.rule == Rule::Interpolate { dt_s } else { data.before_s }
    }

    pub(super) fn step(&self, data: &mut ExternalData, dt_s: f64, pushes: &[Push]) -> [Motion; MOST] {
        let done = data.periods - data.left.saturating_sub(1);
        let share = f64::from(done) / f64::from(data.periods.max(1));
        let (held, step_s) = (data.left == 0, dt_s * f64::from(data.periods));
        let mut motions = [Motion::default(); MOST];
        for (i, (push, motion)) in pushes.iter().zip(&mut motions).enumerate().take(self.count) {
            let joint = &mut data.joints[i];
            joint.own_kg_m2 = push.inertia_kg_m2;
            joint.inertia_kg_m2 = push.inertia_kg_m2 + self.inertia_kg_m2[i];
            joint.dry_nm = push.dry_nm;
            *motion = match self.rule {
                _ if held => {
                    joint.velocity_rad_s = 0.0;
                    Motion::default()
                }
                Rule::Integrate | Rule::Torque => joint.integrate(dt_s, push),
                Rule::Hold => joint.turn_on(push),
                Rule::Interpolate => joint.interpolate(share, step_s, dt_s, push),
            };
            joint.angle_rad += motion.mean_rad_s * dt_s;
        }
        data.left = data.left.saturating_sub(1);
        if !held && data.left == 0 {
            self.end(data, step_s);
        }
        motions
    }

    /// The last period is over: what is handed out.
    fn end(&self, data: &mut ExternalData, step_s: f64) {
        for joint in data.joints.iter_mut().take(self.count) {
            let periods = f64::from(data.periods);
            let torque_nm = joint.torque_nm / periods;
            if !matches!(self.rule, Rule::Integrate | Rule::Torque) {
                let wanted_nm = joint.inertia_kg_m2 / step_s * joint.given.velocity_rad_s + torque_nm + joint.load_nm;
                joint.holding_nm = wanted_nm.clamp(-joint.dry_nm, joint.dry_nm);
                joint.friction_nm = joint.holding_nm * periods;
            }
            joint.handed_nm = torque_nm - joint.friction_nm / periods;
        }
    }
}

impl ExternalData {
    fn begin(&mut self, dt_s: f64, periods: u32) {
        for joint in &mut self.joints {
            (joint.torque_nm, joint.friction_nm) = (0.0, 0.0);
        }
        (self.left, self.periods, self.before_s) = (periods, periods, dt_s);
    }

    /// Control periods of the last exchange that have not been yet.
    pub fn periods_left(&self) -> u32 {
        self.left
    }

    /// Angle and velocity of the shaft at a joint, rad and rad/s.
    pub fn shaft(&self, joint: usize) -> (f64, f64) {
        let Joint { angle_rad, velocity_rad_s, .. } = self.joints[joint];
        (angle_rad, velocity_rad_s)
    }

    /// Torque of the drive at a joint less its friction, the mean of the last exchange, N·m.
    pub fn torque_nm(&self, joint: usize) -> f64 {
        self.joints[joint].handed_nm
    }

    /// Inertia of the drive at a joint, kg·m²: what the engine has to have there, too. 0 before the first control period.
    pub fn inertia_kg_m2(&self, joint: usize) -> f64 {
        self.joints[joint].own_kg_m2
    }

    /// Dry friction at a joint, brakes included, N·m: the most that it gives.
    pub fn dry_nm(&self, joint: usize) -> f64 {
        self.joints[joint].dry_nm
    }
}

impl Joint {
    /// By all torques, with the inertia that is there.
    fn integrate(&mut self, dt_s: f64, push: &Push) -> Motion {
        let before = self.velocity_rad_s;
        let (momentum, half_nm_s) = (self.inertia_kg_m2 / dt_s, 0.5 * push.viscous_nm_s);
        let drive_nm = push.torque_nm + self.load_nm + (momentum - half_nm_s) * before;
        // No more friction than holds.
        let after = (drive_nm.abs() - push.dry_nm).max(0.0).copysign(drive_nm) / (momentum + half_nm_s);
        let dry_nm = drive_nm - (momentum + half_nm_s) * after;
        let middle = 0.5 * (before + after);
        self.velocity_rad_s = after;
        self.torque_nm += push.torque_nm - push.viscous_nm_s * middle;
        self.friction_nm += dry_nm;
        Motion { velocity_rad_s: after, mean_rad_s: middle + self.drift_rad_s, dry_nm }
    }

    /// At one velocity through the step, which brings the shaft to where the joint would be then.
    fn turn_on(&mut self, push: &Push) -> Motion {
        self.moved(self.given.velocity_rad_s, self.drift_rad_s, push)
    }

    /// Along the cubic through the last angle and velocity and the present ones.
    fn interpolate(&mut self, share: f64, step_s: f64, dt_s: f64, push: &Push) -> Motion {
        let (from, to, rest) = (self.past, self.given, 1.0 - share);
        let way = to.angle_rad - from.angle_rad;
        let (slope_from, slope_to) = (from.velocity_rad_s * step_s - way, way - to.velocity_rad_s * step_s);
        let bulge = |s: f64, r: f64| r * s * (slope_from * r + slope_to * s);
        let angle_rad = from.angle_rad + way * share + bulge(share, rest);
        let slope =
            way + (rest - share) * (slope_from * rest + slope_to * share) + share * rest * (slope_to - slope_from);
        let mean_rad_s = (angle_rad - self.angle_rad) / dt_s;
        self.moved(slope / step_s, mean_rad_s, push)
    }

    /// Moved by the engine.
    fn moved(&mut self, velocity_rad_s: f64, mean_rad_s: f64, push: &Push) -> Motion {
        self.velocity_rad_s = velocity_rad_s;
        self.torque_nm += push.torque_nm - push.viscous_nm_s * mean_rad_s;
        Motion { velocity_rad_s, mean_rad_s, dry_nm: self.holding_nm }
    }
}

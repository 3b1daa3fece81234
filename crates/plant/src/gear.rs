//! Reduction gear between a rotor and its load: ratio, torsion spring with damping, backlash, friction.
//!
//! Two masses, the motor's and the output's, joined by what the gear transmits. All of its constants but the friction
//! are stated at the output:
//!
//! ```text
//! twist      = motor angle / ratio - output angle
//! torque     = stiffness * (twist beyond the backlash) + damping * d twist/dt [only while the teeth touch]
//! J_m dw_m/dt = motor torque - torque / ratio - friction of motor and gear
//! J_o dw_o/dt = torque - load torque - friction of the load
//! ```
//!
//! The implicit midpoint rule makes this two linear equations for each case of the two dry frictions, so that a step
//! is stable however stiff the spring is; with an endlessly stiff one and no backlash it is the one mass of
//! [`mechanics`](crate::mechanics). Dry friction goes by the velocity at the end of a step, so that it truly holds; in a
//! step in which a side turns round its work may therefore have either sign.
//! The loss in the teeth is a dry friction of the motor's side that grows with the torque transmitted: driving
//! forward costs `mesh_loss`, and driving backward too. The output's angle is the motor's less the twist: the two
//! never drift apart. A harmonic gear has three more traits, each of which may be left at zero:
//!
//! * a kinematic error, twice per turn of its wave generator: the twist is `motor angle / ratio + error * sin(2 motor angle)
//!   - output angle`, and the ratio of the moment goes with it, so that it drives vibrations;
//! * dry friction of its output side, behind the spring: the output stands on one side or the other of where the motor
//!   points, as it came;
//! * ratcheting: from a torque on its teeth jump, what is wound up is gone as heat, and the output stands elsewhere.
//!
//! In a step in which teeth meet or part the spring's torque is what its energy changes by over the
//! twist, solved by Newton's rule, so that a backlash neither gives nor takes energy.

use crate::angle::{Angle, Axis};
use crate::mechanics::{Load, RotorData, RotorModel};

const INV_TAU: f64 = 1.0 / core::f64::consts::TAU;
/// Newton's rule doubles the digits; a step across a dead band takes three to five, and this ends a chatter.
const NEWTON_STEPS: u32 = 12;
/// Relative change of the twist's rate at which it is done.
const NEWTON_DONE: f64 = 1e-12;
/// An overload is over, and the next one another, when the torque has fallen to this share of the peak.
const OVERLOAD_ENDS: f64 = 0.9;

/// What never changes about a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearModel {
    /// Motor turns per output turn.
    pub ratio: f64,
    /// Torsional stiffness, at the output.
    pub stiffness_nm_rad: f64,
    /// Damping of the torsion, at the output.
    pub damping_nm_s_rad: f64,
    /// Angle by which the output is loose while the motor stands still: the whole dead band.
    pub backlash_rad: f64,
    /// Inertia of the output flange alone, at the output; must be positive.
    pub output_inertia_kg_m2: f64,
    /// Dry friction of the unloaded gear, at the motor.
    pub coulomb_nm: f64,
    /// Viscous friction of the gear, at the motor.
    pub viscous_nm_s: f64,
    /// Loss in the teeth as a share of the torque transmitted.
    pub mesh_loss: f64,
    /// Dry friction of the output side, at the output: flexspline, bearing and seal.
    pub output_coulomb_nm: f64,
    /// Amplitude of the kinematic error, at the output.
    pub kinematic_error_rad: f64,
    /// Torque that it may transmit all the time.
    pub rated_nm: f64,
    /// Torque that it may transmit for moments; more is counted as an overload.
    pub peak_nm: f64,
    /// Torque from which its teeth jump.
    pub ratchet_nm: f64,
}

/// State of the gear and its output. The motor's side is a [`RotorData`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GearData {
    /// Motor angle over the ratio, less the output's angle.
    pub twist_rad: f64,
    /// Velocity of the output.
    pub output_velocity_rad_s: f64,
    /// Torque on the output, mean over the last step.
    pub torque_nm: f64,
    /// What the output was left behind by, over all jumps of the teeth.
    pub slip_rad: f64,
    /// The most that has been transmitted so far.
    pub most_nm: f64,
    /// How often the torque rose over what the gear may transmit.
    pub overloads: u32,
    /// How often the teeth have jumped.
    pub jumps: u32,
    overloaded: bool,
    /// Direction at twice the motor's angle: where in its error the gear is.
    error_axis: Axis,
}

impl GearData {
    /// A new gear in the place of this one: it has not slipped and borne nothing.
    pub fn forget_damage(&mut self) {
        (self.slip_rad, self.most_nm, self.overloads, self.jumps, self.overloaded) = (0.0, 0.0, 0, 0, false);
    }
}

/// What acts on both sides during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearInput<'a> {
    /// Torque of the motor on its rotor.
    pub motor_nm: f64,
    /// Friction of a brake on the motor's shaft.
    pub brake_nm: f64,
    /// What the output is joined to. A locked load holds the output fast; the motor then turns against the spring.
    pub load: &'a Load,
}

/// What happened during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GearOutput {
    /// Mean velocity of the motor.
    pub motor_velocity_rad_s: f64,
    /// Mean velocity of the output.
    pub output_velocity_rad_s: f64,
    /// Heat of all friction during the step: motor, gear, load and brake.
    pub friction_j: f64,
    /// Work done on the active load torque; negative while the load drives.
    pub load_j: f64,
}

impl GearModel {
    /// The output's angle.
    pub fn output_angle(&self, data: &GearData, motor: Angle) -> Angle {
        let error_rad = self.kinematic_error_rad * Axis::at_turns(2.0 * motor.fraction()).sin;
        Angle::from_turns(motor.as_turns() / self.ratio + (error_rad - data.twist_rad - data.slip_rad) * INV_TAU)
    }

    /// A gear that has nothing wound up while its motor stands at an angle.
    pub fn at_rest(&self, motor: Angle) -> GearData {
        let mut data = GearData::default();
        self.align(&mut data, motor);
        data
    }

    /// Takes the motor's angle afresh: what is summed up from step to step would drift in the long run.
    pub(crate) fn align(&self, data: &mut GearData, motor: Angle) {
        if self.kinematic_error_rad != 0.0 {
            data.error_axis = Axis::at_turns(2.0 * motor.fraction());
        }
    }

    /// Twist beyond the backlash: what the spring feels.
    pub fn windup_rad(&self, twist_rad: f64) -> f64 {
        self.contact(twist_rad).windup_rad
    }

    /// Energy in the spring.
    pub fn spring_energy_j(&self, data: &GearData) -> f64 {
        let windup_rad = self.windup_rad(data.twist_rad);
        0.5 * self.stiffness_nm_rad * windup_rad * windup_rad
    }

    /// Energy of the turning masses.
    pub fn kinetic_energy_j(&self, data: &GearData, rotor: &RotorModel, motor: &RotorData, load: &Load) -> f64 {
        let inertia = self.output_inertia_kg_m2 + load.inertia_kg_m2;
        let velocity = data.output_velocity_rad_s;
        rotor.kinetic_energy_j(motor, &Load::default()) + 0.5 * inertia * velocity * velocity
    }

    /// Output torque in steady forward motion at this motor torque and motor velocity: what the frictions leave.
    pub fn driven_torque_nm(&self, rotor: &RotorModel, motor_nm: f64, motor_velocity_rad_s: f64) -> f64 {
        let viscous = rotor.viscous_nm_s + self.viscous_nm_s;
        let lost = rotor.coulomb_nm + self.coulomb_nm + viscous * motor_velocity_rad_s;
        self.ratio * (motor_nm - lost) / (1.0 + self.mesh_loss) - self.output_coulomb_nm
    }

    /// Moves both sides by one step, angles included.
    #[inline]
    pub fn step(
        &self,
        data: &mut GearData,
        rotor: &RotorModel,
        motor: &mut RotorData,
        dt_s: f64,
        input: &GearInput<'_>,
    ) -> GearOutput {
        let GearInput { motor_nm, load, .. } = *input;
        if load.locked {
            data.output_velocity_rad_s = 0.0;
        }
        let Contact { windup_rad, side } = self.contact(data.twist_rad);
        // The ratio of the moment, in the middle of the step as far as it can be known.
        let lead = if self.kinematic_error_rad == 0.0 {
            0.0
        } else {
            let half_way = dt_s * (motor.velocity_rad_s + 0.5 * motor.velocity_change_rad_s);
            2.0 * self.kinematic_error_rad * data.error_axis.turned_by(Axis::at_small_rad(half_way)).cos
        };
        let masses = Masses::new(self, data, rotor, motor, (lead, side), dt_s, input);
        let (spring_nm, coupling) = if side == 0.0 {
            (0.0, 0.0)
        } else {
            (self.stiffness_nm_rad * windup_rad, 0.5 * dt_s * self.stiffness_nm_rad + self.damping_nm_s_rad)
        };
        let mut moved = masses.solve(spring_nm, coupling);
        if self.backlash_rad != 0.0 {
            // Teeth push, they do not pull.
            let pulls = moved.torque_nm * side < 0.0;
            if pulls || self.contact(data.twist_rad + dt_s * moved.twist_rate).side != side {
                moved = self.solve_crossing(&masses, data.twist_rad, dt_s, moved);
            }
        }
        let mean = [0.5 * (masses.before[0] + moved.after[0]), 0.5 * (masses.before[1] + moved.after[1])];

        data.twist_rad += dt_s * moved.twist_rate;
        if self.kinematic_error_rad != 0.0 {
            // What the error truly changed by, in place of what the ratio in the middle of the step made of it.
            let before = data.error_axis;
            data.error_axis = before.turned_by(Axis::at_small_rad(2.0 * dt_s * mean[0]));
            data.twist_rad += self.kinematic_error_rad * (data.error_axis.sin - before.sin) - lead * dt_s * mean[0];
        }
        self.watch_strength(data, moved.torque_nm);
        data.output_velocity_rad_s = moved.after[1];
        data.torque_nm = moved.torque_nm;
        motor.angle = motor.angle.advanced_by(mean[0] * dt_s * INV_TAU);
        motor.velocity_change_rad_s = if moved.after[0] == 0.0 { 0.0 } else { moved.after[0] - masses.before[0] };
        motor.velocity_rad_s = moved.after[0];

        // What the torques brought in and is not stored now went into friction.
        let more_windup_rad = self.windup_rad(data.twist_rad) - windup_rad;
        let spring_j = self.stiffness_nm_rad * (windup_rad + 0.5 * more_windup_rad) * more_windup_rad;
        let motor_j = rotor.inertia_kg_m2 * mean[0] * (moved.after[0] - masses.before[0]);
        let output_inertia = self.output_inertia_kg_m2 + load.inertia_kg_m2;
        let output_j = output_inertia * mean[1] * (moved.after[1] - masses.before[1]);
        let gained_j = spring_j + motor_j + output_j;
        let load_j = load.torque_nm * mean[1] * dt_s;
        GearOutput {
            motor_velocity_rad_s: mean[0],
            output_velocity_rad_s: mean[1],
            friction_j: motor_nm * mean[0] * dt_s - load_j - gained_j,
            load_j,
        }
    }

    /// Counts overloads, and lets the teeth jump.
    #[inline]
    pub(crate) fn watch_strength(&self, data: &mut GearData, torque_nm: f64) {
        let size_nm = torque_nm.abs();
        if size_nm > data.most_nm {
            data.most_nm = size_nm;
        }
        if size_nm > self.peak_nm {
            self.overload(data);
        } else if data.overloaded && size_nm < OVERLOAD_ENDS * self.peak_nm {
            data.overloaded = false;
        }
    }

    #[inline(never)]
    fn overload(&self, data: &mut GearData) {
        if !data.overloaded {
            data.overloaded = true;
            data.overloads = data.overloads.saturating_add(1);
        }
        let windup_rad = self.windup_rad(data.twist_rad);
        if self.stiffness_nm_rad * windup_rad.abs() > self.ratchet_nm {
            data.twist_rad -= windup_rad;
            data.slip_rad += windup_rad;
            data.jumps = data.jumps.saturating_add(1);
        }
    }

    /// How the teeth touch at a twist.
    #[inline]
    fn contact(&self, twist_rad: f64) -> Contact {
        let half = 0.5 * self.backlash_rad;
        if twist_rad > half {
            Contact { windup_rad: twist_rad - half, side: 1.0 }
        } else if half == 0.0 {
            Contact { windup_rad: twist_rad, side: 1.0 }
        } else if twist_rad < -half {
            Contact { windup_rad: twist_rad + half, side: -1.0 }
        } else {
            Contact { windup_rad: 0.0, side: 0.0 }
        }
    }

    /// A step in which teeth meet or part: the torque is the change of the spring's energy over that of the twist, a
    /// rising function of the twist's rate. Damping is left out.
    #[inline(never)]
    fn solve_crossing(&self, masses: &Masses, twist_rad: f64, dt_s: f64, first: Moved) -> Moved {
        let mut moved = first;
        for _ in 0..NEWTON_STEPS {
            let rate = moved.twist_rate;
            let (torque_nm, slope) = self.mean_spring_torque(twist_rad, rate * dt_s);
            moved = masses.solve(torque_nm - slope * dt_s * rate, slope * dt_s);
            if (moved.twist_rate - rate).abs() <= NEWTON_DONE * rate.abs() {
                break;
            }
        }
        moved
    }

    fn mean_spring_torque(&self, twist_rad: f64, way_rad: f64) -> (f64, f64) {
        let (before, after) = (self.windup_rad(twist_rad), self.windup_rad(twist_rad + way_rad));
        mean_spring_torque(self.stiffness_nm_rad, before, after, way_rad)
    }
}

/// How the teeth of a gear touch.
#[derive(Debug, Clone, Copy)]
struct Contact {
    /// Twist beyond the backlash: what the spring feels.
    windup_rad: f64,
    /// Which flanks touch: 1 or -1, 0 for none. Without backlash it is all one.
    side: f64,
}

/// Mean torque of a one-sided spring that is wound up from `before` to `after` while its end moves by `way_rad`, and its slope
/// over that way. It is what the spring's energy changes by over the way, so that none is made or lost.
pub(crate) fn mean_spring_torque(stiffness: f64, before: f64, after: f64, way_rad: f64) -> (f64, f64) {
    if before * after > 0.0 {
        (0.5 * stiffness * (before + after), 0.5 * stiffness)
    } else if way_rad == 0.0 {
        (stiffness * after, 0.0)
    } else {
        let torque_nm = 0.5 * stiffness * (after * after - before * before) / way_rad;
        (torque_nm, (stiffness * after - torque_nm) / way_rad)
    }
}

/// Both sides of the gear over one step, motor first. With `v` the velocities before and `a` those after,
///
/// ```text
/// J (a - v) / dt = drive - viscous (a + v) / 2 - transmitted - dry * sign(a)
/// ```
struct Masses {
    before: [f64; 2],
    /// `2 J / dt + viscous`, and `2 J / dt - viscous`: what stands before `a / 2` and `v / 2`.
    sum: [f64; 2],
    difference: [f64; 2],
    drive: [f64; 2],
    dry: [f64; 2],
    inverse_ratio: f64,
    locked: bool,
}

/// Velocities after the step, the twist's mean rate, and the torque transmitted, at the output.
struct Moved {
    after: [f64; 2],
    twist_rate: f64,
    torque_nm: f64,
}

impl Masses {
    #[inline]
    fn new(
        gear: &GearModel,
        data: &GearData,
        rotor: &RotorModel,
        shaft: &RotorData,
        (lead, side): (f64, f64),
        dt_s: f64,
        input: &GearInput<'_>,
    ) -> Self {
        let GearInput { motor_nm, brake_nm, load } = *input;
        let inverse_ratio = 1.0 / gear.ratio + lead;
        let twice_rate = 2.0 / dt_s;
        let motor = rotor.inertia_kg_m2 * twice_rate;
        let output = (gear.output_inertia_kg_m2 + load.inertia_kg_m2) * twice_rate;
        let viscous = [rotor.viscous_nm_s + gear.viscous_nm_s, load.viscous_nm_s];
        // Of the torque a step ago; none of that of an impact whose teeth have parted since.
        let mesh_nm = if side != 0.0 { gear.mesh_loss * data.torque_nm.abs() * inverse_ratio } else { 0.0 };
        Masses {
            before: [shaft.velocity_rad_s, data.output_velocity_rad_s],
            sum: [motor + viscous[0], output + viscous[1]],
            difference: [motor - viscous[0], output - viscous[1]],
            drive: [motor_nm, -load.torque_nm],
            dry: [rotor.coulomb_nm + gear.coulomb_nm + brake_nm + mesh_nm, load.coulomb_nm + gear.output_coulomb_nm],
            inverse_ratio,
            locked: load.locked,
        }
    }

    #[inline]
    fn twist_rate(&self, velocity: [f64; 2]) -> f64 {
        velocity[0] * self.inverse_ratio - velocity[1]
    }

    /// The step with a torque of `spring_nm + coupling * (mean rate of the twist)`.
    #[inline(always)]
    fn solve(&self, spring_nm: f64, coupling: f64) -> Moved {
        let rate_before = self.twist_rate(self.before);
        let known_nm = spring_nm + 0.5 * coupling * rate_before;
        let n = self.inverse_ratio;
        let system = Friction {
            diagonal: [0.5 * (self.sum[0] + coupling * n * n), 0.5 * (self.sum[1] + coupling)],
            off_diagonal: -0.5 * coupling * n,
            push: [
                self.drive[0] + 0.5 * self.difference[0] * self.before[0] - known_nm * n,
                self.drive[1] + 0.5 * self.difference[1] * self.before[1] + known_nm,
            ],
            dry: self.dry,
        };
        let after = if self.locked { [system.shrink(0, system.push[0]), 0.0] } else { system.velocities(self.before) };
        let rate_after = self.twist_rate(after);
        let torque_nm = known_nm + 0.5 * coupling * rate_after;
        Moved { after, twist_rate: 0.5 * (rate_before + rate_after), torque_nm }
    }
}

/// Two velocities `a` with `S a = push - dry * sign(a)`, where a velocity is zero if its friction can hold it. `S` is
/// symmetric and positive definite, so that there is exactly one answer.
struct Friction {
    diagonal: [f64; 2],
    off_diagonal: f64,
    push: [f64; 2],
    dry: [f64; 2],
}

impl Friction {
    /// Mostly both go on as they went; only if that leads to a contradiction every case is looked at.
    #[inline]
    fn velocities(&self, before: [f64; 2]) -> [f64; 2] {
        let after = self.sliding([1_f64.copysign(before[0]), 1_f64.copysign(before[1])]);
        let goes_on = |side: usize| self.dry[side] == 0.0 || after[side] * before[side] > 0.0;
        if goes_on(0) && goes_on(1) { after } else { self.velocities_of_any_case() }
    }

    #[inline]
    fn sliding(&self, sign: [f64; 2]) -> [f64; 2] {
        let push = [self.push[0] - self.dry[0] * sign[0], self.push[1] - self.dry[1] * sign[1]];
        let inverse = 1.0 / (self.diagonal[0] * self.diagonal[1] - self.off_diagonal * self.off_diagonal);
        [
            (self.diagonal[1] * push[0] - self.off_diagonal * push[1]) * inverse,
            (self.diagonal[0] * push[1] - self.off_diagonal * push[0]) * inverse,
        ]
    }

    #[inline(never)]
    fn velocities_of_any_case(&self) -> [f64; 2] {
        if self.push[0].abs() <= self.dry[0] && self.push[1].abs() <= self.dry[1] {
            return [0.0, 0.0];
        }
        for sign in [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]] {
            let after = self.sliding(sign);
            let agrees = |side: usize| self.dry[side] == 0.0 || after[side] * sign[side] > 0.0;
            if agrees(0) && agrees(1) {
                return after;
            }
        }
        // One side is held. If neither case is free of contradiction to the last bit, both are at its edge.
        let output = self.shrink(1, self.push[1]);
        if (self.push[0] - self.off_diagonal * output).abs() <= self.dry[0] {
            [0.0, output]
        } else {
            [self.shrink(0, self.push[0]), 0.0]
        }
    }

    /// Velocity of one side while the other stands still.
    #[inline]
    fn shrink(&self, side: usize, push: f64) -> f64 {
        (push.abs() - self.dry[side]).max(0.0).copysign(push) / self.diagonal[side]
    }
}

//! Two wheels side by side and a body on them: a mobile base, with its true pose.
//!
//! ```text
//! v = (u_l + u_r) / 2        w = (u_r - u_l) / base            u: velocity of the ground under each wheel, seen from the body
//! m dv/dt = F_l + F_r - rolling - m g sin(slope) cos(heading - uphill)
//! I dw/dt = (F_r - F_l) base / 2 - rolling
//! J dw_i/dt = torque - r F_i - friction of motor i
//! ```
//!
//! Between wheel and ground is dry friction: without slip both have the same velocity, and the ground gives what force that
//! takes, up to the grip times the weight on the wheel; beyond, the wheel slips and gets just that. Which wheel slips is decided
//! anew in each step, so that one that slipped grips again when it can.
//!
//! Assumed: the centre of mass is above the axle, casters have no friction, wheels do not slip sideways, and the weight does not
//! shift to the lower wheel.

#![expect(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use super::friction::{MOST, System};
use crate::attachment::GRAVITY_M_S2;
use crate::shaft::{Motion, Push};

/// Each wheel has three cases; more tries than all of them are for nothing.
const MOST_TRIES: usize = 9;

/// What never changes about the base, or only when the user changes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferentialDriveModel {
    /// Mass of all that moves, kg.
    pub mass_kg: f64,
    /// Inertia about the vertical axis through the middle of the axle, kg·m².
    pub yaw_inertia_kg_m2: f64,
    /// Distance of the wheels, m.
    pub wheel_base_m: f64,
    /// Radius of the wheels, m.
    pub wheel_radius_m: f64,
    /// Rolling resistance over weight.
    pub rolling: f64,
    /// Greatest force along the ground over the weight on a wheel; `None` for wheels that never slip.
    pub grip: Option<f64>,
    /// Share of the weight that is on the two wheels; casters have the rest.
    pub weight_share: f64,
    /// Slope of the ground, rad.
    pub slope_rad: f64,
    /// Direction in which it rises, rad from the x axis.
    pub uphill_rad: f64,
}

/// Its state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DifferentialDriveData {
    /// Place of the middle of the axle along x, m.
    pub x_m: f64,
    /// And along y.
    pub y_m: f64,
    /// Direction, rad from the x axis towards the y axis; not wrapped.
    pub heading_rad: f64,
    /// Velocity of the ground under the left and the right wheel, m/s.
    pub ground_m_s: [f64; 2],
    /// How far each wheel has turned beyond the ground under it, m.
    pub slip_m: [f64; 2],
    /// The wheel slipped in the last step.
    pub slips: [bool; 2],
}

impl DifferentialDriveModel {
    /// Velocity along the heading, m/s.
    pub fn speed_m_s(&self, data: &DifferentialDriveData) -> f64 {
        0.5 * (data.ground_m_s[0] + data.ground_m_s[1])
    }

    /// Rate of the heading, rad/s.
    pub fn yaw_rate_rad_s(&self, data: &DifferentialDriveData) -> f64 {
        (data.ground_m_s[1] - data.ground_m_s[0]) / self.wheel_base_m
    }

    /// Weight on each wheel, N.
    fn wheel_n(&self) -> f64 {
        0.5 * self.weight_share * self.mass_kg * GRAVITY_M_S2 * libm::cos(self.slope_rad)
    }

    pub(super) fn step(&self, data: &mut DifferentialDriveData, dt_s: f64, pushes: [Push; 2]) -> [Motion; 2] {
        let step = StepInput::new(self, data, dt_s, pushes);
        let limit_n = self.grip.map_or(f64::INFINITY, |grip| grip * self.wheel_n());
        let mut slip_n = [None; 2];
        let mut tried = step.attempt(slip_n);
        for _ in 1..MOST_TRIES {
            let next = [0, 1].map(|i| match slip_n[i] {
                None if tried.contact_n[i].abs() > limit_n => Some(limit_n.copysign(tried.contact_n[i])),
                // It would have been overtaken by the ground: it grips.
                Some(force_n) if tried.rim_ahead_m_s[i] * force_n < 0.0 => None,
                same => same,
            });
            if next == slip_n {
                break;
            }
            slip_n = next;
            tried = step.attempt(slip_n);
        }
        self.finish(data, dt_s, &step, &tried, slip_n.map(|force_n| force_n.is_some()));
        tried.motions
    }

    fn finish(
        &self,
        data: &mut DifferentialDriveData,
        dt_s: f64,
        step: &StepInput<'_>,
        tried: &Tried,
        slips: [bool; 2],
    ) {
        let mean = [0, 1].map(|i| 0.5 * (step.before_m_s[i] + tried.ground_m_s[i]));
        let (speed, yaw_rate) = (0.5 * (mean[0] + mean[1]), (mean[1] - mean[0]) / self.wheel_base_m);
        // A step is an arc; its chord points along the heading in its middle.
        let half_turn = 0.5 * yaw_rate * dt_s;
        let chord_m = speed * dt_s * (1.0 - half_turn * half_turn / 6.0);
        let heading = data.heading_rad + half_turn;
        data.x_m += chord_m * libm::cos(heading);
        data.y_m += chord_m * libm::sin(heading);
        data.heading_rad += yaw_rate * dt_s;
        for i in 0..2 {
            if slips[i] {
                data.slip_m[i] += (tried.motions[i].mean_rad_s * self.wheel_radius_m - mean[i]) * dt_s;
            }
        }
        (data.ground_m_s, data.slips) = (tried.ground_m_s, slips);
    }
}

/// What is the same in all attempts at one step.
struct StepInput<'a> {
    model: &'a DifferentialDriveModel,
    pushes: [Push; 2],
    before_m_s: [f64; 2],
    /// Velocity of the rims.
    rim_m_s: [f64; 2],
    /// Mass of the body as each wheel feels it, and as one feels it at the other.
    own_kg: f64,
    cross_kg: f64,
    /// Force on the body at each wheel that is not the wheel's.
    outside_n: f64,
    rolling_n: f64,
    dt_s: f64,
}

/// How the base moves if its wheels slip or do not.
struct Tried {
    ground_m_s: [f64; 2],
    /// How much faster than the ground each rim is after the step.
    rim_ahead_m_s: [f64; 2],
    /// Force of the ground on each wheel, along the heading.
    contact_n: [f64; 2],
    motions: [Motion; 2],
}

impl<'a> StepInput<'a> {
    fn new(model: &'a DifferentialDriveModel, data: &DifferentialDriveData, dt_s: f64, pushes: [Push; 2]) -> Self {
        let (half, spin) = (0.25 * model.mass_kg, model.yaw_inertia_kg_m2 / model.wheel_base_m / model.wheel_base_m);
        let downhill_n = if model.slope_rad == 0.0 {
            0.0
        } else {
            let steep = libm::sin(model.slope_rad) * libm::cos(data.heading_rad - model.uphill_rad);
            -model.mass_kg * GRAVITY_M_S2 * steep
        };
        Self {
            model,
            pushes,
            before_m_s: data.ground_m_s,
            rim_m_s: pushes.map(|push| push.velocity_rad_s * model.wheel_radius_m),
            own_kg: half + spin,
            cross_kg: half - spin,
            outside_n: 0.5 * downhill_n,
            rolling_n: 0.5 * model.rolling * model.mass_kg * GRAVITY_M_S2 * libm::cos(model.slope_rad),
            dt_s,
        }
    }

    /// The step with the wheels that have a force slipping under it, and the others gripping.
    fn attempt(&self, slip_n: [Option<f64>; 2]) -> Tried {
        let radius = self.model.wheel_radius_m;
        let mut system = System::new(2);
        for i in 0..2 {
            let (own, other) = (self.before_m_s[i], self.before_m_s[1 - i]);
            system.matrix[i][1 - i] = self.cross_kg / self.dt_s;
            system.matrix[i][i] = self.own_kg / self.dt_s;
            system.push[i] = (self.own_kg * own + self.cross_kg * other) / self.dt_s + self.outside_n;
            system.dry[i] = self.rolling_n;
            match slip_n[i] {
                Some(force_n) => system.push[i] += force_n,
                None => {
                    let (kg, kg_s) = self.wheel(i);
                    system.matrix[i][i] += kg / self.dt_s + 0.5 * kg_s;
                    system.push[i] +=
                        self.pushes[i].torque_nm / radius + (kg / self.dt_s - 0.5 * kg_s) * self.rim_m_s[i];
                    system.dry[i] += self.pushes[i].dry_nm / radius;
                }
            }
        }
        let mut before = [0.0; MOST];
        (before[0], before[1]) = (self.before_m_s[0], self.before_m_s[1]);
        let after = system.velocities(&before);
        let friction_n = system.friction(&after);
        let wheels = [0, 1].map(|i| match slip_n[i] {
            Some(force_n) => self.slipping(i, force_n),
            None => {
                let own = self.pushes[i].dry_nm / radius;
                let share = if system.dry[i] > 0.0 { own / system.dry[i] } else { 0.0 };
                self.gripping(i, after[i], friction_n[i] * share)
            }
        });
        Tried {
            ground_m_s: [after[0], after[1]],
            rim_ahead_m_s: [0, 1].map(|i| wheels[i].0.velocity_rad_s * radius - after[i]),
            contact_n: wheels.map(|(_, contact_n)| contact_n),
            motions: wheels.map(|(motion, _)| motion),
        }
    }

    /// Inertia and viscous friction of a wheel at its rim, kg and kg/s.
    fn wheel(&self, i: usize) -> (f64, f64) {
        let square = self.model.wheel_radius_m * self.model.wheel_radius_m;
        (self.pushes[i].inertia_kg_m2 / square, self.pushes[i].viscous_nm_s / square)
    }

    /// A wheel that goes with the ground: its motion, and the force that the ground gives for that.
    fn gripping(&self, i: usize, after_m_s: f64, bearing_n: f64) -> (Motion, f64) {
        let radius = self.model.wheel_radius_m;
        let (kg, kg_s) = self.wheel(i);
        let mean = 0.5 * (self.rim_m_s[i] + after_m_s);
        let gained_n = kg * (after_m_s - self.rim_m_s[i]) / self.dt_s;
        let contact_n = self.pushes[i].torque_nm / radius - kg_s * mean - bearing_n - gained_n;
        let dry_nm = bearing_n * radius;
        (Motion { velocity_rad_s: after_m_s / radius, mean_rad_s: mean / radius, dry_nm }, contact_n)
    }

    /// A wheel that turns on its own against this force.
    fn slipping(&self, i: usize, contact_n: f64) -> (Motion, f64) {
        let Push { torque_nm, inertia_kg_m2, dry_nm, viscous_nm_s, velocity_rad_s: before, .. } = self.pushes[i];
        let mut system = System::new(1);
        system.matrix[0][0] = inertia_kg_m2 / self.dt_s + 0.5 * viscous_nm_s;
        system.push[0] = torque_nm - contact_n * self.model.wheel_radius_m
            + (inertia_kg_m2 / self.dt_s - 0.5 * viscous_nm_s) * before;
        system.dry[0] = dry_nm;
        let mut was = [0.0; MOST];
        was[0] = before;
        let after = system.velocities(&was);
        let motion = Motion {
            velocity_rad_s: after[0],
            mean_rad_s: 0.5 * (before + after[0]),
            dry_nm: system.friction(&after)[0],
        };
        (motion, contact_n)
    }
}

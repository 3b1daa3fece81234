//! Machines that several motors move together: two wheels and a body, motors on one shaft, a serial arm, and what a physics engine moves.
//!
//! Each motor says what it does to its shaft in a step ([`Push`]); the machine moves all its coordinates together, and says what
//! became of each shaft ([`Motion`]). The shafts are stiff: a coordinate is a motor's angle times a fixed number of turns. All dry
//! friction is solved for at once ([`friction`]), so that a machine at rest under less than its friction stays where it is to
//! the last bit.

pub mod arm;
pub mod common_shaft;
pub mod differential_drive;
pub mod external;
pub mod friction;
mod vector;

use crate::shaft::{Motion, Push};
pub use arm::{ArmData, ArmModel, Link};
pub use common_shaft::{CommonShaftData, CommonShaftModel};
pub use differential_drive::{DifferentialDriveData, DifferentialDriveModel};
pub use external::{ExternalData, ExternalModel, Rule};
pub use friction::MOST;

/// A machine and its state.
// One of them is made for each machine of a world, and none is copied in a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// Two wheels, left and right, and a body on them.
    DifferentialDrive(DifferentialDriveModel, DifferentialDriveData),
    /// Any number of motors on one shaft.
    CommonShaft(CommonShaftModel, CommonShaftData),
    /// A motor for each joint, from the base on.
    Arm(ArmModel, ArmData),
    /// Shafts that a physics engine moves, each for itself.
    External(ExternalModel, ExternalData),
}

impl Body {
    /// How many motors it takes: the least, and the most.
    pub fn motors(&self) -> (usize, usize) {
        match self {
            Self::DifferentialDrive(..) => (2, 2),
            Self::CommonShaft(..) => (2, MOST),
            Self::Arm(model, _) => (model.links().len(), model.links().len()),
            Self::External(model, _) => (model.count(), model.count()),
        }
    }

    /// One step of `dt_s`. `turns` are the turns of each coordinate per turn of its motor, signed and not zero; `pushes` and
    /// `motions` are the motors' in the same order, at most [`MOST`].
    pub fn step(&mut self, dt_s: f64, turns: &[f64], pushes: &[Push], motions: &mut [Motion]) {
        let mut seen = [Push::default(); MOST];
        for ((seen, push), turns) in seen.iter_mut().zip(pushes).zip(turns) {
            *seen = push.seen_through(*turns);
        }
        let seen = &seen[..pushes.len().min(MOST)];
        let moved = match self {
            Self::DifferentialDrive(model, data) => match *seen {
                [left, right, ..] => {
                    let [left, right] = model.step(data, dt_s, [left, right]);
                    let mut moved = [Motion::default(); MOST];
                    (moved[0], moved[1]) = (left, right);
                    moved
                }
                _ => return,
            },
            Self::CommonShaft(model, data) => model.step(data, dt_s, seen),
            Self::Arm(model, data) => model.step(data, dt_s, seen),
            Self::External(model, data) => model.step(data, dt_s, seen),
        };
        for ((motion, moved), turns) in motions.iter_mut().zip(moved).zip(turns) {
            *motion = moved.felt_through(*turns);
        }
    }
}

impl Push {
    /// The same at a coordinate that makes `turns` per turn of the motor.
    fn seen_through(&self, turns: f64) -> Self {
        let inverse = 1.0 / turns;
        Self {
            velocity_rad_s: self.velocity_rad_s * turns,
            torque_nm: self.torque_nm * inverse,
            inertia_kg_m2: self.inertia_kg_m2 * inverse * inverse,
            dry_nm: self.dry_nm * inverse.abs(),
            viscous_nm_s: self.viscous_nm_s * inverse * inverse,
        }
    }
}

impl Motion {
    /// The motion of the motor, from that of a coordinate that makes `turns` per turn of the motor.
    fn felt_through(&self, turns: f64) -> Self {
        Self {
            velocity_rad_s: self.velocity_rad_s / turns,
            mean_rad_s: self.mean_rad_s / turns,
            dry_nm: self.dry_nm * turns,
        }
    }
}

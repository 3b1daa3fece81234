//! One machine that several drives move together, and its control periods.

use can::Instant;
use devices::AxisId;
use plant::coupled::Body;
use plant::shaft::{Motion, Push};

use super::member::Member;
use crate::mechanics::Mechanics;

/// A machine and the drives that move it.
#[derive(Clone)]
pub(super) struct CoupledBody {
    pub(super) name: String,
    pub(super) body: Body,
    pub(super) shafts: Vec<Shaft>,
    /// Turns of each coordinate per turn of its motor.
    pub(super) turns: Vec<f64>,
    /// What the motors did in the last period, and what came of it: kept to be used again.
    pub(super) pushes: Vec<Push>,
    pub(super) motions: Vec<Motion>,
    /// The drives, each once.
    pub(super) stations: Vec<usize>,
    pub(super) next: Instant,
    pub(super) period_ns: u64,
}

#[derive(Clone, Copy)]
pub(super) struct Shaft {
    pub(super) station: usize,
    pub(super) axis: AxisId,
}

impl CoupledBody {
    /// One control period of all its drives, and the motion that comes of it.
    pub(super) fn run_period(&mut self, members: &mut [Member]) {
        for station in &self.stations {
            if let Some(mechanics) = mechanics(&mut members[*station]) {
                mechanics.run_period();
            }
        }
        for (i, shaft) in self.shafts.iter().enumerate() {
            // A drive that was taken away leaves its shaft behind, without torque.
            self.pushes[i] = match mechanics(&mut members[shaft.station]) {
                Some(mechanics) => mechanics.push(shaft.axis),
                None => {
                    let velocity_rad_s = self.motions[i].velocity_rad_s;
                    Push { torque_nm: 0.0, dry_nm: 0.0, viscous_nm_s: 0.0, velocity_rad_s, ..self.pushes[i] }
                }
            };
        }
        let dt_s = self.period_ns as f64 * 1e-9;
        self.body.step(dt_s, &self.turns, &self.pushes, &mut self.motions);
        for (shaft, motion) in self.shafts.iter().zip(&self.motions) {
            if let Some(mechanics) = mechanics(&mut members[shaft.station]) {
                mechanics.follow(shaft.axis, motion);
            }
        }
        self.next = self.next.plus_nanos(self.period_ns);
    }

    /// Where it is, as bits for a digest.
    pub(super) fn bits(&self) -> Vec<u64> {
        match &self.body {
            Body::DifferentialDrive(_, data) => [data.x_m, data.y_m, data.heading_rad].map(f64::to_bits).to_vec(),
            Body::CommonShaft(_, data) => vec![data.angle.as_turns().to_bits()],
            Body::Arm(_, data) => data.angle_rad.iter().map(|rad| rad.to_bits()).collect(),
            Body::External(model, data) => (0..model.count()).map(|joint| data.shaft(joint).0.to_bits()).collect(),
        }
    }
}

fn mechanics(member: &mut Member) -> Option<&mut dyn Mechanics> {
    match member {
        Member::Drive { drive, .. } => drive.mechanics(),
        _ => None,
    }
}

//! One machine that several drives move together, and its control periods.

use can::Instant;
use devices::AxisId;
use plant::coupled::Body;
use plant::shaft::{Motion, Push};

use super::member::Member;
use crate::VirtualDrive;
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
    /// A machine without drives, whose first control period begins at the first of `period`; it takes `count` shafts.
    pub(super) fn new(name: &str, body: Body, period: (Instant, u64), count: usize) -> Self {
        Self {
            name: name.to_owned(),
            body,
            shafts: Vec::new(),
            turns: Vec::new(),
            pushes: vec![Push::default(); count],
            motions: vec![Motion::default(); count],
            stations: Vec::new(),
            next: period.0,
            period_ns: period.1,
        }
    }

    /// The next shaft; `turns` of its coordinate per turn of its motor.
    pub(super) fn join(&mut self, shaft: Shaft, turns: f64) {
        self.turns.push(turns);
        self.shafts.push(shaft);
        if !self.stations.contains(&shaft.station) {
            self.stations.push(shaft.station);
        }
    }

    /// All control periods that begin up to `now`.
    pub(super) fn bring_up(&mut self, drives: &mut (impl Drives + ?Sized), now: Instant) {
        while self.next <= now {
            self.run_period(drives);
        }
    }

    /// One control period of all its drives, and the motion that comes of it.
    fn run_period(&mut self, drives: &mut (impl Drives + ?Sized)) {
        for station in &self.stations {
            if let Some(mechanics) = drives.mechanics(*station) {
                mechanics.run_period();
            }
        }
        for (i, shaft) in self.shafts.iter().enumerate() {
            // A drive that was taken away leaves its shaft behind, without torque.
            self.pushes[i] = match drives.mechanics(shaft.station) {
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
            if let Some(mechanics) = drives.mechanics(shaft.station) {
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

/// Where a machine finds its drives.
pub(super) trait Drives {
    /// The mechanics of the drive that is this station; `None` where there is none.
    fn mechanics(&mut self, station: usize) -> Option<&mut dyn Mechanics>;
}

impl Drives for [Member] {
    #[inline]
    fn mechanics(&mut self, station: usize) -> Option<&mut dyn Mechanics> {
        match &mut self[station] {
            Member::Drive { drive, .. } => drive.mechanics(),
            _ => None,
        }
    }
}

/// A drive that is in no world.
impl Drives for dyn VirtualDrive + '_ {
    fn mechanics(&mut self, _: usize) -> Option<&mut dyn Mechanics> {
        VirtualDrive::mechanics(self)
    }
}

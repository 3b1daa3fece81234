//! The twin of a stepper: its rotor is known, so that lost steps are seen.

use std::time::Duration;

use canopen::Mux;
use devices::Description;
use master::MotionOptions;
use master::units::Rpm;
use serde::Serialize;
use sim::{Fidelity, Stimulus, World};
use tune::Turned;
use words::failure::Failure;

use super::bench::write;
use super::twin::{NODE, bring_about, world_of};

/// How long it boots, and how long it is looked at after each ramp.
const BOOT: Duration = Duration::from_secs(1);
const STEADY: Duration = Duration::from_millis(300);

/// The twin, up to the speed and back in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TwinRow {
    /// How many times all that it turns was as large.
    pub load: f64,
    /// Full steps by which its rotor slipped, all ramps together; `None` where the drive stopped with a fault, such as that of a
    /// weight that falls and charges its bus.
    pub lost_steps: Option<u64>,
}

impl std::fmt::Display for TwinRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.lost_steps {
            Some(steps) => write!(f, "{steps} full steps lost with {:.2} times the load", self.load),
            None => write!(f, "a fault with {:.2} times the load", self.load),
        }
    }
}

/// A stepper with what it turns, and values of its objects.
pub(super) struct Rotor {
    pub model: &'static Description,
    pub values: Vec<(Mux, i64)>,
    pub rotor: sim::RotorModel,
    pub all: Turned,
    pub supply_v: f64,
    pub speed_rpm: f64,
    pub ramp: Duration,
    pub pulses: u16,
    pub teeth: u32,
}

impl Rotor {
    /// Up to its speed and back in both directions, with all that it turns so many times as large.
    pub(super) async fn turned(&self, load: f64) -> Result<TwinRow, Failure> {
        let failed = |reason: &dyn std::fmt::Display| {
            Failure::new(format!("the twin of a {}, not the drive, failed its trial", self.model.title)).because(reason)
        };
        let all = self.all.times(load);
        let words = [
            format!("supply {}", self.supply_v),
            format!("load inertia {}", all.inertia_kg_m2 - self.rotor.inertia_kg_m2),
            format!(
                "load friction {} viscous {}",
                all.dry_nm - self.rotor.coulomb_nm,
                all.viscous_nm_s - self.rotor.viscous_nm_s
            ),
        ];
        let (mut world, drive) = world_of(self.model, (Fidelity::Full, None), &words)?;
        sim::pass_beside(&mut world, BOOT).await;
        let begin = async {
            for (object, value) in &self.values {
                write(&drive, *object, *value).await?;
            }
            drive.enable().await.map_err(Failure::from)
        };
        sim::run_beside(&mut world, begin).await.map_err(|error| failed(&error))??;
        sim::pass_beside(&mut world, STEADY).await;
        let before = self.ahead(&mut world)?;
        // Held by now: a free shaft would fall.
        bring_about(&mut world, &Stimulus::LoadTorque(all.load_nm)).map_err(|reason| failed(&reason))?;
        let (mut slipped, mut lost_steps) = (0, 0);
        for speed_rpm in [self.speed_rpm, 0.0, -self.speed_rpm, 0.0] {
            let turn = drive.velocity(Rpm(speed_rpm), MotionOptions { wait: false, ..MotionOptions::default() });
            let turned = sim::run_beside(&mut world, turn).await.map_err(|error| failed(&error))?;
            sim::pass_beside(&mut world, self.ramp + STEADY).await;
            let report = world.report(NODE.raw()).map_err(|error| failed(&error))?;
            if report.error_code != 0 {
                return Ok(TwinRow { load, lost_steps: None });
            }
            turned?;
            let now = self.slipped_turns(self.ahead(&mut world)? - before);
            // What is lost on one way may be won on the other.
            lost_steps += 4 * now.abs_diff(slipped);
            slipped = now;
        }
        Ok(TwinRow { load, lost_steps: Some(lost_steps) })
    }

    /// A rotor slips by whole electrical turns of four full steps; by less than half of one it is turned by its load.
    fn slipped_turns(&self, pulses: i64) -> i64 {
        (pulses as f64 * f64::from(self.teeth) / f64::from(self.pulses)).round() as i64
    }

    /// By how many pulses the rotor is ahead of where the drive says.
    fn ahead(&self, world: &mut World) -> Result<i64, Failure> {
        let report = world.report(NODE.raw()).map_err(|error| Failure::new(error.to_string()))?;
        let rotor = report.rotor_position.ok_or_else(|| Failure::new("the twin does not know where its rotor is"))?;
        Ok(rotor - report.position)
    }
}

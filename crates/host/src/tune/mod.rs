//! Finding gains for a drive's loops: it is measured, a twin of it is made, gains are proposed and tried on the twin, and then on
//! the drive (crate `tune` has the mathematics).
//!
//! In: a drive of a model whose description says how its loops are set ([`devices::Loops`]), and [`Bounds`] that its motion keeps to.
//! Everything moves by [`master::cyclic::CyclicDrive`], so that what stops such a motion stops this one. What is written for the
//! measurement is put back at its end, however it ends; where the program dies, by the journal.

mod found;
mod measure;
mod proposed;
mod report;
mod setup;
mod twin;

pub use found::Found;
pub use measure::{Bench, Bounds, Measurement, StepResponse};
pub use proposed::{Gain, Proposed};
pub use report::{GainRow, MarginRow, Request, TuneReport, find, step};
pub use setup::Setup;
pub use twin::{Trial, Twin, motor_of};

use std::time::Duration;

use devices::{Description, Loops};
use master::Drive;
use master::cyclic::CyclicOptions;
use words::failure::Failure;

/// How often gains are halved before a speed loop that swings is given up, and what is left of them then.
const HALVINGS: u32 = 4;
const LEAST_SHARE: f64 = 1.0 / 16.0;

/// How a drive's loops are set, or why nothing of it can be tuned, and what would be possible instead.
///
/// # Errors
/// Its model is not known, or has no gains.
pub fn loops_of(drive: &Drive) -> Result<(&'static Description, &'static Loops), Failure> {
    let id = drive.node().id();
    let model = drive.description().ok_or_else(|| {
        Failure::new(format!("node {id}: the model is not known"))
            .at_node(id)
            .next(format!("ferrodrive scan; then --model {id}=MODEL"))
    })?;
    let axis = model.axes.get(usize::from(drive.axis_id().0)).or(model.axes.first());
    axis.and_then(|axis| axis.loops.as_ref()).map(|loops| (model, loops)).ok_or_else(|| {
        Failure::new(format!("node {id}: of the {} it is not known how its loops are set", model.title))
            .at_node(id)
            .of_kind("no_gains")
            .because("its description names no gains of a speed loop with an object that shows the current that it asks for")
            .next("ferrodrive objects MODEL lists what can be set by hand; a stepper has ramps and currents instead of gains")
    })
}

/// Measures a drive, and puts back what was written for that, however it ends. Gains with which the speed loop swings by itself
/// are halved meanwhile.
///
/// # Errors
/// What stopped it; that not everything could be put back.
pub async fn measure(
    drive: &Drive,
    setup: &Setup,
    loops: &Loops,
    (period, bounds, options): (Duration, Bounds, CyclicOptions),
) -> Result<Measurement, Failure> {
    let mut share = 1.0;
    for _ in 0..=HALVINGS {
        lower(drive, setup, loops, share).await?;
        let mut bench = Bench::open(drive, loops, period, bounds, options).await?;
        bench.gain_share = share;
        let swings = bench.swings().await;
        let measured = match swings {
            Ok(false) => match bench.measure().await {
                // With lower gains the same speeds take less.
                Err(failure) if failure.kind == measure::TOO_MUCH_CURRENT && share > LEAST_SHARE => Ok(None),
                measured => measured.map(Some),
            },
            Ok(true) => Ok(None),
            Err(failure) => Err(failure),
        };
        let stopped = bench.stop().await;
        if let Some(measurement) = measured? {
            stopped?;
            return Ok(measurement);
        }
        stopped?;
        share *= 0.5;
    }
    let id = drive.node().id();
    Err(Failure::new(format!("node {id}: its speed loop swings by itself, even with a sixteenth of its gains"))
        .at_node(id)
        .next("look for a loose coupling or a wrong number of encoder lines"))
}

/// Both gains of the speed loop at this share of what they were.
async fn lower(drive: &Drive, setup: &Setup, loops: &Loops, share: f64) -> Result<(), Failure> {
    for object in [loops.speed_proportional, loops.speed_integral.object()] {
        if share < 1.0
            && let Some(had) = setup.had(object)
        {
            measure::write(drive, object, (had as f64 * share).round() as i64).await?;
        }
    }
    Ok(())
}

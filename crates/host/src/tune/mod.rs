//! Finding gains for a drive's loops: it is measured, a twin of it is made, gains are proposed and tried on the twin, and then on
//! the drive (crate `tune` has the mathematics).
//!
//! Where no object shows what the speed loop asks for (a joint), the drive turns by its own ramps, is read by SDO, and its twin's load
//! is changed until both show the same currents.
//!
//! In: a drive of a model whose description says how its loops are set ([`devices::Loops`]), and [`Bounds`] that its motion keeps to.
//! Everything moves by [`master::cyclic::CyclicDrive`] or [`Drive::velocity`], so that what stops such a motion stops this one. What is written for the
//! measurement is put back at its end, however it ends; where the program dies, by the journal.

mod applied;
mod bench;
mod commanded;
mod curves;
mod found;
mod gaps;
mod line;
mod measure;
mod moves;
mod of_capture;
mod order;
mod outcome;
mod proposed;
mod ramps;
mod ramps_twin;
mod readings;
mod report;
mod sampled;
mod setup;
mod twin;

pub use ::tune::Objective;
pub use applied::{move_there_and_back, step, try_gains, tune};
pub use bench::{Bench, Bounds, Excursion, Measurement, StepResponse};
pub use curves::{Curves, GainAndPhase, ResponseRow};
pub use found::Found;
pub use line::TuneLine;
pub use measure::measure;
pub use moves::MoveRow;
pub use of_capture::{CaptureReport, of_capture};
pub use order::{LoadOrder, Order};
pub(crate) use outcome::{TuneOutcome, Tuned};
pub use proposed::{Gain, Proposed, Unreachable};
pub use ramps::{RampReport, RampRequest, open_loop_of, tune_ramps};
pub use ramps_twin::TwinRow;
pub use readings::{Currents, OutputLoad, Reader, Shaft};
pub use report::{GainRow, MarginRow, Request, SAMPLE_PERIODS, TuneReport, find};
pub use setup::{Setup, speed_gains};
pub use twin::{Trial, Twin, constant_of, motor_of};

use devices::{Description, Loops};
use master::Drive;
use words::failure::Failure;

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
            .because("its description names no gains of a speed loop")
            .next("of a servo by CiA 402 `loops` of its [[drive]] in a machine file names the objects of its gains (docs/machine-file.md); a stepper has ramps and currents instead of gains")
    })
}

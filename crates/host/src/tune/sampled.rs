//! What was measured, less what seldom sampling does to it.
//!
//! A current is seen when SYNC comes, just before the next set-point takes effect, and not between. A speed loop answers to the step of
//! a set-point by a current that has fallen again by then: where samples are far apart against that, the mean is more than what is seen,
//! and inertia and gains come out too small by the same share. The twin is sampled alike, and its inertia is known.

use std::time::Duration;

use devices::{Description, Loops};
use sim::MotorData;
use tune::Mechanics;
use words::failure::Failure;

use super::bench::{Bounds, Measurement};
use super::found::Found;
use super::setup::Setup;
use super::twin::Twin;

/// Less than that is within what inertia is found to in any case.
const BEGINS: f64 = 0.04;
/// The twin is like the drive when it seems to have the same inertia but for this share.
const ALIKE: f64 = 0.02;
/// How often the twin is made anew.
const MOST: usize = 5;
/// Its inertia is four times what it seems at most.
const MOST_LOG: f64 = 2.0 * std::f64::consts::LN_2;

/// A drive, and the twin that answers as it does.
pub(super) struct Sampled {
    pub(super) found: Found,
    pub(super) twin: Twin,
    /// The answer of the twin.
    pub(super) of_twin: Measurement,
    /// What the drive seems to be by its samples.
    pub(super) seems: Mechanics,
}

/// Finds what a drive is from what was measured.
///
/// # Errors
/// Nothing can be said of it, or the twin cannot be made.
pub(super) async fn find(
    (model, loops): (&'static Description, &Loops),
    (measured, had): (&Measurement, &Setup),
    (motor, constant, own): (&MotorData, f64, f64),
    (period, bounds): (Duration, Bounds),
    failed: impl Fn(&dyn std::fmt::Display) -> Failure,
) -> Result<Sampled, Failure> {
    let first = Found::of(measured, had, loops, (motor, constant)).map_err(|error| failed(&error))?;
    let lowered = had.lowered(measured.gain_share);
    // By its logarithm: what is to become 0, and where, the last time.
    let (mut log, mut before) = (0.0_f64, None::<(f64, f64)>);
    let mut made = 0;
    loop {
        let found = first.scaled(log.exp());
        let twin = Twin::new((model, loops), &found, (motor, own), had.gains(loops));
        let of_twin = twin.measure(&lowered, (period, bounds)).await?;
        made += 1;
        // The twin's torque per ampere is its own. Of one that cannot be found the drive's is all that there is.
        let seems = Found::of(&of_twin, had, loops, (motor, own));
        let off = seems.map_or(0.0, |found| (found.mechanics.gain / first.mechanics.gain).ln());
        let alike = if before.is_none() { BEGINS } else { ALIKE };
        // The secant; at first as if the share were the same whatever the inertia is.
        let slope = before.map_or(-1.0, |(log_before, off_before)| (off - off_before) / (log - log_before));
        let next = (log - off / slope).clamp(-MOST_LOG, MOST_LOG);
        // At its bound nothing more can be found; nor from a gain that has no logarithm.
        let is_last = made == MOST || next == log || !next.is_finite();
        if off.abs() < alike || is_last {
            return Ok(Sampled { found, twin, of_twin, seems: first.plant });
        }
        (before, log) = (Some((log, off)), next);
    }
}

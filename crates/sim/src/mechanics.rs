//! What a machine that several drives move needs of each of them.

use can::Instant;
use devices::AxisId;
use plant::shaft::{Motion, Push};

use crate::refused::Refused;

/// The half of a drive that a coupled machine needs: what its motors do to their shafts, and how these move.
pub trait Mechanics {
    /// Hands the shaft of an axis over, for ever. Turns of the output shaft per turn of the motor.
    ///
    /// # Errors
    /// [`Refused`] with what is in the way; nothing is changed then.
    fn couple(&mut self, axis: AxisId) -> Result<f64, Refused>;

    /// When the next control period begins, and how long it is, ns.
    fn next_period(&self) -> (Instant, u64);

    /// One control period, but for the motion of coupled shafts.
    fn run_period(&mut self);

    /// What the motor of a coupled axis does to its shaft in that period.
    fn push(&self, axis: AxisId) -> Push;

    /// Ends the period of a coupled axis.
    fn follow(&mut self, axis: AxisId, motion: &Motion);
}

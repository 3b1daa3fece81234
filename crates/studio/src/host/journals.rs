//! What outlives this program if it dies in the middle of a transaction.

use canopen::NodeId;
use testbench::parameters::journal::Journal;

/// Where what leads back from a transaction is kept until it has come to its end, so that a death of this program loses nothing.
pub trait Journals: core::fmt::Debug + Send + Sync {
    /// Keeps it, onto the disk itself, before the first write.
    ///
    /// # Errors
    /// That it cannot be kept, for people.
    fn begin(&self, journal: &Journal) -> Result<(), String>;

    /// The transaction has come to its end: the drive is as it should be, or as it was.
    ///
    /// # Errors
    /// That it is still there, for people.
    fn end(&self, node: NodeId) -> Result<(), String>;
}

//! Rollback journals, which outlive this program if it dies during a transaction.

use canopen::NodeId;
use machine::parameters::journal::Journal;

/// Rollback journals of open transactions, so that the values before are not lost if this program dies.
pub trait Journals: core::fmt::Debug + Send + Sync {
    /// Saves a journal, synchronised to the disk, before the first write.
    ///
    /// # Errors
    /// Why it cannot be saved, for people.
    fn begin(&self, journal: &Journal) -> Result<(), String>;

    /// The transaction has ended: the drive has the new values, or the old ones.
    ///
    /// # Errors
    /// Why it could not be deleted, for people.
    fn end(&self, node: NodeId) -> Result<(), String>;
}

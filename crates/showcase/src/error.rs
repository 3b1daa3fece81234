//! What can keep the showcase from running.

/// Why there is nothing to see.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A virtual drive cannot be had.
    #[error(transparent)]
    Order(#[from] sim::machine::OrderError),
    /// It cannot be put on the virtual bus.
    #[error(transparent)]
    World(#[from] sim::WorldError),
}

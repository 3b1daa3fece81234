//! What a PDO was before it was set up otherwise, and how it becomes that again.

use canopen::{CobId, Mux};

use super::config::PdoConfig;

/// One write with its name for people.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NamedWrite {
    pub step: &'static str,
    pub mux: Mux,
    pub raw: u32,
    pub bytes: usize,
}

/// What a PDO was before, to go back to.
#[derive(Clone, Debug)]
pub(crate) struct Before {
    /// Invalid where it was switched off.
    pub cob_id: CobId,
    /// Its mapping, the clearing first, then its parameters.
    pub writes: Vec<NamedWrite>,
}

/// A PDO before a motion for which it is set up otherwise.
#[derive(Clone, Debug)]
pub(crate) struct FormerPdo {
    pub config: PdoConfig,
    pub before: Before,
    /// This master sent or received it.
    pub was_used: bool,
}

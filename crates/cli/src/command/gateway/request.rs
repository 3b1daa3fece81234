//! What a client of the gateway asks of the gateway.

use master::core::NodeSet;
use tokio::sync::oneshot;

/// These nodes are about to be moved: answered when they are guarded, as far as they can be.
pub(super) struct Guard(pub(super) NodeSet, pub(super) oneshot::Sender<()>);

/// A client has gone.
pub(super) struct Gone {
    /// What it may have set in motion.
    pub(super) moved: NodeSet,
    /// What it has had guarded.
    pub(super) guarded: NodeSet,
}

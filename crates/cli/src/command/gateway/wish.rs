//! What a client of the gateway asks of the gateway.

use master::core::NodeSet;
use tokio::sync::oneshot;

/// What a client wants of the gateway itself.
pub(super) enum Wish {
    /// These nodes are about to be moved: answered when they are guarded, as far as they can be.
    Guard(NodeSet, oneshot::Sender<()>),
    /// The client has gone, and has moved these.
    Gone(NodeSet),
}

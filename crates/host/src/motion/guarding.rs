//! Every motion is guarded first: a drive that can stops by itself if this program dies. Where nothing stops it, the session that
//! has control has to accept that before the first motion; until then nothing is started.

use canopen::NodeId;
use master::Drive;
use master::drive::SwitchedOff;

use crate::answer::Answer;
use crate::parameters::transactions::Refusal;
use crate::state::Host;
use crate::work::{Asked, refusal_of, send};

/// The kind of the refusal, for programs.
pub(crate) const UNGUARDED: &str = "unguarded";

impl Host {
    /// The session that has control accepts that a drive keeps moving when this program dies.
    pub(crate) fn accept_unguarded(&mut self, node: NodeId, (seq, answer): Asked) {
        let is_drive = self.nodes.get(&node).is_some_and(|node| node.drive.is_some());
        if !is_drive {
            let text = "no drive is known at this node: scan the bus, and check its supply";
            return send(answer, Answer::failed(Some(seq), "no_such_drive", text));
        }
        self.accepted.insert(node);
        send(answer, Answer::done(seq, Vec::new()));
    }

    /// Those of these drives whose loss of the host has not been accepted.
    pub(crate) fn not_accepted(&self, drives: &[Drive]) -> Vec<Drive> {
        drives.iter().filter(|drive| !self.accepted.contains(&drive.node().id())).cloned().collect()
    }
}

/// Guards a drive for a motion.
///
/// # Errors
/// Nothing stops it when this program dies, and that was not accepted; errors of the master.
pub(crate) async fn guard(drive: &Drive, accepted: bool) -> Result<(), Refusal> {
    if !accepted {
        expect_guard(drive).await?;
    }
    drive.guard(SwitchedOff::Leave).await.map(drop).map_err(|error| refusal_of(&error))
}

/// Checks that a guard will stop a drive. Changes nothing.
///
/// # Errors
/// It will not; errors of the master.
pub(crate) async fn expect_guard(drive: &Drive) -> Result<(), Refusal> {
    let loss = drive.host_loss_if_guarded().await.map_err(|error| refusal_of(&error))?;
    match loss.stops_after() {
        Some(_) => Ok(()),
        None => {
            let node = drive.node().id();
            let text =
                format!("node {node} was not moved: if this program dies during the motion, {loss}. Accept that first");
            Err((UNGUARDED, text))
        }
    }
}

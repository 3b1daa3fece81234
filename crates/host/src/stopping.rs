//! What is reported of drives that the program which has moved them lets go of: by a signal, a failure, a client that has gone, a network that
//! is closed. How they are stopped is the master's: [`Network::stop_and_release`] and [`Network::stop_moved`].

use canopen::NodeId;
use master::Network;
use master::drive::{HostLoss, Stopped};

/// What is reported of one drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Account {
    /// The drive.
    pub node: NodeId,
    /// It was seen to stand.
    pub stands: bool,
    /// What was seen of it; of one that may still be moving also what it does by itself.
    pub because: Vec<String>,
}

/// Stops what `network` has set in motion and releases the guards of what stands; `who` lets go of the drives.
pub async fn stop(network: &Network, who: &str) -> Vec<Account> {
    network.stop_and_release().await.iter().map(|stopped| Account::of_stop(stopped, who)).collect()
}

impl Account {
    /// Of a stop; `who` lets go of the drive: "this command".
    pub fn of_stop(stopped: &Stopped, who: &str) -> Self {
        let node = stopped.node;
        match &stopped.outcome {
            Ok(after) => Self {
                node,
                stands: true,
                because: vec![format!(
                    "node {node} was moving and has been quick-stopped: it was seen to stand after {:.2} s",
                    after.as_secs_f64()
                )],
            },
            Err(error) => Self::moving(node, format!("node {node} may still be moving: {error}"), stopped.loss, who),
        }
    }

    /// Of the drives that `network` has set in motion and cannot reach any more, since its bus is lost.
    pub fn of_lost_bus(network: &Network, who: &str) -> Vec<Self> {
        let lost = |node| {
            let text = format!("node {node} may still be moving, and cannot be reached any more: the bus is lost");
            Self::moving(node, text, network.guarded(node), who)
        };
        network.moved().iter().map(lost).collect()
    }

    /// Of the drives whose quick stop was ordered, and of which no more is awaited.
    pub fn of_unawaited(network: &Network, who: &str) -> Vec<Self> {
        let left = |node| {
            let text = format!(
                "node {node} may still be moving: its quick stop was ordered, and neither its arrival nor a standstill was awaited, since \
                 that was interrupted"
            );
            Self::moving(node, text, network.guarded(node), who)
        };
        network.moved().iter().map(left).collect()
    }

    fn moving(node: NodeId, text: String, loss: Option<HostLoss>, who: &str) -> Self {
        let by_itself = loss.map(|loss| format!("without {who} {loss}"));
        Self { node, stands: false, because: [text].into_iter().chain(by_itself).collect() }
    }

    /// What to do about it.
    pub fn next(&self) -> Option<String> {
        (!self.stands).then(|| make_sure(self.node))
    }

    /// One line for people: which node stands, or may still be moving, and what it does by itself.
    pub fn text(&self) -> String {
        self.because.join("; ")
    }
}

/// What to do about a drive that may still be moving.
pub fn make_sure(node: NodeId) -> String {
    format!("make sure that it stands still (emergency stop); then: ferrodrive state {node}")
}

/// A line for each drive that was not seen to stand.
pub fn still_moving(accounts: impl IntoIterator<Item = Account>) -> Vec<String> {
    accounts.into_iter().filter(|account| !account.stands).map(|account| account.text()).collect()
}

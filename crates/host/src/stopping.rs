//! What is reported of drives that the program which has moved them lets go of: by a signal, a failure, a client that has gone, a network that
//! is closed. How they are stopped is the master's: [`Network::stop_and_release`] and [`Network::stop_moved`].

use std::time::Duration;

use canopen::NodeId;
use master::cyclic::NotAtRest;
use master::drive::{HostLoss, Stopped};
use master::units::Rpm;
use master::{Drive, Network};
use words::failure::Failure;

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

/// How long a shaft may take to stand once its power was taken.
const REST: Duration = Duration::from_secs(3);
/// A shaft stands where so many looks in a row show that.
const LOOKS: u32 = 3;
const LOOK: Duration = Duration::from_millis(10);

/// Stops a drive, if this program has set it in motion, and takes its power: by SDO, whatever moved it. Ends when it was seen to stand
/// without power: what a loop held may be turned by its load once it is let go, and a loop that is not stable swings until then.
///
/// # Errors
/// That was not seen: it is among what this program has in motion then.
pub async fn bring_to_rest(drive: &Drive) -> Result<(), Failure> {
    let stood = see_at_rest(drive).await;
    if stood.is_err() {
        // To take its power counts as a stop, whatever the shaft does.
        drive.note_moved();
    }
    stood
}

async fn see_at_rest(drive: &Drive) -> Result<(), Failure> {
    let (network, node) = (drive.node().network(), drive.node().id());
    let stopped = network.stop_moved([node].into_iter().collect()).await;
    let unseen = stopped.into_iter().find_map(|axis| axis.outcome.err());
    if let Err(error) = drive.disable().await {
        return Err(unseen.unwrap_or(error).into());
    }
    let (began, mut looks, mut before) = (network.now(), 0, None);
    while looks < LOOKS {
        network.sleep(LOOK).await;
        let state = drive.state().await?;
        let before = std::mem::replace(&mut before, state.position);
        let stands = match state.velocity {
            Some(speed) => drive.stands_at(speed),
            // One that shows no speed is looked at by its position: the encoder may swing between two counts.
            None => before.zip(state.position).is_some_and(|(before, at)| before.0.abs_diff(at.0) <= 1),
        };
        looks = if stands { looks + 1 } else { 0 };
        if looks < LOOKS && network.now() - began > REST {
            let still = match state.velocity {
                Some(Rpm(rpm)) => NotAtRest::StillTurns { node, rpm, limit: REST },
                None => NotAtRest::NotSeen { node },
            };
            return Err(Failure::new(still.to_string()).of_kind("not_stopped").at_node(node));
        }
    }
    if unseen.is_none() {
        return Ok(());
    }
    // A sensor at fault shows a shaft that stands: that is looked at too, now that it shows it.
    drive.note_moved();
    let stopped = network.stop_moved([node].into_iter().collect()).await;
    stopped.into_iter().find_map(|axis| axis.outcome.err()).map_or(Ok(()), |error| Err(error.into()))
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
                    "node {node} was set in motion and has been quick-stopped: it was seen to stand after {:.2} s",
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

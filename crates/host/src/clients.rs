//! Programs that share a network by a protocol of their own (CiA 309-3): each drive is guarded before one of them moves it, for as
//! long as one is there that has moved it, and what a program has moved is stopped when it goes.

mod guards;

use canopen::NodeId;
use master::core::NodeSet;
use master::drive::SwitchedOff;
use master::{Drive, Network};
use tokio::sync::{mpsc, oneshot};

use crate::stopping::Account;
use guards::Guards;

/// Requests for a guard that may wait.
const REQUESTS: usize = 64;

/// Lets clients in.
#[derive(Clone, Debug)]
pub struct Clients {
    guard: mpsc::Sender<GuardRequest>,
    gone: mpsc::UnboundedSender<Gone>,
}

/// One client. What it has moved is stopped when it is [let go](Self::let_go).
#[derive(Debug)]
pub struct Client {
    clients: Clients,
    guarded: NodeSet,
}

/// These nodes are about to be moved: answered when they are guarded, as far as they can be.
#[derive(Debug)]
struct GuardRequest(NodeSet, oneshot::Sender<()>);

/// A client has gone.
#[derive(Debug)]
struct Gone {
    /// What it may have set in motion.
    moved: NodeSet,
    /// What it has had guarded.
    guarded: NodeSet,
}

impl Clients {
    /// Clients of `network`, and the future that guards and stops drives for them; it has to be polled as long as there are any, and ends
    /// when there can be no more.
    ///
    /// `drive` gives a drive to be guarded, or why there is none; `note` is called with what people should know; `who` is this
    /// program in words: "this gateway".
    pub fn of<'a>(
        network: &'a Network,
        who: &'static str,
        drive: impl AsyncFn(NodeId) -> Result<Drive, String> + 'a,
        note: impl Fn(&str) + 'a,
    ) -> (Self, impl Future<Output = ()> + 'a) {
        let (guard, asked) = mpsc::channel(REQUESTS);
        // Unbounded in type only: each client goes once.
        let (gone, parted) = mpsc::unbounded_channel();
        let (left, unguarded) = mpsc::unbounded_channel();
        let serving = async move {
            // Neither who comes nor who is to be stopped waits for a drive that does not answer.
            tokio::join!(
                see_off(network, who, &note, parted, left),
                see_guarded(network, who, &drive, &note, asked, unguarded)
            );
        };
        (Self { guard, gone }, serving)
    }

    /// A client that has moved nothing.
    pub fn join(&self) -> Client {
        Client { clients: self.clone(), guarded: NodeSet::EMPTY }
    }
}

impl Client {
    /// Returns when these drives, which this client is about to move, are guarded as far as they can be.
    pub async fn guard(&mut self, nodes: NodeSet) {
        let nodes: NodeSet = nodes.iter().filter(|node| !self.guarded.contains(*node)).collect();
        if nodes.is_empty() {
            return;
        }
        let (done, answered) = oneshot::channel();
        // What was asked for is given back when the client goes, which may be before the answer.
        let Ok(permit) = self.clients.guard.reserve().await else { return };
        nodes.iter().for_each(|node| self.guarded.insert(node));
        permit.send(GuardRequest(nodes, done));
        let _ = answered.await;
    }

    /// The client has gone: what it has `moved` is stopped, and then the guards are given back that no other client needs.
    pub fn let_go(self, moved: NodeSet) {
        let Self { clients, guarded } = self;
        if !moved.is_empty() || !guarded.is_empty() {
            let _ = clients.gone.send(Gone { moved, guarded });
        }
    }
}

/// Guards what is about to be moved, and gives the guards back that no client needs any more; one at a time, so that no guard is given
/// back while another client asks for it.
async fn see_guarded(
    network: &Network,
    who: &str,
    drive: &impl AsyncFn(NodeId) -> Result<Drive, String>,
    note: &impl Fn(&str),
    mut asked: mpsc::Receiver<GuardRequest>,
    mut left: mpsc::UnboundedReceiver<NodeSet>,
) {
    let mut guards = Guards::default();
    loop {
        tokio::select! {
            biased;
            // A client asks before it goes.
            Some(GuardRequest(nodes, done)) = asked.recv() => {
                for node in guards.take(nodes).iter() {
                    match guard(drive, node).await {
                        Ok(()) => guards.note(node),
                        Err(why) => note(&format!("node {node}: nothing stops it when {who} dies: {why}")),
                    }
                }
                // The client may have gone.
                let _ = done.send(());
            }
            Some(nodes) = left.recv() => {
                // What has a watch and was not seen to stand is left to it.
                let _ = network.release_guards(guards.give(nodes)).await;
            }
            else => return,
        }
    }
}

/// Makes the drive stop by itself without this program, or returns why it cannot.
async fn guard(drive: &impl AsyncFn(NodeId) -> Result<Drive, String>, node: NodeId) -> Result<(), String> {
    let loss = drive(node).await?.guard(SwitchedOff::Leave).await.map_err(|error| error.to_string())?;
    if loss.stops_after().is_none() { Err(loss.to_string()) } else { Ok(()) }
}

/// Stops what a client that has gone has moved.
async fn see_off(
    network: &Network,
    who: &str,
    note: &impl Fn(&str),
    mut parted: mpsc::UnboundedReceiver<Gone>,
    left: mpsc::UnboundedSender<NodeSet>,
) {
    while let Some(Gone { moved, guarded }) = parted.recv().await {
        for stopped in network.stop_moved(moved).await {
            let account = Account::of_stop(&stopped, who);
            note(&match account.stands {
                true => format!("node {}: its client has gone; it has been quick-stopped and stands", stopped.node),
                false => format!("its client has gone: {}", account.text()),
            });
        }
        // It ends with this.
        let _ = left.send(guarded);
    }
}

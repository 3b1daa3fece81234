use canopen::NodeId;
use cia402::{Controlword, PowerCommand};

use super::handle::{CONTROLWORD, Drive};
use crate::core::{Command, Core, NodeSet, Payload, Request, Transfer};
use crate::error::Error;
use crate::network::{DEFAULT_TIMEOUT, Network, join_all};

/// Quick stop, with the halt bit for drives that look for their reference whatever the quick stop bit says; where there is
/// a state machine, halt means nothing in Quick stop active (CiA 402-2, 8.4.1).
pub(crate) const STOP: Controlword = Controlword(PowerCommand::QuickStop.controlword().0 | Controlword::HALT);

/// Stopping what this program has set in motion, and only that.
impl Network {
    /// Quick-stops every axis that this program has set in motion, all at the same time, and says what each answered.
    pub async fn stop_all_moved(&self) -> Vec<(NodeId, Result<(), Error>)> {
        self.with_core(Core::stop_cyclic);
        let stops = self.moved_axes().into_iter().map(|(id, controlword)| {
            let node = self.node(id);
            async move { (id, controlword, node.write(controlword, STOP.0).await) }
        });
        let stopped = join_all(stops.collect::<Vec<_>>()).await;
        for (id, controlword, _) in stopped.iter().filter(|(_, _, outcome)| outcome.is_ok()) {
            self.note_stopped(*id, *controlword);
        }
        stopped.into_iter().map(|(id, _, outcome)| (id, outcome)).collect()
    }

    /// Queues the same without waiting; the runner has to be kept going until the frames are out.
    pub fn quick_stop_moved(&self) -> NodeSet {
        let stop = Payload::new(&STOP.0.to_le_bytes());
        self.with_core(Core::stop_cyclic);
        let moved = self.moved();
        for (node, mux) in self.moved_axes() {
            let transfer = Transfer::Download(stop.clone());
            let request = Request { node, mux, transfer, timeout: DEFAULT_TIMEOUT };
            let ticket = self.with_core(Core::ticket);
            self.submit(Command::Request(ticket, request));
            self.note_stopped(node, mux);
        }
        moved
    }

    /// A guard that quick-stops what was set in motion when it goes out of scope.
    pub fn stop_guard(&self) -> StopGuard {
        StopGuard { network: self.clone() }
    }
}

impl Drive {
    /// Notes that this program has set this axis in motion.
    pub(super) fn note_moved(&self) {
        self.node.network().note_moved(self.node.id(), self.place(CONTROLWORD));
    }

    /// Notes that this axis stands still again.
    pub(super) fn note_stopped(&self) {
        self.node.network().note_stopped(self.node.id(), self.place(CONTROLWORD));
    }
}

/// Quick-stops, when dropped, every axis that this program has set in motion. See [`Network::stop_guard`].
#[derive(Debug)]
#[must_use = "a guard that is dropped at once stops at once"]
pub struct StopGuard {
    network: Network,
}

impl Drop for StopGuard {
    fn drop(&mut self) {
        self.network.quick_stop_moved();
    }
}

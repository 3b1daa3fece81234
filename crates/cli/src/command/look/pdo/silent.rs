//! Why PDOs of a node stay away, from how they are set up and what was heard meanwhile.

use std::collections::BTreeSet;
use std::time::Duration;

use can::{BusFrame, CanId};
use canopen::CobId;
use canopen::pdo::EventTrigger;
use master::Drive;
use master::pdo::{PdoConfig, Silence, Situation, why_silent};
use tokio::sync::broadcast::Receiver;

use crate::context::Context;

/// The identifier of SYNC as delivered (CiA 301, 7.3.5).
const SYNC: CanId = CanId::standard(0x80);

/// Shortest time to listen to others: no machine has slower cycles than this.
const LISTENED: Duration = Duration::from_millis(300);

/// The identifiers that others send with.
pub(super) struct HeardIds {
    frames: Receiver<BusFrame>,
    ids: BTreeSet<u32>,
}

impl HeardIds {
    /// Listens from now on.
    pub(super) fn listen(context: &Context) -> Self {
        Self { frames: context.traffic.of_others(), ids: BTreeSet::new() }
    }

    /// Listens for so long that a cycle would have been heard.
    pub(super) async fn long_enough(&mut self, context: &Context) {
        context.network.sleep(LISTENED).await;
        self.take();
    }

    /// Takes what has come; a listener that was too slow has missed the oldest, and a cycle comes again.
    pub(super) fn take(&mut self) {
        loop {
            match self.frames.try_recv() {
                Ok(passed) => {
                    self.ids.insert(passed.frame.id().raw());
                }
                Err(tokio::sync::broadcast::error::TryRecvError::Lagged(_)) => {}
                Err(_) => return,
            }
        }
    }

    /// What keeps a PDO of a node away.
    pub(super) fn why(&self, context: &Context, drive: &Drive, config: &PdoConfig, cob_id: CobId) -> Vec<Silence> {
        let model = drive.description();
        let situation = Situation {
            nmt: context.network.facts(drive.node().id()).probable_state(model),
            event_trigger: model.map_or(EventTrigger::Change, |model| model.pdo.event_trigger),
            sync_heard: Some(self.ids.contains(&SYNC.raw())),
            heard: Some(self.ids.contains(&cob_id.can_id().raw())),
        };
        why_silent(config, cob_id, &situation)
    }
}

//! The nodes of the bus: found by a scan, read periodically, and shown.

use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use cia402::object::CONTROLWORD;
use master::core::Event;
use master::identify::Found;
use master::{Drive, Error};

use crate::answer::Answer;
use crate::nodes::known_node::KnownNode;
use crate::snapshot::{DriveView, News, NodeView};
use crate::state::Host;
use crate::work::{Asked, Done, Look, send};

/// The device profile of a drive in the low half of 1000h (CiA 402-1).
const DRIVE_PROFILE: u32 = 402;

/// Period at which a drive is read: about nine objects, which are 4 % of a bus at 500 kbit/s.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// Increase of that period with each further drive, so that many drives take no more of the bus than a few.
const LOOK_INTERVAL_OF_EACH: Duration = Duration::from_millis(25);

/// Period at which it is read what a drive would do if this program died: other clients may change it.
const LOSS_INTERVAL: Duration = Duration::from_secs(2);

/// Period at which a drive that does not answer is tried again.
const SILENT_INTERVAL: Duration = Duration::from_secs(1);

impl Host {
    /// Scans all node-IDs, unless a scan is under way.
    pub(crate) fn begin_scan(&mut self, asked: Option<Asked>) {
        if self.scanning {
            if let Some((seq, answer)) = asked {
                send(answer, Answer::failed(Some(seq), "busy", "a scan is under way"));
            }
            return;
        }
        self.scanning = true;
        let (network, timeout) = (self.network.clone(), self.setting.timeout);
        self.work.push(Box::pin(async move { Done::Scanned(network.scan(timeout, |_| {}).await, asked) }));
    }

    /// Adds the nodes that were found. A node that did not answer this time stays, with what is known of it.
    pub(crate) fn take_scan(&mut self, found: Vec<Found>) {
        self.scanning = false;
        for found in found {
            let (id, known) = (found.node, self.known(&found));
            let before = self.nodes.remove(&id);
            let is_looked_at = before.as_ref().is_some_and(|before| before.is_looked_at);
            let is_drive = known.drive.is_some();
            let (view, loss) = before.map_or((None, None), |before| (before.view, before.loss));
            self.nodes.insert(id, KnownNode { is_looked_at, view, loss, ..known });
            self.learn_pdos(id);
            if is_drive && !is_looked_at {
                self.look_at(id, Duration::ZERO);
            }
        }
        if core::mem::take(&mut self.scans_again) {
            self.begin_scan(None);
        }
    }

    fn known(&self, found: &Found) -> KnownNode {
        let node = self.network.node(found.node).with_timeout(self.setting.timeout);
        let given = self.setting.models.get(&found.node).copied();
        let fits =
            |given: &&devices::Description| found.identity.is_none_or(|identity| identity.matches(&given.identity));
        let contradiction = given
            .filter(|given| !fits(given))
            .map(|given| format!("configured as a {}, but its identity (1018h) differs", given.name));
        let is_drive = found
            .identity
            .and_then(|identity| identity.device_type)
            .is_some_and(|device_type| device_type & 0xFFFF == DRIVE_PROFILE);
        let drive = match given.filter(fits) {
            Some(model) => Drive::new(node, model),
            None => Drive::known_as(node, found.knowledge.clone()),
        };
        let drive = drive.behind(self.setting.gears.get(&found.node).copied().unwrap_or_default());
        let is_drive = is_drive || drive.axis_description().is_some();
        let doubt = || found.doubt().filter(|_| given.is_none());
        KnownNode {
            identity: found.identity,
            remark: contradiction.or_else(doubt),
            drive: Some(drive).filter(|_| is_drive),
            is_looked_at: false,
            view: None,
            loss: None,
            trouble: None,
        }
    }

    /// Reads a drive after a delay.
    fn look_at(&mut self, id: NodeId, after: Duration) {
        let Some(node) = self.nodes.get_mut(&id) else { return };
        let Some(drive) = node.drive.clone() else { return };
        node.is_looked_at = true;
        let due = self.network.now() + after;
        let asks_loss = node.loss.is_none_or(|(_, read_at)| due - read_at >= LOSS_INTERVAL);
        self.work.push(Box::pin(async move {
            drive.node().network().sleep(after).await;
            Done::Read(id, read(&drive, asks_loss).await.map(Box::new))
        }));
    }

    /// Stores the values of a drive, and schedules the next reading.
    pub(crate) fn take_in(&mut self, id: NodeId, read: Result<Box<Look>, Error>) {
        match &read {
            Ok(look) => self.note_look(id, &look.view),
            Err(error) => self.note_silence(id, error),
        }
        self.look_for_rest(id, read.as_ref().ok().map(|look| &look.view));
        let drives = self.nodes.values().filter(|node| node.drive.is_some()).count() as u32;
        let Some(node) = self.nodes.get_mut(&id) else { return };
        node.is_looked_at = false;
        let interval = match read {
            Ok(look) => {
                let Look { view, loss } = *look;
                node.loss = loss.map(|loss| (loss, self.network.now())).or(node.loss);
                (node.view, node.trouble) = (Some(Box::new(view)), None);
                LOOK_INTERVAL.max(LOOK_INTERVAL_OF_EACH * drives)
            }
            Err(error) => {
                (node.view, node.trouble) = (None, Some(error.to_string()));
                SILENT_INTERVAL
            }
        };
        self.look_at(id, interval);
    }

    /// A node as it is shown.
    pub(crate) fn view(&self, id: NodeId, node: &KnownNode, now: Instant) -> NodeView {
        let facts = self.network.facts(id);
        let description = node.drive.as_ref().and_then(Drive::description);
        let identity = node.identity.unwrap_or_default();
        let loss = self.network.guarded(id).or(node.loss.map(|(loss, _)| loss));
        NodeView {
            node: id.raw(),
            model: description.map(|description| description.name),
            title: description.map(|description| description.title),
            remark: node.remark.clone(),
            device_type: identity.device_type,
            vendor_id: identity.vendor_id,
            product_code: identity.product_code,
            revision_number: identity.revision_number,
            nmt: facts.probable_state(description).map(|state| state.to_string()),
            heartbeat_age_ms: facts.heartbeat_age(now).map(|age| age.as_millis() as u64),
            trouble: node.trouble.clone(),
            doing: self.running.get(&id).map(|running| running.what),
            moving: self.network.moved().contains(id),
            stop_unseen: self.unseen_stops.contains_key(&id),
            can_roll_back: self.parameters.can_roll_back(id),
            stored: self.parameters.stored(id),
            mapped: self.parameters.mapped(id),
            without_us: loss.map(|loss| loss.to_string()),
            goes_on: loss.is_some_and(|loss| loss.stops_after().is_none()),
            accepted: self.accepted.contains(&id),
            feed_m: self.setting.gears.get(&id).and_then(|gear| gear.feed_m()),
            drive: node.view.clone(),
        }
    }

    /// Passes on the events of the network. An unknown node triggers a scan.
    pub(crate) fn hear_events(&mut self) {
        while let Some((at, event)) = self.network.poll_event() {
            self.note_event(at, &event);
            let node = match event {
                Event::BootUp(node) => {
                    // A node that was heard and did not answer is unknown too.
                    if self.nodes.get(&node).is_none_or(|known| known.identity.is_none()) {
                        self.scans_again = self.scanning;
                        self.begin_scan(None);
                    }
                    // Values that were not stored are lost.
                    self.learn_pdos(node);
                    Some(node)
                }
                Event::NmtState(node, _)
                | Event::HeartbeatLost(node, _)
                | Event::HeartbeatBack(node)
                | Event::Emcy(node, _) => Some(node),
                // The contents of an answer to one session are not news to the others.
                Event::NoAnswer(..) | Event::Aborted(..) => continue,
                _ => None,
            };
            self.send_news(node, &self.words_of(&event));
        }
    }

    /// Sends news to every page.
    pub(crate) fn send_news(&self, node: Option<NodeId>, text: &str) {
        let time_s = (self.network.now() - Instant::ZERO).as_secs_f64();
        // There may be no receiver.
        let _ = self.inbox.news.send(News { time_s, node: node.map(NodeId::raw), text: text.to_owned() });
    }
}

async fn read(drive: &Drive, asks_loss: bool) -> Result<Look, Error> {
    let state = drive.state().await?;
    let object = drive.axis_description().map_or(CONTROLWORD, |axis| axis.object(CONTROLWORD));
    // Some drives do not report it.
    let controlword = drive.node().read::<u16>(object).await.ok();
    let at_s = (drive.node().network().now() - Instant::ZERO).as_secs_f64();
    // Unknown for an unknown model.
    let loss = if asks_loss { drive.host_loss_if_guarded().await.ok() } else { None };
    Ok(Look { view: DriveView::new(&state, controlword, at_s), loss })
}

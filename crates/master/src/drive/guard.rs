//! What a drive does when the program that moves it dies, and arming what it has against that.
//!
//! How a drive notices is data of its model ([`HostWatch`]): by silence, by a missing heartbeat (CiA 301, 7.2.8.2.2), or not
//! at all. A guard lasts until it is released; meanwhile the core keeps the drive content, as long as it is run.
//! That the program lives and yet does nothing sensible is not noticed here.

use std::time::Duration;

use canopen::heartbeat::Consumer;
use canopen::od::DefaultValue;
use canopen::{Mux, NodeId};
use devices::{AxisId, HostWatch};

use super::everything::{WINDOW, WINDOW_TIME};
use super::handle::Drive;
use crate::core::NodeSet;
use crate::error::Error;
use crate::gear::Gear;
use crate::host_loss::{ArmedGuard, HostLoss};
use crate::identify;
use crate::network::{Former, Network, Node, join_all};

/// How often a drive that watches for silence or for a heartbeat is content within its time: two may get lost.
const SIGNS_IN_TIME: u32 = 4;

/// The shortest period of a heartbeat (1017h has milliseconds).
const SHORTEST_PERIOD: Duration = Duration::from_millis(1);

/// Consumer heartbeat time (CiA 301, 7.5.2.19): bits 16 to 23 node-ID, bits 0 to 15 time in ms.
const HEARTBEAT_CONSUMERS: u16 = 0x1016;

/// What a watch gets that is off as delivered: node 127, which masters mostly take, within 2000 ms, as the M joint has it.
const OWN_WATCH: i64 = 127 << 16 | 2000;

/// How long a node that this program does not move is waited for, when it is asked whether it watches too.
const BYSTANDER_TIMEOUT: Duration = Duration::from_millis(100);

/// How to treat a watch that is set to 0 on the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchedOff {
    /// It was switched off on purpose, and stays so; except for a consumer of heartbeats that is delivered switched
    /// off: that is switched on as by the other.
    Leave,
    /// It is set to its factory value until the guard is released, or to node 127 within 2000 ms where that is off. A drive that
    /// stores each write stores these two.
    SwitchOn,
}

impl Drive {
    /// What the drive does when this program dies, as it is set and guarded now. Changes nothing.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO reads.
    pub async fn host_loss(&self) -> Result<HostLoss, Error> {
        if let Some(guard) = self.node.network().with_guards(|guards| guards.get(&self.node.id()).copied()) {
            return Ok(guard.loss);
        }
        match self.known("find out what it does without its host")?.host_watch {
            HostWatch::Heartbeat { consumer, .. } => Ok(match self.read_number(consumer).await? {
                0 => HostLoss::SwitchedOff { object: consumer },
                _ => HostLoss::NotArmed { object: consumer },
            }),
            HostWatch::Silence { time } => Ok(self.loss(self.read_number(time).await?)),
            HostWatch::None => Ok(HostLoss::GoesOn),
        }
    }

    /// What [`guard`](Self::guard) would report now, with [`SwitchedOff::Leave`]: what the drive does when this program
    /// dies in the middle of a motion that is guarded. Changes nothing.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO reads.
    pub async fn host_loss_if_guarded(&self) -> Result<HostLoss, Error> {
        match self.known("find out what it does without its host")?.host_watch {
            HostWatch::Silence { time: object } | HostWatch::Heartbeat { consumer: object, .. } => {
                Ok(self.loss(self.read_number(object).await?))
            }
            HostWatch::None => Ok(HostLoss::GoesOn),
        }
    }

    /// Has the drive stop by itself when this program dies, with what its model has for that, and reports what it will
    /// do: [`HostLoss::stops_after`] is `None` where nothing can be done.
    ///
    /// From here on the runner keeps the drive content: a drive that watches for silence is asked for its statusword when
    /// no other request is sent to it (whether process data count for it is not known of every drive), and for one that consumes a heartbeat this master produces it, under the node-ID that the
    /// drive watches. A drive that had lost its host, and would go on with an old motion at the first heartbeat, is stopped
    /// before: this one, and any other on the bus that watches the same node-ID. Ends with [`release_guard`](Self::release_guard); a program that ends otherwise leaves it to the drive
    /// to stop.
    ///
    /// One request whose answer is waited for longer than the drive's time leaves it without a frame: timeouts should be
    /// shorter.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; [`Error::NotReached`] when an old motion cannot be stopped; those of the SDO requests.
    pub async fn guard(&self, switched_off: SwitchedOff) -> Result<HostLoss, Error> {
        let object = match self.known("guard it")?.host_watch {
            HostWatch::Silence { time } => time,
            HostWatch::Heartbeat { consumer, .. } => consumer,
            HostWatch::None => return Ok(HostLoss::GoesOn),
        };
        let (id, network) = (self.node.id(), self.node.network());
        let held = network.with_guards(|guards| guards.get(&id).copied());
        let before = match held {
            Some(guard) => guard.before,
            None => self.read_number(object).await?,
        };
        let mut armed = held.map_or(before, |guard| guard.armed);
        let factory = match self.row(object, "guard it")?.default {
            DefaultValue::Value(factory) => factory,
            _ => 0,
        };
        // A watch that is delivered switched off, as 1016h mostly is, was not switched off on purpose.
        let delivered_off = factory == 0 && object.index == HEARTBEAT_CONSUMERS;
        let switches_on = armed == 0 && (delivered_off || switched_off == SwitchedOff::SwitchOn);
        if switches_on {
            armed = if delivered_off { OWN_WATCH } else { factory };
        }
        let loss = self.loss(armed);
        let Some(time) = loss.stops_after() else { return Ok(loss) };
        if let HostLoss::StopsWithoutHeartbeat { host, .. } = loss
            && !network.sends_heartbeat(host)
        {
            network.stop_what_would_go_on(id, host).await?;
        }
        let guard = ArmedGuard { loss, period: (time / SIGNS_IN_TIME).max(SHORTEST_PERIOD), before, armed };
        // Noted before anything changes on the drive: whatever fails from here on, a release puts it back.
        network.with_guards(|guards| guards.insert(id, guard));
        if let Err(error) = self.begin_guard(object, &guard, switches_on).await {
            // The first error is the one to report.
            let _ = network.release_guard(id, NodeSet::EMPTY).await;
            return Err(error);
        }
        network.show_presence(id, guard.loss, Some(guard.period));
        Ok(loss)
    }

    /// Arms the drive's watch where it was off, and ends a motion that would go on with the first heartbeat.
    async fn begin_guard(&self, object: Mux, guard: &ArmedGuard, switches_on: bool) -> Result<(), Error> {
        if switches_on {
            self.write_number(object, guard.armed).await?;
        }
        if self.has_lost_its_host().await? {
            self.stop().await?;
        }
        Ok(())
    }

    /// Ends the guard: the drive no longer watches this program. To be called when it stands still, or is to go on alone.
    ///
    /// # Errors
    /// Those of the SDO requests. The guard has ended nevertheless, and the drive may stop by itself.
    pub async fn release_guard(&self) -> Result<(), Error> {
        self.node.network().release_guard(self.node.id(), NodeSet::EMPTY).await
    }

    /// What this value of the drive's watch stands for, when this program does its part.
    fn loss(&self, raw: i64) -> HostLoss {
        let time = |ms: i64| Duration::from_millis(ms.unsigned_abs());
        match self.description.map(|description| description.host_watch) {
            None | Some(HostWatch::None) => HostLoss::GoesOn,
            Some(HostWatch::Silence { time: object }) if raw <= 0 => HostLoss::SwitchedOff { object },
            Some(HostWatch::Silence { time: object }) => HostLoss::StopsInSilence { object, time: time(raw) },
            Some(HostWatch::Heartbeat { consumer: object, .. }) => match Consumer::from_raw(raw as u32) {
                None => HostLoss::SwitchedOff { object },
                // A device that has that node-ID sends a heartbeat of its own, and this program must not.
                Some(consumer) if self.node.network().seen().contains(consumer.node()) => {
                    HostLoss::WatchesAnother { object, host: consumer.node() }
                }
                Some(consumer) => HostLoss::StopsWithoutHeartbeat {
                    object,
                    host: consumer.node(),
                    time: Duration::from_millis(u64::from(raw as u16)),
                },
            },
        }
    }

    /// Ends the alarm of a drive that has stopped for want of a heartbeat, once its old motion is stopped for good.
    pub(super) async fn forget_lost_host(&self) -> Result<(), Error> {
        let Some(HostWatch::Heartbeat { consumer, .. }) = self.description.map(|description| description.host_watch)
        else {
            return Ok(());
        };
        if !self.has_lost_its_host().await? {
            return Ok(());
        }
        self.stop().await?;
        let raw = self.read_number(consumer).await?;
        self.write_number(consumer, 0).await?;
        self.write_number(consumer, raw).await
    }

    /// True if the drive has stopped for want of a heartbeat, and would go on with the next one.
    async fn has_lost_its_host(&self) -> Result<bool, Error> {
        let Some(description) = self.description else { return Ok(false) };
        match description.host_watch {
            HostWatch::Heartbeat { fault, .. } => Ok(self.read_number(self.fault_code()).await? == i64::from(fault)),
            HostWatch::None | HostWatch::Silence { .. } => Ok(false),
        }
    }
}

impl Network {
    /// What the drive at this node does when this program dies, if it is guarded.
    pub fn guarded(&self, node: NodeId) -> Option<HostLoss> {
        self.with_guards(|guards| guards.get(&node).map(|guard| guard.loss))
    }

    /// Ends the guards of those of these drives that this program has not set in motion, or has seen to stand since, as
    /// [`Drive::release_guard`] does. A drive that may still be moving keeps its watch over its host, and is no longer kept
    /// content: it stops by itself. The others have back what a group or a base had [changed](Self::put_back) for its cycles.
    ///
    /// # Errors
    /// The first error of an SDO request; those guards have ended nevertheless.
    pub async fn release_guards(&self, of: NodeSet) -> Result<(), Error> {
        let moved = self.moved();
        let nodes: NodeSet =
            self.with_guards(|guards| guards.keys().copied().filter(|node| of.contains(*node)).collect());
        for node in nodes.iter().filter(|node| moved.contains(*node)) {
            self.forsake(node);
        }
        let at_rest = nodes.iter().filter(|node| !moved.contains(*node));
        let released = join_all(at_rest.map(|node| self.release_guard(node, moved)).collect::<Vec<_>>()).await;
        let put_back = self.put_back(of).await;
        released.into_iter().chain([put_back]).collect()
    }

    /// Puts back what a group or a base has changed for its cycles (ramps, interpolation time, PDOs), of those of these drives that this
    /// program has not set in motion, or has seen to stand since. Their guards stay.
    ///
    /// # Errors
    /// The first error of an SDO request; what it left is tried again at the next release.
    pub async fn put_back(&self, of: NodeSet) -> Result<(), Error> {
        let moved = self.moved();
        let at_rest = NodeId::all().filter(|node| of.contains(*node) && !moved.contains(*node));
        let put_back = at_rest.map(|node| self.put_back_node(node));
        join_all(put_back.collect::<Vec<_>>()).await.into_iter().collect()
    }

    async fn put_back_node(&self, id: NodeId) -> Result<(), Error> {
        let node = self.node(id).by_server_in_use();
        let mut left = self.take_former(id);
        let done = put_back(&node, &mut left).await;
        // The next release tries the rest again.
        left.objects.into_iter().for_each(|(object, value)| self.note_former(id, object, value));
        left.pdos.into_values().for_each(|pdo| self.note_former_pdo(id, pdo));
        done
    }

    /// Stops, on all nodes but `own`, what the first heartbeat of `host` would set going again: a drive that has stopped for want of it
    /// goes on with its last command then, and the program that gave it may be dead. A node that does not answer is passed over: most
    /// node-IDs are of none.
    async fn stop_what_would_go_on(&self, own: NodeId, host: NodeId) -> Result<(), Error> {
        let others = NodeId::all().filter(|node| *node != own).collect::<Vec<_>>();
        let windows = others.chunks(WINDOW).enumerate();
        let looks = windows.flat_map(|(number, window)| window.iter().map(move |node| (*node, number as u32)));
        let looks = looks.map(|(id, number)| async move {
            if number > 0 {
                self.sleep(WINDOW_TIME * number).await;
            }
            self.stop_if_it_would_go_on(&self.node(id).with_timeout(BYSTANDER_TIMEOUT), host).await
        });
        join_all(looks.collect::<Vec<_>>()).await.into_iter().collect()
    }

    async fn stop_if_it_would_go_on(&self, node: &Node, host: NodeId) -> Result<(), Error> {
        let consumer = node.read::<u32>(Mux::new(HEARTBEAT_CONSUMERS, 1)).await.ok().and_then(Consumer::from_raw);
        if consumer.is_none_or(|consumer| consumer.node() != host) {
            return Ok(());
        }
        let node = self.node(node.id());
        let Some(description) = identify::knowledge(&node).await?.description() else { return Ok(()) };
        for axis in (0..).zip(description.axes).map(|(number, _)| AxisId(number)) {
            let description = Some(description);
            let drive = Drive { node: node.clone(), axis, description, guess: None, gear: Gear::DIRECT };
            if drive.has_lost_its_host().await? {
                drive.stop().await?;
            }
        }
        Ok(())
    }

    /// Leaves a guarded drive to its watch: it gets no more signs of life.
    fn forsake(&self, node: NodeId) {
        match self.with_guards(|guards| guards.remove(&node)).map(|guard| guard.loss) {
            Some(loss @ HostLoss::StopsInSilence { .. }) => self.show_presence(node, loss, None),
            Some(HostLoss::StopsWithoutHeartbeat { host, .. }) => drop(self.send_heartbeat(host)),
            _ => {}
        }
    }

    /// How long this program was held up (frozen, or its machine asleep) beyond what the guarded drive at this node allows: the
    /// drive has stopped by itself since, and is sent no sign of life that would have it go on.
    pub(crate) fn lapse(&self, node: NodeId) -> Option<Duration> {
        match self.guarded(node)? {
            HostLoss::StopsWithoutHeartbeat { host, .. } => self.look(|core| core.lapse(host)),
            HostLoss::StopsInSilence { .. } => self.look(|core| core.lapse(node)),
            _ => None,
        }
    }

    /// Those that are `armed` stay so.
    async fn release_guard(&self, id: NodeId, armed: NodeSet) -> Result<(), Error> {
        let Some(guard) = self.with_guards(|guards| guards.remove(&id)) else { return Ok(()) };
        match guard.loss {
            HostLoss::StopsInSilence { object, .. } => {
                self.show_presence(id, guard.loss, None);
                if guard.before == guard.armed {
                    return Ok(());
                }
                // The object of the time is UNSIGNED16 wherever there is one.
                self.node(id).write(object, guard.before as u16).await
            }
            HostLoss::StopsWithoutHeartbeat { object, host, .. } => {
                if self.send_heartbeat(host) {
                    // The heartbeat goes on for others, and would arm anew any watch but one that is switched off.
                    let off = guard.before == 0 && guard.armed != 0;
                    return if off { self.node(id).write(object, 0_u32).await } else { Ok(()) };
                }
                self.disarm_bystanders(armed.with(id), object, host).await;
                disarm(&self.node(id), object, host, Some(guard.before as u32)).await
            }
            _ => Ok(()),
        }
    }

    /// Has every drive but the `others` that this program's heartbeat has armed forget it: they would stop for want of
    /// it, even when moved by another program. A drive that does not answer stays armed.
    async fn disarm_bystanders(&self, others: NodeSet, object: Mux, host: NodeId) {
        let bystanders = self.seen().iter().filter(|node| !others.contains(*node)).collect::<Vec<_>>();
        let disarmed = bystanders.into_iter().map(|id| async move {
            let node = self.node(id).with_timeout(BYSTANDER_TIMEOUT);
            disarm(&node, object, host, None).await
        });
        join_all(disarmed).await;
    }

    /// Ceases to send the heartbeats that guarded drives watch, or sends them again. The guards stay.
    pub(crate) fn hold_heartbeats(&self, hold: bool) {
        let hosts: NodeSet = self.with_guards(|guards| {
            let host = |guard: &ArmedGuard| match guard.loss {
                HostLoss::StopsWithoutHeartbeat { host, .. } => Some(host),
                _ => None,
            };
            guards.values().filter_map(host).collect()
        });
        for host in hosts.iter() {
            if hold {
                self.heartbeat(host, None);
            } else {
                self.send_heartbeat(host);
            }
        }
    }

    /// A guarded drive has started anew, and what was armed on it is gone.
    pub(crate) fn forget_guard(&self, node: NodeId) {
        if let Some(guard) = self.with_guards(|guards| guards.remove(&node))
            && matches!(guard.loss, HostLoss::StopsInSilence { .. })
        {
            self.show_presence(node, guard.loss, None);
        }
    }

    /// Starts, changes or ends what keeps a drive content.
    fn show_presence(&self, node: NodeId, loss: HostLoss, period: Option<Duration>) {
        match loss {
            HostLoss::StopsInSilence { time, .. } => self.node(node).keep_fed_within(period, Some(time)),
            HostLoss::StopsWithoutHeartbeat { host, .. } => drop(self.send_heartbeat(host)),
            _ => {}
        }
    }

    /// Whether guarded drives have this program send the heartbeat of `host`.
    fn sends_heartbeat(&self, host: NodeId) -> bool {
        let is_of_host =
            |guard: &ArmedGuard| matches!(guard.loss, HostLoss::StopsWithoutHeartbeat { host: own, .. } if own == host);
        self.with_guards(|guards| guards.values().any(is_of_host))
    }

    /// Sends the heartbeat that guarded drives watch as often as they need it, or no longer; true if there are such drives.
    fn send_heartbeat(&self, host: NodeId) -> bool {
        let guards = self.with_guards(|guards| {
            let of_host =
                |guard: &&ArmedGuard| matches!(guard.loss, HostLoss::StopsWithoutHeartbeat { host: own, .. } if own == host);
            guards.values().filter(of_host).copied().collect::<Vec<_>>()
        });
        let period = guards.iter().map(|guard| guard.period).min();
        let allowed = guards.iter().filter_map(|guard| guard.loss.stops_after()).min();
        self.heartbeat_within(host, period, allowed);
        period.is_some()
    }
}

/// Takes out of `left` what it has put back.
async fn put_back(node: &Node, left: &mut Former) -> Result<(), Error> {
    while let Some(object) = left.objects.first_entry() {
        node.download(*object.key(), object.get().as_bytes()).await?;
        object.remove();
    }
    while let Some(pdo) = left.pdos.first_entry() {
        node.put_back_pdo(pdo.get()).await?;
        pdo.remove();
    }
    Ok(())
}

/// Has a consumer of the heartbeat of `host` wait for a first one again, with `value` in its entry, or what was there. A
/// consumer entry of 0 watches nothing (CiA 301, 7.5.2.16), and each write begins anew.
async fn disarm(node: &Node, object: Mux, host: NodeId, value: Option<u32>) -> Result<(), Error> {
    let present: u32 = node.read(object).await?;
    if Consumer::from_raw(present).is_none_or(|consumer| consumer.node() != host) {
        return Ok(());
    }
    node.write(object, 0u32).await?;
    match value.unwrap_or(present) {
        0 => Ok(()),
        value => node.write(object, value).await,
    }
}

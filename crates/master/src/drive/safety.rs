//! Stopping what this program has set in motion, and only that: said to have stopped when it was seen to stand.
//!
//! A quick stop goes by SDO, and in the RPDO that carries the controlword too where one has been written to: a synchronous
//! RPDO that waits in the drive for SYNC would enable it again (CiA 301, 7.2.2.2).

use std::time::Duration;

use can::Instant;
use canopen::object::DEVICE_TYPE;
use canopen::{Mux, NodeId};
use cia402::object::{CONTROLWORD, POSITION_ACTUAL_VALUE, STATUSWORD};
use cia402::{Controlword, PowerCommand, PowerState, Statusword};
use devices::PowerStyle;

use super::conclude::Trigger;
use super::explain::blinding;
use super::handle::{Drive, POLL};
use super::power::STANDSTILL_LOOKS;
use crate::core::{Command, Core, NodeSet, Payload, Request, Transfer};
use crate::error::Error;
use crate::gear::Gear;
use crate::host_loss::HostLoss;
use crate::network::{DEFAULT_TIMEOUT, MovedAxis, Network, join_all};
use crate::units::Rpm;

/// Quick stop, with the halt bit for drives that look for their reference whatever the quick stop bit says; where there is
/// a state machine, halt means nothing in Quick stop active (CiA 402-2, 8.4.1).
pub(crate) const STOP: Controlword = Controlword(PowerCommand::QuickStop.controlword().0 | Controlword::HALT);

/// How long an answer is awaited while a drive is being stopped. Drives answer within milliseconds, and the next question may
/// get through where this one was lost.
pub(crate) const ANSWER: Duration = Duration::from_millis(150);

/// How long the state of a drive is asked for that must not be stopped without knowing it.
const GLANCE: Duration = Duration::from_millis(50);

/// How long one answer is awaited when a drive is stopped once more that has answered nothing.
const LAST_ANSWER: Duration = Duration::from_millis(100);

/// How long a drive may leave everything unanswered before its stop counts as not seen.
pub(super) const SILENCE: Duration = Duration::from_millis(300);

/// How long a drive may go on in Operation enabled before the stop is sent again: another master may have enabled it
/// since.
const REPEAT: Duration = Duration::from_millis(100);

/// How long a drive of an unknown model is given to come to rest: its ramps are not known.
const UNKNOWN_RAMP: Duration = Duration::from_secs(5);

/// What the position of a shaft at rest may vary by within [`REST_LOOK`], in counts: an encoder of 32768 counts a turn has 11
/// of them in this time at 1 r/min.
const REST_COUNTS: i64 = 11;
const REST_LOOK: Duration = Duration::from_millis(20);

/// The result for an axis that was to stop.
#[derive(Clone, Debug)]
pub struct Stopped {
    /// Its node.
    pub node: NodeId,
    /// The place of its controlword: which axis of the node it is.
    pub controlword: Mux,
    /// How long after the command it was seen to stand, by its statusword and its speed (or its position, where it does not
    /// show a speed); or why that was not seen: then it may still be moving.
    pub outcome: Result<Duration, Error>,
    /// What it does without this program, if it was guarded when it was to stop.
    pub loss: Option<HostLoss>,
}

/// Stopping what this program has set in motion, and only that.
///
/// This is what every way to let go of drives comes to: a signal, a failure, a page or a client that has gone, a network that is
/// closed.
impl Network {
    /// Quick-stops every axis that this program has set in motion, all at the same time, and says how each came to rest. What
    /// else this program asks of these drives has to have ended: a future that goes on enabling one would undo this.
    ///
    /// Ends when each was seen to stand, or within the time of the drive's own ramps, or a third of a second after a drive has
    /// fallen silent; what was not seen to stand by then is stopped once more.
    pub async fn stop_all_moved(&self) -> Vec<Stopped> {
        self.stop_moved(self.moved()).await
    }

    /// The same for the axes of these nodes.
    pub async fn stop_moved(&self, nodes: NodeSet) -> Vec<Stopped> {
        let began = self.now();
        let stopped = self.stop_once(nodes).await;
        self.stop_again(stopped, began).await
    }

    /// The same without a second try, for a caller that has one to come.
    pub(crate) async fn stop_once(&self, nodes: NodeSet) -> Vec<Stopped> {
        self.stop_within(nodes, ANSWER, SILENCE).await
    }

    /// Which of these nodes answer: one that does not takes a tenth of a second, or nothing where it has left its last request unanswered.
    pub(crate) async fn answering(&self, nodes: NodeSet) -> NodeSet {
        let asked = nodes.iter().filter(|node| self.facts(*node).unanswered == 0).map(|id| async move {
            let node = self.node(id).by_server_in_use();
            // Its channel may wait for an answer to what was asked before.
            let answered = self.within(LAST_ANSWER, node.upload(DEVICE_TYPE)).await;
            answered.is_some_and(|answer| answer.is_ok()).then_some(id)
        });
        join_all(asked.collect::<Vec<_>>()).await.into_iter().flatten().collect()
    }

    async fn stop_within(&self, nodes: NodeSet, answer: Duration, silence: Duration) -> Vec<Stopped> {
        let axes: Vec<_> = self.moved_axes().into_iter().filter(|axis| nodes.contains(axis.node)).collect();
        self.overrule(&axes);
        let stops = axes.into_iter().map(|moved| async move {
            let loss = self.guarded(moved.node);
            let outcome = self.drive_of(&moved, answer).come_to_rest(silence).await;
            Stopped { node: moved.node, controlword: moved.controlword, outcome, loss }
        });
        join_all(stops.collect::<Vec<_>>()).await
    }

    /// Stops once more what was not seen to stand: its connection may have come back. What stands is reported with the time since
    /// `began`.
    async fn stop_again(&self, mut stopped: Vec<Stopped>, began: Instant) -> Vec<Stopped> {
        let unseen: NodeSet = stopped.iter().filter(|axis| axis.outcome.is_err()).map(|axis| axis.node).collect();
        if unseen.is_empty() {
            return stopped;
        }
        // A further SDO server may be gone, since any client can make it invalid; the default one is always there.
        for node in unseen.iter() {
            self.use_default_server(node);
        }
        let waited = self.now() - began;
        for again in self.stop_within(unseen, LAST_ANSWER, LAST_ANSWER).await {
            let same = |axis: &&mut Stopped| (axis.node, axis.controlword) == (again.node, again.controlword);
            if let Some(before) = stopped.iter_mut().find(same) {
                before.outcome = again.outcome.map(|time| waited + time);
            }
        }
        stopped
    }

    /// [`stop_all_moved`](Self::stop_all_moved), and gives back the guards of the drives that stand. The watch of one that may
    /// still be moving is not taken from it, and it is no longer kept content: it stops by itself, if it can.
    pub async fn stop_and_release(&self) -> Vec<Stopped> {
        let began = self.now();
        let stopped = self.stop_once(self.moved()).await;
        // A drive that stands and does not answer keeps its watch, which then stops nothing.
        let _ = self.release_guards(NodeSet::ALL).await;
        self.stop_again(stopped, began).await
    }

    /// Queues the same quick stops without waiting; the runner has to be kept going until the frames are out. Whether they stop
    /// is not checked: the nodes stay among [`moved`](Self::moved).
    pub fn quick_stop_moved(&self) -> NodeSet {
        let axes = self.moved_axes();
        self.overrule(&axes);
        let stop = Payload::new(&STOP.0.to_le_bytes());
        for MovedAxis { node, controlword: mux, .. } in axes {
            let transfer = Transfer::Download(stop.clone());
            let request = Request { node, mux, transfer, timeout: DEFAULT_TIMEOUT };
            let ticket = self.with_core(Core::ticket);
            self.submit(Command::Request(ticket, request));
        }
        self.moved()
    }

    /// Ends all that this master sends on its own, and everything else: SYNC, heartbeats, process data, requests. For a
    /// program that leaves the bus, after [`stop_and_release`](Self::stop_and_release): drives that may still be moving
    /// and watch over their host stop then. Requests after this fail.
    pub fn fall_silent(&self) {
        self.with_core(Core::fall_silent);
    }

    /// A guard that quick-stops what was set in motion when it goes out of scope.
    pub fn stop_guard(&self) -> StopGuard {
        StopGuard { network: self.clone() }
    }

    fn overrule(&self, axes: &[MovedAxis]) {
        self.with_core(|core| axes.iter().for_each(|axis| core.stop_axis(axis.node, axis.controlword, STOP.0)));
    }

    fn drive_of(&self, moved: &MovedAxis, answer: Duration) -> Drive {
        let node = self.node(moved.node).with_timeout(answer);
        Drive { node, axis: moved.axis, description: moved.description, guess: None, gear: Gear::DIRECT }
    }
}

/// How a drive is seen to stand.
struct Rest {
    looks: u32,
    position: Option<i64>,
    /// The drive is at fault.
    at_fault: bool,
}

impl Drive {
    /// This axis, as what this program has in motion is noted.
    pub(crate) fn as_moved(&self) -> MovedAxis {
        let (node, controlword) = (self.node.id(), self.place(CONTROLWORD));
        MovedAxis { node, controlword, axis: self.axis, description: self.description }
    }

    /// Notes that this program has set this axis in motion, or has not seen it stand after what counted as a stop.
    pub fn note_moved(&self) {
        self.node.network().note_axis_moved(self.as_moved());
    }

    /// Notes that this axis was seen to stand.
    pub(super) fn note_stopped(&self) {
        self.node.network().note_stopped(self.node.id(), self.place(CONTROLWORD));
    }

    /// Whether this program has set it in motion, and has not seen it stand since.
    pub(super) fn is_moved(&self) -> bool {
        let own = self.as_moved();
        let axes = self.node.network().moved_axes();
        axes.iter().any(|axis| (axis.node, axis.controlword) == (own.node, own.controlword))
    }

    /// Whether the shaft of an axis without power is seen to stand, now and for some looks.
    pub(super) async fn stands(&self) -> bool {
        let (mut stop_sent, mut rest) =
            (Some(self.node.network().now()), Rest { looks: 0, position: None, at_fault: false });
        // The first look at one that shows its position alone has nothing to compare it with.
        for _ in 0..=STANDSTILL_LOOKS {
            match self.look_at_rest(&mut stop_sent, &mut rest).await {
                Ok(true) => return !rest.at_fault || self.check_sight("see it stand").await.is_ok(),
                Ok(false) => self.node.network().sleep(POLL).await,
                Err(_) => return false,
            }
        }
        false
    }

    /// Stops the drive and waits until it is seen to stand; how long that took. `silence` is how long it may be silent at first.
    pub(super) async fn come_to_rest(&self, silence: Duration) -> Result<Duration, Error> {
        const INTENT: &str = "bring it to rest";
        let network = self.node.network();
        let began = network.now();
        let (mut stop_sent, mut heard, mut silence) = (None, began, silence);
        let mut limit = None;
        let mut rest = Rest { looks: 0, position: None, at_fault: false };
        loop {
            match self.look_at_rest(&mut stop_sent, &mut rest).await {
                Ok(true) => {
                    if rest.at_fault {
                        self.check_sight(INTENT).await?;
                    }
                    self.note_stopped();
                    return Ok(network.now() - began);
                }
                Ok(false) => (heard, silence) = (network.now(), SILENCE),
                // Not a drive: nothing of it can move.
                Err(Error::Aborted { code, .. })
                    if stop_sent.is_none() && code == canopen::AbortCode::NO_SUCH_OBJECT =>
                {
                    self.note_stopped();
                    return Ok(network.now() - began);
                }
                Err(error) if network.now() - heard >= silence => return self.answered(INTENT, Err(error)).await,
                Err(_) => {}
            }
            let limit = match (limit, stop_sent) {
                (Some(limit), _) => limit,
                // Asked only once the stop has been sent.
                (None, Some(_)) => *limit.insert(self.time_to_rest().await),
                (None, None) => SILENCE,
            };
            // One whose last look showed it at rest is looked at once more: the answers may have been slow.
            if network.now() - began >= limit + SILENCE && rest.looks == 0 {
                return Err(self
                    .not_reached(INTENT, Trigger::StillTurning(self.speed_rpm().await.unwrap_or(0.0)))
                    .await);
            }
            network.sleep(POLL).await;
        }
    }

    /// Sends the stop if it has not been sent, or the drive goes on nevertheless; true once it was seen to stand for a
    /// while.
    async fn look_at_rest(&self, stop_sent: &mut Option<Instant>, rest: &mut Rest) -> Result<bool, Error> {
        let network = self.node.network();
        if stop_sent.is_none() {
            // One without power would energise its motor to hold it; it may coast.
            if !(self.may_hold_by_stopping() && self.is_without_power().await) {
                self.write_controlword(STOP).await?;
            }
            *stop_sent = Some(network.now());
        }
        let statusword = self.statusword().await?;
        rest.at_fault = self.power_style().is_faulted(statusword);
        if self.power_state(statusword) == Some(PowerState::OperationEnabled) {
            rest.looks = 0;
            if stop_sent.is_some_and(|at| network.now() - at >= REPEAT) {
                let (node, controlword) = (self.node.id(), self.place(CONTROLWORD));
                network.with_core(|core| core.stop_axis(node, controlword, STOP.0));
                *stop_sent = None;
            }
            return Ok(false);
        }
        let stands = match self.axis_description().and_then(|axis| axis.units.actual_velocity) {
            Some(velocity) => self.stands_at(Rpm(self.read_quantity(velocity).await?)),
            None => {
                let at = i64::from(self.node.read::<i32>(self.place(POSITION_ACTUAL_VALUE)).await?);
                let before = rest.position.replace(at);
                network.sleep(REST_LOOK.saturating_sub(POLL)).await;
                before.is_some_and(|before| (at - before).abs() <= REST_COUNTS)
            }
        };
        rest.looks = if stands { rest.looks + 1 } else { 0 };
        Ok(rest.looks >= STANDSTILL_LOOKS)
    }

    /// Fails where a fault keeps the drive from seeing its shaft: its speed reading is invalid.
    async fn check_sight(&self, intent: &'static str) -> Result<(), Error> {
        let code = match self.node.upload(self.fault_code()).await {
            Ok(payload) => payload.raw() as u16,
            // Such a drive has no fault codes.
            Err(Error::Aborted { .. }) => return Ok(()),
            Err(error) => return self.answered(intent, Err(error)).await,
        };
        match blinding(self.description, code) {
            Some((sensor, remedy)) => Err(self.not_reached(intent, Trigger::Unseen { sensor, remedy }).await),
            None => Ok(()),
        }
    }

    /// True of a drive that a quick stop may give power: one without the state machine, or of an unknown model.
    pub(super) fn may_hold_by_stopping(&self) -> bool {
        self.description.is_none() || self.power_style() != PowerStyle::Cia402
    }

    /// True if the drive soon says that its motor has no power (statusword bit 4) and does not follow set-points.
    pub(super) async fn is_without_power(&self) -> bool {
        let glance = self.node.clone().with_timeout(GLANCE).read::<u16>(self.place(STATUSWORD)).await;
        glance.is_ok_and(|raw| {
            let statusword = Statusword(raw);
            let live = match self.power_style() {
                PowerStyle::EchoesControlword { live, .. } => live,
                _ => Statusword::VOLTAGE_ENABLED,
            };
            !statusword.has(live) && self.power_state(statusword) != Some(PowerState::OperationEnabled)
        })
    }

    /// How long this drive's own stop may take.
    async fn time_to_rest(&self) -> Duration {
        if self.description.is_some() { self.stop_time().await } else { UNKNOWN_RAMP }
    }

    async fn speed_rpm(&self) -> Option<f64> {
        let velocity = self.axis_description()?.units.actual_velocity?;
        self.read_quantity(velocity).await.ok()
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

//! What a watched world remembers, and what it notes.
//!
//! A drive is looked at after each frame and deadline of it, and after each stimulus, and compared with what it was like
//! before; the wire reports itself. Looking changes nothing: [`VirtualDrive::report_of`] reads what is there.

use std::collections::VecDeque;
use std::sync::Arc;

use can::{Frame, Instant};
use canopen::NmtState;
use canopen::connection_set::Service;
use canopen::emcy::Emcy;
use canopen::heartbeat::Heartbeat;
use cia402::{ModeOfOperation, PowerState, Statusword};
use devices::faults::FaultRow;
use devices::{AxisDescription, AxisId, Description, PowerStyle};

use super::member::Member;
use crate::events::{Event, EventKind, MAX_WAITING, PowerPhase};
use crate::stimulus::Place;
use crate::wire::{ErrorCause, ErrorState, WireEvent};
use crate::{Report, VirtualDrive};

/// What a watched world remembers.
#[derive(Clone, Debug, Default)]
pub(super) struct WorldWatch {
    /// By station: its axes as they were when last looked at; none for a station that is not a drive.
    seen: Vec<Vec<AxisCondition>>,
    /// By station: its controller as the wire last reported.
    controllers: Vec<Controller>,
    waiting: VecDeque<Event>,
    missed: u64,
    pub(super) actor: Option<Arc<str>>,
}

/// What events report of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AxisCondition {
    power: PowerPhase,
    nmt: Option<NmtState>,
    state: Option<PowerState>,
    mode: Option<ModeOfOperation>,
    error_code: u32,
    statusword: u16,
    damage: Option<&'static str>,
    storing: bool,
    generation: u64,
}

/// A controller's error state, and the attempts in a row that failed.
#[derive(Clone, Copy, Debug)]
struct Controller {
    state: ErrorState,
    failed: Option<(ErrorCause, Frame)>,
    attempts: u64,
}

impl Controller {
    const NEW: Self = Self { state: ErrorState::ErrorActive, failed: None, attempts: 0 };
}

/// A drive of the world, to be looked at.
#[derive(Clone, Copy)]
struct WatchedDrive<'a> {
    number: u8,
    drive: &'a dyn VirtualDrive,
}

impl WorldWatch {
    pub(super) fn push(&mut self, event: Event) {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting.pop_front();
            self.missed += 1;
        }
        self.waiting.push_back(event);
    }

    pub(super) fn pull(&mut self, now: Instant) -> Option<Event> {
        if self.missed > 0 {
            let at = self.waiting.front().map_or(now, |event| event.at);
            let kind = EventKind::Missed(std::mem::take(&mut self.missed));
            return Some(Event { at, place: None, kind });
        }
        self.waiting.pop_front()
    }

    /// Takes a station as it is for what it was.
    pub(super) fn get_to_know(&mut self, i: usize, member: &Member) {
        let seen = match member {
            Member::Drive { number, drive } => {
                let subject = WatchedDrive { number: *number, drive: &**drive };
                (0..drive.axes()).map(|axis| subject.condition(AxisId(axis))).collect()
            }
            _ => Vec::new(),
        };
        self.seen.resize(self.seen.len().max(i + 1), Vec::new());
        self.seen[i] = seen;
    }

    pub(super) fn look_at(&mut self, i: usize, member: &Member, now: Instant) {
        let Member::Drive { number, drive } = member else { return };
        let subject = WatchedDrive { number: *number, drive: &**drive };
        for axis in 0..drive.axes() {
            let after = subject.condition(AxisId(axis));
            let Some(before) = self.seen.get_mut(i).and_then(|axes| axes.get_mut(usize::from(axis))) else { continue };
            let before = std::mem::replace(before, after);
            if before != after {
                let place = Place { node: subject.number, axis: AxisId(axis) };
                subject.compare(place, &before, &after, |kind| self.push(Event { at: now, place: Some(place), kind }));
            }
        }
    }

    pub(super) fn hear(&mut self, event: &WireEvent, members: &[Member]) {
        self.controllers.resize(members.len(), Controller::NEW);
        match *event {
            WireEvent::Frame { end, source, frame, .. } => {
                self.controllers[source].attempts = 0;
                self.hear_frame(end, &frame, &members[source]);
            }
            WireEvent::Error { at, source, frame, cause } => {
                let controller = &mut self.controllers[source];
                if controller.failed != Some((cause, frame)) {
                    *controller = Controller { failed: Some((cause, frame)), attempts: 0, ..*controller };
                }
                controller.attempts += 1;
                let attempt = controller.attempts;
                if attempt.is_power_of_two() {
                    let place = place_of(&members[source]);
                    self.push(Event { at, place, kind: EventKind::BusError { cause, frame, attempt } });
                }
            }
            WireEvent::State { at, controller, state } => {
                let from = std::mem::replace(&mut self.controllers[controller].state, state);
                let place = place_of(&members[controller]);
                self.push(Event { at, place, kind: EventKind::BusState { from, to: state } });
            }
        }
    }

    /// Boot-up and EMCY, by the identifiers of the predefined connection set (CiA 301, 7.3.5).
    fn hear_frame(&mut self, at: Instant, frame: &Frame, source: &Member) {
        let (node, kind) = match Service::of(frame.id()) {
            Some(Service::Heartbeat(node)) if Heartbeat::parse(frame).is_some_and(Heartbeat::is_boot_up) => {
                (node, EventKind::Boot)
            }
            Some(Service::Emcy(node)) => {
                let Some(emcy) = Emcy::parse(frame) else { return };
                let description = match source {
                    Member::Drive { drive, .. } => drive.description(),
                    _ => None,
                };
                (node, EventKind::Emcy { emcy, row: description.and_then(|model| model.fault_reported_by(emcy.code)) })
            }
            _ => return,
        };
        let place = place_of(source).unwrap_or(Place::node(node.raw()));
        self.push(Event { at, place: Some(place), kind });
    }
}

fn place_of(member: &Member) -> Option<Place> {
    match member {
        Member::Drive { number, .. } => Some(Place::node(*number)),
        _ => None,
    }
}

/// A drive whose manual gives the bit another meaning than the standard.
fn is_own(axis: &AxisDescription, bit: u16) -> bool {
    axis.statusword_bits.iter().any(|(mask, _)| mask & bit != 0)
}

impl WatchedDrive<'_> {
    fn description(self) -> Option<&'static Description> {
        self.drive.description()
    }

    fn condition(self, axis: AxisId) -> AxisCondition {
        let Report { powered, power, nmt, state, mode, error_code, statusword, damage, .. } =
            self.drive.report_of(axis);
        AxisCondition {
            power,
            nmt,
            state,
            mode,
            // A drive that is dead has forgotten what was wrong, and shows nothing.
            error_code: if powered { error_code } else { 0 },
            // Bits that events report; the others change with every set-point.
            statusword: statusword.unwrap_or(0) & (Statusword::TARGET_REACHED | Statusword::INTERNAL_LIMIT_ACTIVE),
            damage,
            storing: self.drive.is_storing(),
            generation: self.drive.nvm_generation(),
        }
    }

    /// Reports to `note` how the one differs from the other. What is the whole drive's is reported at its first axis.
    fn compare(self, place: Place, before: &AxisCondition, after: &AxisCondition, mut note: impl FnMut(EventKind)) {
        let first = place.axis == AxisId::FIRST;
        if first && before.power != after.power {
            note(EventKind::Power(after.power));
        }
        if let (true, Some(to)) = (first && before.nmt != after.nmt, after.nmt) {
            note(EventKind::Nmt { from: before.nmt, to });
        }
        if before.error_code != after.error_code {
            self.compare_faults(before.error_code, after.error_code, &mut note);
        }
        if let (true, Some(to)) = (before.state != after.state, after.state) {
            note(EventKind::State { from: before.state, to });
        }
        if let (true, Some(mode)) = (before.mode != after.mode, after.mode) {
            note(EventKind::Mode(mode));
        }
        self.compare_bits(place.axis, before, after, &mut note);
        if let (true, Some(damage)) = (before.damage != after.damage, after.damage) {
            note(EventKind::Damage(damage));
        }
        if first && after.storing && !before.storing {
            note(EventKind::StoreBegun);
        }
        if first && before.generation != after.generation {
            note(EventKind::StoreDone { generation: after.generation });
        }
    }

    /// Of a drive that shows several faults at once, as bits, each bit is one.
    fn compare_faults(self, before: u32, after: u32, note: &mut impl FnMut(EventKind)) {
        let faults = self.description().map(|model| model.faults);
        let row = |code: u32| -> Option<&'static FaultRow> {
            faults.and_then(|faults| faults.table.iter().find(|row| u32::from(row.code) == code))
        };
        if !faults.is_some_and(|faults| faults.bit_field) {
            match (before, after) {
                (code, 0) => note(EventKind::FaultReset { code, row: row(code) }),
                (_, code) => note(EventKind::Fault { code, row: row(code) }),
            }
            return;
        }
        let bits = |value: u32| (0..u32::BITS).map(|bit| 1 << bit).filter(move |bit| value & bit != 0);
        bits(before & !after).for_each(|code| note(EventKind::FaultReset { code, row: row(code) }));
        bits(after & !before).for_each(|code| note(EventKind::Fault { code, row: row(code) }));
    }

    /// A drive that echoes its controlword has bit 10 like others, and bit 11 for something of its own.
    fn compare_bits(
        self,
        axis: AxisId,
        before: &AxisCondition,
        after: &AxisCondition,
        note: &mut impl FnMut(EventKind),
    ) {
        let changed = before.statusword ^ after.statusword;
        let is_set = |bit| after.statusword & bit != 0;
        if changed & Statusword::TARGET_REACHED != 0
            && is_set(Statusword::TARGET_REACHED)
            && after.state == Some(PowerState::OperationEnabled)
        {
            note(EventKind::TargetReached);
        }
        let has_limit_bit = self
            .description()
            .and_then(|model| model.axes.get(usize::from(axis.0)))
            .is_some_and(|axis| axis.power == PowerStyle::Cia402 && !is_own(axis, Statusword::INTERNAL_LIMIT_ACTIVE));
        if changed & Statusword::INTERNAL_LIMIT_ACTIVE != 0 && has_limit_bit {
            note(EventKind::InternalLimit(is_set(Statusword::INTERNAL_LIMIT_ACTIVE)));
        }
    }
}

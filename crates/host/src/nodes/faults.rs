//! The entries of the timeline: emergency messages, faults and states of drives, and why they were stopped.

use can::Instant;
use canopen::emcy::{Emcy, EmcyErrorCode};
use canopen::{Mux, NmtState, NodeId};
use cia402::object::{ERROR_CODE, STATUSWORD};
use devices::Description;
use devices::faults::FaultRow;
use master::core::Event;
use master::{Drive, Error};

use crate::snapshot::DriveView;
use crate::state::Host;
use crate::timeline::{Kind, TimelineEvent};

const CHECK_SUPPLY: &str =
    "Check its supply and its cable; it may also have restarted with another node-ID or bit rate.";

impl Host {
    /// An event of the network.
    pub(crate) fn note_event(&self, at: Instant, event: &Event) {
        match event {
            Event::Emcy(node, emcy) => self.note_emcy(at, *node, *emcy),
            Event::BootUp(node) => {
                // A device starts without errors (CiA 301, 7.2.7.1).
                self.inbox.timeline.end_but(at, *node, Kind::Emcy, &[]);
                self.report(TimelineEvent::new(at, *node, Kind::Nmt, "booted"));
            }
            Event::NmtState(node, state) => self.note_nmt(at, *node, *state),
            Event::HeartbeatLost(node, silence) => {
                let what = silence.to_string();
                self.report(TimelineEvent {
                    remedy: Some(CHECK_SUPPLY),
                    ..TimelineEvent::new(at, *node, Kind::Silent, what)
                });
            }
            Event::HeartbeatBack(node) => self.inbox.timeline.end_but(at, *node, Kind::Silent, &[]),
            _ => {}
        }
    }

    fn note_emcy(&self, at: Instant, node: NodeId, emcy: Emcy) {
        if emcy.code == EmcyErrorCode::NO_ERROR {
            return self.inbox.timeline.end_but(at, node, Kind::Emcy, &[]);
        }
        let model = self.description(node);
        let row = model.and_then(|model| model.fault_reported_by(emcy.code));
        let name = row.map_or_else(|| emcy.code.to_string(), |row| row.name.to_owned());
        let what = format!("{name}, error register {:02X}h", emcy.error_register);
        let event = TimelineEvent { code: Some(emcy.code.0), ..TimelineEvent::new(at, node, Kind::Emcy, what) };
        self.report(explained(event, model, row));
    }

    fn note_nmt(&self, at: Instant, node: NodeId, state: NmtState) {
        let tells_alarm = self.description(node).is_some_and(|model| model.tells_alarm(state));
        let what = match tells_alarm {
            true => "its heartbeat reports an alarm".to_owned(),
            false => format!("NMT state {state}"),
        };
        self.report(TimelineEvent::new(at, node, Kind::Nmt, what));
    }

    /// A drive was read: reports what has changed since the last reading.
    pub(crate) fn note_look(&self, id: NodeId, view: &DriveView) {
        let looked_at = Instant::from_nanos((view.at_s * 1e9).round() as u64);
        let model = self.description(id);
        // The time of the reporting frame, if it was an answer to a reading.
        let reported_at = |object: Mux| {
            let held = self.inbox.trace.held();
            held.answered_at(id, self.object_of_axis(id, object), looked_at).unwrap_or(looked_at)
        };
        let at = looked_at;
        self.inbox.timeline.end_but(at, id, Kind::Silent, &[]);
        let before = self.nodes.get(&id).and_then(|node| node.view.as_ref());
        if let Some(before) = before.and_then(|before| before.state)
            && let Some(now) = view.state
            && before != now
        {
            self.report(TimelineEvent::new(reported_at(STATUSWORD), id, Kind::State, format!("{before} → {now}")));
        }
        let rows: Vec<_> = model.map(|model| rows(model, view)).unwrap_or_default();
        let codes: Vec<_> = match rows.as_slice() {
            // A code that is in no table is a fault too.
            [] => view.fault_code.filter(|code| *code != 0).into_iter().map(Some).collect(),
            rows => rows.iter().map(|row| Some(row.code)).collect(),
        };
        self.inbox.timeline.end_but(at, id, Kind::Fault, &codes);
        if codes.is_empty() {
            return;
        }
        let at = reported_at(model.and_then(|model| model.faults.code).unwrap_or(ERROR_CODE));
        for code in codes {
            let row = rows.iter().copied().find(|row| Some(row.code) == code);
            let what = row.map_or("a fault that is not in its description", |row| row.name);
            self.report(explained(TimelineEvent { code, ..TimelineEvent::new(at, id, Kind::Fault, what) }, model, row));
        }
    }

    /// A drive does not answer.
    pub(crate) fn note_silence(&self, id: NodeId, error: &Error) {
        let event = TimelineEvent::new(self.network.now(), id, Kind::Silent, error.to_string());
        self.report(TimelineEvent { remedy: Some(CHECK_SUPPLY), ..event });
    }

    /// This studio stops a drive.
    pub(crate) fn note_stop(&self, id: NodeId, why: &str) {
        self.report(TimelineEvent::new(self.network.now(), id, Kind::Stop, why));
    }

    fn report(&self, event: TimelineEvent) {
        self.inbox.timeline.push(event);
    }

    /// The object of the observed axis that corresponds to one of the first axis.
    fn object_of_axis(&self, id: NodeId, object: Mux) -> Mux {
        let drive = self.nodes.get(&id).and_then(|node| node.drive.as_ref());
        drive.and_then(Drive::axis_description).map_or(object, |axis| axis.object(object))
    }

    /// An event in words: an emergency message in those of the model's fault table.
    pub(crate) fn words_of(&self, event: &Event) -> String {
        let Event::Emcy(node, emcy) = event else { return event.to_string() };
        match self.description(*node).and_then(|model| model.fault_reported_by(emcy.code)) {
            Some(row) => format!("node {node}: emergency {:04X}h ({})", emcy.code.0, row.name),
            None => event.to_string(),
        }
    }

    fn description(&self, id: NodeId) -> Option<&'static Description> {
        self.nodes.get(&id).and_then(|node| node.drive.as_ref()).and_then(Drive::description)
    }
}

/// The faults found by a reading.
fn rows(model: &'static Description, view: &DriveView) -> Vec<&'static FaultRow> {
    let shown = |row: &&FaultRow| view.faults.iter().any(|fault| fault.name == row.name);
    model.faults.table.iter().filter(shown).collect()
}

fn explained(event: TimelineEvent, model: Option<&Description>, row: Option<&'static FaultRow>) -> TimelineEvent {
    let source = model.filter(|_| row.is_some()).map(|model| format!("{}, {}", model.manual, model.faults.section));
    TimelineEvent { remedy: row.map(|row| row.remedy), source, ..event }
}

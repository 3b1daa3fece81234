//! The power drive state machine, as a table for pages.

use cia402::{PowerEvent, PowerState, TRANSITIONS};
use serde_json::{Value, json};

/// The power drive state machine (CiA 402-2, 8.2) as a page draws it, as JSON: `states` and `transitions`. Transitions 0 (start) and 13 (a fault, from any state) are not rows of
/// the table.
pub fn power_states() -> String {
    let states: Vec<_> = PowerState::ALL.iter().map(|state| state.name()).collect();
    let transitions: Vec<Value> = TRANSITIONS
        .iter()
        .map(|row| {
            let event = match row.event {
                PowerEvent::Command(command) => command.name(),
                PowerEvent::SelfTestDone => "self-test done",
                PowerEvent::FaultOccurred => "fault",
                PowerEvent::FaultReactionDone => "fault reaction done",
                PowerEvent::QuickStopDone => "quick stop done",
            };
            json!({ "number": row.number, "from": row.from.name(), "to": row.to.name(), "event": event })
        })
        .collect();
    json!({ "states": states, "transitions": transitions }).to_string()
}

//! The state that is sent to pages, as JSON: the bus, its nodes, and the values of each drive.
//!
//! Units are in the names. Values that a device does not have or has not sent are `null`.

use cia402::{Controlword, PowerEvent, PowerState, next_command, transition};
use devices::PowerStyle;
use devices::faults::FaultRow;
use master::drive::DriveState;
use serde::Serialize;

use crate::wire::Health;

use crate::session::authority::SessionId;

/// The state of everything at one time.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Snapshot<'a> {
    #[serde(rename = "type")]
    pub(crate) kind: &'static str,
    /// Counts the states; a gap shows how many a slow reader missed.
    pub(crate) number: u64,
    /// Time of the bus.
    pub(crate) time_s: f64,
    pub(crate) bus: BusView<'a>,
    /// A scan is under way.
    pub(crate) scanning: bool,
    pub(crate) sessions: usize,
    /// The session that has control.
    pub(crate) controller: Option<SessionId>,
    /// The session that asked for it last.
    pub(crate) asking: Option<SessionId>,
    /// The speed limit of the session that has control, in r/min; `null` without a limit.
    pub(crate) speed_limit_rpm: Option<f64>,
    /// Rises when there is something new at `/api/faults`.
    pub(crate) happenings: u64,
    /// How often the trace was saved since the studio started.
    pub(crate) logs_saved: u64,
    /// Number of changes to the world around virtual drives.
    pub(crate) changes: u64,
    pub(crate) nodes: Vec<NodeView<'a>>,
}

/// The bus.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct BusView<'a> {
    pub(crate) name: &'a str,
    pub(crate) bitrate: Option<u32>,
    pub(crate) frames_per_s: u32,
    /// Bus load in per cent; `null` where the bit rate is unknown.
    pub(crate) load_percent: Option<f64>,
    /// Health as reported by the controller and the connection.
    pub(crate) health: Health,
}

/// A node.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct NodeView<'a> {
    pub(crate) node: u8,
    pub(crate) model: Option<&'a str>,
    pub(crate) title: Option<&'a str>,
    /// What is uncertain about its model.
    pub(crate) remark: Option<&'a str>,
    pub(crate) device_type: Option<u32>,
    pub(crate) vendor_id: Option<u32>,
    pub(crate) product_code: Option<u32>,
    pub(crate) revision_number: Option<u32>,
    pub(crate) nmt: Option<String>,
    pub(crate) heartbeat_age_ms: Option<u64>,
    /// Why its values are unknown now.
    pub(crate) trouble: Option<&'a str>,
    /// The command in progress.
    pub(crate) doing: Option<&'static str>,
    /// This studio has set it in motion.
    pub(crate) moving: bool,
    /// A stop was commanded and it has not been seen at rest since: it may still be moving.
    pub(crate) stop_unseen: bool,
    /// Writes of parameters that can be rolled back.
    pub(crate) can_roll_back: usize,
    /// How often it has stored its parameters since the studio started.
    pub(crate) stored: u32,
    /// How often its PDOs were configured since the studio started.
    pub(crate) mapped: u32,
    /// What it does when this program dies; `null` where that is not yet known.
    pub(crate) without_us: Option<String>,
    /// Nothing stops it then: it keeps moving.
    pub(crate) goes_on: bool,
    /// The session that has control has accepted that it keeps moving then.
    pub(crate) accepted: bool,
    /// Present if the node is a drive.
    pub(crate) drive: Option<&'a DriveView>,
}

/// A drive.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DriveView {
    /// When it was read, in the time of the bus.
    pub(crate) at_s: f64,
    pub(crate) state: Option<&'static str>,
    /// It has the power state machine of CiA 402; else its state is the closest one.
    pub(crate) has_state_machine: bool,
    pub(crate) statusword: u16,
    /// Its bits that are set, in words.
    pub(crate) status_bits: Vec<&'static str>,
    pub(crate) controlword: Option<u16>,
    pub(crate) control_bits: Vec<&'static str>,
    /// The steps from here to Operation enabled.
    pub(crate) way: Vec<Step>,
    pub(crate) mode: Option<i8>,
    pub(crate) mode_name: Option<&'static str>,
    pub(crate) fault_code: u16,
    pub(crate) faults: Vec<FaultView>,
    pub(crate) position_counts: Option<i64>,
    pub(crate) angle_degrees: Option<f64>,
    pub(crate) velocity_rpm: Option<f64>,
    pub(crate) current_a: Option<f64>,
    pub(crate) supply_v: Option<f64>,
    pub(crate) motor_celsius: Option<f64>,
    pub(crate) driver_celsius: Option<f64>,
}

/// One step of the power state machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Step {
    pub(crate) controlword: u16,
    pub(crate) to: &'static str,
}

/// A fault, with what to do about it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FaultView {
    pub(crate) name: &'static str,
    pub(crate) remedy: &'static str,
}

/// Bits of the controlword with the same meaning in all modes (CiA 402-2, 8.4.1).
pub(crate) const CONTROL_BITS: [(u16, &str); 6] = [
    (Controlword::SWITCH_ON, "switch on"),
    (Controlword::ENABLE_VOLTAGE, "enable voltage"),
    (Controlword::QUICK_STOP, "no quick stop"),
    (Controlword::ENABLE_OPERATION, "enable operation"),
    (Controlword::FAULT_RESET, "fault reset"),
    (Controlword::HALT, "halt"),
];

impl DriveView {
    /// The values read from a drive, with its controlword if it can be read.
    pub(crate) fn new(state: &DriveState, controlword: Option<u16>, at_s: f64) -> Self {
        let faults = state.faults.iter().map(|FaultRow { name, remedy, .. }| FaultView { name, remedy });
        let control_bits = CONTROL_BITS.iter().filter(|(mask, _)| controlword.is_some_and(|word| word & mask != 0));
        Self {
            at_s,
            state: state.power.map(PowerState::name),
            has_state_machine: state.style == PowerStyle::Cia402,
            statusword: state.statusword.0,
            status_bits: state.statusword_words(),
            controlword,
            control_bits: control_bits.map(|(_, name)| *name).collect(),
            way: state.power.map(|power| way(state.style, power)).unwrap_or_default(),
            mode: state.mode.map(|mode| mode.0),
            mode_name: state.mode.and_then(cia402::ModeOfOperation::name),
            fault_code: state.fault_code,
            faults: faults.collect(),
            position_counts: state.position.map(|position| position.0),
            angle_degrees: state.angle.map(|angle| angle.0),
            velocity_rpm: state.velocity.map(|velocity| velocity.0),
            current_a: state.current.map(|current| current.0),
            supply_v: state.supply.map(|supply| supply.0),
            motor_celsius: state.motor_temperature.map(|temperature| temperature.0),
            driver_celsius: state.driver_temperature.map(|temperature| temperature.0),
        }
    }
}

/// The steps of CiA 402-2, table 9, that lead to Operation enabled. A drive without that state machine takes one.
fn way(style: PowerStyle, mut state: PowerState) -> Vec<Step> {
    let enabled = PowerState::OperationEnabled;
    if style != PowerStyle::Cia402 {
        let step = Step { controlword: cia402::PowerCommand::EnableOperation.controlword().0, to: enabled.name() };
        return if state == enabled { Vec::new() } else { vec![step] };
    }
    let mut steps = Vec::new();
    // The path is never longer than the number of states.
    while let Some(command) = next_command(state).filter(|_| steps.len() < PowerState::ALL.len()) {
        let Some(arrow) = transition(state, PowerEvent::Command(command)) else { break };
        state = arrow.to;
        steps.push(Step { controlword: command.controlword().0, to: state.name() });
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_to_operation_enabled_is_that_of_the_standard() {
        // CiA 402-2, table 9: transitions 15, 2, 3 and 4.
        let step = |controlword, to: PowerState| Step { controlword, to: to.name() };
        let from_fault = [
            step(0x80, PowerState::SwitchOnDisabled),
            step(0x06, PowerState::ReadyToSwitchOn),
            step(0x07, PowerState::SwitchedOn),
            step(0x0F, PowerState::OperationEnabled),
        ];
        assert_eq!(way(PowerStyle::Cia402, PowerState::Fault), from_fault);
        assert_eq!(way(PowerStyle::Cia402, PowerState::SwitchOnDisabled), from_fault[1..]);
        assert_eq!(way(PowerStyle::Cia402, PowerState::OperationEnabled), []);
        assert_eq!(way(PowerStyle::Cia402, PowerState::NotReadyToSwitchOn), [], "it leaves this state by itself");
    }
}

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
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(tag = "type", rename = "state")]
pub struct Snapshot {
    /// Counts the states; a gap shows how many a slow reader missed.
    pub number: u64,
    /// Time of the bus.
    pub time_s: f64,
    /// The bus.
    pub bus: BusView,
    /// A scan is under way.
    pub scanning: bool,
    /// Number of sessions.
    pub sessions: usize,
    /// The session that has control.
    pub controller: Option<SessionId>,
    /// The session that asked for it last.
    pub asking: Option<SessionId>,
    /// The speed limit of the session that has control, in r/min; `null` without a limit.
    pub speed_limit_rpm: Option<f64>,
    /// Rises when there is something new at `/api/faults`.
    pub happenings: u64,
    /// How often everything was stopped: by a press of stop, or by the host alone what this program has moved.
    pub stops: u64,
    /// How often the trace was saved since the studio started.
    pub logs_saved: u64,
    /// Number of changes to the world around virtual drives.
    pub changes: u64,
    /// The nodes, by node-ID.
    pub nodes: Vec<NodeView>,
}

/// The bus as the state shows it: its bit rate in bit/s, how much of it is used, and whether it works.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BusView {
    /// Its name.
    pub name: String,
    /// Bit rate in bit/s.
    pub bitrate: Option<u32>,
    /// Frames in the last second.
    pub frames_per_s: u32,
    /// Bus load in per cent; `null` where the bit rate is unknown.
    pub load_percent: Option<f64>,
    /// Health as reported by the controller and the connection.
    pub health: Health,
}

/// A node of the bus as the state shows it: what it is, what it does, and why its values are unknown if they are.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NodeView {
    /// Node-ID.
    pub node: u8,
    /// Name of its model.
    pub model: Option<&'static str>,
    /// The model as people call it.
    pub title: Option<&'static str>,
    /// What is uncertain about its model.
    pub remark: Option<String>,
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:01.
    pub vendor_id: Option<u32>,
    /// 1018h:02.
    pub product_code: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
    /// NMT state.
    pub nmt: Option<String>,
    /// Time since its last heartbeat.
    pub heartbeat_age_ms: Option<u64>,
    /// Why its values are unknown now.
    pub trouble: Option<String>,
    /// The command in progress.
    pub doing: Option<&'static str>,
    /// This studio has set it in motion.
    pub moving: bool,
    /// A stop was commanded and it has not been seen at rest since: it may still be moving.
    pub stop_unseen: bool,
    /// Writes of parameters that can be rolled back.
    pub can_roll_back: usize,
    /// How often it has stored its parameters since the studio started.
    pub stored: u32,
    /// How often its PDOs were configured since the studio started.
    pub mapped: u32,
    /// What it does when this program dies; `null` where that is not yet known.
    pub without_us: Option<String>,
    /// Nothing stops it then: it keeps moving.
    pub goes_on: bool,
    /// The session that has control has accepted that it keeps moving then.
    pub accepted: bool,
    /// What moves along with a turn of its output, in m, as the machine file says.
    pub feed_m: Option<f64>,
    /// Present if the node is a drive.
    pub drive: Option<Box<DriveView>>,
}

/// A drive as the state shows it, in physical units; each value is absent where the model has no object for it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DriveView {
    /// When it was read, in the time of the bus.
    pub at_s: f64,
    /// State of the power state machine.
    pub state: Option<&'static str>,
    /// It has the power state machine of CiA 402; else its state is the closest one.
    pub has_state_machine: bool,
    /// 6041h.
    pub statusword: u16,
    /// Its bits that are set, in words.
    pub status_bits: Vec<&'static str>,
    /// 6040h, if it can be read.
    pub controlword: Option<u16>,
    /// Its bits that are set, in words.
    pub control_bits: Vec<&'static str>,
    /// The steps from here to Operation enabled.
    pub way: Vec<Step>,
    /// 6061h.
    pub mode: Option<i8>,
    /// The mode of operation in words.
    pub mode_name: Option<&'static str>,
    /// 603Fh, or what the drive has in its place; `None` where it refuses to show it.
    pub fault_code: Option<u16>,
    /// What it reports.
    pub faults: Vec<FaultView>,
    /// Position in counts.
    pub position_counts: Option<i64>,
    /// Angle of the output.
    pub angle_degrees: Option<f64>,
    /// Speed of the output in r/min.
    pub velocity_rpm: Option<f64>,
    /// Motor current.
    pub current_a: Option<f64>,
    /// Voltage of the supply.
    pub supply_v: Option<f64>,
    /// Temperature of the motor.
    pub motor_celsius: Option<f64>,
    /// Temperature of the power stage.
    pub driver_celsius: Option<f64>,
}

/// One step of the power state machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Step {
    /// What is sent.
    pub controlword: u16,
    /// State that it leads to.
    pub to: &'static str,
}

/// A fault, with what to do about it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FaultView {
    /// What it is.
    pub name: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "news")]
pub struct News {
    /// Time of the bus.
    pub time_s: f64,
    /// The node concerned.
    pub node: Option<u8>,
    /// In words.
    pub text: String,
}

impl Snapshot {
    /// The node of this node-ID.
    pub fn node(&self, number: u8) -> Option<&NodeView> {
        self.nodes.iter().find(|node| node.node == number)
    }
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
    fn news_are_a_message_of_their_type() {
        let news = News { time_s: 1.5, node: Some(4), text: "node 4 booted".into() };
        let json = serde_json::to_value(news).expect("JSON");
        assert_eq!(json, serde_json::json!({ "type": "news", "time_s": 1.5, "node": 4, "text": "node 4 booted" }));
    }

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

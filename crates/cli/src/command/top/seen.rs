//! What the host shows, as far as the terminal needs it: the same state that a page in a browser reads (`/api/state`).

use serde::Deserialize;

/// The state of everything.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct State {
    pub(super) time_s: f64,
    pub(super) bus: Bus,
    pub(super) scanning: bool,
    pub(super) controller: Option<u64>,
    pub(super) nodes: Vec<Node>,
}

/// The bus.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Bus {
    pub(super) name: String,
    pub(super) bitrate: Option<u32>,
    pub(super) frames_per_s: u32,
    pub(super) load_percent: Option<f64>,
}

/// A node.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Node {
    pub(super) node: u8,
    pub(super) model: Option<String>,
    pub(super) remark: Option<String>,
    pub(super) nmt: Option<String>,
    pub(super) heartbeat_age_ms: Option<u64>,
    pub(super) trouble: Option<String>,
    pub(super) doing: Option<String>,
    pub(super) without_us: Option<String>,
    /// Nothing stops it when this program dies,
    #[serde(default)]
    pub(super) goes_on: bool,
    /// which the session in control has accepted.
    #[serde(default)]
    pub(super) accepted: bool,
    /// It was commanded to stop and has not been seen to stand since.
    #[serde(default)]
    pub(super) stop_unseen: bool,
    pub(super) drive: Option<Drive>,
}

/// What a drive says of itself.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Drive {
    pub(super) at_s: f64,
    pub(super) state: Option<String>,
    pub(super) mode_name: Option<String>,
    pub(super) fault_code: u16,
    pub(super) faults: Vec<Fault>,
    pub(super) angle_degrees: Option<f64>,
    pub(super) velocity_rpm: Option<f64>,
    pub(super) current_a: Option<f64>,
    pub(super) supply_v: Option<f64>,
    pub(super) motor_celsius: Option<f64>,
    pub(super) driver_celsius: Option<f64>,
}

/// A fault, with what to do about it.
#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct Fault {
    pub(super) name: String,
    pub(super) remedy: String,
}

/// Something that happened.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct News {
    pub(super) time_s: f64,
    pub(super) node: Option<u8>,
    pub(super) text: String,
}

impl State {
    /// A node of this number.
    pub(super) fn node(&self, number: u8) -> Option<&Node> {
        self.nodes.iter().find(|node| node.node == number)
    }
}

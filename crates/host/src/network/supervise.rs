//! What happens on a network that is watched, as rows.

use can::Instant;
use canopen::NodeId;
use master::supervise::SupervisorEvent;
use serde::Serialize;

/// Something that happened.
#[derive(Debug, Serialize)]
pub struct WatchedEvent {
    /// In s since the time of the bus began.
    pub t: f64,
    /// `boot_up`, `heartbeat_lost`, `emcy` and others, as `docs/json.md` lists them.
    pub kind: &'static str,
    /// The node that it is about.
    pub node: Option<u8>,
    /// Of an emergency message: its error code.
    pub code: Option<u16>,
    /// In words.
    pub text: String,
}

impl WatchedEvent {
    /// What happened at this time.
    pub fn new(at: Instant, happening: &SupervisorEvent) -> Self {
        let code = if let SupervisorEvent::Emcy(record) = happening { Some(record.emcy.code.0) } else { None };
        Self {
            t: at.as_secs_f64(),
            kind: happening.kind(),
            node: happening.node().map(NodeId::raw),
            code,
            text: happening.to_string(),
        }
    }
}

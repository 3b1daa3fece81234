//! Commands to the PDOs of a node and to its NMT state, as JSON.

use serde::Deserialize;

/// What is done with the PDOs of a node.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PdoCommand {
    /// Reads the configuration of the PDOs of a node, what may be changed, and why one is not sent.
    Pdos {},
    /// Plans a configuration of PDOs, with its effect on the bus, without writing.
    PlanPdos {
        /// The new configuration.
        pdos: Vec<NewPdo>,
        /// Period of SYNC for which the load is computed.
        cycle_ms: f64,
        /// In bit/s, if the host does not know it.
        bitrate: Option<u32>,
    },
    /// Configures PDOs, all or nothing.
    WritePdos {
        /// The new configuration.
        pdos: Vec<NewPdo>,
    },
    /// Starts a node, or takes it out of operational: PDOs exist only there (CiA 301, 7.3.2.2).
    Nmt {
        /// Which of the two.
        command: NmtChange,
    },
}

impl PdoCommand {
    pub(super) const WORDS: &[&str] = &["pdos", "plan_pdos", "write_pdos", "nmt"];

    /// Whether it changes the node.
    pub(super) const fn needs_control(&self) -> bool {
        matches!(self, Self::WritePdos { .. } | Self::Nmt { .. })
    }
}

/// A configuration of a PDO; omitted fields stay as they are:
/// `{"pdo":"TPDO1","valid":true,"objects":[{"object":"6041h:00","bits":16}],"transmission":255,"event_ms":100}`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewPdo {
    /// Which one: `TPDO1`.
    pub pdo: String,
    /// Whether it exists.
    pub valid: bool,
    /// What it carries.
    pub objects: Option<Vec<NewEntry>>,
    /// Transmission type (CiA 301, tables 64 and 68).
    pub transmission: Option<u8>,
    /// Inhibit time.
    pub inhibit_ms: Option<f64>,
    /// Event timer.
    pub event_ms: Option<f64>,
    /// Its CAN-ID.
    pub id: Option<u16>,
}

/// An object in a PDO.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewEntry {
    /// `6041h:00`.
    pub object: String,
    /// Its length.
    pub bits: u8,
}

/// The NMT commands that a page may give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NmtChange {
    /// Start remote node.
    Start,
    /// Enter pre-operational.
    PreOperational,
}

//! How the PDOs of a node are set up, as rows.

use std::time::Duration;

use canopen::CobId;
use devices::Description;
use master::pdo::{PdoConfig, Silence};
use serde::Serialize;

use super::params::name;

/// How one PDO is configured.
#[derive(Debug, Serialize)]
pub struct PdoSetup {
    /// `TPDO1`, counted from 1 as by CiA 301.
    pub pdo: String,
    /// The identifier.
    pub id: u32,
    /// It is sent, or taken.
    pub valid: bool,
    /// The transmission type.
    pub transmission: u8,
    /// When it is sent, or takes effect.
    pub when: String,
    /// The inhibit time in ms.
    pub inhibit_ms: Option<f64>,
    /// The event timer in ms.
    pub event_ms: Option<f64>,
    /// What it carries, in the order of the wire.
    pub objects: Vec<Mapped>,
    /// Why it is silent, as far as that is known.
    pub silent: Vec<String>,
}

/// An object in a PDO.
#[derive(Debug, Serialize)]
pub struct Mapped {
    /// The object, such as `6041h:00`.
    pub object: String,
    /// Its name, if the model or the standard has it.
    pub name: Option<&'static str>,
    /// Its length.
    pub bits: u8,
}

impl PdoSetup {
    /// A PDO of a model.
    pub fn new(model: Option<&'static Description>, config: &PdoConfig, cob_id: CobId, silent: &[Silence]) -> Self {
        let ms = |time: Option<Duration>| time.map(|time| time.as_nanos() as f64 / 1e6);
        let mapped = config.map.0.iter().map(|record| Mapped {
            object: record.mux.to_string(),
            name: name(model, record.mux),
            bits: record.bits,
        });
        Self {
            pdo: config.pdo.to_string(),
            id: cob_id.can_id().raw(),
            valid: cob_id.is_valid(),
            transmission: config.transmission.0,
            when: config.when(),
            inhibit_ms: ms(config.inhibit_time),
            event_ms: ms(config.event_time),
            objects: mapped.collect(),
            silent: silent.iter().map(ToString::to_string).collect(),
        }
    }

    /// Its identifier for people.
    pub fn id_text(&self) -> String {
        if self.valid { format!("{:03X}h", self.id) } else { "off".into() }
    }

    /// What it carries for people: each object with its name and its bits.
    pub fn carries(&self) -> String {
        let carries = self.objects.iter().map(|mapped| match mapped.name {
            Some(name) => format!("{} {name} ({})", mapped.object, mapped.bits),
            None => format!("{} ({})", mapped.object, mapped.bits),
        });
        carries.collect::<Vec<_>>().join(", ")
    }
}

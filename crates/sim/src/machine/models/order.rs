//! Drives as one orders them: a model by its name, with an address, a bit rate, and what is special about this one.

use super::boxed::Boxed;
use crate::Refused;
use can::Bitrate;
use canopen::lss::UNCONFIGURED;
use canopen::od::{Dictionary, Entry, Storage};
use canopen::{AbortCode, Mux, NodeId};
use devices::Description;
use devices::row::is_parameter;
use devices::variant::{Preset, PresetError, Variant};
use drives::Fidelity;
use drives::engine::storage::StoredImage;
use drives::node::{Memory, is_makers_mark, is_storable};
use drives::servo::SpeedWorth;

/// What is wanted of a drive beside its model.
#[derive(Clone, Debug)]
pub struct Order {
    /// Node-ID at the first start.
    pub node: NodeId,
    /// Bit rate at the first start.
    pub bitrate: Bitrate,
    /// How it differs from others of its model.
    pub variant: Variant,
    /// Values in its parameter store that are not the factory's.
    pub presets: Vec<Preset>,
    /// It has no node-ID until LSS (CiA 305) gives it one; `node` is what the world calls it until then. Only of models
    /// that have LSS.
    pub unconfigured: bool,
    /// How much of it is computed.
    pub fidelity: Fidelity,
    /// What counts of the gains of its velocity loop are worth: of a described servo whose description names them.
    pub speed_worth: Option<SpeedWorth>,
}

impl Order {
    /// A drive of `model` as delivered, but for its address and bit rate.
    pub fn new(model: &Description, node: NodeId, bitrate: Bitrate) -> Self {
        Self {
            node,
            bitrate,
            variant: Variant::first_of(model.variations),
            presets: Vec::new(),
            unconfigured: false,
            fidelity: Fidelity::Full,
            speed_worth: None,
        }
    }

    /// The parameter store of this drive, from the values of one as delivered.
    pub(super) fn image<S: Storage>(&self, mut values: Dictionary<S>) -> Result<StoredImage, OrderError> {
        for preset in &self.presets {
            preset.store(&mut values).map_err(|error| OrderError::Preset { preset: *preset, error })?;
        }
        Ok(StoredImage::of(&values))
    }
}

/// Why there is no such drive.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OrderError {
    /// This model has not been built yet.
    #[error("there is no virtual {model}")]
    NoSuchModel {
        /// The model's name.
        model: &'static str,
    },
    /// The model cannot have this node-ID.
    #[error("a {model} cannot be node {node}: {reason}")]
    Node {
        /// The model's name.
        model: &'static str,
        /// The node-ID.
        node: NodeId,
        /// What it can be.
        reason: &'static str,
    },
    /// The model does not know this bit rate.
    #[error("a {model} cannot run at {bitrate}: {object} knows {known}")]
    Bitrate {
        /// The model's name.
        model: &'static str,
        /// The bit rate.
        bitrate: Bitrate,
        /// The object that has it.
        object: Mux,
        /// The bit rates that the object lists.
        known: String,
    },
    /// The model has no form of this fidelity.
    #[error(transparent)]
    Fidelity(#[from] Refused),
    /// This value cannot be in the parameter store.
    #[error("{} cannot be {} at power-on: {}", preset.object, preset.value, reason(error))]
    Preset {
        /// The value.
        preset: Preset,
        /// Why the store cannot have it.
        error: PresetError,
    },
}

fn reason(error: &PresetError) -> String {
    match error {
        PresetError::NoSuchObject => "the drive has no such object".into(),
        PresetError::NotStored => "the drive does not store it, and begins with its factory value at each start".into(),
        PresetError::Refused(code) => format!("a write of it would be refused ({code})"),
    }
}

/// The number that stands for a bit rate in a drive's object, by the words of the object's row.
pub(super) fn baud_rate(model: &Description, object: Mux, bitrate: Bitrate) -> Result<u16, OrderError> {
    let values = model.row(object).map_or(&[][..], |row| row.values);
    let words = format!("{} kbit/s", bitrate.bits_per_second() / 1000);
    let number =
        values.iter().find(|(_, meaning)| *meaning == words).and_then(|(number, _)| u16::try_from(*number).ok());
    number.ok_or_else(|| {
        let known = values.iter().map(|(_, meaning)| *meaning).collect::<Vec<_>>().join(", ");
        OrderError::Bitrate { model: model.name, bitrate, object, known }
    })
}

/// The memory of a described device as ordered: values that are not the table's.
pub(super) fn memory(model: &'static Description, order: &Order) -> Result<Memory<Boxed>, OrderError> {
    let mut memory = Memory::empty(model.dictionary);
    if order.unconfigured {
        // The bit rate stays as ordered.
        memory.store_lss([UNCONFIGURED, u8::MAX]);
    }
    if order.presets.is_empty() {
        return Ok(memory);
    }
    let mut values = Dictionary::<Boxed>::new(model.dictionary, order.node);
    let refused = |preset: &Preset, error| OrderError::Preset { preset: *preset, error };
    // Not of the store: its maker's marks, by which LSS distinguishes it from others of its make, and what a sheet leaves to the device.
    let is_mark = |preset: &&Preset| model.row(preset.object).is_some_and(is_makers_mark);
    let (marks, presets): (Vec<&Preset>, Vec<&Preset>) = order.presets.iter().partition(is_mark);
    for preset in presets {
        let can_be = |row: &Entry| is_parameter(row) && is_storable(row);
        preset.store_if(&mut values, can_be).map_err(|error| refused(preset, error))?;
    }
    memory.save(&values, |row| order.presets.iter().any(|preset| preset.object == row.mux()));
    for preset in marks {
        let Some(row) = model.row(preset.object) else { continue };
        let (low, high) = row.data_type.range();
        if !(low..=high).contains(&preset.value) {
            return Err(refused(preset, PresetError::Refused(AbortCode::INVALID_VALUE)));
        }
        memory.store_mark(preset.object, row.data_type.raw(preset.value));
    }
    Ok(memory)
}

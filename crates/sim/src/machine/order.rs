//! Drives as one orders them: a model by its name, with an address, a bit rate, and what is special about this one.
//!
//! The list of all models that can be simulated is here, and nowhere else.

use can::Bitrate;
use canopen::od::Dictionary;
use canopen::{Mux, NodeId};
use devices::Description;
use devices::mjoint;
use devices::variant::{Preset, PresetError, Variant};
use devices::zltech::{ZLAC8030L, ZLIM42C, ZLIM42C_82};
use drives::engine::storage::Image;

use crate::VirtualDrive;

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
}

impl Order {
    /// A drive of `model` as delivered, but for its address and bit rate.
    pub fn new(model: &Description, node: NodeId, bitrate: Bitrate) -> Self {
        Self { node, bitrate, variant: Variant::first_of(model.variations), presets: Vec::new() }
    }

    /// The parameter store of this drive, from the values of one as delivered.
    pub(super) fn image<const N: usize>(&self, mut values: Dictionary<N>) -> Result<Image, OrderError> {
        for preset in &self.presets {
            preset.store(&mut values).map_err(|error| OrderError::Preset { preset: *preset, error })?;
        }
        Ok(Image::of(&values))
    }
}

/// Why there is no such drive.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// Nobody has built this model yet.
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
    /// This value cannot be in the parameter store.
    #[error("{} cannot be {} at power-on: {}", preset.object, preset.value, reason(error))]
    Preset {
        /// The value.
        preset: Preset,
        /// Why.
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

type Maker = fn(&Description, &Order) -> Result<Box<dyn VirtualDrive>, OrderError>;

/// Who builds which model.
static MAKERS: [(&Description, Maker); 7] = [
    (&ZLAC8030L, super::zlac8030l::ordered),
    (&ZLIM42C, super::zlim42c::ordered),
    (&ZLIM42C_82, super::zlim42c::ordered_82),
    (&mjoint::M4230E17B50, super::mjoint::ordered),
    (&mjoint::M4230E17B80, super::mjoint::ordered),
    (&mjoint::M8025E25B50, super::mjoint::ordered),
    (&mjoint::M8025E25B80, super::mjoint::ordered),
];

/// A virtual drive of `model`, without power.
///
/// # Errors
/// [`OrderError`] says what the model cannot be.
pub fn order(model: &Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let maker = MAKERS.iter().find(|(known, _)| known.model == model.model);
    let (_, make) = maker.ok_or(OrderError::NoSuchModel { model: model.model })?;
    make(model, order)
}

/// The number that stands for a bit rate in a drive's object, by the words of the object's row.
pub(super) fn baud_rate(model: &Description, object: Mux, bitrate: Bitrate) -> Result<u16, OrderError> {
    let values = model.row(object).map_or(&[][..], |row| row.values);
    let words = format!("{} kbit/s", bitrate.bits_per_second() / 1000);
    let number =
        values.iter().find(|(_, meaning)| *meaning == words).and_then(|(number, _)| u16::try_from(*number).ok());
    number.ok_or_else(|| {
        let known = values.iter().map(|(_, meaning)| *meaning).collect::<Vec<_>>().join(", ");
        OrderError::Bitrate { model: model.model, bitrate, object, known }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use devices::MODELS;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).unwrap()
    }

    #[test]
    fn every_model_that_is_described_can_be_had() {
        for model in MODELS {
            let drive = order(model, &Order::new(model, node(33), Bitrate::K500)).map(|drive| drive.model());
            assert_eq!(drive, Ok(model.model));
        }
    }

    #[test]
    fn a_bit_rate_that_the_drive_does_not_know_is_refused_with_those_it_knows() {
        let wanted = |bitrate| order(&ZLAC8030L, &Order::new(&ZLAC8030L, node(4), bitrate));
        assert!(wanted(Bitrate::K125).is_ok());
        let refusal = wanted(Bitrate::K50).err().unwrap().to_string();
        assert!(refusal.contains("cannot run at 50k") && refusal.contains("100 kbit/s"), "{refusal}");
    }

    #[test]
    fn a_node_id_that_the_switches_do_not_have_is_refused() {
        let wanted = |raw| order(&ZLIM42C, &Order::new(&ZLIM42C, node(raw), Bitrate::K500));
        assert!(wanted(15).is_ok() && wanted(32).is_ok());
        assert!(matches!(wanted(16), Err(OrderError::Node { .. })));
    }

    #[test]
    fn a_preset_that_the_drive_would_not_keep_is_refused_with_the_reason() {
        let with = |preset| Order { presets: vec![preset], ..Order::new(&ZLAC8030L, node(4), Bitrate::K500) };
        let refusal = |preset| order(&ZLAC8030L, &with(preset)).err().unwrap().to_string();
        // 2014h, rated current, is RW/S; 60FFh, target velocity, is RW.
        assert!(order(&ZLAC8030L, &with(Preset::new(0x2014, 0, 100))).is_ok());
        assert!(refusal(Preset::new(0x60FF, 0, 10)).contains("does not store"));
        assert!(refusal(Preset::new(0x5000, 0, 10)).contains("no such object"));
        assert!(refusal(Preset::new(0x200E, 0, 77)).contains("0609 0030"));
    }
}

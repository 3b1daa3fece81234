//! The joint's EEPROM: which rows it holds stands in the object table.

use canopen::NodeId;
use canopen::od::{Default, Dictionary};

use super::objects::{DEVICE_ADDRESS, ROW_COUNT, TABLE};
use crate::engine::storage::{IMAGE_SIZE, ImageBytes, Store, stored_rows};

const _: usize = stored_rows(&TABLE);

/// Contents of the EEPROM, to be kept over power cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image(pub ImageBytes);

impl Image {
    /// As delivered: factory settings, node-ID 1.
    pub fn factory() -> Self {
        Self::with_address(1)
    }

    /// Factory settings but for the node-ID (2615h).
    pub fn with_address(node_id: u8) -> Self {
        let mut dictionary = Dictionary::<ROW_COUNT>::new(&TABLE, NodeId::new(node_id).unwrap_or(NodeId::MIN));
        if TABLE.row(DEVICE_ADDRESS.slot()).check_value(i64::from(node_id)).is_ok() {
            dictionary.set(DEVICE_ADDRESS, u16::from(node_id));
        }
        let mut store = Store::new([0xFF; IMAGE_SIZE]);
        store.format(&dictionary);
        Self(*store.image().0)
    }

    /// What a save has to store: the identifiers of PDOs follow a new device address ("setting the device address via SDO
    /// sets this value as well"), unless somebody chose others.
    pub(super) fn contents(values: &Dictionary<ROW_COUNT>, node_id: NodeId) -> Dictionary<ROW_COUNT> {
        let mut contents = values.clone();
        let address = u8::try_from(values.get(DEVICE_ADDRESS)).ok().and_then(NodeId::new).unwrap_or(node_id);
        for (slot, row) in TABLE.iter() {
            let own =
                matches!(row.default, Default::NodeIdPlus(base) if values.raw(slot) == base + u32::from(node_id.raw()));
            if own {
                contents.restore_default(slot, address);
            }
        }
        contents
    }

    /// The image in a file's bytes: short files are padded as blank, long ones cut; a checksum tells if it is sound.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut image = Self([0xFF; IMAGE_SIZE]);
        image.0.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        image
    }
}

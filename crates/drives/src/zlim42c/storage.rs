//! The drive's EEPROM: which rows it holds stands in the object table (attribute RW/S).

use canopen::NodeId;
use canopen::od::Dictionary;

use super::objects::{CAN_BAUD_RATE, CUSTOM_NODE_ID, ROW_COUNT, TABLE};
use super::restart::CUSTOM_NODE_IDS;
use crate::engine::storage::{IMAGE_SIZE, ImageBytes, Store, stored_rows};

const _: usize = stored_rows(&TABLE);

/// Contents of the EEPROM, to be kept over power cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image(pub ImageBytes);

impl Image {
    /// A chip that has never been written: the drive starts with fault FF10h and asks for factory settings.
    pub const BLANK: Self = Self([0xFF; IMAGE_SIZE]);

    /// As delivered: factory settings.
    pub fn factory() -> Self {
        Self::with(&Dictionary::new(&TABLE, NodeId::MIN))
    }

    /// Factory settings but for the custom node-ID (2008h, 32 to 127; others leave it alone) and the number of the bit
    /// rate (2009h).
    pub fn with_address(node_id: u8, baud_rate: u16) -> Self {
        let mut dictionary = Dictionary::<ROW_COUNT>::new(&TABLE, NodeId::MIN);
        if CUSTOM_NODE_IDS.contains(&u16::from(node_id)) {
            dictionary.set(CUSTOM_NODE_ID, u16::from(node_id));
        }
        if TABLE.row(CAN_BAUD_RATE.slot()).check_value(i64::from(baud_rate)).is_ok() {
            dictionary.set(CAN_BAUD_RATE, baud_rate);
        }
        Self::with(&dictionary)
    }

    /// The image in a file's bytes: short files are padded as blank, long ones cut; a checksum tells if it is sound.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut image = Self::BLANK;
        image.0.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        image
    }

    fn with(dictionary: &Dictionary<ROW_COUNT>) -> Self {
        let mut store = Store::new(Self::BLANK.0);
        store.format(dictionary);
        Self(*store.image().0)
    }
}

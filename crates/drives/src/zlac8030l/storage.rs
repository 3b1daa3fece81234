//! What the drive's EEPROM holds as delivered. Which rows it holds stands in the object table (attribute RW/S).

use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CAN_NODE_ID, TABLE};
use crate::engine::storage::{Image, stored_rows};

const _: usize = stored_rows(&TABLE);

/// Factory settings.
pub fn factory() -> Image {
    Image::of(&Values::new(&TABLE, NodeId::MIN))
}

/// Factory settings but for the node-ID (4 to 127, else 4) and the number of the bit rate (200Eh).
pub fn with_address(node_id: u8, baud_rate: u16) -> Image {
    let mut values = Values::new(&TABLE, NodeId::MIN);
    for (object, value) in [(CAN_NODE_ID, u16::from(node_id)), (CAN_BAUD_RATE, baud_rate)] {
        if TABLE.row(object.slot()).check_value(i64::from(value)).is_ok() {
            values.set(object, value);
        }
    }
    Image::of(&values)
}

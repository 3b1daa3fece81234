//! What the drive's EEPROM holds as delivered. Which rows it holds stands in the object table (attribute RW/S).

use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CUSTOM_NODE_ID, TABLE};
use super::restart::CUSTOM_NODE_IDS;
use crate::engine::storage::{Image, stored_rows};

const _: usize = stored_rows(&TABLE);

/// Factory settings.
pub fn factory() -> Image {
    Image::of(&Values::new(&TABLE, NodeId::MIN))
}

/// Factory settings but for the custom node-ID (2008h, 32 to 127; others leave it alone) and the number of the bit rate
/// (2009h).
pub fn with_address(node_id: u8, baud_rate: u16) -> Image {
    let mut values = Values::new(&TABLE, NodeId::MIN);
    if CUSTOM_NODE_IDS.contains(&u16::from(node_id)) {
        values.set(CUSTOM_NODE_ID, u16::from(node_id));
    }
    if TABLE.row(CAN_BAUD_RATE.slot()).check_value(i64::from(baud_rate)).is_ok() {
        values.set(CAN_BAUD_RATE, baud_rate);
    }
    Image::of(&values)
}

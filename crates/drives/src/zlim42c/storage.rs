//! What the drive's EEPROM holds as delivered. Which rows it holds stands in the object table (attribute RW/S).

use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CUSTOM_NODE_ID, TABLE};
use super::restart::CUSTOM_NODE_IDS;
use crate::engine::storage::stored_rows;
use devices::variant::Variant;

const _: usize = stored_rows(&TABLE);

/// The values as delivered.
pub fn delivered(variant: &Variant) -> Values {
    variant.delivered(&TABLE, NodeId::MIN)
}

/// The same of a drive for this custom node-ID (2008h, 32 to 127; others leave it alone) and number of a bit rate (2009h).
pub fn addressed(variant: &Variant, node_id: u8, baud_rate: u16) -> Values {
    let mut values = delivered(variant);
    if CUSTOM_NODE_IDS.contains(&u16::from(node_id)) {
        values.set(CUSTOM_NODE_ID, u16::from(node_id));
    }
    if TABLE.row(CAN_BAUD_RATE.slot()).check_value(i64::from(baud_rate)).is_ok() {
        values.set(CAN_BAUD_RATE, baud_rate);
    }
    values
}

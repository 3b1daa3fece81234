//! What the drive's EEPROM holds as delivered. Which rows it holds stands in the object table (attribute RW/S).

use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CAN_NODE_ID, TABLE, TABLE_2_01};
use crate::engine::storage::stored_rows;
use devices::variant::Variant;

const _: usize = stored_rows(&TABLE);
const _: usize = stored_rows(&TABLE_2_01);

/// The values as delivered.
pub fn delivered(variant: &Variant) -> Values {
    variant.delivered(devices::zltech::ZLAC8030L.as_chosen(variant).dictionary, NodeId::MIN)
}

/// The same of a drive for this node-ID (4 to 127, else 4) and number of a bit rate (200Eh).
pub fn addressed(variant: &Variant, node_id: u8, baud_rate: u16) -> Values {
    let mut values = delivered(variant);
    for (object, value) in [(CAN_NODE_ID, u16::from(node_id)), (CAN_BAUD_RATE, baud_rate)] {
        if TABLE.row(object.slot()).check_value(i64::from(value)).is_ok() {
            values.set(object, value);
        }
    }
    values
}

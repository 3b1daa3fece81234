//! What the joint's EEPROM holds as delivered and after a save. Which rows it holds stands in the object table.

use canopen::NodeId;
use canopen::od::DefaultValue;

use super::Values;
use super::assumptions::NO_RECORD;
use super::objects::{CONDITIONS, DEVICE_ADDRESS, POSITION_ACTUAL_INTERNAL_VALUE, TABLE, TABLE_1_66};
use crate::engine::storage::stored_rows;
use devices::variant::Variant;

const _: usize = stored_rows(&TABLE);
const _: usize = stored_rows(&TABLE_1_66);

/// The values as delivered, node-ID 1.
pub fn delivered(variant: &Variant) -> Values {
    addressed(variant, 1)
}

/// The values as delivered but for the node-ID (2615h).
pub fn addressed(variant: &Variant, node_id: u8) -> Values {
    let node = NodeId::new(node_id).unwrap_or(NodeId::MIN);
    // The four models have the same objects.
    let table = devices::mjoint::M4230E17B50.as_chosen(variant).dictionary;
    let mut values: Values = variant.delivered(table, node).with_conditions(&CONDITIONS);
    if TABLE.row(DEVICE_ADDRESS.slot()).check_value(i64::from(node_id)).is_ok() {
        values.set(DEVICE_ADDRESS, u16::from(node_id));
    }
    values.set(POSITION_ACTUAL_INTERNAL_VALUE, NO_RECORD);
    values
}

/// What a save has to store: the identifiers of PDOs follow a new device address ("setting the device address via SDO
/// sets this value as well"), unless others were chosen.
pub(super) fn contents(values: &Values, node_id: NodeId) -> Values {
    let mut contents = values.clone();
    let address = u8::try_from(values.get(DEVICE_ADDRESS)).ok().and_then(NodeId::new).unwrap_or(node_id);
    for (slot, row) in values.table().iter() {
        let own = matches!(row.default, DefaultValue::NodeIdPlus(base) if values.raw(slot) == base + u32::from(node_id.raw()));
        if own {
            contents.restore_default(slot, address);
        }
    }
    contents
}

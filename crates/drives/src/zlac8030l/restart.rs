//! What only a restart (power-on or NMT reset node) takes over: the address and the bit rate.

use can::Bitrate;
use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CAN_NODE_ID};

/// Addresses of the DIP switch that are node-IDs; at any other 200Dh decides (note at 2022h).
const DIP_NODE_IDS: core::ops::RangeInclusive<u8> = 1..=3;

/// Node-ID as delivered.
const FACTORY_NODE_ID: u8 = 4;

pub(super) fn node_id(dip_address: u8, values: &Values) -> NodeId {
    let stored = u8::try_from(values.get(CAN_NODE_ID)).unwrap_or(FACTORY_NODE_ID);
    let raw = if DIP_NODE_IDS.contains(&dip_address) { dip_address } else { stored };
    NodeId::new(raw).or(NodeId::new(FACTORY_NODE_ID)).unwrap_or(NodeId::MIN)
}

/// 200Eh.
pub(super) fn bitrate(values: &Values) -> Bitrate {
    match values.get(CAN_BAUD_RATE) {
        0 => Bitrate::M1,
        2 => Bitrate::K250,
        3 => Bitrate::K125,
        4 => Bitrate::K100,
        _ => Bitrate::K500,
    }
}

//! What only a restart (power-on or NMT reset node) takes over: the address and the bit rate.

use can::Bitrate;
use canopen::NodeId;

use super::Values;
use super::objects::{CAN_BAUD_RATE, CUSTOM_NODE_ID};
use super::tables::{BIT_RATES, entry};

/// Addresses of the switches that are node-IDs; with all switches ON (0) 2008h decides (4.1).
const DIP_NODE_IDS: core::ops::RangeInclusive<u8> = 1..=15;

/// Values of 2008h that are node-IDs; 0 to 31 are "undefined".
pub(super) const CUSTOM_NODE_IDS: core::ops::RangeInclusive<u16> = 32..=127;

/// With neither: the default of 2000h in the maker's EDS.
const FALLBACK_NODE_ID: NodeId = NodeId::MIN;

pub(super) fn node_id(dip_address: u8, values: &Values) -> NodeId {
    let custom = values.get(CUSTOM_NODE_ID);
    let chosen = if DIP_NODE_IDS.contains(&dip_address) {
        NodeId::new(dip_address)
    } else if CUSTOM_NODE_IDS.contains(&custom) {
        NodeId::new(custom as u8)
    } else {
        None
    };
    chosen.unwrap_or(FALLBACK_NODE_ID)
}

/// 2009h.
pub(super) fn bitrate(values: &Values) -> Bitrate {
    entry(&BIT_RATES, values.get(CAN_BAUD_RATE))
}

//! Parameters of further SDO channels (CiA 301, 7.5.2.33 and 7.5.2.34): 1201h to 127Fh of servers, 1280h to 12FFh of clients.
//!
//! These devices have the default server only, and are not a client of any other: a COB-ID that would make a channel valid is refused, as it would
//! have no effect.

use canopen::od::{Condition, Slot, Table, View};
use canopen::{AbortCode, CobId};

/// COB-IDs from the client to the server, and back.
const COB_IDS: core::ops::RangeInclusive<u8> = 1..=2;

/// What a device with these objects refuses beyond its rows.
pub(super) fn conditions(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    let is_cob_id = |index: u16, sub_index: u8| matches!(index, 0x1201..=0x12FF) && COB_IDS.contains(&sub_index);
    let cob_ids = table.iter().filter(move |(_, row)| is_cob_id(row.index, row.sub_index));
    cob_ids.map(|(slot, _)| (slot, Condition::Check(only_invalid)))
}

/// 0609 0030h for a channel that would exist: bit 31 is clear.
fn only_invalid(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if CobId(raw).is_valid() { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
}

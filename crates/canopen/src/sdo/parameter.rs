//! SDO parameters: the records of further servers, 1201h to 127Fh, and of clients, 1280h to 12FFh (CiA 301, 7.5.2.33 and 7.5.2.34).
//!
//! Sub-index 01h is the COB-ID from the client to the server, 02h that back, 03h the node-ID of the other side.

use can::CanId;

use crate::od::View;
use crate::{AbortCode, CobId, Mux, NodeId};

const COB_ID_REQUEST: u8 = 1;
const COB_ID_REPLY: u8 = 2;
const NODE_ID: u8 = 3;

/// Bit 30 of a COB-ID: it was given for the time until the device starts anew, and no store keeps it.
pub const DYNAMIC: u32 = 1 << 30;

/// A record of a server that is not the default one.
pub const fn is_further_server(index: u16) -> bool {
    matches!(index, 0x1201..=0x127F)
}

/// The COB-ID of a further server or of a client.
pub const fn is_cob_id(mux: Mux) -> bool {
    matches!(mux.index, 0x1201..=0x12FF) && matches!(mux.sub_index, COB_ID_REQUEST | COB_ID_REPLY)
}

/// Identifiers of requests and replies, if a further channel with these COB-IDs exists: both are valid, of the base frame format, and
/// not restricted to other services (CiA 301, 7.3.5): an EDS may deliver what no client could write.
pub fn identifiers(request: CobId, reply: CobId) -> Option<(u16, CanId)> {
    let is_fit = |cob_id: CobId| cob_id.is_valid() && !cob_id.is_restricted();
    let exists = is_fit(request) && is_fit(reply) && !reply.is_extended();
    request.can_id().as_standard().filter(|_| exists).map(|request| (request, reply.can_id()))
}

/// What a client may write to a record 1201h to 12FFh: the identifier of a valid COB-ID stays, and a node-ID is one.
///
/// # Errors
/// 0609 0030h.
pub fn check(values: &View<'_>, mux: Mux, raw: u32) -> Result<(), AbortCode> {
    let present = values.table().find(mux).map_or(CobId::INVALID, |slot| values.raw(slot));
    match mux.sub_index {
        _ if raw == present => Ok(()),
        COB_ID_REQUEST | COB_ID_REPLY => CobId(present).check_change(CobId(raw), false),
        NODE_ID if NodeId::new(raw as u8).is_none() => Err(AbortCode::INVALID_VALUE),
        _ => Ok(()),
    }
}

//! SDO parameters: the records of further servers, 1201h to 127Fh, and of clients, 1280h to 12FFh (CiA 301, 7.5.2.33 and 7.5.2.34).
//!
//! Sub-index 01h is the COB-ID from the client to the server, 02h that back, 03h the node-ID of the other side.

use can::CanId;

use crate::connection_set::Service;
use crate::od::View;
use crate::{AbortCode, CobId, Mux, NodeId};

const COB_ID_REQUEST: u8 = 1;
const COB_ID_REPLY: u8 = 2;
const NODE_ID: u8 = 3;

/// Bit 30 of a COB-ID: it was given for the time until the device starts anew, and no store keeps it.
pub const DYNAMIC: u32 = 1 << 30;

/// Bits 11 to 28: of an identifier of the extended frame format, which is not offered.
const EXTENDED_BITS: u32 = 0x1FFF_F800;

/// A record of a client.
pub const fn is_client(index: u16) -> bool {
    matches!(index, 0x1280..=0x12FF)
}

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

/// The identifiers of requests and replies of the client whose record is `index`, 1280h to 12FFh, if these values have that client:
/// both COB-IDs are valid, and those of a further server or of the default one of some node.
pub fn client_channel(values: &View<'_>, index: u16) -> Option<(CanId, CanId)> {
    let id = |sub_index| {
        let mux = Mux::new(index, sub_index);
        let cob_id = CobId(values.raw(values.table().find(mux).ok()?));
        let is_fit = cob_id.is_valid() && (is_of_a_default_server(mux, cob_id) || cob_id.check_identifier().is_ok());
        is_fit.then(|| cob_id.can_id())
    };
    is_client(index).then(|| id(COB_ID_REQUEST).zip(id(COB_ID_REPLY))).flatten()
}

/// What a client may write to a record 1201h to 12FFh: the identifier of a valid COB-ID stays, bits 11 to 28 are 0 with one of the
/// base frame format, and a node-ID is one.
///
/// # Errors
/// 0609 0030h.
pub fn check(values: &View<'_>, mux: Mux, raw: u32) -> Result<(), AbortCode> {
    let present = values.table().find(mux).map_or(CobId::INVALID, |slot| values.raw(slot));
    let (old, new) = (CobId(present), CobId(raw));
    match mux.sub_index {
        _ if raw == present => Ok(()),
        COB_ID_REQUEST | COB_ID_REPLY if raw & EXTENDED_BITS != 0 => Err(AbortCode::INVALID_VALUE),
        COB_ID_REQUEST | COB_ID_REPLY if is_of_a_default_server(mux, new) => {
            let moves = old.is_valid() && new.is_valid() && old.can_id() != new.can_id();
            if moves { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
        }
        COB_ID_REQUEST | COB_ID_REPLY => old.check_change(new, false),
        NODE_ID if NodeId::new(raw as u8).is_none() => Err(AbortCode::INVALID_VALUE),
        _ => Ok(()),
    }
}

/// A client may ask the default server of a node. Table 41 of CiA 301 restricts its identifiers to just that service.
fn is_of_a_default_server(mux: Mux, cob_id: CobId) -> bool {
    let service = Service::of(cob_id.can_id()).map(|service| (mux.sub_index, service));
    let is_its =
        matches!(service, Some((COB_ID_REQUEST, Service::SdoRequest(_)) | (COB_ID_REPLY, Service::SdoReply(_))));
    is_client(mux.index) && is_its
}

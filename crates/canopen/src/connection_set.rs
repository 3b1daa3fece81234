//! The predefined connection set: which CAN identifier carries which service (CiA 301, 7.3.3).
//!
//! An identifier is a function code (its high four bits) and a node-ID (its low seven). These are the defaults
//! after power-on; SYNC, EMCY and PDO identifiers may be moved through their COB-ID objects, SDO 1, NMT and
//! heartbeat never.

use can::CanId;

use crate::NodeId;
use crate::pdo::PdoNumber;

/// NMT node control, from the master to all.
pub const NMT: CanId = CanId::standard(0x000);
/// SYNC, default of object 1005h.
pub const SYNC: CanId = CanId::standard(0x080);
/// TIME, default of object 1012h.
pub const TIME: CanId = CanId::standard(0x100);
/// LSS, from the slaves to the master (CiA 305).
pub const LSS_SLAVE: CanId = CanId::standard(0x7E4);
/// LSS, from the master to the slaves (CiA 305).
pub const LSS_MASTER: CanId = CanId::standard(0x7E5);

/// Function code base of EMCY.
pub const EMCY_BASE: u16 = 0x080;
/// Function code base of TPDO 1; each further one is [`PDO_STEP`] higher.
pub const TPDO_BASE: u16 = 0x180;
/// Function code base of RPDO 1; each further one is [`PDO_STEP`] higher.
pub const RPDO_BASE: u16 = 0x200;
/// Distance between the identifiers of PDO n and PDO n + 1.
pub const PDO_STEP: u16 = 0x100;
/// Function code base of SDO replies, server to client.
pub const SDO_REPLY_BASE: u16 = 0x580;
/// Function code base of SDO requests, client to server.
pub const SDO_REQUEST_BASE: u16 = 0x600;
/// Function code base of boot-up and heartbeat.
pub const HEARTBEAT_BASE: u16 = 0x700;

/// What an identifier of the predefined connection set carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Service {
    /// NMT node control.
    Nmt,
    /// SYNC.
    Sync,
    /// EMCY of a node.
    Emcy(NodeId),
    /// TIME.
    Time,
    /// TPDO of a node: from the device.
    Tpdo(PdoNumber, NodeId),
    /// RPDO of a node: to the device.
    Rpdo(PdoNumber, NodeId),
    /// SDO reply, from the server.
    SdoReply(NodeId),
    /// SDO request, to the server.
    SdoRequest(NodeId),
    /// Boot-up, heartbeat or node guarding reply.
    Heartbeat(NodeId),
    /// LSS, from a slave.
    LssSlave,
    /// LSS, from the master.
    LssMaster,
}

impl Service {
    /// What `id` carries as long as it has not been moved; `None` for identifiers outside the set.
    pub const fn of(id: CanId) -> Option<Self> {
        let Some(raw) = id.as_standard() else { return None };
        match raw {
            0x000 => return Some(Self::Nmt),
            0x080 => return Some(Self::Sync),
            0x100 => return Some(Self::Time),
            0x7E4 => return Some(Self::LssSlave),
            0x7E5 => return Some(Self::LssMaster),
            _ => {}
        }
        let Some(node) = NodeId::new(raw as u8 & 0x7F) else { return None };
        let base = raw & 0x780;
        Some(match base {
            EMCY_BASE => Self::Emcy(node),
            SDO_REPLY_BASE => Self::SdoReply(node),
            SDO_REQUEST_BASE => Self::SdoRequest(node),
            HEARTBEAT_BASE => Self::Heartbeat(node),
            0x180 | 0x280 | 0x380 | 0x480 => match PdoNumber::new(base / PDO_STEP) {
                Some(number) => Self::Tpdo(number, node),
                None => return None,
            },
            0x200 | 0x300 | 0x400 | 0x500 => match PdoNumber::new(base / PDO_STEP - 1) {
                Some(number) => Self::Rpdo(number, node),
                None => return None,
            },
            _ => return None,
        })
    }

    /// The identifier of the service; `None` for PDO 5 and further ones, which have no default COB-ID.
    pub const fn can_id(self) -> Option<CanId> {
        Some(match self {
            Self::Nmt => NMT,
            Self::Sync => SYNC,
            Self::Emcy(node) => emcy(node),
            Self::Time => TIME,
            Self::Tpdo(number, node) => return tpdo(number, node),
            Self::Rpdo(number, node) => return rpdo(number, node),
            Self::SdoReply(node) => sdo_reply(node),
            Self::SdoRequest(node) => sdo_request(node),
            Self::Heartbeat(node) => heartbeat(node),
            Self::LssSlave => LSS_SLAVE,
            Self::LssMaster => LSS_MASTER,
        })
    }
}

/// EMCY of `node`: 080h + node-ID.
pub const fn emcy(node: NodeId) -> CanId {
    of_node(EMCY_BASE, node)
}

/// TPDO 1 to 4 of `node`: 180h, 280h, 380h, 480h + node-ID; further ones have no default.
pub const fn tpdo(number: PdoNumber, node: NodeId) -> Option<CanId> {
    of_pdo(TPDO_BASE, number, node)
}

/// RPDO 1 to 4 of `node`: 200h, 300h, 400h, 500h + node-ID; further ones have no default.
pub const fn rpdo(number: PdoNumber, node: NodeId) -> Option<CanId> {
    of_pdo(RPDO_BASE, number, node)
}

const fn of_pdo(base: u16, number: PdoNumber, node: NodeId) -> Option<CanId> {
    let position = number.position();
    if position < PdoNumber::PREDEFINED { Some(of_node(base + PDO_STEP * position as u16, node)) } else { None }
}

/// SDO reply of `node`: 580h + node-ID.
pub const fn sdo_reply(node: NodeId) -> CanId {
    of_node(SDO_REPLY_BASE, node)
}

/// SDO request to `node`: 600h + node-ID.
pub const fn sdo_request(node: NodeId) -> CanId {
    of_node(SDO_REQUEST_BASE, node)
}

/// Boot-up and heartbeat of `node`: 700h + node-ID.
pub const fn heartbeat(node: NodeId) -> CanId {
    of_node(HEARTBEAT_BASE, node)
}

const fn of_node(base: u16, node: NodeId) -> CanId {
    CanId::standard(base + node.raw() as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_identifier_of_the_set_names_its_service_and_back() {
        let mut named = 0;
        for raw in 0..=CanId::MAX_STANDARD {
            if let Some(service) = Service::of(CanId::standard(raw)) {
                assert_eq!(service.can_id(), Some(CanId::standard(raw)));
                named += 1;
            }
        }
        // NMT, SYNC, TIME, two of LSS; EMCY, 4 TPDO, 4 RPDO, 2 of SDO and heartbeat for 127 nodes.
        assert_eq!(named, 5 + 12 * 127);
    }

    #[test]
    fn identifiers_are_those_of_table_39() {
        let node = NodeId::new(4).unwrap();
        let third = PdoNumber::new(3).unwrap();
        assert_eq!(emcy(node), CanId::standard(0x084));
        assert_eq!(tpdo(third, node), Some(CanId::standard(0x384)));
        assert_eq!(rpdo(third, node), Some(CanId::standard(0x404)));
        assert_eq!(PdoNumber::new(5).and_then(|fifth| tpdo(fifth, node)), None);
        assert_eq!(sdo_reply(node), CanId::standard(0x584));
        assert_eq!(sdo_request(node), CanId::standard(0x604));
        assert_eq!(heartbeat(node), CanId::standard(0x704));
        assert_eq!(Service::of(CanId::extended(0x604)), None);
    }
}

//! What a decoded frame is about: its service, its node, its objects. For filters and counts.

use core::fmt;

use can::CanId;
use canopen::connection_set::{self, Service};
use canopen::nmt::NmtTarget;
use canopen::pdo::PdoNumber;
use canopen::{Mux, NodeId};

use super::{Decoded, Decoder};

/// The services of CiA 301 and CiA 305, as people choose among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ServiceKind {
    /// NMT commands.
    Nmt,
    /// SYNC.
    Sync,
    /// TIME stamps.
    Time,
    /// Emergency messages.
    Emcy,
    /// Process data.
    Pdo,
    /// SDO requests and replies.
    Sdo,
    /// Boot-up messages, heartbeats, answers to node guarding.
    Heartbeat,
    /// Layer setting services.
    Lss,
    /// Anything else.
    Other,
}

impl ServiceKind {
    /// All of them.
    pub const ALL: [Self; 9] =
        [Self::Nmt, Self::Sync, Self::Time, Self::Emcy, Self::Pdo, Self::Sdo, Self::Heartbeat, Self::Lss, Self::Other];

    /// In a word, as it is typed.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Nmt => "nmt",
            Self::Sync => "sync",
            Self::Time => "time",
            Self::Emcy => "emcy",
            Self::Pdo => "pdo",
            Self::Sdo => "sdo",
            Self::Heartbeat => "heartbeat",
            Self::Lss => "lss",
            Self::Other => "other",
        }
    }

    const fn of(service: Service) -> Self {
        match service {
            Service::Nmt => Self::Nmt,
            Service::Sync => Self::Sync,
            Service::Time => Self::Time,
            Service::Emcy(_) => Self::Emcy,
            Service::Tpdo(..) | Service::Rpdo(..) => Self::Pdo,
            Service::SdoReply(_) | Service::SdoRequest(_) => Self::Sdo,
            Service::Heartbeat(_) => Self::Heartbeat,
            Service::LssSlave | Service::LssMaster => Self::Lss,
        }
    }
}

impl fmt::Display for ServiceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

const fn node_of(service: Service) -> Option<NodeId> {
    match service {
        Service::Emcy(node)
        | Service::Tpdo(_, node)
        | Service::Rpdo(_, node)
        | Service::SdoReply(node)
        | Service::SdoRequest(node)
        | Service::Heartbeat(node) => Some(node),
        _ => None,
    }
}

impl Decoded {
    /// The service of CiA 301 or 305 that the frame belongs to.
    pub const fn service(&self) -> ServiceKind {
        match self {
            Self::Nmt(_) => ServiceKind::Nmt,
            Self::Sync(_) => ServiceKind::Sync,
            Self::Time(_) => ServiceKind::Time,
            Self::Emcy(..) => ServiceKind::Emcy,
            Self::BootUp(_) | Self::Heartbeat(..) | Self::AlarmHeartbeat(_) => ServiceKind::Heartbeat,
            Self::Sdo(_) => ServiceKind::Sdo,
            Self::Pdo(_) => ServiceKind::Pdo,
            Self::LssRequest(_) | Self::LssReply(_) => ServiceKind::Lss,
            Self::Remote(Some(service)) | Self::Malformed(service) => ServiceKind::of(*service),
            Self::Remote(None) | Self::Unknown => ServiceKind::Other,
        }
    }

    /// The one node that it comes from or goes to.
    pub const fn node(&self) -> Option<NodeId> {
        match self {
            Self::Nmt(request) => match request.target {
                NmtTarget::Node(node) => Some(node),
                NmtTarget::All => None,
            },
            Self::Emcy(node, ..) | Self::BootUp(node) | Self::Heartbeat(node, _) | Self::AlarmHeartbeat(node) => {
                Some(*node)
            }
            Self::Sdo(sdo) => Some(sdo.node),
            Self::Pdo(pdo) => Some(pdo.node),
            Self::Remote(Some(service)) | Self::Malformed(service) => node_of(*service),
            _ => None,
        }
    }

    /// True if it is about this node: from it, for it, or an NMT command or a multiplexed PDO for all.
    pub fn concerns(&self, node: NodeId) -> bool {
        let is_for = match self {
            Self::Nmt(request) => request.target == NmtTarget::All,
            Self::Pdo(pdo) => pdo.object_node().is_none_or(|other| other == node),
            _ => false,
        };
        is_for || self.node() == Some(node)
    }

    /// The objects that it carries or is part of a transfer of.
    pub fn objects(&self) -> impl Iterator<Item = Mux> + '_ {
        let (sdo, fields) = match self {
            Self::Sdo(sdo) => (sdo.step.object(), &[][..]),
            Self::Pdo(pdo) => (None, &pdo.fields[..]),
            _ => (None, &[][..]),
        };
        sdo.into_iter().chain(fields.iter().map(|(record, _)| record.mux))
    }
}

impl Decoder {
    /// The identifiers of all frames that concern a node, as far as is known now: those of the predefined connection set
    /// (CiA 301, 7.3.3), and those of its PDOs that were given or seen being configured. NMT commands are among them.
    pub fn ids_of(&self, node: NodeId) -> impl Iterator<Item = CanId> + '_ {
        let services = [
            connection_set::NMT,
            connection_set::emcy(node),
            connection_set::sdo_request(node),
            connection_set::sdo_reply(node),
            connection_set::heartbeat(node),
        ];
        let pdos = (1..=4).filter_map(PdoNumber::new);
        let predefined = pdos.flat_map(move |number| {
            [connection_set::tpdo(number, node), connection_set::rpdo(number, node)].into_iter().flatten()
        });
        services.into_iter().chain(predefined).chain(self.pdos.ids_of(node).map(CanId::standard))
    }
}

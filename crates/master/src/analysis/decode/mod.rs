//! Frames in words: what a bus monitor shows (CiA 301, one type per service).
//!
//! In: every frame of the bus in order. Out: a [`Decoded`] value per frame, which prints as one line. SDO transfers
//! are reassembled; PDOs are split by the mapping that was given, comes from a model's object table, or was seen
//! being written or read by SDO. The decoder never sends and keeps no time.

mod block;
mod common;
mod motion;
mod node_models;
mod number;
mod pdo;
mod sdo;
mod step;
mod subject;
mod value;

use core::fmt;

use can::Frame;
use canopen::connection_set::Service;
use canopen::emcy::Emcy;
use canopen::heartbeat::Heartbeat;
use canopen::lss::{Reply, Request};
use canopen::nmt::{NmtRequest, NmtTarget};
use canopen::object::DEVICE_TYPE;
use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::sync::Sync;
use canopen::time_stamp::TimeOfDay;
use canopen::{Mux, NmtState, NodeId};
use devices::Description;
use devices::faults::FaultRow;

use crate::identify::Model;
use crate::models::Models;
use crate::pdo::PdoConfig;
use node_models::NodeModels;
use pdo::PdoBook;
use sdo::Conversations;

pub use common::{common_name, common_row, common_type, standard_row};
pub(crate) use motion::object_may_move;
pub use number::Number;
pub use pdo::Pdo;
pub use sdo::Sdo;
pub use step::{SdoStep, Side};
pub use subject::ServiceKind;
pub use value::{DecodedValue, statusword_words};

/// What one frame says.
#[derive(Clone, Debug)]
pub enum Decoded {
    /// NMT command of a master.
    Nmt(NmtRequest),
    /// SYNC.
    Sync(Sync),
    /// TIME stamp.
    Time(TimeOfDay),
    /// Emergency message, and the fault of the node's model that it reports.
    Emcy(NodeId, Emcy, Option<&'static FaultRow>),
    /// Boot-up message.
    BootUp(NodeId),
    /// Heartbeat, or answer to node guarding.
    Heartbeat(NodeId, NmtState),
    /// Heartbeat that reports an alarm, and not the NMT state, on a model that does so.
    AlarmHeartbeat(NodeId),
    /// Part of an SDO transfer.
    Sdo(Sdo),
    /// Process data.
    Pdo(Pdo),
    /// Layer setting services: what an LSS master asks (CiA 305).
    LssRequest(Request),
    /// Layer setting services: what an LSS slave answers.
    LssReply(Reply),
    /// A remote frame, which asks for the frame with its identifier.
    Remote(Option<Service>),
    /// A frame whose contents break the rules of its service.
    Malformed(Service),
    /// Not a frame of the predefined connection set, nor of a PDO that was seen being configured.
    Unknown,
}

/// Turns frames into words. See the [module](self).
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    known: Models,
    models: NodeModels,
    conversations: Conversations,
    pdos: PdoBook,
}

impl Decoder {
    /// A decoder that knows no node's model: it names the objects that all models agree on. A node whose 1000h is seen
    /// being read is known as far as that identifies it.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same, which looks for nodes among these models.
    pub fn knowing(known: Models) -> Self {
        Self { known, ..Self::default() }
    }

    /// Puts what a node says in its model's words, and takes the model's factory PDO mappings for granted until others
    /// are seen.
    pub fn set_model(&mut self, node: NodeId, model: &'static Description) {
        self.models.0.insert(node.raw(), Model(model));
        self.pdos.load_defaults(node, model.dictionary);
    }

    /// A node has said its device type (1000h): enough where all makers' models with that value have the same objects.
    /// The generic servo (vendor 0), whose device type any servo has, does not identify the others; it has to be named.
    fn learn_model(&mut self, node: NodeId, device_type: &[u8]) {
        let Ok(bytes) = <[u8; 4]>::try_from(device_type) else { return };
        let said = u32::from_le_bytes(bytes);
        let makers = self.known.catalogue().iter().filter(|model| model.identity.vendor_id != 0);
        let mut models = makers.filter(|model| model.identity.device_type == said);
        let Some(first) = models.next().filter(|_| self.models.get(node).is_none()) else { return };
        if models.all(|model| model.same_objects(first)) {
            self.models.0.insert(node.raw(), Model(first));
        }
    }

    /// The name of an object of a node: by its model's table, else by what all models and the standards say.
    pub fn name(&self, node: NodeId, mux: Mux) -> Option<&'static str> {
        match self.models.get(node) {
            Some(model) => model.0.row(mux).map(|row| row.name),
            None => common_name(mux),
        }
    }

    /// Takes for granted that a PDO has this identifier, and what it carries.
    pub fn set_pdo(&mut self, node: NodeId, config: &PdoConfig, id: u16) {
        self.pdos.set(node, config, id);
    }

    /// Takes no PDO's identifier and mapping for granted, nor what was seen of them: more was missed than can be made up for.
    pub fn forget_pdos(&mut self) {
        self.pdos = PdoBook::default();
    }

    /// What a frame says. Frames must come in the order they were on the bus.
    pub fn decode(&mut self, frame: &Frame) -> Decoded {
        let service = Service::of(frame.id());
        if frame.is_remote() {
            return Decoded::Remote(service);
        }
        if let Some(pdo) = self.pdos.decode(frame, &self.models) {
            return Decoded::Pdo(pdo);
        }
        match service {
            Some(service) => self.decode_service(service, frame).unwrap_or(Decoded::Malformed(service)),
            None => Decoded::Unknown,
        }
    }

    /// Takes in what a frame teaches of those behind it, without describing it: mappings, models and
    /// transfers under way. Only SDO frames do.
    pub fn pass(&mut self, frame: &Frame) {
        if let Some(Service::SdoRequest(_) | Service::SdoReply(_)) = Service::of(frame.id()) {
            self.decode(frame);
        }
    }

    fn decode_service(&mut self, service: Service, frame: &Frame) -> Option<Decoded> {
        Some(match service {
            Service::Nmt => Decoded::Nmt(NmtRequest::parse(frame).ok()?),
            Service::Sync => Decoded::Sync(Sync::parse(frame)),
            Service::Time => Decoded::Time(TimeOfDay::parse(frame)?),
            Service::Emcy(node) => {
                let emcy = Emcy::parse(frame)?;
                let model = self.models.get(node);
                Decoded::Emcy(node, emcy, model.and_then(|model| model.0.fault_reported_by(emcy.code)))
            }
            Service::Heartbeat(node) => match Heartbeat::parse(frame)?.nmt_state()? {
                NmtState::Initialising => Decoded::BootUp(node),
                state if self.models.get(node).is_some_and(|model| model.0.tells_alarm(state)) => {
                    Decoded::AlarmHeartbeat(node)
                }
                state => Decoded::Heartbeat(node, state),
            },
            Service::SdoRequest(node) => Decoded::Sdo(self.decode_sdo(node, Side::Client, frame)?),
            Service::SdoReply(node) => Decoded::Sdo(self.decode_sdo(node, Side::Server, frame)?),
            Service::Tpdo(number, node) => self.unmapped(node, Direction::Tpdo, number, frame),
            Service::Rpdo(number, node) => self.unmapped(node, Direction::Rpdo, number, frame),
            Service::LssMaster => Decoded::LssRequest(Request::parse(frame)?),
            Service::LssSlave => Decoded::LssReply(Reply::parse(frame)?),
        })
    }

    fn unmapped(&self, node: NodeId, direction: Direction, number: PdoNumber, frame: &Frame) -> Decoded {
        Decoded::Pdo(Pdo::unmapped(node, PdoId { direction, number }, self.models.get(node), frame))
    }

    fn decode_sdo(&mut self, node: NodeId, from: Side, frame: &Frame) -> Option<Sdo> {
        // Each has eight bytes (CiA 301, 7.2.4.3): of one that is cut off nothing is known that is not there.
        if frame.data().len() != 8 {
            return None;
        }
        let step = self.conversations.step(node, from, frame.padded());
        if let Some((mux, bytes)) = step.learned() {
            self.pdos.learn(node, mux, bytes);
            if mux == DEVICE_TYPE {
                self.learn_model(node, bytes);
            }
        }
        Some(Sdo { node, from, step, model: self.models.get(node) })
    }
}

/// One line, without the frame itself.
impl fmt::Display for Decoded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nmt(request) => {
                let name = command_name(request.command);
                match request.target {
                    NmtTarget::All => write!(f, "NMT {name}, all nodes"),
                    NmtTarget::Node(node) => write!(f, "NMT {name}, node {node}"),
                }
            }
            Self::Sync(Sync { counter: Some(counter) }) => write!(f, "SYNC {counter}"),
            Self::Sync(_) => f.write_str("SYNC"),
            Self::Time(time) => write!(f, "TIME {time}"),
            Self::Emcy(node, emcy, fault) => {
                match fault {
                    Some(fault) => write!(f, "EMCY node {node}: {:04X}h ({})", emcy.code.0, fault.name)?,
                    None => write!(f, "EMCY node {node}: {}", emcy.code)?,
                }
                write!(f, ", error register {:02X}h", emcy.error_register)?;
                if emcy.manufacturer != [0; 5] {
                    f.write_str(", manufacturer")?;
                    emcy.manufacturer.iter().try_for_each(|byte| write!(f, " {byte:02X}"))?;
                }
                Ok(())
            }
            Self::BootUp(node) => write!(f, "boot-up node {node}"),
            Self::Heartbeat(node, state) => write!(f, "heartbeat node {node}: {state}"),
            Self::AlarmHeartbeat(node) => write!(f, "heartbeat node {node}: in alarm (04h; it does not mean stopped)"),
            Self::Sdo(sdo) => sdo.fmt(f),
            Self::Pdo(pdo) => pdo.fmt(f),
            Self::LssRequest(request) => request.fmt(f),
            Self::LssReply(reply) => reply.fmt(f),
            Self::Remote(Some(service)) => write!(f, "remote request for {}", service_name(*service)),
            Self::Remote(None) => f.write_str("remote request"),
            Self::Malformed(service) => write!(f, "malformed {}", service_name(*service)),
            Self::Unknown => f.write_str("unknown"),
        }
    }
}

fn command_name(command: canopen::NmtCommand) -> &'static str {
    use canopen::NmtCommand;
    match command {
        NmtCommand::Start => "start",
        NmtCommand::Stop => "stop",
        NmtCommand::EnterPreOperational => "enter pre-operational",
        NmtCommand::ResetNode => "reset node",
        NmtCommand::ResetCommunication => "reset communication",
    }
}

fn service_name(service: Service) -> String {
    match service {
        Service::Nmt => "NMT command".to_owned(),
        Service::Sync => "SYNC".to_owned(),
        Service::Time => "TIME".to_owned(),
        Service::Emcy(node) => format!("EMCY of node {node}"),
        Service::Tpdo(number, node) => format!("TPDO{number} of node {node}"),
        Service::Rpdo(number, node) => format!("RPDO{number} of node {node}"),
        Service::SdoReply(node) => format!("SDO reply of node {node}"),
        Service::SdoRequest(node) => format!("SDO request to node {node}"),
        Service::Heartbeat(node) => format!("heartbeat of node {node}"),
        Service::LssSlave | Service::LssMaster => "LSS".to_owned(),
    }
}

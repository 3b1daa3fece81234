use std::collections::BTreeMap;
use std::time::Duration;

use can::{CanId, Frame};
use canopen::connection_set::Service;
use canopen::emcy::Emcy;
use canopen::heartbeat::Heartbeat;
use canopen::{Mux, NmtCommand, NmtState, NodeId};
use cia402::PowerCommand;
use cia402::object::CONTROLWORD;

use super::data_type::GatewayType;
use super::refusal::Refusal;
use super::request::{GatewayCommand, GatewayRequest, Unreadable};
use crate::core::{Event, NodeSet};
use crate::decode::object_may_move;
use crate::network::DEFAULT_TIMEOUT;
use crate::{Network, Node};

/// The one network behind a gateway.
const NET: u64 = 1;

/// PDOs that a client may set up, each way.
const MAX_PDOS: usize = 512;

/// A client's connection: what it has set, and what it may have moved.
#[derive(Debug)]
pub struct Session {
    network: Network,
    default_node: Option<NodeId>,
    sdo_timeout: Duration,
    own_id: Option<NodeId>,
    boot_up_indication: bool,
    /// By identifier: number, data types, and the last data.
    rpdos: BTreeMap<u16, (u64, PdoData)>,
    tpdos: BTreeMap<u64, (u16, Vec<GatewayType>)>,
    moved: NodeSet,
}

#[derive(Debug)]
struct PdoData {
    types: Vec<GatewayType>,
    last: Option<Vec<String>>,
}

impl Session {
    /// A client of `network`, which has set nothing yet. The one net is the default, there is no default node.
    pub fn new(network: Network) -> Self {
        Self {
            network,
            default_node: None,
            sdo_timeout: DEFAULT_TIMEOUT,
            own_id: None,
            boot_up_indication: true,
            rpdos: BTreeMap::new(),
            tpdos: BTreeMap::new(),
            moved: NodeSet::EMPTY,
        }
    }

    /// The network whose gateway this is.
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// The nodes that this client has written to in a way that may set their drives in motion.
    pub const fn moved(&self) -> NodeSet {
        self.moved
    }

    /// The nodes whose drives a line may set in motion, if it is obeyed: for the part of the program that has them stop
    /// without the gateway. A controlword that does not enable operation is not held up for that: it may be a stop.
    pub fn about_to_move(&self, line: &str) -> NodeSet {
        let mut nodes = NodeSet::EMPTY;
        match GatewayRequest::parse(line) {
            Ok(Some(GatewayRequest { place, command: GatewayCommand::Write(mux, bytes), .. })) => {
                let may_move = object_may_move(mux).is_some() && !is_stop(mux, &bytes);
                if let (true, Ok(node)) = (may_move, self.node(&place)) {
                    nodes.insert(node.id());
                }
            }
            Ok(Some(GatewayRequest { command: GatewayCommand::WritePdo(number, _), .. })) => {
                if let Some((id, _)) = self.tpdos.get(&number) {
                    self.moved_by(*id).into_iter().for_each(|node| nodes.insert(node));
                }
            }
            _ => {}
        }
        nodes
    }

    /// What a PDO at an identifier of its own moves is not known: then everything that has been heard.
    fn moved_by(&self, id: u16) -> Vec<NodeId> {
        match Service::of(CanId::standard(id)) {
            Some(Service::Rpdo(_, node)) => vec![node],
            _ => self.network.seen().iter().collect(),
        }
    }

    /// Does what a line asks, and answers with a line; nothing for an empty one or a comment.
    pub async fn answer(&mut self, line: &str) -> Option<String> {
        let (sequence, done) = match GatewayRequest::parse(line) {
            Ok(None) => return None,
            Err(Unreadable { sequence, refusal }) => (sequence, Err(refusal)),
            Ok(Some(request)) => (request.sequence, self.obey(request).await),
        };
        Some(match done {
            Ok(said) => format!("[{sequence}] {said}\r\n"),
            Err(refusal) => format!("[{sequence}] ERROR: {refusal}\r\n"),
        })
    }

    /// The answer to a line that is longer than [`super::MAX_LINE`] or not text.
    pub fn unreadable() -> String {
        format!("[0] ERROR: {}\r\n", Refusal::SYNTAX)
    }

    async fn obey(&mut self, request: GatewayRequest) -> Result<String, Refusal> {
        use GatewayCommand as Do;
        let place = request.place.as_slice();
        match request.command {
            Do::Read(mux, kind) => {
                let payload = self.node(place)?.upload(mux).await.map_err(|error| Refusal::from(&error))?;
                // CiA 301, 7.2.4.3.17: 0607 0010h, the length of the parameter does not match.
                let mismatch = Refusal::Abort(canopen::AbortCode(0x0607_0010));
                return kind.text(payload.as_bytes()).ok_or(mismatch);
            }
            Do::Write(mux, bytes) => {
                let node = self.node(place)?;
                if object_may_move(mux).is_some() {
                    self.note_moved(node.id());
                }
                node.download(mux, &bytes).await.map_err(|error| Refusal::from(&error))?;
            }
            // Whatever its numbers mean there: guarding takes a node, for one.
            Do::NotSupported => return Err(Refusal::NOT_SUPPORTED),
            Do::Start => self.nmt(place, NmtCommand::Start)?,
            Do::Stop => self.nmt(place, NmtCommand::Stop)?,
            Do::PreOperational => self.nmt(place, NmtCommand::EnterPreOperational)?,
            Do::ResetNode => self.nmt(place, NmtCommand::ResetNode)?,
            Do::ResetCommunication => self.nmt(place, NmtCommand::ResetCommunication)?,
            Do::WatchHeartbeat(time) => self.node(place)?.watch_heartbeat(Some(Duration::from_millis(time.into()))),
            Do::ForgetHeartbeat => self.node(place)?.watch_heartbeat(None),
            Do::ReadPdo(number) => {
                self.net(place)?;
                let said = self.rpdos.values().find(|(known, _)| *known == number).ok_or(Refusal::STATE)?;
                return said.1.last.as_ref().map(|values| pdo_text(number, values)).ok_or(Refusal::STATE);
            }
            Do::InfoVersion => {
                self.net(place)?;
                return Ok(version());
            }
            command => {
                self.net(place)?;
                self.set(command)?;
            }
        }
        Ok("OK".to_owned())
    }

    /// What concerns the gateway, not a node.
    fn set(&mut self, command: GatewayCommand) -> Result<(), Refusal> {
        use GatewayCommand as Do;
        match command {
            Do::SetSdoTimeout(time) => self.sdo_timeout = Duration::from_millis(time.into()),
            Do::SetNetwork(NET) => {}
            Do::SetNetwork(_) => return Err(Refusal::NETWORK),
            Do::SetNode(node) => self.default_node = Some(node_id(node)?),
            Do::SetId(node) => self.own_id = Some(node_id(node)?),
            Do::SetHeartbeat(time) => {
                let own = self.own_id.ok_or(Refusal::STATE)?;
                self.network.heartbeat(own, (time > 0).then(|| Duration::from_millis(time.into())));
            }
            Do::BootUpIndication(wanted) => self.boot_up_indication = wanted,
            Do::SetRpdo(number, cob, types) => {
                let id = pdo_id(cob, &types)?;
                self.rpdos.retain(|_, (known, _)| *known != number);
                if self.rpdos.len() >= MAX_PDOS {
                    return Err(Refusal::STATE);
                }
                self.rpdos.insert(id, (number, PdoData { types, last: None }));
            }
            Do::SetTpdo(number, cob, types) => {
                let id = pdo_id(cob, &types)?;
                if self.tpdos.len() >= MAX_PDOS && !self.tpdos.contains_key(&number) {
                    return Err(Refusal::STATE);
                }
                self.tpdos.insert(number, (id, types));
            }
            Do::WritePdo(number, values) => self.write_pdo(number, &values)?,
            _ => return Err(Refusal::NOT_SUPPORTED),
        }
        Ok(())
    }

    fn write_pdo(&mut self, number: u64, values: &[String]) -> Result<(), Refusal> {
        let (id, types) = self.tpdos.get(&number).ok_or(Refusal::STATE)?;
        if types.len() != values.len() {
            return Err(Refusal::SYNTAX);
        }
        let mut data = Vec::new();
        for (kind, value) in types.iter().zip(values) {
            data.extend(kind.bytes(value).ok_or(Refusal::SYNTAX)?);
        }
        let frame = Frame::new(CanId::standard(*id), &data);
        self.moved_by(*id).into_iter().for_each(|node| self.note_moved(node));
        self.network.transmit(frame);
        Ok(())
    }

    fn note_moved(&mut self, node: NodeId) {
        self.moved.insert(node);
        self.network.note_moved(node, CONTROLWORD);
    }

    /// The node of a command: `NET NODE`, `NODE`, or the default.
    fn node(&self, place: &[u64]) -> Result<Node, Refusal> {
        let node = match place {
            [] => self.default_node.ok_or(Refusal::NO_DEFAULT_NODE)?,
            [node] => node_id(*node)?,
            [net, node, ..] => {
                self.net(&[*net])?;
                node_id(*node)?
            }
        };
        Ok(self.network.node(node).with_timeout(self.sdo_timeout))
    }

    /// NMT: node 0 is all nodes.
    fn nmt(&self, place: &[u64], command: NmtCommand) -> Result<(), Refusal> {
        match place {
            [0] => self.network.nmt_all(command),
            [net, 0] => {
                self.net(&[*net])?;
                self.network.nmt_all(command);
            }
            place => self.node(place)?.nmt(command),
        }
        Ok(())
    }

    /// The network of a command: `NET`, or the default.
    fn net(&self, place: &[u64]) -> Result<(), Refusal> {
        match place {
            [] | [NET] => Ok(()),
            [_] => Err(Refusal::NETWORK),
            _ => Err(Refusal::SYNTAX),
        }
    }

    /// The line for a frame, if it is one that is reported: boot-up, EMCY, a PDO that was set up.
    pub fn frame_line(&mut self, frame: &Frame) -> Option<String> {
        if let Some((number, pdo)) = frame.standard_data_id().and_then(|id| self.rpdos.get_mut(&id)) {
            let values = pdo_values(&pdo.types, frame.data())?;
            let line = format!("{NET} PDO {}\r\n", pdo_text(*number, &values));
            pdo.last = Some(values);
            return Some(line);
        }
        match Service::of(frame.id())? {
            Service::Emcy(node) => {
                let emcy = Emcy::parse(frame)?;
                let more: String = emcy.manufacturer.iter().map(|byte| format!(" {byte:02X}")).collect();
                Some(format!("{NET} {node} EMCY {:04X} {:02X}{more}\r\n", emcy.code.0, emcy.error_register))
            }
            Service::Heartbeat(node) if self.boot_up_indication => {
                let booted = Heartbeat::parse(frame)?.nmt_state()? == NmtState::Initialising;
                booted.then(|| format!("{NET} {node} BOOT_UP\r\n"))
            }
            _ => None,
        }
    }

    /// The line for an event of the network, if no frame carries it.
    pub fn event_line(&self, event: &Event) -> Option<String> {
        match event {
            // CiA 309-3, internal error codes: 203 heartbeat lost, 202 heartbeat started.
            Event::HeartbeatLost(node, _) => Some(format!("{NET} {node} ERROR 203\r\n")),
            Event::HeartbeatBack(node) => Some(format!("{NET} {node} ERROR 202\r\n")),
            _ => None,
        }
    }
}

/// A controlword of the first axis with which no drive is in operation: CiA 402-2, the commands of the power drive system.
fn is_stop(mux: Mux, bytes: &[u8]) -> bool {
    let enabled = PowerCommand::EnableOperation.controlword().0;
    mux == CONTROLWORD && bytes.first().is_some_and(|low| u16::from(*low) & enabled != enabled)
}

fn node_id(node: u64) -> Result<NodeId, Refusal> {
    u8::try_from(node).ok().and_then(NodeId::new).ok_or(Refusal::NODE)
}

/// An identifier of 11 bits, and data types that a frame has room for.
fn pdo_id(cob: u64, types: &[GatewayType]) -> Result<u16, Refusal> {
    let bytes: usize = types.iter().filter_map(|kind| kind.size()).sum();
    if bytes > can::MAX_DATA_LENGTH {
        return Err(Refusal::PDO_LENGTH);
    }
    u16::try_from(cob).ok().filter(|id| (1..=CanId::MAX_STANDARD).contains(id)).ok_or(Refusal::SYNTAX)
}

/// The values of a PDO; `None` if the frame is too short for them.
fn pdo_values(types: &[GatewayType], mut data: &[u8]) -> Option<Vec<String>> {
    let mut values = Vec::with_capacity(types.len());
    for kind in types {
        let (value, rest) = data.split_at_checked(kind.size()?)?;
        values.push(kind.text(value)?);
        data = rest;
    }
    Some(values)
}

/// `NUMBER COUNT VALUE..`
fn pdo_text(number: u64, values: &[String]) -> String {
    format!("{number} {} {}", values.len(), values.join(" "))
}

/// Vendor-ID, product code, revision and serial number of the gateway (it has none), its class, the protocol's version and the
/// program's.
fn version() -> String {
    let mut numbers = env!("CARGO_PKG_VERSION").split('.');
    let (major, minor) = (numbers.next().unwrap_or("0"), numbers.next().unwrap_or("0"));
    format!("0 0 0 0 2 1.1 {major}.{minor}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_a_stop_waits_for_no_guard() {
        let session = Session::new(Network::new());
        for (line, moves) in [
            // CiA 402-2, commands: disable voltage, quick stop, shutdown, switch on; enable operation, with and without more.
            ("[1] 4 w 0x6040 0 u16 0", false),
            ("[1] 4 w 0x6040 0 u16 2", false),
            ("[1] 4 w 0x6040 0 u16 6", false),
            ("[1] 4 w 0x6040 0 u16 7", false),
            ("[1] 4 w 0x6040 0 u16 15", true),
            ("[1] 4 w 0x6040 0 x16 0x010F", true),
            ("[1] 4 w 0x60FF 0 i32 0", true),
            ("[1] 4 w 0x6042 0 i16 0", true),
            ("[1] 4 w 0x6083 0 u32 100", false),
            ("[1] 4 stop", false),
        ] {
            let node = NodeId::new(4).unwrap();
            assert_eq!(session.about_to_move(line).contains(node), moves, "{line}");
        }
    }
}

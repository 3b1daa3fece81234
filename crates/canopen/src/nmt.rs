//! Network management: node control (CiA 301, 7.2.8).
//!
//! The master's frames on identifier 0 and the slave's states. Boot-up and heartbeat are in [`crate::heartbeat`].
//! What a reset does to a device is its owner's business; see [`crate::node`]. Node guarding is in
//! [`crate::guarding`].

use core::fmt;

use can::Frame;

use crate::{NodeId, connection_set};

/// State of an NMT slave. Source: CiA 301, 7.3.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtState {
    /// Before boot-up: no communication at all.
    Initialising,
    /// SDO, SYNC, EMCY and heartbeat; no PDO.
    PreOperational,
    /// Everything.
    Operational,
    /// NMT and heartbeat only.
    Stopped,
}

impl NmtState {
    /// The state byte of a heartbeat; boot-up is the one of `Initialising`.
    pub const fn heartbeat_byte(self) -> u8 {
        match self {
            Self::Initialising => 0x00,
            Self::Stopped => 0x04,
            Self::Operational => 0x05,
            Self::PreOperational => 0x7F,
        }
    }

    /// The state in a heartbeat byte; bit 7 (the guarding toggle) is ignored.
    pub const fn from_heartbeat_byte(byte: u8) -> Option<Self> {
        match byte & 0x7F {
            0x00 => Some(Self::Initialising),
            0x04 => Some(Self::Stopped),
            0x05 => Some(Self::Operational),
            0x7F => Some(Self::PreOperational),
            _ => None,
        }
    }

    /// SDO, SYNC and EMCY exist in this state. Source: CiA 301, table 37.
    pub const fn allows_sdo(self) -> bool {
        matches!(self, Self::PreOperational | Self::Operational)
    }

    /// PDOs exist in this state.
    pub const fn allows_pdo(self) -> bool {
        matches!(self, Self::Operational)
    }

    /// What `command` does to a slave in this state.
    pub const fn handle(self, command: NmtCommand) -> Transition {
        let target = match command {
            _ if matches!(self, Self::Initialising) => return Transition::None,
            NmtCommand::ResetNode => return Transition::ResetNode,
            NmtCommand::ResetCommunication => return Transition::ResetCommunication,
            NmtCommand::Start => Self::Operational,
            NmtCommand::Stop => Self::Stopped,
            NmtCommand::EnterPreOperational => Self::PreOperational,
        };
        if target as u8 == self as u8 { Transition::None } else { Transition::Enter(target) }
    }
}

/// As people write them: `pre-operational`.
impl fmt::Display for NmtState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Initialising => "initialising",
            Self::PreOperational => "pre-operational",
            Self::Operational => "operational",
            Self::Stopped => "stopped",
        })
    }
}

/// What an NMT command does to a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transition {
    /// Nothing: it is there already, or not up yet.
    None,
    /// To this state.
    Enter(NmtState),
    /// Application and communication start over.
    ResetNode,
    /// Communication starts over.
    ResetCommunication,
}

/// NMT command specifier. Source: CiA 301, 7.2.8.2.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtCommand {
    /// 01h: start remote node, to operational.
    Start,
    /// 02h: stop remote node.
    Stop,
    /// 80h.
    EnterPreOperational,
    /// 81h.
    ResetNode,
    /// 82h.
    ResetCommunication,
}

impl NmtCommand {
    /// All five.
    pub const ALL: [Self; 5] =
        [Self::Start, Self::Stop, Self::EnterPreOperational, Self::ResetNode, Self::ResetCommunication];

    /// As people write it: `reset` is reset node.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::EnterPreOperational => "pre-operational",
            Self::ResetNode => "reset",
            Self::ResetCommunication => "reset-communication",
        }
    }

    /// The command of a [word](Self::word).
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|command| command.word() == word)
    }

    /// The command specifier byte.
    pub const fn code(self) -> u8 {
        match self {
            Self::Start => 0x01,
            Self::Stop => 0x02,
            Self::EnterPreOperational => 0x80,
            Self::ResetNode => 0x81,
            Self::ResetCommunication => 0x82,
        }
    }

    /// The command of a specifier byte.
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0x01 => Some(Self::Start),
            0x02 => Some(Self::Stop),
            0x80 => Some(Self::EnterPreOperational),
            0x81 => Some(Self::ResetNode),
            0x82 => Some(Self::ResetCommunication),
            _ => None,
        }
    }
}

/// Whom an NMT command is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtTarget {
    /// Node 0: every node on the bus.
    All,
    /// One node.
    Node(NodeId),
}

impl NmtTarget {
    /// True if `node` is meant.
    pub fn includes(self, node: NodeId) -> bool {
        match self {
            Self::All => true,
            Self::Node(target) => target == node,
        }
    }
}

/// A frame of the NMT master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NmtRequest {
    /// What to do.
    pub command: NmtCommand,
    /// Who is to do it.
    pub target: NmtTarget,
}

/// Why a frame is not an [`NmtRequest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MalformedNmt {
    /// Not a data frame with identifier 0.
    OtherFrame,
    /// Fewer than two bytes.
    TooShort {
        /// Bytes received.
        dlc: u8,
    },
    /// A command specifier that the standard does not define.
    UnknownCommand(u8),
    /// A node-ID above 127.
    NoSuchNode(u8),
}

impl NmtRequest {
    /// `command` for `target`.
    pub const fn new(command: NmtCommand, target: NmtTarget) -> Self {
        Self { command, target }
    }

    /// Reads a frame. Bytes after the second are ignored.
    ///
    /// # Errors
    /// What is wrong with the frame.
    pub fn parse(frame: &Frame) -> Result<Self, MalformedNmt> {
        if frame.id() != connection_set::NMT || frame.is_remote() {
            return Err(MalformedNmt::OtherFrame);
        }
        let [code, node, ..] = frame.data() else { return Err(MalformedNmt::TooShort { dlc: frame.dlc() }) };
        let command = NmtCommand::from_code(*code).ok_or(MalformedNmt::UnknownCommand(*code))?;
        let target = match *node {
            0 => NmtTarget::All,
            raw => NmtTarget::Node(NodeId::new(raw).ok_or(MalformedNmt::NoSuchNode(raw))?),
        };
        Ok(Self { command, target })
    }

    /// The frame of this request.
    pub fn emit(self) -> Frame {
        let node = match self.target {
            NmtTarget::All => 0,
            NmtTarget::Node(node) => node.raw(),
        };
        Frame::new(connection_set::NMT, &[self.command.code(), node])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::CanId;

    #[test]
    fn what_is_emitted_is_parsed_back() {
        for command in NmtCommand::ALL {
            for target in NodeId::all().map(NmtTarget::Node).chain([NmtTarget::All]) {
                let request = NmtRequest::new(command, target);
                assert_eq!(NmtRequest::parse(&request.emit()), Ok(request));
            }
        }
    }

    #[test]
    fn the_word_of_a_command_is_understood() {
        for command in NmtCommand::ALL {
            assert_eq!(NmtCommand::of_word(command.word()), Some(command));
        }
        assert_eq!(NmtCommand::of_word("reset"), NmtCommand::from_code(0x81));
        assert_eq!(NmtCommand::of_word("preop"), None);
    }

    #[test]
    fn other_frames_are_refused_with_a_reason() {
        let parse = |text: &str| NmtRequest::parse(&text.parse().unwrap());
        assert_eq!(parse("000#"), Err(MalformedNmt::TooShort { dlc: 0 }));
        assert_eq!(parse("000#01"), Err(MalformedNmt::TooShort { dlc: 1 }));
        assert_eq!(parse("000#0304"), Err(MalformedNmt::UnknownCommand(3)));
        assert_eq!(parse("000#0180"), Err(MalformedNmt::NoSuchNode(0x80)));
        assert_eq!(parse("001#0104"), Err(MalformedNmt::OtherFrame));
        assert_eq!(parse("000#R2"), Err(MalformedNmt::OtherFrame));
        assert_eq!(NmtRequest::parse(&Frame::new(CanId::extended(0), &[1, 4])), Err(MalformedNmt::OtherFrame));
    }

    /// CiA 301, table 37.
    #[test]
    fn each_state_has_its_services() {
        use NmtState::*;
        let services = [(Initialising, false, false), (PreOperational, true, false), (Operational, true, true)];
        for (state, sdo, pdo) in services.into_iter().chain([(Stopped, false, false)]) {
            assert_eq!((state.allows_sdo(), state.allows_pdo()), (sdo, pdo), "{state}");
        }
    }

    #[test]
    fn a_slave_moves_as_figure_48_shows() {
        use NmtState::*;
        for state in [PreOperational, Operational, Stopped] {
            for (command, target) in [
                (NmtCommand::Start, Operational),
                (NmtCommand::Stop, Stopped),
                (NmtCommand::EnterPreOperational, PreOperational),
            ] {
                let expected = if state == target { Transition::None } else { Transition::Enter(target) };
                assert_eq!(state.handle(command), expected);
            }
            assert_eq!(state.handle(NmtCommand::ResetNode), Transition::ResetNode);
            assert_eq!(state.handle(NmtCommand::ResetCommunication), Transition::ResetCommunication);
        }
        for command in NmtCommand::ALL {
            assert_eq!(Initialising.handle(command), Transition::None);
        }
    }
}

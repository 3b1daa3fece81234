//! Operations of the layered standard for buses, as far as classical CAN has them (fmi-ls-bus 1.0, "CAN, CAN FD, CAN XL").
//!
//! An operation is an operation code, its whole length, and its arguments, all numbers with the lowest byte first.
//! Several stand behind one another in one binary variable.

use can::{CanId, Frame, MAX_DATA_LENGTH};

const FORMAT_ERROR: u32 = 0x01;
const CAN_TRANSMIT: u32 = 0x10;
const CONFIRM: u32 = 0x20;
const ARBITRATION_LOST: u32 = 0x30;
const BUS_ERROR: u32 = 0x31;
const CONFIGURATION: u32 = 0x40;
const STATUS: u32 = 0x41;
const WAKEUP: u32 = 0x42;

/// Operation code and length.
const HEADER: usize = 8;
const CAN_BAUDRATE: u8 = 1;
const ARBITRATION_LOST_BEHAVIOR: u8 = 4;

/// One operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Operation {
    /// An operation came that was not understood: its bytes, at most 65,535.
    FormatError(Vec<u8>),
    /// A frame: from a node to be sent, from the bus received.
    Transmit(Frame),
    /// The node's frame with this identifier was sent and acknowledged.
    Confirm(u32),
    /// The node's frame with this identifier was not sent at once, and the bus has dropped it.
    ArbitrationLost(u32),
    /// A frame was destroyed.
    BusError(BusError),
    /// The node's bit rate, in bit/s.
    Baudrate(u32),
    /// What the bus does with a frame of the node that loses arbitration.
    ArbitrationLostBehavior(LostFrame),
    /// The state of the node's controller.
    Status(NodeStatus),
    /// A wake-up pulse.
    Wakeup,
}

/// A frame that was destroyed, as one node is notified of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusError {
    /// The identifier of the frame.
    pub id: u32,
    /// What was wrong with it.
    pub code: ErrorCode,
    /// The node is among those that saw it first.
    pub is_primary: bool,
    /// The node was sending it.
    pub is_sender: bool,
}

/// What was wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorCode {
    /// A bit was not the one sent.
    Bit = 1,
    /// Six equal bits in a row.
    Stuff = 2,
    /// A bit of fixed level had the other.
    Form = 3,
    /// The check sum did not fit.
    Crc = 4,
    /// No node acknowledged it.
    Acknowledge = 5,
    /// An error frame was disturbed.
    BrokenErrorFrame = 6,
}

/// What becomes of a frame that loses arbitration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LostFrame {
    /// It is sent as soon as the bus is free.
    #[default]
    Buffer = 1,
    /// It is dropped, and its sender is notified.
    Discard = 2,
}

/// The state of a node's controller (ISO 11898-1, fault confinement).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NodeStatus {
    /// Error active.
    #[default]
    Active = 1,
    /// Error passive.
    Passive = 2,
    /// Takes no part.
    BusOff = 3,
}

impl Operation {
    /// Appends the operation to `bytes`.
    pub fn write(&self, bytes: &mut Vec<u8>) {
        let begin = bytes.len();
        let code = self.code();
        bytes.extend(code.to_le_bytes());
        bytes.extend([0; 4]);
        match self {
            Self::FormatError(data) => {
                let data = &data[..data.len().min(usize::from(u16::MAX))];
                bytes.extend((data.len() as u16).to_le_bytes());
                bytes.extend(data);
            }
            Self::Transmit(frame) => {
                bytes.extend(frame.id().raw().to_le_bytes());
                bytes.push(frame.id().is_extended().into());
                bytes.push(frame.is_remote().into());
                // A remote frame carries no bytes; its length code is the length that it asks for.
                bytes.extend(u16::from(frame.dlc()).to_le_bytes());
                bytes.extend(&frame.padded()[..usize::from(frame.dlc())]);
            }
            Self::Confirm(id) | Self::ArbitrationLost(id) => bytes.extend(id.to_le_bytes()),
            Self::BusError(error) => {
                bytes.extend(error.id.to_le_bytes());
                bytes.extend([error.code as u8, if error.is_primary { 1 } else { 2 }, error.is_sender.into()]);
            }
            Self::Baudrate(rate) => {
                bytes.push(CAN_BAUDRATE);
                bytes.extend(rate.to_le_bytes());
            }
            Self::ArbitrationLostBehavior(lost) => bytes.extend([ARBITRATION_LOST_BEHAVIOR, *lost as u8]),
            Self::Status(status) => bytes.push(*status as u8),
            Self::Wakeup => {}
        }
        let length = (bytes.len() - begin) as u32;
        bytes[begin + 4..begin + HEADER].copy_from_slice(&length.to_le_bytes());
    }

    const fn code(&self) -> u32 {
        match self {
            Self::FormatError(_) => FORMAT_ERROR,
            Self::Transmit(_) => CAN_TRANSMIT,
            Self::Confirm(_) => CONFIRM,
            Self::ArbitrationLost(_) => ARBITRATION_LOST,
            Self::BusError(_) => BUS_ERROR,
            Self::Baudrate(_) | Self::ArbitrationLostBehavior(_) => CONFIGURATION,
            Self::Status(_) => STATUS,
            Self::Wakeup => WAKEUP,
        }
    }
}

/// Reads the operations of a binary variable, one after the other. `Err` has the bytes that are not an operation of classical
/// CAN; if even their length makes no sense, all the rest.
pub fn operations(bytes: &[u8]) -> impl Iterator<Item = Result<Operation, &[u8]>> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let length = number(rest.get(4..HEADER)).map(|length| length as usize);
        let whole = length.filter(|length| (HEADER..=rest.len()).contains(length)).unwrap_or(rest.len());
        let (operation, behind) = rest.split_at(whole);
        rest = behind;
        Some(one(operation).ok_or(operation))
    })
}

/// Four bytes as a number.
fn number(bytes: Option<&[u8]>) -> Option<u32> {
    Some(u32::from_le_bytes(bytes?.try_into().ok()?))
}

fn boolean(byte: u8) -> Option<bool> {
    (byte <= 1).then_some(byte == 1)
}

/// The operation that these bytes are, no more and no less.
fn one(bytes: &[u8]) -> Option<Operation> {
    let code = number(bytes.get(..4))?;
    if number(bytes.get(4..HEADER))? as usize != bytes.len() {
        return None;
    }
    let content = &bytes[HEADER..];
    Some(match (code, content) {
        (FORMAT_ERROR, [low, high, data @ ..]) if usize::from(u16::from_le_bytes([*low, *high])) == data.len() => {
            Operation::FormatError(data.to_vec())
        }
        (CAN_TRANSMIT, [_, _, _, _, extended, remote, low, high, data @ ..]) => {
            let length = usize::from(u16::from_le_bytes([*low, *high]));
            let id = id(number(content.get(..4))?, boolean(*extended)?)?;
            if length != data.len() || length > MAX_DATA_LENGTH {
                return None;
            }
            let remote = boolean(*remote)?;
            Operation::Transmit(if remote { Frame::remote(id, length as u8) } else { Frame::new(id, data) })
        }
        (CONFIRM, [_, _, _, _]) => Operation::Confirm(number(Some(content))?),
        (ARBITRATION_LOST, [_, _, _, _]) => Operation::ArbitrationLost(number(Some(content))?),
        (BUS_ERROR, [_, _, _, _, code, flag @ (1 | 2), sender]) => Operation::BusError(BusError {
            id: number(content.get(..4))?,
            code: error_code(*code)?,
            is_primary: *flag == 1,
            is_sender: boolean(*sender)?,
        }),
        (CONFIGURATION, [CAN_BAUDRATE, rate @ ..]) => Operation::Baudrate(number(Some(rate))?),
        (CONFIGURATION, [ARBITRATION_LOST_BEHAVIOR, 1]) => Operation::ArbitrationLostBehavior(LostFrame::Buffer),
        (CONFIGURATION, [ARBITRATION_LOST_BEHAVIOR, 2]) => Operation::ArbitrationLostBehavior(LostFrame::Discard),
        (STATUS, [1]) => Operation::Status(NodeStatus::Active),
        (STATUS, [2]) => Operation::Status(NodeStatus::Passive),
        (STATUS, [3]) => Operation::Status(NodeStatus::BusOff),
        (WAKEUP, []) => Operation::Wakeup,
        _ => return None,
    })
}

fn id(raw: u32, extended: bool) -> Option<CanId> {
    if extended {
        (raw <= CanId::MAX_EXTENDED).then(|| CanId::extended(raw))
    } else {
        let raw = u16::try_from(raw).ok().filter(|raw| *raw <= CanId::MAX_STANDARD)?;
        Some(CanId::standard(raw))
    }
}

fn error_code(code: u8) -> Option<ErrorCode> {
    use ErrorCode::{Acknowledge, Bit, BrokenErrorFrame, Crc, Form, Stuff};
    [Bit, Stuff, Form, Crc, Acknowledge, BrokenErrorFrame].into_iter().find(|known| *known as u8 == code)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(operation: &Operation) -> Vec<u8> {
        let mut bytes = Vec::new();
        operation.write(&mut bytes);
        bytes
    }

    fn read(bytes: &[u8]) -> Vec<Result<Operation, &[u8]>> {
        operations(bytes).collect()
    }

    /// The layered standard's tables of contents: code, length, arguments.
    #[test]
    fn a_transmit_is_as_the_standard_lays_it_out() {
        let frame: Frame = "001#01020304".parse().unwrap();
        let expected = [16, 0, 0, 0, 20, 0, 0, 0, 1, 0, 0, 0, 0, 0, 4, 0, 1, 2, 3, 4];
        assert_eq!(written(&Operation::Transmit(frame)), expected);
        assert_eq!(written(&Operation::Confirm(1)), [0x20, 0, 0, 0, 12, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(written(&Operation::Baudrate(500_000)), [0x40, 0, 0, 0, 13, 0, 0, 0, 1, 0x20, 0xA1, 7, 0]);
        assert_eq!(written(&Operation::Status(NodeStatus::BusOff)), [0x41, 0, 0, 0, 9, 0, 0, 0, 3]);
        assert_eq!(written(&Operation::ArbitrationLost(7)), [0x30, 0, 0, 0, 12, 0, 0, 0, 7, 0, 0, 0]);
        assert_eq!(written(&Operation::Wakeup), [0x42, 0, 0, 0, 8, 0, 0, 0]);
    }

    #[test]
    fn several_operations_stand_behind_one_another() {
        let all = [
            Operation::Transmit("184#R4".parse().unwrap()),
            Operation::Transmit("00000604#".parse().unwrap()),
            Operation::ArbitrationLost(7),
            Operation::BusError(BusError { id: 5, code: ErrorCode::Crc, is_primary: true, is_sender: false }),
            Operation::ArbitrationLostBehavior(LostFrame::Discard),
            Operation::Wakeup,
            Operation::FormatError(vec![1, 2, 3]),
        ];
        let mut bytes = Vec::new();
        all.iter().for_each(|operation| operation.write(&mut bytes));
        assert_eq!(read(&bytes), all.into_iter().map(Ok).collect::<Vec<_>>());
    }

    #[test]
    fn what_is_not_an_operation_is_handed_back_and_the_next_one_is_read() {
        let mut bytes = vec![0x99, 0, 0, 0, 9, 0, 0, 0, 5];
        Operation::Wakeup.write(&mut bytes);
        assert_eq!(read(&bytes), [Err(&bytes[..9]), Ok(Operation::Wakeup)]);
        // A length that cannot be: where the next one begins is unknown.
        let torn = [0x20, 0, 0, 0, 200, 0, 0, 0, 1, 0];
        assert_eq!(read(&torn), [Err(&torn[..])]);
        assert_eq!(read(&[1, 2]), [Err(&[1, 2][..])]);
        // Nine bytes are not a classical frame, and 800h is not a standard identifier.
        let mut nine = written(&Operation::Transmit(Frame::new(CanId::standard(1), &[0; 8])));
        nine.push(0);
        nine[4] = 25;
        nine[14] = 9;
        assert_eq!(read(&nine), [Err(&nine[..])]);
        let mut wide = written(&Operation::Transmit(Frame::new(CanId::standard(1), &[])));
        wide[9] = 8;
        assert_eq!(read(&wide), [Err(&wide[..])]);
    }
}

//! Frames as packets of pcap and pcapng: LINKTYPE_CAN_SOCKETCAN (227), and the cooked packets of `-i any` (LINKTYPE_LINUX_SLL,
//! 113). Source: the list of link types of the Tcpdump Group.

use can::{CanId, Frame, MAX_DATA_LENGTH};

use crate::record::{Content, Direction, RawErrorFrame};

/// CAN frames as Linux has them, with the identifier in network byte order.
pub(super) const CAN_SOCKETCAN: u32 = 227;
/// A head that says from where and which protocol, then the same.
const LINUX_SLL: u32 = 113;

/// Length of the cooked head.
const SLL_HEAD: usize = 16;
/// ARPHRD_CAN: the hardware of a cooked packet.
const ARPHRD_CAN: u16 = 280;
/// Packet type of a cooked packet that this host sent.
const OUTGOING: u16 = 4;

/// Identifier, length, FD flags, two reserved bytes.
const CAN_HEAD: usize = 8;
const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;
/// Bit of the FD flags that says that it is an FD frame, and what is always set in longer ones.
const FD: u8 = 0x04;

/// Longest packet that is looked at: the cooked head and an FD frame.
pub(super) const MAX_PACKET: usize = SLL_HEAD + CAN_HEAD + 64;

/// Why a link type is not read; `None` if it is.
pub(super) fn refused_link(link: u32) -> Option<String> {
    match link {
        CAN_SOCKETCAN | LINUX_SLL => None,
        other => Some(format!(
            "packets of link type {other} are not read; those of CAN are 227 (CAN_SOCKETCAN) and 113 (LINUX_SLL)"
        )),
    }
}

/// Reads a packet; `None` for a cooked packet of something else than CAN.
pub(super) fn parse(link: u32, packet: &[u8]) -> Result<Option<(Option<Direction>, Content)>, &'static str> {
    if link == LINUX_SLL {
        let (head, frame) = packet.split_at_checked(SLL_HEAD).ok_or("a cooked packet is shorter than its head")?;
        if u16::from_be_bytes([head[2], head[3]]) != ARPHRD_CAN {
            return Ok(None);
        }
        let sent = u16::from_be_bytes([head[0], head[1]]) == OUTGOING;
        let direction = if sent { Direction::Transmitted } else { Direction::Received };
        return content(frame).map(|content| Some((Some(direction), content)));
    }
    content(packet).map(|content| Some((None, content)))
}

fn content(packet: &[u8]) -> Result<Content, &'static str> {
    let (head, data) = packet.split_at_checked(CAN_HEAD).ok_or("a packet is shorter than the header of a CAN frame")?;
    let raw = u32::from_be_bytes([head[0], head[1], head[2], head[3]]);
    let length = usize::from(head[4]);
    let id = if raw & EXTENDED != 0 { CanId::extended(raw) } else { CanId::standard(raw as u16) };
    if head[5] & FD != 0 || length > MAX_DATA_LENGTH {
        let length = u8::try_from(length).ok().filter(|length| *length <= 64);
        return Ok(Content::FdFrame { id, length: length.ok_or("a CAN frame declares more than 64 bytes")? });
    }
    if raw & EXTENDED == 0 && raw & CanId::MAX_EXTENDED > u32::from(CanId::MAX_STANDARD) && raw & ERROR == 0 {
        return Err("a standard identifier is beyond 7FF");
    }
    if raw & REMOTE != 0 {
        return Ok(Content::Frame(Frame::remote(id, length as u8)));
    }
    let data = data.get(..length).ok_or("a packet has fewer bytes than its frame's length says")?;
    if raw & ERROR != 0 {
        let mut bytes = [0; MAX_DATA_LENGTH];
        bytes[..length].copy_from_slice(data);
        return Ok(Content::Error(RawErrorFrame { class: raw & CanId::MAX_EXTENDED, data: bytes }));
    }
    Ok(Content::Frame(Frame::new(id, data)))
}

/// Appends a packet of link type 227; nothing for an FD frame, whose data was not kept.
pub(super) fn emit(content: &Content, out: &mut Vec<u8>) {
    match content {
        Content::Frame(frame) => {
            let extended = if frame.id().is_extended() { EXTENDED } else { 0 };
            let remote = if frame.is_remote() { REMOTE } else { 0 };
            out.extend((frame.id().raw() | extended | remote).to_be_bytes());
            out.extend([frame.dlc(), 0, 0, 0]);
            out.extend(frame.data());
        }
        Content::Error(error) => {
            out.extend((error.class & CanId::MAX_EXTENDED | ERROR).to_be_bytes());
            out.extend([MAX_DATA_LENGTH as u8, 0, 0, 0]);
            out.extend(error.data);
        }
        Content::FdFrame { .. } => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_is_the_frame_of_linux() {
        // linux/can.h: can_id with EFF 8000 0000h, RTR 4000 0000h, ERR 2000 0000h; then the length, then the data.
        for (packet, frame) in [
            (&[0, 0, 6, 4, 2, 0, 0, 0, 0x40, 0x41][..], "604#4041"),
            (&[0x80, 0, 6, 4, 0, 0, 0, 0], "00000604#"),
            (&[0x40, 0, 1, 0x84, 4, 0, 0, 0], "184#R4"),
        ] {
            let content = Content::Frame(frame.parse().unwrap());
            assert_eq!(parse(CAN_SOCKETCAN, packet), Ok(Some((None, content))));
            let mut out = Vec::new();
            emit(&content, &mut out);
            assert_eq!(out, packet);
        }
        let cooked = [0, 4, 1, 24, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0x80, 0, 0, 0, 0];
        let sync = Content::Frame("080#".parse().unwrap());
        assert_eq!(parse(LINUX_SLL, &cooked), Ok(Some((Some(Direction::Transmitted), sync))));
        let mut ethernet = cooked;
        ethernet[3] = 1;
        assert_eq!(parse(LINUX_SLL, &ethernet), Ok(None));
    }

    #[test]
    fn fd_frames_and_torn_packets_are_reported() {
        let fd = Content::FdFrame { id: CanId::standard(0x123), length: 12 };
        assert_eq!(parse(CAN_SOCKETCAN, &[0, 0, 1, 0x23, 12, 4, 0, 0]), Ok(Some((None, fd))));
        for packet in
            [&[0, 0, 1][..], &[0, 0, 6, 4, 2, 0, 0, 0, 0x40], &[0, 0, 8, 0, 0, 0, 0, 0], &[0, 0, 1, 0, 65, 4, 0, 0]]
        {
            assert!(parse(CAN_SOCKETCAN, packet).is_err(), "{packet:?}");
        }
    }
}

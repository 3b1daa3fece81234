//! Which frames may set a drive in motion: a check before sending again what another program sent.
//!
//! Rather too many than too few: what an object of a maker (2000h to 5FFFh) does is not known here, nor what a PDO at an
//! identifier of its own carries.

use canopen::nmt::NmtRequest;
use canopen::pdo::{AddressMode, Direction, Mpdo};
use canopen::{Mux, NmtCommand, NodeId};

use super::{Decoded, Pdo, SdoStep, Side};

impl Decoded {
    /// Why sending this frame may set a drive in motion; `None` if it cannot on its own.
    pub fn may_move(&self) -> Option<&'static str> {
        match self {
            // It makes process data count, what is in them by then included.
            Self::Nmt(NmtRequest { command: NmtCommand::Start, .. }) => Some("NMT start"),
            Self::Pdo(Pdo { multiplexed: Some(mpdo), .. }) => match mpdo.mode {
                AddressMode::Destination => object_may_move(mpdo.object),
                AddressMode::Source => Some("a multiplexed PDO, whose object its receivers lead to one of theirs"),
            },
            Self::Pdo(pdo) if pdo.pdo.direction == Direction::Rpdo => Some("an RPDO"),
            Self::Sdo(sdo) if sdo.from == Side::Client => match &sdo.step {
                SdoStep::Write(mux, _) | SdoStep::Begin(mux, _) | SdoStep::Segment(mux, _) => object_may_move(*mux),
                SdoStep::Read(_) | SdoStep::ReadDone(..) | SdoStep::WriteDone(..) | SdoStep::Abort(..) => None,
                _ => Some("part of an SDO transfer whose object is not known"),
            },
            Self::Unknown => Some("a frame that may be a PDO at an identifier of its own"),
            _ => None,
        }
    }

    /// The node whose drive it may move; `None` for all of them, or where that is not known.
    pub fn may_move_node(&self) -> Option<NodeId> {
        match self {
            Self::Nmt(NmtRequest { target: canopen::nmt::NmtTarget::Node(node), .. }) => Some(*node),
            Self::Pdo(Pdo { multiplexed: Some(Mpdo { mode: AddressMode::Source, .. }), .. }) => None,
            Self::Pdo(pdo) => pdo.object_node(),
            Self::Sdo(sdo) => Some(sdo.node),
            _ => None,
        }
    }
}

/// A write to the communication profile (1000h to 1FFFh) configures and does not move; a profile's own ramps, limits and
/// units do not either.
pub(crate) fn object_may_move(mux: Mux) -> Option<&'static str> {
    /// Distance of two axes' objects of the device profile (CiA 402-2).
    const AXIS: u16 = 0x800;
    match mux.index {
        0x1000..=0x1FFF => None,
        0x2000..=0x5FFF => Some("a write to a maker's object"),
        0x6000..=0x9FFF => match 0x6000 + (mux.index - 0x6000) % AXIS {
            0x6040 => Some("a controlword"),
            0x6060 => Some("a mode of operation"),
            0x6042 | 0x6071 | 0x607A | 0x60B0..=0x60B2 | 0x60C1 | 0x60FF => Some("a target"),
            0x6098 | 0x6099 => Some("a homing parameter"),
            _ => None,
        },
        _ => Some("a write to an object outside of the profiles known here"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Decoder;

    #[test]
    fn what_may_move_a_drive_is_reported() {
        let mut decoder = Decoder::new();
        for (frame, why) in [
            // CiA 301, 7.2.8: NMT start, stop, reset.
            ("000#0104", Some("NMT start")),
            ("000#0100", Some("NMT start")),
            ("000#0204", None),
            ("000#8104", None),
            ("080#", None),
            ("704#05", None),
            ("204#0F00", Some("an RPDO")),
            ("184#3706", None),
            // CiA 402: controlword, target velocity, profile acceleration; the second axis 800h on.
            ("604#2B40600006000000", Some("a controlword")),
            ("604#2B40680006000000", Some("a controlword")),
            ("604#23FF600000000000", Some("a target")),
            ("604#2383600064000000", None),
            ("604#4041600000000000", None),
            ("604#2B17100064000000", None),
            ("604#2B0F200001000000", Some("a write to a maker's object")),
            // A segmented download begins, goes on; its answer does not move.
            ("604#217A600008000000", Some("a target")),
            ("584#607A600000000000", None),
            ("12345678#00", Some("a frame that may be a PDO at an identifier of its own")),
        ] {
            let decoded = decoder.decode(&frame.parse().unwrap());
            assert_eq!(decoded.may_move(), why, "{frame}: {decoded}");
        }
    }
}

//! Which of a node's services an identifier belongs to: looked up for every frame on the bus.

use crate::NodeId;
use crate::cob::{self, PdoNumber};

/// Up to eight identifiers, side by side, so that a frame's is compared with all of them at once. Most frames on a bus
/// are for others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Identifiers([u16; LANES]);

const LANES: usize = 8;
/// Equal to no identifier.
const UNUSED: u16 = u16::MAX;

/// Lane of NMT commands.
pub(super) const NMT: u32 = 0;
/// Lane of SYNC.
pub(super) const SYNC: u32 = 1;
/// Lane of SDO requests.
pub(super) const SDO: u32 = 2;
/// Lane of RPDO 1.
pub(super) const FIRST_RPDO: u32 = 3;

/// The lanes that have an identifier, a bit each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matches(u8);

impl Matches {
    #[inline]
    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The first of the lanes; 8 if there is none.
    #[inline]
    pub(super) const fn first(self) -> u32 {
        self.0.trailing_zeros()
    }

    /// The lanes after the first.
    #[inline]
    pub(super) const fn rest(self) -> Self {
        Self(self.0 & self.0.wrapping_sub(1))
    }
}

impl Identifiers {
    /// Deaf.
    pub(super) const NONE: Self = Self([UNUSED; LANES]);

    /// NMT and SDO requests to `node_id`.
    pub(super) fn of_requests(node_id: NodeId) -> Self {
        let mut identifiers = Self::NONE;
        identifiers.set(NMT, cob::NMT.as_standard());
        identifiers.set(SDO, cob::sdo_request(node_id).as_standard());
        identifiers
    }

    pub(super) fn set(&mut self, lane: u32, id: Option<u16>) {
        self.0[lane as usize] = id.unwrap_or(UNUSED);
    }

    #[inline]
    pub(super) fn of(self, id: u16) -> Matches {
        let mut matches = 0;
        for (lane, own) in self.0.iter().enumerate() {
            matches |= u8::from(*own == id) << lane;
        }
        Matches(matches)
    }
}

const _: () = assert!(FIRST_RPDO as usize + PdoNumber::COUNT <= LANES, "a lane for every service");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_is_found_in_every_lane_that_has_it_and_in_no_other() {
        let mut identifiers = Identifiers::of_requests(NodeId::MAX);
        let rpdos = [Some(0x001), Some(0x7FE), None, Some(0x001)];
        identifiers.set(SYNC, Some(0x080));
        for (lane, id) in (FIRST_RPDO..).zip(rpdos) {
            identifiers.set(lane, id);
        }
        let listened: [Option<u16>; 8] =
            [Some(0), Some(0x080), Some(0x67F), Some(0x001), Some(0x7FE), None, Some(0x001), None];
        for id in 0..=0x7FF {
            let mut matches = identifiers.of(id);
            assert_eq!(matches.is_empty(), !listened.contains(&Some(id)));
            for lane in (0..8).filter(|lane| listened[*lane as usize] == Some(id)) {
                assert_eq!(matches.first(), lane, "{id:#X}");
                matches = matches.rest();
            }
            assert!(matches.is_empty(), "{id:#X}");
            assert!(Identifiers::NONE.of(id).is_empty());
        }
    }
}

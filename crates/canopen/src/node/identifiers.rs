//! Which of a node's services an identifier belongs to: looked up for every frame on the bus.

use crate::NodeId;
use crate::connection_set;
use crate::pdo::PdoNumber;

/// Up to eight identifiers, side by side, so that a frame's is compared with all of them at once. Most frames on a bus
/// are for others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Identifiers([u16; LANES]);

const LANES: usize = 8;
/// Equal to no identifier.
const UNUSED: u16 = u16::MAX;

/// A service that has an identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lane(usize);

impl Lane {
    /// NMT commands.
    pub(super) const NMT: Self = Self(0);
    /// SYNC.
    pub(super) const SYNC: Self = Self(1);
    /// SDO requests.
    pub(super) const SDO: Self = Self(2);

    /// The RPDO at `position`.
    pub(super) const fn rpdo(position: usize) -> Self {
        Self(Self::SDO.0 + 1 + position)
    }
}

impl Identifiers {
    /// Deaf.
    pub(super) const NONE: Self = Self([UNUSED; LANES]);

    /// NMT and SDO requests to `node_id`.
    pub(super) fn of_requests(node_id: NodeId) -> Self {
        let mut identifiers = Self::NONE;
        identifiers.set(Lane::NMT, connection_set::NMT.as_standard());
        identifiers.set(Lane::SDO, connection_set::sdo_request(node_id).as_standard());
        identifiers
    }

    pub(super) fn set(&mut self, lane: Lane, id: Option<u16>) {
        self.0[lane.0] = id.unwrap_or(UNUSED);
    }

    /// True if a service has this identifier. All are compared, without a branch between them.
    #[inline]
    pub(super) fn contain(&self, id: u16) -> bool {
        self.0.iter().fold(false, |found, own| found | (*own == id))
    }

    /// True if this service has it.
    #[inline]
    pub(super) const fn has(&self, lane: Lane, id: u16) -> bool {
        self.0[lane.0] == id
    }
}

const _: () = assert!(Lane::rpdo(PdoNumber::PREDEFINED - 1).0 < LANES, "a lane for every service");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_is_found_in_every_lane_that_has_it_and_in_no_other() {
        let mut identifiers = Identifiers::of_requests(NodeId::MAX);
        let rpdos = [Some(0x001), Some(0x7FE), None, Some(0x001)];
        identifiers.set(Lane::SYNC, Some(0x080));
        for (position, id) in rpdos.into_iter().enumerate() {
            identifiers.set(Lane::rpdo(position), id);
        }
        let listened: [Option<u16>; LANES] =
            [Some(0), Some(0x080), Some(0x67F), Some(0x001), Some(0x7FE), None, Some(0x001), None];
        for id in 0..=0x7FF {
            assert_eq!(identifiers.contain(id), listened.contains(&Some(id)), "{id:#X}");
            for (lane, own) in listened.into_iter().enumerate() {
                assert_eq!(identifiers.has(Lane(lane), id), own == Some(id), "{id:#X} in lane {lane}");
            }
            assert!(!Identifiers::NONE.contain(id));
        }
    }
}

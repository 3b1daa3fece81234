//! Which of a node's services an identifier belongs to: looked up for every frame on the bus.

use crate::od::Storage;
use crate::{NodeId, connection_set};

/// The identifiers that a node listens to. Most frames on a bus are for others: a bit for each of the 2048 identifiers
/// decides with one access.
#[derive(Clone)]
pub(super) struct Identifiers<S: Storage> {
    heard: [u32; WORDS],
    sync: u16,
    sdo: u16,
    rpdos: S::Pdos<u16>,
    /// Two RPDOs have the same identifier.
    rpdos_share: bool,
}

const WORDS: usize = 2048 / 32;
/// Equal to no identifier.
const UNUSED: u16 = u16::MAX;

impl<S: Storage> Identifiers<S> {
    /// Deaf.
    pub(super) fn none(rpdos: usize) -> Self {
        Self { heard: [0; WORDS], sync: UNUSED, sdo: UNUSED, rpdos: S::pdos(rpdos, UNUSED), rpdos_share: false }
    }

    /// Deaf until the next [`listen`](Self::listen).
    pub(super) const fn deafen(&mut self) {
        self.heard = [0; WORDS];
    }

    /// NMT, SDO requests to `node_id`, and what was set for the other services, are heard from now on.
    pub(super) fn listen(&mut self, node_id: NodeId) {
        self.sdo = connection_set::sdo_request(node_id).as_standard().unwrap_or(UNUSED);
        let rpdos = self.rpdos.as_ref();
        self.rpdos_share = rpdos.iter().enumerate().any(|(n, id)| *id != UNUSED && rpdos[..n].contains(id));
        self.deafen();
        let others = [NMT, self.sync, self.sdo];
        for id in others.iter().chain(self.rpdos.as_ref()) {
            if let Some(word) = self.heard.get_mut(usize::from(*id) / 32) {
                *word |= 1 << (id % 32);
            }
        }
    }

    /// One identifier more, until the next [`listen`](Self::listen).
    pub(super) const fn hear(&mut self, id: u16) {
        self.heard[id as usize / 32 % WORDS] |= 1 << (id % 32);
    }

    /// Takes effect with [`listen`](Self::listen).
    pub(super) fn set_sync(&mut self, id: Option<u16>) {
        self.sync = id.unwrap_or(UNUSED);
    }

    /// Takes effect with [`listen`](Self::listen).
    pub(super) fn set_rpdo(&mut self, position: usize, id: Option<u16>) {
        self.rpdos.as_mut()[position] = id.unwrap_or(UNUSED);
    }

    /// True if a service has this identifier.
    #[inline]
    pub(super) const fn contain(&self, id: u16) -> bool {
        self.heard[id as usize / 32 % WORDS] >> (id % 32) & 1 == 1
    }

    #[inline]
    pub(super) const fn is_nmt(&self, id: u16) -> bool {
        id == NMT
    }

    #[inline]
    pub(super) const fn is_sync(&self, id: u16) -> bool {
        id == self.sync
    }

    #[inline]
    pub(super) const fn is_sdo(&self, id: u16) -> bool {
        id == self.sdo
    }

    /// True if a frame may be for more than one RPDO.
    #[inline]
    pub(super) const fn rpdos_share(&self) -> bool {
        self.rpdos_share
    }

    /// The identifiers of RPDO 1 and on.
    #[inline]
    pub(super) fn rpdos(&self) -> &[u16] {
        self.rpdos.as_ref()
    }
}

/// NMT commands, from the master to all.
const NMT: u16 = 0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::od::Fixed;

    #[test]
    fn an_identifier_is_heard_if_a_service_has_it_and_no_other_is() {
        let mut identifiers = Identifiers::<Fixed<0>>::none(4);
        assert!((0..=0x7FF).all(|id| !identifiers.contain(id)));
        identifiers.set_sync(Some(0x080));
        for (position, id) in [Some(0x001), Some(0x7FE), None, Some(0x001)].into_iter().enumerate() {
            identifiers.set_rpdo(position, id);
        }
        identifiers.listen(NodeId::MAX);
        for id in 0..=0x7FF {
            assert_eq!(identifiers.contain(id), [0, 0x080, 0x67F, 0x001, 0x7FE].contains(&id), "{id:#X}");
        }
        identifiers.deafen();
        assert!((0..=0x7FF).all(|id| !identifiers.contain(id)));
    }
}

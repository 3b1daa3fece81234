//! Multiplexed PDOs at a node (CiA 301, 7.2.3).

use can::Instant;

use super::receive::number_at;
use super::{Node, NodeEvent, Via};
use crate::od::{Slot, Storage};
use crate::pdo::multiplex::MAX_SIZE;
use crate::pdo::{AddressMode, Direction, MappingRecord, Mpdo, PdoNumber};
use crate::{AbortCode, Mux, NodeId};

impl<S: Storage> Node<S> {
    /// Sends an object by the TPDO that is in source address mode: the owner's choice among those of its scanning list
    /// ([`multiplex::scanned`](crate::pdo::multiplex::scanned)). False while there is no such TPDO or the node is not operational, and
    /// if the last one has not been sent yet: try again.
    pub fn send_by_source(&mut self, slot: Slot, now: Instant) -> bool {
        let mut data = [0; MAX_SIZE];
        self.dictionary.view().copy(slot, &mut data);
        let object = self.table().row(slot).mux();
        let mpdo = Mpdo { mode: AddressMode::Source, node: self.node_id.raw(), object, data };
        let tpdos = self.pdos.tpdos.as_ref();
        let position = tpdos.iter().position(|tpdo| tpdo.address_mode() == Some(AddressMode::Source));
        position.is_some_and(|position| self.multiplex(position, &mpdo, now))
    }

    /// Sends a value to an object of another node, or of all, by a TPDO that is in destination address mode. False as with
    /// [`send_by_source`](Self::send_by_source).
    pub fn send_to_destination(
        &mut self,
        number: PdoNumber,
        node: Option<NodeId>,
        object: Mux,
        data: [u8; MAX_SIZE],
        now: Instant,
    ) -> bool {
        let node = node.map_or(0, NodeId::raw);
        self.multiplex(number.position(), &Mpdo { mode: AddressMode::Destination, node, object, data }, now)
    }

    fn multiplex(&mut self, position: usize, mpdo: &Mpdo, now: Instant) -> bool {
        self.now = now;
        let operational = self.state.allows_pdo();
        let tpdo = self.pdos.tpdos.as_mut().get_mut(position);
        let tpdo = tpdo.filter(|tpdo| operational && tpdo.address_mode() == Some(mpdo.mode));
        let taken = tpdo.is_some_and(|tpdo| tpdo.multiplex(mpdo));
        if taken {
            self.offer_tpdo(position);
        }
        taken
    }

    /// Stores the one object that the frame names. One of another node or mode, and one that no dispatching list leads to, is not
    /// for this node.
    #[cold]
    pub(super) fn receive_multiplexed(&mut self, position: usize, data: u64) {
        let mpdo = Mpdo::from_bits(data);
        let Some(mode) = self.pdos.rpdos.as_ref()[position].address_mode() else { return };
        let Some(object) = mpdo.destination(&self.dictionary.view(), self.node_id, mode) else { return };
        match self.write_multiplexed(object, &mpdo.data) {
            Ok(slot) => {
                let raw = self.dictionary.raw(slot);
                self.push(NodeEvent::Written { slot, raw, via: Via::Rpdo(number_at(position)) });
            }
            Err(_) if mode == AddressMode::Destination => {
                self.push(NodeEvent::DestinationMissing(number_at(position)));
            }
            Err(_) => {}
        }
    }

    /// As an RPDO writes it: what can be mapped, of up to four bytes, within its limits.
    fn write_multiplexed(&mut self, object: Mux, data: &[u8; MAX_SIZE]) -> Result<Slot, AbortCode> {
        let values = self.dictionary.view();
        let data_type = values.table().row(values.table().find(object)?).data_type;
        let record = MappingRecord { mux: object, bits: data_type.bits() };
        let slot = record.resolve(&values, Direction::Rpdo, self.profile.mapping)?.ok_or(AbortCode::NOT_MAPPABLE)?;
        let data = data.get(..data_type.size()).ok_or(AbortCode::NOT_MAPPABLE)?;
        self.dictionary.write_bytes(slot, data)?;
        Ok(slot)
    }
}

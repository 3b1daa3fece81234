//! A PDO as it will be once values have been written: the way back from [`PdoConfig::values`].

use std::collections::BTreeMap;
use std::time::Duration;

use canopen::pdo::{AddressMode, MappingRecord};
use canopen::{CobId, Mux};
use devices::Description;

use super::config::{PdoConfig, TimerUnits, TransmissionType};
use super::transaction::entries;
use crate::core::PdoMap;

impl PdoConfig {
    /// This PDO, which has `cob_id`, with the values that its objects in a device of this model get; objects of others are
    /// passed over.
    #[must_use]
    pub fn with_values(
        &self,
        cob_id: CobId,
        values: &BTreeMap<Mux, Vec<u8>>,
        model: &Description,
    ) -> (PdoConfig, CobId) {
        let units = TimerUnits::of(model);
        let mut config = self.clone();
        let number = |object: Mux| {
            values.get(&object).map(|bytes| bytes.iter().take(4).rev().fold(0, |raw, byte| raw << 8 | u32::from(*byte)))
        };
        let time = |sub_index, unit: Duration| number(self.parameter(sub_index)).map(|raw| unit * raw);
        if let Some(raw) = number(self.parameter(2)) {
            config.transmission = TransmissionType(raw as u8);
        }
        config.inhibit_time = time(3, units.inhibit).or(config.inhibit_time);
        config.event_time = time(5, units.event).or(config.event_time);
        if let Some(count) = number(self.mapping(0)) {
            config.multiplexed = AddressMode::from_count(count as u8);
            // An entry that is not written is what it was.
            let entry = |entry: u8| {
                let before = || self.map.0.get(usize::from(entry) - 1).copied();
                number(self.mapping(entry)).map(MappingRecord::from_raw).or_else(before)
            };
            config.map = PdoMap(entries(count).filter_map(entry).collect());
        }
        (config, number(self.parameter(1)).map_or(cob_id, CobId))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::NodeId;
    use canopen::pdo::{Direction, PdoId, PdoNumber};

    const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

    fn mapped(entries: &[u32]) -> PdoConfig {
        PdoConfig::new(TPDO1, PdoMap(entries.iter().map(|raw| MappingRecord::from_raw(*raw)).collect()))
    }

    #[test]
    fn what_was_planned_is_what_is_there_afterwards() {
        let model = devices::model("zlac8030l").expect("a model");
        let before = mapped(&[0x6041_0010]);
        let planned = mapped(&[0x6064_0020, 0x606C_0020])
            .transmission(TransmissionType(7))
            .inhibit_time(Duration::from_millis(5))
            .event_time(Duration::from_millis(250));
        let planned = PdoConfig { id: Some(0x1A4), ..planned };
        let values = planned.values(model, NodeId::new(4).expect("a node-ID")).expect("it fits");
        let (after, cob_id) = before.with_values(CobId(0x8000_0184), &values.into_iter().collect(), model);
        assert_eq!((PdoConfig { id: planned.id, ..after }, cob_id), (planned, CobId(0x1A4)));
    }

    #[test]
    fn what_is_not_written_stays() {
        let model = devices::model("zlac8030l").expect("a model");
        let before = mapped(&[0x6041_0010, 0x6064_0020]).event_time(Duration::from_millis(1));
        // The second entry and a third that is not there are not mentioned; TPDO2 is another PDO.
        let values = [(Mux::new(0x1A00, 0), vec![3]), (Mux::new(0x1A00, 1), 0x6061_0008_u32.to_le_bytes().to_vec())];
        let others = [(Mux::new(0x1A01, 0), vec![0]), (Mux::new(0x1801, 2), vec![1])];
        let (after, cob_id) = before.with_values(CobId(0x184), &values.into_iter().chain(others).collect(), model);
        let expected = mapped(&[0x6061_0008, 0x6064_0020]).event_time(Duration::from_millis(1));
        assert_eq!((after, cob_id), (expected, CobId(0x184)));
    }
}

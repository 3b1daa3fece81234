//! A PDO as the values of its objects in a device of a known model: what can be said to be wrong with it before the device is
//! asked (CiA 301, 7.5.2.35 to 7.5.2.38).

use canopen::od::{Entry, PdoMapping};
use canopen::pdo::{Direction, MappingRecord, PdoId};
use canopen::{CobId, Mux, NodeId};
use devices::Description;

use super::config::{PdoConfig, TimerUnits};
use crate::parameters::default_of;

/// Why a model has no such PDO.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PdoUnfit {
    /// It has fewer PDOs.
    #[error("a {model} has no {pdo}; it has {has}")]
    NoSuchPdo {
        /// The model.
        model: &'static str,
        /// The PDO that was named.
        pdo: PdoId,
        /// Those that it has.
        has: String,
    },
    /// What it carries cannot be changed.
    #[error("the mapping of a {model} is fixed: leave out the objects of {pdo}")]
    Fixed {
        /// The model.
        model: &'static str,
        /// The PDO that was named.
        pdo: PdoId,
    },
    /// A frame has 64 bits.
    #[error("{pdo} would have {bits} bits: {objects}. A PDO has 64")]
    TooLong {
        /// The PDO that would be too long.
        pdo: PdoId,
        /// Bits asked for.
        bits: u32,
        /// The objects with their bits.
        objects: String,
    },
    /// A mapping record of the model is shorter.
    #[error("{pdo} would have {objects} objects; on a {model} it has at most {most}")]
    TooMany {
        /// The model.
        model: &'static str,
        /// The PDO that would have too many.
        pdo: PdoId,
        /// Objects asked for.
        objects: usize,
        /// Most of the model.
        most: usize,
    },
    /// The object may not be mapped so.
    #[error("{object} {name} cannot be in {pdo}: {why}")]
    NotMappable {
        /// The PDO that it was to be in.
        pdo: PdoId,
        /// The object.
        object: Mux,
        /// Its name.
        name: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// The model has no such object.
    #[error("a {model} has no object {object}")]
    NoSuchObject {
        /// The model.
        model: &'static str,
        /// The object.
        object: Mux,
    },
    /// The value is not taken.
    #[error("{pdo}: {asked} is not taken for the {what}; it takes {takes}")]
    NotTaken {
        /// The PDO.
        pdo: PdoId,
        /// What was asked for.
        asked: String,
        /// Of what.
        what: &'static str,
        /// What is taken.
        takes: String,
    },
}

/// The entry that maps an object as a whole into PDOs of a direction; of a data type (0001h to 0007h) the dummy entry that skips
/// its bits in an RPDO, where the model takes one (CiA 301, 7.4.7.1).
///
/// # Errors
/// [`PdoUnfit::NoSuchObject`], [`PdoUnfit::NotMappable`].
pub fn record_of(model: &Description, pdo: PdoId, object: Mux) -> Result<MappingRecord, PdoUnfit> {
    let dummy = model.pdo.mapping.dummy(object).filter(|_| pdo.direction == Direction::Rpdo);
    if let Some(data_type) = dummy {
        return Ok(MappingRecord { mux: object, bits: data_type.bits() });
    }
    let row = model.row(object).ok_or(PdoUnfit::NoSuchObject { model: model.name, object })?;
    let refused = |why| PdoUnfit::NotMappable { pdo, object, name: row.name, why };
    match (pdo.direction, row.pdo) {
        (_, PdoMapping::No) => return Err(refused("the model does not let it be mapped")),
        (Direction::Rpdo, PdoMapping::Transmit) => return Err(refused("it goes into TPDOs only")),
        (Direction::Tpdo, PdoMapping::Receive) => return Err(refused("it goes into RPDOs only")),
        (Direction::Rpdo, _) if !row.access.is_writable() => return Err(refused("it can only be read")),
        (Direction::Tpdo, _) if !row.access.is_readable() => return Err(refused("it can only be written")),
        _ => {}
    }
    let form = model.pdo.mapping.tpdo_form(object).filter(|_| pdo.direction == Direction::Tpdo);
    let bits = form.map_or(row.data_type, |form| form.data_type).bits();
    if bits == 0 { Err(refused("it has no fixed length")) } else { Ok(MappingRecord { mux: object, bits }) }
}

/// Most objects in a PDO of a model: entries of its mapping record, and the model's own limit.
pub fn most_objects(model: &Description, pdo: PdoId) -> usize {
    let entries = (1..=64).take_while(|entry| model.row(Mux::new(pdo.mapping_index(), *entry)).is_some()).count();
    entries.min(model.pdo.max_objects.into())
}

impl PdoConfig {
    /// The values that the objects of a device of this model get; they are written in any order by
    /// [`parameters::in_order`](crate::parameters::in_order) alone. The PDO is valid by them.
    ///
    /// # Errors
    /// What the model does not have or take.
    pub fn values(&self, model: &Description, node: NodeId) -> Result<Vec<(Mux, Vec<u8>)>, PdoUnfit> {
        let mut values = Vec::new();
        let units = TimerUnits::of(model);
        self.of_mapping(model, &mut values)?;
        let transmission = self.parameter(2);
        let row = |object: Mux| model.row(object).filter(|row| row.access.is_writable());
        if let Some(row) = model.row(transmission) {
            let asked = i64::from(self.transmission.0);
            if row.check_value(asked).is_err() {
                let (what, takes) = ("transmission type", taken(row));
                return Err(PdoUnfit::NotTaken { pdo: self.pdo, asked: asked.to_string(), what, takes });
            }
            values.push((transmission, vec![self.transmission.0]));
        }
        let times =
            [("inhibit time", 3, self.inhibit_time, units.inhibit), ("event timer", 5, self.event_time, units.event)];
        for (what, sub_index, time, unit) in times {
            let Some(asked) = time else { continue };
            let object = self.parameter(sub_index);
            let takes = match row(object) {
                Some(_) => format!("up to {:?}, in steps of {unit:?}", unit * u32::from(u16::MAX)),
                None => "none: the model has no such object".to_owned(),
            };
            let refused = || PdoUnfit::NotTaken { pdo: self.pdo, asked: format!("{asked:?}"), what, takes };
            let counts = super::transaction::counts(asked, unit).filter(|_| row(object).is_some());
            let row = model.row(object);
            let counts = counts.filter(|counts| row.is_some_and(|row| row.check_value((*counts).into()).is_ok()));
            values.push((object, counts.ok_or_else(refused)?.to_le_bytes().to_vec()));
        }
        if let Some(cob_id) = self.cob_id_in(model, node) {
            values.push((self.parameter(1), cob_id.to_le_bytes().to_vec()));
        }
        Ok(values)
    }

    fn of_mapping(&self, model: &Description, values: &mut Vec<(Mux, Vec<u8>)>) -> Result<(), PdoUnfit> {
        let (pdo, records) = (self.pdo, &self.map.0);
        has(model, pdo)?;
        if model.pdo.fixed_mapping {
            return if records.is_empty() { Ok(()) } else { Err(PdoUnfit::Fixed { model: model.name, pdo }) };
        }
        let bits = self.map.bits();
        if bits > u64::BITS {
            let name = |object: Mux| model.row(object).map_or_else(|| object.to_string(), |row| row.name.to_owned());
            let objects = records.iter().map(|record| format!("{} ({})", name(record.mux), record.bits));
            return Err(PdoUnfit::TooLong { pdo, bits, objects: objects.collect::<Vec<_>>().join(", ") });
        }
        let most = most_objects(model, pdo);
        if records.len() > most {
            return Err(PdoUnfit::TooMany { model: model.name, pdo, objects: records.len(), most });
        }
        for (entry, record) in (1..).zip(records) {
            let whole = record_of(model, pdo, record.mux)?;
            if record.bits != whole.bits && !model.pdo.mapping.longer_entries {
                let (object, name) = (record.mux, model.row(record.mux).map_or("", |row| row.name));
                let why = "it is mapped as a whole or not at all";
                return Err(PdoUnfit::NotMappable { pdo, object, name, why });
            }
            values.push((self.mapping(entry), record.raw().to_le_bytes().to_vec()));
        }
        values.push((self.mapping(0), vec![records.len() as u8]));
        Ok(())
    }

    /// Its COB-ID: as asked for, else as the model is delivered but valid; `None` where it cannot be written.
    fn cob_id_in(&self, model: &Description, node: NodeId) -> Option<u32> {
        let row = model.row(self.parameter(1)).filter(|row| row.access.is_writable())?;
        let delivered = default_of(row, node)?;
        let delivered = u32::from_le_bytes(delivered.try_into().ok()?);
        // The flags of a model stay; the identifier may be another.
        let flags = delivered & CobId::NO_RTR;
        let id = self.id.map_or(delivered & !CobId::INVALID & !CobId::NO_RTR, u32::from);
        // Of a PDO without an identifier of its own by the standard none can be guessed.
        (id != 0).then_some(flags | id)
    }
}

/// The values that make a PDO of a model invalid.
///
/// # Errors
/// [`PdoUnfit::NoSuchPdo`]; [`PdoUnfit::NotTaken`] for a model whose COB-IDs cannot be written.
pub fn values_off(model: &Description, pdo: PdoId, node: NodeId) -> Result<Vec<(Mux, Vec<u8>)>, PdoUnfit> {
    has(model, pdo)?;
    let object = Mux::new(pdo.parameter_index(), 1);
    let row = model.row(object).filter(|row| row.access.is_writable());
    let delivered = row.and_then(|row| default_of(row, node)?.try_into().ok());
    let delivered = delivered.map(u32::from_le_bytes).ok_or_else(|| PdoUnfit::NotTaken {
        pdo,
        asked: "off".to_owned(),
        what: "COB-ID",
        takes: "no change: the model does not let it be written; leave out its objects".to_owned(),
    })?;
    Ok(vec![(object, (delivered | CobId::INVALID).to_le_bytes().to_vec())])
}

fn has(model: &Description, pdo: PdoId) -> Result<(), PdoUnfit> {
    let is_there = |pdo: PdoId| model.row(Mux::new(pdo.parameter_index(), 2)).is_some();
    if is_there(pdo) {
        return Ok(());
    }
    let numbers = (1..=canopen::pdo::PdoNumber::MAX).filter_map(canopen::pdo::PdoNumber::new);
    let all = numbers.map(|number| PdoId { direction: pdo.direction, number }).filter(|pdo| is_there(*pdo));
    let names: Vec<String> = all.map(|pdo| pdo.to_string()).collect();
    let has = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
    Err(PdoUnfit::NoSuchPdo { model: model.name, pdo, has })
}

fn taken(row: &Entry) -> String {
    if row.values.is_empty() {
        let (low, high) = row.limits_at(1);
        return format!("{low} to {high}");
    }
    row.values.iter().map(|(value, meaning)| format!("{value} ({meaning})")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    use crate::core::PdoMap;
    use crate::pdo::TransmissionType;
    use canopen::pdo::PdoNumber;

    const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

    fn model() -> &'static Description {
        devices::model("zlac8030l").expect("a model")
    }

    fn node() -> NodeId {
        NodeId::new(4).expect("a node-ID")
    }

    fn mapped(objects: &[u16]) -> PdoConfig {
        let records = objects.iter().map(|index| record_of(model(), TPDO1, Mux::new(*index, 0)).expect("mappable"));
        PdoConfig::new(TPDO1, PdoMap(records.collect()))
    }

    #[test]
    fn a_pdo_becomes_the_values_of_its_objects() {
        let config = mapped(&[0x6041, 0x6064]).inhibit_time(Duration::from_millis(5));
        let values = config.values(model(), node()).expect("it fits");
        let expected = [
            (Mux::new(0x1A00, 1), 0x6041_0010_u32.to_le_bytes().to_vec()),
            (Mux::new(0x1A00, 2), 0x6064_0020_u32.to_le_bytes().to_vec()),
            (Mux::new(0x1A00, 0), vec![2]),
            (Mux::new(0x1800, 2), vec![255]),
            // The inhibit time counts 0.5 ms (ZLAC8030L quick start guide V1.00, 6.1).
            (Mux::new(0x1800, 3), vec![10, 0]),
            (Mux::new(0x1800, 1), 0x184_u32.to_le_bytes().to_vec()),
        ];
        assert_eq!(values, expected);
    }

    #[test]
    fn a_data_type_skips_its_bits_in_an_rpdo_of_a_model_that_takes_it() {
        let rpdo = PdoId { direction: Direction::Rpdo, ..TPDO1 };
        let servo = devices::model("cia402").expect("a model");
        // UNSIGNED8 and INTEGER32 (CiA 301, table 44).
        for (code, bits) in [(0x0005, 8), (0x0004, 32)] {
            assert_eq!(record_of(servo, rpdo, Mux::new(code, 0)).map(|record| record.bits), Ok(bits), "{code:04X}h");
        }
        let map = [0x0005, 0x6040].map(|index| record_of(servo, rpdo, Mux::new(index, 0)).expect("it is taken"));
        assert!(PdoConfig::new(rpdo, PdoMap(map.into())).values(servo, node()).is_ok());
        assert!(record_of(servo, TPDO1, Mux::new(0x0005, 0)).is_err(), "a TPDO has nothing to skip");
        assert!(record_of(model(), rpdo, Mux::new(0x0005, 0)).is_err(), "this model takes none");
    }

    #[test]
    fn what_does_not_fit_is_reported_before_any_request() {
        let refused = |config: PdoConfig| config.values(model(), node()).expect_err("it does not fit").to_string();
        let long = mapped(&[0x6041, 0x6064, 0x606C]);
        assert!(refused(long).contains("statusword (16), position_actual_value (32), velocity_actual_value (32)"));
        let late = mapped(&[0x6041]).inhibit_time(Duration::from_secs(600));
        assert!(refused(late).contains("is not taken for the inhibit time"));
        let fifth = PdoId { direction: Direction::Tpdo, number: PdoNumber::new(9).expect("a number") };
        assert!(refused(PdoConfig::new(fifth, PdoMap::default())).contains("has no TPDO9; it has TPDO1, TPDO2"));
        let type_300 = mapped(&[0x6041]).transmission(TransmissionType(0));
        assert!(type_300.values(model(), node()).is_ok());
        let error = record_of(model(), TPDO1, Mux::new(0x1017, 0)).expect_err("no process data");
        assert!(error.to_string().contains("1017h:00 producer_heartbeat_time cannot be in TPDO1"), "{error}");
        let joint = devices::model("m4230e17b50").expect("a model");
        let fixed = PdoConfig::new(TPDO1, PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]));
        assert!(matches!(fixed.values(joint, node()), Err(PdoUnfit::Fixed { .. })));
    }
}

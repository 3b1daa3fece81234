//! The writes that make a device's values those that are wanted, in a legal order. Pure: no node is asked here.
//!
//! PDOs are made invalid first, all that change, then set up with their mapping emptied, then made valid (CiA 301, 7.5.2.35 to
//! 7.5.2.38); SYNC and EMCY are off while their identifiers change (7.5.2.5, 7.5.2.17); objects that decide in which unit
//! others count come before these; node-ID and bit rate come last. Every step knows what its object had before it, so
//! that the steps in reverse lead back by legal writes too.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use canopen::pdo::PdoId;
use canopen::{CobId, Mux, NodeId};
use devices::Description;

use super::values::{default_of, same};

/// What a write is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Bit 31 of a COB-ID: what it identifies is off while it changes. A device may refuse this and go on.
    SwitchOff,
    /// A mapping is emptied.
    ClearMapping,
    /// An object is mapped.
    Map,
    /// The mapping counts.
    Count,
    /// What was asked for.
    Value,
    /// A COB-ID as it was asked for, or as it was before.
    SwitchOn,
    /// Node-ID or bit rate.
    Address,
}

impl fmt::Display for Purpose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SwitchOff => "off while it is changed",
            Self::ClearMapping => "empty the mapping",
            Self::Map => "map an object",
            Self::Count => "number of mapped objects",
            Self::Value => "value",
            Self::SwitchOn => "identifier",
            Self::Address => "node-ID or bit rate",
        })
    }
}

/// One SDO write of a plan, in its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterStep {
    /// The object.
    pub object: Mux,
    /// What it gets, as an SDO carries it.
    pub value: Vec<u8>,
    /// What it has just before; `None` if that is not known.
    pub before: Option<Vec<u8>>,
    /// What for.
    pub purpose: Purpose,
}

/// COB-IDs that are off while their identifiers change, and the bit for that: SYNC (bit 30: the device generates it),
/// TIME (bits 31 and 30: it consumes or produces it) and EMCY (bit 31: it does not exist).
const IDENTIFIERS: [(u16, u32, u32); 3] =
    [(0x1005, CobId::NO_RTR, 0), (0x1012, CobId::NO_RTR | CobId::INVALID, 0), (0x1014, 0, CobId::INVALID)];

/// The writes that lead from `current` to `wanted`. What is not in `current` counts as different. With `all`, values
/// that are there already are written too.
pub fn in_order(
    model: Option<&Description>,
    current: &BTreeMap<Mux, Vec<u8>>,
    wanted: &BTreeMap<Mux, Vec<u8>>,
    all: bool,
) -> Vec<ParameterStep> {
    let differs = |(object, value): &(&Mux, &Vec<u8>)| {
        all || current.get(object).is_none_or(|current| !same(**object, value, current))
    };
    let changed: Vec<(Mux, &Vec<u8>)> = wanted.iter().filter(differs).map(|(object, value)| (*object, value)).collect();
    let pdos: BTreeSet<PdoId> = changed.iter().filter_map(|(object, _)| pdo_of(*object)).collect();
    let mut writer = Writer { now: current.clone(), steps: Vec::new(), all };
    for pdo in &pdos {
        writer.switch_off(Mux::new(pdo.parameter_index(), 1), wanted);
    }
    let address = model.map_or(&[][..], |model| model.storage.address);
    let is_plain = |object: &Mux| pdo_of(*object).is_none() && !address.contains(object);
    let decides_units = |object: &Mux| {
        model.is_some_and(|model| model.dictionary.rows().iter().any(|row| row.resolution == Some(*object)))
    };
    let plain = || changed.iter().filter(|(object, _)| is_plain(object));
    for (object, value) in plain().filter(|(object, _)| decides_units(object)) {
        writer.write(*object, value, Purpose::Value);
    }
    for (object, value) in plain().filter(|(object, _)| !decides_units(object)) {
        writer.identifier_off(*object);
        writer.write(*object, value, Purpose::Value);
    }
    for pdo in &pdos {
        writer.set_up(*pdo, &changed);
    }
    for pdo in &pdos {
        writer.switch_on(Mux::new(pdo.parameter_index(), 1), current, wanted);
    }
    for (object, value) in changed.iter().filter(|(object, _)| address.contains(object)) {
        writer.write(*object, value, Purpose::Address);
    }
    writer.steps
}

/// The writes that give a device these values whatever it has: what a configuration manager keeps of it (CiA 302-3, 1F22h).
/// Node-ID and bit rate are left out: a device that can be written to has them. What of a PDO is not given is as
/// `model` is delivered.
pub fn from_any_state(
    model: Option<&Description>,
    node: NodeId,
    wanted: &BTreeMap<Mux, Vec<u8>>,
) -> Vec<(Mux, Vec<u8>)> {
    let mut wanted = wanted.clone();
    let mut as_delivered = BTreeMap::new();
    if let Some(model) = model {
        wanted.retain(|object, _| !model.storage.address.contains(object));
        let of_pdos = model.dictionary.rows().iter().filter(|row| PdoId::of_object(row.index).is_some());
        as_delivered.extend(of_pdos.filter_map(|row| Some((row.mux(), default_of(row, node)?))));
    }
    in_order(model, &as_delivered, &wanted, true).into_iter().map(|step| (step.object, step.value)).collect()
}

/// The PDO that an object sets up.
pub(super) fn pdo_of(object: Mux) -> Option<PdoId> {
    PdoId::of_object(object.index).map(|(pdo, _)| pdo)
}

/// Steps, and the values that the device has after them.
struct Writer {
    now: BTreeMap<Mux, Vec<u8>>,
    steps: Vec<ParameterStep>,
    all: bool,
}

impl Writer {
    fn write(&mut self, object: Mux, value: &[u8], purpose: Purpose) {
        let before = self.now.insert(object, value.to_vec());
        self.steps.push(ParameterStep { object, value: value.to_vec(), before, purpose });
    }

    fn cob_id(&self, object: Mux) -> Option<CobId> {
        Some(CobId(number(self.now.get(&object)?)))
    }

    fn switch_off(&mut self, object: Mux, wanted: &BTreeMap<Mux, Vec<u8>>) {
        let known = self.cob_id(object).or_else(|| wanted.get(&object).map(|value| CobId(number(value))));
        let Some(cob_id) = known.filter(|cob_id| cob_id.is_valid() || self.all) else { return };
        self.write(object, &(cob_id.0 | CobId::INVALID).to_le_bytes(), Purpose::SwitchOff);
    }

    /// A PDO that is invalid gets its mapping and its times.
    fn set_up(&mut self, pdo: PdoId, changed: &[(Mux, &Vec<u8>)]) {
        let (mapping, parameter) = (pdo.mapping_index(), pdo.parameter_index());
        let of = |index: u16| changed.iter().filter(move |(object, _)| object.index == index);
        if of(mapping).next().is_some() {
            let count = Mux::new(mapping, 0);
            let wanted = of(mapping).find(|(object, _)| *object == count).map(|(_, value)| value.to_vec());
            let counted = wanted.or_else(|| self.now.get(&count).cloned());
            if self.all || self.now.get(&count).is_none_or(|value| number(value) != 0) {
                self.write(count, &[0], Purpose::ClearMapping);
            }
            for (object, value) in of(mapping).filter(|(object, _)| *object != count) {
                self.write(*object, value, Purpose::Map);
            }
            if let Some(counted) = counted.filter(|counted| number(counted) != 0) {
                self.write(count, &counted, Purpose::Count);
            }
        }
        for (object, value) in of(parameter).filter(|(object, _)| object.sub_index != 1) {
            self.write(*object, value, Purpose::Value);
        }
    }

    fn switch_on(&mut self, object: Mux, current: &BTreeMap<Mux, Vec<u8>>, wanted: &BTreeMap<Mux, Vec<u8>>) {
        let Some(value) = wanted.get(&object).or_else(|| current.get(&object)) else { return };
        if self.now.get(&object).is_none_or(|now| !same(object, value, now)) {
            self.write(object, &value.clone(), Purpose::SwitchOn);
        }
    }

    /// SYNC, TIME and EMCY are off before their identifiers change.
    fn identifier_off(&mut self, object: Mux) {
        let known = IDENTIFIERS.iter().find(|(index, ..)| *index == object.index && object.sub_index == 0);
        let (Some((_, clear, set)), Some(cob_id)) = (known, self.cob_id(object)) else { return };
        let off = cob_id.0 & !clear | set;
        if off != cob_id.0 {
            self.write(object, &off.to_le_bytes(), Purpose::SwitchOff);
        }
    }
}

/// Up to four bytes, little endian.
pub(super) fn number(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |raw, byte| raw << 8 | u32::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Values = BTreeMap<Mux, Vec<u8>>;

    fn values(rows: &[(u16, u8, &[u8])]) -> Values {
        rows.iter().map(|(index, sub_index, value)| (Mux::new(*index, *sub_index), value.to_vec())).collect()
    }

    fn shown(steps: &[ParameterStep]) -> Vec<String> {
        let hex = |value: &[u8]| value.iter().rev().map(|byte| format!("{byte:02X}")).collect::<String>();
        steps.iter().map(|step| format!("{} {}", step.object, hex(&step.value))).collect()
    }

    fn after(current: &Values, steps: impl Iterator<Item = (Mux, Vec<u8>)>) -> Values {
        let mut values = current.clone();
        values.extend(steps);
        values
    }

    fn drive() -> Values {
        values(&[
            (0x1014, 0, &[0x84, 0, 0, 0]),
            (0x1017, 0, &[0, 0]),
            (0x1800, 1, &[0x84, 1, 0, 0]),
            (0x1800, 2, &[255]),
            (0x1A00, 0, &[1]),
            (0x1A00, 1, &[0x10, 0, 0x41, 0x60]),
            (0x1A00, 2, &[0, 0, 0, 0]),
            (0x200D, 0, &[4, 0]),
        ])
    }

    #[test]
    fn a_pdo_is_off_and_empty_while_it_is_mapped_and_the_address_comes_last() {
        let wanted = values(&[
            (0x1017, 0, &[0xC8, 0]),
            (0x1800, 2, &[1]),
            (0x1A00, 0, &[2]),
            (0x1A00, 2, &[0x20, 0, 0x64, 0x60]),
            (0x200D, 0, &[5, 0]),
        ]);
        let steps = in_order(devices::model("zlac8030l"), &drive(), &wanted, false);
        let expected = [
            "1800h:01 80000184",
            "1017h:00 00C8",
            "1A00h:00 00",
            "1A00h:02 60640020",
            "1A00h:00 02",
            "1800h:02 01",
            "1800h:01 00000184",
            "200Dh:00 0005",
        ];
        assert_eq!(shown(&steps), expected);
    }

    #[test]
    fn the_steps_lead_to_what_is_wanted_and_in_reverse_back() {
        let wanted = values(&[
            (0x1014, 0, &[0x85, 0, 0, 0]),
            (0x1800, 1, &[0x85, 1, 0, 0]),
            (0x1A00, 0, &[0]),
            (0x1A00, 1, &[0x20, 0, 0x64, 0x60]),
        ]);
        let steps = in_order(None, &drive(), &wanted, false);
        let there = after(&drive(), steps.iter().map(|step| (step.object, step.value.clone())));
        assert!(wanted.iter().all(|(object, value)| there[object] == *value));
        let back = steps.iter().rev().map(|step| (step.object, step.before.clone().expect("known")));
        assert_eq!(after(&there, back), drive());
    }

    #[test]
    fn what_is_there_already_is_not_written_unless_all_is_asked_for() {
        assert_eq!(in_order(None, &drive(), &drive(), false), []);
        let all = shown(&in_order(None, &Values::new(), &drive(), true));
        assert_eq!(all[0], "1800h:01 80000184");
        assert_eq!(all.last().map(String::as_str), Some("1800h:01 00000184"));
        assert_eq!(all.iter().filter(|step| step.starts_with("1A00h:00")).count(), 2);
    }

    #[test]
    fn a_stream_for_any_state_switches_every_pdo_off_and_on_again() {
        let node = NodeId::new(5).expect("a node-ID");
        let wanted = values(&[(0x1800, 2, &[1]), (0x1A00, 0, &[0]), (0x200D, 0, &[9, 0])]);
        let stream = from_any_state(devices::model("zlac8030l"), node, &wanted);
        let off_and_on = [0x8000_0185_u32, 0x185].map(|raw| (Mux::new(0x1800, 1), raw.to_le_bytes().to_vec()));
        assert_eq!((&stream[0], stream.last()), (&off_and_on[0], Some(&off_and_on[1])));
        assert!(stream.iter().all(|(object, _)| object.index != 0x200D), "{stream:?}");
    }

    #[test]
    fn an_emcy_identifier_moves_while_it_is_off() {
        let steps = in_order(None, &drive(), &values(&[(0x1014, 0, &[0x85, 0, 0, 0])]), false);
        assert_eq!(shown(&steps), ["1014h:00 80000084", "1014h:00 00000085"]);
    }
}

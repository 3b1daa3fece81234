//! What a PDO carries (CiA 301, 7.5.2.36 and 7.5.2.38): records 1600h and 1A00h, resolved to cells.

use super::{Direction, TpdoForm};
use crate::od::{DataType, PdoMapping, Slot, View};
use crate::{AbortCode, Mux};

/// Most objects in one PDO: eight of one byte.
pub const MAX_OBJECTS: usize = 8;
/// Bits of a PDO.
pub const MAX_BITS: u32 = 64;

/// What entries of a mapping record a device takes beyond those of CiA 301.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MappingRules {
    /// An entry may give an object more bits than it has. A TPDO sends zeros in them, an RPDO ignores them.
    pub longer_entries: bool,
    /// Entries of 0 may be counted in. They carry nothing.
    pub empty_entries: bool,
    /// The objects that TPDOs show in another form than SDO does.
    pub tpdo_forms: &'static [TpdoForm],
}

impl MappingRules {
    /// None.
    pub const CIA_301: Self = Self { longer_entries: false, empty_entries: false, tpdo_forms: &[] };

    /// The form of an object in TPDOs, where it is another than SDO shows.
    pub fn tpdo_form(&self, object: Mux) -> Option<&'static TpdoForm> {
        self.tpdo_forms.iter().find(|form| form.object == object)
    }
}

/// One entry of a mapping record: which object, how many bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MappingRecord {
    /// The object.
    pub mux: Mux,
    /// Its length in bits.
    pub bits: u8,
}

impl MappingRecord {
    /// From the value of a sub-entry: index, sub-index, length.
    pub const fn from_raw(raw: u32) -> Self {
        Self { mux: Mux::from_key(raw >> 8), bits: raw as u8 }
    }

    /// The value of the sub-entry.
    pub const fn raw(self) -> u32 {
        self.mux.key() << 8 | self.bits as u32
    }

    /// The row that this entry maps.
    ///
    /// # Errors
    /// 0602 0000h if there is no such object, 0604 0041h if it cannot be mapped in this direction or not with this length.
    pub fn resolve(self, values: &View<'_>, direction: Direction, rules: MappingRules) -> Result<Slot, AbortCode> {
        let slot = values.table().find(self.mux).map_err(|_| AbortCode::NO_SUCH_OBJECT)?;
        let row = values.table().row(slot);
        let allowed = match (direction, row.pdo) {
            (_, PdoMapping::No) | (Direction::Rpdo, PdoMapping::Transmit) => false,
            (Direction::Tpdo, PdoMapping::Receive) => false,
            // Communication objects take effect by more than their value: by SDO only.
            (Direction::Rpdo, _) => row.access.is_writable() && !row.is_communication(),
            (Direction::Tpdo, _) => row.access.is_readable(),
        };
        let data_type = match rules.tpdo_form(self.mux) {
            Some(form) if direction == Direction::Tpdo => form.data_type,
            _ => row.data_type,
        };
        let longer = self.bits > data_type.bits() && self.bits.is_multiple_of(8) && u32::from(self.bits) <= MAX_BITS;
        let fits = data_type.bits() > 0 && (self.bits == data_type.bits() || (rules.longer_entries && longer));
        if allowed && fits { Ok(slot) } else { Err(AbortCode::NOT_MAPPABLE) }
    }
}

/// The objects of a PDO in order, as cells and shifts into its 64 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapping {
    objects: [Mapped; MAX_OBJECTS],
    count: u8,
    length: u8,
}

/// One mapped object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapped {
    /// The row.
    pub slot: Slot,
    shift: u8,
    /// The form in TPDOs, if it is another than the row's.
    form: Option<&'static TpdoForm>,
}

impl Mapping {
    /// Reads the mapping record at `index` (1600h or 1A00h + n) from the dictionary.
    ///
    /// # Errors
    /// As [`with_count`](Self::with_count).
    pub fn read(
        values: &View<'_>,
        index: u16,
        direction: Direction,
        rules: MappingRules,
    ) -> Result<Option<Self>, AbortCode> {
        match values.value(Mux::new(index, 0)) {
            Ok(count) => Self::with_count(values, index, direction, rules, count as u8),
            Err(_) => Ok(None),
        }
    }

    /// The mapping that the record's entries make if sub-index 00h is `count`; `None` for no objects.
    ///
    /// # Errors
    /// 0604 0042h for more entries than the record has or more than 64 bits, else as [`MappingRecord::resolve`].
    pub fn with_count(
        values: &View<'_>,
        index: u16,
        direction: Direction,
        rules: MappingRules,
        count: u8,
    ) -> Result<Option<Self>, AbortCode> {
        if usize::from(count) > MAX_OBJECTS {
            return Err(AbortCode::PDO_TOO_LONG);
        }
        // That the record is too short says more than what stands in its entries.
        if count > 0 {
            values.value(Mux::new(index, count)).map_err(|_| AbortCode::PDO_TOO_LONG)?;
        }
        let mut mapping: Option<Self> = None;
        for sub_index in 1..=count {
            let raw = values.value(Mux::new(index, sub_index)).map_err(|_| AbortCode::PDO_TOO_LONG)?;
            if raw == 0 && rules.empty_entries {
                continue;
            }
            let record = MappingRecord::from_raw(raw as u32);
            let slot = record.resolve(values, direction, rules)?;
            let form = rules.tpdo_form(record.mux).filter(|_| direction == Direction::Tpdo);
            mapping = Some(Self::extended(mapping, slot, record.bits, form)?);
        }
        Ok(mapping)
    }

    fn extended(
        mapping: Option<Self>,
        slot: Slot,
        bits: u8,
        form: Option<&'static TpdoForm>,
    ) -> Result<Self, AbortCode> {
        let first = Mapped { slot, shift: 0, form };
        let Some(mut mapping) = mapping else {
            return Ok(Self { objects: [first; MAX_OBJECTS], count: 1, length: bits / 8 });
        };
        let used_bits = mapping.length * 8;
        if u32::from(used_bits) + u32::from(bits) > MAX_BITS {
            return Err(AbortCode::PDO_TOO_LONG);
        }
        mapping.objects[usize::from(mapping.count)] = Mapped { slot, shift: used_bits, form };
        mapping.count += 1;
        mapping.length += bits / 8;
        Ok(mapping)
    }

    /// The mapped objects in order.
    #[inline]
    pub fn objects(&self) -> &[Mapped] {
        &self.objects[..usize::from(self.count)]
    }

    /// Length of the PDO in bytes, 1 to 8.
    pub const fn length(&self) -> u8 {
        self.length
    }

    /// The PDO's data, the first object in the lowest bits.
    #[inline]
    pub fn gather(&self, values: &View<'_>) -> u64 {
        self.objects().iter().fold(0, |data, object| data | u64::from(object.sample(values)) << object.shift)
    }
}

impl Mapped {
    /// The object's value as the PDO shows it.
    #[inline]
    fn sample(&self, values: &View<'_>) -> u32 {
        let raw = values.raw(self.slot);
        self.form.map_or(raw, |form| convert(values.table().row(self.slot).data_type, raw, form))
    }

    /// The object's value within `data` of a received PDO, in its low bytes; what stands above them means nothing.
    #[inline]
    pub const fn extract(&self, data: u64) -> u32 {
        (data >> self.shift) as u32
    }
}

#[cold]
fn convert(data_type: DataType, raw: u32, form: &TpdoForm) -> u32 {
    form.data_type.raw(form.value(data_type.value(raw)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NodeId;
    use crate::od::{Access, Dictionary, Entry, Object, Table, keys};

    /// A speed that SDO shows in 16 bits of 0.1 r/min and TPDOs in 32 bits of r/min.
    static IN_TPDO: [TpdoForm; 1] =
        [TpdoForm { object: Mux::new(0x606C, 0), data_type: DataType::Integer32, unit: "r/min", divisor: 10 }];
    const RULES: MappingRules = MappingRules { tpdo_forms: &IN_TPDO, ..MappingRules::CIA_301 };

    static ROWS: [Entry; 3] = [
        Entry::new(0x1A00, 0, DataType::Unsigned8, Access::ReadOnly, "mapping", "Mapping").default(1),
        Entry::new(0x1A00, 1, DataType::Unsigned32, Access::ReadOnly, "mapping_1", "Mapping 1").default(0x606C_0020),
        Entry::new(0x606C, 0, DataType::Integer16, Access::ReadWrite, "speed", "Speed").mappable(),
    ];
    static KEYS: [u32; 3] = keys(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &KEYS);
    const SPEED: Object<i16> = TABLE.object(0x606C, 0);

    #[test]
    fn an_object_with_another_form_in_tpdos_is_mapped_and_sent_in_it() {
        let mut values = Dictionary::<3>::new(&TABLE, NodeId::MIN);
        values.set(SPEED, -6004);
        let mapping = Mapping::read(&values.view(), 0x1A00, Direction::Tpdo, RULES).unwrap().unwrap();
        assert_eq!(mapping.length(), 4);
        assert_eq!(mapping.gather(&values.view()) as u32 as i32, -600);
    }

    #[test]
    fn in_rpdos_and_by_its_sdo_length_in_tpdos_the_forms_are_kept_apart() {
        let values = Dictionary::<3>::new(&TABLE, NodeId::MIN);
        let resolve = |raw, direction| MappingRecord::from_raw(raw).resolve(&values.view(), direction, RULES);
        assert_eq!(resolve(0x606C_0010, Direction::Tpdo), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(resolve(0x606C_0020, Direction::Rpdo), Err(AbortCode::NOT_MAPPABLE));
        assert!(resolve(0x606C_0010, Direction::Rpdo).is_ok());
    }

    #[test]
    fn a_device_may_take_longer_entries_in_whole_bytes_and_never_shorter_ones() {
        let values = Dictionary::<3>::new(&TABLE, NodeId::MIN);
        let rules = MappingRules { longer_entries: true, ..MappingRules::CIA_301 };
        let resolve = |raw, rules| MappingRecord::from_raw(raw).resolve(&values.view(), Direction::Rpdo, rules);
        for (bits, taken) in [(0, false), (8, false), (16, true), (17, false), (24, true), (64, true), (72, false)] {
            let entry = 0x606C_0000 | bits;
            assert_eq!(resolve(entry, rules).is_ok(), taken, "{bits} bits");
            assert_eq!(resolve(entry, MappingRules::CIA_301).is_ok(), bits == 16, "{bits} bits");
        }
    }
}

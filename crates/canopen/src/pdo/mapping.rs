//! What a PDO carries (CiA 301, 7.5.2.36 and 7.5.2.38): records 1600h and 1A00h, resolved to rows.

use super::{AddressMode, Direction, TpdoForm};
use crate::od::{DataType, Dictionary, MAX_NUMBER, PdoMapping, ResolvedWrite, Slot, Storage, View};
use crate::{AbortCode, Mux};

/// Most entries of one PDO: one for each of its bits.
pub const MAX_OBJECTS: usize = 64;
/// Bits of a PDO.
pub const MAX_BITS: u32 = 64;

/// What entries of a mapping record a device takes beyond those of CiA 301, and which of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MappingRules {
    /// An entry may give an object more bits than it has. A TPDO sends zeros in them, an RPDO ignores them.
    pub longer_entries: bool,
    /// Entries of 0 may be counted in. They carry nothing.
    pub empty_entries: bool,
    /// The dummy entries that RPDOs take: bit n for the data type of code n, 1 to 7 (CiA 301, 7.4.7.1; `DummyUsage` of an
    /// EDS file). They skip as many bits as the type has.
    pub dummy_entries: u8,
    /// The objects that TPDOs show in another form than SDO does.
    pub tpdo_forms: &'static [TpdoForm],
    /// Sub-index 00h may be FEh or FFh: a multiplexed PDO.
    pub multiplexed: bool,
}

impl MappingRules {
    /// All dummy entries, nothing beyond the standard.
    pub const CIA_301: Self = Self {
        longer_entries: false,
        empty_entries: false,
        dummy_entries: 0b1111_1110,
        tpdo_forms: &[],
        multiplexed: true,
    };

    /// The form of an object in TPDOs, where it is another than SDO shows.
    pub fn tpdo_form(&self, object: Mux) -> Option<&'static TpdoForm> {
        form_of(self.tpdo_forms, object)
    }

    /// The mode of the multiplexed PDO that a sub-index 00h of this value makes, if it makes one.
    pub fn address_mode(&self, count: u8) -> Option<AddressMode> {
        AddressMode::from_count(count).filter(|_| self.multiplexed)
    }

    /// The type that an entry for this place stands in for, if RPDOs take it.
    pub fn dummy(&self, mux: Mux) -> Option<DataType> {
        let taken = mux.index < 8 && self.dummy_entries >> mux.index & 1 == 1 && mux.sub_index == 0;
        if taken { DataType::from_code(mux.index) } else { None }
    }
}

fn form_of(forms: &'static [TpdoForm], object: Mux) -> Option<&'static TpdoForm> {
    forms.iter().find(|form| form.object == object)
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

    /// The row that this entry maps; `None` for a dummy entry.
    ///
    /// # Errors
    /// 0602 0000h if there is no such object, 0604 0041h if it cannot be mapped in this direction or not with this length.
    pub fn resolve(
        self,
        values: &View<'_>,
        direction: Direction,
        rules: MappingRules,
    ) -> Result<Option<Slot>, AbortCode> {
        if let Some(data_type) = rules.dummy(self.mux).filter(|_| direction == Direction::Rpdo) {
            return if self.bits == data_type.bits() { Ok(None) } else { Err(AbortCode::NOT_MAPPABLE) };
        }
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
        if allowed && fits { Ok(Some(slot)) } else { Err(AbortCode::NOT_MAPPABLE) }
    }
}

/// The objects of a PDO in order, as rows and places in its 64 bits.
#[derive(Clone, Copy, Debug)]
pub struct Mapping {
    objects: MappedObjects,
    count: u8,
    /// In bytes.
    length: u8,
}

#[derive(Clone, Copy, Debug)]
enum MappedObjects {
    /// Each is a cell that stands in the PDO as it is: shifts are all that is left to do. Of one byte at least, so they are
    /// eight at most.
    Plain([Plain; MAX_PLAIN]),
    /// Of any length in bits, and with the forms that objects of a TPDO may have.
    AtTheBit([Mapped; MAX_OBJECTS], &'static [TpdoForm]),
}

/// Most objects of one byte and more.
const MAX_PLAIN: usize = 8;

/// A mapped object whose cell stands in the PDO as it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain {
    pub(crate) write: ResolvedWrite,
    shift: u8,
}

/// A mapped object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mapped {
    pub(crate) slot: Slot,
    shift: u8,
    bits: u8,
}

impl Mapping {
    /// Reads the mapping record at `index` (1600h or 1A00h + n) from the dictionary.
    ///
    /// # Errors
    /// As [`with_count`](Self::with_count).
    pub fn read<S: Storage>(
        values: &Dictionary<S>,
        index: u16,
        direction: Direction,
        rules: MappingRules,
    ) -> Result<Option<Self>, AbortCode> {
        match values.view().value(Mux::new(index, 0)) {
            Ok(count) => Self::with_count(values, index, direction, rules, count as u8),
            Err(_) => Ok(None),
        }
    }

    /// The mapping that the record's entries make if sub-index 00h is `count`; `None` for nothing, not even dummy entries, and for a
    /// multiplexed PDO.
    ///
    /// # Errors
    /// 0604 0042h for more entries than the record has or more than 64 bits, else as [`MappingRecord::resolve`].
    pub fn with_count<S: Storage>(
        values: &Dictionary<S>,
        index: u16,
        direction: Direction,
        rules: MappingRules,
        count: u8,
    ) -> Result<Option<Self>, AbortCode> {
        let view = values.view();
        if let Some(mode) = rules.address_mode(count) {
            return mode.check(view.table(), direction).map(|()| None);
        }
        if usize::from(count) > MAX_OBJECTS {
            return Err(AbortCode::PDO_TOO_LONG);
        }
        // That the record is too short says more than what stands in its entries.
        if count > 0 {
            view.value(Mux::new(index, count)).map_err(|_| AbortCode::PDO_TOO_LONG)?;
        }
        let forms = if direction == Direction::Tpdo { rules.tpdo_forms } else { &[] };
        let mut objects = [Mapped { slot: Slot::at(0), shift: 0, bits: 0 }; MAX_OBJECTS];
        let (mut mapped, mut used, mut plain) = (0, 0_u8, true);
        for sub_index in 1..=count {
            let raw = view.value(Mux::new(index, sub_index)).map_err(|_| AbortCode::PDO_TOO_LONG)?;
            if raw == 0 && rules.empty_entries {
                continue;
            }
            let record = MappingRecord::from_raw(raw as u32);
            let slot = record.resolve(&view, direction, rules)?;
            if u32::from(used) + u32::from(record.bits) > MAX_BITS {
                return Err(AbortCode::PDO_TOO_LONG);
            }
            if let Some(slot) = slot {
                let data_type = view.table().row(slot).data_type;
                let has_form = form_of(forms, record.mux).is_some();
                plain &= data_type.fits_cell() && usize::from(record.bits) >= 8 * data_type.size() && !has_form;
                objects[mapped] = Mapped { slot, shift: used, bits: record.bits };
                mapped += 1;
            }
            used += record.bits;
        }
        if used == 0 {
            return Ok(None);
        }
        let objects = if plain {
            MappedObjects::plain(values, &objects[..mapped])
        } else {
            MappedObjects::AtTheBit(objects, forms)
        };
        Ok(Some(Self { objects, count: mapped as u8, length: used.div_ceil(8) }))
    }

    /// The mapped objects, if each is a cell that stands in the PDO as it is.
    #[inline(always)]
    pub(crate) fn plain_objects(&self) -> Option<&[Plain]> {
        match &self.objects {
            MappedObjects::Plain(objects) => Some(&objects[..usize::from(self.count)]),
            MappedObjects::AtTheBit(..) => None,
        }
    }

    /// The mapped objects, if they are not all [plain](Self::plain_objects).
    pub(crate) fn objects_at_the_bit(&self) -> &[Mapped] {
        match &self.objects {
            MappedObjects::Plain(_) => &[],
            MappedObjects::AtTheBit(objects, _) => &objects[..usize::from(self.count)],
        }
    }

    /// Length of the PDO in bytes, 1 to 8.
    #[inline]
    pub const fn length(&self) -> u8 {
        self.length
    }

    /// The PDO's data, the first object in the lowest bits.
    #[inline]
    pub fn gather<S: Storage>(&self, values: &Dictionary<S>) -> u64 {
        let Some(objects) = self.plain_objects() else { return self.gather_at_the_bit(values) };
        objects.iter().fold(0, |data, object| data | u64::from(values.raw(object.write.slot)) << object.shift)
    }

    #[inline(never)]
    fn gather_at_the_bit<S: Storage>(&self, values: &Dictionary<S>) -> u64 {
        let values = values.view();
        let MappedObjects::AtTheBit(_, forms) = &self.objects else { return 0 };
        let objects = self.objects_at_the_bit().iter();
        objects.fold(0, |data, object| data | (object.sample(&values, forms) & object.mask()) << object.shift)
    }
}

impl MappedObjects {
    fn plain<S: Storage>(values: &Dictionary<S>, mapped: &[Mapped]) -> Self {
        let mut plain = [Plain { write: ResolvedWrite::NONE, shift: 0 }; MAX_PLAIN];
        for (to, from) in plain.iter_mut().zip(mapped) {
            *to = Plain { write: values.resolve(from.slot), shift: from.shift };
        }
        Self::Plain(plain)
    }
}

impl Plain {
    /// The object's cell within `data` of a received PDO, in its low bytes; what stands above them means nothing.
    #[inline(always)]
    pub(crate) const fn extract(&self, data: u64) -> u32 {
        (data >> self.shift) as u32
    }
}

impl Mapped {
    /// The object's value as a TPDO shows it, in its low bits.
    fn sample(&self, values: &View<'_>, forms: &'static [TpdoForm]) -> u64 {
        let row = values.table().row(self.slot);
        if let Some(form) = form_of(forms, row.mux()) {
            return form.data_type.raw(form.value(values.integer(self.slot))).into();
        }
        let mut bytes = [0; MAX_NUMBER];
        values.copy(self.slot, &mut bytes);
        u64::from_le_bytes(bytes)
    }

    /// Its bits, counted from its first.
    const fn mask(&self) -> u64 {
        if self.bits == 0 { 0 } else { u64::MAX >> (u64::BITS - self.bits as u32) }
    }

    /// The object's bits within `data` of a received PDO.
    pub(crate) const fn extract_bits(&self, data: u64) -> u64 {
        data >> self.shift & self.mask()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NodeId;
    use crate::od::{Access, Entry, Fixed, Index, Object, Table};

    /// A speed that SDO shows in 16 bits of 0.1 r/min and TPDOs in 32 bits of r/min.
    static IN_TPDO: [TpdoForm; 1] =
        [TpdoForm { object: Mux::new(0x606C, 0), data_type: DataType::Integer32, unit: "r/min", divisor: 10 }];
    const RULES: MappingRules = MappingRules { tpdo_forms: &IN_TPDO, ..MappingRules::CIA_301 };

    static ROWS: [Entry; 3] = [
        Entry::new(0x1A00, 0, DataType::Unsigned8, Access::ReadOnly, "mapping", "Mapping").default(1),
        Entry::new(0x1A00, 1, DataType::Unsigned32, Access::ReadOnly, "mapping_1", "Mapping 1").default(0x606C_0020),
        Entry::new(0x606C, 0, DataType::Integer16, Access::ReadWrite, "speed", "Speed").mappable(),
    ];
    static INDEX: Index<3> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);
    const SPEED: Object<i16> = TABLE.object(0x606C, 0);

    #[test]
    fn an_object_with_another_form_in_tpdos_is_mapped_and_sent_in_it() {
        let mut values = Dictionary::<Fixed<3>>::new(&TABLE, NodeId::MIN);
        values.set(SPEED, -6004);
        let mapping = Mapping::read(&values, 0x1A00, Direction::Tpdo, RULES).unwrap().unwrap();
        assert_eq!(mapping.length(), 4);
        assert_eq!(mapping.gather(&values) as u32 as i32, -600);
    }

    #[test]
    fn in_rpdos_and_by_its_sdo_length_in_tpdos_the_forms_are_kept_apart() {
        let values = Dictionary::<Fixed<3>>::new(&TABLE, NodeId::MIN);
        let resolve = |raw, direction| MappingRecord::from_raw(raw).resolve(&values.view(), direction, RULES);
        assert_eq!(resolve(0x606C_0010, Direction::Tpdo), Err(AbortCode::NOT_MAPPABLE));
        assert_eq!(resolve(0x606C_0020, Direction::Rpdo), Err(AbortCode::NOT_MAPPABLE));
        assert!(resolve(0x606C_0010, Direction::Rpdo).is_ok());
    }

    #[test]
    fn a_device_may_take_longer_entries_in_whole_bytes_and_never_shorter_ones() {
        let values = Dictionary::<Fixed<3>>::new(&TABLE, NodeId::MIN);
        let rules = MappingRules { longer_entries: true, ..MappingRules::CIA_301 };
        let resolve = |raw, rules| MappingRecord::from_raw(raw).resolve(&values.view(), Direction::Rpdo, rules);
        for (bits, taken) in [(0, false), (8, false), (16, true), (17, false), (24, true), (64, true), (72, false)] {
            let entry = 0x606C_0000 | bits;
            assert_eq!(resolve(entry, rules).is_ok(), taken, "{bits} bits");
            assert_eq!(resolve(entry, MappingRules::CIA_301).is_ok(), bits == 16, "{bits} bits");
        }
    }
}

use super::{
    Check, Condition, Conditions, DefaultValue, Gate, Kind, LongScalar, Object, Refusal, RowFacts, Scalar, Slot,
    Storage, Table, Value, ValueRange, View,
};
use crate::{AbortCode, NodeId};

/// The values of a device's objects: one 32-bit cell a row of its [`Table`], little endian in the low bytes, and the
/// bytes of those that are longer.
///
/// Reading and writing by [`Object`] or [`Slot`] is an array access.
#[derive(Clone)]
pub struct Dictionary<S: Storage> {
    table: &'static Table,
    conditions: &'static Conditions,
    /// Of a value longer than a cell: how many bytes it has.
    cells: S::Cells,
    bytes: S::Bytes,
    /// See [`set_resolution`](Self::set_resolution).
    resolution: u32,
}

/// See [`Dictionary::resolve`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResolvedWrite {
    gate: Gate,
    pub(crate) slot: Slot,
    /// The owner is not asked about what an RPDO brings.
    check: Option<Check>,
}

impl ResolvedWrite {
    /// Of no row.
    pub(crate) const NONE: Self = Self { gate: Gate::CLOSED, slot: Slot::at(0), check: None };
}

impl<S: Storage> Dictionary<S> {
    /// Factory values for a device with this node-ID.
    ///
    /// # Panics
    /// If the table has more rows, or longer values, than the storage has room for.
    pub fn new(table: &'static Table, node_id: NodeId) -> Self {
        let (cells, bytes) = (S::cells(table.rows().len()), S::bytes(table.byte_count()));
        let mut dictionary = Self { table, conditions: Conditions::NONE, cells, bytes, resolution: 1 };
        for (slot, _) in table.iter() {
            dictionary.restore_default(slot, node_id);
        }
        dictionary
    }

    /// The same values under the conditions of a firmware.
    #[must_use]
    pub fn with_conditions(mut self, conditions: &'static Conditions) -> Self {
        self.conditions = conditions;
        self
    }

    /// Whether every object has the value that it has in `other`, which is of the same table.
    pub fn has_same_values(&self, other: &Self) -> bool {
        self.cells.as_ref() == other.cells.as_ref()
            && self.bytes.as_ref() == other.bytes.as_ref()
            && self.resolution == other.resolution
    }

    /// The rows whose values these are: types, access, limits, defaults.
    #[inline]
    pub const fn table(&self) -> &'static Table {
        self.table
    }

    /// The value of a typed object.
    #[inline]
    pub fn get<T: Scalar>(&self, object: Object<T>) -> T {
        T::from_raw(self.raw(object.slot()))
    }

    /// Stores the value of a typed object: the device's own right, no access or range is checked.
    #[inline]
    pub fn set<T: Scalar>(&mut self, object: Object<T>, value: T) {
        self.cells.as_mut()[object.slot().position()] = value.to_raw();
    }

    /// Stores a whole number in the type that the object's row has here: for an object whose type differs between the
    /// editions of a device ([`Table::amended`]). The device's own right, and the number must fit.
    pub fn set_number<T: Scalar + Into<i64>>(&mut self, object: Object<T>, value: T) {
        let data_type = self.table.row(object.slot()).data_type;
        self.cells.as_mut()[object.slot().position()] = data_type.raw(value.into());
    }

    /// The value of a typed object of 64 bits.
    pub fn get_long<T: LongScalar>(&self, object: Object<T>) -> T {
        let mut bytes = [0; 8];
        self.view().copy(object.slot(), &mut bytes);
        T::from_bytes(bytes)
    }

    /// Stores the value of a typed object of 64 bits: the device's own right.
    pub fn set_long<T: LongScalar>(&mut self, object: Object<T>, value: T) {
        self.store_bytes(object.slot(), &value.to_bytes());
    }

    /// The cell of a row; of a value longer than a cell, how many bytes it has.
    #[inline]
    pub fn raw(&self, slot: Slot) -> u32 {
        self.cells.as_ref()[slot.position()]
    }

    /// Stores a cell; bits beyond the object's width are dropped. No access or range is checked. A value longer than a cell
    /// stays as it is: see [`set_bytes`](Self::set_bytes).
    #[inline]
    pub fn set_raw(&mut self, slot: Slot, raw: u32) {
        let mask = self.table.gate(slot).mask();
        if mask != 0 {
            self.cells.as_mut()[slot.position()] = raw & mask;
        }
    }

    /// The value of a row as a whole number; see [`View::integer`].
    pub fn value(&self, slot: Slot) -> i64 {
        self.view().integer(slot)
    }

    /// Stores a value as an SDO carries it: the device's own right, no access or range is checked.
    ///
    /// # Errors
    /// [`AbortCode::TOO_LONG`] and [`AbortCode::TOO_SHORT`] if the type or the capacity is for another number of bytes,
    /// [`AbortCode::READ_ONLY`] for a string that is constant.
    pub fn set_bytes(&mut self, slot: Slot, bytes: &[u8]) -> Result<(), AbortCode> {
        self.view().check_length(slot, bytes.len())?;
        self.store_bytes(slot, bytes);
        Ok(())
    }

    /// Puts one row back to its factory value.
    pub fn restore_default(&mut self, slot: Slot, node_id: NodeId) {
        let row = self.table.row(slot);
        match row.default {
            DefaultValue::Text(text) => return self.store_bytes(slot, text.as_bytes()),
            DefaultValue::Bytes(bytes) => return self.store_bytes(slot, bytes),
            _ if row.data_type.kind() == Kind::Bytes => return self.store_bytes(slot, &[]),
            _ => {}
        }
        let bits = match (row.default, row.data_type.size()) {
            (DefaultValue::Value(value), _) if row.data_type.is_integer() || row.data_type.kind() == Kind::Time => {
                value as u64
            }
            (DefaultValue::Value(value), 4) => (value as f32).to_bits().into(),
            (DefaultValue::Value(value), _) => (value as f64).to_bits(),
            (DefaultValue::Real(value), 4) => (value as f32).to_bits().into(),
            (DefaultValue::Real(value), _) => value.to_bits(),
            (DefaultValue::NodeIdPlus(base), _) => base.wrapping_add(node_id.raw().into()).into(),
            (DefaultValue::Unsigned(value), _) => value,
            (DefaultValue::Text(_) | DefaultValue::Bytes(_), _) => 0,
        };
        self.store_bytes(slot, &bits.to_le_bytes());
    }

    /// All values, to look at.
    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View { table: self.table, cells: self.cells.as_ref(), bytes: self.bytes.as_ref() }
    }

    /// Sets the resolution in effect, of the rows that have one ([`Entry::resolution`](super::Entry::resolution)): a device may
    /// take the object's value over later than it is written. 1 until then; 0 counts as 1.
    pub fn set_resolution(&mut self, resolution: u32) {
        self.resolution = resolution.max(1);
    }

    /// The resolution in effect.
    pub const fn resolution(&self) -> u32 {
        self.resolution
    }

    /// Whether a peer (SDO or RPDO) may write `raw` to this row: access, listed values, limits, the firmware's
    /// condition. Of a row whose value fits a cell.
    ///
    /// # Errors
    /// The abort code that an SDO server answers. Nothing is stored.
    #[inline(always)]
    pub fn check_write(&self, slot: Slot, raw: u32) -> Result<(), AbortCode> {
        Refusal::unasked(self.check(self.table.gate(slot), slot, raw))
    }

    /// [`check_write`](Self::check_write), then stores. Returns the cell.
    ///
    /// # Errors
    /// The abort code that an SDO server answers. Nothing is stored.
    #[inline(always)]
    pub fn write(&mut self, slot: Slot, raw: u32) -> Result<u32, AbortCode> {
        let gate = self.table.gate(slot);
        let cell = raw & gate.mask();
        Refusal::unasked(self.check(gate, slot, cell))?;
        self.cells.as_mut()[slot.position()] = cell;
        Ok(cell)
    }

    /// What a write to a row has to pass, resolved: for a row that is written often.
    pub(crate) fn resolve(&self, slot: Slot) -> ResolvedWrite {
        let gate = *self.table.gate(slot);
        match self.conditions.of(slot) {
            Some(Condition::Check(check)) => ResolvedWrite { gate, slot, check: Some(check) },
            // Rare: asked like a row whose limits are not in its gate.
            Some(Condition::Change(_)) => ResolvedWrite { gate: gate.closed(), slot, check: None },
            Some(Condition::Ask) | None => ResolvedWrite { gate, slot, check: None },
        }
    }

    /// [`write`](Self::write) of a row that was [resolved](Self::resolve) for this dictionary.
    #[inline(always)]
    pub(crate) fn write_resolved(&mut self, write: &ResolvedWrite, raw: u32) -> Result<u32, AbortCode> {
        let cell = raw & write.gate.mask();
        if !write.gate.admits(cell) {
            Refusal::unasked(self.ask_row(write.slot, cell))?;
        } else if let Some(check) = write.check {
            check(&self.view(), cell)?;
        }
        self.cells.as_mut()[write.slot.position()] = cell;
        Ok(cell)
    }

    /// [`write`](Self::write), unless the application is to be asked before.
    #[inline(always)]
    pub(crate) fn write_or_ask(&mut self, slot: Slot, facts: &RowFacts, raw: u32) -> Result<u32, Refusal> {
        let cell = raw & facts.gate.mask();
        self.check(&facts.gate, slot, cell)?;
        self.cells.as_mut()[slot.position()] = cell;
        Ok(cell)
    }

    /// [`check_write`](Self::check_write), which says whether the application is to be asked.
    pub(crate) fn check_or_ask(&self, slot: Slot, raw: u32) -> Result<(), Refusal> {
        self.check(self.table.gate(slot), slot, raw)
    }

    #[inline(always)]
    fn check(&self, gate: &Gate, slot: Slot, raw: u32) -> Result<(), Refusal> {
        if !gate.admits(raw) {
            return self.ask_row(slot, raw);
        }
        self.check_condition(slot, raw)
    }

    /// Why a row does not take a value, if that is so.
    #[cold]
    fn ask_row(&self, slot: Slot, raw: u32) -> Result<(), Refusal> {
        let row = self.table.row(slot);
        let summary = self.table.summary(slot);
        if !summary.is_writable() {
            return Err(AbortCode::READ_ONLY.into());
        }
        if summary.is_long() {
            return Err(AbortCode::LENGTH_MISMATCH.into());
        }
        let value = row.data_type.value(raw);
        match (row.data_type.kind(), row.resolution) {
            (Kind::Real, _) => check_real(f32::from_raw(raw).into(), row.limits)?,
            (_, Some(_)) => row.check_value_at(value, self.resolution.into())?,
            (_, None) => row.check_value(value)?,
        }
        self.check_condition(slot, raw)
    }

    /// Whether a peer may write `bytes` to this row: access, length, limits, the firmware's condition, which gets the
    /// number of bytes for a value longer than a cell. Of any row.
    ///
    /// # Errors
    /// The abort code that an SDO server answers.
    pub fn check_bytes(&self, slot: Slot, bytes: &[u8]) -> Result<(), AbortCode> {
        Refusal::unasked(self.check_bytes_or_ask(slot, bytes))
    }

    fn check_bytes_or_ask(&self, slot: Slot, bytes: &[u8]) -> Result<(), Refusal> {
        let (row, summary) = (self.table.row(slot), self.table.summary(slot));
        if !summary.is_writable() {
            return Err(AbortCode::READ_ONLY.into());
        }
        self.view().check_length(slot, bytes.len())?;
        if !summary.is_long() {
            return self.check_or_ask(slot, cell_of(bytes));
        }
        match Value::parse(row.data_type, bytes).ok_or(AbortCode::LENGTH_MISMATCH)? {
            Value::Integer(value) => row.check_value(value)?,
            Value::Unsigned(value) => check_unsigned(value, row.limits)?,
            Value::Real64(value) => check_real(value, row.limits)?,
            Value::Real32(_) | Value::Time { .. } | Value::Bytes(_) => {}
        }
        if matches!(self.conditions.of(slot), Some(Condition::Change(_))) && self.view().long_bytes(slot) == bytes {
            return Ok(());
        }
        self.check_condition(slot, bytes.len() as u32)
    }

    /// [`check_bytes`](Self::check_bytes), then stores. Returns the cell.
    ///
    /// # Errors
    /// The abort code that an SDO server answers. Nothing is stored.
    pub fn write_bytes(&mut self, slot: Slot, bytes: &[u8]) -> Result<u32, AbortCode> {
        self.check_bytes(slot, bytes)?;
        self.store_bytes(slot, bytes);
        Ok(self.raw(slot))
    }

    /// Where a value of an SDO server waits until it is complete: as many bytes as the longest needs. Server 0 is the default one.
    pub(crate) fn staging_mut(&mut self, server: u8) -> &mut [u8] {
        let range = self.table.staging_place(server);
        &mut self.bytes.as_mut()[range]
    }

    /// Copies the value of a row to where values of a server wait. Returns how many bytes.
    pub(crate) fn stage(&mut self, server: u8, slot: Slot) -> usize {
        let (from, to) = (self.table.gate(slot).long_place(), self.table.staging_place(server));
        let length = self.view().long_bytes(slot).len().min(to.len());
        self.bytes.as_mut().copy_within(from.start..from.start + length, to.start);
        length
    }

    /// The row takes what waits at a server, its first `length` bytes: no access or range is checked.
    pub(crate) fn store_staged(&mut self, server: u8, slot: Slot, length: usize) {
        let (from, to) = (self.table.staging_place(server), self.table.gate(slot).long_place());
        let length = length.min(to.len()).min(from.len());
        self.bytes.as_mut().copy_within(from.start..from.start + length, to.start);
        self.cells.as_mut()[slot.position()] = length as u32;
    }

    /// Whether a peer may write what waits at a server, its first `length` bytes.
    pub(crate) fn check_staged(&self, server: u8, slot: Slot, length: usize) -> Result<(), Refusal> {
        self.check_bytes_or_ask(slot, self.view().staged(server, length))
    }

    /// Stores what fits of `bytes`, from the lowest on.
    fn store_bytes(&mut self, slot: Slot, bytes: &[u8]) {
        if !self.table.summary(slot).is_long() {
            return self.set_raw(slot, cell_of(bytes));
        }
        let place = self.table.gate(slot).long_place();
        let length = bytes.len().min(place.len());
        self.bytes.as_mut()[place][..length].copy_from_slice(&bytes[..length]);
        self.cells.as_mut()[slot.position()] = length as u32;
    }

    #[inline(always)]
    fn check_condition(&self, slot: Slot, raw: u32) -> Result<(), Refusal> {
        match self.conditions.numbers().get(slot.position()) {
            None | Some(0) => Ok(()),
            Some(number) => self.ask_condition(*number, raw),
        }
    }

    #[inline(never)]
    fn ask_condition(&self, number: u16, raw: u32) -> Result<(), Refusal> {
        match self.conditions.numbered(number) {
            None => Ok(()),
            Some((_, Condition::Check(check))) => check(&self.view(), raw).map_err(Refusal::Abort),
            Some((slot, Condition::Change(check))) => {
                // Of a longer value the cell is its length: whether it is the same was looked at with its bytes.
                let is_there = self.raw(slot) == raw && !self.table.summary(slot).is_long();
                if is_there { Ok(()) } else { check(&self.view(), raw).map_err(Refusal::Abort) }
            }
            Some((_, Condition::Ask)) => Err(Refusal::Ask),
        }
    }
}

/// The cell of a value of up to four bytes.
fn cell_of(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |raw, byte| raw << 8 | u32::from(*byte))
}

fn check_real(value: f64, limits: Option<ValueRange>) -> Result<(), AbortCode> {
    match limits {
        Some(ValueRange::Real(min, _)) if value < min => Err(AbortCode::VALUE_TOO_LOW),
        Some(ValueRange::Real(_, max)) if value > max => Err(AbortCode::VALUE_TOO_HIGH),
        Some(ValueRange::Real(..)) if value.is_nan() => Err(AbortCode::INVALID_VALUE),
        _ => Ok(()),
    }
}

/// Of an UNSIGNED64 beyond the largest `i64`.
fn check_unsigned(value: u64, limits: Option<ValueRange>) -> Result<(), AbortCode> {
    match limits {
        Some(ValueRange::Unsigned(min, _)) if value < min => Err(AbortCode::VALUE_TOO_LOW),
        Some(ValueRange::Unsigned(_, max)) if value > max => Err(AbortCode::VALUE_TOO_HIGH),
        Some(ValueRange::Integer(..)) => Err(AbortCode::VALUE_TOO_HIGH),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Access, DataType, Entry, Fixed, Index};
    use super::*;
    use crate::Mux;

    static ROWS: [Entry; 5] = [
        Entry::new(0x1000, 0, DataType::Unsigned32, Access::Const, "device_type", "").default(0x0004_0192),
        Entry::new(0x1014, 0, DataType::Unsigned32, Access::ReadWrite, "cob_id_emcy", "").node_id_plus(0x80),
        Entry::new(0x6060, 0, DataType::Integer8, Access::ReadWrite, "modes_of_operation", "")
            .values(&[(0, "none"), (3, "velocity")]),
        Entry::new(0x6071, 0, DataType::Integer16, Access::ReadWrite, "target_torque", "").range(-300, 300),
        Entry::new(0x60FF, 0, DataType::Integer32, Access::ReadWrite, "target_velocity", "")
            .range(-1000, 1000)
            .resolution(0x2001, 0),
    ];
    static INDEX: Index<5> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);
    const TORQUE: Object<i16> = TABLE.object(0x6071, 0);

    fn dictionary() -> Dictionary<Fixed<8>> {
        Dictionary::new(&TABLE, NodeId::new(4).unwrap())
    }

    #[test]
    fn defaults_include_the_node_id() {
        assert_eq!(dictionary().raw(TABLE.slot(0x1014, 0)), 0x84);
    }

    #[test]
    fn signed_values_keep_their_sign_in_a_cell() {
        let mut dictionary = dictionary();
        dictionary.set(TORQUE, -5);
        assert_eq!(dictionary.get(TORQUE), -5);
        assert_eq!(dictionary.raw(TORQUE.slot()), 0xFFFB);
        assert_eq!(dictionary.value(TORQUE.slot()), -5);
    }

    #[test]
    fn missing_object_and_missing_sub_index_are_distinguished() {
        assert_eq!(TABLE.find(Mux::new(0x1000, 5)), Err(AbortCode::NO_SUCH_SUB_INDEX));
        assert_eq!(TABLE.find(Mux::new(0x1003, 0)), Err(AbortCode::NO_SUCH_OBJECT));
        assert_eq!(TABLE.find(Mux::new(0xFFFF, 0xFF)), Err(AbortCode::NO_SUCH_OBJECT));
        assert_eq!(TABLE.find(Mux::new(0, 0)), Err(AbortCode::NO_SUCH_OBJECT));
    }

    #[test]
    fn writes_are_checked_for_access_values_and_limits() {
        let dictionary = dictionary();
        let check = |mux, raw| dictionary.check_write(TABLE.find(mux).unwrap(), raw);
        assert_eq!(check(Mux::new(0x1000, 0), 1), Err(AbortCode::READ_ONLY));
        assert_eq!(check(Mux::new(0x6060, 0), 6), Err(AbortCode::INVALID_VALUE));
        assert_eq!(check(Mux::new(0x6060, 0), 3), Ok(()));
        assert_eq!(check(Mux::new(0x6071, 0), 301), Err(AbortCode::VALUE_TOO_HIGH));
        assert_eq!(check(Mux::new(0x6071, 0), 0xFED3), Err(AbortCode::VALUE_TOO_LOW));
    }

    #[test]
    fn limits_move_with_the_resolution_in_effect() {
        let mut dictionary = dictionary();
        let slot = TABLE.slot(0x60FF, 0);
        let check = |dictionary: &Dictionary<Fixed<8>>, value: i32| dictionary.check_write(slot, value as u32);
        for (resolution, limit) in [(1, 1000), (10, 10_000), (0, 1000)] {
            dictionary.set_resolution(resolution);
            assert_eq!((check(&dictionary, limit), check(&dictionary, -limit)), (Ok(()), Ok(())));
            assert_eq!(check(&dictionary, limit + 1), Err(AbortCode::VALUE_TOO_HIGH));
            assert_eq!(check(&dictionary, -limit - 1), Err(AbortCode::VALUE_TOO_LOW));
        }
        // Never beyond the type.
        assert_eq!(TABLE.row(slot).limits_at(i64::from(i32::MAX)), DataType::Integer32.range());
    }
}

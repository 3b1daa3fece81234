use super::{Condition, Conditions, DefaultValue, Gate, Kind, Object, Scalar, Slot, Table, ValueRange};
use crate::{AbortCode, Mux, NodeId};

/// The values of a device's objects: one 32-bit cell a row of its [`Table`], little endian in the low bytes.
///
/// `N` is the capacity in rows. Reading and writing by [`Object`] or [`Slot`] is an array access.
#[derive(Clone)]
pub struct Dictionary<const N: usize> {
    table: &'static Table,
    conditions: &'static Conditions,
    cells: [u32; N],
    /// See [`set_resolution`](Self::set_resolution).
    resolution: u32,
}

/// All values, to look at only; what a [`Check`](super::Check) sees.
#[derive(Clone, Copy)]
pub struct View<'a> {
    table: &'static Table,
    cells: &'a [u32],
}

impl<const N: usize> Dictionary<N> {
    /// Factory values for a device with this node-ID.
    ///
    /// # Panics
    /// If the table has more than `N` rows.
    pub fn new(table: &'static Table, node_id: NodeId) -> Self {
        assert!(table.rows().len() <= N, "the table has more rows than the dictionary has cells");
        let mut dictionary = Self { table, conditions: Conditions::NONE, cells: [0; N], resolution: 1 };
        for (slot, _) in table.iter() {
            dictionary.cells[slot.position()] = default_raw(table, slot, node_id);
        }
        dictionary
    }

    /// The same values under the conditions of a firmware.
    #[must_use]
    pub const fn with_conditions(mut self, conditions: &'static Conditions) -> Self {
        self.conditions = conditions;
        self
    }

    /// The rows.
    pub const fn table(&self) -> &'static Table {
        self.table
    }

    /// The value of a typed object.
    #[inline]
    pub fn get<T: Scalar>(&self, object: Object<T>) -> T {
        T::from_raw(self.cells[object.slot().position()])
    }

    /// Stores the value of a typed object: the device's own right, no access or range is checked.
    #[inline]
    pub fn set<T: Scalar>(&mut self, object: Object<T>, value: T) {
        self.cells[object.slot().position()] = value.to_raw();
    }

    /// The cell of a row.
    #[inline]
    pub fn raw(&self, slot: Slot) -> u32 {
        self.cells[slot.position()]
    }

    /// Stores a cell; bits beyond the object's width are dropped. No access or range is checked.
    #[inline]
    pub fn set_raw(&mut self, slot: Slot, raw: u32) {
        self.cells[slot.position()] = raw & self.table.summary(slot).mask();
    }

    /// The value of a row as a number.
    pub fn value(&self, slot: Slot) -> i64 {
        self.table.row(slot).data_type.value(self.raw(slot))
    }

    /// Puts one row back to its factory value.
    pub fn restore_default(&mut self, slot: Slot, node_id: NodeId) {
        self.cells[slot.position()] = default_raw(self.table, slot, node_id);
    }

    /// All values, to look at.
    pub fn view(&self) -> View<'_> {
        View { table: self.table, cells: &self.cells }
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
    /// condition.
    ///
    /// # Errors
    /// The abort code that an SDO server answers. Nothing is stored.
    #[inline(always)]
    pub fn check_write(&self, slot: Slot, raw: u32) -> Result<(), AbortCode> {
        self.check(self.table.gate(slot), slot, raw)
    }

    /// [`check_write`](Self::check_write), then stores. Returns the cell.
    ///
    /// # Errors
    /// The abort code that an SDO server answers. Nothing is stored.
    #[inline(always)]
    pub fn write(&mut self, slot: Slot, raw: u32) -> Result<u32, AbortCode> {
        let gate = self.table.gate(slot);
        let cell = raw & gate.mask();
        self.check(gate, slot, cell)?;
        self.cells[slot.position()] = cell;
        Ok(cell)
    }

    #[inline(always)]
    fn check(&self, gate: &Gate, slot: Slot, raw: u32) -> Result<(), AbortCode> {
        if !gate.admits(raw) {
            return self.ask_row(slot, raw);
        }
        self.check_condition(slot, raw)
    }

    /// Why a row does not take a value, if that is so.
    #[cold]
    fn ask_row(&self, slot: Slot, raw: u32) -> Result<(), AbortCode> {
        let row = self.table.row(slot);
        if !self.table.summary(slot).is_writable() {
            return Err(AbortCode::READ_ONLY);
        }
        let value = row.data_type.value(raw);
        match (row.data_type.kind(), row.resolution) {
            (Kind::Real, _) => check_real(f32::from_raw(raw).into(), row.limits)?,
            (_, Some(_)) => row.check_value_at(value, self.resolution.into())?,
            (_, None) => row.check_value(value)?,
        }
        self.check_condition(slot, raw)
    }

    #[inline(always)]
    fn check_condition(&self, slot: Slot, raw: u32) -> Result<(), AbortCode> {
        match self.conditions.of(slot) {
            None => Ok(()),
            Some(Condition::Check(check)) => check(&self.view(), raw),
        }
    }
}

impl View<'_> {
    /// The rows.
    pub const fn table(&self) -> &'static Table {
        self.table
    }

    /// The value of a typed object.
    pub fn get<T: Scalar>(&self, object: Object<T>) -> T {
        T::from_raw(self.cells[object.slot().position()])
    }

    /// The cell of a row.
    pub fn raw(&self, slot: Slot) -> u32 {
        self.cells[slot.position()]
    }

    /// The value at a multiplexor as a number.
    ///
    /// # Errors
    /// [`AbortCode::NO_SUCH_OBJECT`] or [`AbortCode::NO_SUCH_SUB_INDEX`].
    pub fn value(&self, mux: Mux) -> Result<i64, AbortCode> {
        let slot = self.table.find(mux)?;
        Ok(self.table.row(slot).data_type.value(self.raw(slot)))
    }
}

fn default_raw(table: &Table, slot: Slot, node_id: NodeId) -> u32 {
    let row = table.row(slot);
    match row.default {
        DefaultValue::Value(value) => row.data_type.raw(value),
        DefaultValue::Real(value) => (value as f32).to_raw(),
        DefaultValue::NodeIdPlus(base) => base.wrapping_add(node_id.raw().into()) & row.data_type.mask(),
        DefaultValue::Unsigned(_) | DefaultValue::Text(_) | DefaultValue::Bytes(_) => 0,
    }
}

fn check_real(value: f64, limits: Option<ValueRange>) -> Result<(), AbortCode> {
    match limits {
        Some(ValueRange::Real(min, _)) if value < min => Err(AbortCode::VALUE_TOO_LOW),
        Some(ValueRange::Real(_, max)) if value > max => Err(AbortCode::VALUE_TOO_HIGH),
        Some(ValueRange::Real(..)) if value.is_nan() => Err(AbortCode::INVALID_VALUE),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Access, DataType, Entry, keys};
    use super::*;

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
    static KEYS: [u32; 5] = keys(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &KEYS);
    const TORQUE: Object<i16> = TABLE.object(0x6071, 0);

    fn dictionary() -> Dictionary<8> {
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
    fn missing_object_and_missing_sub_index_are_told_apart() {
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
        let check = |dictionary: &Dictionary<8>, value: i32| dictionary.check_write(slot, value as u32);
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

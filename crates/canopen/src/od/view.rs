//! The values of a dictionary, to look at.

use super::{Kind, Object, Scalar, Slot, Table, Value};
use crate::{AbortCode, Mux};

/// All values, to look at only; what a [`Check`](super::Check) sees.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub(super) table: &'static Table,
    pub(super) cells: &'a [u32],
    pub(super) bytes: &'a [u8],
}

impl<'a> View<'a> {
    /// The rows whose values these are: types, access, limits, defaults.
    #[inline]
    pub const fn table(&self) -> &'static Table {
        self.table
    }

    /// The value of a typed object.
    pub fn get<T: Scalar>(&self, object: Object<T>) -> T {
        T::from_raw(self.raw(object.slot()))
    }

    /// The cell of a row; of a value longer than a cell, how many bytes it has.
    #[inline]
    pub fn raw(&self, slot: Slot) -> u32 {
        self.cells[slot.position()]
    }

    /// The value at a multiplexor as a whole number; see [`integer`](Self::integer).
    ///
    /// # Errors
    /// [`AbortCode::NO_SUCH_OBJECT`] or [`AbortCode::NO_SUCH_SUB_INDEX`].
    pub fn value(&self, mux: Mux) -> Result<i64, AbortCode> {
        self.table.find(mux).map(|slot| self.integer(slot))
    }

    /// The value of a row as a whole number: UNSIGNED64 beyond the largest `i64` as that, reals cut to whole ones, times
    /// their milliseconds; 0 for strings.
    pub fn integer(&self, slot: Slot) -> i64 {
        let data_type = self.table.row(slot).data_type;
        if data_type.fits_cell() && data_type.is_integer() {
            return data_type.value(self.raw(slot));
        }
        match self.typed(slot) {
            Value::Integer(value) => value,
            Value::Unsigned(_) => i64::MAX,
            Value::Real32(value) => value as i64,
            Value::Real64(value) => value as i64,
            Value::Time { millis, .. } => millis.into(),
            Value::Bytes(_) => 0,
        }
    }

    /// The value of a row as its type has it.
    pub fn typed(&self, slot: Slot) -> Value<'a> {
        let data_type = self.table.row(slot).data_type;
        if data_type.kind() == Kind::Bytes {
            return Value::Bytes(self.long_bytes(slot));
        }
        let mut bytes = [0; 8];
        self.copy(slot, &mut bytes);
        Value::of_bits(data_type, u64::from_le_bytes(bytes))
    }

    /// How many bytes the value of a row has, as an SDO carries it.
    pub fn length(&self, slot: Slot) -> usize {
        let summary = self.table.summary(slot);
        if summary.is_long() { self.long_bytes(slot).len() } else { summary.size().into() }
    }

    /// Copies the value of a row, as an SDO carries it, as much as there is room for. Returns how many bytes.
    pub fn copy(&self, slot: Slot, to: &mut [u8]) -> usize {
        let summary = self.table.summary(slot);
        let cell = self.raw(slot).to_le_bytes();
        let from = if summary.is_long() { self.long_bytes(slot) } else { &cell[..summary.size().into()] };
        let length = from.len().min(to.len());
        to[..length].copy_from_slice(&from[..length]);
        length
    }

    /// The bytes of a value that is longer than a cell; none for one that fits.
    pub fn long_bytes(&self, slot: Slot) -> &'a [u8] {
        if let Some(constant) = self.table.row(slot).constant_bytes() {
            return constant;
        }
        let value = &self.bytes[self.table.gate(slot).long_place()];
        if self.table.summary(slot).is_long() { value.get(..self.raw(slot) as usize).unwrap_or(value) } else { &[] }
    }

    /// Whether a value of `length` bytes can be stored in a row.
    ///
    /// # Errors
    /// [`AbortCode::TOO_LONG`] and [`AbortCode::TOO_SHORT`], and [`AbortCode::READ_ONLY`] for a string that never changes.
    pub fn check_length(&self, slot: Slot, length: usize) -> Result<(), AbortCode> {
        let row = self.table.row(slot);
        match (row.data_type.kind(), row.stored_bytes()) {
            (Kind::Bytes, 0) => Err(AbortCode::READ_ONLY),
            (Kind::Bytes, capacity) if length > capacity as usize => Err(AbortCode::TOO_LONG),
            (Kind::Bytes, _) => Ok(()),
            _ if length > row.data_type.size() => Err(AbortCode::TOO_LONG),
            _ if length < row.data_type.size() => Err(AbortCode::TOO_SHORT),
            _ => Ok(()),
        }
    }

    /// The first `length` bytes of what an SDO server holds until it is complete; fewer if there is no room for as many.
    pub(crate) fn staged(&self, server: u8, length: usize) -> &'a [u8] {
        let staging = &self.bytes[self.table.staging_place(server)];
        &staging[..length.min(staging.len())]
    }
}

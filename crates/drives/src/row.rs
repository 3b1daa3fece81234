//! The vocabulary of the table: the manual's type letters and attributes as short `const fn`s.

use canopen::od::{Access, DataType, Entry, Slot};

pub(crate) const U8: DataType = DataType::Unsigned8;
pub(crate) const U16: DataType = DataType::Unsigned16;
pub(crate) const U32: DataType = DataType::Unsigned32;
pub(crate) const I8: DataType = DataType::Integer8;
pub(crate) const I16: DataType = DataType::Integer16;
pub(crate) const I32: DataType = DataType::Integer32;

/// The values that an object accepts, with what each means.
pub(crate) type Values = &'static [(i64, &'static str)];

/// Attribute RO.
pub(crate) const fn ro(index: u16, sub: u8, data_type: DataType, name: &'static str, title: &'static str) -> Entry {
    Entry::new(index, sub, data_type, Access::ReadOnly, name, title)
}

/// Attribute RW.
pub(crate) const fn rw(index: u16, sub: u8, data_type: DataType, name: &'static str, title: &'static str) -> Entry {
    Entry::new(index, sub, data_type, Access::ReadWrite, name, title)
}

/// Attribute RW/S: kept in the EEPROM.
pub(crate) const fn rws(index: u16, sub: u8, data_type: DataType, name: &'static str, title: &'static str) -> Entry {
    rw(index, sub, data_type, name, title).stored()
}

/// The rows of all `parts`, in order.
///
/// # Panics
/// If they are not `N` rows, at compile time in a `const`.
pub(crate) const fn join<const N: usize>(parts: &[&[Entry]]) -> [Entry; N] {
    let mut rows = [ro(0, 0, U8, "", ""); N];
    let (mut part, mut at) = (0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            rows[at] = parts[part][i];
            i += 1;
            at += 1;
        }
        part += 1;
    }
    assert!(at == N, "the parts do not have N rows");
    rows
}

/// What a write to each row of a table does: `OBJECT => Effect;` where it is named, or else the one in
/// the head. The function `effect` looks it up.
macro_rules! effects {
    ($rows:ident else $other:ident: $($object:ident => $effect:ident;)*) => {
        /// What a write to `slot` does.
        #[inline]
        pub fn effect(slot: canopen::od::Slot) -> Effect {
            EFFECTS[slot.position()]
        }

        static EFFECTS: [Effect; $rows] =
            crate::row::by_position(&[$(($object.slot(), Effect::$effect)),*], Effect::$other);
    };
}
pub(crate) use effects;

/// `named` by the position of their rows, and `other` at all other positions.
pub(crate) const fn by_position<E: Copy, const N: usize>(named: &[(Slot, E)], other: E) -> [E; N] {
    let mut all = [other; N];
    let mut i = 0;
    while i < named.len() {
        all[named[i].0.position()] = named[i].1;
        i += 1;
    }
    all
}

/// Constants for objects of a table, checked at compile time: `NAME: type = index sub-index;`.
macro_rules! objects {
    ($table:ident: $($name:ident: $type:ty = $index:literal $sub:literal;)*) => {
        $(#[doc = concat!("Object ", stringify!($index), ":", stringify!($sub), ".")]
        pub const $name: canopen::od::Object<$type> = $table.object($index, $sub);)*
    };
}
pub(crate) use objects;

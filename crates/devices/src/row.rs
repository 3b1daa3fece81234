//! The vocabulary of the table: the manual's type letters and attributes as short `const fn`s.

use canopen::od::{Access, DataType, Entry};

use crate::names::Name;

/// UNSIGNED8.
pub const U8: DataType = DataType::Unsigned8;
/// UNSIGNED16.
pub const U16: DataType = DataType::Unsigned16;
/// UNSIGNED32.
pub const U32: DataType = DataType::Unsigned32;
/// INTEGER8.
pub const I8: DataType = DataType::Integer8;
/// INTEGER16.
pub const I16: DataType = DataType::Integer16;
/// INTEGER32.
pub const I32: DataType = DataType::Integer32;

/// The values that an object accepts, with what each means.
pub type Values = &'static [(i64, &'static str)];

/// Attribute RO.
pub const fn ro(index: u16, sub: u8, data_type: DataType, name: Name) -> Entry {
    Entry::new(index, sub, data_type, Access::ReadOnly, name.name, name.title)
}

/// Attribute RW.
pub const fn rw(index: u16, sub: u8, data_type: DataType, name: Name) -> Entry {
    Entry::new(index, sub, data_type, Access::ReadWrite, name.name, name.title)
}

/// Attribute WO.
pub const fn wo(index: u16, sub: u8, data_type: DataType, name: Name) -> Entry {
    Entry::new(index, sub, data_type, Access::WriteOnly, name.name, name.title)
}

/// Attribute RW/S: kept in the EEPROM.
pub const fn rws(index: u16, sub: u8, data_type: DataType, name: Name) -> Entry {
    rw(index, sub, data_type, name).stored()
}

/// Rows of objects of the standards: CiA's names come from [`names`](crate::names), so that no table repeats them.
///
/// # Panics
/// If the table of names does not have the place, at compile time in a `const`.
pub mod cia {
    use canopen::Mux;
    use canopen::od::{Access, DataType, Entry};

    use crate::names::standard;

    /// Attribute RO.
    pub const fn ro(index: u16, sub: u8, data_type: DataType) -> Entry {
        row(index, sub, data_type, Access::ReadOnly)
    }

    /// Attribute RW.
    pub const fn rw(index: u16, sub: u8, data_type: DataType) -> Entry {
        row(index, sub, data_type, Access::ReadWrite)
    }

    /// Attribute WO.
    pub const fn wo(index: u16, sub: u8, data_type: DataType) -> Entry {
        row(index, sub, data_type, Access::WriteOnly)
    }

    /// Attribute RW/S: kept in the EEPROM.
    pub const fn rws(index: u16, sub: u8, data_type: DataType) -> Entry {
        rw(index, sub, data_type).stored()
    }

    const fn row(index: u16, sub: u8, data_type: DataType, access: Access) -> Entry {
        let Some(name) = standard(Mux::new(index, sub)) else { panic!("no name of the standards: see devices::names") };
        Entry::new(index, sub, data_type, access, name.name, name.title)
    }
}

/// Whether a row of a device that follows the profiles is a parameter, which a save of everything stores (CiA 301, 7.5.2.13):
/// it can be written, and is neither a command nor a set-point.
pub const fn is_parameter(row: &Entry) -> bool {
    let command = match row.index {
        0x1003 | 0x1010 | 0x1011 => true,
        // Of each axis of a drive (CiA 402-1: blocks of 800h).
        0x6000..=0x9FFF => matches!(
            (0x6000 | row.index & 0x7FF, row.sub_index),
            (0x6040 | 0x6042 | 0x6060 | 0x6071 | 0x607A | 0x60B0..=0x60B2 | 0x60B8 | 0x60C1 | 0x60EA | 0x60FF, _)
                | (0x60C4, 4 | 6)
                | (0x60FE, 1)
        ),
        _ => false,
    };
    matches!(row.access, Access::ReadWrite) && !command && !row.command
}

const EMPTY: Entry = ro(0, 0, U8, Name { title: "", name: "" });

/// The rows of all `parts`, in order.
///
/// # Panics
/// If they are not `N` rows, at compile time in a `const`.
pub const fn join<const N: usize>(parts: &[&[Entry]]) -> [Entry; N] {
    let mut rows = [EMPTY; N];
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

/// The rows of all `parts`, ascending by index and sub-index; a row of a later part replaces that of an earlier one. So a
/// maker's own objects and defaults go over those of a profile.
///
/// # Panics
/// If they are not `N` different rows, at compile time in a `const`.
pub const fn merge<const N: usize>(parts: &[&[Entry]]) -> [Entry; N] {
    let mut rows = [EMPTY; N];
    let (mut count, mut part) = (0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            let row = parts[part][i];
            let key = row.mux().key();
            let mut at = count;
            while at > 0 && rows[at - 1].mux().key() > key {
                at -= 1;
            }
            if at > 0 && rows[at - 1].mux().key() == key {
                rows[at - 1] = row;
            } else {
                assert!(count < N, "the parts have more than N rows");
                let mut behind = count;
                while behind > at {
                    rows[behind] = rows[behind - 1];
                    behind -= 1;
                }
                rows[at] = row;
                count += 1;
            }
            i += 1;
        }
        part += 1;
    }
    assert!(count == N, "the parts have fewer than N rows");
    rows
}

/// The rows of another edition of a device, for [`Table::amended`](canopen::od::Table::amended): `base` in its order, each row
/// replaced by that of `changes` at its place, and behind them the rest of `changes`.
///
/// # Panics
/// If they are not `N` rows, at compile time in a `const`.
pub const fn amend<const N: usize>(base: &[Entry], changes: &[Entry]) -> [Entry; N] {
    let mut rows = [EMPTY; N];
    let (mut count, mut i) = (base.len(), 0);
    while i < base.len() {
        rows[i] = base[i];
        i += 1;
    }
    i = 0;
    while i < changes.len() {
        let mut at = 0;
        while at < base.len() && base[at].mux().key() != changes[i].mux().key() {
            at += 1;
        }
        if at == base.len() {
            at = count;
            count += 1;
        }
        rows[at] = changes[i];
        i += 1;
    }
    assert!(count == N, "base and changes do not have N rows");
    rows
}

/// Rows of a table, each of the maker with its [`name!`](crate::name), and a typed constant for each that is named behind its row (`=> NAME`): each stands once.
///
/// The rows come out as the constant array in the head. The constants come out where the macro in the head is called, beside
/// the `TABLE` that they are places of: it lies above the rows.
macro_rules! rows {
    ($vis:vis const $rows:ident: [Entry; $count:literal], $objects:ident:
        $($make:ident($index:literal, $sub:literal, $type:ident $(, $title:literal $(, $words:literal)?)?)
            $(.$set:ident($($value:expr),*))* $(=> $object:ident)?;)*) => {
        $vis const $rows: [Entry; $count] = [$($make($index, $sub, $type $(, $crate::name!($title $(, $words)?))?)$(.$set($($value),*))*),*];

        macro_rules! $objects {
            () => {
                $($(#[doc = concat!("Object ", stringify!($index), ":", stringify!($sub), ".")]
                pub const $object: canopen::od::Object<$crate::row::types::$type> = TABLE.object($index, $sub);)?)*
            };
        }
        pub(super) use $objects;
    };
}
pub(crate) use rows;

/// The types of Rust that hold the values of the rows' types.
pub(crate) mod types {
    pub(crate) type U8 = u8;
    pub(crate) type U16 = u16;
    pub(crate) type U32 = u32;
    pub(crate) type I8 = i8;
    pub(crate) type I16 = i16;
    pub(crate) type I32 = i32;
}

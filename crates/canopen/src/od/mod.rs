//! The object dictionary (CiA 301, clause 7.4): rows as data, values beside them.
//!
//! A device writes one `static` array of [`Entry`] rows that reads like its manual's table, or reads its rows from a file.
//! [`Table`] finds rows by multiplexor; [`Object`] is a row known at compile time, with its Rust type; [`Dictionary`] holds
//! one 32-bit cell a row, and the bytes of strings, domains and numbers of more than 32 bits. How much room that is, and
//! where, is the [`Storage`]'s.
//!
//! Sub-index FFh, the structure of an object (CiA 301, 7.4.2), is a row like any other where a table has one; where it has
//! none it is refused with 0609 0011h.

mod condition;
mod data_type;
mod dictionary;
mod entry;
mod gate;
mod index;
mod slot;
mod storage;
mod summary;
mod table;
mod table_error;
mod value;
mod value_range;
mod view;

pub(crate) use condition::Refusal;
pub use condition::{Check, Condition, Conditions, condition_numbers};
pub use data_type::{DataType, Held, Kind, LongScalar, Scalar};
pub use dictionary::Dictionary;
pub(crate) use dictionary::ResolvedWrite;
pub use entry::{Access, DefaultValue, Entry, HeldTo, PdoMapping};
use gate::Gate;
pub use index::{FREE_PLACES, Index, Places, RowFacts};
pub use slot::{MAX_ROWS, Slot};
pub use storage::{Fixed, Storage};
pub(crate) use summary::AccessBits;
pub use table::{Object, Table};
pub use table_error::TableError;
pub use value::{MAX_NUMBER, Value};
pub use value_range::ValueRange;
pub use view::View;

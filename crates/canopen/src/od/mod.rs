//! The object dictionary (CiA 301, clause 7.4): rows as const data, values beside them.
//!
//! A device writes one `static` array of [`Entry`] rows that reads like its manual's table. [`Table`] finds
//! rows by multiplexor; [`Object`] is a row known at compile time, with its Rust type; [`Dictionary`] holds
//! one 32-bit cell a row. Objects longer than four bytes are constant texts of the table: none of the drives
//! has a writable one.

mod condition;
mod data_type;
mod dictionary;
mod entry;
mod gate;
mod summary;
mod table;
mod value_range;

pub use condition::{Check, Condition, Conditions, condition_numbers};
pub use data_type::{DataType, Kind, Scalar};
pub use dictionary::{Dictionary, View};
pub use entry::{Access, DefaultValue, Entry, HeldTo, PdoMapping};
use gate::Gate;
use summary::Summary;
pub use table::{MAX_ROWS, Object, Slot, Table, keys};
pub use value_range::ValueRange;

//! The object table of the M joint motors ("M Robot Joint Motor CanOpen Manual", 5.04 and 5.08).
//!
//! [`TABLE`] is the one description that the drive, the command line and the documents read; the four
//! models share it. The constants below it are the objects that a firmware itself reads and writes. Where the
//! RS485 side finds an object stands in [`modbus`].

mod communication;
mod control;
pub mod modbus;
mod values;

use canopen::od::{Entry, Index, Table};

use crate::row::join;

/// Number of rows.
pub const ROW_COUNT: usize = 104;

static ROWS: [Entry; ROW_COUNT] = join(&[&communication::ROWS, &control::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

communication::general_objects!();
control::manufacturer_objects!();
control::profile_objects!();

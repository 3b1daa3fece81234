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

use crate::row::{amend, join, merge};

/// Number of rows.
pub const ROW_COUNT: usize = 104;

static ROWS: [Entry; ROW_COUNT] = join(&[&communication::ROWS, &control::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

/// Number of rows with firmware 1.66.
pub const ROW_COUNT_1_66: usize = ROW_COUNT + 9;

static CHANGES_OF_1_66: [Entry; 41] = join(&[&communication::CHANGES_OF_1_66, &control::CHANGES_OF_1_66]);
static ROWS_1_66: [Entry; ROW_COUNT_1_66] = amend(&ROWS, &CHANGES_OF_1_66);
static ASCENDING_1_66: [Entry; ROW_COUNT_1_66] = merge(&[&ROWS, &CHANGES_OF_1_66]);
static INDEX_1_66: Index<ROW_COUNT_1_66> = Index::of_amended(&ROWS_1_66, ROW_COUNT);

/// All objects of the drive with firmware 1.66.
pub static TABLE_1_66: Table = Table::amended(&ROWS_1_66, &ASCENDING_1_66, &INDEX_1_66);

communication::general_objects!();
control::manufacturer_objects!();
control::profile_objects!();

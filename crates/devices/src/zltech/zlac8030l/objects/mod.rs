//! The object table of the ZLAC8030L: 194 rows as its manual prints them ("ZLAC8030L quick start guide V1.00",
//! chapter 9) and 1018h:03 of the maker's EDS.
//!
//! [`TABLE`] is the one description that the drive, the command line and the documents read.
//! The constants below it are the objects that a firmware itself reads and writes. 1000h to 1FFFh are those of both drives of
//! the maker, beside this folder.

mod manufacturer;
mod profile;
mod values;

use canopen::od::{Entry, Index, Table};

use super::assumptions::{HARDWARE_VERSION, SOFTWARE_VERSION, SOFTWARE_VERSION_2_01};
use crate::row::{amend, join, merge};
use crate::zltech::communication;

/// Number of rows.
pub const ROW_COUNT: usize = 195;

static ROWS: [Entry; ROW_COUNT] =
    join(&[&communication::rows(HARDWARE_VERSION, SOFTWARE_VERSION), &manufacturer::ROWS, &profile::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

/// Number of rows with firmware 2.01.
pub const ROW_COUNT_2_01: usize = ROW_COUNT + 1;

static CHANGES_OF_2_01: [Entry; 105] =
    join(&[&communication::rows(HARDWARE_VERSION, SOFTWARE_VERSION_2_01), &manufacturer::CHANGES_OF_2_01]);
static ROWS_2_01: [Entry; ROW_COUNT_2_01] = amend(&ROWS, &CHANGES_OF_2_01);
static ASCENDING_2_01: [Entry; ROW_COUNT_2_01] = merge(&[&ROWS, &CHANGES_OF_2_01]);
static INDEX_2_01: Index<ROW_COUNT_2_01> = Index::of_amended(&ROWS_2_01, ROW_COUNT);

/// All objects of the drive with firmware 2.01.
pub static TABLE_2_01: Table = Table::amended(&ROWS_2_01, &ASCENDING_2_01, &INDEX_2_01);

manufacturer::general_objects!();
manufacturer::limits_objects!();
manufacturer::loops_objects!();
manufacturer::device_objects!();
manufacturer::power_objects!();
manufacturer::terminals_objects!();
profile::profile_objects!();

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

use super::assumptions::{HARDWARE_VERSION, SOFTWARE_VERSION};
use crate::row::join;
use crate::zltech::communication;

/// Number of rows.
pub const ROW_COUNT: usize = 195;

static ROWS: [Entry; ROW_COUNT] =
    join(&[&communication::rows(HARDWARE_VERSION, SOFTWARE_VERSION), &manufacturer::ROWS, &profile::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects of the drive.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

manufacturer::general_objects!();
manufacturer::limits_objects!();
manufacturer::loops_objects!();
manufacturer::device_objects!();
manufacturer::power_objects!();
manufacturer::terminals_objects!();
profile::profile_objects!();

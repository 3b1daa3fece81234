//! The object table of the standard's own servo: every object of CiA 301 and CiA 402-2 that the firmware acts on, and none
//! of a maker's.

mod communication;
mod profile;
mod values;

use canopen::od::{Entry, Table, keys};

use crate::row::join;

pub use profile::INCREMENTS_PER_TURN;

/// Number of rows.
pub const ROW_COUNT: usize = communication::ROW_COUNT + profile::ROW_COUNT;

static ROWS: [Entry; ROW_COUNT] = join(&[&communication::ROWS, &profile::ROWS]);
static KEYS: [u32; ROW_COUNT] = keys(&ROWS);

/// All objects.
pub static TABLE: Table = Table::new(&ROWS, &KEYS);

//! The object table of the standard's own servo: every object of CiA 301 and CiA 402-2 that the firmware acts on, and none
//! of a maker's.

mod communication;
mod profile;
mod values;

use canopen::od::{Entry, Index, Table};

use crate::row::join;

pub use profile::INCREMENTS_PER_TURN;

/// Number of rows.
pub const ROW_COUNT: usize = communication::ROW_COUNT + profile::ROW_COUNT;

static ROWS: [Entry; ROW_COUNT] = join(&[&communication::ROWS, &profile::ROWS]);
static INDEX: Index<ROW_COUNT> = Index::of(&ROWS);

/// All objects.
pub static TABLE: Table = Table::new(&ROWS, &INDEX);

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::od::PdoMapping;

    #[test]
    fn every_name_is_there_once() {
        for (at, row) in ROWS.iter().enumerate() {
            assert!(ROWS[at + 1..].iter().all(|other| other.name != row.name), "{}", row.name);
        }
    }

    #[test]
    fn what_is_mapped_as_delivered_can_be_mapped_and_fits() {
        for index in (0x1600..0x1604).chain(0x1A00..0x1A04) {
            let mapped = ROWS.iter().filter(|row| row.index == index && row.sub_index > 0);
            let mut bits = 0;
            for entry in mapped {
                let canopen::od::DefaultValue::Value(record) = entry.default else { panic!("{}", entry.name) };
                if record == 0 {
                    continue;
                }
                let row = TABLE.row(TABLE.find(canopen::Mux::from_key((record >> 8) as u32)).unwrap());
                assert_eq!(
                    (row.pdo, i64::from(row.data_type.bits())),
                    (PdoMapping::Yes, record & 0xFF),
                    "{}",
                    entry.name
                );
                bits += record & 0xFF;
            }
            assert!((1..=64).contains(&bits), "{index:04X}h");
        }
    }
}

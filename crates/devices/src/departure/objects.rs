//! Objects of CiA 301 and CiA 402-2 that a device has in another type, or with other rights, than the standard; and records
//! whose sub-index 00h is not their highest. What the standard has is read from its own servo, [`servo::CIA402`].

use canopen::od::{DataType, DefaultValue, Entry};

use super::Departure;
use crate::description::Description;
use crate::servo;

/// The standard's objects of communication, and those of drives.
const COMMUNICATION: core::ops::Range<u16> = 0x1000..0x2000;
const PROFILE: core::ops::Range<u16> = 0x6000..0x6800;

/// Texts that are numbers on some devices have a departure of their own.
const VERSIONS: core::ops::RangeInclusive<u16> = 0x1008..=0x100A;

/// Objects that CiA 301 lets a device make constant: COB-IDs (7.5.2.5, 7.5.2.12), and PDO records (7.5.2.35 to 7.5.2.38).
const fn may_be_constant(index: u16) -> bool {
    matches!(index, 0x1005 | 0x1014 | 0x1400..=0x1BFF)
}

/// Their sub-index 00h counts what is in use (CiA 301, 7.5.2.4, 7.5.2.36 and 7.5.2.38).
const fn counts_what_is_used(index: u16) -> bool {
    matches!(index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF)
}

impl Description {
    /// Departures of single objects, those of the communication first.
    pub(super) fn of_objects(&self) -> impl Iterator<Item = Departure> {
        let standard = |area: core::ops::Range<u16>| {
            servo::CIA402.dictionary.rows().iter().filter(move |row| area.contains(&row.index))
        };
        let communication = standard(COMMUNICATION).filter_map(|row| Some((row, self.row(row.mux())?)));
        let profile = self.axes.iter().flat_map(move |axis| {
            standard(PROFILE).filter_map(move |row| Some((row, self.row(axis.object(row.mux()))?)))
        });
        let differing = communication.chain(profile).flat_map(|(standard, own)| differences(standard, own));
        differing.flatten().chain(self.of_counts())
    }

    fn of_counts(&self) -> impl Iterator<Item = Departure> {
        // The last row of a record; rows ascend by index and sub-index.
        let rows = self.dictionary.rows();
        let ends = rows.iter().enumerate().filter(|(at, row)| {
            let last = rows.get(at + 1).is_none_or(|next| next.index != row.index);
            last && row.sub_index > 0 && !counts_what_is_used(row.index)
        });
        ends.filter_map(|(_, last)| {
            let count = self.row(canopen::Mux::new(last.index, 0))?;
            let DefaultValue::Value(says) = count.default else { return None };
            let highest = last.sub_index;
            (says != i64::from(highest)).then_some(Departure::SubIndexCount { object: count.mux(), says, highest })
        })
    }
}

fn differences(standard: &Entry, own: &Entry) -> [Option<Departure>; 2] {
    let object = own.mux();
    let another_type = own.data_type != standard.data_type && !is_version_number(own);
    let constant = own.access.is_readable() && !own.access.is_writable() && may_be_constant(own.index);
    let (here, there) = (own.access, standard.access);
    let same_rights = (here.is_readable(), here.is_writable()) == (there.is_readable(), there.is_writable());
    [
        another_type.then_some(Departure::OtherType { object, here: own.data_type, standard: standard.data_type }),
        (!same_rights && !constant).then_some(Departure::OtherAccess { object, here, standard: there }),
    ]
}

fn is_version_number(row: &Entry) -> bool {
    VERSIONS.contains(&row.index) && row.data_type != DataType::VisibleString
}

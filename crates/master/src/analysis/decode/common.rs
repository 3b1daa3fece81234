//! What is known of an object of a node whose model is not known: what all models agree on that have it, else the name
//! and type that CiA 301 (7.5) and CiA 402-2 give it.

use canopen::Mux;
use canopen::od::{Access, DataType, Entry};
use devices::servo::CIA402;
use devices::{all, names};

use DataType::Unsigned32 as U32;
use DataType::{Integer16 as I16, Integer32 as I32};

/// The row of an object on which all models agree that have it, for a node whose model is not known. Of an object of the
/// profile area (6000h to 9FFFh) that one model alone has, the unit is that model's: a scale that others set by 6091h and the
/// like.
pub fn common_row(mux: Mux) -> Option<&'static Entry> {
    let row = all().common_row(mux)?;
    let is_profile = matches!(mux.index, 0x6000..=0x9FFF);
    let is_alone = all().rows(mux).nth(1).is_none();
    (row.unit.is_empty() || !is_profile || !is_alone).then_some(row)
}

/// The name of an object that all models that have it give it, whatever its type and unit, or that the standard gives it.
pub fn common_name(mux: Mux) -> Option<&'static str> {
    let mut names = all().rows(mux).map(|row| row.name);
    match names.next() {
        Some(first) => names.all(|name| name == first).then_some(first),
        None => standard_name(mux),
    }
}

/// The type of an object that came with this many bytes, where those models that have it with this length agree on it, or
/// the standard's. An object may have another form in TPDOs.
pub fn common_type(mux: Mux, length: usize) -> Option<DataType> {
    let forms = all().iter().flat_map(|description| {
        let in_tpdo = description.pdo.mapping.tpdo_form(mux).map(|form| form.data_type);
        [description.row(mux).map(|row| row.data_type), in_tpdo]
    });
    let mut fitting = forms.flatten().filter(|data_type| data_type.size() == length && length > 0);
    match fitting.next() {
        Some(first) => fitting.all(|other| other == first).then_some(first),
        None => standard_type(mux).filter(|data_type| data_type.size() == length),
    }
}

/// What CiA 301 and CiA 402-2 say of an object of a node whose model is not known, for a write: its type, and the meanings of its
/// values. It has no unit and no limits, which are the node's own.
pub fn standard_row(mux: Mux) -> Option<Entry> {
    if let Some(row) = CIA402.row(mux) {
        let bare = Entry::new(mux.index, mux.sub_index, row.data_type, Access::ReadWrite, row.name, row.title);
        return Some(bare.values(row.values));
    }
    let name = names::standard(mux)?;
    Some(Entry::new(mux.index, mux.sub_index, standard_type(mux)?, Access::ReadWrite, name.name, name.title))
}

/// The name of the place, or of an array or record that none of the models has that of the object.
fn standard_name(mux: Mux) -> Option<&'static str> {
    let is_whole = || RECORDS.contains(&mux.index);
    names::standard(mux).or_else(|| names::standard_object(mux.index).filter(|_| is_whole())).map(|name| name.name)
}

fn standard_type(mux: Mux) -> Option<DataType> {
    let place = TYPES.binary_search_by_key(&mux.index, |(index, _)| *index).ok()?;
    (mux.sub_index == 0).then_some(TYPES[place].1)
}

/// Variables of the standards that none of the models has, ascending, with their types.
#[rustfmt::skip]
const TYPES: [(u16, DataType); 7] = [
    (0x1002, U32), (0x1007, U32), (0x1012, U32), (0x1013, U32), (0x1F80, U32), (0x6069, I32), (0x606A, I16),
];

/// Arrays and records of the standards that none of the models has: what stands in them differs by sub-index.
const RECORDS: [u16; 5] = [0x1020, 0x1021, 0x1022, 0x1028, 0x6090];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_objects_ascend_and_no_model_has_them() {
        assert!(TYPES.is_sorted_by(|(a, _), (b, _)| a < b));
        for index in TYPES.map(|(index, _)| index).into_iter().chain(RECORDS) {
            let has = |description: &devices::Description| description.row(Mux::new(index, 0)).is_some();
            assert!(!all().iter().any(has), "{index:04X}h: a model's own row speaks for it");
            assert!(common_name(Mux::new(index, 0)).is_some(), "{index:04X}h");
        }
        assert_eq!(common_name(Mux::new(0x6090, 1)), Some("velocity_encoder_resolution"));
        assert_eq!(
            (common_name(Mux::new(0x60FA, 0)), common_name(Mux::new(0x60FA, 1))),
            (Some("control_effort"), None)
        );
    }

    #[test]
    fn a_name_needs_no_agreement_on_the_unit_and_a_type_none_between_lengths() {
        let speed = Mux::new(0x606C, 0);
        assert!(common_row(speed).is_none());
        assert_eq!(common_name(speed), Some("velocity_actual_value"));
        assert_eq!((common_type(speed, 2), common_type(speed, 4)), (Some(I16), Some(I32)));
        assert_eq!((common_type(speed, 1), common_type(speed, 0)), (None, None));
        // 200Ah is the motor's largest speed on one and the way of stopping at a limit on the other.
        assert_eq!(common_name(Mux::new(0x200A, 0)), None);
        assert_eq!(
            (common_name(Mux::new(0x60F4, 0)), common_type(Mux::new(0x60F4, 0), 4)),
            (Some("following_error_actual_value"), Some(I32))
        );
        assert_eq!(common_name(Mux::new(0x60C6, 0)), Some("max_deceleration"));
        assert_eq!(common_name(Mux::new(0x5FFF, 0)), None);
    }

    #[test]
    fn the_standard_has_the_type_of_what_it_names() {
        let data_type = |index, sub_index| standard_row(Mux::new(index, sub_index)).map(|row| row.data_type);
        // CiA 402-2: 6060h is INTEGER8, 6040h UNSIGNED16, 607Ah INTEGER32, 6081h UNSIGNED32; CiA 301: 1017h UNSIGNED16.
        assert_eq!(data_type(0x6060, 0), Some(DataType::Integer8));
        assert_eq!(data_type(0x6040, 0), Some(DataType::Unsigned16));
        assert_eq!([0x607A, 0x60FA].map(|index| data_type(index, 0)), [Some(I32); 2]);
        assert_eq!((data_type(0x6081, 0), data_type(0x1017, 0)), (Some(U32), Some(DataType::Unsigned16)));
        assert_eq!([(0x2000, 0), (0x6060, 1), (0x6090, 1)].map(|(index, sub)| data_type(index, sub)), [None; 3]);
        let mode = standard_row(Mux::new(0x6060, 0)).unwrap();
        assert_eq!(mode.meaning(6), Some("homing"));
        assert!(standard_row(Mux::new(0x60FF, 0)).unwrap().unit.is_empty(), "the unit is the node's own");
    }
}

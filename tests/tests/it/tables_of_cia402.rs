//! The table of the standard's own servo and the data read from CiA 402-2, laid side by side.

use canopen::Mux;
use canopen::od::PdoMapping;
use devices::servo::CIA402;
use ferrodrive_tests::csv::CsvTable;

const OBJECTS: &str = include_str!("../../data/cia402/objects.csv");

/// Type, access and mapping of an object as one line, in the words of the data.
fn heard(mux: Mux) -> Option<String> {
    let row = CIA402.row(mux)?;
    let kind = format!("{:?}", row.data_type).replace("Unsigned", "U").replace("Integer", "I");
    let mapped = if row.pdo == PdoMapping::No { "no" } else { "yes" };
    Some(format!("{kind},{},{mapped}", row.access.name()))
}

#[test]
fn every_object_of_the_profile_is_as_the_standard_has_it() {
    let mut objects = Vec::new();
    for line in CsvTable::parse(OBJECTS).unwrap().rows() {
        let (index, sub) = (line.get("index"), line.get("sub"));
        let mux = Mux::new(u16::from_str_radix(index, 16).unwrap(), u8::from_str_radix(sub, 16).unwrap());
        // What the note says is otherwise here, and why.
        let access = line.get("note").get(..2).unwrap_or(line.get("access"));
        let expected = format!("{},{access},{}", line.get("type"), line.get("pdo_mappable"));
        assert_eq!(heard(mux), Some(expected), "{line:?}");
        objects.push(mux);
    }
    let rows = CIA402.dictionary.rows().iter().filter(|row| row.index >= 0x6000).map(|row| row.mux());
    assert!(rows.eq(objects), "the same objects");
}

#[test]
fn it_departs_from_the_standard_in_nothing() {
    let departures: Vec<_> = CIA402.departures(devices::all()).map(|departure| departure.to_string()).collect();
    assert!(departures.is_empty(), "{departures:?}");
}

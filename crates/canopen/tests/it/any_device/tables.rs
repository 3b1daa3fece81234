//! Tables of rows that are read at run time.

use canopen::od::{
    Access, DataType, Dictionary, Entry, FREE_PLACES, Index, MAX_ROWS, Object, RowFacts, Table, TableError,
};
use canopen::{AbortCode, Mux, NodeId};

use crate::any_device::device::{Boxed, Numbers, node, rw, table, upload};

fn try_table(rows: Vec<Entry>) -> Result<Table, TableError> {
    let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
    Table::at_run_time(rows.leak(), facts, places)
}

#[test]
fn every_one_of_thousands_of_rows_is_found_and_no_other_place_is() {
    let mut numbers = Numbers(3);
    for count in [0, 1, 2, 3, 100, 5000, 20_000] {
        let mut keys: Vec<u32> = (0..count).map(|_| numbers.next() as u32 & 0xFF_FFFF).collect();
        keys.sort_unstable();
        keys.dedup();
        let rows: Vec<Entry> = keys
            .iter()
            .map(|key| Mux::from_key(*key))
            .map(|mux| rw(mux.index, mux.sub_index, DataType::Unsigned8))
            .collect();
        let table = table(rows);
        for (position, key) in keys.iter().enumerate() {
            assert_eq!(table.find(Mux::from_key(*key)).map(|slot| slot.position()), Ok(position));
        }
        for _ in 0..10_000 {
            let mux = Mux::from_key(numbers.next() as u32 & 0xFF_FFFF);
            if keys.binary_search(&mux.key()).is_err() {
                let has_index = keys.iter().any(|key| Mux::from_key(*key).index == mux.index && count <= 100)
                    || keys.binary_search_by_key(&mux.index, |key| Mux::from_key(*key).index).is_ok();
                let expected = if has_index { AbortCode::NO_SUCH_SUB_INDEX } else { AbortCode::NO_SUCH_OBJECT };
                assert_eq!(table.find(mux), Err(expected), "{mux}");
            }
        }
    }
}

#[test]
fn rows_that_make_no_table_are_refused_with_the_place() {
    let rows = |muxes: &[(u16, u8)]| muxes.iter().map(|(index, sub)| rw(*index, *sub, DataType::Unsigned8)).collect();
    let twice = try_table(rows(&[(0x1000, 0), (0x2000, 1), (0x2000, 1)]));
    assert_eq!(twice.err(), Some(TableError::NotAscending { position: 2 }));
    let back = try_table(rows(&[(0x2000, 0), (0x1000, 0)]));
    assert_eq!(back.err(), Some(TableError::NotAscending { position: 1 }));
    let many: Vec<(u16, u8)> = (0..=MAX_ROWS as u32).map(|n| ((n >> 4) as u16, n as u8 & 0xF)).collect();
    assert_eq!(try_table(rows(&many)).err(), Some(TableError::TooManyRows));
    let long = vec![
        rw(0x2000, 0, DataType::Domain).capacity(u32::MAX - 10),
        rw(0x2001, 0, DataType::OctetString).capacity(20),
    ];
    assert_eq!(try_table(long).err(), Some(TableError::TooManyBytes));
    let facts = vec![RowFacts::NONE; 1].leak();
    let short = Table::at_run_time(rows(&[(1, 0), (2, 0)]).leak(), facts, vec![FREE_PLACES; 2].leak());
    assert_eq!(short.err(), Some(TableError::OtherLength));
}

#[test]
fn sub_indices_go_to_feh_and_the_structure_at_ffh_is_there_if_a_row_says_so() {
    let mut rows: Vec<Entry> = (0..=0xFE).map(|sub| rw(0x2000, sub, DataType::Unsigned8).default(sub.into())).collect();
    let structure = Entry::new(0x2001, 0xFF, DataType::Unsigned32, Access::Const, "structure", "").default(0x0005_0008);
    rows.push(structure);
    let mut node = node(rows);
    for sub in 0..=0xFE {
        assert_eq!(upload(&mut node, Mux::new(0x2000, sub)).unwrap(), [sub]);
    }
    assert_eq!(node.table().find(Mux::new(0x2000, 0xFF)), Err(AbortCode::NO_SUCH_SUB_INDEX));
    assert_eq!(upload(&mut node, Mux::new(0x2001, 0xFF)).unwrap(), 0x0005_0008_u32.to_le_bytes());
}

#[test]
fn a_dictionary_needs_the_bytes_of_its_long_values_and_once_more_the_longest() {
    let table = table(vec![
        rw(0x2000, 0, DataType::Unsigned32),
        rw(0x2001, 0, DataType::Integer64),
        rw(0x2002, 0, DataType::VisibleString).capacity(30),
        rw(0x2003, 0, DataType::VisibleString).text("constant"),
        rw(0x2004, 0, DataType::TimeDifference),
    ]);
    assert_eq!(table.byte_count(), 8 + 30 + 6 + 30);
    let mut values = Dictionary::<Boxed>::new(table, NodeId::MIN);
    let slot = table.find(Mux::new(0x2001, 0)).unwrap();
    assert_eq!(values.set_bytes(slot, &[1; 7]), Err(AbortCode::TOO_SHORT));
    assert_eq!(values.set_bytes(slot, &(-1_i64).to_le_bytes()), Ok(()));
    values.set_raw(slot, 3);
    assert_eq!(values.value(slot), -1, "it does not fit into a cell");
    assert_eq!(values.write(slot, 3), Err(AbortCode::LENGTH_MISMATCH));
}

static ROWS: [Entry; 2] = [
    Entry::new(0x2000, 0, DataType::Integer16, Access::ReadOnly, "speed", "Speed"),
    Entry::new(0x3000, 0, DataType::Unsigned8, Access::ReadWrite, "mode", "Mode"),
];
static INDEX: Index<2> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
const SPEED: Object<i16> = TABLE.object(0x2000, 0);

/// 2000h has another type, and 2800h is there too, with a sub-index.
const WIDE: Entry = Entry::new(0x2000, 0, DataType::Integer32, Access::ReadOnly, "speed", "Speed");
const ADDED: Entry = Entry::new(0x2800, 1, DataType::Unsigned16, Access::ReadWrite, "limit", "Limit");
static AMENDED_ROWS: [Entry; 3] = [WIDE, ROWS[1], ADDED];
static ASCENDING: [Entry; 3] = [WIDE, ADDED, ROWS[1]];
static AMENDED_INDEX: Index<3> = Index::of_amended(&AMENDED_ROWS, 2);
static AMENDED: Table = Table::amended(&AMENDED_ROWS, &ASCENDING, &AMENDED_INDEX);

#[test]
fn an_amended_table_keeps_its_slots_and_lists_its_rows_in_order() {
    let found = |table: &Table, index, sub_index| table.find(Mux::new(index, sub_index));
    assert_eq!(found(&AMENDED, 0x3000, 0), found(&TABLE, 0x3000, 0));
    assert_eq!(found(&AMENDED, 0x2000, 0), Ok(SPEED.slot()));
    let added = found(&AMENDED, 0x2800, 1).expect("a row");
    assert_eq!(AMENDED.row(added).name, "limit");
    assert_eq!(AMENDED.rows().iter().map(|row| row.index).collect::<Vec<_>>(), [0x2000, 0x2800, 0x3000]);
    assert!(AMENDED.iter().all(|(slot, row)| AMENDED.row(slot).mux() == row.mux()));
    assert_eq!(found(&AMENDED, 0x2800, 0), Err(AbortCode::NO_SUCH_SUB_INDEX));
    assert_eq!(found(&TABLE, 0x2800, 0), Err(AbortCode::NO_SUCH_OBJECT));
}

#[test]
fn a_number_is_stored_in_the_width_that_its_row_has() {
    for (table, bytes) in [(&TABLE, 2), (&AMENDED, 4)] {
        let mut values = Dictionary::<Boxed>::new(table, NodeId::MIN);
        values.set_number(SPEED, -600);
        assert_eq!(values.value(SPEED.slot()), -600, "{bytes} bytes");
        assert_eq!(table.row(SPEED.slot()).data_type.size(), bytes);
    }
}

//! Writing PDO, SYNC and EMCY parameters: what is refused, with which code, and what the manuals allow.

use crate::node::bench::Bench;
use crate::node::device::{LOOSE, STANDARD};

#[track_caller]
fn talk(script: &str) {
    Bench::new(&STANDARD).talk(script);
}

#[test]
fn reserved_transmission_types_abort_with_0609_0030_and_rtr_types_are_for_tpdos() {
    for raw in 0..=255_u8 {
        for (record, reserved) in [("0018", 241..=251), ("0014", 241..=253)] {
            let reply = match reserved.contains(&raw) {
                true => format!("80{record}0230000906"),
                false => format!("60{record}0200000000"),
            };
            talk(&format!("> 604#2F{record}02{raw:02X}000000\n < 584#{reply}"));
        }
    }
}

#[test]
fn rtr_types_abort_with_0609_0030_where_no_remote_frame_is_answered() {
    for raw in [252, 253] {
        // Bit 30 of its COB-ID: no RTR allowed.
        talk(&format!(
            "> 604#2300180184010040
             < 584#6000180100000000
             > 604#2F001802{raw:02X}000000
             < 584#8000180230000906"
        ));
        let mut bench = Bench::new(&LOOSE);
        bench.talk(&format!("> 604#2F001802{raw:02X}000000\n < 584#8000180230000906"));
    }
}

#[test]
fn restricted_identifiers_abort_with_0609_0030() {
    for id in [0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF]
    {
        let [low, high] = u16::to_le_bytes(id);
        for (index, sub_index) in [("0014", "01"), ("0018", "01"), ("0510", "00"), ("1410", "00")] {
            // On a device that lets identifiers move, so that only the identifier can be what is refused.
            let mut bench = Bench::new(&LOOSE);
            let mux = format!("{index}{sub_index}");
            bench.talk(&format!("> 604#23{mux}{low:02X}{high:02X}0000\n < 584#80{mux}30000906"));
        }
    }
}

#[test]
fn extended_identifiers_abort_with_0609_0030() {
    talk("> 604#2300140104020020\n < 584#8000140130000906\n > 604#2300180184010020\n < 584#8000180130000906");
}

#[test]
fn a_device_without_1006h_does_not_become_a_producer_of_sync() {
    talk("> 604#2305100080000040\n < 584#8005100030000906");
}

#[test]
fn the_identifier_of_a_valid_pdo_stays_by_the_standard() {
    talk(
        "> 604#2300180185010000
         < 584#8000180130000906
         > 604#2300180184010080
         < 584#6000180100000000
         > 604#2300180185010080
         < 584#6000180100000000
         > 604#2300180185010000
         < 584#6000180100000000
         > 604#2314100085000000
         < 584#8014100030000906",
    );
}

#[test]
fn the_identifier_of_a_valid_pdo_moves_where_the_device_allows_it() {
    Bench::new(&LOOSE).talk(
        "> 604#2300180185010000
         < 584#6000180100000000
         > 000#0104
         < 185#0000",
    );
}

#[test]
fn the_inhibit_time_of_a_valid_pdo_stays_by_the_standard() {
    talk("> 604#2B00180364000000\n < 584#8000180300000106");
    Bench::new(&LOOSE).talk("> 604#2B00180364000000\n < 584#6000180300000000");
}

#[test]
fn a_valid_pdo_is_not_remapped_by_the_standard() {
    talk(
        "> 604#2F001A0000000000
         < 584#80001A0000000106
         > 604#2300180184010080
         < 584#6000180100000000
         > 604#2F001A0000000000
         < 584#60001A0000000000
         > 604#23001A0120006460
         < 584#60001A0100000000
         > 604#2F001A0001000000
         < 584#60001A0000000000
         > 604#2300180184010000
         < 584#6000180100000000
         > 000#0104
         < 184#00000000",
    );
}

#[test]
fn the_manuals_remapping_without_bit_31_works_where_the_device_allows_it() {
    // ZLAC8030L quick start guide V1.00, 6.1: clear, map 606Ch, count, event trigger, inhibit 500 ms.
    let mut bench = Bench::new(&LOOSE);
    bench.talk(
        "> 604#2F001A0000000000
         < 584#60001A0000000000
         > 604#23001A0120006C60
         < 584#60001A0100000000
         > 604#2F001A0001000000
         < 584#60001A0000000000
         > 604#2F001802FE000000
         < 584#6000180200000000
         > 604#2B001803E8030000
         < 584#6000180300000000
         > 000#0104
         < 184#00000000",
    );
    bench.set(0x606C, 0x0403_0201);
    bench.talk("500ms < 184#01020304");
}

#[test]
fn the_standards_remapping_with_bit_31_works_there_as_well() {
    let mut bench = Bench::new(&LOOSE);
    bench.talk(
        "> 604#2300180184010080
         < 584#6000180100000000
         > 604#2F001A0000000000
         < 584#60001A0000000000
         > 604#23001A0120006460
         < 584#60001A0100000000
         > 604#2F001A0001000000
         < 584#60001A0000000000
         > 604#2300180184010000
         < 584#6000180100000000
         > 000#0104
         < 184#00000000",
    );
}

#[test]
fn entries_stay_while_the_mapping_counts_them() {
    Bench::new(&LOOSE).talk("> 604#23001A0120006C60\n < 584#80001A0100000106");
}

/// Answers of an emptied TPDO 4 and RPDO 4 to a mapping entry.
#[track_caller]
fn entry(record: &str, value: u32, answer: &str) {
    let value: String = value.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
    Bench::new(&LOOSE).talk(&format!("> 604#23{record}01{value}\n < 584#{answer}"));
}

#[test]
fn entries_for_missing_objects_abort_with_0602_0000() {
    entry("031A", 0x5FFF_0010, "80031A0100000206");
    entry("031A", 0x6041_0510, "80031A0100000206");
    // A dummy entry of a type that there is none of, and one in a TPDO.
    entry("0316", 0x0008_0020, "8003160100000206");
    entry("031A", 0x0005_0008, "80031A0100000206");
}

#[test]
fn entries_for_objects_that_cannot_be_mapped_abort_with_0604_0041() {
    // Not mappable; of another length; not writable in an RPDO.
    entry("031A", 0x2004_0010, "80031A0141000406");
    entry("031A", 0x6041_0008, "80031A0141000406");
    entry("031A", 0x6041_0000, "80031A0141000406");
    entry("031A", 0x6041_0020, "80031A0141000406");
    entry("0316", 0x6041_0010, "8003160141000406");
    entry("031A", 0x1008_0000, "80031A0141000406");
}

#[test]
fn an_entry_may_be_emptied_but_an_empty_one_not_counted() {
    Bench::new(&LOOSE).talk(
        "> 604#23031A0100000000
         < 584#60031A0100000000
         > 604#2F031A0001000000
         < 584#80031A0000000206",
    );
}

#[test]
fn more_entries_than_there_are_abort_with_0604_0042() {
    for count in [5, 8, 9, 65, 253] {
        let mut bench = Bench::new(&LOOSE);
        for sub_index in 1..=4 {
            bench.talk(&format!("> 604#23031A{sub_index:02X}08000120\n < 584#60031A{sub_index:02X}00000000"));
        }
        bench.talk(&format!("> 604#2F031A00{count:02X}000000\n < 584#80031A0042000406"));
    }
}

#[test]
fn more_than_64_bits_abort_with_0604_0042() {
    let mut bench = Bench::new(&LOOSE);
    bench.talk(
        "> 604#23031A0120006460
         < 584#60031A0100000000
         > 604#23031A0220006C60
         < 584#60031A0200000000
         > 604#23031A0308000120
         < 584#60031A0300000000
         > 604#2F031A0003000000
         < 584#80031A0042000406
         > 604#2F031A0002000000
         < 584#60031A0000000000",
    );
}

#[test]
fn a_stored_mapping_that_cannot_be_resolved_maps_nothing() {
    let mut bench = Bench::off(&STANDARD);
    let slot = bench.node.table().find(canopen::Mux::new(0x1A00, 1)).unwrap();
    bench.node.dictionary_mut().set_raw(slot, 0x5FFF_0010);
    bench.boot();
    bench.talk("< 704#00\n > 000#0104\n silence 100ms");
}

//! SDO, PDO, SYNC, EMCY, heartbeat and NMT of this drive: what its own object table and its own timers decide. What all
//! drives share is tried on the ZLAC8030L.

use sim::Component;

use crate::bench::{Bench, assert_within};

const CANNOT_BE_MAPPED: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;

/// Sends SYNC and waits until what it causes has gone over the bus.
fn sync(bench: &mut Bench) {
    bench.send("080#").run_ms(2);
}

#[test]
fn each_of_the_four_rpdos_sets_the_objects_it_maps() {
    let mut bench = Bench::new();
    // Two objects in each: 6083h/6084h, 6081h/6082h, 60FFh/2005h, 607Ah/6060h.
    let pairs: [[i64; 2]; 4] = [
        [0x6083_0020, 0x6084_0020],
        [0x6081_0020, 0x6082_0020],
        [0x60FF_0020, 0x2005_0010],
        [0x607A_0020, 0x6060_0008],
    ];
    for (record, pair) in (0x1600..).zip(&pairs) {
        bench.map(record, pair);
    }
    bench.send("000#0101");
    for frame in ["201#2C010000C8000000", "301#58020000E8030000", "401#9CFFFFFF0500", "501#80C1FFFF03"] {
        bench.send(frame);
    }
    let read = [(0x6083, 300), (0x6084, 200), (0x6081, 600), (0x6082, 1000), (0x60FF, -100), (0x2005, 5)];
    for (index, value) in read.into_iter().chain([(0x607A, -16_000), (0x6060, 3)]) {
        assert_eq!(bench.get(index), value, "{index:04X}h");
    }
}

#[test]
fn each_of_the_four_tpdos_tells_the_objects_it_maps() {
    let mut bench = Bench::new();
    let maps: [&[i64]; 4] = [
        &[0x6041_0010, 0x6061_0008],
        &[0x6064_0020, 0x606C_0020],
        &[0x2002_0010, 0x2001_0010, 0x2069_0010, 0x603F_0010],
        &[0x2003_0010, 0x2004_0010, 0x2005_0010, 0x2000_0010],
    ];
    for (record, objects) in (0x1A00..).zip(maps) {
        bench.map(record, objects);
    }
    for record in 0x1800..0x1804 {
        bench.set((record, 2), 1);
    }
    bench.enable_in(1).move_by(400).run_ms(1000);
    bench.send("000#0101").run_ms(5);
    bench.heard();
    sync(&mut bench);
    // Standing at 400 pulses, reached, bit 4 up, 24 V, 2005h = 3, node 1.
    assert_eq!(bench.heard(), ["181#37BE01", "281#9001000000000000", "381#0000000018000000", "481#0000000003000100"]);
}

#[test]
fn an_rpdo_of_types_0_to_240_waits_for_the_sync_and_one_of_254_or_255_does_not() {
    for (kind, waits) in [(0, true), (1, true), (240, true), (254, false), (255, false)] {
        let mut bench = Bench::new();
        bench.map(0x1601, &[0x60FF_0020]).set((0x1401, 2), kind).send("000#0101").send("301#64000000");
        assert_eq!(bench.get(0x60FF), if waits { 0 } else { 100 }, "type {kind} before SYNC");
        sync(&mut bench);
        assert_eq!(bench.get(0x60FF), 100, "type {kind} after SYNC");
    }
}

#[test]
fn a_synchronous_tpdo_comes_with_each_nth_sync_and_one_of_type_0_after_a_change() {
    for (kind, syncs, expected) in [(1, 12, 12), (4, 12, 3), (240, 480, 2), (0, 12, 1)] {
        let mut bench = Bench::new();
        bench.map(0x1A02, &[0x6041_0010]).set((0x1802, 2), kind).send("000#0101").run_ms(5);
        bench.heard();
        if kind == 0 {
            (0..3).for_each(|_| sync(&mut bench));
            bench.heard();
            bench.set(0x6040, 6);
        }
        (0..syncs).for_each(|_| sync(&mut bench));
        assert_eq!(bench.heard_of("381#").len(), expected, "type {kind}");
    }
}

#[test]
fn sync_is_heard_on_the_identifier_of_1005h() {
    let mut bench = Bench::new();
    bench.map(0x1A00, &[0x6041_0010]).set((0x1800, 2), 1).set(0x1005, 0x90).send("000#0101").run_ms(5);
    bench.heard();
    for (frame, answers) in [("080#", 0), ("090#", 1)] {
        bench.send(frame).run_ms(2);
        assert_eq!(bench.heard_of("181#").len(), answers, "{frame}");
    }
}

#[test]
fn inhibit_time_and_event_timer_count_half_milliseconds() {
    let mut bench = Bench::new();
    bench.map(0x1A00, &[0x6064_0020]).set((0x1800, 2), 254).set((0x1800, 3), 100).enable_in(3).set(0x60FF, 60);
    bench.send("000#0101").run_ms(500);
    bench.heard();
    bench.run_ms(1000);
    let changing: Vec<_> = bench.heard_at().iter().map(|(at, _)| at.as_nanos()).collect();
    assert!((19..=21).contains(&changing.len()), "{} in 1 s", changing.len());
    for pair in changing.windows(2) {
        assert_within("ms between two", (pair[1] - pair[0]) as f64 * 1e-6, 49.9, 50.6);
    }
    // At rest nothing changes: only the timer of type 255 sends.
    bench.set(0x60FF, 0).set((0x1800, 3), 0).set((0x1800, 2), 255).set((0x1800, 5), 40).run_ms(500);
    bench.heard();
    bench.run_ms(1000);
    let count = bench.heard_of("181#").len();
    assert!((49..=51).contains(&count), "{count} in 1 s, expected one each 20 ms");
}

#[test]
fn an_rpdo_acts_in_operational_only() {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x60FF_0020]);
    for (state, acts) in [("000#8001", false), ("000#0201", false), ("000#0101", true)] {
        bench.send(state).send("301#64000000").send("000#8001");
        assert_eq!(bench.get(0x60FF) == 100, acts, "{state}");
    }
}

#[test]
fn what_the_table_refuses_an_rpdo_does_not_do_either() {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x6060_0008, 0x60FF_0020]).send("000#0101").send("301#03B80B0000");
    assert_eq!((bench.get(0x6060), bench.get(0x60FF)), (3, 3000));
    // No mode 2, 3001 r/min, a byte too few.
    for frame in ["301#02B80B0000", "301#04B80B0000", "301#03B90B0000", "301#06010000"] {
        bench.send(frame).run_ms(5);
        assert_eq!((bench.get(0x6060), bench.get(0x60FF)), (3, 3000), "{frame}");
    }
}

#[test]
fn controlword_and_target_in_one_rpdo_start_the_move_whichever_comes_first() {
    for objects in [[0x6040_0010, 0x607A_0020], [0x607A_0020, 0x6040_0010]] {
        let mut bench = Bench::new();
        bench.map(0x1602, &objects).enable_in(1).send("000#0101");
        let (start, target) = ("5F00", "90010000");
        let data = if objects[0] == 0x6040_0010 { format!("{start}{target}") } else { format!("{target}{start}") };
        bench.send(&format!("401#{data}")).run_ms(1000);
        assert_eq!(bench.get(0x6064), 400, "{objects:X?}");
    }
}

#[test]
fn what_the_manual_does_not_map_cannot_be_mapped() {
    let mut bench = Bench::new();
    for record in (0x1600..0x1604).chain(0x1A00..0x1A04) {
        bench.set(record, 0);
        // 605Ah to 605Dh, 1017h and 2030h:00 are not mappable (5.4).
        for object in [0x605A_0010, 0x605D_0010, 0x1017_0010, 0x2030_0010] {
            assert_eq!(bench.write((record, 1), object), Err(CANNOT_BE_MAPPED), "{object:08X}h into {record:04X}h");
        }
        assert!(bench.write((record, 1), 0x6077_0010).is_err(), "6077h does not exist here");
        assert_eq!(bench.write(record, 5), Err(TOO_LONG), "five objects");
    }
    for record in 0x1600..0x1604 {
        assert_eq!(bench.write((record, 1), 0x6041_0010), Err(CANNOT_BE_MAPPED), "read-only into {record:04X}h");
    }
}

#[test]
fn a_stored_mapping_works_after_a_power_cycle() {
    let mut bench = Bench::new();
    bench.map(0x1A03, &[0x6064_0020, 0x6041_0010]).set((0x1803, 2), 1).let_store().power_cycle();
    bench.send("000#0101").run_ms(5);
    bench.heard();
    sync(&mut bench);
    assert_eq!(bench.heard(), ["481#000000007002"]);
}

#[test]
fn segmented_transfers_carry_small_objects_and_block_transfers_are_refused() {
    let mut bench = Bench::new();
    for (request, answer) in [
        ([0x21, 0x7A, 0x60, 0, 4, 0, 0, 0], [0x60, 0x7A, 0x60, 0, 0, 0, 0, 0]),
        ([0x07, 0x80, 0x0C, 0, 0, 0, 0, 0], [0x20, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        assert_eq!(bench.sdo(&request), Some(answer));
    }
    bench.reads(0x607A, 3200);
    // One byte too many.
    bench.sdo(&[0x21, 0x7A, 0x60, 0, 5, 0, 0, 0]);
    bench.sdo(&[0x05, 1, 2, 3, 4, 5, 0, 0]);
    bench.reads(0x607A, 3200);
    for request in [[0xC2, 0x7A, 0x60, 0, 4, 0, 0, 0], [0xA0, 0x7A, 0x60, 0, 4, 0, 0, 0]] {
        assert_eq!(bench.sdo(&request), Some([0x80, 0x7A, 0x60, 0, 0x01, 0x00, 0x04, 0x05]));
    }
}

#[test]
fn the_command_bytes_of_5_2_are_understood_and_an_upload_ignores_its_low_five_bits() {
    let mut bench = Bench::new();
    // The client of a sister drive sends 43h and 4Bh for 40h and relies on the answers.
    for command in [0x40, 0x43, 0x4B, 0x4F, 0x47] {
        let answer = bench.sdo(&[command, 0x00, 0x10, 0, 0, 0, 0, 0]);
        assert_eq!(answer, Some([0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x04, 0x00]), "{command:02X}h");
    }
    // 27h: three bytes, which no object here has.
    let answer = bench.sdo(&[0x27, 0x7A, 0x60, 0, 1, 0, 0, 0]).expect("an answer");
    assert_eq!((answer[0], &answer[4..]), (0x80, &[0x13, 0x00, 0x07, 0x06][..]));
}

#[test]
fn nothing_that_the_manual_does_not_name_is_answered() {
    let mut bench = Bench::new();
    bench.heard();
    // Node guarding, LSS switch state global, LSS fastscan, a second SDO channel, a TPDO's remote frame.
    for frame in ["701#R1", "7E5#0401000000000000", "7E5#5100000000800000", "641#4041600000000000", "181#R8"] {
        bench.send(frame).run_ms(20);
        assert_eq!(bench.heard(), [""; 0], "{frame}");
    }
}

#[test]
fn a_stopped_node_answers_nothing_and_a_reset_boots_it_again() {
    let mut bench = Bench::new();
    bench.set(0x1017, 50).send("000#0201");
    assert_eq!(bench.sdo(&[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]), None);
    bench.heard();
    bench.run_ms(120);
    assert!(bench.heard_of("701#").iter().all(|beat| beat == "701#04"));
    for command in ["000#8201", "000#8101"] {
        bench.send(command).run_ms(20);
        assert_eq!(bench.heard_of("701#")[0], "701#00", "{command}");
        bench.reads(0x1000, 0x0004_0192);
    }
}

#[test]
fn a_communication_reset_leaves_the_motor_turning_and_a_node_reset_frees_it() {
    for (command, rpm, statusword) in [("000#8201", 60, 0x37), ("000#8101", 0, 0x70)] {
        let mut bench = Bench::new();
        bench.enable_in(3).set(0x60FF, 60).run_ms(500);
        bench.send(command).run_ms(50);
        assert_eq!((bench.get(0x606C), bench.statusword() & 0x7F), (rpm, statusword), "{command}");
        assert_eq!(bench.get(0x6064) == 0, rpm == 0, "a started drive counts from 0");
    }
}

#[test]
fn emcy_goes_out_on_the_identifier_of_1014h_and_not_at_all_with_bit_31() {
    for (cob_id, identifier, expected) in [(0x81, "081#", 1), (0x8000_0081, "081#", 0)] {
        let mut bench = Bench::new();
        bench.set(0x1014, cob_id);
        bench.heard();
        bench.set_fault(Component::Reference, true).run_ms(50);
        assert_eq!(bench.heard_of(identifier).len(), expected, "{cob_id:X}h");
    }
}

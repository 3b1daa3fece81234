//! PDOs that can be mapped (CiA 301, 7.2.2 and 7.5.2.35 and on): when they act, what they carry, and which are refused.

use crate::bench::{Bench, BenchSubject, assert_within};
use crate::power_states::PowerSubject;

const CANNOT_BE_MAPPED: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;
const NO_SUCH_OBJECT: u32 = 0x0602_0000;
const NO_SUCH_SUB_INDEX: u32 = 0x0609_0011;
const INVALID_VALUE: u32 = 0x0609_0030;

/// 60FFh in RPDO1 (the second), the node started, as 6.2 of the ZLAC8030L's manual does.
fn with_velocity_rpdo<S: BenchSubject>() -> Bench<S> {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x60FF_0020]).send("000#010n").forget();
    bench
}

/// Sends SYNC and waits until what it causes has gone over the bus.
fn sync<S: BenchSubject>(bench: &mut Bench<S>) {
    bench.send("080#").run_ms(2);
}

/// 7.3.2.2: not in pre-operational, not when stopped, and not later either.
pub fn an_rpdo_acts_in_operational_only<S: BenchSubject>() {
    let mut bench = with_velocity_rpdo::<S>();
    for state in ["000#800n", "000#020n"] {
        bench.send(state).send("30n#64000000").send("000#010n").run_ms(10).reads(0x60FF, 0);
    }
    bench.send("30n#64000000").reads(0x60FF, 100);
}

/// Two objects in each: 6083h/6084h, 6081h/6040h, 60FFh/6085h, 607Ah/6060h.
pub fn each_of_the_four_rpdos_sets_the_objects_it_maps<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1600, &[0x6083_0020, 0x6084_0020]).map(0x1601, &[0x6081_0020, 0x6040_0010]);
    bench.map(0x1602, &[0x60FF_0020, 0x6085_0020]).map(0x1603, &[0x607A_0020, 0x6060_0008]).send("000#010n");
    bench.send("20n#2C010000C8000000").send("30n#580200000600").send("40n#9CFFFFFF05000000").send("50n#80C1FFFF03");
    bench.reads(0x6083, 300).reads(0x6084, 200).reads(0x6081, 600).reads(0x6040, 6);
    bench.reads(0x60FF, -100).reads(0x6085, 5).reads(0x607A, -16_000).reads(0x6060, 3);
}

/// At rest after a move: each carries what an SDO reads of its objects, one after the other, the lowest byte first.
pub fn each_of_the_four_tpdos_tells_the_objects_it_maps<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    let maps: [&[i64]; 4] = [
        &[0x6041_0010, 0x6061_0008, 0x6060_0008],
        &[0x607A_0020, 0x6083_0020],
        &[0x6040_0010, 0x603F_0010, 0x6084_0020],
        &[0x6081_0020, 0x60FF_0020],
    ];
    for (number, objects) in (0..).zip(maps) {
        bench.map(0x1A00 + number, objects).set((0x1800 + number, 2), 1);
    }
    bench.enable_in(1).set(0x60FF, -2).move_by(400).run_ms(2500).send("000#010n").run_ms(5).forget();
    sync(&mut bench);
    let heard = bench.heard();
    assert_eq!(heard.len(), 4, "{heard:?}");
    for ((frame, objects), number) in heard.iter().zip(maps).zip(1..) {
        let read = |object: &i64| bench.read((object >> 16) as u16).expect("an object");
        let data: String = objects.iter().flat_map(read).map(|byte| format!("{byte:02X}")).collect();
        assert_eq!(*frame, format!("{number}8{:X}#{data}", S::NODE));
    }
    bench.shows(0x6F, 0x27).reads(0x6061, 1).reads(0x607A, 400 * S::COUNTS).reads(0x60FF, -2);
}

/// Table 72.
pub fn an_rpdo_of_types_0_to_240_waits_for_the_sync_and_one_of_254_or_255_does_not<S: BenchSubject>() {
    for (kind, waits) in [(0, true), (1, true), (240, true), (254, false), (255, false)] {
        let mut bench = with_velocity_rpdo::<S>();
        bench.set((0x1401, 2), kind).send("30n#64000000");
        assert_eq!(bench.get(0x60FF), if waits { 0 } else { 100 }, "type {kind} before SYNC");
        sync(&mut bench);
        assert_eq!(bench.get(0x60FF), 100, "type {kind} after SYNC");
    }
}

/// Table 77.
pub fn a_synchronous_tpdo_comes_with_each_nth_sync_and_one_of_type_0_after_a_change<S: BenchSubject>() {
    for (kind, syncs) in [(1, 12), (3, 9), (4, 12), (240, 480), (0, 12)] {
        let mut bench = Bench::<S>::new();
        bench.map(0x1A02, &[0x6041_0010]).set((0x1802, 2), kind).send("080#").run_ms(2);
        bench.send("000#010n").run_ms(5).hears_of("38n#", &[]);
        if kind == 0 {
            (0..3).for_each(|_| sync(&mut bench));
            bench.forget().set(0x6040, 6);
        }
        for number in 1..=syncs {
            sync(&mut bench);
            let expected = if kind == 0 { number == 1 } else { number % kind == 0 };
            assert_eq!(bench.heard_of("38n#").len(), usize::from(expected), "type {kind}, SYNC {number}");
        }
    }
}

/// 7.3.2.2.3.
pub fn each_asynchronous_tpdo_is_sent_once_on_entering_operational<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1A01, &[0x6041_0010]).map(0x1A02, &[0x6064_0020]).set((0x1802, 2), 254).forget();
    let statusword = format!("28n#{:04X}", S::BOOTED.swap_bytes());
    let expected = [bench.named(&statusword), bench.named("38n#00000000")];
    let mut heard = bench.send("000#010n").run_ms(500).heard();
    heard.retain(|frame| frame.starts_with("28") || frame.starts_with("38"));
    assert_eq!(heard, expected);
}

/// Both count half milliseconds in these drives (chapter 9 of the ZLAC8030L's manual, 5.4 of the ZLIM42-C's).
pub fn inhibit_time_and_event_timer_count_half_milliseconds<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1A00, &[0x6064_0020]).set((0x1800, 2), 254).set((0x1800, 3), 100).turn(60);
    bench.send("000#010n").run_ms(500).forget().run_ms(1000);
    let changing: Vec<_> = bench.heard_at().iter().map(|(at, _)| at.as_nanos()).collect();
    assert!((19..=21).contains(&changing.len()), "{} in 1 s", changing.len());
    for pair in changing.windows(2) {
        assert_within("ms between two", (pair[1] - pair[0]) as f64 * 1e-6, 49.9, 50.6);
    }
    // With type 255 only the timer sends, whatever changes.
    bench.set((0x1800, 3), 0).set((0x1800, 2), 255).set((0x1800, 5), 40).run_ms(500).forget().run_ms(1000);
    let count = bench.heard_of("18n#").len();
    assert!((49..=51).contains(&count), "{count} in 1 s, expected one each 20 ms");
}

/// 7.5.2.36.
pub fn a_pdo_is_mapped_with_bit_31_as_masters_do_and_without_as_the_manuals_do<S: PowerSubject>() {
    let cob_id = 0x180 + i64::from(S::NODE);
    for with_bit_31 in [true, false] {
        let mut bench = Bench::<S>::new();
        if with_bit_31 {
            bench.set((0x1800, 1), 0x8000_0000 | cob_id);
        }
        bench.map(0x1A00, &[0x6064_0020, 0x6041_0010]).set((0x1800, 2), 254).set((0x1800, 1), cob_id);
        bench.send("000#010n").run_ms(20);
        bench.hears_of("18n#", &[&format!("18n#00000000{:04X}", S::BOOTED.swap_bytes())]);
    }
}

/// 7.5.2.35, bit 31.
pub fn a_switched_off_pdo_is_silent_and_deaf<S: BenchSubject>() {
    let mut bench = with_velocity_rpdo::<S>();
    let node = i64::from(S::NODE);
    bench.map(0x1A00, &[0x6041_0010]).set((0x1800, 1), 0x8000_0180 + node).set((0x1401, 1), 0x8000_0300 + node);
    bench.forget().send("000#800n").send("000#010n").send("30n#64000000").set(0x6040, 6).run_ms(100);
    bench.hears_of("18n#", &[]).reads(0x60FF, 0);
}

/// 605Ah to 605Dh and 1017h are not mappable, 6041h is read-only (object tables); widths, sums and counts are CiA 301's.
pub fn a_wrong_mapping_is_refused_with_the_codes_of_cia_301<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    for record in (0x1600..0x1604).chain(0x1A00..0x1A04) {
        bench.set(record, 0);
        let (rpdo, before) = (record < 0x1A00, bench.get((record, 1)));
        let missing =
            [0x7000_0020, 0x2030_1110].map(|object| (object, [CANNOT_BE_MAPPED, NO_SUCH_OBJECT, NO_SUCH_SUB_INDEX]));
        let unmappable = [0x605A_0010, 0x605D_0010, 0x1017_0010, if rpdo { 0x6041_0010 } else { 0x606C_0010 }];
        for (object, codes) in missing.into_iter().chain(unmappable.map(|object| (object, [CANNOT_BE_MAPPED; 3]))) {
            let answer = bench.write((record, 1), object);
            assert!(answer.is_err_and(|code| codes.contains(&code)), "{object:08X}h into {record:04X}h: {answer:X?}");
            assert_eq!(bench.get((record, 1)), before, "nothing is stored");
        }
        let object = if rpdo { 0x60FF_0020 } else { 0x6064_0020 };
        bench.refuses(record, 5, TOO_LONG).set((record, 1), object).set((record, 2), object).set((record, 3), object);
        bench.refuses(record, 3, TOO_LONG).set(record, 2);
        assert!(bench.write((record, 1), object).is_err(), "an entry while the mapping is in use");
    }
}

/// A mode that does not exist, a speed above its range, a byte too few: the object stays as it is.
pub fn what_the_table_refuses_an_rpdo_does_not_do_either<S: BenchSubject>() {
    let (_, most_rpm) = S::rows().find(0x60FF, 0).and_then(|row| row.limits).expect("a range");
    let frame = |mode: u8, rpm: i64| format!("30n#{mode:02X}{:08X}", (rpm as u32).swap_bytes());
    let mut bench = Bench::<S>::new();
    bench.map(0x1601, &[0x6060_0008, 0x60FF_0020]).send("000#010n").send(&frame(3, most_rpm));
    for wrong in [frame(2, most_rpm), frame(9, most_rpm), frame(3, most_rpm + 1), "30n#01010000".to_owned()] {
        bench.send(&wrong).run_ms(5).reads(0x6060, 3).reads(0x60FF, most_rpm);
    }
}

/// 7.2.2.5: a frame may be longer than what is mapped, not shorter.
pub fn a_short_rpdo_is_not_half_applied_and_a_long_one_counts_as_far_as_mapped<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    let before = (bench.get(0x6083), bench.get(0x6084));
    bench.map(0x1601, &[0x6083_0020, 0x6084_0020]).send("000#010n").send("30n#64000000C80000");
    assert_eq!((bench.get(0x6083), bench.get(0x6084)), before);
    bench.map(0x1601, &[0x60FF_0020]).send("30n#6400000012345678").reads(0x60FF, 100);
}

/// 7.2.7.1 and table 26: 8210h when the error begins, 0000h when it ends, bit 4 of 1001h between. Of an RPDO that is too
/// long the mapped bytes count; 8220h is a choice, and none of these drives makes it.
pub fn an_rpdo_that_is_too_short_is_told_once_by_8210h_and_one_that_is_too_long_is_not<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.send("000#010n").run_ms(50).forget().send("20n#06").send("20n#06").send("20n#06").run_ms(10);
    bench.hears_of("08n#", &["08n#1082110000000000"]).reads(0x1001, 0b1_0001).reads(0x6040, 0).reads(0x603F, 0);
    bench.send("20n#0600").send("20n#0600").send("20n#0600").run_ms(10);
    bench.hears_of("08n#", &["08n#0000000000000000"]).reads(0x1001, 0).reads(0x6040, 6).shows(0x6F, 0x21);
    bench.send("20n#0700AAAAAAAAAAAA").run_ms(10).hears_of("08n#", &[]).reads(0x1001, 0).reads(0x6040, 7);
}

/// All objects of a frame are there before the controlword acts.
pub fn controlword_and_target_in_one_rpdo_start_the_move_whichever_comes_first<S: PowerSubject>() {
    for (objects, data) in [([0x6040_0010, 0x607A_0020], "5F0000040000"), ([0x607A_0020, 0x6040_0010], "000400005F00")]
    {
        let mut bench = Bench::<S>::new();
        bench.map(0x1602, &objects).enable_in(1).send("000#010n").send(&format!("40n#{data}")).run_ms(2500);
        // 2002h of the ZLAC8030L: in place within 30 counts.
        assert_within(&format!("6064h with {objects:X?}"), bench.get(0x6064) as f64, 994.0, 1054.0);
    }
}

/// Mapping and transmission type are stored (object tables).
pub fn a_stored_mapping_works_after_a_power_cycle<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1A03, &[0x6064_0020, 0x6041_0010]).set((0x1803, 2), 1).let_store().power_cycle();
    bench.send("000#010n").run_ms(5).forget();
    sync(&mut bench);
    bench.hears_of("48n#", &[&format!("48n#00000000{:04X}", S::BOOTED.swap_bytes())]);
}

/// Tables 72 and 77: 241 to 251 are reserved, 252 and 253 are for remote frames, and of TPDOs only.
pub fn a_reserved_transmission_type_is_refused<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    for record in (0x1400..0x1404).chain(0x1800..0x1804) {
        for kind in [0, 1, 240, 254, 255] {
            bench.set((record, 2), kind);
        }
        for kind in [241, 251] {
            bench.refuses((record, 2), kind, INVALID_VALUE);
        }
        for kind in [252, 253] {
            if record >= 0x1800 && devices::model(S::MODEL).is_some_and(|model| model.pdo.remote_requests) {
                bench.set((record, 2), kind);
            } else {
                bench.refuses((record, 2), kind, INVALID_VALUE);
            }
        }
    }
}

//! NMT, SDO, PDO, heartbeat and EMCY of the running drive, with the faults that other CANopen stacks were found to have.

use sim::Component;

use crate::bench::{Bench, assert_within};

/// Maps 60FFh into RPDO1 and starts the node, as 6.2 does.
fn with_velocity_rpdo() -> Bench {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x60FF_0020]).send("000#0104");
    bench.heard();
    bench
}

#[test]
fn an_rpdo_heard_in_pre_operational_is_not_applied_at_the_start() {
    let mut bench = with_velocity_rpdo();
    bench.send("000#8004").send("304#64000000").send("000#0104").run_ms(10).reads(0x60FF, 0);
}

#[test]
fn a_reset_leaves_the_node_able_to_speak() {
    for (command, name) in [("000#8104", "node"), ("000#8204", "communication")] {
        let mut bench = with_velocity_rpdo();
        bench.set(0x1017, 100).run_ms(50);
        bench.heard();
        bench.send(command).run_ms(450);
        // 1017h is stored: the heartbeat goes on with the boot-up message as its first.
        let heard = bench.heard_of("704#");
        assert_eq!(heard, ["704#00", "704#7F", "704#7F", "704#7F", "704#7F"], "reset {name}");
        bench.reads(0x1000, 0x0004_0192);
        bench.send("000#0104").send("304#64000000");
        assert_eq!(bench.get(0x60FF), 100, "RPDO1 is stored and works again");
    }
}

#[test]
fn commands_to_all_nodes_and_to_this_one_act_and_commands_to_others_do_not() {
    let mut bench = Bench::new();
    bench.set(0x1017, 20);
    for (command, state) in [
        ("000#0104", "704#05"),
        ("000#8005", "704#05"),
        ("000#0200", "704#04"),
        ("000#0103", "704#04"),
        ("000#8000", "704#7F"),
        ("000#0100", "704#05"),
        ("000#7F04", "704#05"),
        ("000#80", "704#05"),
    ] {
        bench.send(command);
        bench.heard();
        bench.run_ms(30);
        assert_eq!(bench.heard()[0], state, "after {command}");
    }
}

#[test]
fn a_stopped_node_answers_no_sdo_and_its_motor_goes_on() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 60).run_ms(800);
    bench.send("000#0204");
    assert_eq!(bench.sdo(&[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]), None);
    bench.run_ms(1000).turns_at(59.0, 61.0);
    bench.send("000#8004").reads(0x60FF, 60);
}

#[test]
fn a_communication_reset_does_not_touch_the_motor_and_a_node_reset_lets_it_go() {
    for (command, low, high) in [("000#8204", 59.0, 61.0), ("000#8104", 0.0, 55.0)] {
        let mut bench = Bench::new();
        bench.enable_in(3).set(0x60FF, 60).run_ms(800);
        bench.send(command).run_ms(700);
        assert_within(&format!("speed after {command}"), bench.report().velocity_rpm, low, high);
    }
    let mut bench = Bench::new();
    bench.send("000#8104").run_ms(10).shows(0xFFFF, 0x0670);
}

#[test]
fn the_heartbeat_comes_back_by_itself_after_a_power_cycle_when_it_was_stored() {
    let mut bench = Bench::new();
    bench.set(0x1017, 200).let_store();
    bench.heard();
    bench.power_cycle().run_ms(700);
    assert_eq!(bench.heard_of("704#"), ["704#00", "704#7F", "704#7F", "704#7F"]);
}

#[test]
fn malformed_sdo_requests_are_survived_and_change_nothing() {
    let mut bench = Bench::new();
    let requests = ["604#", "604#40", "604#2F6060", "604#2B4060000F", "604#FFFFFFFFFFFFFFFF", "604#E041600000000000"];
    for request in requests {
        bench.send(request).run_ms(5);
    }
    bench.send("604#R8").run_ms(5);
    assert_eq!((bench.get(0x6060), bench.get(0x6040), bench.statusword()), (0, 0, 0x0670));
}

#[test]
fn a_block_transfer_is_refused_and_an_abort_in_its_place_is_ignored() {
    let mut bench = Bench::new();
    let refused = [0x80, 0x00, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05];
    assert_eq!(bench.sdo(&[0xA0, 0x00, 0x10, 0x00, 0x10, 0, 0, 0]), Some(refused), "block upload");
    assert_eq!(bench.sdo(&[0x80, 0x00, 0x10, 0x00, 0x00, 0x00, 0x04, 0x05]), None, "a client's abort");
    assert_eq!(bench.sdo(&[0xC2, 0x00, 0x10, 0x00, 4, 0, 0, 0]), Some(refused), "block download");
    bench.reads(0x1000, 0x0004_0192);
}

#[test]
fn an_answer_comes_within_about_a_millisecond() {
    let mut bench = Bench::new();
    let before = bench.world.now();
    bench.sdo(&[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
    let taken = bench.world.now().nanos_since(before);
    assert_within("ms, two frames of 0.25 ms on the wire included", taken as f64 * 1e-6, 0.4, 1.7);
}

#[test]
fn a_short_rpdo_is_not_half_applied_and_a_long_one_counts_as_far_as_mapped() {
    let mut bench = Bench::new();
    bench.map(0x1601, &[0x6083_0020, 0x6084_0020]).send("000#0104").send("304#64000000C80000");
    assert_eq!((bench.get(0x6083), bench.get(0x6084)), (500, 500));
    bench.map(0x1601, &[0x60FF_0020]).send("304#6400000012345678").reads(0x60FF, 100);
}

#[test]
fn a_tpdo_of_type_3_comes_with_each_third_sync() {
    let mut bench = Bench::new();
    bench.map(0x1A00, &[0x6064_0020]).set((0x1800, 2), 3).send("000#0104").run_ms(10);
    bench.heard();
    let sent: Vec<_> = (0..9)
        .map(|_| {
            bench.send("080#").run_ms(5);
            bench.heard_of("184#").len()
        })
        .collect();
    assert_eq!(sent, [0, 0, 1, 0, 0, 1, 0, 0, 1]);
}

#[test]
fn each_asynchronous_tpdo_is_sent_once_on_entering_operational() {
    let mut bench = Bench::new();
    bench.map(0x1A01, &[0x6041_0010]).map(0x1A02, &[0x6064_0020]).set((0x1802, 2), 254);
    bench.heard();
    bench.send("000#0104").run_ms(500);
    assert_eq!(bench.heard(), ["284#7006", "384#00000000"]);
}

#[test]
fn an_event_driven_tpdo_keeps_to_its_inhibit_time_in_half_milliseconds() {
    let mut bench = Bench::new();
    bench.map(0x1A00, &[0x6064_0020]).set((0x1800, 2), 254).set((0x1800, 3), 200).enable_in(3).set(0x60FF, 60);
    bench.send("000#0104").run_ms(1000);
    bench.heard();
    bench.run_ms(1000);
    let times: Vec<_> = bench.heard_at().iter().map(|(at, _)| at.as_nanos()).collect();
    assert!((9..=11).contains(&times.len()), "{} in 1 s", times.len());
    for pair in times.windows(2) {
        assert_within("ms between two", (pair[1] - pair[0]) as f64 * 1e-6, 99.9, 101.0);
    }
}

#[test]
fn a_pdo_is_mapped_with_bit_31_as_masters_do_and_without_as_the_manual_does() {
    for with_bit_31 in [true, false] {
        let mut bench = Bench::new();
        if with_bit_31 {
            bench.set((0x1800, 1), 0x8000_0184);
        }
        bench.map(0x1A00, &[0x6064_0020, 0x6041_0010]).set((0x1800, 2), 254);
        if with_bit_31 {
            bench.set((0x1800, 1), 0x184);
        }
        bench.send("000#0104").run_ms(20);
        assert_eq!(bench.heard_of("184#"), ["184#000000007006"]);
    }
}

#[test]
fn a_switched_off_pdo_is_silent_and_deaf() {
    let mut bench = with_velocity_rpdo();
    bench.map(0x1A00, &[0x6041_0010]).set((0x1800, 1), 0x8000_0184).set((0x1401, 1), 0x8000_0304);
    bench.heard();
    bench.send("000#8004").send("000#0104").send("304#64000000").set(0x6040, 6).run_ms(100);
    assert_eq!(bench.heard_of("184#"), [""; 0]);
    bench.reads(0x60FF, 0);
}

#[test]
fn a_wrong_mapping_is_refused_with_the_codes_of_cia_301() {
    const CANNOT_BE_MAPPED: u32 = 0x0604_0041;
    const TOO_LONG: u32 = 0x0604_0042;
    let mut bench = Bench::new();
    bench.set(0x1600, 0).set(0x1A00, 0);
    for (record, object, refusal) in [
        (0x1600, 0x6041_0010, &[CANNOT_BE_MAPPED][..]),
        (0x1600, 0x605A_0010, &[CANNOT_BE_MAPPED]),
        (0x1A00, 0x1017_0010, &[CANNOT_BE_MAPPED]),
        (0x1A00, 0x606C_0010, &[CANNOT_BE_MAPPED]),
        (0x1A00, 0x7000_0020, &[CANNOT_BE_MAPPED, 0x0602_0000]),
        (0x1A00, 0x202F_0910, &[CANNOT_BE_MAPPED, 0x0602_0000]),
    ] {
        let answer = bench.write((record, 1), object);
        assert!(answer.is_err_and(|code| refusal.contains(&code)), "{object:08X}h into {record:04X}h: {answer:X?}");
        assert_eq!(bench.get((record, 1)), if record == 0x1600 { 0x6040_0010 } else { 0 }, "nothing is stored");
    }
    assert_eq!(bench.write(0x1A00, 5), Err(TOO_LONG), "five objects");
    for sub in 1..=3 {
        bench.set((0x1A00, sub), 0x6064_0020);
    }
    assert_eq!(bench.write(0x1A00, 3), Err(TOO_LONG), "96 bits");
    bench.set(0x1A00, 2);
    assert!(bench.write((0x1A00, 1), 0x606C_0020).is_err(), "an entry while the mapping is in use");
}

#[test]
fn a_value_out_of_range_in_an_rpdo_is_not_followed() {
    let mut bench = with_velocity_rpdo();
    bench.send("304#E9030000");
    assert_eq!(bench.get(0x60FF), 0, "1001 r/min");
    bench.send("304#E8030000").reads(0x60FF, 1000);
}

#[test]
fn emcy_is_sent_on_the_identifier_of_1014h_and_not_at_all_with_bit_31() {
    for (cob_id, expected) in [(0x84, 1), (0x8000_0084, 0)] {
        let mut bench = Bench::new();
        bench.set(0x1014, cob_id);
        bench.heard();
        bench.set_fault(Component::Hall, true).run_ms(50);
        assert_eq!(bench.heard_of("084#").len(), expected);
    }
}

#[test]
fn a_segmented_download_and_upload_carry_a_small_object_too() {
    let mut bench = Bench::new();
    let steps: [(&[u8], [u8; 8]); 2] = [
        (&[0x21, 0x83, 0x60, 0, 4, 0, 0, 0], [0x60, 0x83, 0x60, 0, 0, 0, 0, 0]),
        (&[0x07, 0xE8, 0x03, 0, 0, 0, 0, 0], [0x20, 0, 0, 0, 0, 0, 0, 0]),
    ];
    for (request, answer) in steps {
        assert_eq!(bench.sdo(request), Some(answer));
    }
    bench.reads(0x6083, 1000);
}

#[test]
fn a_segment_with_the_wrong_toggle_bit_ends_the_transfer_and_stores_nothing() {
    let mut bench = Bench::new();
    bench.sdo(&[0x21, 0x83, 0x60, 0, 4, 0, 0, 0]);
    let answer = bench.sdo(&[0x17, 0xE8, 0x03, 0, 0, 0, 0, 0]).expect("an abort");
    assert_eq!((answer[0], &answer[4..]), (0x80, &[0x00, 0x00, 0x03, 0x05][..]));
    bench.reads(0x6083, 500);
}

#[test]
fn an_expedited_download_without_a_size_takes_what_the_object_needs() {
    let mut bench = Bench::new();
    assert_eq!(bench.sdo(&[0x22, 0x83, 0x60, 0, 0xE8, 3, 0, 0]), Some([0x60, 0x83, 0x60, 0, 0, 0, 0, 0]));
    bench.reads(0x6083, 1000);
}

#[test]
fn a_heartbeat_of_100_ms_comes_a_hundred_times_in_ten_seconds_without_drift() {
    let mut bench = Bench::new();
    bench.set(0x1017, 100).run_ms(150);
    bench.heard();
    bench.run_ms(10_000);
    let times: Vec<_> = bench.heard_at().iter().map(|(at, _)| at.as_nanos()).collect();
    assert_eq!(times.len(), 100);
    let span_ms = (times[99] - times[0]) as f64 * 1e-6;
    assert_within("ms from the first to the last", span_ms, 9899.9, 9900.6);
}

#[test]
fn no_emcy_and_no_pdo_leave_a_stopped_node() {
    let mut bench = with_velocity_rpdo();
    bench.map(0x1A00, &[0x603F_0010]).send("000#0204");
    bench.heard();
    bench.set_fault(Component::Hall, true).run_ms(200);
    bench.send("080#");
    assert_eq!(bench.heard(), [""; 0]);
}

#[test]
fn remote_frames_get_no_answer() {
    let mut bench = with_velocity_rpdo();
    bench.map(0x1A00, &[0x6041_0010]).run_ms(20);
    bench.heard();
    for frame in ["704#R1", "184#R2", "584#R8"] {
        bench.send(frame).run_ms(20);
    }
    assert_eq!(bench.heard(), [""; 0]);
}

#[test]
fn a_reserved_transmission_type_is_refused() {
    let mut bench = Bench::new();
    for kind in [0, 1, 240, 254, 255] {
        assert_eq!(bench.write((0x1800, 2), kind), Ok(()), "type {kind}");
    }
    for kind in [241, 251] {
        assert_eq!(bench.write((0x1800, 2), kind), Err(0x0609_0030), "type {kind}");
    }
}

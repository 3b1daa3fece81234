//! NMT, heartbeat, EMCY and SYNC (CiA 301), with the faults that other CANopen stacks were found to have.

use crate::bench::{Bench, BenchSubject, assert_within};
use crate::power_states::PowerSubject;

/// 7.2.8.2: node 0 is all nodes; a command that is cut short or not defined has no effect.
pub fn commands_to_all_nodes_and_to_this_one_act_and_commands_to_others_do_not<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(0x1017, 20);
    for (command, state) in [
        ("000#010n", "70n#05"),
        ("000#8005", "70n#05"),
        ("000#0200", "70n#04"),
        ("000#0103", "70n#04"),
        ("000#01", "70n#04"),
        ("000#", "70n#04"),
        ("000#8000", "70n#7F"),
        ("000#FF0n", "70n#7F"),
        ("000#0100", "70n#05"),
        ("000#7F0n", "70n#05"),
        ("000#80", "70n#05"),
    ] {
        bench.send(command).forget().run_ms(30);
        let heard = bench.heard_of("70n#");
        assert!(!heard.is_empty() && heard.iter().all(|beat| beat[4..] == state[4..]), "after {command}: {heard:?}");
    }
}

/// What is stored of communication works at once after a reset: 1017h with the boot-up message as its first, and RPDO1.
pub fn a_reset_leaves_the_node_able_to_speak<S: BenchSubject>() {
    for (command, name) in [("000#810n", "node"), ("000#820n", "communication")] {
        for state in ["000#010n", "000#020n"] {
            let mut bench = Bench::<S>::new();
            bench.map(0x1601, &[0x60FF_0020]).set(0x1017, 100).send(state).run_ms(50);
            bench.forget().send(command).run_ms(450);
            bench.hears_of("70n#", &["70n#00", "70n#7F", "70n#7F", "70n#7F", "70n#7F"]).reads(0x1000, 0x0004_0192);
            bench.send("000#010n").send("30n#64000000");
            assert_eq!(bench.get(0x60FF), 100, "RPDO1 is stored and works again after a reset of the {name}");
        }
    }
}

/// 7.3.2.2.4: a stopped node has NMT and heartbeat only. What the motor does is not a matter of the network.
pub fn a_stopped_node_answers_no_sdo_and_its_motor_goes_on<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(0x1017, 50).turn(60).send("000#020n").forget().is_silent().run_ms(1000);
    assert_within("r/min", bench.report().velocity_rpm, 60.0 - S::RIPPLE_RPM, 60.0 + S::RIPPLE_RPM);
    let expected = |frame: &String| frame.starts_with("70") && frame.ends_with("#04") || frame.starts_with("60");
    assert!(bench.heard().iter().all(expected));
    bench.send("000#800n").reads(0x60FF, 60);
}

/// The power state machine is the application's: a reset of communication leaves it alone, and a reset of the node starts
/// the drive, which then counts from 0.
pub fn a_communication_reset_leaves_the_motor_turning_and_a_node_reset_frees_it<S: PowerSubject>() {
    for (command, turns) in [("000#820n", true), ("000#810n", false)] {
        let mut bench = Bench::<S>::new();
        bench.turn(60);
        let before = bench.get(0x6064);
        bench.send(command).run_ms(50).shows(0x6F, if turns { 0x27 } else { S::BOOTED & 0x6F });
        assert_eq!(bench.get(0x6064) > before, turns, "{command}: a started drive counts from 0");
        assert_eq!(bench.report().current_a != 0.0, turns, "{command}");
        match turns {
            true => bench.run_ms(650).goes_at(60),
            false => bench.run_ms(650).turns_at(0.0, 55.0),
        };
    }
    let mut bench = Bench::<S>::new();
    bench.send("000#810n").run_ms(10).shows(0xFFFF, S::BOOTED);
}

/// 1017h is stored.
pub fn the_heartbeat_comes_back_by_itself_after_a_power_cycle<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(0x1017, 200).let_store().forget().power_cycle().run_ms(700);
    bench.hears_of("70n#", &["70n#00", "70n#7F", "70n#7F", "70n#7F"]);
}

/// 7.2.8.3.2.2, and 0 ms for none.
pub fn a_heartbeat_of_100_ms_comes_a_hundred_times_in_ten_seconds_without_drift_and_one_of_0_never<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(0x1017, 100).run_ms(150).forget().run_ms(10_000);
    let times: Vec<_> = bench.heard_at().iter().map(|(at, _)| at.as_nanos()).collect();
    assert_eq!(times.len(), 100);
    let span_ms = (times[99] - times[0]) as f64 * 1e-6;
    assert_within("ms from the first to the last", span_ms, 9899.9, 9900.6);
    bench.set(0x1017, 0).run_ms(5).forget().run_ms(2000).hears(&[]);
}

/// 7.5.2.17.
pub fn emcy_is_sent_on_the_identifier_of_1014h_and_not_at_all_with_bit_31<S: PowerSubject>() {
    let own = 0x80 + i64::from(S::NODE);
    for (cob_id, expected) in [(own, 1), (0x8000_0000 | own, 0)] {
        let mut bench = Bench::<S>::new();
        bench.set(0x1014, cob_id).forget().break_down(true);
        assert_eq!(bench.heard_of("08n#").len(), expected, "1014h = {cob_id:X}h");
    }
}

/// 7.3.2.2.4.
pub fn no_emcy_and_no_pdo_leave_a_stopped_node<S: PowerSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1A00, &[0x603F_0010]).send("000#010n").send("000#020n").forget().break_down(true).run_ms(150);
    bench.send("080#").hears(&[]);
}

/// 7.5.2.5.
pub fn sync_is_heard_on_the_identifier_of_1005h<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.map(0x1A00, &[0x6041_0010]).set((0x1800, 2), 1).set(0x1005, 0x90).send("000#010n").run_ms(5).forget();
    for (frame, answers) in [("080#", 0), ("090#", 1)] {
        bench.send(frame).run_ms(2);
        assert_eq!(bench.heard_of("18n#").len(), answers, "{frame}");
    }
}

/// Services that no manual names: node guarding, LSS (switch state global, fastscan), TIME, a second SDO channel, SDO of
/// another node.
pub fn nothing_that_the_manual_does_not_name_is_answered<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set(0x1017, 0).run_ms(20).forget();
    for frame in [
        "70n#R1",
        "7E5#0401000000000000",
        "7E5#5100000000800000",
        "100#000000000000",
        "64n#4041600000000000",
        "602#4041600000000000",
    ] {
        bench.send(frame).run_ms(20).hears(&[]);
    }
}

/// Bit 30 of a TPDO's COB-ID is 0: CiA 301, table 69 reads that as "RTR allowed". CiA says elsewhere (application note 802)
/// that remote frames should not be used, and these drives do not hear them.
pub fn remote_frames_get_no_answer_though_the_cob_ids_say_that_rtr_is_allowed<S: BenchSubject>() {
    let mut bench = Bench::<S>::new();
    if S::rows().find(0x1A00, 0).is_some_and(|row| row.writable) {
        bench.map(0x1A00, &[0x6041_0010]);
    }
    bench.set(0x1017, 0).send("000#010n").run_ms(50).forget();
    for number in 0..4 {
        let cob_id = bench.get((0x1800 + number, 1)) as u32;
        assert_eq!(cob_id >> 30 & 1, 0, "TPDO{number}");
        for reserved in [241, 251, 252, 253] {
            bench.refuses((0x1800 + number, 2), reserved, 0x0609_0030);
        }
    }
    bench.forget();
    // TPDO 1 to 4, node guarding, SDO, RPDO 1, EMCY, SYNC, NMT; then with the length of what they ask for.
    for frame in ["18n#R", "28n#R", "38n#R", "48n#R", "70n#R", "58n#R", "60n#R", "20n#R", "08n#R", "080#R", "000#R"] {
        bench.send(frame);
    }
    for frame in ["70n#R1", "18n#R2", "28n#R6", "18n#R8", "58n#R8", "60n#R8", "20n#R7"] {
        bench.send(frame).run_ms(3);
    }
    bench.run_ms(200).hears(&[]).reads(0x1001, 0);
}

//! NMT, heartbeats, the watch over the host, and PDOs that answer PDOs.

use crate::virtual_mjoint::bench::{Bench, TURN};

#[test]
fn a_joint_boots_into_operational_and_sends_nothing_but_heartbeats_unasked() {
    let mut bench = Bench::new();
    let boot: Vec<String> = bench.heard();
    assert_eq!(boot, ["701#00"]);
    bench.turn(500).forget().run_ms(3500);
    let heard = bench.heard();
    assert!(heard.iter().all(|frame| frame == "701#05"), "{heard:?}");
    assert!((3..=4).contains(&heard.len()), "{heard:?}");
}

#[test]
fn each_rpdo_is_answered_once_by_the_tpdo_of_its_number() {
    let mut bench = Bench::new();
    for (request, answer, length) in [
        ("201#000001A0860100", "181#", 6),
        ("301#A0860100E8030000", "281#", 6),
        ("401#00000100000000", "381#", 6),
        ("501#A0860100", "481#", 6),
    ] {
        bench.forget().send(request).run_ms(10);
        let heard = bench.heard();
        assert_eq!(heard.len(), 1, "{request}: {heard:?}");
        assert!(heard[0].starts_with(answer) && heard[0].len() == 4 + 2 + length * 2 - 2, "{request}: {heard:?}");
    }
    bench.forget().send("080#");
    assert_eq!(bench.heard(), [""; 0], "SYNC itself is answered by nothing");
}

#[test]
fn requests_may_be_as_short_as_they_need_and_answers_have_eight_bytes() {
    let mut bench = Bench::new();
    for (request, answer) in [
        ("601#40416000", "581#4B41600004040000"),
        ("601#2B4060000F00", "581#6040600000000000"),
        ("601#2F60600001", "581#6060600000000000"),
        ("601#4064600000000000", "581#4364600000000000"),
    ] {
        bench.forget().send(request);
        assert_eq!(bench.heard(), [answer], "{request}");
    }
    bench.forget().send("601#2B4060000F");
    assert_eq!(bench.heard(), [""; 0], "a byte is missing");
}

#[test]
fn the_first_heartbeat_of_the_host_arms_a_watch_that_stops_the_motor_and_clears_itself() {
    let mut bench = Bench::new();
    bench.turn(600).run_ms(5000);
    assert_eq!(bench.statusword(), 0x0437, "not watched before the first heartbeat");
    bench.send("77F#05").run_ms(1900).reads(0x260E, 0);
    bench.run_ms(200).reads(0x260E, 0x20).shows(0xFFFF, 0x003F).reads(0x1001, 1);
    bench.run_ms(200);
    assert!(bench.report().velocity_rpm.abs() < 1.0, "stopped, and held");
    bench.forget().run_ms(1010);
    assert!(bench.heard().contains(&"701#04".to_string()));
    bench.send("77E#05");
    assert_eq!(bench.get(0x260E), 0x20, "another node's heartbeat");
    bench.send("77F#05").reads(0x260E, 0).reads(0x1001, 0);
    bench.run_ms(500);
    assert!((bench.report().velocity_rpm - 600.0).abs() < 10.0, "it goes on");
}

#[test]
fn a_move_goes_on_to_its_target_after_a_silence_of_the_host() {
    let mut bench = Bench::new();
    bench.set(0x6081, 300).set((0x1016, 1), 0x007F_0064).set(0x6040, 0x2F).set(0x607A, 10 * TURN).send("77F#05");
    bench.run_ms(400);
    let stopped = bench.position();
    assert!(stopped < 2 * TURN && bench.get(0x260E) == 0x20, "{stopped}");
    bench.send("77F#05").set((0x1016, 1), 0).reaches(3000).is_at(10 * TURN, 30);
}

#[test]
fn nmt_stop_silences_pdos_and_sdo_and_start_brings_them_back() {
    let mut bench = Bench::new();
    bench.send("000#0201").forget().send("301#0000000000000000").send("601#40416000").hears(&[]);
    bench.send("000#0101").send("301#0000000000000000");
    assert!(bench.heard().iter().any(|frame| frame.starts_with("281#")));
}

#[test]
fn an_rpdo_that_is_too_short_has_no_effect_and_one_that_is_longer_is_taken() {
    let mut bench = Bench::new();
    bench.forget();
    for short in ["201#2F000150C300", "301#50C30000E80300", "401#0F00035802", "501#50C300", "201#"] {
        bench.send(short);
        assert_eq!(bench.heard(), [""; 0], "{short}");
    }
    bench.reads(0x6040, 0).reads(0x607A, 0).reads(0x60FF, 0).reads(0x1001, 0);
    bench.forget().send("201#0F000350C30000FF");
    assert!(bench.heard().iter().any(|frame| frame.starts_with("181#")));
    bench.reads(0x6040, 0x0F).reads(0x6060, 3).reads(0x607A, 50_000).reads(0x1001, 0);
}

#[test]
fn pre_operational_leaves_sdo_and_stops_pdos() {
    let mut bench = Bench::new();
    bench.send("000#8001").forget().send("301#0000000000000000").hears(&[]).shows(0xFFFF, 0x0404);
    bench.run_ms(1010);
    assert!(bench.heard().contains(&"701#7F".to_string()));
    for reset in ["000#8101", "000#8201"] {
        bench.send(reset).run_ms(5);
        assert_eq!(bench.heard(), ["701#00"], "{reset}");
        bench.send("301#0000000000000000");
        assert!(bench.heard().iter().any(|frame| frame.starts_with("281#")), "operational again by itself");
    }
}

#[test]
fn no_reset_clears_the_loss_of_the_host_and_a_time_of_0_watches_nothing() {
    let mut bench = Bench::new();
    bench.set((0x1016, 1), 0x007F_0064).send("77F#05").run_ms(150).reads(0x260E, 0x20);
    bench.set(0x6040, 0x80).set(0x2601, 0).set(0x2601, 1).set(0x260E, 0).reads(0x260E, 0x20);
    bench.set((0x1016, 1), 0x007F_0000);
    assert_eq!(bench.get(0x260E), 0, "no node is watched any more");
    bench.send("77F#05").run_ms(5000).reads(0x260E, 0);
    // Bits 24 to 31 are "invalid": node 7Fh is watched all the same.
    bench.set((0x1016, 1), 0xAB7F_0064).send("77F#05").run_ms(150).reads(0x260E, 0x20);
}

#[test]
fn a_receive_pdo_can_be_switched_off_and_moved_and_a_transmit_pdo_keeps_its_inhibit_time() {
    let mut bench = Bench::new();
    for cob_id in [0x8000_0301, 0x2AA] {
        bench.set((0x1401, 1), cob_id).forget().send("301#0000000000000000").hears(&[]);
    }
    bench.send("2AA#0000000000000000");
    assert!(bench.heard().iter().any(|frame| frame.starts_with("281#")));
    // 100 * 0.1 ms.
    bench.set((0x1801, 3), 100).run_ms(20);
    bench.forget();
    for _ in 0..4 {
        bench.send("2AA#0000000000000000");
    }
    bench.run_ms(50);
    let sent: Vec<f64> = bench
        .heard_at()
        .iter()
        .filter(|(_, frame)| frame.standard_data_id() == Some(0x281))
        .map(|(at, _)| at.as_secs_f64())
        .collect();
    assert_eq!(sent.len(), 2, "the first at once, one more for all that came in the time: {sent:?}");
    assert!(sent[1] - sent[0] >= 0.01, "{sent:?}");
}

#[test]
fn of_several_cached_positions_sync_takes_the_last() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x0F);
    for position in ["501#10270000", "501#E8030000"] {
        bench.send(position);
    }
    bench.send("080#").reaches(1000).is_at(1000, 30);
    bench.run_ms(500);
    bench.send("080#");
    assert_eq!(bench.statusword(), 0x0437, "it is used up");
}

#[test]
fn what_came_while_pdos_were_off_is_not_done_later() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x2F);
    for state in ["000#8001", "000#0201"] {
        bench.send(state).send("201#2F000150C30000").send("501#50C30000").send("080#").send("000#0101").send("080#");
        bench.run_ms(200);
        assert_eq!((bench.get(0x607A), bench.position().abs() < 5), (0, true), "{state}");
    }
}

#[test]
fn identifiers_that_cia_301_reserves_are_no_pdos() {
    let mut bench = Bench::new();
    for (index, id) in
        [(0x1400, 0x000), (0x1401, 0x601), (0x1402, 0x77F), (0x1800, 0x7E5), (0x1801, 0x581), (0x1802, 0x07F)]
    {
        let before = bench.get((index, 1));
        assert_eq!(bench.write((index, 1), id), Err(0x0609_0030), "{index:04X}h = {id:03X}h");
        bench.reads((index, 1), before);
    }
}

#[test]
fn a_device_address_is_in_the_identifiers_of_pdos_at_once_and_the_node_id_after_a_power_cycle() {
    // 5.08.2: "setting the device address via SDO sets this value as well".
    let mut bench = Bench::new();
    bench.set((0x1402, 1), 0x444);
    for address in [7, 5] {
        bench.set(0x2615, address).reads((0x1400, 1), 0x200 + address).reads((0x1800, 1), 0x180 + address);
        assert_eq!(bench.get((0x1402, 1)), 0x444, "one that was chosen stays");
    }
    bench.forget().send("201#0F0001E8030000").run_ms(5);
    assert!(bench.heard().iter().all(|frame| !frame.starts_with("181#")), "no node listens to 201h");
    bench.send("205#0F0001E8030000").run_ms(5);
    assert!(bench.heard().iter().any(|frame| frame.starts_with("185#")));
    bench.set(0x6040, 0).save().send("000#8101").run_ms(5).reads(0x2615, 5).forget().power_cycle();
    assert!(bench.heard().contains(&"705#00".to_string()), "the node-ID");
    bench.node = 5;
    bench.reads((0x1400, 1), 0x205).forget().send("305#0000000000000000");
    assert!(bench.heard().iter().any(|frame| frame.starts_with("285#")));
}

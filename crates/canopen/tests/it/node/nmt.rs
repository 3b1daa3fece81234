//! NMT states, boot-up, heartbeat, resets.

use canopen::{NmtState, NodeEvent, NodeProfile};

use crate::node::bench::Bench;
use crate::node::device::{STANDARD, TABLE};

#[test]
fn boot_up_is_the_first_frame_and_pre_operational_follows() {
    let mut bench = Bench::off(&STANDARD);
    bench.talk("> 604#4000100000000000\n > 000#0104\n silence 1000ms");
    assert_eq!(bench.node.state(), NmtState::Initialising);
    bench.boot();
    bench.talk("< 704#00");
    assert_eq!(bench.node.state(), NmtState::PreOperational);
    assert_eq!(bench.events(), [NodeEvent::Nmt(NmtState::PreOperational)]);
}

#[test]
fn commands_to_the_node_and_to_all_are_obeyed_and_others_not() {
    let mut bench = Bench::new(&STANDARD);
    for (command, state) in [
        ("000#0105", NmtState::PreOperational),
        ("000#0104", NmtState::Operational),
        ("000#8000", NmtState::PreOperational),
        ("000#0200", NmtState::Stopped),
        ("000#0100", NmtState::Operational),
        ("000#0204", NmtState::Stopped),
        ("000#8004", NmtState::PreOperational),
        ("000#0304", NmtState::PreOperational),
        ("000#01", NmtState::PreOperational),
        ("000#", NmtState::PreOperational),
        ("000#R2", NmtState::PreOperational),
        ("00000000#0104", NmtState::PreOperational),
    ] {
        bench.send(command);
        assert_eq!(bench.node.state(), state, "after {command}");
    }
}

#[test]
fn a_command_to_the_present_state_changes_nothing() {
    let mut bench = Bench::operational();
    bench.talk("> 000#0104\n silence 10ms");
    assert_eq!(bench.events(), []);
}

#[test]
fn heartbeats_come_at_exactly_their_period_and_carry_the_state() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2B171000E8030000
         < 584#6017100000000000
         < 704#7F
         1000ms < 704#7F
         > 000#0104
         < 184#0000
         2000ms < 704#05
         > 000#0204
         3000ms < 704#04
         silence 999.999ms
         4000ms < 704#04",
    );
}

#[test]
fn a_hundred_and_one_heartbeats_fit_into_ten_seconds_at_100_ms() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#2B17100064000000\n < 584#6017100000000000\n < 704#7F");
    bench.wait(std::time::Duration::from_secs(10));
    assert_eq!(bench.sent.len(), 100);
}

#[test]
fn a_new_heartbeat_time_counts_at_once_and_zero_ends_it() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2B171000E8030000
         < 584#6017100000000000
         < 704#7F
         wait 500ms
         > 604#2B17100064000000
         < 584#6017100000000000
         < 704#7F
         600ms < 704#7F
         700ms < 704#7F
         > 604#2B17100000000000
         < 584#6017100000000000
         silence 5000ms",
    );
}

#[test]
fn boot_up_counts_as_the_first_heartbeat() {
    let mut bench = Bench::off(&STANDARD);
    let slot = bench.slot(0x1017);
    bench.node.dictionary_mut().set_raw(slot, 250);
    bench.boot();
    bench.talk("< 704#00\n 250ms < 704#7F\n 500ms < 704#7F");
}

#[test]
fn a_late_runner_gets_one_heartbeat_not_many() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#2B17100064000000\n < 584#6017100000000000\n < 704#7F");
    bench.now = can::Instant::from_millis(1050);
    can::Station::handle_timeout(&mut bench.node, bench.now);
    bench.talk("1050ms < 704#7F\n 1100ms < 704#7F");
}

#[test]
fn the_owner_may_send_another_state_byte() {
    let mut bench = Bench::new(&STANDARD);
    bench.node.set_heartbeat_state(Some(0x04));
    bench.talk("> 604#2B17100064000000\n < 584#6017100000000000\n < 704#04");
    bench.node.set_heartbeat_state(None);
    bench.talk("100ms < 704#7F");
}

#[test]
fn reset_node_is_the_owners_to_carry_out() {
    let mut bench = Bench::operational();
    bench.talk("> 000#8104\n > 604#4000100000000000\n silence 1000ms");
    assert_eq!(bench.events(), [NodeEvent::ResetNode]);
    bench.boot();
    bench.talk("< 704#00\n > 604#4000100000000000\n < 584#4300100092010400");
}

#[test]
fn reset_communication_restores_communication_objects_only() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2B171000E8030000
         < 584#6017100000000000
         < 704#7F
         > 604#2B4060000F000000
         < 584#6040600000000000
         > 000#8204",
    );
    assert_eq!(bench.events().last(), Some(&NodeEvent::ResetCommunication));
    bench.node.reset_communication(bench.now);
    bench.talk("wait 3000ms\n < 704#00");
    assert_eq!((bench.value(0x1017), bench.value(0x6040)), (0, 0xF));
}

#[test]
fn stored_values_take_effect_when_the_owner_puts_them_back_before_boot() {
    let mut bench = Bench::new(&STANDARD);
    bench.send("000#8204");
    bench.node.restore_communication_defaults();
    let slot = bench.slot(0x1017);
    bench.node.dictionary_mut().set_raw(slot, 100);
    bench.boot();
    bench.talk("< 704#00\n 100ms < 704#7F");
}

#[test]
fn the_host_watch_sees_only_frames_that_bring_this_node_data() {
    let mut bench = Bench::new(&STANDARD);
    assert_eq!(bench.node.last_addressed(), None);
    for (ms, frame, counts) in [
        (1, "605#4000100000000000", false),
        (2, "604#4000100000000000", true),
        (3, "080#", false),
        (4, "000#0105", false),
        (5, "000#0104", false),
        (6, "204#0000", true),
        (7, "184#0000", false),
        (8, "000#0200", false),
    ] {
        bench.now = can::Instant::from_millis(ms);
        let before = bench.node.last_addressed();
        bench.send(frame);
        let expected = if counts { Some(bench.now) } else { before };
        assert_eq!(bench.node.last_addressed(), expected, "{frame}");
    }
}

static SELF_STARTING: NodeProfile = NodeProfile { start_state: NmtState::Operational, ..NodeProfile::cia_301(&TABLE) };

#[test]
fn a_self_starting_device_boots_up_before_its_first_tpdo() {
    let mut bench = Bench::off(&SELF_STARTING);
    bench.boot();
    bench.talk("< 704#00\n < 184#0000");
    assert_eq!(bench.node.state(), NmtState::Operational);
}

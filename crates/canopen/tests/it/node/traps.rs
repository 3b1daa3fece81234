//! Faults that were found in other stacks, one test each, and a few of the same kind.

use canopen::node::Via;
use canopen::{NmtState, NodeEvent};

use crate::node::bench::Bench;
use crate::node::device::STANDARD;

#[test]
fn a_client_abort_in_the_middle_of_an_upload_does_no_harm() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#4008100000000000
         < 584#4108100014000000
         > 604#6000000000000000
         < 584#0061206472697665
         > 604#8008100000000408
         silence 2000ms
         > 604#4000100000000000
         < 584#4300100092010400",
    );
}

#[test]
fn a_client_abort_of_a_block_upload_that_never_began_does_no_harm() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#A40810007F000000
         < 584#C608100014000000
         > 604#8008100000000008
         > 604#A300000000000000
         < 584#8000000001000405
         > 604#8008100000000408
         > 604#4000100000000000
         < 584#4300100092010400",
    );
}

#[test]
fn an_rpdo_received_in_pre_operational_is_not_applied_at_nmt_start() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 204#0F00\n > 000#0104\n < 184#0000\n > 080#\n silence 100ms");
    assert_eq!(bench.value(0x6040), 0);
    assert_eq!(bench.events(), [NodeEvent::Nmt(NmtState::Operational), NodeEvent::Sync]);
}

#[test]
fn a_short_rpdo_is_discarded_whole() {
    let mut bench = Bench::new(&STANDARD);
    // RPDO 1: controlword and target velocity.
    bench.talk(
        "> 604#2300140104020080
         < 584#6000140100000000
         > 604#2F00160000000000
         < 584#6000160000000000
         > 604#230016022000FF60
         < 584#6000160200000000
         > 604#2F00160002000000
         < 584#6000160000000000
         > 604#2300140104020000
         < 584#6000140100000000
         > 000#0104
         < 184#0000
         > 204#0F0064
         > 204#0F00640000
         > 204#",
    );
    assert_eq!((bench.value(0x6040), bench.value(0x60FF)), (0, 0));
    assert!(!bench.events().iter().any(|event| matches!(event, NodeEvent::Written { via: Via::Rpdo(_), .. })));
    bench.talk("> 204#0F0064000000");
    assert_eq!((bench.value(0x6040), bench.value(0x60FF)), (15, 100));
}

#[test]
fn every_n_syncs_does_not_mean_every_sync() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2F00180205000000
         < 584#6000180200000000
         > 000#0104
         > 080#
         > 080#
         > 080#
         > 080#
         silence 1ms
         > 080#
         < 184#0000
         > 080#
         silence 1ms",
    );
}

#[test]
fn an_nmt_reset_does_not_leave_the_node_silent() {
    for (command, event) in [
        ("000#8104", NodeEvent::ResetNode),
        ("000#8204", NodeEvent::ResetCommunication),
        ("000#8100", NodeEvent::ResetNode),
    ] {
        let mut bench = Bench::operational();
        bench.send(command);
        assert_eq!(bench.events(), [event]);
        bench.boot();
        bench.talk("< 704#00\n > 604#4000100000000000\n < 584#4300100092010400\n > 000#0104\n < 184#0000");
    }
}

#[test]
fn an_sdo_frame_without_data_does_no_harm() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#\n silence 1ms\n > 604#4000100000000000\n < 584#4300100092010400");
}

#[test]
fn nmt_commands_to_all_are_obeyed() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 000#0100\n < 184#0000\n > 000#8000\n > 000#0200");
    assert_eq!(bench.node.state(), NmtState::Stopped);
}

#[test]
fn a_missing_sub_index_is_not_a_missing_object() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk("> 604#4018100500000000\n < 584#8018100511000906\n > 604#4019100500000000\n < 584#8019100500000206");
}

#[test]
fn a_refused_mapping_leaves_the_old_one_in_force() {
    let mut bench = Bench::operational();
    bench.talk("> 604#2F00160002000000\n < 584#8000160000000106\n > 204#0F00");
    assert_eq!(bench.value(0x6040), 15);
}

#[test]
fn a_reset_overtakes_what_was_waiting_to_be_sent() {
    let mut bench = Bench::new(&STANDARD);
    let node = &mut bench.node;
    let now = can::Instant::ZERO;
    can::Station::handle_frame(node, &"604#4000100000000000".parse().unwrap(), now);
    can::Station::handle_frame(node, &"000#8104".parse().unwrap(), now);
    assert_eq!(can::Station::poll_transmit(node), None);
}

//! What RPDOs do, and when. RPDO 1 maps the controlword 6040h, RPDO 2 the target velocity 60FFh.

use canopen::node::Via;
use canopen::pdo::PdoNumber;
use canopen::{Mux, NmtState, NodeEvent};

use crate::node::bench::Bench;
use crate::node::device::STANDARD;

fn via(number: u16) -> Via {
    Via::Rpdo(PdoNumber::new(number).unwrap())
}

#[test]
fn an_asynchronous_rpdo_takes_effect_at_once_and_in_order() {
    let mut bench = Bench::operational();
    bench.talk("> 204#0600\n > 304#64000000\n > 204#0F00");
    let controlword = bench.slot(0x6040);
    let target = bench.slot(0x60FF);
    assert_eq!(
        bench.events(),
        [
            NodeEvent::Written { slot: controlword, raw: 6, via: via(1) },
            NodeEvent::Written { slot: target, raw: 100, via: via(2) },
            NodeEvent::Written { slot: controlword, raw: 15, via: via(1) },
        ]
    );
    assert_eq!((bench.value(0x6040), bench.value(0x60FF)), (15, 100));
}

#[test]
fn a_synchronous_rpdo_waits_for_sync_and_the_newest_counts() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2F01140201000000
         < 584#6001140200000000
         > 000#0104
         < 184#0000
         > 304#64000000
         > 304#C8000000",
    );
    assert_eq!(bench.value(0x60FF), 0);
    bench.events();
    bench.talk("> 080#");
    assert_eq!(bench.value(0x60FF), 200);
    let target = bench.slot(0x60FF);
    assert_eq!(bench.events(), [NodeEvent::Sync, NodeEvent::Written { slot: target, raw: 200, via: via(2) }]);
    bench.talk("> 080#");
    assert_eq!(bench.events(), [NodeEvent::Sync]);
}

#[test]
fn what_waits_for_sync_is_dropped_on_leaving_operational() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2F01140200000000
         < 584#6001140200000000
         > 000#0104
         < 184#0000
         > 304#64000000
         > 000#8004
         > 000#0104
         < 184#0000
         > 080#",
    );
    assert_eq!(bench.value(0x60FF), 0);
}

#[test]
fn a_value_that_may_not_be_written_is_not_stored_but_its_neighbours_are() {
    let mut bench = Bench::new(&STANDARD);
    // RPDO 3: modes of operation, controlword, target velocity.
    bench.talk(
        "> 604#2302140104040080
         < 584#6002140100000000
         > 604#2302160108006060
         < 584#6002160100000000
         > 604#2302160210004060
         < 584#6002160200000000
         > 604#230216032000FF60
         < 584#6002160300000000
         > 604#2F02160003000000
         < 584#6002160000000000
         > 604#2302140104040000
         < 584#6002140100000000
         > 000#0104
         < 184#0000
         > 404#060700E9030000
         > 404#030F0064000000",
    );
    let rpdo_writes: Vec<_> = bench
        .events()
        .into_iter()
        .filter_map(|event| match event {
            NodeEvent::Written { slot, raw, via } if via == self::via(3) => {
                Some((bench.node.table().row(slot).index, raw))
            }
            _ => None,
        })
        .collect();
    // Mode 6 is not listed and 1001 is above the limit.
    assert_eq!(rpdo_writes, [(0x6040, 7), (0x6060, 3), (0x6040, 15), (0x60FF, 100)]);
}

#[test]
fn bytes_beyond_the_mapping_are_ignored() {
    let mut bench = Bench::operational();
    bench.talk("> 204#0F00FFFFFFFFFFFF");
    assert_eq!(bench.value(0x6040), 15);
}

#[test]
fn an_rpdo_moves_to_the_identifier_that_is_written() {
    let mut bench = Bench::operational();
    bench.talk(
        "> 604#2300140104020080
         < 584#6000140100000000
         > 204#0600
         > 604#2300140100030000
         < 584#6000140100000000
         > 204#0700
         > 300#0F00",
    );
    assert_eq!(bench.value(0x6040), 15);
    assert_eq!(bench.events().len(), 3);
}

#[test]
fn two_rpdos_may_listen_to_one_identifier() {
    let mut bench = Bench::new(&STANDARD);
    bench.talk(
        "> 604#2301140104020080
         < 584#6001140100000000
         > 604#2301140104020000
         < 584#6001140100000000
         > 000#0104
         < 184#0000
         > 204#0F000000",
    );
    assert_eq!((bench.value(0x6040), bench.value(0x60FF)), (15, 15));
}

#[test]
fn extended_and_remote_frames_are_no_rpdos() {
    let mut bench = Bench::operational();
    bench.talk("> 00000204#0F00\n > 204#R2");
    assert_eq!(bench.value(0x6040), 0);
}

#[test]
fn a_written_mapping_is_what_the_next_frame_is_read_by() {
    let mut bench = Bench::operational();
    bench.talk(
        "> 604#2302140104040080
         < 584#6002140100000000
         > 604#2302160108000120
         < 584#6002160100000000
         > 604#2302160208000220
         < 584#6002160200000000
         > 604#2F02160002000000
         < 584#6002160000000000
         > 604#2302140104040000
         < 584#6002140100000000
         > 404#1122",
    );
    assert_eq!((bench.value(0x2001), bench.value(0x2002)), (0x11, 0x22));
    assert_eq!(bench.node.state(), NmtState::Operational);
    assert!(bench.node.table().find(Mux::new(0x1602, 5)).is_err());
}

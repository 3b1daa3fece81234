//! When a master sends a long value in blocks, what is reported of a node that has none, and that other nodes do not wait for it.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::{Mux, NodeId};
use master::core::{Command, Core, Event};

const NAME: Mux = Mux::new(0x1008, 0);
const TIMEOUT: Duration = Duration::from_millis(500);

fn node() -> NodeId {
    NodeId::new(4).unwrap()
}

/// SDO requests that it offers.
fn requests(core: &mut Core) -> Vec<String> {
    let sent = std::iter::from_fn(|| core.poll_transmit()).map(|frame| frame.to_string());
    sent.filter(|frame| frame.starts_with("604#")).collect()
}

#[test]
fn while_sync_is_produced_or_followed_no_block_stands_before_it() {
    let period = Some(Duration::from_millis(10));
    for (command, expected) in [
        (None, "604#C608100050000000"),
        (Some(Command::Sync(period)), "604#2108100050000000"),
        (Some(Command::FollowSync(period)), "604#2108100050000000"),
    ] {
        let mut core = Core::new();
        if let Some(command) = command {
            core.execute(command, Instant::ZERO);
        }
        core.download(node(), NAME, &[7; 80], TIMEOUT, Instant::ZERO);
        assert_eq!(requests(&mut core), [expected]);
    }
}

#[test]
fn a_node_without_block_transfer_is_reported_once_and_gets_its_value_in_segments() {
    let mut core = Core::new();
    let reply = |text: &str| text.parse::<Frame>().unwrap();
    core.download(node(), NAME, &[7; 80], TIMEOUT, Instant::ZERO);
    assert_eq!(requests(&mut core), ["604#C608100050000000"]);
    core.handle_frame(&reply("584#8008100001000405"), Instant::ZERO);
    assert_eq!(requests(&mut core), ["604#2108100050000000"]);
    let events: Vec<Event> = std::iter::from_fn(|| core.poll_event()).map(|(_, event)| event).collect();
    assert_eq!(events, [Event::NoBlockTransfer(node())]);
    // Twelve segments, whose toggle bit alternates.
    core.handle_frame(&reply("584#6008100000000000"), Instant::ZERO);
    for segment in 0..12 {
        assert_eq!(requests(&mut core).len(), 1);
        core.handle_frame(
            &reply(if segment % 2 == 0 { "584#2000000000000000" } else { "584#3000000000000000" }),
            Instant::ZERO,
        );
    }
    assert!(core.poll_finished().unwrap().outcome.is_ok());
    core.download(node(), NAME, &[7; 80], TIMEOUT, Instant::ZERO);
    assert_eq!(requests(&mut core), ["604#2108100050000000"], "it is not asked again");
    assert!(core.poll_event().is_none());
    core.handle_frame(&reply("584#8008100000000008"), Instant::ZERO);
    core.handle_frame(&reply("704#00"), Instant::ZERO);
    core.download(node(), NAME, &[7; 80], TIMEOUT, Instant::ZERO);
    assert_eq!(requests(&mut core), ["604#C608100050000000"], "it has booted: another device, or another firmware");
}

/// CiA 301, 7.2.4.3.9: the segments of a block wait for no answer. They take turns with what others are asked for.
#[test]
fn a_block_keeps_the_request_to_another_node_waiting_for_one_frame() {
    let mut core = Core::new();
    core.download(node(), NAME, &[7; 2000], TIMEOUT, Instant::ZERO);
    assert_eq!(requests(&mut core), ["604#C6081000D0070000"]);
    core.handle_frame(&"584#A40810007F000000".parse().unwrap(), Instant::ZERO);
    let first = core.poll_transmit().unwrap();
    assert_eq!(first.to_string(), "604#0107070707070707");
    // Two nodes, one with a smaller and one with a larger node-ID.
    for other in [2, 9] {
        core.upload(NodeId::new(other).unwrap(), NAME, TIMEOUT, Instant::ZERO);
    }
    let sent: Vec<String> =
        std::iter::from_fn(|| core.poll_transmit()).take(4).map(|frame| frame.to_string()).collect();
    let expected = ["609#4008100000000000", "602#4008100000000000", "604#0207070707070707", "604#0307070707070707"];
    assert_eq!(sent, expected);
    assert_eq!(requests(&mut core).len(), 127 - 3, "and then the rest of the block");
}

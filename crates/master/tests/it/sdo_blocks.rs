//! When a master sends a long value in blocks, and what is reported of a node that has none.

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
}

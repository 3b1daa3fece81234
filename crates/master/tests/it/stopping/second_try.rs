//! A stop that was not heard, and is sent again.

use std::task::Poll;
use std::time::Duration;

use devices::{HostWatch, model};
use master::drive::{MotionOptions, SwitchedOff};
use master::units::Rpm;
use sim::task::Task;
use sim::{Place, Stimulus};

use super::{Bench, NODES, PERIOD, models, options};
use crate::support::toy_drive::zlac8030l;
use crate::support::{Bus, node};

/// A connection that was gone for a moment, as a converter that is plugged in again: the first stop is not heard.
#[test]
fn a_drive_that_is_reached_again_is_stopped_by_a_second_try() {
    // Longer than until the last request of the first try, which ends 300 ms after the first.
    const GONE: Duration = Duration::from_millis(250);
    for name in models() {
        let mut bench = Bench::new(name);
        let [drive, _] = bench.drives.clone();
        bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
        bench.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        bench.moving = vec![NODES[0]];
        let cut = |bench: &mut Bench, cut| {
            bench.world.apply(Place::node(NODES[0]), &Stimulus::CableCut(cut)).unwrap().unwrap();
        };
        cut(&mut bench, true);
        let (began, network) = (bench.world.now(), bench.network.clone());
        let mut stopping = Task::new(Box::pin(async move { network.stop_and_release().await }));
        let mut is_cut = true;
        let stopped = loop {
            match stopping.poll_if_woken() {
                Some(Poll::Ready(stopped)) => break stopped,
                Some(_) => bench.world.refresh(),
                None if is_cut && bench.world.now() - began >= GONE => {
                    is_cut = false;
                    cut(&mut bench, false);
                }
                None => assert!(bench.world.step(), "{name}"),
            }
        };
        let [stopped] = &stopped[..] else { panic!("{name}: {stopped:?}") };
        let after = stopped.outcome.clone().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(after >= GONE, "{name}: {after:?}");
        assert!(after + PERIOD >= bench.world.now() - began, "{name}: {after:?} since the first try");
        // What it would have done without this program, for the report of a stop that was not seen.
        let watch = model(name).unwrap().host_watch;
        assert_eq!(stopped.loss.is_some(), watch != HostWatch::None, "{name}: {stopped:?}");
        assert!(bench.fastest() < 1.0 && bench.network.moved().is_empty(), "{name}");
    }
}

/// The record is read with the first request; a stop before that asks the default server, and waits for nothing.
#[test]
fn a_chosen_server_is_used_from_the_first_request_on_and_delays_no_stop() {
    let mut bus = Bus::new(vec![zlac8030l(4).u32(0x1201, 1, 0x680).u32(0x1201, 2, 0x690)]);
    let network = bus.network.clone();
    let drive = master::Drive::new(network.node(node(4)), model("zlac8030l").unwrap());
    network.choose_sdo_servers([(node(4), 0x1201)]);
    let models = [(node(4), model("zlac8030l").unwrap())].into();
    // For callers that may only stop drives; and with the NMT state of every node.
    let mut axes = bus.block_on(network.quick_stop_everything(&models));
    assert!(bus.frames().iter().all(|frame| !frame.starts_with("000#")), "no NMT command");
    axes.extend(bus.block_on(network.stop_everything(&models)));
    assert_eq!(bus.frames().iter().filter(|frame| frame.starts_with("000#")).collect::<Vec<_>>(), ["000#8000"]);
    assert!(axes.len() == 2 && axes.iter().all(|axis| axis.outcome.is_ok()), "{axes:?}");
    assert!(bus.frames().iter().all(|frame| !frame.starts_with("604#400112") && !frame.starts_with("680#")));

    // The choice lasts.
    let short = drive.node().clone().with_timeout(Duration::from_millis(20));
    // The toy answers at its default server only.
    bus.block_on(async { short.read::<u32>(canopen::Mux::new(0x1000, 0)).await }).unwrap_err();
    let frames = bus.frames();
    let asked: Vec<&str> =
        frames.iter().filter(|frame| frame[4..].starts_with("40")).map(|frame| &frame[..12]).collect();
    assert_eq!(asked[asked.len() - 3..], ["604#40011201", "604#40011202", "680#40001000"]);
    // Where the record is missing, the request is not sent by another server in secret.
    bus.block_on(async { drive.node().use_sdo_server(0x1200).await }).unwrap();
    network.choose_sdo_servers([(node(4), 0x1202)]);
    let refused = bus.block_on(async { drive.node().read::<u32>(canopen::Mux::new(0x1000, 0)).await }).unwrap_err();
    assert_eq!(refused.object(), Some(canopen::Mux::new(0x1202, 1)));
}

/// The toy has the record of a further server and does not answer there, as a device whose server another client has made invalid.
#[test]
fn a_drive_whose_further_server_is_gone_is_stopped_through_the_default_one() {
    let drive = zlac8030l(4).u32(0x1201, 1, 0x680).u32(0x1201, 2, 0x690);
    let mut bus = Bus::new(vec![drive]);
    let network = bus.network.clone();
    let drive = master::Drive::new(network.node(node(4)), model("zlac8030l").unwrap());
    let stopped = bus.block_on(async {
        drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() }).await.unwrap();
        drive.node().use_sdo_server(0x1201).await.unwrap();
        network.stop_all_moved().await
    });
    assert!(matches!(&stopped[..], [axis] if axis.outcome.is_ok()), "{stopped:?}");
    assert!(bus.frames().iter().any(|frame| frame.starts_with("680#2B406000")), "the first try");
    assert!(network.moved().is_empty());
}

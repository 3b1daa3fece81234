//! What a run has touched is put back: after it, and when it is given up at any point.

use std::time::Duration;

use can::{Bitrate, Tap};
use canopen::{Mux, NmtState};
use cia402::PowerState;
use conform::{Capture, Options, Subject, Suite};
use devices::Description;
use master::Network;
use sim::events::EventKind;
use sim::{World, block_on, block_on_for};

use crate::bench::{drive, node, values};
use crate::complete::complete;

/// A world with one node in a state that no case leaves by itself: values that are not stored, and operational.
fn configured(description: &'static Description) -> (World, Network, Capture) {
    let (network, capture) = (Network::new(), Capture::new());
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(5, drive(description)).unwrap();
    world.add_station(Tap::new(network.clone(), capture.clone()));
    world.run_for(Duration::from_secs(1));
    let device = network.node(node());
    block_on(&mut world, async {
        device.write(Mux::new(0x1017, 0), 333_u16).await.unwrap();
        device.write(Mux::new(0x1800, 1), 0x8000_0185_u32).await.unwrap();
        device.write(Mux::new(0x1800, 3), 70_u16).await.unwrap();
        device.write(Mux::new(0x1800, 1), 0x185_u32).await.unwrap();
        device.nmt(canopen::NmtCommand::Start);
        network.sleep(Duration::from_millis(500)).await;
    })
    .unwrap();
    (world, network, capture)
}

fn state(network: &Network) -> Option<NmtState> {
    network.facts(node()).nmt_state
}

#[test]
fn a_whole_run_leaves_values_and_nmt_state_as_they_were() {
    let (mut world, network, capture) = configured(complete());
    let before = values(&mut world, &network, complete());
    let subject = Subject::of_model(node(), complete());
    let options = Options { allow_store: true, ..Options::default() };
    let report =
        block_on(&mut world, Suite::new(network.clone(), capture, subject, options).run(|_| ())).unwrap().unwrap();
    assert_eq!(report.not_restored, [""; 0]);
    world.run_for(Duration::from_secs(1));
    assert_eq!(values(&mut world, &network, complete()), before);
    assert_eq!(state(&network), Some(NmtState::Operational));
    // The cases send requests as frames: their answers are not a second device's.
    assert_eq!(network.facts(node()).twins, None);
}

#[test]
fn a_run_that_is_given_up_at_any_point_is_put_back() {
    // Whenever that is: in a transfer, in a reset, stopped, with a mapping that is half changed.
    for tenths in (1..=400).step_by(13) {
        let (mut world, network, capture) = configured(complete());
        let before = values(&mut world, &network, complete());
        let subject = Subject::of_model(node(), complete());
        let suite = Suite::new(network.clone(), capture, subject, Options::default());
        let restorer = suite.restorer();
        let ended = block_on_for(&mut world, Duration::from_millis(100 * tenths + tenths * 7), suite.run(|_| ()));
        let left = block_on(&mut world, restorer.restore()).unwrap();
        assert_eq!(left, [""; 0], "given up after {tenths} tenths of a second");
        world.run_for(Duration::from_secs(1));
        assert_eq!(values(&mut world, &network, complete()), before, "given up after {tenths} tenths of a second");
        assert_eq!(state(&network), Some(NmtState::Operational), "given up after {tenths} tenths of a second");
        if ended.is_ok() {
            break;
        }
    }
}

#[test]
fn an_enabled_drive_is_not_touched() {
    let model = devices::model("cia402").unwrap();
    let (network, capture) = (Network::new(), Capture::new());
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(5, drive(model)).unwrap();
    world.add_station(Tap::new(network.clone(), capture.clone()));
    world.run_for(Duration::from_secs(1));
    let axis = master::Drive::new(network.node(node()), model);
    block_on(&mut world, axis.enable()).unwrap().unwrap();
    let suite = Suite::new(network, capture, Subject::of_model(node(), model), Options::default());
    let refused = block_on(&mut world, suite.run(|_| ())).unwrap().unwrap_err();
    assert_eq!(refused, conform::SuiteError::Enabled);
}

/// Without leave nothing turns and nothing is energised, whatever carries a controlword; and the run leaves what it found. The joint
/// is energised by itself from power-on on, and again after each reset (reading J005).
#[test]
fn no_motor_is_energised_without_leave() {
    for name in ["cia402", "zlac8030l", "zlim42c", "m4230e17b50"] {
        let model = devices::model(name).unwrap();
        let (network, capture) = (Network::new(), Capture::new());
        let mut world = World::new(Bitrate::K500, 1);
        world.add_drive(5, drive(model)).unwrap();
        world.add_station(Tap::new(network.clone(), capture.clone()));
        world.run_for(Duration::from_secs(1));
        let found = world.report(5).unwrap().state.unwrap();
        assert_eq!(is_energised(found), name == "m4230e17b50", "{name}: {found:?}");
        let before = (world.report(5).unwrap().position, values(&mut world, &network, model));
        world.watch(true);
        let suite = Suite::new(network.clone(), capture, Subject::of_model(node(), model), Options::default());
        block_on(&mut world, suite.run(|_| ())).unwrap().unwrap();
        while let Some(event) = world.poll_event() {
            match event.kind {
                EventKind::State { to, .. } => {
                    assert!(to == found || !is_energised(to), "{name}: {to:?} at {}", event.at);
                }
                EventKind::Missed(events) => panic!("{name}: {events} events were not seen"),
                _ => {}
            }
        }
        assert_eq!((world.report(5).unwrap().position, values(&mut world, &network, model)), before, "{name}");
    }
}

/// States in which there may be current in the motor: a ZLIM42-C has it from Switched on (5.3.2).
fn is_energised(state: PowerState) -> bool {
    use PowerState::{FaultReactionActive, OperationEnabled, QuickStopActive, SwitchedOn};
    matches!(state, SwitchedOn | OperationEnabled | QuickStopActive | FaultReactionActive)
}

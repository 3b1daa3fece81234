//! What a cyclic drive is sent before it has been heard: nothing that takes its power, and nothing that gives it any.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Frame, Instant, Station};
use cia402::{ModeOfOperation, PowerState};
use master::cyclic::{CyclicDrive, CyclicOptions, CyclicState, Demand, Refusal};
use master::units::Rpm;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{World, block_on};

const PERIOD: Duration = Duration::from_millis(4);
const PV: ModeOfOperation = ModeOfOperation::PROFILE_VELOCITY;
const IP: ModeOfOperation = ModeOfOperation::INTERPOLATED_POSITION;

/// Counts the RPDOs of all.
#[derive(Clone)]
struct RpdoCounter(Arc<Mutex<u32>>);

impl Station for RpdoCounter {
    fn handle_frame(&mut self, frame: &Frame, _: Instant) {
        let id = frame.standard_data_id().unwrap_or(0);
        // The predefined connection set (CiA 301, 7.3.5): 200h, 300h, 400h and 500h, and a node-ID.
        let is_rpdo = [0x200, 0x300, 0x400, 0x500].contains(&(id & !0x7F));
        *self.0.lock().unwrap() += u32::from(is_rpdo);
    }

    fn handle_timeout(&mut self, _: Instant) {}

    fn poll_transmit(&mut self) -> Option<Frame> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// One drive, mapped, opened and enabled by another master; SYNC is on.
struct Bench {
    world: World,
    drive: Drive,
    cyclic: CyclicDrive,
    rpdos: Arc<Mutex<u32>>,
}

impl Bench {
    fn new(name: &str, mode: ModeOfOperation) -> Self {
        let model = devices::model(name).unwrap();
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        let rpdos = Arc::new(Mutex::new(0));
        world.add_station(RpdoCounter(Arc::clone(&rpdos)));
        world.add_drive(1, order(model, &Order::new(model, node(1), Bitrate::K500)).unwrap()).unwrap();
        world.run_until(Instant::from_secs(2));
        let drive = Drive::new(network.node(node(1)), model);
        let opened = block_on(&mut world, async {
            drive.configure_cyclic(mode).await.unwrap();
            let cyclic = drive.cyclic(mode, CyclicOptions::default()).await.unwrap();
            network.sync(Some(PERIOD));
            drive.enable().await.unwrap();
            cyclic
        });
        Self { world, drive, cyclic: opened.unwrap(), rpdos }
    }

    fn step(&mut self, demand: Demand) -> CyclicState {
        let network = self.drive.node().network().clone();
        let cyclic = &mut self.cyclic;
        block_on(&mut self.world, async {
            network.next_sync().await.unwrap();
            network.exchange(|io| cyclic.step(io, demand))
        })
        .unwrap()
    }
}

#[test]
fn a_drive_that_is_enabled_and_stands_keeps_its_power_when_a_program_takes_it_over() {
    for (name, mode) in [("zlac8030l", PV), ("zlim42c", PV), ("m4230e17b50", IP)] {
        let mut bench = Bench::new(name, mode);
        let before = bench.world.report(1).unwrap().shaft_angle_rad;
        for cycle in 0..100 {
            let state = bench.step(Demand::Hold);
            let expected = state.statusword.and(Some(PowerState::OperationEnabled));
            assert_eq!(state.power, expected, "{name}, cycle {cycle}: {state}");
        }
        let state = bench.step(Demand::Hold);
        assert!(state.follows && state.refused.is_none(), "{name}: {state}");
        let after = bench.world.report(1).unwrap().shaft_angle_rad;
        assert!((after - before).abs() < 0.01, "{name}: {before} {after}");
    }
}

#[test]
fn nothing_is_sent_to_a_drive_that_is_not_heard_but_switching_off() {
    let mut bench = Bench::new("zlac8030l", PV);
    // Its TPDO does not come: it was made invalid.
    let write = bench.drive.node().write(mux(0x1800, 1), 0x8000_0181_u32);
    block_on(&mut bench.world, write).unwrap().unwrap();
    bench.world.run_for(Duration::from_secs(1));
    let before = *bench.rpdos.lock().unwrap();
    for _ in 0..50 {
        assert_eq!(bench.step(Demand::Velocity(Rpm(100.0))).refused, Some(Refusal::NotHeard));
    }
    assert_eq!(*bench.rpdos.lock().unwrap(), before);
    assert!(bench.world.report(1).unwrap().velocity_rpm.abs() < 2.0);
    for _ in 0..50 {
        bench.step(Demand::Off);
    }
    let word = block_on(&mut bench.world, bench.drive.statusword()).unwrap().unwrap();
    assert_ne!(word.state(), Some(PowerState::OperationEnabled));
}

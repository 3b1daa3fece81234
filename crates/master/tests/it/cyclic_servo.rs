//! The standard's own servo, moved cycle by cycle in every mode that takes a set-point a cycle (CiA 402-2, clauses 12, 14
//! to 16), at 1 ms, with the mapping that the master sets up.

use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Instant};
use canopen::NodeId;
use cia402::{ModeOfOperation, PowerState};
use devices::servo::CIA402;
use master::core::CycleLoss;
use master::cyclic::{CyclicDrive, CyclicError, CyclicOptions, CyclicState, Demand, Refusal};
use master::drive::HeldBy;
use master::drive::MotionOptions;
use master::units::{Amperes, Angle, Rpm, Turns};
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{World, block_on};

const SERVO: u8 = 5;
const PERIOD: Duration = Duration::from_millis(1);

const CSP: ModeOfOperation = ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION;
const CSV: ModeOfOperation = ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY;
const CST: ModeOfOperation = ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE;
const IP: ModeOfOperation = ModeOfOperation::INTERPOLATED_POSITION;

struct Bench {
    world: World,
    network: Network,
    drive: Drive,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::M1, 7);
        let network = Network::new();
        world.add_station(network.clone());
        let id = NodeId::new(SERVO).unwrap();
        world.add_drive(SERVO, order(&CIA402, &Order::new(&CIA402, id, Bitrate::M1)).unwrap()).unwrap();
        world.run_until(Instant::from_secs(1));
        let drive = Drive::new(network.node(node(SERVO)), &CIA402);
        Self { world, network, drive }
    }

    fn open(&mut self, mode: ModeOfOperation) -> CyclicDrive {
        let (drive, network) = (self.drive.clone(), self.network.clone());
        block_on(&mut self.world, async {
            drive.configure_cyclic(mode).await?;
            // The set-points come each millisecond (60C2h).
            drive.node().write(mux(0x60C2, 1), 1_u8).await?;
            drive.node().write(mux(0x60C2, 2), -3_i8).await?;
            let cyclic = drive.cyclic(mode, CyclicOptions::default()).await?;
            network.sync(Some(PERIOD));
            Ok::<_, CyclicError>(cyclic)
        })
        .unwrap()
        .unwrap()
    }

    fn run(&mut self, cyclic: &mut CyclicDrive, cycles: u32, demand: impl Fn(u32) -> Demand) -> CyclicState {
        let network = self.network.clone();
        block_on(&mut self.world, async {
            let mut state = None;
            for cycle in 0..cycles {
                network.next_sync().await.unwrap();
                state = Some(network.exchange(|io| cyclic.step(io, demand(cycle))));
            }
            state.unwrap()
        })
        .unwrap()
    }

    /// Enabled and holding.
    fn hold(&mut self, cyclic: &mut CyclicDrive) -> CyclicState {
        let state = self.run(cyclic, 500, |_| Demand::Hold);
        assert_eq!((state.power, state.follows, state.refused), (Some(PowerState::OperationEnabled), true, None));
        state
    }

    fn speed_rpm(&mut self) -> f64 {
        self.world.report(SERVO).unwrap().velocity_rpm
    }
}

/// A turn and back in a second: at most pi turns a second.
fn swing(cycle: u32) -> f64 {
    0.5 * (1.0 - (core::f64::consts::TAU * f64::from(cycle) * PERIOD.as_secs_f64()).cos())
}

#[test]
fn positions_of_each_cycle_are_followed_in_csp_and_ip() {
    for mode in [CSP, IP] {
        let mut bench = Bench::new();
        let mut cyclic = bench.open(mode);
        let Turns(from) = bench.hold(&mut cyclic).position.unwrap();
        for quarter in 1..=4 {
            let to = |cycle| Demand::Position(Angle::Turns(from + swing((quarter - 1) * 250 + cycle)));
            let state = bench.run(&mut cyclic, 250, to);
            assert_eq!(state.refused, None, "mode {mode}: {state}");
            let Turns(at) = state.position.unwrap();
            let wanted = from + swing(quarter * 250 - 1);
            // Half a dozen cycles at the highest speed: the way to the drive and back, and its following error.
            assert!((at - wanted).abs() < 3.2 * 6.0 * PERIOD.as_secs_f64(), "mode {mode}: {at} of {wanted}");
        }
    }
}

#[test]
fn speeds_and_currents_of_each_cycle_are_followed_in_csv_and_cst() {
    let mut bench = Bench::new();
    let mut cyclic = bench.open(CSV);
    bench.hold(&mut cyclic);
    for rpm in [300.0, -300.0] {
        // A ramp of the program's own: 600 r/min/s.
        let state = bench.run(&mut cyclic, 1500, |cycle| {
            let share = (f64::from(cycle) / 1000.0).min(1.0);
            Demand::Velocity(Rpm(if rpm > 0.0 { rpm * share } else { 300.0 - 600.0 * share }))
        });
        assert_eq!(state.refused, None, "{state}");
        assert!((bench.speed_rpm() - rpm).abs() < 6.0, "{} of {rpm}", bench.speed_rpm());
        assert!((state.velocity.unwrap().0 - rpm).abs() < 10.0, "{state}");
    }
    let mut bench = Bench::new();
    let mut cyclic = bench.open(CST);
    bench.hold(&mut cyclic);
    // The loops of the current need some cycles; some more, and the motor without a load turns at its highest speed.
    let state = bench.run(&mut cyclic, 12, |_| Demand::Current(Amperes(0.5)));
    assert_eq!(state.refused, None, "{state}");
    // 6071h is a share of the rated torque, and the motor's rated torque results from a tenth less than its rated
    // current.
    let Amperes(current) = state.current.unwrap();
    assert!((0.4..0.52).contains(&current), "{state} {:?}", bench.world.report(SERVO));
    assert!(bench.speed_rpm() > 60.0, "{}", bench.speed_rpm());
}

#[test]
fn an_acceleration_of_zero_is_reported_and_not_waited_for() {
    let mut bench = Bench::new();
    let began = bench.world.now();
    let error = block_on(&mut bench.world, async {
        // Without torque it never turns, whatever its ramps.
        bench.drive.node().write(mux(0x6072, 0), 0_u16).await?;
        bench.drive.node().write(mux(0x6083, 0), 0_u32).await?;
        bench.drive.velocity(Rpm(60.0), MotionOptions::default()).await
    });
    let error = error.unwrap().unwrap_err().to_string();
    assert!(error.contains("6083h:00 is 0") && error.contains("to 6083h:00"), "{error}");
    let waited = (bench.world.now() - began).as_secs_f64();
    assert!(waited < 10.0, "{waited} s");
}

#[test]
fn a_step_beyond_607fh_is_refused() {
    let mut bench = Bench::new();
    block_on(&mut bench.world, async {
        // Two turns a second in position units.
        let counts = bench.drive.counts_per_turn().await?;
        bench.drive.node().write(mux(0x607F, 0), (2.0 * counts) as u32).await
    })
    .unwrap()
    .unwrap();
    let mut cyclic = bench.open(CSP);
    let Turns(from) = bench.hold(&mut cyclic).position.unwrap();
    let to = |turns: f64| Demand::Position(Angle::Turns(from + turns));
    let state = bench.run(&mut cyclic, 10, |_| to(0.01));
    let Some(Refusal::StepTooLarge { bound, .. }) = state.refused else { panic!("{state}") };
    assert_eq!(bound.by.and_then(HeldBy::setting).map(|setting| setting.object), Some(mux(0x607F, 0)), "{bound}");
    // A hundredth of a turn at two turns a second takes 5 ms.
    let state = bench.run(&mut cyclic, 6, |cycle| to(0.01 * f64::from(cycle + 1) / 6.0));
    assert_eq!(state.refused, None, "{state}");
}

#[test]
fn a_program_that_hangs_stops_the_servo_in_every_mode() {
    for (mode, demand) in [(CSV, Demand::Velocity(Rpm(120.0))), (CST, Demand::Current(Amperes(0.5)))] {
        let mut bench = Bench::new();
        let mut cyclic = bench.open(mode);
        bench.hold(&mut cyclic);
        bench.run(&mut cyclic, 300, |_| demand);
        assert!(bench.speed_rpm() > 60.0, "mode {mode}: {}", bench.speed_rpm());
        bench.world.run_for(Duration::from_secs(2));
        assert!(bench.speed_rpm().abs() < 1.0, "mode {mode}: {}", bench.speed_rpm());
        let state = bench.run(&mut cyclic, 5, |_| demand);
        assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::ProgramLate(3))), "mode {mode}");
    }
}

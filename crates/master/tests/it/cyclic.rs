//! Drives that are moved cycle by cycle: the servo and the stepper of ZLTECH by speed, the servo by current, the joint by
//! interpolated positions, on one virtual bus. What stops them when the program, the drive or SYNC stays away.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Frame, Instant, Station};
use canopen::NmtCommand;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use cia402::{ModeOfOperation, PowerState};
use devices::model;
use drives::mjoint::Model;
use master::core::{CycleLoss, Event, PdoMap};
use master::cyclic::{CyclicDrive, CyclicError, CyclicOptions, CyclicState, Demand, Refusal};
use master::drive::{HostLoss, MotionOptions};
use master::pdo::{PdoConfig, TimerUnits, TransmissionType};
use master::units::{Amperes, Angle, Rpm, Turns};
use master::{Drive, Error, Network, NoCycle};
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{StationId, World, block_on};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const SERVO: u8 = 4;

const PERIOD: Duration = Duration::from_millis(4);

const PV: ModeOfOperation = ModeOfOperation::PROFILE_VELOCITY;
const TQ: ModeOfOperation = ModeOfOperation::PROFILE_TORQUE;
const IP: ModeOfOperation = ModeOfOperation::INTERPOLATED_POSITION;

/// A master's process, which can be killed, and counts the SDO requests that it sends.
#[derive(Clone)]
struct Process {
    network: Network,
    seen: Arc<Mutex<Seen>>,
}

#[derive(Default)]
struct Seen {
    killed: bool,
    sdo_requests: u32,
}

impl Station for Process {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if !self.seen.lock().unwrap().killed {
            self.network.handle_frame(frame, now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if !self.seen.lock().unwrap().killed {
            self.network.handle_timeout(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let mut seen = self.seen.lock().unwrap();
        let frame = if seen.killed { None } else { self.network.poll_transmit() }?;
        let id = frame.standard_data_id().unwrap_or(0);
        seen.sdo_requests += u32::from((0x601..=0x67F).contains(&id));
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if self.seen.lock().unwrap().killed { None } else { self.network.poll_timeout() }
    }
}

struct Bench {
    world: World,
    network: Network,
    seen: Arc<Mutex<Seen>>,
    _process: StationId,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        let seen = Arc::new(Mutex::new(Seen::default()));
        let process = world.add_station(Process { network: network.clone(), seen: Arc::clone(&seen) });
        let joint = Model::named("m4230e17b50").unwrap();
        world.add_drive(JOINT, Box::new(mjoint(joint, JOINT, Bitrate::K500))).unwrap();
        world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, 1))).unwrap();
        world.add_drive(SERVO, Box::new(zlac8030l(SERVO, 1))).unwrap();
        world.run_until(Instant::from_secs(2));
        Self { world, network, seen, _process: process }
    }

    fn drive(&self, id: u8) -> Drive {
        let name = match id {
            JOINT => "m4230e17b50",
            STEPPER => "zlim42c",
            _ => "zlac8030l",
        };
        Drive::new(self.network.node(node(id)), model(name).unwrap())
    }

    /// Mapped, opened, and SYNC on.
    fn open(&mut self, id: u8, mode: ModeOfOperation) -> (Drive, CyclicDrive) {
        let drive = self.drive(id);
        let cyclic = block_on(&mut self.world, async {
            drive.configure_cyclic(mode).await?;
            let cyclic = drive.cyclic(mode, CyclicOptions::default()).await?;
            drive.node().network().sync(Some(PERIOD));
            Ok::<_, CyclicError>(cyclic)
        });
        (drive, cyclic.unwrap().unwrap())
    }

    /// Steps the drive in so many cycles with what each is to bring; the last state.
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

    fn speed_rpm(&mut self, id: u8) -> f64 {
        self.world.report(id).unwrap().velocity_rpm
    }

    /// Mean of a tenth of a second: the rotor of a stepper swings about its speed.
    fn mean_speed_rpm(&mut self, id: u8, cyclic: &mut CyclicDrive, demand: Demand) -> f64 {
        let cycles = 25;
        let sum: f64 = (0..cycles)
            .map(|_| {
                self.run(cyclic, 1, |_| demand);
                self.speed_rpm(id)
            })
            .sum();
        sum / f64::from(cycles)
    }

    fn sdo_requests(&self) -> u32 {
        self.seen.lock().unwrap().sdo_requests
    }

    /// How often the guard of the servo may have asked it since: four times in each 1000 ms of its 2000h.
    fn guard_requests(&self, since: Instant) -> u32 {
        ((self.world.now() - since).as_millis() / 250) as u32 + 1
    }
}

#[test]
fn both_zltech_drives_turn_at_speeds_that_come_each_cycle_without_an_sdo() {
    for id in [SERVO, STEPPER] {
        let mut bench = Bench::new();
        let (_, mut cyclic) = bench.open(id, PV);
        let (before, since) = (bench.sdo_requests(), bench.world.now());
        let state = bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
        assert_eq!((state.power, state.follows, state.refused), (Some(PowerState::OperationEnabled), true, None));
        let speed = bench.mean_speed_rpm(id, &mut cyclic, Demand::Velocity(Rpm(60.0)));
        assert!((speed - 60.0).abs() < 1.5, "{speed}");
        assert!((state.velocity.unwrap().0 - 60.0).abs() < 3.0, "{state}");
        // The drive's own ramp from one speed to the next.
        bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(-30.0)));
        let speed = bench.mean_speed_rpm(id, &mut cyclic, Demand::Velocity(Rpm(-30.0)));
        assert!((speed + 30.0).abs() < 1.5, "{speed}");
        let state = bench.run(&mut cyclic, 400, |_| Demand::Off);
        assert_ne!(state.power, Some(PowerState::OperationEnabled));
        assert!(bench.speed_rpm(id).abs() < 1.0);
        let guard = if id == SERVO { bench.guard_requests(since) } else { 0 };
        assert!(bench.sdo_requests() - before <= guard, "node {id}: {}", bench.sdo_requests() - before);
    }
}

#[test]
fn the_servo_pushes_with_the_current_of_each_cycle() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, TQ);
    let (before, since) = (bench.sdo_requests(), bench.world.now());
    // The drive's torque slope is 0.3 A a second as delivered (6087h): 0.4 A after 1.4 s, and its speed is still low.
    let state = bench.run(&mut cyclic, 375, |_| Demand::Current(Amperes(0.4)));
    assert!(state.follows, "{state}");
    let report = bench.world.report(SERVO).unwrap();
    assert!((report.current_demand_a.unwrap() - 0.4).abs() < 0.01 && report.velocity_rpm > 1.0, "{report:?}");
    // 6077h has 0.1 A in one count.
    assert!((state.current.unwrap().0 - report.current_a).abs() <= 0.15, "{state}");
    let state = bench.run(&mut cyclic, 2, |_| Demand::Velocity(Rpm(1.0)));
    assert_eq!(state.refused, Some(Refusal::WrongKind));
    assert!(bench.sdo_requests() - before <= bench.guard_requests(since));
}

/// A swing from where it is and back: the cosine of the demo's path.
fn swing(cycle: u32, turns: f64, period_s: f64) -> f64 {
    let time_s = f64::from(cycle) * PERIOD.as_secs_f64();
    turns / 2.0 * (1.0 - (core::f64::consts::TAU * time_s / period_s).cos())
}

#[test]
fn the_joint_follows_a_path_of_positions() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(JOINT, IP);
    let state = bench.run(&mut cyclic, 50, |_| Demand::Hold);
    assert!(state.follows && state.refused.is_none(), "{state}");
    let before = bench.sdo_requests();
    let Turns(from) = state.position.unwrap();
    let to = |cycle| Demand::Position(Angle::Turns(from + swing(cycle, 2.0, 2.0)));
    for half in [250, 500] {
        let state = bench.run(&mut cyclic, 250, |cycle| to(half - 250 + cycle));
        let Turns(at) = state.position.unwrap();
        let wanted = from + swing(half - 1, 2.0, 2.0);
        // Two cycles at the path's highest speed, 6.28 turns/s: from the set-point to the TPDO that shows it.
        assert!((at - wanted).abs() < 6.3 * 3.0 * PERIOD.as_secs_f64(), "{at} of {wanted}");
    }
    assert_eq!(bench.sdo_requests(), before);
}

#[test]
fn a_step_beyond_the_highest_speed_is_refused_and_the_drive_stays() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(JOINT, IP);
    let state = bench.run(&mut cyclic, 50, |_| Demand::Hold);
    let Turns(from) = state.position.unwrap();
    let state = bench.run(&mut cyclic, 100, |_| Demand::Position(Angle::Turns(from + 10.0)));
    let Some(Refusal::StepTooLarge { way, longest, bound }) = state.refused else { panic!("{state}") };
    // 60FFh of the joint's table, in r/min; 32768 counts a turn.
    let rpm = bound.high as f64;
    assert_eq!((way, bound.object), (327_680, mux(0x60FF, 0)));
    assert_eq!(longest, (rpm / 60.0 * 32_768.0 * PERIOD.as_secs_f64()) as i64 + 1);
    let Turns(at) = state.position.unwrap();
    assert!(state.follows && (at - from).abs() < 0.01, "{state}");
    // A step within it is taken.
    let state = bench.run(&mut cyclic, 20, |_| Demand::Position(Angle::Turns(from + 0.01)));
    assert_eq!(state.refused, None);
}

#[test]
fn what_the_limits_do_not_allow_is_refused_as_by_the_intents() {
    let mut bench = Bench::new();
    let (drive, mut cyclic) = bench.open(SERVO, PV);
    let state = bench.run(&mut cyclic, 100, |_| Demand::Velocity(Rpm(30.0)));
    assert!(state.follows);
    // 60FFh takes 1000 r/min (quick start guide, chapter 9).
    let state = bench.run(&mut cyclic, 200, |_| Demand::Velocity(Rpm(1500.0)));
    let Some(refusal @ Refusal::OutOfLimits { asked: 1500, .. }) = state.refused else { panic!("{state}") };
    let by_cycle = block_on(&mut bench.world, drive.explain_refusal(refusal)).unwrap().unwrap();
    bench.run(&mut cyclic, 200, |_| Demand::Off);
    let by_intent = block_on(&mut bench.world, drive.velocity(Rpm(1500.0), Default::default())).unwrap().unwrap_err();
    assert_eq!(by_cycle.to_string(), by_intent.to_string());
}

#[test]
fn a_demand_that_is_refused_holds_the_drive_until_it_is_one_that_can_be_followed() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
    assert!(bench.speed_rpm(SERVO) > 55.0);
    for refused in [Demand::Velocity(Rpm(1500.0)), Demand::Velocity(Rpm(f64::NAN)), Demand::Current(Amperes(1.0))] {
        let state = bench.run(&mut cyclic, 400, |_| refused);
        assert!(state.refused.is_some() && state.follows, "{refused:?}: {state}");
        assert!(bench.speed_rpm(SERVO).abs() < 1.0, "{refused:?}: {}", bench.speed_rpm(SERVO));
        let state = bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
        assert!(state.refused.is_none() && bench.speed_rpm(SERVO) > 55.0, "{refused:?}: {state}");
    }
    let (_, mut cyclic) = bench.open(SERVO, TQ);
    bench.run(&mut cyclic, 375, |_| Demand::Current(Amperes(0.4)));
    let state = bench.run(&mut cyclic, 400, |_| Demand::Current(Amperes(1e6)));
    assert!(matches!(state.refused, Some(Refusal::OutOfLimits { .. })), "{state}");
    assert!(bench.world.report(SERVO).unwrap().current_demand_a.unwrap().abs() < 0.01);
}

#[test]
fn a_drive_whose_rpdo_got_another_mapping_is_stopped_by_sdo() {
    let mut bench = Bench::new();
    let (drive, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
    let pdo = PdoId { direction: Direction::Rpdo, number: PdoNumber::FIRST };
    let other = PdoConfig::new(pdo, PdoMap(vec![MappingRecord::from_raw(0x6040_0010)]));
    let units = TimerUnits { inhibit: Duration::from_micros(500), event: Duration::from_micros(500) };
    block_on(&mut bench.world, drive.node().configure_pdo(&other, units)).unwrap().unwrap();
    let state = bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
    assert!(state.refused.is_some() && !state.follows, "{state}");
    assert!(bench.speed_rpm(SERVO).abs() < 1.0, "{}", bench.speed_rpm(SERVO));
    // It was stopped while it was set up anew; switched off, it is its mapping that keeps it from moving.
    bench.run(&mut cyclic, 100, |_| Demand::Off);
    let state = bench.run(&mut cyclic, 100, |_| Demand::Velocity(Rpm(60.0)));
    assert_eq!((state.refused, state.follows), (Some(Refusal::Remapped), false));
}

/// The servo's TPDO1 with the statusword alone, sent as this says.
fn open_with_tpdo(bench: &mut Bench, send: impl Fn(PdoConfig) -> PdoConfig) -> CyclicDrive {
    let drive = bench.drive(SERVO);
    let pdo = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };
    let config = send(PdoConfig::new(pdo, PdoMap(vec![MappingRecord::from_raw(0x6041_0010)])));
    let units = TimerUnits { inhibit: Duration::from_micros(500), event: Duration::from_micros(500) };
    block_on(&mut bench.world, async {
        drive.configure_cyclic(PV).await?;
        drive.node().configure_pdo(&config, units).await?;
        let cyclic = drive.cyclic(PV, CyclicOptions::default()).await?;
        drive.node().network().sync(Some(PERIOD));
        Ok::<_, CyclicError>(cyclic)
    })
    .unwrap()
    .unwrap()
}

#[test]
fn a_tpdo_that_comes_more_slowly_than_sync_is_waited_for_by_its_own_time() {
    let ms = Duration::from_millis;
    type Send = fn(PdoConfig) -> PdoConfig;
    // Each comes every 40 ms, which is 10 cycles.
    let slow: [(&str, Send); 3] = [
        ("event timer", |pdo| pdo.transmission(TransmissionType::EVENT_PROFILE).event_time(Duration::from_millis(40))),
        ("inhibit time", |pdo| {
            let pdo = pdo.transmission(TransmissionType::EVENT_PROFILE).inhibit_time(Duration::from_millis(40));
            pdo.event_time(Duration::from_millis(4))
        }),
        ("tenth SYNC", |pdo| pdo.transmission(TransmissionType(10))),
    ];
    for (name, send) in slow {
        let mut bench = Bench::new();
        let mut cyclic = open_with_tpdo(&mut bench, send);
        let state = bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
        assert!(state.refused.is_none() && state.follows, "{name}: {state}");
        assert!(bench.speed_rpm(SERVO) > 55.0, "{name}: {}", bench.speed_rpm(SERVO));
        // It is missed for two cycles beyond that and no longer.
        block_on(&mut bench.world, bench.network.node(node(SERVO)).write(mux(0x1800, 1), 0x8000_0184_u32))
            .unwrap()
            .unwrap();
        let state = bench.run(&mut cyclic, 14, |_| Demand::Velocity(Rpm(60.0)));
        assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::Silent(12))), "{name}: {state}");
        // The program is given no more time for it.
        let mut bench = Bench::new();
        let mut cyclic = open_with_tpdo(&mut bench, send);
        bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(60.0)));
        bench.world.run_for(ms(100));
        let state = bench.run(&mut cyclic, 1, |_| Demand::Velocity(Rpm(60.0)));
        assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::ProgramLate(3))), "{name}: {state}");
    }
}

#[test]
fn a_tpdo_that_only_an_event_sends_is_no_sign_of_life() {
    // The event timer is for types 254 and 255 (CiA 301, 7.5.2.37): with type 0 a change is what sends it.
    let mut bench = Bench::new();
    let drive = bench.drive(SERVO);
    let pdo = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };
    let config = PdoConfig::new(pdo, PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]));
    let config = config.transmission(TransmissionType::SYNC_ACYCLIC).event_time(Duration::from_millis(4));
    let units = TimerUnits { inhibit: Duration::from_micros(500), event: Duration::from_micros(500) };
    let error = block_on(&mut bench.world, async {
        drive.configure_cyclic(PV).await?;
        drive.node().configure_pdo(&config, units).await?;
        drive.cyclic(PV, CyclicOptions::default()).await
    });
    let error = error.unwrap().unwrap_err();
    assert!(matches!(error, CyclicError::OnEventsOnly { .. }), "{error}");
}

#[test]
fn a_program_that_gives_no_set_points_any_more_stops_its_drive() {
    for (id, mode) in [(SERVO, PV), (STEPPER, PV)] {
        let mut bench = Bench::new();
        let (_, mut cyclic) = bench.open(id, mode);
        bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
        assert!(bench.speed_rpm(id) > 90.0);
        // The program hangs; its runner does not, and SYNC goes on.
        bench.world.run_for(Duration::from_secs(1));
        assert!(bench.speed_rpm(id).abs() < 2.0, "node {id}: {}", bench.speed_rpm(id));
        let events: Vec<_> = std::iter::from_fn(|| bench.network.poll_event()).map(|(_, event)| event).collect();
        assert!(events.contains(&Event::CyclicStopped(node(id), CycleLoss::ProgramLate(3))), "{events:?}");
        // It comes back, gets the reason, and moves nothing until it has switched the drive off.
        let state = bench.run(&mut cyclic, 100, |_| Demand::Velocity(Rpm(100.0)));
        assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::ProgramLate(3))));
        assert!(bench.speed_rpm(id).abs() < 2.0);
        bench.run(&mut cyclic, 100, |_| Demand::Off);
        let state = bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
        assert!(state.follows && bench.speed_rpm(id) > 90.0, "{state}");
    }
}

#[test]
fn a_joint_whose_program_hangs_comes_to_rest_and_gives_the_reason() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(JOINT, IP);
    let Turns(from) = bench.run(&mut cyclic, 50, |_| Demand::Hold).position.unwrap();
    bench.run(&mut cyclic, 125, |cycle| Demand::Position(Angle::Turns(from + swing(cycle, 2.0, 2.0))));
    assert!(bench.speed_rpm(JOINT) > 100.0);
    bench.world.run_for(Duration::from_secs(1));
    assert!(bench.speed_rpm(JOINT).abs() < 1.0);
    let state = bench.run(&mut cyclic, 10, |_| Demand::Hold);
    assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::ProgramLate(3))));
}

#[test]
fn a_drive_that_falls_silent_is_reported_and_stopped() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
    // Its TPDO stays away, and it hears: the TPDO was made invalid.
    block_on(&mut bench.world, bench.network.node(node(SERVO)).write(mux(0x1800, 1), 0x8000_0184_u32))
        .unwrap()
        .unwrap();
    bench.run(&mut cyclic, 5, |_| Demand::Velocity(Rpm(100.0)));
    let state = bench.run(&mut cyclic, 200, |_| Demand::Velocity(Rpm(100.0)));
    assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::Silent(3))), "{state}");
    assert_eq!(state.statusword, None);
    assert!(bench.speed_rpm(SERVO).abs() < 2.0);
}

#[test]
fn the_loss_of_another_nodes_sync_stops_the_drive() {
    let mut bench = Bench::new();
    let producer = Network::new();
    bench.world.add_station(producer.clone());
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.network.sync(None);
    producer.sync(Some(PERIOD));
    bench.network.follow_sync(Some(PERIOD));
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
    assert!(bench.speed_rpm(SERVO) > 90.0);
    producer.sync(None);
    let network = bench.network.clone();
    let lost = block_on(&mut bench.world, async {
        loop {
            if let Err(lost) = network.next_sync().await {
                return lost;
            }
            network.exchange(|io| cyclic.step(io, Demand::Velocity(Rpm(100.0))));
        }
    });
    assert_eq!(lost.unwrap(), NoCycle::Lost { period: PERIOD });
    bench.world.run_for(Duration::from_secs(1));
    assert!(bench.speed_rpm(SERVO).abs() < 2.0);
}

#[test]
fn a_drive_that_moves_is_stopped_when_its_own_program_ends_sync() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
    bench.network.sync(None);
    bench.world.refresh();
    bench.world.run_for(Duration::from_secs(1));
    assert!(bench.speed_rpm(SERVO).abs() < 2.0, "{}", bench.speed_rpm(SERVO));
}

#[test]
fn a_drive_stops_when_the_whole_program_dies() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
    assert!(bench.speed_rpm(SERVO) > 90.0);
    bench.seen.lock().unwrap().killed = true;
    bench.world.run_for(cyclic.host_loss().stops_after().unwrap() + Duration::from_secs(1));
    assert!(bench.speed_rpm(SERVO).abs() < 2.0);
}

#[test]
fn what_nothing_stops_when_the_program_dies_is_reported_before_it_moves() {
    // The ZLIM42-C has no watch over its host.
    let mut bench = Bench::new();
    let (_, cyclic) = bench.open(STEPPER, PV);
    assert_eq!(cyclic.host_loss(), HostLoss::GoesOn);
    let events: Vec<_> = std::iter::from_fn(|| bench.network.poll_event()).map(|(_, event)| event).collect();
    assert!(events.contains(&Event::Unguarded(node(STEPPER), HostLoss::GoesOn)), "{events:?}");
    // One that must be left alone is not armed.
    let drive = bench.drive(JOINT);
    let options = CyclicOptions { guard: None, ..CyclicOptions::default() };
    let cyclic = block_on(&mut bench.world, drive.cyclic(IP, options)).unwrap().unwrap();
    assert_eq!((cyclic.host_loss().stops_after(), bench.network.guarded(node(JOINT))), (None, None));
    let events = std::iter::from_fn(|| bench.network.poll_event());
    assert!(events.last().is_some_and(|(_, event)| matches!(event, Event::Unguarded(id, _) if id == node(JOINT))));
}

#[test]
fn a_joint_keeps_its_heartbeats_while_it_is_moved_cycle_by_cycle() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(JOINT, IP);
    let Turns(from) = bench.run(&mut cyclic, 50, |_| Demand::Hold).position.unwrap();
    // Longer than the 2 s after which it would stop without heartbeats (5.11.2).
    let state = bench.run(&mut cyclic, 1000, |cycle| Demand::Position(Angle::Turns(from + swing(cycle, 2.0, 2.0))));
    assert!(state.follows && state.refused.is_none(), "{state}");
    bench.seen.lock().unwrap().killed = true;
    bench.world.run_for(Duration::from_secs(4));
    assert_eq!(bench.world.report(JOINT).unwrap().error_code, 0x20);
}

#[test]
fn stopping_all_that_was_moved_is_not_undone_by_the_next_step() {
    let mut bench = Bench::new();
    let (_, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 400, |_| Demand::Velocity(Rpm(100.0)));
    assert!(bench.network.moved().contains(node(SERVO)));
    bench.network.quick_stop_moved();
    let state = bench.run(&mut cyclic, 200, |_| Demand::Velocity(Rpm(100.0)));
    assert_eq!(state.refused, Some(Refusal::Stopped(CycleLoss::StopAll)));
    assert!(bench.speed_rpm(SERVO).abs() < 2.0);
}

#[test]
fn a_fault_is_latched_explained_and_reset() {
    let mut bench = Bench::new();
    let (drive, mut cyclic) = bench.open(SERVO, PV);
    bench.run(&mut cyclic, 200, |_| Demand::Velocity(Rpm(60.0)));
    // Below the supply that it works with.
    bench.world.with_drive(SERVO, |drive, now| drive.set_supply(14.0, now)).unwrap().unwrap();
    let state = bench.run(&mut cyclic, 100, |_| Demand::Velocity(Rpm(60.0)));
    let Some(refusal @ Refusal::Fault(_)) = state.refused else { panic!("{state}") };
    let error = block_on(&mut bench.world, drive.explain_refusal(refusal)).unwrap().unwrap();
    assert!(matches!(error, Error::NotReached(_)), "{error}");
    let by_intent = block_on(&mut bench.world, drive.enable()).unwrap().unwrap_err().to_string();
    let cause = |text: &str| text.split("Seen:").next().unwrap().split('.').nth(1).map(str::to_owned);
    assert_eq!(cause(&error.to_string()), cause(&by_intent));
    bench.world.with_drive(SERVO, |drive, now| drive.set_supply(48.0, now)).unwrap().unwrap();
    bench.run(&mut cyclic, 100, |_| Demand::Off);
    let state = bench.run(&mut cyclic, 100, |_| Demand::ResetFault);
    assert_eq!(state.power, Some(PowerState::SwitchOnDisabled), "{state}");
    let state = bench.run(&mut cyclic, 200, |_| Demand::Velocity(Rpm(60.0)));
    assert!(state.follows, "{state}");
}

#[test]
fn what_is_not_mapped_or_not_a_mode_of_set_points_is_reported_before_anything_moves() {
    let mut bench = Bench::new();
    let (servo, joint) = (bench.drive(SERVO), bench.drive(JOINT));
    let options = CyclicOptions::default();
    // As delivered the servo maps the controlword and no target.
    let error = block_on(&mut bench.world, servo.cyclic(PV, options)).unwrap().unwrap_err();
    assert!(matches!(error, CyclicError::NotMapped(_)), "{error}");
    assert!(error.to_string().contains("60FFh:00 of node 4 is in no RPDO"), "{error}");
    let error = block_on(&mut bench.world, servo.cyclic(ModeOfOperation::PROFILE_POSITION, options));
    assert!(matches!(error.unwrap().unwrap_err(), CyclicError::NoSetPoint { .. }));
    let error = block_on(&mut bench.world, joint.cyclic(TQ, options)).unwrap().unwrap_err();
    assert!(matches!(error, CyclicError::Drive(Error::NoSuchMode { .. })), "{error}");
}

/// A motion of each kind, watched to its end; where the shaft is, and how often the drive was asked by SDO meanwhile.
fn intents(bench: &mut Bench) -> (Vec<i64>, u32) {
    let drive = bench.drive(SERVO);
    let before = bench.sdo_requests();
    let options = MotionOptions { speed: Some(Rpm(60.0)), ..MotionOptions::default() };
    let mut places = Vec::new();
    block_on(&mut bench.world, async {
        drive.move_absolute(Turns(1.0), options).await?;
        places.push(drive.state().await?.position.unwrap().0);
        drive.velocity(Rpm(60.0), MotionOptions::default()).await?;
        drive.supervise(Duration::from_secs(2)).await?;
        drive.stop().await?;
        drive.move_absolute(Turns(0.0), options).await?;
        places.push(drive.state().await?.position.unwrap().0);
        drive.disable().await
    })
    .unwrap()
    .unwrap();
    (places, bench.sdo_requests() - before)
}

#[test]
fn intents_read_what_is_mapped_from_the_process_data_and_do_the_same() {
    let mut by_sdo = Bench::new();
    let (places, asked) = intents(&mut by_sdo);
    let mut by_pdo = Bench::new();
    let drive = by_pdo.drive(SERVO);
    block_on(&mut by_pdo.world, async {
        drive.configure_cyclic(PV).await?;
        let pdo = PdoId { direction: Direction::Tpdo, number: PdoNumber::new(2).unwrap() };
        let position = PdoConfig::new(pdo, PdoMap(vec![MappingRecord::from_raw(0x6064_0020)]));
        let units = TimerUnits { inhibit: Duration::from_micros(500), event: Duration::from_micros(500) };
        drive.node().configure_pdo(&position.transmission(TransmissionType::EVERY_SYNC), units).await?;
        Ok::<_, CyclicError>(())
    })
    .unwrap()
    .unwrap();
    by_pdo.network.nmt_all(NmtCommand::Start);
    by_pdo.network.sync(Some(PERIOD));
    let (places_by_pdo, asked_by_pdo) = intents(&mut by_pdo);
    for ((at, wanted), at_by_pdo) in places.iter().zip([4096_i64, 0]).zip(&places_by_pdo) {
        assert!((at - wanted).abs() <= 41 && (at_by_pdo - wanted).abs() <= 41, "{at} and {at_by_pdo} of {wanted}");
    }
    // 2 s are supervised, and about 4 s watched, with a look each 10 ms: two questions a look become one each 100 ms.
    assert!(asked > 1000 && asked_by_pdo * 5 < asked, "{asked} before, {asked_by_pdo} with process data");
}

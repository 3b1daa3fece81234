//! An inverter that turns in velocity mode (vl) alone: the master's speeds are those of 6042h, its ramps those of 6048h and 6049h
//! (CiA 402-2, velocity mode).

use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use devices::Quantity;
use master::drive::MotionOptions;
use master::units::{Ramp, Rpm, Turns};
use master::{Drive, Error, Network};
use sim::machine::{Order, order};
use sim::{World, block_on};

use crate::support::{INVERTER, mux, node};

const INVERTER_ID: u8 = 5;
const RUN: i64 = 0x7F;

struct Bench {
    world: World,
    drive: Drive,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::M1, 7);
        let network = Network::new();
        world.add_station(network.clone());
        let id = NodeId::new(INVERTER_ID).unwrap();
        world.add_drive(INVERTER_ID, order(*INVERTER, &Order::new(*INVERTER, id, Bitrate::M1)).unwrap()).unwrap();
        world.run_until(Instant::from_secs(1));
        Self { world, drive: Drive::new(network.node(node(INVERTER_ID)), *INVERTER) }
    }

    fn run<T>(&mut self, what: impl AsyncFnOnce(&Drive) -> T) -> T {
        let drive = self.drive.clone();
        block_on(&mut self.world, async move { what(&drive).await }).unwrap()
    }

    fn number(&mut self, index: u16, sub_index: u8) -> i64 {
        let object = Quantity::new(index, sub_index, 1.0);
        self.run(async |drive| drive.read_quantity(object).await).unwrap() as i64
    }

    fn rpm(&mut self) -> f64 {
        self.world.report(INVERTER_ID).unwrap().velocity_rpm
    }
}

/// 300 r/min in 1 s, and back in 0.5 s.
fn options() -> MotionOptions {
    MotionOptions {
        acceleration: Some(Ramp::Time(Duration::from_secs(1))),
        deceleration: Some(Ramp::RpmPerSecond(600.0)),
        ..MotionOptions::default()
    }
}

#[test]
fn a_speed_is_turned_at_by_the_objects_of_velocity_mode_and_the_stop_takes_its_ramp() {
    let mut bench = Bench::new();
    let report = bench.run(async |drive| drive.velocity(Rpm(300.0), options()).await).unwrap();
    // 95 % of 300 r/min at 300 (r/min)/s, and 5 % of tolerance.
    let reached = report.reached_after.unwrap().as_secs_f64();
    assert!((0.9..1.1).contains(&reached), "{reached}");
    assert!((bench.rpm() - 300.0).abs() < 20.0, "{}", bench.rpm());
    let shown = [(0x6061, 0), (0x6042, 0), (0x6048, 1), (0x6048, 2), (0x6049, 1), (0x6049, 2), (0x6040, 0)];
    assert_eq!(shown.map(|(index, sub_index)| bench.number(index, sub_index)), [2, 300, 300, 1, 600, 1, RUN]);
    bench.run(async |drive| drive.supervise(Duration::from_secs(1)).await).unwrap();
    assert!((bench.rpm() - 300.0).abs() < 5.0, "{}", bench.rpm());
    let began = bench.world.now();
    bench.run(async |drive| drive.stop().await).unwrap();
    let took = (bench.world.now() - began).as_secs_f64();
    assert!((0.45..0.75).contains(&took) && bench.rpm().abs() < 1.0, "{took} s, {} r/min", bench.rpm());
    // And on again, the other way: the ramp's bits are back.
    bench.run(async |drive| drive.velocity(Rpm(-300.0), options()).await).unwrap();
    assert_eq!((bench.number(0x6042, 0), bench.number(0x6040, 0)), (-300, RUN));
    assert!((bench.rpm() + 300.0).abs() < 20.0, "{}", bench.rpm());
}

#[test]
fn a_stop_stands_although_the_drive_has_a_least_speed() {
    let mut bench = Bench::new();
    bench.run(async |drive| drive.node().write(mux(0x6046, 1), 100_u32).await).unwrap();
    bench.run(async |drive| drive.velocity(Rpm(300.0), options()).await).unwrap();
    bench.run(async |drive| drive.stop().await).unwrap();
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
}

/// CiA 402-2, vl velocity min max amount: a target below the least is raised to it, of either sign; one of 0 stands still.
#[test]
fn a_speed_that_the_drive_would_raise_is_refused_before_anything_moves() {
    let mut bench = Bench::new();
    bench.run(async |drive| drive.node().write(mux(0x6046, 1), 100_u32).await).unwrap();
    for slow in [50.0, -99.0] {
        let error = bench.run(async |drive| drive.velocity(Rpm(slow), options()).await).unwrap_err();
        let Error::OutOfLimits { limits, .. } = &error else { panic!("{error}") };
        assert_eq!(limits.raised_to.map(|(least, setting)| (least, setting.object)), Some((100, mux(0x6046, 1))));
        assert!(error.to_string().contains("smaller values (except 0) act as 100, by 6046h:01"), "{error}");
        assert_eq!((bench.number(0x6042, 0), bench.rpm().abs() < 1.0), (0, true));
    }
    bench.run(async |drive| drive.velocity(Rpm(100.0), options()).await).unwrap();
    assert!((bench.rpm() - 100.0).abs() < 10.0, "{}", bench.rpm());
    // The drive does as the standard says with what it is written all the same.
    bench.run(async |drive| drive.node().write(mux(0x6042, 0), 50_i16).await).unwrap();
    bench.run(async |drive| drive.supervise(Duration::from_millis(200)).await.or(Ok::<(), Error>(()))).unwrap();
    assert!((bench.rpm() - 100.0).abs() < 5.0, "{}", bench.rpm());
}

#[test]
fn factors_of_the_drive_scale_the_target_and_limits_refuse_it_before_anything_moves() {
    let mut bench = Bench::new();
    // A tenth of r/min in the target; the actual value and the amounts stay in r/min.
    bench.run(async |drive| drive.node().write(mux(0x604B, 2), 10_i16).await).unwrap();
    bench.run(async |drive| drive.node().write(mux(0x6046, 2), 500_u32).await).unwrap();
    bench.run(async |drive| drive.velocity(Rpm(300.0), options()).await).unwrap();
    assert_eq!(bench.number(0x6042, 0), 3000);
    bench.run(async |drive| drive.supervise(Duration::from_secs(1)).await).unwrap();
    assert!((bench.rpm() - 300.0).abs() < 5.0, "{}", bench.rpm());
    let error = bench.run(async |drive| drive.velocity(Rpm(600.0), options()).await).unwrap_err();
    let Error::OutOfLimits { asked, limits, .. } = &error else { panic!("{error}") };
    assert_eq!(
        (*asked, limits.held_to.map(|(most, by)| (most, by.setting().unwrap().value))),
        (6000, Some((5000, 500)))
    );
    assert_eq!(bench.number(0x6042, 0), 3000, "{error}");
}

#[test]
fn a_ramp_is_given_a_time_where_the_drive_has_none() {
    let mut bench = Bench::new();
    bench.run(async |drive| drive.node().write(mux(0x6048, 2), 0_u16).await).unwrap();
    let report = bench.run(async |drive| drive.velocity(Rpm(300.0), options()).await).unwrap();
    assert_eq!((bench.number(0x6048, 1), bench.number(0x6048, 2)), (300, 1));
    assert!(report.reached_after.unwrap() > Duration::from_millis(900));
}

#[test]
fn what_it_has_no_mode_for_is_refused() {
    let mut bench = Bench::new();
    let moved = bench.run(async |drive| drive.move_relative(Turns(1.0), MotionOptions::default()).await);
    assert!(matches!(moved, Err(Error::NoSuchMode { .. } | Error::NoSuchQuantity { .. })), "{moved:?}");
}

//! A base on two hub motors in virtual time, held to where the simulated body truly is.

use std::f64::consts::{FRAC_PI_2, PI};
use std::time::Duration;

use crate::support::node;
use can::{Bitrate, Instant};
use canopen::Mux;
use cia402::ModeOfOperation;
use master::base::{Base, BaseError, BaseLimits, Geometry, Pose, StopCause, Twist, WheelSetup};
use master::cyclic::{CyclicOptions, NotAtRest, Refusal};
use master::drive::MotionOptions;
use master::units::Rpm;
use master::{Drive, Error, Network};
use plant::coupled::DifferentialDriveModel;
use sim::coupling::{BodyKind, CoupledShaft, Coupling};
use sim::machine::{Order, order};
use sim::stimulus::BusFault;
use sim::{Place, Stimulus, World, block_on};

const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const PERIOD: Duration = Duration::from_millis(10);
const GEOMETRY: Geometry = Geometry { wheel_base_m: 0.4, wheel_radius_m: 0.084 };
const LIMITS: BaseLimits = BaseLimits {
    linear_m_s: 0.8,
    angular_rad_s: 2.0,
    wheel_m_s: 0.8,
    wheel_m_s2: 0.8,
    watchdog: Duration::from_millis(200),
    lag_m: 0.2,
};

struct Bench {
    world: World,
    wheels: [WheelSetup; 2],
}

impl Bench {
    /// Two wheels that nothing joins.
    fn apart() -> Self {
        Self::with(|_| {})
    }

    fn with(join: impl FnOnce(&mut World)) -> Self {
        let mut world = World::new(Bitrate::K500, 7);
        let network = Network::new();
        world.add_station(network.clone());
        let model = devices::model("zlac8030l").unwrap();
        let wheels = [(LEFT, 1.0), (RIGHT, -1.0)].map(|(number, turns)| {
            let id = node(number);
            world.add_drive(number, order(model, &Order::new(model, id, Bitrate::K500)).unwrap()).unwrap();
            let drive = Drive::new(network.node(id), model);
            WheelSetup { drive, mode: ModeOfOperation::PROFILE_VELOCITY, turns }
        });
        join(&mut world);
        world.run_until(Instant::from_secs(1));
        Self { world, wheels }
    }

    /// The wheels of a body on the ground.
    fn new() -> Self {
        Self::with(|world| {
            let body = DifferentialDriveModel {
                mass_kg: 40.0,
                yaw_inertia_kg_m2: 1.5,
                wheel_base_m: GEOMETRY.wheel_base_m,
                wheel_radius_m: GEOMETRY.wheel_radius_m,
                rolling: 0.015,
                grip: None,
                weight_share: 0.7,
                slope_rad: 0.0,
                uphill_rad: 0.0,
            };
            let shafts = [CoupledShaft::direct(Place::node(LEFT)), CoupledShaft::reversed(Place::node(RIGHT))];
            world.couple("base", &Coupling::DifferentialDrive(body), &shafts).unwrap();
        })
    }

    fn try_open(&mut self, limits: BaseLimits) -> Result<Base, BaseError> {
        let [left, right] = &self.wheels;
        let open = Base::open([left, right], GEOMETRY, limits, PERIOD, CyclicOptions::default());
        block_on(&mut self.world, open).unwrap()
    }

    fn open(&mut self) -> Base {
        let mut base = self.try_open(LIMITS).unwrap();
        block_on(&mut self.world, base.enable()).unwrap().unwrap();
        base
    }

    /// Drives with this twist, given again in each cycle.
    fn drive(&mut self, base: &mut Base, linear_m_s: f64, angular_rad_s: f64, time_s: f64) {
        for _ in 0..(time_s / PERIOD.as_secs_f64()).round() as u32 {
            base.command(Twist { linear_m_s, angular_rad_s }).unwrap();
            self.cycle(base);
        }
    }

    fn cycle(&mut self, base: &mut Base) {
        block_on(&mut self.world, base.cycle()).unwrap().unwrap();
    }

    fn stand(&mut self, base: &mut Base) {
        block_on(&mut self.world, base.stop()).unwrap().unwrap();
        for _ in 0..100 {
            self.cycle(base);
        }
    }

    /// Where the body truly is, and its speed.
    fn truth(&mut self) -> (Pose, f64) {
        match self.world.body("base").unwrap().kind {
            BodyKind::DifferentialDrive { x_m, y_m, heading_deg, speed_m_s, .. } => {
                (Pose { x_m, y_m, heading_rad: heading_deg.to_radians() }, speed_m_s)
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn odometry_is_where_the_body_is() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    // Straight on, a spin, a circle to the right, backwards.
    for (linear, angular, time_s) in [(0.5, 0.0, 2.0), (0.0, 1.0, 2.0), (0.4, -0.8, 3.0), (-0.3, 0.1, 2.0)] {
        bench.drive(&mut base, linear, angular, time_s);
    }
    bench.stand(&mut base);
    let (truth, _) = bench.truth();
    let counted = base.state().pose;
    let off = (truth.x_m - counted.x_m).hypot(truth.y_m - counted.y_m);
    // A count is 0.13 mm on the ground; a path of some metres, without slip.
    assert!(off < 0.002, "{off} m: {truth:?} {counted:?}");
    assert!((truth.heading_rad - counted.heading_rad).abs() < 0.002, "{truth:?} {counted:?}");
    assert!(truth.x_m.hypot(truth.y_m) > 0.5, "{truth:?}");
}

#[test]
fn a_twist_is_what_the_body_does() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    // A ramp of 0.8 m/s^2 to 0.4 m/s and back: the way is v t, of which the ramps give the halves.
    bench.drive(&mut base, 0.4, 0.0, 3.0);
    let (_, speed) = bench.truth();
    // Whole r/min: 8.8 mm/s.
    assert!((speed - 0.4).abs() < 0.006, "{speed}");
    bench.stand(&mut base);
    let (straight, _) = bench.truth();
    assert!((straight.x_m - 1.2).abs() < 0.02 && straight.y_m.abs() < 0.01, "{straight:?}");
    bench.drive(&mut base, 0.0, 1.0, FRAC_PI_2);
    bench.stand(&mut base);
    let (turned, _) = bench.truth();
    assert!((turned.heading_rad - straight.heading_rad - FRAC_PI_2).abs() < 0.05, "{turned:?}");
}

#[test]
fn too_much_is_driven_more_slowly_on_the_same_circle() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    // A radius of 1 m; twice as fast as the wheels may.
    bench.drive(&mut base, 1.6, 1.6, 3.0);
    let commanded = base.state().commanded;
    assert!((commanded.linear_m_s / commanded.angular_rad_s - 1.0).abs() < 1e-9, "{commanded:?}");
    let outer = commanded.linear_m_s + 0.5 * GEOMETRY.wheel_base_m * commanded.angular_rad_s;
    assert!((outer - LIMITS.wheel_m_s).abs() < 1e-9, "{outer}");
    bench.stand(&mut base);
    // The centre of the circle is a metre to the left of the start.
    let (truth, _) = bench.truth();
    assert!((truth.x_m.hypot(truth.y_m - 1.0) - 1.0).abs() < 0.03, "{truth:?}");
    assert!(truth.heading_rad > 0.5 * PI, "{truth:?}");
}

#[test]
fn without_a_new_twist_it_stops_and_reports_it() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    // The watchdog's 0.2 s, and the ramp's 0.5 s.
    for _ in 0..100 {
        bench.cycle(&mut base);
    }
    let (_, speed) = bench.truth();
    assert!(speed.abs() < 0.005, "{speed}");
    let cause = base.state().cause.unwrap();
    assert_eq!(cause.to_string(), "the base was stopped: no new twist came for 200 ms");
    // The next one is followed again.
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    assert!(bench.truth().1 > 0.38);
}

#[test]
fn a_wheel_that_goes_stops_the_other() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    bench.world.cut_power(RIGHT).unwrap();
    for _ in 0..200 {
        // A program that does not look goes on to give its twist.
        let _ = base.command(Twist { linear_m_s: 0.4, angular_rad_s: 0.0 });
        bench.cycle(&mut base);
    }
    let cause = base.state().cause;
    assert!(matches!(cause, Some(StopCause::Wheel { refusal: Refusal::Stopped(_), .. })), "{cause:?}");
    assert!(matches!(base.command(Twist::default()), Err(BaseError::Stopped(_))));
    // The left wheel has no power or no speed; the right one has none to hold.
    assert!(bench.world.report(LEFT).unwrap().velocity_rpm.abs() < 2.0);
}

#[test]
fn a_wheel_that_is_not_heard_for_a_while_ends_the_motion_with_a_cause() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    let silent = |on| Stimulus::Bus(BusFault::Silent(on));
    bench.world.apply(Place::node(RIGHT), &silent(true)).unwrap().unwrap();
    let twist = Twist { linear_m_s: 0.4, angular_rad_s: 0.0 };
    // The limit of the cyclic drives is three cycles: this is an interruption, not an end.
    for cycle in 0..8 {
        let _ = base.command(twist);
        bench.cycle(&mut base);
        let state = base.state();
        assert!(state.follows || state.cause.is_some(), "cycle {cycle}: {state:?}");
    }
    bench.world.apply(Place::node(RIGHT), &silent(false)).unwrap().unwrap();
    // It comes back, and the program goes on to give its twist.
    for _ in 0..200 {
        let _ = base.command(twist);
        bench.cycle(&mut base);
    }
    let cause = base.state().cause;
    assert!(matches!(cause, Some(StopCause::Wheel { node, .. }) if node.raw() == RIGHT), "{cause:?}");
    assert!(bench.truth().1.abs() < 0.01, "it drives on unasked: {} m/s", bench.truth().1);
    // A stop does not say that all is well; enabled again, it drives.
    let stopped = block_on(&mut bench.world, base.stop()).unwrap();
    assert!(matches!(stopped, Err(BaseError::Stopped(StopCause::Wheel { .. }))), "{stopped:?}");
    block_on(&mut bench.world, base.enable()).unwrap().unwrap();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    assert!(bench.truth().1 > 0.38);
}

/// At 0.4 m/s a blocked wheel is 0.2 m behind after half a second; the drive's own overload takes several (2015h).
#[test]
fn a_blocked_wheel_stops_both_before_the_base_has_turned_about_it() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    bench.world.apply(Place::node(RIGHT), &Stimulus::RotorLock(true)).unwrap().unwrap();
    let mut cycles = 0;
    while base.state().cause.is_none() {
        base.command(Twist { linear_m_s: 0.4, angular_rad_s: 0.0 }).unwrap();
        bench.cycle(&mut base);
        cycles += 1;
    }
    let cause = base.state().cause.unwrap();
    assert!(matches!(cause, StopCause::Lag { node, limit_m: 0.2, .. } if node.raw() == RIGHT), "{cause}");
    let waited = cycles as f64 * PERIOD.as_secs_f64();
    assert!((0.35..0.6).contains(&waited), "{waited} s");
    let stopped = block_on(&mut bench.world, base.stop()).unwrap();
    assert!(matches!(stopped, Err(BaseError::Stopped(StopCause::Lag { .. }))), "{stopped:?}");
    for _ in 0..30 {
        bench.cycle(&mut base);
    }
    assert!(bench.world.report(LEFT).unwrap().velocity_rpm.abs() < 1.0);
    assert!(matches!(base.command(Twist::default()), Err(BaseError::Stopped(_))), "until it is enabled anew");
}

/// Its other wheel is pulled by more than its motor holds: that it still turns is not all that is said.
#[test]
fn a_base_that_was_stopped_and_does_not_come_to_rest_names_both_reasons() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.4, 0.0, 2.0);
    bench.world.apply(Place::node(RIGHT), &Stimulus::RotorLock(true)).unwrap().unwrap();
    while base.state().cause.is_none() {
        base.command(Twist { linear_m_s: 0.4, angular_rad_s: 0.0 }).unwrap();
        bench.cycle(&mut base);
    }
    bench.world.apply(Place::node(LEFT), &Stimulus::LoadTorque(-60.0)).unwrap().unwrap();
    let stopped = block_on(&mut bench.world, base.stop()).unwrap().unwrap_err();
    let BaseError::NotStopped { cause, why } = &stopped else { panic!("{stopped:?}") };
    let StopCause::Lag { node, .. } = **cause else { panic!("{stopped:?}") };
    assert_eq!((node.raw(), why.node().raw()), (RIGHT, LEFT), "{stopped}");
    assert!(stopped.to_string().contains("lags") && stopped.to_string().contains("still turns at"), "{stopped}");
}

#[test]
fn a_wheel_that_is_lost_while_the_base_stops_is_reported() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.8, 0.0, 2.0);
    bench.world.cut_power(LEFT).unwrap();
    let stopped = block_on(&mut bench.world, base.stop()).unwrap();
    assert!(
        matches!(stopped, Err(BaseError::Stopped(StopCause::Wheel { node, .. })) if node.raw() == LEFT),
        "{stopped:?}"
    );
}

/// A set-point of 0 is not yet standstill: wheels follow it some time later.
#[test]
fn a_stop_ends_when_both_wheels_stand_and_not_when_that_was_commanded() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    for twist in [(0.8, 0.0), (0.0, 1.0)] {
        bench.drive(&mut base, twist.0, twist.1, 2.0);
        block_on(&mut bench.world, base.stop()).unwrap().unwrap();
        for wheel in [LEFT, RIGHT] {
            let speed = bench.world.report(wheel).unwrap().velocity_rpm;
            assert!(speed.abs() < 2.0, "wheel {wheel} turns at {speed} r/min");
        }
    }
}

#[test]
fn closing_a_base_with_a_wheel_behind_a_cut_cable_is_an_error() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    bench.drive(&mut base, 0.8, 0.0, 2.0);
    bench.world.apply(Place::node(LEFT), &"cable cut".parse().unwrap()).unwrap().unwrap();
    while base.state().cause.is_none() {
        let _ = base.command(Twist { linear_m_s: 0.8, angular_rad_s: 0.0 });
        bench.cycle(&mut base);
    }
    let closed = block_on(&mut bench.world, base.close()).unwrap();
    assert!(bench.world.report(RIGHT).unwrap().velocity_rpm.abs() < 2.0, "the wheel in reach stands");
    // Its watch over its host (2000h) acts a second after the last frame: whether it has by then is not seen.
    assert!(matches!(&closed, Err(error) if error.to_string().contains("node 1")), "{closed:?}");
}

#[test]
fn closing_a_base_with_a_wheel_that_its_load_turns_without_power_is_an_error() {
    let mut bench = Bench::apart();
    let mut base = bench.open();
    bench.drive(&mut base, 0.3, 0.0, 1.0);
    // The motor holds against it, and nothing does without its power.
    let load = "load torque 16".parse::<Stimulus>().unwrap();
    bench.world.apply(Place::node(LEFT), &load).unwrap().unwrap();
    bench.drive(&mut base, 0.0, 0.0, 1.0);
    let closed = block_on(&mut bench.world, base.close()).unwrap();
    let rpm = bench.world.report(LEFT).unwrap().velocity_rpm;
    assert!(rpm.abs() > 50.0, "the load turns it, at {rpm} r/min");
    assert!(closed.is_err_and(|error| error.to_string().contains("node 1")), "said to be closed at {rpm} r/min");
}

#[test]
fn bad_input_is_refused() {
    let mut bench = Bench::new();
    let mut base = bench.open();
    for bad in [f64::NAN, f64::INFINITY] {
        let error = base.command(Twist { linear_m_s: bad, angular_rad_s: 0.0 }).unwrap_err();
        assert!(error.to_string().contains("both have to be finite numbers"), "{error}");
    }
    assert!(matches!(bench.try_open(LIMITS), Err(BaseError::Taken { .. })));
    let wheel = bench.wheels[0].drive.clone();
    let beside = block_on(&mut bench.world, wheel.velocity(Rpm(60.0), MotionOptions::default())).unwrap();
    assert!(matches!(beside, Err(Error::InCycles { .. })), "{beside:?}");
    drop(base);
    let zero = bench.try_open(BaseLimits { wheel_m_s2: 0.0, ..LIMITS }).unwrap_err();
    assert_eq!(zero.to_string(), "the limit wheel_m_s2 is 0: state a finite number above 0");
    let fast = bench.try_open(BaseLimits { wheel_m_s: 50.0, ..LIMITS }).unwrap_err();
    assert!(matches!(fast, BaseError::BeyondDrive { .. }), "{fast}");
    bench.open();
}

#[test]
fn a_wheel_that_its_load_drives_was_not_brought_to_rest() {
    let mut bench = Bench::apart();
    // 5 A at most (2015h, in 0.1 A), 3.8 N·m: its load is stronger, and it goes on.
    let right = bench.wheels[1].drive.node().clone();
    block_on(&mut bench.world, right.write(Mux::new(0x2015, 0), 50_u16)).unwrap().unwrap();
    let mut base = bench.open();
    bench.drive(&mut base, 0.2, 0.0, 0.5);
    bench.world.apply(Place::node(RIGHT), &Stimulus::LoadTorque(4.5)).unwrap().unwrap();
    let stopped = block_on(&mut bench.world, base.stop()).unwrap();
    // On the way to rest it runs ahead of its command, which stops the base for good.
    let Err(BaseError::NotStopped { cause, why }) = &stopped else { panic!("{stopped:?}") };
    assert!(matches!(**cause, StopCause::Lag { .. }), "{cause}");
    let NotAtRest::StillTurns { node: turning, rpm, .. } = why else { panic!("{why:?}") };
    assert_eq!(*turning, node(RIGHT));
    let true_rpm = bench.world.report(RIGHT).unwrap().velocity_rpm;
    assert!(rpm.abs() > 2.0 && (rpm.abs() - true_rpm.abs()).abs() < 0.2 * true_rpm.abs(), "{rpm} for {true_rpm} r/min");
    assert!(why.to_string().contains("node 2 still turns at"), "{why}");
}

//! Drives that are captured while they move: demand values are what was asked for, and the figures of a motion those of its plant.

use std::time::Duration;

use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use cia402::object::MODES_OF_OPERATION_DISPLAY;
use host::capture::{Pace, Restorer, merit};
use host::test_motion::{Shape, follow, points, steps};
use host::tune::motor_of;
use master::core::PdoMap;
use master::cyclic::CyclicOptions;
use master::drive::MotionOptions;
use master::group::{AxisLimits, AxisSetup, Group};
use master::pdo::{PdoConfig, TimerUnits};
use master::units::{Amperes, Angle, Ramp, Rpm};
use recording::Capture;
use sim::Place;

use crate::capture::{Bench, MS, node};

const CYCLE: Duration = Duration::from_millis(5);
/// A count of the position of a zlac8030l, in degrees.
const COUNT_DEG: f64 = 360.0 / 4096.0;

/// Twice the amplitude from end to end, whatever the drive takes its set-points as; and the way back at the end.
#[test]
fn a_sine_is_followed_run_after_run_while_it_is_captured() {
    for is_taken in [false, true] {
        is_followed_while_it_is_captured(is_taken);
    }
}

/// Where the spare TPDO was mapped and valid before, the group takes it for the room on the bus, and puts that back before the capture is at its
/// way back.
fn is_followed_while_it_is_captured(is_taken: bool) {
    let mut bench = Bench::new("zlac8030l");
    if is_taken {
        let spare = PdoId { direction: Direction::Tpdo, number: PdoNumber::at(1).expect("a second one") };
        let record = MappingRecord { mux: MODES_OF_OPERATION_DISPLAY, bits: 8 };
        let config = PdoConfig::new(spare, PdoMap(vec![record]));
        bench.run(bench.drive.clone().node().configure_pdo(&config, TimerUnits::STANDARD)).expect("it is mapped");
    }
    let before = bench.tpdos();
    let limits = AxisLimits { velocity_turns_s: 1.0, acceleration_turns_s2: 20.0, ..AxisLimits::careful() };
    let amplitude_turns = 10.0 / 360.0;
    let shape = Shape::Sine { amplitude_turns, hz: 2.0, periods: 2 };
    let path = points(&shape, &limits, CYCLE.as_secs_f64()).expect("within its limits");
    let drive = bench.drive.clone();
    let mode = AxisSetup::best_mode(&drive).expect("it has one");
    let axis = AxisSetup { drive: drive.clone(), mode, limits };
    let mut group = bench.run(Group::open(&[axis], CYCLE, CyclicOptions::default())).expect("it opens");
    let mut wanted = bench.wanted(&["position", "current"], None);
    wanted.period = CYCLE;
    let restorer = Restorer::of(&drive);
    let begun = bench.run(group.beside(wanted.begin(&drive, &restorer)));
    let mut running = begun.expect("it begins");
    assert_eq!(running.plan().map(|plan| plan.pace), Some(Pace::Sync(1)));
    bench.run(group.enable()).expect("it is enabled");
    for run in 0..2 {
        let ((followed, taken), truth) = bench.run_beside_truth(running.during(follow(&mut group, &path)));
        let followed = followed.unwrap_or_else(|error| panic!("run {run}: {error}"));
        // Two periods of 0.5 s, and the cycles in which it begins and ends.
        assert!((1.0..=1.025).contains(&followed.took_s), "run {run}: {followed:?}");
        assert!(followed.most_deg < 0.3 && followed.rms_deg <= followed.most_deg, "run {run}: {followed:?}");
        assert!(taken.cut_off.is_none(), "{:?}", taken.cut_off);
        let capture = taken.capture;
        let trace = capture.trace("position_deg").expect("a position");
        let ends = |values: &[f64]| {
            values.iter().fold((f64::MAX, f64::MIN), |(low, high), deg| (low.min(*deg), high.max(*deg)))
        };
        let (seen, had) = (ends(&trace.values), ends(&truth.1));
        // One count is 360 / 4096 degrees; at the ends the shaft stands for longer than a cycle.
        let is_near = |seen: f64, had: f64| (seen - had).abs() < COUNT_DEG + 0.01;
        assert!(is_near(seen.0, had.0) && is_near(seen.1, had.1), "run {run}: {seen:?}, {had:?}");
        assert!(
            (seen.1 - seen.0 - 20.0).abs() < 2.0 * (followed.most_deg + COUNT_DEG),
            "run {run}: {seen:?}, {followed:?}"
        );
    }
    bench.run(group.close()).expect("it closes");
    assert_eq!(bench.run(restorer.restore()), Vec::<String>::new());
    assert_eq!(bench.tpdos(), before);
}

#[test]
fn steps_of_velocity_end_at_rest_with_both_edges_captured() {
    let mut bench = Bench::new("zlac8030l");
    let wanted = bench.wanted(&["velocity", "target_velocity"], None);
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let drive = bench.drive.clone();
    let (done, taken) = bench.run(running.during(steps(&drive, Rpm(60.0), None, Duration::from_millis(800), None)));
    done.expect("it moves");
    assert!(taken.cut_off.is_none(), "{:?}", taken.cut_off);
    let capture = taken.capture;
    let demand: Vec<f64> = capture.trace("target_velocity_rpm").expect("a demand").values.clone();
    let edges: Vec<_> = demand.windows(2).filter(|pair| pair[0] != pair[1]).map(|pair| (pair[0], pair[1])).collect();
    assert_eq!(edges, [(0.0, 60.0), (60.0, 0.0)]);
    assert!(bench.world.report(4).expect("the drive").velocity_rpm.abs() < 1.0);
    assert!(!bench.network.moved().contains(node()));
    bench.run(restorer.restore());
}

/// Values of 607Ah, 6062h, 6064h and 60F4h in degrees, of 606Bh in r/min: what was asked for, and that the error is the distance of both.
#[test]
fn demand_values_of_a_move_are_those_that_were_asked_for() {
    let mut bench = Bench::new("cia402");
    let names = ["target_position", "position_demand", "position", "following_error"];
    let mut wanted = bench.wanted(&names, None);
    wanted.period = 5 * MS;
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let drive = bench.drive.clone();
    let ramp = Some(Ramp::RpmPerSecond(240.0));
    let (speed, within) = (Some(Rpm(30.0)), None);
    let options = MotionOptions { speed, acceleration: ramp, deceleration: ramp, wait: true, within };
    let (done, taken) = bench.run(running.during(drive.move_relative(Angle::Turns(0.25), options)));
    done.expect("it moves");
    let capture = taken.capture;
    let of = |name: &str| {
        let trace = capture.traces.iter().find(|trace| trace.quantity.starts_with(name)).expect("it was captured");
        (trace.unit.as_str(), trace.values.clone())
    };
    let (unit, target) = of("target_position");
    assert_eq!((unit, target.last().map(|deg| deg.round())), ("°", Some(90.0)));
    let ((_, demand), (_, actual), (unit, error)) = (of("position_demand"), of("position_deg"), of("following_error"));
    assert!(unit == "°" && (demand.last().expect("one") - 90.0).abs() < 0.1, "{unit}: {demand:?}");
    let largest = error.iter().fold(0.0_f64, |most, deg| most.max(deg.abs()));
    for at in 0..error.len() {
        assert!((error[at] - (demand[at] - actual[at])).abs() < 0.1, "{at}: {} of {largest}", error[at]);
    }
    assert!(largest > 0.2, "it was seen to follow: {largest} degrees");
    drop(running);
    bench.run(restorer.restore());
    // The speed that it is to have then, 606Bh: up, kept, and down.
    let mut wanted = bench.wanted(&["velocity_demand"], None);
    wanted.period = 5 * MS;
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let (done, taken) = bench.run(running.during(drive.move_relative(Angle::Turns(0.25), options)));
    done.expect("it moves");
    let trace = taken.capture.trace("velocity_demand_rpm").expect("it was captured");
    let fastest = trace.values.iter().copied().fold(0.0, f64::max);
    assert!(trace.unit == "r/min" && (fastest - 30.0).abs() < 0.5, "{fastest} {}", trace.unit);
    assert_eq!((trace.values.first(), trace.values.last().map(|rpm| rpm.abs() < 1.0)), (Some(&0.0), Some(true)));
    bench.run(drive.disable()).expect("it has no power");
    drop(running);
    bench.run(restorer.restore());
    // The current that is asked for, of 6071h, whose unit is a thousandth of the rated torque.
    let mut wanted = bench.wanted(&["target_current"], None);
    wanted.period = 5 * MS;
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let (done, taken) = bench.run(running.during(async {
        drive.torque(Amperes(0.8)).await?;
        drive.supervise(Duration::from_millis(100)).await
    }));
    done.expect("it pushes");
    let trace = taken.capture.trace("target_current_a").expect("it was captured");
    let last = trace.values.last().copied().expect("a reading");
    // Its step is a thousandth of 2.8 A.
    assert!((last - 0.8).abs() < 0.0028 && trace.unit == "A", "{last} {}", trace.unit);
    bench.run(drive.quick_stop()).expect("it stops");
    bench.run(restorer.restore());
}

/// How far a captured position is from the points that were sent, at the delay at which both are nearest, in degrees.
fn off_deg(capture: &Capture, points: &[f64]) -> f64 {
    let seen = &capture.trace("position_deg").expect("a position").values;
    let off = |late: usize| {
        let pairs = points.iter().zip(&seen[late..]);
        pairs.map(|(turns, deg)| (turns * 360.0 - (deg - seen[0])).abs()).fold(0.0, f64::max)
    };
    (0..seen.len().saturating_sub(points.len()).min(12)).map(off).fold(f64::INFINITY, f64::min)
}

/// A chirp, a pseudo-random sequence, and the path that the chirp has left.
#[test]
fn a_chirp_a_random_sequence_and_a_recorded_path_move_the_shaft_along_their_points() {
    let mut bench = Bench::new("zlac8030l");
    let limits = AxisLimits { velocity_turns_s: 1.0, acceleration_turns_s2: 30.0, ..AxisLimits::careful() };
    let drive = bench.drive.clone();
    let mode = AxisSetup::best_mode(&drive).expect("it has one");
    let axis = AxisSetup { drive: drive.clone(), mode, limits: limits.clone() };
    let mut group = bench.run(Group::open(&[axis], CYCLE, CyclicOptions::default())).expect("it opens");
    let mut wanted = bench.wanted(&["position"], None);
    wanted.period = CYCLE;
    let restorer = Restorer::of(&drive);
    let begun = bench.run(group.beside(wanted.begin(&drive, &restorer)));
    let mut running = begun.expect("it begins");
    bench.run(group.enable()).expect("it is enabled");
    let chirp = Shape::Chirp { amplitude_turns: 8.0 / 360.0, from_hz: 0.5, to_hz: 3.0, duration_s: 2.0 };
    let prbs = Shape::Prbs { velocity_turns_s: 0.2, bit_s: 0.02 };
    let mut recorded = Vec::new();
    for shape in [Some(chirp), Some(prbs), None] {
        let shape = shape.unwrap_or_else(|| Shape::Path { points: std::mem::take(&mut recorded) });
        let path = points(&shape, &limits, CYCLE.as_secs_f64()).unwrap_or_else(|why| panic!("{shape:?}: {why}"));
        let (followed, taken) = bench.run(running.during(follow(&mut group, &path)));
        let followed = followed.unwrap_or_else(|error| panic!("{shape:?}: {error}"));
        assert!(followed.most_deg < 1.0, "{followed:?}");
        let (least, most) = path.iter().fold((0.0_f64, 0.0_f64), |(low, high), at| (low.min(*at), high.max(*at)));
        let off = off_deg(&taken.capture, &path);
        assert!((most - least) * 360.0 > 5.0 && off < 1.0, "{shape:?}: {off} of {} degrees", (most - least) * 360.0);
        if matches!(shape, Shape::Chirp { .. }) {
            let position = taken.capture.trace("position_deg").expect("a position").clone();
            recorded = taken.capture.points(&position).map(|(at, deg)| (at, deg / 360.0)).collect();
        }
    }
    bench.run(group.close()).expect("it closes");
    assert_eq!(bench.run(restorer.restore()), Vec::<String>::new());
}

/// Three phases, each with the amplitude that the drive shows times a sine: their heat is 3/2 of its square times the resistance of one.
#[test]
fn the_heat_of_a_motion_is_that_of_the_winding() {
    let mut bench = Bench::new("zlac8030l");
    let load = "load friction 3 viscous 0.01".parse().expect("words");
    bench.world.apply(Place::node(4), &load).expect("there").expect("done");
    let wanted = bench.wanted(&["current", "true_winding_heat"], None);
    let (mut running, restorer) = bench.begin(&wanted).expect("it begins");
    let drive = bench.drive.clone();
    let (done, taken) = bench.run(running.during(steps(&drive, Rpm(60.0), None, Duration::from_millis(800), None)));
    done.expect("it moves");
    let of = |name: &str| {
        let trace = taken.capture.trace(name).unwrap_or_else(|| panic!("{name}"));
        taken.capture.points(trace).collect::<Vec<_>>()
    };
    let (current, heat) = (of("current_a"), of("true_winding_heat_j"));
    let figures = merit::heating(&current).expect("readings");
    let winding_j = heat[heat.len() - 1].1 - heat[0].1;
    let motor = motor_of(drive.description().expect("known")).expect("its motor");
    let of_figures_j = 1.5 * motor.windings.resistance_ohm * figures.a2s;
    assert!((of_figures_j / winding_j - 1.0).abs() < 0.05, "{of_figures_j} J, {winding_j} J in the winding");
    bench.run(restorer.restore());
}

//! Tasks and stops on a shaft that follows its demand exactly, against the closed forms of uniform acceleration.

use cia402::HomingMethod;

use super::*;

const DT_S: f64 = 0.5e-3;
/// Counts/s².
const RATE: f64 = 2000.0;
const RAMP: Ramp = Ramp::Rate(RATE);
const LIMITS: MoveLimits = MoveLimits {
    start_speed: 0.0,
    max_speed: 1000.0,
    end_speed: 0.0,
    passes: false,
    acceleration: RAMP,
    deceleration: RAMP,
};
const SPEEDS: VelocityRamps =
    VelocityRamps { start_speed: 0.0, max_speed: 1000.0, acceleration: RAMP, deceleration: RAMP };
const HOLD: Task = Task::Hold { control: Control::Position, ramp: RAMP };
const STOP: Stop =
    Stop { braking: Braking::Ramp(Ramp::Rate(4000.0)), on_path: true, end: StopEnd::Hold, patience_s: 1.0 };

struct AxisBench {
    axis: Axis,
    /// Counts, with their share.
    position: f64,
    velocity: f64,
}

impl AxisBench {
    fn turning_at(velocity: f64) -> Self {
        let mut bench = Self { axis: Axis::new(), position: 0.0, velocity };
        bench.look();
        bench.axis.engage();
        bench.axis.begin(HOLD);
        bench
    }

    fn look(&mut self) {
        let (position, velocity) = (self.position as i32, self.velocity);
        self.axis.observe(Feedback { position, velocity, standing: velocity.abs() < 1e-9, current_a: 0.0 });
    }

    fn step(&mut self) -> Demand {
        self.look();
        let demand = self.axis.update(DT_S);
        match demand {
            Demand::Position(point) => {
                (self.position, self.velocity) = (f64::from(point.position) + point.fraction, point.velocity);
            }
            Demand::Velocity(point) => {
                self.position += 0.5 * (self.velocity + point.velocity) * DT_S;
                self.velocity = point.velocity;
            }
            Demand::Off | Demand::Torque(_) => self.position += self.velocity * DT_S,
        }
        demand
    }

    fn run(&mut self, s: f64) -> &mut Self {
        (0..(s / DT_S).round() as u32).for_each(|_| _ = self.step());
        self
    }

    fn stands_at(&self, position: f64) -> bool {
        self.velocity == 0.0 && (self.position - position).abs() < 1.0
    }
}

#[test]
fn a_shaft_that_turns_is_taken_over_and_brought_to_rest() {
    // v²/2a from 1000 counts/s.
    let mut bench = AxisBench::turning_at(1000.0);
    bench.run(0.25);
    assert!((bench.velocity - 500.0).abs() < 2.0, "{}", bench.velocity);
    assert!(bench.run(0.26).stands_at(250.0), "{}", bench.position);
}

#[test]
fn a_stop_lies_over_a_move_which_goes_on_afterwards() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.begin(Task::Move { target: 5000, limits: LIMITS });
    bench.run(1.0);
    let there = bench.position;
    bench.axis.set_stop(Some(STOP));
    assert_eq!(bench.axis.stop_state(), Some(StopState::Braking));
    // v²/2a at 1000 counts/s and 4000 counts/s².
    assert!(bench.run(0.3).stands_at(there + 125.0), "{}", bench.position - there);
    assert!(bench.axis.has_stopped() && !bench.axis.is_done());
    bench.axis.set_stop(None);
    assert!(bench.run(6.0).stands_at(5000.0) && bench.axis.is_done(), "{}", bench.position);
}

#[test]
fn a_task_that_is_begun_under_a_stop_waits_for_its_end() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.set_stop(Some(STOP));
    bench.run(0.1);
    bench.axis.begin(Task::Move { target: -700, limits: LIMITS });
    assert!(bench.run(1.0).stands_at(0.0));
    bench.axis.set_stop(None);
    assert!(bench.run(2.0).stands_at(-700.0));
}

#[test]
fn a_coasting_shaft_is_free_and_is_taken_over_as_it_turns() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.begin(Task::Speed { velocity: 800.0, ramps: SPEEDS });
    bench.run(1.0);
    bench.axis.set_stop(Some(Stop { braking: Braking::Coast, ..STOP }));
    assert_eq!((bench.step(), bench.axis.stop_state()), (Demand::Off, Some(StopState::Free)));
    bench.velocity = 300.0;
    bench.run(0.1);
    bench.axis.set_stop(None);
    let Demand::Velocity(point) = bench.step() else { panic!("it turns again") };
    assert!((point.velocity - 300.0 - RATE * DT_S).abs() < 1e-6, "{point:?}");
}

#[test]
fn another_stop_goes_on_where_the_first_has_come_to_unless_it_is_faster() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.begin(Task::Speed { velocity: 1000.0, ramps: SPEEDS });
    bench.run(1.0);
    bench.axis.set_stop(Some(STOP));
    bench.run(0.1);
    bench.axis.set_stop(Some(Stop { end: StopEnd::LetGo, ..STOP }));
    bench.run(0.1);
    assert!((bench.velocity - 200.0).abs() < 3.0, "the ramp is the same: {}", bench.velocity);
    bench.axis.set_stop(Some(Stop { braking: Braking::CurrentLimit, on_path: false, ..STOP }));
    assert!(matches!(bench.step(), Demand::Velocity(point) if point.velocity == 0.0));
}

#[test]
fn cyclic_set_points_are_followed_to_the_point_and_again_after_a_stop() {
    let mut bench = AxisBench::turning_at(0.0);
    let point = |n: i32| TrajectoryPoint::moving(n, 1.0 / DT_S);
    for n in 0..200 {
        bench.axis.begin(Task::Cyclic(Cyclic::Position(point(n))));
        assert_eq!(bench.step(), Demand::Position(point(n)));
    }
    bench.axis.set_stop(Some(STOP));
    for n in 200..1400 {
        bench.axis.begin(Task::Cyclic(Cyclic::Position(point(n))));
        bench.step();
    }
    // v²/2a at 2000 counts/s.
    assert!(bench.axis.has_stopped() && bench.stands_at(199.0 + 500.0), "{}", bench.position);
    bench.axis.set_stop(None);
    bench.axis.begin(Task::Cyclic(Cyclic::Torque(1.5)));
    assert_eq!(bench.step(), Demand::Torque(1.5));
}

#[test]
fn an_interpolation_under_a_stop_leads_to_its_last_target_afterwards() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.begin(Task::Interpolate { target: 10, time_s: 0.01, max_speed: 0.0 });
    bench.run(0.005);
    assert!((bench.position - 5.0).abs() < 1e-6);
    bench.axis.set_stop(Some(STOP));
    bench.run(1.0);
    bench.axis.begin(Task::Interpolate { target: 2000, time_s: 0.01, max_speed: 1000.0 });
    bench.axis.set_stop(None);
    bench.run(1.0);
    assert!(bench.velocity > 999.0 && !bench.axis.is_done(), "no faster than allowed");
    assert!(bench.run(2.0).stands_at(2000.0) && bench.axis.is_done());
}

#[test]
fn homing_tells_the_edge_and_comes_to_rest_beyond_it() {
    let mut bench = AxisBench::turning_at(0.0);
    bench.axis.begin(Task::Home(HomingParameters {
        sequence: HomingMethod(19).sequence(),
        search_speed: 500.0,
        latch_speed: 200.0,
        ramps: SPEEDS,
        end: RAMP,
        ..HomingParameters::default()
    }));
    let mut home = None;
    for _ in 0..20_000 {
        bench.axis.set_switches(Switches { home: bench.position >= 300.0, ..Switches::default() });
        bench.step();
        home = home.or(bench.axis.take_home());
    }
    // The switch goes off below 300; 200 counts/s at 2000 counts/s² take 10 counts.
    assert_eq!((home, bench.axis.homing()), (Some(299), HomingState::Attained));
    assert!((bench.position - 289.0).abs() < 1.5 && bench.velocity == 0.0, "{}", bench.position);
    bench.axis.shift(299);
    assert_eq!(bench.axis.target(), -10);
}

//! Who may move, on a shaft that follows its demand exactly: stop options, the fault reaction, modes with their ramps.

use cia402::{
    Controlword, DisableOperationOption, FaultReactionOption, HaltOption, ModeOfOperation, PowerState, QuickStopOption,
    ShutdownOption, StopRamp,
};

use super::*;
use crate::engine::axis::{
    Control, Cyclic, Demand, Feedback, HomingParameters, MoveLimits, Ramp, Switches, Task, TrajectoryPoint,
    VelocityRamps,
};

const DT_S: f64 = 1e-3;
const SLOW: Ramp = Ramp::Rate(1000.0);
const QUICK: Ramp = Ramp::Rate(4000.0);

fn parameters() -> Parameters {
    let limits = MoveLimits {
        start_speed: 0.0,
        max_speed: 1000.0,
        end_speed: 0.0,
        passes: false,
        acceleration: SLOW,
        deceleration: SLOW,
    };
    Parameters {
        moves: limits,
        velocity: VelocityRamps { start_speed: 0.0, max_speed: 1000.0, acceleration: SLOW, deceleration: SLOW },
        quick_stop_ramp: QUICK,
        torque_slope_a_s: 0.0,
        quick_stop: QuickStopOption::QUICK_STOP,
        disable: DisableOptions {
            shutdown: ShutdownOption::DISABLE,
            disable_operation: DisableOperationOption::SLOW_DOWN,
        },
        halt: HaltOption::SLOW_DOWN,
        emergency_stop: StopRamp::CurrentLimit,
        limit_stop: Some(StopRamp::QuickStop),
        homing: HomingParameters::default(),
        external_stop: ExternalStop::Hold,
        tolerances: Tolerances { position: 1, velocity: 1.0, current_a: 0.1 },
        mode_change: ModeChange::AtStandstill,
    }
}

struct Bench {
    drive: PowerDrive,
    parameters: Parameters,
    targets: Targets,
    position: f64,
    velocity: f64,
}

impl Bench {
    /// Enabled, in a mode.
    fn enabled(mode: ModeOfOperation) -> Self {
        let mut bench = Self {
            drive: PowerDrive::new(&[]),
            parameters: parameters(),
            targets: Targets::default(),
            position: 0.0,
            velocity: 0.0,
        };
        bench.drive.self_test_done();
        bench.drive.request_mode(mode);
        [0x06, 0x07, 0x0F].into_iter().for_each(|word| bench.command(word, 0));
        bench
    }

    /// Turning at 1000 counts/s in profile velocity.
    fn turning() -> Self {
        let mut bench = Self::enabled(ModeOfOperation::PROFILE_VELOCITY);
        bench.targets.velocity = 1000.0;
        bench.run(1500);
        assert_eq!(bench.velocity, 1000.0);
        bench
    }

    fn command(&mut self, word: u16, target: i32) {
        self.drive.command(Controlword(word), target, &self.parameters);
        self.run(1);
    }

    fn run(&mut self, periods: u32) -> Demand {
        let mut demand = Demand::Off;
        for _ in 0..periods {
            let (position, velocity) = (self.position as i32, self.velocity);
            let feedback = Feedback { position, velocity, standing: velocity.abs() < 1e-9, current_a: 0.0 };
            let next = self.drive.update(feedback, &self.targets, &self.parameters, DT_S);
            demand = next.unwrap_or_else(|| self.drive.idle(None, DT_S));
            match demand {
                Demand::Position(point) => {
                    (self.position, self.velocity) = (f64::from(point.position) + point.fraction, point.velocity);
                }
                Demand::Velocity(point) => {
                    self.velocity = point.velocity;
                    self.position += self.velocity * DT_S;
                }
                Demand::Off | Demand::Torque(_) => self.position += self.velocity * DT_S,
            }
        }
        demand
    }

    /// Periods until the shaft stands.
    fn periods_to_rest(&mut self) -> u32 {
        (0..5000).find(|_| self.velocity == 0.0 || self.run(1) == Demand::Off).expect("it comes to rest")
    }

    fn reached(&self) -> bool {
        self.drive.status(&self.targets, &self.parameters).target_reached
    }
}

#[test]
fn a_quick_stop_goes_where_its_option_code_says() {
    // 1000 counts/s at 1000 and at 4000 counts/s².
    for (option, periods, end) in [
        (0, 0..=1, PowerState::SwitchOnDisabled),
        (1, 999..=1001, PowerState::SwitchOnDisabled),
        (2, 249..=251, PowerState::SwitchOnDisabled),
        (5, 999..=1001, PowerState::QuickStopActive),
        (6, 249..=251, PowerState::QuickStopActive),
        (7, 0..=1, PowerState::QuickStopActive),
    ] {
        let mut bench = Bench::turning();
        bench.parameters.quick_stop = QuickStopOption(option);
        bench.command(0x02, 0);
        let took = bench.periods_to_rest();
        bench.run(5);
        assert!(periods.contains(&took) && bench.drive.state() == end, "605Ah = {option}: {took} ms");
        assert_eq!(bench.drive.is_driven(), end == PowerState::QuickStopActive, "605Ah = {option}");
    }
}

#[test]
fn a_fault_is_reacted_to_before_it_is_a_fault() {
    for (reaction, periods) in [(0, 0..=0), (1, 999..=1001), (2, 249..=251), (3, 0..=1)] {
        let mut bench = Bench::turning();
        bench.drive.fault(FaultReactionOption(reaction));
        let expected = if reaction == 0 { PowerState::Fault } else { PowerState::FaultReactionActive };
        assert_eq!(bench.drive.state(), expected, "605Eh = {reaction}");
        bench.command(0x0F, 0);
        let took = bench.periods_to_rest();
        assert!(periods.contains(&took) || took + 1 == *periods.start(), "605Eh = {reaction}: {took} ms");
        bench.run(5);
        assert_eq!((bench.drive.state(), bench.run(1)), (PowerState::Fault, Demand::Off), "605Eh = {reaction}");
        bench.drive.reset_fault();
        assert_eq!(bench.drive.state(), PowerState::SwitchOnDisabled);
    }
}

#[test]
fn disable_operation_ramps_down_and_shutdown_does_not_as_their_options_say() {
    let mut bench = Bench::turning();
    bench.command(0x07, 0);
    assert!((997..=1001).contains(&bench.periods_to_rest()));
    bench.run(2);
    assert_eq!(bench.drive.state(), PowerState::SwitchedOn);
    let mut bench = Bench::turning();
    bench.command(0x06, 0);
    assert_eq!((bench.drive.state(), bench.run(1)), (PowerState::ReadyToSwitchOn, Demand::Off));
}

#[test]
fn a_shaft_that_is_not_enabled_does_what_the_drive_asks() {
    let mut bench = Bench::enabled(ModeOfOperation::PROFILE_POSITION);
    bench.command(0x00, 0);
    let feedback = Feedback { position: 40, standing: true, ..Feedback::default() };
    assert_eq!(bench.drive.update(feedback, &bench.targets, &bench.parameters, DT_S), None);
    let hold = Task::Hold { control: Control::Position, ramp: Ramp::NONE };
    assert_eq!(bench.drive.idle(Some(hold), DT_S), Demand::Position(TrajectoryPoint::rest(40)));
    assert_eq!(bench.drive.idle(None, DT_S), Demand::Off);
}

#[test]
fn set_points_follow_each_other_and_a_halted_one_goes_on() {
    let mut bench = Bench::enabled(ModeOfOperation::PROFILE_POSITION);
    bench.command(0x1F, 500);
    bench.command(0x0F, 0);
    bench.command(0x1F, -200);
    bench.run(300);
    bench.command(0x010F, 0);
    bench.run(1000);
    assert!(bench.velocity == 0.0 && bench.position > 10.0 && bench.position < 400.0, "halted: {}", bench.position);
    bench.command(0x0F, 0);
    bench.run(8000);
    assert!(bench.position == -200.0 && bench.reached());
}

#[test]
fn cyclic_modes_follow_the_set_points_they_are_given_and_hold_without() {
    let mut bench = Bench::enabled(ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION);
    assert_eq!(bench.run(3), Demand::Position(TrajectoryPoint::rest(0)));
    for n in 1..=50 {
        let point = TrajectoryPoint::moving(10 * n, 10.0 / DT_S);
        bench.targets.cyclic = Some(Cyclic::Position(point));
        assert_eq!(bench.run(1), Demand::Position(point));
    }
    bench.targets.cyclic = None;
    bench.run(12_000);
    assert!(bench.velocity == 0.0 && bench.position > 500.0, "brought to rest and held");
}

#[test]
fn a_limit_switch_lets_no_cyclic_set_point_past_and_every_one_away() {
    let mut bench = Bench::enabled(ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY);
    let velocity = |v: f64| Some(Cyclic::Velocity(TrajectoryPoint::moving(0, v)));
    bench.targets.cyclic = velocity(500.0);
    bench.run(100);
    bench.drive.set_switches(Switches { positive_limit: true, ..Switches::default() });
    bench.run(200);
    assert!(bench.velocity == 0.0 && bench.drive.stop_cause() == Some(StopCause::Limit));
    assert!(bench.drive.status(&bench.targets, &bench.parameters).limit_active);
    bench.targets.cyclic = velocity(-500.0);
    bench.run(2);
    assert_eq!((bench.velocity, bench.drive.stop_cause()), (-500.0, None));
}

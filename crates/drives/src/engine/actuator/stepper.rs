//! Open-loop control of a two-phase stepper: a current vector that turns with the commanded position.
//!
//! [`command`](Stepper::command) runs every supervision period and says where the vector is to be,
//! [`modulate`](Stepper::modulate) every control period. Between two commands the way is straight. The vector points to
//! whole pulses only (microsteps), so its angle is exact however far the motor turns:
//!
//! ```text
//! angle = pulses / pulses per electrical turn        i_a* = I cos(angle)        i_b* = I sin(angle)
//! ```
//!
//! One PI controller for each axis of the turning frame regulates the two currents. Across the vector flows what balances
//! the detent of a rotor that follows without a load, four periods in an electrical turn:
//!
//! ```text
//! i_q* = I_detent sin(4 angle)
//! ```
//!
//! Where the motor's own voltage leaves too little of the bus for these currents, the voltage vector keeps the direction that
//! the controllers ask for, at the length that there is: the motor is then a synchronous one on a stiff source, whose pull-out
//! torque `K (V / Z - R e / Z²)` is that of the voltage alone. Such a motor has hardly any damping, and at high speed less than
//! none; so the vector gives way to the swings of the current along it, which are those of the power
//! ([`AtLimit`]): it falls back while the power rises and runs ahead while it falls.
//!
//! A power stage that follows by itself takes the path of the vector in place of duty cycles, once each supervision period
//! ([`follow`](Stepper::follow)): [`Fidelity::Mechanical`](crate::Fidelity).
//!
//! Nothing here measures the rotor: it follows within a quarter of an electrical turn, or slips by whole ones, and the
//! position knows nothing of it.

use motion::angle::sin_cos_turns;
use motion::pid::{Pi, PiGains};

use crate::engine::axis::{Demand, TrajectoryPoint};

/// What the drive knows about the motor and its own rhythm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperModel {
    /// Pulses in one electrical turn (four full steps).
    pub pulses_per_electrical_turn: u16,
    /// Control periods in one supervision period.
    pub periods_per_command: u8,
    /// Control period, s.
    pub control_period_s: f32,
    /// Current across the vector that balances the motor's detent, A: the detent torque over the torque constant. Zero for
    /// none.
    pub detent_a: f32,
    /// How far ahead that current is asked for, control periods: what the voltage and the current take to follow.
    pub detent_lead_periods: f32,
}

/// Amplitudes of the current vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepperCurrents {
    /// While it turns, A.
    pub run_a: f32,
    /// At standstill, A.
    pub hold_a: f32,
    /// Supervision periods from the last pulse until the current falls.
    pub hold_after: u16,
}

/// How the current loops are set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepperGains {
    /// Of both axes: V/A and V/(A s).
    pub current: PiGains,
    /// Share of the bus voltage that the bridges can give, 0 to 1.
    pub modulation_limit: f32,
    /// What the vector does at that limit.
    pub at_limit: AtLimit,
}

/// How a voltage vector at the limit of its length damps the rotor's swing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtLimit {
    /// How far the vector falls back for what swings of the current along it, turns/A.
    pub turns_per_a: f32,
    /// Share of the current across it, on the side from which the rotor pulls, that counts beside the one along it. The nearer the
    /// rotor is to pull-out the less its swing shows along the vector, and the more across it.
    pub across_share: f32,
    /// What swings is what passes the first of two low-passes and not the second: the share of the way that each goes in a
    /// control period.
    pub passed: [f32; 2],
    /// Share of their rate at which the integrals of the controllers follow the direction.
    pub integral_share: f32,
}

/// What the currents did in one supervision period, for the faults: the largest values, phase A first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Measured, A, without sign.
    pub current_a: [f32; 2],
    /// Asked for, A, without sign.
    pub reference_a: [f32; 2],
}

/// What a power stage is asked for that follows by itself: the vector's path over a supervision period, in electrical turns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FieldDemand {
    /// Where it stands at the beginning, between whole pulses.
    pub from_turns: f64,
    /// How far it goes.
    pub way_turns: f64,
    /// A whole pulse.
    pub pulse_turns: f64,
    /// Length of the current vector, A.
    pub amplitude_a: f32,
    /// Amplitude of the current across it that balances the detent, A, and how far ahead that is asked for.
    pub detent_a: f32,
    /// See `detent_a`.
    pub detent_lead_turns: f32,
}

/// State of the vector and its loops.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stepper {
    energised: bool,
    /// Command at the beginning and the end of the supervision period.
    from: TrajectoryPoint,
    to: TrajectoryPoint,
    pulses_per_period: f64,
    period: u8,
    /// Last whole pulse, and where in its electrical turn the vector points.
    issued: i32,
    field: u16,
    electrical_turns: i32,
    amplitude_a: f32,
    resting_for: u16,
    d: Pi,
    q: Pi,
    /// Current along a voltage vector at its limit, behind the two low-passes, A.
    along_a: Option<[f32; 2]>,
    measured_a: [f32; 2],
    peaks: Peaks,
    /// What a power stage is asked for that follows by itself, and how far its path is ahead of the last whole pulse.
    path: FieldDemand,
    ahead_pulses: f64,
}

impl Stepper {
    /// Where the vector is to be at the end of this supervision period, in whole pulses.
    pub const fn position(&self) -> i32 {
        self.to.position
    }

    /// Commanded velocity in pulses/s.
    pub const fn velocity(&self) -> f64 {
        self.to.velocity
    }

    /// Length of the measured current vector, A.
    pub fn current_a(&self) -> f32 {
        let [a, b] = self.measured_a;
        libm::sqrtf(a * a + b * b)
    }

    /// Length of the current vector asked for, A.
    pub const fn reference_a(&self) -> f32 {
        self.amplitude_a
    }

    /// How far the vector has turned since the beginning, in electrical turns.
    pub fn vector_turns(&self, model: &StepperModel) -> f64 {
        f64::from(self.electrical_turns) + f64::from(self.field) / f64::from(model.pulses_per_electrical_turn.max(1))
    }

    /// The motor is free, the position 0; the vector keeps its direction.
    #[must_use]
    pub fn restarted(&self) -> Self {
        Self { field: self.field, electrical_turns: self.electrical_turns, path: self.path, ..Self::default() }
    }

    /// The zero of the position: what was `by` is 0 from now on. The vector stays where it points.
    pub fn shift(&mut self, by: i32) {
        for position in [&mut self.from.position, &mut self.to.position, &mut self.issued] {
            *position = position.wrapping_sub(by);
        }
    }

    /// Another number of pulses: the vector keeps its angle, the position its number.
    pub fn rescale(&mut self, before: u16, after: u16) {
        let scaled = u32::from(self.field) * u32::from(after) / u32::from(before.max(1));
        self.field = u16::try_from(scaled).unwrap_or(0) % after.max(1);
    }

    /// Takes what the axis asks for, once each supervision period.
    pub fn command(&mut self, model: &StepperModel, demand: &Demand, currents: &StepperCurrents) {
        let (Demand::Position(point) | Demand::Velocity(point)) = *demand else { return self.release() };
        // Free before: nothing to come from, the vector stands up where the position is.
        self.from = if self.energised { self.to } else { TrajectoryPoint { velocity: 0.0, ..point } };
        if !self.energised {
            self.issued = point.position;
        }
        self.energised = true;
        self.to = point;
        self.period = 0;
        let way = f64::from(point.position.wrapping_sub(self.from.position)) + point.fraction - self.from.fraction;
        self.pulses_per_period = way / f64::from(model.periods_per_command.max(1));
        let moves = way != 0.0 || point.velocity != 0.0;
        self.resting_for = if moves { 0 } else { self.resting_for.saturating_add(1) };
        self.amplitude_a = if self.resting_for >= currents.hold_after { currents.hold_a } else { currents.run_a };
    }

    /// One control period: duty cycles of the two bridges, -1 to 1 of the bus voltage.
    #[inline]
    pub fn modulate(
        &mut self,
        model: &StepperModel,
        gains: &StepperGains,
        current_a: [f32; 2],
        bus_v: f32,
    ) -> [f32; 2] {
        self.measured_a = current_a;
        self.step(model);
        let per_pulse = 1.0 / f32::from(model.pulses_per_electrical_turn.max(1));
        let angle = f32::from(self.field) * per_pulse;
        let (sin, cos) = sin_cos_turns(angle);
        let [a, b] = current_a;
        let (wanted_d_a, wanted_q_a) = self.wanted_current_a(model, angle, per_pulse);
        let error_d = wanted_d_a - (a * cos + b * sin);
        let error_q = wanted_q_a + a * sin - b * cos;
        let (wanted_d, wanted_q) =
            (self.d.propose(&gains.current, error_d, 0.0), self.q.propose(&gains.current, error_q, 0.0));

        // The voltage acts over the period after the coming one: in its middle the frame has turned on so far.
        let angle_v = angle + VOLTAGE_DELAY_PERIODS * self.pulses_per_period as f32 * per_pulse;
        let limit = gains.modulation_limit * bus_v.max(0.0);
        let square = wanted_d * wanted_d + wanted_q * wanted_q;
        let (v_a, v_b) = if square > limit * limit {
            let share = limit / libm::sqrtf(square);
            let (given_d, given_q) = (wanted_d * share, wanted_q * share);
            let dt_s = gains.at_limit.integral_share * model.control_period_s;
            self.d.settle(&gains.current, error_d, wanted_d, given_d, dt_s);
            self.q.settle(&gains.current, error_q, wanted_q, given_q, dt_s);
            let (d_a, q_a) = (wanted_d_a - error_d, wanted_q_a - error_q);
            // Turning the other way everything is mirrored.
            let ahead = if self.pulses_per_period < 0.0 { -1.0 } else { 1.0 };
            let across = ahead * (given_d * q_a - given_q * d_a);
            let swing = (given_d * d_a + given_q * q_a - gains.at_limit.across_share * across) / limit;
            let back = ahead * self.give_way(&gains.at_limit, swing);
            turned(given_d, given_q, sin_cos_turns(angle_v - back))
        } else {
            self.along_a = None;
            let (sin_v, cos_v) = sin_cos_turns(angle_v);
            let (v_a, v_b) = turned(wanted_d, wanted_q, (sin_v, cos_v));
            let (given_d, given_q) = (v_a * cos_v + v_b * sin_v, v_b * cos_v - v_a * sin_v);
            self.d.settle(&gains.current, error_d, wanted_d, given_d, model.control_period_s);
            self.q.settle(&gains.current, error_q, wanted_q, given_q, model.control_period_s);
            (v_a, v_b)
        };

        let duty = if bus_v > 0.0 { [v_a / bus_v, v_b / bus_v] } else { [0.0; 2] };
        self.note_peaks(current_a, [self.amplitude_a * cos, self.amplitude_a * sin]);
        duty
    }

    /// The path of the vector over the coming supervision period, for a power stage that follows by itself and carries this current
    /// now. The control period that a vector is ahead of its time goes on as the period began.
    #[cold]
    #[inline(never)]
    pub fn follow(&mut self, model: &StepperModel, current_a: [f32; 2]) {
        self.measured_a = current_a;
        let due = floor(self.ahead_pulses + ROUNDING);
        self.turn_to(model, self.issued.wrapping_add(due));
        let begun = self.ahead_pulses - f64::from(due);
        let end = f64::from(self.to.position.wrapping_sub(self.issued)) + self.to.fraction + self.pulses_per_period;
        self.ahead_pulses = end;
        let pulse_turns = 1.0 / f64::from(model.pulses_per_electrical_turn.max(1));
        let lead = model.detent_lead_periods * (self.pulses_per_period * pulse_turns) as f32;
        self.path = FieldDemand {
            from_turns: (f64::from(self.field) + begun) * pulse_turns,
            way_turns: (end - begun) * pulse_turns,
            pulse_turns,
            amplitude_a: self.amplitude_a,
            detent_a: if self.balances_detent(model, lead) { model.detent_a } else { 0.0 },
            // What is asked for acts as late as the voltage.
            detent_lead_turns: lead - VOLTAGE_DELAY_PERIODS * (self.pulses_per_period * pulse_turns) as f32,
        };
        // It has no single phases, of which one could be lost.
        self.peaks = Peaks { current_a: [self.amplitude_a; 2], reference_a: [self.amplitude_a; 2] };
    }

    /// What a power stage is asked for that follows by itself.
    pub const fn path(&self) -> &FieldDemand {
        &self.path
    }

    #[inline]
    fn balances_detent(&self, model: &StepperModel, lead_turns: f32) -> bool {
        !(model.detent_a == 0.0 || self.amplitude_a <= model.detent_a || lead_turns.abs() > 1.0 / 16.0)
    }

    /// Current along the vector and across it, A: across it what balances the detent, along it the rest of the vector's length
    /// (`I cos x` for `I sin x`, to the square of x). Above the speed at which the lead is a quarter of the detent's period
    /// nothing is balanced: the rotor's inertia smooths what comes so often.
    #[inline]
    fn wanted_current_a(&self, model: &StepperModel, angle: f32, per_pulse: f32) -> (f32, f32) {
        let lead = model.detent_lead_periods * self.pulses_per_period as f32 * per_pulse;
        if !self.balances_detent(model, lead) {
            return (self.amplitude_a, 0.0);
        }
        let across_a = model.detent_a * sin_cos_turns(4.0 * (angle + lead)).0;
        (self.amplitude_a - 0.5 * across_a * across_a / self.amplitude_a, across_a)
    }

    /// How far a voltage vector at its limit falls back, turns, by the current along it, A.
    #[inline]
    fn give_way(&mut self, at_limit: &AtLimit, along_a: f32) -> f32 {
        let mut passed = self.along_a.unwrap_or([along_a; 2]);
        for (passed_a, share) in passed.iter_mut().zip(at_limit.passed) {
            *passed_a += share * (along_a - *passed_a);
        }
        self.along_a = Some(passed);
        (at_limit.turns_per_a * (passed[0] - passed[1])).clamp(-0.25, 0.25)
    }

    /// The largest values since they were last taken.
    pub fn take_peaks(&mut self) -> Peaks {
        core::mem::take(&mut self.peaks)
    }

    /// Off: the vector keeps its direction, and a motor that is moved by hand jumps to it when it is energised again.
    fn release(&mut self) {
        self.energised = false;
        self.to.velocity = 0.0;
        self.pulses_per_period = 0.0;
        self.amplitude_a = 0.0;
        self.resting_for = 0;
        self.measured_a = [0.0; 2];
        (self.d, self.q) = (Pi::default(), Pi::default());
        self.along_a = None;
        self.peaks = Peaks::default();
        self.ahead_pulses = 0.0;
    }

    /// The whole pulses that have come due turn the vector.
    fn step(&mut self, model: &StepperModel) {
        self.period = self.period.saturating_add(1).min(model.periods_per_command);
        let way = self.from.fraction + self.pulses_per_period * f64::from(self.period);
        self.turn_to(model, self.from.position.wrapping_add(floor(way + ROUNDING)));
    }

    /// The pulses up to this position turn the vector.
    #[inline(always)]
    fn turn_to(&mut self, model: &StepperModel, due: i32) {
        let pulses = i64::from(due.wrapping_sub(self.issued));
        let turn = i64::from(model.pulses_per_electrical_turn.max(1));
        let field = i64::from(self.field) + pulses;
        if (0..turn).contains(&field) {
            self.field = field as u16;
        } else {
            self.field = field.rem_euclid(turn) as u16;
            self.electrical_turns = self.electrical_turns.wrapping_add(field.div_euclid(turn) as i32);
        }
        self.issued = due;
    }

    #[inline]
    fn note_peaks(&mut self, current_a: [f32; 2], reference_a: [f32; 2]) {
        let larger = |most: f32, now: f32| if now.abs() > most { now.abs() } else { most };
        for phase in 0..2 {
            self.peaks.current_a[phase] = larger(self.peaks.current_a[phase], current_a[phase]);
            self.peaks.reference_a[phase] = larger(self.peaks.reference_a[phase], reference_a[phase]);
        }
    }
}

/// From the turning frame to the phases.
#[inline]
fn turned(d: f32, q: f32, (sin, cos): (f32, f32)) -> (f32, f32) {
    (d * cos - q * sin, d * sin + q * cos)
}

/// From sampling the currents to the middle of the period in which the voltage acts: duty cycles go through the
/// timer's shadow registers.
pub const VOLTAGE_DELAY_PERIODS: f32 = 1.5;

/// The largest whole number not above `x`, a number of pulses.
#[inline]
fn floor(x: f64) -> i32 {
    let whole = x as i64;
    (if whole as f64 > x { whole - 1 } else { whole }) as i32
}

/// A way that ends on a whole pulse does so in spite of the rounding of its tenths.
const ROUNDING: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: StepperModel = StepperModel {
        pulses_per_electrical_turn: 80,
        periods_per_command: 10,
        control_period_s: 50e-6,
        detent_a: 0.0,
        detent_lead_periods: 0.0,
    };
    const GAINS: StepperGains = StepperGains {
        current: PiGains { proportional: 15.0, integral_per_s: 1.5e3 },
        modulation_limit: 0.98,
        at_limit: AtLimit { turns_per_a: 0.16, across_share: 0.0, passed: [0.06, 1.7e-3], integral_share: 0.3 },
    };
    const CURRENTS: StepperCurrents = StepperCurrents { run_a: 1.2, hold_a: 0.6, hold_after: 200 };
    const RESISTANCE_OHM: f32 = 1.85;
    const INDUCTANCE_H: f32 = 2.8e-3;

    struct StepperBench {
        stepper: Stepper,
        current_a: [f32; 2],
        duty: [f32; 2],
    }

    impl StepperBench {
        fn new() -> Self {
            Self { stepper: Stepper::default(), current_a: [0.0; 2], duty: [0.0; 2] }
        }

        /// One supervision period on windings without a rotor.
        fn run(&mut self, point: TrajectoryPoint) {
            self.run_with(&MODEL, point);
        }

        fn run_with(&mut self, model: &StepperModel, point: TrajectoryPoint) {
            self.stepper.command(model, &Demand::Position(point), &CURRENTS);
            for _ in 0..10 {
                let next = self.stepper.modulate(model, &GAINS, self.current_a, 24.0);
                let duty = core::mem::replace(&mut self.duty, next);
                for (current_a, duty) in self.current_a.iter_mut().zip(duty) {
                    *current_a += (24.0 * duty - RESISTANCE_OHM * *current_a) * (50e-6 / INDUCTANCE_H);
                }
            }
        }

        fn angle_turns(&self) -> f64 {
            libm::atan2(f64::from(self.current_a[1]), f64::from(self.current_a[0])) / core::f64::consts::TAU
        }
    }

    #[test]
    fn the_vector_stands_up_at_its_amplitude_and_halves_at_rest() {
        let mut bench = StepperBench::new();
        (0..150).for_each(|_| bench.run(TrajectoryPoint::rest(0)));
        assert!((bench.current_a[0] - 1.2).abs() < 0.01 && bench.current_a[1].abs() < 0.01);
        (0..250).for_each(|_| bench.run(TrajectoryPoint::rest(0)));
        assert!((bench.stepper.current_a() - 0.6).abs() < 0.01);
    }

    #[test]
    fn a_quarter_of_an_electrical_turn_is_a_full_step_from_phase_a_to_phase_b() {
        let mut bench = StepperBench::new();
        bench.run(TrajectoryPoint::rest(0));
        (0..150).for_each(|_| bench.run(TrajectoryPoint::rest(20)));
        assert!(bench.current_a[0].abs() < 0.01 && (bench.current_a[1] - 1.2).abs() < 0.01, "{:?}", bench.current_a);
        (0..150).for_each(|_| bench.run(TrajectoryPoint::rest(-20)));
        assert!((bench.current_a[1] + 1.2).abs() < 0.01, "{:?}", bench.current_a);
    }

    #[test]
    fn the_current_follows_a_turning_vector_without_lag() {
        // 25 pulses in 0.5 ms: 625 electrical turns a second, 750 r/min of a motor with 50 teeth.
        let mut bench = StepperBench::new();
        for n in 0..200 {
            bench.run(TrajectoryPoint::moving(25 * n, 50e3));
        }
        let asked = f64::from(25 * 199 % 80) / 80.0;
        let lag = (asked - bench.angle_turns() + 0.5).rem_euclid(1.0) - 0.5;
        assert!(lag.abs() < 0.03, "{lag} turns");
        assert!((bench.stepper.current_a() - 1.2).abs() < 0.1, "{}", bench.stepper.current_a());
    }

    #[test]
    fn a_vector_that_the_bus_cannot_give_keeps_the_direction_asked_for_at_the_length_that_there_is() {
        let mut stepper = Stepper { field: 10, ..Stepper::default() };
        // An eighth of an electrical turn: both phases alike, each below what one of them could be given alone.
        stepper.command(&MODEL, &Demand::Position(TrajectoryPoint::rest(0)), &CURRENTS);
        for bus_v in [24.0, 12.0, 6.0] {
            let mut stepper = stepper.clone();
            let duty = stepper.modulate(&MODEL, &GAINS, [0.0; 2], bus_v);
            let asked_v = GAINS.current.proportional * CURRENTS.run_a;
            let length = (asked_v / bus_v).min(GAINS.modulation_limit);
            assert!((libm::hypotf(duty[0], duty[1]) - length).abs() < 1e-4, "{bus_v} V: {duty:?}");
            assert!((duty[0] - duty[1]).abs() < 1e-4, "{bus_v} V: {duty:?}");
        }
    }

    #[test]
    fn a_vector_at_its_limit_falls_back_while_the_power_rises_and_stands_where_it_was_when_that_stays() {
        let mut stepper = Stepper::default();
        stepper.command(&MODEL, &Demand::Position(TrajectoryPoint::rest(0)), &CURRENTS);
        let mut turned = |current_a: f32, periods: u32| {
            let mut duty = [0.0; 2];
            (0..periods).for_each(|_| duty = stepper.modulate(&MODEL, &GAINS, [current_a, 0.0], 6.0));
            libm::atan2f(duty[1], duty[0]) / core::f32::consts::TAU
        };
        assert!(turned(0.1, 1000).abs() < 1e-4);
        // 0.3 A more along the vector, at 0.16 turns/A: most of it after some ms, nothing after some tenths of a second.
        let (soon, late) = (turned(0.4, 60), turned(0.4, 6000));
        assert!((-0.048..-0.035).contains(&soon), "{soon} turns");
        assert!(late.abs() < 1e-4, "{late} turns");
        assert!(turned(0.1, 60) > 0.035, "and ahead while it falls");
    }

    #[test]
    fn what_balances_the_detent_turns_the_vector_between_the_full_steps_and_leaves_its_length() {
        let model = StepperModel { detent_a: 0.05, ..MODEL };
        // Full steps (20 pulses) lie where the detent is zero, quarter steps where it is at its greatest.
        for (pulses, across_a) in [(0, 0.0), (5, 0.05), (10, 0.0), (15, -0.05), (20, 0.0), (25, 0.05)] {
            let mut bench = StepperBench::new();
            bench.run_with(&model, TrajectoryPoint::rest(0));
            (0..150).for_each(|_| bench.run_with(&model, TrajectoryPoint::rest(pulses)));
            let angle = f64::from(pulses) / 80.0 + across_a / 1.2 / core::f64::consts::TAU;
            assert!((bench.angle_turns() - angle).abs() < 2e-4, "{pulses}: {} turns", bench.angle_turns());
            assert!((bench.stepper.current_a() - 1.2).abs() < 0.005, "{pulses}: {} A", bench.stepper.current_a());
        }
    }

    #[test]
    fn clearing_the_position_and_a_counter_that_wraps_leave_the_vector_alone() {
        let mut bench = StepperBench::new();
        bench.run(TrajectoryPoint::rest(7));
        let field = bench.stepper.field;
        bench.stepper.shift(7);
        bench.run(TrajectoryPoint::rest(0));
        assert_eq!(bench.stepper.field, field);
        bench.stepper.shift(i32::MIN + 1);
        bench.run(TrajectoryPoint::rest(i32::MAX));
        bench.run(TrajectoryPoint::rest(i32::MIN));
        assert_eq!(bench.stepper.field, field + 1);
    }
}

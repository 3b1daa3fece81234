//! A stepper's steps of a supervision period: its field is a path, its currents obey their loop by themselves.
//!
//! The rotor hangs on the field as on a spring, so within such a step it is moved in as many parts as its swing about the field
//! asks for: half of the way, the torque there, the other half (Verlet's rule, which neither damps nor feeds a swing). The field
//! goes by whole pulses; over a part it stands in the mean of where they put it, so that few of them push the rotor as they do,
//! and many are a steady turn. Where the voltage is used up a part is four control periods.
//!
//! Bus, heat and energies are booked once for the whole step. An idle bridge is computed in control periods, as at any time.

use core::f64::consts::TAU;

use crate::angle::{Axis, floor};
use crate::current_loop::short_steps;
use crate::dq::Dq;
use crate::field_loop::{Expected, FieldOutput, FieldStep, four_times};
use crate::flows::Flows;
use crate::mechanics::Load;
use crate::shaft::PendingStep;
use crate::stepper::{Bridges, Turn};
use crate::stepper_motor::StepperMotor;

/// A part of the step is at most as long as lets the rotor's swing go on by so much of its angle, rad.
const SWING_RAD: f64 = 0.8;

/// Control periods in a part where the voltage is used up: its direction stands still so long, and by the middle is late by about as
/// much as the firmware's.
const LIMITED_PERIODS: u32 = 4;

/// Up to so many turns of the field in a part the detent is computed; faster, it is four times as fast and its pushes cancel.
const DETENT_TURNS: f64 = 1.0 / 20.0;

/// A pulse has come due on its time in spite of the rounding of its tenths.
const ROUNDING: f64 = 1e-6;

/// The path of the field, pulses.
struct Path {
    pulses: f64,
    per_period: f64,
    pulse_turns: f64,
}

/// What went where during the parts so far.
#[derive(Default)]
struct Book {
    heat_j_per_ohm: f64,
    /// Work of the currents and of the detent on the rotor.
    motor_j: f64,
    detent_j: f64,
    friction_j: f64,
    load_j: f64,
    /// Impulse of currents and detent, for the mean torque; that of the currents alone.
    motor_nm_s: f64,
    current_nm_s: f64,
    /// What the currents hold the rotor by, times time.
    holding_a_s: f64,
    largest_square: f64,
}

/// How the rotor stands to the field, and the currents in the frame of it.
struct FieldFrame {
    ahead: Axis,
    current_a: Dq,
    field_pulses: f64,
    /// The field's own direction, as long as the detent shows.
    field: Option<Axis>,
}

/// One part of the step.
struct SubStep {
    periods: u32,
    dt_s: f64,
    /// How far the field turns.
    field_turns: f64,
    /// Where it stands in the middle, if the detent shows.
    field: Option<Axis>,
}

impl Path {
    /// Where whole pulses put the field, in the mean over a part about a time, control periods from the beginning.
    #[inline]
    fn at(&self, periods: f64, part: f64) -> f64 {
        let pulses = self.pulses + ROUNDING + self.per_period * periods;
        let window = (self.per_period * part).abs();
        if window >= 1.0 {
            return pulses - 0.5;
        }
        let (low, high) = (floor(pulses - 0.5 * window), floor(pulses + 0.5 * window));
        if low == high { low } else { low + (pulses + 0.5 * window - high) / window }
    }
}

impl StepperMotor {
    /// A step of a supervision period with idle bridges.
    #[inline(never)]
    pub fn coast_long(&mut self, dt_s: f64) {
        self.field.release();
        self.largest_a = None;
        let steps = short_steps(dt_s);
        let short_s = dt_s / f64::from(steps);
        if !self.rig.is_coupled() {
            return (0..steps).for_each(|_| self.step(short_s, &Bridges::Open));
        }
        let velocity_rad_s = self.expected_rad_s();
        let (mut mean_nm, mut sum) = (0.0, Flows::default());
        let mut axis = self.axis;
        let share = 1.0 / f64::from(steps);
        for _ in 0..steps {
            let turn = Turn::new(axis, 0.5 * short_s * f64::from(self.model.stepper.teeth) * velocity_rad_s);
            axis = turn.end();
            let (torque_nm, flows) = self.drive(short_s, &Bridges::Open, turn);
            mean_nm += share * torque_nm;
            sum.bus_w += share * flows.bus_w;
            sum.heat_w_per_ohm += share * flows.heat_w_per_ohm;
            sum.arc_j += flows.arc_j;
        }
        self.torque_nm = mean_nm;
        self.expected = Expected::default();
        self.push(mean_nm, sum, dt_s);
    }

    /// A step of a supervision period under the current loop, for the path that its settings have.
    #[inline(never)]
    pub fn follow_long(&mut self, dt_s: f64) {
        let stepper = self.model.stepper;
        let settings = self.field.settings;
        let periods = short_steps(dt_s);
        let period_s = dt_s / f64::from(periods);
        let pulse_turns = settings.pulse_turns.max(f64::MIN_POSITIVE);
        let per_period = settings.way_turns / (pulse_turns * f64::from(periods));
        let path = Path { pulses: settings.from_turns / pulse_turns, per_period, pulse_turns };
        let longest = self.longest_part(period_s, periods);
        let before_j = stepper.magnetic_energy_j(&self.stepper);
        let detent_before_j = stepper.detent_energy_j(self.axis);
        let mut held = self.held(&path, longest.min(LIMITED_PERIODS));
        let mut book = Book::default();
        // A voltage that stands still for a control period turns on by so much less than its direction.
        let turn_rad = settings.way_turns * TAU / f64::from(periods);
        let limit_v =
            settings.modulation_limit * self.rig.supply.bus_v * (1.0 - turn_rad * turn_rad * (1.0 / 24.0)).max(0.5);
        let resistance_ohm = self.rig.path_ohm(&self.model.rig);
        let coupled = self.rig.is_coupled();
        let velocity_rad_s = if self.rig.load.locked { 0.0 } else { self.rotor.velocity_rad_s };
        let mut done = 0;
        while done < periods {
            let wanted_v = self.field.wanted_v(Dq { d: settings.amplitude_a, q: 0.0 }, held.current_a);
            let limited = wanted_v.d * wanted_v.d + wanted_v.q * wanted_v.q > limit_v * limit_v;
            let most = if limited { longest.min(LIMITED_PERIODS) } else { longest };
            let part = self.part(&path, &mut held, done, most.min(periods - done), period_s);
            done += part.periods;
            let input = (resistance_ohm, limit_v);
            if coupled {
                self.push_part(&mut held, &mut book, &part, input, velocity_rad_s);
            } else {
                self.swing_part(&mut held, &mut book, &part, input);
            }
        }
        self.let_go(&path, &held);
        self.largest_a = Some(libm::sqrt(book.largest_square));
        let heat_j = resistance_ohm * book.heat_j_per_ohm;
        let stored_j = stepper.magnetic_energy_j(&self.stepper) - before_j;
        self.torque_nm = book.motor_nm_s / dt_s;
        let mut flows = Flows {
            bus_w: (heat_j + book.motor_j + stored_j) / dt_s,
            heat_w_per_ohm: book.heat_j_per_ohm / dt_s,
            ..Flows::default()
        };
        if coupled {
            let Book { holding_a_s, current_nm_s, motor_j, .. } = book;
            let stiffness = f64::from(stepper.teeth) * stepper.torque_constant_nm_a() * holding_a_s / dt_s;
            let torque_constant = stepper.torque_constant_nm_a();
            let damping_nm_s = torque_constant * torque_constant / self.field.seen_ohm(resistance_ohm);
            let give_nm_s = 0.5 * dt_s * stiffness.max(0.0) + damping_nm_s;
            self.expected = Expected { velocity_rad_s, give_nm_s, current_nm: current_nm_s / dt_s, motor_j };
            let torque_nm = self.torque_nm;
            return self.push(torque_nm, flows, dt_s);
        }
        // The detent is a spring: what its mean torques miss of what it stores is not lost.
        let wound_j = stepper.detent_energy_j(self.axis) - detent_before_j;
        (flows.friction_j, flows.load_j) = (book.friction_j - book.detent_j - wound_j, book.load_j);
        self.book_long(dt_s, flows);
    }

    /// The velocity that is expected in the middle of a step.
    #[inline]
    fn expected_rad_s(&self) -> f64 {
        if self.rig.load.locked { 0.0 } else { self.rotor.velocity_rad_s + 0.5 * self.rotor.velocity_change_rad_s }
    }

    /// Control periods in the longest part of a step that shows how the rotor swings about the field.
    #[inline]
    fn longest_part(&mut self, period_s: f64, periods: u32) -> u32 {
        let amplitude_a = self.field.settings.amplitude_a;
        let inertia = self.model.rotor.inertia_kg_m2 + self.rig.load.inertia_kg_m2;
        let made_for = [amplitude_a, inertia, f64::from(periods)];
        if self.field.longest.0 != made_for {
            let stiffness = self.model.stepper.stiffness_nm_rad(amplitude_a);
            let swing_periods = SWING_RAD * libm::sqrt(inertia / stiffness) / period_s;
            // Equal parts, so that what their length makes of the currents is made once.
            let longest =
                (1..=periods).rev().find(|part| periods.is_multiple_of(*part) && f64::from(*part) <= swing_periods);
            self.field.longest = (made_for, longest.unwrap_or(1));
        }
        self.field.longest.1
    }

    /// Rotor and currents seen from where the field stands at the beginning.
    #[inline]
    fn held(&self, path: &Path, part: u32) -> FieldFrame {
        let field_pulses = path.at(0.0, f64::from(part));
        let field = Axis::at_turns(field_pulses * path.pulse_turns);
        let back = Axis { sin: -field.sin, cos: field.cos };
        let [a, b] = self.stepper.current_a;
        FieldFrame {
            ahead: self.axis.turned_by(back),
            current_a: Dq { d: a * field.cos + b * field.sin, q: b * field.cos - a * field.sin },
            field_pulses,
            field: Some(field),
        }
    }

    /// The currents as the phases carry them, and the magnets' direction, where the field stands at the end.
    #[inline]
    fn let_go(&mut self, path: &Path, held: &FieldFrame) {
        let field = held.field.unwrap_or_else(|| Axis::at_turns(held.field_pulses * path.pulse_turns));
        let Dq { d, q } = held.current_a;
        self.stepper.current_a = [d * field.cos - q * field.sin, q * field.cos + d * field.sin];
        if !self.rig.is_coupled() {
            self.axis = held.ahead.turned_by(field);
        }
    }

    #[inline]
    fn part(&self, path: &Path, held: &mut FieldFrame, done: u32, periods: u32, period_s: f64) -> SubStep {
        let before = held.field_pulses;
        held.field_pulses = path.at(f64::from(done + periods), f64::from(periods));
        let field_turns = (held.field_pulses - before) * path.pulse_turns;
        let shows = field_turns.abs() <= DETENT_TURNS && self.model.stepper.detent_nm != 0.0;
        let field = if shows {
            let half = Axis::at_small_rad(0.5 * TAU * field_turns);
            let begin = held.field.unwrap_or_else(|| Axis::at_turns(before * path.pulse_turns));
            let middle = begin.turned_by(half);
            held.field = Some(middle.turned_by(half));
            Some(middle)
        } else {
            held.field = None;
            None
        };
        SubStep { periods, dt_s: f64::from(periods) * period_s, field_turns, field }
    }

    /// Currents during a part while the rotor turns at this velocity, from `held` up to its middle: the torque on the rotor, of the
    /// currents and of the detent, and how far the rotor has turned on to the middle.
    #[inline(always)]
    fn torque_nm(
        &mut self,
        held: &mut FieldFrame,
        book: &mut Book,
        part: &SubStep,
        (resistance_ohm, limit_v): (f64, f64),
        (to_middle_rad_s, mean_rad_s): (f64, f64),
    ) -> (f64, f64) {
        let stepper = &self.model.stepper;
        let teeth = f64::from(stepper.teeth);
        let field_rad = part.field_turns * TAU;
        let to_middle_rad = 0.5 * part.dt_s * teeth * to_middle_rad_s;
        held.ahead = held.ahead.turned_by(Axis::at_small_rad(to_middle_rad - 0.5 * field_rad));
        let along_a = Dq { d: self.field.settings.amplitude_a, q: 0.0 };
        let (wanted_a, detent_nm) = match part.field {
            None => (along_a, 0.0),
            Some(field) => {
                let balanced = self.field.settings.detent_a != 0.0;
                let rotor = held.ahead.turned_by(field);
                (
                    if balanced { self.field.wanted_a(field) } else { along_a },
                    -stepper.detent_nm * four_times(rotor.sin, rotor.cos),
                )
            }
        };
        let step = FieldStep {
            dt_s: part.dt_s,
            periods: part.periods,
            field_rad,
            rotor_rad: part.dt_s * teeth * mean_rad_s,
            ahead: held.ahead,
            resistance_ohm,
            inductance_h: stepper.inductance_h,
            flux_linkage_wb: stepper.flux_linkage_wb,
            limit_v,
        };
        let torque_constant = stepper.torque_constant_nm_a();
        let wanted_v = self.field.wanted_v(wanted_a, held.current_a);
        let FieldOutput { torque_a, holding_a, heat_w_per_ohm } =
            self.field.step(&mut held.current_a, wanted_a, wanted_v, &step);
        let Dq { d, q } = held.current_a;
        book.largest_square = book.largest_square.max(d * d + q * q);
        book.heat_j_per_ohm += heat_w_per_ohm * part.dt_s;
        book.holding_a_s += holding_a * part.dt_s;
        (torque_constant * torque_a, detent_nm)
    }

    /// A part in which the rotor moves on its own.
    #[inline]
    fn swing_part(&mut self, held: &mut FieldFrame, book: &mut Book, part: &SubStep, input: (f64, f64)) {
        let before_rad_s = if self.rig.load.locked { 0.0 } else { self.rotor.velocity_rad_s };
        // The change is kept as that of a control period, whatever the length of a part.
        let change = f64::from(part.periods) * self.rotor.velocity_change_rad_s;
        let expected_rad_s = if self.rig.load.locked { 0.0 } else { before_rad_s + 0.5 * change };
        let held_before_a_s = book.holding_a_s;
        let (current_nm, detent_nm) = self.torque_nm(held, book, part, input, (before_rad_s, expected_rad_s));
        let motor_nm = current_nm + detent_nm;
        let (mean_rad_s, friction_j, load_j) = if self.rig.is_joined() {
            let turned = self.rig.turn_attached((&self.model.rotor, &mut self.rotor), part.dt_s, motor_nm, 0.0);
            (turned.mean_rad_s, turned.friction_j, turned.load_j)
        } else {
            let model = &self.model;
            let stiffness_s = f64::from(model.stepper.teeth)
                * model.stepper.torque_constant_nm_a()
                * (book.holding_a_s - held_before_a_s).max(0.0);
            // So much heavier the rule swings a rotor in its own time, to the fourth power of the part.
            let heavier = stiffness_s * part.dt_s * (1.0 / 12.0);
            let load = Load { inertia_kg_m2: self.rig.load.inertia_kg_m2 + heavier, ..self.rig.load };
            let moved = model.rotor.step(&mut self.rotor, part.dt_s, motor_nm, &load, 0.0);
            self.rotor.angle = self.rotor.angle.advanced_by(moved.velocity_rad_s * part.dt_s * (1.0 / TAU));
            let after_rad_s = self.rotor.velocity_rad_s;
            let kinetic_j = 0.5 * heavier * (after_rad_s - before_rad_s) * (after_rad_s + before_rad_s);
            (moved.velocity_rad_s, moved.friction_j + kinetic_j, moved.load_j)
        };
        self.rotor.velocity_change_rad_s /= f64::from(part.periods);
        let teeth = f64::from(self.model.stepper.teeth);
        let rest_rad = part.dt_s * teeth * (mean_rad_s - 0.5 * before_rad_s) - 0.5 * part.field_turns * TAU;
        held.ahead = held.ahead.turned_by(Axis::at_small_rad(rest_rad));
        let way_rad = mean_rad_s * part.dt_s;
        book.motor_j += current_nm * way_rad;
        book.detent_j += detent_nm * way_rad;
        book.motor_nm_s += motor_nm * part.dt_s;
        book.friction_j += friction_j;
        book.load_j += load_j;
    }

    /// A part in which the rotor turns on as it does, since what moves it comes after.
    #[cold]
    #[inline(never)]
    fn push_part(
        &mut self,
        held: &mut FieldFrame,
        book: &mut Book,
        part: &SubStep,
        input: (f64, f64),
        velocity_rad_s: f64,
    ) {
        let (current_nm, detent_nm) = self.torque_nm(held, book, part, input, (velocity_rad_s, velocity_rad_s));
        let rest_rad =
            0.5 * part.dt_s * f64::from(self.model.stepper.teeth) * velocity_rad_s - 0.5 * part.field_turns * TAU;
        held.ahead = held.ahead.turned_by(Axis::at_small_rad(rest_rad));
        book.motor_j += current_nm * velocity_rad_s * part.dt_s;
        book.current_nm_s += current_nm * part.dt_s;
        book.motor_nm_s += (current_nm + detent_nm) * part.dt_s;
    }

    /// Hands a coupled shaft's torque to its machine.
    fn push(&mut self, motor_nm: f64, flows: Flows, dt_s: f64) {
        let pending = PendingStep { flows, motor_nm, dt_s, bleeder_on: false };
        self.rig.push_directly((&self.model.rotor, &self.rotor), pending, 0.0);
        // What the shaft turns otherwise than expected the field gives by its spring and its damping: implicitly, so that no step is too
        // long for it.
        let Expected { velocity_rad_s, give_nm_s, .. } = self.expected;
        if let Some(coupled) = &mut self.rig.coupled {
            coupled.push.torque_nm += give_nm_s * velocity_rad_s;
            coupled.push.viscous_nm_s += give_nm_s;
        }
    }

    /// What the field gave while a coupled shaft turned is work of the motor, and no heat of its friction.
    pub(crate) fn give(&mut self, flows: &mut Flows, mean_rad_s: f64, dt_s: f64) {
        let Expected { velocity_rad_s, give_nm_s, current_nm, motor_j } = self.expected;
        let way_rad = mean_rad_s * dt_s;
        let given_nm = give_nm_s * (mean_rad_s - velocity_rad_s);
        flows.friction_j -= give_nm_s * mean_rad_s * way_rad;
        flows.load_j += give_nm_s * velocity_rad_s * way_rad;
        flows.bus_w += ((current_nm - given_nm) * way_rad - motor_j) / dt_s;
        self.torque_nm -= given_nm;
    }

    /// Bus and energies of a long step, and now and then the slow things.
    pub(crate) fn book_long(&mut self, dt_s: f64, mut flows: Flows) {
        if self.rotor.velocity_rad_s.abs() > self.model.bearing_limit_rad_s {
            flows.friction_j += self.seize();
        }
        let bus_v = self.rig.supply.bus_v;
        let (clamp, broken_down) = (self.model.clamp, self.broken_down);
        let beside_w = |bus_v: f64| clamp.power_w(bus_v) + Self::breakdown_w(broken_down, bus_v);
        let quiet = !broken_down && bus_v <= clamp.from_v;
        let bus_w = flows.bus_w + if quiet { 0.0 } else { beside_w(bus_v) };
        self.bus_current_a = if bus_v > 0.0 { bus_w / bus_v } else { 0.0 };
        let due = if quiet {
            self.rig.step_long(&self.model.rig, dt_s, &flows, |_| 0.0)
        } else {
            self.rig.step_long(&self.model.rig, dt_s, &flows, beside_w)
        };
        if due {
            self.step_slow();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::field_loop::FieldLoop;
    use crate::stepper_motor::StepperMotorModel;

    fn motor(inertia_kg_m2: f64) -> StepperMotor {
        let mut motor = StepperMotor::new(StepperMotorModel::ZLIM42_C_70, Angle::default(), 24.0, 25.0);
        motor.rig.load.inertia_kg_m2 = inertia_kg_m2;
        motor.field.settings = FieldLoop {
            pulse_turns: 1.0 / 80.0,
            amplitude_a: 1.2,
            proportional: 15.0,
            integral_per_s: 1500.0,
            modulation_limit: 0.98,
            voltage_lag_s: 75e-6,
            ..FieldLoop::default()
        };
        (0..200).for_each(|_| motor.follow_long(1e-3));
        motor
    }

    /// Where the rotor is each millisecond after a push, rad of the field.
    fn swing(motor: &StepperMotor, dt_s: f64) -> [f64; 12] {
        let mut motor = motor.clone();
        motor.rotor.velocity_rad_s = 6.0;
        core::array::from_fn(|_| {
            (0..(1e-3 / dt_s + 0.5) as u32).for_each(|_| motor.follow_long(dt_s));
            motor.rotor.angle.as_rad() * 50.0
        })
    }

    #[test]
    fn a_rotor_swings_as_it_does_in_steps_of_a_control_period() {
        for inertia_kg_m2 in [0.0, 20e-6, 200e-6] {
            let motor = motor(inertia_kg_m2);
            let (long, short) = (swing(&motor, 1e-3), swing(&motor, 50e-6));
            let most = short.iter().fold(0.0, |most: f64, rad| most.max(rad.abs()));
            for (long, short) in long.iter().zip(&short) {
                assert!((long - short).abs() < 0.15 * most, "{inertia_kg_m2} kg m²: {long} and {short} of {most} rad");
            }
        }
    }

    #[test]
    fn a_rotor_at_rest_stays_to_the_last_bit_and_takes_the_power_of_its_resistance() {
        let mut motor = motor(0.0);
        let (angle, winding_j) = (motor.rotor.angle, motor.rig.energy.winding_j + motor.rig.energy.switches_j);
        (0..1000).for_each(|_| motor.follow_long(1e-3));
        assert_eq!(motor.rotor.angle, angle);
        // 1.2 A along one phase, through winding and switches at 25 °C and some tenths; the electronics' watt warms the same board.
        let ohm = 1.65 * (1.0 + 0.003_93 * 5.0) + 0.2;
        let taken_j = motor.rig.energy.winding_j + motor.rig.energy.switches_j - winding_j;
        assert!((taken_j / (1.44 * ohm) - 1.0).abs() < 0.02, "{taken_j} J");
    }

    #[test]
    fn whole_pulses_put_the_field_half_a_pulse_back_in_the_mean_and_on_its_pulse_when_it_stands() {
        let path = |per_period: f64| Path { pulses: 7.25, per_period, pulse_turns: 0.0125 };
        assert_eq!(path(0.0).at(10.0, 10.0), 7.0);
        for per_period in [0.2, 0.9, -3.0] {
            let at = path(per_period).at(10.0, 10.0);
            assert!((at - (7.25 + 10.0 * per_period - 0.5)).abs() < 1e-5, "{per_period}: {at}");
        }
        // A pulse in the middle of a part: half of it before, half after.
        let halfway = Path { pulses: 6.9, per_period: 0.02, pulse_turns: 0.0125 }.at(5.0, 10.0);
        assert!((halfway - 6.5).abs() < 1e-4, "{halfway}");
    }
}

//! A hybrid stepper on the power stage of an open-loop drive: the whole plant of an integrated stepper.
//!
//! In goes what the two bridges do ([`Bridges`]), out comes what the drive's sensors read ([`Sensors`]). There is no
//! position sensor: a rotor that is overloaded slips by whole electrical turns (four full steps) and nothing in the
//! readings shows it; only [`StepperMotor::rotor`], the truth, does. The load, the supply, the faults and the
//! surroundings are plain fields that a test or a person at a bench changes at any time.
//!
//! A rotor that a load drives has its friction, its iron loss, and from some speed on the bus that its voltage charges through
//! the diodes, up to the suppressors. A board that these have heated through loses a transistor; bearings beyond their limit
//! seize.
//!
//! The rotor hangs on the field as on a spring and rings at some 300 Hz with hardly any damping, as the real one does
//! when a drive dwells at its resonance. [`RotorData::turn`] moves the angle before the torque of the step is known,
//! which gives such a ringing `(w dt)^3 / 8` of critical damping back: 1e-4 at 50 µs, a thirtieth of its friction's.

use crate::angle::{Angle, Axis};
use crate::clamp::ClampModel;
use crate::current_loop::is_long;
use crate::field_loop::{Expected, FieldData};
use crate::flows::Flows;
use crate::mechanics::{RotorData, RotorModel};
use crate::motor::{self, Motor};
use crate::physics::{Physics, load_velocity_rad_s};
use crate::rig::{Rig, RigModel};
use crate::shaft::{Motion, PendingStep, Turned};
use crate::stepper::{Bridges, Phase, StepperData, StepperInput, StepperModel, Stepping, Turn};
use crate::thermal::reading_c;

/// Assumed: two wires that touch have 1 ohm with their contact. It is enough to be noticed before the bus collapses.
const SHORT_OHM: f64 = 1.0;

/// Assumed: a transistor that has broken down, with the one that works beside it.
const BREAKDOWN_OHM: f64 = 5.0;

/// What never changes about a stepper and the power stage it is wired to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperMotorModel {
    /// The name it is published under.
    pub name: &'static str,
    /// Windings, magnets and teeth.
    pub stepper: StepperModel,
    /// Inertia and friction of the motor alone.
    pub rotor: RotorModel,
    /// Warm bodies, power stage and supply. The drive has no bleeder: it is never switched on.
    pub rig: RigModel,
    /// What limits the voltage of the bus.
    pub clamp: ClampModel,
    /// Temperature of the board at which a transistor breaks down.
    pub power_stage_limit_c: f64,
    /// Speed at which the bearings seize.
    pub bearing_limit_rad_s: f64,
}

/// What the drive's sensors read at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// Currents of phases A and B, at the bridges.
    pub phase_current_a: [f64; 2],
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Current that the bridges take from the bus, mean over the last step.
    pub bus_current_a: f64,
    /// Temperature of the windings.
    pub winding_c: f64,
    /// Temperature of the power stage's heat sink, likewise.
    pub heat_sink_c: f64,
}

/// A stepper that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct StepperMotor {
    /// Its constants.
    pub model: StepperMotorModel,
    /// Phase currents.
    pub stepper: StepperData,
    /// Angle and velocity.
    pub rotor: RotorData,
    /// A phase whose wire has come off.
    pub lost_phase: Option<Phase>,
    /// A phase whose two wires touch: the bridge feeds the contact, the winding brakes the rotor.
    pub shorted_phase: Option<Phase>,
    /// A transistor of the bridges has broken down: it takes current from the bus whether they switch or not.
    pub broken_down: bool,
    /// Load, supply, temperatures and energies.
    pub rig: Rig,
    /// Torque of the motor on its rotor, detent included, mean over the last step.
    pub torque_nm: f64,
    /// The current loop, where the power stage follows by itself ([`follow_long`](Self::follow_long)).
    pub field: FieldData,
    /// The longest current vector in the last step of such a power stage.
    pub(crate) largest_a: Option<f64>,
    pub(crate) expected: Expected,
    seized: bool,
    overheated: bool,
    pub(crate) axis: Axis,
    pub(crate) bus_current_a: f64,
    /// Current through the contact of two wires.
    short_a: f64,
}

impl StepperMotor {
    /// A motor at rest at an angle, its bus charged from a source of `source_v`, all at `ambient_c`.
    pub fn new(model: StepperMotorModel, angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        StepperMotor {
            model,
            stepper: StepperData::default(),
            rotor: RotorData { angle, ..RotorData::default() },
            lost_phase: None,
            shorted_phase: None,
            broken_down: false,
            rig: Rig::new(&model.rig, model.stepper.resistance_ohm, source_v, ambient_c),
            torque_nm: 0.0,
            field: FieldData::default(),
            largest_a: None,
            expected: Expected::default(),
            seized: false,
            overheated: false,
            axis: magnet_axis(&model, angle),
            bus_current_a: 0.0,
            short_a: 0.0,
        }
    }

    /// One step: windings, rotor, bus, energies, and now and then heat. Meant for 50 µs and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, bridges: &Bridges) {
        if self.rig.is_joined() {
            return self.step_joined(dt_s, bridges);
        }
        let velocity_rad_s = self.rotor.turn(dt_s, &self.rig.load);
        let turn = Turn::new(self.axis, 0.5 * dt_s * f64::from(self.model.stepper.teeth) * velocity_rad_s);
        self.axis = turn.end();
        let (torque_nm, mut flows) = self.drive(dt_s, bridges, turn);
        let moved = self.model.rotor.step(&mut self.rotor, dt_s, torque_nm, &self.rig.load, 0.0);
        (flows.friction_j, flows.load_j) = (moved.friction_j, moved.load_j);
        self.book(dt_s, flows);
    }

    /// Windings, with what is broken and what the suppressors take: the torque on the rotor and where the energy went.
    #[inline(always)]
    pub(crate) fn drive(&mut self, dt_s: f64, bridges: &Bridges, turn: Turn) -> (f64, Flows) {
        let bus_v = self.rig.supply.bus_v;
        let broken_w = self.broken_w(bridges, bus_v);
        let model = &self.model;
        let input = StepperInput {
            bridges: *bridges,
            bus_v,
            lost_phase: self.lost_phase,
            shorted_phase: self.shorted_phase,
            resistance_ohm: self.rig.path_ohm(&model.rig),
            turn,
        };
        let motor = model.stepper.step(&mut self.stepper, dt_s, &input);
        self.torque_nm = motor.torque_nm + model.stepper.detent_torque_nm(&turn);
        let bus_w = motor.bus_w + broken_w;
        self.bus_current_a = if bus_v > 0.0 { bus_w / bus_v } else { 0.0 };
        let clamp_w = model.clamp.power_w(bus_v);
        let flows = Flows {
            bus_w: bus_w + clamp_w,
            heat_w_per_ohm: motor.heat_w_per_ohm,
            arc_j: motor.arc_j + (broken_w + clamp_w) * dt_s,
            ..Flows::default()
        };
        (self.torque_nm, flows)
    }

    /// The step of a shaft that is not a plain one. The windings go by the velocity that is expected in the middle of the step, the
    /// angle by the real one.
    #[cold]
    #[inline(never)]
    fn step_joined(&mut self, dt_s: f64, bridges: &Bridges) {
        let velocity_rad_s = self.rotor.velocity_rad_s + 0.5 * self.rotor.velocity_change_rad_s;
        let turn = Turn::new(self.axis, 0.5 * dt_s * f64::from(self.model.stepper.teeth) * velocity_rad_s);
        let (motor_nm, flows) = self.drive(dt_s, bridges, turn);
        let pending = PendingStep { flows, motor_nm, dt_s, bleeder_on: false };
        let model = &self.model;
        if self.rig.is_coupled() {
            self.rig.push_directly((&model.rotor, &self.rotor), pending, 0.0);
        } else {
            let turned = self.rig.turn_attached((&model.rotor, &mut self.rotor), dt_s, motor_nm, 0.0);
            self.finish_joined(pending, &turned);
        }
    }

    fn finish_joined(&mut self, pending: PendingStep, turned: &Turned) {
        let PendingStep { mut flows, dt_s, .. } = pending;
        let turn_rad = dt_s * f64::from(self.model.stepper.teeth) * turned.mean_rad_s;
        self.axis = self.axis.turned_by(Axis::at_small_rad(turn_rad));
        (flows.friction_j, flows.load_j) = (turned.friction_j, turned.load_j);
        if is_long(dt_s) {
            if self.rig.is_coupled() {
                self.give(&mut flows, turned.mean_rad_s, dt_s);
            }
            return self.book_long(dt_s, flows);
        }
        self.book(dt_s, flows);
    }

    /// Bus and energies, and now and then the slow things.
    #[inline(always)]
    fn book(&mut self, dt_s: f64, mut flows: Flows) {
        if self.rotor.velocity_rad_s.abs() > self.model.bearing_limit_rad_s {
            flows.friction_j += self.seize();
        }
        if self.rig.step(&self.model.rig, dt_s, &flows, false) {
            self.step_slow();
        }
    }

    /// The bearings seize. What that takes from the moving masses.
    #[cold]
    pub(crate) fn seize(&mut self) -> f64 {
        self.seized = true;
        self.rig.seize(&self.model.rotor, &mut self.rotor)
    }

    /// Blocks the rotor, or frees it; seized bearings are new ones then.
    pub fn lock_rotor(&mut self, locked: bool) {
        self.rig.load.locked = locked;
        self.seized = false;
    }

    /// The bearings have seized.
    pub fn is_seized(&self) -> bool {
        self.seized
    }

    /// A transistor breaks down, or a new, cold board is put in.
    pub fn set_broken_down(&mut self, broken: bool) {
        if self.overheated {
            self.rig.heat_sink.temperature_c = self.rig.ambient_c;
        }
        self.broken_down = broken;
        self.overheated = false;
    }

    /// Heat has broken a transistor down.
    pub fn is_overheated(&self) -> bool {
        self.overheated
    }

    /// Power that goes into what is broken, and the current of a short circuit.
    #[inline]
    fn broken_w(&mut self, bridges: &Bridges, bus_v: f64) -> f64 {
        self.short_a = 0.0;
        if self.shorted_phase.is_none() && !self.broken_down {
            return 0.0;
        }
        let short_v = match (self.shorted_phase, bridges) {
            (Some(phase), Bridges::Driven(duty)) => duty[phase as usize].clamp(-1.0, 1.0) * bus_v,
            _ => 0.0,
        };
        self.short_a = short_v / (SHORT_OHM + self.model.rig.switch_resistance_ohm);
        short_v * self.short_a + Self::breakdown_w(self.broken_down, bus_v)
    }

    /// What a transistor takes from the bus that has broken down.
    #[inline]
    pub(crate) fn breakdown_w(broken_down: bool, bus_v: f64) -> f64 {
        if broken_down { bus_v * bus_v / BREAKDOWN_OHM } else { 0.0 }
    }

    /// Heat of the last steps into the bodies, the windings' resistance, and the magnets' direction afresh.
    pub(crate) fn step_slow(&mut self) {
        self.rig.step_slow(&self.model.rig, self.model.stepper.resistance_ohm);
        let board = &self.rig.heat_sink;
        if board.hold_c.is_none() && board.temperature_c > self.model.power_stage_limit_c && !self.broken_down {
            (self.broken_down, self.overheated) = (true, true);
        }
        self.axis = magnet_axis(&self.model, self.rotor.angle);
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        let mut phase_current_a = self.stepper.current_a;
        if let Some(phase) = self.shorted_phase {
            phase_current_a[phase as usize] = self.short_a;
        }
        Sensors {
            phase_current_a,
            bus_v: self.rig.supply.bus_v,
            bus_current_a: self.bus_current_a,
            winding_c: reading_c(self.rig.winding.temperature_c),
            heat_sink_c: reading_c(self.rig.heat_sink.temperature_c),
        }
    }

    /// The longest current vector in the last step of a power stage that follows by itself.
    pub fn largest_current_a(&self) -> Option<f64> {
        self.largest_a
    }

    /// Energy stored now: in motion, in the windings' field, in the detent and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        self.rig.mechanical_j(&self.model.rotor, &self.rotor)
            + self.model.stepper.magnetic_energy_j(&self.stepper)
            + self.model.stepper.detent_energy_j(magnet_axis(&self.model, self.rotor.angle))
            + self.model.rig.supply.stored_energy_j(&self.rig.supply)
    }
}

impl Motor for StepperMotor {
    type Pins = Bridges;
    /// A transistor has broken down.
    type Wear = bool;

    motor::parts!(StepperMotor);

    fn stepping(&self) -> Option<Stepping> {
        let rig = &self.model.rig;
        Some(Stepping {
            windings: self.model.stepper,
            resistance_per_k: rig.resistance_per_k,
            switch_resistance_ohm: rig.switch_resistance_ohm,
        })
    }

    fn physics(&self) -> Physics {
        let velocity_rad_s = load_velocity_rad_s(&self.rig, self.rotor.velocity_rad_s);
        let [a, b] = self.sense().phase_current_a;
        Physics {
            motor_torque_nm: self.torque_nm,
            phase_current_a: [Some(a), Some(b), None],
            stored_j: self.stored_j(),
            ..Physics::of_rig(&self.rig, (self.load_angle(), velocity_rad_s))
        }
    }

    fn bleeds(&self, _pins: &Bridges) -> bool {
        false
    }

    fn wear(&self) -> bool {
        self.broken_down
    }

    fn follow(&mut self, motion: &Motion) {
        if let Some((pending, turned)) = self.rig.follow(&mut self.rotor, motion) {
            self.finish_joined(pending, &turned);
        }
    }
}

fn magnet_axis(model: &StepperMotorModel, angle: Angle) -> Axis {
    Axis::at_turns(angle.fraction() * f64::from(model.stepper.teeth))
}

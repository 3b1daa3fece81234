//! A hybrid stepper on the power stage of an open-loop drive: the whole plant of an integrated stepper.
//!
//! In goes what the two bridges do ([`Bridges`]), out comes what the drive's sensors read ([`Sensors`]). There is no
//! position sensor: a rotor that is overloaded slips by whole electrical turns (four full steps) and nothing in the
//! readings says so; only [`StepperMotor::rotor`], the truth, does. The load, the supply, the faults and the
//! surroundings are plain fields that a test or a person at a bench changes at any time.
//!
//! The rotor hangs on the field as on a spring and rings at some 300 Hz with hardly any damping, as the real one does
//! when a drive dwells at its resonance. [`RotorData::turn`] moves the angle before the torque of the step is known,
//! which gives such a ringing `(w dt)^3 / 8` of critical damping back: 1e-4 at 50 µs, a thirtieth of its friction's.

use crate::angle::{Angle, Axis};
use crate::mechanics::{RotorData, RotorModel};
use crate::rig::{Flows, Rig, RigModel};
use crate::stepper::{Bridges, Phase, StepperData, StepperInput, StepperModel, Turn};

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
}

/// What the drive's sensors read at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// Currents of phases A and B.
    pub phase_current_a: [f64; 2],
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Temperature of the windings.
    pub winding_c: f64,
    /// Temperature of the power stage's heat sink.
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
    /// Load, supply, temperatures and energies.
    pub rig: Rig,
    /// Torque of the motor on its rotor, detent included, mean over the last step.
    pub torque_nm: f64,
    axis: Axis,
}

impl StepperMotor {
    /// A motor at rest at an angle, its bus charged from a source of `source_v`, all at `ambient_c`.
    pub fn new(model: StepperMotorModel, angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        StepperMotor {
            model,
            stepper: StepperData::default(),
            rotor: RotorData { angle, ..RotorData::default() },
            lost_phase: None,
            rig: Rig::new(&model.rig, model.stepper.resistance_ohm, source_v, ambient_c),
            torque_nm: 0.0,
            axis: magnet_axis(&model, angle),
        }
    }

    /// One step: windings, rotor, bus, energies, and now and then heat. Meant for 50 µs and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, bridges: &Bridges) {
        let model = &self.model;
        let velocity_rad_s = self.rotor.turn(dt_s, &self.rig.load);
        let turn = Turn::new(self.axis, 0.5 * dt_s * f64::from(model.stepper.teeth) * velocity_rad_s);
        self.axis = turn.end();
        let input = StepperInput {
            bridges: *bridges,
            bus_v: self.rig.supply.bus_v,
            lost_phase: self.lost_phase,
            resistance_ohm: self.rig.path_ohm(&model.rig),
            turn,
        };
        let motor = model.stepper.step(&mut self.stepper, dt_s, &input);
        let torque_nm = motor.torque_nm + model.stepper.detent_torque_nm(&turn);
        let moved = model.rotor.step(&mut self.rotor, dt_s, torque_nm, &self.rig.load, 0.0);
        self.torque_nm = torque_nm;

        let flows = Flows {
            bus_w: motor.bus_w,
            heat_w_per_ohm: motor.heat_w_per_ohm,
            arc_j: motor.arc_j,
            friction_j: moved.friction_j,
            load_j: moved.load_j,
        };
        if self.rig.step(&model.rig, dt_s, &flows, false) {
            self.step_slow();
        }
    }

    /// Heat of the last steps into the bodies, the windings' resistance, and the magnets' direction afresh.
    fn step_slow(&mut self) {
        self.rig.step_slow(&self.model.rig, self.model.stepper.resistance_ohm);
        self.axis = magnet_axis(&self.model, self.rotor.angle);
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        Sensors {
            phase_current_a: self.stepper.current_a,
            bus_v: self.rig.supply.bus_v,
            winding_c: self.rig.winding.temperature_c,
            heat_sink_c: self.rig.heat_sink.temperature_c,
        }
    }

    /// Energy stored now: in motion, in the windings' field, in the detent and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        self.model.rotor.kinetic_energy_j(&self.rotor, &self.rig.load)
            + self.model.stepper.magnetic_energy_j(&self.stepper)
            + self.model.stepper.detent_energy_j(magnet_axis(&self.model, self.rotor.angle))
            + self.model.rig.supply.stored_energy_j(&self.rig.supply)
    }
}

fn magnet_axis(model: &StepperMotorModel, angle: Angle) -> Axis {
    Axis::at_turns(angle.fraction() * f64::from(model.stepper.teeth))
}

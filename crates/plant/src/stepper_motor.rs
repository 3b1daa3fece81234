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
use crate::hub_motor::Energy;
use crate::mechanics::{Load, RotorData, RotorModel};
use crate::stepper::{Bridges, Phase, StepperData, StepperInput, StepperModel, Turn};
use crate::supply::{SupplyData, SupplyModel};
use crate::thermal::{BodyData, BodyModel, resistance_at_ohm};

/// Steps between two looks at the slow things: heat, resistance, and the exact direction of the magnets.
const SLOW_EVERY: u32 = 16;

/// What never changes about a stepper and the power stage it is wired to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperMotorModel {
    /// The name it is published under.
    pub name: &'static str,
    /// Windings, magnets and teeth.
    pub stepper: StepperModel,
    /// Inertia and friction of the motor alone.
    pub rotor: RotorModel,
    /// The windings as a warm body.
    pub winding: BodyModel,
    /// Change of the windings' resistance per kelvin, relative to that at 20 °C.
    pub resistance_per_k: f64,
    /// The power stage's heat sink as a warm body.
    pub heat_sink: BodyModel,
    /// Resistance of the power stage's switches and wires in each phase.
    pub switch_resistance_ohm: f64,
    /// The direct-voltage side. The drive has no bleeder: it is never switched on.
    pub supply: SupplyModel,
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
    /// Winding temperature.
    pub winding: BodyData,
    /// Heat-sink temperature.
    pub heat_sink: BodyData,
    /// Source and bus.
    pub supply: SupplyData,
    /// What the shaft is joined to.
    pub load: Load,
    /// Temperature of the surroundings.
    pub ambient_c: f64,
    /// Energy book. The arc of a wire that comes off under current counts as heat of the switches.
    pub energy: Energy,
    /// Torque of the motor on its rotor, detent included, mean over the last step.
    pub torque_nm: f64,
    axis: Axis,
    winding_ohm: f64,
    slow: Slow,
}

/// When the slow things were last looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Slow {
    steps: u32,
    time_s: f64,
    winding_j: f64,
    heat_sink_j: f64,
}

impl StepperMotor {
    /// A motor at rest at an angle, its bus charged from a source of `source_v`, all at `ambient_c`.
    pub fn new(model: StepperMotorModel, angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        StepperMotor {
            model,
            stepper: StepperData::default(),
            rotor: RotorData { angle, ..RotorData::default() },
            lost_phase: None,
            winding: model.winding.at_ambient(ambient_c),
            heat_sink: model.heat_sink.at_ambient(ambient_c),
            supply: SupplyData::charged(source_v),
            load: Load::default(),
            ambient_c,
            energy: Energy::default(),
            torque_nm: 0.0,
            axis: magnet_axis(&model, angle),
            winding_ohm: winding_resistance_ohm(&model, ambient_c),
            slow: Slow::default(),
        }
    }

    /// One step: windings, rotor, bus, energies, and now and then heat. Meant for 50 µs and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, bridges: &Bridges) {
        let model = &self.model;
        let velocity_rad_s = self.rotor.turn(dt_s, &self.load);
        let turn = Turn::new(self.axis, 0.5 * dt_s * f64::from(model.stepper.teeth) * velocity_rad_s);
        self.axis = turn.end();
        let input = StepperInput {
            bridges: *bridges,
            bus_v: self.supply.bus_v,
            lost_phase: self.lost_phase,
            resistance_ohm: self.winding_ohm + model.switch_resistance_ohm,
            turn,
        };
        let motor = model.stepper.step(&mut self.stepper, dt_s, &input);
        let torque_nm = motor.torque_nm + model.stepper.detent_torque_nm(&turn);
        let moved = model.rotor.step(&mut self.rotor, dt_s, torque_nm, &self.load, 0.0);
        let bus = model.supply.step(&mut self.supply, dt_s, motor.bus_w, false);
        self.torque_nm = torque_nm;

        self.energy.source_j += bus.source_j;
        self.energy.winding_j += motor.heat_w_per_ohm * self.winding_ohm * dt_s;
        self.energy.switches_j += motor.heat_w_per_ohm * model.switch_resistance_ohm * dt_s + motor.arc_j;
        self.energy.friction_j += moved.friction_j;
        self.energy.load_j += moved.load_j;
        self.energy.consumption_j += bus.consumption_j;

        self.slow.steps += 1;
        self.slow.time_s += dt_s;
        if self.slow.steps >= SLOW_EVERY {
            self.step_slow();
        }
    }

    /// Heat of the last steps into the bodies, the windings' resistance, and the magnets' direction afresh.
    fn step_slow(&mut self) {
        let Slow { time_s, winding_j, heat_sink_j, .. } = self.slow;
        let model = &self.model;
        let into_winding_j = self.energy.winding_j;
        let into_heat_sink_j = self.energy.switches_j + self.energy.consumption_j;
        if time_s > 0.0 {
            let winding_w = (into_winding_j - winding_j) / time_s;
            let heat_sink_w = (into_heat_sink_j - heat_sink_j) / time_s;
            model.winding.step(&mut self.winding, time_s, winding_w, self.ambient_c);
            model.heat_sink.step(&mut self.heat_sink, time_s, heat_sink_w, self.ambient_c);
        }
        self.winding_ohm = winding_resistance_ohm(model, self.winding.temperature_c);
        self.axis = magnet_axis(model, self.rotor.angle);
        self.slow = Slow { steps: 0, time_s: 0.0, winding_j: into_winding_j, heat_sink_j: into_heat_sink_j };
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        Sensors {
            phase_current_a: self.stepper.current_a,
            bus_v: self.supply.bus_v,
            winding_c: self.winding.temperature_c,
            heat_sink_c: self.heat_sink.temperature_c,
        }
    }

    /// Energy stored now: in motion, in the windings' field, in the detent and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        self.model.rotor.kinetic_energy_j(&self.rotor, &self.load)
            + self.model.stepper.magnetic_energy_j(&self.stepper)
            + self.model.stepper.detent_energy_j(magnet_axis(&self.model, self.rotor.angle))
            + self.model.supply.stored_energy_j(&self.supply)
    }
}

fn magnet_axis(model: &StepperMotorModel, angle: Angle) -> Axis {
    Axis::at_turns(angle.fraction() * f64::from(model.stepper.teeth))
}

/// Resistance of one phase at a temperature.
fn winding_resistance_ohm(model: &StepperMotorModel, winding_c: f64) -> f64 {
    resistance_at_ohm(model.stepper.resistance_ohm, model.resistance_per_k, winding_c)
}

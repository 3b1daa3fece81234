//! A hub motor with its sensors on the power stage of a drive: the whole plant of a single-axis drive.
//!
//! In goes what the drive's pins do ([`Actuation`]), out comes what its sensors read ([`Sensors`]). The load, the
//! supply, the faults and the surroundings are plain fields that a test or a person at a bench changes at any time.
//! Deliberately absent: switching ripple (a step sees the mean voltage), measurement noise, the drive's firmware.

use crate::angle::{Angle, Axis};
use crate::brake::BrakeModel;
use crate::encoder::{EncoderData, EncoderModel};
use crate::hall::{HallFault, HallModel};
use crate::mechanics::{Load, RotorData, RotorModel};
use crate::pmsm::{Phase, PmsmData, PmsmInput, PmsmModel, Terminals};
use crate::supply::{SupplyData, SupplyModel};
use crate::thermal::{BodyData, BodyModel, resistance_at_ohm};

/// Steps between two looks at the slow things: heat, resistance, and the exact direction of the magnets. Bodies are
/// a million steps slow, and turning the direction on by its series is off by 1e-11 in so many steps.
const SLOW_EVERY: u32 = 16;

/// What never changes about a hub motor and the power stage it is wired to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HubMotorModel {
    /// The name it is published under.
    pub name: &'static str,
    /// Winding and magnets.
    pub pmsm: PmsmModel,
    /// Inertia and friction of the motor alone.
    pub rotor: RotorModel,
    /// Incremental encoder.
    pub encoder: EncoderModel,
    /// Hall sensors.
    pub hall: HallModel,
    /// Holding brake.
    pub brake: BrakeModel,
    /// The winding as a warm body.
    pub winding: BodyModel,
    /// Change of the winding's resistance per kelvin, relative to that at 20 °C; 0.00393 for copper, 0 for none.
    pub resistance_per_k: f64,
    /// The power stage's heat sink as a warm body.
    pub heat_sink: BodyModel,
    /// Resistance of the power stage's switches and wires in each phase.
    pub switch_resistance_ohm: f64,
    /// The direct-voltage side.
    pub supply: SupplyModel,
}

/// What the drive's power stage does during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Actuation {
    /// The three half bridges.
    pub inverter: Inverter,
    /// The bleeder's switch is closed.
    pub bleeder_on: bool,
    /// The holding brake has current and lets go.
    pub brake_released: bool,
}

/// What the three half bridges do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Inverter {
    /// All switches off.
    #[default]
    Open,
    /// All wires joined to one rail.
    Shorted,
    /// Switching with these duty cycles of U, V, W, each 0 to 1.
    Driven([f64; 3]),
}

/// What the drive's sensors read at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// Hardware counter of the encoder's quadrature; wraps.
    pub encoder_count: u16,
    /// Hall state, 1 to 6; 0 or 7 with a fault.
    pub hall: u8,
    /// Currents of U, V, W, positive into the motor.
    pub phase_current_a: [f64; 3],
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Temperature of the winding.
    pub winding_c: f64,
    /// Temperature of the power stage's heat sink.
    pub heat_sink_c: f64,
}

/// Energies since power-on. The sum of what came in equals the sum of where it went; see [`HubMotor::stored_j`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// In: from the source.
    pub source_j: f64,
    /// Out: heat of the winding.
    pub winding_j: f64,
    /// Out: heat of the switches.
    pub switches_j: f64,
    /// Out: heat of all friction, brake included.
    pub friction_j: f64,
    /// Out: work done on the active load torque; negative while the load drove.
    pub load_j: f64,
    /// Out: heat of the bleeder.
    pub bleeder_j: f64,
    /// Out: the drive's own electronics.
    pub consumption_j: f64,
}

impl Energy {
    /// All that came in less all that went out: equals the change of the stored energy.
    pub fn balance_j(&self) -> f64 {
        self.source_j
            - (self.winding_j + self.switches_j + self.friction_j + self.load_j + self.bleeder_j + self.consumption_j)
    }
}

/// A hub motor that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct HubMotor {
    /// Its constants.
    pub model: HubMotorModel,
    /// Winding current.
    pub pmsm: PmsmData,
    /// Angle and velocity.
    pub rotor: RotorData,
    /// Encoder counter and its fault.
    pub encoder: EncoderData,
    /// Fault of the Hall sensors.
    pub hall_fault: HallFault,
    /// A motor wire that has come off.
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
    /// Energy book.
    pub energy: Energy,
    /// Torque of the motor on its rotor, mean over the last step.
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

impl HubMotor {
    /// A motor at rest at an angle, its bus charged from a source of `source_v`, all at `ambient_c`.
    pub fn new(model: HubMotorModel, angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        HubMotor {
            model,
            pmsm: PmsmData::default(),
            rotor: RotorData { angle, ..RotorData::default() },
            encoder: model.encoder.power_on(angle),
            hall_fault: HallFault::None,
            lost_phase: None,
            winding: model.winding.at_ambient(ambient_c),
            heat_sink: model.heat_sink.at_ambient(ambient_c),
            supply: SupplyData::charged(source_v),
            load: Load::default(),
            ambient_c,
            energy: Energy::default(),
            torque_nm: 0.0,
            axis: Axis::at_turns(model.pmsm.electrical_turns(angle)),
            winding_ohm: winding_resistance_ohm(&model, ambient_c),
            slow: Slow::default(),
        }
    }

    /// One step: winding, rotor, bus, encoder, energies, and now and then heat. Meant for 50 µs and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, actuation: &Actuation) {
        let model = &self.model;
        let velocity_rad_s = self.rotor.turn(dt_s, &self.load);
        let half_turn = Axis::at_small_rad(0.5 * dt_s * f64::from(model.pmsm.pole_pairs) * velocity_rad_s);
        let input = PmsmInput {
            terminals: actuation.inverter.terminals(self.supply.bus_v),
            lost_phase: self.lost_phase,
            resistance_ohm: self.winding_ohm + model.switch_resistance_ohm,
            axis: self.axis.turned_by(half_turn),
            velocity_rad_s,
        };
        self.axis = input.axis.turned_by(half_turn);
        let motor = model.pmsm.step(&mut self.pmsm, dt_s, &input);
        let brake_nm = model.brake.torque_nm(actuation.brake_released);
        let moved = model.rotor.step(&mut self.rotor, dt_s, motor.torque_nm, &self.load, brake_nm);
        let bus = model.supply.step(&mut self.supply, dt_s, motor.bus_w, actuation.bleeder_on);
        model.encoder.step(&mut self.encoder, self.rotor.angle);
        self.torque_nm = motor.torque_nm;

        self.energy.source_j += bus.source_j;
        self.energy.winding_j += motor.heat_w_per_ohm * self.winding_ohm * dt_s;
        self.energy.switches_j += motor.heat_w_per_ohm * model.switch_resistance_ohm * dt_s;
        self.energy.friction_j += moved.friction_j;
        self.energy.load_j += moved.load_j;
        self.energy.bleeder_j += bus.bleeder_j;
        self.energy.consumption_j += bus.consumption_j;

        self.slow.steps += 1;
        self.slow.time_s += dt_s;
        if self.slow.steps >= SLOW_EVERY {
            self.step_slow();
        }
    }

    /// Heat of the last steps into the bodies, the winding's resistance, and the magnets' direction afresh.
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
        self.axis = Axis::at_turns(model.pmsm.electrical_turns(self.rotor.angle));
        self.slow = Slow { steps: 0, time_s: 0.0, winding_j: into_winding_j, heat_sink_j: into_heat_sink_j };
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        let electrical = self.model.pmsm.electrical_turns(self.rotor.angle);
        Sensors {
            encoder_count: self.encoder.count,
            hall: self.model.hall.state(electrical, self.hall_fault),
            phase_current_a: self.model.pmsm.phase_current_a(&self.pmsm, self.axis),
            bus_v: self.supply.bus_v,
            winding_c: self.winding.temperature_c,
            heat_sink_c: self.heat_sink.temperature_c,
        }
    }

    /// Energy stored now: in motion, in the winding's field and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        self.model.rotor.kinetic_energy_j(&self.rotor, &self.load)
            + self.model.pmsm.magnetic_energy_j(&self.pmsm)
            + self.model.supply.stored_energy_j(&self.supply)
    }
}

/// Resistance of one phase of the winding at a temperature.
fn winding_resistance_ohm(model: &HubMotorModel, winding_c: f64) -> f64 {
    resistance_at_ohm(model.pmsm.resistance_ohm, model.resistance_per_k, winding_c)
}

impl Inverter {
    #[inline]
    pub(crate) fn terminals(&self, bus_v: f64) -> Terminals {
        match *self {
            Inverter::Open => Terminals::Open { bus_v },
            Inverter::Shorted => Terminals::Shorted,
            Inverter::Driven(duty) => Terminals::from_duties(duty, bus_v),
        }
    }
}

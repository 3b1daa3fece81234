//! What drives the motor: the control loops, what they are asked for, and what is shown of them.

use motion::field_weakening::{FieldWeakening, torque_share};
use motion::filter::{LowPass, LowPassGains};

use super::assumptions::{DISPLAY_FILTER_S, STATIONARY_RPM, SUPERVISION_PERIOD_S};
use super::gains::MODULATION_LIMIT;
use super::hardware::{PowerStage, Sensors};
use super::parameters::Parameters;
use crate::Fidelity;
use crate::engine::actuator::servo::{Servo, ServoLimits};
use crate::engine::axis::Demand;

/// Amplitude of a phase over the voltage of the bus.
const INV_SQRT_3: f32 = 0.577_350_26;

/// The mean of the largest voltage between two of three wires over the amplitude of a phase: `sqrt(3) * 3 / pi`.
const FARTHEST_WIRES: f32 = 1.653_986_7;

/// Loops and power stage.
#[derive(Clone, PartialEq)]
pub(super) struct Output {
    pub(super) servo: Servo,
    weakening: FieldWeakening,
    pub(super) demand: Demand,
    stage: PowerStage,
    shown_velocity_rpm: LowPass,
    /// In the amperes of 261Dh and 6078h.
    shown_current_a: LowPass,
}

impl Output {
    /// Motor free.
    pub(super) fn new(parameters: &Parameters) -> Self {
        Self {
            servo: Servo::new(&parameters.servo, 0, 0),
            weakening: FieldWeakening::default(),
            demand: Demand::Off,
            stage: PowerStage::Off,
            shown_velocity_rpm: LowPass::default(),
            shown_current_a: LowPass::default(),
        }
    }

    /// The motor's current, signed as its torque: once each supervision period, with what is shown.
    pub(super) fn measure(&mut self, parameters: &Parameters, sensors: &Sensors) -> f32 {
        self.servo.measure(&parameters.servo, &parameters.gains, sensors.phase_current_a);
        let shown = LowPassGains::from_time_constant(DISPLAY_FILTER_S, SUPERVISION_PERIOD_S);
        self.shown_velocity_rpm.update(&shown, self.servo.velocity_rpm());
        let current_a = self.servo.current_magnitude_a().copysign(self.servo.current_a());
        self.shown_current_a.update(&shown, current_a / parameters.amplitude);
        current_a
    }

    /// The loops, once each supervision period.
    pub(super) fn control(&mut self, parameters: &Parameters, position: i32, bus_v: f32) {
        let direct_a = self.weaken_field(parameters, bus_v);
        let Parameters { servo, gains, limits, .. } = parameters;
        let limits = ServoLimits { current_a: torque_share(limits.current_a, direct_a), ..*limits };
        self.servo.control(servo, gains, &self.demand, position, &limits);
    }

    /// The current against the magnets, for more speed than the bus gives by itself. A motor that stands needs its voltage
    /// for torque.
    fn weaken_field(&mut self, parameters: &Parameters, bus_v: f32) -> f32 {
        let turns = self.demand != Demand::Off && self.servo.velocity_rpm().abs() >= STATIONARY_RPM;
        let direct_a = if turns {
            let available_v = bus_v * INV_SQRT_3 * MODULATION_LIMIT;
            let wanted_v = self.servo.wanted_magnitude_v();
            self.weakening.update(&parameters.weakening, wanted_v, available_v, SUPERVISION_PERIOD_S)
        } else {
            self.weakening.reset();
            0.0
        };
        self.servo.set_direct_current(direct_a);
        direct_a
    }

    /// What the power stage is asked for, every control period.
    pub(super) fn modulate(&mut self, parameters: &Parameters, sensors: &Sensors) {
        if self.demand != Demand::Off {
            let Parameters { servo, gains, .. } = parameters;
            self.stage = match servo.fidelity {
                Fidelity::Full => {
                    let duty = self.servo.modulate(servo, gains, sensors.phase_current_a, sensors.bus_v);
                    PowerStage::Modulate { duty }
                }
                Fidelity::Mechanical => PowerStage::Follow(self.servo.current_demand(servo, gains)),
            };
        }
    }

    pub(super) fn power_stage(&self) -> PowerStage {
        if self.demand == Demand::Off { PowerStage::Off } else { self.stage }
    }

    pub(super) const fn shown_velocity_rpm(&self) -> f32 {
        self.shown_velocity_rpm.value
    }

    /// In the amperes of 261Dh and 6078h, signed.
    pub(super) const fn shown_current_a(&self) -> f32 {
        self.shown_current_a.value
    }

    /// Share of the bus voltage between two wires, signed as the current that is asked for; 0 with the motor free.
    pub(super) fn share(&self, bus_v: f32) -> f32 {
        if self.demand == Demand::Off {
            return 0.0;
        }
        let share = match &self.stage {
            PowerStage::Off => 0.0,
            PowerStage::Modulate { duty } => {
                let most = duty.iter().fold(0.0_f32, |most, duty| most.max(*duty));
                let least = duty.iter().fold(1.0_f32, |least, duty| least.min(*duty));
                most - least
            }
            // Between the two wires that are farthest apart: the mean over the sixth of a turn in which they are.
            PowerStage::Follow(_) if bus_v > 0.0 => {
                (FARTHEST_WIRES * self.servo.wanted_magnitude_v() / bus_v).min(MODULATION_LIMIT)
            }
            PowerStage::Follow(_) => 0.0,
        };
        if self.servo.setpoint_a() < 0.0 { -share } else { share }
    }
}

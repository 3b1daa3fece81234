//! What all axes share: bus, power stage, parameter store, braking resistor.

use devices::servo::faults::row;

use super::hardware::Sensors;
use super::motor::Motor;
use crate::engine::actuator::bleeder::BleederLimits;
use crate::engine::faults::{FaultSet, exceeds, exceeds_with_hysteresis};

/// Shares of the rated bus voltage: faults, their ways back, and the braking resistor.
const OVER_VOLTAGE: f32 = 1.4;
const UNDER_VOLTAGE: f32 = 0.6;
const VOLTAGE_HYSTERESIS: f32 = 0.05;
const BLEEDER_ON: f32 = 1.3;
const BLEEDER_OFF: f32 = 1.25;
/// Energy that the braking resistor takes at once, in seconds of its rated power.
const BLEEDER_OVERLOAD_S: f32 = 5.0;
/// Assumed: the limit of a drive's heat sink.
const DRIVE_LIMIT_C: f32 = 85.0;
const TEMPERATURE_HYSTERESIS_C: f32 = 10.0;
/// The bus is charged before under-voltage is looked for, supervision periods.
const SETTLING_PERIODS: u16 = 200;

/// What has to be remembered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Protection {
    supplied_for: u16,
}

impl Protection {
    /// The causes that are present now.
    pub(super) fn causes(&mut self, sensors: &Sensors, rated_v: f32, store_sound: bool, latched: FaultSet) -> FaultSet {
        let settled = self.supplied_for >= SETTLING_PERIODS;
        self.supplied_for = SETTLING_PERIODS.min(self.supplied_for + 1);
        let recovered = if latched.has(row::UNDER_VOLTAGE) { VOLTAGE_HYSTERESIS } else { 0.0 };
        let share = sensors.bus_v / rated_v;
        let over = exceeds_with_hysteresis(share, OVER_VOLTAGE, VOLTAGE_HYSTERESIS, latched.has(row::OVER_VOLTAGE));
        let hot = exceeds_with_hysteresis(
            sensors.drive_c,
            DRIVE_LIMIT_C,
            TEMPERATURE_HYSTERESIS_C,
            latched.has(row::DRIVE_TEMPERATURE),
        );
        FaultSet::NONE
            .with(row::OVER_VOLTAGE, over)
            .with(row::UNDER_VOLTAGE, settled && exceeds(UNDER_VOLTAGE + recovered, share))
            .with(row::DRIVE_TEMPERATURE, hot)
            .with(row::STORE, !store_sound || !sensors.store_ok)
    }
}

/// The braking resistor of a motor's data.
pub(super) fn bleeder_limits(motor: &Motor) -> BleederLimits {
    BleederLimits {
        enabled: motor.braking_w > 0.0 && motor.braking_ohm > 0.0,
        on_v: motor.bus_v * BLEEDER_ON,
        off_v: motor.bus_v * BLEEDER_OFF,
        conductance_s: if motor.braking_ohm > 0.0 { 1.0 / motor.braking_ohm } else { 0.0 },
        rated_w: motor.braking_w,
        overload_j: motor.braking_w * BLEEDER_OVERLOAD_S,
    }
}

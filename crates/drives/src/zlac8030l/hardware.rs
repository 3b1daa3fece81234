//! What the drive's pins read and do: the border between firmware and the physical world.

use super::storage;
use super::variations::VARIANT;
use crate::engine::actuator::servo::{CurrentDemand, Followed};
use crate::engine::storage::StoredImage;

/// What the drive measures, each control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Counter of the encoder's quadrature, four counts a line; wraps.
    pub encoder_count: u16,
    /// The receiver sees signals on the encoder's lines: false with the cable unplugged.
    pub encoder_wired: bool,
    /// Hall state: U bit 0, V bit 1, W bit 2; 0 and 7 are faults. Forward: 5, 1, 3, 2, 6, 4.
    pub hall: u8,
    /// Currents of phases U and V, A, positive into the motor.
    pub phase_current_a: [f32; 2],
    /// Voltage of the direct-voltage bus.
    pub bus_v: f32,
    /// Temperature of the motor's winding, degC.
    pub motor_c: f32,
    /// Temperature of the power stage, degC.
    pub driver_c: f32,
    /// The reference of the current measurement; [`REFERENCE_V`](super::assumptions::REFERENCE_V) when sound.
    pub reference_v: f32,
    /// Levels of inputs X0 and X1; an unconnected input is low.
    pub inputs: [bool; 2],
    /// The EEPROM answers.
    pub eeprom_ok: bool,
    /// What a power stage says that follows by itself ([`Fidelity::Mechanical`](crate::Fidelity)).
    pub followed: Option<Followed>,
}

impl Default for Sensors {
    /// A motor at rest in Hall state 5 at 48 V and 25 degC, nothing wrong.
    fn default() -> Self {
        Self {
            encoder_count: 0,
            encoder_wired: true,
            hall: 5,
            phase_current_a: [0.0; 2],
            bus_v: 48.0,
            motor_c: 25.0,
            driver_c: 25.0,
            reference_v: super::assumptions::REFERENCE_V,
            inputs: [false; 2],
            eeprom_ok: true,
            followed: None,
        }
    }
}

/// What the three half bridges do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PowerStage {
    /// All switches off: the motor is free.
    #[default]
    Off,
    /// Upper switches off, lower on: the motor's wires are joined and it brakes itself (202F:01, alarm PWM).
    Shorted,
    /// Switching with these duty cycles of U, V, W, each 0 to 1.
    Modulate {
        /// Duty cycles of U, V and W.
        duty: [f32; 3],
    },
    /// Whatever gives these currents ([`Fidelity::Mechanical`](crate::Fidelity)).
    Follow(CurrentDemand),
}

/// What the drive does until the next control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuation {
    /// The half bridges.
    pub power_stage: PowerStage,
    /// The bleeder's switch is closed.
    pub bleeder_on: bool,
    /// Levels of outputs Y0 and Y1.
    pub outputs: [bool; 2],
    /// Brake output B0 holds the shaft (2030h:0E = 1).
    pub brake_engaged: bool,
}

/// What the firmware finds at power-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// The address switches: 1 to 3 are node-IDs, any other value lets 200Dh decide.
    pub dip_address: u8,
    /// Contents of the EEPROM.
    pub eeprom: StoredImage,
}

impl Default for Hardware {
    /// As delivered: switches at 0, factory settings.
    fn default() -> Self {
        Self { dip_address: 0, eeprom: StoredImage::of(&storage::delivered(&VARIANT)) }
    }
}

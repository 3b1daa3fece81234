//! What the drive's pins read and do: the border between firmware and the physical world.

use super::led::Led;
use super::storage;
use super::variations::VARIANT;
use crate::engine::storage::StoredImage;

/// What the drive measures, each control period. There is no position sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Currents of phases A and B, A.
    pub phase_current_a: [f32; 2],
    /// Voltage of the direct-voltage bus.
    pub bus_v: f32,
    /// Current that the bridges take from the bus, A.
    pub bus_current_a: f32,
    /// The reference of the current measurement; [`REFERENCE_V`](super::assumptions::REFERENCE_V) when sound.
    pub reference_v: f32,
    /// Levels of inputs X0 to X3; an unconnected input is low.
    pub inputs: [bool; 4],
    /// The EEPROM answers.
    pub eeprom_ok: bool,
    /// The longest current vector since the last tick, A, of a power stage that follows by itself
    /// ([`Fidelity::Mechanical`](crate::Fidelity)): what a phase carries as it turns.
    pub largest_a: Option<f32>,
}

impl Default for Sensors {
    /// No current at 24 V, nothing wrong.
    fn default() -> Self {
        Self {
            phase_current_a: [0.0; 2],
            bus_v: 24.0,
            bus_current_a: 0.0,
            reference_v: super::assumptions::REFERENCE_V,
            inputs: [false; 4],
            eeprom_ok: true,
            largest_a: None,
        }
    }
}

/// What the two bridges do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PowerStage {
    /// All switches off: the motor is free but for its detent.
    #[default]
    Off,
    /// Switching: phases A and B see the bus voltage times these, -1 to 1.
    Modulate {
        /// Duty cycles of A and B.
        duty: [f32; 2],
    },
    /// Whatever gives the current vector on the way that [`Zlim42c::path`](super::Zlim42c::path) has
    /// ([`Fidelity::Mechanical`](crate::Fidelity)).
    Follow,
}

/// What the drive does until the next control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuation {
    /// The bridges.
    pub power_stage: PowerStage,
    /// Levels of outputs Y0 and Y1.
    pub outputs: [bool; 2],
    /// The two lights.
    pub led: Led,
}

/// What the firmware finds at power-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// Switches SW2 to SW5, SW2 lowest, OFF counting 1 (4.1): 1 to 15 are node-IDs, 0 lets 2008h decide.
    pub dip_address: u8,
    /// Contents of the EEPROM.
    pub eeprom: StoredImage,
}

impl Default for Hardware {
    /// As delivered: all switches ON, factory settings.
    fn default() -> Self {
        Self { dip_address: 0, eeprom: StoredImage::of(&storage::delivered(&VARIANT)) }
    }
}

//! What the joint's pins read and do: the border between firmware and the physical world.

use can::Bitrate;

use super::pulses::PulseInput;
use super::storage;
use super::variations::VARIANT;
use crate::engine::actuator::servo::{CurrentDemand, Followed};
use crate::engine::storage::StoredImage;

/// The encoder's battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Battery {
    /// Plugged in and full.
    #[default]
    Full,
    /// Plugged in and not full: it is being charged.
    Charging,
    /// Unplugged or dead.
    Missing,
}

/// What the drive measures, each control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Angle of the motor's shaft within its turn, 0 to 32767, from the encoder's own zero: for commutation.
    pub angle_count: u16,
    /// Counts of the motor's shaft from the origin, turns included.
    pub position_counts: i32,
    /// The encoder has lost its turns: the position is within one turn.
    pub turns_lost: bool,
    /// The encoder's battery.
    pub battery: Battery,
    /// Currents of phases U and V, A, positive into the motor.
    pub phase_current_a: [f32; 2],
    /// Voltage of the direct-voltage bus.
    pub bus_v: f32,
    /// Temperature of the power stage, degC.
    pub driver_c: f32,
    /// Level of PU: 5 V between PU+ and PU-.
    pub pu: bool,
    /// Level of DIR.
    pub dir: bool,
    /// The timers behind PU and DIR.
    pub pulses: PulseInput,
    /// The EEPROM does not answer.
    pub eeprom_fails: bool,
    /// What a power stage says that follows by itself ([`Fidelity::Mechanical`](crate::Fidelity)).
    pub followed: Option<Followed>,
}

/// What the three half bridges do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PowerStage {
    /// All switches off: the motor is free.
    #[default]
    Off,
    /// Switching with these duty cycles of U, V, W, each 0 to 1.
    Modulate {
        /// Duty cycles of U, V and W.
        duty: [f32; 3],
    },
    /// Whatever gives these currents ([`Fidelity::Mechanical`](crate::Fidelity)).
    Follow(CurrentDemand),
}

/// The holding brake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Brake {
    /// The drive is set for a motor without one.
    #[default]
    Absent,
    /// It has current and lets go.
    Released,
    /// It holds the shaft.
    Engaged,
}

/// What the drive does until the next control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuation {
    /// False without supply: everything else then says nothing.
    pub running: bool,
    /// The half bridges.
    pub power_stage: PowerStage,
    /// The holding brake.
    pub brake: Brake,
    /// Command to the encoder: the present position is the origin.
    pub set_origin: bool,
    /// ZO and COM are joined: the position is below zero.
    pub zero_output: bool,
    /// The alarm output WR conducts.
    pub alarm_output: bool,
    /// The red LED is lit.
    pub red_led: bool,
    /// The green LED is lit.
    pub green_led: bool,
}

/// What the firmware finds at power-on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// Contents of the EEPROM.
    pub eeprom: StoredImage,
    /// Rate that the CAN controller is built for: 1 Mbit/s, with no object to change it.
    pub bitrate: Bitrate,
}

impl Default for Hardware {
    /// As delivered.
    fn default() -> Self {
        Self { eeprom: StoredImage::of(&storage::delivered(&VARIANT)), bitrate: Bitrate::M1 }
    }
}

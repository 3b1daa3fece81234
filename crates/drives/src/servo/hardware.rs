//! What the drive's pins read and do: the border between firmware and the physical world.

use canopen::od::Storage;

use super::motor::Motor;
use crate::engine::actuator::servo::{CurrentDemand, Followed};
use crate::node::Memory;

/// Most axes of one device (CiA 402-1: eight blocks of 800h from 6000h on).
pub const MAX_AXES: usize = 8;

/// What the drive measures, each control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Of each axis; those that the device does not have are not looked at.
    pub axes: [AxisSensors; MAX_AXES],
    /// Voltage of the bus.
    pub bus_v: f32,
    /// Temperature of the power stage, degC.
    pub drive_c: f32,
    /// The parameter store answers.
    pub store_ok: bool,
}

/// What is measured at one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSensors {
    /// Counter of the encoder's quadrature; wraps.
    pub encoder_count: u16,
    /// The counter where the index pulse came, if it came since the last look.
    pub index_count: Option<u16>,
    /// The receiver sees signals on the encoder's lines.
    pub encoder_wired: bool,
    /// Commutation tracks: U bit 0, V bit 1, W bit 2. Forward: 5, 1, 3, 2, 6, 4.
    pub tracks: u8,
    /// Currents of phases U and V, A, positive into the motor.
    pub phase_current_a: [f32; 2],
    /// Temperature of the motor's winding, degC.
    pub motor_c: f32,
    /// Limit switch at the negative end: on.
    pub negative_limit: bool,
    /// Limit switch at the positive end: on.
    pub positive_limit: bool,
    /// Home switch: on.
    pub home: bool,
    /// The two touch probes: on.
    pub probes: [bool; 2],
    /// What a power stage says that follows by itself ([`Fidelity::Mechanical`](crate::Fidelity)).
    pub followed: Option<Followed>,
}

/// What the drive does until the next control period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuation {
    /// At each axis.
    pub axes: [AxisActuation; MAX_AXES],
    /// The braking resistor's switch is closed.
    pub bleeder_on: bool,
}

/// What the three half bridges of an axis do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PowerStage {
    /// All switches off.
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

/// What is done at one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisActuation {
    /// The half bridges.
    pub power_stage: PowerStage,
    /// The holding brake has current and lets go.
    pub brake_released: bool,
    /// The maker's outputs: bits 16 to 31 of 60FEh.
    pub outputs: u16,
}

/// What the firmware finds at power-on.
#[derive(Clone, Debug)]
pub struct Hardware<S: Storage> {
    /// Node-ID at the switches.
    pub node_id: canopen::NodeId,
    /// Bit rate at the switches.
    pub bitrate: can::Bitrate,
    /// The motors, as many as there are axes.
    pub motors: [Motor; MAX_AXES],
    /// The parameter store.
    pub memory: Memory<S>,
}

//! What the outer world does to a node, as values.

use std::ops::RangeInclusive;

use canopen::{Mux, NodeId};

use super::bus_fault::BusFault;
use super::load::LoadPart;
use super::range::SwitchRange;

/// One thing that the outer world does to a node and the machine around it.
#[derive(Clone, Debug, PartialEq)]
pub enum Stimulus {
    /// `power on`, `power off`, `power cycle`, `power cut`.
    Power(Power),
    /// `input X0 1`: a digital input's level. Removes a switch that is bound to it.
    Input {
        /// The input's name, in any case of letters.
        name: String,
        /// Its level.
        level: bool,
    },
    /// `switch X0 -5000 max`: an input tied to the position. The range is given in counts of the present actual position and
    /// fixed in the machine from then on: zeroing the position later does not move the switch.
    Switch {
        /// The input's name, in any case of letters.
        name: String,
        /// Where it is active.
        range: SwitchRange,
    },
    /// `load torque 2.5`: N·m at the output shaft; positive opposes positive motion, also at standstill.
    LoadTorque(f64),
    /// `load inertia 0.02`: kg·m² added at the output shaft.
    LoadInertia(f64),
    /// `load pulley 2 0.05` and so on: what else hangs on the output shaft.
    Load(LoadPart),
    /// `rotor lock`, `rotor free`.
    RotorLock(bool),
    /// `supply 48`: V; `supply 48 limit 10 resistance 0.2`: with what is behind it.
    Supply(Source),
    /// `temperature motor 95`, `temperature driver auto`: °C held, or back to the model.
    Temperature(TemperatureSensor, Option<f64>),
    /// `fault hall on`: breaks or mends a component.
    Fault(Component, bool),
    /// `battery off`: the multi-turn battery.
    Battery(bool),
    /// `pulses 8192 10000`, `quadrature -400 1000`, `duty 40`, `clock 10000`: what is sent to the pulse inputs; what was being
    /// sent ends.
    Pulses(PulseTrain),
    /// `cable cut` is true, `cable join` is false: the bus cable of the node.
    CableCut(bool),
    /// `bus late 5 20`, `bus silent on`: what is wrong with the node's access to the bus.
    Bus(BusFault),
    /// `set 6000:01 FFh`: the value of an object of a node whose objects are the outer world's.
    Object {
        /// The object.
        mux: Mux,
        /// Its value.
        value: ObjectValue,
    },
    /// `mpdo 7 6200:01 FFh`, `mpdo all 6200:01 FFh`: the application of such a node writes to an object of another, or of all, by a
    /// multiplexed PDO in destination address mode (CiA 301, 7.2.3).
    Mpdo {
        /// The other node; `None` for all.
        to: Option<NodeId>,
        /// Its object.
        object: Mux,
        /// Up to four bytes: [`MPDO_VALUES`].
        value: i64,
    },
}

/// What an MPDO carries: 32 bits, with a sign or without.
pub const MPDO_VALUES: RangeInclusive<i64> = i32::MIN as i64..=u32::MAX as i64;

/// What happens to the supply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// On: the firmware boots.
    On,
    /// Off: the drive lives on until its bus has drained.
    Off,
    /// Off, and on again when the drive has died of it.
    Cycle,
    /// Dead at once, in the middle of whatever it does.
    Cut,
}

/// The value of an object; the object's type decides what fits.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectValue {
    /// `255`, `-5`, `FFh`, `0xFF`.
    Integer(i128),
    /// `1.5`, with a point or an exponent.
    Real(f64),
    /// `"text"`.
    Text(String),
}

/// A supply; `None` leaves that as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Source {
    /// Open-circuit voltage in V.
    pub voltage_v: Option<f64>,
    /// The most that it gives, in A. Asked for more its voltage falls.
    pub limit_a: Option<f64>,
    /// Resistance of source and wires, in ohm.
    pub resistance_ohm: Option<f64>,
}

/// Where a temperature is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TemperatureSensor {
    /// Winding or housing of the motor.
    Motor,
    /// Power stage.
    Driver,
}

/// A component that can break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Hall sensors.
    Hall,
    /// Encoder.
    Encoder,
    /// Parameter memory.
    Eeprom,
    /// Reference voltage of the current measurement.
    Reference,
    /// A motor phase, open.
    Phase,
    /// A motor phase, its wires touching.
    Short,
    /// The power stage: a transistor that has broken down takes current from the bus.
    Bridge,
    /// The bleeder's resistor, open.
    Bleeder,
}

/// What a controller sends to a drive's pulse inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PulseTrain {
    /// Pulses with a direction.
    Pulses {
        /// How many; negative with the direction input conducting.
        count: i64,
        /// Pulses a second.
        hz: f64,
    },
    /// Two channels of an encoder.
    Quadrature {
        /// Counts, four a line; negative with the second channel ahead.
        count: i64,
        /// Counts a second.
        hz: f64,
    },
    /// A square wave of this duty cycle in per cent, for ever.
    Duty(f64),
    /// A level on the second input that changes so many times a second, for ever.
    Clock(f64),
}

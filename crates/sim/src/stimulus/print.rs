//! A stimulus in the words that it is parsed from.

use std::fmt;

use super::kinds::{Component, ObjectValue, Power, PulseTrain, Source, Stimulus, TemperatureSensor};
use super::range::SwitchRange;
use super::words::bound_word;

impl fmt::Display for Stimulus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let on = |on: bool| if on { "on" } else { "off" };
        match self {
            Self::Power(power) => write!(f, "power {}", power.word()),
            Self::Input { name, level } => write!(f, "input {name} {}", u8::from(*level)),
            Self::Switch { name, range: SwitchRange { low, high } } => {
                write!(f, "switch {name} {} {}", bound_word(*low, "min"), bound_word(*high, "max"))
            }
            Self::LoadTorque(torque_nm) => write!(f, "load torque {torque_nm}"),
            Self::LoadInertia(inertia_kg_m2) => write!(f, "load inertia {inertia_kg_m2}"),
            Self::Load(part) => part.fmt(f),
            Self::RotorLock(locked) => write!(f, "rotor {}", if *locked { "lock" } else { "free" }),
            Self::Supply(source) => supply(f, source),
            Self::Temperature(sensor, Some(celsius)) => write!(f, "temperature {} {celsius}", sensor.word()),
            Self::Temperature(sensor, None) => write!(f, "temperature {} auto", sensor.word()),
            Self::Fault(component, broken) => write!(f, "fault {} {}", component.word(), on(*broken)),
            Self::Battery(connected) => write!(f, "battery {}", on(*connected)),
            Self::Pulses(PulseTrain::Pulses { count, hz }) => write!(f, "pulses {count} {hz}"),
            Self::Pulses(PulseTrain::Quadrature { count, hz }) => write!(f, "quadrature {count} {hz}"),
            Self::Pulses(PulseTrain::Duty(percent)) => write!(f, "duty {percent}"),
            Self::Pulses(PulseTrain::Clock(hz)) => write!(f, "clock {hz}"),
            Self::CableCut(cut) => write!(f, "cable {}", if *cut { "cut" } else { "join" }),
            Self::Bus(fault) => fault.fmt(f),
            Self::Object { mux, value } => write!(f, "set {mux:X} {value}"),
            Self::Mpdo { to: Some(node), object, value } => write!(f, "mpdo {node} {object:X} {value}"),
            Self::Mpdo { to: None, object, value } => write!(f, "mpdo all {object:X} {value}"),
        }
    }
}

fn supply(f: &mut fmt::Formatter<'_>, source: &Source) -> fmt::Result {
    f.write_str("supply")?;
    source.voltage_v.map_or(Ok(()), |volts| write!(f, " {volts}"))?;
    source.limit_a.map_or(Ok(()), |limit_a| write!(f, " limit {limit_a}"))?;
    source.resistance_ohm.map_or(Ok(()), |ohm| write!(f, " resistance {ohm}"))
}

impl fmt::Display for ObjectValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(integer) => write!(f, "{integer}"),
            // With a point or an exponent, so that it is read as what it is.
            Self::Real(real) => write!(f, "{real:?}"),
            Self::Text(text) => write!(f, "\"{text}\""),
        }
    }
}

impl Power {
    /// Each of them.
    pub const ALL: [Self; 4] = [Self::On, Self::Off, Self::Cycle, Self::Cut];

    /// How it is called in a command.
    pub const fn word(self) -> &'static str {
        match self {
            Self::On => "on",
            Self::Off => "off",
            Self::Cycle => "cycle",
            Self::Cut => "cut",
        }
    }
}

impl TemperatureSensor {
    /// Each of them.
    pub const ALL: [Self; 2] = [Self::Motor, Self::Driver];

    /// How it is called in a command.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Driver => "driver",
        }
    }
}

impl Component {
    /// Each of them.
    pub const ALL: [Self; 8] = [
        Self::Hall,
        Self::Encoder,
        Self::Eeprom,
        Self::Reference,
        Self::Phase,
        Self::Short,
        Self::Bridge,
        Self::Bleeder,
    ];

    /// How it is called in a command.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hall => "hall",
            Self::Encoder => "encoder",
            Self::Eeprom => "eeprom",
            Self::Reference => "reference",
            Self::Phase => "phase",
            Self::Short => "short",
            Self::Bridge => "bridge",
            Self::Bleeder => "bleeder",
        }
    }
}

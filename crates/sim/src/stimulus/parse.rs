//! From words to a [`Stimulus`]. What may be said stands in the usage texts below.

use std::str::FromStr;

use canopen::{Mux, NodeId};

use super::body;
use super::bus_fault::{self, BusFault};
use super::error::StimulusError;
use super::kinds::{Component, MPDO_VALUES, ObjectValue, Power, PulseTrain, Source, Stimulus, TemperatureSensor};
use super::load::{self, LoadPart};
use super::words::{excerpt, number, range};

impl FromStr for Stimulus {
    type Err = StimulusError;

    /// The words after the node.
    fn from_str(text: &str) -> Result<Self, StimulusError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let Some((&verb, arguments)) = words.split_first() else { return Err(StimulusError::Unknown(String::new())) };
        match verb {
            "power" => {
                let power = Power::ALL.into_iter().find(|power| arguments == [power.word()]);
                power.map(Self::Power).ok_or(StimulusError::Usage(POWER))
            }
            "input" => parse_input(arguments),
            "switch" => parse_switch(arguments),
            "load" => parse_load(arguments),
            "rotor" => Ok(Self::RotorLock(choice(arguments, "lock", "free", ROTOR)?)),
            "supply" => parse_supply(arguments),
            "temperature" => parse_temperature(arguments),
            "fault" => parse_fault(arguments),
            "battery" => Ok(Self::Battery(choice(arguments, "on", "off", BATTERY)?)),
            "pulses" | "quadrature" | "duty" | "clock" => parse_pulses(verb, arguments).map(Self::Pulses),
            "cable" => Ok(Self::CableCut(choice(arguments, "cut", "join", CABLE)?)),
            "bus" => BusFault::parse(arguments).map(Self::Bus),
            "set" => parse_set(text),
            "mpdo" => parse_mpdo(arguments),
            _ => Err(StimulusError::Unknown(excerpt(verb))),
        }
    }
}

const POWER: &str = "NODE power on|off|cycle|cut";
const INPUT: &str = "NODE input NAME 0|1";
const SWITCH: &str = "NODE switch NAME LOW|min HIGH|max";
const LOAD: &str = "NODE load torque N·m, or NODE load inertia kg·m²";
/// What may follow `load`.
const LOADS: &str = "NODE load torque|inertia|friction|pulley|spring|stop|fan|gear VALUES, or NODE load none";
const ROTOR: &str = "NODE rotor lock|free";
const SUPPLY: &str = "NODE supply VOLTS [limit AMPERES] [resistance OHMS]";
const TEMPERATURE: &str = "NODE temperature motor|driver CELSIUS|auto";
const FAULT: &str = "NODE fault hall|encoder|eeprom|reference|phase|short|bridge|bleeder on|off";
const BATTERY: &str = "NODE battery on|off";
const PULSES: &str = "NODE pulses COUNT HZ";
const QUADRATURE: &str = "NODE quadrature COUNT HZ";
const DUTY: &str = "NODE duty PERCENT";
const CLOCK: &str = "NODE clock HZ";
const CABLE: &str = "NODE cable cut|join";
const SET: &str = "NODE set OBJECT VALUE";
const MPDO: &str = "NODE mpdo OTHER|all OBJECT VALUE";
/// The form of the line that moves time.
pub const RUN: &str = "run 20ms, or run until 2.5s (ns, us, ms, s, min, h)";
/// The form of the question that every node answers.
pub const GET: &str = "NODE get";

/// Every form of a line of world commands, one line each. `NODE.2` is the second axis of a node.
pub const FORMS: &[&str] = &[
    POWER,
    INPUT,
    SWITCH,
    LOAD,
    load::FORMS[0],
    load::FORMS[1],
    load::FORMS[2],
    load::FORMS[3],
    load::FORMS[4],
    load::FORMS[5],
    load::FORMS[6],
    ROTOR,
    SUPPLY,
    TEMPERATURE,
    FAULT,
    BATTERY,
    PULSES,
    QUADRATURE,
    DUTY,
    CLOCK,
    CABLE,
    bus_fault::SILENT,
    bus_fault::LATE,
    bus_fault::BABBLE,
    bus_fault::OVERRUN,
    bus_fault::CORRUPT,
    SET,
    MPDO,
    GET,
    body::FORMS[0],
    body::FORMS[1],
    body::FORMS[2],
    body::FORMS[3],
    body::FORMS[4],
    bus_fault::WIRE,
    RUN,
    "now",
    "help",
    "quit",
];

/// Below this a temperature is below absolute zero.
const ABSOLUTE_ZERO_C: f64 = -273.15;

fn parse_input(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let [name, level] = arguments else { return Err(StimulusError::Usage(INPUT)) };
    Ok(Stimulus::Input { name: name.to_string(), level: choice(&[level], "1", "0", INPUT)? })
}

fn parse_switch(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let [name, low, high] = arguments else { return Err(StimulusError::Usage(SWITCH)) };
    Ok(Stimulus::Switch { name: name.to_string(), range: range(low, high, SWITCH)? })
}

fn parse_load(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    match arguments {
        ["torque", torque_nm] => Ok(Stimulus::LoadTorque(number(torque_nm, "torque", f64::MIN, LOAD)?)),
        ["inertia", inertia] => Ok(Stimulus::LoadInertia(number(inertia, "inertia", 0.0, LOAD)?)),
        _ => LoadPart::parse(arguments).unwrap_or(Err(StimulusError::Usage(LOADS))).map(Stimulus::Load),
    }
}

fn parse_supply(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let mut source = Source::default();
    let mut pairs = arguments;
    if let Some((volts, rest)) = arguments.split_first().filter(|(first, _)| !matches!(**first, "limit" | "resistance"))
    {
        source.voltage_v = Some(number(volts, "voltage", 0.0, SUPPLY)?);
        pairs = rest;
    }
    for pair in pairs.chunks(2) {
        let place = match pair {
            ["limit", _] => &mut source.limit_a,
            ["resistance", _] => &mut source.resistance_ohm,
            _ => return Err(StimulusError::Usage(SUPPLY)),
        };
        *place = Some(number(pair[1], "number", 0.0, SUPPLY)?);
    }
    if arguments.is_empty() { Err(StimulusError::Usage(SUPPLY)) } else { Ok(Stimulus::Supply(source)) }
}

fn parse_temperature(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let [sensor, celsius] = arguments else { return Err(StimulusError::Usage(TEMPERATURE)) };
    let sensor = TemperatureSensor::ALL.into_iter().find(|known| known.word() == *sensor);
    let sensor = sensor.ok_or(StimulusError::Usage(TEMPERATURE))?;
    let held = match *celsius {
        "auto" => None,
        text => Some(number(text, "temperature", ABSOLUTE_ZERO_C, TEMPERATURE)?),
    };
    Ok(Stimulus::Temperature(sensor, held))
}

fn parse_fault(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let [component, state] = arguments else { return Err(StimulusError::Usage(FAULT)) };
    let component = Component::ALL.into_iter().find(|known| known.word() == *component);
    let component = component.ok_or(StimulusError::Usage(FAULT))?;
    Ok(Stimulus::Fault(component, choice(&[state], "on", "off", FAULT)?))
}

fn parse_pulses(verb: &str, arguments: &[&str]) -> Result<PulseTrain, StimulusError> {
    match (verb, arguments) {
        ("pulses", _) => count_and_rate(arguments, PULSES).map(|(count, hz)| PulseTrain::Pulses { count, hz }),
        ("quadrature", _) => {
            count_and_rate(arguments, QUADRATURE).map(|(count, hz)| PulseTrain::Quadrature { count, hz })
        }
        ("duty", [percent]) => Ok(PulseTrain::Duty(number(percent, "duty cycle", 0.0, DUTY)?)),
        ("duty", _) => Err(StimulusError::Usage(DUTY)),
        (_, [hz]) => Ok(PulseTrain::Clock(number(hz, "frequency", 0.0, CLOCK)?)),
        _ => Err(StimulusError::Usage(CLOCK)),
    }
}

/// A text may hold blanks, so the words are not split further.
fn parse_set(text: &str) -> Result<Stimulus, StimulusError> {
    let rest = text.trim().strip_prefix("set").unwrap_or_default().trim_start();
    let (object, value) = rest.split_once(char::is_whitespace).ok_or(StimulusError::Usage(SET))?;
    let bad = |text: &str, what| StimulusError::BadValue { text: text.to_string(), what, usage: SET };
    let mux = parse_object(object).ok_or_else(|| bad(object, "object"))?;
    let value = value.trim();
    Ok(Stimulus::Object { mux, value: parse_object_value(value).ok_or_else(|| bad(value, "value"))? })
}

fn parse_mpdo(arguments: &[&str]) -> Result<Stimulus, StimulusError> {
    let [other, object, value] = arguments else { return Err(StimulusError::Usage(MPDO)) };
    let bad = |text: &str, what| StimulusError::BadValue { text: text.to_string(), what, usage: MPDO };
    let node = || other.parse().ok().and_then(NodeId::new).ok_or_else(|| bad(other, "node"));
    let to = if *other == "all" { None } else { Some(node()?) };
    let mux = parse_object(object).ok_or_else(|| bad(object, "object"))?;
    let number = match parse_object_value(value) {
        Some(ObjectValue::Integer(number)) => i64::try_from(number).ok().filter(|number| MPDO_VALUES.contains(number)),
        _ => None,
    };
    Ok(Stimulus::Mpdo { to, object: mux, value: number.ok_or_else(|| bad(value, "value of up to four bytes"))? })
}

/// `6000:01`, `6000h:01`, `0x6000`: hexadecimal, as objects are written.
fn parse_object(text: &str) -> Option<Mux> {
    let (index, sub_index) = text.split_once(':').unwrap_or((text, "0"));
    let hex = |text: &str| {
        let digits = text.strip_prefix("0x").unwrap_or(text);
        let digits = digits.strip_suffix(['h', 'H']).unwrap_or(digits);
        u16::from_str_radix(digits, 16).ok().filter(|_| digits.len() <= 4 && !digits.starts_with('+'))
    };
    Some(Mux::new(hex(index)?, u8::try_from(hex(sub_index)?).ok()?))
}

fn parse_object_value(text: &str) -> Option<ObjectValue> {
    if let Some(quoted) = text.strip_prefix('"') {
        return quoted.strip_suffix('"').map(|text| ObjectValue::Text(text.to_string()));
    }
    let hex = text.strip_prefix("0x").or_else(|| text.strip_suffix(['h', 'H']));
    if let Some(digits) = hex {
        let plain = digits.starts_with(|first: char| first.is_ascii_hexdigit());
        return i128::from_str_radix(digits, 16).ok().filter(|_| plain).map(ObjectValue::Integer);
    }
    let integer = text.parse().ok().map(ObjectValue::Integer);
    let real = || text.parse().ok().filter(|real: &f64| real.is_finite()).map(ObjectValue::Real);
    integer.or_else(real)
}

/// Signed pulses or counts, and how many a second.
fn count_and_rate(arguments: &[&str], usage: &'static str) -> Result<(i64, f64), StimulusError> {
    let [count, hz] = arguments else { return Err(StimulusError::Usage(usage)) };
    let bad = |_| StimulusError::BadValue { text: count.to_string(), what: "count", usage };
    Ok((count.parse().map_err(bad)?, number(hz, "frequency", 0.0, usage)?))
}

/// One word that must be `yes` (true) or `no` (false).
fn choice(arguments: &[&str], yes: &str, no: &str, usage: &'static str) -> Result<bool, StimulusError> {
    match arguments {
        [word] if *word == yes => Ok(true),
        [word] if *word == no => Ok(false),
        _ => Err(StimulusError::Usage(usage)),
    }
}

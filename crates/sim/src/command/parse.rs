//! From a line to a [`Command`]. What a line may say stands in the usage texts below.

use std::str::FromStr;

use super::{Action, Command, CommandError};
use crate::{Component, PulseTrain, Source, SwitchRange, TemperatureSensor};

impl FromStr for Command {
    type Err = CommandError;

    fn from_str(line: &str) -> Result<Self, CommandError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["now"] => Ok(Self::Now),
            ["help"] => Ok(Self::Help),
            ["quit"] => Ok(Self::Quit),
            ["now", ..] => Err(CommandError::Usage("now")),
            ["help", ..] => Err(CommandError::Usage("help")),
            ["quit", ..] => Err(CommandError::Usage("quit")),
            [first, action @ ..] => {
                let number = parse_node(first)?;
                Ok(Self::Drive { number, action: parse_action(number, action)? })
            }
            [] => Err(CommandError::Unknown(String::new())),
        }
    }
}

const POWER: &str = "NODE power on|off|cycle|cut";
const INPUT: &str = "NODE input NAME 0|1";
const SWITCH: &str = "NODE switch NAME LOW|min HIGH|max";
const LOAD: &str = "NODE load torque N·m, or NODE load inertia kg·m²";
const ROTOR: &str = "NODE rotor lock|free";
const SUPPLY: &str = "NODE supply VOLTS [limit AMPERES] [resistance OHMS]";
const TEMPERATURE: &str = "NODE temperature motor|driver CELSIUS|auto";
const FAULT: &str = "NODE fault hall|encoder|eeprom|reference|phase|short|bridge on|off";
const BATTERY: &str = "NODE battery on|off";
const PULSES: &str = "NODE pulses COUNT HZ";
const QUADRATURE: &str = "NODE quadrature COUNT HZ";
const DUTY: &str = "NODE duty PERCENT";
const CLOCK: &str = "NODE clock HZ";
const CABLE: &str = "NODE cable cut|join";
const GET: &str = "NODE get";

/// Every form of a line, one line each.
pub(super) const FORMS: &[&str] = &[
    POWER,
    INPUT,
    SWITCH,
    LOAD,
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
    GET,
    "now",
    "help",
    "quit",
];

/// Below this a temperature is below absolute zero.
const ABSOLUTE_ZERO_C: f64 = -273.15;

fn parse_node(word: &str) -> Result<u8, CommandError> {
    let number = word.parse().ok().filter(|number| (1..=127).contains(number) && !word.starts_with('+'));
    let looks_numeric = word.starts_with(|first: char| first.is_ascii_digit() || first == '-' || first == '+');
    number.ok_or_else(|| {
        let word = word.to_string();
        if looks_numeric { CommandError::BadNode(word) } else { CommandError::Unknown(word) }
    })
}

fn parse_action(node: u8, words: &[&str]) -> Result<Action, CommandError> {
    let (&verb, arguments) = words.split_first().ok_or(CommandError::NoAction(node))?;
    match verb {
        "power" => parse_power(arguments),
        "input" => parse_input(arguments),
        "switch" => parse_switch(arguments),
        "load" => parse_load(arguments),
        "rotor" => Ok(Action::RotorLock(choice(arguments, "lock", "free", ROTOR)?)),
        "supply" => parse_supply(arguments),
        "temperature" => parse_temperature(arguments),
        "fault" => parse_fault(arguments),
        "battery" => Ok(Action::Battery(choice(arguments, "on", "off", BATTERY)?)),
        "pulses" => {
            let (count, hz) = count_and_rate(arguments, PULSES)?;
            Ok(Action::Pulses(PulseTrain::Pulses { count, hz }))
        }
        "quadrature" => {
            let (count, hz) = count_and_rate(arguments, QUADRATURE)?;
            Ok(Action::Pulses(PulseTrain::Quadrature { count, hz }))
        }
        "duty" => match arguments {
            [percent] => Ok(Action::Pulses(PulseTrain::Duty(number(percent, "duty cycle", 0.0, DUTY)?))),
            _ => Err(CommandError::Usage(DUTY)),
        },
        "clock" => match arguments {
            [hz] => Ok(Action::Pulses(PulseTrain::Clock(number(hz, "frequency", 0.0, CLOCK)?))),
            _ => Err(CommandError::Usage(CLOCK)),
        },
        "cable" => Ok(Action::CableCut(choice(arguments, "cut", "join", CABLE)?)),
        "get" if arguments.is_empty() => Ok(Action::Get),
        "get" => Err(CommandError::Usage(GET)),
        _ => Err(CommandError::UnknownAction(verb.to_string())),
    }
}

fn parse_power(arguments: &[&str]) -> Result<Action, CommandError> {
    match arguments {
        ["cycle"] => Ok(Action::PowerCycle),
        ["cut"] => Ok(Action::PowerCut),
        _ => Ok(Action::Power(choice(arguments, "on", "off", POWER)?)),
    }
}

fn parse_input(arguments: &[&str]) -> Result<Action, CommandError> {
    let [name, level] = arguments else { return Err(CommandError::Usage(INPUT)) };
    Ok(Action::Input { name: name.to_string(), level: choice(&[level], "1", "0", INPUT)? })
}

fn parse_switch(arguments: &[&str]) -> Result<Action, CommandError> {
    let [name, low, high] = arguments else { return Err(CommandError::Usage(SWITCH)) };
    let range = SwitchRange { low: bound(low, "min")?, high: bound(high, "max")? };
    if let SwitchRange { low: Some(low), high: Some(high) } = range
        && low > high
    {
        return Err(CommandError::EmptyRange { low, high });
    }
    Ok(Action::Switch { name: name.to_string(), range })
}

fn parse_load(arguments: &[&str]) -> Result<Action, CommandError> {
    match arguments {
        ["torque", torque_nm] => Ok(Action::LoadTorque(number(torque_nm, "torque", f64::MIN, LOAD)?)),
        ["inertia", inertia] => Ok(Action::LoadInertia(number(inertia, "inertia", 0.0, LOAD)?)),
        _ => Err(CommandError::Usage(LOAD)),
    }
}

fn parse_supply(arguments: &[&str]) -> Result<Action, CommandError> {
    let Some((volts, pairs)) = arguments.split_first() else { return Err(CommandError::Usage(SUPPLY)) };
    let mut source = Source { voltage_v: Some(number(volts, "voltage", 0.0, SUPPLY)?), ..Source::default() };
    for pair in pairs.chunks(2) {
        let place = match pair {
            ["limit", _] => &mut source.limit_a,
            ["resistance", _] => &mut source.resistance_ohm,
            _ => return Err(CommandError::Usage(SUPPLY)),
        };
        *place = Some(number(pair[1], "number", 0.0, SUPPLY)?);
    }
    Ok(Action::Supply(source))
}

fn parse_temperature(arguments: &[&str]) -> Result<Action, CommandError> {
    let [sensor, celsius] = arguments else { return Err(CommandError::Usage(TEMPERATURE)) };
    let sensor = match *sensor {
        "motor" => TemperatureSensor::Motor,
        "driver" => TemperatureSensor::Driver,
        _ => return Err(CommandError::Usage(TEMPERATURE)),
    };
    let held = match *celsius {
        "auto" => None,
        text => Some(number(text, "temperature", ABSOLUTE_ZERO_C, TEMPERATURE)?),
    };
    Ok(Action::Temperature(sensor, held))
}

fn parse_fault(arguments: &[&str]) -> Result<Action, CommandError> {
    let [component, state] = arguments else { return Err(CommandError::Usage(FAULT)) };
    let component = match *component {
        "hall" => Component::Hall,
        "encoder" => Component::Encoder,
        "eeprom" => Component::Eeprom,
        "reference" => Component::Reference,
        "phase" => Component::Phase,
        "short" => Component::Short,
        "bridge" => Component::Bridge,
        _ => return Err(CommandError::Usage(FAULT)),
    };
    Ok(Action::Fault(component, choice(&[state], "on", "off", FAULT)?))
}

/// Signed pulses or counts, and how many a second.
fn count_and_rate(arguments: &[&str], usage: &'static str) -> Result<(i64, f64), CommandError> {
    let [count, hz] = arguments else { return Err(CommandError::Usage(usage)) };
    let bad = |_| CommandError::BadValue { text: count.to_string(), what: "count", usage };
    Ok((count.parse().map_err(bad)?, number(hz, "frequency", 0.0, usage)?))
}

/// One word that must be `yes` (true) or `no` (false).
fn choice(arguments: &[&str], yes: &str, no: &str, usage: &'static str) -> Result<bool, CommandError> {
    match arguments {
        [word] if *word == yes => Ok(true),
        [word] if *word == no => Ok(false),
        _ => Err(CommandError::Usage(usage)),
    }
}

fn number(text: &str, what: &'static str, least: f64, usage: &'static str) -> Result<f64, CommandError> {
    let value: Option<f64> = text.parse().ok().filter(|value: &f64| value.is_finite() && *value >= least);
    value.ok_or_else(|| CommandError::BadValue { text: text.to_string(), what, usage })
}

fn bound(text: &str, open: &str) -> Result<Option<i64>, CommandError> {
    if text == open {
        return Ok(None);
    }
    let bad = |_| CommandError::BadValue { text: text.to_string(), what: "position", usage: SWITCH };
    text.parse().map(Some).map_err(bad)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn action(line: &str) -> Action {
        match line.parse() {
            Ok(Command::Drive { number: 4, action }) => action,
            other => panic!("{line:?}: {other:?}"),
        }
    }

    #[test]
    fn understands_every_line_of_the_manual_page() {
        assert_eq!("now".parse(), Ok(Command::Now));
        assert_eq!("  quit\r\n".parse(), Ok(Command::Quit));
        assert_eq!(action("4 power off"), Action::Power(false));
        assert_eq!(action("4 power on"), Action::Power(true));
        assert_eq!(action("4 power cycle"), Action::PowerCycle);
        assert_eq!(action("4 input X0 1"), Action::Input { name: "X0".into(), level: true });
        let range = |low, high| Action::Switch { name: "X0".into(), range: SwitchRange { low, high } };
        assert_eq!(action("4 switch X0 -5000 -4000"), range(Some(-5000), Some(-4000)));
        assert_eq!(action("4 switch X0 min -5000"), range(None, Some(-5000)));
        assert_eq!(action("4 switch X0 7 max"), range(Some(7), None));
        assert_eq!(action("4 switch X0 7 7"), range(Some(7), Some(7)));
        assert_eq!(action("4 switch X0 min max"), range(None, None));
        assert_eq!(action("4 load torque -2.5"), Action::LoadTorque(-2.5));
        assert_eq!(action("4 load inertia 0.02"), Action::LoadInertia(0.02));
        assert_eq!(action("4 rotor lock"), Action::RotorLock(true));
        assert_eq!(action("4 rotor free"), Action::RotorLock(false));
        let source = Source { voltage_v: Some(48.0), limit_a: None, resistance_ohm: None };
        assert_eq!(action("4 supply 48"), Action::Supply(source));
        let source = Source { limit_a: Some(10.0), ..source };
        assert_eq!(action("4 supply 48 limit 10"), Action::Supply(source));
        let source = Source { resistance_ohm: Some(0.2), ..source };
        assert_eq!(action("4 supply 48 limit 10 resistance 0.2"), Action::Supply(source));
        assert_eq!(action("4 power cut"), Action::PowerCut);
        assert_eq!(action("4 temperature motor 95"), Action::Temperature(TemperatureSensor::Motor, Some(95.0)));
        assert_eq!(action("4 temperature driver auto"), Action::Temperature(TemperatureSensor::Driver, None));
        assert_eq!(action("4 fault hall on"), Action::Fault(Component::Hall, true));
        assert_eq!(action("4 fault encoder off"), Action::Fault(Component::Encoder, false));
        assert_eq!(action("4 fault eeprom on"), Action::Fault(Component::Eeprom, true));
        assert_eq!(action("4 fault reference on"), Action::Fault(Component::Reference, true));
        assert_eq!(action("4 fault phase on"), Action::Fault(Component::Phase, true));
        assert_eq!(action("4 fault short on"), Action::Fault(Component::Short, true));
        assert_eq!(action("4 fault bridge off"), Action::Fault(Component::Bridge, false));
        assert_eq!(action("4 battery off"), Action::Battery(false));
        assert_eq!(action("4 pulses 8192 10000"), Action::Pulses(PulseTrain::Pulses { count: 8192, hz: 1e4 }));
        assert_eq!(action("4 quadrature -400 1e3"), Action::Pulses(PulseTrain::Quadrature { count: -400, hz: 1e3 }));
        assert_eq!(action("4 duty 40"), Action::Pulses(PulseTrain::Duty(40.0)));
        assert_eq!(action("4 clock 1e4"), Action::Pulses(PulseTrain::Clock(1e4)));
        assert_eq!(action("4 cable cut"), Action::CableCut(true));
        assert_eq!(action("4 cable join"), Action::CableCut(false));
        assert_eq!(action("\t4   get "), Action::Get);
    }

    #[test]
    fn says_what_it_expected_of_a_malformed_line() {
        for (line, error) in [
            ("", "unknown command \"\"; expected now, help, quit, or a node number and a command, as in: 4 get"),
            (
                "hello",
                "unknown command \"hello\"; expected now, help, quit, or a node number and a command, as in: 4 get",
            ),
            ("now 4", "expected: now"),
            ("quit now", "expected: quit"),
            ("0 get", "\"0\" is no node number; expected 1 to 127"),
            ("128 get", "\"128\" is no node number; expected 1 to 127"),
            ("-1 get", "\"-1\" is no node number; expected 1 to 127"),
            ("+4 get", "\"+4\" is no node number; expected 1 to 127"),
            ("99999999999999999999 get", "\"99999999999999999999\" is no node number; expected 1 to 127"),
            (
                "4",
                "nothing to do is said after node 4; expected power, input, switch, load, rotor, supply, temperature, \
                 fault, battery, pulses, quadrature, duty, clock, cable or get, as in: 4 get",
            ),
            (
                "4 Power on",
                "unknown command \"Power\" for a node; expected power, input, switch, load, rotor, supply, \
                 temperature, fault, battery, pulses, quadrature, duty, clock, cable or get",
            ),
            ("4 power", "expected: NODE power on|off|cycle|cut"),
            ("4 power up", "expected: NODE power on|off|cycle|cut"),
            ("4 power on now", "expected: NODE power on|off|cycle|cut"),
            ("4 input X0", "expected: NODE input NAME 0|1"),
            ("4 input X0 2", "expected: NODE input NAME 0|1"),
            ("4 switch X0 5", "expected: NODE switch NAME LOW|min HIGH|max"),
            ("4 switch X0 a 5", "\"a\" is no position; expected: NODE switch NAME LOW|min HIGH|max"),
            ("4 switch X0 max min", "\"max\" is no position; expected: NODE switch NAME LOW|min HIGH|max"),
            ("4 switch X0 1.5 2", "\"1.5\" is no position; expected: NODE switch NAME LOW|min HIGH|max"),
            ("4 switch X0 5 -5", "the range from 5 to -5 is empty; give the lower bound first"),
            ("4 load", "expected: NODE load torque N·m, or NODE load inertia kg·m²"),
            ("4 load torque x", "\"x\" is no torque; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
            ("4 load torque inf", "\"inf\" is no torque; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
            ("4 load torque nan", "\"nan\" is no torque; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
            ("4 load inertia -1", "\"-1\" is no inertia; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
            ("4 rotor stuck", "expected: NODE rotor lock|free"),
            ("4 supply", "expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]"),
            ("4 supply -1", "\"-1\" is no voltage; expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]"),
            (
                "4 supply 1e999",
                "\"1e999\" is no voltage; expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]",
            ),
            ("4 temperature oil 5", "expected: NODE temperature motor|driver CELSIUS|auto"),
            (
                "4 temperature motor hot",
                "\"hot\" is no temperature; expected: NODE temperature motor|driver CELSIUS|auto",
            ),
            (
                "4 temperature motor -300",
                "\"-300\" is no temperature; expected: NODE temperature motor|driver CELSIUS|auto",
            ),
            ("4 fault hall", "expected: NODE fault hall|encoder|eeprom|reference|phase|short|bridge on|off"),
            ("4 fault fuse on", "expected: NODE fault hall|encoder|eeprom|reference|phase|short|bridge on|off"),
            ("4 battery low", "expected: NODE battery on|off"),
            ("4 pulses 5", "expected: NODE pulses COUNT HZ"),
            ("4 pulses 1.5 100", "\"1.5\" is no count; expected: NODE pulses COUNT HZ"),
            ("4 quadrature 5 fast", "\"fast\" is no frequency; expected: NODE quadrature COUNT HZ"),
            ("4 duty", "expected: NODE duty PERCENT"),
            ("4 clock", "expected: NODE clock HZ"),
            ("4 cable off", "expected: NODE cable cut|join"),
            ("4 get position", "expected: NODE get"),
        ] {
            let result: Result<Command, CommandError> = line.parse();
            assert_eq!(result.unwrap_err().to_string(), error, "{line:?}");
        }
    }

    #[test]
    fn what_is_behind_a_supply_comes_in_pairs() {
        let expected = "expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]";
        for line in ["4 supply 48 limit", "4 supply 48 10A", "4 supply 48 limit 10 resistance"] {
            let result: Result<Command, CommandError> = line.parse();
            assert_eq!(result.unwrap_err().to_string(), expected, "{line:?}");
        }
    }
}

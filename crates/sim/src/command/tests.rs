//! What a line of world commands may say, and what is said of a wrong one.

use super::*;
use crate::stimulus::{Component, Power, PulseTrain, Source, SwitchRange, TemperatureSensor};

fn action(line: &str) -> Stimulus {
    match line.parse() {
        Ok(Command::Apply(place, stimulus)) if place == Place::node(4) => stimulus,
        other => panic!("{line:?}: {other:?}"),
    }
}

#[test]
fn understands_every_line_of_the_manual_page() {
    assert_eq!("now".parse(), Ok(Command::Now));
    assert_eq!("  quit\r\n".parse(), Ok(Command::Quit));
    assert_eq!(action("4 power off"), Stimulus::Power(Power::Off));
    assert_eq!(action("4 power on"), Stimulus::Power(Power::On));
    assert_eq!(action("4 power cycle"), Stimulus::Power(Power::Cycle));
    assert_eq!(action("4 input X0 1"), Stimulus::Input { name: "X0".into(), level: true });
    let range = |low, high| Stimulus::Switch { name: "X0".into(), range: SwitchRange { low, high } };
    assert_eq!(action("4 switch X0 -5000 -4000"), range(Some(-5000), Some(-4000)));
    assert_eq!(action("4 switch X0 min -5000"), range(None, Some(-5000)));
    assert_eq!(action("4 switch X0 7 max"), range(Some(7), None));
    assert_eq!(action("4 switch X0 7 7"), range(Some(7), Some(7)));
    assert_eq!(action("4 switch X0 min max"), range(None, None));
    assert_eq!(action("4 load torque -2.5"), Stimulus::LoadTorque(-2.5));
    assert_eq!(action("4 load inertia 0.02"), Stimulus::LoadInertia(0.02));
    assert_eq!(action("4 rotor lock"), Stimulus::RotorLock(true));
    assert_eq!(action("4 rotor free"), Stimulus::RotorLock(false));
    let source = Source { voltage_v: Some(48.0), limit_a: None, resistance_ohm: None };
    assert_eq!(action("4 supply 48"), Stimulus::Supply(source));
    let source = Source { limit_a: Some(10.0), ..source };
    assert_eq!(action("4 supply 48 limit 10"), Stimulus::Supply(source));
    let source = Source { resistance_ohm: Some(0.2), ..source };
    assert_eq!(action("4 supply 48 limit 10 resistance 0.2"), Stimulus::Supply(source));
    assert_eq!(action("4 power cut"), Stimulus::Power(Power::Cut));
    assert_eq!(action("4 temperature motor 95"), Stimulus::Temperature(TemperatureSensor::Motor, Some(95.0)));
    assert_eq!(action("4 temperature driver auto"), Stimulus::Temperature(TemperatureSensor::Driver, None));
    assert_eq!(action("4 fault hall on"), Stimulus::Fault(Component::Hall, true));
    assert_eq!(action("4 fault encoder off"), Stimulus::Fault(Component::Encoder, false));
    assert_eq!(action("4 fault eeprom on"), Stimulus::Fault(Component::Eeprom, true));
    assert_eq!(action("4 fault reference on"), Stimulus::Fault(Component::Reference, true));
    assert_eq!(action("4 fault phase on"), Stimulus::Fault(Component::Phase, true));
    assert_eq!(action("4 fault short on"), Stimulus::Fault(Component::Short, true));
    assert_eq!(action("4 fault bridge off"), Stimulus::Fault(Component::Bridge, false));
    assert_eq!(action("4 battery off"), Stimulus::Battery(false));
    assert_eq!(action("4 pulses 8192 10000"), Stimulus::Pulses(PulseTrain::Pulses { count: 8192, hz: 1e4 }));
    assert_eq!(action("4 quadrature -400 1e3"), Stimulus::Pulses(PulseTrain::Quadrature { count: -400, hz: 1e3 }));
    assert_eq!(action("4 duty 40"), Stimulus::Pulses(PulseTrain::Duty(40.0)));
    assert_eq!(action("4 clock 1e4"), Stimulus::Pulses(PulseTrain::Clock(1e4)));
    assert_eq!(action("4 cable cut"), Stimulus::CableCut(true));
    assert_eq!(action("4 cable join"), Stimulus::CableCut(false));
    assert_eq!("\t4   get ".parse(), Ok(Command::Get(Place::node(4))));
}

#[test]
fn understands_times_of_every_unit() {
    use can::Instant;
    let ms = Duration::from_millis;
    for (line, run) in [
        ("run 20ms", Run::For(ms(20))),
        ("run 20 ms", Run::For(ms(20))),
        ("run 2.5s", Run::For(ms(2500))),
        ("run 1min", Run::For(ms(60_000))),
        ("run 2h", Run::For(Duration::from_secs(7200))),
        ("run 100us", Run::For(Duration::from_micros(100))),
        ("run 100 µs", Run::For(Duration::from_micros(100))),
        ("run until 8760h", Run::Until(Instant::from_secs(365 * 86_400))),
        ("run 1ns", Run::For(Duration::from_nanos(1))),
        ("run 0s", Run::For(Duration::ZERO)),
        ("run until 2.5s", Run::Until(Instant::from_millis(2500))),
    ] {
        assert_eq!(line.parse(), Ok(Command::Run(run)), "{line}");
    }
    assert_eq!(Run::Until(Instant::from_secs(1)).end(Instant::from_secs(2)), Instant::from_secs(2));
    for line in [
        "run",
        "run until",
        "run 20",
        "run -1s",
        "run nans",
        "run infs",
        "run 1e9s",
        "run ms",
        "run until dawn",
        "run 1 d",
        "run 1.5sss",
        "run 8760.1h",
    ] {
        let error = line.parse::<Command>().expect_err(line).to_string();
        assert!(error.contains("run 20ms"), "{line}: {error}");
    }
}

#[test]
fn says_what_it_expected_of_a_malformed_line() {
    for (line, error) in [
        (
            "",
            "unknown command \"\"; expected now, help, run, quit, bus, body, or a node number and a command, as in: 4 get",
        ),
        (
            "hello",
            "unknown command \"hello\"; expected now, help, run, quit, bus, body, or a node number and a command, as in: 4 get",
        ),
        ("now 4", "expected: now"),
        ("quit now", "expected: quit"),
        ("0 get", "\"0\" is not a node number; expected 1 to 127"),
        ("128 get", "\"128\" is not a node number; expected 1 to 127"),
        ("-1 get", "\"-1\" is not a node number; expected 1 to 127"),
        ("+4 get", "\"+4\" is not a node number; expected 1 to 127"),
        ("99999999999999999999 get", "\"99999999999999999999\" is not a node number; expected 1 to 127"),
        (
            "4",
            "nothing to do is said after node 4; expected power, input, switch, load, rotor, supply, temperature, \
             fault, battery, pulses, quadrature, duty, clock, cable, bus, set or get, as in: 4 get",
        ),
        (
            "4 Power on",
            "unknown command \"Power\" for a node; expected power, input, switch, load, rotor, supply, \
             temperature, fault, battery, pulses, quadrature, duty, clock, cable, bus, set or get",
        ),
        ("4 power", "expected: NODE power on|off|cycle|cut"),
        ("4 power up", "expected: NODE power on|off|cycle|cut"),
        ("4 power on now", "expected: NODE power on|off|cycle|cut"),
        ("4 input X0", "expected: NODE input NAME 0|1"),
        ("4 input X0 2", "expected: NODE input NAME 0|1"),
        ("4 switch X0 5", "expected: NODE switch NAME LOW|min HIGH|max"),
        ("4 switch X0 a 5", "invalid position \"a\"; expected: NODE switch NAME LOW|min HIGH|max"),
        ("4 switch X0 max min", "invalid position \"max\"; expected: NODE switch NAME LOW|min HIGH|max"),
        ("4 switch X0 1.5 2", "invalid position \"1.5\"; expected: NODE switch NAME LOW|min HIGH|max"),
        ("4 switch X0 5 -5", "the range from 5 to -5 is empty; give the lower bound first"),
        ("4 load", "expected: NODE load torque|inertia|friction|pulley|spring|stop|fan|gear VALUES, or NODE load none"),
        ("4 load torque x", "invalid torque \"x\"; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
        ("4 load torque inf", "invalid torque \"inf\"; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
        ("4 load torque nan", "invalid torque \"nan\"; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
        ("4 load inertia -1", "invalid inertia \"-1\"; expected: NODE load torque N·m, or NODE load inertia kg·m²"),
        ("4 rotor stuck", "expected: NODE rotor lock|free"),
        ("4 supply", "expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]"),
        ("4 supply -1", "invalid voltage \"-1\"; expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]"),
        ("4 supply 1e999", "invalid voltage \"1e999\"; expected: NODE supply VOLTS [limit AMPERES] [resistance OHMS]"),
        ("4 temperature oil 5", "expected: NODE temperature motor|driver CELSIUS|auto"),
        (
            "4 temperature motor hot",
            "invalid temperature \"hot\"; expected: NODE temperature motor|driver CELSIUS|auto",
        ),
        (
            "4 temperature motor -300",
            "invalid temperature \"-300\"; expected: NODE temperature motor|driver CELSIUS|auto",
        ),
        ("4 fault hall", "expected: NODE fault hall|encoder|eeprom|reference|phase|short|bridge|bleeder on|off"),
        ("4 fault fuse on", "expected: NODE fault hall|encoder|eeprom|reference|phase|short|bridge|bleeder on|off"),
        ("4 battery low", "expected: NODE battery on|off"),
        ("4 pulses 5", "expected: NODE pulses COUNT HZ"),
        ("4 pulses 1.5 100", "invalid count \"1.5\"; expected: NODE pulses COUNT HZ"),
        ("4 quadrature 5 fast", "invalid frequency \"fast\"; expected: NODE quadrature COUNT HZ"),
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
fn says_what_it_expected_of_a_malformed_fault_of_the_bus() {
    for (line, error) in [
        ("4 bus", "expected: NODE bus silent|late|babble|overrun|corrupt .."),
        ("4 bus late 5", "expected: NODE bus late MIN_MS MAX_MS, or NODE bus late off"),
        ("4 bus late 5 1", "invalid longest delay \"1\"; expected: NODE bus late MIN_MS MAX_MS, or NODE bus late off"),
        ("4 bus late 5 20d", "invalid time in ms \"20d\"; expected: NODE bus late MIN_MS MAX_MS, or NODE bus late off"),
        ("4 bus late nan 5", "invalid time in ms \"nan\"; expected: NODE bus late MIN_MS MAX_MS, or NODE bus late off"),
        (
            "4 bus corrupt 1.5",
            "invalid probability \"1.5\"; expected: NODE bus corrupt PROBABILITY (0 to 1), or NODE bus corrupt off",
        ),
        ("bus", "expected: bus corrupt PROBABILITY (0 to 1), bus corrupt off, or bus destroy NTH_FRAME BIT"),
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

#[test]
fn a_drive_has_the_axes_that_it_has_and_its_objects_are_its_own() {
    let mut world = World::new(can::Bitrate::K500, 1);
    world.add_drive(4, Box::new(crate::machine::zlac8030l(4, 1))).expect("the first drive");
    let mut json = |line: &str| answer(&mut world, line).expect("an answer").json;
    assert!(json("4.1 get").contains("\"node\":4"));
    assert_eq!(
        json("4.2 get"),
        r#"{"ok":false,"error":{"kind":"refused","message":"a zlac8030l has no axis 2; it has 1","node":null,"object":null,"abort":null,"next":"give what this drive has and takes; help lists the commands"}}"#
    );
    assert_eq!(
        json("4.2 load torque 1"),
        r#"{"ok":false,"error":{"kind":"refused","message":"a zlac8030l has no axis 2; it has 1","node":null,"object":null,"abort":null,"next":"give what this drive has and takes; help lists the commands"}}"#
    );
    assert_eq!(
        json("4 set 6041 0"),
        r#"{"ok":false,"error":{"kind":"refused","message":"a zlac8030l sets its objects by itself; write 6041h:00 over the bus, as its host does","node":null,"object":null,"abort":null,"next":"give what this drive has and takes; help lists the commands"}}"#
    );
}

#[test]
fn what_was_done_to_a_drive_is_in_its_recording() {
    let mut world = World::new(can::Bitrate::K500, 1);
    world.add_drive(4, Box::new(crate::machine::zlac8030l(4, 1))).expect("the first drive");
    world.start_recording(crate::recorder::Recorder::new(Duration::from_millis(1), []));
    for line in ["4 supply 40", "4 supply 400", "4 cable cut", "4.2 rotor lock"] {
        answer(&mut world, line);
    }
    let recorder = world.stop_recording().expect("it was started");
    let done: Vec<String> = recorder.stimuli().iter().map(|(_, place, done)| format!("{place} {done}")).collect();
    assert_eq!(done, ["4 supply 40", "4 cable cut"], "what was refused is not in it");
}

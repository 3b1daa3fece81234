//! The descriptions that an FMU carries: of its variables (FMI 3.0, 2.4), of its networks and of the layered standard.

mod fmi2;
mod parts;

use std::fmt::Write as _;
use std::path::Path;

use words::escaped;

use crate::config::{Config, TxClock};
use crate::unit::Unit;
use crate::variable::{Causality, Reference, Terminal, Variable};
use parts::{LOG_CATEGORIES, dependencies, units};
pub use parts::{MODEL_IDENTIFIER, token};

/// The value reference of time.
pub const TIME: Reference = 0;
const MIME_TYPE: &str = "application/org.fmi-standard.fmi-ls-bus.can; version=&quot;1.0.0&quot;";

/// `modelDescription.xml`.
pub fn model_description(config: &Config, resources: &Path, unit: &Unit) -> String {
    let name = match config {
        Config::Drive(drive) => drive.drive.clone(),
        Config::Bus(bus) => format!("CAN bus of {} nodes", bus.nodes),
        Config::Axis(axis) => return fmi2::model_description(config, axis, resources, &unit.variables()),
    };
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{}\" \
         instantiationToken=\"{}\" generationTool=\"Ferrodrive {}\" variableNamingConvention=\"flat\">\n  \
         <CoSimulation modelIdentifier=\"{MODEL_IDENTIFIER}\" canHandleVariableCommunicationStepSize=\"true\" \
         hasEventMode=\"true\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\"/>\n",
        escaped(&name),
        token(config, resources),
        env!("CARGO_PKG_VERSION"),
    );
    xml.push_str(&units());
    xml.push_str(LOG_CATEGORIES);
    xml.push_str("  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.001\"/>\n  <ModelVariables>\n");
    let _ = writeln!(
        xml,
        "    <Float64 name=\"time\" valueReference=\"{TIME}\" causality=\"independent\" variability=\"continuous\"/>"
    );
    let (variables, terminals) = (unit.variables(), unit.terminals());
    let notifies = |variable: &Variable| terminals.iter().any(|it| it.notifications == variable.reference);
    variables.iter().for_each(|variable| element(&mut xml, variable, notifies(variable)));
    terminals.iter().for_each(|terminal| network(&mut xml, terminal, config.clock()));
    xml.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let outputs = variables.iter().filter(|variable| variable.causality == Causality::Output);
    let calculated = |variable: &&Variable| !notifies(variable);
    for variable in outputs.clone() {
        let _ = writeln!(xml, "    <Output valueReference=\"{}\"{}/>", variable.reference, dependencies(variable));
    }
    for terminal in &terminals {
        if config.clock() == TxClock::Triggered {
            let _ = writeln!(xml, "    <Output valueReference=\"{}\"/>", terminal.tx_clock);
        }
        let _ = writeln!(xml, "    <Output valueReference=\"{}\"/>", terminal.tx_data);
    }
    let clocks = terminals.iter().filter(|_| config.clock() == TxClock::Triggered).map(|terminal| terminal.tx_clock);
    for reference in outputs.filter(calculated).map(|variable| variable.reference).chain(clocks) {
        let _ = writeln!(xml, "    <InitialUnknown valueReference=\"{reference}\"/>");
    }
    xml.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    xml
}

/// `terminalsAndIcons/terminalsAndIcons.xml`.
pub fn terminals_and_icons(unit: &Unit) -> String {
    let mut xml = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiTerminalsAndIcons fmiVersion=\"3.0\">\n  <Terminals>\n",
    );
    for Terminal { name, .. } in unit.terminals() {
        let _ = writeln!(
            xml,
            "    <Terminal name=\"{name}\" terminalKind=\"org.fmi-ls-bus.network-terminal\" \
             matchingRule=\"org.fmi-ls-bus.transceiver\">"
        );
        for member in ["Rx_Clock", "Rx_Data", "Tx_Clock", "Tx_Data"] {
            let _ = writeln!(
                xml,
                "      <TerminalMemberVariable variableKind=\"signal\" variableName=\"{name}.{member}\" memberName=\"{member}\"/>"
            );
        }
        let _ = writeln!(
            xml,
            "      <Terminal name=\"Configuration\" terminalKind=\"org.fmi-ls-bus.network-terminal.configuration\" \
             matchingRule=\"bus\">\n        <TerminalMemberVariable variableKind=\"signal\" \
             variableName=\"{name}.BusNotifications\" memberName=\"BusNotifications\"/>\n      </Terminal>\n    \
             </Terminal>"
        );
    }
    xml.push_str("  </Terminals>\n</fmiTerminalsAndIcons>\n");
    xml
}

/// `extra/org.fmi-standard.fmi-ls-bus/fmi-ls-manifest.xml`.
pub fn manifest(config: &Config) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiLayeredStandardManifest \
         xmlns:fmi-ls=\"http://fmi-standard.org/fmi-ls-manifest\" fmi-ls:fmi-ls-name=\"org.fmi-standard.fmi-ls-bus\" \
         fmi-ls:fmi-ls-version=\"1.0.0\" fmi-ls:fmi-ls-description=\"Layered Standard for the simulation of bus \
         communication on a Physical Signal Abstraction or Network Abstraction based level.\" \
         isBusSimulationFMU=\"{}\"/>\n",
        matches!(config, Config::Bus(_))
    )
}

/// One variable; a constant has its value as its start.
fn element(xml: &mut String, variable: &Variable, notifications: bool) {
    let Variable { reference, name, causality, value, unit, description, .. } = variable;
    let kind = value.type_name();
    let variability = match (causality, kind) {
        (Causality::Parameter, _) => "fixed",
        (Causality::Output, _) if notifications => "constant",
        (_, "Float64") => "continuous",
        _ => "discrete",
    };
    let _ = write!(
        xml,
        "    <{kind} name=\"{}\" valueReference=\"{reference}\" causality=\"{}\" variability=\"{variability}\" \
         description=\"{}\"",
        escaped(name),
        causality.word(),
        escaped(description),
    );
    if !unit.is_empty() {
        let _ = write!(xml, " unit=\"{unit}\"");
    }
    if *causality != Causality::Output || notifications {
        let _ = write!(xml, " start=\"{}\"", escaped(&value.text()));
    }
    xml.push_str("/>\n");
}

/// The four variables of a network.
fn network(xml: &mut String, terminal: &Terminal, clock: TxClock) {
    let Terminal { name, rx_data, rx_clock, tx_data, tx_clock, .. } = terminal;
    let (causality, interval) = match clock {
        TxClock::Countdown => ("input", "countdown"),
        TxClock::Triggered => ("output", "triggered"),
    };
    let _ = writeln!(
        xml,
        "    <Clock name=\"{name}.Rx_Clock\" valueReference=\"{rx_clock}\" causality=\"input\" variability=\"discrete\" \
         intervalVariability=\"triggered\"/>\n    <Binary name=\"{name}.Rx_Data\" valueReference=\"{rx_data}\" \
         causality=\"input\" variability=\"discrete\" clocks=\"{rx_clock}\" mimeType=\"{MIME_TYPE}\"><Start \
         value=\"\"/></Binary>\n    <Clock name=\"{name}.Tx_Clock\" valueReference=\"{tx_clock}\" \
         causality=\"{causality}\" variability=\"discrete\" intervalVariability=\"{interval}\"/>\n    <Binary \
         name=\"{name}.Tx_Data\" valueReference=\"{tx_data}\" causality=\"output\" variability=\"discrete\" \
         clocks=\"{tx_clock}\" mimeType=\"{MIME_TYPE}\"/>"
    );
}

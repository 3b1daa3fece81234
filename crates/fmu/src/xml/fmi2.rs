//! The description of a drive with a master, by FMI 2.0.

use std::fmt::Write as _;
use std::path::Path;

use words::escaped;

use super::parts::{LOG_CATEGORIES, MODEL_IDENTIFIER, dependencies, token, units};
use crate::config::{AxisConfig, Config};
use crate::fmi2::VariableKind;
use crate::variable::{Causality, Variable};

/// `modelDescription.xml` (FMI 2.0.5, 2.2 and 4.3).
pub(super) fn model_description(
    config: &Config,
    axis: &AxisConfig,
    resources: &Path,
    variables: &[Variable],
) -> String {
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{}\" guid=\"{}\" \
         generationTool=\"Ferrodrive {}\" variableNamingConvention=\"flat\">\n  <CoSimulation \
         modelIdentifier=\"{MODEL_IDENTIFIER}\" canHandleVariableCommunicationStepSize=\"true\" \
         canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"/>\n",
        escaped(&format!("{}, {}", axis.drive.drive, axis.mode.word())),
        token(config, resources),
        env!("CARGO_PKG_VERSION"),
    );
    xml.push_str(&units());
    xml.push_str(LOG_CATEGORIES);
    xml.push_str("  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.001\"/>\n  <ModelVariables>\n");
    variables.iter().for_each(|variable| element(&mut xml, variable));
    xml.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let is_output = |(_, variable): &(usize, &Variable)| variable.causality == Causality::Output;
    for list in ["Outputs", "InitialUnknowns"] {
        let _ = writeln!(xml, "    <{list}>");
        // Variables are counted from 1, in the order in which they stand.
        for (index, variable) in (1..).zip(variables).filter(is_output) {
            let _ = writeln!(xml, "      <Unknown index=\"{index}\"{}/>", dependencies(variable));
        }
        let _ = writeln!(xml, "    </{list}>");
    }
    xml.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    xml
}

fn element(xml: &mut String, variable: &Variable) {
    let Variable { reference, name, causality, value, unit, description, .. } = variable;
    let kind = VariableKind::of(value);
    let (variability, initial) = match (causality, kind) {
        (Causality::Parameter, _) => ("fixed", " initial=\"exact\""),
        (Causality::Output, VariableKind::Real) => ("continuous", " initial=\"calculated\""),
        (Causality::Output, _) => ("discrete", " initial=\"calculated\""),
        // An input has none (FMI 2.0.5, 2.2.7).
        (Causality::Input, VariableKind::Real) => ("continuous", ""),
        (Causality::Input, _) => ("discrete", ""),
    };
    let _ = write!(
        xml,
        "    <ScalarVariable name=\"{}\" valueReference=\"{reference}\" description=\"{}\" causality=\"{}\" \
         variability=\"{variability}\"{initial}><{}",
        escaped(name),
        escaped(description),
        causality.word(),
        kind.element(),
    );
    if *causality != Causality::Output {
        let _ = write!(xml, " start=\"{}\"", escaped(&value.text()));
    }
    if !unit.is_empty() {
        let _ = write!(xml, " unit=\"{unit}\"");
    }
    xml.push_str("/></ScalarVariable>\n");
}

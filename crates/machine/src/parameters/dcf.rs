//! Parameters of a node as a DCF (CiA 306-1).

use canopen::NodeId;
use devices::Description;
use eds::document::Document;
use eds::{Commissioning, Configuration, Eds, Reading, Refusal, Severity, Sheet, parameter_values};
use master::identify::Identity;
use master::parameters::Parameters;

/// The parameters in a DCF. `node` is what it is read for where it does not say a node itself.
///
/// # Errors
/// Everything that is wrong with it, for people.
pub fn of_dcf(file: &[u8], node: NodeId) -> Result<Parameters, String> {
    let reading = Document::parse(file).and_then(|document| Eds::read(&document));
    of_reading(reading.map_err(|refusal| refused(&refusal))?, node, "FILE")
}

/// What a data sheet is refused for, and where.
pub(super) fn refused(refusal: &Refusal) -> String {
    match refusal.line {
        0 => refusal.reason.clone(),
        line => format!("line {line}: {}", refusal.reason),
    }
}

/// The values of what was read from a file of this name.
pub(super) fn of_reading(reading: Reading, node: NodeId, name: &str) -> Result<Parameters, String> {
    // What the reader had to guess or to leave out of values and of lists of objects: the file is not whole.
    let is_broken = |finding: &&eds::Finding| {
        finding.severity() == Severity::Error
            && (finding.key.as_deref().is_some_and(|key| key.eq_ignore_ascii_case("ParameterValue"))
                || finding.section.ends_with("Value")
                || finding.section.ends_with("Objects"))
    };
    if let Some(first) = reading.findings.iter().find(is_broken) {
        let all = reading.findings.iter().filter(is_broken).count();
        return Err(format!(
            "it is not whole: line {first}{}. `ferrodrive eds lint {name}` shows all",
            if all > 1 { format!(", and {} more", all - 1) } else { String::new() },
        ));
    }
    let eds = reading.eds;
    let of_file = eds.commissioning.as_ref().and_then(|device| NodeId::new(device.node_id?));
    let mut parameters = Parameters { node: of_file, ..Parameters::default() };
    let mut wrong = Vec::new();
    for value in parameter_values(&eds, of_file.unwrap_or(node).raw()) {
        match value {
            Ok((object, bytes)) => {
                parameters.values.insert(object, bytes);
            }
            Err(refusal) => wrong.push(format!("line {}: {refusal}", refusal.line)),
        }
    }
    if !wrong.is_empty() {
        return Err(wrong.join("; "));
    }
    if parameters.values.is_empty() && !eds.is_dcf() {
        return Err("it is a data sheet without values (no ParameterValue in it): a DCF has some".into());
    }
    let known = |number: Option<u32>| number.filter(|number| *number != 0);
    parameters.identity = Identity {
        device_type: None,
        vendor_id: known(eds.device.vendor_number),
        product_code: known(eds.device.product_number),
        revision_number: known(eds.device.revision_number),
    };
    Ok(parameters)
}

/// The model's data sheet with every value, as a file of this name.
///
/// # Errors
/// That a value has no place in the sheet, or the name none in a line.
pub fn to_dcf(parameters: &Parameters, model: &'static Description, name: &str) -> Result<Vec<u8>, String> {
    let sheet =
        Document::parse(eds::write(&Sheet::of(model).eds()).as_bytes()).map_err(|refusal| refusal.to_string())?;
    let node = parameters.node.map_or(0, NodeId::raw);
    let mut made = Configuration::new(sheet, node).map_err(|refusal| refusal.to_string())?;
    for (object, bytes) in &parameters.values {
        made.set(*object, bytes, true).map_err(|error| format!("{object}: {error}"))?;
    }
    let device = Commissioning { node_id: Some(node), net_number: Some(1), ..Commissioning::default() };
    made.commission(&device, name).map_err(|error| error.to_string())?;
    Ok(made.into_document().to_bytes())
}

//! What a data sheet says of the device behind a node, and which model that is.

use std::path::Path;

use canopen::{Mux, NodeId};
use devices::Description;
use eds::{Eds, Severity as LintSeverity, Value};
use sim::machine::models;

use super::finding::{Place, Reporter, Severity};
use words::counted;
use words::data_sheet::{self, Unread};

/// A data sheet, and the model that it fits best.
pub(super) struct Device {
    pub(super) eds: Eds,
    pub(super) model: Option<&'static Description>,
}

/// Reads the sheet of a node; what is wrong with it is reported.
pub(super) fn read(path: &Path, at: Place, report: &mut Reporter<'_>) -> Option<Device> {
    report.rule = "data-sheet";
    let shown = path.display();
    let reading = match data_sheet::reading(path) {
        Ok(reading) => reading,
        Err(Unread::File(error)) => {
            let next = "the path is taken from the folder of this file; `ferrodrive eds MODEL` writes the sheet of a known drive";
            report.say(Severity::Error, at, format!("cannot read {shown}: {error}"), next);
            return None;
        }
        Err(Unread::Refused(refusal)) => {
            report.say(
                Severity::Error,
                at,
                format!("{shown} is not a data sheet: {refusal}"),
                format!("ferrodrive eds lint {shown}"),
            );
            return None;
        }
    };
    let errors = reading.findings.count(LintSeverity::Error);
    if errors > 0 {
        let what = format!("{shown} has {}, for which strict tools such as dcfgen refuse it", counted(errors, "error"));
        report.say(Severity::Warning, at, what, format!("ferrodrive eds lint {shown}"));
    }
    let model = model_of(&reading.eds);
    Some(Device { eds: reading.eds, model })
}

/// The model whose identity the sheet has, and of those the one that has most of its manufacturer's objects.
fn model_of(eds: &Eds) -> Option<&'static Description> {
    let identity = |sub_index| number(eds.variable(0x1018, sub_index)?.default.as_ref()?, None);
    let (vendor, product) = (identity(1).unwrap_or(0), identity(2).unwrap_or(0));
    let own: Vec<u16> =
        eds.objects.iter().map(|object| object.index).filter(|index| (0x2000..0x6000).contains(index)).collect();
    let shared = |model: &Description| own.iter().filter(|index| model.has_index(**index)).count();
    let fits = |model: &&Description| {
        let stated = vendor != 0 || product != 0;
        let same = (i128::from(model.identity.vendor_id), i128::from(model.identity.product_code)) == (vendor, product);
        (same || !stated) && !own.is_empty() && shared(model) * 10 >= own.len() * 8
    };
    // The first of those that fit alike: they have the same objects.
    models().filter(fits).reduce(|best, next| if shared(next) > shared(best) { next } else { best })
}

/// A whole number of a sheet; one that depends on the node-ID, at `node`.
fn number(value: &Value, node: Option<NodeId>) -> Option<i128> {
    match value {
        Value::Number(number) => Some(number.at_node(node.map_or(0, NodeId::raw))),
        _ => None,
    }
}

impl Device {
    /// What an object holds in a device as delivered, or as a DCF wants it.
    pub(super) fn value(&self, mux: Mux, node: Option<NodeId>) -> Option<i128> {
        let variable = self.eds.variable(mux.index, mux.sub_index)?;
        number(variable.value_or_default()?, node)
    }

    /// True if the sheet has an object of this index.
    pub(super) fn has(&self, index: u16) -> bool {
        self.eds.object(index).is_some()
    }

    /// Name to print: of the model, or as the sheet says.
    pub(super) fn title(&self) -> String {
        self.model.map_or_else(|| self.eds.device.product_name.clone(), |model| model.title.to_owned())
    }
}

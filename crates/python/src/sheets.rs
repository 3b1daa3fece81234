//! Models and their data sheets.

use canopen::NodeId;
use devices::Description;
use devices::variant::Variant;
use eds::{Flavour, Sheet, write};
use pyo3::prelude::*;

use crate::failure::bad_value;

/// Names of the models that can be simulated.
#[pyfunction]
pub(crate) fn models() -> Vec<&'static str> {
    sim::machine::models().map(|model| model.name).collect()
}

/// The text of a model's data sheet (CiA 306-1), as `ferrodrive eds MODEL` writes it.
#[pyfunction]
#[pyo3(name = "eds", signature = (model, node=None))]
pub(crate) fn sheet(model: &str, node: Option<u8>) -> PyResult<String> {
    let node_id = node.map(node_id).transpose()?;
    let description = model_of(model)?;
    let sheet = Sheet {
        description,
        variant: Variant::first_of(description.variations),
        presets: &[],
        node_id,
        flavour: Flavour::Standard,
    };
    Ok(write(&sheet.eds()))
}

/// The name of a model, as it is written; or of a file that describes one.
#[pyfunction]
pub(crate) fn model_name(model: &str) -> PyResult<&'static str> {
    model_of(model).map(|model| model.name)
}

/// A model by its name, or by a file that describes it (EDS, DCF).
pub(crate) fn model_of(name: &str) -> PyResult<&'static Description> {
    words::models::resolve(name).map_err(bad_value)
}

/// A node-ID, 1 to 127.
pub(crate) fn node_id(raw: u8) -> PyResult<NodeId> {
    NodeId::new(raw).ok_or_else(|| bad_value(format!("{raw} is not a node-ID; expected 1 to 127")))
}

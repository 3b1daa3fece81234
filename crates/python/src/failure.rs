//! Errors as Python has them.

use std::path::Path;

use canopen::NodeId;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use words::calls::in_python;
use words::failure::{Failure, Subject};

mod classes {
    #![allow(missing_docs, reason = "the classes have their words in ferrodrive/errors.py")]
    pyo3::import_exception!(ferrodrive.errors, Refused);
}

/// A stimulus or an order that the world or the device does not take.
pub(crate) fn refused(error: impl ToString) -> PyErr {
    classes::Refused::new_err(error.to_string())
}

/// An argument that makes no sense.
pub(crate) fn bad_value(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// What is wrong with a file, with its name: what is wrong in it has that already.
pub(crate) fn named(path: &Path, reason: String) -> String {
    let shown = path.display().to_string();
    if reason.starts_with(&shown) { reason } else { format!("{shown}: {reason}") }
}

/// A use of something whose time is over, or in a process that it does not belong to.
pub(crate) fn wrong_use(error: impl ToString) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Why the master did not get there: its words, what is wrong with the bus, and the parts for programs.
pub(crate) fn master_error(py: Python<'_>, text: &str, failure: &Failure, bus: Option<&str>) -> PyErr {
    let Subject { node, object, abort } = failure.subject;
    let (text, bus_said) = (in_python(text), bus.map(|bus| format!("; {bus}")).unwrap_or_default());
    let parts = (
        failure.kind,
        in_python(&failure.what),
        failure.because.iter().map(String::as_str).chain(bus).map(in_python).collect::<Vec<_>>(),
        failure.next.iter().map(|advice| in_python(advice)).collect::<Vec<_>>(),
        (
            node.map(|node| u16::from(node.raw())),
            object.map(|mux| (mux.index, mux.sub_index)),
            abort.map(|code| code.0),
        ),
    );
    let made = py
        .import("ferrodrive.errors")
        .and_then(|errors| errors.call_method1("made", (format!("{text}{bus_said}"), parts)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Why a request was not even tried, or a file is not taken.
pub(crate) fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    master_error(py, &failure.to_string(), failure, None)
}

/// How a program says which model a node is.
pub(crate) fn how_to_say(node: NodeId, models: &[&str]) -> String {
    let (first, others) = models.split_first().unwrap_or((&"MODEL", &[]));
    let others = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
    format!("network.drive({node}, {first:?}){others}, or a machine file: Network(bus, machine=FILE)")
}

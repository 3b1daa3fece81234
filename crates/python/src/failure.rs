//! Errors as Python has them.

use std::path::Path;

use master::Error;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

mod classes {
    #![allow(missing_docs, reason = "the classes have their words in ferrodrive/errors.py")]
    pyo3::import_exception!(ferrodrive.errors, Refused);
    pyo3::import_exception!(ferrodrive.errors, MasterError);
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

/// Why the master did not get there: its words, what is wrong with the bus, and the abort code for programs.
pub(crate) fn master_error(py: Python<'_>, error: &Error, bus: Option<String>) -> PyErr {
    let bus = bus.map(|bus| format!("; {bus}")).unwrap_or_default();
    let raised = classes::MasterError::new_err(format!("{error}{bus}"));
    if let Error::Aborted { node, mux, code, .. } = error {
        let value = raised.value(py);
        let set = value
            .setattr("node", node.raw())
            .and_then(|()| value.setattr("object", (mux.index, mux.sub_index)))
            .and_then(|()| value.setattr("abort_code", code.0));
        if let Err(failed) = set {
            return failed;
        }
    }
    raised
}

/// What a group or a base says, and what is wrong with the bus.
pub(crate) fn said(text: &str, bus: Option<String>) -> PyErr {
    let bus = bus.map(|bus| format!("; {bus}")).unwrap_or_default();
    classes::MasterError::new_err(format!("{text}{bus}"))
}

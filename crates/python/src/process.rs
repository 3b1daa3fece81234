//! In which process this is: a child of `fork` has the objects of its parent in its memory, and perhaps a lock of one held for ever.
//!
//! The interpreter reports each fork to the child. To ask the system for the number of the process takes longer than all that an
//! exchange with a physics engine does beside its drives.

use std::sync::atomic::{AtomicU32, Ordering};

use pyo3::prelude::*;
use pyo3::types::PyDict;

static FORKS: AtomicU32 = AtomicU32::new(0);

/// How many forks lie between this process and the one that has loaded the package: an object is of the process whose number it has.
pub(crate) fn generation() -> u32 {
    FORKS.load(Ordering::Relaxed)
}

#[pyfunction]
fn forked() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

/// Counts forks from now on, where the system has them.
pub(crate) fn watch(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let os = module.py().import("os")?;
    if let Some(register) = os.getattr_opt("register_at_fork")? {
        let arguments = PyDict::new(module.py());
        arguments.set_item("after_in_child", wrap_pyfunction!(forked, module)?)?;
        register.call((), Some(&arguments))?;
    }
    Ok(())
}

//! The native half of the Python package `ferrodrive`.
//!
//! Only what must be fast or must know the Rust side is here: a world that moves without the interpreter's lock, scenarios,
//! and the master. What users see (classes with units in their docstrings, the stand-in for the clock, the interface for
//! python-can) is Python, in `python/ferrodrive`, and stands on `ferrodrive._native`.
//!
//! A world is behind a lock of its own: two threads may use it in turn. A process that was forked refuses the worlds of its
//! parent, whose lock another thread may have held.

mod external;
mod failure;
mod frames;
mod live;
mod master;
mod process;
mod scenario;
mod sheets;
mod world;

use pyo3::prelude::*;

/// Native half of the package `ferrodrive`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    process::watch(module)?;
    module.add_class::<world::World>()?;
    module.add_class::<external::Worlds>()?;
    module.add_function(wrap_pyfunction!(external::couple_external, module)?)?;
    module.add_function(wrap_pyfunction!(external::exchange, module)?)?;
    module.add_function(wrap_pyfunction!(external::exchange_torque, module)?)?;
    module.add_function(wrap_pyfunction!(external::begin_exchange, module)?)?;
    module.add_function(wrap_pyfunction!(external::exchanged, module)?)?;
    module.add_function(wrap_pyfunction!(external::external_shafts, module)?)?;
    module.add_class::<master::Network>()?;
    module.add_class::<master::Job>()?;
    module.add_class::<master::axes::Group>()?;
    module.add_class::<master::axes::Base>()?;
    module.add_class::<master::supervise::Supervisor>()?;
    module.add_function(wrap_pyfunction!(master::whole::scan, module)?)?;
    module.add_function(wrap_pyfunction!(master::whole::boot, module)?)?;
    module.add_function(wrap_pyfunction!(master::whole::check, module)?)?;
    module.add_function(wrap_pyfunction!(master::whole::check_file, module)?)?;
    module.add_function(wrap_pyfunction!(master::whole::plan, module)?)?;
    module.add_function(wrap_pyfunction!(master::whole::explain, module)?)?;
    module.add_function(wrap_pyfunction!(master::capture::capture, module)?)?;
    module.add_function(wrap_pyfunction!(master::capture_file::save_capture, module)?)?;
    module.add_function(wrap_pyfunction!(master::capture_file::load_capture, module)?)?;
    module.add_function(wrap_pyfunction!(master::capture_file::tune_capture, module)?)?;
    module.add_function(wrap_pyfunction!(master::test_motion::test_motion, module)?)?;
    module.add_function(wrap_pyfunction!(master::tune::tune_drive, module)?)?;
    module.add_function(wrap_pyfunction!(master::tune::tune_ramps_of, module)?)?;
    module.add_function(wrap_pyfunction!(master::report::report, module)?)?;
    module.add_function(wrap_pyfunction!(master::params::params_backup, module)?)?;
    module.add_function(wrap_pyfunction!(master::params::params_compare, module)?)?;
    module.add_function(wrap_pyfunction!(master::params::params_compare_nodes, module)?)?;
    module.add_function(wrap_pyfunction!(master::params::params_apply, module)?)?;
    module.add_function(wrap_pyfunction!(master::params::params_rollback, module)?)?;
    module.add_class::<scenario::Sweep>()?;
    module.add_class::<scenario::Summary>()?;
    module.add_function(wrap_pyfunction!(scenario::run_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(sheets::models, module)?)?;
    module.add_function(wrap_pyfunction!(sheets::model_name, module)?)?;
    module.add_function(wrap_pyfunction!(sheets::sheet, module)?)?;
    module.add_function(wrap_pyfunction!(world::stimulus_forms, module)?)?;
    module.add_function(wrap_pyfunction!(world::stimulus_words, module)?)?;
    Ok(())
}

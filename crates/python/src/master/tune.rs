//! Gains for the loops of a drive, for Python: the parts are those of `ferrodrive tune`.

use std::path::PathBuf;

use host::capture::with_left;
use host::tune::{Bounds, Order, loops_of, tune};
use master::cyclic::CyclicOptions;
use pyo3::prelude::*;

use super::capture::not_put_back;
use super::job::Trouble;
use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network, duration};
use crate::failure::bad_value;

/// What is asked for, in plain values.
#[derive(FromPyObject)]
pub(crate) struct TuneOrder {
    #[pyo3(item)]
    bandwidth_hz: Option<f64>,
    #[pyo3(item)]
    phase_margin_deg: f64,
    #[pyo3(item)]
    position: bool,
    #[pyo3(item)]
    speed_rpm: Option<f64>,
    #[pyo3(item)]
    current_a: f64,
    #[pyo3(item)]
    travel_turns: f64,
    #[pyo3(item)]
    period: f64,
    #[pyo3(item)]
    torque_constant_nm_a: Option<f64>,
    #[pyo3(item)]
    apply: bool,
    #[pyo3(item)]
    journal: Option<PathBuf>,
}

/// Measures a drive, proposes gains, and has it try them, if that is asked for.
#[pyfunction]
pub(crate) fn tune_drive(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    order: TuneOrder,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    let wanted = Order {
        bandwidth_hz: order.bandwidth_hz,
        phase_margin_deg: order.phase_margin_deg,
        position: order.position,
        speed_rpm: order.speed_rpm,
        current_a: order.current_a,
        travel_turns: order.travel_turns,
        period_ms: duration(order.period)?.as_secs_f64() * 1e3,
        torque_constant_nm_a: order.torque_constant_nm_a,
    };
    let request = wanted.request(Bounds::default().speed_rpm, CyclicOptions::default(), asked.journal(order.journal));
    let mut request = request.map_err(|failure| bad_value(failure.what))?;
    request.apply = order.apply;
    network.get().begin_leading_back(py, |way_back| async move {
        let drive = asked.drive().await?;
        if wanted.speed_rpm.is_none() {
            request.bounds.speed_rpm = loops_of(&drive)?.1.usual_rpm;
        }
        let restorer = way_back.of(&drive);
        let tuned = tune((&drive, restorer), &request, &(), std::future::ready(false)).await;
        let left = restorer.restore().await;
        let report = Value::report(&tuned.map_err(|failure| with_left(failure, &left))?);
        match not_put_back(asked.node, &left) {
            Some(failure) => Err(Trouble::Reported(with_left(failure, &left), Box::new(report))),
            None => Ok(report),
        }
    })
}

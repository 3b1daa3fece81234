//! Gains for the loops of a drive, for Python: the parts are those of `ferrodrive tune`.

use std::path::PathBuf;
use std::time::Duration;

use host::capture::with_left;
use host::tune::{Bounds, Objective, Request, loops_of, tune};
use master::cyclic::CyclicOptions;
use pyo3::prelude::*;

use super::capture::not_put_back;
use super::job::Trouble;
use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network, duration};
use crate::failure::bad_value;

/// Longest time for the transaction with the proposed values, as the default of the command line.
const WITHIN: Duration = Duration::from_secs(60);

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
    let objective = order.bandwidth_hz.map_or(Objective::PhaseMargin(order.phase_margin_deg), Objective::Bandwidth);
    let mut request = Request {
        objective,
        with_position: order.position,
        period: duration(order.period)?,
        bounds: Bounds {
            speed_rpm: order.speed_rpm.unwrap_or(Bounds::default().speed_rpm).abs(),
            current_a: order.current_a.abs(),
            travel_turns: order.travel_turns,
        },
        cyclic: CyclicOptions::default(),
        torque_constant_nm_a: order.torque_constant_nm_a,
        journal: asked.journal(order.journal),
        on_kept: |_| (),
        apply: order.apply,
        within: WITHIN,
    };
    request.check().map_err(|failure| bad_value(failure.what))?;
    network.get().begin_leading_back(py, |way_back| async move {
        let drive = asked.drive().await?;
        if order.speed_rpm.is_none() {
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

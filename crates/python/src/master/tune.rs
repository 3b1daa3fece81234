//! Gains for the loops of a drive, for Python: the parts are those of `ferrodrive tune`.

use std::path::PathBuf;

use host::capture::with_left;
use host::tune::{Bounds, LoadOrder, Order, loops_of, tune, tune_ramps};
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
    current_a: Option<f64>,
    #[pyo3(item)]
    travel_turns: f64,
    #[pyo3(item)]
    period: Option<f64>,
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
        current_a: order.current_a.unwrap_or(Bounds::default().current_a),
        travel_turns: order.travel_turns,
        period_ms: order.period.map(|period| Ok::<_, PyErr>(duration(period)?.as_secs_f64() * 1e3)).transpose()?,
        torque_constant_nm_a: order.torque_constant_nm_a,
    };
    let request = wanted.request(Bounds::default().speed_rpm, CyclicOptions::default(), asked.journal(order.journal));
    let mut request = request.map_err(|failure| bad_value(failure.what))?;
    request.apply = order.apply;
    network.get().begin_leading_back(py, |way_back| async move {
        let drive = asked.drive().await?;
        let (_, loops) = loops_of(&drive)?;
        if wanted.speed_rpm.is_none() {
            request.bounds.speed_rpm = loops.usual_rpm;
        }
        if order.current_a.is_none() {
            request.bounds.current_a = loops.usual_a;
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

/// What a stepper turns, and how fast it is to be, in plain values.
#[derive(FromPyObject)]
pub(crate) struct RampOrder {
    #[pyo3(item)]
    inertia_kg_m2: f64,
    #[pyo3(item)]
    friction_nm: f64,
    #[pyo3(item)]
    load_nm: f64,
    #[pyo3(item)]
    speed_rpm: f64,
    #[pyo3(item)]
    margin: f64,
    #[pyo3(item)]
    ramp: Option<f64>,
    #[pyo3(item)]
    apply: bool,
    #[pyo3(item)]
    journal: Option<PathBuf>,
}

/// Computes ramps and currents of a stepper for a load, and writes them, if that is asked for.
#[pyfunction]
pub(crate) fn tune_ramps_of(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    order: RampOrder,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    let wanted = LoadOrder {
        inertia_kg_m2: order.inertia_kg_m2,
        friction_nm: order.friction_nm,
        load_nm: order.load_nm,
        speed_rpm: order.speed_rpm.abs(),
        margin: order.margin,
        ramp_ms: order.ramp.map(duration).transpose()?.map(|ramp| ramp.as_secs_f64() * 1e3),
    };
    let mut request = wanted.request().map_err(|failure| bad_value(failure.what))?;
    (request.apply, request.journal) = (order.apply, asked.journal(order.journal));
    network.get().begin_said(py, async move {
        let drive = asked.drive().await?;
        Ok(Value::report(&tune_ramps(&drive, &request, &()).await?))
    })
}

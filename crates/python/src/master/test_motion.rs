//! Test motions of a drive, for Python: the parts are those of `ferrodrive test-motion`.

use std::path::PathBuf;

use can::Bitrate;
use host::capture::{Captured, with_left};
use host::test_motion::{Figures, Motion, Order, Run, run, usual_quantities};
use master::cyclic::CyclicOptions;
use master::drive::SwitchedOff;
use pyo3::prelude::*;
use serde::Serialize;
use words::failure::Failure;

use super::capture::{not_put_back, quantities};
use super::job::Trouble;
use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network, duration};
use crate::failure::bad_value;

/// What is to be moved, in plain values.
#[derive(FromPyObject)]
pub(crate) struct TestMotionOrder {
    #[pyo3(item)]
    shape: String,
    #[pyo3(item)]
    by_deg: f64,
    #[pyo3(item)]
    speed_rpm: f64,
    #[pyo3(item)]
    frequency_hz: f64,
    #[pyo3(item)]
    to_frequency_hz: f64,
    #[pyo3(item)]
    periods: u32,
    #[pyo3(item)]
    time: f64,
    /// Times in s, and degrees.
    #[pyo3(item)]
    path: Vec<(f64, f64)>,
    #[pyo3(item)]
    count: u32,
    #[pyo3(item)]
    velocity_rpm: f64,
    #[pyo3(item)]
    acceleration_rpm_s: Option<f64>,
    #[pyo3(item)]
    travel_turns: Option<f64>,
    #[pyo3(item)]
    following_error_deg: f64,
    #[pyo3(item)]
    period: f64,
    #[pyo3(item)]
    quantities: Vec<String>,
    #[pyo3(item)]
    capture_period: f64,
    #[pyo3(item)]
    sdo: bool,
    #[pyo3(item)]
    journal: Option<PathBuf>,
}

/// What came of it.
#[derive(Serialize)]
struct TestMotionReport {
    runs: Vec<RunReport>,
}

#[derive(Serialize)]
struct RunReport {
    run: u32,
    #[serde(flatten)]
    figures: Figures,
    capture: Captured,
}

impl TestMotionOrder {
    fn order(&self) -> Result<Order, String> {
        Ok(Order {
            shape: self.shape.parse()?,
            by_deg: self.by_deg,
            speed_rpm: self.speed_rpm,
            frequency_hz: self.frequency_hz,
            to_frequency_hz: self.to_frequency_hz,
            periods: self.periods,
            time_s: self.time,
            path: self.path.clone(),
            count: self.count,
            velocity_rpm: self.velocity_rpm,
            acceleration_rpm_s: self.acceleration_rpm_s,
            travel_turns: self.travel_turns,
            following_error_deg: self.following_error_deg,
            period_ms: self.period * 1e3,
        })
    }
}

/// Makes runs of a test motion, each captured, and puts everything back.
#[pyfunction]
pub(crate) fn test_motion(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    order: TestMotionOrder,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    let bitrate = network.get().bitrate(py)?.unwrap_or(Bitrate::K500);
    let motion = order.order().and_then(|order| order.motion(CyclicOptions::default())).map_err(bad_value)?;
    let mut wanted = asked.capturing(bitrate, duration(order.capture_period)?, order.journal);
    wanted.by_sdo = order.sdo;
    let world = network.get().true_values(py)?;
    network.get().begin_leading_back(py, move |way_back| async move {
        let drive = asked.drive().await?;
        let names = if order.quantities.is_empty() { usual_quantities(&drive).await? } else { order.quantities };
        wanted.quantities = quantities(&drive, world.as_ref(), &names).await?;
        wanted.check(&motion.span())?;
        let (restorer, mut runs) = (way_back.of(&drive), Vec::new());
        let is_points = matches!(motion, Motion::Points { .. });
        drive.check_unclaimed("test motion").map_err(Failure::from)?;
        if !is_points {
            restorer.begin_motion(false);
        }
        let moved = async {
            // Points have a guard of their own. That of steps ends with the way back.
            if !is_points && drive.node().network().guarded(asked.node).is_none() {
                drive.guard(SwitchedOff::Leave).await.map_err(Failure::from)?;
            }
            let how = (order.count, order.travel_turns);
            run((&drive, &motion), (&wanted, restorer), how, &mut runs, |_| ()).await
        };
        let moved = moved.await;
        let left = restorer.restore().await;
        let rows = runs.into_iter().map(|Run { number, figures, capture, ways, .. }| RunReport {
            run: number,
            figures,
            capture: Captured::of(&capture, &ways),
        });
        let value = Value::report(&TestMotionReport { runs: rows.collect() });
        let failed = moved.err().or(not_put_back(asked.node, &left));
        match failed {
            Some(failure) => Err(Trouble::Reported(with_left(failure, &left), Box::new(value))),
            None => Ok(value),
        }
    })
}

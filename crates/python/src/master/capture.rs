//! Fast capture of a drive for Python: begun, waited for and put back as one job. The parts are those of `ferrodrive capture`.

use std::path::PathBuf;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use host::capture::{Captured, Measurand, Span, Taken, Trigger, Wanted, with_left};
use machine::file::tpdo_id;
use master::Drive;
use pyo3::prelude::*;
use sim::recorder::LiveValues;
use words::failure::Failure;

use super::job::Trouble;
use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network, duration};
use crate::failure::bad_value;

/// What is to be captured, in plain values.
#[derive(FromPyObject)]
pub(crate) struct CaptureOrder {
    #[pyo3(item)]
    quantities: Vec<String>,
    #[pyo3(item)]
    duration: f64,
    #[pyo3(item)]
    period: f64,
    #[pyo3(item)]
    trigger: Option<String>,
    #[pyo3(item)]
    pre_trigger: f64,
    #[pyo3(item)]
    take: Vec<String>,
    #[pyo3(item)]
    sdo: bool,
    #[pyo3(item)]
    journal: Option<PathBuf>,
}

impl AskedDrive {
    /// What is captured of it: with this time between two readings, and nothing yet.
    pub(super) fn capturing(&self, bitrate: Bitrate, period: Duration, journal: Option<PathBuf>) -> Wanted {
        let journal = self.journal(journal);
        Wanted { quantities: Vec::new(), period, bitrate, take: Vec::new(), by_sdo: false, journal, on_kept: |_| () }
    }
}

/// What could not be put back.
pub(super) fn not_put_back(node: NodeId, left: &[String]) -> Option<Failure> {
    let next = "when it answers again: network.params(node).rollback()";
    host::capture::not_put_back(node, left).map(|failure| failure.next(next))
}

/// Captures quantities of a drive, and puts everything back.
#[pyfunction]
pub(crate) fn capture(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    order: CaptureOrder,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    let bitrate = network.get().bitrate(py)?.unwrap_or(Bitrate::K500);
    let trigger: Option<Trigger> = order.trigger.as_deref().map(str::parse).transpose().map_err(bad_value)?;
    let take = order.take.iter().map(|text| tpdo_id(text)).collect::<Result<_, _>>().map_err(bad_value)?;
    let span = Span { duration: duration(order.duration)?, trigger, pre_trigger: duration(order.pre_trigger)? };
    let mut wanted = asked.capturing(bitrate, duration(order.period)?, order.journal);
    (wanted.take, wanted.by_sdo) = (take, order.sdo);
    let world = network.get().true_values(py)?;
    network.get().begin_leading_back(py, |way_back| async move {
        let drive = asked.drive().await?;
        wanted.quantities = quantities(&drive, world.as_ref(), &order.quantities).await?;
        wanted.check(&span)?;
        let restorer = way_back.of(&drive);
        let mut running = wanted.begin(&drive, restorer).await?;
        let taken = running.next(&span).await;
        let left = restorer.restore().await;
        let Taken { capture, cut_off, .. } = taken.map_err(|failure| with_left(failure, &left))?;
        let value = Value::report(&Captured::of(&capture, running.ways()));
        match cut_off.or(not_put_back(asked.node, &left)) {
            Some(failure) => Err(Trouble::Reported(with_left(failure, &left), Box::new(value))),
            None => Ok(value),
        }
    })
}

/// Quantities of a drive by their names; in a world its true values too.
pub(super) async fn quantities(
    drive: &Drive,
    world: Option<&LiveValues>,
    names: &[String],
) -> Result<Vec<Measurand>, Failure> {
    let mut quantities = Vec::new();
    for name in names {
        quantities.push(Measurand::named(drive, world, name).await?);
    }
    Ok(quantities)
}

//! A base on two wheels for Python.

use std::time::Duration;

use machine::file::CyclePlan;
use master::Network as Core;
use master::base::{Base as MasterBase, BaseError, BaseLimits, BaseState, Geometry, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::drive::Drive;
use pyo3::prelude::*;
use words::failure::Failure;
use words::mode::mode;

use super::{Job, Network, Slot, Stepped, Trouble, Value, bad_value, check_fits, duration, next, opening, with_reason};

/// Twists that differ by no more than the rounding of their computation, m/s and rad/s.
const SAME_TWIST: f64 = 1e-9;

/// A base, in plain values.
#[derive(FromPyObject)]
pub(crate) struct BaseOrder {
    /// Node, model, and turns of the drive for a turn of the wheel forward; the left one first.
    #[pyo3(item)]
    wheels: [(u8, String, f64); 2],
    #[pyo3(item)]
    mode: String,
    #[pyo3(item)]
    wheel_base_m: f64,
    #[pyo3(item)]
    wheel_radius_m: f64,
    #[pyo3(item)]
    linear_m_s: f64,
    #[pyo3(item)]
    angular_rad_s: f64,
    #[pyo3(item)]
    wheel_m_s: f64,
    #[pyo3(item)]
    wheel_m_s2: f64,
    #[pyo3(item)]
    watchdog_s: f64,
    #[pyo3(item)]
    lag_m: Option<f64>,
}

impl From<BaseError> for Trouble {
    fn from(error: BaseError) -> Self {
        match error {
            BaseError::Drive(error) => Self::Drive(error),
            error => Failure::from(error).into(),
        }
    }
}

/// A base on two wheels; `ferrodrive.Base` is what users have.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Base {
    network: Py<Network>,
    core: Core,
    slot: Slot<MasterBase>,
}

/// One that is dropped is not stepped any longer, and the master stops its drives.
impl Drop for Base {
    fn drop(&mut self) {
        drop(self.slot.close());
    }
}

#[pymethods]
impl Base {
    /// A base on two wheels in a network, still to be opened.
    #[new]
    fn new(network: Py<Network>) -> Self {
        let core = network.get().core.clone();
        Self { network, core, slot: Slot::empty() }
    }

    /// Opens it and enables its wheels; nothing moves.
    fn open(&self, py: Python<'_>, order: BaseOrder, period_s: f64, tolerance: u32) -> PyResult<Job> {
        let network = self.network.get();
        let wheels = order.setups(network)?;
        let geometry = Geometry { wheel_base_m: order.wheel_base_m, wheel_radius_m: order.wheel_radius_m };
        let limits = BaseLimits {
            linear_m_s: order.linear_m_s,
            angular_rad_s: order.angular_rad_s,
            wheel_m_s: order.wheel_m_s,
            wheel_m_s2: order.wheel_m_s2,
            watchdog: duration(order.watchdog_s)?,
            lag_m: order.lag_m.unwrap_or_else(|| BaseLimits::lag_for(order.wheel_m_s)),
        };
        self.open_with(py, wheels, (geometry, limits), duration(period_s)?, tolerance)
    }

    /// The same with the base of the machine file, and its period unless one is given.
    fn open_of_file(&self, py: Python<'_>, period_s: Option<f64>, tolerance: u32) -> PyResult<Job> {
        let (wheels, plan, period) = self.network.get().base_of_file(py)?;
        let period = period_s.map_or(Ok(period), duration)?;
        self.open_with(py, wheels, (plan.geometry, plan.limits), period, tolerance)
    }

    /// Steps it in each cycle for as long as it is open, in the background.
    fn keep(&self, py: Python<'_>) -> PyResult<Job> {
        self.network.get().begin_said(py, self.slot.clone().keep(self.core.clone()))
    }

    /// The twist from the next cycle on, for as long as the watchdog lets it count.
    fn command(&self, py: Python<'_>, linear_m_s: f64, angular_rad_s: f64) -> PyResult<Py<PyAny>> {
        self.network.get().check_open()?;
        let taken = self.slot.with(|base| command(base, Twist { linear_m_s, angular_rad_s }));
        taken.map_err(|trouble| trouble.raised(py, None))?.into_python(py)
    }

    /// The twist for this long, and then to rest.
    fn drive(&self, py: Python<'_>, linear_m_s: f64, angular_rad_s: f64, seconds: f64) -> PyResult<Job> {
        let (slot, core, time) = (self.slot.clone(), self.core.clone(), duration(seconds)?);
        self.network.get().begin_said(py, async move {
            let began = core.now();
            let twist = Twist { linear_m_s, angular_rad_s };
            let mut taken = slot.with(|base| command(base, twist))?;
            let _stop = slot.stop_on_drop();
            let mut is_stopped = false;
            while core.now() - began < time && !is_stopped {
                next(&core).await?;
                is_stopped = slot.with(|base| {
                    // A stop that another thread has asked for counts more than this twist; a lost wheel takes none.
                    if !base.is_stopping() && base.state().cause.is_none_or(|cause| cause.wheel().is_none()) {
                        taken = command(base, twist)?;
                        return Ok(false);
                    }
                    Ok(true)
                })?;
            }
            stand(&core, &slot).await?;
            match is_stopped {
                true => Err(Failure::new("the base was stopped on its way, by command").of_kind("base").into()),
                false => Ok(taken),
            }
        })
    }

    /// To rest within its limits; it stays powered.
    fn stop(&self, py: Python<'_>) -> PyResult<Job> {
        let (slot, core) = (self.slot.clone(), self.core.clone());
        self.network.get().begin_said(py, async move { stand(&core, &slot).await })
    }

    /// To rest, and without power; the base is gone then.
    fn close(&self, py: Python<'_>) -> PyResult<Job> {
        let slot = self.slot.clone();
        self.network.get().begin_said(py, async move {
            match slot.close() {
                Some(base) => Ok(base.close().await.map(|()| Value::None)?),
                None => Ok(Value::None),
            }
        })
    }

    /// What the last cycle showed.
    fn state(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.network.get().check_open()?;
        let state = self.slot.with(|base| Ok(base.state())).map_err(|trouble| trouble.raised(py, None))?;
        let BaseState { cause, commanded, pose, .. } = state;
        let record = vec![
            ("x_m", Value::Real(pose.x_m)),
            ("y_m", Value::Real(pose.y_m)),
            ("heading_deg", Value::Real(pose.heading_rad.to_degrees())),
            ("linear_m_s", Value::Real(commanded.linear_m_s)),
            ("angular_rad_s", Value::Real(commanded.angular_rad_s)),
            ("cause", cause.map_or(Value::None, |cause| Value::Text(cause.to_string()))),
        ];
        Value::Record(record).into_python(py)
    }
}

impl Base {
    fn open_with(
        &self,
        py: Python<'_>,
        wheels: [WheelSetup; 2],
        (geometry, limits): (Geometry, BaseLimits),
        period: Duration,
        tolerance: u32,
    ) -> PyResult<Job> {
        let (slot, bitrate) = (self.slot.clone(), self.network.get().bitrate(py)?);
        let options = CyclicOptions { tolerance, ..CyclicOptions::default() };
        let nodes = wheels.iter().map(|wheel| (wheel.drive.node().id(), Some(wheel.mode))).collect();
        let cycle = CyclePlan { what: "the base".into(), period, nodes, is_base: true };
        self.network.get().begin_said(py, async move {
            let [left, right] = &wheels;
            let drives = [&left.drive, &right.drive];
            check_fits(&cycle, &drives, bitrate).await?;
            let opened = MasterBase::open([left, right], geometry, limits, period, options).await;
            let mut base = opened.map_err(|error| opening(&cycle.what, error.of_drive().cloned(), error))?;
            if let Err(error) = base.enable().await {
                let reason = base.explain_stop().await;
                let _ = base.close().await;
                return Err(with_reason(error, reason));
            }
            slot.fill(base);
            Ok(Value::None)
        })
    }
}

impl BaseOrder {
    fn setups(&self, network: &Network) -> PyResult<[WheelSetup; 2]> {
        let mode = mode(&self.mode).map_err(bad_value)?;
        let wheel = |(node, model, turns): &(u8, String, f64)| {
            let drive =
                Drive::new(network.node(*node)?, network.model(*node, model)?).behind(network.gear(*node, None)?);
            Ok::<_, PyErr>(WheelSetup { drive, mode, turns: *turns })
        };
        Ok([wheel(&self.wheels[0])?, wheel(&self.wheels[1])?])
    }
}

/// Has a base drive with a twist; what its limits make of that.
fn command(base: &mut MasterBase, twist: Twist) -> Result<Value, Trouble> {
    base.command(twist)?;
    let Twist { linear_m_s, angular_rad_s } = base.wanted();
    let limited =
        (linear_m_s - twist.linear_m_s).abs() > SAME_TWIST || (angular_rad_s - twist.angular_rad_s).abs() > SAME_TWIST;
    Ok(Value::Record(vec![
        ("linear_m_s", Value::Real(linear_m_s)),
        ("angular_rad_s", Value::Real(angular_rad_s)),
        ("limited", Value::Bool(limited)),
    ]))
}

/// Brings the base to rest, until both wheels were seen to stand; a wheel that was lost before or meanwhile is reported, in the words
/// of its drive.
async fn stand(core: &Core, slot: &Slot<MasterBase>) -> Result<Value, Trouble> {
    slot.with(|base| {
        base.start_stop();
        Ok(())
    })?;
    let _stop = slot.stop_on_drop();
    let (stopped, question) = loop {
        next(core).await?;
        let (stopped, question) = slot.with(|base| {
            // A twist of another thread does not take the stop back.
            Stepped::stop(base);
            Ok((base.stopped(), base.explanation()))
        })?;
        if let Some(stopped) = stopped {
            break (stopped, question);
        }
    };
    let Err(error) = stopped else { return Ok(Value::None) };
    // It is stepped in the background meanwhile.
    let reason = match question {
        Some(question) => question.await,
        None => None,
    };
    Err(with_reason(error, reason))
}

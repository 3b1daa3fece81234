//! Groups and bases for Python: opened and enabled by one job, stepped in each cycle of SYNC by another one for as long as they are
//! there, so that the drives are kept while the program does something else, and sent where they are to go by further ones.

use std::time::Duration;

use can::Bitrate;
use machine::file::CyclePlan;
use master::base::{Base as MasterBase, BaseError, BaseLimits, BaseState, Geometry, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::drive::Drive;
use master::group::{AxisLimits, AxisSetup, Group as MasterGroup, GroupError, StopCause, StreamOptions};
use master::units::Turns;
use master::{Error, Network as Core};
use pyo3::prelude::*;
use words::failure::Failure;
use words::mode::mode;

use super::job::Trouble;
use super::slot::{Slot, Stepped};
use super::value::Value;
use super::{Job, Network, duration};
use crate::failure::bad_value;

/// Points of a path that are given at once: a tenth of a second at 1 ms.
const AHEAD: usize = 100;

/// Twists that differ by no more than the rounding of their computation, m/s and rad/s.
const SAME_TWIST: f64 = 1e-9;

/// An axis of a group, in plain values.
#[derive(FromPyObject)]
pub(crate) struct AxisOrder {
    #[pyo3(item)]
    node: u8,
    #[pyo3(item)]
    model: String,
    #[pyo3(item)]
    mode: String,
    #[pyo3(item)]
    range_deg: Option<(f64, f64)>,
    #[pyo3(item)]
    velocity_rpm: f64,
    #[pyo3(item)]
    acceleration_rpm_s: f64,
    #[pyo3(item)]
    jerk_rpm_s2: f64,
    #[pyo3(item)]
    following_error_deg: f64,
    #[pyo3(item)]
    gear_ratio: Option<f64>,
}

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

/// Several axes that move as one; `ferrodrive.Group` is what users have.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Group {
    network: Py<Network>,
    core: Core,
    slot: Slot<MasterGroup>,
}

impl From<GroupError> for Trouble {
    fn from(error: GroupError) -> Self {
        match error {
            GroupError::Drive(error) => Self::Drive(error),
            error => Failure::from(error).into(),
        }
    }
}

impl From<BaseError> for Trouble {
    fn from(error: BaseError) -> Self {
        match error {
            BaseError::Drive(error) => Self::Drive(error),
            error => Failure::from(error).into(),
        }
    }
}

/// Why a group or a base does not move, with what the drive says that keeps it.
fn with_reason(error: impl Into<Failure>, reason: Option<Error>) -> Trouble {
    reason.into_iter().fold(error.into(), |failure, reason| failure.because(reason.to_string())).into()
}

/// Why a group or a base was not opened; `drive` is what a drive said, where that is why.
fn opening(what: &str, drive: Option<Error>, error: impl Into<Trouble>) -> Trouble {
    match drive {
        Some(silence @ Error::NoAnswer { .. }) => not_booted(what, silence.into()).into(),
        _ => error.into(),
    }
}

/// Of a drive that does not answer while something is opened, what to do first.
fn not_booted(what: &str, failure: Failure) -> Failure {
    let Some(node) = failure.subject.node.filter(|_| failure.kind == "no_answer") else { return failure };
    let what = format!("{what} was not opened, and nothing moves: node {node} does not answer");
    let Failure { kind, subject, what: because, next, .. } = failure;
    let failure = Failure { kind, subject, ..Failure::new(what) }.because(because);
    next.into_iter().fold(failure.next("boot its nodes first: network.boot()"), Failure::next)
}

/// An error where the bus cannot carry the cycle, before anything is written to a drive. Without a known bit rate nothing is refused.
async fn check_fits(cycle: &CyclePlan, drives: &[&Drive], bitrate: Option<Bitrate>) -> Result<(), Trouble> {
    let Some(bitrate) = bitrate else { return Ok(()) };
    match cycle.too_full(drives, bitrate, |read| read).await {
        Ok(None) => Ok(()),
        Ok(Some(full)) => {
            let failure = Failure::new(format!("{} was not opened: {}", cycle.what, full.what)).of_kind("bus_load");
            let shown = format!("network.plan(cycle={}) shows each frame", cycle.period.as_secs_f64());
            Err(failure.next(full.next).next(shown).into())
        }
        Err(failure) => Err(not_booted(&cycle.what, failure).into()),
    }
}

/// One that is dropped is not stepped any longer, and the master stops its drives.
impl Drop for Group {
    fn drop(&mut self) {
        drop(self.slot.close());
    }
}

#[pymethods]
impl Group {
    /// Several axes that move as one in a network, still to be opened.
    #[new]
    fn new(network: Py<Network>) -> Self {
        let core = network.get().core.clone();
        Self { network, core, slot: Slot::empty() }
    }

    /// Opens it and enables its drives; nothing moves.
    fn open(&self, py: Python<'_>, axes: Vec<AxisOrder>, period_s: f64, tolerance: u32) -> PyResult<Job> {
        let network = self.network.get();
        let axes = axes.iter().map(|axis| axis.setup(network)).collect::<PyResult<Vec<_>>>()?;
        self.open_with(py, axes, duration(period_s)?, tolerance)
    }

    /// The same with the axes of a group of the machine file, and its period unless one is given.
    fn open_of_file(&self, py: Python<'_>, name: &str, period_s: Option<f64>, tolerance: u32) -> PyResult<Job> {
        let (axes, period) = self.network.get().group_of_file(py, name)?;
        let period = period_s.map_or(Ok(period), duration)?;
        self.open_with(py, axes, period, tolerance)
    }

    /// Steps it in each cycle for as long as it is open, in the background.
    fn keep(&self, py: Python<'_>) -> PyResult<Job> {
        self.network.get().begin_said(py, self.slot.clone().keep(self.core.clone()))
    }

    /// All axes to these positions in degrees, at rest there; the time of the path in s.
    fn move_to(&self, py: Python<'_>, to_deg: Vec<f64>, within_s: Option<f64>) -> PyResult<Job> {
        let (slot, core) = (self.slot.clone(), self.core.clone());
        let within = within_s.map(duration).transpose()?;
        self.network.get().begin_said(py, async move {
            let time = slot.with(|group| Ok(group.start_move(&turns(&to_deg), within)?))?;
            let _stop = slot.stop_on_drop();
            rest(&core, &slot, |_| Ok(())).await?;
            Ok(Value::Real(time.as_secs_f64()))
        })
    }

    /// Along these points, one for each cycle, in degrees.
    fn follow(&self, py: Python<'_>, points_deg: Vec<Vec<f64>>) -> PyResult<Job> {
        let (slot, core) = (self.slot.clone(), self.core.clone());
        self.network.get().begin_said(py, async move {
            let points: Vec<_> = points_deg.iter().map(|point| turns(point)).collect();
            let options =
                StreamOptions { capacity: 2 * AHEAD, prefill: AHEAD.min(points.len()), ..StreamOptions::default() };
            slot.with(|group| {
                group.check_path(&points)?;
                Ok(group.start_stream(options)?)
            })?;
            let _stop = slot.stop_on_drop();
            let mut left = points.iter();
            let moved = rest(&core, &slot, |group| {
                while group.stream().is_some_and(|stream| stream.room() > 0) {
                    match left.next() {
                        Some(point) => group.push(point)?,
                        None => {
                            group.end_stream();
                            break;
                        }
                    }
                }
                Ok(())
            });
            moved.await?;
            Ok(Value::None)
        })
    }

    /// All axes to rest within their limits; they keep their power.
    fn stop(&self, py: Python<'_>) -> PyResult<Job> {
        let (slot, core) = (self.slot.clone(), self.core.clone());
        self.network.get().begin_said(py, async move {
            slot.with(|group| {
                group.start_stop();
                Ok(())
            })?;
            match rest(&core, &slot, |_| Ok(())).await {
                Err(Stopped { cause: Some(StopCause::Asked), .. }) | Ok(()) => Ok(Value::None),
                Err(stopped) => Err(stopped.into()),
            }
        })
    }

    /// To rest, and without power; the group is gone then.
    fn close(&self, py: Python<'_>) -> PyResult<Job> {
        let slot = self.slot.clone();
        self.network.get().begin_said(py, async move {
            match slot.close() {
                Some(group) => Ok(group.close().await.map(|()| Value::None)?),
                None => Ok(Value::None),
            }
        })
    }

    /// What the last cycle showed.
    fn state(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.network.get().check_open()?;
        let value = self.slot.with(|group| {
            let state = group.state();
            let axes = group.axes().iter().zip(group.points()).map(|(axis, point)| {
                let angle = axis.position.map_or(Value::None, |Turns(turns)| Value::Real(turns * 360.0));
                Value::Record(vec![
                    ("angle_deg", angle),
                    ("set_point_deg", Value::Real(point.position_turns * 360.0)),
                    ("power", axis.power.map_or(Value::None, |power| Value::Text(power.name().to_owned()))),
                ])
            });
            Ok(Value::Record(vec![
                ("phase", Value::Text(state.phase.to_string())),
                ("cause", state.cause.map_or(Value::None, |cause| Value::Text(cause.to_string()))),
                ("missed_cycles", Value::Integer(i64::try_from(state.missed_cycles).unwrap_or(i64::MAX))),
                ("axes", Value::List(axes.collect())),
            ]))
        });
        value.map_err(|trouble| trouble.raised(py, None))?.into_python(py)
    }
}

impl Group {
    fn open_with(&self, py: Python<'_>, axes: Vec<AxisSetup>, period: Duration, tolerance: u32) -> PyResult<Job> {
        let (slot, bitrate) = (self.slot.clone(), self.network.get().bitrate(py)?);
        let options = CyclicOptions { tolerance, ..CyclicOptions::default() };
        let nodes = axes.iter().map(|axis| (axis.drive.node().id(), Some(axis.mode))).collect();
        let cycle = CyclePlan { what: "the group".into(), period, nodes, is_base: false };
        self.network.get().begin_said(py, async move {
            let drives: Vec<&Drive> = axes.iter().map(|axis| &axis.drive).collect();
            check_fits(&cycle, &drives, bitrate).await?;
            let opened = MasterGroup::open(&axes, period, options).await;
            let mut group = opened.map_err(|error| opening(&cycle.what, error.of_drive().cloned(), error))?;
            if let Err(error) = group.enable().await {
                let reason = group.explain_stop().await;
                let _ = group.close().await;
                return Err(with_reason(error, reason));
            }
            slot.fill(group);
            Ok(Value::None)
        })
    }
}

impl AxisOrder {
    fn setup(&self, network: &Network) -> PyResult<AxisSetup> {
        let range_turns = self.range_deg.map(|(low, high)| low / 360.0..=high / 360.0);
        let limits = AxisLimits {
            range_turns,
            velocity_turns_s: self.velocity_rpm / 60.0,
            acceleration_turns_s2: self.acceleration_rpm_s / 60.0,
            jerk_turns_s3: self.jerk_rpm_s2 / 60.0,
            following_error_turns: self.following_error_deg / 360.0,
        };
        let drive = Drive::new(network.node(self.node)?, network.model(self.node, &self.model)?)
            .behind(network.gear(self.node, self.gear_ratio)?);
        Ok(AxisSetup { drive, mode: mode(&self.mode).map_err(bad_value)?, limits })
    }
}

/// Why a group does not go on.
struct Stopped {
    /// What stopped it, where all axes were seen to stand.
    cause: Option<StopCause>,
    /// How it is reported.
    trouble: Trouble,
}

impl From<Trouble> for Stopped {
    fn from(trouble: Trouble) -> Self {
        Self { cause: None, trouble }
    }
}

impl From<Stopped> for Trouble {
    fn from(stopped: Stopped) -> Self {
        stopped.trouble
    }
}

/// Cycles until the axes of the group were seen to stand; what stopped it, in the words of its drive.
async fn rest(
    core: &Core,
    slot: &Slot<MasterGroup>,
    mut each: impl FnMut(&mut MasterGroup) -> Result<(), Trouble>,
) -> Result<(), Stopped> {
    let (stands, cause, question) = loop {
        let (stands, cause, question) = slot.with(|group| {
            each(group)?;
            Ok((group.stands(), group.state().cause, group.explanation()))
        })?;
        if let Some(stands) = stands {
            break (stands, cause, question);
        }
        next(core).await?;
    };
    let Some(cause) = cause else { return Ok(stands.map_err(GroupError::from).map_err(Trouble::from)?) };
    // It is stepped in the background meanwhile.
    let reason = match question {
        Some(question) => question.await.map(|reason| reason.to_string()),
        None => None,
    };
    let seen = stands.is_ok();
    let sentences = [Some(cause.to_string()), reason, stands.err().map(|moving| moving.to_string())];
    let text = sentences.into_iter().flatten().collect::<Vec<_>>().join(". ");
    Err(Stopped { cause: seen.then_some(cause), trouble: Failure::new(text).of_kind("group").into() })
}

fn turns(degrees: &[f64]) -> Vec<Turns> {
    degrees.iter().map(|degrees| Turns(degrees / 360.0)).collect()
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

async fn next(core: &Core) -> Result<(), Trouble> {
    core.next_sync().await.map(drop).map_err(|error| Trouble::Said(error.to_string()))
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

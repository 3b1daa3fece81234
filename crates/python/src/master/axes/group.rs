//! Several axes that move as one, for Python.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use host::group_follow::{RecordedPath, Track};
use machine::file::CyclePlan;
use master::Network as Core;
use master::cyclic::CyclicOptions;
use master::drive::Drive;
use master::group::{AxisLimits, AxisSetup, Group as MasterGroup, GroupError, StopCause, StreamOptions};
use master::units::Turns;
use pyo3::prelude::*;
use words::failure::Failure;
use words::mode::mode;

use super::{Job, Network, Slot, Trouble, Value, bad_value, check_fits, duration, next, opening, with_reason};
use crate::failure::raised;

/// Points of a path that are given at once: a tenth of a second at 1 ms.
const AHEAD: usize = 100;

/// An axis of a group, in plain values.
#[derive(FromPyObject)]
pub(crate) struct AxisOrder {
    #[pyo3(item)]
    node: u8,
    #[pyo3(item)]
    model: String,
    #[pyo3(item)]
    mode: Option<String>,
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
            slot.with(|group| Ok(group.check_path(&points)?))?;
            stream(&core, &slot, points.into_iter()).await?;
            Ok(Value::None)
        })
    }

    /// Along a recorded path, all of it checked before; how long it takes in s.
    fn follow_file(&self, py: Python<'_>, path: PathBuf, approach: bool, relative: bool) -> PyResult<Job> {
        let path = py.detach(|| RecordedPath::read(&path)).map_err(|failure| raised(py, &failure))?;
        let (slot, core) = (self.slot.clone(), self.core.clone());
        self.network.get().begin_said(py, async move {
            let (drives, limits, period) =
                slot.with(|group| Ok((group.drives().to_vec(), group.limits().to_vec(), group.period())))?;
            let track = Track::of(&path, &drives, relative).await?;
            let mut from = set_points(&slot)?;
            track.check(&drives, &limits, period, &from).await?;
            if !approach && !relative {
                track.check_start(&from)?;
            }
            let _stop = slot.stop_on_drop();
            if !relative {
                let led: BTreeMap<_, _> = track.begin().collect();
                let nodes = drives.iter().map(|drive| drive.node().id());
                from = nodes.zip(&from).map(|(node, held)| *led.get(&node).unwrap_or(held)).collect();
                let begin: Vec<_> = from.iter().copied().map(Turns).collect();
                slot.with(|group| Ok(group.start_move(&begin, None)?))?;
                rest(&core, &slot, |_| Ok(())).await?;
            }
            stream(&core, &slot, track.points(period, &from).skip(1)).await?;
            Ok(Value::Real(track.time().as_secs_f64()))
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
            let shown = group.axes().iter().zip(group.points()).zip(group.following_errors());
            let degrees = |turns: Option<f64>| turns.map_or(Value::None, |turns| Value::Real(turns * 360.0));
            let axes = shown.map(|((axis, point), error_turns)| {
                Value::Record(vec![
                    ("angle_deg", degrees(axis.position.map(|Turns(turns)| turns))),
                    ("set_point_deg", Value::Real(point.position_turns * 360.0)),
                    ("following_error_deg", degrees(error_turns)),
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
        let mode = match &self.mode {
            Some(word) => mode(word).map_err(bad_value)?,
            None => AxisSetup::best_mode(&drive).map_err(|error| bad_value(error.to_string()))?,
        };
        Ok(AxisSetup { drive, mode, limits })
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

/// Sends a group these points, one in each cycle, and waits until its axes were seen to stand; it is stopped however this ends.
async fn stream(
    core: &Core,
    slot: &Slot<MasterGroup>,
    points: impl Iterator<Item = Vec<Turns>>,
) -> Result<(), Stopped> {
    let options = StreamOptions { capacity: 2 * AHEAD, prefill: AHEAD, ..StreamOptions::default() };
    slot.with(|group| Ok(group.start_stream(options)?))?;
    let _stop = slot.stop_on_drop();
    let mut points = points.fuse();
    rest(core, slot, |group| {
        while group.stream().is_some_and(|stream| stream.room() > 0) {
            match points.next() {
                Some(point) => group.push(&point)?,
                None => {
                    group.end_stream();
                    break;
                }
            }
        }
        Ok(())
    })
    .await
}

/// Where its axes are held, in turns.
fn set_points(slot: &Slot<MasterGroup>) -> Result<Vec<f64>, Trouble> {
    slot.with(|group| Ok(group.points().iter().map(|point| point.position_turns).collect()))
}

fn turns(degrees: &[f64]) -> Vec<Turns> {
    degrees.iter().map(|degrees| Turns(degrees / 360.0)).collect()
}

//! A recorded path, which a group follows in time: all of it is held to the limits of the axes before anything moves.
//!
//! In: positions of each axis over time ([`RecordedPath`]), and what a move of a group takes too. Between its points the path is a
//! cubic spline that is at rest at both ends; a set-point of it is sent in each cycle of SYNC. The group is led to the first point as by
//! a move. `ferrodrive group follow` and a line of a scenario's host (`group follow path.csv`) are this.

mod path;
mod spline;
mod track;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use canopen::NodeId;
use machine::file::{GroupPlan, Machine};
use machine::group_move::{GroupMove, GroupRun, PlannedMove};
use master::Drive;
use master::group::{Group, GroupError, Phase, StreamOptions};
use master::units::{Along, Angle, Turns};
use words::failure::Failure;

pub use path::RecordedPath;
pub use track::Track;

/// A path, and how it is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupFollow {
    /// The path.
    pub path: RecordedPath,
    /// Whether axes that stand elsewhere are led to its first point.
    pub approach: bool,
    /// What a move takes too: limits, cycle, group. Where it goes is the path's; `relative` has the path begin where each axis stands.
    pub options: GroupMove,
}

/// A path as a line of a host asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct FollowLine {
    /// The file of the path, as the line names it.
    pub file: PathBuf,
    /// As of [`GroupFollow`].
    pub approach: bool,
    /// As of [`GroupFollow`].
    pub options: GroupMove,
}

impl FromStr for FollowLine {
    type Err = String;

    /// What stands behind `group` in a line of a scenario: its [form](FollowLine::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let mut words = text.split_whitespace();
        let file = words.next().filter(|word| *word == "follow").and_then(|_| words.next());
        let Some(file) = file.filter(|file| file.to_ascii_lowercase().ends_with(".csv")) else {
            return Err(format!("'group {text}' names no path; expected: group {}", Self::FORM));
        };
        let (mut approach, mut options) = (false, GroupMove::default());
        words::line::take(&format!("group {}", Self::FORM), words, |word, value| {
            match word {
                "by" => options.relative = true,
                "approach" => approach = true,
                _ => return options.take(word, value),
            }
            Ok(true)
        })?;
        Ok(Self { file: file.into(), approach, options })
    }
}

impl FollowLine {
    /// It as a line of a host has it, behind `group`.
    pub const FORM: &str = "follow FILE.csv [by] [approach] [of GROUP] [at SPEED] [acceleration RATE] [rounding TIME] \
                            [following-error ANGLE] [period TIME] [mode MODE] [hold TIME]";

    /// It with its path.
    pub fn of(&self, path: RecordedPath) -> GroupFollow {
        GroupFollow { path, approach: self.approach, options: self.options.clone() }
    }
}

/// A path that its axes can follow.
pub struct PlannedFollow {
    /// To its first point.
    pub start: PlannedMove,
    track: Track,
}

impl GroupFollow {
    /// Its axes, and the group of the machine file that they are of, if there is a file with groups.
    ///
    /// # Errors
    /// Axes that are not of one group.
    pub fn axes<'a>(&self, machine: Option<&'a Machine>) -> Result<(Vec<NodeId>, Option<&'a GroupPlan>), Failure> {
        let targets = self.path.nodes().map(|node| (node, Along::Turning(Angle::Turns(0.0)))).collect();
        GroupMove { targets, ..self.options.clone() }.axes(machine)
    }

    /// The path of its [axes](Self::axes), each of its set-points within what they may do, from where they stand.
    ///
    /// # Errors
    /// `out_of_limits` with the first time at which it breaks a limit; `not_at_start` where an axis stands elsewhere; a drive that cannot
    /// be moved so, or does not answer. Nothing has been written then.
    pub async fn plan(&self, plan: Option<&GroupPlan>, drives: Vec<Drive>) -> Result<PlannedFollow, Failure> {
        let relative = self.options.relative;
        let track = Track::of(&self.path, &drives, relative).await?;
        let targets = track.begin().map(|(node, turns)| (node, Along::Turning(Angle::Turns(turns)))).collect();
        let start = GroupMove { targets, ..self.options.clone() }.plan(plan, drives.clone()).await?;
        let mut from = Vec::new();
        for drive in &drives {
            let node = drive.node().id();
            let degrees = drive.state().await?.angle.ok_or_else(|| {
                Failure::new(format!("node {node} does not show its position"))
                    .at_node(node)
                    .next(format!("ferrodrive explain {node} says what it lacks"))
            })?;
            from.push(degrees.0 / 360.0);
        }
        let limits: Vec<_> = start.axes.iter().map(|axis| axis.limits.clone()).collect();
        track.check(&drives, &limits, start.period, &from).await?;
        if !self.approach && !relative {
            track.check_start(&from)?;
        }
        Ok(PlannedFollow { start, track })
    }
}

impl PlannedFollow {
    /// How long the path takes.
    pub fn time(&self) -> Duration {
        self.track.time()
    }

    /// Enables, leads to the first point, follows the path, and waits until the shafts are seen at its end; `progress` is called in each
    /// cycle with the time on the path and its whole time. The group holds then, and is the caller's to close, also after an error.
    ///
    /// # Errors
    /// Those of the [group](Group), and what has stopped it.
    pub async fn carry_out(
        &self,
        group: &mut Group,
        mut progress: impl FnMut(Duration, Duration),
    ) -> Result<GroupRun, GroupError> {
        let mut run = self.start.carry_out(group, |_, _| {}).await?;
        let positions = |group: &Group| group.points().iter().map(|point| point.position_turns).collect::<Vec<_>>();
        run.from = positions(group);
        // One that moves as it gets power, or is followed from where it stands, is somewhere else than it was.
        let points = || self.track.points(self.start.period, &run.from);
        group.check_path(points())?;
        run.time = self.time();
        run.largest_turns.fill(0.0);
        let began = group.network().now();
        let largest = &mut run.largest_turns;
        stream(group, points().skip(1), |group| {
            let errors = group.following_errors().map(Option::unwrap_or_default);
            largest.iter_mut().zip(errors).for_each(|(largest, error)| *largest = largest.max(error));
            progress(group.network().now() - began, run.time);
        })
        .await?;
        group.settle().await?;
        run.to = positions(group);
        let at = group.axes().iter().zip(&run.to);
        run.at = at.map(|(state, to)| state.position.map_or(*to, |Turns(at)| at)).collect();
        run.missed_cycles = group.state().missed_cycles;
        Ok(run)
    }
}

/// Sends a group these points, one in each cycle, taken as there is room, and waits until all axes rest again; `seen` is called after each
/// cycle.
///
/// # Errors
/// Those of the group, once all axes rest.
pub async fn stream<P: AsRef<[Turns]>>(
    group: &mut Group,
    points: impl IntoIterator<Item = P>,
    mut seen: impl FnMut(&Group),
) -> Result<(), GroupError> {
    let mut points = points.into_iter().fuse();
    group.start_stream(StreamOptions::default())?;
    loop {
        while group.stream().is_some_and(|stream| stream.room() > 0) {
            match points.next() {
                Some(point) => group.push(point.as_ref())?,
                None => {
                    group.end_stream();
                    break;
                }
            }
        }
        let phase = group.cycle().await?.phase;
        seen(group);
        if phase != Phase::Streaming {
            return group.rest().await;
        }
    }
}

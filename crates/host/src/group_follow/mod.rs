//! A recorded path, which a group follows in time: all of it is held to the limits of the axes before anything moves.
//!
//! In: positions of each axis over time ([`RecordedPath`]), and what a move of a group takes too. Between its points the path is a
//! cubic spline that is at rest at both ends; a set-point of it is sent in each cycle of SYNC. The group is led to the first point as by
//! a move. `ferrodrive group follow` and a line of a scenario's host (`group follow path.csv`) are this.

mod path;
mod spline;

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use canopen::NodeId;
use machine::file::{GroupPlan, Machine};
use machine::group_move::{GroupMove, GroupRun, PlannedMove, countable};
use master::Drive;
use master::group::{AxisLimits, Group, GroupError, Phase, StreamOptions, check_path};
use master::units::{Angle, Shown, Turns};
use words::failure::Failure;

pub use path::RecordedPath;
use spline::Spline;

/// How far from the first point of a path its axes may stand without being asked to approach it.
const AT_START_TURNS: f64 = 1.0 / 360.0;

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
        options.take_words(Self::FORM, words, |options, word| {
            match word {
                "by" => options.relative = true,
                "approach" => approach = true,
                _ => return Ok(false),
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
    /// Of the axes in the order of their group, in turns; `None` for one that stays where it is.
    splines: Vec<Option<Spline>>,
    begin_s: f64,
    duration_s: f64,
    relative: bool,
}

impl GroupFollow {
    /// Its axes, and the group of the machine file that they are of, if there is a file with groups.
    ///
    /// # Errors
    /// Axes that are not of one group.
    pub fn axes<'a>(&self, machine: Option<&'a Machine>) -> Result<(Vec<NodeId>, Option<&'a GroupPlan>), Failure> {
        let targets = self.path.nodes().map(|node| (node, Angle::Turns(0.0))).collect();
        GroupMove { targets, ..self.options.clone() }.axes(machine)
    }

    /// The path of its [axes](Self::axes), each of its set-points within what they may do, from where they stand.
    ///
    /// # Errors
    /// `out_of_limits` with the first time at which it breaks a limit; `not_at_start` where an axis stands elsewhere; a drive that cannot
    /// be moved so, or does not answer. Nothing has been written then.
    pub async fn plan(&self, plan: Option<&GroupPlan>, drives: Vec<Drive>) -> Result<PlannedFollow, Failure> {
        let (path, relative) = (&self.path, self.options.relative);
        let (mut targets, mut splines) = (Vec::new(), Vec::new());
        for drive in &drives {
            let node = drive.node().id();
            let Some(axis) = path.axes.iter().find(|axis| axis.node == node) else {
                splines.push(None);
                continue;
            };
            let each = axis.turns_each(drive).await?;
            let begin = if relative { axis.positions[0] } else { 0.0 };
            let turns: Vec<_> = axis.positions.iter().map(|position| (position - begin) * each).collect();
            targets.push((node, Angle::Turns(turns[0])));
            splines.push(Some(Spline::new(&path.time_s, &turns)));
        }
        let start = GroupMove { targets, ..self.options.clone() }.plan(plan, drives).await?;
        let (begin_s, duration_s) = (path.time_s[0], path.duration_s());
        let planned = PlannedFollow { start, splines, begin_s, duration_s, relative };
        let mut from = Vec::new();
        for axis in &planned.start.axes {
            let node = axis.drive.node().id();
            let degrees = axis.drive.state().await?.angle.ok_or_else(|| {
                Failure::new(format!("node {node} does not show its position"))
                    .at_node(node)
                    .next(format!("ferrodrive explain {node} says what it lacks"))
            })?;
            from.push(degrees.0 / 360.0);
        }
        planned.check(&path.name, &from).await?;
        if !self.approach && !relative {
            planned.check_start(&path.name, &from)?;
        }
        Ok(planned)
    }
}

impl PlannedFollow {
    /// How long the path takes.
    pub fn time(&self) -> Duration {
        Duration::from_secs_f64(self.duration_s)
    }

    /// The set-points of its cycles, the first one that of its beginning, from where the axes are. At the end the last one comes twice
    /// more: velocity and acceleration are zero then, and nothing is left to be brought to rest.
    fn points<'a>(&'a self, from: &'a [f64]) -> impl Iterator<Item = Vec<Turns>> + 'a {
        let period_s = self.start.period.as_secs_f64();
        let cycles = (self.duration_s / period_s - 1e-9).ceil() as u64;
        (0..=cycles + 2).map(move |cycle| {
            let time_s = self.begin_s + (cycle as f64 * period_s).min(self.duration_s);
            let point = |(spline, from): (&Option<Spline>, &f64)| match spline {
                Some(spline) if self.relative => from + spline.at(time_s),
                Some(spline) => spline.at(time_s),
                None => *from,
            };
            self.splines.iter().zip(from).map(point).map(Turns).collect()
        })
    }

    /// Holds each set-point to the limits, and to what the drives can count to.
    async fn check(&self, name: &str, from: &[f64]) -> Result<(), Failure> {
        let limits: Vec<AxisLimits> = self.start.axes.iter().map(|axis| axis.limits.clone()).collect();
        check_path(self.points(from), &limits, self.start.period).map_err(|refused| {
            let time_s = self.begin_s + (refused.point as f64 * self.start.period.as_secs_f64()).min(self.duration_s);
            let failure = Failure::from(GroupError::Path(refused.error));
            let what = format!("{name} cannot be followed: at {} s {}", Shown(time_s), failure.what);
            Failure { what, next: Vec::new(), ..failure }
                .next("let the path take more time or keep within the limits, or raise a limit; nothing was moved")
        })?;
        let mut most = vec![0.0_f64; from.len()];
        for point in self.points(from) {
            let farther = |(most, Turns(at)): (&mut f64, Turns)| *most = if at.abs() > most.abs() { at } else { *most };
            most.iter_mut().zip(point).for_each(farther);
        }
        for (number, (axis, most)) in (1..).zip(self.start.axes.iter().zip(most)) {
            countable(&axis.drive, Angle::Turns(most), number).await?;
        }
        Ok(())
    }

    /// That the axes stand where the path begins.
    fn check_start(&self, name: &str, from: &[f64]) -> Result<(), Failure> {
        let degrees = |turns: f64| Shown(turns * 360.0);
        let begin = |spline: &Spline| spline.at(self.begin_s);
        let axes = self.start.axes.iter().zip(&self.splines).zip(from);
        let axes = axes.filter_map(|((axis, spline), at)| Some((axis.drive.node().id(), begin(spline.as_ref()?), *at)));
        let away: Vec<_> = axes.clone().filter(|(_, begin, at)| (begin - at).abs() > AT_START_TURNS).collect();
        let Some((first, ..)) = away.first() else { return Ok(()) };
        let failure = Failure::new(format!("{name} does not begin where the axes stand; nothing was moved"))
            .of_kind("not_at_start")
            .at_node(*first);
        let failure = away.iter().fold(failure, |failure, (node, begin, at)| {
            let (at_deg, begin_deg, by) = (degrees(*at), degrees(*begin), degrees((begin - at).abs()));
            failure.because(format!(
                "node {node} stands at {at_deg} deg and the path begins at {begin_deg} deg, {by} deg away"
            ))
        });
        let targets: Vec<_> = axes.map(|(node, begin, _)| format!("{node}={}deg", degrees(begin))).collect();
        Err(failure
            .next(format!("move there first: group move {}", targets.join(" ")))
            .next("or ask to approach it (--approach): all axes are led there together, within their limits"))
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
        group.check_path(self.points(&run.from))?;
        run.time = self.time();
        run.largest_turns.fill(0.0);
        let began = group.network().now();
        let largest = &mut run.largest_turns;
        stream(group, self.points(&run.from).skip(1), |group| {
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

//! A recorded path in the turns of its axes: its set-points in each cycle, and whether the axes can follow them.

use std::time::Duration;

use canopen::NodeId;
use machine::group_move::countable;
use master::Drive;
use master::group::{AxisLimits, GroupError, check_path};
use master::units::{Angle, Shown, Turns};
use words::failure::Failure;

use super::RecordedPath;
use super::spline::Spline;

/// How far from the first point of a path its axes may stand without being asked to approach it.
const AT_START_TURNS: f64 = 1.0 / 360.0;

/// A path of the axes of a group.
#[derive(Clone, Debug)]
pub struct Track {
    /// Of its file.
    name: String,
    /// In the order of the group; a spline in turns, or `None` for an axis that stays where it is.
    axes: Vec<(NodeId, Option<Spline>)>,
    begin_s: f64,
    duration_s: f64,
    relative: bool,
}

/// What a path takes of an axis, in turns and s, by the set-points of its cycles.
#[derive(Clone, Debug, Default)]
struct AxisNeeds {
    low: f64,
    high: f64,
    speed: f64,
    acceleration: f64,
    /// The set-point and the speed before.
    last: Option<(f64, f64)>,
}

impl AxisNeeds {
    /// With the set-point of the next cycle.
    fn take(&mut self, at: f64, period_s: f64) {
        let Some((before, speed_before)) = self.last else {
            (self.low, self.high, self.last) = (at, at, Some((at, 0.0)));
            return;
        };
        let speed = (at - before) / period_s;
        (self.low, self.high) = (self.low.min(at), self.high.max(at));
        self.speed = self.speed.max(speed.abs());
        self.acceleration = self.acceleration.max(((speed - speed_before) / period_s).abs());
        self.last = Some((at, speed));
    }
}

impl Track {
    /// A path for these drives, in the order of their group; a `relative` one begins where each axis stands.
    ///
    /// # Errors
    /// A node of the path is not one of them; positions in counts, of a drive whose counts per turn are not known.
    pub async fn of(path: &RecordedPath, drives: &[Drive], relative: bool) -> Result<Self, Failure> {
        let nodes: Vec<_> = drives.iter().map(|drive| drive.node().id()).collect();
        if let Some(node) = path.nodes().find(|node| !nodes.contains(node)) {
            let axes = nodes.iter().map(NodeId::to_string).collect::<Vec<_>>().join(", ");
            let what = format!("{} has positions of node {node}, and the axes of the group are {axes}", path.name);
            return Err(Failure::usage(what).at_node(node).next("take its column out, or open a group that has it"));
        }
        let mut axes = Vec::new();
        for (node, drive) in nodes.into_iter().zip(drives) {
            let Some(axis) = path.axes.iter().find(|axis| axis.node == node) else {
                axes.push((node, None));
                continue;
            };
            let each = axis.turns_each(drive).await?;
            let begin = if relative { axis.positions[0] } else { 0.0 };
            let turns: Vec<_> = axis.positions.iter().map(|position| (position - begin) * each).collect();
            axes.push((node, Some(Spline::new(&path.time_s, &turns))));
        }
        Ok(Self { name: path.name.clone(), axes, begin_s: path.time_s[0], duration_s: path.duration_s(), relative })
    }

    /// How long it takes.
    pub fn time(&self) -> Duration {
        Duration::from_secs_f64(self.duration_s)
    }

    /// Its first point, in turns: of the axes that it leads.
    pub fn begin(&self) -> impl Iterator<Item = (NodeId, f64)> + Clone {
        self.axes.iter().filter_map(|(node, spline)| Some((*node, spline.as_ref()?.at(self.begin_s))))
    }

    /// The set-points of its cycles, the first one that of its beginning, from where the axes are in turns. At the end the last one comes
    /// twice more: velocity and acceleration are zero then, and nothing is left to be brought to rest.
    pub fn points<'a>(&'a self, period: Duration, from: &'a [f64]) -> impl Iterator<Item = Vec<Turns>> + 'a {
        let period_s = period.as_secs_f64();
        let cycles = (self.duration_s / period_s - 1e-9).ceil() as u64;
        (0..=cycles + 2).map(move |cycle| {
            let time_s = self.begin_s + (cycle as f64 * period_s).min(self.duration_s);
            let point = |((_, spline), from): (&(NodeId, Option<Spline>), &f64)| match spline {
                Some(spline) if self.relative => from + spline.at(time_s),
                Some(spline) => spline.at(time_s),
                None => *from,
            };
            self.axes.iter().zip(from).map(point).map(Turns).collect()
        })
    }

    /// Holds each set-point, in cycles of this period from where the axes are in turns, to their limits, and to what the drives can count to.
    ///
    /// # Errors
    /// `out_of_limits` with the first time at which it breaks one; a drive that does not answer.
    pub async fn check(
        &self,
        drives: &[Drive],
        limits: &[AxisLimits],
        period: Duration,
        from: &[f64],
    ) -> Result<(), Failure> {
        check_path(self.points(period, from), limits, period).map_err(|refused| {
            let time_s = self.begin_s + (refused.point as f64 * period.as_secs_f64()).min(self.duration_s);
            let failure =
                Failure::from(GroupError::of_path(refused.error, drives.iter().map(|drive| drive.node().id())));
            let what = format!("{} cannot be followed: at {} s {}", self.name, Shown(time_s), failure.what);
            let failure = Failure { what, next: Vec::new(), ..failure };
            let (beyond, slower) = self.beyond(limits, period, from);
            let next = match slower {
                Some(times) => format!(
                    "let the path take {:.2} s, {times:.3} times as long, or raise the limits; nothing was moved",
                    self.duration_s * times
                ),
                None => "keep within the limits, or raise a limit; nothing was moved".to_owned(),
            };
            beyond.into_iter().fold(failure, Failure::because).next(next)
        })?;
        let mut most = vec![0.0_f64; from.len()];
        for point in self.points(period, from) {
            let farther = |(most, Turns(at)): (&mut f64, Turns)| *most = if at.abs() > most.abs() { at } else { *most };
            most.iter_mut().zip(point).for_each(farther);
        }
        for (number, (drive, most)) in (1..).zip(drives.iter().zip(most)) {
            countable(drive, Angle::Turns(most), number).await?;
        }
        Ok(())
    }

    /// What the whole path takes of each axis beyond its limits, in words; and how many times slower it would be within those of speed and
    /// acceleration, unless no time is enough.
    fn beyond(&self, limits: &[AxisLimits], period: Duration, from: &[f64]) -> (Vec<String>, Option<f64>) {
        let mut needs = vec![AxisNeeds::default(); from.len()];
        for point in self.points(period, from) {
            needs.iter_mut().zip(point).for_each(|(axis, Turns(at))| axis.take(at, period.as_secs_f64()));
        }
        let (mut beyond, mut slower) = (Vec::new(), Some(1.0_f64));
        for ((node, _), (axis, limits)) in self.axes.iter().zip(needs.iter().zip(limits)) {
            let degrees = |turns: f64| Shown(turns * 360.0);
            let outside =
                limits.range_turns.as_ref().filter(|range| axis.low < *range.start() || axis.high > *range.end());
            beyond.extend(outside.map(|range| {
                let [low, high, least, most] = [axis.low, axis.high, *range.start(), *range.end()].map(degrees);
                format!("node {node}: the path goes from {low} to {high} deg, and {least} to {most} are its range")
            }));
            if outside.is_some() {
                slower = None;
            }
            // A path that takes so many times as long has that part of the speed, and the square of that part of the acceleration.
            for (most, limit, unit, power) in [
                (axis.speed, limits.velocity_turns_s, "deg/s", 1.0),
                (axis.acceleration, limits.acceleration_turns_s2, "deg/s2", 0.5),
            ] {
                if most > limit * (1.0 + 1e-6) {
                    let (needed, limit_deg) = (degrees(most), degrees(limit));
                    beyond.push(format!(
                        "node {node}: the path takes up to {needed} {unit}, and {limit_deg} are allowed"
                    ));
                    slower = slower.map(|times| times.max((most / limit).powf(power)));
                }
            }
        }
        (beyond, slower.filter(|times| *times > 1.0))
    }

    /// That the axes stand where it begins; `from` in turns.
    ///
    /// # Errors
    /// `not_at_start`, with how far each is away and what leads it there.
    pub fn check_start(&self, from: &[f64]) -> Result<(), Failure> {
        let degrees = |turns: f64| Shown(turns * 360.0);
        let led = self.axes.iter().zip(from).filter(|((_, spline), _)| spline.is_some());
        let axes = self.begin().zip(led).map(|((node, begin), (_, at))| (node, begin, *at));
        let away: Vec<_> = axes.clone().filter(|(_, begin, at)| (begin - at).abs() > AT_START_TURNS).collect();
        let Some((first, ..)) = away.first() else { return Ok(()) };
        let failure = Failure::new(format!("{} does not begin where the axes stand; nothing was moved", self.name))
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
            .next("ask to approach it (--approach; approach=True in Python): all axes are led there together, within their limits")
            .next(format!("or move there before, where they stay without power: group move {}", targets.join(" "))))
    }
}

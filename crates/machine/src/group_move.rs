//! A move of several axes to positions, as one: as it is typed, with which axes and within which limits, and how it is carried out.
//!
//! `ferrodrive group move` and a line of a scenario's host (`group move 1=90deg 2=-45deg within 3s`) are this.

use std::str::FromStr;
use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use master::group::{AxisLimits, AxisSetup, Group, GroupError, PathError, Phase};
use master::units::{Along, Angle, ParseUnitError, Ramp, Rpm, Turns};
use master::{Drive, cyclic::CyclicOptions};

use crate::file::{CyclePlan, GROUP_PERIOD, GroupPlan, Machine};
use words::failure::Failure;
use words::line;
use words::mode::mode;
use words::node::node;
use words::time::some_time;

/// A move as it is asked for; what is `None` is that of the machine file, or the default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupMove {
    /// Where each axis goes. The others of its group stay where they are.
    pub targets: Vec<(NodeId, Along<Angle>)>,
    /// By so much from where each axis is, instead of to a position.
    pub relative: bool,
    /// The name of the `[[group]]`; without it, the one that has the nodes.
    pub group: Option<String>,
    /// Duration; without it the shortest within the limits.
    pub within: Option<Duration>,
    /// Highest speed of each axis.
    pub velocity: Option<Rpm>,
    /// Highest acceleration of each axis, in turns/s^2.
    pub acceleration: Option<f64>,
    /// Time in which the acceleration reaches its highest value.
    pub rounding: Option<Duration>,
    /// Largest distance of a shaft from its set-point.
    pub following_error: Option<Angle>,
    /// From one SYNC to the next.
    pub period: Option<Duration>,
    /// Mode of operation of each axis.
    pub mode: Option<ModeOfOperation>,
    /// For so long the axes keep their power afterwards.
    pub hold: Option<Duration>,
}

/// The axes, and where each is to go; `None` for one that stays.
pub struct PlannedMove {
    /// The axes, in the order of their group.
    pub axes: Vec<AxisSetup>,
    /// From one SYNC to the next.
    pub period: Duration,
    targets: Vec<Option<Turns>>,
    relative: bool,
    within: Option<Duration>,
}

/// What becomes of drives whose power a group has taken at its end.
pub const PULLING_LOAD: &str =
    "a load that pulls (an arm, a slope) moves a motor without power, unless a brake holds it";

/// What was seen of a move; of the axes in the order of their group, in turns.
pub struct GroupRun {
    /// How long the path takes.
    pub time: Duration,
    /// Where each was.
    pub from: Vec<f64>,
    /// Where each was to go.
    pub to: Vec<f64>,
    /// Where each came to.
    pub at: Vec<f64>,
    /// The largest distance of each from its set-point on the way.
    pub largest_turns: Vec<f64>,
    /// Cycles that the path was late for.
    pub missed_cycles: u64,
}

/// An axis and its target: `1=90deg`, or `1=20mm` behind a gear with a feed.
///
/// # Errors
/// What is expected.
pub fn target(text: &str) -> Result<(NodeId, Along<Angle>), String> {
    let (number, position) = text.split_once('=').ok_or("expected NODE=POSITION, e.g. 1=90deg")?;
    Ok((node(number)?, with_unit(position)?))
}

/// An angle with its unit: a group is spoken of in degrees, and a number alone would be counts of the drive.
///
/// # Errors
/// What is expected.
pub fn angle(text: &str) -> Result<Angle, String> {
    with_unit(text)
}

fn with_unit<T: FromStr<Err = ParseUnitError>>(text: &str) -> Result<T, String> {
    let angle = text.parse().map_err(|error| format!("{error}"))?;
    if text.ends_with(|c: char| c.is_ascii_digit() || c == '.') {
        return Err(format!(
            "'{text}' has no unit: expected an angle, e.g. {text}deg, 0.5turn or 1.57rad, or counts of the drive: {text}counts"
        ));
    }
    Ok(angle)
}

/// A speed of the shaft above 0: a group plans in turns.
///
/// # Errors
/// What is expected.
pub fn turning(text: &str) -> Result<Rpm, String> {
    match text.parse() {
        Ok(Along::Turning(Rpm(value))) if value > 0.0 => Ok(Rpm(value)),
        Ok(Along::Turning(_)) => {
            Err("expected a profile velocity above 0, e.g. 60rpm; the target decides the direction".into())
        }
        Ok(Along::Metres(_)) => {
            Err("expected a speed of rotation, e.g. 60rpm: the axes of a group are moved in turns".into())
        }
        Err(error) => Err(error.to_string()),
    }
}

/// A speed of the shaft in either direction, other than 0.
///
/// # Errors
/// What is expected.
pub fn directed(text: &str) -> Result<Rpm, String> {
    turning(text.strip_prefix('-').unwrap_or(text)).map(|Rpm(rpm)| Rpm(if text.starts_with('-') { -rpm } else { rpm }))
}

/// Turns of a shaft: `20turn`, `90deg`; a number alone is turns.
///
/// # Errors
/// What is expected.
pub fn turns(text: &str) -> Result<f64, String> {
    match text.parse::<f64>().map_or_else(|_| text.parse(), |turns| Ok(Angle::Turns(turns))) {
        Ok(Angle::Turns(turns)) => Ok(turns),
        Ok(Angle::Counts(_)) => Err("expected an angle in turns or degrees, e.g. 20turn or 90deg".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// A rate above 0, in turns/s^2.
///
/// # Errors
/// What is expected.
pub fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<Ramp>() {
        Ok(Ramp::RpmPerSecond(rate)) if rate > 0.0 => Ok(rate / 60.0),
        Ok(_) => Err("expected a rate above 0, e.g. 120rpm/s: a change of speed does not take a fixed time".into()),
        Err(error) => Err(error.to_string()),
    }
}

/// An angle as the drive reckons it.
///
/// # Errors
/// Its counts for one turn are not known.
pub async fn turns_of(drive: &Drive, angle: Angle) -> Result<Turns, master::Error> {
    match angle {
        Angle::Turns(turns) => Ok(Turns(turns)),
        Angle::Counts(counts) => Ok(Turns(counts as f64 / drive.counts_per_turn().await?)),
    }
}

/// Turns of a drive's shaft that 32 bits surely count to: with up to 2^24 counts for one turn.
const SURELY_COUNTED_TURNS: f64 = 127.0;

/// A position of the axis of this number, from 1, as the drive reckons it. Positions of CiA 402 (607Ah, 6064h) are INTEGER32. A drive is
/// asked for its counts only where it may not fit.
///
/// # Errors
/// It does not fit, or the drive does not answer.
pub async fn countable(drive: &Drive, angle: Angle, axis: usize) -> Result<Turns, GroupError> {
    let Turns(to_turns) = turns_of(drive, angle).await?;
    if (to_turns * drive.gear().ratio()).abs() > SURELY_COUNTED_TURNS {
        let most_turns = f64::from(i32::MAX) / drive.counts_per_turn().await?;
        if to_turns.abs() > most_turns {
            let error = PathError::BeyondCounts { axis, to_turns, most_turns };
            return Err(GroupError::Path { node: Some(drive.node().id()), error });
        }
    }
    Ok(Turns(to_turns))
}

impl FromStr for GroupMove {
    type Err = String;

    /// What stands behind `group` in a line of a scenario: its [form](GroupMove::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let form = format!("group {}", Self::FORM);
        let mut words = text.split_whitespace().peekable();
        if words.next() != Some("move") {
            return Err(format!("'group {text}' is not a command of a group; expected: {form}"));
        }
        let mut asked = Self { relative: words.next_if_eq(&"by").is_some(), ..Self::default() };
        line::take(&form, words, |word, value| match word {
            "within" => {
                asked.within = Some(some_time(value()?)?);
                Ok(true)
            }
            word if word.contains('=') => {
                asked.targets.push(target(word)?);
                Ok(true)
            }
            _ => asked.take(word, value),
        })?;
        asked.check().map_err(|failure| failure.one_line())?;
        Ok(asked)
    }
}

impl GroupMove {
    /// It as a line of a host has it, behind `group`.
    pub const FORM: &str = "move [by] NODE=POSITION.. [of GROUP] [at SPEED] [acceleration RATE] [rounding TIME] \
                            [following-error ANGLE] [period TIME] [mode MODE] [within TIME] [hold TIME]";

    /// Takes an option of a line that a path has too; false for another word. See [`line::take`].
    ///
    /// # Errors
    /// A bad value.
    pub fn take<'a>(&mut self, word: &str, value: &mut dyn FnMut() -> Result<&'a str, String>) -> Result<bool, String> {
        match word {
            "of" => self.group = Some(value()?.to_owned()),
            "at" => self.velocity = Some(turning(value()?)?),
            "acceleration" => self.acceleration = Some(rate(value()?)?),
            "rounding" => self.rounding = Some(some_time(value()?)?),
            "following-error" => self.following_error = Some(angle(value()?)?),
            "period" => self.period = Some(some_time(value()?)?),
            "mode" => self.mode = Some(mode(value()?)?),
            "hold" => self.hold = Some(some_time(value()?)?),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn check(&self) -> Result<(), Failure> {
        if self.targets.is_empty() {
            return Err(
                Failure::usage("expected the axes to move").next("name each with its position: 1=90deg 4=0.5turn")
            );
        }
        for (position, (node, _)) in self.targets.iter().enumerate() {
            if self.targets[..position].iter().any(|(other, _)| other == node) {
                return Err(Failure::usage(format!("two positions for node {node}"))
                    .at_node(*node)
                    .next("name each node once, with the position where it is to end"));
            }
        }
        Ok(())
    }

    /// Its axes, and the group of the machine file that they are of, if there is a file with groups.
    ///
    /// # Errors
    /// No axis, one that is named twice, or axes that are not of one group.
    pub fn axes<'a>(&self, machine: Option<&'a Machine>) -> Result<(Vec<NodeId>, Option<&'a GroupPlan>), Failure> {
        self.axes_in(machine.map(|machine| &*machine.groups))
    }

    /// The same with the groups of a file, if there is one.
    ///
    /// # Errors
    /// Those of [`axes`](Self::axes).
    pub fn axes_in<'a>(
        &self,
        groups: Option<&'a [GroupPlan]>,
    ) -> Result<(Vec<NodeId>, Option<&'a GroupPlan>), Failure> {
        self.check()?;
        let plan = self.of_file(groups)?;
        let nodes = match plan {
            Some(plan) => plan.axes.iter().map(|axis| axis.node).collect(),
            None => self.targets.iter().map(|(node, _)| *node).collect(),
        };
        Ok((nodes, plan))
    }

    fn of_file<'a>(&self, of_file: Option<&'a [GroupPlan]>) -> Result<Option<&'a GroupPlan>, Failure> {
        let groups = of_file.unwrap_or_default();
        let names = || groups.iter().map(|group| group.name.as_str()).collect::<Vec<_>>().join(", ");
        let has = |group: &&GroupPlan, node: NodeId| group.axes.iter().any(|axis| axis.node == node);
        let Some(name) = &self.group else {
            let found = groups.iter().find(|group| self.targets.iter().all(|(node, _)| has(group, *node)));
            // Limits that the file has for an axis are not passed over because of its neighbour.
            let parted = groups.iter().any(|group| self.targets.iter().any(|(node, _)| has(&group, *node)));
            if found.is_none() && parted {
                return Err(Failure::bad_file("these nodes are not in one [[group]] of the machine file")
                    .next(format!("move those of one group together; its groups: {}", names())));
            }
            return Ok(found);
        };
        let Some(group) = groups.iter().find(|group| group.name == *name) else {
            let what = format!("there is no group '{name}'");
            let advice = "a group is a [[group]] of a machine file (docs/machine-file.md); give that file";
            return Err(match groups {
                [] if of_file.is_none() => Failure::usage(what).next(advice),
                [] => Failure::bad_file(what).next(advice),
                _ => Failure::bad_file(what).next(format!("the machine file has: {}", names())),
            });
        };
        match self.targets.iter().find(|(node, _)| !has(&group, *node)) {
            Some((node, _)) => {
                let axes: Vec<_> = group.axes.iter().map(|axis| axis.node.to_string()).collect();
                Err(Failure::bad_file(format!("node {node} is not an axis of the group '{name}'"))
                    .at_node(*node)
                    .next(format!("move its axes, nodes {}, or add the node to its [[group]]", axes.join(", "))))
            }
            None => Ok(Some(group)),
        }
    }

    /// How far each of its [axes](Self::axes) may go, and where to: all of it before anything moves.
    ///
    /// # Errors
    /// A drive that cannot be moved so, or whose counts are not known.
    pub async fn plan(&self, plan: Option<&GroupPlan>, drives: Vec<Drive>) -> Result<PlannedMove, GroupError> {
        let period = self.period.or(plan.and_then(|plan| plan.period)).unwrap_or(GROUP_PERIOD);
        let (relative, within) = (self.relative, self.within);
        let mut planned = PlannedMove { axes: Vec::new(), targets: Vec::new(), period, relative, within };
        for (index, drive) in drives.into_iter().enumerate() {
            let said = plan.map(|plan| &plan.axes[index]);
            let mode = self.mode.or(said.and_then(|axis| axis.mode));
            let mode = mode.map_or_else(|| AxisSetup::best_mode(&drive), Ok)?;
            let limits = self.limits(&drive, said.map(|axis| &axis.limits)).await?;
            let target = self.targets.iter().find(|(node, _)| *node == drive.node().id());
            planned.targets.push(match target {
                Some((_, wish)) => Some(countable(&drive, drive.turning(*wish)?, index + 1).await?),
                None => None,
            });
            planned.axes.push(AxisSetup { drive, mode, limits });
        }
        Ok(planned)
    }

    /// What an axis may do: as the file says, or less where less is asked for. Without a file as it is asked for, else as a careful person
    /// would begin.
    async fn limits(&self, drive: &Drive, said: Option<&AxisLimits>) -> Result<AxisLimits, master::Error> {
        let following = match self.following_error {
            Some(angle) => Some(turns_of(drive, angle).await?.0),
            None => None,
        };
        let (is_said, careful) = (said.is_some(), AxisLimits::careful());
        let said = said.unwrap_or(&careful);
        // A machine's limits are its file's: a number that is meant for all axes at once raises none.
        let of =
            |asked: Option<f64>, said: f64| asked.map_or(said, |asked| if is_said { asked.min(said) } else { asked });
        let acceleration_turns_s2 = of(self.acceleration, said.acceleration_turns_s2);
        // Without a stated jerk it follows the acceleration.
        let rounding_s = careful.acceleration_turns_s2 / careful.jerk_turns_s3;
        let jerk = self.rounding.map(|time| acceleration_turns_s2 / time.as_secs_f64());
        Ok(AxisLimits {
            range_turns: said.range_turns.clone(),
            velocity_turns_s: of(self.velocity.map(|Rpm(rpm)| rpm / 60.0), said.velocity_turns_s),
            acceleration_turns_s2,
            jerk_turns_s3: if is_said {
                of(jerk, said.jerk_turns_s3)
            } else {
                jerk.unwrap_or(acceleration_turns_s2 / rounding_s)
            },
            following_error_turns: of(following, said.following_error_turns),
        })
    }
}

impl PlannedMove {
    /// What the bus has to carry.
    pub fn cycle(&self) -> CyclePlan {
        CyclePlan {
            what: "the group".to_owned(),
            period: self.period,
            nodes: self.axes.iter().map(|axis| (axis.drive.node().id(), Some(axis.mode))).collect(),
            is_base: false,
        }
    }

    /// Its group, its drives set up and without power.
    ///
    /// # Errors
    /// Those of [`Group::open`].
    pub async fn open(&self, options: CyclicOptions) -> Result<Group, GroupError> {
        Group::open(&self.axes, self.period, options).await
    }

    /// Enables, moves, and waits until the shafts are seen where they were to go; `progress` is called in each cycle with the time on the path and its whole time. The
    /// group holds then, and is the caller's to close, also after an error.
    ///
    /// # Errors
    /// Those of the [group](Group), and what has stopped it.
    pub async fn carry_out(
        &self,
        group: &mut Group,
        mut progress: impl FnMut(Duration, Duration),
    ) -> Result<GroupRun, GroupError> {
        group.enable().await?;
        let from: Vec<_> = group.points().iter().map(|point| point.position_turns).collect();
        let goal = |(from, target): (&f64, &Option<Turns>)| match target {
            Some(Turns(by)) if self.relative => from + by,
            Some(Turns(to)) => *to,
            None => *from,
        };
        let to: Vec<_> = from.iter().zip(&self.targets).map(goal).collect();
        let goals: Vec<_> = to.iter().copied().map(Turns).collect();
        let time = group.start_move(&goals, self.within)?;
        let mut largest_turns = vec![0.0_f64; from.len()];
        let began = group.network().now();
        loop {
            let phase = group.cycle().await?.phase;
            let errors = group.following_errors().map(Option::unwrap_or_default);
            largest_turns.iter_mut().zip(errors).for_each(|(largest, error)| *largest = largest.max(error));
            if phase != Phase::Moving {
                break;
            }
            progress(group.network().now() - began, time);
        }
        group.settle().await?;
        let at = group.axes().iter().zip(&to).map(|(state, to)| state.position.map_or(*to, |Turns(at)| at)).collect();
        Ok(GroupRun { time, from, to, at, largest_turns, missed_cycles: group.state().missed_cycles })
    }
}

/// Has the axes of a group that rests hold until `ended`, which is asked in each cycle with the time since; that time. Of a group that was
/// stopped those that follow.
///
/// # Errors
/// What stopped the group meanwhile.
pub async fn hold(group: &mut Group, mut ended: impl FnMut(Duration) -> bool) -> Result<Duration, GroupError> {
    let (began, stopped) = (group.network().now(), group.state().cause);
    loop {
        if group.cycle().await?.cause != stopped {
            group.rest().await?;
        }
        let held = group.network().now() - began;
        if ended(held) {
            return Ok(held);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_targets_and_options_in_any_order() {
        let asked: GroupMove =
            "move by 1=90deg at 60rpm 2=-0.5turn within 3s of arm period 2ms mode ip".parse().unwrap();
        let [one, two] = [1, 2].map(|id| NodeId::new(id).unwrap());
        let turns = |turns| Along::Turning(Angle::Turns(turns));
        assert_eq!(asked.targets, [(one, turns(0.25)), (two, turns(-0.5))]);
        assert_eq!((asked.relative, asked.group.as_deref(), asked.velocity), (true, Some("arm"), Some(Rpm(60.0))));
        assert_eq!((asked.within, asked.period), (Some(Duration::from_secs(3)), Some(Duration::from_millis(2))));
        assert_eq!(asked.mode, Some(ModeOfOperation::INTERPOLATED_POSITION));
    }

    /// One number is for all axes: an axis that the file lets do less does less.
    #[test]
    fn what_a_move_asks_for_lowers_the_limits_of_the_file_and_raises_none() {
        let (network, node) = (master::Network::new(), NodeId::new(1).unwrap());
        let drive = Drive::new(network.node(node), words::models::resolve("zlac8030l").unwrap());
        let said = AxisLimits { velocity_turns_s: 1.0, following_error_turns: 0.2, ..AxisLimits::careful() };
        let limits = |line: &str, said: Option<&AxisLimits>| {
            let asked: GroupMove = line.parse().unwrap();
            sim::block_on(&mut sim::World::new(can::Bitrate::K500, 1), asked.limits(&drive, said)).unwrap().unwrap()
        };
        let fast = "move 1=90deg at 120rpm acceleration 6000rpm/s following-error 1turn rounding 1ms";
        assert_eq!(limits(fast, Some(&said)), said);
        let free = limits(fast, None);
        assert_eq!((free.velocity_turns_s, free.acceleration_turns_s2, free.following_error_turns), (2.0, 100.0, 1.0));
        let slow = limits("move 1=90deg at 30rpm following-error 36deg", Some(&said));
        assert_eq!((slow.velocity_turns_s, slow.following_error_turns), (0.5, 0.1));
        assert_eq!((slow.acceleration_turns_s2, slow.jerk_turns_s3), (said.acceleration_turns_s2, said.jerk_turns_s3));
    }

    #[test]
    fn what_is_not_a_move_is_refused_with_the_form() {
        for (line, said) in [
            ("", "expected: group move [by]"),
            ("follow x.csv", "'group follow x.csv' is not a command of a group"),
            ("move", "expected the axes to move"),
            ("move 1=30", "'30' has no unit"),
            ("move 1=90deg 1=10deg", "two positions for node 1"),
            ("move 1=90deg fast", "'fast' is not a part of group move"),
            ("move 1=90deg within", "'within' has no value"),
            ("move 1=90deg within 0s", "a time above 0"),
            ("move 1=90deg at 1m/s", "moved in turns"),
            ("move 1=90deg acceleration 500ms", "a rate above 0"),
            ("move 200=90deg", "node-ID"),
        ] {
            let refused = line.parse::<GroupMove>().err().unwrap_or_default();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}

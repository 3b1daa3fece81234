//! Axes that move as one, in a machine file: `[[group]]` and `[base]`. A master uses them (`ferrodrive group`, `ferrodrive
//! drive-base`); a simulated machine does not use it.

use std::ops::RangeInclusive;
use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use master::base::{BaseLimits, Geometry};
use master::group::AxisLimits;
use master::units::parse_duration;

use words::document::Problem;
use words::document::reader::{Field, Table};
use words::mode::mode;
use words::node::node;

const NODE: &str = "the node-ID of a [[drive]], e.g. 4";
const NUMBER: &str = "a number above 0";
const RANGE: &str = "two bounds in degrees, [low, high]";
const MODE: &str = "a mode of operation as text, e.g. \"csp\"";
const TIME: &str = "a time as text, e.g. \"10ms\"";
const AXES: &str = "a table of its own for each axis, begun by [[group.axis]]";
const WHEELS: &str = "the nodes of the left and the right wheel, e.g. [4, 5]";
const TURNS: &str = "turns of each drive for a turn of its wheel forward, e.g. [1, -1]";

const GROUP_KEYS: &[&str] = &["name", "period", "axis"];
const AXIS_KEYS: &[&str] =
    &["node", "mode", "range_deg", "velocity_deg_s", "acceleration_deg_s2", "jerk_deg_s3", "following_error_deg"];
const BASE_KEYS: &[&str] = &[
    "wheels",
    "turns",
    "mode",
    "period",
    "wheel_base_m",
    "wheel_radius_m",
    "linear_m_s",
    "angular_rad_s",
    "wheel_m_s",
    "wheel_m_s2",
    "watchdog",
    "lag_m",
];

/// Axes that move as one: a `[[group]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupPlan {
    /// Its name, without blanks.
    pub name: String,
    /// From one SYNC to the next, where the file says it.
    pub period: Option<Duration>,
    /// Its axes in their order.
    pub axes: Vec<AxisPlan>,
}

/// One axis of it.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisPlan {
    /// Its node.
    pub node: NodeId,
    /// How it is moved, where the file says it.
    pub mode: Option<ModeOfOperation>,
    /// What it may do.
    pub limits: AxisLimits,
}

/// A base on two wheels: `[base]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BasePlan {
    /// The left wheel and the right one, and the turns of each drive for a turn of its wheel forward.
    pub wheels: [(NodeId, f64); 2],
    /// How they are moved, where the file says it.
    pub mode: Option<ModeOfOperation>,
    /// From one SYNC to the next, where the file says it.
    pub period: Option<Duration>,
    /// Where its wheels are.
    pub geometry: Geometry,
    /// What it may do. The watchdog is the file's, or 300 ms.
    pub limits: BaseLimits,
}

/// How long a twist counts by default.
pub const WATCHDOG: Duration = Duration::from_millis(300);

/// All groups of a file with drives at these nodes, and its base. What is wrong is added to `problems`.
pub(super) fn read(
    file: &Table<'_>,
    drives: &[NodeId],
    problems: &mut Vec<Problem>,
) -> (Vec<GroupPlan>, Option<BasePlan>) {
    let mut groups: Vec<GroupPlan> = Vec::new();
    let expected = "a table of its own for each group, begun by [[group]]";
    let fields = file.get("group").map_or(Ok(Vec::new()), |field| field.list(expected));
    let fields = fields.unwrap_or_else(|problem| {
        problems.push(problem);
        Vec::new()
    });
    for field in fields {
        match group(&field, drives) {
            Err(problem) => problems.push(problem),
            Ok(group) if groups.iter().any(|other| other.name == group.name) => {
                problems.push(field.problem(format!("two groups have the name '{}'", group.name)));
            }
            Ok(group) => groups.push(group),
        }
    }
    let base = file.get("base").map(|field| base(&field, drives)).transpose();
    let base = base.unwrap_or_else(|problem| {
        problems.push(problem);
        None
    });
    (groups, base)
}

fn group(field: &Field<'_>, drives: &[NodeId]) -> Result<GroupPlan, Problem> {
    let table = field.table("a group", "a table of its own for each group, begun by [[group]]")?;
    table.takes_only(GROUP_KEYS)?;
    let expected = "a name without blanks, e.g. \"arm\"";
    let name = table.need("name", expected)?;
    let text = name.text(expected)?;
    if text.is_empty() || text.contains(char::is_whitespace) {
        return Err(name.wrong(expected));
    }
    let field = table.need("axis", AXES)?;
    let mut axes: Vec<AxisPlan> = Vec::new();
    for (number, entry) in (1..).zip(field.list(AXES)?) {
        let axis = axis(&entry, number, drives)?;
        if axes.iter().any(|other| other.node == axis.node) {
            return Err(entry.problem(format!("node {} is two axes of the group '{text}'", axis.node)));
        }
        axes.push(axis);
    }
    if axes.is_empty() {
        return Err(field.wrong(AXES));
    }
    Ok(GroupPlan { name: text.to_owned(), period: time(&table, "period")?, axes })
}

fn axis(field: &Field<'_>, number: usize, drives: &[NodeId]) -> Result<AxisPlan, Problem> {
    let table = field.table("an axis of a group", AXES)?;
    table.takes_only(AXIS_KEYS)?;
    let limits = ["velocity_deg_s", "acceleration_deg_s2", "jerk_deg_s3", "following_error_deg"];
    table.need_all(&limits, NUMBER)?;
    let turns = |name| Ok::<_, Problem>(table.need(name, NUMBER)?.number(NUMBER)? / 360.0);
    let limits = AxisLimits {
        range_turns: table.get("range_deg").map(|field| range(&field)).transpose()?,
        velocity_turns_s: turns("velocity_deg_s")?,
        acceleration_turns_s2: turns("acceleration_deg_s2")?,
        jerk_turns_s3: turns("jerk_deg_s3")?,
        following_error_turns: turns("following_error_deg")?,
    };
    limits.check(number).map_err(|error| field.problem(error.to_string()))?;
    Ok(AxisPlan { node: drive(&table.need("node", NODE)?, drives)?, mode: mode_of(&table)?, limits })
}

fn base(field: &Field<'_>, drives: &[NodeId]) -> Result<BasePlan, Problem> {
    let table = field.table("a base", "a table, begun by [base]")?;
    table.takes_only(BASE_KEYS)?;
    let lengths = ["wheel_base_m", "wheel_radius_m", "linear_m_s", "angular_rad_s", "wheel_m_s", "wheel_m_s2"];
    table.need_all(&lengths, NUMBER)?;
    let number = |name| table.need(name, NUMBER)?.number(NUMBER);
    let geometry = Geometry { wheel_base_m: number("wheel_base_m")?, wheel_radius_m: number("wheel_radius_m")? };
    let limits = BaseLimits {
        linear_m_s: number("linear_m_s")?,
        angular_rad_s: number("angular_rad_s")?,
        wheel_m_s: number("wheel_m_s")?,
        wheel_m_s2: number("wheel_m_s2")?,
        watchdog: time(&table, "watchdog")?.unwrap_or(WATCHDOG),
        lag_m: match table.get("lag_m") {
            Some(field) => field.number(NUMBER)?,
            None => BaseLimits::lag_for(number("wheel_m_s")?),
        },
    };
    geometry.check().and_then(|()| limits.check()).map_err(|error| field.problem(error.to_string()))?;
    let wheels = table.need("wheels", WHEELS)?;
    let nodes = wheels.list(WHEELS)?.iter().map(|node| drive(node, drives)).collect::<Result<Vec<_>, _>>()?;
    let [left, right] = <[NodeId; 2]>::try_from(nodes).map_err(|_| wheels.wrong(WHEELS))?;
    if left == right {
        return Err(wheels.problem(format!("node {left} cannot be both wheels")));
    }
    let turns = table.need("turns", TURNS)?;
    let values = turns.list(TURNS)?.iter().map(|turns| turns.number(TURNS)).collect::<Result<Vec<_>, _>>()?;
    let [left_turns, right_turns] = <[f64; 2]>::try_from(values).map_err(|_| turns.wrong(TURNS))?;
    if left_turns == 0.0 || right_turns == 0.0 {
        return Err(turns.wrong(TURNS));
    }
    let wheels = [(left, left_turns), (right, right_turns)];
    Ok(BasePlan { wheels, mode: mode_of(&table)?, period: time(&table, "period")?, geometry, limits })
}

/// The node of one of the drives.
fn drive(field: &Field<'_>, drives: &[NodeId]) -> Result<NodeId, Problem> {
    let id = node(&field.word(NODE)?).map_err(|reason| field.problem(reason))?;
    if drives.contains(&id) {
        return Ok(id);
    }
    Err(field.problem(format!("the file has no [[drive]] at node {id}")))
}

fn range(field: &Field<'_>) -> Result<RangeInclusive<f64>, Problem> {
    let bounds = field.list(RANGE)?.iter().map(|bound| bound.number(RANGE)).collect::<Result<Vec<_>, _>>()?;
    let [low, high] = <[f64; 2]>::try_from(bounds).map_err(|_| field.wrong(RANGE))?;
    Ok(low / 360.0..=high / 360.0)
}

fn mode_of(table: &Table<'_>) -> Result<Option<ModeOfOperation>, Problem> {
    let Some(field) = table.get("mode") else { return Ok(None) };
    mode(&field.word(MODE)?).map(Some).map_err(|reason| field.problem(reason))
}

fn time(table: &Table<'_>, name: &str) -> Result<Option<Duration>, Problem> {
    let Some(field) = table.get(name) else { return Ok(None) };
    parse_duration(&field.words(TIME)?).map(Some).map_err(|error| field.problem(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::super::Machine;
    use super::*;

    const DRIVES: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n[[drive]]\nmodel = 'zlac8030l'\nnode = 5\n";
    const GROUP: &str = "[[group]]\nname = 'arm'\nperiod = '2ms'\n";
    const AXIS: &str = "[[group.axis]]\nnode = 4\nmode = 'pv'\nrange_deg = [-90, 180]\nvelocity_deg_s = 360\n\
                        acceleration_deg_s2 = 720\njerk_deg_s3 = 3600\nfollowing_error_deg = 36\n";
    const BASE: &str = "[base]\nwheels = [4, 5]\nturns = [1, -1]\nwheel_base_m = 0.4\nwheel_radius_m = 0.084\n\
                        linear_m_s = 0.8\nangular_rad_s = 2\nwheel_m_s = 0.9\nwheel_m_s2 = 0.7\n";

    fn refusal(text: &str) -> String {
        Machine::parse(text).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    #[test]
    fn groups_and_a_base_are_read_in_their_units() {
        let machine = Machine::parse(&format!("{DRIVES}{GROUP}{AXIS}{BASE}")).unwrap_or_else(|bad| panic!("{bad}"));
        let [group] = &machine.groups[..] else { panic!("{:?}", machine.groups) };
        assert_eq!((group.name.as_str(), group.period), ("arm", Some(Duration::from_millis(2))));
        let [axis] = &group.axes[..] else { panic!("{group:?}") };
        assert_eq!((axis.node.raw(), axis.mode), (4, Some(ModeOfOperation::PROFILE_VELOCITY)));
        assert_eq!(axis.limits.range_turns, Some(-0.25..=0.5));
        assert_eq!((axis.limits.velocity_turns_s, axis.limits.acceleration_turns_s2), (1.0, 2.0));
        assert_eq!((axis.limits.jerk_turns_s3, axis.limits.following_error_turns), (10.0, 0.1));
        let base = machine.base.unwrap();
        assert_eq!(base.wheels.map(|(node, turns)| (node.raw(), turns)), [(4, 1.0), (5, -1.0)]);
        assert_eq!(base.geometry, Geometry { wheel_base_m: 0.4, wheel_radius_m: 0.084 });
        assert_eq!((base.limits.wheel_m_s, base.limits.watchdog, base.period), (0.9, WATCHDOG, None));
        // A master uses them: it does not say that it does not.
        assert_eq!(machine.unused_by_a_master(), None);
    }

    #[test]
    fn what_is_wrong_with_a_group_is_reported_at_its_place() {
        let with = |from: &str, to: &str| refusal(&format!("{DRIVES}{GROUP}{}", AXIS.replace(from, to)));
        assert!(with("node = 4", "node = 9").contains("line 11, column 8: the file has no [[drive]] at node 9"));
        assert!(with("velocity_deg_s = 360\n", "").contains("an axis of a group needs 'velocity_deg_s'"));
        let fewer = AXIS.replace("velocity_deg_s = 360\n", "").replace("jerk_deg_s3 = 3600\n", "");
        let without = refusal(&format!("{DRIVES}{GROUP}{fewer}"));
        assert!(without.contains("an axis of a group needs 'velocity_deg_s', 'jerk_deg_s3': "), "{without}");
        let zero = with("jerk_deg_s3 = 3600", "jerk_deg_s3 = 0");
        assert!(zero.contains("the limit of axis 1 for a jerk is 0 deg/s^3"), "{zero}");
        assert!(with("[-90, 180]", "[180, -90]").contains("state the lower one first"));
        assert!(with("[-90, 180]", "[1]").contains("'range_deg' is a list of 1; expected two bounds in degrees"));
        assert!(with("'pv'", "'fast'").contains("'fast' is not a mode of operation"));
        assert!(refusal(&format!("{DRIVES}{GROUP}")).contains("a group needs 'axis'"));
        assert!(refusal(&format!("{DRIVES}{GROUP}{AXIS}{AXIS}")).contains("node 4 is two axes of the group 'arm'"));
        let twice = format!("{DRIVES}{GROUP}{AXIS}{GROUP}{AXIS}");
        assert!(refusal(&twice).contains("line 18, column 1: two groups have the name 'arm'"), "{}", refusal(&twice));
        assert!(refusal(&format!("{DRIVES}{GROUP}speed = 1\n{AXIS}")).contains("a group has no 'speed'"));
    }

    #[test]
    fn what_is_wrong_with_a_base_is_reported_at_its_place() {
        let with = |from: &str, to: &str| refusal(&format!("{DRIVES}{}", BASE.replace(from, to)));
        assert!(with("[4, 5]", "[4, 4]").contains("line 8, column 10: node 4 cannot be both wheels"));
        assert!(
            with("[4, 5]", "[4]").contains("'wheels' is a list of 1; expected the nodes of the left and the right")
        );
        assert!(with("[1, -1]", "[1, 0]").contains("'turns' is a list of 2; expected turns of each drive"));
        assert!(with("wheel_m_s2 = 0.7", "wheel_m_s2 = -1").contains("the limit wheel_m_s2 is -1"));
        assert!(with("wheel_radius_m = 0.084", "wheel_radius_m = 0").contains("state a finite length above 0"));
        assert!(with("wheel_m_s2 = 0.7", "wheel_m_s2 = 1\nwatchdog = 5").contains("'watchdog' is 5; expected a time"));
    }
}

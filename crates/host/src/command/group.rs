//! Commands to several drives as one motion, as JSON.

use canopen::NodeId;
use master::base::Twist;
use serde::Deserialize;

use super::fields;

/// A motion of several drives.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum GroupCommand {
    /// Turns several drives to positions, or by angles, together.
    GroupMove(GroupMove),
    /// Turns several drives together as long as they are held.
    GroupJog {
        /// Which drives, and how fast.
        axes: Vec<AxisSpeed>,
        /// The highest acceleration of each.
        rpm_per_s: Option<f64>,
    },
    /// Drives two wheels as a base as long as they are held.
    BaseJog(BaseJog),
    /// Holds a base, with another twist.
    BaseTwist {
        /// Forward.
        linear_m_s: f64,
        /// To the left.
        angular_rad_s: f64,
    },
    /// Holds a group; at least every 100 ms.
    GroupHold {},
    /// Ends a group: it comes to rest within its limits.
    GroupEnd {},
}

impl GroupCommand {
    pub(super) const WORDS: &[&str] = &["group_move", "group_jog", "base_jog", "base_twist", "group_hold", "group_end"];
}

/// Targets of several drives.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupMove {
    /// Which drives, and where to.
    pub axes: Vec<AxisTarget>,
    /// By so much from where each is.
    #[serde(default)]
    pub relative: bool,
    /// The highest speed of each.
    pub rpm: Option<f64>,
    /// The highest acceleration of each.
    pub rpm_per_s: Option<f64>,
    /// Duration of the motion, instead of the shortest possible.
    pub within_s: Option<f64>,
}

/// The target of a drive of a group.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisTarget {
    /// Which drive.
    #[serde(deserialize_with = "fields::node")]
    pub node: NodeId,
    /// Of its output.
    pub degrees: f64,
}

/// The speed of a drive of a group.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpeed {
    /// Which drive.
    #[serde(deserialize_with = "fields::node")]
    pub node: NodeId,
    /// Of its output.
    pub rpm: f64,
}

/// A two-wheeled base and its motion.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseJog {
    /// The left one and the right one.
    #[serde(deserialize_with = "fields::two_nodes")]
    pub wheels: [NodeId; 2],
    /// Turns of each drive for a turn of its wheel forward.
    pub turns: [f64; 2],
    /// Distance of the wheels.
    pub wheel_base_m: f64,
    /// Radius of a wheel.
    pub wheel_radius_m: f64,
    /// The highest speed of a wheel over the ground, and its highest acceleration.
    pub most_m_s: f64,
    /// The highest acceleration of a wheel.
    pub m_per_s2: f64,
    /// Forward.
    pub linear_m_s: f64,
    /// To the left.
    pub angular_rad_s: f64,
}

impl BaseJog {
    /// Its motion: m/s forwards and rad/s to the left.
    pub const fn twist(&self) -> Twist {
        Twist { linear_m_s: self.linear_m_s, angular_rad_s: self.angular_rad_s }
    }
}

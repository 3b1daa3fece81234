//! Why a drive does not move, why a PDO is silent, and what is missing to reach Operation enabled.
//!
//! In: the frames that others send ([`Overheard`]) and what the drive's objects say, read by SDO. Out: [`Finding`]s in the
//! order in which a person would look: does it answer, what is its NMT state, who else commands it, its inputs and its brake, its power state, its mode,
//! its set-point, its load, its PDOs one by one. Only listens and reads: nothing is written, so that a running machine may be
//! looked at. What differs between models comes from their descriptions; without one the standard's objects are looked at.
//!
//! The rules are pure functions of what was [observed](Observed): one file for each topic.

mod communication;
mod finding;
mod load;
mod mode;
mod observed;
mod overheard;
mod pdos;
mod power;
mod set_point;
mod terminals;

use canopen::{NmtState, NodeId};
use cia402::{ModeOfOperation, PowerState};
use std::time::Duration;

pub use finding::{Finding, Topic, Weight};
pub use observed::Observed;
pub use overheard::{HeardFrames, Overheard};
pub use pdos::PdoSeen;

/// The result of looking at a drive.
#[derive(Clone, Debug)]
pub struct Explained {
    /// The node.
    pub node: NodeId,
    /// The name of its model, if known.
    pub model: Option<&'static str>,
    /// Its NMT state, as far as that was heard.
    pub nmt: Option<NmtState>,
    /// Its power state.
    pub power: Option<PowerState>,
    /// Its mode, as it shows it.
    pub mode: Option<ModeOfOperation>,
    /// Speed of the shaft in r/min.
    pub speed_rpm: Option<f64>,
    /// Supply voltage in V.
    pub supply_v: Option<f64>,
    /// How long the bus was listened to.
    pub listened: Duration,
    /// What was found, in the order to look at it.
    pub findings: Vec<Finding>,
    /// Its PDOs that are mapped or switched on, and what was heard of them.
    pub pdos: Vec<PdoSeen>,
}

/// A rule adds what it finds.
type Rule = fn(&Observed, &mut Vec<Finding>);

/// In the order of the findings. The load comes last of what concerns motion: it looks at what the others leave unexplained.
const RULES: [Rule; 7] =
    [communication::look, terminals::look, power::look, mode::look, set_point::look, load::look, pdos::look];

/// What a motion that is under way has brought about itself, and what says no more than that it does not come forward.
const OF_THE_MOTION: [&str; 4] = ["at_target", "set_point_not_started", "start_bit_left_set", "shaft_held"];

impl Observed {
    /// The first cause for which a shaft that was set in motion does not get there: an input, its commands and limits, its load.
    pub(crate) fn hindrance(&self) -> Option<Finding> {
        let mut findings = Vec::new();
        for rule in [terminals::look, mode::look, set_point::look, load::look] {
            rule(self, &mut findings);
        }
        let stops = |finding: &Finding| finding.weight == Weight::Cause && !OF_THE_MOTION.contains(&finding.rule);
        findings.into_iter().find(stops)
    }

    /// What follows from this.
    pub fn explained(&self) -> Explained {
        let mut findings = Vec::new();
        for rule in RULES {
            rule(self, &mut findings);
        }
        Explained {
            node: self.node,
            model: self.description.map(|description| description.name),
            nmt: self.nmt,
            power: self.power,
            mode: self.mode,
            speed_rpm: self.speed_rpm,
            supply_v: self.supply_v,
            listened: self.heard.listened(),
            findings,
            pdos: pdos::seen(self),
        }
    }
}

//! Why a drive does not move, why a PDO is silent, and what is missing to reach Operation enabled.
//!
//! In: the frames that others send ([`Overheard`]) and what the drive's objects say, read by SDO. Out: [`Finding`]s in the
//! order in which a person would look: does it answer, what is its NMT state, who else commands it, its power state, its mode,
//! its set-point, its load, its PDOs one by one. Only listens and reads: nothing is written, so that a running machine may be
//! looked at. What differs between models comes from their descriptions; without one the standard's objects are looked at.
//!
//! The rules are pure functions of what was [observed](Observed): one file for each topic, and [`RULES`] their order.

mod communication;
mod load;
mod mode;
mod observed;
mod overheard;
mod pdos;
mod power;
mod set_point;

use canopen::{NmtState, NodeId};
use cia402::{ModeOfOperation, PowerState};
use std::time::Duration;

use crate::drive::Drive;
pub use observed::Observed;
pub use overheard::{HeardFrames, Overheard};
pub use pdos::PdoSeen;

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Whether it answers, its NMT state, heartbeats, other masters, its watch over a host.
    Communication,
    /// The power state machine: the way to Operation enabled, and faults.
    Power,
    /// 6060h and 6061h.
    Mode,
    /// Targets, ramps, limits, start bits.
    SetPoint,
    /// What the shaft does with all that.
    Load,
    /// A PDO.
    Pdo,
}

impl Topic {
    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Communication => "communication",
            Self::Power => "power",
            Self::Mode => "mode",
            Self::SetPoint => "set-point",
            Self::Load => "load",
            Self::Pdo => "pdo",
        }
    }
}

/// What a finding weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// With this the drive does not move.
    Cause,
    /// It may move with this, and somebody will wonder sooner or later.
    Warning,
}

impl Weight {
    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cause => "cause",
            Self::Warning => "warning",
        }
    }
}

/// Something that is not as a moving drive has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its rule, for programs: `target_zero`.
    pub rule: &'static str,
    /// What it is about.
    pub topic: Topic,
    /// What it weighs.
    pub weight: Weight,
    /// What a moving drive has.
    pub expected: String,
    /// What this one has.
    pub found: String,
    /// What comes of it.
    pub follows: String,
    /// What to do.
    pub remedy: String,
}

/// What became of looking at a drive.
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
const RULES: [Rule; 6] = [communication::look, power::look, mode::look, set_point::look, load::look, pdos::look];

impl Drive {
    /// Looks for what keeps this drive from moving and its PDOs from being exchanged. Reads some thirty objects and writes
    /// none; `heard` is what others sent in the time before.
    pub async fn explain(&self, heard: &Overheard) -> Explained {
        let seen = Observed::of(self, heard).await;
        seen.explained()
    }
}

impl Observed {
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

/// A finding that keeps the drive from moving.
fn cause(topic: Topic, rule: &'static str, [expected, found, follows, remedy]: [String; 4]) -> Finding {
    Finding { rule, topic, weight: Weight::Cause, expected, found, follows, remedy }
}

/// A finding that does not.
fn warning(topic: Topic, rule: &'static str, texts: [String; 4]) -> Finding {
    Finding { weight: Weight::Warning, ..cause(topic, rule, texts) }
}

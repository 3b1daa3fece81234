//! What a scenario is made of: steps, hosts and their lines, expectations, figures.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use canopen::NodeId;
use host::group_follow::RecordedPath;
use master::parameters::Parameters;
use sim::recorder::Signal;
use sim::stimulus::{BodyStimulus, WireFault};
use sim::{Place, Stimulus};

use super::command::Command;
use super::condition::Condition;
use words::document::Located;

/// What the outer world does.
#[derive(Clone, Debug)]
pub(super) struct ScenarioStep {
    pub(super) name: Option<String>,
    pub(super) base: Base,
    pub(super) when: Option<Wait>,
    pub(super) within: Option<Duration>,
    pub(super) delay: Duration,
    pub(super) acts: Vec<Act>,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// What a step waits for.
#[derive(Clone, Debug)]
pub(super) struct Wait {
    pub(super) condition: Condition,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// From when on something counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Base {
    /// A time of the run.
    At(Duration),
    /// When the step or host of this name is done.
    After(String, Located),
}

/// One thing that the outer world does.
#[derive(Clone, Debug)]
pub(super) enum Act {
    World(Place, Stimulus),
    Wire(WireFault),
    /// At the machine of this name, which drives move together.
    Body(String, BodyStimulus),
    /// The host's cable: cut is true.
    HostCable(bool),
    /// The host is gone for good, in the middle of what it does.
    HostDies,
}

/// A script of the master.
#[derive(Clone, Debug)]
pub(super) struct Host {
    pub(super) name: String,
    /// `None`: when the drives have booted.
    pub(super) start: Option<Duration>,
    pub(super) lines: Vec<HostLine>,
}

/// One line of it.
#[derive(Clone, Debug)]
pub(super) struct HostLine {
    pub(super) command: Command,
    pub(super) name: Option<String>,
    pub(super) wanted: WantedResult,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// Parameters as they were read for a node: of a file, or without one of the machine file.
pub(super) type Sheets = BTreeMap<(NodeId, Option<PathBuf>), Parameters>;

/// Recorded paths by the names that lines give them.
pub(super) type Paths = BTreeMap<PathBuf, RecordedPath>;

/// What is to come of a line.
#[derive(Clone, Debug, Default)]
pub(super) struct WantedResult {
    /// It fails, and the reason has this in it.
    pub(super) fails: Option<String>,
    /// A number that is read.
    pub(super) value: Option<f64>,
    pub(super) tolerance: f64,
    pub(super) within: Option<Duration>,
}

/// What is expected.
#[derive(Clone, Debug)]
pub(super) struct Expect {
    pub(super) name: String,
    pub(super) law: Law,
    pub(super) condition: Condition,
    pub(super) from: Base,
    pub(super) until: Until,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// How often it has to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Law {
    /// At least once.
    Once,
    /// All the time.
    Always,
    /// At no time.
    Never,
}

/// How long it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Until {
    /// To the end of the run.
    End,
    /// To a time of the run.
    At(Duration),
    /// So long from its beginning.
    Within(Duration),
}

/// A number that a run reports.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlannedFigure {
    pub(super) name: String,
    pub(super) of: Measure,
    pub(super) place: Located,
}

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Measure {
    Signal(Statistic, Place, Signal),
    /// Of a body that drives move: its name, and that of the number.
    Body(Statistic, String, String),
    /// When the step or host of this name is done, in s.
    Time(String),
}

/// What is made of the values of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Statistic {
    Min,
    Max,
    Mean,
    /// The largest magnitude.
    Peak,
    Last,
}

//! The boot-up of a network (CiA 302-2): by what it goes, and what each step expected and found.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use canopen::{Mux, NodeId};
use devices::Description;
use eds::{Eds, Value};
use master::Network;
use master::boot::{self, Assignment, BootPlan, ErrorStatus, Expectation, Startup, Step, Unconfigured, Verdict};
use serde::Serialize;

use super::read_machine;
use machine::file::Machine;
use words::data_sheet;
use words::document::read_bytes;
use words::failure::Failure;
use words::node::node;

/// What came of a boot-up.
#[derive(Debug, Serialize)]
pub struct BootReport {
    /// Every mandatory node has booted, and has what is planned for it.
    pub ok: bool,
    /// A row each.
    pub nodes: Vec<BootedNode>,
    /// What else is to be known.
    pub notes: Vec<String>,
}

/// What came of one node.
#[derive(Debug, Serialize)]
pub struct BootedNode {
    /// Its node-ID.
    pub node: u8,
    /// What it was taken for.
    pub model: Option<&'static str>,
    /// The network does not start without it (1F81h bit 3).
    pub mandatory: bool,
    /// The standard's error status (CiA 302-2), A to O; `null` for none.
    pub letter: Option<char>,
    /// What it means.
    pub meaning: Option<&'static str>,
    /// The NMT state in which it was left.
    pub state: Option<String>,
    /// Objects of its configuration that have another value, of a node that was operational and was left as it is.
    pub unconfigured: Vec<String>,
    /// What was done, in its order.
    pub steps: Vec<BootStep>,
}

/// One step of the boot-up of a node.
#[derive(Debug, Serialize)]
pub struct BootStep {
    /// Its name, such as `identity`.
    pub step: &'static str,
    /// The object that it is about.
    pub object: Option<String>,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub found: String,
    /// `passed`, `noted`, `left` or `failed`.
    pub verdict: &'static str,
    /// What to do.
    pub next: Option<&'static str>,
}

impl BootReport {
    /// What came of the boot-up of a plan.
    pub fn new(plan: &BootPlan, report: &boot::BootReport, unconfigured: &[Unconfigured]) -> Self {
        let of_node = |node: NodeId| unconfigured.iter().filter(move |it| it.node == node).flat_map(|it| &it.objects);
        let nodes = report.nodes.iter().map(|node| BootedNode {
            node: node.node.raw(),
            model: plan.nodes.get(&node.node).and_then(|expected| expected.description).map(|model| model.name),
            mandatory: node.mandatory,
            letter: node.status.map(ErrorStatus::letter),
            meaning: node.status.map(ErrorStatus::meaning),
            state: node.state.map(|state| state.to_string()),
            unconfigured: of_node(node.node).map(ToString::to_string).collect(),
            steps: node.steps.iter().map(BootStep::new).collect(),
        });
        Self { ok: report.is_whole() && unconfigured.is_empty(), nodes: nodes.collect(), notes: report.notes.clone() }
    }

    /// Why a network that was to be booted is not, if it is not: a mandatory node has failed, or one does not have what is planned for
    /// it.
    pub fn failure(&self) -> Option<Failure> {
        let unconfigured = self.nodes.iter().find(|node| !node.unconfigured.is_empty());
        match (self.ok, unconfigured) {
            (true, _) => None,
            (false, Some(node)) => {
                let failure = Failure::new("a node is not configured as the file says").of_kind("not_configured");
                let objects = node.unconfigured.join(", ");
                let failure = failure.because(format!("node {}: {objects} has another value than the file", node.node));
                Some(failure.next("reset it: a motor that turns may stop at once, or go on").about(node.node))
            }
            (false, None) => Some(self.not_booted()),
        }
    }
}

impl BootReport {
    /// Which nodes have failed, at which step.
    fn not_booted(&self) -> Failure {
        let failure = Failure::new("a mandatory node has not booted").of_kind("not_booted");
        let failed = self.nodes.iter().filter(|node| node.mandatory).flat_map(|node| {
            let failed = node.steps.iter().filter(|step| step.verdict == "failed");
            failed.map(move |step| (node.node, step))
        });
        let first = failed.clone().next().map(|(node, _)| node);
        let failure = failed.fold(failure, |failure, (node, step)| {
            let because = format!("node {node}: {}: expected {}, got {}", step.step, step.expected, step.found);
            step.next.into_iter().fold(failure.because(because), Failure::next)
        });
        first.into_iter().fold(failure, Failure::about)
    }
}

impl BootStep {
    fn new(step: &Step) -> Self {
        Self {
            step: step.kind.name(),
            object: step.object.map(|object| object.to_string()),
            expected: step.expected.to_string(),
            found: step.found.to_string(),
            verdict: match step.verdict {
                Verdict::Passed => "passed",
                Verdict::Noted => "noted",
                Verdict::LeftOperational => "left",
                Verdict::Failed(_) => "failed",
            },
            next: step.advice(),
        }
    }
}

/// Which nodes are booted, and how far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BootOptions {
    /// These alone; all of the plan if there are none.
    pub nodes: Vec<NodeId>,
    /// Nodes that are operational too: a motor that turns may stop at once, or go on.
    pub reset: bool,
    /// They are left pre-operational.
    pub no_start: bool,
}

/// How long a network is given after its boot-up before its configuration is read.
const SETTLING: Duration = Duration::from_millis(50);

impl FromStr for BootOptions {
    type Err = String;

    /// What stands behind `boot` in a line of a scenario: its [form](BootOptions::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let mut options = Self::default();
        words::line::take(Self::FORM, text.split_whitespace(), |word, value| {
            match word {
                "node" => options.nodes.push(node(value()?)?),
                "reset" => options.reset = true,
                "no-start" => options.no_start = true,
                _ => return Ok(false),
            }
            Ok(true)
        })?;
        Ok(options)
    }
}

impl BootOptions {
    /// It as a line of a host has it.
    pub const FORM: &str = "boot [node NODE].. [reset] [no-start]";

    /// Boots the nodes of a plan, and reads of those that were left as they are whether they have what is planned. No drive is armed to
    /// stop without this master: that is for the program that moves it.
    pub async fn boot(&self, network: &Network, plan: &mut BootPlan) -> BootReport {
        plan.guard = false;
        if self.reset {
            for expectation in plan.nodes.values_mut() {
                expectation.assignment = expectation.assignment.without(Assignment::KEEP_ALIVE);
            }
        }
        if self.no_start {
            plan.startup.0 |= Startup::STARTS_NONE;
        }
        let report = network.boot(plan).await;
        network.sleep(SETTLING).await;
        let unconfigured = network.unconfigured(plan, &report).await;
        BootReport::new(plan, &report, &unconfigured)
    }
}

/// A file, as far as it can be read without the bus.
pub enum Planned {
    /// A machine file.
    Machine(PathBuf, Box<Machine>),
    /// A manager's dictionary: the values that its DCF gives, as SDO carries them.
    Manager(BTreeMap<Mux, Vec<u8>>),
    /// None: what the command line and the bus say.
    Bus,
}

/// The longest configuration of one node that is read from a file: far more than any dictionary has.
const LONGEST_CONFIGURATION: u64 = 1 << 20;

impl Planned {
    /// Reads a file, by its ending; without one the bus is asked.
    ///
    /// # Errors
    /// It is neither, or makes no sense.
    pub fn read(file: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = file else { return Ok(Self::Bus) };
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("toml") => Ok(Self::Machine(path.to_owned(), Box::new(read_machine(path)?))),
            Some("dcf" | "eds") => Ok(Self::Manager(values(path)?)),
            _ => Err(Failure::usage(format!("cannot tell what kind of file {} is", path.display()))
                .next("expected a machine file, FILE.toml, or the DCF of a CANopen manager, FILE.dcf")),
        }
    }

    /// The plan, for these nodes alone if there are any.
    ///
    /// `known` are the models of nodes that need not be found out, `timeout` is how long an answer is waited for, `asked` hears how many
    /// of the 127 node-IDs have been asked where nothing says who is there.
    ///
    /// # Errors
    /// The file names no slave, or not one of `only`; no node is on the bus.
    pub async fn plan(
        &self,
        network: &Network,
        known: &BTreeMap<NodeId, &'static Description>,
        timeout: Duration,
        only: &[NodeId],
        asked: impl FnMut(usize),
    ) -> Result<BootPlan, Failure> {
        let mut plan = match self {
            Self::Machine(_, machine) => {
                let chosen = |(node, model)| {
                    let expectation = Expectation::of(known.get(&node).copied().unwrap_or(model));
                    (node, Expectation { configuration: machine.configuration(node), ..expectation })
                };
                BootPlan::new(machine.models().map(chosen))
            }
            Self::Manager(values) => {
                let plan = BootPlan::from_objects(|object| values.get(&object).cloned());
                let mut plan = plan.map_err(|bad| {
                    let failure = Failure::bad_file(bad.to_string());
                    match bad.node() {
                        Some(node) => failure.at_node(node).next("write that concise DCF again, as a whole"),
                        None => failure.next("give the DCF of the CANopen manager, with bit 0 of its 1F80h set"),
                    }
                })?;
                for (node, expectation) in &mut plan.nodes {
                    expectation.description = known.get(node).copied();
                }
                plan
            }
            Self::Bus => BootPlan::new(found(network, known, timeout, only, asked).await),
        };
        plan.timeout = plan.timeout.min(timeout);
        if let Some(stranger) = only.iter().find(|node| !plan.nodes.contains_key(node)) {
            let named = plan.nodes.keys().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            let named = if named.is_empty() { "none".to_owned() } else { named };
            return Err(Failure::bad_file(format!("node {stranger} is to be booted, and the file does not have it"))
                .at_node(*stranger)
                .next(format!("its nodes: {named}")));
        }
        plan.nodes.retain(|node, _| only.is_empty() || only.contains(node));
        if plan.nodes.is_empty() {
            return Err(match self {
                Self::Manager(_) => Failure::bad_file("the file has no slave: 1F81h marks no node as one")
                    .next("give the DCF of the CANopen manager, not that of a device"),
                _ => Failure::new("no node answers on the bus").of_kind("no_node").next("ferrodrive scan shows more"),
            });
        }
        Ok(plan)
    }
}

/// Who is to be booted where a file does not name them: the nodes that are asked for, those of known models, else those that answer.
async fn found(
    network: &Network,
    known: &BTreeMap<NodeId, &'static Description>,
    timeout: Duration,
    only: &[NodeId],
    asked: impl FnMut(usize),
) -> Vec<(NodeId, Expectation)> {
    let expected = |node: NodeId| known.get(&node).copied().map_or_else(Expectation::of_unknown, Expectation::of);
    if !only.is_empty() {
        return only.iter().map(|node| (*node, expected(*node))).collect();
    }
    if !known.is_empty() {
        return known.iter().map(|(node, model)| (*node, Expectation::of(model))).collect();
    }
    let found = network.scan(timeout, asked).await;
    let expected = found.iter().map(|found| {
        let model = found.knowledge.description();
        (found.node, model.map_or_else(Expectation::of_unknown, Expectation::of))
    });
    expected.collect()
}

/// The values of a manager's DCF. A DOMAIN is in a file of its own, beside it (`DownloadFile`, CiA 306-1).
fn values(path: &Path) -> Result<BTreeMap<Mux, Vec<u8>>, Failure> {
    let eds = data_sheet::reading(path).map_err(|unread| unread.failure(path))?.eds;
    let own = eds.commissioning.as_ref().and_then(|own| own.node_id).unwrap_or(NodeId::MAX.raw());
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut values = BTreeMap::new();
    for (index, variable) in eds.variables() {
        let object = Mux::new(index, variable.sub_index);
        if !variable.download_file.is_empty() {
            values.insert(object, configuration(&folder.join(&variable.download_file), object)?);
            continue;
        }
        if let Some(Value::Number(number)) = variable.value_or_default() {
            // A number of up to 64 bits, in two's complement: SDO carries its lowest bytes.
            values.insert(object, (number.at_node(own) as u64).to_le_bytes().to_vec());
        }
    }
    check(path, &eds)?;
    Ok(values)
}

/// A device's file in place of the manager's is a mistake that would boot nothing.
fn check(path: &Path, eds: &Eds) -> Result<(), Failure> {
    if eds.object(0x1F81).is_some() {
        return Ok(());
    }
    Err(Failure::bad_file(format!("{} has no 1F81h: it is not the file of a CANopen manager", path.display()))
        .next("give the DCF of the manager, which lists its slaves there (CiA 302-2), or a machine file"))
}

fn configuration(path: &Path, object: Mux) -> Result<Vec<u8>, Failure> {
    let unreadable = |why: String| {
        Failure::bad_file(format!("cannot read {}, which {object} names", path.display()))
            .because(why)
            .next("it is looked for beside the DCF; is it there?")
    };
    read_bytes(path, LONGEST_CONFIGURATION).map_err(unreadable)
}

//! What a boot-up goes by: a machine file, the DCF of a CANopen manager, or what is on the bus.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use canopen::{Mux, NodeId};
use eds::{Eds, Value};
use master::boot::{BootPlan, Expectation};
use testbench::machine_file::Machine;

use crate::command::cycles::refuse_too_full_cycles;
use crate::command::eds::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::session;

/// A file, as far as it can be read without the bus.
pub(crate) enum Planned {
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
    pub(crate) fn read(file: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = file else { return Ok(Self::Bus) };
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("toml") => Ok(Self::Machine(path.to_owned(), Box::new(session::read_machine(path)?))),
            Some("dcf" | "eds") => Ok(Self::Manager(values(path)?)),
            _ => Err(Failure::usage(format!("what kind of file is {}?", path.display()))
                .next("expected a machine file, FILE.toml, or the DCF of a CANopen manager, FILE.dcf")),
        }
    }

    /// The command line with what the file says: on the virtual bus of a command's own, its drives are there.
    pub(crate) fn global(&self, global: &Global) -> Global {
        match self {
            Self::Machine(path, machine) => global.on_machine(path, machine),
            Self::Manager(_) | Self::Bus => global.clone(),
        }
    }

    /// The plan, for these nodes alone if there are any. A machine whose cycles its bus cannot carry is refused before.
    pub(crate) async fn plan(&self, context: &Context, only: &[NodeId]) -> Result<BootPlan, Failure> {
        let mut plan = match self {
            Self::Machine(_, machine) => {
                if only.is_empty() {
                    refuse_too_full_cycles(context, machine).await?;
                }
                let chosen = |(node, model)| {
                    let expectation = Expectation::of(context.told_model(node).unwrap_or(model));
                    (node, Expectation { configuration: machine.configuration(node), ..expectation })
                };
                BootPlan::new(machine.models().map(chosen))
            }
            Self::Manager(values) => {
                let plan = BootPlan::from_objects(|object| values.get(&object).cloned());
                let mut plan = plan.map_err(|bad| match (Failure::usage(bad.to_string()), bad.node()) {
                    (failure, Some(node)) => failure.at_node(node),
                    (failure, None) => failure,
                })?;
                for (node, expectation) in &mut plan.nodes {
                    expectation.description = context.told_model(*node);
                }
                plan
            }
            Self::Bus => BootPlan::new(found(context, only).await),
        };
        plan.timeout = plan.timeout.min(context.timeout());
        if let Some(stranger) = only.iter().find(|node| !plan.nodes.contains_key(node)) {
            let named = plan.nodes.keys().map(ToString::to_string).collect::<Vec<_>>().join(", ");
            let named = if named.is_empty() { "none".to_owned() } else { named };
            return Err(Failure::usage(format!("--node names node {stranger}, which the file does not have"))
                .at_node(*stranger)
                .next(format!("its nodes: {named}")));
        }
        plan.nodes.retain(|node, _| only.is_empty() || only.contains(node));
        if plan.nodes.is_empty() {
            return Err(match self {
                Self::Manager(_) => Failure::usage("the file has no slave: 1F81h says of no node that it is one")
                    .next("give the DCF of the CANopen manager, not that of a device"),
                _ => Failure::new("nobody is on the bus").of_kind("nobody").next("ferrodrive scan says more"),
            });
        }
        Ok(plan)
    }
}

/// Who is to be booted where no file says it: whom the command line names, what was told of the machine, else who answers.
async fn found(context: &Context, only: &[NodeId]) -> Vec<(NodeId, Expectation)> {
    let told = |node: NodeId| context.told_model(node).map_or_else(Expectation::of_unknown, Expectation::of);
    if !only.is_empty() {
        return only.iter().map(|node| (*node, told(*node))).collect();
    }
    let told_nodes: Vec<_> = NodeId::all().filter(|node| context.told_model(*node).is_some()).collect();
    if !told_nodes.is_empty() {
        return told_nodes.into_iter().map(|node| (node, told(node))).collect();
    }
    let asked = |count| context.progress.count(format!("asked {count} of 127"));
    let found = context.network.scan(context.timeout(), asked).await;
    let expected = found.iter().map(|found| {
        let model = found.knowledge.description();
        (found.node, model.map_or_else(Expectation::of_unknown, Expectation::of))
    });
    expected.collect()
}

/// The values of a manager's DCF. A DOMAIN is in a file of its own, beside it (`DownloadFile`, CiA 306-1).
fn values(path: &Path) -> Result<BTreeMap<Mux, Vec<u8>>, Failure> {
    let eds = source::reading(path)?.eds;
    let own = eds.commissioning.as_ref().and_then(|own| own.node_id).unwrap_or(NodeId::MAX.raw());
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut values = BTreeMap::new();
    for (index, variable) in eds.variables() {
        let object = Mux::new(index, variable.sub_index);
        if !variable.download_file.is_empty() {
            values.insert(object, configuration(&folder.join(&variable.download_file), object)?);
            continue;
        }
        if let Some(Value::Number(number)) = variable.value.as_ref().or(variable.default.as_ref()) {
            // A number of up to 64 bits, in two's complement: SDO carries its lowest bytes.
            values.insert(object, (number.at_node(own) as u64).to_le_bytes().to_vec());
        }
    }
    check(path, &eds)?;
    Ok(values)
}

/// A device's file in place of the manager's is a mistake that would boot nobody.
fn check(path: &Path, eds: &Eds) -> Result<(), Failure> {
    if eds.object(0x1F81).is_some() {
        return Ok(());
    }
    Err(Failure::usage(format!("{} has no 1F81h: it is not the file of a CANopen manager", path.display()))
        .next("give the DCF of the manager, which lists its slaves there (CiA 302-2), or a machine file"))
}

fn configuration(path: &Path, object: Mux) -> Result<Vec<u8>, Failure> {
    let unreadable = |why: String| {
        Failure::usage(format!("cannot read {}, which {object} names", path.display()))
            .because(why)
            .next("it is looked for beside the DCF; is it there?")
    };
    let size = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
    if size > LONGEST_CONFIGURATION {
        return Err(unreadable(format!("{size} bytes are more than any configuration has")));
    }
    std::fs::read(path).map_err(|error| unreadable(error.to_string()))
}

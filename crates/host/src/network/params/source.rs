//! Where parameters come from, and why a set of them is refused before anything is written.

use std::path::Path;

use canopen::NodeId;
use devices::Description;
use master::parameters::{Deviation, Parameters, PlanError, Unfit};

use machine::file::Machine;
use machine::parameters::Unread;
use words::counted;
use words::failure::Failure;

/// The source of parameters that no file of their own has.
pub const MACHINE_FILE: &str = "the machine file";

/// Reads a file for a node. What the file has of another node of the same model follows this one's node-ID.
///
/// # Errors
/// It cannot be read as parameters.
pub fn read(path: &Path, model: Option<&'static Description>, node: Option<NodeId>) -> Result<Parameters, Failure> {
    let unreadable = |unread| {
        let what = format!("cannot read {} as parameters", path.display());
        let (failure, reason) = match unread {
            Unread::Name(reason) => (Failure::usage(what), reason),
            Unread::File(reason) => (Failure::bad_file(what), reason),
            Unread::Content(reason) => (Failure::new(what).of_kind("bad_parameters"), reason),
        };
        failure
            .because(reason)
            .next("nothing was written; correct the file, or make one: ferrodrive params backup NODE -o FILE.toml")
    };
    let reader = node.unwrap_or(NodeId::MIN);
    let parameters = machine::parameters::read(path, model, reader).map_err(unreadable)?;
    Ok(match node {
        Some(node) => parameters.for_node(node, model),
        None => parameters,
    })
}

/// What a node is to have by a machine file.
///
/// # Errors
/// The file has nothing for it.
pub fn of_machine(machine: &Machine, node: NodeId) -> Result<(Parameters, String), Failure> {
    let found = machine.parameters(node).filter(|parameters| !parameters.values.is_empty());
    let found = found.ok_or_else(|| {
        Failure::bad_file(format!("the machine file has no settings for node {node}"))
            .next("give its [[drive]] pdos, limits, heartbeat or start_up (docs/machine-file.md), or name a file of parameters")
    })?;
    Ok((found, MACHINE_FILE.to_owned()))
}

/// How many values that a node cannot have are named.
const SHOWN: usize = 10;

/// A refusal before anything was written.
pub fn refused(error: PlanError) -> Failure {
    match error {
        PlanError::Node(error) => error.into(),
        PlanError::OtherDevice { node, wanted, found } => Failure::new(format!(
            "node {node} is not the device that these parameters are for; nothing was written"
        ))
        .of_kind("other_device")
        .at_node(node)
        .because(format!("the file is for {wanted}"))
        .because(format!("the node reports {found}"))
        .next(format!(
            "ferrodrive scan shows which device is there; if the drive was replaced by another model, it needs parameters of \
                     its own: ferrodrive params backup {node}"
        )),
        PlanError::AtWork { node, axis, state } => Failure::new(format!(
            "axis {} of node {node} is in {}: parameters are written to a drive at rest only; nothing was written",
            axis.0 + 1,
            state.name()
        ))
        .of_kind("at_work")
        .at_node(node)
        .next(format!("ferrodrive disable {node}, if that may stop what it holds or drives")),
        PlanError::Unfit { node, unfit } => {
            let objects = counted(unfit.len(), "value");
            let failure = Failure::new(format!("node {node} cannot have {objects} of the file; nothing was written"));
            let failure = failure.of_kind("unfit_parameters").at_node(node);
            let first = unfit.first().map(Unfit::object);
            let failure = unfit.iter().take(SHOWN).fold(failure, |failure, unfit| failure.because(unfit));
            let failure = match unfit.len().saturating_sub(SHOWN) {
                0 => failure.next("correct these values, or take them out of the file"),
                more => failure
                    .because(format!("and {more} more"))
                    .next("check whether the file is that of another model; if it is not, correct these values"),
            };
            match first {
                Some(object) => failure.at_object(object),
                None => failure,
            }
        }
    }
}

/// What an object has in place of its value, in words.
pub fn found(deviation: &Deviation) -> Result<&[u8], String> {
    deviation.found.as_deref().map_err(|error| match error.abort() {
        Some(code) => format!("refused: {code}"),
        None => error.to_string(),
    })
}

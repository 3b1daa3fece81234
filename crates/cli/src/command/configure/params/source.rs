//! Where parameters come from on the command line.

use devices::Description;
use host::network::params::source::{of_machine, read};
use master::parameters::Parameters;

use crate::context::Context;
use crate::failure::Failure;

/// The requested parameters of a node, and their source: the named file, or the machine file.
pub(super) fn wanted(
    context: &Context,
    wanted: &super::NodeAndFile,
    model: Option<&'static Description>,
) -> Result<(Parameters, String), Failure> {
    if let Some(path) = &wanted.file {
        return Ok((read(path, model, Some(wanted.node))?, path.display().to_string()));
    }
    let Some(machine) = &context.machine else {
        return Err(Failure::usage("expected a file of parameters")
            .next("give its path, or a machine file with --machine FILE.toml"));
    };
    Ok(of_machine(machine, wanted.node)?)
}

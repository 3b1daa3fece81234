//! What a boot-up goes by, on the command line.

use std::path::Path;

use canopen::NodeId;
pub(crate) use host::network::boot::Planned;
use master::boot::BootPlan;

use crate::command::cycles::refuse_too_full_cycles;
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;

/// The file of the command, otherwise that of `--machine`.
pub(crate) fn planned_by(file: Option<&Path>, global: &Global) -> Result<Planned, Failure> {
    let by_option = || global.machine_file.as_ref().map(|file| file.path.as_path());
    Ok(Planned::read(file.or_else(by_option))?)
}

/// The command line with what the file says: on the virtual bus of a command's own, its drives are there.
pub(crate) fn global_of(planned: &Planned, global: &Global) -> Result<Global, Failure> {
    match planned {
        Planned::Machine(path, machine) => global.on_machine(path, machine),
        Planned::Manager(_) | Planned::Bus => Ok(global.clone()),
    }
}

/// Shows that the nodes of a plan are booted, with a note where that may not end by itself.
pub(crate) fn announce(context: &Context, plan: &BootPlan) {
    if plan.boot_time.is_none() {
        context.note("1F89h is 0: mandatory nodes are waited for without limit; Ctrl-C ends that");
    }
    context.progress.show(format!("booting {} nodes", plan.nodes.len()));
}

/// The plan, for these nodes alone if there are any. A machine whose cycles its bus cannot carry is refused before.
pub(crate) async fn plan_of(planned: &Planned, context: &Context, only: &[NodeId]) -> Result<BootPlan, Failure> {
    if let Planned::Machine(_, machine) = planned
        && only.is_empty()
    {
        refuse_too_full_cycles(context, machine).await?;
    }
    let asked = |count| context.progress.count(format!("asked {count} of 127"));
    Ok(planned.plan(&context.network, &context.stated_models(), context.timeout(), only, asked).await?)
}

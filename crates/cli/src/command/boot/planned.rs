//! What a boot-up goes by, on the command line.

use canopen::NodeId;
use master::boot::BootPlan;
pub(crate) use testbench::network::boot::Planned;

use crate::command::cycles::refuse_too_full_cycles;
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;

/// The command line with what the file says: on the virtual bus of a command's own, its drives are there.
pub(crate) fn global_of(planned: &Planned, global: &Global) -> Global {
    match planned {
        Planned::Machine(path, machine) => global.on_machine(path, machine),
        Planned::Manager(_) | Planned::Bus => global.clone(),
    }
}

/// The plan, for these nodes alone if there are any. A machine whose cycles its bus cannot carry is refused before.
pub(crate) async fn plan_of(planned: &Planned, context: &Context, only: &[NodeId]) -> Result<BootPlan, Failure> {
    if let Planned::Machine(_, machine) = planned
        && only.is_empty()
    {
        refuse_too_full_cycles(context, machine).await?;
    }
    let asked = |count| context.progress.count(format!("asked {count} of 127"));
    Ok(planned.plan(&context.network, &context.told_models(), context.timeout(), only, asked).await?)
}

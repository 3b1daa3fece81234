//! What commands that move drives cycle by cycle have in common: how late a host may be, whether the bus carries the cycle, and
//! what to do where the host was late.

use machine::file::{CyclePlan, Machine, TOLERANCE, TooFull};
use master::Drive;
use master::core::CycleLoss;
use master::cyclic::{CyclicOptions, Refusal};
use master::plan::NodeTraffic;

use super::look::studio::bitrate;
use crate::context::Context;
use crate::failure::Failure;
use console::numbers::whole;

/// The most cycles that `--tolerance` takes.
const MOST_TOLERANCE: u32 = 100;

/// How late a host may be.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct CycleArgs {
    /// Consecutive cycles that this command, or a TPDO of a drive, may miss before all drives are stopped
    #[arg(long, value_name = "CYCLES", default_value_t = TOLERANCE, value_parser = |text: &str| whole(text, 0..=MOST_TOLERANCE))]
    tolerance: u32,
}

impl CycleArgs {
    /// Drives that are guarded already, as the command line has it.
    pub(super) const fn options(self) -> CyclicOptions {
        CyclicOptions { guard: None, tolerance: self.tolerance }
    }

    /// A failure by what a drive says, with what helps where this command was late, or the TPDOs of the drive.
    pub(super) fn advised(self, failure: Failure, refusal: Refusal) -> Failure {
        let late = match refusal {
            Refusal::Stopped(CycleLoss::ProgramLate(_)) => "other programs delayed the cycles of this one",
            Refusal::Stopped(CycleLoss::Silent(_)) => {
                "the drive is off, or its TPDOs were late: on the bus, in the adapter, or in this host while other programs delayed it"
            }
            _ => return failure,
        };
        let more = (self.tolerance.max(1) * 5).min(MOST_TOLERANCE);
        let allow = match more > self.tolerance {
            true => format!("--tolerance {more} to allow more of them that miss one, "),
            false => String::new(),
        };
        failure.next(format!(
            "{late}: give {allow}--realtime (Linux) to run before other programs, or a longer \
             period; `ferrodrive latency` measures how late this host is"
        ))
    }
}

/// Refuses a cycle that does not fit the bus, before anything is written. Without a known bit rate nothing is refused.
pub(super) async fn refuse_too_full(context: &Context, cycle: &CyclePlan, drives: &[&Drive]) -> Result<(), Failure> {
    let full = too_full(context, cycle, drives, |read| read).await?;
    full.map_or(Ok(()), |full| Err(refusal(cycle, full.what, full.next)))
}

/// The same for the cycles of a machine file, once its drives are configured as it says: a boot-up is refused first.
/// A drive that cannot be asked is the boot-up's business.
pub(super) async fn refuse_too_full_cycles(context: &Context, machine: &Machine) -> Result<(), Failure> {
    for cycle in machine.cycles() {
        let drives: Vec<_> = cycle.nodes.iter().map(|(node, _)| machine.drive(context.node(*node))).collect();
        let drives: Vec<_> = drives.iter().collect();
        if let Ok(Some(full)) = too_full(context, &cycle, &drives, |read| machine.set_up(read)).await {
            return Err(refusal(&cycle, format!("{}: {}", cycle.what, full.what), full.next));
        }
    }
    Ok(())
}

async fn too_full(
    context: &Context,
    cycle: &CyclePlan,
    drives: &[&Drive],
    set_up: impl Fn(NodeTraffic) -> NodeTraffic,
) -> Result<Option<TooFull>, Failure> {
    let Some(bitrate) = bitrate(context) else { return Ok(None) };
    Ok(cycle.too_full(drives, bitrate, set_up).await?)
}

fn refusal(cycle: &CyclePlan, what: String, next: String) -> Failure {
    let shown = format!("ferrodrive plan --cycle {}us shows each frame", cycle.period.as_micros());
    Failure::new(what).of_kind("bus_load").next(next).next(shown)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_busy_host_is_shown_which_options_help_also_where_the_frames_of_a_drive_are_late() {
        let advised = |tolerance, loss| {
            CycleArgs { tolerance }.advised(Failure::new("axis 1 stopped"), Refusal::Stopped(loss)).next.join("; ")
        };
        for (tolerance, more) in [(2, "--tolerance 10 "), (0, "--tolerance 5 "), (20, "--tolerance 100 ")] {
            for loss in [CycleLoss::ProgramLate(6), CycleLoss::Silent(6)] {
                let next = advised(tolerance, loss);
                for part in [more, "--realtime", "a longer period", "`ferrodrive latency`", "delayed"] {
                    assert!(next.contains(part), "{tolerance}: {part:?} in {next:?}");
                }
            }
        }
        assert_eq!(advised(2, CycleLoss::NoSync(Duration::from_millis(20))), "");
    }

    /// What is advised is taken: the option ends at 100 cycles.
    #[test]
    fn the_tolerance_that_is_advised_is_one_that_the_option_takes() {
        let next =
            CycleArgs { tolerance: 100 }.advised(Failure::new("late"), Refusal::Stopped(CycleLoss::ProgramLate(101)));
        let advice = next.next.join("; ");
        assert!(!advice.contains("--tolerance 500"), "{advice}");
    }
}

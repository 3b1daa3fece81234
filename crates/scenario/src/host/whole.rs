//! What a host does with several drives at once or with all that a node has: groups, the base, the boot-up, parameters.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use canopen::NodeId;
use host::group_follow::FollowLine;
use host::network::boot::{BootOptions, BootReport, Planned};
use host::network::params::{ApplyReport, LeftOut, Transaction, VerifyReport, source, verify_node};
use machine::base_drive::{self, BaseDrive, come_to_rest};
use machine::group_move::{self, GroupMove, GroupRun, PlannedMove};
use master::base::BaseError;
use master::cyclic::CyclicOptions;
use master::group::{Group, GroupError};
use master::units::Shown;
use words::counted;
use words::failure::Failure;

use super::{Done, HostTask};
use crate::command::ParametersCommand;

/// Longest wait for an answer of a boot-up, as the default of the command line.
const TIMEOUT: Duration = Duration::from_millis(500);

/// Objects with other values that a row names.
const SHOWN: usize = 3;

impl HostTask {
    /// Moves axes as one, as `ferrodrive group move` does; afterwards they have no power.
    pub(super) async fn move_group(&self, asked: &GroupMove) -> Done {
        let (nodes, plan) = asked.axes(Some(&self.machine)).map_err(|failure| failure.one_line())?;
        let drives = nodes.into_iter().map(|node| self.machine.drive(self.network.node(node))).collect();
        let planned = asked.plan(plan, drives).await.map_err(|error| error.to_string())?;
        let run = carry_out(&planned, asked.hold, async |group| planned.carry_out(group, |_, _| {}).await).await?;
        let (axes, time) = (planned.axes.len(), Shown(run.time.as_secs_f64()));
        Ok((format!("{axes} axes moved together in {time} s; largest lag {}", largest_lag(&run)), None))
    }

    /// Moves axes along a recorded path, as `ferrodrive group follow` does; afterwards they have no power.
    pub(super) async fn follow(&self, asked: &FollowLine) -> Done {
        // Read with the scenario.
        let path = self.paths.get(&asked.file).ok_or("this path was not read")?;
        let follow = asked.of(path.clone());
        let (nodes, plan) = follow.axes(Some(&self.machine)).map_err(|failure| failure.one_line())?;
        let drives = nodes.into_iter().map(|node| self.machine.drive(self.network.node(node))).collect();
        let planned = follow.plan(plan, drives).await.map_err(|failure| said(&failure))?;
        let moved = async |group: &mut Group| planned.carry_out(group, |_, _| {}).await;
        let run = carry_out(&planned.start, asked.options.hold, moved).await?;
        let (axes, time) = (planned.start.axes.len(), Shown(run.time.as_secs_f64()));
        Ok((format!("{axes} axes followed the path in {time} s; largest lag {}", largest_lag(&run)), None))
    }

    /// Drives the base of the machine by a twist, as `ferrodrive drive-base` does; afterwards its drives have no power.
    pub(super) async fn drive_base(&self, asked: &BaseDrive) -> Done {
        let network = &self.network;
        // The file has been asked for it.
        let plan = self.machine.base.ok_or("the machine has no [base]")?;
        let drives = plan.wheels.map(|(node, _)| self.machine.drive(network.node(node)));
        let wheels = base_drive::wheels(&plan, drives);
        let opened = base_drive::open(&plan, &wheels, plan.limits, CyclicOptions::default()).await;
        let mut base = opened.map_err(|error| error.to_string())?;
        let driven = async {
            base.enable().await?;
            asked.carry_out(&mut base, network, |_| {}).await?;
            come_to_rest(&mut base, network).await
        }
        .await;
        let reason = match &driven {
            Err(BaseError::Stopped(_) | BaseError::NotStopped { .. }) => base.explain_stop().await,
            _ => None,
        };
        let pose = base.state().pose;
        let closed = base.close().await;
        driven.map_err(|error| with_reason(&error, reason))?;
        closed.map_err(|error| error.to_string())?;
        let (x_m, y_m, heading_deg) = (pose.x_m, pose.y_m, pose.heading_rad.to_degrees());
        Ok((format!("it stands at x {x_m:.3} m, y {y_m:.3} m, heading {heading_deg:.1} deg, by its wheels"), None))
    }

    /// Boots the machine as `ferrodrive boot` does.
    pub(super) async fn boot(&self, options: &BootOptions) -> Done {
        let planned = Planned::Machine(PathBuf::new(), Box::new((*self.machine).clone()));
        let plan = planned.plan(&self.network, &BTreeMap::new(), TIMEOUT, &options.nodes, |_| ()).await;
        let report = options.boot(&self.network, &mut plan.map_err(|failure| said(&failure))?).await;
        report.failure().map_or_else(|| Ok((booted(&report), None)), |failure| Err(said(&failure)))
    }

    /// Writes or compares the parameters of a file, or those of the machine file, as `ferrodrive params` does.
    pub(super) async fn parameters(&self, node: NodeId, what: ParametersCommand, file: Option<&PathBuf>) -> Done {
        let drive = self.machine.drive(self.network.node(node));
        let named = file.map_or_else(|| source::MACHINE_FILE.to_owned(), |path| path.display().to_string());
        // Read with the scenario.
        let wanted = self.sheets.get(&(node, file.cloned())).ok_or("these parameters were not read")?;
        match what {
            ParametersCommand::Apply { save } => {
                let within = super::BOOT_PATIENCE;
                // The drives end with the run: nothing is left to go back to.
                let journal = None;
                let order = Transaction { address: false, save, prove: None, within, journal, on_kept: |_| () };
                if save {
                    drive.check_save().await.map_err(|error| error.to_string())?;
                }
                let applied = order.apply(&(), &drive, wanted, named).await;
                applied.map(|report| (applied_as(&report), None)).map_err(|failure| said(&failure))
            }
            ParametersCommand::Verify => {
                let report = verify_node(&drive, wanted, named).await.map_err(|failure| said(&failure))?;
                match report.failure() {
                    Some(failure) => Err(format!("{}: {}", failure.what, deviations(&report))),
                    None => Ok((format!("{} as in {}", counted(report.compared, "object"), report.file), None)),
                }
            }
        }
    }
}

/// Opens a group, has it moved and held, and takes its power.
async fn carry_out(
    planned: &PlannedMove,
    hold: Option<Duration>,
    moved: impl AsyncFnOnce(&mut Group) -> Result<GroupRun, GroupError>,
) -> Result<GroupRun, String> {
    let mut group = planned.open(CyclicOptions::default()).await.map_err(|error| error.to_string())?;
    let mut done = moved(&mut group).await;
    if let (Ok(_), Some(time)) = (&done, hold)
        && let Err(error) = group_move::hold(&mut group, |held| held >= time).await
    {
        done = Err(error);
    }
    let reason = match &done {
        Err(GroupError::Stopped(_)) => group.explain_stop().await,
        _ => None,
    };
    let closed = group.close().await;
    let run = done.map_err(|error| with_reason(&error, reason))?;
    closed.map_err(|error| error.to_string())?;
    Ok(run)
}

fn largest_lag(run: &GroupRun) -> String {
    format!("{} deg", Shown(run.largest_turns.iter().fold(0.0_f64, |largest, turns| largest.max(turns * 360.0))))
}

/// What has stopped several drives, with what one of them says of it.
fn with_reason(error: &dyn std::error::Error, reason: Option<master::Error>) -> String {
    reason.map_or_else(|| error.to_string(), |reason| format!("{error}: {reason}"))
}

/// A failure in one line, with its reasons.
pub(super) fn said(failure: &Failure) -> String {
    let parts: Vec<_> = std::iter::once(&failure.what).chain(&failure.because).map(String::as_str).collect();
    parts.join(": ")
}

fn booted(report: &BootReport) -> String {
    let (whole, others): (Vec<_>, Vec<_>) = report.nodes.iter().partition(|node| node.letter.is_none());
    let others = others.iter().map(|node| {
        let (letter, meaning) = (node.letter.unwrap_or_default(), node.meaning.unwrap_or_default());
        format!("node {}: {letter}: {meaning}", node.node)
    });
    let whole = (!whole.is_empty()).then(|| format!("{} booted", counted(whole.len(), "node")));
    whole.into_iter().chain(others).collect::<Vec<_>>().join("; ")
}

fn applied_as(report: &ApplyReport) -> String {
    let mut parts = vec![match report.writes {
        0 => format!("it has the values of {}: nothing was written", report.file),
        writes => format!("{} done and read back", counted(writes, "write")),
    }];
    parts.extend(report.rounded.iter().map(|it| format!("{} holds {}", it.object, it.found.text)));
    parts.extend(report.left.iter().map(LeftOut::text));
    parts.extend(report.notes.iter().cloned());
    parts.extend(report.saved.then(|| "stored".to_owned()));
    parts.join("; ")
}

/// The first objects that have another value.
fn deviations(report: &VerifyReport) -> String {
    let shown = report.deviations.iter().take(SHOWN).map(|it| {
        let found = it.found.as_ref().map(|found| found.text.as_str()).or(it.refused.as_deref());
        format!("{} is {}, not {}", it.object, found.unwrap_or_default(), it.wanted.text)
    });
    let more = report.deviations.len().saturating_sub(SHOWN);
    shown.chain((more > 0).then(|| format!("and {more} more"))).collect::<Vec<_>>().join("; ")
}

//! Groups and bases for Python: opened and enabled by one job, stepped in each cycle of SYNC by another one for as long as they are
//! there, so that the drives are kept while the program does something else, and sent where they are to go by further ones.

mod base;
mod group;

use can::Bitrate;
use machine::file::CyclePlan;
use master::drive::Drive;
use master::{Error, Network as Core};
use words::failure::Failure;

use super::job::Trouble;
use super::slot::{Slot, Stepped};
use super::value::Value;
use super::{Job, Network, duration};
use crate::failure::bad_value;

pub(crate) use base::Base;
pub(crate) use group::Group;

/// Why a group or a base does not move, with what the drive says that keeps it.
fn with_reason(error: impl Into<Failure>, reason: Option<Error>) -> Trouble {
    reason.into_iter().fold(error.into(), |failure, reason| failure.because(reason.to_string())).into()
}

/// Why a group or a base was not opened; `drive` is what a drive said, where that is why.
fn opening(what: &str, drive: Option<Error>, error: impl Into<Trouble>) -> Trouble {
    match drive {
        Some(silence @ Error::NoAnswer { .. }) => not_booted(what, silence.into()).into(),
        _ => error.into(),
    }
}

/// Of a drive that does not answer while something is opened, what to do first.
fn not_booted(what: &str, failure: Failure) -> Failure {
    let Some(node) = failure.subject.node.filter(|_| failure.kind == "no_answer") else { return failure };
    let what = format!("{what} was not opened, and nothing moves: node {node} does not answer");
    let Failure { kind, subject, what: because, next, .. } = failure;
    let failure = Failure { kind, subject, ..Failure::new(what) }.because(because);
    next.into_iter().fold(failure.next("boot its nodes first: network.boot()"), Failure::next)
}

/// An error where the bus cannot carry the cycle, before anything is written to a drive. Without a known bit rate nothing is refused.
async fn check_fits(cycle: &CyclePlan, drives: &[&Drive], bitrate: Option<Bitrate>) -> Result<(), Trouble> {
    let Some(bitrate) = bitrate else { return Ok(()) };
    match cycle.too_full(drives, bitrate, |read| read).await {
        Ok(None) => Ok(()),
        Ok(Some(full)) => {
            let failure = Failure::new(format!("{} was not opened: {}", cycle.what, full.what)).of_kind("bus_load");
            let shown = format!("network.plan(cycle={}) shows each frame", cycle.period.as_secs_f64());
            Err(failure.next(full.next).next(shown).into())
        }
        Err(failure) => Err(not_booted(&cycle.what, failure).into()),
    }
}

async fn next(core: &Core) -> Result<(), Trouble> {
    core.next_sync().await.map(drop).map_err(|error| Trouble::Said(error.to_string()))
}

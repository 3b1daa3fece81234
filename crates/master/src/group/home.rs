//! Homing of the axes of a group, before it is opened: each drive by a method of its own (CiA 402-2, clause 11), all at once or
//! one after the other, as the machine allows.

use cia402::object::CONTROLWORD;
use core::future::{Future, poll_fn};
use core::pin::Pin;
use core::task::Poll;

use super::error::GroupError;
use crate::drive::{Drive, HomingOptions, MotionReport};
use crate::network::join_all;

/// How an axis finds its reference.
#[derive(Clone, Debug)]
pub struct AxisHoming {
    /// The drive.
    pub drive: Drive,
    /// The method of CiA 402 (6098h).
    pub method: i8,
    /// Speed and the longest time.
    pub options: HomingOptions,
}

/// Which axes search at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingOrder {
    /// All of them.
    Together,
    /// One after the other, as they are given: for axes that are in each other's way.
    InSequence,
}

type Search<'a> = Pin<Box<dyn Future<Output = Result<MotionReport, GroupError>> + 'a>>;

/// Finds the reference of each axis. When one does not find it, those that search beside it are quick-stopped and those after
/// it do not begin.
///
/// # Errors
/// [`GroupError::Homing`] of the first axis that failed, [`GroupError::Taken`] for an axis of an open group, before anything moves.
pub async fn home(axes: &[AxisHoming], order: HomingOrder) -> Result<Vec<MotionReport>, GroupError> {
    let mut claims = Vec::new();
    for axis in axes {
        let (node, controlword) = (axis.drive.node().id(), axis.drive.place(CONTROLWORD));
        let claim = axis.drive.node().network().claim(node, controlword);
        claims.push(claim.ok_or(GroupError::Taken { node, controlword })?);
    }
    let mut searches = (1..).zip(axes).map(|(number, axis)| Box::pin(axis.search(number)) as Search<'_>);
    match order {
        HomingOrder::InSequence => {
            let mut reports = Vec::new();
            for search in searches {
                reports.push(search.await?);
            }
            Ok(reports)
        }
        HomingOrder::Together => {
            let found = all_or_first_error(searches.by_ref().collect()).await;
            if found.is_err() {
                // The first error is reported, whether or not the stops succeed.
                let _ = join_all(axes.iter().map(|axis| axis.drive.quick_stop())).await;
            }
            found
        }
    }
}

impl AxisHoming {
    async fn search(&self, axis: usize) -> Result<MotionReport, GroupError> {
        let options = HomingOptions { wait: true, ..self.options };
        let found = self.drive.home_claimed(self.method, options).await;
        found.map_err(|source| GroupError::Homing { axis, node: self.drive.node().id(), source })
    }
}

/// The results of all, in their order; or the first error, and the others are dropped.
async fn all_or_first_error(mut searches: Vec<Search<'_>>) -> Result<Vec<MotionReport>, GroupError> {
    let mut reports: Vec<Option<MotionReport>> = searches.iter().map(|_| None).collect();
    poll_fn(|context| {
        for (search, report) in searches.iter_mut().zip(&mut reports) {
            if report.is_none()
                && let Poll::Ready(found) = search.as_mut().poll(context)
            {
                match found {
                    Ok(found) => *report = Some(found),
                    Err(error) => return Poll::Ready(Err(error)),
                }
            }
        }
        if reports.iter().all(Option::is_some) { Poll::Ready(Ok(())) } else { Poll::Pending }
    })
    .await?;
    Ok(reports.into_iter().flatten().collect())
}

//! Test motions of one axis, again and again: a shape with its limits, sent point by point through a group of one axis, or steps of
//! velocity by the drive's own ramps, and what was seen of each run.
//!
//! What moves here is stopped by what stops a group and `velocity`: both note what they have set in motion.

mod commanded;
mod line;
mod order;
mod runs;
mod shape;

use master::group::{Group, GroupError};
use master::units::Turns;
use serde::Serialize;

use crate::group_follow::stream;

pub(crate) use commanded::cyclic;
pub use line::TestMotionLine;
pub use order::{Order, ShapeName};
pub use runs::{Figures, Motion, Run, Travel, limits, run, steps, usual_quantities};
pub use shape::{Shape, points};

/// How a run of a shape was followed, by the position that the drive shows in each cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Followed {
    /// How long it took, in s.
    pub took_s: f64,
    /// The greatest distance of the shaft from its set-point, in degrees.
    pub most_deg: f64,
    /// Root of the mean of its square over the cycles.
    pub rms_deg: f64,
}

/// Sends the points of a shape, relative to where the group holds, one in each cycle, and waits until it holds again.
///
/// # Errors
/// Those of the group, which comes to rest then.
pub async fn follow(group: &mut Group, points: &[f64]) -> Result<Followed, GroupError> {
    let network = group.network().clone();
    let from = group.points().first().map_or(0.0, |point| point.position_turns);
    // At the end twice the same point: velocity and acceleration are zero then, and there is nothing left to be brought to rest.
    let at_rest = points.last().into_iter().cycle().take(2);
    let path: Vec<_> = points.iter().chain(at_rest).map(|point| [Turns(from + point)]).collect();
    let began = network.now();
    let (mut most, mut squares, mut cycles) = (0.0_f64, 0.0, 0_u32);
    stream(group, path, |group| {
        if let Some(Some(error)) = group.following_errors().next() {
            most = most.max(error.abs());
            squares += error * error;
            cycles += 1;
        }
    })
    .await?;
    let took_s = (network.now() - began).as_secs_f64();
    let rms = (squares / f64::from(cycles.max(1))).sqrt();
    Ok(Followed { took_s, most_deg: most * 360.0, rms_deg: rms * 360.0 })
}

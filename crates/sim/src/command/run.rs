//! `run 20ms`, `run until 2.5s`: time that passes on request, and what happened in it.

use core::time::Duration;

use can::Instant;
use serde::Serialize;

use crate::World;
use crate::json;
use crate::stimulus::{RUN, StimulusError};

/// How far time moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Run {
    /// So much further.
    For(Duration),
    /// To this time of the bus, if that has not come yet.
    Until(Instant),
}

impl Run {
    /// The words after `run`.
    pub(super) fn parse(text: &str) -> Result<Self, StimulusError> {
        let (until, time) = match text.trim().strip_prefix("until") {
            Some(time) => (true, time.trim()),
            None => (false, text.trim()),
        };
        if time.is_empty() {
            return Err(StimulusError::Usage(RUN));
        }
        let duration = can::parse_duration(time).map_err(|_| StimulusError::BadValue {
            text: time.to_owned(),
            what: "time of up to a year",
            usage: RUN,
        })?;
        Ok(if until { Self::Until(Instant::ZERO + duration) } else { Self::For(duration) })
    }

    /// Where it ends when it begins at `now`.
    pub fn end(self, now: Instant) -> Instant {
        match self {
            Self::For(duration) => now + duration,
            Self::Until(end) => end.max(now),
        }
    }
}

/// What a world was like at the beginning of a run.
#[derive(Clone, Debug)]
pub struct Before {
    frames: u64,
    nodes: Vec<NodeState>,
}

/// What may change about a drive that is reported to a person.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct NodeState {
    node: u8,
    power: &'static str,
    statusword: Option<u16>,
    error_code: u32,
}

#[derive(Serialize)]
struct RunReport {
    ok: bool,
    t: f64,
    frames: u64,
    changes: Vec<NodeState>,
}

impl Before {
    /// A world as it is now.
    pub fn of(world: &mut World) -> Self {
        Self { frames: world.statistics().frames, nodes: nodes(world) }
    }

    /// What has happened since, as an answer: the time reached, the frames that the wire has carried, and the drives whose power, statusword or
    /// error code is another.
    pub fn answer(&self, world: &mut World) -> String {
        let now = nodes(world);
        let changes = now.into_iter().filter(|node| !self.nodes.contains(node)).collect();
        let frames = world.statistics().frames - self.frames;
        json::line(&RunReport { ok: true, t: world.now().as_nanos() as f64 / 1e9, frames, changes })
    }
}

fn nodes(world: &mut World) -> Vec<NodeState> {
    let numbers: Vec<u8> = world.drive_numbers().collect();
    let reports = numbers.into_iter().filter_map(|node| Some((node, world.report(node).ok()?)));
    let seen = reports.map(|(node, report)| NodeState {
        node,
        power: report.power.word(),
        statusword: report.statusword,
        error_code: report.error_code,
    });
    seen.collect()
}

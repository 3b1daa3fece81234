//! What several threads compute at once, before the world goes on with one station after the other.
//!
//! What a drive does up to an instant depends on no other one, unless a machine or an encoder joins them: those stay with the
//! world's own thread. So it may be computed in any order; what comes of it is collected in the order of their numbers.

use can::Instant;

use super::World;
use super::crew::{Errand, Job, JobResult, OnBus};
use super::member::{Member, Vacant};

/// Fewer drives than that are not worth several threads: with ten control periods each it is some 12 us, and a hand-over takes 3.
const WORTH_IT: usize = 16;

impl World {
    /// How many threads work on the drives, this one among them; 1 in a new world, and 64 at most. The run is the same to the last
    /// bit whatever their number. Drives that a body couples, encoders on the shafts of others with what they look at, and fewer
    /// than 16 drives that are due at once stay with the caller's thread.
    pub fn set_threads(&mut self, threads: usize) {
        self.crew.set_threads(threads);
        self.done_ahead.clear();
    }

    /// How many threads work on the drives.
    pub fn threads(&self) -> usize {
        self.crew.threads()
    }

    /// Does the job with all drives that are `wanted`, if they are so many that it is worth a hand-over. They are noted in
    /// `done_ahead`, with what was found.
    pub(super) fn work_ahead(&mut self, job: Job, wanted: impl Fn(&Self, usize) -> bool) {
        if self.crew.threads() == 1 {
            return;
        }
        let mut batch = std::mem::take(&mut self.done_ahead);
        batch.clear();
        let is_drive = |i: usize| matches!(self.members[i], Member::Drive { .. });
        let chosen = (0..self.members.len()).filter(|i| wanted(self, *i) && is_drive(*i) && !self.is_tied(*i));
        batch.extend(chosen.map(|i| (i, JobResult::Unknown)));
        if batch.len() < WORTH_IT {
            batch.clear();
        } else {
            let Self { members, bus, ledgers, crew, now, .. } = self;
            let is_direct = ledgers.is_empty();
            let errands = batch.iter().map(|(station, _)| Errand {
                station: *station,
                member: std::mem::replace(&mut members[*station], Member::Gone(Vacant)),
                on_bus: is_direct
                    .then(|| OnBus { bitrate: bus.bitrate_of(*station), has_room: bus.has_room(*station) }),
                found: JobResult::Unknown,
            });
            crew.work((job, *now), batch.len(), errands);
            let mut found = batch.iter_mut().map(|(_, found)| found);
            crew.take_back(|errand| {
                members[errand.station] = errand.member;
                found.next().into_iter().for_each(|found| *found = errand.found);
            });
        }
        self.done_ahead = batch;
    }

    /// After a job with station `i` on another thread: like [`serve`](Self::serve), without a look at a drive that wants nothing.
    pub(super) fn serve_found(&mut self, i: usize, found: JobResult) {
        match found {
            JobResult::Quiet(due) => self.due.set(i, due),
            JobResult::Sends(frame) => {
                self.bus.offer(i, frame, self.now);
                self.serve(i);
            }
            JobResult::Unknown => self.serve(i),
        }
    }

    /// What it does depends on other drives, or is looked at by one.
    fn is_tied(&self, i: usize) -> bool {
        let has_shaft = |number| matches!(&self.members[i], Member::Drive { number: own, .. } if *own == number);
        self.bodies.iter().any(|body| body.stations.contains(&i))
            || self.mounted.iter().any(|(encoder, shaft)| *encoder == i || has_shaft(shaft.node))
    }
}

impl Member {
    /// A job for this station alone, and what it wants then.
    pub(super) fn work(&mut self, job: Job, now: Instant, on_bus: Option<OnBus>) -> JobResult {
        let Self::Drive { drive, .. } = self else { return JobResult::Unknown };
        if job == Job::Advance {
            drive.advance(now);
            return JobResult::Unknown;
        }
        drive.handle_timeout(now);
        let Some(on_bus) = on_bus.filter(|on_bus| drive.bitrate() == on_bus.bitrate) else { return JobResult::Unknown };
        match on_bus.has_room.then(|| drive.poll_transmit()).flatten() {
            Some(frame) => JobResult::Sends(frame),
            None => JobResult::Quiet(drive.poll_timeout().unwrap_or(Instant::FAR_FUTURE)),
        }
    }
}

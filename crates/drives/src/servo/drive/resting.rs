//! When the control periods of this drive change nothing any more.

use can::Instant;
use canopen::od::Storage;

use super::{SUPERVISION_DIVIDER, ServoDrive};
use crate::Resting;

impl<S: Storage> Resting for ServoDrive<S> {
    const ROUND: u32 = SUPERVISION_DIVIDER as u32;

    fn rests_since(&self, earlier: &Self, _now: Instant) -> bool {
        // Each by name, so that no new one is forgotten.
        let Self {
            description: _,
            base,
            shafts,
            motors: _,
            faults,
            protection,
            bleeder,
            bleeder_limits: _,
            probes,
            periods,
            fidelity: _,
        } = self;
        (faults, protection, bleeder) == (&earlier.faults, &earlier.protection, &earlier.bleeder)
            && (probes, periods) == (&earlier.probes, &earlier.periods)
            && shafts
                .iter()
                .flatten()
                .zip(earlier.shafts.iter().flatten())
                .all(|(shaft, before)| shaft.rests_since(before))
            && base.device.rests_since(&earlier.base.device)
    }

    fn next_event(&self) -> Option<Instant> {
        self.base.device.next_event().into_iter().chain(self.base.next_watch()).min()
    }

    fn task_from(&self, at: Instant) -> Option<Instant> {
        self.base.device.task_from(at)
    }

    fn task_is_idle(&self) -> bool {
        self.base.device.is_task_idle()
    }

    fn leave_out_tasks(&mut self, now: Instant) {
        self.base.device.leave_out_tasks(now);
    }

    fn leave_out_rounds(&mut self, rounds: u64) {
        // A round has one supervision, or each of its ticks is one.
        let supervisions = rounds * u64::from(self.fidelity.tick(1, SUPERVISION_DIVIDER));
        self.shafts.iter_mut().flatten().for_each(|shaft| shaft.leave_out_supervisions(supervisions));
    }
}

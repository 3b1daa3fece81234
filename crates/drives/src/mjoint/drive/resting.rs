//! When the control periods of this drive change nothing any more.

use can::Instant;

use super::{Battery, INTERPOLATION_PERIODS, LAMP_TEST_MS, MJoint, SUPERVISION_DIVIDER};
use crate::Resting;

impl Resting for MJoint {
    const ROUND: u32 = SUPERVISION_DIVIDER as u32 * INTERPOLATION_PERIODS as u32;

    fn rests_since(&self, earlier: &Self, now: Instant) -> bool {
        // Each by name, so that no new one is forgotten.
        let Self {
            model: _,
            device,
            powered_at,
            host,
            parameters: _,
            parameters_changed,
            address,
            save_asked,
            origin,
            orders,
            axis,
            output,
            alarms,
            protection,
            terminals,
            battery,
            encoder,
            rhythm,
        } = self;
        // The lights go by the time in the lamp test, with an alarm and without a full battery.
        let tested = now.nanos_since(*powered_at) >= LAMP_TEST_MS * 1_000_000;
        let lights_are_steady = tested && alarms.latched().is_empty() && *battery == Battery::Full;
        lights_are_steady
            && !(*parameters_changed || *save_asked || origin.is_due())
            && (*address, host.is_lost()) == (earlier.address, earlier.host.is_lost())
            && (origin, orders) == (&earlier.origin, &earlier.orders)
            && (axis, output) == (&earlier.axis, &earlier.output)
            && (alarms, protection) == (&earlier.alarms, &earlier.protection)
            && (terminals, encoder, rhythm) == (&earlier.terminals, &earlier.encoder, &earlier.rhythm)
            && device.rests_since(&earlier.device)
    }

    fn next_event(&self) -> Option<Instant> {
        self.device.next_event().into_iter().chain(self.host.poll_timeout()).min()
    }

    fn task_from(&self, at: Instant) -> Option<Instant> {
        self.device.task_from(at)
    }

    fn task_is_idle(&self) -> bool {
        !self.save_asked && self.device.is_task_idle()
    }

    fn leave_out_tasks(&mut self, now: Instant) {
        self.device.leave_out_tasks(now);
    }
}

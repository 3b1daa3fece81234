//! When the control periods of this drive change nothing any more.

use can::Instant;

use super::{SUPERVISION_DIVIDER, Zlim42c};
use crate::Resting;

impl Resting for Zlim42c {
    const ROUND: u32 = SUPERVISION_DIVIDER as u32;

    fn rests_since(&self, earlier: &Self, _now: Instant) -> bool {
        // Each by name, so that no new one is forgotten. The lights flash a fault by the time.
        let Self {
            device,
            fidelity: _,
            dip_address: _,
            parameters: _,
            shell,
            stepper,
            controlword,
            faults,
            phases,
            bus_a,
            shown_fault,
        } = self;
        shown_fault.is_none()
            && !shell.parameters_changed
            && *shell == earlier.shell
            && *stepper == earlier.stepper
            && *controlword == earlier.controlword
            && *faults == earlier.faults
            && *phases == earlier.phases
            && *bus_a == earlier.bus_a
            && device.rests_since(&earlier.device)
    }

    fn next_event(&self) -> Option<Instant> {
        self.device.next_event()
    }

    fn task_from(&self, at: Instant) -> Option<Instant> {
        self.device.task_from(at)
    }

    fn task_is_idle(&self) -> bool {
        self.device.is_task_idle()
    }

    fn leave_out_tasks(&mut self, now: Instant) {
        self.device.leave_out_tasks(now);
    }
}

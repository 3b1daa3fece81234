//! Faults of the whole drive and of its axes: what they stop, what is reported of them, and how they end.

use can::Instant;
use canopen::od::Storage;
use cia402::FaultReactionOption;
use devices::servo::faults::{FAULTS, row};

use super::ServoDrive;
use crate::engine::faults::FaultSet;
use crate::servo::faults::NewFaults;
use crate::servo::shaft::Shaft;
use crate::servo::write;

/// Faults after which the motor cannot be stopped by the power stage.
const POWERLESS: [usize; 4] = [row::OVER_CURRENT, row::OVER_VOLTAGE, row::UNDER_VOLTAGE, row::ENCODER];

impl<S: Storage> ServoDrive<S> {
    /// New faults stop the axes, and are reported.
    pub(super) fn enter_faults(&mut self, new: &NewFaults, now: Instant) {
        if new.codes().next().is_none() {
            return;
        }
        let values = self.base.device.values_mut();
        for (shaft, own) in self.shafts.iter_mut().zip(new.own) {
            let Some(shaft) = shaft else { continue };
            let concerns = FaultSet(new.shared.0 | own.0);
            let Some(first) = concerns.rows().next() else { continue };
            let powerless = concerns.rows().any(|row| POWERLESS.contains(&row));
            let reaction = shaft.parameters().fault_reaction;
            shaft.fault(if powerless { FaultReactionOption::DISABLE } else { reaction });
            write(values, shaft.slots().error_code, i64::from(FAULTS[first].code));
            shaft.publish_status(values);
        }
        let register = self.error_register();
        self.base.device.report_codes(new.codes(), register, now);
    }

    /// Forgets the faults whose cause is gone. An axis leaves Fault when none of its own and none of the drive's is left.
    pub(super) fn reset_faults(&mut self, now: Instant) {
        let shared_gone = self.faults.reset();
        let values = self.base.device.values_mut();
        for shaft in self.shafts.iter_mut().flatten() {
            shaft.forget_causes();
            if shaft.faults_mut().reset() && shared_gone {
                write(values, shaft.slots().error_code, 0);
                shaft.reset_fault();
            }
            shaft.publish_status(values);
        }
        let register = self.error_register();
        self.base.device.report_register(register, now);
    }

    fn error_register(&self) -> u8 {
        let axes = self.shafts.iter().flatten().map(|shaft: &Shaft| shaft.faults().error_register());
        axes.fold(self.faults.error_register(), |all, register| all | register)
    }
}

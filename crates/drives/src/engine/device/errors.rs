//! What a device reports of its errors: EMCY messages and the error register (CiA 301, 7.2.7 and 7.5.2.2). Faults are the
//! drive's; errors of communication are the device's own, and stand beside them.

use can::Instant;
use canopen::EmcyErrorCode;
use canopen::od::Storage;

use super::Device;
use crate::engine::faults::{FaultMonitor, FaultSet};

impl<S: Storage> Device<S> {
    /// Sends an EMCY message for each new fault; the error register shows all that are latched.
    pub fn report_faults<const F: usize>(&mut self, new: FaultSet, faults: &FaultMonitor<F>, now: Instant) {
        self.report_codes(new.rows().map(|row| faults.row(row).emcy), faults.error_register(), now);
    }

    /// The same of faults that are in several monitors: sends an EMCY message for each code, and the error register shows
    /// these bits.
    pub fn report_codes(&mut self, new: impl Iterator<Item = EmcyErrorCode>, register: u8, now: Instant) {
        self.fault_bits = register;
        for code in new {
            self.report_error(code, now);
        }
    }

    /// After a reset of faults: the error register shows what is left, and EMCY reports when nothing is.
    pub fn report_reset<const F: usize>(&mut self, faults: &FaultMonitor<F>, now: Instant) {
        self.report_register(faults.error_register(), now);
    }

    /// The same with the bits of the error register of all faults that are left.
    pub fn report_register(&mut self, register: u8, now: Instant) {
        self.fault_bits = register;
        self.communication_errors.events_lost = false;
        self.report_end_of_error(now);
    }

    /// An RPDO came too short, or has its length again: an error that the profile may have a code for.
    pub(super) fn report_rpdo_length(&mut self, fits: bool, now: Instant) {
        let Some(code) = self.profile.short_rpdo else { return };
        if fits {
            self.communication_errors.end_short_rpdo();
            self.report_end_of_error(now);
        } else {
            self.communication_errors.begin_short_rpdo();
            self.report_error(code, now);
        }
    }

    /// Events of the node were lost: what CiA 301 calls objects lost. It stands until faults are reset, since what was
    /// lost does not come back.
    pub(super) fn report_lost_events(&mut self, now: Instant) {
        self.communication_errors.events_lost = true;
        self.report_error(EmcyErrorCode::CAN_OVERRUN, now);
    }

    /// An RPDO has missed the deadline of its event timer, or has come again (CiA 301, 7.5.2.35).
    pub fn report_rpdo_deadline(&mut self, met: bool, now: Instant) {
        if met {
            self.communication_errors.end_late_rpdo();
            self.report_end_of_error(now);
        } else {
            self.communication_errors.begin_late_rpdo();
            self.report_error(EmcyErrorCode::RPDO_TIMEOUT, now);
        }
    }

    /// The application's own errors, as bits of the error register: a new one is reported as a generic error (1000h).
    pub fn report_own_errors(&mut self, register: u8, now: Instant) {
        if register == self.fault_bits {
            return;
        }
        let is_new = register & !self.fault_bits != 0;
        self.fault_bits = register;
        if is_new {
            self.report_error(EmcyErrorCode::GENERIC, now);
        } else {
            self.report_end_of_error(now);
        }
    }

    /// The controller takes part in the bus again after it was bus-off: that is reported, and over.
    pub fn report_bus_off_recovery(&mut self, now: Instant) {
        let register = self.fault_bits | self.communication_errors.register_bits();
        self.node.raise_emcy(EmcyErrorCode::RECOVERED_FROM_BUS_OFF, register, [0; 5], now);
        self.report_end_of_error(now);
    }

    /// A multiplexed PDO named an object that it cannot be stored in (CiA 301, 7.2.3.2.1): that is reported, and over.
    pub(super) fn report_missing_destination(&mut self, now: Instant) {
        self.report_error(EmcyErrorCode::DESTINATION_NOT_AVAILABLE, now);
        self.report_end_of_error(now);
    }

    /// A heartbeat that is watched, or the master's guarding, has stayed away, or is heard again (CiA 301, 7.2.8.2).
    pub fn report_heartbeat(&mut self, heard: bool, now: Instant) {
        if !heard {
            self.communication_errors.heartbeat_lost = true;
            self.report_error(EmcyErrorCode::HEARTBEAT, now);
        } else if self.communication_errors.heartbeat_lost {
            self.communication_errors.heartbeat_lost = false;
            self.report_end_of_error(now);
        }
    }

    fn report_error(&mut self, code: EmcyErrorCode, now: Instant) {
        self.node.raise_emcy(code, self.fault_bits | self.communication_errors.register_bits(), [0; 5], now);
    }

    /// An error ended: the error register shows what is left, and EMCY reports when nothing is.
    fn report_end_of_error(&mut self, now: Instant) {
        let register = self.fault_bits | self.communication_errors.register_bits();
        if let Some(slot) = self.error_register() {
            self.node.dictionary_mut().set_raw(slot, u32::from(register));
        }
        if register == 0 {
            self.node.raise_emcy(EmcyErrorCode::NO_ERROR, 0, [0; 5], now);
        }
    }
}

//! The drive on the bus: what a host writes, and what the loss of the host does.
//!
//! 6007h says what an axis does when the connection is lost, whatever way (CiA 402-2, object 6007h): a heartbeat or the
//! guarding that stays away, bus-off, NMT stopped, and NMT reset communication; here the missed deadline of an
//! RPDO too, which CiA 301, 7.5.2.35 leaves to the application. An axis without the object does what the
//! standard's default says: a fault. After NMT reset node the firmware starts over, with the power stage off.

use can::Instant;
use canopen::NmtState;
use canopen::node::Via;
use canopen::od::{Slot, Storage};
use canopen::pdo::PdoNumber;
use devices::servo::faults::row;

use super::ServoDrive;
use crate::engine::device::{Application, Device};
use crate::engine::faults::FaultSet;
use crate::node::Loss;
use crate::node::described::{Described, DescribedDevice, described_station};
use crate::servo::faults::NewFaults;
use crate::servo::shaft::Written;

impl<S: Storage> Application<S> for ServoDrive<S> {
    fn device(&mut self) -> &mut Device<S> {
        &mut self.base.device
    }

    fn written(&mut self, slot: Slot, raw: u32, via: Via, now: Instant) -> bool {
        if self.service_written(slot, raw, via, now) {
            return false;
        }
        let mut reset = false;
        let mut commanded = false;
        for (shaft, probes) in self.shafts.iter_mut().zip(self.probes) {
            let Some(shaft) = shaft else { continue };
            match shaft.written(self.base.device.values_mut(), slot, via, probes) {
                Written::Elsewhere => continue,
                Written::Command => commanded = true,
                Written::FaultReset => reset = true,
                Written::Value => {}
            }
        }
        if reset {
            self.reset_faults(now);
        }
        commanded
    }

    fn show_status(&mut self) {
        let values = self.base.device.values_mut();
        for shaft in self.shafts.iter().flatten() {
            shaft.publish_status(values);
        }
    }

    fn nmt_changed(&mut self, state: NmtState, now: Instant) {
        self.follow_nmt(state, now);
    }

    fn rpdo_deadline(&mut self, _number: PdoNumber, met: bool, now: Instant) {
        self.connection(Loss::RpdoDeadline, !met, now);
    }

    fn restart(&mut self, now: Instant) {
        self.restart_firmware(now);
    }

    /// What it does to the axes is reported after the boot-up message.
    fn restart_communication(&mut self, now: Instant) {
        self.base.restart_communication(now);
        self.connection(Loss::Reset, true, now);
    }

    fn communication_task(&mut self, now: Instant) {
        self.base.device.notice_changes(now);
    }
}

impl<S: Storage> Described<S> for ServoDrive<S> {
    fn base(&self) -> &DescribedDevice<S> {
        &self.base
    }

    fn base_mut(&mut self) -> &mut DescribedDevice<S> {
        &mut self.base
    }

    fn connection(&mut self, loss: Loss, lost: bool, now: Instant) {
        if lost { self.lose_connection(loss, now) } else { self.regain_connection(loss, now) }
    }
}

impl<S: Storage> ServoDrive<S> {
    /// Each axis does what its 6007h says. A fault reports itself; otherwise the loss is reported as the error that it is.
    fn lose_connection(&mut self, loss: Loss, now: Instant) {
        let row = fault_row(loss);
        let mut new = NewFaults::default();
        let mut is_fault = false;
        for (shaft, own) in self.shafts.iter_mut().zip(&mut new.own) {
            let Some(shaft) = shaft else { continue };
            // A host that stops or resets a node that does not move has not lost it.
            if loss != Loss::Silence && !shaft.power().is_live() {
                continue;
            }
            if shaft.lose_connection(self.base.device.values(), row, loss != Loss::Reset) {
                is_fault = true;
                *own = FaultSet::NONE.with(row, shaft.faults_mut().raise(row));
            }
        }
        if is_fault {
            self.enter_faults(&new, now);
        } else {
            self.base.report(loss, true, now);
        }
        self.show_status();
    }

    /// A fault for the loss can be reset from now on.
    fn regain_connection(&mut self, loss: Loss, now: Instant) {
        for shaft in self.shafts.iter_mut().flatten() {
            shaft.regain_connection(fault_row(loss));
        }
        // The fault itself has the code of a recovery, and is sent with it.
        let is_fault = self.shafts.iter().flatten().any(|shaft| shaft.faults().latched().has(fault_row(loss)));
        if loss != Loss::BusOff || !is_fault {
            self.base.report(loss, false, now);
        }
    }
}

const fn fault_row(loss: Loss) -> usize {
    match loss {
        Loss::Silence => row::HEARTBEAT,
        Loss::BusOff => row::BUS_OFF,
        Loss::Stopped | Loss::Reset => row::NMT,
        Loss::RpdoDeadline => row::RPDO_DEADLINE,
    }
}

described_station!(ServoDrive);

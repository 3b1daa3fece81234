//! How parameters are stored: the register parameter setting (2009h of the ZLAC8030L, 2010h of the ZLIM42-C) and the object
//! that has each write stored (2010h and 200Ch).

use canopen::od::{Entry, Object, Slot, Storage};

use devices::zltech::{RESTORE, SAVE};

use crate::engine::device::Device;

/// A write to the register parameter setting, which reads 0 again when it is done; it is about the rows that `wanted` names.
/// True if all is as delivered now.
#[cold]
pub(crate) fn register_command<S: Storage>(
    device: &mut Device<S>,
    register: Object<u16>,
    command: u32,
    wanted: fn(&Entry) -> bool,
) -> bool {
    device.values_mut().set(register, 0);
    match command {
        RESTORE => device.restore_factory_settings(wanted),
        SAVE => {
            device.mark_all(wanted);
            false
        }
        _ => false,
    }
}

/// A peer's write to a row: stored by the next task if each write is.
#[inline]
pub(crate) fn mark_if_saving<S: Storage>(device: &mut Device<S>, save_on_write: Object<u16>, slot: Slot) {
    if device.values().get(save_on_write) == 0 {
        device.mark(slot);
    }
}

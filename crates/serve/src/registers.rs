//! Modbus requests on a world: which drive a unit is, and what it answers.
//!
//! A unit is a drive by the address it uses at present (2615h of an M joint). Requests are served between two steps of
//! the world, at its present time, as world commands are. Who answers decides when: an answer may stand for a store.

#[cfg(test)]
mod tests;

use sim::{RegisterError, World};
use transport::{ModbusException, ModbusRequest, RegisterAccess, RegisterAnswer};

/// What the drive that `request` is for answers, and that drive's number; a broadcast is a write for all of them, and none
/// answers.
pub(crate) fn answer(world: &mut World, request: &ModbusRequest) -> (RegisterAnswer, Option<u8>) {
    if request.broadcast { (broadcast(world, request), None) } else { of_unit(world, request.unit, &request.access) }
}

fn of_unit(
    world: &mut World,
    unit: u8,
    access: &Result<RegisterAccess, ModbusException>,
) -> (RegisterAnswer, Option<u8>) {
    let Some(number) = world.modbus_drive(unit) else { return (None, None) };
    let access = access.as_ref().map_err(|refused| *refused);
    (Some(access.and_then(|access| carry_out(world, number, access))), Some(number))
}

/// Each unit takes it or refuses it by itself; a read for all has no answer.
fn broadcast(world: &mut World, request: &ModbusRequest) -> RegisterAnswer {
    if let Ok(access @ RegisterAccess::Write { .. }) = &request.access {
        let numbers: Vec<u8> = world.drive_numbers().collect();
        for number in numbers {
            let _ = carry_out(world, number, access);
        }
    }
    None
}

fn carry_out(world: &mut World, number: u8, access: &RegisterAccess) -> Result<Vec<u16>, ModbusException> {
    let done = world.with_drive(number, |drive, now| match access {
        RegisterAccess::Read { address, count } => {
            let mut words = vec![0; usize::from(*count)];
            drive.read_registers(*address, &mut words, now).map(|()| words)
        }
        RegisterAccess::Write { address, words } => drive.write_registers(*address, words, now).map(|()| Vec::new()),
    });
    done.map_err(|_| ModbusException::ServerDeviceFailure)?.map_err(|error| match error {
        // "It may also indicate that the server is in the wrong state to process a request of this type": MODBUS
        // Application Protocol V1.1b3, 7, exception 01.
        RegisterError::Forbidden => ModbusException::IllegalFunction,
        RegisterError::NoSuchAddress | RegisterError::ReadOnly => ModbusException::IllegalDataAddress,
        RegisterError::BadValue(_) => ModbusException::IllegalDataValue,
    })
}

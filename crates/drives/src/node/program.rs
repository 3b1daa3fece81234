//! Program download (CiA 302-3): the programs of a described device by 1F50h (data), 1F51h (control), 1F56h (software identification)
//! and 1F57h (flash status).
//!
//! A program is stopped before its data comes, and started after it: its old data stays until all of the new has come. CiA 302-3
//! itself is not public: the values of 1F51h and 1F57h are those of another implementation of it (Zephyr RTOS, its CANopen program
//! download), and 1F57h is also printed by TR-Electronic (TR-ECE-BA-DGB-0128, 7.19). No program is executed here: what a device does
//! is in its firmware.

use canopen::od::{Check, Condition, Dictionary, Entry, Slot, Storage, Table, View};
use canopen::{AbortCode, Mux};
use cia402::{Controlword, PowerState, Statusword};

use crate::engine::storage::crc32;

/// Programs of one device.
const MOST: u8 = 4;

const DATA: u16 = 0x1F50;
const CONTROL: u16 = 0x1F51;
const IDENTIFICATION: u16 = 0x1F56;
const STATUS: u16 = 0x1F57;

/// Of 1F51h.
const STOP: u32 = 0;
const START: u32 = 1;
const RESET: u32 = 2;
const CLEAR: u32 = 3;

/// 1F57h: bit 0 is set while memory is written, bits 1 to 7 are the error: 1, there is not a valid program.
const STATUS_OK: u32 = 0;
const STATUS_NO_PROGRAM: u32 = 1 << 1;

/// Where an axis' block of the profile area begins: at each 800h (CiA 402-1).
const AXIS_STEP: u16 = 0x800;
const CONTROLWORD: u16 = 0x6040;
const STATUSWORD: u16 = 0x6041;
const AXES: u16 = 8;

/// What a peer's write did to a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Changed {
    /// Its data: the memory is to keep it.
    Data,
    /// Only whether it runs.
    State,
}

/// Whether a row is a part of program download: it has a place of its own in the memory, beside the parameters.
pub(super) const fn is_of_program(row: &Entry) -> bool {
    matches!(row.index, DATA | CONTROL | IDENTIFICATION | STATUS)
}

/// Where the data of the programs is that a table has.
pub(super) fn data_rows(table: &'static Table) -> impl Iterator<Item = (Slot, &'static Entry)> {
    let is_data = |row: &Entry| row.index == DATA && matches!(row.sub_index, 1..=MOST) && row.stored_bytes() > 0;
    table.iter().filter(move |(_, row)| is_data(row))
}

/// The device starts: each program that there is runs. `stored` is what its memory has, if it has ever been written.
pub(super) fn start<'a>(values: &mut Dictionary<impl Storage>, stored: impl Fn(Mux) -> Option<&'a [u8]>) {
    for (slot, row) in data_rows(values.table()) {
        let number = row.sub_index;
        match stored(row.mux()) {
            // As delivered: 1F56h is what the description says.
            None => set(values, CONTROL, number, START),
            Some(program) => {
                // It has been taken from this object.
                let _ = values.set_bytes(slot, program);
                show(values, number, program);
                set(values, CONTROL, number, if program.is_empty() { STOP } else { START });
            }
        }
    }
}

/// What 1F51h shows of each program: NMT reset communication, which puts it to the description's value, changes no program.
pub(super) fn states(values: &Dictionary<impl Storage>) -> [Option<i64>; MOST as usize] {
    core::array::from_fn(|place| values.view().value(Mux::new(CONTROL, place as u8 + 1)).ok())
}

/// The same again.
pub(super) fn restore_states(values: &mut Dictionary<impl Storage>, states: [Option<i64>; MOST as usize]) {
    for (state, number) in states.into_iter().zip(1..) {
        if let Some(state) = state {
            set(values, CONTROL, number, state as u32);
        }
    }
}

/// A peer wrote to an object; `None` if it is not one of these, or does nothing.
pub(super) fn written(values: &mut Dictionary<impl Storage>, slot: Slot, raw: u32) -> Option<Changed> {
    let mux = values.table().row(slot).mux();
    if !matches!(mux.index, DATA | CONTROL) {
        return None;
    }
    let number = mux.sub_index;
    let data = data_rows(values.table()).find(|(_, row)| row.sub_index == number)?.0;
    match (mux.index, raw) {
        (DATA, _) => {
            let sum = crc32(values.view().long_bytes(data));
            show_sum(values, number, raw, sum);
            Some(Changed::Data)
        }
        (CONTROL, RESET) => {
            set(values, CONTROL, number, START);
            Some(Changed::State)
        }
        (CONTROL, CLEAR) => {
            // An empty value fits any string.
            let _ = values.set_bytes(data, &[]);
            show(values, number, &[]);
            set(values, CONTROL, number, STOP);
            Some(Changed::Data)
        }
        (CONTROL, _) => Some(Changed::State),
        _ => None,
    }
}

/// Identification and status of a program.
fn show(values: &mut Dictionary<impl Storage>, number: u8, program: &[u8]) {
    show_sum(values, number, program.len() as u32, crc32(program));
}

fn show_sum(values: &mut Dictionary<impl Storage>, number: u8, length: u32, sum: u32) {
    let (sum, status) = if length == 0 { (0, STATUS_NO_PROGRAM) } else { (sum, STATUS_OK) };
    set(values, IDENTIFICATION, number, sum);
    set(values, STATUS, number, status);
}

fn set(values: &mut Dictionary<impl Storage>, index: u16, number: u8, raw: u32) {
    if let Ok(slot) = values.table().find(Mux::new(index, number)) {
        values.set_raw(slot, raw);
    }
}

/// What a device with programs refuses beyond its rows.
pub(super) fn conditions(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    let has_control = data_rows(table).any(|(_, row)| table.find(Mux::new(CONTROL, row.sub_index)).is_ok());
    table.iter().filter_map(move |(slot, row)| {
        let place = usize::from(row.sub_index).wrapping_sub(1);
        let check: Check = match row.index {
            DATA if row.sub_index > 0 => DATA_CHECKS.get(place).copied().unwrap_or(refuse),
            CONTROL if row.sub_index > 0 => CONTROL_CHECKS.get(place).copied().unwrap_or(refuse),
            index if has_control && is_of_axis(index, CONTROLWORD) && row.sub_index == 0 => runs_before_it_moves,
            _ => return None,
        };
        Some((slot, Condition::Check(check)))
    })
}

const fn is_of_axis(index: u16, first: u16) -> bool {
    index >= first && (index - first).is_multiple_of(AXIS_STEP) && (index - first) / AXIS_STEP < AXES
}

const DATA_CHECKS: [Check; MOST as usize] = [data::<1>, data::<2>, data::<3>, data::<4>];
const CONTROL_CHECKS: [Check; MOST as usize] = [control::<1>, control::<2>, control::<3>, control::<4>];

/// One more than there is room for: it would have no effect.
fn refuse(_: &View<'_>, _: u32) -> Result<(), AbortCode> {
    Err(AbortCode::PARAMETER_INCOMPATIBLE)
}

/// 1F50h: of a program that is stopped, on a device whose motors have no power.
fn data<const NUMBER: u8>(values: &View<'_>, _: u32) -> Result<(), AbortCode> {
    let is_stopped = values.value(Mux::new(CONTROL, NUMBER)).unwrap_or(0) == i64::from(STOP);
    if is_stopped { without_power(values) } else { Err(AbortCode::DEVICE_STATE) }
}

/// 1F51h: what there is to start must be valid, and what is cleared must be stopped; nothing is done under power.
fn control<const NUMBER: u8>(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let value = |index| values.value(Mux::new(index, NUMBER)).unwrap_or(0);
    let is_valid = value(STATUS) != i64::from(STATUS_NO_PROGRAM);
    let runs = value(CONTROL) != i64::from(STOP);
    match raw {
        STOP => without_power(values),
        START if is_valid => Ok(()),
        RESET if is_valid => without_power(values),
        CLEAR if !runs => without_power(values),
        START | RESET | CLEAR => Err(AbortCode::DEVICE_STATE),
        _ => Err(AbortCode::INVALID_VALUE),
    }
}

/// 0800 0022h while the power stage of an axis is on: no motor moves while its program changes.
fn without_power(values: &View<'_>) -> Result<(), AbortCode> {
    let states = (0..AXES).filter_map(|axis| values.value(Mux::new(STATUSWORD + AXIS_STEP * axis, 0)).ok());
    let has_power = |statusword: i64| {
        let state = Statusword(statusword as u16).state();
        matches!(
            state,
            Some(PowerState::OperationEnabled | PowerState::QuickStopActive | PowerState::FaultReactionActive)
        )
    };
    if states.into_iter().any(has_power) { Err(AbortCode::DEVICE_STATE) } else { Ok(()) }
}

/// A controlword: without its program a drive is not enabled.
fn runs_before_it_moves(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let enables = Controlword(raw as u16).0 & ENABLE_OPERATION == ENABLE_OPERATION;
    let any_stopped = (1..=MOST).any(|number| values.value(Mux::new(CONTROL, number)) == Ok(i64::from(STOP)));
    if enables && any_stopped { Err(AbortCode::DEVICE_STATE) } else { Ok(()) }
}

/// Bits 0 to 3 of "enable operation" (CiA 402-2).
const ENABLE_OPERATION: u16 = 0b1111;

//! A CiA 402 servo of any vendor: the firmware is built from a [`Description`], of the standard's own
//! drive ([`devices::servo`]) or of a file.
//!
//! Objects are looked up once, when the firmware starts: what the table lacks is not there, and what it has beyond
//! [`acts_on`] is stored and answered, and has no effect. Values as delivered, limits and modes are the table's. The motor
//! comes with the hardware.

mod drive;
mod hardware;
mod motor;
mod parameters;
mod protection;
mod scales;
mod shaft;
mod slots;
mod statusword;
mod touch_probes;

pub use drive::ServoDrive;
pub use hardware::{Actuation, AxisActuation, AxisSensors, Hardware, MAX_AXES, Sensors};
pub use motor::{CONTROL_PERIOD_NS, Motor};

use canopen::od::{Condition, Dictionary, Slot, Storage, Table, View};
use canopen::{AbortCode, Mux};
use cia402::{ModeOfOperation, SupportedModes};
use devices::Description;

use crate::node;

/// Whether this firmware does something with an object of a device so described, or shows something in it.
pub fn acts_on(description: &Description, mux: Mux) -> bool {
    let by_axis = description.axes.iter().take(MAX_AXES).any(|axis| {
        // Sub-index 0 of a record only counts its entries.
        let counts = |known: &Mux| {
            let placed = axis.placement.place(*known);
            mux == placed || (mux.sub_index == 0 && mux.index == placed.index && placed.sub_index > 0)
        };
        slots::AxisSlots::OBJECTS.iter().any(counts)
    });
    by_axis || node::acts_on(mux)
}

/// What a drive so described refuses beyond its rows: for [`Conditions`](canopen::od::Conditions).
pub fn conditions(description: &'static Description) -> impl Iterator<Item = (Slot, Condition)> {
    let table = description.dictionary;
    let modes = description.axes.iter().filter_map(move |axis| {
        let check: fn(&View<'_>, u32) -> Result<(), AbortCode> = match axis.placement.place(SUPPORTED_MODES).index {
            0x6D02 => mode_of_second_axis,
            _ => mode_of_first_axis,
        };
        let mode = table.find(axis.placement.place(Mux::new(0x6060, 0))).ok()?;
        Some((mode, Condition::Check(check)))
    });
    modes.chain(node::conditions(table))
}

const SUPPORTED_MODES: Mux = Mux::new(0x6502, 0);

fn mode_of_first_axis(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    mode_is_supported(values, SUPPORTED_MODES, raw)
}

fn mode_of_second_axis(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    mode_is_supported(values, Mux::new(0x6D02, 0), raw)
}

fn mode_is_supported(values: &View<'_>, declared: Mux, raw: u32) -> Result<(), AbortCode> {
    let mode = ModeOfOperation(raw as i8);
    let Ok(modes) = values.value(declared) else { return Ok(()) };
    let supported = mode == ModeOfOperation::NONE || SupportedModes(modes as u32).has(mode);
    if supported { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

/// The value of an object that may not be there.
fn read(values: &Dictionary<impl Storage>, slot: Option<Slot>, absent: i64) -> i64 {
    slot.map_or(absent, |slot| values.value(slot))
}

/// Shows a value in an object that may not be there, held to the range of its type.
fn write(values: &mut Dictionary<impl Storage>, slot: Option<Slot>, value: i64) {
    let Some(slot) = slot else { return };
    let data_type = Table::row(values.table(), slot).data_type;
    let (low, high) = data_type.range();
    values.set_raw(slot, data_type.raw(value.clamp(low, high)));
}

//! A CiA 402 servo of any vendor: the firmware is built from a [`Description`], of the standard's own
//! drive ([`devices::servo`]) or of a file.
//!
//! Objects are looked up once, when the firmware starts: what the table lacks is not there. What it has beyond [`acts_on`] has no
//! effect: of the profile it is answered and keeps its value, of the maker, and where the profile leaves it to the maker
//! ([`is_left_to_makers`]), it is stored and answered. Values as delivered, limits and modes are the table's. The motor comes with the
//! hardware.

mod drive;
mod faults;
mod hardware;
mod motor;
mod named_gains;
mod parameters;
mod position_range;
mod protection;
mod scales;
mod shaft;
mod slots;
mod statusword;
mod touch_probes;
mod velocity_mode;

pub use drive::ServoDrive;
pub use hardware::{Actuation, AxisActuation, AxisSensors, Hardware, MAX_AXES, PowerStage, Sensors};
pub use motor::{CONTROL_PERIOD_NS, Motor, SpeedWorth};

use canopen::object::COMMUNICATION_CYCLE_PERIOD;
use canopen::od::{Check, Condition, Dictionary, Entry, Slot, Storage, Table, View};
use canopen::{AbortCode, Mux};
use cia402::object::{HOMING_METHOD, INTERPOLATION_DATA_RECORD_1ST_SET_POINT, MODES_OF_OPERATION};
use cia402::{
    DisableOperationOption, FaultReactionOption, HaltOption, HomingMethod, ModeOfOperation, QuickStopOption,
    ShutdownOption, StopRamp, SupportedModes,
};
use devices::{Description, Placement};

use crate::node;

/// Whether this firmware does something with an object of a device so described, or shows something in it.
pub fn acts_on(description: &Description, mux: Mux) -> bool {
    let by_axis = description.axes.iter().take(MAX_AXES).any(|axis| {
        // Sub-index 0 of a record only counts its entries.
        let counts = |known: &Mux| {
            let placed = axis.placement.place(*known);
            mux == placed || (mux.sub_index == 0 && mux.index == placed.index && placed.sub_index > 0)
        };
        let is_gain = axis.loops.as_ref().is_some_and(|loops| {
            let others = [loops.demand, loops.speed_filter, loops.position_proportional].into_iter().flatten();
            let gains = [loops.speed_proportional, loops.speed_integral.object()];
            gains.into_iter().chain(others.map(|quantity| quantity.object)).any(|gain| gain == mux)
        });
        is_gain || slots::AxisSlots::OBJECTS.iter().any(counts)
    });
    by_axis || mux == COMMUNICATION_CYCLE_PERIOD || node::acts_on(mux)
}

/// What a drive so described refuses beyond its rows: for [`Conditions`](canopen::od::Conditions).
pub fn conditions(description: &'static Description) -> impl Iterator<Item = (Slot, Condition)> {
    let table = description.dictionary;
    let of_axis = move |placement: Placement, mux: Mux, checks: &'static [(u16, Check)]| {
        // The checks know the object by its index; a second sub-index has no room for what belongs to one axis.
        let placed = placement.place(mux);
        let is_by_index = matches!(placement, Placement::IndexOffset(_));
        let check = checks.iter().find(|(index, _)| is_by_index && *index == placed.index)?.1;
        Some((table.find(placed).ok()?, Condition::Check(check)))
    };
    let modes =
        description.axes.iter().filter_map(move |axis| of_axis(axis.placement, MODES_OF_OPERATION, MODE_CHECKS));
    let set_points = description
        .axes
        .iter()
        .filter_map(move |axis| of_axis(axis.placement, INTERPOLATION_DATA_RECORD_1ST_SET_POINT, SET_POINT_CHECKS));
    let factors = table.iter().filter(|(_, row)| {
        let is_factor = |factor: u16| row.index % 0x800 == factor % 0x800;
        is_of_profile(row) && FACTORS.into_iter().any(is_factor) && matches!(row.sub_index, 1 | 2)
    });
    let factors = factors.filter(move |(_, row)| acts_on(description, row.mux()));
    let factors = factors.map(|(slot, _)| (slot, Condition::Change(is_not_zero)));
    let methods = description.axes.iter().filter_map(move |axis| of_axis(axis.placement, HOMING_METHOD, METHOD_CHECKS));
    let types =
        description.axes.iter().filter_map(move |axis| of_axis(axis.placement, MOTION_PROFILE_TYPE, TYPE_CHECKS));
    let stops = description.axes.iter().flat_map(move |axis| {
        let of_object = |(mux, check)| Some((table.find(axis.placement.place(mux)).ok()?, Condition::Change(check)));
        STOP_CODES.into_iter().filter_map(of_object)
    });
    let without_effect = table.iter().filter(move |(_, row)| {
        let is_taken = row.access.is_writable() && !acts_on(description, row.mux());
        let is_stored = is_left_to_makers(row.mux()) || (row.index % 0x800, row.sub_index) == SIZE_OF_DATA_RECORD;
        is_of_profile(row) && is_taken && !is_stored
    });
    let without_effect = without_effect.map(|(slot, _)| (slot, Condition::Change(node::refused)));
    let others =
        stops.chain(factors).chain(without_effect).chain(node::conditions(table)).chain(node::no_destinations(table));
    modes.chain(set_points).chain(methods).chain(types).chain(others)
}

/// Index within the block of an axis, and sub-index, of what hosts write as they set the buffer of interpolated position up and
/// cannot read (60C4h:05): a set-point has the bytes of 60C1h whatever they say.
const SIZE_OF_DATA_RECORD: (u16, u8) = (0x60C4 % 0x800, 5);

/// Objects of the profile whose content CiA 402-2 leaves to makers: parameters of the loops of torque, velocity and position and of the
/// power stage, data of motor and drive, and the texts that name these two. As the maker's own objects (2000h to 5FFFh) they are stored
/// and answered, and no loop of this firmware uses them unless the description names them: the lists with which makers' drives are started
/// write them.
pub const fn is_left_to_makers(mux: Mux) -> bool {
    let first_axis = 0x6000 + mux.index % 0x800;
    let is_of_profile = matches!(mux.index, 0x6000..=0x9FFF);
    is_of_profile
        && matches!(
            first_axis,
            0x60F6 | 0x60F7 | 0x60F9 | 0x60FB | 0x6403..=0x6405 | 0x6410 | 0x6503..=0x6505 | 0x6510
        )
}

/// Of the blocks of the axes (CiA 402-1).
fn is_of_profile(row: &Entry) -> bool {
    (0x6000..=0x9FFF).contains(&row.index)
}

/// How ramps look.
const MOTION_PROFILE_TYPE: Mux = Mux::new(0x6086, 0);

/// Fractions of a numerator at sub-index 1 and a divisor at 2: encoder resolution, gear ratio, feed, the factors of the profile's
/// first edition, and of velocity mode the set-point factor and the dimension factor.
const FACTORS: [u16; 10] = [0x608F, 0x6091, 0x6092, 0x6093, 0x6094, 0x6095, 0x6096, 0x6097, 0x604B, 0x604C];

/// Option codes that say how the shaft is brought to rest: what the standard reserves or leaves to makers is refused (CiA 402-2,
/// tables 33 to 44), but for what a file delivers.
const STOP_CODES: [(Mux, Check); 5] = [
    (Mux::new(0x605A, 0), |_, raw| is_ramp(QuickStopOption(raw as i16).ramp())),
    (Mux::new(0x605B, 0), |_, raw| is_ramp(ShutdownOption(raw as i16).ramp())),
    (Mux::new(0x605C, 0), |_, raw| is_ramp(DisableOperationOption(raw as i16).ramp())),
    (Mux::new(0x605D, 0), |_, raw| is_ramp(HaltOption(raw as i16).ramp())),
    (Mux::new(0x605E, 0), |_, raw| is_ramp(FaultReactionOption(raw as i16).ramp())),
];

fn is_ramp(ramp: Option<StopRamp>) -> Result<(), AbortCode> {
    ramp.map(|_| ()).ok_or(AbortCode::INVALID_VALUE)
}

/// By the index of the object: an axis' block of the profile area begins at each 800h (CiA 402-1).
macro_rules! by_axis {
    ($check:ident, $index:literal) => {
        &[
            ($index, $check::<0x0000>),
            ($index + 0x0800, $check::<0x0800>),
            ($index + 0x1000, $check::<0x1000>),
            ($index + 0x1800, $check::<0x1800>),
            ($index + 0x2000, $check::<0x2000>),
            ($index + 0x2800, $check::<0x2800>),
            ($index + 0x3000, $check::<0x3000>),
            ($index + 0x3800, $check::<0x3800>),
        ]
    };
}

const MODE_CHECKS: &[(u16, Check)] = by_axis!(mode_is_supported, 0x6060);
const SET_POINT_CHECKS: &[(u16, Check)] = by_axis!(buffer_has_room, 0x60C1);
const METHOD_CHECKS: &[(u16, Check)] = by_axis!(method_is_supported, 0x6098);

/// 6098h: a method that this firmware has, and that 60E3h lists where the axis has 60E3h with a list in it; or none.
fn method_is_supported<const OFFSET: u16>(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let method = HomingMethod(raw as i8);
    let listed = |sub_index| values.value(Mux::new(0x60E3 + OFFSET, sub_index)).unwrap_or(0) as i8;
    let mut list =
        (1..=u8::MAX - 1).take(usize::from(listed(0) as u8)).map(listed).filter(|method| *method != 0).peekable();
    let is_listed = list.peek().is_none() || list.any(|listed| listed == method.0);
    let is_supported = method == HomingMethod::NONE || (method.sequence().is_some() && is_listed);
    if is_supported { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

const TYPE_CHECKS: &[(u16, Check)] = by_axis!(profile_type_is_supported, 0x6086);

/// 6086h: linear, or jerk-limited where the axis has a jerk (60A4h).
fn profile_type_is_supported<const OFFSET: u16>(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let has_jerk = values.value(Mux::new(0x60A4 + OFFSET, 1)).is_ok();
    if raw as i16 == 0 || (raw as i16 == 3 && has_jerk) { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

/// 6060h: a mode that 6502h has, where the axis has 6502h.
fn mode_is_supported<const OFFSET: u16>(values: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    let mode = ModeOfOperation(raw as i8);
    let Ok(modes) = values.value(Mux::new(0x6502 + OFFSET, 0)) else { return Ok(()) };
    let supported = mode == ModeOfOperation::NONE || SupportedModes(modes as u32).has(mode);
    if supported { Ok(()) } else { Err(AbortCode::INVALID_VALUE) }
}

/// A fraction with a 0 in it scales nothing.
fn is_not_zero(_: &View<'_>, raw: u32) -> Result<(), AbortCode> {
    if raw == 0 { Err(AbortCode::VALUE_TOO_LOW) } else { Ok(()) }
}

/// 60C1h:01 in ip: a first-in-first-out buffer that is full (60C4h:04 counts what waits) takes no more.
fn buffer_has_room<const OFFSET: u16>(values: &View<'_>, _raw: u32) -> Result<(), AbortCode> {
    let of_buffer = |sub_index| values.value(Mux::new(0x60C4 + OFFSET, sub_index));
    let (Ok(size @ 2..), Ok(waiting)) = (of_buffer(2), of_buffer(4)) else { return Ok(()) };
    let is_ring = of_buffer(3) == Ok(1);
    let in_ip = values.value(Mux::new(0x6061 + OFFSET, 0)) == Ok(i64::from(ModeOfOperation::INTERPOLATED_POSITION.0));
    if in_ip && !is_ring && waiting >= size { Err(AbortCode::DEVICE_STATE) } else { Ok(()) }
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

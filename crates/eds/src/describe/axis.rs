//! The axes of a file of CiA 402: as the standard has them, without what the file does not have of it.

use super::rows::DraftRow;
use canopen::Mux;
use canopen::od::{DefaultValue, Table};
use cia402::object::SUPPORTED_DRIVE_MODES;
use cia402::{ModeOfOperation, SupportedModes};
use devices::servo::{self, objects::INCREMENTS_PER_TURN};
use devices::{AxisDescription, CountsPerTurn, HomingRules, Placement, Quantity, Ramps, Scale, Units};

/// Most axes of a device: eight blocks of 800h from 6000h on (CiA 402-1).
const MOST_AXES: u16 = 8;
pub(super) const BLOCK: u16 = 0x800;

/// The axes: each block of the profile area that has a controlword and a statusword. None for a device that is not a drive by
/// 1000h; makers often leave its value open, and then the objects decide.
pub(super) fn axes(table: &'static Table, device_type: u32) -> Vec<AxisDescription> {
    if !matches!(device_type & 0xFFFF, 0 | 402) {
        return Vec::new();
    }
    let placements = (0..MOST_AXES).map(|number| Placement::IndexOffset(number * BLOCK));
    placements.filter_map(|placement| AxisObjects { table, placement }.axis()).collect()
}

/// The objects of one axis, named as those of the first.
struct AxisObjects {
    table: &'static Table,
    placement: Placement,
}

impl AxisObjects {
    fn axis(&self) -> Option<AxisDescription> {
        if !(self.has(0x6040, 0) && self.has(0x6041, 0)) {
            return None;
        }
        let standard = servo::axis(self.placement, Box::leak(self.modes().into_boxed_slice()));
        let is_there = |homing: &HomingRules| self.table.find(homing.method).is_ok();
        Some(AxisDescription {
            mode_display: self.placement.place(Mux::new(if self.has(0x6061, 0) { 0x6061 } else { 0x6060 }, 0)),
            homing: standard
                .homing
                .filter(is_there)
                .map(|homing| HomingRules { search_speed: self.there(homing.search_speed), ..homing }),
            units: match standard.velocity_mode() {
                ModeOfOperation::VELOCITY => self.units_of_velocity_mode(self.units(standard.units)),
                _ => self.units(standard.units),
            },
            ..standard
        })
    }

    fn has(&self, index: u16, sub_index: u8) -> bool {
        self.table.find(self.placement.place(Mux::new(index, sub_index))).is_ok()
    }

    /// An axis without another mode for speeds turns by 6042h. Factors that the file does not have are 1.
    fn units_of_velocity_mode(&self, units: Units) -> Units {
        let (target, actual, ramps) = servo::VELOCITY_MODE;
        let placed = |quantity: Quantity| Quantity {
            object: self.placement.place(quantity.object),
            scale: self.with_factors(quantity.scale),
        };
        let ramps = match ramps {
            Ramps::Rates { acceleration, deceleration, quick_stop, scale, none_from } => Ramps::Rates {
                acceleration: self.placement.place(acceleration),
                deceleration: self.placement.place(deceleration),
                quick_stop: quick_stop.map(|place| self.placement.place(place)),
                scale: self.with_factors(scale),
                none_from,
            },
            times => times,
        };
        Units {
            target_velocity: self.there(Some(placed(target))),
            actual_velocity: self.there(Some(placed(actual))).or(units.actual_velocity),
            ramps: self.ramps(ramps),
            ..units
        }
    }

    /// A scale where this axis has it, without the factors that it does not have.
    fn with_factors(&self, scale: Scale) -> Scale {
        let there = |factor: Option<Mux>| {
            factor.map(|mux| self.placement.place(mux)).filter(|mux| self.table.find(*mux).is_ok())
        };
        match scale {
            Scale::Factors { times, over } => Scale::Factors { times: times.map(there), over: over.map(there) },
            Scale::InTime { times, over } => Scale::InTime { times: there(times), over: there(over) },
            scale => scale,
        }
    }

    /// A quantity whose object is there, and the rated value too where it is a share of one.
    fn there(&self, quantity: Option<Quantity>) -> Option<Quantity> {
        quantity.filter(|quantity| {
            let rated = match quantity.scale {
                Scale::Rated { rated, .. } => self.table.find(rated).is_ok(),
                _ => true,
            };
            rated && self.table.find(quantity.object).is_ok()
        })
    }

    fn units(&self, standard: Units) -> Units {
        Units {
            counts_per_turn: self.counts_per_turn(standard.counts_per_turn),
            target_velocity: self.there(standard.target_velocity),
            actual_velocity: self.there(standard.actual_velocity),
            profile_velocity: self.there(standard.profile_velocity),
            ramps: standard.ramps.and_then(|ramps| self.ramps(ramps)),
            target_current: self.there(standard.target_current),
            actual_current: self.there(standard.actual_current),
            bus_voltage: self.there(standard.bus_voltage),
            motor_temperature: self.there(standard.motor_temperature),
            driver_temperature: self.there(standard.driver_temperature),
        }
    }

    /// None without an acceleration; a file without a deceleration has one for both.
    fn ramps(&self, standard: Ramps) -> Option<Ramps> {
        let Ramps::Rates { acceleration, deceleration, quick_stop, scale, none_from } = standard else {
            return Some(standard);
        };
        let is_there = |place: &Mux| self.table.find(*place).is_ok();
        is_there(&acceleration).then(|| Ramps::Rates {
            acceleration,
            deceleration: if is_there(&deceleration) { deceleration } else { acceleration },
            quick_stop: quick_stop.filter(is_there),
            scale,
            none_from,
        })
    }

    /// Feed over gear, where the file has both; else the encoder's; else that of the standard's servo here.
    fn counts_per_turn(&self, standard: CountsPerTurn) -> CountsPerTurn {
        let both = |index| self.has(index, 1) && self.has(index, 2);
        if both(0x6091) && both(0x6092) {
            return standard;
        }
        if both(0x608F) {
            let place = |sub_index| Some(self.placement.place(Mux::new(0x608F, sub_index)));
            return CountsPerTurn::Ratio { times: [place(1), None], over: [place(2), None] };
        }
        CountsPerTurn::Fixed(INCREMENTS_PER_TURN.unsigned_abs() as u32)
    }

    /// Those that 6502h says; without it, those whose objects are there.
    fn modes(&self) -> Vec<ModeOfOperation> {
        let of_standard = (1..=11).map(ModeOfOperation).filter(|mode| mode.name().is_some());
        if let Some(said) = self.supported_modes() {
            return of_standard.filter(|mode| said.has(*mode)).collect();
        }
        by_objects(|index, sub_index| self.has(index, sub_index))
    }

    fn supported_modes(&self) -> Option<SupportedModes> {
        let slot = self.table.find(self.placement.place(SUPPORTED_DRIVE_MODES)).ok()?;
        match self.table.row(slot).default {
            DefaultValue::Value(bits) => u32::try_from(bits).ok().filter(|bits| *bits != 0).map(SupportedModes),
            _ => None,
        }
    }
}

/// The modes whose objects are there; the cyclic ones are given a set-point each period of 60C2h.
fn by_objects(has: impl Fn(u16, u8) -> bool) -> Vec<ModeOfOperation> {
    use ModeOfOperation as Mode;
    let cyclic = has(0x60C2, 1);
    let of_objects = [
        (Mode::PROFILE_POSITION, has(0x607A, 0)),
        (Mode::VELOCITY, has(0x6042, 0)),
        (Mode::PROFILE_VELOCITY, has(0x60FF, 0)),
        (Mode::PROFILE_TORQUE, has(0x6071, 0)),
        (Mode::HOMING, has(0x6098, 0)),
        (Mode::INTERPOLATED_POSITION, has(0x60C1, 1)),
        (Mode::CYCLIC_SYNCHRONOUS_POSITION, cyclic && has(0x607A, 0)),
        (Mode::CYCLIC_SYNCHRONOUS_VELOCITY, cyclic && has(0x60FF, 0)),
        (Mode::CYCLIC_SYNCHRONOUS_TORQUE, cyclic && has(0x6071, 0)),
        (Mode::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE, cyclic && has(0x6071, 0) && has(0x60EA, 0)),
    ];
    of_objects.into_iter().filter(|(_, is_there)| *is_there).map(|(mode, _)| mode).collect()
}

/// A 6502h that says no mode, as many files have it, which leave the value to the device: the modes whose objects are there. It
/// would say otherwise that the axis has none.
pub(super) fn say_modes(rows: &mut [DraftRow]) {
    for number in 0..MOST_AXES {
        let place = |index: u16, sub_index| Mux::new(index + number * BLOCK, sub_index);
        let find = |mux: Mux| rows.binary_search_by_key(&mux.key(), |row| row.entry.mux().key()).ok();
        let Some(at) = find(place(0x6502, 0)) else { continue };
        if rows[at].entry.default != DefaultValue::Value(0) {
            continue;
        }
        let modes = by_objects(|index, sub_index| find(place(index, sub_index)).is_some());
        let modes = modes.into_iter().fold(SupportedModes::default(), SupportedModes::with);
        rows[at].entry.default = DefaultValue::Value(i64::from(modes.0));
    }
}

//! The axes of a file of CiA 402: as the standard has them, with what the file has of it.

use canopen::Mux;
use canopen::od::{DefaultValue, Table};
use cia402::{ModeOfOperation, Statusword, SupportedModes};
use devices::{
    AxisDescription, BitPattern, CountsPerTurn, HomingRules, HomingStart, NewSetPoint, Placement, PowerStyle, Quantity,
    Ramps, Scale, Units, servo,
};

/// Most axes of a device: eight blocks of 800h from 6000h on (CiA 402-1).
const MOST_AXES: u16 = 8;
const BLOCK: u16 = 0x800;

/// The axes: each block of the profile area that has a controlword. None for a device that is no drive by 1000h.
pub(super) fn axes(table: &'static Table, device_type: u32) -> Vec<AxisDescription> {
    if device_type & 0xFFFF != 402 {
        return Vec::new();
    }
    let placements = (0..MOST_AXES).map(|number| Placement::IndexOffset(number * BLOCK));
    placements.filter_map(|placement| of_placement(table, placement)).collect()
}

fn of_placement(table: &'static Table, placement: Placement) -> Option<AxisDescription> {
    let objects = Objects { table, placement };
    objects.has(0x6040, 0).then(|| AxisDescription {
        placement,
        modes: Box::leak(objects.modes().into_boxed_slice()),
        mode_display: placement.place(Mux::new(if objects.has(0x6061, 0) { 0x6061 } else { 0x6060 }, 0)),
        power: PowerStyle::Cia402,
        new_set_point: NewSetPoint::Handshake,
        statusword_bits: &[],
        homing: objects.has(0x6098, 0).then(|| objects.homing()),
        units: objects.units(),
    })
}

/// The objects of one axis, named as those of the first.
struct Objects {
    table: &'static Table,
    placement: Placement,
}

impl Objects {
    fn has(&self, index: u16, sub_index: u8) -> bool {
        self.table.find(self.placement.place(Mux::new(index, sub_index))).is_ok()
    }

    fn default(&self, index: u16) -> Option<i64> {
        let slot = self.table.find(self.placement.place(Mux::new(index, 0))).ok()?;
        match self.table.row(slot).default {
            DefaultValue::Value(value) => Some(value),
            _ => None,
        }
    }

    /// Those that 6502h says; without it, those whose target is there.
    fn modes(&self) -> Vec<ModeOfOperation> {
        use ModeOfOperation as Mode;
        let standard = servo_modes();
        let said = self.default(0x6502).and_then(|bits| u32::try_from(bits).ok()).filter(|bits| *bits != 0);
        if let Some(said) = said.map(SupportedModes) {
            return standard.into_iter().filter(|mode| said.has(*mode)).collect();
        }
        let by_object = [
            (Mode::PROFILE_POSITION, 0x607A),
            (Mode::PROFILE_VELOCITY, 0x60FF),
            (Mode::PROFILE_TORQUE, 0x6071),
            (Mode::HOMING, 0x6098),
        ];
        let mut modes: Vec<Mode> =
            by_object.into_iter().filter(|(_, index)| self.has(*index, 0)).map(|(mode, _)| mode).collect();
        if self.has(0x60C1, 1) {
            modes.push(Mode::INTERPOLATED_POSITION);
        }
        modes
    }

    fn homing(&self) -> HomingRules {
        let bits = Statusword::HOMING_ATTAINED | Statusword::HOMING_ERROR | Statusword::TARGET_REACHED;
        HomingRules {
            method: self.placement.place(Mux::new(0x6098, 0)),
            search_speed: self.velocity(0x6099, 1),
            start: HomingStart::ControlwordBit4,
            attained: BitPattern { mask: bits, value: Statusword::HOMING_ATTAINED | Statusword::TARGET_REACHED },
            failed: BitPattern { mask: Statusword::HOMING_ERROR, value: Statusword::HOMING_ERROR },
        }
    }

    fn units(&self) -> Units {
        Units {
            counts_per_turn: self.counts_per_turn(),
            target_velocity: self.velocity(0x60FF, 0),
            actual_velocity: self.velocity(0x606C, 0),
            profile_velocity: self.velocity(0x6081, 0),
            ramps: self.ramps(),
            target_current: self.current(0x6071),
            actual_current: self.current(0x6078).or_else(|| self.current(0x6077)),
            // In mV.
            bus_voltage: self.quantity(0x6079, 0, Scale::PerCount(1e-3)),
            motor_temperature: None,
            driver_temperature: None,
        }
    }

    fn quantity(&self, index: u16, sub_index: u8, scale: Scale) -> Option<Quantity> {
        let object = self.placement.place(Mux::new(index, sub_index));
        self.has(index, sub_index).then_some(Quantity { object, scale })
    }

    /// Position units a second.
    fn velocity(&self, index: u16, sub_index: u8) -> Option<Quantity> {
        self.quantity(index, sub_index, Scale::Positions(1.0))
    }

    /// Thousandths of the rated current, which is in mA.
    fn current(&self, index: u16) -> Option<Quantity> {
        let rated = self.has(0x6075, 0).then(|| self.placement.place(Mux::new(0x6075, 0)))?;
        self.quantity(index, 0, Scale::Rated { rated, per_count: 1e-6 })
    }

    fn ramps(&self) -> Option<Ramps> {
        let place = |index| self.placement.place(Mux::new(index, 0));
        self.has(0x6083, 0).then(|| Ramps::Rates {
            acceleration: place(0x6083),
            deceleration: place(if self.has(0x6084, 0) { 0x6084 } else { 0x6083 }),
            quick_stop: self.has(0x6085, 0).then(|| place(0x6085)),
            scale: Scale::Positions(1.0),
            none_from: None,
        })
    }

    /// Feed over gear, where the file has both; else the encoder's; else that of the standard's servo here.
    fn counts_per_turn(&self) -> CountsPerTurn {
        let place = |index, sub_index| Some(self.placement.place(Mux::new(index, sub_index)));
        let both = |index| self.has(index, 1) && self.has(index, 2);
        if both(0x6091) && both(0x6092) {
            let (times, over) = ([place(0x6092, 1), place(0x6091, 2)], [place(0x6092, 2), place(0x6091, 1)]);
            return CountsPerTurn::Ratio { times, over };
        }
        if both(0x608F) {
            return CountsPerTurn::Ratio { times: [place(0x608F, 1), None], over: [place(0x608F, 2), None] };
        }
        CountsPerTurn::Fixed(servo::objects::INCREMENTS_PER_TURN as u32)
    }
}

/// The modes of the standard that have a bit in 6502h.
fn servo_modes() -> Vec<ModeOfOperation> {
    (1..=10).map(ModeOfOperation).filter(|mode| mode.name().is_some()).collect()
}

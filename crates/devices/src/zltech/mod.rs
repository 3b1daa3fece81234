//! The two drives of ZLTECH: one maker's firmware, with the same identity, the same communication objects and the same way of
//! storing parameters.
//!
//! Sources: "ZLAC8030L quick start guide V1.00" and "ZLIM42-C user manual V1.03". What differs, and be it the number of an
//! object, stands in the drive's own folder.

mod communication;
mod values;
pub mod zlac8030l;
pub mod zlim42c;

use canopen::pdo::{EventTrigger, MappingRules};
use canopen::{EmcyErrorCode, Mux};
use cia402::object;

use crate::description::{Identity, ParameterStorage, PdoRules, Write};
use crate::stated::Stated;
use crate::terminals::{Input, InputSignal, Meaning};
use crate::units::Ramps;

pub use zlac8030l::{ZLAC8030L, ZLAC8030L_2_01};
pub use zlim42c::{ZLIM42C, ZLIM42C_82};

/// One count of a PDO's inhibit time and event timer (ZLAC8030L, 6.1; the ZLIM42-C's manual gives none).
const PDO_TIMER_UNIT_NS: u64 = 500_000;

/// The same for both, though their objects have other meanings.
const IDENTITY: Identity = Identity { device_type: 0x0004_0192, vendor_id: 0x100, product_code: 1, revision_number: 0 };

/// PDO timers in 0.5 ms, PDOs that may be changed while they are valid, four objects in a mapping.
const PDO_RULES: PdoRules = PdoRules {
    inhibit_unit_ns: PDO_TIMER_UNIT_NS,
    event_timer_unit_ns: PDO_TIMER_UNIT_NS,
    // The manuals say nothing of an RPDO's event timer: silence of the host is 2000h's.
    rpdo_deadline: false,
    max_objects: 4,
    // The manuals are silent; CiA advises against remote frames (application note 802).
    remote_requests: false,
    remap_while_valid: true,
    fixed_mapping: false,
    first_in_manual: 0,
    mapping: MappingRules { dummy_entries: 0, multiplexed: false, ..MappingRules::CIA_301 },
    // Event-driven PDOs as the ZLAC8030L's manual has them (6.1); the ZLIM42-C's gives no more than the object table.
    event_trigger: EventTrigger::ChangeOr255ByTimer,
    // The manuals are silent; CiA 301 asks it of a device with EMCY.
    short_rpdo: Some(EmcyErrorCode::PDO_NOT_PROCESSED),
};

/// 6083h to 6085h are times.
const RAMPS: Ramps = Ramps::Times {
    acceleration: object::PROFILE_ACCELERATION,
    deceleration: object::PROFILE_DECELERATION,
    quick_stop: object::QUICK_STOP_DECELERATION,
};

/// Value of the register parameter setting that restores factory settings.
pub const RESTORE: u32 = 1;

/// Value of the register parameter setting that saves all stored parameters.
pub const SAVE: u32 = 2;

/// The digital input of this bit: 2030h says what it is for, X0 at sub-index 02.
const fn input(name: &'static str, bit: u8, signals: &'static [(i64, InputSignal)]) -> Input {
    Input { name, bit, meaning: Meaning::Chosen { function: Mux::new(0x2030, 2 + bit), signals } }
}

/// How parameters are stored: by the object `register` as a whole, each with its write while the object `save_on_write` is
/// 0, as delivered.
const fn parameter_storage(
    register: u16,
    save_on_write: u16,
    effective_after_restart: &'static [Mux],
    address: &'static [Mux],
) -> ParameterStorage {
    ParameterStorage {
        save: Some(Write { object: Mux::new(register, 0), value: SAVE }),
        saved: None,
        restore: Some(Write { object: Mux::new(register, 0), value: RESTORE }),
        save_on_write: Some((Write { object: Mux::new(save_on_write, 0), value: 0 }, true)),
        effective_after_restart,
        address,
    }
}

/// Both tables of the ZLIM42-C (5.3.1, 5.3.2), and the other sibling of the ZLAC8030L; CiA 402-2, 8.4.2 has a warning beside the
/// fault, not with it.
const WARNING_IN_FAULT: Stated = Stated {
    key: "warning_bit_in_fault",
    object: object::STATUSWORD,
    what: "bit 7 is set in fault",
    remedy: "take it for a warning only while bit 3 is clear",
};

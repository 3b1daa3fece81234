//! What both models are on the bus, as const data: for the firmware and for [`DriveProfile`](crate::profile::DriveProfile).

use canopen::node::NodeProfile;
use canopen::od::Table;
use canopen::pdo::{EventTrigger, MappingRules};
use canopen::{EmcyErrorCode, Mux};

use crate::profile::{Identity, ParameterStorage, PdoRules, Quirk, Ramps, Write, communication};

/// One count of a PDO's inhibit time and event timer (ZLAC8030L, 6.1; the ZLIM42-C's manual gives none).
const PDO_TIMER_UNIT_NS: u64 = 500_000;

/// How the drives communicate: by their PDO rules and quirks, event-driven PDOs as the ZLAC8030L's manual has them
/// (6.1; the ZLIM42-C's gives no more than the object table).
pub(crate) const fn node_profile(table: &'static Table, pdo: &PdoRules, quirks: &[Quirk]) -> NodeProfile {
    NodeProfile { event_trigger: EventTrigger::ChangeOr255ByTimer, ..communication(table, pdo, quirks) }
}

/// The same for both, though their objects have other meanings.
pub(crate) const IDENTITY: Identity =
    Identity { device_type: 0x0004_0192, vendor_id: 0x100, product_code: 1, revision_number: 0 };

/// PDO timers in 0.5 ms, PDOs that may be changed while they are valid, four objects in a mapping.
pub(crate) const PDO_RULES: PdoRules = PdoRules {
    inhibit_unit_ns: PDO_TIMER_UNIT_NS,
    event_timer_unit_ns: PDO_TIMER_UNIT_NS,
    max_objects: 4,
    remap_while_valid: true,
    fixed_mapping: false,
    mapping: MappingRules::CIA_301,
    // The manuals are silent; CiA 301 asks it of a device with EMCY.
    short_rpdo: Some(EmcyErrorCode::PDO_NOT_PROCESSED),
};

/// 6083h to 6085h are times.
pub(crate) const RAMPS: Ramps = Ramps::Milliseconds {
    acceleration: Mux::new(0x6083, 0),
    deceleration: Mux::new(0x6084, 0),
    quick_stop: Mux::new(0x6085, 0),
};

/// Value of the register parameter setting that restores factory settings.
pub(crate) const RESTORE: u32 = 1;

/// Value of the register parameter setting that saves all stored parameters.
pub(crate) const SAVE: u32 = 2;

/// How parameters are stored: by the object `register` as a whole, each with its write while the object `save_on_write` is
/// 0, as delivered.
pub(crate) const fn parameter_storage(
    register: u16,
    save_on_write: u16,
    effective_after_restart: &'static [Mux],
) -> ParameterStorage {
    ParameterStorage {
        save: Write { object: Mux::new(register, 0), value: SAVE },
        restore: Some(Write { object: Mux::new(register, 0), value: RESTORE }),
        save_on_write: Some((Write { object: Mux::new(save_on_write, 0), value: 0 }, true)),
        effective_after_restart,
    }
}

//! How a firmware communicates, by its description.

use canopen::node::NodeProfile;
use canopen::sdo::block::MAX_BLOCK_SIZE;
use devices::Description;

/// How a firmware with this description communicates: a master reads of a drive what the drive does.
pub const fn communication(description: &Description) -> NodeProfile {
    let pdo = &description.pdo;
    NodeProfile {
        start_state: description.nmt.start_state,
        emcy: description.sends_emcy(),
        inhibit_unit_ns: pdo.inhibit_unit_ns,
        event_timer_unit_ns: pdo.event_timer_unit_ns,
        rpdo_deadline: pdo.rpdo_deadline,
        event_trigger: pdo.event_trigger,
        remote_requests: pdo.remote_requests,
        pdo_changes_while_valid: pdo.remap_while_valid,
        mapping: pdo.mapping,
        short_rpdo: pdo.short_rpdo,
        sdo_block_size: if description.sdo_block_transfer { MAX_BLOCK_SIZE } else { 0 },
        ..NodeProfile::cia_301(description.dictionary)
    }
}

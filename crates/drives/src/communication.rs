//! How a firmware communicates, by its description.

use canopen::NmtState;
use canopen::node::NodeProfile;
use canopen::pdo::EventTrigger;
use devices::{Description, Quirk};

/// How a firmware with this description communicates: a master reads of a drive what the drive does.
pub(crate) const fn communication(description: &Description) -> NodeProfile {
    let standard = NodeProfile::cia_301(description.table);
    let (pdo, quirks) = (&description.pdo, description.quirks);
    NodeProfile {
        start_state: if Quirk::StartsOperational.is_in(quirks) { NmtState::Operational } else { standard.start_state },
        emcy: !Quirk::NoEmcy.is_in(quirks),
        inhibit_unit_ns: pdo.inhibit_unit_ns,
        event_timer_unit_ns: pdo.event_timer_unit_ns,
        event_trigger: if Quirk::TpdoAnswersRpdo.is_in(quirks) {
            EventTrigger::AnswersRpdo
        } else {
            standard.event_trigger
        },
        pdo_changes_while_valid: pdo.remap_while_valid,
        mapping: pdo.mapping,
        short_rpdo: pdo.short_rpdo,
        ..standard
    }
}

//! What the two ZLTECH drives have in common: one maker's firmware, with the same way of storing parameters and the same
//! meaning of most CiA 402 objects.
//!
//! Sources: "ZLAC8030L quick start guide V1.00" and "ZLIM42-C user manual V1.03". What differs stands in the drive's own folder.

mod parameters;
mod storage;
pub(crate) mod terminals;

use canopen::node::NodeProfile;
use canopen::pdo::EventTrigger;
use devices::Description;

use crate::communication::communication;

pub(crate) use parameters::ProfileObjects;
pub(crate) use storage::{mark_if_saving, register_command};

/// How the drives communicate: as described, event-driven PDOs as the ZLAC8030L's manual has them (6.1; the ZLIM42-C's gives
/// no more than the object table).
pub(crate) const fn node_profile(description: &Description) -> NodeProfile {
    NodeProfile { event_trigger: EventTrigger::ChangeOr255ByTimer, ..communication(description) }
}

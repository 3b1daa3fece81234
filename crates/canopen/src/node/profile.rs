use crate::emcy::EmcyErrorCode;
use crate::od::{Conditions, Dictionary, Storage, Table};
use crate::pdo::{EventTrigger, MappingRules};
use crate::sdo::block::MAX_BLOCK_SIZE;
use crate::sdo::server::FrameLength;
use crate::{Mux, NmtState, NodeId};

/// What differs between devices in their communication. Constant data.
///
/// Start from [`cia_301`](Self::cia_301) and change what a manual says otherwise.
#[derive(Clone, Copy)]
pub struct NodeProfile {
    /// The object rows.
    pub table: &'static Table,
    /// What downloads have to pass besides their rows.
    pub conditions: &'static Conditions,
    /// Which communication objects (1000h to 1FFFh) have an effect. Of the others a client may write the value that is there, and
    /// no other (0609 0030h).
    pub acts_on: fn(Mux) -> bool,
    /// NMT state entered after boot-up.
    pub start_state: NmtState,
    /// The device sends EMCY messages.
    pub emcy: bool,
    /// One count of a PDO's inhibit time (sub-index 03h).
    pub inhibit_unit_ns: u64,
    /// One count of a PDO's event timer (sub-index 05h).
    pub event_timer_unit_ns: u64,
    /// The event timer of an RPDO is a deadline: [`NodeEvent::RpdoTimedOut`](super::NodeEvent::RpdoTimedOut). CiA 301 leaves
    /// that to the device.
    pub rpdo_deadline: bool,
    /// What makes the device send TPDOs of type 254 and 255.
    pub event_trigger: EventTrigger,
    /// Remote frames that ask for a TPDO are answered where bit 30 of its COB-ID allows it, and transmission types 252 and 253
    /// are taken.
    pub remote_requests: bool,
    /// COB-ID, inhibit time and mapping of a PDO may be changed while it is valid, and the COB-ID of EMCY.
    pub pdo_changes_while_valid: bool,
    /// What entries of a mapping it takes.
    pub mapping: MappingRules,
    /// The EMCY error code of an RPDO with fewer bytes than are mapped; `None` if it is not reported. Such a frame is
    /// never used. Of a longer one the mapped bytes are, and nothing is reported: CiA 301 has 8220h for it and leaves it to
    /// the device, and many masters send eight bytes whatever they mean.
    pub short_rpdo: Option<EmcyErrorCode>,
    /// Which SDO frames are heard, by length.
    pub sdo_frame_length: FrameLength,
    /// A segmented SDO transfer is aborted when the client is silent this long; 0 for never.
    pub sdo_timeout_ns: u64,
    /// SDO block transfer: segments of the blocks that it asks for, up to 127; 0 for a device without block transfer.
    pub sdo_block_size: u8,
}

impl NodeProfile {
    /// Longest silence of a client within a segmented transfer. CiA 301 leaves it to the device; long enough for a
    /// host that pauses, short enough that a client that went away does not hold the channel.
    pub const SDO_TIMEOUT_NS: u64 = 1_000_000_000;

    /// What CiA 301 says: pre-operational after boot-up, inhibit time in 100 us, event timer in 1 ms, PDOs to be made
    /// invalid before they are changed, SDO frames of eight bytes, block transfer with blocks as long as they can be.
    pub const fn cia_301(table: &'static Table) -> Self {
        Self {
            table,
            conditions: Conditions::NONE,
            acts_on: all,
            start_state: NmtState::PreOperational,
            emcy: true,
            inhibit_unit_ns: 100_000,
            event_timer_unit_ns: 1_000_000,
            rpdo_deadline: true,
            event_trigger: EventTrigger::Change,
            remote_requests: true,
            pdo_changes_while_valid: false,
            mapping: MappingRules::CIA_301,
            short_rpdo: Some(EmcyErrorCode::PDO_NOT_PROCESSED),
            sdo_frame_length: FrameLength::Eight,
            sdo_timeout_ns: Self::SDO_TIMEOUT_NS,
            sdo_block_size: MAX_BLOCK_SIZE,
        }
    }
}

const fn all(_: Mux) -> bool {
    true
}

impl NodeProfile {
    /// Factory values for a device with this node-ID.
    ///
    /// # Panics
    /// If the storage has not enough room.
    pub fn factory_values<S: Storage>(&self, node_id: NodeId) -> Dictionary<S> {
        Dictionary::new(self.table, node_id).with_conditions(self.conditions)
    }
}

impl core::fmt::Debug for NodeProfile {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("NodeProfile")
            .field("rows", &self.table.rows().len())
            .field("start_state", &self.start_state)
            .finish_non_exhaustive()
    }
}

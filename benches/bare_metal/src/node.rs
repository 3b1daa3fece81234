//! A node with 30 objects: heartbeat, EMCY, SYNC, an SDO server, an RPDO and a TPDO, and the values of its own.
//! An index is an object; entries (sub-indices) are 41.

use canopen::od::{Access, DataType, Entry, Fixed, Index, Object, Table};
use canopen::{Node, NodeEvent, NodeId, NodeProfile};

use Access::{Const, ReadOnly, ReadWrite};
use DataType::{Integer16, Unsigned8, Unsigned16, Unsigned32, VisibleString};

use crate::{Board, exchange};

static ROWS: [Entry; 41] = [
    Entry::new(0x1000, 0, Unsigned32, Const, "device_type", "Device type").default(0x0004_0191),
    Entry::new(0x1001, 0, Unsigned8, ReadOnly, "error_register", "Error register"),
    Entry::new(0x1005, 0, Unsigned32, ReadWrite, "sync_cob_id", "COB-ID SYNC").default(0x80),
    Entry::new(0x1008, 0, VisibleString, Const, "device_name", "Manufacturer device name").text("sensor"),
    Entry::new(0x100A, 0, VisibleString, Const, "software_version", "Manufacturer software version").text("1.0"),
    Entry::new(0x1014, 0, Unsigned32, ReadWrite, "emcy_cob_id", "COB-ID EMCY").node_id_plus(0x80),
    Entry::new(0x1017, 0, Unsigned16, ReadWrite, "heartbeat_time", "Producer heartbeat time").default(1000),
    Entry::new(0x1018, 1, Unsigned32, Const, "vendor_id", "Vendor-ID"),
    Entry::new(0x1018, 2, Unsigned32, Const, "product_code", "Product code"),
    Entry::new(0x1018, 3, Unsigned32, Const, "revision", "Revision number"),
    Entry::new(0x1018, 4, Unsigned32, Const, "serial_number", "Serial number"),
    Entry::new(0x1200, 1, Unsigned32, Const, "sdo_request", "COB-ID client to server").node_id_plus(0x600),
    Entry::new(0x1200, 2, Unsigned32, Const, "sdo_response", "COB-ID server to client").node_id_plus(0x580),
    Entry::new(0x1400, 1, Unsigned32, ReadWrite, "rpdo_cob_id", "COB-ID used by RPDO").node_id_plus(0x200),
    Entry::new(0x1400, 2, Unsigned8, ReadWrite, "rpdo_type", "Transmission type").default(255),
    Entry::new(0x1600, 0, Unsigned8, ReadWrite, "rpdo_count", "Number of mapped objects").default(2),
    Entry::new(0x1600, 1, Unsigned32, ReadWrite, "rpdo_object_1", "First object").default(0x6200_0108),
    Entry::new(0x1600, 2, Unsigned32, ReadWrite, "rpdo_object_2", "Second object").default(0x6411_0110),
    Entry::new(0x1800, 1, Unsigned32, ReadWrite, "tpdo_cob_id", "COB-ID used by TPDO").node_id_plus(0x180),
    Entry::new(0x1800, 2, Unsigned8, ReadWrite, "tpdo_type", "Transmission type").default(255),
    Entry::new(0x1800, 5, Unsigned16, ReadWrite, "tpdo_event_timer", "Event timer").unit("ms"),
    Entry::new(0x1A00, 0, Unsigned8, ReadWrite, "tpdo_count", "Number of mapped objects").default(2),
    Entry::new(0x1A00, 1, Unsigned32, ReadWrite, "tpdo_object_1", "First object").default(0x6000_0108),
    Entry::new(0x1A00, 2, Unsigned32, ReadWrite, "tpdo_object_2", "Second object").default(0x6401_0110),
    Entry::new(0x2000, 0, Unsigned16, ReadWrite, "sample_time", "Time between two samples").unit("ms").default(10),
    Entry::new(0x2001, 0, Integer16, ReadWrite, "offset", "Offset of the analogue input"),
    Entry::new(0x2002, 0, Unsigned32, ReadOnly, "samples", "Samples since the start"),
    Entry::new(0x2003, 0, Integer16, ReadOnly, "lowest", "Lowest value since the start"),
    Entry::new(0x2004, 0, Integer16, ReadOnly, "highest", "Highest value since the start"),
    Entry::new(0x2005, 0, Unsigned16, ReadWrite, "filter_time", "Time constant of the filter").unit("ms"),
    Entry::new(0x2006, 0, Integer16, ReadWrite, "lower_limit", "Lower limit of the alarm").default(-32768),
    Entry::new(0x2007, 0, Integer16, ReadWrite, "upper_limit", "Upper limit of the alarm").default(32767),
    Entry::new(0x2008, 0, Unsigned8, ReadOnly, "alarm", "The value is beyond a limit"),
    Entry::new(0x2009, 0, Unsigned32, ReadOnly, "operating_time", "Time since the start").unit("s"),
    Entry::new(0x6000, 1, Unsigned8, ReadOnly, "inputs", "Read inputs 1 to 8").mappable(),
    Entry::new(0x6002, 1, Unsigned8, ReadWrite, "input_polarity", "Polarity of inputs 1 to 8"),
    Entry::new(0x6200, 1, Unsigned8, ReadWrite, "outputs", "Write outputs 1 to 8").mappable(),
    Entry::new(0x6206, 1, Unsigned8, ReadWrite, "error_mode", "Error mode of outputs 1 to 8"),
    Entry::new(0x6207, 1, Unsigned8, ReadWrite, "error_value", "Error value of outputs 1 to 8"),
    Entry::new(0x6401, 1, Integer16, ReadOnly, "analogue_input", "Analogue input 1").mappable(),
    Entry::new(0x6411, 1, Integer16, ReadWrite, "analogue_output", "Analogue output 1").mappable(),
];
static INDEX: Index<41> = Index::of(&ROWS);
static TABLE: Table = Table::new(&ROWS, &INDEX);
static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);
const SAMPLES: Object<u32> = TABLE.object(0x2002, 0);

/// The node with room for its 30 objects, one PDO each way and eight events.
pub type Sensor = Node<Fixed<41, { TABLE.byte_count() }, 1, 8>>;

/// The node as delivered, node-ID 5, not booted.
pub fn sensor() -> Sensor {
    Node::new(&PROFILE, NodeId::new(5).expect("1 to 127"))
}

/// Power-on: the boot-up message.
pub fn start(node: &mut Sensor, board: &mut impl Board) {
    let now = board.now();
    node.boot(now);
    exchange(node, board, now);
}

/// One round of the main loop: frames in, a sample, events, frames out.
pub fn turn(node: &mut Sensor, board: &mut impl Board) {
    let now = board.now();
    let samples = node.dictionary().get(SAMPLES).wrapping_add(1);
    node.dictionary_mut().set(SAMPLES, samples);
    node.notice_changes(now);
    exchange(node, board, now);
    while let Some(event) = node.poll_event() {
        if matches!(event, NodeEvent::ResetCommunication | NodeEvent::ResetNode) {
            node.reset_communication(now);
        }
    }
}

//! A small drive-like device for the conversations: node 4, in two profiles.

use canopen::od::{Access, Condition, Conditions, DataType, Entry, Index, Slot, Table, condition_numbers};
use canopen::pdo::EventTrigger;
use canopen::{AbortCode, NodeProfile};

use Access::{Const, ReadOnly, ReadWrite, WriteOnly};
use DataType::{Integer8, Integer32, Unsigned8, Unsigned16, Unsigned32, VisibleString};

/// Capacity of the dictionaries in these tests.
pub(crate) const CELLS: usize = 128;

const fn row(index: u16, sub_index: u8, data_type: DataType, access: Access, name: &'static str) -> Entry {
    Entry::new(index, sub_index, data_type, access, name, "")
}

const fn rpdo_parameter(index: u16, base: u32) -> [Entry; 3] {
    [
        row(index, 0, Unsigned8, Const, "rpdo").default(2),
        row(index, 1, Unsigned32, ReadWrite, "cob_id").node_id_plus(base),
        row(index, 2, Unsigned8, ReadWrite, "transmission_type").default(255),
    ]
}

const fn tpdo_parameter(index: u16, base: u32) -> [Entry; 5] {
    [
        row(index, 0, Unsigned8, Const, "tpdo").default(5),
        row(index, 1, Unsigned32, ReadWrite, "cob_id").node_id_plus(base),
        row(index, 2, Unsigned8, ReadWrite, "transmission_type").default(255),
        row(index, 3, Unsigned16, ReadWrite, "inhibit_time"),
        row(index, 5, Unsigned16, ReadWrite, "event_timer"),
    ]
}

const fn mapping(index: u16, count: i64, first: u32) -> [Entry; 5] {
    [
        row(index, 0, Unsigned8, ReadWrite, "mapping").default(count),
        row(index, 1, Unsigned32, ReadWrite, "mapping_1").default(first as i64),
        row(index, 2, Unsigned32, ReadWrite, "mapping_2"),
        row(index, 3, Unsigned32, ReadWrite, "mapping_3"),
        row(index, 4, Unsigned32, ReadWrite, "mapping_4"),
    ]
}

/// 2003h may only be written while 2001h is 0.
fn only_while_2001_is_zero(values: &canopen::od::View<'_>, _raw: u32) -> Result<(), AbortCode> {
    match values.value(canopen::Mux::new(0x2001, 0)) {
        Ok(0) => Ok(()),
        _ => Err(AbortCode::DEVICE_STATE),
    }
}

const GENERAL: [Entry; 15] = [
    row(0x1000, 0, Unsigned32, Const, "device_type").default(0x0004_0192),
    row(0x1001, 0, Unsigned8, ReadOnly, "error_register"),
    row(0x1005, 0, Unsigned32, ReadWrite, "cob_id_sync").default(0x80),
    row(0x1008, 0, VisibleString, Const, "device_name").text("a drive of the tests"),
    row(0x1009, 0, VisibleString, Const, "hardware_version").text("1.0"),
    row(0x100A, 0, VisibleString, Const, "software_version").text(""),
    row(0x1014, 0, Unsigned32, ReadWrite, "cob_id_emcy").node_id_plus(0x80),
    row(0x1015, 0, Unsigned16, ReadWrite, "inhibit_time_emcy"),
    row(0x1017, 0, Unsigned16, ReadWrite, "producer_heartbeat_time").stored(),
    row(0x1018, 0, Unsigned8, Const, "identity").default(2),
    row(0x1018, 1, Unsigned32, Const, "vendor_id").default(0x100),
    row(0x1018, 2, Unsigned32, Const, "product_code").default(1),
    row(0x1200, 0, Unsigned8, Const, "sdo_server").default(2),
    row(0x1200, 1, Unsigned32, Const, "cob_id_client_to_server").node_id_plus(0x600),
    row(0x1200, 2, Unsigned32, Const, "cob_id_server_to_client").node_id_plus(0x580),
];

const APPLICATION: [Entry; 14] = [
    row(0x2000, 0, Unsigned16, WriteOnly, "write_only"),
    row(0x2001, 0, Unsigned8, ReadWrite, "byte_1").mappable(),
    row(0x2002, 0, Unsigned8, ReadWrite, "byte_2").mappable(),
    row(0x2003, 0, Unsigned8, ReadWrite, "guarded").mappable(),
    row(0x2004, 0, Unsigned16, ReadWrite, "unmappable"),
    row(0x2005, 2, Unsigned8, ReadWrite, "sparse"),
    row(0x6040, 0, Unsigned16, ReadWrite, "controlword").mappable(),
    row(0x6041, 0, Unsigned16, ReadOnly, "statusword").mappable(),
    row(0x6060, 0, Integer8, ReadWrite, "modes_of_operation").values(&[(1, "position"), (3, "velocity")]).mappable(),
    row(0x6064, 0, Integer32, ReadOnly, "position_actual_value").mappable(),
    row(0x606C, 0, Integer32, ReadOnly, "velocity_actual_value").mappable(),
    row(0x607A, 0, Integer32, ReadWrite, "target_position").mappable(),
    row(0x6081, 0, Unsigned32, ReadWrite, "profile_velocity").default(120).range(1, 1000),
    row(0x60FF, 0, Integer32, ReadWrite, "target_velocity").range(-1000, 1000).mappable(),
];

const COUNT: usize = GENERAL.len() + 4 * (3 + 5 + 5 + 5) + APPLICATION.len();

static ROWS: [Entry; COUNT] = {
    let mut rows = Rows { rows: [GENERAL[0]; COUNT], count: 0 };
    rows.add(&GENERAL);
    let mut n = 0;
    while n < 4 {
        rows.add(&rpdo_parameter(0x1400 + n, 0x200 + 0x100 * n as u32));
        n += 1;
    }
    rows.add(&mapping(0x1600, 1, 0x6040_0010));
    rows.add(&mapping(0x1601, 1, 0x60FF_0020));
    rows.add(&mapping(0x1602, 0, 0));
    rows.add(&mapping(0x1603, 0, 0));
    n = 0;
    while n < 4 {
        rows.add(&tpdo_parameter(0x1800 + n, 0x180 + 0x100 * n as u32));
        n += 1;
    }
    rows.add(&mapping(0x1A00, 1, 0x6041_0010));
    rows.add(&mapping(0x1A01, 0, 0));
    rows.add(&mapping(0x1A02, 0, 0));
    rows.add(&mapping(0x1A03, 0, 0));
    rows.add(&APPLICATION);
    rows.rows
};

struct Rows {
    rows: [Entry; COUNT],
    count: usize,
}

impl Rows {
    const fn add(&mut self, more: &[Entry]) {
        let mut i = 0;
        while i < more.len() {
            self.rows[self.count] = more[i];
            self.count += 1;
            i += 1;
        }
    }
}

static INDEX: Index<COUNT> = Index::of(&ROWS);

/// The rows of the device.
pub(crate) static TABLE: Table = Table::new(&ROWS, &INDEX);

static GUARDED: [(Slot, Condition); 1] = [(TABLE.slot(0x2003, 0), Condition::Check(only_while_2001_is_zero))];
static NUMBERS: [u16; COUNT] = condition_numbers(&GUARDED);
static CONDITIONS: Conditions = Conditions::new(&GUARDED, &NUMBERS);

/// As CiA 301 has it.
pub(crate) static STANDARD: NodeProfile = NodeProfile { conditions: &CONDITIONS, ..NodeProfile::cia_301(&TABLE) };

/// As the ZLAC8030L quick start guide V1.00, 6.1 has it: timers in 0.5 ms, changes while valid, 255 by its timer; remote
/// frames are not answered.
pub(crate) static LOOSE: NodeProfile = NodeProfile {
    inhibit_unit_ns: 500_000,
    event_timer_unit_ns: 500_000,
    event_trigger: EventTrigger::ChangeOr255ByTimer,
    pdo_changes_while_valid: true,
    remote_requests: false,
    conditions: &CONDITIONS,
    ..NodeProfile::cia_301(&TABLE)
};

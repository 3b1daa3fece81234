//! What a file makes of a bus: the plan of its boot-up, the values that are written, and what is sent then.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use devices::Description;
use eds::keep_of;
use master::boot::{Assignment, BootPlan, Expectation};

use super::bus_yml::{Bus, Slave};
use super::device::Device;
use super::finding::Place;
use super::generated::{Generator, Planned, assignment};
use crate::file::CyclePlan;

/// A bus as its file wants it.
#[derive(Clone, Debug)]
pub struct Intended {
    /// What the master does at the start.
    pub plan: BootPlan,
    /// Its nodes.
    pub nodes: BTreeMap<NodeId, IntendedNode>,
    /// Bit rate.
    pub bitrate: Bitrate,
    /// Period of SYNC; `None`: the master sends none.
    pub cycle: Option<Duration>,
    /// What is moved in cycles; the first of them is what the bus is planned for.
    pub moved: Vec<MovedAt>,
    /// The master's heartbeat.
    pub host_heartbeat: Option<(NodeId, Duration)>,
    /// The place of findings about the whole bus.
    pub at: Place,
}

/// What is moved in cycles, and where the file says its period.
#[derive(Clone, Debug)]
pub struct MovedAt {
    /// The cycle: its period, and the drives that are moved in it.
    pub cycle: CyclePlan,
    /// The place of the period in the file.
    pub at: Place,
}

/// One node of it.
#[derive(Clone, Debug)]
pub struct IntendedNode {
    /// Its name in the file.
    pub name: String,
    /// Where it stands.
    pub at: Place,
    /// What it is.
    pub description: &'static Description,
    /// What is written to it.
    pub writes: Vec<Planned>,
    /// What else of its communication is taken from its data sheet, and is not written because it stands there: heartbeats and PDOs.
    pub of_sheet: BTreeMap<Mux, Vec<u8>>,
}

impl IntendedNode {
    /// Where a write to an object is asked for; else where the node stands.
    pub fn place_of(&self, object: Option<Mux>) -> Place {
        self.writes.iter().find(|write| Some(write.object) == object).map_or(self.at, |write| write.at)
    }

    /// What its objects have in the end: the last write to each.
    pub fn values(&self) -> BTreeMap<Mux, &Planned> {
        self.writes.iter().map(|write| (write.object, write)).collect()
    }
}

/// Default bit rate.
const BITRATE: Bitrate = Bitrate::K500;

/// How long ros2_canopen waits for the boot-up of a node, where the file does not say it.
const BOOT_TIMEOUT: Duration = Duration::from_millis(2000);

/// The bus of a `bus.yml` as `dcfgen` and Lely's master take it.
///
/// # Errors
/// Why it has none, in a sentence.
pub(super) fn of_bus_yml(bus: &Bus, devices: &[Option<Device>]) -> Result<Intended, String> {
    let own = bus.master.node_id.as_ref().and_then(|id| NodeId::new(u8::try_from(id.value).ok()?));
    let own = own.ok_or("the master has no node-ID")?;
    let mut plan = BootPlan { own, heartbeat: None, guard: false, startup: bus.master.startup, ..BootPlan::new([]) };
    let mut nodes = BTreeMap::new();
    let mut generator = Generator::new(bus);
    for (slave, device) in bus.nodes.iter().zip(devices) {
        let device = device.as_ref().ok_or_else(|| format!("{} has no data sheet that can be read", slave.name))?;
        let node = slave.node().ok_or_else(|| format!("{} has no node-ID", slave.name))?;
        let description = match device.model {
            Some(model) => model,
            None => keep_of(&device.eds, &slave.name)
                .map_err(|error| format!("the data sheet of {} cannot be simulated: {error}", slave.name))?,
        };
        let writes = generator.writes(slave, device);
        // The generator reads the file on; a node that is not booted is only listed.
        if slave.assignment.has(Assignment::BOOT) {
            plan.nodes.insert(node, expectation(slave, device, &writes, description));
        }
        let intended = IntendedNode {
            name: slave.name.clone(),
            at: slave.at,
            description,
            of_sheet: of_sheet(device, node, &writes),
            writes,
        };
        if node == own || nodes.insert(node, intended).is_some() {
            return Err(format!("two nodes have the node-ID {node}"));
        }
    }
    let ms = |ms: i64| u32::try_from(ms).ok().filter(|ms| *ms > 0).map(|ms| Duration::from_millis(ms.into()));
    let said = bus.nodes.iter().filter_map(|slave| slave.boot_timeout_ms.as_ref()).chain(&bus.master.boot_timeout_ms);
    let longest = said.filter_map(|time| ms(time.value)).max().unwrap_or(BOOT_TIMEOUT);
    plan.boot_time = Some(ms(bus.master.boot_time_ms).unwrap_or(longest).min(LONGEST_BOOT));
    let cycle = bus.master.sync_period_us.as_ref().and_then(|period| u32::try_from(period.value).ok());
    let beat = bus.master.heartbeat_producer_ms.as_ref().and_then(|time| ms(time.value.min(i64::from(u16::MAX))));
    Ok(Intended {
        plan,
        bitrate: bitrate(bus, &nodes),
        nodes,
        moved: Vec::new(),
        cycle: cycle.filter(|us| *us > 0).map(|us| Duration::from_micros(us.into())),
        host_heartbeat: beat.map(|period| (own, period)),
        at: bus.master.sync_period_us.as_ref().map_or(bus.master.at, |period| period.at),
    })
}

/// The heartbeats and PDOs of a sheet that are not written.
fn of_sheet(device: &Device, node: NodeId, writes: &[Planned]) -> BTreeMap<Mux, Vec<u8>> {
    let is_taken = |index: u16| matches!(index, 0x1016 | 0x1017 | 0x1400..=0x1BFF);
    let variables =
        device.eds.variables().filter(|(index, variable)| is_taken(*index) && variable.access.is_readable());
    let values = variables.filter_map(|(index, variable)| {
        let object = Mux::new(index, variable.sub_index);
        let size = usize::from(variable.data_type.bits()?.div_ceil(8)).min(16);
        Some((object, device.value(object, Some(node))?.to_le_bytes()[..size].to_vec()))
    });
    values.filter(|(object, _)| !writes.iter().any(|write| write.object == *object)).collect()
}

/// A longer time is a slip in a unit.
const LONGEST_BOOT: Duration = Duration::from_secs(60);

/// As said, else that of the first model that is delivered with one.
fn bitrate(bus: &Bus, nodes: &BTreeMap<NodeId, IntendedNode>) -> Bitrate {
    let said = bus.master.baudrate.and_then(|kbit_s| format!("{kbit_s}k").parse().ok());
    said.or_else(|| nodes.values().find_map(|node| node.description.bitrate)).unwrap_or(BITRATE)
}

/// 1F81h to 1F88h and 1F22h of the master, as the generator makes them of the sheet.
fn expectation(slave: &Slave, device: &Device, writes: &[Planned], description: &'static Description) -> Expectation {
    let sheet = |index, sub_index| device.value(Mux::new(index, sub_index), slave.node());
    let number = |index, sub_index| {
        sheet(index, sub_index).and_then(|value| u32::try_from(value).ok()).filter(|value| *value != 0)
    };
    let said = |value: Option<i64>| value.and_then(|value| u32::try_from(value).ok()).filter(|value| *value != 0);
    let period = slave.heartbeat_producer_ms.as_ref().map(|time| time.value);
    let period = period.or_else(|| sheet(0x1017, 0).and_then(|time| i64::try_from(time).ok())).filter(|ms| *ms > 0);
    let heartbeat = period.map(|ms| ms as f64 / 1e3 * slave.heartbeat_multiplier);
    Expectation {
        assignment: assignment(slave),
        device_type: number(0x1000, 0),
        vendor_id: number(0x1018, 1),
        product_code: number(0x1018, 2),
        revision_number: said(slave.revision_number).or_else(|| number(0x1018, 3)),
        serial_number: said(slave.serial_number).or_else(|| number(0x1018, 4)),
        software: said(slave.software_version),
        configuration: writes.iter().map(|write| (write.object, write.bytes.clone())).collect(),
        restore: u8::try_from(slave.restore_configuration).unwrap_or(0),
        heartbeat: heartbeat
            .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
            .map(|time| time.min(LONGEST_BOOT)),
        description: Some(description),
        ..Expectation::default()
    }
}

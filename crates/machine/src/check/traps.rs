//! What goes wrong when such a bus is started, rule by rule. Each rule goes by what the data sheet and the description say of a device;
//! none knows a model by its name. Found with Lely's master, `dcfgen` and ros2_canopen's CiA 402 driver against the virtual drives.

use std::collections::BTreeMap;

use canopen::{Mux, NmtState, NodeId};
use devices::{Description, HostWatch, PowerStyle};

use super::bus_yml::{Bus, Pdo, Slave};
use super::device::Device;
use super::finding::{Reporter, Severity};

/// A node as the rules see it.
pub(super) struct Case<'a> {
    pub(super) bus: &'a Bus,
    pub(super) slave: &'a Slave,
    pub(super) device: Option<&'a Device>,
}

type Rule = fn(&Case<'_>, &mut Reporter<'_>);

/// The rules of a node, by name.
pub(super) const RULES: [(&str, Rule); 16] = [
    ("node-id", node_id),
    ("no-data-sheet", no_data_sheet),
    ("heartbeat", heartbeat),
    ("boot-timeout", boot_timeout),
    ("host-watch", host_watch),
    ("host-silence", host_silence),
    ("node-guarding", node_guarding),
    ("cia402-driver", cia402_driver),
    ("supported-modes", supported_modes),
    ("fixed-mapping", fixed_mapping),
    ("set-point-by-sync", set_point_by_sync),
    ("flood", flood),
    ("pdo-number", pdo_number),
    ("sdo-object", sdo_object),
    ("starts-by-itself", starts_by_itself),
    ("alarm-as-state", alarm_as_state),
];

impl Case<'_> {
    fn model(&self) -> Option<&'static Description> {
        self.device?.model
    }

    fn value(&self, index: u16, sub_index: u8) -> Option<i128> {
        self.device?.value(Mux::new(index, sub_index), self.slave.node())
    }

    fn driver_has(&self, word: &str) -> bool {
        self.slave.driver.as_ref().is_some_and(|driver| driver.value.contains(word))
    }

    /// Time between two heartbeats of the device, in ms: as it is set up, or as delivered.
    fn heartbeat_ms(&self) -> Option<i128> {
        let said = self.slave.heartbeat_producer_ms.as_ref().map(|said| i128::from(said.value));
        said.or_else(|| self.value(0x1017, 0))
    }
}

/// The rules of the bus as a whole.
pub(super) fn of_bus(bus: &Bus, report: &mut Reporter<'_>) {
    report.rule = "node-id";
    let mut nodes: BTreeMap<u8, &str> = BTreeMap::new();
    match &bus.master.node_id {
        None => report.say(Severity::Error, bus.master.at, "the master has no `node_id`", "add `node_id: 127`"),
        Some(id) => match u8::try_from(id.value).ok().and_then(NodeId::new) {
            None => report.say(
                Severity::Error,
                id.at,
                format!("{} is not a node-ID", id.value),
                "expected 1 to 127; 127 for a master",
            ),
            Some(node) => drop(nodes.insert(node.raw(), "the master")),
        },
    }
    for slave in &bus.nodes {
        let Some(node) = slave.node() else { continue };
        let at = slave.node_id.as_ref().map_or(slave.at, |id| id.at);
        if let Some(other) = nodes.insert(node.raw(), &slave.name) {
            report.node = Some(node);
            let what =
                format!("{node} is also the node-ID of {other}: both answer each request, and the bus has errors");
            report.say(Severity::Error, at, what, "give each a node-ID of its own; 127 suits a master best");
            report.node = None;
        }
    }
    report.rule = "shape";
    for (said, most, key, unit) in [
        (&bus.master.sync_period_us, i64::from(u32::MAX), "sync_period", "us"),
        (&bus.master.heartbeat_producer_ms, i64::from(u16::MAX), "heartbeat_producer", "ms"),
    ] {
        if let Some(said) = said.as_ref().filter(|said| !(0..=most).contains(&said.value)) {
            let what = format!("`{key}` is {}", said.value);
            report.say(Severity::Error, said.at, what, format!("expected 0 to {most} ({unit})"));
        }
    }
    report.rule = "master-heartbeat";
    if bus.master.heartbeat_producer_ms.as_ref().is_none_or(|time| time.value == 0) {
        let at = bus.master.heartbeat_producer_ms.as_ref().map_or(bus.master.at, |time| time.at);
        let what = "the master sends no heartbeat: no drive notices its loss";
        report.say(Severity::Warning, at, what, "add `heartbeat_producer: 100` (ms)");
    }
}

fn node_id(case: &Case<'_>, report: &mut Reporter<'_>) {
    let slave = case.slave;
    match &slave.node_id {
        None => {
            report.say(Severity::Error, slave.at, format!("{} has no `node_id`", slave.name), "add `node_id`, 1 to 127")
        }
        Some(id) if slave.node().is_none() => {
            report.say(Severity::Error, id.at, format!("{} is not a node-ID", id.value), "expected 1 to 127");
        }
        Some(_) => {}
    }
    // A drive that was never set up comes up beside the master.
    let master = case.bus.master.node_id.as_ref();
    if let (Some(master), Some(delivered)) = (master, case.model().and_then(|model| model.node_id))
        && master.value == i64::from(delivered.raw())
        && slave.node() != Some(delivered)
    {
        let title = case.device.map(Device::title).unwrap_or_default();
        let what = format!(
            "the {title} has the master's node-ID {delivered} as delivered: one that is replaced comes up as a second master"
        );
        report.say(Severity::Warning, master.at, what, "give the master 127");
    }
}

fn no_data_sheet(case: &Case<'_>, report: &mut Reporter<'_>) {
    if case.slave.dcf.is_none() {
        let what = format!("{} has no `dcf`: dcfgen wants the EDS of each node", case.slave.name);
        report.say(
            Severity::Error,
            case.slave.at,
            what,
            "add `dcf: \"FILE.eds\"`; `ferrodrive eds MODEL` writes that of a known drive",
        );
    }
}

/// That master waits for the next heartbeat after the configuration before it takes a node for started.
fn heartbeat(case: &Case<'_>, report: &mut Reporter<'_>) {
    let at = case.slave.heartbeat_producer_ms.as_ref().map_or(case.slave.at, |time| time.at);
    match case.heartbeat_ms() {
        Some(0) => {
            let what = "it sends no heartbeat: the master does not notice its loss or restart";
            report.say(Severity::Warning, at, what, "add `heartbeat_producer: 200` (ms)");
        }
        Some(time) if time >= 1000 => {
            let what = format!(
                "a heartbeat every {time} ms: the master waits for one after the configuration, and its first attempts to boot the node fail"
            );
            report.say(Severity::Warning, at, what, "set `heartbeat_producer` to 100 to 500 (ms)");
        }
        _ => {}
    }
}

fn boot_timeout(case: &Case<'_>, report: &mut Reporter<'_>) {
    let (Some(beat), Some(model)) = (case.heartbeat_ms(), case.model()) else { return };
    let said = case.slave.boot_timeout_ms.as_ref().or(case.bus.master.boot_timeout_ms.as_ref());
    let Some(timeout) = said else { return };
    let boots = i128::from(model.timing.boot.most_us / 1000);
    let needed = beat.saturating_add(boots);
    if i128::from(timeout.value) < needed {
        let what = format!(
            "{} ms are not enough: the drive takes up to {boots} ms to start, and its next heartbeat {beat} ms more",
            timeout.value
        );
        report.say(Severity::Error, timeout.at, what, format!("set `boot_timeout_ms` to {} or more", needed.max(2000)));
    }
}

/// dcfgen writes 0 to the consumer entries of a node without a heartbeat consumer in the file.
fn host_watch(case: &Case<'_>, report: &mut Reporter<'_>) {
    let armed = case.value(0x1016, 1).filter(|entry| *entry != 0);
    let consumes = case.slave.heartbeat_consumer.as_ref();
    if let (Some(entry), false) = (armed, consumes.is_some_and(|said| said.value)) {
        let at = consumes.map_or(case.slave.at, |said| said.at);
        let (who, ms) = ((entry >> 16) & 0x7F, entry & 0xFFFF);
        let what = format!(
            "the generator switches off its watch over the host (1016h:01, node {who}, {ms} ms as delivered): when the master dies, it goes on"
        );
        report.say(Severity::Error, at, what, "add `heartbeat_consumer: true`");
    }
}

fn host_silence(case: &Case<'_>, report: &mut Reporter<'_>) {
    let Some(HostWatch::Silence { time }) = case.model().map(|model| model.host_watch) else { return };
    let polls = case.slave.polling.as_ref().is_some_and(|polling| polling.value);
    let ms = case.value(time.index, time.sub_index).unwrap_or(0);
    if ms > 0 && !polls {
        let what = format!(
            "it stops {ms} ms after the last frame for it ({time}); that neither SYNC nor the master's heartbeat counts is a guess: its manual is silent on it"
        );
        report.say(
            Severity::Note,
            case.slave.at,
            what,
            "send it something that often: a cyclic RPDO, or `polling: true`",
        );
    }
    if ms == 0 {
        report.say(
            Severity::Warning,
            case.slave.at,
            format!("its watch over the host is off ({time} is 0): when the master dies, it goes on"),
            format!("set {time} by `sdo`"),
        );
    }
}

fn node_guarding(case: &Case<'_>, report: &mut Reporter<'_>) {
    let written = case.slave.sdo.iter().filter(|write| matches!(write.index, 0x100C | 0x100D)).map(|write| write.at);
    let said = case.slave.guard_time.iter().filter(|time| time.value > 0).map(|time| time.at);
    if case.device.is_some_and(|device| !device.has(0x100C)) {
        for at in written.chain(said) {
            let what = "it does not answer node guarding: the master resets it again and again";
            report.say(Severity::Error, at, what, "take heartbeats: `heartbeat_producer`");
        }
    }
}

fn cia402_driver(case: &Case<'_>, report: &mut Reporter<'_>) {
    let Some(driver) = case.slave.driver.as_ref().filter(|_| case.driver_has("402")) else { return };
    let style = case.model().and_then(Description::first_axis).map(|axis| axis.power);
    if matches!(style, Some(PowerStyle::EchoesControlword { .. })) {
        let title = case.device.map(Device::title).unwrap_or_default();
        let what = format!(
            "the statusword of the {title} has none of the states of CiA 402: that driver never sees it enabled"
        );
        report.say(Severity::Error, driver.at, what, "take `ros2_canopen::ProxyDriver`");
    }
    if case.device.is_some_and(|device| !device.has(0x6041)) {
        report.say(
            Severity::Error,
            driver.at,
            "its data sheet has no statusword (6041h): it is not a CiA 402 drive",
            "take `ros2_canopen::ProxyDriver`",
        );
    }
}

/// The driver reads 6502h without a look whether the sheet has it.
fn supported_modes(case: &Case<'_>, report: &mut Reporter<'_>) {
    let Some(driver) = case.slave.driver.as_ref().filter(|_| case.driver_has("402")) else { return };
    if case.device.is_some_and(|device| !device.has(0x6502)) {
        let next = match case.model() {
            Some(model) => format!(
                "`ferrodrive eds {} --variant ros2_canopen` writes a sheet that has it, or take the proxy driver",
                model.name
            ),
            None => "take `ros2_canopen::ProxyDriver`, or add the row to a copy of the sheet and mark it as yours"
                .to_owned(),
        };
        report.say(Severity::Error, driver.at, "its data sheet has no 6502h: that driver ends the process", next);
    }
}

fn fixed_mapping(case: &Case<'_>, report: &mut Reporter<'_>) {
    if !case.model().is_some_and(|model| model.pdo.fixed_mapping) {
        return;
    }
    for pdo in case.slave.pdos.iter().filter(|pdo| pdo.mapping.is_some()) {
        let what = format!("the mapping of its {} cannot be changed: the node does not boot (error J)", name(pdo));
        report.say(Severity::Error, pdo.at, what, "leave out `mapping`; the factory mapping is in its data sheet");
    }
}

/// Targets that a drive follows while it is enabled (CiA 402-2: 607Ah, 60C1h, 60FFh, 6071h).
const SET_POINTS: [u16; 4] = [0x607A, 0x60C1, 0x60FF, 0x6071];

/// A generated master sends each RPDO that is valid in the sheet, with zeros until it is given other values. A file
/// that names an RPDO uses it, or switches it off.
fn set_point_by_sync(case: &Case<'_>, report: &mut Reporter<'_>) {
    let syncs = case.bus.master.sync_period_us.as_ref().is_some_and(|period| period.value > 0);
    for number in (1..=512).take_while(|_| syncs) {
        let at_index = |base: u16| base + number - 1;
        let Some(id) = case.value(at_index(0x1400), 1) else { break };
        let by_sync = case.value(at_index(0x1400), 2).is_some_and(|transmission| transmission <= 240);
        if id & 0x8000_0000 != 0 || !by_sync || case.slave.pdo(false, number).is_some() {
            continue;
        }
        let carried = (1..=8).filter_map(|entry| Some((case.value(at_index(0x1600), entry)? >> 16) as u16));
        if let Some(target) = carried.into_iter().find(|index| SET_POINTS.contains(index)) {
            let what = format!(
                "its RPDO{number} carries {target:04X}h, is on as delivered and goes out with each SYNC: the master sends 0 until it is given a value, and an enabled drive goes there"
            );
            let next = format!("add `rpdo: {{{number}: {{enabled: false}}}}` unless you use it");
            report.say(Severity::Error, case.slave.at, what, next);
        }
    }
}

/// What changes all the time, and has a TPDO of type 254 or 255 sent each time.
const CHANGING: [u16; 4] = [0x606C, 0x6064, 0x6077, 0x6078];

fn flood(case: &Case<'_>, report: &mut Reporter<'_>) {
    for pdo in case.slave.pdos.iter().filter(|pdo| pdo.is_transmit && pdo.enabled != Some(false)) {
        let index = 0x1800 + pdo.number - 1;
        let transmission = pdo.transmission.map(i128::from).or_else(|| case.value(index, 2));
        let inhibit = pdo.inhibit_time.map(i128::from).or_else(|| case.value(index, 3)).unwrap_or(0);
        let carries = pdo.mapping.iter().flatten().find(|(index, _)| CHANGING.contains(index));
        if let (Some(254 | 255), 0, Some((object, _))) = (transmission, inhibit, carries) {
            let what = format!(
                "its {} carries {object:04X}h, is of type 254 or 255 and has no inhibit time: while the motor turns it fills the bus",
                name(pdo)
            );
            report.say(Severity::Warning, pdo.at, what, "set `transmission: 1`, or an `inhibit_time`");
        }
    }
}

fn pdo_number(case: &Case<'_>, report: &mut Reporter<'_>) {
    let Some(device) = case.device else { return };
    for pdo in &case.slave.pdos {
        let base = if pdo.is_transmit { 0x1800 } else { 0x1400 };
        if !device.has(base + pdo.number - 1) {
            report.say(
                Severity::Error,
                pdo.at,
                format!("its data sheet has no {}", name(pdo)),
                "see `ferrodrive eds show` for the PDOs that it has",
            );
        }
        for (index, sub_index) in pdo.mapping.iter().flatten() {
            let mux = Mux::new(*index, *sub_index);
            match device.eds.variable(*index, *sub_index) {
                None if *index >= 0x1000 => {
                    let what = format!("its data sheet has no {mux}, which {} is to carry", name(pdo));
                    report.say(Severity::Error, pdo.at, what, "map an object that it has");
                }
                Some(variable) if !variable.pdo_mapping => {
                    let what = format!("{mux} may not be mapped, by its data sheet");
                    report.say(Severity::Error, pdo.at, what, "map another object, or read it by SDO");
                }
                _ => {}
            }
        }
    }
}

/// What is written by SDO is in the sheet, may be written, and fits its type.
fn sdo_object(case: &Case<'_>, report: &mut Reporter<'_>) {
    let Some(device) = case.device else { return };
    for write in &case.slave.sdo {
        let object = Mux::new(write.index, write.sub_index);
        let Some(variable) = device.eds.variable(write.index, write.sub_index) else {
            let what = format!("its data sheet has no {object}: dcfgen refuses the file");
            report.say(
                Severity::Error,
                write.at,
                what,
                "write an object that it has; `ferrodrive eds show` lists them",
            );
            continue;
        };
        if !variable.access.is_writable() {
            let what = format!("{object} cannot be written, by its data sheet: the node does not boot (error J)");
            report.say(Severity::Error, write.at, what, "leave it out");
        }
        match variable.data_type.range() {
            Some((low, high)) if !(low..=high).contains(&i128::from(write.value)) => {
                let what = format!("{} does not fit {object}, which takes {low} to {high}", write.value);
                report.say(Severity::Error, write.at, what, "give a value in that range");
            }
            _ => {}
        }
    }
    for (said, most, key) in [
        (&case.slave.heartbeat_producer_ms, i64::from(u16::MAX), "heartbeat_producer"),
        (&case.slave.boot_timeout_ms, i64::from(u32::MAX), "boot_timeout_ms"),
    ] {
        if let Some(said) = said.as_ref().filter(|said| !(0..=most).contains(&said.value)) {
            let what = format!("`{key}` is {}", said.value);
            report.say(Severity::Error, said.at, what, format!("expected 0 to {most} (ms)"));
        }
    }
}

fn name(pdo: &Pdo) -> String {
    format!("{}{}", if pdo.is_transmit { "TPDO" } else { "RPDO" }, pdo.number)
}

fn starts_by_itself(case: &Case<'_>, report: &mut Reporter<'_>) {
    if case.model().is_some_and(|model| model.nmt.start_state == NmtState::Operational) {
        let what =
            "it is operational as soon as it has started: a master boots it with letter L, which is not an error";
        report.say(Severity::Note, case.slave.at, what, "nothing has to be done");
    }
}

fn alarm_as_state(case: &Case<'_>, report: &mut Reporter<'_>) {
    if case.model().is_some_and(|model| model.nmt.heartbeat_tells_alarm) {
        let what = "its heartbeat says 04h while it has an alarm: masters read that as STOPPED";
        report.say(Severity::Note, case.slave.at, what, "look at its alarm when a master says that it has stopped");
    }
}

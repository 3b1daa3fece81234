//! The bus of ros2_canopen: a `bus.yml`, which Lely's `dcfgen` reads too. Its contents, with their places.
//!
//! `options` and `defaults` are for all nodes, `master` is the master, every other name is a node; newer files have the nodes below
//! `nodes`.

use std::path::{Path, PathBuf};

use canopen::NodeId;
use master::boot::{Assignment, Startup};

use super::finding::{Place, Reporter, Severity};
use super::yaml::{Entry, YamlNode};
use words::suggest::{did_you_mean, near};

/// The keys of the master that are known: those of `dcfgen`, and those of ros2_canopen.
const MASTER_KEYS: [&str; 26] = [
    "node_id",
    "baudrate",
    "vendor_id",
    "product_code",
    "revision_number",
    "serial_number",
    "heartbeat_multiplier",
    "heartbeat_consumer",
    "heartbeat_producer",
    "emcy_inhibit_time",
    "sync_period",
    "sync_window",
    "sync_overflow",
    "error_behavior",
    "nmt_inhibit_time",
    "start",
    "start_nodes",
    "start_all_nodes",
    "reset_all_nodes",
    "stop_all_nodes",
    "boot_time",
    "driver",
    "package",
    "namespace",
    "boot_timeout_ms",
    "enable_lazy_load",
];

/// The same of a node.
const NODE_KEYS: [&str; 45] = [
    "node_id",
    "dcf",
    "dcf_path",
    "revision_number",
    "serial_number",
    "heartbeat_multiplier",
    "heartbeat_consumer",
    "heartbeat_producer",
    "error_behavior",
    "rpdo",
    "tpdo",
    "boot",
    "mandatory",
    "reset_communication",
    "software_file",
    "software_version",
    "configuration_file",
    "time_cob_id",
    "guard_time",
    "life_time_factor",
    "restore_configuration",
    "retry_factor",
    "sdo",
    "driver",
    "package",
    "namespace",
    "enable_lazy_load",
    "polling",
    "period",
    "position_mode",
    "velocity_mode",
    "torque_mode",
    "switching_state",
    "diagnostics",
    "boot_timeout_ms",
    "sdo_timeout_ms",
    "scale_pos_to_dev",
    "scale_pos_from_dev",
    "scale_vel_to_dev",
    "scale_vel_from_dev",
    "offset_pos_to_dev",
    "offset_pos_from_dev",
    "homing_timeout_seconds",
    "scale_eff_to_dev",
    "scale_eff_from_dev",
];

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(super) struct At<T> {
    pub(super) value: T,
    pub(super) at: Place,
}

/// A bus.
#[derive(Clone, Debug)]
pub(super) struct Bus {
    pub(super) master: Master,
    pub(super) nodes: Vec<Slave>,
}

#[derive(Clone, Debug)]
pub(super) struct Master {
    pub(super) at: Place,
    pub(super) node_id: Option<At<i64>>,
    pub(super) sync_period_us: Option<At<i64>>,
    pub(super) heartbeat_producer_ms: Option<At<i64>>,
    pub(super) boot_timeout_ms: Option<At<i64>>,
    /// Bit rate in kbit/s.
    pub(super) baudrate: Option<i64>,
    /// How many of its heartbeats a node waits for (`options` and `master`; 3).
    pub(super) heartbeat_multiplier: f64,
    /// The bits of 1F80h that it says, by the names of their keys.
    pub(super) startup: Startup,
    /// 1F89h, in ms; 0 for none.
    pub(super) boot_time_ms: i64,
}

/// A node. What it does not say itself is that of `defaults`.
#[derive(Clone, Debug)]
pub(super) struct Slave {
    pub(super) name: String,
    pub(super) at: Place,
    pub(super) node_id: Option<At<i64>>,
    pub(super) dcf: Option<At<PathBuf>>,
    pub(super) driver: Option<At<String>>,
    pub(super) heartbeat_producer_ms: Option<At<i64>>,
    pub(super) heartbeat_consumer: Option<At<bool>>,
    pub(super) boot_timeout_ms: Option<At<i64>>,
    pub(super) polling: Option<At<bool>>,
    pub(super) pdos: Vec<Pdo>,
    pub(super) sdo: Vec<SdoWrite>,
    /// 1F81h of the master, by the names of its keys.
    pub(super) assignment: Assignment,
    /// How many of its heartbeats the master waits for.
    pub(super) heartbeat_multiplier: f64,
    pub(super) revision_number: Option<i64>,
    pub(super) serial_number: Option<i64>,
    pub(super) software_version: Option<i64>,
    /// The sub-index of 1011h that restores it; 0 for none.
    pub(super) restore_configuration: i64,
    /// 100Ch, which begins node guarding.
    pub(super) guard_time: Option<At<i64>>,
}

/// A value that is written to an object.
#[derive(Clone, Debug)]
pub(super) struct SdoWrite {
    pub(super) index: u16,
    pub(super) sub_index: u8,
    pub(super) value: i64,
    pub(super) at: Place,
}

/// The keys of one PDO.
#[derive(Clone, Debug)]
pub(super) struct Pdo {
    pub(super) at: Place,
    pub(super) is_transmit: bool,
    pub(super) number: u16,
    pub(super) enabled: Option<bool>,
    pub(super) transmission: Option<i64>,
    pub(super) inhibit_time: Option<i64>,
    pub(super) event_timer: Option<i64>,
    pub(super) sync_start: Option<i64>,
    pub(super) cob_id: Option<PdoId>,
    /// Index and sub-index of what it carries, if that is given.
    pub(super) mapping: Option<Vec<(u16, u8)>>,
}

/// What `cob_id` of a PDO says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PdoId {
    /// `auto`: that of the predefined connection set, or from PDO 5 on the next one that is free.
    Auto,
    /// This value of 1400h:01 or 1800h:01.
    Value(i64),
}

impl Slave {
    /// Its node-ID, if it is one.
    pub(super) fn node(&self) -> Option<NodeId> {
        NodeId::new(u8::try_from(self.node_id.as_ref()?.value).ok()?)
    }

    /// The keys of a PDO.
    pub(super) fn pdo(&self, is_transmit: bool, number: u16) -> Option<&Pdo> {
        self.pdos.iter().find(|pdo| pdo.is_transmit == is_transmit && pdo.number == number)
    }
}

/// The bus of a document; data sheets are looked for in `folder`.
pub(super) fn read(document: &YamlNode<'_>, folder: &Path, report: &mut Reporter<'_>) -> Option<Bus> {
    report.rule = "shape";
    let entries = document.entries();
    let Some(master) = entries.iter().find(|entry| entry.key == "master") else {
        let next = "describe the master: `master:` with `node_id: 127`";
        report.say(Severity::Error, document.at(), "`master` is missing: not a bus.yml, or not a whole one", next);
        return None;
    };
    let defaults = entries.iter().find(|entry| entry.key == "defaults");
    let options = entries.iter().find(|entry| entry.key == "options");
    let multiplier = options.and_then(|options| value(&options.value, None, "heartbeat_multiplier")?.real());
    let multiplier = multiplier.unwrap_or(HEARTBEAT_MULTIPLIER);
    let nested = entries.iter().find(|entry| entry.key == "nodes").map(|entry| entry.value.entries());
    let is_node = |entry: &&Entry<'_>| !["master", "defaults", "options", "nodes"].contains(&entry.key.as_str());
    let mut nodes = Vec::new();
    for entry in entries.iter().filter(is_node).chain(nested.iter().flatten()) {
        if entry.value.is_mapping() {
            let default = defaults.map(|entry| &entry.value);
            nodes.push(slave(entry, default, (folder, multiplier), report));
        } else {
            let what = format!("'{}' is not a node: it has no keys", entry.key);
            report.say(
                Severity::Error,
                entry.at,
                what,
                "expected `node_id`, `dcf` and `driver` below a name, or `options`",
            );
        }
    }
    if let Some(defaults) = defaults {
        unknown_keys(&defaults.value, &NODE_KEYS, report);
    }
    if nodes.is_empty() {
        report.say(Severity::Error, document.at(), "no node beside the master", "add a name with `node_id` and `dcf`");
    }
    Some(Bus { master: of_master(master, multiplier, report), nodes })
}

/// Of `dcfgen`, where `options` says none.
const HEARTBEAT_MULTIPLIER: f64 = 3.0;

fn of_master(entry: &Entry<'_>, multiplier: f64, report: &mut Reporter<'_>) -> Master {
    unknown_keys(&entry.value, &MASTER_KEYS, report);
    // Each bit with what its key has to say for it to be set.
    let bits = [
        ("start_all_nodes", Startup::START_ALL, true),
        ("start_nodes", Startup::STARTS_NONE, false),
        ("reset_all_nodes", Startup::RESET_ALL, true),
        ("stop_all_nodes", Startup::STOP_ALL, true),
    ];
    let startup = bits.into_iter().fold(0, |all, (key, bit, sets)| {
        let said = truth(&entry.value, None, key, report).map(|said| said.value);
        if said == Some(sets) { all | bit } else { all }
    });
    let heartbeat_multiplier = value(&entry.value, None, "heartbeat_multiplier").and_then(|node| node.real());
    let number = |key: &str, report: &mut Reporter<'_>| number(&entry.value, None, key, report);
    Master {
        at: entry.at,
        node_id: number("node_id", report),
        sync_period_us: number("sync_period", report),
        heartbeat_producer_ms: number("heartbeat_producer", report),
        boot_timeout_ms: number("boot_timeout_ms", report),
        baudrate: number("baudrate", report).map(|said| said.value),
        heartbeat_multiplier: heartbeat_multiplier.unwrap_or(multiplier),
        startup: Startup(startup),
        boot_time_ms: number("boot_time", report).map_or(0, |said| said.value),
    }
}

fn slave(
    entry: &Entry<'_>,
    defaults: Option<&YamlNode<'_>>,
    (folder, multiplier): (&Path, f64),
    report: &mut Reporter<'_>,
) -> Slave {
    unknown_keys(&entry.value, &NODE_KEYS, report);
    let own = &entry.value;
    let number_of = |key: &str, report: &mut Reporter<'_>| number(own, defaults, key, report);
    let truth_of = |key: &str, report: &mut Reporter<'_>| truth(own, defaults, key, report);
    let text_of =
        |key: &str| value(own, defaults, key).and_then(|node| Some(At { value: node.text()?, at: node.at() }));
    let pdos = |key: &str, is_transmit: bool, report: &mut Reporter<'_>| -> Vec<Pdo> {
        let of_key = value(own, defaults, key).map(|node| node.entries()).unwrap_or_default();
        of_key.iter().filter_map(|entry| pdo(entry, is_transmit, report)).collect()
    };
    let mut all = pdos("rpdo", false, report);
    all.extend(pdos("tpdo", true, report));
    let sdo = value(own, defaults, "sdo").map(|node| node.items()).unwrap_or_default();
    // Each bit with what its key has to say for it to be set.
    let bits = [
        ("boot", Assignment::BOOT, true),
        ("mandatory", Assignment::MANDATORY, true),
        ("reset_communication", Assignment::KEEP_ALIVE, false),
    ];
    let assignment = bits.into_iter().fold(Assignment::SLAVE | Assignment::BOOT, |all, (key, bit, sets)| {
        let Some(said) = truth_of(key, report) else { return all };
        if said.value == sets { all | bit } else { all & !bit }
    });
    let multiple = value(own, defaults, "heartbeat_multiplier").and_then(|node| node.real()).unwrap_or(multiplier);
    Slave {
        name: entry.key.clone(),
        assignment: Assignment(assignment),
        heartbeat_multiplier: multiple,
        revision_number: number_of("revision_number", report).map(|said| said.value),
        serial_number: number_of("serial_number", report).map(|said| said.value),
        software_version: number_of("software_version", report).map(|said| said.value),
        restore_configuration: number_of("restore_configuration", report).map_or(0, |said| said.value),
        guard_time: number_of("guard_time", report),
        at: entry.at,
        node_id: number_of("node_id", report),
        dcf: text_of("dcf").map(|dcf| At { value: folder.join(&dcf.value), at: dcf.at }),
        driver: text_of("driver"),
        heartbeat_producer_ms: number_of("heartbeat_producer", report),
        heartbeat_consumer: truth_of("heartbeat_consumer", report),
        boot_timeout_ms: number_of("boot_timeout_ms", report),
        polling: truth_of("polling", report),
        pdos: all,
        sdo: sdo.iter().filter_map(write).collect(),
    }
}

/// Of a node, or else of the defaults.
fn value<'a>(own: &YamlNode<'a>, defaults: Option<&YamlNode<'a>>, key: &str) -> Option<YamlNode<'a>> {
    let of = |node: &YamlNode<'a>| node.entries().into_iter().find(|entry| entry.key == key).map(|entry| entry.value);
    of(own).or_else(|| of(defaults?))
}

fn number(
    own: &YamlNode<'_>,
    defaults: Option<&YamlNode<'_>>,
    key: &str,
    report: &mut Reporter<'_>,
) -> Option<At<i64>> {
    let node = value(own, defaults, key)?;
    let number = node.number();
    if number.is_none() {
        report.say(
            Severity::Error,
            node.at(),
            format!("`{key}` is not a whole number"),
            format!("expected a number: `{key}: 1`"),
        );
    }
    Some(At { value: number?, at: node.at() })
}

fn truth(
    own: &YamlNode<'_>,
    defaults: Option<&YamlNode<'_>>,
    key: &str,
    report: &mut Reporter<'_>,
) -> Option<At<bool>> {
    let node = value(own, defaults, key)?;
    let truth = node.truth();
    if truth.is_none() {
        report.say(
            Severity::Error,
            node.at(),
            format!("`{key}` is neither true nor false"),
            "expected `true` or `false`",
        );
    }
    Some(At { value: truth?, at: node.at() })
}

fn pdo(entry: &Entry<'_>, is_transmit: bool, report: &mut Reporter<'_>) -> Option<Pdo> {
    let number = entry.key.parse().ok().filter(|number| (1..=512).contains(number));
    let Some(number) = number else {
        report.say(
            Severity::Error,
            entry.at,
            format!("'{}' is not a number of a PDO", entry.key),
            "expected 1 to 512: PDO 1 is 1400h or 1800h",
        );
        return None;
    };
    let of = |key: &str| value(&entry.value, None, key);
    let mapping = of("mapping").map(|list| list.items().iter().filter_map(object).collect());
    Some(Pdo {
        at: entry.at,
        is_transmit,
        number,
        enabled: of("enabled").and_then(|node| node.truth()),
        transmission: of("transmission").and_then(|node| node.number()),
        inhibit_time: of("inhibit_time").and_then(|node| node.number()),
        event_timer: of("event_timer").and_then(|node| node.number()),
        sync_start: of("sync_start").and_then(|node| node.number()),
        cob_id: of("cob_id").and_then(|node| match node.number() {
            Some(number) => Some(PdoId::Value(number)),
            None => node.text().filter(|text| text == "auto").map(|_| PdoId::Auto),
        }),
        mapping,
    })
}

fn write(node: &YamlNode<'_>) -> Option<SdoWrite> {
    let (index, sub_index) = object(node)?;
    let value = value(node, None, "value").map_or(Some(0), |value| value.number())?;
    Some(SdoWrite { index, sub_index, value, at: node.at() })
}

fn object(node: &YamlNode<'_>) -> Option<(u16, u8)> {
    let index = value(node, None, "index")?.number()?;
    let sub_index = value(node, None, "sub_index").map_or(Some(0), |node| node.number())?;
    Some((index.try_into().ok()?, sub_index.try_into().ok()?))
}

fn unknown_keys(node: &YamlNode<'_>, known: &[&str], report: &mut Reporter<'_>) {
    for entry in node.entries().iter().filter(|entry| !known.contains(&entry.key.as_str())) {
        let near = near(&entry.key, known.iter().copied());
        let what =
            format!("'{}' is not a key that ros2_canopen or dcfgen is known to read{}", entry.key, did_you_mean(&near));
        report.say(Severity::Warning, entry.at, what, "check its spelling: an unknown key is ignored silently");
    }
}

//! A described bus held against the drives that are there: who they are, and what their objects have. Only reads.

use canopen::object::{
    APPLICATION_SOFTWARE_IDENTIFICATION, DEVICE_TYPE, MANUFACTURER_SOFTWARE_VERSION, PRODUCER_HEARTBEAT_TIME,
    PRODUCT_CODE, REVISION_NUMBER, SERIAL_NUMBER, VENDOR_ID,
};
use canopen::{Mux, NodeId};
use devices::Description;
use master::boot::Expectation;
use master::parameters::{Deviation, verify};
use master::{Error, Network, Node};
use serde::Serialize;

use super::finding::{Reporter, Severity};
use super::intended::{Intended, IntendedNode};

/// A drive as it answered.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LiveNode {
    /// Its node-ID.
    pub node: u8,
    /// Its name in the file.
    pub name: String,
    /// It answers.
    pub answers: bool,
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:01.
    pub vendor_id: Option<u32>,
    /// 1018h:02.
    pub product_code: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
    /// 1018h:04.
    pub serial_number: Option<u32>,
    /// Its manufacturer software version (100Ah).
    pub software: Option<String>,
    /// Its producer heartbeat time (1017h), in ms.
    pub heartbeat_ms: Option<u16>,
    /// How many objects were compared.
    pub compared: usize,
    /// Those that have another value than the file writes.
    pub deviations: Vec<LiveDeviation>,
}

/// An object that has not yet what the file wants.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LiveDeviation {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// What the file writes, hexadecimal.
    pub expected: String,
    /// What it has, or why that is not known.
    pub found: String,
}

/// Asks all nodes of a bus, one after the other.
pub(super) async fn ask(
    intended: &Intended,
    network: &Network,
    node_of: impl Fn(NodeId) -> Node,
    report: &mut Reporter<'_>,
) -> Vec<LiveNode> {
    let mut all = Vec::new();
    for (id, place) in &intended.nodes {
        report.node = Some(*id);
        let node = node_of(*id);
        let mut live = LiveNode { node: id.raw(), name: place.name.clone(), ..LiveNode::default() };
        let expectation = intended.plan.nodes.get(id);
        if let Err(error) = look(&node, place, expectation, &mut live, report).await {
            report.rule = "live-silent";
            let next = "check its supply, its cable, its node-ID and the bit rate: ferrodrive scan";
            report.say(Severity::Error, place.at, format!("on the bus: {error}"), next);
        }
        all.push(live);
    }
    report.node = None;
    strangers(intended, network, report);
    all
}

/// What a node says; silence ends it.
async fn look(
    node: &Node,
    place: &IntendedNode,
    expectation: Option<&Expectation>,
    live: &mut LiveNode,
    report: &mut Reporter<'_>,
) -> Result<(), Error> {
    live.device_type = number(node, DEVICE_TYPE).await?;
    live.answers = true;
    live.vendor_id = number(node, VENDOR_ID).await?;
    live.product_code = number(node, PRODUCT_CODE).await?;
    live.revision_number = number(node, REVISION_NUMBER).await?;
    live.serial_number = number(node, SERIAL_NUMBER).await?;
    live.heartbeat_ms = number(node, PRODUCER_HEARTBEAT_TIME).await?.and_then(|ms| u16::try_from(ms).ok());
    live.software = software_version(node, place.description).await?;
    let software = number(node, APPLICATION_SOFTWARE_IDENTIFICATION).await?;
    if let Some(expected) = expectation {
        report.rule = "live-identity";
        let identity = [
            ("1000h:00", expected.device_type, live.device_type),
            ("1018h:01", expected.vendor_id, live.vendor_id),
            ("1018h:02", expected.product_code, live.product_code),
            ("1018h:03", expected.revision_number, live.revision_number),
            ("1018h:04", expected.serial_number, live.serial_number),
            ("1F56h:01", expected.software, software),
        ];
        for (object, wanted, found) in identity {
            let Some(wanted) = wanted.filter(|wanted| Some(*wanted) != found) else { continue };
            let found = found.map_or_else(|| "does not have it".to_owned(), |found| format!("has {found:X}h"));
            let what =
                format!("on the bus: {object} is expected to be {wanted:X}h, and the device {found}: it will not boot");
            let next =
                "the device or its firmware is not the one that the file expects: replace it, or correct the file";
            report.say(Severity::Error, place.at, what, next);
        }
    }
    let values = place.values();
    let wanted: Vec<_> = values.iter().map(|(object, write)| (object, &write.bytes)).collect();
    let deviations = verify(node, wanted).await?;
    live.compared = values.len();
    report.rule = "live-value";
    for deviation in &deviations {
        let LiveDeviation { object, expected, found } = shown(deviation);
        let what = format!("on the bus: {object} has {found}, and the file writes {expected}");
        let next = "the boot-up writes it; to have it now: ferrodrive params apply, or ferrodrive boot";
        report.say(Severity::Note, place.place_of(Some(deviation.object)), what, next);
    }
    live.deviations = deviations.iter().map(shown).collect();
    // What the generator takes from the data sheet it does not write: there the sheet has to be right.
    report.rule = "live-sheet";
    for deviation in verify(node, &place.of_sheet).await? {
        let LiveDeviation { object, expected, found } = shown(&deviation);
        let what = format!(
            "on the bus: {object} has {found}, its data sheet says {expected}, and the generator writes only what differs from the sheet"
        );
        let next = "name the value in the file (`sdo`), restore the device, or correct the sheet";
        report.say(Severity::Warning, place.at, what, next);
    }
    live.compared += place.of_sheet.len();
    Ok(())
}

/// Who else was heard meanwhile.
fn strangers(intended: &Intended, network: &Network, report: &mut Reporter<'_>) {
    report.rule = "live-stranger";
    let seen = network.seen();
    let is_known = |node: &NodeId| *node == intended.plan.own || intended.nodes.contains_key(node);
    for node in NodeId::all().filter(|node| seen.contains(*node) && !is_known(node)) {
        let what = format!("on the bus: node {node} is heard, which the file does not have");
        report.say(
            Severity::Warning,
            intended.at,
            what,
            "add it to the file, or find out which device it is: ferrodrive scan",
        );
    }
}

/// A number; `None` for an object that is refused or not a number.
async fn number(node: &Node, object: Mux) -> Result<Option<u32>, Error> {
    Ok(answered(node.upload(object).await)?
        .filter(|payload| payload.as_bytes().len() <= 4)
        .map(|payload| payload.raw()))
}

/// A VISIBLE_STRING (CiA 301, 7.5.2.7), or the number that some have in its place.
async fn software_version(node: &Node, model: &Description) -> Result<Option<String>, Error> {
    let object = MANUFACTURER_SOFTWARE_VERSION;
    if model.row(object).is_some_and(|row| row.data_type.is_integer()) {
        return Ok(number(node, object).await?.map(|version| version.to_string()));
    }
    let of_bytes = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned();
    Ok(answered(node.upload(object).await)?.map(|payload| of_bytes(payload.as_bytes())))
}

fn answered<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::Aborted { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn shown(deviation: &Deviation) -> LiveDeviation {
    let found = match &deviation.found {
        Ok(bytes) => hexadecimal(bytes),
        Err(error) => error.to_string(),
    };
    LiveDeviation { object: deviation.object.to_string(), expected: hexadecimal(&deviation.wanted), found }
}

/// A number as people write it: SDO carries the lowest byte first.
fn hexadecimal(bytes: &[u8]) -> String {
    let digits: String = bytes.iter().rev().map(|byte| format!("{byte:02X}")).collect();
    let short = digits.trim_start_matches('0');
    format!("{}h", if short.is_empty() { "0" } else { short })
}

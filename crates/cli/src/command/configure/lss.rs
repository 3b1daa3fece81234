//! `ferrodrive lss`: layer setting services (CiA 305): devices without a node-ID, and with one that is to change.

use std::time::Duration;

use can::Bitrate;
use canopen::lss::{
    Address, BIT_RATES_KBIT, Bound, Client, FastScan, Outcome, Part, Reply, Request, Search, UNCONFIGURED,
};
use canopen::{NmtCommand, NodeId};
use master::units::parse_duration;
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use plot::Table;
use words::node::node;

/// Find devices by their LSS address, and set their node-ID and bit rate (CiA 305)
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus slcan:///dev/ttyACM0 lss scan\n  \
    ferrodrive --bus can0 lss identify 100:1\n  \
    ferrodrive --bus can0 lss inquire only\n  \
    ferrodrive --bus can0 lss set 100:1:0:2A --node-id 5 --store\n  \
    ferrodrive --bus can0 lss set only --bitrate 250k --store --activate 500ms")]
pub(crate) struct Lss {
    #[command(subcommand)]
    what: LssCommand,
    /// Longest wait for each answer
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "50ms", global = true)]
    within: Duration,
}

#[derive(Debug, clap::Subcommand)]
enum LssCommand {
    /// Find every device that has no node-ID (fastscan): some seconds for each
    #[command(after_help = "Example:\n  ferrodrive --bus can0 lss scan")]
    Scan,
    /// Find every device of a vendor and product, with or without a node-ID (identify remote slave): some seconds for
    /// each
    ///
    /// Revision and serial numbers are requested in ranges, which are halved where a device answers. It only asks:
    /// nothing is changed.
    #[command(after_help = "Examples:\n  ferrodrive --bus can0 lss identify 100:1\n  \
        ferrodrive --bus can0 lss identify 100:1:2")]
    Identify {
        /// VENDOR:PRODUCT[:REVISION] (1018h:01 to 03) in hexadecimal; with the revision it takes half the time
        #[arg(value_name = "VENDOR:PRODUCT", value_parser = make)]
        make: Make,
    },
    /// Ask a device for its address and its node-ID
    #[command(after_help = "Examples:\n  ferrodrive --bus can0 lss inquire only\n  \
        ferrodrive --bus can0 lss inquire 100:1:0:2A")]
    Inquire {
        #[command(flatten)]
        device: DeviceArg,
    },
    /// Set a device's node-ID or bit rate
    Set(Set),
}

#[derive(Debug, clap::Args)]
struct DeviceArg {
    /// VENDOR:PRODUCT:REVISION:SERIAL (1018h:01 to 04) in hexadecimal, or only: the one device on the bus
    #[arg(value_name = "ADDRESS|only", value_parser = device)]
    device: MeantDevice,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 lss set 100:1:0:2A --node-id 5 --store\n  \
    ferrodrive --bus can0 lss set only --node-id 5 --reset\n  \
    ferrodrive --bus can0 lss set only --bitrate 250k --store --activate 500ms")]
struct Set {
    #[command(flatten)]
    device: DeviceArg,
    /// New node-ID, in effect from the next NMT reset communication on; none removes it
    #[arg(long, value_name = "NODE|none", value_parser = node_or_none, required_unless_present_any = ["bitrate", "store"])]
    node_id: Option<NodeIdArg>,
    /// New bit rate: 10k, 20k, 50k, 125k, 250k, 500k, 800k, 1M
    #[arg(long, value_name = "RATE", value_parser = bit_rate)]
    bitrate: Option<u8>,
    /// Store both in the device
    #[arg(long)]
    store: bool,
    /// Send NMT reset communication afterwards, with which a node that has a node-ID takes the new one
    #[arg(long, requires = "node_id")]
    reset: bool,
    /// Switch to the new bit rate now, with this much silence before and after; this bus has to be switched too
    #[arg(long, value_name = "TIME", value_parser = silence, requires = "bitrate")]
    activate: Option<Duration>,
}

/// The device that is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeantDevice {
    At(Address),
    Only,
}

/// Devices of one make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Make {
    vendor_id: u32,
    product_code: u32,
    revision: Option<u32>,
}

/// A node-ID that is to be set, 255 for none.
#[derive(Clone, Copy, Debug)]
struct NodeIdArg(u8);

/// Devices found on one bus at the most.
const MOST: usize = 127;

/// How long a device may take to boot with its new node-ID, as `nmt` waits.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

fn device(text: &str) -> Result<MeantDevice, String> {
    if text.eq_ignore_ascii_case("only") {
        return Ok(MeantDevice::Only);
    }
    let numbers: Option<[u32; 4]> = hexadecimals(text);
    numbers.map(|numbers| MeantDevice::At(Address { numbers })).ok_or_else(|| {
        format!(
            "expected an LSS address (vendor, product code, revision and serial number in hexadecimal, e.g. 100:1:0:2A), or \
             the word only, got '{text}'"
        )
    })
}

fn make(text: &str) -> Result<Make, String> {
    let short = hexadecimals(text).map(|[vendor_id, product_code]| Make { vendor_id, product_code, revision: None });
    let long = hexadecimals(text).map(|[vendor_id, product_code, revision]| Make {
        vendor_id,
        product_code,
        revision: Some(revision),
    });
    short.or(long).ok_or_else(|| {
        format!(
            "expected vendor-ID and product code, and the revision if known, in hexadecimal, e.g. 100:1, got '{text}'"
        )
    })
}

/// So many hexadecimal numbers, between colons.
fn hexadecimals<const N: usize>(text: &str) -> Option<[u32; N]> {
    let number = |part: &str| {
        let digits = part.trim_end_matches(['h', 'H']);
        u32::from_str_radix(digits.strip_prefix("0x").unwrap_or(digits), 16).ok()
    };
    let numbers: Option<Vec<u32>> = text.split(':').map(number).collect();
    numbers?.try_into().ok()
}

fn node_or_none(text: &str) -> Result<NodeIdArg, String> {
    if text.eq_ignore_ascii_case("none") {
        return Ok(NodeIdArg(UNCONFIGURED));
    }
    node(text).map(|node| NodeIdArg(node.raw())).map_err(|error| format!("{error}, or the word none"))
}

/// The index in the table of CiA 305.
fn bit_rate(text: &str) -> Result<u8, String> {
    let wanted = text.parse::<Bitrate>().ok().map(|rate| rate.bits_per_second() / 1000);
    let index = BIT_RATES_KBIT.iter().position(|rate| rate.is_some() && rate.map(u32::from) == wanted);
    index.map(|index| index as u8).ok_or_else(|| {
        format!("expected a bit rate of CiA 305 (10k, 20k, 50k, 125k, 250k, 500k, 800k or 1M), got '{text}'")
    })
}

fn silence(text: &str) -> Result<Duration, String> {
    let time = parse_duration(text).map_err(|error| error.to_string())?;
    if time.as_millis() <= u128::from(u16::MAX) { Ok(time) } else { Err("expected at most 65535ms".into()) }
}

/// What was found or done.
#[derive(Debug, Serialize)]
pub(crate) struct LssReport {
    devices: Vec<FoundDevice>,
    /// What was set, in words.
    done: Vec<String>,
    /// When it takes effect, and how, where it has not yet.
    pending: Option<String>,
    /// The node-ID that a node still has, and the one that it has from NMT reset communication on.
    #[serde(skip)]
    change: Option<(NodeId, Option<NodeId>)>,
}

/// A device, as far as it is known.
#[derive(Debug, Serialize)]
struct FoundDevice {
    /// As `lss set` takes it.
    address: String,
    vendor_id: u32,
    product_code: u32,
    revision_number: u32,
    serial_number: u32,
    /// `null` for none.
    node_id: Option<u8>,
}

/// The master of LSS, for the length of a command.
struct LssMaster<'a> {
    context: &'a Context,
    client: Client,
    /// Longest wait for each answer.
    within: Duration,
}

impl Lss {
    /// Does it. All devices wait again afterwards.
    pub(crate) async fn run(&self, context: &Context) -> Result<LssReport, Failure> {
        context.traffic.listen();
        let mut master = LssMaster { context, client: Client::new(self.within), within: self.within };
        let done = match &self.what {
            LssCommand::Scan => master.scan().await,
            LssCommand::Identify { make } => master.identify(*make).await,
            LssCommand::Inquire { device } => master.inquire(device.device).await,
            LssCommand::Set(set) => master.set(set).await,
        };
        master.ask(Request::SwitchGlobal(false)).await;
        context.settle().await;
        let mut done = done?;
        if let (LssCommand::Set(set), Some((old, new))) = (&self.what, done.change) {
            done.pending = set.take_effect(context, old, new).await?;
        }
        Ok(done)
    }
}

impl Set {
    /// NMT reset communication, if requested; else how to send it.
    async fn take_effect(
        &self,
        context: &Context,
        old: NodeId,
        new: Option<NodeId>,
    ) -> Result<Option<String>, Failure> {
        if !self.reset {
            let reset = NmtCommand::ResetCommunication.code();
            return Ok(Some(format!(
                "node {old} keeps its node-ID until NMT reset communication: ferrodrive send 000#{reset:02X}{:02X} (or --reset)",
                old.raw()
            )));
        }
        let nodes = new.map(|new| context.node(new));
        let booted = nodes.as_ref().map(|node| node.wait_boot_up(BOOT_PATIENCE));
        context.node(old).nmt(NmtCommand::ResetCommunication);
        match booted {
            Some(booted) => booted.await?,
            None => context.settle().await,
        }
        Ok(None)
    }
}

impl LssMaster<'_> {
    fn begin(&mut self, request: Request) {
        self.client.ask(request, self.context.network.now());
        if let Some(frame) = self.client.poll_transmit() {
            self.context.network.transmit(frame);
        }
    }

    /// Asks, and waits for the answer; `None` if there is none, or is to be none.
    async fn ask(&mut self, request: Request) -> Option<Reply> {
        self.begin(request);
        let network = &self.context.network;
        while let Some(due) = self.client.poll_timeout() {
            let now = network.now();
            let left = if due > now { due - now } else { Duration::ZERO };
            tokio::select! {
                passed = self.context.traffic.next() => {
                    if let Some(reply) = self.client.handle_frame(&passed.frame) {
                        return Some(reply);
                    }
                }
                () = network.sleep(left) => {
                    if self.client.handle_timeout(network.now()) {
                        return None;
                    }
                }
            }
        }
        None
    }

    /// Asks, and hears everything that comes for as long as an answer may take.
    async fn ask_all(&mut self, request: Request) -> Vec<Reply> {
        self.begin(request);
        let (context, mut replies) = (self.context, Vec::new());
        let listening = async {
            loop {
                let reply = Reply::parse(&context.traffic.next().await.frame);
                replies.extend(reply.filter(|reply| request.is_answered_by(reply)));
            }
        };
        tokio::select! {
            () = listening => {}
            () = context.network.sleep(self.within) => {}
        }
        replies
    }

    /// Refuses where more than one device answers: of a question to all of them the answers differ in one of the five.
    async fn is_alone(&mut self) -> Result<(), Failure> {
        for request in Part::ALL.into_iter().rev().map(Request::Inquire).chain([Request::InquireNodeId]) {
            let mut replies = self.ask_all(request).await;
            replies.dedup();
            if replies.len() > 1 {
                return Err(several());
            }
        }
        Ok(())
    }

    async fn scan(&mut self) -> Result<LssReport, Failure> {
        let mut devices = Vec::new();
        self.ask(Request::SwitchGlobal(false)).await;
        while devices.len() < MOST {
            let (mut scan, mut asked) = (FastScan::new(), 0);
            while let Some(request) = scan.next() {
                let answer = self.ask(request).await;
                scan.note(answer == Some(Reply::Identified));
                asked += 1;
                self.context.progress.count(format!("found {}; question {asked} of 133", devices.len()));
            }
            match scan.found() {
                Some(address) => devices.push(FoundDevice::new(address, None)),
                None if asked > 1 => {
                    return Err(went_away());
                }
                None => break,
            }
        }
        if devices.is_empty() {
            return Err(Failure::new("no device without a node-ID answers")
                .of_kind("no_node")
                .because(format!(
                    "a fastscan finds devices without a node-ID alone (CiA 305, 6.5.3), and not every device has LSS: {}",
                    without_lss()
                ))
                .next(
                    "ferrodrive scan finds those with a node-ID; `lss inquire only` asks the one device on the bus",
                ));
        }
        Ok(LssReport { devices, done: Vec::new(), pending: None, change: None })
    }

    async fn identify(&mut self, make: Make) -> Result<LssReport, Failure> {
        let Make { vendor_id, product_code, revision } = make;
        let mut search = Search::new(vendor_id, product_code, revision);
        let (mut addresses, mut asked) = (Vec::new(), 0);
        while let Some(request) = search.poll_request() {
            let answer = self.ask(request).await;
            if matches!(request, Request::Identify(Bound::HighestSerial, _)) {
                addresses.extend(search.note(answer == Some(Reply::Identified)));
                asked += 1;
                self.context.progress.count(format!("found {}; question {asked}", addresses.len()));
            }
            if addresses.len() == MOST {
                break;
            }
        }
        if addresses.is_empty() {
            let only_first = asked == 1;
            return Err(if only_first {
                no_answer(&format!("a device {vendor_id:X}:{product_code:X}"))
            } else {
                went_away()
            });
        }
        let mut devices = Vec::new();
        for address in addresses {
            self.select(MeantDevice::At(address)).await?;
            // Optional for a device.
            let node = match self.ask(Request::InquireNodeId).await {
                Some(Reply::NodeId(node)) => NodeId::new(node),
                _ => None,
            };
            devices.push(FoundDevice::new(address, node));
        }
        Ok(LssReport { devices, done: Vec::new(), pending: None, change: None })
    }

    /// Lets the device that is meant be configured, and no other.
    async fn select(&mut self, device: MeantDevice) -> Result<(), Failure> {
        self.ask(Request::SwitchGlobal(false)).await;
        let MeantDevice::At(address) = device else {
            self.ask(Request::SwitchGlobal(true)).await;
            return self.is_alone().await;
        };
        let mut selected = None;
        for (part, number) in Part::ALL.into_iter().zip(address.numbers) {
            selected = self.ask(Request::SwitchSelective(part, number)).await;
        }
        match selected {
            Some(_) => Ok(()),
            None => Err(no_answer(&format!("the device {}", address))),
        }
    }

    async fn number(&mut self, part: Part) -> Result<u32, Failure> {
        match self.ask(Request::Inquire(part)).await {
            Some(Reply::Number(_, number)) => Ok(number),
            _ => Err(no_answer("the device")),
        }
    }

    async fn inquire(&mut self, device: MeantDevice) -> Result<LssReport, Failure> {
        self.select(device).await?;
        let mut address = Address::default();
        for (part, number) in Part::ALL.into_iter().zip(&mut address.numbers) {
            *number = self.number(part).await?;
        }
        let Some(Reply::NodeId(node)) = self.ask(Request::InquireNodeId).await else {
            return Err(no_answer("the device"));
        };
        Ok(LssReport {
            devices: vec![FoundDevice::new(address, NodeId::new(node))],
            done: Vec::new(),
            pending: None,
            change: None,
        })
    }

    async fn set(&mut self, set: &Set) -> Result<LssReport, Failure> {
        self.select(set.device.device).await?;
        let mut done = Vec::new();
        // Optional for a device: without it the device decides when the new one takes effect.
        let before = match self.ask(Request::InquireNodeId).await {
            Some(Reply::NodeId(node)) => Some(NodeId::new(node)),
            _ => None,
        };
        let wanted = set.node_id.map(|NodeIdArg(node)| NodeId::new(node));
        if let Some(new) = wanted.flatten().filter(|new| before.flatten() != Some(*new)) {
            self.context.expect_free(new).await?;
        }
        if let Some(NodeIdArg(node)) = set.node_id {
            let what = if node == UNCONFIGURED { "no node-ID".to_owned() } else { format!("node-ID {node}") };
            let answer = self.ask(Request::ConfigureNodeId(node)).await;
            done.push(checked(&what, answer, "the device does not accept it")?);
        }
        if let Some(index) = set.bitrate {
            let rate = BIT_RATES_KBIT[usize::from(index)].unwrap_or_default();
            let answer = self.ask(Request::ConfigureBitRate { table: 0, index }).await;
            done.push(checked(&format!("{rate} kbit/s"), answer, "the device has no such bit rate")?);
        }
        if set.store {
            let answer = self.ask(Request::Store).await;
            done.push(checked("stored", answer, "the device cannot store it")?);
        }
        if let Some(silence) = set.activate {
            self.ask(Request::ActivateBitRate(silence.as_millis() as u16)).await;
            done.push(format!("new bit rate from {} ms on", silence.as_millis()));
        }
        let change = before.flatten().zip(wanted).filter(|(old, new)| Some(*old) != *new);
        Ok(LssReport { devices: Vec::new(), done, pending: None, change })
    }
}

fn went_away() -> Failure {
    Failure::new("a device stopped answering in the middle of the scan").next("give it more time: --within 200ms")
}

fn several() -> Failure {
    Failure::new("more than one device answers")
        .because("`only` is for a bus with a single LSS device; nothing was set")
        .next("name one by its address: `ferrodrive lss identify VENDOR:PRODUCT` and `lss scan` list them, and `ferrodrive read NODE 1018:*` reads it")
}

fn no_answer(who: &str) -> Failure {
    Failure::new(format!("{who} does not answer LSS"))
        .of_kind("no_answer")
        .because(format!("it is not there, has another address, or has no LSS (CiA 305): {}", without_lss()))
        .next("ferrodrive scan shows the nodes with a node-ID, `ferrodrive read NODE 1018:*` its address; give it more time: --within 200ms")
}

/// The models that have no LSS, in words.
fn without_lss() -> String {
    let without: Vec<_> = devices::all().iter().filter(|model| !model.lss).map(|model| model.name).collect();
    format!("according to their manuals, {} do not support it", without.join(", "))
}

const LSS_REFUSED: &str = "choose what its manual lists for LSS (CiA 305), or set it by its own objects";

/// What was set, or why not.
fn checked(what: &str, answer: Option<Reply>, refused: &str) -> Result<String, Failure> {
    match answer {
        Some(Reply::NodeIdConfigured(outcome) | Reply::BitRateConfigured(outcome) | Reply::Stored(outcome)) => {
            match outcome {
                Outcome::DONE => Ok(what.to_owned()),
                Outcome { code: 255, specific } => Err(Failure::new(format!("the device refused: {what}"))
                    .because(format!("the maker's error {specific}"))
                    .next(LSS_REFUSED)),
                Outcome { code, .. } => Err(Failure::new(format!("the device refused: {what}"))
                    .because(format!("{refused} (error {code})"))
                    .next(LSS_REFUSED)),
            }
        }
        _ => Err(no_answer("the device")),
    }
}

impl FoundDevice {
    fn new(address: Address, node_id: Option<NodeId>) -> Self {
        let [vendor_id, product_code, revision_number, serial_number] = address.numbers;
        Self {
            address: address.to_string(),
            vendor_id,
            product_code,
            revision_number,
            serial_number,
            node_id: node_id.map(NodeId::raw),
        }
    }
}

impl Report for LssReport {
    fn text(&self, paint: Paint) -> String {
        if self.devices.is_empty() {
            let pending = self.pending.as_ref().map(|pending| format!("\n{pending}")).unwrap_or_default();
            return format!("set: {}{pending}", self.done.join(", "));
        }
        let mut table = Table::new(&["address", "node-ID"]);
        for found in &self.devices {
            table.row([found.address.clone(), found.node_id.map_or_else(|| "none".into(), |node| node.to_string())]);
        }
        table.plain(paint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_four_hexadecimal_numbers() {
        let at = |numbers| Ok(MeantDevice::At(Address { numbers }));
        assert_eq!(device("100:1:0:2A"), at([0x100, 1, 0, 0x2A]));
        assert_eq!(device("0x100:1h:0:FFFFFFFF"), at([0x100, 1, 0, u32::MAX]));
        assert_eq!(device("only"), Ok(MeantDevice::Only));
        assert_eq!(make("100:1"), Ok(Make { vendor_id: 0x100, product_code: 1, revision: None }));
        assert_eq!(make("100:1:FFFFFFFF").map(|make| make.revision), Ok(Some(u32::MAX)));
        assert!(make("100").is_err() && make("100:1:2:3").is_err() && make("").is_err());
        for wrong in ["", "100", "100:1:0", "100:1:0:2A:1", "100:1:0:x", "100000000:1:0:1"] {
            assert!(device(wrong).unwrap_err().contains("e.g. 100:1:0:2A"), "{wrong}");
        }
        // CiA 305, table 1.
        assert_eq!((bit_rate("1M"), bit_rate("500k"), bit_rate("10k")), (Ok(0), Ok(2), Ok(8)));
        assert!(bit_rate("100k").is_err());
    }
}

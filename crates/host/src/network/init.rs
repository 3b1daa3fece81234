//! A machine file for the drives that a scan has found, or for drives that are named: what is known as keys, what is not known as
//! comments, and what a user adds next as examples.
//!
//! In: what was found, and which models the user says that nodes are. Out: rows, and the text of the file. A comment begins with `#` and
//! a blank; a `#` without one stands before a line that counts without it. Nothing is written to a drive.

use std::fmt::Write as _;
use std::time::Duration;

use can::Bitrate;
use canopen::object::{PRODUCER_HEARTBEAT_TIME, SERIAL_NUMBER};
use canopen::od::DefaultValue;
use canopen::{NmtState, NodeId};
use devices::Description;
use devices::variant::Variant;
use master::Network;
use master::identify::{Found, Knowledge};
use serde::Serialize;
use sim::machine::models;

use super::scan::ScannedNode;
use machine::file::Machine;
use words::drive::DriveSpec;
use words::failure::{Failure, FailureBody};
use words::models::file_of;
use words::plain;

/// Values of the example of `limits`, by its keys: what no drive is harmed by.
const LIMITS: [(&str, &str); 4] =
    [("speed", "\"100rpm\""), ("torque", "\"50%\""), ("current", "\"1A\""), ("position", "[-10000, 10000]")];

/// The machine file that was made of a bus, and which nodes it has.
#[derive(Debug, Serialize)]
pub struct InitReport {
    /// False if a drive is commented out.
    pub ok: bool,
    /// Why, and what to do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<FailureBody>,
    /// Of the bus in bit/s, where it is known.
    pub bitrate: Option<u32>,
    /// The drives of the file.
    pub nodes: Vec<InitNode>,
    /// Where the file is, unless it went to standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The file.
    pub toml: String,
}

/// A drive of the file.
#[derive(Clone, Debug, Serialize)]
pub struct InitNode {
    /// Its node-ID.
    pub node: u8,
    /// The model that the file has; `None` where the drive is commented out.
    pub model: Option<String>,
    /// True if the model is said by the user or by the node's identity, and not guessed.
    pub certain: bool,
    /// The models that it may be by its identity and objects.
    pub models: Vec<String>,
    /// The object that speaks for a guess.
    pub evidence: Option<String>,
    /// 1017h, in ms; 0 for never.
    pub heartbeat_ms: Option<u64>,
    /// 1018h:04, where it has one.
    pub serial_number: Option<u32>,
    /// What is not certain, and why.
    pub remark: Option<String>,
    /// Keys and values of its `options`.
    #[serde(skip)]
    options: Vec<(String, String)>,
    #[serde(skip)]
    description: Option<&'static Description>,
}

impl InitNode {
    /// A node that was found, and which model the user says that it is.
    ///
    /// Reads its serial number.
    pub async fn found(network: &Network, known: Option<&'static Description>, found: &Found) -> Self {
        let scanned = ScannedNode::new(known, found, here);
        let serial_number = match found.identity {
            Some(_) => network.node(found.node).read::<u32>(SERIAL_NUMBER).await.ok().filter(|number| *number != 0),
            None => None,
        };
        let named = if let Knowledge::Named(model) = &found.knowledge { Some(model.0) } else { None };
        // A model that the node contradicts is not that of the scan.
        let certain = known.or(named).filter(|model| scanned.model == Some(model.name));
        let guess = found.knowledge.guess().filter(|guess| certain.is_none() && guess.evidence().is_some());
        let models = match &found.knowledge {
            Knowledge::Guessed(guess) => guess.fitting().map(|model| model.name.to_owned()).collect(),
            _ => found.models.iter().map(|model| model.name.to_owned()).collect(),
        };
        let row = Self {
            node: scanned.node,
            model: None,
            certain: certain.is_some(),
            models,
            evidence: scanned.evidence.filter(|_| certain.is_none()),
            heartbeat_ms: scanned.heartbeat_ms,
            serial_number,
            remark: scanned.remark,
            options: Vec::new(),
            description: None,
        };
        match certain.or(guess.map(|guess| guess.description())) {
            Some(model) => row.of_model(model),
            None => row,
        }
    }

    /// A drive that is named as for `sim --drive`; `text` is what was typed.
    pub fn named(text: &str, spec: &DriveSpec) -> Self {
        let row = Self {
            node: spec.node.raw(),
            model: None,
            certain: true,
            models: vec![spec.model.name.to_owned()],
            evidence: None,
            heartbeat_ms: None,
            serial_number: None,
            remark: None,
            options: Vec::new(),
            description: None,
        };
        let options = text.split(',').skip(1).filter_map(|word| word.split_once('='));
        let options = options.map(|(key, value)| match (key.trim(), value.split_once(':')) {
            ("reading", Some((place, choice))) => (place.trim().to_owned(), choice.trim().to_owned()),
            (key, _) => (key.to_owned(), value.trim().to_owned()),
        });
        let mut row = row.of_model(spec.model);
        for (key, value) in options {
            // Of what is said twice the last counts, as with `sim`; a table of TOML has a key once.
            row.options.retain(|(other, _)| *other != key);
            row.options.push((key, value));
        }
        row
    }

    /// The node as a drive of this model, which the user says or the evidence.
    fn of_model(mut self, model: &'static Description) -> Self {
        self.model = Some(file_of(model).unwrap_or(model.name).to_owned());
        self.options = edition(model);
        // A heartbeat that is not the model's own as delivered has been stored.
        let delivered = model.row(PRODUCER_HEARTBEAT_TIME).map(|row| row.default);
        if let Some(ms) =
            self.heartbeat_ms.filter(|_| model.row(PRODUCER_HEARTBEAT_TIME).is_some_and(|row| row.access.is_writable()))
            && !matches!(delivered, Some(DefaultValue::Value(value)) if value == ms as i64)
        {
            self.options.push(("1017".to_owned(), ms.to_string()));
        }
        self.description = Some(model);
        self
    }

    /// The node as the model that the user chooses among those that it may be; as it is if the name is not one of these.
    pub fn chosen(self, name: &str) -> Self {
        let model = models().find(|model| model.name == name && self.models.iter().any(|fits| fits == name));
        match model {
            Some(model) => Self { certain: true, evidence: None, remark: None, ..self.of_model(model) },
            None => self,
        }
    }

    /// The node as it is taken for without another word: a guess that is not contradicted.
    pub fn guess(&self) -> Option<&str> {
        self.model.as_deref().filter(|_| !self.certain)
    }

    /// Files that it names are meant from this folder on.
    pub fn with_file(&mut self, path: impl FnOnce(&str) -> String) {
        if self.description.and_then(file_of).is_some() {
            self.model = self.model.as_deref().map(path);
        }
    }
}

/// The choice that makes a model what it is, where it is not the first.
fn edition(model: &'static Description) -> Vec<(String, String)> {
    let Some(base) = models().find(|base| model.is_edition_of(base) && !std::ptr::eq(*base, model)) else {
        return Vec::new();
    };
    let choices =
        base.variations.iter().flat_map(|variation| variation.choices.iter().map(move |one| (variation, one)));
    let mut picking = choices.filter(|(variation, choice)| {
        let mut variant = Variant::first_of(base.variations);
        variant.choose(variation.key, choice.name).is_ok() && std::ptr::eq(base.as_chosen(&variant), model)
    });
    picking.next().map(|(variation, choice)| (variation.key.to_owned(), choice.name.to_owned())).into_iter().collect()
}

impl InitReport {
    /// The file for these drives.
    pub fn new(nodes: Vec<InitNode>, bitrate: Option<Bitrate>) -> Self {
        // A drive that answers is on a bus of the one that it has.
        let own = || nodes.iter().filter(|node| node.certain).find_map(|node| node.description?.only_bitrate());
        let bitrate = bitrate.or_else(own);
        let toml = machine_file(&nodes, bitrate);
        let mut report =
            Self { ok: true, error: None, bitrate: bitrate.map(Bitrate::bits_per_second), nodes, file: None, toml };
        let failure = report.failure();
        report.ok = failure.is_none();
        report.error = failure.as_ref().map(FailureBody::from);
        report
    }

    /// That drives are commented out, and what to do.
    pub fn failure(&self) -> Option<Failure> {
        let open: Vec<_> = self.nodes.iter().filter(|node| node.model.is_none()).collect();
        let first = open.first()?;
        let of = self.nodes.len();
        let what = match open.len() {
            1 => format!("1 of {of} drives is commented out in the machine file: its model is not known"),
            open => format!("{open} of {of} drives are commented out in the machine file: their models are not known"),
        };
        let failure = open.iter().fold(Failure::new(what).of_kind("unknown_model"), |failure, node| {
            failure.because(format!("node {}: {}", node.node, alternatives(&node.models)))
        });
        let example = first.models.first().map_or("FILE.eds", String::as_str);
        let failure = failure.next(format!("name its model: --model {}={example}", first.node));
        Some(failure.next("or choose in the file, and remove the # of its lines"))
    }
}

/// How the user says which of `models` a node is, who reads the file.
fn here(node: NodeId, models: &[&str]) -> String {
    let model = models.first().unwrap_or(&"MODEL");
    format!("--model {node}={model} of `ferrodrive init`, or the line `model` below")
}

/// Which models a node may be, in words.
fn alternatives(models: &[String]) -> String {
    match models {
        [] => "not a known model; give its data sheet (FILE.eds)".to_owned(),
        [one] => format!("it may be {one}"),
        several => format!("it may be one of {}", several.join(", ")),
    }
}

/// The text of the file.
fn machine_file(nodes: &[InitNode], bitrate: Option<Bitrate>) -> String {
    let mut text = "# A machine file, begun by `ferrodrive init`. docs/machine-file.md describes each key; `ferrodrive check FILE` checks it.\n\
                    # Lines that begin with # and without a space after it are examples: remove the #, and put in the values of your machine.\n\n"
        .to_owned();
    let _ = match bitrate {
        Some(rate) => writeln!(text, "bitrate = \"{rate}\""),
        None => writeln!(
            text,
            "# The bit rate of the bus: nothing here shows it, and without this line it is 500k (`init --bitrate RATE` writes it).\n\
             #bitrate = \"500k\""
        ),
    };
    nodes.iter().for_each(|node| drive(&mut text, node));
    group(&mut text, nodes);
    base(&mut text, nodes);
    text
}

/// One `[[drive]]` with what is known of it, and examples.
fn drive(text: &mut String, node: &InitNode) {
    text.push('\n');
    if let Some(remark) = &node.remark {
        let _ = writeln!(text, "# {}", one_line(remark));
    }
    if let Some(number) = node.serial_number {
        let _ = writeln!(text, "# Serial number (1018h:04): {number}");
    }
    let off = if node.model.is_some() { "" } else { "#" };
    if !off.is_empty() {
        let _ = writeln!(text, "# Not in use yet: {}.", alternatives(&node.models));
    }
    let model = node.model.as_deref().or(node.models.first().map(String::as_str)).unwrap_or("FILE.eds");
    let others: Vec<_> = node.models.iter().map(String::as_str).filter(|other| *other != model).collect();
    let or = if node.certain || others.is_empty() { String::new() } else { format!("  # or {}", others.join(", ")) };
    let _ = writeln!(text, "{off}[[drive]]\n{off}model = {}{or}\n{off}node = {}", quoted(model), node.node);
    if !node.options.is_empty() {
        let options = node.options.iter().map(|(key, value)| format!("{} = {}", word(key), value_of(value)));
        let options = options.collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            text,
            "# What a simulated one has already when its power comes on.\n{off}options = {{ {options} }}"
        );
    }
    let has_heartbeat = node
        .description
        .is_none_or(|model| model.row(PRODUCER_HEARTBEAT_TIME).is_some_and(|row| row.access.is_writable()));
    if has_heartbeat {
        // What becomes operational by itself is left as it is by a boot-up without a reset.
        let by_itself = node.description.is_some_and(|model| model.nmt.start_state == NmtState::Operational);
        let boot = if by_itself { "boot --reset" } else { "boot" };
        let _ = match node.heartbeat_ms {
            Some(ms) if ms > 0 => writeln!(text, "# As read (1017h); `{boot}` sets it.\n{off}heartbeat = \"{ms}ms\""),
            Some(_) => {
                writeln!(text, "# It sends no heartbeat (1017h is 0); `{boot}` sets one.\n#heartbeat = \"500ms\"")
            }
            None => writeln!(text, "# How often it is to send its heartbeat (1017h).\n#heartbeat = \"500ms\""),
        };
    }
    text.push_str(
        "# What stands behind its shaft: turns of the shaft for one of the output (of a joint motor the last number of its model's name),\n\
         # and the way for one turn of the output.\n\
         #units = { gear_ratio = 50, feed_constant = \"10mm\" }\n\
         # What hangs on the shaft of a simulated one. A torque_nm beside it would pull all the time, as a weight does.\n\
         #load = { inertia_kg_m2 = 0.01, friction = { coulomb_nm = 0.05, viscous_nm_s = 0.001 } }\n",
    );
    let _ = match node.description.map(|model| (model, limits(model, node.node))) {
        Some((_, Some(limits))) => writeln!(text, "# Limits that `boot` sets.\n#limits = {{ {limits} }}"),
        Some((model, None)) => match own_limit(model, node.node) {
            Some(own) => writeln!(
                text,
                "# It has no limits by CiA 402; those of its own go in here, and `boot` sets them.\n#start_up = {{ {own} }}"
            ),
            None => Ok(()),
        },
        None => Ok(()),
    };
}

/// Examples for the limits of CiA 402 that a model has.
fn limits(model: &'static Description, node: u8) -> Option<String> {
    let takes = |(key, value): &&(&str, &str)| is_taken(model, node, &format!("limits = {{ {key} = {value} }}"));
    let taken: Vec<_> = LIMITS.iter().filter(takes).map(|(key, value)| format!("{key} = {value}")).collect();
    (!taken.is_empty()).then(|| taken.join(", "))
}

/// An example for a limit that only this model has, with its value as delivered.
fn own_limit(model: &'static Description, node: u8) -> Option<String> {
    let rows =
        model.dictionary.rows().iter().filter(|row| {
            (row.name.starts_with("max_") || row.name.starts_with("maximum_")) && row.access.is_writable()
        });
    let mut lines = rows.filter_map(|row| match row.default {
        DefaultValue::Value(value) => Some(format!("{} = {value}", row.name)),
        _ => None,
    });
    lines.find(|line| is_taken(model, node, &format!("start_up = {{ {line} }}")))
}

/// True if a drive may have this line. Of a model in a file nothing is said: the file may be anywhere.
fn is_taken(model: &'static Description, node: u8, line: &str) -> bool {
    Machine::parse(&format!("[[drive]]\nmodel = {}\nnode = {node}\n{line}", quoted(model.name))).is_ok()
}

/// An example of axes that move as one.
fn group(text: &mut String, nodes: &[InitNode]) {
    text.push_str(
        "\n# Axes that move as one, each with limits in degrees of its output: `ferrodrive group move FILE`.\n\
         #[[group]]\n#name = \"arm\"\n",
    );
    // A drive that interpolates over a time of its own goes evenly in cycles of that time.
    let mut own = nodes.iter().filter_map(|node| node.description?.first_axis()?.interpolation);
    let period = own.next().unwrap_or(Duration::from_millis(5));
    let _ = writeln!(text, "#period = \"{period:?}\"");
    for node in nodes.iter().filter(|node| node.model.is_some()) {
        let _ = writeln!(
            text,
            "#[[group.axis]]\n#node = {}\n#range_deg = [-90, 90]\n#velocity_deg_s = 90\n#acceleration_deg_s2 = 360\n\
             #jerk_deg_s3 = 3600\n#following_error_deg = 10",
            node.node
        );
    }
}

/// An example of a base on two wheels.
fn base(text: &mut String, nodes: &[InitNode]) {
    let mut ids = nodes.iter().filter(|node| node.model.is_some()).map(|node| node.node);
    let (Some(left), Some(right)) = (ids.next(), ids.next()) else { return };
    let _ = writeln!(
        text,
        "\n# A base on two wheels, left and right, and turns of each drive for a turn of its wheel forward: `ferrodrive drive-base FILE`.\n\
         #[base]\n#wheels = [{left}, {right}]\n#turns = [1, -1]\n#wheel_base_m = 0.4\n#wheel_radius_m = 0.084\n\
         #linear_m_s = 0.8\n#angular_rad_s = 2.0\n#wheel_m_s = 0.8\n#wheel_m_s2 = 0.8"
    );
}

/// Text for one comment.
fn one_line(text: &str) -> String {
    plain(&text.replace('\n', " "))
}

/// A text of TOML.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// A key of TOML.
fn word(key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { key.to_owned() } else { quoted(key) }
}

/// A number of TOML where it is one, else a text.
fn value_of(value: &str) -> String {
    match value.parse::<i64>() {
        Ok(number) if number.to_string() == value => value.to_owned(),
        _ => quoted(value),
    }
}

//! Machine files: an embedded virtual bus described in TOML, for `--bus sim:FILE.toml`, or which models are where on a real
//! bus, for `--machine FILE.toml`.
//!
//! A file names the drives and what is around them. Everything about a machine is put into the words of `ferrodrive sim`
//! and done by the same code, so that a file can do what a world command can, and no more.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use can::{Bitrate, Instant};
use canopen::NodeId;
use serde::Deserialize;
use sim::{Source, World};

use crate::embedded::{self, Embedded, SEED};
use crate::failure::Failure;
use crate::models::DriveProfile;
use crate::parse::drive_spec::{DriveSpec, drive_spec};

const EXAMPLE: &str =
    "[[drive]]\n           model = \"zlac8030l\"\n           node = 4\n           load = { torque_nm = 0.5 }";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineFile {
    bitrate: Option<String>,
    seed: Option<u64>,
    #[serde(default)]
    drive: Vec<DriveTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveTable {
    model: String,
    node: u8,
    supply_v: Option<f64>,
    #[serde(default)]
    supply: Supply,
    /// What is special about this one: the keys and values that follow a comma in `sim --drive`.
    #[serde(default)]
    options: BTreeMap<String, OptionValue>,
    #[serde(default)]
    load: Load,
    /// Input levels by name.
    #[serde(default)]
    inputs: BTreeMap<String, bool>,
    /// Where an input is active, in counts: `[low, high]`.
    #[serde(default)]
    switches: BTreeMap<String, [Bound; 2]>,
    #[serde(default)]
    rotor_locked: bool,
    /// Held temperatures by sensor (`motor`, `driver`).
    #[serde(default)]
    temperatures_c: BTreeMap<String, f64>,
    /// Broken components.
    #[serde(default)]
    faults: Vec<String>,
}

/// The supply: its voltage (also `supply_v`) and what is behind it.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Supply {
    voltage_v: Option<f64>,
    limit_a: Option<f64>,
    resistance_ohm: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Load {
    torque_nm: Option<f64>,
    inertia_kg_m2: Option<f64>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Bound {
    Counts(i64),
    Word(String),
}

/// The world that a file describes.
pub(crate) fn load(path: &Path) -> Result<Embedded, Failure> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string());
    text.and_then(|text| build(&text)).map_err(|reason| {
        Failure::usage(format!("cannot use the machine file {}", path.display()))
            .because(reason)
            .next(format!("a machine file looks like this:\n           {EXAMPLE}"))
    })
}

/// Which models are at which nodes of a real bus.
#[derive(Clone)]
pub(crate) struct Machine(pub(crate) Vec<(NodeId, &'static DriveProfile)>);

/// What a file says of the models at its nodes.
pub(crate) fn models(path: &str) -> Result<Machine, String> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string());
    text.and_then(|text| nodes(&text))
        .map(Machine)
        .map_err(|reason| format!("cannot use it: {reason}\na machine file looks like this:\n           {EXAMPLE}"))
}

fn nodes(text: &str) -> Result<Vec<(NodeId, &'static DriveProfile)>, String> {
    let mut nodes: Vec<(NodeId, &'static DriveProfile)> = Vec::new();
    for table in parse(text)?.drive {
        let spec = table.spec()?;
        if nodes.iter().any(|(node, _)| *node == spec.node) {
            return Err(format!("two drives at node {}", spec.node));
        }
        nodes.push((spec.node, spec.model));
    }
    Ok(nodes)
}

fn parse(text: &str) -> Result<MachineFile, String> {
    let file: MachineFile = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
    if file.drive.is_empty() { Err("it has no [[drive]]".into()) } else { Ok(file) }
}

fn build(text: &str) -> Result<Embedded, String> {
    let file = parse(text)?;
    let bitrate = file.bitrate.as_deref().map_or(Ok(Bitrate::K500), str::parse).map_err(|error| error.to_string())?;
    let mut world = World::new(bitrate, file.seed.unwrap_or(SEED));
    let mut drives = Vec::new();
    for table in &file.drive {
        let spec = table.spec()?;
        let order = spec.order(bitrate);
        let mut drive = embedded::ordered_drive(spec.model, &order).map_err(|failure| failure.what)?;
        // Before the power comes on: capacitors once charged would hold another voltage for a while.
        drive.set_source(table.source(), Instant::ZERO).map_err(|refused| refused.to_string())?;
        world.add_drive(spec.node.raw(), drive).map_err(|error| error.to_string())?;
        for command in table.commands() {
            obey(&mut world, &command)?;
        }
        drives.push((spec.node, spec.model));
    }
    Ok((world, drives))
}

/// Does what a world command says.
fn obey(world: &mut World, command: &str) -> Result<(), String> {
    let parsed: sim::command::Command = command.parse().map_err(|error| format!("{error}"))?;
    let answer = sim::command::answer(world, command).map(|answer| answer.json).unwrap_or_default();
    let done = answer.starts_with("{\"ok\":true");
    if done { Ok(()) } else { Err(format!("{parsed:?} was answered with {answer}")) }
}

impl DriveTable {
    fn spec(&self) -> Result<DriveSpec, String> {
        let mut spec = drive_spec(&format!("{}@{}", self.model, self.node))?;
        for (key, value) in &self.options {
            spec.set(key, &value.to_string()).map_err(|reason| format!("options of node {}: {reason}", self.node))?;
        }
        Ok(spec)
    }

    fn source(&self) -> Source {
        let Supply { voltage_v, limit_a, resistance_ohm } = self.supply;
        Source { voltage_v: voltage_v.or(self.supply_v), limit_a, resistance_ohm }
    }

    /// What the table says, as world commands.
    fn commands(&self) -> Vec<String> {
        let mut commands: Vec<String> = Vec::new();
        commands.extend(self.load.torque_nm.map(|torque| format!("load torque {torque}")));
        commands.extend(self.load.inertia_kg_m2.map(|inertia| format!("load inertia {inertia}")));
        commands.extend(self.inputs.iter().map(|(name, level)| format!("input {name} {}", u8::from(*level))));
        commands.extend(self.switches.iter().map(|(name, [low, high])| format!("switch {name} {low} {high}")));
        commands.extend(self.rotor_locked.then(|| "rotor lock".into()));
        commands.extend(self.temperatures_c.iter().map(|(sensor, celsius)| format!("temperature {sensor} {celsius}")));
        commands.extend(self.faults.iter().map(|component| format!("fault {component} on")));
        commands.iter().map(|command| format!("{} {command}", self.node)).collect()
    }
}

/// `2.01` as a text, `3` as a number.
#[derive(Deserialize)]
#[serde(untagged)]
enum OptionValue {
    Number(i64),
    Text(String),
}

impl std::fmt::Display for OptionValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Counts(counts) => write!(f, "{counts}"),
            Self::Word(word) => f.write_str(word),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        build(text).err().unwrap_or_default()
    }

    #[test]
    fn a_table_becomes_world_commands() {
        let text = "model = 'zlac8030l'\nnode = 7\nload = { torque_nm = 0.5 }\n\
                    inputs = { X0 = true }\nswitches = { X1 = ['min', -100] }\nfaults = ['hall']";
        let table: DriveTable = toml::from_str(text).unwrap();
        assert_eq!(table.commands(), ["7 load torque 0.5", "7 input X0 1", "7 switch X1 min -100", "7 fault hall on"]);
    }

    #[test]
    fn a_file_says_which_models_are_where_and_no_node_twice() {
        let text = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\nload = { torque_nm = 0.5 }\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4";
        let said: Vec<_> =
            nodes(text).unwrap_or_default().into_iter().map(|(node, model)| (node.raw(), model.model)).collect();
        assert_eq!(said, [(2, "zlim42c"), (4, "zlac8030l")]);
        let twice = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\n[[drive]]\nmodel = 'zlac8030l'\nnode = 2";
        assert_eq!(nodes(twice).err().as_deref(), Some("two drives at node 2"));
        assert!(models("/nowhere/machine.toml").is_err_and(|reason| reason.contains("[[drive]]")));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        assert!(refusal("").contains("no [[drive]]"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\ncolour = 1").contains("line 4"));
        assert!(refusal("[[drive]]\nmodel = 'zlac803'\nnode = 4").contains("did you mean zlac8030l?"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 200").contains("no node 200"));
        assert!(
            refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\noptions = { colour = 'red' }").contains("no 'colour'")
        );
        assert_eq!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\noptions = { 2014 = 100 }"), "");
        let supplied = |supply: &str| refusal(&format!("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nsupply = {supply}"));
        assert_eq!(supplied("{ voltage_v = 36, limit_a = 10, resistance_ohm = 0.2 }"), "");
        assert!(supplied("{ limit_a = 0 }").contains("0.01 to 1000 A"));
        assert!(supplied("{ voltage_v = 101 }").contains("0 to 100 V"));
        assert!(refusal("bitrate = '7k'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4").contains("bit rate must be"));
    }
}

//! Machine files: a virtual bus described in TOML, for `--bus sim:FILE.toml` and `sim --machine FILE.toml`, or which models
//! are where on a real bus, for `--machine FILE.toml` of every other command.
//!
//! A file names the drives and what is around them. Everything about a machine is put into the words of `ferrodrive sim`
//! and done by the same code, so that a file can do what a world command can, and no more.

mod reader;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use can::{Bitrate, Instant};
use canopen::NodeId;
use sim::machine::Realism;
use sim::{Source, VirtualDrive, World};

use crate::models::Description;
use crate::words::drive::{DriveSpec, drive_spec};
use reader::{Field, Table};

const EXAMPLE: &str =
    "[[drive]]\n           model = \"zlac8030l\"\n           node = 4\n           load = { torque_nm = 0.5 }";

/// Decides everything random where no seed is given: runs are repeatable.
pub const SEED: u64 = 1;

/// Largest file that is read. A bus has 127 drives, and a drive some lines.
const LARGEST: u64 = 1 << 20;

/// A machine as its file describes it.
#[derive(Clone, Default)]
pub struct Machine {
    /// The bus's rate, where it says one.
    pub bitrate: Option<Bitrate>,
    /// What decides everything random, where it says so.
    pub seed: Option<u64>,
    /// Whether its drives have the noise and the flaws of real ones, where it says so.
    pub realism: Option<Realism>,
    /// The drives, each at a node of its own.
    pub drives: Vec<Placed>,
}

/// One drive of a machine and what is around it.
#[derive(Clone)]
pub struct Placed {
    /// Which drive, and where.
    pub spec: DriveSpec,
    source: Source,
    /// What is around it, as world commands.
    commands: Vec<String>,
}

/// The machine that the file at `path` describes.
///
/// # Errors
/// What is wrong with the file.
pub fn read(path: &Path) -> Result<Machine, String> {
    Machine::parse(&text_of(path)?)
}

/// The machine of `--machine`.
///
/// # Errors
/// What is wrong with the file, and what one looks like.
pub fn machine(path: &str) -> Result<Machine, String> {
    read(Path::new(path)).map_err(|reason| format!("cannot use it: {reason}\n{}", example()))
}

/// What a machine file looks like, for messages.
pub fn example() -> String {
    format!("a machine file looks like this:\n           {EXAMPLE}")
}

/// The text of a file of sensible size. A pipe or a device, which may never end, is none.
fn text_of(path: &Path) -> Result<String, String> {
    let kind = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !kind.is_file() {
        return Err("it is no file but a directory, a pipe or a device".into());
    }
    let mut text = String::new();
    let file = File::open(path).map_err(|error| error.to_string())?;
    let read = file.take(LARGEST + 1).read_to_string(&mut text).map_err(|_| "it is no text".to_owned())?;
    if read as u64 > LARGEST { Err("it has more than 1 MB; no machine needs that".into()) } else { Ok(text) }
}

impl Machine {
    /// Reads the text of a machine file.
    ///
    /// # Errors
    /// What is wrong, at which line, and what is expected there.
    pub fn parse(text: &str) -> Result<Self, String> {
        reader::read(text, "a machine file", |file| {
            file.takes_only(&["bitrate", "seed", "realism", "drive"])?;
            let bitrate = file.get("bitrate").map(|field| rate(&field)).transpose()?;
            let seed = file.get("seed").map(|field| field.whole("a whole number from 0 on")).transpose()?;
            let realism = file.get("realism").map(|field| realism(&field)).transpose()?;
            let expected = "a table of its own for each drive, begun by [[drive]]";
            let tables = file.get("drive").map_or(Ok(Vec::new()), |field| field.list(expected))?;
            let mut drives: Vec<Placed> = Vec::new();
            for table in tables {
                let drive = Placed::parse(&table.table("a drive", expected)?)?;
                if drives.iter().any(|other| other.spec.node == drive.spec.node) {
                    return Err(table.at(&format!("two drives at node {}", drive.spec.node)));
                }
                drives.push(drive);
            }
            if drives.is_empty() {
                Err("it has no [[drive]]".into())
            } else {
                Ok(Self { bitrate, seed, realism, drives })
            }
        })
    }

    /// Which models are where.
    pub fn models(&self) -> impl Iterator<Item = (NodeId, &'static Description)> {
        self.drives.iter().map(|drive| (drive.spec.node, drive.spec.model))
    }

    /// Its bus, still without drives.
    pub fn world(&self) -> World {
        World::new(self.bitrate.unwrap_or(Bitrate::K500), self.seed.unwrap_or(SEED))
    }

    /// Makes the drives of its world, which are there already, as real as it says.
    pub fn make_real(&self, world: &mut World) {
        for placed in &self.drives {
            // A drive that is not there has been refused before.
            let _ = world.set_realism(placed.spec.node.raw(), self.realism.unwrap_or_default());
        }
    }

    /// Its bus with its drives and what is around them, at time zero.
    ///
    /// # Errors
    /// What a drive does not take, in a sentence.
    pub fn build(&self) -> Result<World, String> {
        let mut world = self.world();
        for placed in &self.drives {
            let spec = &placed.spec;
            let order = spec.order(world.bitrate());
            let mut drive = sim::machine::order(spec.model, &order).map_err(|error| error.to_string())?;
            placed.supply(drive.as_mut())?;
            world.add_drive(spec.node.raw(), drive).map_err(|error| error.to_string())?;
            placed.furnish(&mut world)?;
        }
        self.make_real(&mut world);
        Ok(world)
    }
}

/// A drive with nothing around it.
impl From<DriveSpec> for Placed {
    fn from(spec: DriveSpec) -> Self {
        Self { spec, source: Source::default(), commands: Vec::new() }
    }
}

fn rate(field: &Field<'_>) -> Result<Bitrate, String> {
    let expected = "a bit rate as text, e.g. \"500k\"";
    field.text(expected)?.parse().map_err(|error| field.at(&format!("{error}")))
}

fn realism(field: &Field<'_>) -> Result<Realism, String> {
    let expected = "\"ideal\" or \"full\"";
    field.text(expected)?.parse().map_err(|_| field.wrong(expected))
}

impl Placed {
    /// Sets the supply of the drive, before the power comes on: capacitors once charged would hold another voltage for a
    /// while.
    pub fn supply(&self, drive: &mut dyn VirtualDrive) -> Result<(), String> {
        let set = drive.set_source(self.source, Instant::ZERO);
        set.map_err(|refused| format!("supply of node {}: {refused}", self.spec.node))
    }

    /// Puts into the world what is around the drive, which is there already.
    pub fn furnish(&self, world: &mut World) -> Result<(), String> {
        self.commands.iter().try_for_each(|command| obey(world, command))
    }

    fn parse(table: &Table<'_>) -> Result<Self, String> {
        table.takes_only(&[
            "model",
            "node",
            "supply_v",
            "supply",
            "options",
            "load",
            "inputs",
            "switches",
            "rotor_locked",
            "temperatures_c",
            "faults",
        ])?;
        let expected = "the drive's model as text, e.g. \"zlac8030l\"";
        let model = table.need("model", expected)?;
        let node = table.need("node", NODE)?;
        let number: u8 = node.whole(NODE)?;
        let mut spec =
            drive_spec(&format!("{}@{number}", model.text(expected)?)).map_err(|reason| model.at(&reason))?;
        for option in fields(table, "options", "a table of options, e.g. { 6060 = 3 }")? {
            let value = option.word("a whole number or a text")?;
            spec.set(option.name(), &value)
                .map_err(|reason| option.at(&format!("options of node {number}: {reason}")))?;
        }
        let commands = surroundings(table)?.into_iter().map(|command| format!("{number} {command}")).collect();
        Ok(Self { spec, source: source(table)?, commands })
    }
}

const NODE: &str = "a node-ID from 1 to 127, e.g. 4";

/// The supply: its voltage (also `supply_v`) and what is behind it.
fn source(table: &Table<'_>) -> Result<Source, String> {
    let number = |table: &Table<'_>, name: &str, expected: &str| -> Result<Option<f64>, String> {
        table.get(name).map(|field| field.number(expected)).transpose()
    };
    let source = Source { voltage_v: number(table, "supply_v", VOLTAGE)?, limit_a: None, resistance_ohm: None };
    let Some(supply) = table.get("supply") else { return Ok(source) };
    let supply = supply.table("a supply", "a table, e.g. { voltage_v = 48, limit_a = 10 }")?;
    supply.takes_only(&["voltage_v", "limit_a", "resistance_ohm"])?;
    Ok(Source {
        voltage_v: number(&supply, "voltage_v", VOLTAGE)?.or(source.voltage_v),
        limit_a: number(&supply, "limit_a", "a current in A, e.g. 10")?,
        resistance_ohm: number(&supply, "resistance_ohm", "a resistance in ohms, e.g. 0.2")?,
    })
}

const VOLTAGE: &str = "a voltage in V, e.g. 48";

/// What is around a drive, as world commands.
fn surroundings(table: &Table<'_>) -> Result<Vec<String>, String> {
    let mut commands: Vec<String> = Vec::new();
    if let Some(load) = table.get("load") {
        let load = load.table("a load", "a table, e.g. { torque_nm = 0.5 }")?;
        load.takes_only(&["torque_nm", "inertia_kg_m2"])?;
        for (name, word) in [("torque_nm", "torque"), ("inertia_kg_m2", "inertia")] {
            let number = load.get(name).map(|field| field.number("a number, e.g. 0.5")).transpose()?;
            commands.extend(number.map(|number| format!("load {word} {number}")));
        }
    }
    for input in fields(table, "inputs", "a table of levels, e.g. { X0 = true }")? {
        let level = u8::from(input.flag("true or false")?);
        commands.push(format!("input {} {level}", word(&input)?));
    }
    for switch in fields(table, "switches", "a table of ranges, e.g. { X0 = [-5000, \"max\"] }")? {
        let [low, high] = bounds(&switch)?;
        commands.push(format!("switch {} {low} {high}", word(&switch)?));
    }
    if table.get("rotor_locked").map_or(Ok(false), |field| field.flag("true or false"))? {
        commands.push("rotor lock".into());
    }
    for sensor in fields(table, "temperatures_c", "a table of sensors, e.g. { motor = 95 }")? {
        commands.push(format!("temperature {} {}", word(&sensor)?, sensor.number("degrees Celsius, e.g. 95")?));
    }
    let expected = "a list of components, e.g. [\"hall\"]";
    for component in table.get("faults").map_or(Ok(Vec::new()), |field| field.list(expected))? {
        let name = component.text(expected)?;
        commands.push(format!("fault {} on", one_word(&component, name)?));
    }
    Ok(commands)
}

/// The two ends of a switch's range.
fn bounds(switch: &Field<'_>) -> Result<[String; 2], String> {
    const EXPECTED: &str = "two bounds, [low, high], each a whole number of counts, \"min\" or \"max\"";
    let ends = switch.list(EXPECTED)?;
    let words = ends.iter().map(|end| match end.word(EXPECTED) {
        Ok(word) if matches!(word.as_str(), "min" | "max") || word.parse::<i64>().is_ok() => Ok(word),
        _ => Err(end.wrong(EXPECTED)),
    });
    let words = words.collect::<Result<Vec<_>, _>>()?;
    <[String; 2]>::try_from(words).map_err(|_| switch.wrong(EXPECTED))
}

/// The names and values of the table behind `name`; none if it is not there.
fn fields<'a>(table: &Table<'a>, name: &'static str, expected: &str) -> Result<Vec<Field<'a>>, String> {
    let Some(field) = table.get(name) else { return Ok(Vec::new()) };
    Ok(field.table(name, expected)?.fields().collect())
}

/// The name of a field as a word of a world command.
fn word<'a>(field: &'a Field<'_>) -> Result<&'a str, String> {
    one_word(field, field.name())
}

/// A name that is one word: it must not bring words of its own into a world command.
fn one_word<'a>(field: &Field<'_>, name: &'a str) -> Result<&'a str, String> {
    let word = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if word { Ok(name) } else { Err(field.at(&format!("'{name}' is no name of anything on a drive"))) }
}

/// Does what a world command says.
fn obey(world: &mut World, command: &str) -> Result<(), String> {
    let answer = sim::command::answer(world, command).map(|answer| answer.json).unwrap_or_default();
    if answer.starts_with("{\"ok\":true") {
        return Ok(());
    }
    let said: serde_json::Value = serde_json::from_str(&answer).unwrap_or_default();
    Err(format!("'{command}' cannot be done: {}", said["error"].as_str().unwrap_or(&answer)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        Machine::parse(text).and_then(|machine| machine.build()).err().unwrap_or_default()
    }

    fn parsed(text: &str) -> Machine {
        Machine::parse(text).unwrap_or_else(|reason| panic!("{reason}"))
    }

    const DRIVE: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";

    #[test]
    fn a_table_becomes_world_commands() {
        let text = "[[drive]]\nmodel = 'zlac8030l'\nnode = 7\nload = { torque_nm = 0.5 }\n\
                    inputs = { X0 = true }\nswitches = { X1 = ['min', -100] }\nfaults = ['hall']\nrotor_locked = true";
        let commands = &parsed(text).drives[0].commands;
        let expected = ["7 load torque 0.5", "7 input X0 1", "7 switch X1 min -100", "7 rotor lock", "7 fault hall on"];
        assert_eq!(*commands, expected);
    }

    #[test]
    fn a_file_says_which_models_are_where_and_no_node_twice() {
        let text = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\nload = { torque_nm = 0.5 }\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4";
        let said: Vec<_> = parsed(text).models().map(|(node, model)| (node.raw(), model.name)).collect();
        assert_eq!(said, [(2, "zlim42c"), (4, "zlac8030l")]);
        let twice = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\n[[drive]]\nmodel = 'zlac8030l'\nnode = 2";
        assert_eq!(refusal(twice), "line 4: two drives at node 2");
        assert!(machine("/nowhere/machine.toml").is_err_and(|reason| reason.contains("[[drive]]")));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place_and_what_is_expected() {
        let with = |line: &str| refusal(&format!("{DRIVE}{line}"));
        assert!(refusal("").contains("no [[drive]]"));
        assert_eq!(with("colour = 1").split("; it has").next(), Some("line 4: a drive has no 'colour'"));
        assert!(with("suply_v = 1").contains("did you mean supply_v?"));
        assert!(
            refusal("[[drive]]\nmodel = 'zlac803'\nnode = 4")
                .contains("line 2: 'zlac803' is no model; did you mean zlac8030l?")
        );
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 200").contains("no node 200"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 300").contains("'node' is 300; expected a node-ID"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'").contains("line 1: a drive needs 'node'"));
        assert!(refusal("[[drive]]\nmodel = 4\nnode = 4").contains("'model' is 4; expected the drive's model as text"));
        assert!(with("options = { colour = 'red' }").contains("no 'colour'"));
        assert_eq!(with("options = { 2014 = 100 }"), "");
        assert!(with("supply_v = 'high'").contains("'supply_v' is \"high\"; expected a voltage"));
        assert!(with("supply_v = nan").contains("expected a voltage"));
        assert_eq!(with("supply = { voltage_v = 36, limit_a = 10, resistance_ohm = 0.2 }"), "");
        assert!(with("supply = { limit_a = 0 }").contains("0.01 to 1000 A"));
        assert_eq!(refusal("realism = 'full'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4"), "");
        assert!(refusal("realism = 'much'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4").contains("ideal"));
        assert!(with("supply = { voltage_v = 101 }").contains("0 to 100 V"));
        assert!(with("supply = 48").contains("'supply' is 48; expected a table"));
        assert!(with("load = 5").contains("'load' is 5; expected a table, e.g. { torque_nm = 0.5 }"));
        assert!(with("inputs = { X0 = 1 }").contains("'X0' is 1; expected true or false"));
        assert!(with("rotor_locked = 'yes'").contains("expected true or false"));
        assert!(with("faults = 'hall'").contains("expected a list of components"));
        assert!(with("faults = ['gear']").contains("'4 fault gear on' cannot be done: "));
        assert!(with("inputs = { 'X0 1\\n4 rotor lock' = true }").contains("is no name"));
        assert!(refusal("drive = 3").contains("begun by [[drive]]"));
        assert!(refusal(&format!("bitrate = '7k'\n{DRIVE}")).contains("bit rate must be"));
        assert!(refusal(&format!("bitrate = 500\n{DRIVE}")).contains("expected a bit rate as text"));
        assert!(refusal("[[drive]]\nmodel = ").starts_with("line 2: "));
    }

    #[test]
    fn a_switch_has_two_bounds() {
        let with = |range: &str| refusal(&format!("{DRIVE}switches = {{ X0 = {range} }}"));
        assert_eq!(with("[-5000, 'max']"), "");
        assert!(with("[1, 2, 3]").contains("line 4: 'X0' is a list of 3; expected two bounds, [low, high]"));
        assert!(with("[1]").contains("expected two bounds"));
        assert!(with("[1, 'top']").contains("'X0' is \"top\"; expected two bounds"));
        assert!(with("[1.5, 2]").contains("'X0' is 1.5; expected two bounds"));
        assert!(with("5").contains("expected two bounds"));
    }

    /// Words that only a programmer of Rust knows.
    #[test]
    fn no_refusal_speaks_of_rust() {
        let values =
            ["1", "-1", "1.5", "'a'", "true", "[]", "{}", "[1]", "[[]]", "{ a = 1 }", "2026-11-22", "1e999", "inf"];
        let names =
            ["model", "node", "supply_v", "options", "load", "inputs", "switches", "rotor_locked", "faults", "else"];
        for (name, value) in names.iter().flat_map(|name| values.map(|value| (name, value))) {
            let drive = if *name == "model" || *name == "node" { "[[drive]]\n" } else { DRIVE };
            let said = refusal(&format!("{drive}{name} = {value}"));
            let rust =
                ["sequence", "map", "variant", "enum", "struct", "f64", "u8", "i64", "string", "boolean", "Some"];
            let spoken = said.split(|c: char| !c.is_alphanumeric()).find(|word| rust.contains(word));
            assert_eq!(spoken, None, "{name} = {value}: {said}");
        }
    }

    #[test]
    fn only_a_file_of_sensible_size_is_read() {
        let path = std::env::temp_dir().join(format!("ferrodrive-large-{}.toml", std::process::id()));
        std::fs::write(&path, format!("{DRIVE}# {}", " ".repeat(LARGEST as usize))).unwrap();
        let said = machine(path.to_str().unwrap()).err().unwrap_or_default();
        std::fs::remove_file(&path).unwrap();
        assert!(said.contains("more than 1 MB"), "{said}");
        assert!(machine("/").is_err_and(|said| said.contains("no file")));
        #[cfg(unix)]
        assert!(machine("/dev/zero").is_err_and(|said| said.contains("no file")));
    }
}

//! Machine files: drives and what is around them, described in TOML, for a virtual bus (`--bus sim:FILE.toml`, `sim --machine
//! FILE.toml`, `run`), or which models are where on a real bus (`--machine FILE.toml` of every other command).
//!
//! Everything about a machine becomes a [`Stimulus`](sim::Stimulus) of `ferrodrive sim` and is done by the same code, so that a file can do
//! what a world command can, and no more. Each key is described in `docs/machine-file.md`.

mod bodies;
mod configuration;
mod cycles;
mod fidelity;
mod fields;
mod loops;
mod motion;
mod mounted;
mod placed;
mod surroundings;
mod units;

use std::path::Path;

use can::Bitrate;
use canopen::{Mux, NodeId};
use master::identify::Identity;
use master::parameters::{Parameters, from_any_state};
use plant::coupled::{ArmModel, DifferentialDriveModel};
use sim::machine::{Realism, TimingMode};
use sim::{CoupledShaft, Fidelity, VirtualDrive, World};

use bodies::Joined;
pub use configuration::{mapped, pdo_id, sdo_server_record, tpdo_id};
pub use cycles::{BASE_PERIOD, CyclePlan, GROUP_PERIOD, TOLERANCE, TooFull, speed_mode, too_full, too_full_at};
use fields::{noted, optional_word, rate};
pub use motion::{AxisPlan, BasePlan, GroupPlan, WATCHDOG};
pub use placed::{DRIVE_KEYS, Placed};
use words::document::reader::{self, Parameters as Placeholders, Table};
use words::document::{BadFile, Problem, read_text};
use words::models::Description;

/// What each table of a file looks like, by the words with which messages name it.
const EXAMPLES: [(&str, &str); 3] = [
    (
        "a group",
        "[[group]]\n           name = \"arm\"\n           [[group.axis]]\n           node = 1\n           \
         velocity_deg_s = 90\n           acceleration_deg_s2 = 360\n           jerk_deg_s3 = 3600\n           \
         following_error_deg = 10",
    ),
    (
        "a base",
        "[base]\n           wheels = [4, 5]\n           turns = [1, -1]\n           wheel_base_m = 0.4\n           \
         wheel_radius_m = 0.084\n           linear_m_s = 0.8\n           angular_rad_s = 2.0\n           \
         wheel_m_s = 0.8\n           wheel_m_s2 = 0.8",
    ),
    (
        "a drive",
        "[[drive]]\n           model = \"zlac8030l\"\n           node = 4\n           load = { torque_nm = 0.5 }",
    ),
];

/// The seed where none is given: runs are repeatable.
pub const SEED: u64 = 1;

/// Node-IDs that there are.
const MOST_DRIVES: usize = 127;

/// What a machine file may say of its bus.
pub const BUS_KEYS: &[&str] =
    &["bitrate", "seed", "realism", "timing", "fidelity", "sync_counter", "drive", "body", "group", "base"];

/// A machine as its file describes it.
#[derive(Clone, Debug, Default)]
pub struct Machine {
    /// The bus's rate, where it says one.
    pub bitrate: Option<Bitrate>,
    /// The seed of everything random, where it is given.
    pub seed: Option<u64>,
    /// Whether its drives have the noise and the flaws of real ones, where it is given.
    pub realism: Option<Realism>,
    /// Whether its drives take the time that such drives take, where it is given; a drive may have its own.
    pub timing: Option<TimingMode>,
    /// How much of its drives is computed, where it is given; a drive may have its own.
    pub fidelity: Option<Fidelity>,
    /// The highest counter of the SYNC that a master produces, 1019h of the devices; without one it has no counter.
    pub sync_counter: Option<u8>,
    /// The drives, each at a node of its own.
    pub drives: Vec<Placed>,
    /// Those that a master moves as one.
    pub groups: Vec<GroupPlan>,
    /// The base that a master drives.
    pub base: Option<BasePlan>,
    /// What they move together.
    pub(crate) bodies: Vec<Joined>,
}

/// The machine that the file at `path` describes. Data sheets that it names are looked for beside it.
///
/// # Errors
/// What is wrong with the file.
pub fn read(path: &Path) -> Result<Machine, String> {
    read_with_text(path).map(|(machine, _)| machine)
}

/// As [`read`], with the text of the file.
///
/// # Errors
/// What is wrong with the file.
pub fn read_with_text(path: &Path) -> Result<(Machine, String), String> {
    let text = read_text(path)?;
    let machine = Machine::parse_in(&text, path.parent().unwrap_or(Path::new("")));
    machine.map(|machine| (machine, text)).map_err(|bad| bad.named(path.display().to_string()).to_string())
}

/// The machine of `--machine`.
///
/// # Errors
/// What is wrong with the file, and what one looks like.
pub fn machine(path: &str) -> Result<Machine, String> {
    read(Path::new(path)).map_err(|reason| format!("cannot use it:\n{reason}\n{}", example(&reason)))
}

/// What a machine file looks like, of the table that is wrong, for messages.
pub fn example(reason: &str) -> String {
    let [group, base, drive] = EXAMPLES;
    let of_it = [group, base].into_iter().find(|(named, _)| reason.contains(&format!("{named} "))).unwrap_or(drive);
    let what = if of_it == drive { "a machine file" } else { of_it.0 };
    format!("{what} looks like this:\n           {}", of_it.1)
}

impl Machine {
    /// Reads the text of a machine file; data sheets that it names are looked for in the current folder.
    ///
    /// # Errors
    /// Everything that is wrong, with its place and what is expected there.
    pub fn parse(text: &str) -> Result<Self, BadFile> {
        Self::parse_in(text, Path::new(""))
    }

    /// As [`parse`](Self::parse), with data sheets looked for in `folder`.
    ///
    /// # Errors
    /// The same.
    pub fn parse_in(text: &str, folder: &Path) -> Result<Self, BadFile> {
        reader::read(text, &Placeholders::new(), "a machine file", |file| Self::from_table(file, folder))
            .map_err(|problems| BadFile::new(text, problems))
    }

    /// Takes a machine out of a table, be it a file of its own or a part of another.
    ///
    /// # Errors
    /// Everything that is wrong.
    pub fn from_table(file: &Table<'_>, folder: &Path) -> Result<Self, Vec<Problem>> {
        let mut problems = file.strangers(BUS_KEYS);
        let bitrate = noted(file.get("bitrate").map(|field| rate(&field)).transpose(), &mut problems);
        let seed =
            noted(file.get("seed").map(|field| field.whole("a whole number from 0 on")).transpose(), &mut problems);
        let realism = noted(optional_word(file, "realism", "\"ideal\" or \"full\""), &mut problems);
        let timing = noted(optional_word(file, "timing", "\"device\" or \"ideal\""), &mut problems);
        let fidelity = noted(optional_word(file, "fidelity", "\"full\" or \"mechanical\""), &mut problems);
        let sync_counter = noted(configuration::sync_counter(file), &mut problems);
        let mut machine = Self { bitrate, seed, realism, timing, fidelity, sync_counter, ..Self::default() };
        let expected = "a table of its own for each drive, begun by [[drive]]";
        let tables = file.get("drive").map_or(Ok(Vec::new()), |field| field.list(expected));
        let tables = tables.unwrap_or_else(|problem| {
            problems.push(problem);
            Vec::new()
        });
        let none = tables.is_empty();
        if let Some(beyond) = tables.get(MOST_DRIVES) {
            problems.push(beyond.problem(format!("a bus has at most {MOST_DRIVES} nodes (CiA 301, 7.2.8)")));
            return Err(problems);
        }
        for field in tables {
            match field
                .table("a drive", expected)
                .map_err(|problem| vec![problem])
                .and_then(|table| Placed::parse(&table, folder))
            {
                Err(wrong) => problems.extend(wrong),
                Ok(drive) if machine.drives.iter().any(|other| other.spec.node == drive.spec.node) => {
                    problems.push(field.problem(format!("two drives at node {}", drive.spec.node)));
                }
                Ok(drive) => machine.drives.push(drive),
            }
        }
        let expected = "a table of its own for each body, begun by [[body]]";
        let bodies = noted(file.get("body").map_or(Ok(Vec::new()), |field| field.list(expected)), &mut problems);
        for field in bodies {
            match Joined::parse(&field) {
                Ok(joined) => machine.bodies.push(joined),
                Err(problem) => problems.push(problem),
            }
        }
        let nodes: Vec<_> = machine.drives.iter().map(|drive| drive.spec.node).collect();
        (machine.groups, machine.base) = motion::read(file, &nodes, &mut problems);
        if none && problems.is_empty() {
            problems.push(Problem::new(file.place(), "it has no [[drive]]"));
        }
        if problems.is_empty() { Ok(machine) } else { Err(problems) }
    }

    /// Which models are where.
    pub fn models(&self) -> impl Iterator<Item = (NodeId, &'static Description)> {
        let nodes = self.drives.iter().filter(|drive| !drive.spec.unconfigured);
        nodes.map(|drive| (drive.spec.node, drive.spec.description()))
    }

    /// What a master shall have a node be set to: `pdos`, `limits`, `heartbeat` and `start_up` of its drive, and the identity of its
    /// model. `None` for a node that is not in the file.
    pub fn parameters(&self, node: NodeId) -> Option<Parameters> {
        let placed = self.drives.iter().find(|drive| drive.spec.node == node)?;
        let model = placed.spec.description().identity;
        let known = |number: u32| Some(number).filter(|number| *number != 0);
        let identity = Identity {
            device_type: None,
            vendor_id: known(model.vendor_id),
            product_code: known(model.product_code),
            revision_number: known(model.revision_number),
        };
        Some(Parameters { identity, node: Some(node), values: placed.start_up.clone() })
    }

    /// The records of the SDO servers by which a master asks nodes, where it says them.
    pub fn sdo_servers(&self) -> impl Iterator<Item = (NodeId, u16)> {
        self.drives.iter().filter_map(|drive| Some((drive.spec.node, drive.sdo_server?)))
    }

    /// The writes that set a node up so, whatever it has, in the order of CiA 301; none for a node that is not in the file, or
    /// of which it says nothing.
    pub fn configuration(&self, node: NodeId) -> Vec<(Mux, Vec<u8>)> {
        let Some(placed) = self.drives.iter().find(|drive| drive.spec.node == node) else { return Vec::new() };
        from_any_state(Some(placed.spec.description()), node, &placed.start_up)
    }

    /// The bit rate of its bus: 500 kbit/s where it names none.
    pub fn bus_bitrate(&self) -> Bitrate {
        self.bitrate.unwrap_or(Bitrate::K500)
    }

    /// Its bus, still without drives.
    pub fn world(&self) -> World {
        World::new(self.bus_bitrate(), self.seed.unwrap_or(SEED))
    }

    /// Whether a drive of it takes its time: as itself says, or the machine. As real ones do, where neither says anything.
    pub fn timing_of(&self, placed: &Placed) -> TimingMode {
        placed.spec.timing.or(self.timing).unwrap_or(TimingMode::Device)
    }

    /// Makes the drives of its world, which are there already, as real as it says.
    pub fn make_real(&self, world: &mut World) {
        for placed in &self.drives {
            // A drive that is not there has been refused before.
            let _ = world.set_realism(placed.spec.node.raw(), self.realism.unwrap_or_default());
        }
    }

    /// Joins the drives of its world, which are there already, to what they move together.
    ///
    /// # Errors
    /// What is in the way, with its place in the file.
    pub fn join(&self, world: &mut World) -> Result<(), BadFile> {
        let mounted = self.drives.iter().filter_map(|placed| Some((placed.spec.node, placed.shaft.as_ref()?)));
        mounted.into_iter().try_for_each(|(node, on)| on.take(world, node))?;
        self.bodies.iter().try_for_each(|body| body.couple(world))
    }

    /// Its bus with its drives and what is around them, at time zero.
    ///
    /// # Errors
    /// What a drive does not take, with its place in the file.
    pub fn build(&self) -> Result<World, BadFile> {
        self.build_with(&mut |_, _| {})
    }

    /// The same; each drive is handed out, by its number, before its power comes on: what it has stored can be put back into it.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn build_with(&self, prepare: &mut dyn FnMut(u8, &mut dyn VirtualDrive)) -> Result<World, BadFile> {
        self.check_realism()?;
        let mut world = self.world();
        let mut problems = Vec::new();
        for placed in &self.drives {
            let spec = &placed.spec;
            let order = self.order_of(placed, world.bitrate());
            let mut drive =
                sim::machine::order(spec.model, &order).map_err(|error| placed.refused(None, &error.to_string()))?;
            let supplied = placed.supply(drive.as_mut());
            prepare(spec.node.raw(), drive.as_mut());
            world.set_timing(self.timing_of(placed));
            let added = world.add_drive(spec.node.raw(), drive);
            added.map_err(|error| placed.refused(None, &error.to_string()))?;
            for refused in [supplied, placed.furnish(&mut world)] {
                problems.extend(refused.err().into_iter().flat_map(|bad| bad.problems));
            }
        }
        BadFile::none_or(problems)?;
        self.join(&mut world)?;
        self.make_real(&mut world);
        Ok(world)
    }

    /// The bases on two wheels that it simulates: name, model, and the nodes, the left one first, with turns of the wheel for one of
    /// the drive.
    pub(crate) fn differential_drives(&self) -> impl Iterator<Item = (&str, &DifferentialDriveModel, [(u8, f64); 2])> {
        self.bodies
            .iter()
            .filter_map(|body| body.differential_drive().map(|(model, wheels)| (body.name(), model, wheels)))
    }

    /// The arms that it simulates: name, model, and the shafts of its joints, the base first.
    pub(crate) fn arms(&self) -> impl Iterator<Item = (&str, &ArmModel, &[CoupledShaft])> {
        self.bodies.iter().filter_map(|body| body.arm().map(|(model, shafts)| (body.name(), model, shafts)))
    }

    /// The names of the machines that its drives move together.
    pub fn body_names(&self) -> impl Iterator<Item = &str> {
        self.bodies.iter().map(Joined::name)
    }

    /// Whether one of them has this name.
    pub fn has_body(&self, name: &str) -> bool {
        self.body_names().any(|its| its == name)
    }

    /// What of the file counts for a simulated machine only, in words: a master on a real bus does not use it. `None` if there
    /// is nothing.
    pub fn unused_by_a_master(&self) -> Option<String> {
        let bodies = self.bodies.first().map(|_| "body");
        let bus = [
            self.bitrate.map(|_| "bitrate"),
            self.seed.map(|_| "seed"),
            self.realism.map(|_| "realism"),
            self.timing.map(|_| "timing"),
            self.fidelity.map(|_| "fidelity"),
            bodies,
        ];
        let bus = bus.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let of_drive = |placed: &Placed| format!("{} of node {}", placed.keys.join(", "), placed.spec.node);
        let drives = self.drives.iter().filter(|placed| !placed.keys.is_empty()).map(of_drive);
        let parts: Vec<_> = Some(bus).filter(|bus| !bus.is_empty()).into_iter().chain(drives).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        Machine::parse(text).and_then(|machine| machine.build()).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    fn parsed(text: &str) -> Machine {
        Machine::parse(text).unwrap_or_else(|reason| panic!("{reason}"))
    }

    const DRIVE: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";

    #[test]
    fn the_example_of_a_remedy_is_of_the_table_that_is_wrong_and_is_taken() {
        for (reason, table) in [
            ("m.toml:4:1: a group has no 'axes'", "[[group]]"),
            ("an axis of a group needs 'velocity_deg_s'", "[[group.axis]]"),
            ("a base needs 'wheels'", "[base]"),
            ("a drive has no 'nodes'", "[[drive]]"),
        ] {
            let shown = example(reason);
            let lines = shown.lines().skip(1).map(str::trim).collect::<Vec<_>>().join("\n");
            assert!(lines.contains(table), "{reason}: {shown}");
            let drives = [1, 4, 5].map(|node| format!("[[drive]]\nmodel = 'zlac8030l'\nnode = {node}\n"));
            parsed(&if table == "[[drive]]" { lines } else { drives.concat() + &lines });
        }
    }

    #[test]
    fn a_table_becomes_world_commands() {
        let text = "[[drive]]\nmodel = 'zlac8030l'\nnode = 7\nload = { torque_nm = 0.5 }\n\
                    inputs = { X0 = true }\nswitches = { X1 = ['min', -100] }\nfaults = ['hall']\nrotor_locked = true";
        let around: Vec<_> = parsed(text).drives[0].around.iter().map(|(stimulus, _)| stimulus.to_string()).collect();
        assert_eq!(around, ["load torque 0.5", "input X0 1", "switch X1 min -100", "rotor lock", "fault hall on"]);
    }

    #[test]
    fn a_file_says_which_models_are_where_and_no_node_twice() {
        let text = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\nload = { torque_nm = 0.5 }\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4";
        let said: Vec<_> = parsed(text).models().map(|(node, model)| (node.raw(), model.name)).collect();
        assert_eq!(said, [(2, "zlim42c"), (4, "zlac8030l")]);
        let twice = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\n[[drive]]\nmodel = 'zlac8030l'\nnode = 2";
        assert_eq!(refusal(twice), "line 4, column 1: two drives at node 2\n  4 | [[drive]]\n    | ^^^^^^^^^");
        assert!(machine("/nowhere/machine.toml").is_err_and(|reason| reason.contains("[[drive]]")));
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_place_and_what_is_expected() {
        let with = |line: &str| refusal(&format!("{DRIVE}{line}"));
        assert!(refusal("").contains("no [[drive]]"));
        assert_eq!(with("colour = 1").split("; it has").next(), Some("line 4, column 1: a drive has no 'colour'"));
        assert!(with("suply_v = 1").contains("did you mean supply_v?"));
        assert!(
            refusal("[[drive]]\nmodel = 'zlac803'\nnode = 4")
                .contains("line 2, column 9: 'zlac803' is not a model; did you mean zlac8030l?")
        );
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 200").contains("no node 200"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 300").contains("'node' is 300; expected a node-ID"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'").contains("line 1, column 1: a drive needs 'node'"));
        assert!(refusal("[[drive]]\nmodel = 4\nnode = 4").contains("'model' is 4; expected the drive's model as text"));
        assert!(with("options = { colour = 'red' }").contains("no 'colour'"));
        assert_eq!(with("options = { 2014 = 100 }"), "");
        assert!(with("supply_v = 'high'").contains("'supply_v' is \"high\"; expected a voltage"));
        assert!(with("supply_v = nan").contains("expected a voltage"));
        assert_eq!(with("supply = { voltage_v = 36, limit_a = 10, resistance_ohm = 0.2 }"), "");
        assert!(with("supply = { limit_a = -1 }").contains("0 to 1000 A"));
        assert_eq!(refusal("realism = 'full'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4"), "");
        assert!(refusal("realism = 'much'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4").contains("ideal"));
        assert!(with("supply = { voltage_v = 101 }").contains("0 to 100 V"));
        assert!(with("supply = 48").contains("'supply' is 48; expected a table"));
        assert!(with("load = 5").contains("'load' is 5; expected a table, e.g. { torque_nm = 0.5 }"));
        assert!(with("inputs = { X0 = 1 }").contains("'X0' is 1; expected true or false"));
        assert!(with("rotor_locked = 'yes'").contains("expected true or false"));
        assert!(with("faults = 'hall'").contains("expected a list of components"));
        assert!(with("faults = ['gear']").contains("line 4, column 11: 'fault gear on' cannot be done: "));
        assert!(with("inputs = { 'X0 1\\n4 rotor lock' = true }").contains("is not the name of an"));
        assert!(refusal("drive = 3").contains("begun by [[drive]]"));
        assert!(refusal(&format!("bitrate = '7k'\n{DRIVE}")).contains("bit rate must be"));
        assert!(refusal(&format!("bitrate = 500\n{DRIVE}")).contains("expected a bit rate as text"));
        assert!(refusal("[[drive]]\nmodel = ").starts_with("line 2, column "));
    }

    #[test]
    fn a_switch_has_two_bounds() {
        let with = |range: &str| refusal(&format!("{DRIVE}switches = {{ X0 = {range} }}"));
        assert_eq!(with("[-5000, 'max']"), "");
        assert!(with("[1, 2, 3]").contains("line 4, column 19: 'X0' is a list of 3; expected two bounds, [low, high]"));
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
    fn all_that_is_wrong_is_reported_at_once_in_the_order_of_the_file() {
        let bad = Machine::parse("colour = 1\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nload = { torque_nm = 'much' }\nfaults = ['gear']\n[[drive]]\nmodel = 'x'\nnode = 5\n").err();
        let lines: Vec<_> = bad.iter().flat_map(|bad| &bad.problems).map(|problem| problem.line).collect();
        assert_eq!(lines, [1, 5, 6, 8]);
    }

    fn lines_reported(text: &str) -> Vec<usize> {
        let bad = Machine::parse(text).and_then(|machine| machine.build()).err();
        bad.iter().flat_map(|bad| &bad.problems).map(|problem| problem.line).collect()
    }

    #[test]
    fn all_that_is_wrong_with_one_drives_table_is_reported() {
        // In what it says: each number of a part, each entry of a list, a model and a node that there are not.
        let said = "[[drive]]\nmodel = 'x'\nnode = 200\nsupply_v = 'a'\nbattery = 1\nrotor_locked = 2\n[drive.load]\ntorque_nm = 'b'\n\
                    inertia_kg_m2 = 'c'\nmass = 1\n[drive.load.gear]\nratio = 'd'\nbacklash_deg = 'e'\n[drive.load.stop]\nrange = 1\n\
                    damping_nm_s_rad = 3\n[drive.inputs]\nX0 = 1\nX1 = 2\n[drive.temperatures_c]\nmotor = 'hot'\ndriver = 'cold'\n";
        assert_eq!(lines_reported(said), [2, 3, 4, 5, 6, 8, 9, 10, 12, 13, 14, 15, 18, 19, 21, 22]);
        // In what the drives refuse, in both of two tables.
        let drive = |node| format!("[[drive]]\nmodel = 'zlac8030l'\nnode = {node}\nsupply_v = 300\nbattery = false\n");
        let refused = format!(
            "{}{}[drive.load]\ntorque_nm = 1e9\npulley = {{ mass_kg = 1e9, radius_m = 1 }}\n",
            drive(4),
            drive(5)
        );
        assert_eq!(lines_reported(&refused), [4, 5, 9, 10, 12, 13]);
    }

    #[test]
    fn what_only_a_machine_refuses_is_reported_at_its_place() {
        let bad = refusal(&format!("{DRIVE}battery = false"));
        assert!(
            bad.starts_with("line 4, column 11: '4 battery off' cannot be done: a zlac8030l has no battery"),
            "{bad}"
        );
        assert!(refusal(&format!("{DRIVE}supply_v = 300")).starts_with("line 4, column 12: supply of node 4"));
    }

    #[test]
    fn servers_and_the_counter_of_sync_are_for_a_master() {
        let machine = parsed(&format!("sync_counter = 240\n{DRIVE}sdo_server = 2"));
        assert!(machine.sdo_servers().eq([(NodeId::new(4).unwrap(), 0x1201)]));
        assert_eq!((machine.sync_counter, machine.unused_by_a_master()), (Some(240), None));
        assert!([0, 129, -1].iter().all(|n| refusal(&format!("{DRIVE}sdo_server = {n}")).contains("number of an SDO")));
        assert!(refusal(&format!("sync_counter = 241\n{DRIVE}")).contains("2 to 240"));
    }

    #[test]
    fn what_a_master_does_not_use_is_reported() {
        let text = format!("seed = 3\n{DRIVE}load = {{ torque_nm = 0.5 }}\nfaults = []");
        assert_eq!(parsed(&text).unused_by_a_master().as_deref(), Some("seed; load, faults of node 4"));
        assert_eq!(parsed(DRIVE).unused_by_a_master(), None);
    }

    #[test]
    fn only_a_file_of_sensible_size_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("machine.toml");
        std::fs::write(&path, format!("{DRIVE}# {}", " ".repeat(words::document::LARGEST as usize))).unwrap();
        let said = machine(path.to_str().unwrap()).err().unwrap_or_default();
        assert!(said.contains("limit of 1 MB"), "{said}");
        assert!(machine("/").is_err_and(|said| said.contains("not a regular file")));
        #[cfg(unix)]
        assert!(machine("/dev/zero").is_err_and(|said| said.contains("not a regular file")));
    }
}

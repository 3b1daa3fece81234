//! A drive of a machine file, and what is around it.

use std::collections::BTreeMap;
use std::path::Path;

use can::Instant;
use canopen::{Mux, NodeId};
use master::Gear;
use sim::{LoadPart, Place, Source, Stimulus, VirtualDrive, World};
use words::document::reader::Table;
use words::document::{BadFile, Located, Problem};
use words::drive::DriveSpec;
use words::models::{Description, resolve_in};
use words::node::node;

use super::fields::noted;
use super::mounted::MountedOn;
use super::{configuration, loops, surroundings, units};

/// What a machine file may say of a drive.
pub const DRIVE_KEYS: &[&str] = &[
    "model",
    "node",
    "supply_v",
    "supply",
    "options",
    "load",
    "inputs",
    "switches",
    "rotor_locked",
    "shaft",
    "temperatures_c",
    "faults",
    "battery",
    "units",
    "loops",
    "pdos",
    "limits",
    "heartbeat",
    "guarding",
    "start_up",
    "sdo_server",
];

/// One drive of a machine and what is around it.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Which drive, and where.
    pub spec: DriveSpec,
    pub(super) source: Source,
    /// Where the supply is described.
    pub(super) source_at: Option<Located>,
    /// The shaft of another node that it sits on, with its place in the file.
    pub(super) shaft: Option<MountedOn>,
    /// What is around it, with the places in the file.
    pub(super) around: Vec<(Stimulus, Located)>,
    /// The keys that the file has of it for a simulated machine.
    pub(super) keys: Vec<&'static str>,
    /// What a master writes to it at its start.
    pub(super) start_up: BTreeMap<Mux, Vec<u8>>,
    /// What stands behind its shaft.
    pub(super) gear: Gear,
    /// The record of the SDO server by which a master asks it, where the file says one.
    pub(super) sdo_server: Option<u16>,
}

/// A drive with nothing around it.
impl From<DriveSpec> for Placed {
    fn from(spec: DriveSpec) -> Self {
        Self {
            spec,
            source: Source::default(),
            source_at: None,
            shaft: None,
            around: Vec::new(),
            keys: Vec::new(),
            start_up: BTreeMap::new(),
            gear: Gear::DIRECT,
            sdo_server: None,
        }
    }
}

impl Placed {
    /// Turns of its shaft for one turn of its simulated load; 1 without a gear there.
    pub(super) fn load_gear(&self) -> f64 {
        let ratio = |(stimulus, _): &(Stimulus, Located)| match stimulus {
            Stimulus::Load(LoadPart::Gear { ratio, .. }) => Some(*ratio),
            _ => None,
        };
        self.around.iter().find_map(ratio).unwrap_or(1.0)
    }

    /// Sets the supply of the drive, before the power comes on: capacitors once charged would hold another voltage for a
    /// while.
    ///
    /// # Errors
    /// That the drive does not take it.
    pub fn supply(&self, drive: &mut dyn VirtualDrive) -> Result<(), BadFile> {
        let set = drive.set_source(self.source, Instant::ZERO);
        let node = self.spec.node;
        set.map_err(|refused| self.refused(self.source_at.as_ref(), &format!("supply of node {node}: {refused}")))
    }

    /// Puts into the world what is around the drive, which is there already.
    ///
    /// # Errors
    /// All that the drive does not take.
    pub fn furnish(&self, world: &mut World) -> Result<(), BadFile> {
        let place = Place::node(self.spec.node.raw());
        let refused = self.around.iter().filter_map(|(stimulus, at)| {
            let applied = world.apply(place, stimulus).map_err(|error| error.to_string());
            let reason = applied.and_then(|applied| applied.map_err(|refused| refused.to_string())).err()?;
            Some(at.saying(format!("'{place} {stimulus}' cannot be done: {reason}")))
        });
        BadFile::none_or(refused.collect())
    }

    /// A refusal, at a place of the file if it has one.
    pub(super) fn refused(&self, at: Option<&Located>, what: &str) -> BadFile {
        let nowhere = Located { line: 1, column: 1, width: 1, shown: String::new(), what: String::new() };
        BadFile::one(at.unwrap_or(&nowhere).saying(what))
    }

    pub(super) fn parse(table: &Table<'_>, folder: &Path) -> Result<Self, Vec<Problem>> {
        let mut problems = table.strangers(DRIVE_KEYS);
        let source = surroundings::source(table, &mut problems);
        let source_at = ["supply", "supply_v"].into_iter().find_map(|name| table.get(name));
        let source_at = source_at.map(|field| field.problem("").locate(table.text()));
        let around = surroundings::around(table, &mut problems);
        let shaft = noted(MountedOn::parse(table), &mut problems);
        let described = model(table, folder).and_then(|model| loops::named(table, model));
        let (described, id) = match (described, node_id(table)) {
            (Ok(described), Ok(id)) => (described, id),
            (described, id) => {
                problems.extend(described.err().into_iter().chain(id.err()));
                return Err(problems);
            }
        };
        let mut spec = DriveSpec::new(described, id);
        for option in
            noted(surroundings::fields(table, "options", "a table of options, e.g. { 6060 = 3 }"), &mut problems)
        {
            let set = option.word("a whole number or a text").and_then(|value| {
                spec.set(option.name(), &value)
                    .map_err(|reason| option.problem(format!("options of node {id}: {reason}")))
            });
            noted(set, &mut problems);
        }
        let start_up = configuration::values(table, spec.description(), id, &mut problems);
        let gear = noted(units::gear(table), &mut problems);
        let sdo_server = noted(configuration::sdo_server(table), &mut problems);
        let of_master = |key: &str| [units::KEY, loops::KEY].contains(&key) || configuration::KEYS.contains(&key);
        let of_simulator = |key: &&str| !matches!(*key, "model" | "node") && !of_master(key);
        let keys = DRIVE_KEYS.iter().copied().filter(|key| of_simulator(key) && table.get(key).is_some());
        if problems.is_empty() {
            Ok(Self { spec, source, source_at, shaft, around, keys: keys.collect(), start_up, gear, sdo_server })
        } else {
            Err(problems)
        }
    }
}

const NODE: &str = "a node-ID from 1 to 127, e.g. 4";

fn node_id(table: &Table<'_>) -> Result<NodeId, Problem> {
    let number = table.need("node", NODE)?;
    let id = number.whole::<u8>(NODE)?;
    node(&id.to_string()).map_err(|reason| number.problem(reason))
}

fn model(table: &Table<'_>, folder: &Path) -> Result<&'static Description, Problem> {
    let expected = "the drive's model as text, e.g. \"zlac8030l\", or a data sheet, \"FILE.eds\"";
    let model = table.need("model", expected)?;
    resolve_in(&model.words(expected)?, folder).map_err(|reason| model.problem(reason))
}

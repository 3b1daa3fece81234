//! What a master does with the machine of a file: its drives behind their gears, and cycle by cycle each of its groups and its base,
//! as a bus carries them.

use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use cia402::ModeOfOperation;
use devices::AxisDescription;
use master::group::{AxisSetup, GroupError};
use master::plan::{NodeTraffic, Plan, Settings, plan, shortest_cycle};
use master::units::Shown;
use master::{Drive, Gear, Node};

use super::{BasePlan, GroupPlan, Machine, Placed};
use words::failure::Failure;

/// From one SYNC of a group to the next where nothing says it.
pub const GROUP_PERIOD: Duration = Duration::from_millis(5);

/// The same of a base.
pub const BASE_PERIOD: Duration = Duration::from_millis(10);

/// Cycles in a row without a PDO that a group and a base tolerate where nothing says it.
pub const TOLERANCE: u32 = 2;

/// The most that SYNC, and a set-point of 8 bytes and its answer for each drive, take on the wire, in bits.
const SYNC_BITS: u64 = 55;
const DRIVE_BITS: u64 = 2 * 135;

/// What is moved in one cycle of SYNC.
#[derive(Clone, Debug, PartialEq)]
pub struct CyclePlan {
    /// What it is, for people: `group 'arm'`, `the base`.
    pub what: String,
    /// From one SYNC to the next.
    pub period: Duration,
    /// Its drives, and how each is moved where the file says it.
    pub nodes: Vec<(NodeId, Option<ModeOfOperation>)>,
    /// It is driven at speeds.
    pub is_base: bool,
}

impl From<&GroupPlan> for CyclePlan {
    fn from(group: &GroupPlan) -> Self {
        Self {
            what: format!("group '{}'", group.name),
            period: group.period.unwrap_or(GROUP_PERIOD),
            nodes: group.axes.iter().map(|axis| (axis.node, axis.mode)).collect(),
            is_base: false,
        }
    }
}

impl From<&BasePlan> for CyclePlan {
    fn from(base: &BasePlan) -> Self {
        Self {
            what: "the base".to_owned(),
            period: base.period.unwrap_or(BASE_PERIOD),
            nodes: base.wheels.iter().map(|(node, _)| (*node, base.mode)).collect(),
            is_base: true,
        }
    }
}

impl CyclePlan {
    /// Why one of its drives does not move evenly, and in which period it would. A drive whose interpolation takes a time of its own
    /// stands between two points of a longer cycle, and is cut short by a shorter one.
    pub fn uneven(&self, axis: &AxisDescription, said: Option<ModeOfOperation>) -> Option<(String, Duration)> {
        const CSP: ModeOfOperation = ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION;
        let (own, period) = (axis.interpolation?, self.period);
        // As a group chooses where nothing is said: positions for each cycle before interpolated ones.
        let is_ip = said.map_or(!axis.modes.contains(&CSP), |mode| mode == ModeOfOperation::INTERPOLATED_POSITION);
        let what = format!(
            "it takes {own:?} from one point to the next whatever the cycle is: in a cycle of {period:?} it does not move evenly"
        );
        (is_ip && !self.is_base && period != own).then_some((what, own))
    }

    /// The mode in which one of its drives is moved: as the file says, else the best that it has.
    ///
    /// # Errors
    /// [`GroupError::NoMode`].
    pub fn mode(&self, drive: &Drive, said: Option<ModeOfOperation>) -> Result<ModeOfOperation, GroupError> {
        match said {
            Some(mode) => Ok(mode),
            None if self.is_base => Ok(speed_mode(drive)),
            None => AxisSetup::best_mode(drive),
        }
    }

    /// What one of its drives sends while it is moved so, out of what it sends on its own; of another drive that is
    /// all.
    ///
    /// # Errors
    /// It cannot be moved so.
    pub fn traffic(&self, drive: &Drive, read: NodeTraffic) -> Result<NodeTraffic, GroupError> {
        let Some((_, said)) = self.nodes.iter().find(|(node, _)| *node == drive.node().id()) else { return Ok(read) };
        let mode = self.mode(drive, *said)?;
        Ok(read.in_cycles(drive, mode, true)?)
    }

    /// Whether a bus carries it, by what its drives say of their PDOs; `set_up` is what becomes of that before it is moved. They are
    /// asked only where it may not fit.
    ///
    /// # Errors
    /// A drive cannot be asked, or not be moved so.
    pub async fn too_full(
        &self,
        drives: &[&Drive],
        bitrate: Bitrate,
        set_up: impl Fn(NodeTraffic) -> NodeTraffic,
    ) -> Result<Option<TooFull>, Failure> {
        let most_ns = (SYNC_BITS + DRIVE_BITS * drives.len() as u64) * bitrate.bit_nanos();
        if Duration::from_nanos(most_ns) <= self.period {
            return Ok(None);
        }
        let mut nodes = Vec::new();
        for drive in drives {
            let read = set_up(NodeTraffic::of(drive).await?);
            nodes.push(self.traffic(drive, read).map_err(|error| {
                let advice = "take a mode for speed, torque or positions that the model has, e.g. pv";
                Failure::new(error.to_string()).of_kind("group").at_node(drive.node().id()).next(advice)
            })?);
        }
        Ok(too_full_at(&nodes, self.period, bitrate))
    }
}

/// The mode of a wheel where nothing says it: cyclic synchronous velocity where the model has it.
pub fn speed_mode(drive: &Drive) -> ModeOfOperation {
    let csv = ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY;
    let has = drive.axis_description().is_some_and(|axis| axis.modes.contains(&csv));
    if has { csv } else { ModeOfOperation::PROFILE_VELOCITY }
}

/// A cycle that does not fit its bus.
#[derive(Clone, Debug, PartialEq)]
pub struct TooFull {
    /// What does not go, and how full the bus would be.
    pub what: String,
    /// What to do.
    pub next: String,
}

/// Whether a bus can carry a cycle at all: what it needs without SDO and EMCY fits. What `check`, `plan` and
/// those who move say of it is this.
pub fn too_full(nodes: &[NodeTraffic], settings: &Settings, bitrate: Bitrate, alone: &Plan) -> Option<TooFull> {
    if alone.load <= 1.0 {
        return None;
    }
    let ms = |time: Duration| Shown(time.as_secs_f64() * 1e3);
    let rate = bitrate.bits_per_second() / 1000;
    let shortest = match shortest_cycle(nodes, &settings.cycle_alone(), bitrate) {
        Some(period) => format!("take a period of {} ms, the shortest that fits at {rate} kbit/s", ms(period)),
        None => "no period up to 100 ms fits".to_owned(),
    };
    Some(TooFull {
        what: format!(
            "a cycle of {} ms does not fit the bus: its frames take up to {:.0} % of {rate} kbit/s",
            ms(settings.cycle),
            alone.load * 100.0
        ),
        next: format!("{shortest}; or a higher bit rate, or fewer drives"),
    })
}

/// The same of what was read of some nodes, with what a master does otherwise left out.
pub fn too_full_at(nodes: &[NodeTraffic], cycle: Duration, bitrate: Bitrate) -> Option<TooFull> {
    let settings = Settings::new(cycle).cycle_alone();
    too_full(nodes, &settings, bitrate, &plan(nodes, &settings, bitrate))
}

impl Machine {
    /// What stands behind the shaft of a drive: `units`. [`Gear::DIRECT`] for a node that is not in the file.
    pub fn gear(&self, node: NodeId) -> Gear {
        self.drives.iter().find(|drive| drive.spec.node == node).map_or(Gear::DIRECT, |drive| drive.gear)
    }

    /// Turns of a drive's shaft for one turn of its simulated load; 1 without a gear there.
    pub(crate) fn load_gear(&self, node: NodeId) -> f64 {
        self.drives.iter().find(|drive| drive.spec.node == node).map_or(1.0, Placed::load_gear)
    }

    /// The drive at a node as the file has it: its model, and the gear behind its shaft. A program that moves a drive
    /// of a machine file by its model takes it from here, so that the same intent is the same counts.
    pub fn drive(&self, node: Node) -> Drive {
        let gear = self.gear(node.id());
        let drive = match self.models().find(|(id, _)| *id == node.id()) {
            Some((_, model)) => Drive::new(node, model),
            None => Drive::of_unknown_model(node),
        };
        drive.behind(gear)
    }

    /// What is moved in cycles: each group, then the base.
    pub fn cycles(&self) -> impl Iterator<Item = CyclePlan> + '_ {
        self.groups.iter().map(CyclePlan::from).chain(self.base.iter().map(CyclePlan::from))
    }

    /// The one of them that fills its bus most: the most drives in the shortest time.
    pub fn fullest_cycle(&self) -> Option<CyclePlan> {
        let fullness = |cycle: &CyclePlan| cycle.nodes.len() as f64 / cycle.period.as_secs_f64();
        self.cycles().reduce(|most, other| if fullness(&other) > fullness(&most) { other } else { most })
    }

    /// What a node sends once it has been set up as the file says: its heartbeat, its PDOs.
    #[must_use]
    pub fn set_up(&self, read: NodeTraffic) -> NodeTraffic {
        let Some(placed) = self.drives.iter().find(|drive| drive.spec.node == read.node) else { return read };
        let model = placed.spec.description();
        let pdos = read.pdos.iter().map(|(config, id)| config.with_values(*id, &placed.start_up, model)).collect();
        let ms = placed
            .start_up
            .get(&PRODUCER_HEARTBEAT_TIME)
            .map(|bytes| bytes.iter().rev().fold(0, |ms, byte| ms << 8 | u64::from(*byte)));
        let heartbeat = match ms {
            Some(ms) => Some(Duration::from_millis(ms)).filter(|time| !time.is_zero()),
            None => read.heartbeat,
        };
        NodeTraffic { pdos, heartbeat, ..read }
    }
}

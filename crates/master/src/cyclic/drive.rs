use can::Instant;
use canopen::{Mux, NodeId};
use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};
use devices::PowerStyle;

use super::demand::{CyclicState, Demand, Refusal};
use super::sequence::controlword;
use super::target::{Kind, Target};
use crate::core::{SetPoint, Signal, WatchId};
use crate::drive::STOP;
use crate::network::Exchange;
use crate::units::{Amperes, Rpm, Turns};

/// How often a controlword that goes by SDO is sent again while the drive does not show what it asks for.
const REPEAT_AFTER: core::time::Duration = core::time::Duration::from_millis(100);

/// A drive that is moved cycle by cycle, as a plain value: [`step`](Self::step) it once in each cycle of SYNC. From
/// [`crate::Drive::cyclic`].
///
/// From the first step that wants motion on, the master stops the drive when no step comes for some cycles, when the drive's
/// TPDO does not come, or when SYNC stays away; the step after that says so. That the whole program dies is the drive's to
/// notice: [`crate::Drive::guard`].
#[derive(Clone, Debug)]
pub struct CyclicDrive {
    pub(super) node: NodeId,
    /// Where its controlword is: which axis of the node it is.
    pub(super) place: Mux,
    pub(super) mode: ModeOfOperation,
    pub(super) style: PowerStyle,
    pub(super) statusword: Signal<u16>,
    pub(super) controlword: ControlwordPath,
    pub(super) target: Target,
    pub(super) position: Option<Signal<Turns>>,
    pub(super) velocity: Option<Signal<Rpm>>,
    pub(super) current: Option<Signal<Amperes>>,
    /// Cycles in a row that may be missed.
    pub(super) tolerance: u32,
    pub(super) watch: WatchId,
    pub(super) progress: Progress,
}

/// How the controlword gets to the drive.
#[derive(Clone, Copy, Debug)]
pub(super) enum ControlwordPath {
    /// In an RPDO, each cycle.
    Pdo(SetPoint<u16>),
    /// By SDO where no RPDO carries it: when it changes, and again while it shows no effect.
    Sdo { object: Mux, sent: Option<(Controlword, Instant)> },
}

/// What one step leaves for the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    /// The drive followed set-points.
    followed: bool,
    /// What keeps the drive from its demand until it is switched off.
    latched: Option<Refusal>,
    odd_step: bool,
}

impl CyclicDrive {
    /// Its node.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The mode in which it is moved.
    pub const fn mode(&self) -> ModeOfOperation {
        self.mode
    }

    /// Looks at the drive and has it do what is wanted in this cycle. What cannot be done leaves the last set-point, and the
    /// state says why. Allocates nothing.
    pub fn step(&mut self, io: &mut Exchange<'_>, demand: Demand) -> CyclicState {
        self.progress.odd_step ^= true;
        let mut seen = self.look(io);
        if matches!(demand, Demand::Off | Demand::ResetFault) {
            self.progress.latched = None;
            self.progress.followed = false;
            io.note_off((self.node, self.place), self.watch);
        } else if let Some(loss) = io.cycle_loss(self.watch) {
            self.progress.latched = Some(Refusal::Stopped(loss));
        }
        if demand.wants_power() && self.progress.latched.is_none() {
            self.progress.latched = self.find_trouble(&seen);
        }
        let free = self.progress.latched.is_none();
        let follows = free && demand.wants_power() && seen.power == Some(PowerState::OperationEnabled);
        let word = if free {
            controlword(self.style, seen.power, demand, self.mode, self.progress.odd_step)
        } else if let Some(Refusal::Fault(_)) = self.progress.latched {
            Controlword(0)
        } else {
            STOP
        };
        let wish = if follows { self.follow(io, demand) } else { Ok(self.target.rest(self.actual(io))) };
        let refused = self.progress.latched.or(wish.err());
        let sent = self.send(io, wish.unwrap_or(self.target.held), word, &seen);
        self.progress.followed = follows;
        if follows {
            io.note_moving((self.node, self.place), self.watch);
        } else {
            io.note_resting(self.watch);
        }
        seen.follows = follows;
        let unheard = (demand.wants_power() && seen.statusword.is_none()).then_some(Refusal::NotHeard);
        seen.refused = refused.or((!sent).then_some(Refusal::Remapped)).or(unheard);
        seen
    }

    fn look(&self, io: &Exchange<'_>) -> CyclicState {
        // What came in the cycle before is what a cycle begins with.
        let cycles = u64::from(self.tolerance) + 1;
        let statusword = io.read_fresh(self.statusword, cycles).map(Statusword);
        CyclicState {
            statusword,
            power: statusword.and_then(|statusword| self.style.state(statusword)),
            follows: false,
            position: self.position.and_then(|signal| io.read_fresh(signal, cycles)),
            velocity: self.velocity.and_then(|signal| io.read_fresh(signal, cycles)),
            current: self.current.and_then(|signal| io.read_fresh(signal, cycles)),
            age: io.cycles_since(self.statusword),
            refused: None,
        }
    }

    /// What ends the motion until the drive is switched off or its fault reset.
    fn find_trouble(&self, seen: &CyclicState) -> Option<Refusal> {
        let statusword = seen.statusword?;
        match seen.power {
            Some(PowerState::Fault | PowerState::FaultReactionActive) => Some(Refusal::Fault(statusword)),
            Some(PowerState::OperationEnabled) => None,
            other if self.progress.followed => Some(Refusal::LostOperation(other)),
            _ => None,
        }
    }

    fn follow(&self, io: &Exchange<'_>, demand: Demand) -> Result<i64, Refusal> {
        let (Some(_), Some(period)) = (io.cycle(), io.sync_period()) else { return Err(Refusal::NoCycle) };
        self.target.follow(demand, period)
    }

    fn actual(&self, io: &Exchange<'_>) -> Option<i64> {
        match self.target.kind {
            Kind::Position { actual, .. } => io.read_fresh(actual, u64::from(self.tolerance) + 1),
            Kind::Velocity { .. } | Kind::Current { .. } => None,
        }
    }

    /// False if one of the PDOs got another mapping.
    fn send(&mut self, io: &mut Exchange<'_>, raw: i64, word: Controlword, seen: &CyclicState) -> bool {
        let taken = io.write(self.target.set_point, raw);
        if taken {
            self.target.held = raw;
        }
        match &mut self.controlword {
            ControlwordPath::Pdo(set_point) => taken & io.write(*set_point, word.0),
            ControlwordPath::Sdo { object, sent } => {
                let shown = shows(word, seen.power);
                let due =
                    |(before, at): (Controlword, Instant)| before != word || !shown && io.now() - at >= REPEAT_AFTER;
                if sent.is_none_or(due) {
                    io.command(self.node, *object, word.0);
                    *sent = Some((word, io.now()));
                }
                taken
            }
        }
    }
}

/// True if the drive is where the controlword leads.
fn shows(word: Controlword, power: Option<PowerState>) -> bool {
    let enabled = power == Some(PowerState::OperationEnabled);
    enabled == word.has(Controlword::ENABLE_OPERATION)
}

use core::time::Duration;

use can::Instant;
use canopen::pdo::PdoNumber;
use canopen::{Mux, NodeId};
use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};
use devices::PowerStyle;

use super::demand::{Bound, CyclicState, Demand, Refusal};
use super::sequence::controlword;
use super::standstill::Standstill;
use super::target::{Target, TargetKind};
use crate::core::{Cadence, SetPoint, Signal, WatchId};
use crate::drive::STOP;
use crate::host_loss::HostLoss;
use crate::network::{Exchange, MovedAxis};
use crate::units::{Amperes, Rpm, Turns};

/// How often a controlword that goes by SDO is sent again while the drive does not show what it asks for.
const REPEAT_AFTER: core::time::Duration = core::time::Duration::from_millis(100);

/// A drive that is moved cycle by cycle, as a plain value: [`step`](Self::step) it once in each cycle of SYNC. From
/// [`crate::Drive::cyclic`].
///
/// From the first step that wants motion on, the master stops the drive when no step comes for some cycles, when the drive's
/// TPDO does not come, or when SYNC stays away; the step after that reports it. That the whole program dies is the
/// drive's to notice: [`host_loss`](Self::host_loss) says whether it does.
#[derive(Clone, Debug)]
pub struct CyclicDrive {
    pub(super) node: NodeId,
    /// The RPDO with the set-point.
    pub(super) rpdo: PdoNumber,
    /// Which axis of the node it is.
    pub(super) axis: MovedAxis,
    pub(super) mode: ModeOfOperation,
    pub(super) style: PowerStyle,
    pub(super) statusword: Signal<u16>,
    pub(super) controlword: ControlwordPath,
    pub(super) target: Target,
    pub(super) position: Option<Signal<Turns>>,
    /// Its TPDO comes in the exchange of each cycle.
    pub(super) position_comes: bool,
    pub(super) velocity: Option<Signal<Rpm>>,
    pub(super) current: Option<Signal<Amperes>>,
    /// How often the TPDO with the statusword comes.
    pub(super) cadence: Cadence,
    /// That TPDO comes only as the answer to an RPDO.
    pub(super) answers: bool,
    /// Cycles in a row that may be missed.
    pub(super) tolerance: u32,
    pub(super) host_loss: HostLoss,
    pub(super) watch: WatchId,
    pub(super) progress: CyclicProgress,
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
#[derive(Clone, Copy, Debug)]
pub(super) struct CyclicProgress {
    /// The drive has been heard since it was opened, or was sent a demand that does not want power.
    spoken: bool,
    /// The drive followed set-points.
    followed: bool,
    /// What keeps the drive from its demand until it is switched off.
    latched: Option<Refusal>,
    odd_step: bool,
    /// Its power stage was on in the step before.
    had_power: bool,
    /// What was sent was not what holds it where it is.
    asked_to_turn: bool,
    /// Where it was noted that it is in motion.
    noted_at: usize,
    pub(super) standstill: Standstill,
}

impl CyclicProgress {
    /// Of a shaft that stands below this speed, in r/min of the output.
    pub(super) const fn new(standstill_rpm: f64) -> Self {
        let standstill = Standstill::new(standstill_rpm);
        Self {
            spoken: false,
            followed: false,
            latched: None,
            odd_step: false,
            had_power: true,
            asked_to_turn: false,
            noted_at: 0,
            standstill,
        }
    }
}

impl CyclicDrive {
    /// Node-ID of the drive.
    pub const fn node(&self) -> NodeId {
        self.node
    }

    /// The RPDO that carries its set-point: what is sent to it in each cycle.
    pub const fn rpdo(&self) -> PdoNumber {
        self.rpdo
    }

    /// The mode in which it is moved.
    pub const fn mode(&self) -> ModeOfOperation {
        self.mode
    }

    /// The highest speed that set-points may ask for, by the drive's own objects; `None` in a mode for torque.
    pub fn highest_speed(&self) -> Option<(Rpm, Bound)> {
        match self.target.kind {
            TargetKind::Position { counts_per_turn, counts_per_s, speed, .. } => {
                Some((Rpm(counts_per_s / counts_per_turn * 60.0), speed))
            }
            TargetKind::Velocity { per_count } => {
                let bound = Bound::from(self.target.limits);
                Some((Rpm(bound.high as f64 * per_count), bound))
            }
            TargetKind::Current { .. } => None,
        }
    }

    /// The position that was sent last, in a mode that takes positions.
    pub fn set_point(&self) -> Option<Turns> {
        match self.target.kind {
            TargetKind::Position { counts_per_turn, .. } => Some(Turns(self.target.last_sent as f64 / counts_per_turn)),
            TargetKind::Velocity { .. } | TargetKind::Current { .. } => None,
        }
    }

    /// True if the drive's position comes by TPDO.
    pub const fn shows_position(&self) -> bool {
        self.position.is_some()
    }

    /// True if it comes in the exchange of each cycle too: TPDOs that are answers come for the RPDO that is sent alone.
    pub(crate) const fn shows_position_in_cycles(&self) -> bool {
        self.position.is_some() && self.position_comes
    }

    /// What the drive does when this program dies in the middle of a motion.
    pub const fn host_loss(&self) -> HostLoss {
        self.host_loss
    }

    /// How long its shaft has to stand until it is taken to.
    pub(crate) const fn stands_after(&mut self, time: Duration) {
        self.progress.standstill.set_time(time);
    }

    /// Whether its shaft stands is to be seen from here on. See [`at_rest`](super::at_rest).
    pub(crate) const fn begin_rest(&mut self) {
        self.progress.standstill.begin();
    }

    fn look_for_rest(&mut self, io: &mut Exchange<'_>, seen: &CyclicState) {
        if self.progress.asked_to_turn && seen.power == Some(PowerState::OperationEnabled) {
            // Whether it stands is not asked until it is to hold.
            return self.begin_rest();
        }
        let is_without_power = seen.is_without_power();
        let had_power = core::mem::replace(&mut self.progress.had_power, !is_without_power);
        if had_power && is_without_power {
            // What its motor has held stands until then: the load may turn it from here on.
            self.begin_rest();
        }
        let faulted = matches!(seen.power, Some(PowerState::Fault | PowerState::FaultReactionActive));
        if faulted && io.is_blind(&self.axis) {
            // What it shows is not its shaft's.
            self.begin_rest();
        } else {
            self.progress.standstill.look(seen, io.now());
        }
        if is_without_power && self.progress.standstill.stands() {
            io.note_stands(&self.axis);
        }
    }

    /// Looks at the drive and has it do what is wanted in this cycle. A demand that is refused stops the drive as
    /// [`Demand::Hold`] does, for as long as it is refused, and the state says why. Allocates nothing.
    ///
    /// A demand for power is not sent to a drive that has not been heard yet: one that another master has enabled keeps
    /// its power and is taken over where it stands, and none gets power before its state is known.
    pub fn step(&mut self, io: &mut Exchange<'_>, demand: Demand) -> CyclicState {
        self.progress.odd_step ^= true;
        let mut seen = self.look(io);
        self.look_for_rest(io, &seen);
        if demand.wants_power() && seen.statusword.is_none() && !self.progress.spoken {
            return self.await_drive(io, seen);
        }
        self.progress.spoken = true;
        if matches!(demand, Demand::Off | Demand::ResetFault) {
            self.progress.latched = None;
            self.progress.followed = false;
            io.forget_loss(self.watch);
        } else if let Some(loss) = io.cycle_loss(self.watch) {
            self.progress.latched = Some(Refusal::Stopped(loss));
        }
        if demand.wants_power() && self.progress.latched.is_none() {
            self.progress.latched = self.find_trouble(&seen);
        }
        let enabled = demand.wants_power() && seen.power == Some(PowerState::OperationEnabled);
        if enabled
            && !self.progress.followed
            && let Some(actual) = self.actual(io)
        {
            // It may have been moved since its position was read: what it is given first is where it stands.
            self.target.last_sent = actual;
        }
        let wish = if enabled && self.progress.latched.is_none() {
            self.follow(io, demand)
        } else {
            Ok(self.target.rest(self.actual(io)))
        };
        // The last speed or current, sent again, would be followed without end.
        let held = self.target.hold();
        let raw = wish.unwrap_or(held);
        if io.write(self.target.set_point, raw) {
            self.target.last_sent = raw;
        } else if demand.wants_power() {
            self.progress.latched.get_or_insert(Refusal::Remapped);
        }
        let word = match self.progress.latched {
            None => controlword(self.style, seen.power, demand, self.mode, self.progress.odd_step),
            Some(Refusal::Fault(_)) => Controlword(0),
            Some(_) => STOP,
        };
        self.send_controlword(io, word, seen.power);
        let follows = enabled && self.progress.latched.is_none();
        self.progress.followed = follows;
        self.progress.asked_to_turn = follows && raw != held;
        if follows {
            self.progress.noted_at = io.note_moving(&self.axis, self.watch, self.progress.noted_at);
        } else {
            io.note_resting(self.watch);
        }
        seen.follows = follows;
        let unheard = (demand.wants_power() && seen.statusword.is_none()).then_some(Refusal::NotHeard);
        seen.refused = self.progress.latched.or(wish.err()).or(unheard);
        seen
    }

    /// One cycle of a drive that has not been heard since it was opened.
    fn await_drive(&mut self, io: &mut Exchange<'_>, seen: CyclicState) -> CyclicState {
        // Where only an RPDO brings a TPDO, this is one: with the controlword that the device had when it was opened.
        if self.answers {
            io.write(self.target.set_point, self.target.hold());
        }
        io.note_resting(self.watch);
        CyclicState { refused: Some(Refusal::NotHeard), ..seen }
    }

    /// For how many cycles a value counts as the drive's present one.
    fn patience(&self, io: &Exchange<'_>) -> u64 {
        // What came in the cycle before is what a cycle begins with.
        u64::from(self.tolerance) + self.cadence.cycles(io.sync_period())
    }

    fn look(&self, io: &Exchange<'_>) -> CyclicState {
        let cycles = self.patience(io);
        let newest = io.read_aged(&self.statusword);
        let statusword = newest.filter(|(_, age)| *age <= cycles).map(|(raw, _)| Statusword(raw));
        CyclicState {
            statusword,
            power: statusword.and_then(|statusword| self.style.state(statusword)),
            is_live: statusword.is_some_and(|statusword| self.style.is_live(statusword)),
            follows: false,
            position: self.position.and_then(|signal| io.read_fresh(signal, cycles)),
            velocity: self.velocity.and_then(|signal| io.read_fresh(signal, cycles)),
            current: self.current.and_then(|signal| io.read_fresh(signal, cycles)),
            age: newest.map(|(_, age)| age),
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
            TargetKind::Position { actual, .. } => io.read_fresh(actual, self.patience(io)),
            TargetKind::Velocity { .. } | TargetKind::Current { .. } => None,
        }
    }

    fn send_controlword(&mut self, io: &mut Exchange<'_>, word: Controlword, power: Option<PowerState>) {
        if let ControlwordPath::Pdo(set_point) = self.controlword {
            if io.write(set_point, word.0) {
                return;
            }
            // The RPDO got another mapping. The drive has to be stopped nevertheless.
            self.controlword = ControlwordPath::Sdo { object: self.axis.controlword, sent: None };
        }
        if let ControlwordPath::Sdo { object, sent } = &mut self.controlword {
            let shown = shows(word, power);
            let due = |(before, at): (Controlword, Instant)| before != word || !shown && io.now() - at >= REPEAT_AFTER;
            if sent.is_none_or(due) {
                io.command(self.node, *object, word.0);
                *sent = Some((word, io.now()));
            }
        }
    }
}

/// True if the drive is where the controlword leads.
fn shows(word: Controlword, power: Option<PowerState>) -> bool {
    let enabled = power == Some(PowerState::OperationEnabled);
    enabled == word.has(Controlword::ENABLE_OPERATION)
}

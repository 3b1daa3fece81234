//! A group as its program holds it: intents, and the cycle that carries them out.

use core::fmt;
use core::time::Duration;

use can::Instant;

use super::error::GroupError;
use super::limits::{AxisLimits, PathPoint};
use super::runner::{Activity, GroupRunner, POWER_LIMIT};
use super::state::{GroupState, Phase, StopCause};
use super::stream::{Stream, StreamOptions};
use super::trajectory::Trajectory;
use crate::core::NodeSet;
use crate::cyclic::{CyclicState, NotAtRest, at_rest, seen_to_stand};
use crate::drive::{Drive, REACHED_TURNS};
use crate::error::Error;
use crate::network::{Exchange, Network};
use crate::units::Turns;

/// Cycles after which a drive that is not heard is not waited for.
const UNHEARD: u64 = 10;

/// How long the shafts may take to come to their last set-points before it is looked where they are.
const SETTLING: Duration = Duration::from_millis(500);
/// How long one is waited for that is not there then.
const LONGEST_SETTLING: Duration = Duration::from_secs(3);

/// Several axes that move as one. See the [module](super).
pub struct Group {
    pub(super) network: Network,
    pub(super) drives: Vec<Drive>,
    pub(super) runner: GroupRunner,
}

impl Group {
    /// One cycle: looks at all drives and gives each its next set-point. To be called once after each SYNC, in
    /// [`Network::exchange`]; [`cycle`](Self::cycle) waits and does both.
    pub fn step(&mut self, io: &mut Exchange<'_>) -> GroupState {
        self.runner.step(io)
    }

    /// Waits for the next SYNC and does one cycle.
    ///
    /// # Errors
    /// [`GroupError::NoCycle`]: the master has stopped the drives.
    pub async fn cycle(&mut self) -> Result<GroupState, GroupError> {
        self.network.next_sync().await?;
        let runner = &mut self.runner;
        Ok(self.network.exchange(|io| runner.step(io)))
    }

    /// The network that its drives are on.
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// The drives of its axes, in their order.
    pub fn drives(&self) -> &[Drive] {
        &self.drives
    }

    /// What its axes may do, in their order.
    pub fn limits(&self) -> &[AxisLimits] {
        &self.runner.limits
    }

    /// The length of its cycle.
    pub fn period(&self) -> Duration {
        Duration::from_secs_f64(self.runner.period_s)
    }

    /// What the group is doing.
    pub const fn state(&self) -> GroupState {
        self.runner.state()
    }

    /// What each drive showed in the last cycle, in the order of the group.
    pub fn axes(&self) -> &[CyclicState] {
        &self.runner.states
    }

    /// Where each axis is on its path: its newest set-points.
    pub fn points(&self) -> &[PathPoint] {
        &self.runner.points
    }

    /// How far each shaft was from its set-point in the last cycle, in turns; `None` where its position did not come.
    pub fn following_errors(&self) -> impl Iterator<Item = Option<f64>> {
        self.runner.axes.iter().map(|axis| axis.error_turns)
    }

    /// When the last move gave its first set-points: all of them in one exchange, for one SYNC.
    pub const fn began(&self) -> Option<Instant> {
        self.runner.began
    }

    /// Has all drives enabled from the next cycle on.
    pub fn start_enabling(&mut self) {
        if matches!(self.runner.activity, Activity::Off) {
            self.runner.cause = None;
            self.runner.activity = Activity::Enabling;
        }
    }

    /// Enables all drives and holds them.
    ///
    /// # Errors
    /// [`GroupError::Stopped`] when a drive is at fault, [`GroupError::NotEnabled`] when one takes too long, those of
    /// [`cycle`](Self::cycle). The drives are then without power.
    pub async fn enable(&mut self) -> Result<(), GroupError> {
        if !matches!(self.runner.activity, Activity::Off) {
            return self.check_going();
        }
        // What an earlier stop has left behind ends without power, and all axes get theirs together.
        self.switch_off().await?;
        self.start_enabling();
        for _ in 0..self.cycles(POWER_LIMIT) {
            match self.cycle().await? {
                GroupState { cause: Some(cause), .. } => return Err(GroupError::Stopped(cause)),
                GroupState { phase: Phase::Holding, .. } => return Ok(()),
                _ => {}
            }
        }
        let late = self.runner.states.iter().position(|state| !state.follows).unwrap_or(0);
        let (node, shows) = (self.runner.axes[late].drive.node(), self.runner.states[late].to_string());
        self.runner.activity = Activity::Off;
        self.cycle().await?;
        Err(GroupError::NotEnabled { axis: late + 1, node, limit: POWER_LIMIT, shows })
    }

    /// Plans a move of all axes to these positions, at rest there, and begins it with the next cycle. All axes begin with one
    /// SYNC and end together; `within` gives the time, else it is the shortest within the limits. A group that is moving is
    /// led over smoothly.
    ///
    /// # Errors
    /// [`GroupError::Path`], [`GroupError::Stopped`], [`GroupError::Phase`]; then nothing changes.
    pub fn start_move(&mut self, to: &[Turns], within: Option<Duration>) -> Result<Duration, GroupError> {
        self.go_on()?;
        if !matches!(self.runner.activity, Activity::Holding | Activity::Moving { .. }) {
            return Err(self.not_now());
        }
        let to: Vec<_> = to.iter().map(|Turns(turns)| *turns).collect();
        let path = Trajectory::to_rest_at(&self.runner.points, &to, &self.runner.limits, within);
        let nodes = self.runner.axes.iter().map(|axis| axis.drive.node());
        let path = path.map_err(|error| GroupError::of_path(error, nodes))?;
        let time = Duration::from_secs_f64(path.duration_s());
        self.runner.activity = Activity::Moving { path, time_s: 0.0 };
        Ok(time)
    }

    /// [`start_move`](Self::start_move), until all axes have their last set-point.
    ///
    /// # Errors
    /// As [`start_move`](Self::start_move) and [`cycle`](Self::cycle); [`GroupError::Stopped`], once all axes rest.
    pub async fn move_to(&mut self, to: &[Turns], within: Option<Duration>) -> Result<(), GroupError> {
        self.start_move(to, within)?;
        self.rest().await
    }

    /// Cycles until the group rests.
    ///
    /// # Errors
    /// As [`cycle`](Self::cycle); [`GroupError::Stopped`], once all axes rest.
    pub async fn rest(&mut self) -> Result<(), GroupError> {
        while self.runner.is_under_way() {
            self.cycle().await?;
        }
        self.check_going()
    }

    /// Cycles at rest until the shafts are where they were led: 0.5 s at least, and 3 s at most where one is not there yet.
    ///
    /// # Errors
    /// As [`rest`](Self::rest); [`GroupError::NotReached`], or [`NotAtRest::NotSeen`] of one whose position does not come: the group holds on.
    pub async fn settle(&mut self) -> Result<(), GroupError> {
        self.rest().await?;
        let began = self.network.now();
        loop {
            self.cycle().await?;
            self.rest().await?;
            let waited = self.network.now() - began;
            // One whose position did not come was not seen there.
            let mut errors = self.following_errors().enumerate();
            match errors.find(|(_, error)| error.is_none_or(|turns| turns > REACHED_TURNS)) {
                _ if waited < SETTLING => {}
                None => return Ok(()),
                Some((axis, error)) if waited >= LONGEST_SETTLING => {
                    let node = self.runner.axes[axis].drive.node();
                    return Err(error.map_or_else(
                        || NotAtRest::NotSeen { node }.into(),
                        |error_turns| GroupError::NotReached { axis: axis + 1, node, error_turns, waited },
                    ));
                }
                Some(_) => {}
            }
        }
    }

    /// Whether the axes stand: `None` while they are on their way or it is not seen yet, `Ok` once all were seen to stand. What
    /// stopped them is in [`state`](Self::state).
    ///
    /// # Errors
    /// Of an axis that does not come to rest, or is not seen.
    pub fn stands(&self) -> Option<Result<(), NotAtRest>> {
        let runner = &self.runner;
        // What it has begun counts from its first cycle on.
        if runner.is_under_way() || runner.still_cycles == 0 {
            return None;
        }
        let waited = Duration::from_secs_f64(runner.still_cycles as f64 * runner.period_s);
        // One that is not heard where something has stopped the group is that, or is stopped by its own watch.
        let is_stopped = runner.cause.is_some_and(|cause| cause != StopCause::Asked);
        let axes = runner.axes.iter().zip(&runner.states);
        let axes = axes.filter(|(_, state)| !is_stopped || state.statusword.is_some()).map(|(axis, _)| &axis.drive);
        at_rest(axes, waited)
    }

    /// Begins to take points: one for each cycle.
    ///
    /// # Errors
    /// [`GroupError::Stopped`], [`GroupError::Phase`] for a group that does not hold, [`GroupError::StreamOption`].
    pub fn start_stream(&mut self, options: StreamOptions) -> Result<(), GroupError> {
        self.go_on()?;
        if !matches!(self.runner.activity, Activity::Holding) {
            return Err(self.not_now());
        }
        options.check(self.runner.period_s)?;
        self.runner.activity = Activity::Streaming(Stream::new(&self.runner.points, self.runner.period_s, options));
        Ok(())
    }

    /// Checks that a stream would take these points from where the group is: for a path that is known as a whole.
    ///
    /// # Errors
    /// As [`push`](Self::push), for the first point that is refused. Nothing changes.
    pub fn check_path<P: AsRef<[Turns]>>(&self, points: impl IntoIterator<Item = P>) -> Result<(), GroupError> {
        let runner = &self.runner;
        let mut stream = Stream::new(&runner.points, runner.period_s, StreamOptions::default());
        stream
            .check_all(points, &runner.limits)
            .map_err(|refused| GroupError::of_path(refused.error, runner.axes.iter().map(|axis| axis.drive.node())))
    }

    /// The stream, while there is one: how many points wait, for how many there is room.
    pub const fn stream(&self) -> Option<&Stream> {
        if let Activity::Streaming(stream) = &self.runner.activity { Some(stream) } else { None }
    }

    /// Gives a stream its next point.
    ///
    /// # Errors
    /// [`GroupError::Path`] for a point that breaks a limit, [`GroupError::StreamFull`]: then the stream stays as it was.
    /// [`GroupError::Stopped`], [`GroupError::Phase`].
    pub fn push(&mut self, point: &[Turns]) -> Result<(), GroupError> {
        self.check_going()?;
        let nodes = self.runner.axes.iter().map(|axis| axis.drive.node());
        let Activity::Streaming(stream) = &mut self.runner.activity else { return Err(self.not_now()) };
        let pushed = stream.push(point, &self.runner.limits).map_err(|error| GroupError::of_path(error, nodes))?;
        pushed.map_err(|_| GroupError::StreamFull)
    }

    /// Says that no further points come. The group comes to rest after the last one, within its limits.
    pub const fn end_stream(&mut self) {
        if let Activity::Streaming(stream) = &mut self.runner.activity {
            stream.end();
        }
    }

    /// Has all axes come to rest within their limits, from the next cycle on.
    pub fn start_stop(&mut self) {
        if matches!(self.runner.activity, Activity::Moving { .. } | Activity::Streaming(_)) {
            self.runner.stop(StopCause::Asked);
        }
        self.runner.still_cycles = 0;
    }

    /// Brings all axes to rest, until they were seen to stand, and leaves them powered. The group can be moved again.
    ///
    /// # Errors
    /// As [`cycle`](Self::cycle) and [`stands`](Self::stands); [`GroupError::Stopped`] by another cause.
    pub async fn stop(&mut self) -> Result<(), GroupError> {
        self.start_stop();
        let stands = loop {
            self.cycle().await?;
            if let Some(stands) = self.stands() {
                break stands;
            }
        };
        if self.runner.cause == Some(StopCause::Asked) {
            self.runner.cause = None;
        }
        stands?;
        self.check_going()
    }

    /// Brings all axes to rest and takes their power. The group can be enabled again.
    ///
    /// # Errors
    /// As [`cycle`](Self::cycle). [`GroupError::Stopped`] for what went wrong on the way to rest; the power is taken nevertheless.
    /// What had stopped the group before is not an error here.
    pub async fn disable(&mut self) -> Result<(), GroupError> {
        let known = self.runner.cause.is_some_and(|cause| cause != StopCause::Asked);
        self.start_stop();
        match self.rest().await {
            Ok(()) | Err(GroupError::Stopped(_)) => {}
            Err(error) => return Err(error),
        }
        self.switch_off().await?;
        match self.runner.cause.take() {
            Some(cause) if !known && cause != StopCause::Asked => Err(GroupError::Stopped(cause)),
            _ => Ok(()),
        }
    }

    /// Cycles until every drive shows that it has no power.
    async fn switch_off(&mut self) -> Result<(), GroupError> {
        self.runner.activity = Activity::Off;
        for cycle in 0..self.cycles(POWER_LIMIT) {
            self.cycle().await?;
            // One that is not heard is not waited for: nothing is known of it, and nothing it does can be seen.
            let settled =
                |state: &CyclicState| state.is_without_power() || cycle > UNHEARD && state.statusword.is_none();
            if self.runner.states.iter().all(settled) {
                break;
            }
        }
        let mut states = self.runner.axes.iter().zip(&self.runner.states);
        let powered = states.find(|(_, state)| state.is_live).map(|(axis, _)| axis.drive.node());
        powered.map_or(Ok(()), |node| Err(NotAtRest::StillPowered { node, limit: POWER_LIMIT }.into()))
    }

    /// [`disable`](Self::disable), and ends what the group began: SYNC, and the guards of the drives that were seen to stand
    /// without power. One that was not stays among [`Network::moved`] and is left to its own watch.
    ///
    /// # Errors
    /// As [`disable`](Self::disable), and those of the requests.
    pub async fn close(mut self) -> Result<(), GroupError> {
        let disabled = self.disable().await;
        self.network.sync(None);
        let nodes: NodeSet = self.drives.iter().map(|drive| drive.node().id()).collect();
        let unheard = self.runner.axes.iter().zip(&self.runner.states).filter(|(_, state)| state.statusword.is_none());
        let unheard: NodeSet = unheard.map(|(axis, _)| axis.drive.node()).collect();
        let heard = nodes.iter().filter(|node| !unheard.contains(*node)).collect();
        let mut stopped = self.network.stop_once(heard).await;
        // One that answers nothing is not asked again, which would take its time.
        let answering = self.network.answering(unheard).await;
        stopped.extend(self.network.stop_once(answering).await);
        let released = self.network.release_guards(nodes).await;
        disabled?;
        seen_to_stand::<GroupError>(stopped, unheard, answering)?;
        Ok(released?)
    }

    /// Asks the drive that stopped the group what is the matter with it: its fault with its text, or what it is missing. The
    /// cycles go on meanwhile. `None` where no drive was the cause, or it has nothing to say.
    pub async fn explain_stop(&mut self) -> Option<Error> {
        let question = self.explanation()?;
        self.beside(question).await
    }

    /// Awaits something else on the bus while the group goes on with its cycles: holding, or without power. Where no SYNC comes there are
    /// no cycles; the next [`cycle`](Self::cycle) is a [`GroupError::NoCycle`].
    pub async fn beside<T>(&mut self, what: impl Future<Output = T>) -> T {
        let runner = &mut self.runner;
        let step = |io: &mut Exchange<'_>| {
            runner.step(io);
        };
        self.network.ask_beside_cycles(what, step).await
    }

    /// The question of [`explain_stop`](Self::explain_stop) alone, for a group that is stepped elsewhere meanwhile.
    pub fn explanation(&self) -> Option<impl Future<Output = Option<Error>> + Send + use<>> {
        let (axis, refusal) = match self.runner.cause? {
            StopCause::Axis { axis, refusal, .. } => (axis, Some(refusal)),
            StopCause::FollowingError { axis, .. } => (axis, None),
            _ => return None,
        };
        let drive = self.drives.get(axis.checked_sub(1)?)?.clone();
        Some(drive.explain_stop(refusal))
    }

    /// A stop that was asked for does not outlast the next command.
    fn go_on(&mut self) -> Result<(), GroupError> {
        if self.runner.cause == Some(StopCause::Asked) && matches!(self.runner.activity, Activity::Holding) {
            self.runner.cause = None;
        }
        self.check_going()
    }

    fn check_going(&self) -> Result<(), GroupError> {
        self.runner.cause.map_or(Ok(()), |cause| Err(GroupError::Stopped(cause)))
    }

    fn not_now(&self) -> GroupError {
        let phase = self.state().phase;
        let remedy = match phase {
            Phase::Off => "enable it first",
            Phase::Holding => "begin a stream first",
            _ => "wait until it holds",
        };
        GroupError::Phase { phase, remedy }
    }

    fn cycles(&self, time: Duration) -> u64 {
        self.runner.cycles(time)
    }
}

impl fmt::Debug for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Group").field("state", &self.state()).field("drives", &self.drives).finish_non_exhaustive()
    }
}

//! A base as its program holds it: a twist in, wheels and a pose out, once in each cycle of SYNC.

use core::fmt;
use core::time::Duration;

use can::Instant;
use cia402::ModeOfOperation;
use cia402::object::CONTROLWORD;

use super::kinematics::{Geometry, Pose, Twist, Wheels};
use super::limits::{BaseError, BaseLimits};
use super::state::StopCause;
use crate::core::NodeSet;
use crate::cyclic::{CyclicDrive, CyclicOptions, CyclicState, Demand, NotAtRest, Refusal, at_rest, seen_to_stand};
use crate::drive::Drive;
use crate::error::Error;
use crate::network::{Claim, Exchange, Network};
use crate::units::{Rpm, Turns};

/// How long drives may take to be enabled, and to be without power again.
const POWER_LIMIT: Duration = Duration::from_secs(5);

/// How long both wheels are seen to stand before that is reported: no position loop holds them.
const REST_TIME: Duration = Duration::from_millis(200);

/// How long a wheel that is behind stays so, s: its speed is rounded to what its object counts, and that adds up.
const LAG_MEMORY_S: f64 = 5.0;

/// Cycles after which a drive that is not heard is not waited for.
const UNHEARD: u64 = 10;

/// One wheel, and how its motor sits.
#[derive(Clone, Debug)]
pub struct WheelSetup {
    /// The drive.
    pub drive: Drive,
    /// A mode for speed: profile velocity or cyclic synchronous velocity.
    pub mode: ModeOfOperation,
    /// Turns of the drive's output shaft for a turn of the wheel forward; negative for a motor that sits the other way round, as
    /// the right one of two hub motors does.
    pub turns: f64,
}

/// What a base shows after a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseState {
    /// Both wheels have power and follow.
    pub follows: bool,
    /// Why it is being stopped, or stands.
    pub cause: Option<StopCause>,
    /// The twist commanded to the wheels in this cycle, within the limits.
    pub commanded: Twist,
    /// Where it came to, by the positions of its wheels. `Pose::after` of every cycle.
    pub pose: Pose,
    /// Cycles in which a wheel's position did not come. What it went meanwhile is counted when it comes again.
    pub unseen_cycles: u64,
}

/// A base on two wheels. See the [module](super).
pub struct Base {
    network: Network,
    drives: [Drive; 2],
    wheels: [Wheel; 2],
    geometry: Geometry,
    limits: BaseLimits,
    period: Duration,
    power: Power,
    wanted: Twist,
    /// When the newest twist came; `None` before the first.
    wanted_at: Option<Instant>,
    /// Speeds commanded to the wheels, m/s over the ground.
    sent: Wheels,
    state: BaseState,
    now: Instant,
    /// It is to come to rest, and no twist came since.
    is_stopping: bool,
    /// Cycles for which the wheels have been commanded to no speed since then.
    still_cycles: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Off,
    /// Wanted; the wheels do not follow yet.
    Enabling,
    /// Both wheels have followed: whatever keeps one from it is trouble.
    On,
}

struct Wheel {
    drive: CyclicDrive,
    /// Turns of the drive's shaft for a turn of the wheel.
    turns: f64,
    /// Where the shaft was when the pose was counted last, in turns.
    counted_turns: Option<f64>,
    /// Lag behind the commanded way, m. A part is forgotten in each cycle: speeds are rounded.
    behind_m: f64,
    shows: Option<CyclicState>,
    _claim: Claim,
}

impl Base {
    /// Makes a base of a left and a right wheel and has this master produce SYNC with this period. Nothing moves.
    ///
    /// The wheels' ramps are made here, by `wheel_m_s2`: those of the drives (6083h, 6084h) are set to follow each cycle, so that a
    /// stop of their own by them is a hard one.
    ///
    /// # Errors
    /// [`BaseError`].
    pub async fn open(
        [left, right]: [&WheelSetup; 2],
        geometry: Geometry,
        limits: BaseLimits,
        period: Duration,
        options: CyclicOptions,
    ) -> Result<Self, BaseError> {
        geometry.check()?;
        limits.check()?;
        let network = left.drive.node().network().clone();
        if !network.is_same_as(right.drive.node().network()) {
            return Err(BaseError::OtherNetwork);
        }
        // Both, before either drive is written to.
        let (left_claim, right_claim) = (left.claim()?, right.claim()?);
        let opened = async {
            Ok::<_, BaseError>([
                left.open(&geometry, &limits, period, options, left_claim).await?,
                right.open(&geometry, &limits, period, options, right_claim).await?,
            ])
        };
        let wheels = match opened.await {
            Ok(wheels) => wheels,
            Err(error) => {
                // No base is left that would do it at its end. The first error is the one to report.
                let _ =
                    network.put_back([left, right].map(|wheel| wheel.drive.node().id()).into_iter().collect()).await;
                return Err(error);
            }
        };
        network.sync(Some(period));
        Ok(Self {
            now: network.now(),
            network,
            drives: [left.drive.clone(), right.drive.clone()],
            wheels,
            geometry,
            limits,
            period,
            power: Power::Off,
            is_stopping: false,
            still_cycles: 0,
            wanted: Twist::default(),
            wanted_at: None,
            sent: Wheels::default(),
            state: BaseState {
                follows: false,
                cause: None,
                commanded: Twist::default(),
                pose: Pose::default(),
                unseen_cycles: 0,
            },
        })
    }

    /// What the base is to do from the next cycle on, until another twist comes or the watchdog's time has passed. One beyond the
    /// limits is followed as fast as they allow, on its circle ([`Geometry::saturate`]).
    ///
    /// # Errors
    /// [`BaseError::BadTwist`], and [`BaseError::Stopped`] by a wheel; the last twist counts on then.
    pub fn command(&mut self, twist: Twist) -> Result<(), BaseError> {
        let Twist { linear_m_s, angular_rad_s } = twist;
        if !linear_m_s.is_finite() || !angular_rad_s.is_finite() {
            return Err(BaseError::BadTwist { linear_m_s, angular_rad_s });
        }
        match self.state.cause {
            Some(cause) if cause.wheel().is_some() => return Err(BaseError::Stopped(cause)),
            _ => self.state.cause = None,
        }
        self.is_stopping = false;
        self.wanted = self.geometry.saturate(twist, &self.limits);
        self.wanted_at = Some(self.network.now());
        Ok(())
    }

    /// One cycle: reads both wheels, counts the pose on, and gives both their speeds. To be called once after each SYNC, in
    /// [`Network::exchange`]; [`cycle`](Self::cycle) waits and does both. Allocates nothing.
    pub fn step(&mut self, io: &mut Exchange<'_>) -> BaseState {
        self.now = io.now();
        self.ramp();
        let sent = [self.sent.left, self.sent.right];
        let turns_per_m = self.geometry.turns_per_m();
        for (wheel, m_s) in self.wheels.iter_mut().zip(sent) {
            let demand = match self.power {
                Power::Off => Demand::Off,
                Power::Enabling | Power::On => Demand::Velocity(Rpm(m_s * turns_per_m * wheel.turns * 60.0)),
            };
            wheel.shows = Some(wheel.drive.step(io, demand));
        }
        let period_s = self.period.as_secs_f64();
        for (wheel, m_s) in self.wheels.iter_mut().zip(sent) {
            wheel.behind_m = (wheel.behind_m + m_s * period_s) * (1.0 - period_s / LAG_MEMORY_S);
        }
        self.count();
        self.state.follows = self.wheels.iter().all(|wheel| wheel.shows.is_some_and(|shown| shown.follows));
        if self.power != Power::Off {
            self.find_trouble();
        }
        if self.power == Power::Enabling && self.state.follows {
            self.power = Power::On;
        }
        self.state.commanded = self.geometry.twist(self.sent);
        let is_still = self.is_stopping && self.state.commanded == Twist::default();
        if is_still && self.still_cycles == 0 {
            // One that was about to turn had still stood.
            self.wheels.iter_mut().for_each(|wheel| wheel.drive.begin_rest());
        }
        self.still_cycles = if is_still { self.still_cycles + 1 } else { 0 };
        self.state
    }

    /// The speeds of this cycle: nearer to the wanted ones by what the limits allow, both wheels by one share, so that the base
    /// goes from one circle to the next evenly.
    fn ramp(&mut self) {
        let Some(wanted_at) = self.wanted_at else { return };
        let watchdog = self.limits.watchdog;
        if self.state.cause.is_none() && self.now - wanted_at > watchdog && self.wanted != Twist::default() {
            self.state.cause = Some(StopCause::Watchdog { after: watchdog });
        }
        let goal = if self.state.cause.is_some() || self.power != Power::On || !self.state.follows {
            Wheels::default()
        } else {
            self.geometry.wheels_m_s(self.wanted)
        };
        let (left, right) = (goal.left - self.sent.left, goal.right - self.sent.right);
        let most = self.limits.wheel_m_s2 * self.period.as_secs_f64();
        let share = (most / left.abs().max(right.abs())).min(1.0);
        // The same goal again: nothing over nothing.
        if share.is_finite() {
            self.sent = Wheels { left: self.sent.left + share * left, right: self.sent.right + share * right };
        }
    }

    /// Counts on from the last positions of both wheels that were seen together.
    fn count(&mut self) {
        let seen = self.wheels.each_ref().map(|wheel| wheel.shows.and_then(|shown| shown.position));
        let [Some(Turns(left)), Some(Turns(right))] = seen else {
            self.state.unseen_cycles += 1;
            return;
        };
        let m_per_turn = 1.0 / self.geometry.turns_per_m();
        let mut ways = [0.0; 2];
        for ((wheel, now), way) in self.wheels.iter_mut().zip([left, right]).zip(&mut ways) {
            let before = wheel.counted_turns.replace(now).unwrap_or(now);
            *way = (now - before) / wheel.turns * m_per_turn;
        }
        self.wheels.iter_mut().zip(ways).for_each(|(wheel, way)| wheel.behind_m -= way);
        let [left, right] = ways;
        self.state.pose = self.state.pose.after(Wheels { left, right }, &self.geometry);
    }

    fn find_trouble(&mut self) {
        if self.lost_wheel().is_some() {
            return;
        }
        for wheel in &self.wheels {
            match wheel.shows.and_then(|shown| shown.refused) {
                None => {}
                // Its first TPDO may be on its way. Later on, one that stays away ends the motion: the base does not drive on by
                // itself when it comes back.
                Some(Refusal::NoCycle | Refusal::NotHeard) if self.power == Power::Enabling => {}
                Some(refusal) => {
                    self.state.cause = Some(StopCause::Wheel { node: wheel.drive.node(), refusal });
                    return;
                }
            }
        }
        // A wheel that was not seen is behind by what it may have gone meanwhile.
        let seen = |wheel: &&Wheel| wheel.shows.is_some_and(|shown| shown.position.is_some());
        let limit_m = self.limits.lag_m;
        let lagging = self.wheels.iter().filter(seen).find(|wheel| wheel.behind_m.abs() > limit_m);
        if let Some(wheel) = lagging.filter(|_| self.power == Power::On) {
            self.state.cause = Some(StopCause::Lag { node: wheel.drive.node(), lag_m: wheel.behind_m, limit_m });
        }
    }

    /// Waits for the next SYNC and does one cycle.
    ///
    /// # Errors
    /// [`BaseError::NoCycle`]: the master has stopped the drives.
    pub async fn cycle(&mut self) -> Result<BaseState, BaseError> {
        let network = self.network.clone();
        network.next_sync().await?;
        Ok(network.exchange(|io| self.step(io)))
    }

    /// What the last cycle showed.
    pub const fn state(&self) -> BaseState {
        self.state
    }

    /// The twist that the base is to have: the newest one that was commanded, as the limits allow it. `commanded` of
    /// [`state`](Self::state) comes to it with `wheel_m_s2`.
    pub const fn wanted(&self) -> Twist {
        self.wanted
    }

    /// Begins to count from this pose.
    pub const fn set_pose(&mut self, pose: Pose) {
        self.state.pose = pose;
    }

    /// Enables both wheels and holds them at no speed.
    ///
    /// # Errors
    /// [`BaseError::Stopped`] when a drive is at fault, [`BaseError::NotEnabled`] when one takes too long, those of
    /// [`cycle`](Self::cycle).
    pub async fn enable(&mut self) -> Result<(), BaseError> {
        (self.state.cause, self.wanted, self.sent) = (None, Twist::default(), Wheels::default());
        self.wheels.iter_mut().for_each(|wheel| wheel.behind_m = 0.0);
        // What an earlier stop has left behind ends without power.
        self.switch_off().await?;
        self.power = Power::Enabling;
        for _ in 0..self.cycles(POWER_LIMIT) {
            match self.cycle().await? {
                BaseState { cause: Some(cause), .. } => {
                    self.power = Power::Off;
                    return Err(BaseError::Stopped(cause));
                }
                BaseState { follows: true, .. } => return Ok(()),
                _ => {}
            }
        }
        self.power = Power::Off;
        self.cycle().await?;
        let [left, right] =
            self.wheels.each_ref().map(|wheel| wheel.shows.map_or_else(String::new, |shown| shown.to_string()));
        Err(BaseError::NotEnabled { limit: POWER_LIMIT, left, right })
    }

    /// Has the base come to rest within its limits, from the next cycle on, until another twist comes. It stays powered.
    pub fn start_stop(&mut self) {
        self.wanted = Twist::default();
        (self.is_stopping, self.still_cycles) = (true, 0);
    }

    /// True from [`start_stop`](Self::start_stop) on until a twist comes.
    pub const fn is_stopping(&self) -> bool {
        self.is_stopping
    }

    /// What became of [`start_stop`](Self::start_stop): `None` while the wheels come to rest, `Ok` once both were seen to stand.
    ///
    /// # Errors
    /// [`BaseError::NotAtRest`] for a wheel that does not come to rest, or [`BaseError::NotStopped`] where the base had been stopped
    /// before; [`BaseError::Stopped`] where a wheel was lost before or on the
    /// way to rest, once those that are heard stand.
    pub fn stopped(&self) -> Option<Result<(), BaseError>> {
        if !self.is_stopping || self.still_cycles == 0 {
            return None;
        }
        let waited = self.period * u32::try_from(self.still_cycles).unwrap_or(u32::MAX);
        // A wheel that is not heard is the lost one, or is stopped by its own watch.
        let lost = self.lost_wheel();
        let wheels = self.wheels.iter().filter(|wheel| lost.is_none() || wheel.is_heard());
        let rest = at_rest(wheels.map(|wheel| &wheel.drive), waited)?;
        Some(match (rest, lost) {
            (Err(why), _) => {
                let both = |cause| BaseError::NotStopped { cause: Box::new(cause), why };
                Err(self.state.cause.map_or(why.into(), both))
            }
            (Ok(()), Some(cause)) => Err(BaseError::Stopped(cause)),
            (Ok(()), None) => Ok(()),
        })
    }

    /// Brings the base to rest within its limits, until both wheels were seen to stand; it stays powered.
    ///
    /// # Errors
    /// As [`cycle`](Self::cycle) and [`stopped`](Self::stopped).
    pub async fn stop(&mut self) -> Result<(), BaseError> {
        self.start_stop();
        loop {
            self.cycle().await?;
            if let Some(stopped) = self.stopped() {
                return stopped;
            }
        }
    }

    /// Asks the wheel that stopped the base what is the matter with it: its fault with its text, or what it is missing. The
    /// cycles go on meanwhile. `None` where no wheel was the cause, or it has nothing to say.
    pub async fn explain_stop(&mut self) -> Option<Error> {
        let question = self.explanation()?;
        let network = self.network.clone();
        let step = |io: &mut Exchange<'_>| {
            self.step(io);
        };
        network.ask_beside_cycles(question, step).await
    }

    /// The question of [`explain_stop`](Self::explain_stop) alone, for a base that is stepped elsewhere meanwhile.
    pub fn explanation(&self) -> Option<impl Future<Output = Option<Error>> + Send + use<>> {
        let (node, refusal) = match self.state.cause? {
            StopCause::Wheel { node, refusal } => (node, Some(refusal)),
            StopCause::Lag { node, .. } => (node, None),
            StopCause::Watchdog { .. } => return None,
        };
        let [left, right] = &self.drives;
        let drive = if left.node().id() == node { left } else { right }.clone();
        Some(drive.explain_stop(refusal))
    }

    fn lost_wheel(&self) -> Option<StopCause> {
        self.state.cause.filter(|cause| cause.wheel().is_some())
    }

    /// Brings the base to rest, takes the wheels' power and ends what was begun: SYNC, and the guards of the drives that were seen
    /// to stand without power. One that was not stays among [`Network::moved`] and is left to its own watch.
    ///
    /// # Errors
    /// As [`cycle`](Self::cycle), and those of the requests; [`BaseError::Stopped`] for a wheel that was lost on the way to rest.
    pub async fn close(mut self) -> Result<(), BaseError> {
        let known = self.lost_wheel().is_some();
        // One that has come to rest need not do so again.
        let stopped = match self.stopped() {
            Some(stopped) => stopped,
            None => self.stop().await,
        };
        let stopped =
            stopped.or_else(|error| if known && matches!(error, BaseError::Stopped(_)) { Ok(()) } else { Err(error) });
        // Without SYNC there are no cycles, and the master has stopped the drives.
        let off = if matches!(stopped, Err(BaseError::NoCycle(_))) { Ok(()) } else { self.switch_off().await };
        self.network.sync(None);
        let nodes: NodeSet = self.drives.iter().map(|drive| drive.node().id()).collect();
        let unheard = self.wheels.iter().filter(|wheel| !wheel.is_heard());
        let unheard: NodeSet = unheard.map(|wheel| wheel.drive.node()).collect();
        let heard = nodes.iter().filter(|node| !unheard.contains(*node)).collect();
        let mut asked = self.network.stop_once(heard).await;
        // One that answers nothing is not asked again, which would take its time.
        let answering = self.network.answering(unheard).await;
        asked.extend(self.network.stop_once(answering).await);
        let released = self.network.release_guards(nodes).await;
        stopped.and(off)?;
        seen_to_stand::<BaseError>(asked, unheard, answering)?;
        Ok(released?)
    }

    /// Cycles until both drives show that they have no power.
    async fn switch_off(&mut self) -> Result<(), BaseError> {
        self.power = Power::Off;
        for cycle in 0..self.cycles(POWER_LIMIT) {
            self.cycle().await?;
            // One that is not heard is not waited for: nothing is known of it, and nothing it does can be seen.
            let settled =
                |shown: CyclicState| shown.is_without_power() || cycle > UNHEARD && shown.statusword.is_none();
            if self.wheels.iter().all(|wheel| wheel.shows.is_some_and(settled)) {
                break;
            }
        }
        let powered = self.wheels.iter().find(|wheel| wheel.shows.is_some_and(|shown| shown.is_live));
        let node = powered.map(|wheel| wheel.drive.node());
        node.map_or(Ok(()), |node| Err(NotAtRest::StillPowered { node, limit: POWER_LIMIT }.into()))
    }

    fn cycles(&self, time: Duration) -> u64 {
        (time.as_secs_f64() / self.period.as_secs_f64()).ceil() as u64
    }
}

impl Wheel {
    /// Its drive's TPDO comes.
    fn is_heard(&self) -> bool {
        self.shows.is_some_and(|shown| shown.statusword.is_some())
    }
}

impl WheelSetup {
    fn claim(&self) -> Result<Claim, BaseError> {
        let (node, controlword) = (self.drive.node().id(), self.drive.place(CONTROLWORD));
        self.drive.node().network().claim(node, controlword).ok_or(BaseError::Taken { node, controlword })
    }

    async fn open(
        &self,
        geometry: &Geometry,
        limits: &BaseLimits,
        period: Duration,
        options: CyclicOptions,
        claim: Claim,
    ) -> Result<Wheel, BaseError> {
        let node = self.drive.node().id();
        if !self.turns.is_finite() || self.turns == 0.0 {
            return Err(BaseError::BadLimit { what: "turns of the drive for a turn of the wheel", value: self.turns });
        }
        self.drive.configure_cyclic_for_a_motion(self.mode).await?;
        let mut drive = self.drive.cyclic(self.mode, options).await?;
        drive.stands_after(REST_TIME);
        let rpm_of = |m: f64| m * geometry.turns_per_m() * self.turns.abs() * 60.0;
        let needed_rpm = rpm_of(limits.wheel_m_s);
        match drive.highest_speed() {
            Some((Rpm(most_rpm), bound)) if needed_rpm > most_rpm => {
                Err(BaseError::BeyondDrive { node, needed_rpm, most_rpm, bound })
            }
            Some(_) if drive.shows_position() && drive.set_point().is_none() => {
                self.drive.write_ramps_of_a_cycle(period, rpm_of(limits.wheel_m_s2)).await?;
                let (turns, counted_turns, behind_m, shows) = (self.turns, None, 0.0, None);
                Ok(Wheel { drive, turns, counted_turns, behind_m, shows, _claim: claim })
            }
            _ => Err(BaseError::NoWheel { node }),
        }
    }
}

impl fmt::Debug for Base {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Base").field("state", &self.state).field("drives", &self.drives).finish_non_exhaustive()
    }
}

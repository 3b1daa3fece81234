//! The boot-up of one node: the process "boot NMT slave" of CiA 302-2, step by step.
//!
//! Two things differ from the standard's figure, for the sake of motors that may turn: a node that must not be reset while it
//! is operational, and has its heartbeat off, is given one before anything else, so that its state is known; and one whose
//! state cannot be known is not reset. Node guarding is for nodes that send no heartbeat. Programs are not loaded: I does not come
//! from here.

use std::time::Duration;

use can::Instant;
use canopen::object::{
    APPLICATION_SOFTWARE_IDENTIFICATION, CONFIGURATION_DATE, CONFIGURATION_TIME, DEVICE_TYPE, GUARD_TIME,
    LIFE_TIME_FACTOR, PRODUCER_HEARTBEAT_TIME,
};
use canopen::{Mux, NmtCommand, NmtState, NodeId};
use devices::HostWatch;

use super::assignment::{Assignment, Startup};
use super::error_status::ErrorStatus;
use super::expectation::{BOOT_TIME, BootPlan, Expectation};
use super::report::NodeReport;
use super::step::{Expected, Found, Heard, Step, StepKind, Verdict};
use crate::Drive;
use crate::drive::{HostLoss, SwitchedOff};
use crate::error::Error;
use crate::network::{Elapsed, Network, Node, NodeView};

const IDENTITY: u16 = 0x1018;
const RESTORE: u16 = 0x1011;
/// The signature that 1011h expects. Source: CiA 301, 7.5.2.14.
const LOAD: [u8; 4] = *b"load";

/// How much later than its time a heartbeat may come: behind a bus full of other frames.
const JITTER: Duration = Duration::from_millis(100);

/// How many requests in a row a node may leave unanswered whose life time factor (100Dh) is 0.
const GUARD_FACTOR: u8 = 3;

/// How the boot-up of a node goes on after a step.
type Go<T = ()> = Result<T, ErrorStatus>;

/// One node on its way.
pub(super) struct NodeBoot<'a> {
    node: Node,
    plan: &'a BootPlan,
    expectation: &'a Expectation,
    steps: Vec<Step>,
    /// Until then silence may be that it has not booted yet; `None` for ever.
    patience_ends: Option<Instant>,
    /// It was operational before, and is left so.
    left_operational: bool,
    /// The longest time between its heartbeats, once it sends any.
    heartbeat: Option<Duration>,
}

/// How the master notices that a node is gone.
#[derive(Clone, Copy)]
enum Watch {
    /// By its heartbeat: the longest time between two.
    Heartbeat(Duration),
    /// By node guarding: guard time, and life time factor.
    Guarding(Duration, u8),
}

/// What is known of the state of a node that must not be disturbed.
enum KnownState {
    Operational,
    Other,
    Unknown,
}

impl<'a> NodeBoot<'a> {
    pub(super) fn new(network: &Network, id: NodeId, plan: &'a BootPlan, expectation: &'a Expectation) -> Self {
        Self {
            node: network.node(id).with_timeout(plan.timeout),
            plan,
            expectation,
            steps: Vec::new(),
            patience_ends: plan.boot_time_of(expectation).map(|time| network.now() + time),
            left_operational: false,
            heartbeat: None,
        }
    }

    /// A node that has booted, to be started with all others.
    pub(super) fn resumed(network: &Network, id: NodeId, plan: &'a BootPlan, expectation: &'a Expectation) -> Self {
        let booted = Self::new(network, id, plan, expectation);
        let heartbeat = booted.node.facts().heartbeat_watch.map(|watch| watch.time);
        Self { heartbeat, ..booted }
    }

    /// Puts what was done since into its report.
    pub(super) fn fill_in(self, report: &mut NodeReport) {
        report.state = self.node.facts().probable_state(self.expectation.description);
        report.steps.extend(self.steps);
    }

    /// All steps up to NMT start, and this too unless all nodes are started together.
    pub(super) async fn run(mut self) -> NodeReport {
        let status = match self.boot().await {
            Err(status) => Some(status),
            Ok(()) => self.left_operational.then_some(ErrorStatus::InitiallyOperational),
        };
        let together = self.plan.startup.has(Startup::START_ALL);
        let booted = status.is_none() && self.expectation.assignment.has(Assignment::BOOT);
        if booted && !together && !self.plan.startup.has(Startup::STARTS_NONE) {
            let before = self.node.network().now();
            self.node.nmt(NmtCommand::Start);
            self.await_start(before).await;
        }
        let mandatory = self.expectation.assignment.has(Assignment::MANDATORY);
        let state = self.node.facts().probable_state(self.expectation.description);
        NodeReport { node: self.node.id(), mandatory, steps: self.steps, status, state }
    }

    async fn boot(&mut self) -> Go {
        let assignment = self.expectation.assignment;
        if !assignment.has(Assignment::SLAVE) {
            let found = Found::Value(assignment.0);
            return self.fail(StepKind::Assignment, None, Expected::Listed, found, ErrorStatus::NotListed);
        }
        // CiA 302-2, 1F81h and the figure of the process: without bit 2 the steps are passed over up to error control.
        if !assignment.has(Assignment::BOOT) {
            let left =
                Found::Text("a node booted by another manager (1F81h, bit 2): its heartbeat is watched".to_owned());
            self.note(StepKind::Assignment, None, Expected::Listed, left, Verdict::Noted);
            return self.begin_watch().await;
        }
        let keeps_alive = assignment.has(Assignment::KEEP_ALIVE);
        if !keeps_alive {
            self.reset(NmtCommand::ResetCommunication).await;
        }
        self.check_device_type().await?;
        self.check_identity().await?;
        if keeps_alive {
            match self.state().await? {
                KnownState::Operational => self.left_operational = true,
                KnownState::Other => self.reset(NmtCommand::ResetCommunication).await,
                KnownState::Unknown => {}
            }
        }
        if !self.left_operational {
            self.restore().await?;
            self.check_software().await?;
            self.configure().await?;
        }
        self.begin_watch().await?;
        self.arm_host_watch().await;
        Ok(())
    }

    /// Resets it and waits for its boot-up message. The next request shows whether it is there at all.
    async fn reset(&mut self, command: NmtCommand) {
        let time = self.plan.boot_time.unwrap_or(BOOT_TIME);
        let booted = self.node.wait_boot_up(time);
        self.node.nmt(command);
        let (found, verdict) = match booted.await {
            Ok(()) => (Found::Came, Verdict::Passed),
            Err(_) => (self.nothing(time), Verdict::Noted),
        };
        self.note(StepKind::Reset, None, Expected::BootUp, found, verdict);
    }

    async fn check_device_type(&mut self) -> Go {
        let expected = self.expectation.device_type;
        let found = self.read_until(DEVICE_TYPE, self.patience_ends).await;
        let status = match (&found, expected) {
            (Found::Value(value), Some(expected)) if *value != expected => Some(ErrorStatus::OtherDeviceType),
            (Found::Value(_), _) => None,
            _ => Some(ErrorStatus::NoDeviceType),
        };
        self.judge(StepKind::DeviceType, DEVICE_TYPE, expected.map_or(Expected::Answer, Expected::Value), found, status)
    }

    async fn check_identity(&mut self) -> Go {
        let Expectation { vendor_id, product_code, revision_number, serial_number, .. } = *self.expectation;
        for (sub_index, expected, status) in [
            (1, vendor_id, ErrorStatus::OtherVendor),
            (2, product_code, ErrorStatus::OtherProduct),
            (3, revision_number, ErrorStatus::OtherRevision),
            (4, serial_number, ErrorStatus::OtherSerial),
        ] {
            let Some(expected) = expected else { continue };
            let object = Mux::new(IDENTITY, sub_index);
            self.check_value(StepKind::Identity, object, expected, status).await?;
        }
        Ok(())
    }

    /// Whether it is operational, by its heartbeat, which it is given where it has none, or by node guarding.
    async fn state(&mut self) -> Go<KnownState> {
        let expected = Expected::OtherState(NmtState::Operational);
        let Some(watch) = self.find_watch().await else {
            let unknown = Found::Text("a node that sends no heartbeat (1017h): it is not reset".to_owned());
            self.note(StepKind::State, Some(PRODUCER_HEARTBEAT_TIME), expected, unknown, Verdict::Noted);
            return Ok(KnownState::Unknown);
        };
        let now = self.node.network().now();
        let (patience, awaited, status) = match watch {
            Watch::Heartbeat(patience) => (patience, Expected::Heartbeat, ErrorStatus::NoHeartbeat),
            Watch::Guarding(..) => (self.guard_node(watch), Expected::GuardAnswer, ErrorStatus::NoGuarding),
        };
        match self.hear_state(now, patience, |_| true).await {
            Ok(NmtState::Operational) => {
                let found = Found::State(NmtState::Operational);
                match self.expectation.asks_for_nothing() {
                    true => {
                        self.note(StepKind::State, None, Expected::State(NmtState::Operational), found, Verdict::Passed)
                    }
                    false => self.note(StepKind::State, None, expected, found, Verdict::LeftOperational),
                }
                Ok(KnownState::Operational)
            }
            Ok(state) => {
                self.note(StepKind::State, None, expected, Found::State(state), Verdict::Passed);
                Ok(KnownState::Other)
            }
            Err(Elapsed) => {
                let found = self.nothing(patience);
                self.fail(StepKind::State, None, awaited, found, status)?;
                Ok(KnownState::Unknown)
            }
        }
    }

    async fn restore(&mut self) -> Go {
        if !self.expectation.assignment.has(Assignment::RESTORE) {
            return Ok(());
        }
        let object = Mux::new(RESTORE, self.expectation.restore);
        let found = self.write(object, &LOAD).await;
        let status = (!matches!(found, Found::Done)).then_some(ErrorStatus::ConfigurationFailed);
        self.judge(StepKind::Restore, object, Expected::Write(LOAD.to_vec()), found, status)?;
        // What was restored counts after a reset (CiA 301, 7.5.2.14).
        self.reset(NmtCommand::ResetNode).await;
        Ok(())
    }

    /// CiA 302-2, error status: G where there is nothing to compare, in the plan (1F55h) or in the node, H where the program may
    /// not be replaced: without bit 6 of 1F81h, or with bit 4, which has the node left as it is. One that may be is not at hand
    /// here, which is G again.
    async fn check_software(&mut self) -> Go {
        let assignment = self.expectation.assignment;
        if !assignment.has(Assignment::VERIFY_SOFTWARE) {
            return Ok(());
        }
        let Some(expected) = self.expectation.software else {
            let found = Found::Text("a plan without one (1F55h is 0)".to_owned());
            return self.fail(
                StepKind::Software,
                Some(APPLICATION_SOFTWARE_IDENTIFICATION),
                Expected::Answer,
                found,
                ErrorStatus::NoProgram,
            );
        };
        let allowed = assignment.has(Assignment::UPDATE_SOFTWARE) && !assignment.has(Assignment::KEEP_ALIVE);
        let found = self.read(APPLICATION_SOFTWARE_IDENTIFICATION).await;
        let status = match found {
            Found::Value(value) if value == expected => None,
            Found::Value(_) if !allowed => Some(ErrorStatus::ProgramNotAllowed),
            _ => Some(ErrorStatus::NoProgram),
        };
        self.judge(StepKind::Software, APPLICATION_SOFTWARE_IDENTIFICATION, Expected::Value(expected), found, status)
    }

    /// Writes its configuration, unless it has it by date and time.
    async fn configure(&mut self) -> Go {
        let expectation = self.expectation;
        if let Some((date, time)) = expectation.configured {
            let found = (self.read(CONFIGURATION_DATE).await, self.read(CONFIGURATION_TIME).await);
            if let (Found::Value(found_date), Found::Value(found_time)) = found
                && (found_date, found_time) == (date, time)
            {
                let expected = Expected::Value(date);
                self.note(StepKind::Configuration, Some(CONFIGURATION_DATE), expected, Found::AsItWas, Verdict::Passed);
                return Ok(());
            }
        }
        for (object, bytes) in &expectation.configuration {
            let found = self.write(*object, bytes).await;
            let status = (!matches!(found, Found::Done)).then_some(ErrorStatus::ConfigurationFailed);
            self.judge(StepKind::Configuration, *object, Expected::Write(bytes.clone()), found, status)?;
        }
        Ok(())
    }

    /// Has the master watch it, and waits for the first sign of life.
    async fn begin_watch(&mut self) -> Go {
        let Some(watch) = self.find_watch().await else {
            let found = Found::Text("a node that sends none: its loss would go unnoticed".to_owned());
            self.note(StepKind::Heartbeat, Some(PRODUCER_HEARTBEAT_TIME), Expected::Heartbeat, found, Verdict::Noted);
            return Ok(());
        };
        let now = self.node.network().now();
        let (time, kind, object, expected, failed) = match watch {
            Watch::Heartbeat(time) => {
                self.node.watch_heartbeat(Some(time));
                let failed = ErrorStatus::NoHeartbeatAtStart;
                (time, StepKind::Heartbeat, PRODUCER_HEARTBEAT_TIME, Expected::Heartbeat, failed)
            }
            Watch::Guarding(..) => {
                let time = self.guard_node(watch);
                (time, StepKind::Guarding, GUARD_TIME, Expected::GuardAnswer, ErrorStatus::NoGuarding)
            }
        };
        let (found, status) = match self.hear_state(now, time, |_| true).await {
            Ok(_) => (Found::Came, None),
            Err(Elapsed) => (self.nothing(time), Some(failed)),
        };
        self.heartbeat = Some(time);
        self.judge(kind, object, expected, found, status)
    }

    /// Begins to guard it; the longest time without an answer.
    fn guard_node(&self, watch: Watch) -> Duration {
        match watch {
            Watch::Heartbeat(time) => time,
            Watch::Guarding(time, factor) => {
                self.node.watch_by_guarding(time, factor);
                time * u32::from(factor.max(1))
            }
        }
    }

    /// By its heartbeat; by node guarding where 1F81h or its configuration has a guard time, 1016h has no time for it and it sends none, and where it
    /// cannot send any and has 100Ch and 100Dh. CiA 302-2, start of error control.
    async fn find_watch(&mut self) -> Option<Watch> {
        if let (Some((time, factor)), None) = (self.expectation.guarding(), self.expectation.heartbeat)
            && !matches!(self.read(PRODUCER_HEARTBEAT_TIME).await, Found::Value(1..))
        {
            return Some(Watch::Guarding(time, factor));
        }
        if let Some(time) = self.produce_heartbeat().await {
            return Some(Watch::Heartbeat(time));
        }
        let (Found::Value(ms), Found::Value(factor)) = (self.read(GUARD_TIME).await, self.read(LIFE_TIME_FACTOR).await)
        else {
            return None;
        };
        // A time of 0 has it answer all the same, and not watch this master (CiA 301, 7.5.2.11).
        let time = match ms & 0xFFFF {
            0 => self.plan.heartbeat?,
            ms => Duration::from_millis(ms.into()),
        };
        let factor = if factor as u8 == 0 { GUARD_FACTOR } else { factor as u8 };
        Some(Watch::Guarding(time, factor))
    }

    /// Sees to it that it sends a heartbeat, if it can and is booted; the longest time between two.
    async fn produce_heartbeat(&mut self) -> Option<Duration> {
        let period = match self.read(PRODUCER_HEARTBEAT_TIME).await {
            Found::Value(0) => {
                let period = self.plan.heartbeat.filter(|_| self.expectation.assignment.has(Assignment::BOOT))?;
                let ms = u16::try_from(period.as_millis()).unwrap_or(u16::MAX);
                let Found::Done = self.write(PRODUCER_HEARTBEAT_TIME, &ms.to_le_bytes()).await else { return None };
                period
            }
            // UNSIGNED16 (CiA 301, 7.5.2.20).
            Found::Value(ms) => Duration::from_millis(u64::from(ms & 0xFFFF)),
            _ => return None,
        };
        Some(self.expectation.heartbeat.unwrap_or(period + period / 2 + JITTER))
    }

    /// Has the drive stop when this program dies, or says what it does then.
    async fn arm_host_watch(&mut self) {
        let drive = self.expectation.description.filter(|description| description.first_axis().is_some());
        let Some(description) = drive else { return };
        let object = match description.host_watch {
            HostWatch::Silence { time } => Some(time),
            HostWatch::Heartbeat { consumer, .. } => Some(consumer),
            HostWatch::None => None,
        };
        let drive = Drive::new(self.node.clone(), description);
        let loss = if self.plan.guard { self.guard(&drive, object).await } else { drive.host_loss().await };
        let (found, verdict) = match loss {
            Ok(loss) => {
                let stops = loss.stops_after().is_some();
                (Found::Text(loss.to_string()), if stops { Verdict::Passed } else { Verdict::Noted })
            }
            Err(error) => (Found::Text(error.to_string()), Verdict::Noted),
        };
        self.note(StepKind::HostWatch, object, Expected::Stops, found, verdict);
    }

    /// Arms the drive's watch for this master. One that is off and listens to heartbeats gets this master's node-ID; one that is
    /// set already was set on purpose, and stays as it is.
    async fn guard(&self, drive: &Drive, object: Option<Mux>) -> Result<HostLoss, Error> {
        if let (Some(HostWatch::Heartbeat { .. }), Some(consumer)) =
            (self.expectation.description.map(|description| description.host_watch), object)
            && self.plan.own != NodeId::MAX
            && self.node.read::<u32>(consumer).await? == 0
        {
            self.node.write(consumer, u32::from(self.plan.own.raw()) << 16 | CONSUMER_TIME_MS).await?;
        }
        drive.guard(SwitchedOff::SwitchOn).await
    }

    /// Waits until a started node says that it is operational.
    pub(super) async fn await_start(&mut self, before: Instant) {
        let expected = Expected::State(NmtState::Operational);
        let Some(time) = self.heartbeat else {
            let found = Found::Text("no state: it sends no heartbeat".to_owned());
            return self.note(StepKind::Start, None, expected, found, Verdict::Noted);
        };
        // A heartbeat may have been on its way when the command went out: the next one counts.
        let heard = self.hear_state(before, time * 2, |state| state == NmtState::Operational).await;
        let (found, verdict) = match (heard, self.node.facts().probable_state(self.expectation.description)) {
            (Ok(state), _) => (Found::State(state), Verdict::Passed),
            (Err(Elapsed), Some(state)) => (Found::State(state), Verdict::Noted),
            (Err(Elapsed), None) => (self.nothing(time * 2), Verdict::Noted),
        };
        self.note(StepKind::Start, None, expected, found, verdict);
    }

    /// A heartbeat that came after `since` with a wanted state.
    async fn hear_state(
        &self,
        since: Instant,
        patience: Duration,
        wanted: impl Fn(NmtState) -> bool + Unpin,
    ) -> Result<NmtState, Elapsed> {
        let description = self.expectation.description;
        let said = move |view: &NodeView<'_>| {
            let said = view.facts.nmt_state.filter(|_| view.facts.heartbeat_at.is_some_and(|at| at > since))?;
            Some(description.map_or(said, |description| description.nmt_state(said))).filter(|state| wanted(*state))
        };
        self.node.wait(said, patience).await
    }

    async fn check_value(&mut self, kind: StepKind, object: Mux, expected: u32, status: ErrorStatus) -> Go {
        let found = self.read(object).await;
        let right = matches!(found, Found::Value(value) if value == expected);
        self.judge(kind, object, Expected::Value(expected), found, (!right).then_some(status))
    }

    async fn read(&self, object: Mux) -> Found {
        self.read_until(object, Some(Instant::ZERO)).await
    }

    /// Asks as often as the plan says, and until then.
    async fn read_until(&self, object: Mux, until: Option<Instant>) -> Found {
        self.ask(until, || self.node.upload(object), |payload| Found::Value(payload.raw())).await
    }

    async fn write(&self, object: Mux, bytes: &[u8]) -> Found {
        self.ask(Some(Instant::ZERO), || self.node.download(object, bytes), |()| Found::Done).await
    }

    async fn ask<T, F: Future<Output = Result<T, Error>>>(
        &self,
        until: Option<Instant>,
        request: impl Fn() -> F,
        answered: impl Fn(T) -> Found,
    ) -> Found {
        let mut tries: u32 = 0;
        loop {
            tries = tries.saturating_add(1);
            match request().await {
                Ok(answer) => return answered(answer),
                Err(Error::Aborted { code, .. }) => return Found::Refused(code),
                Err(Error::NoAnswer { hints, .. }) => {
                    if tries >= self.plan.tries && until.is_some_and(|until| self.node.network().now() >= until) {
                        return Found::Silent { waited: self.node.timeout(), tries, last: self.last_heard(), hints };
                    }
                }
                Err(error) => return Found::Text(error.to_string()),
            }
        }
    }

    fn nothing(&self, waited: Duration) -> Found {
        Found::Nothing { waited, last: self.last_heard(), hints: self.node.hints(false) }
    }

    fn last_heard(&self) -> Option<Heard> {
        let (facts, now) = (self.node.facts(), self.node.network().now());
        let seen = facts.seen_at?;
        Some(match (facts.boot_up, facts.heartbeat_at) {
            (Some((booted, _)), _) if booted >= seen => Heard::BootUp(now - booted),
            (_, Some(beat)) if beat >= seen => Heard::Heartbeat(now - beat),
            _ => Heard::Frame(now - seen),
        })
    }

    fn judge(
        &mut self,
        kind: StepKind,
        object: Mux,
        expected: Expected,
        found: Found,
        status: Option<ErrorStatus>,
    ) -> Go {
        match status {
            Some(status) => self.fail(kind, Some(object), expected, found, status),
            None => {
                self.note(kind, Some(object), expected, found, Verdict::Passed);
                Ok(())
            }
        }
    }

    fn fail(
        &mut self,
        kind: StepKind,
        object: Option<Mux>,
        expected: Expected,
        found: Found,
        status: ErrorStatus,
    ) -> Go {
        self.note(kind, object, expected, found, Verdict::Failed(status));
        Err(status)
    }

    fn note(&mut self, kind: StepKind, object: Option<Mux>, expected: Expected, found: Found, verdict: Verdict) {
        self.steps.push(Step { kind, object, expected, found, verdict });
    }
}

/// The consumer time of a watch that was off, in ms: as the M joint is delivered.
const CONSUMER_TIME_MS: u32 = 2000;

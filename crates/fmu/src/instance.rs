//! An instance of an FMU by the rules of FMI 3.0: in which mode what may be called, and what a call does. Without pointers:
//! `abi` has those.

use std::path::{Path, PathBuf};

use can::Instant;
use serde::{Deserialize, Serialize};

use crate::call::{CallError, Called, refused};
use crate::config::{Config, ConfigError, TxClock};
use crate::fmi2::VariableKind;
use crate::journal::Journal;
use crate::unit::{Action, Unit};
use crate::variable::{Causality, Reference, Terminal, Value, Variable};

const NANOS: f64 = 1e9;
/// A century, in seconds: nanoseconds since the begin fit 64 bits far beyond it.
const LATEST_S: f64 = 3.2e9;
const LATEST_NS: u64 = (LATEST_S * NANOS) as u64;

/// The state of an instance (FMI 3.0, 2.3 and 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Made; parameters may be set.
    Instantiated,
    /// Between entering and leaving initialization.
    Initialization,
    /// Clocks tick and clocked variables are exchanged.
    Event,
    /// Time may pass.
    Step,
    /// Over.
    Terminated,
}

/// What a step came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stepped {
    /// Clocks have ticked: event mode should be entered.
    pub needs_event: bool,
    /// Where time stands, s.
    pub time_s: f64,
}

/// When the clock of what is sent ticks next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interval {
    /// Not known: nothing will be sent by itself.
    NotKnown,
    /// In so many nanoseconds.
    In(u64),
}

/// One network, as the importer sees it now.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Port {
    /// Set and not yet handed on.
    received: Option<Vec<u8>>,
    /// What the clock's last tick made visible.
    visible: Vec<u8>,
    /// The clock of what is sent has ticked.
    ticked: bool,
}

/// What an instance is beside its unit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Rest {
    ports: Vec<Port>,
    mode: Mode,
    /// Time at the begin, s.
    start_s: f64,
    now_ns: u64,
}

/// An instance.
pub struct Instance {
    pub(crate) config: Config,
    resources: PathBuf,
    /// Of what FMU it is.
    pub(crate) token: String,
    /// What it computes, with what was done to that.
    pub(crate) journal: Journal,
    variables: Vec<Variable>,
    terminals: Vec<Terminal>,
    has_event_mode: bool,
    rest: Rest,
}

impl Instance {
    /// An instance of what is described in a folder of resources.
    ///
    /// # Errors
    /// That nothing is described there, or nothing that can be built.
    pub fn new(resources: &Path, has_event_mode: bool) -> Result<Self, ConfigError> {
        Self::of(Config::read(resources)?, resources, has_event_mode)
    }

    /// An instance of a configuration.
    ///
    /// # Errors
    /// That it cannot be built.
    pub fn of(config: Config, resources: &Path, has_event_mode: bool) -> Result<Self, ConfigError> {
        let unit = Unit::new(&config, resources)?;
        let (variables, terminals) = (unit.variables(), unit.terminals());
        let ports = vec![Port::default(); terminals.len()];
        let rest = Rest { ports, mode: Mode::Instantiated, start_s: 0.0, now_ns: 0 };
        let (token, resources) = (crate::xml::token(&config, resources), resources.to_owned());
        let journal = Journal::new(unit);
        Ok(Self { config, resources, token, journal, variables, terminals, has_event_mode, rest })
    }

    /// Its mode.
    pub const fn mode(&self) -> Mode {
        self.rest.mode
    }

    /// Its variables, but for those of its terminals and time.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Back to how it was made.
    ///
    /// # Errors
    /// That a file of the resources has gone.
    pub fn reset(&mut self) -> Called<()> {
        *self = self.anew()?;
        Ok(())
    }

    /// One like this before anything was done to it.
    ///
    /// # Errors
    /// As of [`reset`](Self::reset).
    pub(crate) fn anew(&self) -> Called<Self> {
        let anew = Self::of(self.config.clone(), &self.resources, self.has_event_mode);
        anew.map_err(|error| CallError(error.to_string()))
    }

    /// One that goes on as this one.
    ///
    /// # Errors
    /// Of a drive with its master: more was done to it than is kept.
    pub fn copy(&self) -> Called<Self> {
        Ok(Self {
            config: self.config.clone(),
            resources: self.resources.clone(),
            token: self.token.clone(),
            journal: self.journal.copy()?,
            variables: self.variables.clone(),
            terminals: self.terminals.clone(),
            has_event_mode: self.has_event_mode,
            rest: self.rest.clone(),
        })
    }

    /// Initialization begins at `start_s`.
    ///
    /// # Errors
    /// The wrong mode, a time that is not a number.
    pub fn enter_initialization(&mut self, start_s: f64) -> Called<()> {
        self.expect(&[Mode::Instantiated], "EnterInitializationMode")?;
        if !start_s.is_finite() {
            return refused(format!("the start time is {start_s}; expected a number of seconds"));
        }
        self.rest.start_s = start_s;
        self.rest.mode = Mode::Initialization;
        Ok(())
    }

    /// Initialization ends, and time begins.
    ///
    /// # Errors
    /// The wrong mode.
    pub fn exit_initialization(&mut self) -> Called<()> {
        self.expect(&[Mode::Initialization], "ExitInitializationMode")?;
        self.act(Action::Begin)?;
        self.rest.mode = if self.has_event_mode { Mode::Event } else { Mode::Step };
        self.tick_triggered()
    }

    /// Event mode begins.
    ///
    /// # Errors
    /// The wrong mode, or event mode was not asked for.
    pub fn enter_event(&mut self) -> Called<()> {
        self.expect(&[Mode::Step], "EnterEventMode")?;
        if !self.has_event_mode {
            return refused("event mode was not asked for: fmi3InstantiateCoSimulation had eventModeUsed = false");
        }
        self.rest.mode = Mode::Event;
        Ok(())
    }

    /// Event mode ends.
    ///
    /// # Errors
    /// The wrong mode.
    pub fn enter_step(&mut self) -> Called<()> {
        self.expect(&[Mode::Event], "EnterStepMode")?;
        self.hand_over()?;
        self.rest.mode = Mode::Step;
        Ok(())
    }

    /// The simulation is over.
    ///
    /// # Errors
    /// The wrong mode.
    pub fn terminate(&mut self) -> Called<()> {
        self.expect(&[Mode::Event, Mode::Step], "Terminate")?;
        self.rest.mode = Mode::Terminated;
        Ok(())
    }

    /// One round of an event: takes in what was set, does what is due. True if clocks have ticked anew.
    ///
    /// # Errors
    /// The wrong mode.
    pub fn update(&mut self) -> Called<bool> {
        self.expect(&[Mode::Event], "UpdateDiscreteStates")?;
        self.clear_ticks();
        self.hand_over()?;
        self.act(Action::Serve)?;
        self.tick_triggered()?;
        Ok(self.rest.ports.iter().any(|port| port.ticked))
    }

    /// Time passes from `from_s` by `step_s`.
    ///
    /// # Errors
    /// The wrong mode, a step that does not begin where time stands, or is not forward; where the importer moves the joint, one that it
    /// cannot have moved so. Nothing is changed then.
    pub fn step(&mut self, from_s: f64, step_s: f64) -> Called<Stepped> {
        self.expect(&[Mode::Step], "DoStep")?;
        let to_s = from_s + step_s;
        // By the standard a step takes time; importers make one of none where a countdown ends at once.
        if !(step_s >= 0.0 && to_s.is_finite() && to_s - self.rest.start_s < LATEST_S) {
            return refused(format!("a step of {step_s} s is not possible; expected a time of 0 or more"));
        }
        let (from_ns, to_ns) = (self.nanos(from_s), self.nanos(to_s).max(self.rest.now_ns));
        // A sum of many steps is a nanosecond beside their number of times one.
        if from_s < self.rest.start_s - 1.0 / NANOS || from_ns.abs_diff(self.rest.now_ns) > 1 {
            let now_s = self.rest.start_s + self.rest.now_ns as f64 / NANOS;
            return refused(format!(
                "the step begins at {from_s} s, but time stands at {now_s} s; it does not go back"
            ));
        }
        // Before anything is done of it: a step that is refused is not one by half.
        self.journal.unit.check_step(Instant::from_nanos(to_ns)).map_err(CallError)?;
        self.clear_ticks();
        self.hand_over()?;
        self.act(Action::Serve)?;
        self.act(Action::Advance(to_ns))?;
        self.rest.now_ns = to_ns;
        // Without a countdown no call comes at this instant before the next step: what is due is sent now.
        if self.config.clock() == TxClock::Triggered || !self.has_event_mode {
            self.act(Action::Serve)?;
        }
        self.tick_triggered()?;
        Ok(Stepped { needs_event: self.needs_event(), time_s: to_s })
    }

    /// Whether a clock has ticked or is due, where there are events at all.
    fn needs_event(&self) -> bool {
        self.has_event_mode
            && match self.config.clock() {
                TxClock::Triggered => self.rest.ports.iter().any(|port| port.ticked),
                TxClock::Countdown => {
                    self.journal.unit.next_event().is_some_and(|at| at.as_nanos() <= self.rest.now_ns)
                }
            }
    }

    /// The value of a variable.
    ///
    /// # Errors
    /// No variable has this reference.
    pub fn get(&mut self, reference: Reference) -> Called<Value> {
        if reference == crate::xml::TIME {
            return Ok(Value::Float64(self.rest.start_s + self.rest.now_ns as f64 / NANOS));
        }
        if let Some((_, port, is_rx)) = self.data(reference) {
            return Ok(Value::Binary(if is_rx {
                port.received.clone().unwrap_or_default()
            } else {
                port.visible.clone()
            }));
        }
        self.journal.look();
        self.journal.unit.get(reference).ok_or_else(|| unknown(reference))
    }

    /// What a network sends, to be looked at without a copy; `None` for another variable.
    pub(crate) fn sent(&self, reference: Reference) -> Option<&[u8]> {
        self.data(reference).map(|(_, port, is_rx)| match is_rx {
            true => port.received.as_deref().unwrap_or_default(),
            false => &port.visible,
        })
    }

    /// Whether [`set`](Self::set) would take a value; nothing changes.
    ///
    /// # Errors
    /// As there.
    pub fn check(&self, reference: Reference, value: &Value) -> Called<()> {
        self.may_set(reference, value)?;
        self.journal.unit.check(reference, value).map_err(|error| self.named(reference, error))
    }

    /// Writes a variable.
    ///
    /// # Errors
    /// No variable has this reference, it has another type, it cannot be set now, or the drive refuses the value.
    pub fn set(&mut self, reference: Reference, value: Value) -> Called<()> {
        self.may_set(reference, &value)?;
        if let Some((place, ..)) = self.data(reference) {
            if let Value::Binary(bytes) = value {
                self.rest.ports[place].received = Some(bytes);
            }
            return Ok(());
        }
        // What changes nothing is not written down, so that a state does not grow with each call.
        if self.journal.unit.get(reference).as_ref() == Some(&value) {
            return Ok(());
        }
        let done = self.journal.act(Action::Set(reference, value));
        done.map(drop).map_err(|error| self.named(reference, error))
    }

    /// The variable, if it may be set to such a value now; `None` for what comes in from a network.
    fn may_set(&self, reference: Reference, value: &Value) -> Called<Option<&Variable>> {
        if let Some((_, _, is_rx)) = self.data(reference) {
            return match (value, is_rx) {
                (Value::Binary(_), true) if self.rest.mode == Mode::Terminated => {
                    refused(format!("variable {reference} cannot be set: the simulation is over"))
                }
                (Value::Binary(_), true) => Ok(None),
                (Value::Binary(_), false) => refused(format!("variable {reference} is an output")),
                _ => refused(format!("variable {reference} is a binary")),
            };
        }
        let variable = self.variable(reference).ok_or_else(|| unknown(reference))?;
        let name = &variable.name;
        if value.type_name() != variable.value.type_name() {
            let [wanted, given] = [&variable.value, value].map(|value| self.type_name(value));
            return refused(format!("{name} is a {wanted}, not a {given}"));
        }
        let before = matches!(self.rest.mode, Mode::Instantiated | Mode::Initialization);
        match variable.causality {
            Causality::Output => return refused(format!("{name} is an output")),
            Causality::Parameter if !before => {
                return refused(format!("{name} is a parameter; it is set before initialization ends"));
            }
            _ => {}
        }
        if let Value::Float64(number) = value
            && !number.is_finite()
        {
            return refused(format!("{name} cannot be {number}"));
        }
        if self.rest.mode == Mode::Terminated {
            return refused(format!("{name} cannot be set: the simulation is over"));
        }
        Ok(Some(variable))
    }

    /// Why a unit does not take a value, with the name of the variable.
    fn named(&self, reference: Reference, error: String) -> CallError {
        CallError(match self.variable(reference) {
            Some(variable) => format!("{}: {error}", variable.name),
            None => error,
        })
    }

    fn variable(&self, reference: Reference) -> Option<&Variable> {
        self.variables.iter().find(|variable| variable.reference == reference)
    }

    /// Whether a clock has ticked.
    ///
    /// # Errors
    /// It is not a clock.
    pub fn clock(&self, reference: Reference) -> Called<bool> {
        let tx = self.terminals.iter().position(|terminal| terminal.tx_clock == reference);
        let rx = self.terminals.iter().position(|terminal| terminal.rx_clock == reference);
        match (tx, rx) {
            (Some(place), _) => Ok(self.rest.ports[place].ticked),
            (None, Some(place)) => Ok(self.rest.ports[place].received.is_some()),
            (None, None) => refused(format!("variable {reference} is not a clock")),
        }
    }

    /// The importer has a clock tick.
    ///
    /// # Errors
    /// It is not a clock, or not one that the importer decides.
    pub fn set_clock(&mut self, reference: Reference, ticks: bool) -> Called<()> {
        match self.may_tick(reference)? {
            Some(place) if ticks => self.tick(place),
            // What is received says by itself when it came.
            _ => Ok(()),
        }
    }

    /// The network whose clock the importer may have tick; `None` for a clock of what it receives.
    ///
    /// # Errors
    /// As of [`set_clock`](Self::set_clock).
    pub(crate) fn may_tick(&self, reference: Reference) -> Called<Option<usize>> {
        self.expect(&[Mode::Event, Mode::Initialization], "SetClock")?;
        self.clock(reference)?;
        let place = self.terminals.iter().position(|terminal| terminal.tx_clock == reference);
        if place.is_some() && self.config.clock() == TxClock::Triggered {
            return refused(format!("clock {reference} is an output: it ticks by itself"));
        }
        Ok(place)
    }

    /// When the countdown of a clock ends.
    ///
    /// # Errors
    /// It is not a countdown.
    pub fn interval(&self, reference: Reference) -> Called<Interval> {
        let place = self.terminals.iter().position(|terminal| terminal.tx_clock == reference);
        if place.is_none() || self.config.clock() != TxClock::Countdown {
            return refused(format!("clock {reference} has no interval: it is not a countdown"));
        }
        // Always what is left of it: importers that forget a countdown with each event need it, and others lose nothing.
        let next = self.journal.unit.next_event().map(|at| at.as_nanos());
        Ok(next.map_or(Interval::NotKnown, |at| Interval::In(at.saturating_sub(self.rest.now_ns))))
    }

    pub(crate) fn rest(&self) -> Rest {
        self.rest.clone()
    }

    /// Does once more what was done to another instance, to one to which nothing was done, and takes the rest of its state. All of
    /// it is looked at before the first is done.
    ///
    /// # Errors
    /// What cannot have been done to it, or does not belong to what was.
    pub(crate) fn replay(&mut self, actions: Vec<Action>, rest: Rest) -> Called<()> {
        let now_ns = self.follow(&actions)?;
        let has_begun = self.rest.mode == Mode::Step;
        if has_begun == matches!(rest.mode, Mode::Instantiated | Mode::Initialization) {
            let not = if has_begun { "" } else { "not " };
            return refused(format!("it is in the mode {:?}, and its time has {not}begun", rest.mode));
        }
        if rest.now_ns != now_ns {
            return refused(format!("it stands at {} ns; what was done ends at {now_ns} ns", rest.now_ns));
        }
        if rest.ports.len() != self.terminals.len() || !rest.start_s.is_finite() {
            return refused("its networks or its start time are not possible");
        }
        self.journal.replay(actions).map_err(|(action, error)| match action {
            Action::Set(reference, _) => self.named(reference, error),
            _ => CallError(error),
        })?;
        self.rest = rest;
        Ok(())
    }

    /// Whether these actions can have been done to an instance, one after the other; the time at which they end, in ns.
    fn follow(&mut self, actions: &[Action]) -> Called<u64> {
        let mut now_ns = 0;
        for action in actions {
            let has_begun = self.rest.mode == Mode::Step;
            match action {
                Action::Set(reference, value) => {
                    if self.may_set(*reference, value)?.is_none() {
                        return refused(format!("variable {reference} is not set by itself"));
                    }
                }
                Action::Begin if has_begun => return refused("its time begins twice"),
                Action::Begin => self.rest.mode = Mode::Step,
                Action::Receive(..) | Action::Serve | Action::Advance(_) if !has_begun => {
                    return refused("time passes before it begins");
                }
                Action::Advance(to_ns) if !(now_ns..LATEST_NS).contains(to_ns) => {
                    return refused(format!("its time goes from {now_ns} ns to {to_ns} ns"));
                }
                Action::Advance(to_ns) => now_ns = *to_ns,
                Action::Receive(..) | Action::Serve | Action::Look | Action::Take(_) => {}
            }
        }
        Ok(now_ns)
    }

    const fn is_of_fmi2(&self) -> bool {
        matches!(self.config, Config::Axis(_))
    }

    /// The type of a value in the instance's version of FMI.
    const fn type_name(&self, value: &Value) -> &'static str {
        if self.is_of_fmi2() { VariableKind::of(value).element() } else { value.type_name() }
    }

    fn expect(&self, modes: &[Mode], call: &str) -> Called<()> {
        if modes.contains(&self.rest.mode) {
            return Ok(());
        }
        let version = if self.is_of_fmi2() { 2 } else { 3 };
        refused(format!("fmi{version}{call} in the mode {:?}; expected {modes:?}", self.rest.mode))
    }

    /// Nanoseconds since the begin, to the nearest.
    fn nanos(&self, time_s: f64) -> u64 {
        ((time_s - self.rest.start_s) * NANOS).round() as u64
    }

    /// The binary variable of a network: which network, and whether it is what comes in.
    fn data(&self, reference: Reference) -> Option<(usize, &Port, bool)> {
        let is_it = |terminal: &Terminal| terminal.rx_data == reference || terminal.tx_data == reference;
        let place = self.terminals.iter().position(is_it)?;
        Some((place, &self.rest.ports[place], self.terminals[place].rx_data == reference))
    }

    /// Does an action and writes it down.
    fn act(&mut self, action: Action) -> Called<Vec<u8>> {
        self.journal.act(action).map_err(CallError)
    }

    /// Hands on what was set.
    fn hand_over(&mut self) -> Called<()> {
        for place in 0..self.rest.ports.len() {
            if let Some(bytes) = self.rest.ports[place].received.take().filter(|bytes| !bytes.is_empty()) {
                self.act(Action::Receive(place, bytes))?;
            }
        }
        Ok(())
    }

    fn clear_ticks(&mut self) {
        for port in &mut self.rest.ports {
            port.visible.clear();
            port.ticked = false;
        }
    }

    fn tick(&mut self, place: usize) -> Called<()> {
        let sent = self.act(Action::Take(place))?;
        let port = &mut self.rest.ports[place];
        port.ticked = true;
        port.visible.extend(sent);
        Ok(())
    }

    /// Clocks that tick by themselves tick where there is something to send.
    fn tick_triggered(&mut self) -> Called<()> {
        if self.config.clock() == TxClock::Countdown && self.has_event_mode {
            return Ok(());
        }
        for place in 0..self.rest.ports.len() {
            let sent = self.act(Action::Take(place))?;
            if !sent.is_empty() {
                let port = &mut self.rest.ports[place];
                port.ticked = true;
                port.visible.extend(sent);
            }
        }
        Ok(())
    }
}

fn unknown(reference: Reference) -> CallError {
    CallError(format!("variable {reference} does not exist"))
}

//! A virtual world whose bus is served to other programs: its wire's frames go to clients, theirs go onto its wire.
//!
//! All clients share one CAN adapter of the virtual bus. It is given one frame at a time, each client's in turn, so that
//! who sends much waits and who sends little does not. As an adapter with one shared_outbox does it takes the next frame when the
//! one before is out, which is too late for the arbitration that follows: a station that waits has its turn then, whatever
//! the identifiers are.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use can::{Bitrate, Frame, INTERFRAME_SPACE_BITS, Instant};
use host::control::{ClientNumber, Control, Outcome, Pending};
use scenario::Execution;
use scenario::occurrence::Occurrence;
use sim::command::{Answer, Before, Command, CommandError, Run, Service};
use sim::events::{Event, EventKind, MAX_WAITING};
use sim::recorder::Recorder;
use sim::wire::{ErrorCause, WireEvent};
use sim::{StationId, World};
use transport::{ClientId, ErrorFrame, ErrorKind, ErrorKinds, Heard, LeaveReason, ModbusRequest, RealTimeWorld};

use super::control::{ControlMessage, OutboxSender};
use super::eeprom::EepromError;
use super::kept::Kept;
use super::lag::{Lag, LagNews};
use super::messages::Messages;
use super::pacer::Pacer;
use super::registers;
use super::round_robin::RoundRobin;
use super::store_writer::StoreWriter;
use super::stores::Stores;

/// See the [module](self).
pub struct ServedWorld {
    world: World,
    adapter: StationId,
    round_robin: RoundRobin<ClientId>,
    /// Whose frame the adapter has, and how many it had sent before.
    offered: Option<(ClientId, Frame, u64)>,
    /// When the adapter takes another.
    free_at: Instant,
    heard: VecDeque<Heard>,
    /// What a log or a record has not been given yet.
    kept: Option<Kept>,
    stores: Option<Stores>,
    control: Control<OutboxSender>,
    /// The scenario that the world goes through, if it does, and its end.
    execution: Option<FollowedExecution>,
    /// Events that the execution has seen and the record has not.
    events: Vec<Event>,
    /// Who is behind the lines of standard input, to those who hear of stimuli.
    own_name: Arc<str>,
    pacer: Pacer,
    /// What the clock showed last.
    clock: Instant,
    /// The run that is under way where time is moved by hand.
    run: Option<UnderWay>,
    /// Reports that a run is over; false if that was not taken, and has to be repeated.
    run_is_over: Box<dyn Fn() -> bool>,
    lag: Lag,
    frames_lost: u64,
    displaced: u64,
    messages: Messages,
}

/// A requested run.
struct UnderWay {
    before: Before,
    end: Instant,
    reported: bool,
    /// Whose it is, if a client of the control connection asked.
    client: Option<Pending>,
}

/// A scenario under way.
struct FollowedExecution {
    execution: Execution,
    /// Reports that it is over; false if that was not taken, and has to be repeated.
    is_over: Box<dyn Fn() -> bool>,
    reported: bool,
}

/// The result of a world command.
pub enum Commanded {
    /// Nothing is answered: a blank line or a comment.
    Nothing,
    /// It is done.
    Done(Answer),
    /// It has begun; [`ServedWorld::take_run`] has the answer when it is done.
    Begun,
}

impl ServedWorld {
    /// Adds the adapter to `world`, whose time passes as `pacer` says. `logged` keeps carried frames for [`Self::take_carried`]; what is to be said of the
    /// service goes to `messages`.
    pub fn new(mut world: World, pacer: Pacer, logged: bool, messages: Messages) -> Self {
        let adapter = world.add_probe();
        let mut control = Control::new(None);
        if world.is_watched() {
            control.keep_events();
        }
        Self {
            world,
            adapter,
            round_robin: RoundRobin::new(),
            offered: None,
            free_at: Instant::ZERO,
            heard: VecDeque::new(),
            kept: logged.then(Kept::new),
            stores: None,
            control,
            execution: None,
            events: Vec::new(),
            own_name: "standard input".into(),
            pacer,
            clock: Instant::ZERO,
            run: None,
            run_is_over: Box::new(|| true),
            lag: Lag::default(),
            frames_lost: 0,
            displaced: 0,
            messages,
        }
    }

    /// Goes through a scenario with the clients as its host; calls `is_over` at its end, until that returns true. Time then stands.
    pub fn follow(&mut self, mut execution: Execution, is_over: impl Fn() -> bool + 'static) {
        execution.is_served_by(self.adapter, &mut self.world);
        if self.world.is_watched() {
            self.control.keep_events();
        }
        execution.go_on(&mut self.world);
        self.execution = Some(FollowedExecution { execution, is_over: Box::new(is_over), reported: false });
    }

    /// The world and its scenario, as they stand.
    pub fn into_course(self) -> (World, Option<Execution>) {
        (self.world, self.execution.map(|followed| followed.execution))
    }

    /// From now on what drives store is kept, and acknowledged when it is.
    pub fn keep_stores(&mut self, store_writer: StoreWriter) {
        self.stores = Some(Stores::guard(&mut self.world, store_writer, self.messages.clone()));
    }

    /// Clients of the control connection have to give this token from now on.
    pub fn ask_for_token(&mut self, token: String) {
        self.control.ask_for(token);
    }

    /// A client of the control connection comes, speaks or goes.
    pub fn serve_control(&mut self, message: ControlMessage) {
        match message {
            ControlMessage::Joined(number, shared_outbox) => self.control.join(number, OutboxSender(shared_outbox)),
            ControlMessage::Left(number) => self.see_off(number),
            ControlMessage::Line(number, line) => {
                let service = self.service();
                match self.control.handle(number, &line, &mut self.world, service) {
                    Outcome::Answered => {}
                    // The answer to it is still sent.
                    Outcome::Close => self.see_off(number),
                    Outcome::Run(pending) => self.begin_for_client(pending),
                }
            }
        }
    }

    /// A client of the control connection is gone, and with it the run that it has asked for: no client waits for that.
    fn see_off(&mut self, number: ClientNumber) {
        drop(self.control.leave(number, &mut self.world));
        if self.run.as_ref().and_then(|run| run.client.as_ref()).is_some_and(|pending| pending.client == number) {
            self.end_run("its client has left");
        }
    }

    /// The bus's rate.
    pub fn bitrate(&self) -> Bitrate {
        self.world.bitrate()
    }

    /// Does what a world command says.
    pub fn command(&mut self, line: &str) -> Commanded {
        if let Ok(Command::Run(run)) = line.parse() {
            return match self.begin(run) {
                Ok(()) => Commanded::Begun,
                Err(refusal) => Commanded::Done(Answer { json: sim::command::refused(&refusal), quit: false }),
            };
        }
        let service = self.service();
        self.world.act_as(Some(self.own_name.clone()));
        let answer = sim::command::answer_served(&mut self.world, line, service);
        self.world.act_as(None);
        self.control.publish(&mut self.world);
        answer.map_or(Commanded::Nothing, Commanded::Done)
    }

    fn service(&self) -> Service {
        Service { behind: self.lag.now(), frames_lost: self.frames_lost }
    }

    /// Time begins to move, where that is done by hand.
    fn begin(&mut self, run: Run) -> Result<(), CommandError> {
        match &self.run {
            _ if !self.pacer.is_manual() => Err(CommandError::NotManual),
            Some(run) => Err(CommandError::Running { until_s: run.end.as_nanos() as f64 / 1e9 }),
            None => {
                let end = run.end(self.world.now());
                self.run = Some(UnderWay { before: Before::of(&mut self.world), end, reported: false, client: None });
                self.pacer.run_to(end);
                Ok(())
            }
        }
    }

    /// The same for a client of the control connection, who is answered when it is over.
    fn begin_for_client(&mut self, pending: Pending) {
        match self.begin(pending.run) {
            Ok(()) => {
                if let Some(run) = &mut self.run {
                    run.client = Some(pending);
                }
            }
            Err(refusal) => self.control.answer_run(&pending, Err(refusal.into())),
        }
    }

    /// Calls `run_is_over` when there is something for [`take_run`](Self::take_run), until it returns true.
    pub fn on_run_over(&mut self, run_is_over: impl Fn() -> bool + 'static) {
        self.run_is_over = Box::new(run_is_over);
    }

    /// Calls `is_full` when what is kept has to be [taken](Self::take_carried) before time goes on, until it returns true.
    pub fn on_full_piece(&mut self, is_full: impl Fn() -> bool + 'static) {
        if let Some(kept) = &mut self.kept {
            kept.on_full(is_full);
        }
    }

    /// True while a run is under way.
    pub fn is_running(&self) -> bool {
        self.run.is_some()
    }

    /// Ends the run that is under way where it stands, if there is one; the answer, unless it goes to a client of the control connection.
    pub fn end_run(&mut self, why: &'static str) -> Option<String> {
        let run = self.run.take()?;
        let now = self.world.now();
        self.pacer.run_to(now);
        let ended = CommandError::Ended { at_s: now.as_nanos() as f64 / 1e9, why };
        match run.client {
            None => Some(sim::command::refused(&ended)),
            Some(pending) => {
                self.control.answer_run(&pending, Err(ended.into()));
                None
            }
        }
    }

    /// Ends a run that has come to its end; the answer, unless it goes to a client of the control connection.
    pub fn take_run(&mut self) -> Option<String> {
        let run = self.run.take_if(|run| run.end <= self.world.now())?;
        let answer = run.before.answer(&mut self.world);
        match run.client {
            None => Some(answer),
            Some(pending) => {
                self.control.answer_run(&pending, Ok(&answer));
                None
            }
        }
    }

    /// Has a Modbus request answered.
    pub fn serve_registers(&mut self, request: ModbusRequest) {
        match &mut self.stores {
            Some(stores) => stores.answer(&mut self.world, request, self.clock),
            None => {
                let (answer, _) = registers::answer(&mut self.world, &request);
                request.answer(answer);
            }
        }
    }

    /// What was recorded since the last call, if anything is.
    pub fn take_recorded(&mut self) -> Option<Recorder> {
        self.world.take_recorded()
    }

    /// What happened since the last call, if the world is watched.
    pub fn take_events(&mut self) -> Vec<Event> {
        let mut events = std::mem::take(&mut self.events);
        events.append(&mut self.control.take_events(&mut self.world));
        events
    }

    /// Frames carried since the last call.
    pub fn take_carried(&mut self) -> Vec<(Instant, Frame)> {
        let now = self.world.now();
        self.kept.as_mut().map(|kept| kept.take(now)).unwrap_or_default()
    }

    /// Finds stores that no frame goes with: a joint notes its position when its supply falls.
    pub fn look_for_stores(&mut self) {
        let Some(stores) = &mut self.stores else { return };
        let numbers: Vec<u8> = self.world.drive_numbers().collect();
        for number in numbers {
            // Only an unknown number is an error.
            let _ = self.world.with_drive(number, |drive, now| drive.advance(now));
        }
        stores.settle(&mut self.world, self.clock);
    }

    /// Returns when all stores are on the disk, at most after `patience`; `None` if nothing is known by then. Stores of
    /// later are not kept.
    pub fn finish_stores(&mut self, patience: Duration) -> Option<Result<(), EepromError>> {
        self.look_for_stores();
        match self.stores.take() {
            Some(stores) => stores.finish(&mut self.world, patience),
            None => Some(Ok(())),
        }
    }

    /// Sorts out what the wire did, and gives the adapter its next frame.
    fn collect(&mut self) {
        while let Some(event) = self.world.log_mut().pull() {
            if let Some(FollowedExecution { execution, .. }) = &mut self.execution {
                execution.hear(&mut self.world, Occurrence::Wire(&event));
            }
            // What a node behind a cut cable tries does not reach the wire of the others.
            if let WireEvent::Error { at, source, cause, .. } = event
                && self.hears()
                && (source == self.adapter.index() || !self.world.is_source_cut(source))
            {
                self.heard.push_back(Heard::Error { error: error_frame(cause), at });
            }
            let WireEvent::Frame { end, source, frame, .. } = event else { continue };
            // A drive may have sent the very same frame with it, and is the sender then.
            let sent = self.world.frames_sent(self.adapter);
            let is_offered = |offered: &mut (_, Frame, u64)| offered.1 == frame && sent > offered.2;
            let from = self.offered.take_if(is_offered).map(|(client, ..)| client);
            if from.is_some() || source == self.adapter.index() {
                self.free_at = end.plus_nanos(u64::from(INTERFRAME_SPACE_BITS) * self.world.bitrate().bit_nanos());
            }
            if from.is_some() || self.hears() {
                self.heard.push_back(Heard::Carried { frame, at: end, from });
            }
            self.kept.iter_mut().for_each(|kept| kept.push(end, frame));
        }
        // What the adapter heard is in the log too.
        while self.world.poll_received(self.adapter).is_some() {}
        self.follow_course();
    }

    /// Hands the events of the world to the scenario, and has it do what it can do now.
    fn follow_course(&mut self) {
        let Some(FollowedExecution { execution, .. }) = &mut self.execution else { return };
        if self.world.is_watched() {
            for event in self.control.take_events(&mut self.world) {
                execution.hear(&mut self.world, Occurrence::Event(&event));
                if self.kept.is_some() && self.events.len() < MAX_WAITING {
                    self.events.push(event);
                }
            }
        }
        execution.go_on(&mut self.world);
    }

    /// The scenario is at its end.
    fn is_over(&self) -> bool {
        self.execution.as_ref().is_some_and(|followed| followed.execution.is_over())
    }

    /// When the scenario wants to look at values.
    fn next_look(&self) -> Option<Instant> {
        self.execution.as_ref()?.execution.next_time(self.world.now())
    }

    /// Has the scenario look at values, and act on them.
    fn look(&mut self) {
        if let Some(FollowedExecution { execution, .. }) = &mut self.execution {
            execution.look(&mut self.world);
            self.collect();
        }
    }

    /// The adapter is on the bus: no scenario has cut its cable, or had its host die.
    fn hears(&self) -> bool {
        !self.world.is_cut(self.adapter) && !self.world.is_gone(self.adapter)
    }

    /// Time stands because an answer waits for the disk: where it follows no clock, a disk that is slow is not to show in it, and a
    /// run by hand does the same on each machine. Where it follows the clock, it passes.
    fn stands_for_a_store(&self) -> bool {
        let waits = self.stores.as_ref().is_some_and(|stores| stores.is_waiting(&self.world));
        waits && !self.pacer.follows_the_clock()
    }

    /// Moves the world to `instant`; false if it stopped before: the adapter has become free and a client waits for it, or an answer
    /// waits for the disk.
    fn run_to(&mut self, instant: Instant) -> bool {
        while !self.is_over() && self.world.next_event().is_some_and(|at| at <= instant) {
            let was_busy = self.offered.is_some();
            self.world.step();
            self.collect();
            if self.stands_for_a_store() {
                return false;
            }
            if was_busy && self.next_offer().is_some() {
                return false;
            }
        }
        if !self.is_over() {
            self.world.run_until(instant);
        }
        true
    }

    /// Moves the world to `instant`, with the frames of clients on the way.
    fn move_to(&mut self, instant: Instant) {
        loop {
            let offer = self.next_offer().filter(|at| *at <= instant);
            let reached = self.run_to(offer.unwrap_or(instant));
            if self.stands_for_a_store() {
                break;
            }
            match offer {
                Some(_) => self.offer_next(),
                None if reached => break,
                None => {}
            }
        }
    }

    /// When the adapter takes the frame that waits for it.
    fn next_offer(&self) -> Option<Instant> {
        let waits = self.offered.is_none() && !self.round_robin.is_empty();
        waits.then(|| self.free_at.max(self.world.now()))
    }

    /// Gives the adapter the next frame, if it takes one now.
    fn offer_next(&mut self) {
        if self.world.is_gone(self.adapter)
            && let Some((from, ..)) = self.offered.take()
        {
            self.heard.push_back(Heard::Lost { from });
        }
        while self.offered.is_none() && self.free_at <= self.world.now() {
            let Some((client, frame)) = self.round_robin.pop() else { return };
            let sent = self.world.frames_sent(self.adapter);
            match self.world.send(self.adapter, frame) {
                Ok(()) => self.offered = Some((client, frame, sent)),
                Err(_) => self.heard.push_back(Heard::Lost { from: client }),
            }
        }
    }

    fn give_up(&mut self, frames: usize) {
        if frames > 0 && self.frames_lost == 0 {
            self.messages.say(
                "warning: clients that are gone have left more frames behind than the bus can carry; those are given up \
                 and counted in the answer to `now`",
            );
        }
        self.frames_lost += frames as u64;
    }
}

/// What a controller would report of an error that all stations see: its kind, where the cause has one.
fn error_frame(cause: ErrorCause) -> ErrorFrame {
    let kinds = match cause {
        ErrorCause::NotAcknowledged => ErrorKinds::NONE.with(ErrorKind::Acknowledge),
        ErrorCause::Collision => ErrorKinds::NONE.with(ErrorKind::Bit),
        ErrorCause::BitRate | ErrorCause::Abandoned => ErrorKinds::NONE.with(ErrorKind::Stuff),
        ErrorCause::Disturbed => ErrorKinds::NONE.with(ErrorKind::Crc),
    };
    ErrorFrame { kinds, ..ErrorFrame::default() }
}

impl RealTimeWorld for ServedWorld {
    fn now(&self) -> Instant {
        self.world.now()
    }

    fn target(&mut self, clock: Instant) -> Instant {
        self.clock = clock;
        let target = self.pacer.target(clock, self.world.now());
        if self.stands_for_a_store() { self.world.now() } else { target }
    }

    fn clock_at(&self, at: Instant) -> Option<Instant> {
        // What is waited for says when it is there.
        if self.stands_for_a_store() { None } else { self.pacer.clock_at(at) }
    }

    fn wakes_at(&self) -> Option<Instant> {
        self.stores.as_ref().and_then(Stores::wakes_at)
    }

    fn next_deadline(&self) -> Option<Instant> {
        let sample = self.control.next_sample();
        [self.world.next_event(), self.next_offer(), self.next_look(), sample].into_iter().flatten().min()
    }

    fn advance_to(&mut self, instant: Instant) {
        let instant = instant.min(self.kept.as_ref().map_or(instant, Kept::full_at)).max(self.world.now());
        loop {
            let look = self.next_look();
            let stop = self.control.next_sample().into_iter().chain(look).min().filter(|at| *at <= instant);
            self.move_to(stop.unwrap_or(instant));
            if look.is_some_and(|at| at <= self.world.now()) {
                self.look();
            }
            self.control.publish(&mut self.world);
            if stop.is_none() || self.is_over() || self.stands_for_a_store() {
                break;
            }
        }
        if let Some(followed) = self.execution.as_mut().filter(|followed| followed.execution.is_over()) {
            // A run of longer ends with it: time goes no further.
            self.run.iter_mut().for_each(|run| run.end = run.end.min(self.world.now()));
            followed.reported = followed.reported || (followed.is_over)();
        }
        if let Some(stores) = &mut self.stores {
            stores.settle(&mut self.world, self.clock);
        }
        let reached = self.world.now();
        self.kept.iter_mut().for_each(|kept| kept.reached(reached));
        if let Some(run) = self.run.as_mut().filter(|run| !run.reported && run.end <= reached) {
            run.reported = (self.run_is_over)();
        }
    }

    fn inject(&mut self, client: ClientId, frame: &Frame) {
        self.round_robin.push(client, *frame);
        self.offer_next();
    }

    fn take_heard(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }

    fn joined(&mut self, _: ClientId) {
        self.pacer.joined();
    }

    fn left(&mut self, client: ClientId, reason: LeaveReason) {
        self.pacer.left();
        let given_up = self.round_robin.leave(client);
        self.give_up(given_up);
        if reason == LeaveReason::Displaced {
            if self.displaced == 0 {
                self.messages.say("warning: too many clients; those that are idle make room for new ones");
            }
            self.displaced += 1;
        }
    }

    fn set_lag(&mut self, lag: Duration) {
        let lag = if self.pacer.follows_the_clock() { lag } else { Duration::ZERO };
        if let Some(news) = self.lag.update(lag) {
            self.messages.say(&news.to_string());
            let kind = match news {
                LagNews::Behind(lag) => EventKind::Behind(lag),
                LagNews::CaughtUp { worst } => EventKind::CaughtUp { worst },
            };
            self.world.tell(None, kind);
            self.control.publish(&mut self.world);
        }
    }
}

//! The clients of one world: their requests, their subscriptions, and who may ask.

use std::collections::BTreeMap;
use std::sync::Arc;

use can::Instant;
use serde_json::{Value, json};
use sim::Place;
use sim::World;
use sim::command::{Command, CommandError, Run, Service};
use sim::events::MAX_WAITING;
use sim::stimulus::FORMS;

use super::answer::{ControlError, marked};
use super::id::Id;
use super::lines::{MAX_LINE_LENGTH, ReadLine};
use super::outbox::Class;
use super::request::{Message, REQUESTS, Request};
use super::subscription::{Subscription, Values};
use crate::events::{self, Event, EventKind, KINDS};

/// The version of this protocol. It grows by one when something that a client relies on changes; new fields, requests and
/// kinds of events may come without.
pub const PROTOCOL: u32 = 1;

/// Subscriptions of one client.
const MAX_SUBSCRIPTIONS: usize = 64;

/// Wrong tokens, or requests without one, before a client is sent away.
const MAX_STRANGER_REQUESTS: u32 = 3;

const NO_TOKEN: &str = "a token is asked for first";

/// Names a client of a [`Control`].
pub type ClientNumber = u64;

/// Where lines for a client go.
pub trait Sink {
    /// Takes a line without its end; never waits.
    fn put(&mut self, class: Class, line: String);

    /// The client has given the token, or need not: it stays. Before that it is a stranger, who may be sent away.
    fn admit(&mut self) {}
}

/// What a request still needs from the caller.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Nothing: it is answered.
    Answered,
    /// Move the world, then call [`Control::answer_run`].
    Run(Pending),
    /// The client is answered; close its connection.
    Close,
}

/// A request to move the world that is not answered yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Pending {
    /// The client that is answered when it is done.
    pub client: ClientNumber,
    /// How far the world is to be moved.
    pub run: Run,
    id: Option<Id>,
}

/// See the [module](super).
#[derive(Debug)]
pub struct Control<S> {
    clients: BTreeMap<ClientNumber, Client<S>>,
    token: Option<String>,
    kept: Option<QueuedEvents>,
}

/// Events for one who takes them as values.
#[derive(Debug, Default)]
struct QueuedEvents {
    events: Vec<Event>,
    missed: u64,
}

#[derive(Debug)]
struct Client<S> {
    name: Arc<str>,
    sink: S,
    /// It has given the token, or none is asked for.
    admitted: bool,
    /// Requests without the token.
    strange: u32,
    subscriptions: BTreeMap<u64, Subscription>,
    subscribed: u64,
}

impl<S: Sink> Control<S> {
    /// Without clients. With a `token` each client has to give it first.
    pub fn new(token: Option<String>) -> Self {
        Self { clients: BTreeMap::new(), token, kept: None }
    }

    /// Clients that come from now on have to give this token.
    pub fn ask_for(&mut self, token: String) {
        self.token = Some(token);
    }

    /// Keeps every event for [`take_events`](Self::take_events) too, in a world that is watched for another purpose,
    /// such as a record.
    pub fn keep_events(&mut self) {
        self.kept.get_or_insert_default();
    }

    /// The events since the last call, if they are kept; at most [`MAX_WAITING`], and then how many are missing.
    pub fn take_events(&mut self, world: &mut World) -> Vec<Event> {
        self.publish(world);
        let Some(QueuedEvents { mut events, missed }) = self.kept.as_mut().map(std::mem::take) else {
            return Vec::new();
        };
        if missed > 0 {
            events.push(Event { at: world.now(), place: None, kind: EventKind::Missed(missed) });
        }
        events
    }

    /// A client comes under a number of its own.
    pub fn join(&mut self, number: ClientNumber, sink: S) {
        let mut client = Client {
            name: format!("control client {number}").into(),
            sink,
            admitted: self.token.is_none(),
            strange: 0,
            subscriptions: BTreeMap::new(),
            subscribed: 0,
        };
        if client.admitted {
            client.sink.admit();
        }
        self.clients.insert(number, client);
    }

    /// A client is gone, and with it what it subscribed to; what waits for it may still be sent. Its sink is handed back.
    pub fn leave(&mut self, number: ClientNumber, world: &mut World) -> Option<S> {
        let client = self.clients.remove(&number)?;
        self.update_watch(world);
        Some(client.sink)
    }

    /// Serves a line of a client, and answers it but for [`Outcome::Run`]. A blank line and a comment have no answer.
    pub fn handle(&mut self, number: ClientNumber, line: &ReadLine, world: &mut World, service: Service) -> Outcome {
        let Some(client) = self.clients.get_mut(&number) else { return Outcome::Close };
        let ReadLine::Text(text) = line else {
            if !client.admitted {
                return client.refuse_stranger(None, NO_TOKEN);
            }
            let reason = format!("the line is longer than {MAX_LINE_LENGTH} bytes, and was discarded");
            client.refuse(None, &ControlError::new("too_long", reason).next("give each request a line of its own"));
            return Outcome::Answered;
        };
        if !sim::command::asks_for_an_answer(text) {
            return Outcome::Answered;
        }
        // A browser would go on with lines that a page chose.
        if text.contains(" HTTP/") {
            client.refuse(None, &ControlError::usage("this is not a web server: lines of JSON or world commands"));
            return Outcome::Close;
        }
        let Message { id, request } = match Message::parse(text) {
            Ok(message) => message,
            Err((id, _)) if !client.admitted => return client.refuse_stranger(id.as_ref(), NO_TOKEN),
            Err((id, error)) => {
                client.refuse(id.as_ref(), &error);
                return Outcome::Answered;
            }
        };
        if let Some(outcome) = client.check_token(id.as_ref(), &request, self.token.as_deref()) {
            return outcome;
        }
        if let Some(run) = request.run() {
            return Outcome::Run(Pending { client: number, run, id });
        }
        let answered = client.serve(request, world, service);
        match answered {
            Ok(answer) => client.sink.put(Class::Answer, marked(id.as_ref(), &answer)),
            Err(error) => client.refuse(id.as_ref(), &error),
        }
        self.update_watch(world);
        self.publish(world);
        Outcome::Answered
    }

    /// Answers a request to move the world, with the outcome as [`sim::command::Before`] gives it.
    pub fn answer_run(&mut self, pending: &Pending, done: Result<&str, ControlError>) {
        let Some(client) = self.clients.get_mut(&pending.client) else { return };
        match done {
            Ok(answer) => client.sink.put(Class::Answer, marked(pending.id.as_ref(), answer)),
            Err(error) => client.refuse(pending.id.as_ref(), &error),
        }
    }

    /// When the next values are due: the world goes no further before [`publish`](Self::publish).
    pub fn next_sample(&self) -> Option<Instant> {
        let due = |client: &Client<S>| client.subscriptions.values().filter_map(Subscription::next_due).min();
        self.clients.values().filter_map(due).min()
    }

    /// Sends what has happened, and the values that are due, to those who have subscribed to them.
    pub fn publish(&mut self, world: &mut World) {
        while let Some(event) = world.poll_event() {
            let mut text = None;
            for client in self.clients.values_mut() {
                for (number, subscription) in &client.subscriptions {
                    let Subscription::Events(filter) = subscription else { continue };
                    if filter.takes(&event) {
                        let value = text.get_or_insert_with(|| events::json(&event));
                        client.sink.put(Class::Event, line(*number, "event", value));
                    }
                }
            }
            match &mut self.kept {
                Some(kept) if kept.events.len() < MAX_WAITING => kept.events.push(event),
                Some(kept) => kept.missed += 1,
                None => {}
            }
        }
        let now = world.now();
        if self.next_sample().is_none_or(|due| due > now) {
            return;
        }
        for client in self.clients.values_mut() {
            for (number, subscription) in &mut client.subscriptions {
                let Subscription::Values { values, next } = subscription else { continue };
                if *next <= now {
                    *next = next_after(*next, values.every_ns(), now);
                    let sample = json!({ "t": seconds(now), "t_ns": now.as_nanos(), "values": values.sample(world) });
                    client.sink.put(Class::Values, line(*number, "sample", &sample));
                }
            }
        }
    }

    /// How many clients there are.
    pub fn len(&self) -> usize {
        self.clients.len()
    }

    /// Without clients.
    pub fn is_empty(&self) -> bool {
        self.clients.is_empty()
    }

    /// The world is watched while a client wants its events.
    fn update_watch(&self, world: &mut World) {
        let mut all = self.clients.values().flat_map(|client| client.subscriptions.values());
        let is_wanted = all.any(|subscription| matches!(subscription, Subscription::Events(_)));
        world.watch(is_wanted || self.kept.is_some());
    }
}

impl<S: Sink> Client<S> {
    fn refuse(&mut self, id: Option<&Id>, error: &ControlError) {
        self.sink.put(Class::Answer, error.answer(id));
    }

    /// What a client gets that has not given the token; `None` for one that has, or does so now.
    fn check_token(&mut self, id: Option<&Id>, request: &Request, token: Option<&str>) -> Option<Outcome> {
        let given = match request {
            Request::Hello { token, .. } => token.as_deref(),
            _ => None,
        };
        if let (Some(token), Some(given)) = (token, given) {
            self.admitted = equal(token.as_bytes(), given.as_bytes());
        }
        if self.admitted {
            self.sink.admit();
            return None;
        }
        Some(self.refuse_stranger(id, if given.is_some() { "wrong token" } else { NO_TOKEN }))
    }

    /// A client without the token learns nothing but that, and how to give it.
    fn refuse_stranger(&mut self, id: Option<&Id>, reason: &str) -> Outcome {
        self.refuse(id, &ControlError::new("token", reason).next(REQUESTS[0]));
        self.strange += 1;
        if self.strange >= MAX_STRANGER_REQUESTS { Outcome::Close } else { Outcome::Answered }
    }

    fn serve(&mut self, request: Request, world: &mut World, service: Service) -> Result<String, ControlError> {
        match request {
            Request::Hello { name, .. } => {
                if let Some(name) = name.filter(|name| !name.is_empty()) {
                    self.name = name.into();
                }
                Ok(hello(world))
            }
            Request::Help => Ok(help()),
            Request::Now => self.command(&Command::Now, world, service),
            Request::Get(place) => self.command(&Command::Get(place), world, service),
            Request::World(line) if line.len() > sim::command::MAX_LINE_LENGTH => Err(CommandError::TooLong.into()),
            Request::World(line) => {
                match line.parse()? {
                    Command::Quit => Err(ControlError::usage(
                        "quit is not for clients, only for the standard input of the simulator",
                    )
                    .next("close the connection; the simulator ends with `quit` on its standard input, or a signal")),
                    Command::Help => Ok(help()),
                    Command::Run(_) => {
                        Err(ControlError::usage("time is moved by the request `run`, not by a world command")
                            .next(REQUESTS[6]))
                    }
                    command => self.command(&command, world, service),
                }
            }
            Request::SubscribeEvents(filter) => self.subscribe(Subscription::Events(filter)),
            Request::SubscribeValues(values) => {
                check_places(&values, world)?;
                self.subscribe(Subscription::Values { values, next: world.now() })
            }
            Request::Unsubscribe(number) => match self.subscriptions.remove(&number) {
                Some(_) => Ok(json!({ "ok": true, "subscription": number }).to_string()),
                None => Err(ControlError::usage(format!("there is no subscription {number}"))
                    .next("the answer to subscribe has its number; one that is ended has none")),
            },
            // The caller has dealt with it.
            Request::Run(_) => Err(CommandError::NotManual.into()),
        }
    }

    fn command(&self, command: &Command, world: &mut World, service: Service) -> Result<String, ControlError> {
        world.act_as(Some(self.name.clone()));
        let answer = sim::command::perform(world, command, service);
        world.act_as(None);
        Ok(answer?)
    }

    fn subscribe(&mut self, subscription: Subscription) -> Result<String, ControlError> {
        if self.subscriptions.len() >= MAX_SUBSCRIPTIONS {
            let reason = format!("{MAX_SUBSCRIPTIONS} subscriptions are the most that one client may have");
            return Err(ControlError::new("limit", reason).next(REQUESTS[8]));
        }
        self.subscribed += 1;
        self.subscriptions.insert(self.subscribed, subscription);
        Ok(json!({ "ok": true, "subscription": self.subscribed }).to_string())
    }
}

impl Subscription {
    const fn next_due(&self) -> Option<Instant> {
        match self {
            Self::Events(_) => None,
            Self::Values { next, .. } => Some(*next),
        }
    }
}

/// The next point of the grid after `now`.
fn next_after(due: Instant, every_ns: u64, now: Instant) -> Instant {
    let passed = now.nanos_since(due) / every_ns;
    due.plus_nanos((passed + 1) * every_ns)
}

fn check_places(values: &Values, world: &mut World) -> Result<(), ControlError> {
    let there: Vec<u8> = world.drive_numbers().collect();
    for Place { node: number, axis } in values.places() {
        match world.with_drive(number, |drive, _| drive.check_axis(axis)) {
            Ok(checked) => checked.map_err(CommandError::from)?,
            Err(_) => {
                let present: Vec<String> = there.iter().map(ToString::to_string).collect();
                return Err(CommandError::NoSuchDrive { number, present: present.join(", ") }.into());
            }
        }
    }
    Ok(())
}

fn hello(world: &mut World) -> String {
    let numbers: Vec<u8> = world.drive_numbers().collect();
    let mut model = |number| world.with_drive(number, |drive, _| drive.model()).ok();
    let nodes: Vec<Value> =
        numbers.into_iter().map(|number| json!({ "node": number, "model": model(number) })).collect();
    json!({
        "ok": true,
        "protocol": PROTOCOL,
        "program": concat!("ferrodrive ", env!("CARGO_PKG_VERSION")),
        "nodes": nodes,
    })
    .to_string()
}

fn help() -> String {
    let kinds: Vec<&str> = KINDS.iter().map(|(name, _)| *name).collect();
    let signals: Vec<&str> = sim::recorder::Signal::ALL.iter().map(|signal| signal.name()).collect();
    json!({ "ok": true, "help": REQUESTS, "world": FORMS, "kinds": kinds, "signals": signals }).to_string()
}

/// An unrequested line: `{"subscription":1,"event":{..}}`.
fn line(subscription: u64, what: &str, value: &Value) -> String {
    json!({ "subscription": subscription, what: value }).to_string()
}

fn seconds(at: Instant) -> f64 {
    sim::json::rounded(at.as_nanos() as f64 / 1e9)
}

/// Takes as long for a wrong token as for the right one, so that it cannot be found letter by letter.
fn equal(token: &[u8], given: &[u8]) -> bool {
    let differences = token.iter().zip(given.iter().chain(core::iter::repeat(&0))).fold(0, |sum, (a, b)| sum | (a ^ b));
    core::hint::black_box(differences) == 0 && token.len() == given.len()
}

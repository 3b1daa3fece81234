//! A host and one page on the bus behind an slcan adapter: its caller has the port and the clock.
//!
//! The host begins when the adapter has opened its channel, and stays when the port is lost: what it had moved then gets its stop again
//! as soon as there is a port. The page's session ends, and with it its control, whenever what it sees or sends can no longer be relied
//! on: the page is hidden, this program was not run for a while, the port is lost, the adapter falls silent, refuses frames or sends
//! garbage. A page that takes leave has the drives' watches over this host given back.

use std::pin::Pin;
use std::sync::Arc;
use std::task::Poll;
use std::time::Duration;

use can::{Bitrate, Instant, Station, Tap};
use console::line::Reader;
use host::capture::WaysBack;
use host::stopping::{Account, still_moving, stop};
use host::{Setting, Wire};
use master::Network;
use sim::task::Task;
use slcan::{Client, Event, Status};

use crate::hosted::{Hosted, PassedFrames};
use crate::hosted_world::Failed;
use crate::requests::{Request, Response, respond_without_host};

/// Longest wait for each answer of a node, as the command line has it at first.
const TIMEOUT: Duration = Duration::from_millis(500);

/// A caller that comes every few milliseconds and was away for so long has slept, or was held up.
const HELD_UP: Duration = Duration::from_secs(1);

/// Lines in a row that are not slcan, and none that is between: the line is not to be relied on.
const GARBLED: u32 = 10;

/// What is said of drives that this host cannot reach.
const WHO: &str = "this page";

/// How the line to the bus is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// There is no port; why, behind the first one.
    Closed(Option<String>),
    /// The adapter is asked to open its channel.
    Opening,
    /// Frames come and go.
    Open,
}

/// Why the page has lost control.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LetGo {
    /// What happened.
    pub why: String,
    /// The nodes that it had set in motion, for which a quick stop was ordered.
    pub moved: Vec<u8>,
    /// The drives that cannot be reached, and what they do by themselves.
    pub moving: Vec<String>,
}

/// How far the page's leave of the adapter is.
enum Leave {
    No,
    /// What was moved is being stopped, and then the watches of the drives are given back.
    Stopping(Task<Pin<Box<dyn Future<Output = Vec<Account>>>>>),
    /// What may still be moving.
    Done(Vec<String>),
}

/// The host, its page, and the client of the adapter.
pub struct SerialHost {
    network: Network,
    station: Tap<Network, PassedFrames>,
    passed: PassedFrames,
    setting: Setting,
    wire: Wire,
    bitrate: Bitrate,
    /// While there is a port.
    client: Option<Client>,
    is_open: bool,
    lost: Option<String>,
    hosted: Option<Hosted>,
    /// A page waits for the host.
    is_page_waiting: bool,
    garbled: u32,
    /// It has been said that the adapter refuses frames, since it opened its channel.
    is_refusal_said: bool,
    let_go: Option<LetGo>,
    leave: Leave,
    now: Instant,
}

impl core::fmt::Debug for SerialHost {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SerialHost").field("now", &self.now).field("line", &self.line()).finish_non_exhaustive()
    }
}

impl SerialHost {
    /// A host without a port. `name` is shown as that of the bus; `unix_zero` is the Unix time of [`Instant::ZERO`], for logs.
    ///
    /// # Errors
    /// slcan has no such bit rate.
    pub fn new(name: &str, bitrate: Bitrate, unix_zero: Duration, now: Instant) -> Result<Self, Failed> {
        if slcan::bitrate_code(bitrate).is_none() {
            let known = "10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k and 1M";
            return Err(Failed::new("usage", format!("slcan cannot select {bitrate}; it knows {known}")));
        }
        let (network, passed, wire) = (Network::new(), PassedFrames::default(), Wire::default());
        let setting = Setting {
            bus: name.into(),
            bitrate: Some(bitrate),
            timeout: TIMEOUT,
            models: Default::default(),
            gears: Default::default(),
            groups: Vec::new(),
            interface: "can0".into(),
            unix_zero,
            journals: None,
            world: None,
            ways_back: WaysBack::default(),
            console: Some(Arc::new(Reader)),
            wire: wire.clone(),
            allow_motion: false,
        };
        let mut station = Tap::new(network.clone(), passed.clone());
        station.handle_timeout(now);
        Ok(Self {
            network,
            station,
            passed,
            setting,
            wire,
            bitrate,
            client: None,
            is_open: false,
            lost: None,
            hosted: None,
            is_page_waiting: false,
            garbled: 0,
            is_refusal_said: false,
            let_go: None,
            leave: Leave::No,
            now,
        })
    }

    /// How the line is.
    pub fn line(&self) -> Line {
        match &self.client {
            Some(_) if self.is_open => Line::Open,
            Some(_) => Line::Opening,
            None => Line::Closed(self.lost.clone()),
        }
    }

    /// The nodes that the page has set in motion and that were not seen to stand since.
    pub fn moved(&self) -> Vec<u8> {
        self.network.moved().iter().map(|node| node.raw()).collect()
    }

    /// There is a port, whose adapter is asked to open its channel.
    pub fn plug(&mut self) {
        self.is_open = false;
        self.client = Client::open(Some(self.bitrate), self.now);
    }

    /// The port is lost, with all that moved.
    pub fn unplug(&mut self, why: &str) {
        let was_open = std::mem::replace(&mut self.is_open, false);
        (self.client, self.lost) = (None, Some(why.to_owned()));
        if was_open {
            self.wire.update(|health| health.state = Some("connection lost"));
            self.end_session(format!("The adapter is lost: {why}"));
        }
        if matches!(self.leave, Leave::Stopping(_)) {
            self.leave = Leave::Done(self.out_of_reach());
        }
    }

    /// The page takes leave of the adapter: its session ends, what it moved is stopped, and the drives' watches over this host are given
    /// back. There is no further session; [`left`](Self::left) says when that is done.
    pub fn take_leave(&mut self) {
        if !matches!(self.leave, Leave::No) {
            return;
        }
        self.end_session("The page took leave of the adapter".to_owned());
        self.leave = if self.is_open && self.hosted.is_some() {
            let network = self.network.clone();
            Leave::Stopping(Task::new(Box::pin(async move { stop(&network, WHO).await })))
        } else {
            Leave::Done(self.out_of_reach())
        };
        self.settle();
    }

    /// Once the page has taken leave, and all is done that can be: the drives that may still be moving, and what they do by themselves.
    pub fn left(&self) -> Option<&[String]> {
        match &self.leave {
            Leave::Done(moving) => Some(moving),
            Leave::No | Leave::Stopping(_) => None,
        }
    }

    /// Ends the session of the page, if there is one: what it moved is stopped, and control has to be taken anew.
    pub fn let_go(&mut self, why: &str) {
        self.end_session(why.to_owned());
    }

    /// Begins a session for the page; as soon as the adapter has opened its channel. Not for a page that has taken leave.
    pub fn join(&mut self) {
        if !matches!(self.leave, Leave::No) {
            return;
        }
        self.is_page_waiting = self.hosted.is_none();
        if let Some(hosted) = &mut self.hosted {
            hosted.join();
        }
        self.settle();
    }

    /// Hands on a message of the page.
    pub fn say(&mut self, message: &str) {
        if let Some(hosted) = &mut self.hosted {
            hosted.say(message);
        }
        self.settle();
    }

    /// What a request of the page is answered.
    ///
    /// # Errors
    /// The adapter has not opened its channel yet.
    pub fn request(&self, request: &Request, body: &[u8]) -> Result<Response, Failed> {
        let response = match &self.hosted {
            Some(hosted) => Some(hosted.request(request, body)),
            None => respond_without_host(request),
        };
        response.ok_or_else(|| Failed::new("no_bus", "the adapter has not opened its channel yet"))
    }

    /// Takes what the port has brought, and brings everything to `now`. It is to be called every few milliseconds: a call after a longer
    /// pause first stops what moved before it.
    pub fn run(&mut self, input: &[u8], now: Instant) {
        let now = now.max(self.now);
        let pause = now - self.now;
        if pause > HELD_UP {
            let why = format!("The machine slept, or this page was held up, for {:.1} s", pause.as_secs_f64());
            self.end_session(why);
        }
        self.now = now;
        if let Some(client) = &mut self.client {
            client.handle_input(input, now);
            client.handle_timeout(now);
        }
        self.handle_events();
        self.settle();
    }

    /// The bytes for the port.
    pub fn take_output(&mut self) -> Vec<u8> {
        self.client.as_mut().map(Client::take_output).unwrap_or_default()
    }

    /// Closes the channel of the adapter, as the last thing on its line.
    pub fn close(&mut self) {
        if let Some(client) = &mut self.client {
            client.close();
        }
    }

    /// What the page is to be sent since the last call: JSON objects.
    pub fn take_sent(&mut self) -> Vec<String> {
        self.hosted.as_mut().map(Hosted::take_sent).unwrap_or_default()
    }

    /// Why the session of the page has ended, once.
    pub fn take_let_go(&mut self) -> Option<LetGo> {
        self.let_go.take()
    }

    fn end_session(&mut self, why: String) {
        self.is_page_waiting = false;
        let moved = self.moved();
        // Without a channel no stop leaves, whatever has ended the session.
        let moving = if self.is_open { Vec::new() } else { self.out_of_reach() };
        let Some(hosted) = &mut self.hosted else { return };
        if hosted.leave() || !moving.is_empty() {
            self.let_go = Some(LetGo { why, moved, moving });
        }
        self.settle();
    }

    /// The drives that were set in motion, as those of a bus that is lost.
    fn out_of_reach(&self) -> Vec<String> {
        still_moving(Account::of_lost_bus(&self.network, WHO))
    }

    fn handle_events(&mut self) {
        while let Some(event) = self.client.as_mut().and_then(Client::poll_event) {
            match event {
                Event::Opened => self.handle_opened(),
                Event::Failed(error) => self.unplug(&error.to_string()),
                Event::Frame(frame) => {
                    self.garbled = 0;
                    self.station.handle_frame(&frame, self.now);
                    self.settle();
                }
                Event::Status(flags) => self.handle_status(flags),
                Event::FrameRefused => {
                    self.wire.update(|health| health.frames_lost += 1);
                    let why = "The adapter answered BEL: a frame is lost. Is another node on, is the bit rate right, is the bus terminated?";
                    let is_news = !std::mem::replace(&mut self.is_refusal_said, true);
                    self.distrust(why, is_news);
                }
                Event::Silent => self.unplug("the adapter says nothing any more: is it still there?"),
                Event::Malformed(_, malformed) => {
                    self.garbled = self.garbled.saturating_add(1);
                    if self.garbled >= GARBLED {
                        let why = format!("The adapter sends what is not slcan: {malformed}");
                        self.distrust(&why, self.garbled == GARBLED);
                    }
                }
            }
        }
    }

    fn handle_opened(&mut self) {
        (self.is_open, self.lost, self.garbled, self.is_refusal_said) = (true, None, 0, false);
        self.wire.update(|health| health.state = None);
        if self.hosted.is_some() {
            return self.wire.tell("the connection to the bus is back");
        }
        self.station.handle_timeout(self.now);
        let mut hosted = Hosted::new(self.network.clone(), self.setting.clone(), self.passed.clone());
        if std::mem::take(&mut self.is_page_waiting) {
            hosted.join();
        }
        self.hosted = Some(hosted);
        self.settle();
    }

    fn handle_status(&mut self, flags: Status) {
        self.garbled = 0;
        self.wire.update(|health| {
            health.state = Some(match (flags.is_error_passive(), flags.is_error_warning()) {
                (true, _) => "error-passive",
                (false, true) => "error-warning",
                (false, false) => "error-active",
            });
            health.error_frames += u64::from(flags.is_bus_error() || flags.is_arbitration_lost());
            health.frames_lost += u64::from(flags.is_receive_lost()) + u64::from(flags.is_send_queue_full());
        });
    }

    /// The line cannot be relied on: a page in control moves nothing by it any more. Where nothing moves by this page, or what moved has
    /// had its stop, it is news.
    fn distrust(&mut self, why: &str, is_news: bool) {
        if self.hosted.as_ref().is_some_and(Hosted::is_controlled) && !self.network.moved().is_empty() {
            self.end_session(why.to_owned());
        } else if is_news {
            self.wire.tell(why);
        }
    }

    /// Has host, page and master do what they can do now.
    fn settle(&mut self) {
        let Some(hosted) = &mut self.hosted else { return };
        loop {
            let mut has_run = hosted.poll();
            if let Leave::Stopping(stopping) = &mut self.leave
                && let Some(polled) = stopping.poll_if_woken()
            {
                has_run = true;
                if let Poll::Ready(accounts) = polled {
                    self.leave = Leave::Done(still_moving(accounts));
                }
            }
            if self.station.poll_timeout().is_some_and(|at| at <= self.now) || self.network.now() < self.now {
                self.station.handle_timeout(self.now);
                has_run = true;
            }
            while let Some(frame) = self.station.poll_transmit() {
                // Without a channel a frame is lost, as that of a controller without a cable.
                if let Some(client) = self.client.as_mut().filter(|_| self.is_open) {
                    client.transmit(&frame);
                }
                self.station.handle_transmitted(&frame, self.now);
                has_run = true;
            }
            if !has_run {
                return;
            }
        }
    }
}

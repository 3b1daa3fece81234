//! A CAN interface of Linux as an [`AsyncBus`].

use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::time::Duration;

use can::{CanId, Frame, Instant};
use nix::errno::Errno;

use super::error_class::notes_of;
use super::interface::{self, InterfaceProblem, SYSTEM};
use super::socket::{Incoming, Socket};
use super::wire::KernelMessage;
use crate::note::Suspicions;
use crate::{AsyncBus, BusError, ControllerState, Note, Received, WallClock};

/// How often an interface that went away is looked for.
const AGAIN: Duration = Duration::from_millis(200);

/// How long a full send queue may hold up a frame. The ten frames that Linux gives an interface take 130 ms at 10 kbit/s,
/// the slowest bit rate of CiA 301, table 1; a queue that is still full then is not being emptied.
const QUEUE_PATIENCE: Duration = Duration::from_millis(200);

/// Pause between two attempts to put a frame into a full send queue: two frames at 250 kbit/s.
const QUEUE_PAUSE: Duration = Duration::from_millis(1);

/// Most filters that the kernel takes for a socket (`CAN_RAW_FILTER_MAX` in `include/uapi/linux/can/raw.h`).
const MOST_FILTERS: usize = 512;

/// A bus behind a CAN interface of Linux.
///
/// When the interface goes down or its adapter is unplugged, this is reported ([`Note::ConnectionLost`]), and it waits until it is up
/// again. A frame that finds the send queue full waits a moment; when the queue is not being emptied it is lost, and so are
/// those behind it, until one gets through ([`Note::SendQueueFull`]).
#[derive(Debug)]
pub struct SocketCanBus {
    interface: String,
    clock: WallClock,
    connection: InterfaceState,
    /// Identifiers that are asked for; none for all.
    wanted: Vec<CanId>,
    /// What is to be reported next: what one message said, and what sending met.
    waiting: VecDeque<(Instant, Received)>,
    suspicions: Suspicions,
    /// The time reported last: a clock that is set back must not turn time round.
    last: Instant,
    /// Messages that the socket had lost when that was last reported.
    lost: u32,
    /// The send queue was full for longer than its patience, and no frame got through since.
    is_stuck: bool,
}

#[derive(Debug)]
enum InterfaceState {
    Up(Socket),
    Away { again_at: Instant },
}

impl SocketCanBus {
    /// Opens `interface`, which has to be up.
    pub fn open(interface: &str, clock: &WallClock) -> Result<Self, BusError> {
        let (socket, has_carrier) = connect(interface).map_err(BusError::Interface)?;
        let mut bus = Self {
            interface: interface.to_owned(),
            clock: clock.clone(),
            connection: InterfaceState::Up(socket),
            wanted: Vec::new(),
            waiting: VecDeque::new(),
            suspicions: Suspicions::default(),
            last: clock.now(),
            lost: 0,
            is_stuck: false,
        };
        bus.tell_state(has_carrier);
        Ok(bus)
    }

    /// See [`crate::AnyBus::hear_only`].
    pub fn hear_only(&mut self, ids: &[CanId]) -> Result<bool, BusError> {
        let ids = if ids.len() > MOST_FILTERS { &[] } else { ids };
        self.wanted = ids.to_vec();
        if let InterfaceState::Up(socket) = &self.connection
            && let Err(error) = socket.set_filter(ids)
        {
            self.lose(error)?;
        }
        Ok(!ids.is_empty())
    }

    /// An interface that is up and has no carrier belongs to a controller that is bus-off, which reports that only once.
    fn tell_state(&mut self, has_carrier: bool) {
        if !has_carrier {
            self.tell(Note::State(ControllerState::BusOff));
        }
    }

    fn tell(&mut self, note: Note) {
        self.waiting.push_back((self.clock.now(), note.into()));
    }

    /// Takes in a message: at least one thing to report.
    fn take(&mut self, incoming: Incoming) {
        let now = self.clock.now();
        let at = incoming.stamp.map_or(now, |stamp| self.clock.at_unix(stamp)).clamp(self.last, now);
        self.last = at;
        // The count of the socket is of 32 bits, and goes round.
        let lost = incoming.lost.wrapping_sub(self.lost);
        self.lost = incoming.lost;
        if lost > 0 {
            self.waiting.push_back((at, Note::Overrun { lost: Some(lost) }.into()));
        }
        match incoming.message {
            KernelMessage::Frame(frame) => self.waiting.push_back((at, frame.into())),
            KernelMessage::Fd { id, length } => self.waiting.push_back((at, Note::FdFrame { id, length }.into())),
            KernelMessage::Error { class, data } => {
                self.waiting.extend(notes_of(class, data).map(|note| (at, note.into())));
            }
        }
    }

    /// An answer of the system that is not a frame: the interface went away and may come back, or the bus is of no use.
    fn lose(&mut self, error: io::Error) -> Result<(), BusError> {
        let problem = InterfaceProblem::of(&self.interface, error);
        if !problem.may_pass() {
            return Err(BusError::Interface(problem));
        }
        self.connection = InterfaceState::Away { again_at: self.clock.now() + AGAIN };
        self.tell(Note::ConnectionLost { reason: problem.to_string() });
        Ok(())
    }

    /// Looks whether the interface is back.
    fn look_again(&mut self) {
        let connected = connect(&self.interface);
        match connected.and_then(|(socket, has_carrier)| {
            let filtered = socket.set_filter(&self.wanted);
            filtered.map(|()| (socket, has_carrier)).map_err(|error| InterfaceProblem::of(&self.interface, error))
        }) {
            Ok((socket, has_carrier)) => {
                self.connection = InterfaceState::Up(socket);
                (self.lost, self.is_stuck) = (0, false);
                self.tell(Note::ConnectionBack);
                self.tell_state(has_carrier);
            }
            Err(_) => self.connection = InterfaceState::Away { again_at: self.clock.now() + AGAIN },
        }
    }

    /// Puts `frame` into the send queue, waiting while it is full.
    async fn queue(&self, socket: &Socket, frame: &Frame) -> io::Result<()> {
        let patience = if self.is_stuck { Duration::ZERO } else { QUEUE_PATIENCE };
        let end = self.clock.now() + patience;
        loop {
            match socket.send(frame).await {
                Err(error) if is_full(&error) && self.clock.now() < end => self.clock.sleep(QUEUE_PAUSE).await,
                result => return result,
            }
        }
    }
}

impl AsyncBus for SocketCanBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let InterfaceState::Up(socket) = &self.connection else { return Ok(()) };
        match self.queue(socket, frame).await {
            Ok(()) => self.is_stuck = false,
            Err(error) if is_full(&error) => {
                if !self.is_stuck {
                    self.tell(Note::SendQueueFull);
                }
                self.is_stuck = true;
            }
            Err(error) => self.lose(error)?,
        }
        Ok(())
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            if let Some((at, next)) = self.waiting.pop_front() {
                if let Some(suspicion) = self.suspicions.after(&next) {
                    self.waiting.push_front((at, suspicion.into()));
                }
                return Ok((at, next));
            }
            match &mut self.connection {
                InterfaceState::Up(socket) => match socket.receive().await {
                    Ok(incoming) => self.take(incoming),
                    Err(error) => self.lose(error)?,
                },
                InterfaceState::Away { again_at } => {
                    let again_at = *again_at;
                    self.clock.sleep_until(again_at).await;
                    self.look_again();
                }
            }
        }
    }
}

/// A socket on `interface`, which is up, and whether it has a carrier.
fn connect(interface: &str) -> Result<(Socket, bool), InterfaceProblem> {
    let problem = |error| InterfaceProblem::of(interface, error);
    // Where the kernel has no CAN there is no interface either, and that is not the reason to give.
    Socket::probe().map_err(problem)?;
    let has_carrier = interface::look(Path::new(SYSTEM), interface)?;
    Ok((Socket::open(interface).map_err(problem)?, has_carrier))
}

fn is_full(error: &io::Error) -> bool {
    error.raw_os_error() == Some(Errno::ENOBUFS as i32)
}

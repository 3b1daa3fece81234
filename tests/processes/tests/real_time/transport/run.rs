//! The run loops: a toy station on a real connection, a toy world behind a hub.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::time::Duration;

use super::{Raw, frame, heard, hub, socketcand, socketcand_port, soon};
use can::{CanId, Frame, Instant, Station};
use canlog::Place;
use tokio::sync::{Notify, mpsc};
use transport::{
    AsyncBus, BusError, BusSpec, ClientId, Heard, LeaveReason, Note, RealTimeWorld, Received, WallClock, run_station,
    run_world,
};

/// Answers each frame with the next identifier, sends what its handles queue, and beats once at a deadline.
#[derive(Clone, Default)]
struct Toy {
    queue: Rc<RefCell<VecDeque<Frame>>>,
    beat: Rc<RefCell<Option<Instant>>>,
    transmitted: Rc<RefCell<Vec<Frame>>>,
}

impl Toy {
    fn queue(&self, text: &str) {
        self.queue.borrow_mut().push_back(frame(text));
    }
}

impl Station for Toy {
    fn handle_frame(&mut self, frame: &Frame, _now: Instant) {
        let id = CanId::standard(frame.id().raw() as u16 + 1);
        self.queue.borrow_mut().push_back(Frame::new(id, frame.data()));
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.beat.borrow_mut().take_if(|beat| now >= *beat).is_some() {
            self.queue("701#05");
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.queue.borrow_mut().pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        *self.beat.borrow()
    }

    fn handle_transmitted(&mut self, frame: &Frame, _now: Instant) {
        self.transmitted.borrow_mut().push(*frame);
    }
}

/// A peer, and a bus for the station.
async fn connected(clock: &WallClock) -> (impl AsyncBus + use<>, impl AsyncBus + use<>) {
    let mut hub = hub(clock).await;
    let address = socketcand_port(&hub);
    let pair = (socketcand(address, clock).await, socketcand(address, clock).await);
    tokio::spawn(async move { while AsyncBus::recv(&mut hub).await.is_ok() {} });
    pair
}

#[tokio::test]
async fn a_station_answers_frames_and_keeps_its_deadlines() {
    let clock = WallClock::start();
    let (mut peer, mut bus) = connected(&clock).await;
    let mut toy = Toy::default();
    let transmitted = Rc::clone(&toy.transmitted);
    *toy.beat.borrow_mut() = Some(clock.now() + Duration::from_millis(20));
    let beat = toy.beat.borrow().unwrap();
    let conversation = async {
        assert_eq!(heard(&mut peer, &clock).await, frame("701#05"));
        assert!(clock.now() >= beat);
        for i in 0..100_u8 {
            peer.send(&Frame::new(CanId::standard(0x100), &[i])).await.unwrap();
            assert_eq!(heard(&mut peer, &clock).await, Frame::new(CanId::standard(0x101), &[i]));
        }
        "done"
    };
    let result = soon(&clock, run_station(&mut bus, &mut toy, &clock, &Notify::new(), conversation, |_, _| {})).await;
    assert_eq!(result.unwrap(), "done");
    assert_eq!(transmitted.borrow().len(), 101);
}

#[tokio::test]
async fn what_a_handle_queues_goes_out_at_once() {
    let clock = WallClock::start();
    let (mut peer, mut bus) = connected(&clock).await;
    let mut toy = Toy::default();
    let handle = toy.clone();
    let wakeup = Notify::new();
    let inside = async {
        // From within: the command future that runs in the loop.
        handle.queue("601#01");
        assert_eq!(heard(&mut peer, &clock).await, frame("601#01"));
        // A deadline set behind the station's back is kept too.
        *handle.beat.borrow_mut() = Some(clock.now() + Duration::from_millis(5));
        assert_eq!(heard(&mut peer, &clock).await, frame("701#05"));
        peer
    };
    let result = soon(&clock, run_station(&mut bus, &mut toy, &clock, &wakeup, inside, |_, _| {})).await;
    let mut peer = result.unwrap();
    // From outside: another task, which has to notify.
    let outside = async {
        clock.sleep(Duration::from_millis(5)).await;
        handle.queue("602#02");
        wakeup.notify_one();
        heard(&mut peer, &clock).await
    };
    let stop = Notify::new();
    let running = run_station(&mut bus, &mut toy, &clock, &wakeup, stop.notified(), |_, _| {});
    let (received, ended) = tokio::join!(
        async {
            let received = outside.await;
            stop.notify_one();
            received
        },
        soon(&clock, running)
    );
    assert_eq!(received, frame("602#02"));
    ended.unwrap();
}

#[tokio::test]
async fn what_was_queued_last_still_goes_out() {
    let clock = WallClock::start();
    let (mut peer, mut bus) = connected(&clock).await;
    let mut toy = Toy::default();
    let handle = toy.clone();
    for i in 0..20 {
        // The command ends in the same breath as it queues, before or after the loop first waits.
        let command = async {
            if i % 2 == 0 {
                clock.sleep(Duration::from_micros(200)).await;
            }
            handle.queue("000#0280");
            handle.queue("601#2B40600006000000");
        };
        soon(&clock, run_station(&mut bus, &mut toy, &clock, &Notify::new(), command, |_, _| {})).await.unwrap();
        assert_eq!(heard(&mut peer, &clock).await, frame("000#0280"));
        assert_eq!(heard(&mut peer, &clock).await, frame("601#2B40600006000000"));
    }
}

#[tokio::test]
async fn a_lost_connection_ends_the_station_with_the_reason() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let mut bus = socketcand(socketcand_port(&hub), &clock).await;
    let address = socketcand_port(&hub).to_string();
    drop(hub);
    let never = std::future::pending::<()>();
    let result =
        soon(&clock, run_station(&mut bus, &mut Toy::default(), &clock, &Notify::new(), never, |_, _| {})).await;
    assert!(result.unwrap_err().to_string().contains(&address));
}

#[tokio::test]
async fn a_log_is_replayed_and_read_only() {
    let clock = WallClock::start();
    let path = std::env::temp_dir().join(format!("ferrodrive-log-{}.log", std::process::id()));
    std::fs::write(&path, "(1.000001) can0 701#05\n(2.5) can0 oops\n(3.000000) can0 080#\n").unwrap();
    let spec: BusSpec = format!("log:{}", path.display()).parse().unwrap();
    let mut bus = spec.open(&clock).await.unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(bus.recv().await.unwrap(), (Instant::from_micros(1_000_001), frame("701#05").into()));
    let (at, torn) = bus.recv().await.unwrap();
    assert_eq!(at, Instant::from_micros(1_000_001));
    assert!(matches!(&torn, Received::Note(Note::TornRecord(torn)) if torn.place == Place::Line(2)), "{torn:?}");
    assert_eq!(bus.recv().await.unwrap(), (Instant::from_secs(3), frame("080#").into()));
    assert!(matches!(bus.send(&frame("000#")).await, Err(BusError::ReadOnly { .. })));
    assert!(matches!(bus.recv().await, Err(BusError::EndOfLog { .. })));
    assert!(matches!(spec.open(&clock).await, Err(BusError::OpenLog { .. })));
}

/// A wire that takes a millisecond a frame, lowest identifier first, and gives up identifier 7FFh.
#[derive(Default)]
struct Wire {
    now: Instant,
    busy_until: Option<Instant>,
    waiting: Vec<(ClientId, Frame)>,
    /// While a frame is on the wire, time stands until so many wait for it.
    stands_until_waiting: usize,
    on_wire: Option<(ClientId, Frame)>,
    heard: VecDeque<Heard>,
    /// Something due every so often, besides the frames.
    period: Option<Duration>,
    due: Option<Instant>,
    longest_step: Duration,
    steps: usize,
    worst_lag: Duration,
    /// Shared with who waits until it is small.
    lag: Rc<Cell<Duration>>,
    /// Shared as the lag is.
    gone: Rc<RefCell<Vec<LeaveReason>>>,
}

impl Wire {
    fn begin(&mut self, at: Instant) {
        let lowest = (0..self.waiting.len()).min_by_key(|i| self.waiting[*i].1.arbitration_key());
        self.on_wire = lowest.map(|place| self.waiting.remove(place));
        self.busy_until = self.on_wire.map(|_| at + Duration::from_millis(1));
    }
}

impl RealTimeWorld for Wire {
    fn now(&self) -> Instant {
        self.now
    }

    fn target(&mut self, clock: Instant) -> Instant {
        let stands = self.on_wire.is_some() && self.waiting.len() < self.stands_until_waiting;
        if stands { self.now } else { clock }
    }

    fn next_deadline(&self) -> Option<Instant> {
        [self.busy_until, self.due].into_iter().flatten().min()
    }

    fn advance_to(&mut self, instant: Instant) {
        assert!(instant >= self.now, "time went back");
        self.steps += 1;
        self.longest_step = self.longest_step.max(instant - self.now);
        while let Some(at) = self.busy_until.filter(|end| *end <= instant) {
            let (from, frame) = self.on_wire.take().unwrap();
            self.heard.push_back(match frame.id().raw() {
                0x7FF => Heard::Lost { from },
                _ => Heard::Carried { frame, at, from: Some(from) },
            });
            self.begin(at);
        }
        if let (Some(period), Some(due)) = (self.period, &mut self.due) {
            while *due <= instant {
                *due += period;
            }
        }
        self.now = instant;
    }

    fn inject(&mut self, client: ClientId, frame: &Frame) {
        self.waiting.push((client, *frame));
        if self.on_wire.is_none() {
            self.begin(self.now);
        }
        if self.waiting.len() >= self.stands_until_waiting {
            self.stands_until_waiting = 0;
        }
    }

    fn take_heard(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }

    fn left(&mut self, _: ClientId, reason: LeaveReason) {
        self.gone.borrow_mut().push(reason);
    }

    fn set_lag(&mut self, lag: Duration) {
        self.lag.set(lag);
        self.worst_lag = lag.max(self.worst_lag);
    }
}

enum Order {
    Stop,
}

fn obey(world: &mut Wire, Order::Stop: Order) -> ControlFlow<Instant> {
    ControlFlow::Break(world.now())
}

#[tokio::test]
async fn a_world_carries_the_clients_frames_by_priority_and_at_its_own_pace() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let (orders, mut commands) = mpsc::channel(1);
    // The first is on the wire until the others have come, however long the machine takes to read them.
    let mut world = Wire { stands_until_waiting: 2, ..Wire::default() };
    let clients = async {
        let mut listener = socketcand(address, &clock).await;
        let mut sender = Raw::connect(address, &clock).await;
        sender.enter_raw_mode().await;
        let start = clock.now();
        sender.say(b"< send 500 0 >< send 400 0 >< send 300 0 >").await;
        // The others take their turn by identifier.
        let order = [
            heard(&mut listener, &clock).await,
            heard(&mut listener, &clock).await,
            heard(&mut listener, &clock).await,
        ];
        assert_eq!(order, [frame("500#"), frame("300#"), frame("400#")]);
        assert!(clock.now() - start >= Duration::from_millis(3));
        // Frames that the wire gives up return their credit: twice the window gets through.
        sender.say(&b"< send 7FF 0 >".repeat(127)).await;
        sender.say(b"< send 100 0 >").await;
        assert_eq!(heard(&mut listener, &clock).await, frame("100#"));
        orders.send(Order::Stop).await.unwrap();
    };
    let running = run_world(&mut world, &mut hub, &clock, &mut commands, obey);
    let (stopped_at, ()) = soon(&clock, async { tokio::join!(running, clients) }).await;
    assert!(stopped_at <= clock.now());
}

/// Runs `world` for 200 ms after the thread stood still for 200 ms, as after a stopped process, and on until it is not late.
async fn run_late(world: &mut Wire) -> Instant {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let (orders, mut commands) = mpsc::channel(1);
    // A thread that gets no processor time.
    std::thread::sleep(Duration::from_millis(200));
    let lag = Rc::clone(&world.lag);
    let later = async {
        clock.sleep(Duration::from_millis(200)).await;
        while lag.get() > Duration::from_millis(20) {
            clock.sleep(Duration::from_millis(1)).await;
        }
        orders.send(Order::Stop).await.unwrap();
    };
    let running = run_world(world, &mut hub, &clock, &mut commands, obey);
    let (stopped_at, ()) = soon(&clock, async { tokio::join!(running, later) }).await;
    stopped_at
}

#[tokio::test]
async fn an_idle_world_costs_nothing() {
    let mut world = Wire::default();
    assert!(run_late(&mut world).await >= Instant::from_millis(400));
    assert!(world.steps <= 4, "{} steps", world.steps);
}

#[tokio::test]
async fn a_late_world_catches_up_in_steps_and_then_wakes_once_a_deadline() {
    let period = Duration::from_millis(10);
    let mut world = Wire { period: Some(period), due: Some(Instant::ZERO + period), ..Wire::default() };
    let stopped_at = run_late(&mut world).await;
    assert!(stopped_at >= Instant::from_millis(400));
    assert!(world.longest_step <= 3 * period, "{:?}", world.longest_step);
    // One for each deadline and one that finds it is not yet due, and some for the end.
    let deadlines = (stopped_at - Instant::ZERO).as_millis() / period.as_millis();
    assert!((12..2 * deadlines + 10).contains(&(world.steps as u128)), "{} steps", world.steps);
    // It gets how late it is, and (or it would still run) when it is on time again.
    assert!(world.worst_lag >= Duration::from_millis(150), "{:?}", world.worst_lag);
}

#[tokio::test]
async fn a_world_learns_when_a_client_is_gone_and_after_its_frames() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let (orders, mut commands) = mpsc::channel(1);
    let mut world = Wire::default();
    let gone = world.gone.clone();
    let clients = async {
        let mut listener = socketcand(address, &clock).await;
        let mut sender = socketcand(address, &clock).await;
        sender.send(&frame("123#01")).await.unwrap();
        drop(sender);
        assert_eq!(heard(&mut listener, &clock).await, frame("123#01"));
        while gone.borrow().is_empty() {
            clock.sleep(Duration::from_millis(1)).await;
        }
        orders.send(Order::Stop).await.unwrap();
    };
    let running = run_world(&mut world, &mut hub, &clock, &mut commands, obey);
    soon(&clock, async { tokio::join!(running, clients) }).await;
    assert_eq!(*gone.borrow(), [LeaveReason::Closed]);
}

#[tokio::test]
async fn a_world_goes_on_when_nobody_commands_it_any_more() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let (orders, mut commands) = mpsc::channel::<Order>(1);
    drop(orders);
    let mut world = Wire::default();
    let clients = async {
        let mut listener = socketcand(address, &clock).await;
        let mut sender = socketcand(address, &clock).await;
        sender.send(&frame("123#01")).await.unwrap();
        heard(&mut listener, &clock).await
    };
    tokio::select! {
        _ = run_world(&mut world, &mut hub, &clock, &mut commands, obey) => unreachable!("it is not ended"),
        received = clients => assert_eq!(received, frame("123#01")),
    }
}

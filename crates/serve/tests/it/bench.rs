//! A served world, and all that is asked of it.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, Write};
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use can::{Frame, Instant};
use host::control::{ClientNumber, LineBuffer};
use machine::file::Machine;
use scenario::{Execution, Scenario};
use serde_json::Value;
use serve::control::{ControlMessage, SharedOutbox};
use serve::messages::Messages;
use serve::pacer::Pacer;
use serve::service::{Request, Service};
use serve::world::ServedWorld;
use sim::World;
use transport::{ClientId, Heard, LeaveReason, RealTimeWorld};
use words::failure::Failure;

type Asked = Request<Failure>;

/// The watchdog's: what is awaited is the thread that writes lines, not time.
const PATIENCE: Duration = Duration::from_secs(600);

/// A stream that keeps what is written to it.
#[derive(Clone, Default)]
struct Paper(Arc<Mutex<Vec<u8>>>);

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Paper {
    fn take(&self) -> Vec<String> {
        let bytes = std::mem::take(&mut *self.0.lock().unwrap());
        String::from_utf8(bytes).unwrap().lines().map(str::to_owned).collect()
    }
}

/// See the [module](self).
pub(crate) struct Bench {
    pub(crate) served: ServedWorld,
    service: Service,
    /// What the clock shows.
    pub(crate) clock: Instant,
    /// What was asked by the world itself.
    pending: Rc<RefCell<VecDeque<Asked>>>,
    answers: Paper,
    warnings: Paper,
    /// How the service has ended, if it has.
    pub(crate) ended: Option<Result<(), Failure>>,
}

/// A world of the drives of a machine file, which take no time, with the power just come on.
pub(crate) fn world(machine: &str) -> World {
    built(&format!("timing = 'ideal'\n{machine}"))
}

/// The world of a machine file.
pub(crate) fn built(machine: &str) -> World {
    Machine::parse(machine).unwrap_or_else(|bad| panic!("{bad}")).build().unwrap()
}

pub(crate) const SERVO: &str = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";

impl Bench {
    pub(crate) fn new(world: World, pacer: Pacer) -> Self {
        let (answers, warnings) = (Paper::default(), Paper::default());
        let warned = Messages::warnings_to(warnings.clone());
        let by_hand = pacer.is_manual();
        let mut served = ServedWorld::new(world, pacer, false, warned.clone());
        let pending: Rc<RefCell<VecDeque<Asked>>> = Rc::default();
        let over = Rc::clone(&pending);
        served.on_run_over(move || {
            over.borrow_mut().push_back(Asked::RunIsOver);
            true
        });
        let service = Service {
            answers: Messages::answers_to(answers.clone(), warned.clone()),
            warnings: warned,
            log: None,
            record: None,
            waiting: VecDeque::new(),
            quit_in: None,
            by_hand,
            is_typed: false,
        };
        Self { served, service, clock: Instant::ZERO, pending, answers, warnings, ended: None }
    }

    /// A scenario that the world goes through with clients as its host.
    pub(crate) fn following(scenario: &str, pacer: Pacer) -> Self {
        let scenario = Scenario::parse(scenario, std::path::Path::new(".")).unwrap_or_else(|bad| panic!("{bad}"));
        let (world, execution) = Execution::begin(&scenario, None).unwrap_or_else(|bad| panic!("{bad}"));
        let mut bench = Self::new(world, pacer);
        let over = Rc::clone(&bench.pending);
        bench.served.follow(execution, move || {
            over.borrow_mut().push_back(Asked::ScenarioIsOver);
            true
        });
        bench
    }

    /// Asks for something; what follows is done by the next [`turn`](Self::turn).
    pub(crate) fn request(&mut self, request: Asked) {
        if self.ended.is_none()
            && let std::ops::ControlFlow::Break(ended) = self.service.serve(&mut self.served, request)
        {
            self.ended = Some(ended);
        }
    }

    /// One turn of the loop: the world comes to where it is to be when the clock shows what it does.
    pub(crate) fn turn(&mut self) {
        let target = self.served.target(self.clock).max(self.served.now());
        self.served.advance_to(target);
        loop {
            let next = self.pending.borrow_mut().pop_front();
            let Some(request) = next else { return };
            self.request(request);
        }
    }

    /// Turns until a run is over.
    fn settle(&mut self) {
        self.turn();
        while self.served.is_running() && self.ended.is_none() {
            self.turn();
        }
    }

    /// Types lines at once; what is answered to them when all is done.
    pub(crate) fn type_all(&mut self, lines: &[&str]) -> Vec<Value> {
        lines.iter().for_each(|line| self.request(Asked::Line((*line).to_owned())));
        self.settle();
        self.said()
    }

    /// Types a line; its answer.
    #[track_caller]
    pub(crate) fn ask(&mut self, line: &str) -> Value {
        let mut answers = self.type_all(&[line]);
        assert_eq!(answers.len(), 1, "{line}: {answers:?}");
        answers.remove(0)
    }

    /// What was answered since the last call.
    pub(crate) fn said(&self) -> Vec<Value> {
        assert!(self.service.answers.finish(PATIENCE));
        let lines = self.answers.take();
        lines
            .iter()
            .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error} in {line}")))
            .collect()
    }

    /// What people were warned of since the last call.
    pub(crate) fn warned(&self) -> Vec<String> {
        assert!(self.service.warnings.finish(PATIENCE));
        self.warnings.take()
    }

    /// A client of the control connection comes.
    pub(crate) fn control(&mut self, number: ClientNumber) -> Arc<SharedOutbox> {
        let outbox = Arc::<SharedOutbox>::default();
        self.request(Asked::Control(ControlMessage::Joined(number, Arc::clone(&outbox))));
        outbox
    }

    /// It says a line.
    pub(crate) fn says(&mut self, number: ClientNumber, line: &str) {
        let mut lines = Vec::new();
        LineBuffer::default().take(format!("{line}\n").as_bytes(), |line| lines.push(line));
        for line in lines {
            self.request(Asked::Control(ControlMessage::Line(number, line)));
        }
    }

    /// A client of the bus comes.
    pub(crate) fn join(&mut self, number: u64) {
        self.served.joined(ClientId::of(number));
    }

    /// It goes.
    pub(crate) fn leave(&mut self, number: u64) {
        self.served.left(ClientId::of(number), LeaveReason::Closed);
    }

    /// It goes for the sake of another.
    pub(crate) fn make_room(&mut self, number: u64) {
        self.served.left(ClientId::of(number), LeaveReason::Displaced);
    }

    /// It sends a frame.
    pub(crate) fn send(&mut self, number: u64, frame: &str) {
        self.served.inject(ClientId::of(number), &frame.parse::<Frame>().expect("a frame"));
    }

    /// What has become of frames since the last call: those that the bus has carried, as text.
    pub(crate) fn heard(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.served.take_heard())
            .filter_map(|heard| match heard {
                Heard::Carried { frame, .. } => Some(frame.to_string()),
                _ => None,
            })
            .collect()
    }
}

/// All lines for a client of the control connection.
pub(crate) fn lines(outbox: &SharedOutbox) -> Vec<Value> {
    let lines = std::iter::from_fn(|| outbox.next_line());
    lines.map(|line| serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"))).collect()
}

//! What is asked of a running simulation by those who started it: lines of standard input, signals, Modbus clients; and the
//! records that it keeps. Nothing here waits for the program at the other end.

use std::collections::VecDeque;
use std::io::{self, BufRead};
use std::ops::ControlFlow;
use std::time::Duration;

use sim::command::{Command, CommandError};
use tokio::sync::mpsc;
use transport::{ModbusRequest, WallClock};

use super::control::ControlMessage;
use super::input::next_line;
use super::messages::Messages;
use super::world::{Commanded, ServedWorld};
use crate::writing::{FrameLog, RecordOutput};
use recording::Batch;
use words::failure::Failure;

/// How often the log is handed on, and drives are looked at that nothing has happened to.
const KEEPING_INTERVAL: Duration = Duration::from_millis(100);

/// How long standard input waits for the reader of the answers before answers may be dropped.
const READER_PATIENCE: Duration = Duration::from_secs(1);

/// How long the end waits for the disk.
const DISK_PATIENCE: Duration = Duration::from_secs(5);

/// How long the end then waits for the reader of the last answers.
pub const PARTING_PATIENCE: Duration = Duration::from_millis(500);

/// How long the end may take in any case: what stores, log and the last words may take together.
pub const END_PATIENCE: Duration = Duration::from_secs(12);

/// How many times [`KEEPING_INTERVAL`] a `quit` waits for the end of a run: 10 s, in which a drive alone has hours.
const QUIT_TURNS: u32 = 100;

/// Lines that may wait for the end of a run.
const LINES_WAITING: usize = 1024;

/// Requests that may wait.
pub const REQUESTS_WAITING: usize = 64;

/// Tasks of clients that run before the world has its turn again; see [`transport::Hub`] on how much each does.
const TASKS_A_TURN: u32 = 16;

/// The runtime of a served world and its clients.
///
/// # Errors
/// The system's.
pub fn runtime_of_clients() -> io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread().enable_all().event_interval(TASKS_A_TURN).build()
}

/// Something to be served between two steps of the world. `E` is why the service ends, where that is not a line that asks for it.
pub enum Request<E> {
    /// A line of standard input.
    Line(String),
    /// A run has come to its end.
    RunIsOver,
    /// Time to look for records.
    Keep,
    /// What is kept for the records has to be written before time goes on.
    PieceIsFull,
    /// A store is on the disk: answers may go out.
    Stored,
    /// A Modbus request.
    Registers(ModbusRequest),
    /// A client of the control connection comes, speaks or goes.
    Control(ControlMessage),
    /// The scenario has come to its end.
    ScenarioIsOver,
    /// A signal asks for the end, or the bus that was joined is gone.
    Ended(E),
}

impl<E> From<ControlMessage> for Request<E> {
    fn from(message: ControlMessage) -> Self {
        Self::Control(message)
    }
}

impl<E> From<ModbusRequest> for Request<E> {
    fn from(request: ModbusRequest) -> Self {
        Self::Registers(request)
    }
}

/// What a running simulation says and writes.
pub struct Service {
    /// Answers to world commands.
    pub answers: Messages,
    /// Everything else that people should know.
    pub warnings: Messages,
    /// The log, if one is asked for.
    pub log: Option<FrameLog>,
    /// Where the record goes, if one is asked for.
    pub record: Option<RecordOutput>,
    /// Lines that came while a run was under way: each is answered in its turn.
    pub waiting: VecDeque<String>,
    /// RoundRobin of keeping after which a `quit` that waits ends the run.
    pub quit_in: Option<u32>,
    /// Time is moved by hand.
    pub by_hand: bool,
    /// Lines are typed at a terminal: a `quit` among them does not wait for the end of a run.
    pub is_typed: bool,
}

/// How the service has ended.
#[derive(Debug)]
pub struct Parted {
    /// What is not whole on the disk: stores, log, record.
    pub torn: Vec<Failure>,
    /// What was said has been read: without a reader nothing more can be said either.
    pub is_read: bool,
}

impl Service {
    /// Serves one request; breaks when it was the last.
    pub fn serve<E: From<Failure>>(
        &mut self,
        world: &mut ServedWorld,
        request: Request<E>,
    ) -> ControlFlow<Result<(), E>> {
        match request {
            Request::Line(line) if world.is_running() && asks_to_quit(&line) => {
                return self.quit_later(world, line);
            }
            Request::Line(line) if world.is_running() => self.put_off(line),
            Request::Line(line) => return self.obey(world, &line),
            Request::RunIsOver => return self.after_a_run(world),
            Request::Registers(request) => world.serve_registers(request),
            Request::Control(message) => world.serve_control(message),
            Request::Keep => {
                world.look_for_stores();
                // Where time is moved by hand the clock is not to show in a record: pieces end with runs, and when they are full.
                if !self.by_hand {
                    self.write_records(world);
                }
                return self.count_down(world);
            }
            Request::PieceIsFull => self.write_records(world),
            // Whatever woke the loop, answers that may go out do so before it sleeps again.
            Request::Stored => {}
            Request::ScenarioIsOver => {
                self.after_a_run(world)?;
                return ControlFlow::Break(Ok(()));
            }
            Request::Ended(why) => return ControlFlow::Break(Err(why)),
        }
        ControlFlow::Continue(())
    }

    /// Answers a line.
    fn obey<E: From<Failure>>(&mut self, world: &mut ServedWorld, line: &str) -> ControlFlow<Result<(), E>> {
        let Commanded::Done(answer) = world.command(line) else { return ControlFlow::Continue(()) };
        if !answer.quit {
            self.answers.say(&answer.json);
            return ControlFlow::Continue(());
        }
        // What was stored is on the disk when the answer is read.
        let kept = self.finish(world);
        self.answers.say(&answer.json);
        ControlFlow::Break(kept.map_err(E::from))
    }

    /// A line that came during a run waits for its end.
    fn put_off(&mut self, line: String) {
        if self.waiting.len() < LINES_WAITING {
            self.waiting.push_back(line);
        } else {
            self.answers.say(&sim::command::refused(&CommandError::TooMany { most: LINES_WAITING }));
        }
    }

    /// A `quit` that comes during a run has its turn like other lines, so that lines which a script sends at once mean what they say.
    /// It does not wait for ever: a second one, one typed at a terminal, and [`QUIT_TURNS`] end the run.
    fn quit_later<E: From<Failure>>(&mut self, world: &mut ServedWorld, quit: String) -> ControlFlow<Result<(), E>> {
        self.put_off(quit);
        if self.quit_in.is_some() || self.is_typed {
            return self.quit_in_a_run(world);
        }
        self.quit_in = Some(QUIT_TURNS);
        ControlFlow::Continue(())
    }

    /// One turn less until a `quit` that waits ends the run.
    fn count_down<E: From<Failure>>(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), E>> {
        self.quit_in = self.quit_in.and_then(|round_robin| round_robin.checked_sub(1));
        if self.quit_in == Some(0) { self.quit_in_a_run(world) } else { ControlFlow::Continue(()) }
    }

    /// Ends the run, and answers the lines that waited for it, up to `quit`; runs among them end where they begin.
    fn quit_in_a_run<E: From<Failure>>(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), E>> {
        self.end_run(world, "quit");
        while let Some(line) = self.waiting.pop_front() {
            self.obey(world, &line)?;
            self.end_run(world, "quit");
        }
        ControlFlow::Continue(())
    }

    /// Ends a run where it stands; its client gets the reason.
    fn end_run(&self, world: &mut ServedWorld, why: &'static str) {
        if let Some(answer) = world.end_run(why) {
            self.answers.say(&answer);
        }
    }

    /// Answers a run that is over, and the lines that waited for it, up to the next run.
    fn after_a_run<E: From<Failure>>(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), E>> {
        if let Some(answer) = world.take_run() {
            self.answers.say(&answer);
        }
        self.write_records(world);
        while !world.is_running()
            && let Some(line) = self.waiting.pop_front()
        {
            self.obey(world, &line)?;
        }
        ControlFlow::Continue(())
    }

    /// Ends: stores and log are on the disk, and what was said is read, as far as the disk and the readers allow in good time.
    pub fn part(mut self, world: &mut ServedWorld) -> Parted {
        let kept = self.finish(world).err();
        let logged = self.log.take().and_then(|log| log.finish(DISK_PATIENCE).err());
        let recorded = self.record.take().and_then(|record| record.finish(DISK_PATIENCE).err());
        let is_read = self.answers.finish(PARTING_PATIENCE) & self.warnings.finish(PARTING_PATIENCE);
        Parted { torn: [kept, logged, recorded].into_iter().flatten().collect(), is_read }
    }

    /// Brings to the disk what has happened since the last time.
    fn finish(&mut self, world: &mut ServedWorld) -> Result<(), Failure> {
        self.write_records(world);
        match world.finish_stores(DISK_PATIENCE) {
            Some(kept) => kept.map_err(Failure::from),
            None => Err(Failure::new("the last stores have not reached --state")
                .because(format!("the disk has not taken them within {} s", DISK_PATIENCE.as_secs()))
                .next("acknowledged stores are there; check what else keeps the disk busy")),
        }
    }

    /// Hands on what has happened since the last time.
    fn write_records(&mut self, world: &mut ServedWorld) {
        let frames = world.take_carried();
        if let Some(record) = &mut self.record {
            let (recorded, events) = (world.take_recorded(), world.take_events());
            record.write(Batch::of_world(recorded, frames.clone(), &events));
        }
        if let Some(log) = &mut self.log {
            log.write(frames);
        }
    }
}

fn asks_to_quit(line: &str) -> bool {
    line.parse() == Ok(Command::Quit)
}

/// Hands over the lines of `input`; ends with it. A reader of `answers` that is slow is waited for here.
pub fn read_lines<E>(mut input: impl BufRead, requests: &mpsc::Sender<Request<E>>, answers: &Messages) {
    while let Ok(Some(line)) = next_line(&mut input) {
        if sim::command::asks_for_an_answer(&line) {
            answers.wait_for_room(READER_PATIENCE);
            if requests.blocking_send(Request::Line(line)).is_err() {
                return;
            }
        }
    }
}

/// Asks for records to be kept.
pub async fn tick<E>(requests: mpsc::Sender<Request<E>>, clock: WallClock) {
    loop {
        clock.sleep(KEEPING_INTERVAL).await;
        if requests.send(Request::Keep).await.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::BufWriter;

    use can::{Bitrate, Instant};
    use canlog::{Format, LogWriter};
    use canopen::NodeId;
    use devices::AxisId;
    use recording::{Column, Kind};
    use sim::World;
    use sim::machine::{Order, order, zlac8030l};
    use sim::recorder::{Channel, Recorder, Signal};
    use sim::stimulus::Place;
    use transport::RealTimeWorld;

    use super::*;
    use crate::files::{create_log, create_record};
    use crate::pacer::{Clock, Pacer, Speed};
    use crate::writing::{Pace, RecordFile};

    type Asked = Request<Failure>;

    /// The record and the log of some lines; before line `keep_before` the clock comes to where they are looked for.
    fn written(kind: Kind, keep_before: usize) -> [Vec<u8>; 2] {
        let scratch = tempfile::tempdir().unwrap();
        let folder = scratch.path();
        std::fs::create_dir_all(folder).unwrap();
        let (path, log) = (folder.join("record"), folder.join("log"));
        let mut world = World::new(Bitrate::K500, 1);
        world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
        // It sends a heartbeat each second (M joint manual, 5.11.1).
        let joint = devices::model("m4230e17b50").unwrap();
        let ordered = Order::new(joint, NodeId::new(1).unwrap(), Bitrate::K500);
        world.add_drive(1, order(joint, &ordered).unwrap()).unwrap();
        let channel = Channel { place: Place { node: 4, axis: AxisId(0) }, signal: Signal::Velocity };
        world.start_recording(Recorder::new(Duration::from_millis(1), vec![channel]));
        world.watch(true);
        let file = create_record(&path, kind).unwrap();
        let columns = [Column::of_axis(channel)];
        let record = recording::Record::begin(kind, Box::new(file), &columns).unwrap();
        let file = Some(RecordFile::start(record, Pace::Free, Messages::silent()));
        let mut served =
            ServedWorld::new(world, Pacer::new(Clock::Manual, Speed::Times(1.0)), true, Messages::silent());
        let frames = BufWriter::new(create_log(&log, Format::Candump).unwrap());
        let frames = LogWriter::new(frames, Format::Candump).unwrap();
        let mut service = Service {
            answers: Messages::silent(),
            warnings: Messages::silent(),
            log: Some(FrameLog::start(frames, Duration::ZERO, Pace::Free, Messages::silent())),
            record: Some(RecordOutput { file, ..RecordOutput::default() }),
            waiting: VecDeque::new(),
            quit_in: None,
            by_hand: true,
            is_typed: false,
        };
        let lines = ["run 1500ms", "4 load torque 0.5", "run 2ms", "4 fault hall on", "run 1s", "4 fault hall off"];
        for (place, line) in lines.into_iter().enumerate() {
            if place == keep_before {
                assert!(service.serve(&mut served, Asked::Keep).is_continue());
            }
            assert!(service.serve(&mut served, Asked::Line(line.to_owned())).is_continue());
            while served.is_running() {
                let target = served.target(Instant::ZERO);
                let before = served.now();
                served.advance_to(target);
                let request = if served.now() == before { Asked::RunIsOver } else { Asked::PieceIsFull };
                assert!(service.serve(&mut served, request).is_continue());
            }
        }
        assert!(service.part(&mut served).torn.is_empty());
        [path, log].map(|path| std::fs::read(path).unwrap())
    }

    #[test]
    fn moved_by_hand_record_and_log_are_the_same_whenever_the_clock_looks_for_them() {
        for kind in [Kind::Csv, Kind::Mcap] {
            let never = written(kind, usize::MAX);
            let recorded = recording::read(kind, &never[0]).unwrap();
            assert!(recorded.marks.iter().any(|mark| mark.text.contains("load torque 0.5")), "{:?}", recorded.marks);
            // Boot-up and heartbeats of the joint, by the bus's own time.
            let log = String::from_utf8_lossy(&never[1]);
            assert!(log.matches(" 701#").count() >= 2 && log.starts_with("(0000000000."), "{log}");
            for place in 0..6 {
                assert!(written(kind, place) == never, "{kind:?}, looked for before line {place}");
            }
        }
    }
}

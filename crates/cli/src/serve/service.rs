//! What is asked of a running simulation by those who started it: lines of standard input, signals, Modbus clients; and the
//! records that it keeps. Nothing here waits for the program at the other end.

use std::collections::VecDeque;
use std::io::{self, IsTerminal};
use std::ops::ControlFlow;
use std::time::Duration;

use sim::command::{Command, CommandError};
use tokio::sync::mpsc;
use transport::{ModbusRequest, WallClock};

use super::control::ControlMessage;
use super::input::next_line;
use super::messages::Messages;
use super::world::{Commanded, ServedWorld};
use crate::failure::Failure;
use crate::recording::{Batch, FrameLog, RecordFile};
use crate::session::{no_runtime, runtime};
use crate::signals::{Signal, Signals};

/// How often the log is handed on, and drives are looked at that nothing has happened to.
const KEEPING_INTERVAL: Duration = Duration::from_millis(100);

/// How long standard input waits for the reader of the answers before answers may be dropped.
const READER_PATIENCE: Duration = Duration::from_secs(1);

/// How long the end waits for the disk, and then for the reader of the last answers.
const DISK_PATIENCE: Duration = Duration::from_secs(5);
pub(crate) const PARTING_PATIENCE: Duration = Duration::from_millis(500);

/// How long after a signal the process ends in any case: what stores, log and the last words may take together.
const END_PATIENCE: Duration = Duration::from_secs(12);

/// How many times [`KEEPING_INTERVAL`] a `quit` waits for the end of a run: 10 s, in which a drive alone has hours.
const QUIT_TURNS: u32 = 100;

/// Lines that may wait for the end of a run.
const LINES_WAITING: usize = 1024;

/// Requests that may wait.
pub(crate) const REQUESTS_WAITING: usize = 64;

/// Tasks of clients that run before the world has its turn again; see [`transport::Hub`] on how much each does.
const TASKS_A_TURN: u32 = 16;

/// The runtime of a served world and its clients.
pub(crate) fn runtime_of_clients() -> Result<tokio::runtime::Runtime, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().event_interval(TASKS_A_TURN).build();
    runtime.map_err(|error| no_runtime(&error))
}

/// Something to be served between two steps of the world.
pub(crate) enum Request {
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
    /// A signal asks for the end.
    Ended(Signal),
    /// The bus that was joined is gone.
    BridgeLost(Failure),
}

impl From<ControlMessage> for Request {
    fn from(message: ControlMessage) -> Self {
        Self::Control(message)
    }
}

impl From<ModbusRequest> for Request {
    fn from(request: ModbusRequest) -> Self {
        Self::Registers(request)
    }
}

/// What a running simulation says and writes.
pub(crate) struct Service {
    /// Answers to world commands.
    pub(crate) answers: Messages,
    /// Everything else that people should know.
    pub(crate) warnings: Messages,
    /// The log, if one is asked for.
    pub(crate) log: Option<FrameLog>,
    /// The record, if one is asked for.
    pub(crate) record: Option<RecordFile>,
    /// Lines that came while a run was under way: each is answered in its turn.
    pub(crate) waiting: VecDeque<String>,
    /// RoundRobin of keeping after which a `quit` that waits ends the run.
    pub(crate) quit_in: Option<u32>,
    /// Time is moved by hand.
    pub(crate) by_hand: bool,
}

impl Service {
    /// Serves one request; breaks when it was the last.
    pub(crate) fn serve(&mut self, world: &mut ServedWorld, request: Request) -> ControlFlow<Result<(), Failure>> {
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
            Request::Ended(signal) => return ControlFlow::Break(Err(Failure::ended_by(signal))),
            Request::BridgeLost(failure) => return ControlFlow::Break(Err(failure)),
        }
        ControlFlow::Continue(())
    }

    /// Answers a line.
    fn obey(&mut self, world: &mut ServedWorld, line: &str) -> ControlFlow<Result<(), Failure>> {
        let Commanded::Done(answer) = world.command(line) else { return ControlFlow::Continue(()) };
        if !answer.quit {
            self.answers.say(&answer.json);
            return ControlFlow::Continue(());
        }
        // What was stored is on the disk when the answer is read.
        let kept = self.finish(world);
        self.answers.say(&answer.json);
        ControlFlow::Break(kept)
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
    fn quit_later(&mut self, world: &mut ServedWorld, quit: String) -> ControlFlow<Result<(), Failure>> {
        self.put_off(quit);
        if self.quit_in.is_some() || io::stdin().is_terminal() {
            return self.quit_in_a_run(world);
        }
        self.quit_in = Some(QUIT_TURNS);
        ControlFlow::Continue(())
    }

    /// One turn less until a `quit` that waits ends the run.
    fn count_down(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), Failure>> {
        self.quit_in = self.quit_in.and_then(|round_robin| round_robin.checked_sub(1));
        if self.quit_in == Some(0) { self.quit_in_a_run(world) } else { ControlFlow::Continue(()) }
    }

    /// Ends the run, and answers the lines that waited for it, up to `quit`; runs among them end where they begin.
    fn quit_in_a_run(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), Failure>> {
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
    fn after_a_run(&mut self, world: &mut ServedWorld) -> ControlFlow<Result<(), Failure>> {
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

    /// Ends with `ended`: stores and log are on the disk, and what was said is read, as far as the disk and the readers
    /// allow in good time. The reason that ended the simulation is reported first, then what kept a store from the disk.
    pub(crate) fn part(mut self, world: &mut ServedWorld, ended: Result<(), Failure>) -> Result<(), Failure> {
        let kept = self.finish(world);
        let mut ended = match (ended, kept) {
            (Err(failure), Err(lost)) => Err(failure.because(lost.what)),
            (ended, kept) => ended.and(kept),
        };
        let logged = self.log.take().map(|log| log.finish(DISK_PATIENCE));
        let recorded = self.record.take().map(|record| record.finish(DISK_PATIENCE));
        for torn in [logged, recorded].into_iter().flatten().filter_map(Result::err) {
            ended = Err(match ended {
                Ok(()) => torn,
                Err(failure) => torn.because.into_iter().fold(failure.because(torn.what), Failure::because),
            });
        }
        let read = self.answers.finish(PARTING_PATIENCE) & self.warnings.finish(PARTING_PATIENCE);
        if let Err(failure) = &mut ended {
            // Without a reader the reason cannot be printed either: that would wait for ever.
            failure.reported |= !read;
        }
        ended
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
            record.write(Batch { recorded, frames: frames.clone(), events });
        }
        if let Some(log) = &mut self.log {
            log.write(frames);
        }
    }
}

fn asks_to_quit(line: &str) -> bool {
    line.parse() == Ok(Command::Quit)
}

/// Hands over the lines of standard input; ends with it. A reader of `answers` that is slow is waited for here.
pub(crate) fn read_lines(requests: &mpsc::Sender<Request>, answers: &Messages) {
    let mut input = io::stdin().lock();
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
pub(crate) async fn tick(requests: mpsc::Sender<Request>, clock: WallClock) {
    loop {
        clock.sleep(KEEPING_INTERVAL).await;
        if requests.send(Request::Keep).await.is_err() {
            return;
        }
    }
}

/// Listens to signals from now on, in a thread of its own. The first asks for the end; if that takes too long, or a second
/// one comes, the process ends at once. Stores that were acknowledged are on the disk in any case.
pub(crate) fn listen_to_signals(requests: mpsc::Sender<Request>) {
    let (ready, listening) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let Ok(runtime) = runtime() else { return };
        runtime.block_on(async {
            let mut signals = Signals::listen();
            drop(ready);
            let signal = signals.next().await;
            let asked = async {
                let _ = requests.send(Request::Ended(signal)).await;
                std::future::pending::<()>().await;
            };
            tokio::select! {
                () = asked => {}
                _ = signals.next() => {}
                () = tokio::time::sleep(END_PATIENCE) => {}
            }
            std::process::exit(signal.status() as i32);
        });
    });
    // A client that has read `ready` may ask for the end; the other end is dropped when that is so.
    let _: Result<(), _> = listening.recv();
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

    use super::super::files::{create_log, create_record};
    use super::super::pacer::{Clock, Pacer, Speed};
    use super::super::scratch;
    use super::*;
    use crate::recording::Pace;

    /// The record and the log of some lines; before line `keep_before` the clock comes to where they are looked for.
    fn written(kind: Kind, keep_before: usize) -> [Vec<u8>; 2] {
        let folder = scratch(&format!("by-hand-{kind:?}-{keep_before}"));
        std::fs::create_dir_all(&folder).unwrap();
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
        let file = RecordFile::start(kind, file, &columns, Pace::Free, Messages::silent()).unwrap();
        let mut served =
            ServedWorld::new(world, Pacer::new(Clock::Manual, Speed::Times(1.0)), true, Messages::silent());
        let frames = BufWriter::new(create_log(&log, Format::Candump).unwrap());
        let frames = LogWriter::new(frames, Format::Candump).unwrap();
        let mut service = Service {
            answers: Messages::silent(),
            warnings: Messages::silent(),
            log: Some(FrameLog::start(frames, Duration::ZERO, Pace::Free, Messages::silent())),
            record: Some(file),
            waiting: VecDeque::new(),
            quit_in: None,
            by_hand: true,
        };
        let lines = ["run 1500ms", "4 load torque 0.5", "run 2ms", "4 fault hall on", "run 1s", "4 fault hall off"];
        for (place, line) in lines.into_iter().enumerate() {
            if place == keep_before {
                assert!(service.serve(&mut served, Request::Keep).is_continue());
            }
            assert!(service.serve(&mut served, Request::Line(line.to_owned())).is_continue());
            while served.is_running() {
                let target = served.target(Instant::ZERO);
                let before = served.now();
                served.advance_to(target);
                let request = if served.now() == before { Request::RunIsOver } else { Request::PieceIsFull };
                assert!(service.serve(&mut served, request).is_continue());
            }
        }
        assert!(service.part(&mut served, Ok(())).is_ok());
        let bytes = [path, log].map(|path| std::fs::read(path).unwrap());
        std::fs::remove_dir_all(folder).unwrap();
        bytes
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

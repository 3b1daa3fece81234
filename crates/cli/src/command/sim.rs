//! `ferrodrive sim`: virtual drives in real time, for other programs.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufRead, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

use can::Bitrate;
use sim::World;
use tokio::sync::mpsc;
use transport::log::LogWriter;
use transport::{
    AsyncBus, BusSpec, Hub, HubOptions, ModbusRequest, ModbusServer, ModbusSpec, Protocol, ServeSpec, SocketcandBus,
    WallClock, run_world,
};

use crate::args::Global;
use crate::embedded;
use crate::failure::Failure;
use crate::parse::drive_spec::{DriveSpec, drive_spec};
use crate::serve::eeprom::{EepromError, Eeproms};
use crate::serve::keeper::{Keeper, file_name};
use crate::serve::registers;
use crate::serve::world::ServedWorld;
use crate::session::{bus_failure, failure_of, runtime};
use crate::signals::{Signal, Signals};

/// Run virtual drives in real time, for other programs
///
/// Prints one line that begins with `ready` and names every listener once all of them listen. Then reads world commands
/// from standard input, one a line, and answers each with one line of JSON; `quit` ends, the end of input does not.
#[derive(clap::Args)]
#[command(after_help = "World commands (4 is the node of --drive):\n  \
    4 power off|on|cycle      4 input X0 1              4 switch X0 -5000 max\n  \
    4 load torque 2.5         4 load inertia 0.02       4 rotor lock|free\n  \
    4 supply 48               4 temperature motor 95    4 fault hall on\n  \
    4 cable cut|join          4 get                     now, quit\n\
    Of the joints, here node 1:\n  \
    1 battery off|on          1 pulses 8192 10000       1 quadrature -400 1000\n  \
    1 duty 40                 1 clock 10000\n\n\
    Example:\n  ferrodrive sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536\n  \
    ferrodrive --bus socketcand://127.0.0.1:29536/can0 move 4 90deg")]
pub(crate) struct Sim {
    /// A drive and its node-ID, e.g. zlac8030l@4; may be repeated
    ///
    /// After a comma: what is special about this one (`ferrodrive readings MODEL` lists it), e.g. zlim42c@2,reading=Z050:prose;
    /// or the value that an object has at power-on, as if stored, e.g. zlac8030l@4,2014=100.
    #[arg(long = "drive", value_name = "MODEL@NODE[,KEY=VALUE..]", value_parser = drive_spec, required = true)]
    drives: Vec<DriveSpec>,
    /// Bit rate of the bus
    #[arg(long, value_name = "RATE", default_value = "500k")]
    bitrate: Bitrate,
    /// Where to serve the bus: socketcand://HOST:PORT or slcan://HOST:PORT; port 0 takes a free one; may be repeated
    #[arg(long = "serve", value_name = "URL")]
    places: Vec<ServeSpec>,
    /// Where to serve the joints' registers: HOST:PORT for Modbus TCP, or rtu:///dev/ttyUSB0?baud=115200; the unit
    /// identifier is the joint's address (2615h)
    #[arg(long, value_name = "PLACE")]
    modbus: Option<ModbusSpec>,
    /// Keep EEPROM contents in this directory; without it every start is factory-fresh
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
    /// Decides everything random
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write all frames to this file, in candump format
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
}

/// How often EEPROM contents and the log are brought to the disk.
const KEEPING_INTERVAL: Duration = Duration::from_millis(100);

/// Lines of standard input that may wait.
const LINES_WAITING: usize = 64;

enum Request {
    Line(String),
    Keep,
    Registers(ModbusRequest),
    Ended(Signal),
    BridgeLost(Failure),
}

impl From<ModbusRequest> for Request {
    fn from(request: ModbusRequest) -> Self {
        Self::Registers(request)
    }
}

/// What a running simulation writes to the disk.
struct Records {
    keeper: Option<Keeper>,
    log: Option<LogWriter<BufWriter<File>>>,
    unix_zero: Duration,
}

impl Sim {
    /// Runs until `quit`, Ctrl-C or a lost `bridge` (the bus given with `--bus` beside `sim`).
    pub(crate) fn run(&self, global: &Global, bridge: Option<&BusSpec>) -> Result<(), Failure> {
        self.refuse_duplicates()?;
        if let Some(BusSpec::Sim { .. } | BusSpec::Log { .. }) = bridge {
            return Err(Failure::usage(format!("sim cannot join its drives to {}", global.bus))
                .because("it makes a virtual bus itself, and joins it to a live one only")
                .next("leave --bus away, or give e.g. --bus socketcand://HOST:29536/can0"));
        }
        let eeproms = self.state.as_deref().map(Eeproms::open).transpose()?;
        let mut world = World::new(self.bitrate, self.seed);
        for spec in &self.drives {
            self.add_drive(&mut world, spec, eeproms.as_ref())?;
        }
        let log = self.log.as_ref().map(File::create).transpose().map_err(|error| {
            Failure::new(format!("cannot write the log {}", self.log.clone().unwrap_or_default().display()))
                .because(error)
        })?;
        let keeper = eeproms.map(|eeproms| Keeper::start(eeproms, &mut world));
        let log = log.map(|file| LogWriter::new(BufWriter::new(file), "can0"));
        let world = ServedWorld::new(world, log.is_some());
        let runtime = runtime()?;
        let ended =
            runtime.block_on(self.serve(world, Records { keeper, log, unix_zero: Duration::ZERO }, global, bridge));
        // Threads that wait for standard input must not hold up the end.
        runtime.shutdown_background();
        ended
    }

    fn refuse_duplicates(&self) -> Result<(), Failure> {
        let mut nodes = BTreeSet::new();
        match self.drives.iter().find(|spec| !nodes.insert(spec.node)) {
            None => Ok(()),
            Some(spec) => Err(Failure::usage(format!("two drives at node {}", spec.node))
                .because("a node-ID may be used once on a bus")
                .next(format!("give the second --drive {}@... another node-ID", spec.model.model))),
        }
    }

    fn add_drive(&self, world: &mut World, spec: &DriveSpec, eeproms: Option<&Eeproms>) -> Result<(), Failure> {
        let mut drive = embedded::ordered_drive(spec.model, &spec.order(self.bitrate))?;
        let name = file_name(spec.model.model, spec.node.raw());
        if let Some(image) = eeproms.map(|eeproms| eeproms.load(&name, spec.model.model)).transpose()?.flatten() {
            drive.load_nvm(&image).map_err(|error| {
                Failure::new(format!("the EEPROM contents kept for {name} cannot be used")).because(error)
            })?;
        }
        world.add_drive(spec.node.raw(), drive).map_err(|error| Failure::usage(error.to_string()))?;
        Ok(())
    }

    async fn serve(
        &self,
        mut world: ServedWorld,
        mut records: Records,
        global: &Global,
        bridge: Option<&BusSpec>,
    ) -> Result<(), Failure> {
        let clock = WallClock::start();
        // Whoever has read `ready` may ask for the end.
        let signals = Signals::listen();
        records.unix_zero = clock.unix_zero();
        let outer = match bridge {
            Some(spec) => Some(spec.open(&clock).await.map_err(|error| bus_failure(global, &error))?),
            None => None,
        };
        let mut places = self.places.clone();
        if outer.is_some() {
            places.push(ServeSpec { protocol: Protocol::Socketcand, address: "127.0.0.1:0".into() });
        }
        let options = HubOptions { bitrate: Some(self.bitrate), zero: clock.unix_zero(), ..HubOptions::default() };
        let mut hub = Hub::bind(&places, options, &clock).await.map_err(|error| failure_of(&error))?;
        let (requests, mut incoming) = mpsc::channel(LINES_WAITING);
        let modbus = self.serve_registers(&requests, &clock).await?;
        if let (Some(outer), Some(inner)) = (outer, hub.listeners().last()) {
            let inner = inner.address.to_string();
            tokio::spawn(join_buses(outer, inner, clock.clone(), requests.clone(), global.clone()));
        }
        let listeners = hub.listeners()[..self.places.len()].iter().map(|listener| format!(" {listener}"));
        say(&format!(
            "ready{}{}{}",
            listeners.collect::<String>(),
            modbus.as_ref().map(|server| format!(" {}", server.place())).unwrap_or_default(),
            bridge.map(|bus| format!(" {bus}")).unwrap_or_default()
        ));
        tokio::spawn(tick(requests.clone(), clock.clone(), signals));
        std::thread::spawn(move || read_lines(&requests));
        let ended = run_world(&mut world, &mut hub, &clock, &mut incoming, |world, request| {
            answer(world, request, &mut records)
        })
        .await;
        records.keep(&mut world);
        records.finish().and(ended)
    }
}

impl Sim {
    /// The server of `--modbus`, listening.
    async fn serve_registers(
        &self,
        requests: &mpsc::Sender<Request>,
        clock: &WallClock,
    ) -> Result<Option<ModbusServer>, Failure> {
        let Some(place) = &self.modbus else { return Ok(None) };
        let server = ModbusServer::bind(place, requests.clone(), clock).await;
        server.map(Some).map_err(|error| failure_of(&error))
    }
}

/// Serves one request; breaks when it was the last.
fn answer(world: &mut ServedWorld, request: Request, records: &mut Records) -> ControlFlow<Result<(), Failure>> {
    match request {
        Request::Line(line) => {
            if let Some(answer) = sim::command::answer(world.world_mut(), &line) {
                if answer.quit {
                    // What was stored is on the disk when the answer is read.
                    records.keep(world);
                    let kept = records.finish();
                    say(&answer.json);
                    return ControlFlow::Break(kept);
                }
                say(&answer.json);
            }
            ControlFlow::Continue(())
        }
        Request::Registers(request) => {
            registers::answer(world.world_mut(), request);
            ControlFlow::Continue(())
        }
        Request::Keep => {
            records.keep(world);
            ControlFlow::Continue(())
        }
        Request::Ended(signal) => ControlFlow::Break(Err(Failure::ended_by(signal))),
        Request::BridgeLost(failure) => ControlFlow::Break(Err(failure)),
    }
}

impl Records {
    /// Brings to the disk what has happened since the last time.
    fn keep(&mut self, world: &mut ServedWorld) {
        if let Some(keeper) = &mut self.keeper {
            keeper.look(world.world_mut());
        }
        let Some(log) = &mut self.log else { return };
        let lines = world.take_carried();
        let written = lines.iter().try_for_each(|(at, frame)| log.write(*at + self.unix_zero, frame));
        if let Err(error) = written.and_then(|()| log.flush()) {
            // The drives are worth more than their log.
            let _ = writeln!(io::stderr(), "warning: cannot write the log: {error}; it ends here");
            self.log = None;
        }
    }

    /// Waits until EEPROM contents are on the disk.
    fn finish(&mut self) -> Result<(), Failure> {
        self.keeper.take().map_or(Ok(()), |keeper| keeper.finish().map_err(Failure::from))
    }
}

impl From<EepromError> for Failure {
    fn from(error: EepromError) -> Self {
        let failure = Self::new(error.to_string());
        match error {
            EepromError::Corrupt(..) => failure.next("move the file away to start this drive factory-fresh"),
            EepromError::InUse(_) => failure.next("end the other simulator, or give another --state directory"),
            _ => failure,
        }
    }
}

/// One line on standard output, at once. The drives run on if nobody reads.
fn say(line: &str) {
    let mut out = io::stdout().lock();
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}

/// Hands over the lines of standard input; ends with it.
fn read_lines(requests: &mpsc::Sender<Request>) {
    let mut input = io::stdin().lock();
    let mut line = Vec::new();
    while input.read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
        let text = String::from_utf8_lossy(&line).into_owned();
        line.clear();
        if requests.blocking_send(Request::Line(text)).is_err() {
            return;
        }
    }
}

/// Asks for records to be kept, and tells of a signal to end.
async fn tick(requests: mpsc::Sender<Request>, clock: WallClock, mut signals: Signals) {
    loop {
        let (request, over) = tokio::select! {
            signal = signals.next() => (Request::Ended(signal), true),
            () = clock.sleep(KEEPING_INTERVAL) => (Request::Keep, false),
        };
        if requests.send(request).await.is_err() || over {
            return;
        }
    }
}

/// Carries frames both ways between another bus and this one, which is served at `inner`.
async fn join_buses(
    mut outer: impl AsyncBus,
    inner: String,
    clock: WallClock,
    requests: mpsc::Sender<Request>,
    global: Global,
) {
    let carried = async {
        let mut inner = SocketcandBus::connect(&inner, "can0", &clock).await?;
        loop {
            tokio::select! {
                received = outer.recv() => inner.send(&received?.1).await?,
                received = inner.recv() => outer.send(&received?.1).await?,
            }
        }
    };
    let lost: Result<std::convert::Infallible, transport::BusError> = carried.await;
    let Err(error) = lost;
    let _ = requests.send(Request::BridgeLost(bus_failure(&global, &error))).await;
}

//! `ferrodrive sim`: virtual drives in real time, for other programs.

mod described;

use std::collections::{BTreeSet, VecDeque};
use std::io::stdin;
use std::path::PathBuf;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::Mux;
use devices::variant::Preset;
use serve::eeprom::Eeproms;
use serve::messages::Messages;
use serve::pacer::{Clock, Pacer, Speed};
use serve::service::{PARTING_PATIENCE, REQUESTS_WAITING, Service, read_lines, tick};
use serve::store_writer::{StoreWriter, file_name};
use serve::world::ServedWorld;
use serve::writing::{FrameLog, Pace, RecordOutput};
use sim::Fidelity;
use sim::machine::{Order, Realism, TimingMode};
use sim::{VirtualDrive, World};
use tokio::sync::mpsc;
use transport::{
    AnyBus, BusNotes, BusSpec, Hub, HubOptions, ModbusServer, ModbusSpec, ServeSpec, WallClock, run_world,
};

use crate::embedded;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::{file_path, ready_line};
use crate::plain::plain;
use crate::recording::{LogPath, RecordOptions};
use crate::served::{
    ClockArg, ControlOptions, ServiceRequest, at_the_end, is_typed, listen_to_signals, runtime_of_clients,
};
use crate::session::{bus_failure, enter_real_time, not_served, start_clock};
use console::numbers::whole;
use described::notes;
use machine::file::{Machine, Placed};
use serve::writing::NewLog;
use words::document::BadFile;
use words::drive::{DriveSpec, drive_spec};
use words::models::is_from_file;

const WORLD_COMMANDS: &str = "World commands (4 is the node of --drive):\n  \
    4 power off|on|cycle|cut  4 input X0 1              4 switch X0 -5000 max\n  \
    4 load torque 2.5         4 load inertia 0.02       4 rotor lock|free\n  \
    4 load friction 0.2 viscous 0.01 static 0.3         (N·m, N·m·s/rad, N·m at rest)\n  \
    4 load pulley 2 0.05      4 load fan 2 300          (kg on a drum of so many m; N·m at r/min)\n  \
    4 load spring 5           4 load stop -5000 max     (N·m/rad; positions)\n  \
    4 load gear 10 0.5        4 load fan off, load none (ratio, degrees of backlash)\n  \
    body base get             body base slope 5         (of drives that a [[body]] of --machine joins)\n  \
    4 supply 48               4 temperature motor 95    4 fault hall on\n  \
    4 cable cut|join          4 get                     now, help, quit\n  \
    4 bus corrupt 0.3         4 bus late 5 20           4 bus silent on|off\n  \
    4 bus babble 080# 1       4 bus overrun 2 0.5       bus corrupt 0.01\n  \
    run 20ms, run until 2.5s                (with --clock manual: time passes)\n  \
    4 supply 48 limit 10 resistance 0.2     (what the supply gives at most, in A, and its resistance in ohm)\n\
    Switched off, a drive runs on the charge of its DC bus, with under-voltage, until it dies; a supply that returns before\n\
    that, and a cycle, wait for it, as `power` in `get` shows. Cut, it is dead at once.\n\
    Of the joints, here node 1:\n  \
    1 battery off|on          1 pulses 8192 10000       1 quadrature -400 1000\n  \
    1 duty 40                 1 clock 10000";

const EXAMPLES: &str = "\
    Examples:\n  ferrodrive --bus can0 sim --drive zlac8030l@4\n  ferrodrive sim --drive zlac8030l@4 --serve socketcand://127.0.0.1:29536\n  \
    ferrodrive --bus socketcand://127.0.0.1:29536/can0 move 4 90deg";

/// Run virtual drives in real time, for other programs
///
/// Prints one line that begins with `ready` and names every listener, once all of them listen. Then reads world
/// commands from standard input, one per line, and answers each with one line of JSON; `quit` ends the simulator, the
/// end of input does not. Blank lines and `# comments` have no answer; `help` lists the commands.
///
/// With --bus BUS before or after `sim` the drives join a live bus: can0, vcan0, socketcand://HOST:29536/can0 or slcan.
/// They hear its frames and answer as real drives would; --serve may be given beside it. When that bus goes away, the
/// drives go on and wait for it.
///
/// The drives start with the simulator, and take about a second to boot (--timing): until its boot-up message a drive
/// is deaf, and `get` reports "power":"booting".
///
/// Time on the bus follows the clock, unless --speed or --clock is given. No client holds it up: answers that are not
/// read are dropped when 4 MiB wait, and counted; clients take turns on the wire, at most 256 at a time, of which idle
/// ones make room. `now` and `get` report `behind_ms`, how far the bus is behind the clock; falling behind and catching
/// up are also reported on standard error.
#[derive(clap::Args)]
#[command(after_help = format!("{EXAMPLES}\n\nWorld commands and more options: ferrodrive sim --help"), after_long_help = format!("{WORLD_COMMANDS}\n\n{EXAMPLES}"))]
pub(crate) struct Sim {
    /// A drive and its node-ID, e.g. zlac8030l@4; may be repeated, beside --machine FILE
    ///
    /// cia402@5 is a servo as the standard has it. An EDS or DCF file in place of the model, e.g. vendor.eds@5, is a
    /// servo with the objects of that file, or, if it does not describe a drive, a node with its objects.
    ///
    /// After a comma: variations of this drive (`ferrodrive readings MODEL` lists them), e.g.
    /// zlim42c@2,reading=Z050:prose; or the value of an object at power-on, as if stored, e.g. zlac8030l@4,2014=100.
    #[arg(long = "drive", value_name = "MODEL@NODE[,KEY=VALUE..]", value_parser = drive_spec)]
    drives: Vec<DriveSpec>,
    /// Bit rate of the bus (default: the machine file's, or 500k)
    #[arg(long, value_name = "RATE")]
    bitrate: Option<Bitrate>,
    /// Serve the bus here: socketcand://HOST:PORT or slcan://HOST:PORT; may be repeated
    ///
    /// Port 0 takes a free one, which the `ready` line names.
    #[arg(long = "serve", value_name = "URL")]
    places: Vec<ServeSpec>,
    /// Serve the joints' registers at this address: HOST:PORT for Modbus TCP, or rtu:///dev/ttyUSB0?baud=115200; the
    /// unit identifier is the joint's address (2615h)
    #[arg(long, value_name = "PLACE", hide_short_help = true)]
    modbus: Option<ModbusSpec>,
    #[command(flatten)]
    control: ControlOptions,
    /// Keep EEPROM contents in this directory (default: every start is factory-fresh)
    ///
    /// A store is on the disk before the drive acknowledges it: before the SDO answer to a write that is stored, before
    /// the answer that reads 2 from a joint's 2614h, over Modbus too. So no store is lost when the simulator ends, be
    /// it by a signal or kill -9. A disk that takes more than 250 ms, or cannot be written, is not waited for; that is
    /// reported on standard error. Stores without an acknowledgement (values written by PDO, the position that a joint
    /// notes when its supply falls) follow within 100 ms and the time that the disk takes. Symbolic links and files of
    /// others are refused, and never changed.
    #[arg(long, value_name = "DIR", value_parser = file_path)]
    state: Option<PathBuf>,
    /// Random seed (default: the machine file's, or 1)
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 0..=u64::MAX))]
    seed: Option<u64>,
    /// Threads that compute the drives
    ///
    /// The bus does the same on any number of them. It pays from some 20 turning drives on; with fewer, or with drives
    /// at rest, the others sleep.
    #[arg(long, value_name = "N", default_value = "1", hide_short_help = true, value_parser = |text: &str| whole(text, 1..=64_u8))]
    threads: u8,
    /// Simulate drives as calculated (ideal), or with the imperfections of real ones (full): noise of encoder, current,
    /// voltage and temperature, dead time, cogging (default: the machine file's, or ideal)
    #[arg(long, value_name = "ideal|full", hide_short_help = true)]
    realism: Option<Realism>,
    /// Simulate drives that take the time of real ones (device), or none (ideal) (default: the machine file's, or
    /// device)
    ///
    /// A drive boots in about a second, is deaf until its boot-up message, acts on an SDO request after about a
    /// millisecond, on an RPDO or SYNC after some hundred microseconds, takes some milliseconds for a store and half a
    /// second for NMT reset node. `ferrodrive readings MODEL times` lists the bounds and their sources; --seed decides
    /// each time between them. One drive may differ: --drive zlac8030l@4,timing=ideal.
    #[arg(long, value_name = "device|ideal", hide_short_help = true)]
    timing: Option<TimingMode>,
    /// Compute each control period of the drives (full), or their mechanics and outer loops only (mechanical), many times
    /// faster (default: the machine file's, or full)
    ///
    /// Firmware, objects, faults and times on the bus are the same. docs/fidelity.md has what mechanical does not show, and
    /// how far the two are apart. One drive may differ: --drive zlac8030l@4,fidelity=mechanical.
    #[arg(long, value_name = "full|mechanical", hide_short_help = true)]
    fidelity: Option<Fidelity>,
    /// Speed of the bus as a multiple of the clock, e.g. 10 or 0.1, or max
    ///
    /// With max it runs as fast as the machine can while a client is connected, which takes a whole core: 1 ms of the
    /// bus's time is computed, then clients have their turn; their frames are taken between two such steps. While no
    /// client is connected it follows the clock.
    #[arg(long, value_name = "N|max", conflicts_with = "clock")]
    speed: Option<Speed>,
    /// What advances time: the clock, or `run 20ms`, `run until 2.5s` on standard input (manual)
    ///
    /// With manual, time stands still between two runs: a frame of a client is taken at the present time of the bus,
    /// and goes out with the next run. Records and logs are then the same each time; a log counts from the start of the
    /// bus. Each run is answered, when it is over, with the time reached, how many frames the bus has carried, and the
    /// drives whose power, statusword or error code has changed. Lines that arrive before that wait for it; a second
    /// `quit` does not.
    #[arg(long, value_name = "real|manual", value_enum, default_value = "real", hide_possible_values = true)]
    clock: ClockArg,
    #[command(flatten)]
    recording: RecordOptions,
    /// Name the objects of a file that have no effect, which are otherwise only counted at the start
    #[arg(short, long, hide_short_help = true)]
    verbose: bool,
}

/// The object of a joint that allows Modbus (M4230 and M8025).
const MODBUS_ENABLE: Mux = Mux::new(0x2600, 0);

/// The note of a simulator that no program can reach.
const UNREACHABLE: &str = "note: no program can reach these drives: give --serve socketcand://127.0.0.1:29536, or --modbus, or \
                      --bus to join a bus. World commands on standard input are still answered";

impl Sim {
    /// Runs until `quit`, Ctrl-C or a lost `bridge` (the bus given with `--bus` beside `sim`). The drives of the machine file come
    /// first; one of the environment is for a simulator without drives of its own.
    pub(crate) fn run(&self, global: &Global, bridge: Option<&BusSpec>) -> Result<(), Failure> {
        let is_typed = global.machine_file.as_ref().is_some_and(|file| file.is_typed);
        let file = global.machine.as_ref().filter(|_| is_typed || self.drives.is_empty());
        let machine = self.machine(file)?;
        if global.realtime && (self.clock != ClockArg::Real || self.speed.is_some()) {
            return Err(Failure::usage("--realtime has no meaning where the bus does not run with the clock")
                .next("omit --realtime, or --speed and --clock"));
        }
        if let Some(BusSpec::Sim { .. } | BusSpec::Log { .. }) = bridge {
            return Err(Failure::usage(format!("sim cannot join its drives to {}", global.bus))
                .because("it creates a virtual bus, and joins it to a live bus only")
                .next("omit --bus, or give e.g. --bus socketcand://HOST:29536/can0"));
        }
        if bridge.is_some()
            && (self.clock == ClockArg::Manual || self.speed.is_some_and(|speed| speed != Speed::Times(1.0)))
        {
            return Err(Failure::usage(format!("on {} time passes by itself", global.bus))
                .because("--speed and --clock manual need a bus of its own")
                .next("omit them, or --bus"));
        }
        self.refuse_unanswered_registers(&machine, file.is_some())?;
        if let Some(what) = machine.bad_realism() {
            return Err(Failure::usage(what).next("omit --realism full, or --fidelity mechanical"));
        }
        // Everything that its drives refuse is reported at once, before any of them is created.
        file.map(Machine::build).transpose().map_err(unusable)?;
        let warnings = Messages::of_warnings();
        let eeproms = self.state.as_deref().map(Eeproms::open).transpose().map_err(words::failure::Failure::from)?;
        let mut world = machine.world();
        for placed in &machine.drives {
            world.set_timing(machine.timing_of(placed));
            let order = machine.order_of(placed, world.bitrate());
            add_drive(&mut world, (placed, &order), eeproms.as_ref(), &warnings)?;
            let notes = notes(placed.spec.node, placed.spec.model, self.verbose || global.verbose);
            notes.iter().for_each(|note| warnings.say(&plain(note)));
        }
        machine.not_shown().iter().for_each(|what| warnings.say(&plain(what)));
        machine.join(&mut world).map_err(unusable)?;
        machine.make_real(&mut world);
        world.set_threads(self.threads.into());
        let log = global.log.as_ref().map(LogPath::create).transpose()?;
        let record = self.recording.start(&mut world, self.pace(), warnings.clone())?;
        let pacer = Pacer::new(Clock::from(self.clock), self.speed.unwrap_or(Speed::Times(1.0)));
        let world = ServedWorld::new(world, pacer, log.is_some() || record.is_some(), warnings.clone());
        let runtime = runtime_of_clients()?;
        let ended = runtime.block_on(self.serve(world, eeproms, (log, record), warnings, global, bridge));
        // Threads that wait for standard input must not hold up the end.
        runtime.shutdown_background();
        ended
    }

    /// Refuses a Modbus server that no drive would answer at.
    fn refuse_unanswered_registers(&self, machine: &Machine, by_file: bool) -> Result<(), Failure> {
        let has_registers = |placed: &Placed| {
            let model = placed.spec.model;
            !is_from_file(model) && model.row(MODBUS_ENABLE).is_some_and(|row| row.name == "modbus_enable")
        };
        if self.modbus.is_none() || machine.drives.iter().any(has_registers) {
            return Ok(());
        }
        let what = "no drive answers at --modbus";
        let failure = if by_file { Failure::bad_file(what) } else { Failure::usage(what) };
        Err(failure
            .because("of the models only the joints have registers")
            .next("omit it, or add a joint, e.g. --drive m4230e17b50@1"))
    }

    /// Whether log and record have to keep up with the clock.
    fn pace(&self) -> Pace {
        if self.clock == ClockArg::Real && self.speed.is_none() { Pace::RealTime } else { Pace::Free }
    }

    /// The machine of the file, if there is one, with what the command line says beside it.
    pub(crate) fn machine(&self, file: Option<&Machine>) -> Result<Machine, Failure> {
        let mut machine = file.cloned().unwrap_or_default();
        machine.bitrate = self.bitrate.or(machine.bitrate);
        machine.seed = self.seed.or(machine.seed);
        machine.realism = self.realism.or(machine.realism);
        machine.timing = self.timing.or(machine.timing);
        machine.fidelity = self.fidelity.or(machine.fidelity);
        machine.drives.extend(self.drives.iter().cloned().map(Placed::from));
        if machine.drives.is_empty() {
            return Err(Failure::usage("no drive to run")
                .next("give --drive MODEL@NODE, e.g. --drive zlac8030l@4, or --machine FILE.toml"));
        }
        let mut nodes = BTreeSet::new();
        match machine.drives.iter().map(|placed| &placed.spec).find(|spec| !nodes.insert(spec.node)) {
            None => Ok(machine),
            Some(spec) => Err(Failure::usage(format!("two drives at node {}", spec.node))
                .because("a node-ID may be used once on a bus")
                .next(format!("give the second --drive {}@... another node-ID", spec.model.name))),
        }
    }

    async fn serve(
        &self,
        mut world: ServedWorld,
        eeproms: Option<Eeproms>,
        (log, record): (Option<NewLog>, Option<RecordOutput>),
        warnings: Messages,
        global: &Global,
        bridge: Option<&BusSpec>,
    ) -> Result<(), Failure> {
        let clock = start_clock(global)?;
        let (requests, mut incoming) = mpsc::channel(REQUESTS_WAITING);
        listen_to_signals(requests.clone());
        let answers = Messages::of_answers(warnings.clone());
        // A bus whose time is moved by hand has no time of day, and its log is the same each time.
        let unix_zero = if self.clock == ClockArg::Manual { Duration::ZERO } else { clock.unix_zero() };
        let log = log.map(|file| FrameLog::start(file, unix_zero, self.pace(), warnings.clone()));
        let (waiting, by_hand) = (VecDeque::new(), self.clock == ClockArg::Manual);
        let (said, warned) = (answers.clone(), warnings.clone());
        let is_typed = is_typed();
        let mut service =
            Service { answers: said, warnings: warned, log, record, waiting, quit_in: None, by_hand, is_typed };
        let outer = match bridge {
            Some(spec) => Some(spec.open(&clock).await.map_err(|error| bus_failure(global, &error))?),
            None => None,
        };
        let options = HubOptions { bitrate: Some(world.bitrate()), zero: clock.unix_zero(), ..HubOptions::default() };
        let mut hub = Hub::bind(&self.places, options, &clock).await.map_err(|error| not_served(&error))?;
        let modbus = self.serve_registers(&requests, &clock).await?;
        if let Some(outer) = outer {
            join(&hub, outer, requests.clone(), global.clone(), warnings.clone());
        }
        if let Some(eeproms) = eeproms {
            let stored = requests.clone();
            // A full queue wakes the loop as well.
            world.keep_stores(StoreWriter::start(eeproms, warnings, move || {
                drop(stored.try_send(ServiceRequest::Stored))
            }));
        }
        let over = requests.clone();
        world.on_run_over(move || over.try_send(ServiceRequest::RunIsOver).is_ok());
        let full = requests.clone();
        world.on_full_piece(move || full.try_send(ServiceRequest::PieceIsFull).is_ok());
        let control = self.control.serve(&mut world, &requests, &service.warnings).await?;
        let places = hub.listeners().iter().map(ToString::to_string);
        let places = places.chain(modbus.iter().map(|server| server.place().to_string()));
        let places = places.chain(control.iter().map(|server| server.place().to_string()));
        let places: Vec<_> = places.chain(bridge.iter().map(ToString::to_string)).collect();
        answers.say(&ready_line(global.json, &places));
        if self.places.is_empty() && modbus.is_none() && control.is_none() && bridge.is_none() {
            service.warnings.say(UNREACHABLE);
        }
        tokio::spawn(tick(requests.clone(), clock.clone()));
        std::thread::spawn(move || read_lines(stdin().lock(), &requests, &answers));
        // After all threads that it starts: a disk or a terminal does not need real time.
        enter_real_time(global)?;
        let serving =
            run_world(&mut world, &mut hub, &clock, &mut incoming, |world, request| service.serve(world, request));
        let ended = serving.await;
        let ended = at_the_end(ended, service.part(&mut world));
        drop(world);
        if let Some(control) = control {
            control.part(PARTING_PATIENCE).await;
        }
        ended
    }

    /// The server of `--modbus`, listening.
    async fn serve_registers(
        &self,
        requests: &mpsc::Sender<ServiceRequest>,
        clock: &WallClock,
    ) -> Result<Option<ModbusServer>, Failure> {
        let Some(place) = &self.modbus else { return Ok(None) };
        let server = ModbusServer::bind(place, requests.clone(), clock).await;
        server.map(Some).map_err(|error| not_served(&error))
    }
}

/// Adds a drive with what it remembers and what is around it.
fn add_drive(
    world: &mut World,
    (placed, order): (&Placed, &Order),
    eeproms: Option<&Eeproms>,
    warnings: &Messages,
) -> Result<(), Failure> {
    let spec = &placed.spec;
    let mut drive = embedded::ordered_drive(spec.model, order)?;
    placed.supply(drive.as_mut()).map_err(unusable)?;
    let number = spec.node.raw();
    let name = file_name(spec.model.name, number);
    let image = eeproms
        .map(|eeproms| eeproms.load(&name, spec.model.name))
        .transpose()
        .map_err(words::failure::Failure::from)?
        .flatten();
    if let Some(image) = &image {
        drive.load_nvm(image).map_err(|error| {
            Failure::new(format!("the EEPROM contents kept for {name} cannot be used"))
                .because(error)
                .next("move the file away to start this drive factory-fresh")
        })?;
    }
    if image.is_some() {
        note_presets_without_effect(&order.presets, &name, warnings);
        note_what_the_image_changes(drive.clone(), world.bitrate(), number, &name, warnings);
    }
    world.add_drive(number, drive).map_err(|error| {
        Failure::usage(error.to_string()).next("give each --drive MODEL@NODE a node-ID of its own, 1 to 127")
    })?;
    placed.furnish(world).map_err(unusable)
}

fn unusable(bad: BadFile) -> Failure {
    Failure::bad_file("cannot use the machine file").because(bad).next("docs/machine-file.md describes each key")
}

/// Says it if values were given for a drive that has its EEPROM contents.
pub(crate) fn note_presets_without_effect(presets: &[Preset], name: &str, warnings: &Messages) {
    let objects: Vec<String> = presets.iter().map(|preset| preset.object.to_string()).collect();
    if !objects.is_empty() {
        warnings.say(&format!(
            "note: {name} has its EEPROM contents: what is given for {} has no effect; to begin with that, move its file out of --state",
            objects.join(", ")
        ));
    }
}

/// Says it if a drive is not where the command line puts it, because its EEPROM contents say otherwise.
///
/// That is seen from one that is switched on beside the bus.
pub(crate) fn note_what_the_image_changes(
    mut drive: Box<dyn VirtualDrive>,
    of_bus: Bitrate,
    number: u8,
    name: &str,
    warnings: &Messages,
) {
    drive.set_power(true, Instant::ZERO);
    let (bitrate, node) = (drive.bitrate(), drive.report().node);
    if let Some(bitrate) = bitrate.filter(|bitrate| *bitrate != of_bus) {
        warnings.say(&format!(
            "warning: {name} is off the bus: its EEPROM contents say {bitrate}, and the bus has {of_bus}"
        ));
    }
    if node != number {
        warnings.say(&format!(
            "note: {name} is node {node} on the bus, as its EEPROM contents say; world commands call it {number}"
        ));
    }
}

/// Joins another bus to this one. A bus that goes away and comes back is waited for, and the drives go on meanwhile; its end
/// ends the simulator.
fn join(hub: &Hub, outer: AnyBus, requests: mpsc::Sender<ServiceRequest>, global: Global, warnings: Messages) {
    let mut notes = BusNotes::of(&global.bus);
    let joined = hub.join(outer, move |note| {
        notes.news(note).iter().for_each(|text| warnings.say(&plain(&format!("note: {text}"))));
    });
    tokio::spawn(async move {
        let error = joined.await;
        let _ = requests.send(ServiceRequest::Ended(bus_failure(&global, &error))).await;
    });
}

//! Why a drive does not move: each drive is brought into a condition, and the explanation names it; a drive that moves has
//! nothing to explain. The conditions are those of CiA 301 and CiA 402-2 that the rules cite.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::{StoppedTwin, mux, node};
use can::{Bitrate, CanId, Frame, Instant, Station};
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use canopen::{Mux, NmtCommand, NodeId};
use devices::model;
use master::core::PdoMap;
use master::drive::{MotionOptions, SwitchedOff};
use master::explain::{Explained, Overheard, Weight};
use master::pdo::{PdoConfig, TimerUnits, TransmissionType};
use master::units::{Ramp, Rpm};
use master::{Drive, Error, Network};
use sim::machine::{Order, order};
use sim::stimulus::{Place, Stimulus};
use sim::wire::WireEvent;
use sim::{World, block_on};

pub(crate) const NODE: u8 = 4;
const ALL: [&str; 4] = ["zlac8030l", "zlim42c", "m4230e17b50", "cia402"];

/// Longer than any heartbeat and watch of these drives that a test leaves on.
const LISTENING: Duration = Duration::from_millis(2500);

/// A master that notes what others send.
#[derive(Clone)]
struct Ear {
    network: Network,
    heard: Arc<Mutex<Overheard>>,
}

impl Station for Ear {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.heard.lock().unwrap().note(frame, now);
        self.network.handle_frame(frame, now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.network.handle_timeout(now);
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.network.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.network.poll_timeout()
    }
}

pub(crate) struct Bench {
    pub(crate) world: World,
    /// Another program on the same bus.
    pub(crate) other: Network,
    heard: Arc<Mutex<Overheard>>,
    pub(crate) drive: Drive,
}

impl Bench {
    pub(crate) fn new(name: &str) -> Self {
        Self::with(name, &[])
    }

    /// A model with these choices of its variations.
    pub(crate) fn with(name: &str, choices: &[(&str, &str)]) -> Self {
        let (mut world, network, other) = (World::new(Bitrate::K500, 5), Network::new(), Network::new());
        let heard = Arc::<Mutex<Overheard>>::default();
        world.add_station(Ear { network: network.clone(), heard: heard.clone() });
        world.add_station(other.clone());
        let model = model(name).unwrap();
        let mut ordered = Order::new(model, node(NODE), Bitrate::K500);
        for (key, value) in choices {
            ordered.variant.choose(key, value).unwrap();
        }
        world.add_drive(NODE, order(model, &ordered).unwrap()).unwrap();
        world.run_until(Instant::from_secs(2));
        Self { world, other, heard, drive: Drive::new(network.node(node(NODE)), model) }
    }

    #[track_caller]
    pub(crate) fn done<T>(&mut self, work: impl Future<Output = Result<T, Error>>) -> T {
        block_on(&mut self.world, work).unwrap().unwrap()
    }

    #[track_caller]
    pub(crate) fn write(&mut self, object: Mux, value: i64) {
        let drive = self.drive.clone();
        let row = drive.description().unwrap().row(object).unwrap();
        let bytes = row.data_type.raw(value).to_le_bytes();
        self.done(drive.node().download(object, &bytes[..row.data_type.size()]));
    }

    pub(crate) fn enable(&mut self, mode: i64) {
        self.write(mux(0x6060, 0), mode);
        let drive = self.drive.clone();
        self.done(drive.enable());
    }

    fn nmt(&mut self, command: NmtCommand) {
        self.drive.node().nmt(command);
        self.world.refresh();
        self.world.run_for(Duration::from_millis(50));
    }

    pub(crate) fn stimulus(&mut self, words: &str) {
        let stimulus: Stimulus = words.parse().unwrap();
        self.world.apply(Place::node(NODE), &stimulus).unwrap().unwrap();
    }

    fn listen(&mut self, during: impl Fn(&Network)) -> Overheard {
        *self.heard.lock().unwrap() = Overheard::from(self.world.now());
        for _ in 0..LISTENING.as_millis() / 50 {
            during(&self.other);
            // A quiet bus wakes no task: the other program's frame would wait until one came.
            self.world.refresh();
            self.world.run_for(Duration::from_millis(50));
        }
        let mut heard = self.heard.lock().unwrap().clone();
        heard.until(self.world.now());
        heard
    }

    pub(crate) fn explain(&mut self) -> Explained {
        self.explain_while(|_| ())
    }

    fn explain_while(&mut self, during: impl Fn(&Network)) -> Explained {
        let heard = self.listen(during);
        let drive = self.drive.clone();
        block_on(&mut self.world, drive.explain(&heard)).unwrap()
    }
}

pub(crate) fn rules(explained: &Explained) -> Vec<&'static str> {
    explained.findings.iter().map(|finding| finding.rule).collect()
}

/// A condition: its rule, the models that can be in it, and how they get there.
struct Row(&'static str, &'static [&'static str], fn(&mut Bench));

const CONTROLWORD: Mux = mux(0x6040, 0);
const TARGET: Mux = mux(0x607A, 0);

/// What an under-voltage is to each of them; a joint's alarm comes from its watch over a host (next table).
fn starve(bench: &mut Bench) {
    bench.enable(3);
    bench.stimulus("supply 10");
    bench.world.run_for(Duration::from_secs(1));
}

/// The joint watches node 7Fh from its first heartbeat on, 2000 ms as delivered (M joint manual, 5.11.2).
fn lose_host(bench: &mut Bench) {
    bench.enable(3);
    bench.other.heartbeat(NodeId::MAX, Some(Duration::from_millis(500)));
    bench.world.refresh();
    bench.world.run_for(Duration::from_secs(1));
    bench.other.heartbeat(NodeId::MAX, None);
    bench.world.refresh();
    bench.world.run_for(Duration::from_secs(3));
}

/// A target reached with controlword bit 4 still set, then another.
fn leave_start_bit(bench: &mut Bench) {
    bench.enable(1);
    bench.write(TARGET, 2000);
    bench.write(CONTROLWORD, 0x1F);
    bench.world.run_for(Duration::from_secs(3));
    bench.write(TARGET, 4000);
}

fn soft_limits(bench: &mut Bench) {
    bench.enable(1);
    bench.write(mux(0x607D, 1), -1000);
    bench.write(mux(0x607D, 2), 1000);
    bench.write(TARGET, 5000);
}

/// An enabled drive in profile velocity with 0 in this object.
fn without(bench: &mut Bench, object: Mux) {
    bench.enable(3);
    bench.write(object, 0);
}

fn hold_shaft(bench: &mut Bench, target: i64) {
    bench.enable(3);
    bench.stimulus("rotor lock");
    bench.write(mux(0x60FF, 0), target);
}

/// Turns at this target velocity for longer than the ramp takes, though no master talks to the drive.
fn turn_at(bench: &mut Bench, target: i64) {
    bench.write(mux(0x2000, 0), 0);
    bench.enable(3);
    bench.write(mux(0x60FF, 0), target);
    bench.world.run_for(Duration::from_secs(3));
}

fn command(bench: &mut Bench, mode: i64, controlword: i64) {
    bench.enable(mode);
    bench.write(CONTROLWORD, controlword);
}

/// A turning motor keeps its mode (the manuals of both ZLTECH drives; CiA 402-2, 8.5 leaves it to the maker).
fn change_mode_while_turning(bench: &mut Bench) {
    let drive = bench.drive.clone();
    bench.done(drive.guard(SwitchedOff::Leave));
    bench.done(drive.velocity(Rpm(40.0), MotionOptions::default()));
    bench.world.run_for(Duration::from_secs(1));
    bench.write(mux(0x6060, 0), 1);
}

/// A way to go, and no speed to go it at.
fn no_profile_velocity(bench: &mut Bench) {
    bench.enable(1);
    bench.write(mux(0x6081, 0), 0);
    bench.write(TARGET, 200_000);
    bench.write(CONTROLWORD, 0x1F);
}

/// CiA 402-2, 11.1: bit 4 falls while the drive looks for its home switch, which ends the search.
fn interrupt_homing(bench: &mut Bench) {
    bench.enable(6);
    bench.write(mux(0x6098, 0), 24);
    bench.write(CONTROLWORD, 0x1F);
    bench.world.run_for(Duration::from_millis(500));
    bench.write(CONTROLWORD, 0x0F);
    bench.world.run_for(Duration::from_secs(2));
}

/// X0 is the emergency stop: as delivered (ZLAC8030L, 2030h:02), or chosen (ZLIM42-C, 5.4).
fn press_emergency_stop(bench: &mut Bench) {
    bench.enable(3);
    bench.write(mux(0x2030, 2), 9);
    bench.stimulus("input X0 1");
    bench.write(mux(0x60FF, 0), 20);
}

/// ZLAC8030L, 202Fh:03 = 1: the stop takes the power off the motor, and its state is Switch on disabled.
fn be_released_by_emergency_stop(bench: &mut Bench) {
    bench.write(mux(0x202F, 3), 1);
    press_emergency_stop(bench);
    bench.world.run_for(Duration::from_secs(1));
    bench.write(CONTROLWORD, 0x0F);
}

/// X1 as positive limit (ZLIM42-C, 5.4: function 2), its wire reversed by 2030h:01.
fn meet_limit_with_reversed_input(bench: &mut Bench) {
    bench.write(mux(0x2030, 3), 2);
    bench.write(mux(0x2030, 1), 0b10);
    bench.enable(3);
    bench.write(mux(0x60FF, 0), 20);
}

/// CiA 402-2, 60FDh: bit 1 is the positive limit switch.
fn meet_limit(bench: &mut Bench) {
    bench.stimulus("input POS 1");
    bench.enable(3);
    bench.write(mux(0x60FF, 0), 131_072);
}

/// ZLAC8030L, 2030h:0E = 1 closes the brake at B0, and the drive does not open it by itself.
fn leave_brake_closed(bench: &mut Bench) {
    bench.enable(3);
    bench.write(mux(0x2030, 0x0E), 1);
    bench.write(mux(0x60FF, 0), 5);
}

/// A target beyond the highest speed (CiA 402-2, 10.3: 607Fh).
fn ask_too_much(bench: &mut Bench) {
    bench.enable(3);
    bench.write(mux(0x607F, 0), 131_072);
    bench.write(mux(0x60FF, 0), 1_310_720);
    bench.world.run_for(Duration::from_secs(1));
}

/// Conditions that last by themselves.
const CONDITIONS: &[Row] = &[
    Row("no_answer", &ALL, |bench| bench.world.cut_power(NODE).unwrap()),
    Row("not_enabled", &ALL, |_| ()),
    Row("pdo_not_operational", &["zlac8030l", "zlim42c", "cia402"], |_| ()),
    Row("pdo_without_sync", &["m4230e17b50"], |_| ()),
    Row("enabled_without_steps", &["zlac8030l", "zlim42c", "cia402"], |bench| bench.write(CONTROLWORD, 0x0F)),
    Row("fault", &["zlac8030l", "cia402"], |bench| {
        bench.enable(3);
        bench.stimulus("supply 10");
    }),
    Row("reset_bit_left_set", &["zlac8030l"], |bench| {
        starve(bench);
        bench.write(CONTROLWORD, 0x80);
    }),
    Row("host_heartbeat_missing", &["m4230e17b50"], lose_host),
    Row("fault", &["m4230e17b50"], lose_host),
    Row("host_silent", &["zlac8030l"], |bench| bench.enable(3)),
    Row("quick_stop", &["zlac8030l", "zlim42c"], |bench| command(bench, 3, 0x02)),
    Row("not_enabled", &["m4230e17b50", "cia402"], |bench| command(bench, 3, 0x02)),
    Row("no_mode", &["zlac8030l", "zlim42c", "cia402"], |bench| bench.enable(0)),
    Row("target_zero", &ALL, |bench| bench.enable(3)),
    Row("halt", &["zlac8030l", "zlim42c", "cia402"], |bench| command(bench, 3, 0x10F)),
    Row("ramp_held", &["cia402"], |bench| bench.enable(2)),
    Row("ramp_zero", &["m4230e17b50", "cia402"], |bench| without(bench, mux(0x6083, 0))),
    Row("speed_limit_zero", &["cia402"], |bench| without(bench, mux(0x6080, 0))),
    Row("speed_limit_zero", &["cia402"], |bench| without(bench, mux(0x607F, 0))),
    Row("torque_limit_zero", &["cia402"], |bench| without(bench, mux(0x6072, 0))),
    Row("at_target", &["zlac8030l", "m4230e17b50", "cia402"], |bench| bench.enable(1)),
    Row("set_point_not_started", &ALL, |bench| {
        bench.enable(1);
        bench.write(TARGET, 20_000);
    }),
    Row("start_bit_left_set", &["zlim42c", "cia402"], leave_start_bit),
    Row("software_limit", &["cia402"], soft_limits),
    Row("homing_not_started", &["zlim42c", "cia402"], |bench| bench.enable(6)),
    Row("shaft_held", &["m4230e17b50"], |bench| hold_shaft(bench, 50)),
    Row("mode_not_taken", &["zlac8030l", "zlim42c"], change_mode_while_turning),
    Row("profile_velocity_zero", &["cia402"], no_profile_velocity),
    Row("homing_failed", &["zlim42c", "cia402"], interrupt_homing),
    Row("emergency_stop", &["zlac8030l", "zlim42c"], press_emergency_stop),
    Row("emergency_stop", &["zlac8030l"], be_released_by_emergency_stop),
    Row("limit_switch", &["zlim42c"], meet_limit_with_reversed_input),
    Row("limit_switch", &["cia402"], meet_limit),
    Row("brake_set", &["zlac8030l"], leave_brake_closed),
    Row("internal_limit", &["cia402"], ask_too_much),
    Row("supply_limit", &["zlac8030l"], |bench| turn_at(bench, 900)),
];

/// With these a drive may move all the same.
const WARNINGS: [&str; 4] = ["pdo_not_operational", "pdo_without_sync", "internal_limit", "supply_limit"];

#[test]
fn each_condition_is_named_with_what_to_do() {
    for Row(rule, models, prepare) in CONDITIONS {
        for name in *models {
            let mut bench = Bench::new(name);
            prepare(&mut bench);
            let explained = bench.explain();
            let seen = explained.findings.iter().find(|finding| finding.rule == *rule);
            let seen = seen.unwrap_or_else(|| panic!("{name}: no {rule} in {:?}", rules(&explained)));
            let texts = [&seen.expected, &seen.found, &seen.follows, &seen.remedy];
            assert!(texts.iter().all(|text| !text.is_empty()), "{name}: {seen:?}");
            let is_cause = seen.weight == Weight::Cause;
            assert_eq!(is_cause, !WARNINGS.contains(rule), "{name}: {seen:?}");
        }
    }
}

#[test]
fn an_input_is_reported_by_its_name_and_object_of_the_manual_and_is_gone_when_released() {
    let mut bench = Bench::new("zlac8030l");
    press_emergency_stop(&mut bench);
    let explained = bench.explain();
    let seen = explained.findings.iter().find(|finding| finding.rule == "emergency_stop").unwrap();
    assert!(seen.expected.contains("X0 (emergency stop)"), "{seen:?}");
    assert!(seen.found.contains("2003h:00") && seen.found.contains("2030h:02"), "{seen:?}");
    bench.stimulus("input X0 0");
    bench.world.run_for(Duration::from_millis(100));
    let explained = bench.explain();
    assert!(!rules(&explained).contains(&"emergency_stop"), "{explained:#?}");
}

/// Of a switch at the other end only a warning is made.
#[test]
fn a_limit_switch_is_a_cause_only_where_the_shaft_is_to_go() {
    for (target, weight) in [(131_072, Weight::Cause), (0, Weight::Warning)] {
        let mut bench = Bench::new("cia402");
        meet_limit(&mut bench);
        bench.write(mux(0x60FF, 0), target);
        let explained = bench.explain();
        let seen = explained.findings.iter().find(|finding| finding.rule == "limit_switch");
        assert_eq!(seen.map(|finding| finding.weight), Some(weight), "{explained:#?}");
    }
}

/// The standard's servo with a motor that has a brake, which 60FEh sets (bit 0) where the mask gives it to the host.
#[test]
fn a_brake_that_the_host_has_set_is_named() {
    let mut bench = Bench::with("cia402", &[("motor", "sgmah-04a-brake")]);
    bench.enable(3);
    bench.write(mux(0x60FE, 1), 1);
    bench.write(mux(0x60FF, 0), 20_000);
    let explained = bench.explain();
    assert!(!rules(&explained).contains(&"brake_set"), "without the mask the drive moves its brake: {explained:#?}");
    bench.write(mux(0x60FE, 2), 1);
    let explained = bench.explain();
    assert!(rules(&explained).contains(&"brake_set"), "{explained:#?}");
}

/// A plug without contact while the bus was listened to: nothing came, and the drive answers now.
#[test]
fn what_should_have_come_and_did_not_is_named() {
    for name in ["zlac8030l", "zlim42c", "cia402"] {
        let mut bench = Bench::new(name);
        let drive = bench.drive.clone();
        bench.write(mux(0x1017, 0), 200);
        let map = PdoMap(vec![MappingRecord { mux: mux(0x6041, 0), bits: 16 }]);
        let config = PdoConfig::new(pdo(Direction::Tpdo), map)
            .transmission(TransmissionType::EVENT_PROFILE)
            .event_time(Duration::from_millis(100));
        let units = TimerUnits::of(drive.description().unwrap());
        block_on(&mut bench.world, drive.node().configure_pdo(&config, units)).unwrap().unwrap();
        bench.nmt(NmtCommand::Start);
        let missing = ["heartbeat_missing", "pdo_missing"];
        let explained = bench.explain();
        assert!(!rules(&explained).iter().any(|rule| missing.contains(rule)), "{name}: {explained:#?}");
        bench.stimulus("bus silent on");
        let heard = bench.listen(|_| ());
        bench.stimulus("bus silent off");
        bench.world.run_for(Duration::from_millis(100));
        let explained = block_on(&mut bench.world, drive.explain(&heard)).unwrap();
        assert!(missing.iter().all(|rule| rules(&explained).contains(rule)), "{name}: {explained:#?}");
    }
}

/// The hub motor ends at 48 V over the published constant of its voltage, 0.7613 V s: V / sqrt(3) against 2/3 of Kt (docs/drives, L091).
#[test]
fn a_speed_beyond_the_supply_is_reported_with_the_voltage_and_what_is_reached() {
    let mut bench = Bench::new("zlac8030l");
    turn_at(&mut bench, 900);
    let explained = bench.explain();
    let finding_of_supply =
        explained.findings.iter().find(|finding| finding.rule == "supply_limit").expect("a finding");
    let reached = explained.speed_rpm.expect("a speed");
    let closed_form = 48.0 / 3.0_f64.sqrt() * 1.5 / 0.7613 * 60.0 / core::f64::consts::TAU;
    assert!((0.95..1.0).contains(&(reached / closed_form)), "{reached} of {closed_form} r/min");
    assert!(
        finding_of_supply.found.contains(" V, ") && finding_of_supply.found.contains(" A of 30.0 A"),
        "{finding_of_supply:?}"
    );
    assert!(finding_of_supply.remedy.contains(&format!("at most {reached:.0} r/min")), "{finding_of_supply:?}");
    // A load that takes all the current there is, a speed that is reached, one on its way, and one that 200Ah holds are not.
    type Prepare = fn(&mut Bench);
    let others: [(&str, Prepare); 4] = [
        ("a heavy load", |bench| {
            turn_at(bench, 300);
            bench.stimulus("load torque 40");
        }),
        ("reached", |bench| turn_at(bench, 450)),
        ("on its way", |bench| {
            bench.write(mux(0x6083, 0), 30_000);
            turn_at(bench, 900);
        }),
        ("held by 200Ah", |bench| {
            bench.write(mux(0x200A, 0), 300);
            turn_at(bench, 300);
        }),
    ];
    for (case, prepare) in others {
        let mut bench = Bench::new("zlac8030l");
        prepare(&mut bench);
        let explained = bench.explain();
        assert!(!rules(&explained).contains(&"supply_limit"), "{case}: {explained:#?}");
    }
}

#[test]
fn a_drive_that_moves_has_nothing_to_explain() {
    for name in ALL {
        let mut bench = Bench::new(name);
        let ramp = Some(Ramp::Time(Duration::from_millis(300)));
        let options = MotionOptions { acceleration: ramp, deceleration: ramp, ..MotionOptions::default() };
        let drive = bench.drive.clone();
        bench.nmt(NmtCommand::Start);
        bench.done(drive.guard(SwitchedOff::Leave));
        bench.done(drive.velocity(Rpm(40.0), options));
        bench.world.run_for(Duration::from_secs(1));
        let explained = bench.explain_while(|other| other.transmit(Frame::new(CanId::standard(0x080), &[])));
        assert_eq!(rules(&explained), [] as [&str; 0], "{name}: {explained:#?}");
        assert!(
            explained.speed_rpm.is_some_and(|speed| (speed - 40.0).abs() < 5.0),
            "{name}: {:?}",
            explained.speed_rpm
        );
    }
}

/// A PDO of the drive by its model's own rules, set up by this master.
fn pdo(direction: Direction) -> PdoId {
    PdoId { direction, number: PdoNumber::FIRST }
}

/// Maps the controlword into RPDO1, event-driven, and gives its identifier.
fn map_controlword(bench: &mut Bench) -> u16 {
    let drive = bench.drive.clone();
    let map = PdoMap(vec![MappingRecord { mux: CONTROLWORD, bits: 16 }]);
    let config = PdoConfig::new(pdo(Direction::Rpdo), map);
    let units = TimerUnits::of(drive.description().unwrap());
    let set_up = block_on(&mut bench.world, drive.node().configure_pdo(&config, units)).unwrap();
    set_up.unwrap_or_else(|error| panic!("{drive:?}: {error}"));
    let cob_id: u32 = bench.done(drive.node().read(mux(0x1400, 1)));
    (cob_id & 0x7FF) as u16
}

#[test]
fn a_controlword_that_others_send_by_rpdo_is_reported_with_its_value() {
    for name in ["zlac8030l", "zlim42c", "cia402"] {
        let mut bench = Bench::new(name);
        let id = map_controlword(&mut bench);
        bench.nmt(NmtCommand::Start);
        let explained = bench.explain_while(|other| other.transmit(Frame::new(CanId::standard(id), &[0x06, 0x00])));
        let seen = explained.findings.iter().find(|finding| finding.rule == "controlword_by_rpdo");
        let seen = seen.unwrap_or_else(|| panic!("{name}: {:?}", rules(&explained)));
        assert!(seen.found.contains("RPDO1") && seen.found.contains("0006h (shutdown)"), "{name}: {}", seen.found);
        assert!(seen.found.contains("bits 0, 3 are missing"), "{name}: {}", seen.found);
        // One byte where two are mapped.
        let explained = bench.explain_while(|other| other.transmit(Frame::new(CanId::standard(id), &[0x06])));
        assert!(rules(&explained).contains(&"pdo_too_short"), "{name}: {:?}", rules(&explained));
    }
}

#[test]
fn each_pdo_gives_the_reason_it_is_silent() {
    for name in ["zlac8030l", "zlim42c", "cia402"] {
        let mut bench = Bench::new(name);
        let drive = bench.drive.clone();
        map_controlword(&mut bench);
        bench.nmt(NmtCommand::EnterPreOperational);
        let explained = bench.explain();
        let rpdo = explained.pdos.iter().find(|seen| seen.pdo == pdo(Direction::Rpdo)).unwrap();
        assert!(rpdo.silent.as_deref().is_some_and(|why| why.contains("operational only")), "{name}: {rpdo:?}");
        bench.nmt(NmtCommand::Start);
        let rpdo = bench.explain().pdos.into_iter().find(|seen| seen.pdo == pdo(Direction::Rpdo)).unwrap();
        assert_eq!((rpdo.silent.as_deref(), rpdo.heard), (Some("no node was heard sending it"), 0), "{name}");
        let map = PdoMap(vec![MappingRecord { mux: mux(0x6041, 0), bits: 16 }]);
        let config = PdoConfig::new(pdo(Direction::Tpdo), map).transmission(TransmissionType::EVERY_SYNC);
        let units = TimerUnits::of(drive.description().unwrap());
        block_on(&mut bench.world, drive.node().configure_pdo(&config, units)).unwrap().unwrap();
        let explained = bench.explain();
        assert!(rules(&explained).contains(&"pdo_without_sync"), "{name}: {:?}", rules(&explained));
        let explained = bench.explain_while(|other| other.transmit(Frame::new(CanId::standard(0x080), &[])));
        let tpdo = explained.pdos.iter().find(|seen| seen.pdo == pdo(Direction::Tpdo)).unwrap();
        assert!(tpdo.silent.is_none() && tpdo.heard > 10, "{name}: {tpdo:?}");
        assert!(!rules(&explained).contains(&"pdo_without_sync"), "{name}: {:?}", rules(&explained));
        block_on(&mut bench.world, drive.node().switch_pdo_off(pdo(Direction::Tpdo))).unwrap().unwrap();
        let tpdo = bench.explain().pdos.into_iter().find(|seen| seen.pdo == pdo(Direction::Tpdo)).unwrap();
        assert!(!tpdo.valid && tpdo.silent.is_some_and(|why| why.contains("bit 31")), "{name}");
    }
}

#[test]
fn another_master_is_seen() {
    for name in ALL {
        let mut bench = Bench::new(name);
        // CiA 301, 7.2.4.3: an upload of 6041h as another client sends it; 7.2.8.3.1: pre-operational, to all.
        let request = Frame::new(CanId::standard(0x604), &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
        let explained = bench.explain_while(|other| other.transmit(request));
        assert!(rules(&explained).contains(&"other_master"), "{name}: {:?}", rules(&explained));
        let command = Frame::new(CanId::standard(0x000), &[128, 0]);
        let explained = bench.explain_while(|other| other.transmit(command));
        assert!(rules(&explained).contains(&"nmt_by_other"), "{name}: {:?}", rules(&explained));
        assert!(!rules(&explained).contains(&"other_master"), "{name}: {:?}", rules(&explained));
    }
}

#[test]
fn a_stopped_device_with_the_node_id_of_another_is_seen_by_its_heartbeats() {
    let mut bench = Bench::new("cia402");
    bench.write(mux(0x1017, 0), 1000);
    let from = bench.world.now() + Duration::from_millis(300);
    bench.world.add_station(StoppedTwin::of(4, from));
    let explained = bench.explain();
    assert!(rules(&explained).contains(&"node_twice"), "{:?}", rules(&explained));
    let finding = explained.findings.iter().find(|finding| finding.rule == "node_twice").unwrap();
    assert!(finding.found.contains("in turn, without a command"), "{finding:?}");
}

#[test]
fn heartbeats_of_two_devices_under_one_number_are_seen() {
    let mut bench = Bench::new("cia402");
    bench.write(mux(0x1017, 0), 500);
    let twin = Frame::new(CanId::standard(0x704), &[0x7F]);
    assert!(!rules(&bench.explain()).contains(&"node_twice"));
    let explained = bench.explain_while(|other| other.transmit(twin));
    assert!(rules(&explained).contains(&"node_twice"), "{:?}", rules(&explained));
}

#[test]
fn explaining_writes_nothing() {
    for name in ALL {
        let mut bench = Bench::new(name);
        bench.enable(3);
        let heard = bench.listen(|_| ());
        while bench.world.log_mut().pull().is_some() {}
        let drive = bench.drive.clone();
        block_on(&mut bench.world, drive.explain(&heard)).unwrap();
        let frames = std::iter::from_fn(|| bench.world.log_mut().pull()).filter_map(|event| match event {
            WireEvent::Frame { frame, .. } => Some(frame),
            _ => None,
        });
        let asked = frames.filter(|frame| frame.standard_data_id() == Some(0x604)).map(|frame| frame.to_string());
        let requests: Vec<String> = asked.collect();
        // CiA 301, 7.2.4.3.5: an initiate upload, or a segment of one (60h, 70h).
        let reads =
            |frame: &String| frame.starts_with("604#40") || frame.starts_with("604#60") || frame.starts_with("604#70");
        assert!(requests.len() > 20 && requests.iter().all(reads), "{name}: {requests:?}");
    }
}

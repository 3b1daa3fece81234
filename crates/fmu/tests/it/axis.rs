//! A drive with a master of its own: against the same drive and master in a world, and by the law of stopping.

use std::f64::consts::PI;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use cia402::ModeOfOperation;
use ferrodrive_fmu::config::{AxisConfig, Config, ConfigError, DriveConfig, TargetKind};
use ferrodrive_fmu::instance::{Instance, Mode};
use ferrodrive_fmu::state::SavedState;
use ferrodrive_fmu::variable::{Causality, Value};
use ferrodrive_fmu::xml;
use master::cyclic::{CyclicDrive, CyclicOptions, Demand};
use master::units::Rpm;
use master::{Drive, Network};
use sim::machine::{Order, TimingMode, order};
use sim::{BlockOnError, World, block_on, block_on_for};

use crate::importer::named;

pub(crate) fn axis(spec: &str, mode: TargetKind) -> Config {
    Config::Axis(AxisConfig { mode, drive: DriveConfig::new(spec) })
}

/// An axis that is stepped by 1 ms, its variables by their names.
pub(crate) struct Stepped {
    pub(crate) instance: Instance,
    ms: u32,
}

impl Stepped {
    fn new(spec: &str, mode: TargetKind) -> Self {
        let mut instance = Instance::of(axis(spec, mode), ".".as_ref(), false).unwrap();
        instance.enter_initialization(0.0).unwrap();
        instance.exit_initialization().unwrap();
        Self { instance, ms: 0 }
    }

    fn reference(&self, name: &str) -> u32 {
        named(&self.instance, name)
    }

    pub(crate) fn set(&mut self, name: &str, value: Value) {
        self.instance.set(self.reference(name), value).unwrap();
    }

    pub(crate) fn get(&mut self, name: &str) -> Value {
        self.instance.get(self.reference(name)).unwrap()
    }

    fn real(&mut self, name: &str) -> f64 {
        let Value::Float64(value) = self.get(name) else { panic!("{name}") };
        value
    }

    fn is(&mut self, name: &str) -> bool {
        self.get(name) == Value::Boolean(true)
    }

    fn enable(&mut self, enable: bool) {
        self.set("enable", Value::Boolean(enable));
    }

    /// To this time of its own.
    fn run_to(&mut self, ms: u32) {
        while self.ms < ms {
            self.instance.step(f64::from(self.ms) * 1e-3, 1e-3).unwrap();
            self.ms += 1;
        }
    }

    fn all(&mut self) -> Vec<Value> {
        let variables = self.instance.variables().to_vec();
        variables.iter().map(|variable| self.instance.get(variable.reference).unwrap()).collect()
    }
}

/// Enabled and turning with 60 r/min.
fn turning(until_ms: u32) -> Stepped {
    let mut wheel = Stepped::new("zlac8030l@4,timing=ideal", TargetKind::Velocity);
    wheel.enable(true);
    wheel.set("target_velocity", Value::Float64(2.0 * PI));
    wheel.run_to(until_ms);
    assert!((wheel.real("velocity") - 2.0 * PI).abs() < 0.1, "{}", wheel.real("velocity"));
    wheel
}

/// What a program of the project's own master does with the same drive: at these times in ms, as the importer below.
struct Program {
    world: World,
    network: Network,
    wheel: CyclicDrive,
    off_since: Option<Instant>,
    /// Until SYNC has begun.
    period: Option<Duration>,
}

const ENABLED: u64 = 1_700;
const TURNS: u64 = 1_900;
const LOADED: u64 = 2_500;
const OFF: u64 = 3_001;

impl Program {
    fn new() -> Self {
        let model = devices::model("zlac8030l").unwrap();
        let node = NodeId::new(4).unwrap();
        let mut world = World::new(Bitrate::K500, 1);
        world.set_timing(TimingMode::Device);
        let network = Network::new();
        world.add_station(network.clone());
        world.add_drive(4, order(model, &Order::new(model, node, Bitrate::K500)).unwrap()).unwrap();
        let drive = Drive::new(network.node(node), model);
        let opened = block_on(&mut world, async {
            drive.node().wait_boot_up(Duration::from_secs(10)).await.unwrap();
            drive.configure_cyclic(ModeOfOperation::PROFILE_VELOCITY).await.unwrap();
            drive.cyclic(ModeOfOperation::PROFILE_VELOCITY, CyclicOptions::default()).await.unwrap()
        });
        let wheel = opened.unwrap();
        Self { world, network, wheel, off_since: None, period: Some(Duration::from_millis(2)) }
    }

    fn run_to(&mut self, ms: u64) {
        let Self { world, network, wheel, off_since, period } = self;
        let cycles = async {
            // Here, and not when it was opened: the first SYNC would pass before anything waits for it.
            if let Some(period) = period.take() {
                network.sync(Some(period));
            }
            loop {
                network.next_sync().await.unwrap();
                network.exchange(|io| {
                    let now = io.now();
                    let demand = if now > Instant::from_millis(OFF) {
                        let since = *off_since.get_or_insert(now);
                        let stands = matches!(wheel.at_rest(now - since), Some(Ok(())));
                        if stands { Demand::Off } else { Demand::QuickStop }
                    } else if now > Instant::from_millis(TURNS) {
                        Demand::Velocity(Rpm(2.0 * PI * 30.0 / PI))
                    } else if now > Instant::from_millis(ENABLED) {
                        Demand::Velocity(Rpm(0.0))
                    } else {
                        Demand::Off
                    };
                    wheel.step(io, demand);
                });
            }
        };
        let end = Instant::from_millis(ms) - world.now();
        let ended: Result<(), _> = block_on_for(world, end, cycles);
        assert!(matches!(ended, Err(BlockOnError::OutOfTime { .. })));
    }
}

#[test]
fn an_axis_is_the_drive_and_the_master_of_a_world() {
    let mut program = Program::new();
    let mut wheel = Stepped::new("zlac8030l@4", TargetKind::Velocity);
    for ms in [1_701, 1_950, 2_400, 2_900, 3_050, 4_000] {
        for at in [ENABLED, TURNS, LOADED, OFF] {
            if u64::from(wheel.ms) < at && at <= ms {
                wheel.run_to(at as u32);
                match at {
                    ENABLED => wheel.enable(true),
                    TURNS => wheel.set("target_velocity", Value::Float64(2.0 * PI)),
                    OFF => wheel.enable(false),
                    _ => {}
                }
                // A load that stays would turn the wheel once it has no power.
                if let LOADED | OFF = at {
                    let torque_nm = if at == LOADED { 2.0 } else { 0.0 };
                    program.run_to(at);
                    program.world.with_drive(4, |drive, now| drive.set_load_torque(torque_nm, now)).unwrap().unwrap();
                    wheel.set("load_torque", Value::Float64(torque_nm));
                }
            }
        }
        wheel.run_to(ms as u32);
        program.run_to(ms);
        let report = program.world.report(4).unwrap();
        let physics = report.physics.as_ref().unwrap();
        for (name, expected) in [
            ("angle", report.shaft_angle_rad),
            ("velocity", report.velocity_rpm * PI / 30.0),
            ("current", report.current_a),
            ("torque", physics.motor_torque_nm),
            ("bus_voltage", report.supply_v),
            ("winding_temperature", physics.winding_c),
        ] {
            assert_eq!(wheel.real(name).to_bits(), expected.to_bits(), "{name} at {ms} ms");
        }
        assert_eq!(wheel.get("statusword"), Value::UInt16(report.statusword.unwrap()), "at {ms} ms");
        match ms {
            2_900 => {
                assert!((wheel.real("velocity") - 2.0 * PI).abs() < 0.1, "{}", wheel.real("velocity"));
                assert!((wheel.real("actual_velocity") - 2.0 * PI).abs() < 0.2);
                assert!(wheel.is("ready") && wheel.is("follows"));
            }
            4_000 => {
                assert!(wheel.real("velocity").abs() < 0.01);
                assert!(!wheel.is("follows"));
            }
            _ => {}
        }
    }
}

#[test]
fn a_target_moves_nothing_without_enable() {
    let mut wheel = Stepped::new("zlac8030l@4,timing=ideal", TargetKind::Velocity);
    let at = wheel.real("angle");
    wheel.set("target_velocity", Value::Float64(10.0));
    wheel.run_to(1_000);
    assert!(wheel.is("ready"));
    assert_eq!((wheel.real("angle"), wheel.is("follows")), (at, false));
    // Neither after it was enabled once, nor while it is being stopped.
    wheel.enable(true);
    wheel.run_to(1_600);
    assert!(wheel.is("follows") && wheel.real("velocity") > 9.0);
    wheel.enable(false);
    wheel.set("target_velocity", Value::Float64(-20.0));
    let mut before = wheel.real("velocity");
    for ms in 1_601..2_600 {
        wheel.run_to(ms);
        let velocity = wheel.real("velocity");
        assert!(velocity > -0.1 && velocity < before + 0.1, "{velocity} after {before} at {ms} ms");
        before = velocity;
    }
    assert!(before.abs() < 0.01, "{before}");
}

/// Quick stop and `enable` false end a motion within the ramp of a quick stop; without power a wheel would coast for seconds.
#[test]
fn enable_and_stop_bring_it_to_rest_and_a_stop_is_kept_until_enable_is_off() {
    for input in ["enable", "stop"] {
        let mut wheel = turning(1_500);
        wheel.set(input, Value::Boolean(input == "stop"));
        wheel.run_to(2_200);
        assert!(wheel.real("velocity").abs() < 0.01, "{input}: {}", wheel.real("velocity"));
        if input == "stop" {
            let Value::String(why) = wheel.get("refusal") else { panic!() };
            assert!(why.contains("moves again when enable has been false"), "{why}");
            wheel.set("stop", Value::Boolean(false));
            wheel.run_to(3_000);
            assert!(wheel.real("velocity").abs() < 0.01 && !wheel.is("follows"));
            wheel.enable(false);
            wheel.run_to(3_200);
        }
        wheel.enable(true);
        wheel.run_to(4_000);
        assert!((wheel.real("velocity") - 2.0 * PI).abs() < 0.1, "{input}: {}", wheel.real("velocity"));
    }
}

/// A drive whose supply fails and comes back boots anew, and does not move by itself.
#[test]
fn a_drive_that_was_without_supply_waits_for_enable() {
    let mut wheel = turning(1_500);
    wheel.set("supply_on", Value::Boolean(false));
    wheel.run_to(3_500);
    assert!(!wheel.is("ready") && !wheel.is("powered"));
    wheel.set("supply_on", Value::Boolean(true));
    wheel.run_to(6_000);
    assert!(wheel.is("ready") && !wheel.is("follows"), "{:?}", wheel.get("refusal"));
    assert!(wheel.real("velocity").abs() < 0.01);
    wheel.enable(false);
    wheel.run_to(6_100);
    wheel.enable(true);
    wheel.run_to(7_000);
    assert!((wheel.real("velocity") - 2.0 * PI).abs() < 0.1, "{}", wheel.real("velocity"));
}

/// The importer's time stands at the end, and with it all that can be read: also of a drive that moves.
#[test]
fn the_end_changes_nothing_that_can_be_read() {
    let mut wheel = turning(1_500);
    let before = wheel.all();
    wheel.instance.terminate().unwrap();
    assert_eq!(wheel.instance.mode(), Mode::Terminated);
    assert_eq!(wheel.all(), before);
}

#[test]
fn an_axis_goes_on_from_its_state_and_from_its_bytes() {
    // In the middle of a request of its master, and in cycles.
    for begin in [700, 1_500] {
        let mut wheel = Stepped::new("zlac8030l@4,timing=ideal", TargetKind::Velocity);
        wheel.enable(true);
        wheel.set("target_velocity", Value::Float64(3.0));
        wheel.run_to(begin);
        let state = SavedState::of(&wheel.instance).unwrap();
        let bytes = state.bytes().unwrap();
        let onward = |wheel: &mut Stepped| {
            wheel.ms = begin;
            wheel.set("load_torque", Value::Float64(1.0));
            wheel.run_to(begin + 800);
            wheel.all()
        };
        let expected = onward(&mut wheel);
        let mut other = Stepped::new("zlac8030l@4,timing=ideal", TargetKind::Velocity);
        for taken in [&state, &SavedState::from_bytes(&bytes, &other.instance).unwrap()] {
            taken.restore(&mut other.instance).unwrap();
            assert_eq!(onward(&mut other), expected);
        }
        assert!((wheel.real("velocity") - 3.0).abs() < 0.1, "{}", wheel.real("velocity"));
    }
}

#[test]
fn an_arm_joint_follows_a_path_and_holds_before_a_jump() {
    let mut joint = Stepped::new("m4230e17b50@5,timing=ideal", TargetKind::Position);
    joint.run_to(1_000);
    let from = joint.real("actual_position");
    joint.set("target_position", Value::Float64(from));
    joint.enable(true);
    joint.run_to(1_500);
    assert!(joint.is("follows"), "{:?}", joint.get("refusal"));
    for ms in 1_500..2_500_u32 {
        let swing = 0.1 * (1.0 - (2.0 * PI * f64::from(ms - 1_500) * 1e-3).cos());
        joint.set("target_position", Value::Float64(from + swing));
        joint.run_to(ms + 1);
        assert!((joint.real("actual_position") - from - swing).abs() < 0.02, "at {ms} ms");
    }
    joint.set("target_position", Value::Float64(from + 2.0));
    joint.run_to(2_600);
    let Value::String(why) = joint.get("refusal") else { panic!() };
    assert!(why.contains("more than the") && why.contains("held instead"), "{why}");
    assert!((joint.real("actual_position") - from).abs() < 0.02);
}

#[test]
fn a_current_turns_a_wheel_that_is_free() {
    let mut wheel = Stepped::new("zlac8030l@4,timing=ideal", TargetKind::Torque);
    wheel.enable(true);
    wheel.set("target_current", Value::Float64(1.0));
    while !wheel.is("follows") {
        wheel.run_to(wheel.ms + 1);
    }
    let begin = wheel.ms;
    // 6087h, torque slope: 300 mA/s as delivered.
    for (ms, current_a) in [(200, 0.06), (400, 0.12), (800, 0.24)] {
        wheel.run_to(begin + ms);
        assert!((wheel.real("current") - current_a).abs() < 0.02, "{} after {ms} ms", wheel.real("current"));
    }
    assert!(wheel.real("velocity") > 0.3);
}

#[test]
fn what_cannot_be_led_is_refused_when_it_is_made() {
    let refusal = |spec: &str, mode| match Instance::of(axis(spec, mode), ".".as_ref(), false) {
        Err(error) => error,
        Ok(_) => panic!("{spec}"),
    };
    let no_mode = refusal("zlac8030l@4", TargetKind::Position);
    assert!(matches!(no_mode, ConfigError::NoMode("zlac8030l", "position")), "{no_mode}");
    assert!(refusal("cia402@4,node-id=none", TargetKind::Velocity).to_string().contains("LSS"));
}

/// FMI 2.0.5, 2.2.7: a start for each input and parameter and for no output; indices from 1 in the order of the variables.
#[test]
fn the_description_lists_variables_by_fmi_2() {
    let config = axis("zlac8030l@4", TargetKind::Velocity);
    let instance = Instance::of(config.clone(), ".".as_ref(), false).unwrap();
    let unit = ferrodrive_fmu::unit::Unit::new(&config, ".".as_ref()).unwrap();
    let text = xml::model_description(&config, ".".as_ref(), &unit);
    let outputs: Vec<_> = (1..)
        .zip(instance.variables())
        .filter(|(_, it)| it.causality == Causality::Output)
        .map(|(index, _)| format!("<Unknown index=\"{index}\"/>"))
        .collect();
    let listed = text.split("<Outputs>").nth(1).unwrap().split("</Outputs>").next().unwrap();
    assert_eq!(listed.split_whitespace().collect::<String>(), outputs.concat().replace(' ', ""));
    let rows: Vec<_> = text.lines().filter(|line| line.contains("<ScalarVariable ")).collect();
    assert_eq!(rows.len(), instance.variables().len());
    for row in rows {
        assert_eq!(row.contains(" start="), !row.contains("causality=\"output\""), "{row}");
    }
}

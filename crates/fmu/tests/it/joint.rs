//! The other form, motion in and torque out: to the last bit what a world's exchange gives, by closed forms, and what is refused.

use can::{Bitrate, Frame, Instant, frame_bits};
use ferrodrive_fmu::config::{AxisConfig, Config, DriveConfig, TargetKind, TxClock};
use ferrodrive_fmu::instance::Instance;
use ferrodrive_fmu::operation::Operation;
use ferrodrive_fmu::state::SavedState;
use ferrodrive_fmu::unit::Unit;
use ferrodrive_fmu::variable::Value;
use ferrodrive_fmu::xml;
use sim::machine::TimingMode;
use sim::{CoupledShaft, Coupling, ExternalModel, Given, LoadPart, Place, Rule, StationId, Stimulus, World};
use std::time::Duration;
use words::drive::drive_spec;

use crate::importer::{Importer, named};

const DT: Duration = Duration::from_millis(1);
const DT_S: f64 = 1e-3;
/// What the importer has behind the joint, kg·m².
const WHEEL: f64 = 0.05;

fn config(spec: &str, rule: Rule) -> DriveConfig {
    DriveConfig { rule, ..DriveConfig::new(spec) }
}

/// An FMU that is stepped by as much as the importer likes, its variables by their names.
struct Stepped {
    instance: Instance,
    now_s: f64,
}

impl Stepped {
    fn of(config: Config) -> Self {
        let mut instance = Instance::of(config, ".".as_ref(), false).unwrap();
        instance.enter_initialization(0.0).unwrap();
        instance.exit_initialization().unwrap();
        Self { instance, now_s: 0.0 }
    }

    fn drive(spec: &str, rule: Rule) -> Self {
        Self::of(Config::Drive(config(spec, rule)))
    }

    fn set(&mut self, name: &str, value: f64) {
        self.instance.set(named(&self.instance, name), Value::Float64(value)).unwrap();
    }

    fn real(&mut self, name: &str) -> f64 {
        let Value::Float64(value) = self.instance.get(named(&self.instance, name)).unwrap() else { panic!("{name}") };
        value
    }

    fn step(&mut self, step_s: f64) {
        self.instance.step(self.now_s, step_s).unwrap();
        self.now_s += step_s;
    }

    /// A step of the joint: where it is goes in, the torque at it comes out.
    fn exchange(&mut self, step_s: f64, (angle_rad, velocity_rad_s): (f64, f64)) -> f64 {
        self.set("joint_angle", angle_rad);
        self.set("joint_velocity", velocity_rad_s);
        self.step(step_s);
        self.real("joint_torque")
    }

    fn send(&mut self, frame: Frame) {
        let mut bytes = Vec::new();
        Operation::Transmit(frame).write(&mut bytes);
        self.instance.set(2, Value::Binary(bytes)).unwrap();
    }

    fn all(&mut self) -> Vec<Value> {
        let variables = self.instance.variables().to_vec();
        variables.iter().map(|variable| self.instance.get(variable.reference).unwrap()).collect()
    }
}

/// The importer's joint: a mass with the drive's inertia, and a spring to an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Joint {
    angle_rad: f64,
    velocity_rad_s: f64,
    inertia_kg_m2: f64,
    stiffness_nm_rad: f64,
    rest_rad: f64,
}

impl Joint {
    fn motion(&self) -> (f64, f64) {
        (self.angle_rad, self.velocity_rad_s)
    }

    /// Half a kick, a drift, half a kick: by itself it keeps its energy.
    fn step(&mut self, step_s: f64, torque_nm: f64) {
        self.kick(0.5 * step_s, torque_nm);
        self.angle_rad += self.velocity_rad_s * step_s;
        self.kick(0.5 * step_s, torque_nm);
    }

    fn kick(&mut self, time_s: f64, torque_nm: f64) {
        let spring_nm = self.stiffness_nm_rad * (self.rest_rad - self.angle_rad);
        self.velocity_rad_s += time_s * (torque_nm + spring_nm) / self.inertia_kg_m2;
    }
}

/// The same drive in a world, with a host on its bus.
fn world(spec: &str, rule: Option<Rule>) -> (World, StationId) {
    let spec = drive_spec(spec).ok().unwrap();
    let mut world = World::new(Bitrate::K500, 1);
    world.set_timing(spec.timing.unwrap_or(TimingMode::Device));
    let number = spec.node.raw();
    world.add_drive(number, sim::machine::order(spec.model, &spec.order(Bitrate::K500)).unwrap()).unwrap();
    if let Some(rule) = rule {
        let model = ExternalModel::new(rule, &[(0.0, 0.0)]).unwrap();
        world.couple("joint", &Coupling::External(model), &[CoupledShaft::direct(Place::node(number))]).unwrap();
    }
    let host = world.add_probe();
    (world, host)
}

/// Each frame comes in at the begin of a step of the FMU. In the world it is sent as long before as it takes on the wire.
fn script() -> Vec<(u64, Frame)> {
    let lines = [
        (1_600, "604#2F60600003000000"),
        (1_610, "604#2B40600006000000"),
        (1_620, "604#2B40600007000000"),
        (1_630, "604#2B4060000F000000"),
        (1_640, "604#23FF60003C000000"),
        (1_900, "604#2B4060000F010000"),
    ];
    lines.into_iter().map(|(ms, text)| (ms, text.parse().unwrap())).collect()
}

#[test]
fn motion_in_and_torque_out_is_a_worlds_exchange_to_the_last_bit() {
    for (spec, rule) in [
        ("zlac8030l@4", Rule::Integrate),
        ("zlac8030l@4", Rule::Hold),
        ("zlac8030l@4", Rule::Interpolate),
        ("zlac8030l@4,fidelity=mechanical", Rule::Integrate),
    ] {
        let mut wheel = Stepped::drive(spec, rule);
        let (mut world, host) = world(spec, Some(rule));
        let inertia_kg_m2 = WHEEL + wheel.real("joint_inertia");
        assert_eq!(inertia_kg_m2, WHEEL + world.external_shafts()[0].inertia_kg_m2);
        let mut joint = Joint { inertia_kg_m2, ..Joint::default() };
        let mut frames = script().into_iter().peekable();
        for ms in 0..2_100_u64 {
            let ([angle], [velocity]) = ([joint.angle_rad], [joint.velocity_rad_s]);
            world.begin_exchange(DT, Given::Motion(&[angle], &[velocity])).unwrap();
            let end = Instant::from_millis(ms + 1);
            if let Some((_, frame)) = frames.next_if(|(at, _)| *at == ms + 1) {
                let wire_ns = u64::from(frame_bits(&frame)) * Bitrate::K500.bit_nanos();
                world.run_until(Instant::from_nanos(end.as_nanos() - wire_ns));
                world.send(host, frame).unwrap();
            }
            world.run_until(end);
            let mut expected = [0.0];
            world.read_torques(&mut expected);
            if let Some((_, frame)) = script().into_iter().find(|(at, _)| *at == ms) {
                wheel.send(frame);
            }
            let torque_nm = wheel.exchange(DT_S, joint.motion());
            assert_eq!(
                torque_nm.to_bits(),
                expected[0].to_bits(),
                "{spec} {rule:?} at {ms} ms: {torque_nm} {expected:?}"
            );
            joint.step(DT_S, torque_nm);
        }
        let report = world.report(4).unwrap();
        assert_eq!(wheel.real("angle").to_bits(), report.shaft_angle_rad.to_bits(), "{spec} {rule:?}");
        assert_eq!(wheel.real("current").to_bits(), report.current_a.to_bits(), "{spec} {rule:?}");
        // 60 r/min for a quarter of a second are a radian and a half, less what the ramp takes; then it is halted.
        assert!((0.7..1.9).contains(&joint.angle_rad), "{spec} {rule:?}: {joint:?}");
    }
}

/// Behind a reducer, with a stepper, of a described servo: whatever has a shaft. What has none is refused when it is packed.
#[test]
fn every_model_with_a_shaft_takes_a_joint() {
    for spec in ["m4230e17b50@4", "zlim42c@4", "cia402@4"] {
        let mut wheel = Stepped::drive(spec, Rule::Integrate);
        let (mut world, _) = world(spec, Some(Rule::Integrate));
        let inertia_kg_m2 = 2.0 * wheel.real("joint_inertia");
        assert!(inertia_kg_m2 > 0.0, "{spec}");
        let stiffness_nm_rad = 400.0 * inertia_kg_m2;
        let mut joint = Joint { inertia_kg_m2, stiffness_nm_rad, rest_rad: 1.0, ..Joint::default() };
        for step in 0..300 {
            let mut expected = [0.0];
            world.exchange(DT, (&[joint.angle_rad], &[joint.velocity_rad_s]), &mut expected).unwrap();
            let torque_nm = wheel.exchange(DT_S, joint.motion());
            assert_eq!(torque_nm.to_bits(), expected[0].to_bits(), "{spec} step {step}: {torque_nm} {expected:?}");
            joint.step(DT_S, torque_nm);
        }
        assert!(joint.angle_rad != 0.0, "{spec}: {joint:?}");
    }
    for spec in ["io401@5", "encoder406@5"] {
        let error = Unit::new(&Config::Drive(config(spec, Rule::Hold)), ".".as_ref()).err().unwrap().to_string();
        assert!(error.contains("drive 5 moves no shaft"), "{error}");
    }
}

/// A torsion spring at a drive that is not enabled, in three ways: the world's own load, by its torque, and as the importer's joint.
#[test]
fn both_forms_swing_as_the_worlds_own_spring() {
    const SPRING_NM_RAD: f64 = 0.5;
    const STEP_S: f64 = 0.25e-3;
    let spec = "zlac8030l@4,timing=ideal";
    let (mut world, _) = world(spec, None);
    let spring = LoadPart::Spring { stiffness_nm_rad: SPRING_NM_RAD, rest_deg: 1_f64.to_degrees() };
    world.apply(Place::node(4), &Stimulus::Load(spring)).unwrap().unwrap();
    let mut by_torque = Stepped::drive(spec, Rule::Torque);
    let mut by_motion = Stepped::drive(spec, Rule::Integrate);
    let inertia_kg_m2 = by_motion.real("joint_inertia");
    let mut joint = Joint { inertia_kg_m2, stiffness_nm_rad: SPRING_NM_RAD, rest_rad: 1.0, ..Joint::default() };
    let mut furthest_rad = 0.0_f64;
    for step in 1..=4_000_u64 {
        world.run_until(Instant::from_nanos(step * 250_000));
        let angle_rad = by_torque.real("angle");
        by_torque.set("load_torque", SPRING_NM_RAD * (angle_rad - 1.0));
        by_torque.step(STEP_S);
        let torque_nm = by_motion.exchange(STEP_S, joint.motion());
        joint.step(STEP_S, torque_nm);
        let expected = world.report(4).unwrap().shaft_angle_rad;
        furthest_rad = furthest_rad.max(expected);
        for (form, angle) in [("torque", by_torque.real("angle")), ("motion", joint.angle_rad)] {
            assert!((angle - expected).abs() < 0.01, "{form} in, step {step}: {angle} rad, expected {expected}");
        }
        assert!((by_motion.real("angle") - joint.angle_rad).abs() < 1e-3, "step {step}");
    }
    // Beyond the middle, and held by its friction of 0.1 N·m on the way back.
    assert!(furthest_rad > 1.4, "{furthest_rad}");
}

/// Dry friction takes as much of a swing in each half of it (closed form), viscous friction a share; figures of the motor alone.
#[test]
fn a_swing_outside_decays_by_the_drives_friction() {
    let (stiffness_nm_rad, spec) = (4.0, "zlac8030l@4,timing=ideal");
    let drive = drive_spec(spec).ok().unwrap();
    let drive = sim::machine::order(drive.model, &drive.order(Bitrate::K500)).unwrap();
    let rotor = drive.motor(sim::AxisId::FIRST).unwrap().rotor;
    for (rule, step_s) in [(Rule::Integrate, 1e-3), (Rule::Hold, 1e-3), (Rule::Integrate, 0.33e-3)] {
        let mut wheel = Stepped::drive(spec, rule);
        let inertia_kg_m2 = WHEEL + wheel.real("joint_inertia");
        let mut joint = Joint { inertia_kg_m2, stiffness_nm_rad, rest_rad: 0.5, ..Joint::default() };
        let omega = (stiffness_nm_rad / inertia_kg_m2).sqrt();
        let damping = 0.5 * rotor.viscous_nm_s / (inertia_kg_m2 * omega);
        let left = (-damping * std::f64::consts::PI / (1.0 - damping * damping).sqrt()).exp();
        let (mut swing_rad, dry_rad) = (0.5, rotor.coulomb_nm / stiffness_nm_rad);
        for half in 1..=6 {
            let forward = half % 2 == 1;
            loop {
                let torque_nm = wheel.exchange(step_s, joint.motion());
                joint.step(step_s, torque_nm);
                let beyond = (joint.angle_rad - joint.rest_rad) * if forward { 1.0 } else { -1.0 };
                if beyond > 0.0 && (joint.velocity_rad_s > 0.0) != forward {
                    break;
                }
            }
            swing_rad = (swing_rad - dry_rad) * left - dry_rad;
            let reached_rad = (joint.angle_rad - joint.rest_rad).abs();
            assert!(
                (reached_rad - swing_rad).abs() < 0.005,
                "{rule:?} {half}: {reached_rad} rad, expected {swing_rad}"
            );
        }
        assert!(swing_rad < 0.25, "{swing_rad}");
    }
}

/// From countdown to countdown its steps have any length; it leads the importer's wheel as one that is stepped by the millisecond.
#[test]
fn a_drive_on_a_bus_leads_a_joint_through_steps_of_any_length() {
    let frames: Vec<_> = script().into_iter().take(5).map(|(ms, frame)| (ms * 1_000_000 + 137, frame)).collect();
    let mut importer = Importer::of(&[config("zlac8030l@4", Rule::Integrate)], frames);
    let [angle, velocity, torque, inertia] =
        ["joint_angle", "joint_velocity", "joint_torque", "joint_inertia"].map(|name| named(&importer.drives[0], name));
    let Value::Float64(own) = importer.drives[0].get(inertia).unwrap() else { panic!() };
    let mut joint = Joint { inertia_kg_m2: WHEEL + own, ..Joint::default() };
    let mut lengths = std::collections::BTreeSet::new();
    importer.run_with(Instant::from_millis(2_400), 1_000_000, |drives, step_ns| {
        let Value::Float64(torque_nm) = drives[0].get(torque).unwrap() else { panic!() };
        joint.step(step_ns as f64 * 1e-9, torque_nm);
        lengths.insert(step_ns);
        drives[0].set(angle, Value::Float64(joint.angle_rad)).unwrap();
        drives[0].set(velocity, Value::Float64(joint.velocity_rad_s)).unwrap();
    });
    assert!(lengths.iter().any(|step_ns| step_ns % 50_000 != 0), "{lengths:?}");
    assert!((joint.velocity_rad_s / std::f64::consts::TAU - 1.0).abs() < 0.02, "60 r/min, not {joint:?}");
    let Value::Float64(shaft_rad) = importer.drives[0].get(200).unwrap() else { panic!() };
    assert!((shaft_rad - joint.angle_rad).abs() < 0.01, "{shaft_rad} rad, expected {}", joint.angle_rad);
}

/// By FMI 2.0: the master leads the importer's wheel by numbers, and its quick stop is the importer's, too.
#[test]
fn a_drive_with_a_master_leads_a_joint_and_stops_it() {
    let drive = config("zlac8030l@4,timing=ideal", Rule::Integrate);
    let mut wheel = Stepped::of(Config::Axis(AxisConfig { mode: TargetKind::Velocity, drive }));
    let enable = named(&wheel.instance, "enable");
    let mut joint = Joint { inertia_kg_m2: WHEEL + wheel.real("joint_inertia"), ..Joint::default() };
    wheel.set("target_velocity", std::f64::consts::TAU);
    for ms in 0..3_500 {
        match ms {
            500 => wheel.instance.set(enable, Value::Boolean(true)).unwrap(),
            2_500 => {
                assert!((joint.velocity_rad_s / std::f64::consts::TAU - 1.0).abs() < 0.02, "{joint:?}");
                assert!((wheel.real("actual_velocity") - joint.velocity_rad_s).abs() < 0.2);
                wheel.instance.set(enable, Value::Boolean(false)).unwrap();
            }
            _ => {}
        }
        let torque_nm = wheel.exchange(DT_S, joint.motion());
        joint.step(DT_S, torque_nm);
        assert!(ms > 500 || joint.angle_rad == 0.0, "it moves without enable: {joint:?}");
    }
    assert!(joint.velocity_rad_s.abs() < 0.01, "{joint:?}");
}

#[test]
fn a_joint_goes_on_from_its_state_and_from_its_bytes() {
    let drive = || config("zlac8030l@4,timing=ideal", Rule::Integrate);
    let axis = Config::Axis(AxisConfig { mode: TargetKind::Velocity, drive: drive() });
    for config in [Config::Drive(drive()), axis] {
        let mut wheel = Stepped::of(config.clone());
        let new = wheel.all();
        let mut joint = Joint { inertia_kg_m2: 0.1, stiffness_nm_rad: 4.0, rest_rad: 0.5, ..Joint::default() };
        let swing = |wheel: &mut Stepped, joint: &mut Joint, steps: u32| {
            for _ in 0..steps {
                let torque_nm = wheel.exchange(DT_S, joint.motion());
                joint.step(DT_S, torque_nm);
            }
        };
        swing(&mut wheel, &mut joint, 150);
        let (state, before, at_s) = (SavedState::of(&wheel.instance).unwrap(), joint, wheel.now_s);
        let bytes = state.bytes().unwrap();
        swing(&mut wheel, &mut joint, 100);
        let expected = (wheel.all(), joint);
        assert!(joint.velocity_rad_s.abs() > 0.1 && wheel.real("joint_torque") != 0.0, "{joint:?}");
        let read = SavedState::from_bytes(&bytes, &Stepped::of(config).instance).unwrap();
        for taken in [&state, &read] {
            taken.restore(&mut wheel.instance).unwrap();
            (joint, wheel.now_s) = (before, at_s);
            swing(&mut wheel, &mut joint, 100);
            assert_eq!((wheel.all(), joint), expected);
        }
        wheel.instance.reset().unwrap();
        wheel.instance.enter_initialization(0.0).unwrap();
        wheel.instance.exit_initialization().unwrap();
        assert_eq!(wheel.all(), new);
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_no_time_passes() {
    let mut wheel = Stepped::drive("zlac8030l@4,timing=ideal", Rule::Integrate);
    wheel.exchange(DT_S, (0.001, 1.0));
    let [angle, velocity, inertia] =
        ["joint_angle", "joint_velocity", "load_inertia"].map(|name| named(&wheel.instance, name));
    let before = wheel.all();
    let refused = |called: Result<(), ferrodrive_fmu::call::CallError>, said: &str| {
        let error = called.unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    };
    refused(wheel.instance.set(angle, Value::Float64(f64::NAN)), "joint_angle cannot be NaN");
    refused(wheel.instance.set(angle, Value::Float64(1e7)), "expected a number from -1e6 to 1e6");
    refused(
        wheel.instance.set(velocity, Value::Float64(-1e9)),
        "joint_velocity: the velocity of joint 1 is -1000000000",
    );
    refused(wheel.instance.set(inertia, Value::Float64(0.1)), "load_inertia is a parameter");
    refused(wheel.instance.set(10, Value::Float64(1.0)), "variable 10 does not exist");
    refused(wheel.instance.get(10).map(drop), "variable 10 does not exist");
    refused(wheel.instance.step(0.0, DT_S).map(drop), "time stands at 0.001 s; it does not go back");
    refused(wheel.instance.step(DT_S, 2.0).map(drop), "a step of 2 s");
    assert_eq!(wheel.all(), before);
    // It was put elsewhere; back where it can be, it goes on.
    wheel.set("joint_angle", 3.0);
    refused(wheel.instance.step(DT_S, DT_S).map(drop), "further than its velocities explain");
    assert_eq!(wheel.instance.get(0).unwrap(), Value::Float64(DT_S));
    wheel.exchange(DT_S, (0.002, 1.0));

    let mut made = Instance::of(Config::Drive(config("zlac8030l@4", Rule::Hold)), ".".as_ref(), false).unwrap();
    refused(made.set(inertia, Value::Float64(-1.0)), "an inertia is 0 to 1e6 kg·m², not -1");
    made.set(inertia, Value::Float64(0.2)).unwrap();
    made.set(angle, Value::Float64(100.0)).unwrap();
    made.enter_initialization(0.0).unwrap();
    made.exit_initialization().unwrap();
    // The shaft was taken over where the joint stands then.
    made.step(0.0, DT_S).unwrap();
}

#[test]
fn the_description_says_what_comes_in_and_what_goes_out() {
    let config = Config::Drive(DriveConfig { clock: TxClock::Countdown, ..config("zlac8030l@4", Rule::Hold) });
    assert!(config.text().contains("rule = \"hold\""), "{}", config.text());
    let unit = Unit::new(&config, ".".as_ref()).unwrap();
    let xml = xml::model_description(&config, ".".as_ref(), &unit);
    for (name, reference, causality, unit) in [
        ("joint_angle", 13, "input", "rad"),
        ("joint_velocity", 14, "input", "rad/s"),
        ("joint_torque", 215, "output", "N.m"),
        ("joint_inertia", 216, "output", "kg.m2"),
        ("load_inertia", 8, "parameter", "kg.m2"),
    ] {
        let start = format!("<Float64 name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\"");
        let line = xml.lines().find(|line| line.contains(&start)).unwrap_or_else(|| panic!("{start}"));
        assert!(line.contains(&format!("unit=\"{unit}\"")), "{line}");
    }
    assert!(xml.contains("<Output valueReference=\"215\" dependencies=\"\"/>") && !xml.contains("load_torque"));
    // A folder of resources with another word is one that was not packed here.
    let torn = config.text().replace("hold", "guess");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(ferrodrive_fmu::config::FILE), torn).unwrap();
    let error = Config::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains("rule \"guess\": expected hold, interpolate, integrate or torque"), "{error}");
}

//! A servo whose maker's objects for its gains a machine file names: found out as a wheel is, with the same bounds.
#![allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]

use std::time::Duration;

use canopen::Mux;
use devices::servo::CIA402;
use host::capture::Restorer;
use host::tune::{Bounds, Excursion, Request, TuneReport, find, loops_of, motor_of, tune};
use machine::file::Machine;
use master::{Drive, Network};
use sim::{Prng, World};
use tempfile::TempDir;

use crate::tune_random::machines;

/// What makers' sheets add to the profile: gains of two loops, a filter, an integral time and the current that the speed loop asks for.
const OBJECTS: [(&str, u8, &str, i64); 6] = [
    ("Speed loop proportional gain", 6, "rw", 500),
    ("Speed loop integral gain", 6, "rw", 400),
    ("Speed filter time in us", 6, "rw", 250),
    ("Position loop gain in 0.1/s", 6, "rw", 600),
    ("Speed loop integral time in 0.1 ms", 6, "rw", 167),
    ("Current demand in mA", 3, "ro", 0),
];

/// A folder with the sheet of a maker's servo.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let head = |index: &str, what: &str, kind: u8| format!("\n[{index}]\nParameterName={what}\nObjectType=0x{kind}\n");
    let value = |data: u8, access: &str, value: i64| {
        let mapped = u8::from(access == "ro" && data == 3);
        format!("DataType=0x000{data}\nAccessType={access}\nDefaultValue={value}\nPDOMapping={mapped}\n")
    };
    let mut added = head("2100", "Loops", 9) + "SubNumber=7\n";
    added += &(head("2100sub0", "Highest sub-index", 7) + &value(5, "ro", 6));
    for (sub, (what, data, access, delivered)) in (1..).zip(OBJECTS) {
        added += &(head(&format!("2100sub{sub}"), what, 7) + &value(data, access, delivered));
    }
    let sheet = eds::write(&eds::Sheet::of(&CIA402).eds());
    let sheet = sheet.replace(
        "[ManufacturerObjects]\nSupportedObjects=0\n",
        &format!("[ManufacturerObjects]\nSupportedObjects=1\n1=0x2100\n{added}"),
    );
    std::fs::write(folder.path().join("maker.eds"), sheet).unwrap();
    folder
}

fn machine(loops: &str, load: [f64; 3]) -> Machine {
    machine_with(loops, load, "")
}

fn machine_with(loops: &str, load: [f64; 3], more: &str) -> Machine {
    let [inertia, dry, viscous] = load;
    let text = format!(
        "bitrate = '1M'\ntiming = 'ideal'\n[[drive]]\nmodel = 'maker.eds'\nnode = 5\nload = {{ inertia_kg_m2 = {inertia}, friction = {{ coulomb_nm = {dry}, viscous_nm_s = {viscous} }}{more} }}\n\
         [drive.loops]\n{loops}"
    );
    Machine::parse_in(&text, folder().path()).unwrap_or_else(|bad| panic!("{bad}"))
}

fn booted(machine: &Machine) -> (World, Drive) {
    let mut world = machine.build().unwrap_or_else(|bad| panic!("{bad}"));
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(Duration::from_secs(1));
    let (node, model) = machine.models().next().unwrap();
    (world, Drive::new(network.node(node), model))
}

/// With the speed and the current that its file says.
fn request(drive: &Drive) -> Request {
    let (_, loops) = loops_of(drive).unwrap();
    let bounds = Bounds { speed_rpm: loops.usual_rpm, current_a: loops.usual_a, ..Bounds::default() };
    Request { bounds, ..crate::tune::request() }
}

fn found(machine: &Machine, position: bool) -> TuneReport {
    let (mut world, drive) = booted(machine);
    let request = Request { with_position: position, ..request(&drive) };
    let restorer = Restorer::of(&drive);
    let (report, _) =
        sim::block_on(&mut world, find((&drive, &restorer), &request, &mut Excursion::default())).unwrap().unwrap();
    assert!(world.report(5).unwrap().velocity_rpm.abs() < 1.0);
    report
}

const GAINS: &str = "speed_proportional = '2100:01'\nspeed_integral = '2100:02'\ncurrent = 2.5\n";
const TIME_AND_FILTER: &str = "speed_proportional = '2100:01'\nspeed_integral_time = '2100:05'\ncurrent = 2.5\n\
     speed_filter = { object = '2100:03', per_count = 1e-6 }\n\
     position_proportional = { object = '2100:04', per_count = 0.1 }\n\
     demand = { object = '2100:06', per_count = 1e-3 }\n";

/// Inertia within 5 %, friction within 10 %: closed forms of the plant's own equations.
#[test]
fn random_servos_are_identified_by_the_objects_that_a_file_names_and_get_better_gains() {
    let motor = motor_of(&CIA402).unwrap();
    let mut random = Prng::new(7);
    let mut worse = Vec::new();
    let count = machines(2);
    for number in 0..count {
        let mut between =
            |low: f64, high: f64| low * (high / low).powf(random.below(1 << 20) as f64 / f64::from(1 << 20));
        let load @ [inertia, dry, viscous] = [between(2e-5, 4e-4), between(0.02, 0.15), between(2e-4, 2e-3)];
        let loops = [GAINS, TIME_AND_FILTER][number % 2];
        let report = found(&machine(loops, load), number % 2 == 1);
        let within = |what: &str, is: f64, should: f64, bound: f64| {
            let off = (is / should - 1.0).abs();
            assert!(off < bound, "{number}: {what} {is}, the plant has {should}: {load:?} {report:?}");
        };
        within("inertia", report.inertia_kg_m2, motor.rotor.inertia_kg_m2 + inertia, 0.05);
        within("dry friction", report.dry_friction_nm, motor.rotor.coulomb_nm + dry, 0.1);
        within("viscous friction", report.viscous_friction_nm_s, motor.rotor.viscous_nm_s + viscous, 0.1);
        assert!(report.twin_off < 0.1 && report.model_off < 0.1, "{number}: {report:?}");
        assert!(report.after.stable && report.after.phase_deg >= 39.0, "{number}: {report:?}");
        let objects: Vec<&str> = report.gains.iter().map(|gain| gain.object.as_str()).collect();
        let expected: &[&str] =
            if number % 2 == 0 { &["2100h:01", "2100h:02"] } else { &["2100h:01", "2100h:05", "2100h:03", "2100h:04"] };
        assert_eq!(objects, expected);
        if report.twin_error[1] >= report.twin_error[0] {
            worse.push(number);
        }
    }
    println!("{count} servos: worse {worse:?}");
    assert!(worse.len() * 10 <= count, "worse than as delivered: {worse:?}");
}

/// A load behind a spring: its resonance within 2 %, by the closed form of two masses.
#[test]
fn the_resonance_of_a_servo_with_an_elastic_load_is_found() {
    let motor = motor_of(&CIA402).unwrap();
    let (inertia, resonance_hz) = (3e-4, 40.0);
    // The output wheel of a load's gear.
    let load = inertia + 0.01 * motor.rotor.inertia_kg_m2;
    let reduced = 1.0 / (1.0 / load + 1.0 / motor.rotor.inertia_kg_m2);
    let stiffness = (std::f64::consts::TAU * resonance_hz).powi(2) * reduced;
    let gear = format!(", gear = {{ ratio = 1, backlash_deg = 0, stiffness_nm_rad = {stiffness} }}");
    let (mut world, drive) = booted(&machine_with(GAINS, [inertia, 0.05, 5e-4], &gear));
    let (bounds, constant) = (request(&drive).bounds, 1270.0 / 2800.0);
    let (found, setup) = crate::tune::measured(&mut world, &drive, (&motor, constant), bounds).unwrap();
    sim::block_on(&mut world, setup.put_back(&drive)).unwrap().unwrap();
    let elastic = found.mechanics.elastic.unwrap();
    let (resonance, anti) = (elastic.resonance_hz, elastic.anti_resonance_hz);
    assert!((resonance / resonance_hz - 1.0).abs() < 0.02, "{found:?}");
    let anti_hz = (stiffness / load).sqrt() / std::f64::consts::TAU;
    assert!((anti / anti_hz - 1.0).abs() < 0.05, "{anti} Hz, the plant has {anti_hz}");
    let whole = load + motor.rotor.inertia_kg_m2;
    assert!((found.inertia_kg_m2() / whole - 1.0).abs() < 0.05, "{} of {whole}", found.inertia_kg_m2());
}

/// The drive itself, which is not its twin: with the gains that it has and with those that are proposed.
#[test]
fn the_drive_takes_gains_of_named_objects_and_answers_a_step_with_less_error() {
    let machine = machine(GAINS, [1.5e-4, 0.05, 5e-4]);
    let (mut world, drive) = booted(&machine);
    let request = Request { apply: true, ..request(&drive) };
    let restorer = Restorer::of(&drive);
    let run = tune((&drive, &restorer), &request, &(), std::future::ready(false));
    let report = sim::block_on(&mut world, run).unwrap().unwrap();
    let [before, after] = report.drive_error.unwrap();
    assert!(report.applied && after < before, "{report:?}");
    for gain in &report.gains {
        let sub_index = if gain.object == "2100h:01" { 1 } else { 2 };
        let value = sim::block_on(&mut world, drive.node().read::<u16>(Mux::new(0x2100, sub_index))).unwrap().unwrap();
        assert_eq!(i64::from(value), gain.after, "{gain:?}");
        assert_ne!(gain.after, gain.before, "{gain:?}");
    }
    assert_eq!(drive.node().network().with_core(|core| core.sync_period()), None);
}

/// Torque per ampere changes what is said of inertia and friction in N m, not how the twin of the drive behaves.
#[test]
fn another_torque_constant_scales_what_was_found_and_its_twin_stays_right() {
    let own = found(&machine(GAINS, [1e-4, 0.05, 5e-4]), false);
    let doubled = format!("torque_constant = {}\n{GAINS}", 2.0 * own.torque_constant_nm_a);
    let other = found(&machine(&doubled, [1e-4, 0.05, 5e-4]), false);
    assert!((own.torque_constant_nm_a - 1270.0 / 2800.0).abs() < 1e-9, "{}", own.torque_constant_nm_a);
    assert!(
        (other.inertia_kg_m2 / own.inertia_kg_m2 - 2.0).abs() < 0.02,
        "{} {}",
        other.inertia_kg_m2,
        own.inertia_kg_m2
    );
    assert!(other.twin_off < 0.1, "{}", other.twin_off);
    let values = |report: &TuneReport| report.gains.iter().map(|gain| gain.after).collect::<Vec<_>>();
    assert_eq!(values(&other), values(&own));
}

#[test]
fn a_position_loop_whose_gain_is_not_named_is_refused_and_nothing_is_left_changed() {
    let machine = machine(GAINS, [1e-4, 0.05, 5e-4]);
    let (mut world, drive) = booted(&machine);
    let request = Request { with_position: true, ..request(&drive) };
    let ramp = Mux::new(0x6083, 0);
    let before = sim::block_on(&mut world, drive.node().read::<u32>(ramp)).unwrap().unwrap();
    let restorer = Restorer::of(&drive);
    let mut excursion = Excursion::default();
    let run = find((&drive, &restorer), &request, &mut excursion);
    let failure = sim::block_on(&mut world, run).unwrap().unwrap_err();
    assert!(failure.because[0].contains("position_proportional"), "{failure:?}");
    assert_eq!(sim::block_on(&mut world, drive.node().read::<u32>(ramp)).unwrap().unwrap(), before);
}

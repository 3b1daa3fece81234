//! Does what a command says, and words the answer.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;

use plant::FreeRun;

use super::{Before, Command, CommandError, Service};
use crate::json;
use crate::stimulus::{BodyStimulus, FORMS, Place, Stimulus};
use crate::{BodyState, Brake, Levels, OutputShaft, PowerPhase, Report, StationId, World};

/// Does what `command` says; returns the line of JSON that answers it.
pub(super) fn answer(world: &mut World, command: &Command, service: Service) -> Result<String, CommandError> {
    match command {
        Command::Now => Ok(now(world, service)),
        Command::Help => Ok(json::line(&Help { ok: true, help: FORMS })),
        Command::Quit => Ok(done(world)),
        Command::Run(run) => {
            let before = Before::of(world);
            world.run_until(run.end(world.now()));
            Ok(before.answer(world))
        }
        Command::Get(place) => get(world, *place, service),
        Command::Disturb(fault) => {
            world.disturb(*fault);
            Ok(done(world))
        }
        Command::GetBody(name) => body(world, name),
        Command::ApplyToBody(name, stimulus) => {
            apply_to_body(world, name, stimulus)?;
            Ok(done(world))
        }
        Command::Apply(place, stimulus) => {
            apply(world, *place, stimulus)?;
            if let Stimulus::Power(_) = stimulus {
                return Ok(switched(world, place.node));
            }
            let note = if is_load(stimulus) { outlook(world, *place) } else { None };
            Ok(json::line(&CommandDone { ok: true, t: seconds(world), note }))
        }
    }
}

/// Does to a node what the outer world may do.
///
/// # Errors
/// No such drive, or what it does not take; nothing is changed then.
pub fn apply(world: &mut World, place: Place, stimulus: &Stimulus) -> Result<(), CommandError> {
    Ok(world.apply(place, stimulus).map_err(|_| no_such_drive(world, place.node))??)
}

/// Does to a machine that several drives move what the outer world may do.
///
/// # Errors
/// No such machine, or what it does not take; nothing is changed then.
pub fn apply_to_body(world: &mut World, name: &str, stimulus: &BodyStimulus) -> Result<(), CommandError> {
    Ok(world.apply_to_body(name, stimulus).ok_or_else(|| no_such_body(world, name))??)
}

fn no_such_drive(world: &World, number: u8) -> CommandError {
    let numbers: Vec<String> = world.drive_numbers().map(|number| number.to_string()).collect();
    let present = if numbers.is_empty() { "none".to_string() } else { numbers.join(", ") };
    CommandError::NoSuchDrive { number, present }
}

fn no_such_body(world: &World, name: &str) -> CommandError {
    let names: Vec<&str> = world.body_names().collect();
    let present = if names.is_empty() { "none".to_string() } else { names.join(", ") };
    CommandError::NoSuchBody { name: name.to_owned(), present }
}

/// The answer to `body NAME get`.
#[derive(Serialize)]
struct GotBody {
    ok: bool,
    t: f64,
    body: BodyState,
}

fn body(world: &mut World, name: &str) -> Result<String, CommandError> {
    let body = world.body(name).ok_or_else(|| no_such_body(world, name))?;
    Ok(json::line(&GotBody { ok: true, t: seconds(world), body }))
}

#[derive(Serialize)]
struct CommandDone {
    ok: bool,
    t: f64,
    /// What will come of it, where a person may not expect it.
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<String>,
}

fn done(world: &World) -> String {
    json::line(&CommandDone { ok: true, t: seconds(world), note: None })
}

/// The answer to a switch of the supply: what the drive makes of it now. A bus drains for a while after it.
#[derive(Serialize)]
struct Switched {
    ok: bool,
    t: f64,
    power: &'static str,
}

fn switched(world: &mut World, node: u8) -> String {
    let power = world.report(node).map_or(PowerPhase::Off, |report| report.power).word();
    json::line(&Switched { ok: true, t: seconds(world), power })
}

const fn is_load(stimulus: &Stimulus) -> bool {
    matches!(stimulus, Stimulus::LoadTorque(_) | Stimulus::Load(_))
}

/// What a load will do to a shaft that is not driven: it is active, and friction does not stop it.
fn outlook(world: &mut World, place: Place) -> Option<String> {
    let free_run = world.with_drive(place.node, |drive, now| {
        drive.advance(now);
        drive.free_run(place.axis)
    });
    let rpm = |velocity_rad_s: f64| (velocity_rad_s * cia402::RPM_PER_RAD_S).round();
    Some(match free_run.ok()?? {
        FreeRun::Held => "the shaft is not driven; its friction or its brake holds it".to_owned(),
        FreeRun::Turns { velocity_rad_s } => {
            format!("the shaft is free: it will turn at up to about {} r/min of the motor", rpm(velocity_rad_s))
        }
        FreeRun::Seizes { velocity_rad_s } => format!(
            "the shaft is free: it will run away, and its bearings seize at {} r/min of the motor",
            rpm(velocity_rad_s)
        ),
    })
}

/// The answer to `now`.
#[derive(Serialize)]
struct Now {
    ok: bool,
    t: f64,
    behind_ms: u64,
    frames_lost: u64,
}

fn now(world: &World, service: Service) -> String {
    let Service { behind, frames_lost } = service;
    json::line(&Now { ok: true, t: seconds(world), behind_ms: millis(behind), frames_lost })
}

/// Whole milliseconds.
fn millis(duration: Duration) -> u64 {
    duration.as_millis().try_into().unwrap_or(u64::MAX)
}

#[derive(Serialize)]
struct Help {
    ok: bool,
    help: &'static [&'static str],
}

/// The answer to `get`, in the order in which people look at it.
#[derive(Serialize)]
struct Got<'a> {
    ok: bool,
    t: f64,
    node: u8,
    model: &'a str,
    powered: bool,
    power: &'a str,
    position: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotor_position: Option<i64>,
    velocity_rpm: f64,
    current_a: f64,
    supply_v: f64,
    inputs: BTreeMap<&'a str, u8>,
    outputs: BTreeMap<&'a str, u8>,
    /// By the objects' words, as `set` has them: `6401:01`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    analogue: BTreeMap<String, i64>,
    brake: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    output_shaft: Option<OutputAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    damage: Option<&'a str>,
    /// The machine that it moves with others.
    #[serde(skip_serializing_if = "Option::is_none")]
    body: Option<BodyState>,
    motor_c: Option<f64>,
    driver_c: Option<f64>,
    statusword: Option<u16>,
    error_code: u32,
    shaft_angle_rad: f64,
    /// What the load gives at its own shaft, positive against positive motion; of a drive with a motor.
    #[serde(skip_serializing_if = "Option::is_none")]
    load_torque_nm: Option<f64>,
    /// The true temperature of the winding.
    #[serde(skip_serializing_if = "Option::is_none")]
    winding_c: Option<f64>,
    bitrate: Option<u32>,
    bus: &'a str,
    tec: u16,
    rec: u16,
    behind_ms: u64,
}

/// The shaft behind a reducer.
#[derive(Serialize)]
struct OutputAnswer {
    angle_deg: f64,
    torque_nm: f64,
    most_nm: f64,
    overloads: u32,
    jumps: u32,
    slip_deg: f64,
}

impl From<OutputShaft> for OutputAnswer {
    fn from(shaft: OutputShaft) -> Self {
        let OutputShaft { angle_rad, torque_nm, most_nm, overloads, jumps, slip_rad } = shaft;
        let (angle_deg, slip_deg) = (angle_rad.to_degrees(), slip_rad.to_degrees());
        Self { angle_deg, torque_nm, most_nm, overloads, jumps, slip_deg }
    }
}

fn get(world: &mut World, place: Place, service: Service) -> Result<String, CommandError> {
    let id = world.drive_id(place.node).ok_or_else(|| no_such_drive(world, place.node))?;
    let measured = world.with_drive(place.node, |drive, now| {
        drive.advance(now);
        drive.check_axis(place.axis)?;
        Ok::<_, CommandError>((
            drive.model(),
            drive.bitrate(),
            drive.report_of(place.axis),
            drive.input_levels(),
            drive.analogue(),
        ))
    });
    let (model, bitrate, report, inputs, analogue) = measured.map_err(|_| no_such_drive(world, place.node))??;
    let Report { node, powered, position, velocity_rpm, current_a, supply_v, .. } = report;
    let counters = world.counters(id);
    Ok(json::line(&Got {
        ok: true,
        t: seconds(world),
        // What takes no part in the bus has no node-ID yet: it goes by the number it was started under.
        node: if bitrate.is_some() { node } else { place.node },
        model,
        powered,
        power: report.power.word(),
        position,
        rotor_position: report.rotor_position,
        velocity_rpm,
        current_a,
        supply_v,
        inputs: levels(inputs),
        outputs: levels(report.outputs),
        analogue: analogue.into_iter().map(|(mux, value)| (format!("{mux:X}"), value)).collect(),
        brake: brake_text(report.brake),
        output_shaft: report.output.map(OutputAnswer::from),
        damage: report.damage,
        body: world.body_of(place),
        motor_c: report.motor_c,
        driver_c: report.driver_c,
        statusword: report.statusword,
        error_code: report.error_code,
        shaft_angle_rad: report.shaft_angle_rad,
        load_torque_nm: report.physics.map(|physics| physics.load_torque_nm),
        winding_c: report.physics.map(|physics| physics.winding_c),
        bitrate: bitrate.map(can::Bitrate::bits_per_second),
        bus: bus_text(world, id, bitrate.is_some()),
        tec: counters.tec(),
        rec: counters.rec(),
        behind_ms: millis(service.behind),
    }))
}

fn levels(levels: Levels) -> BTreeMap<&'static str, u8> {
    levels.iter().map(|(name, level)| (name, u8::from(level))).collect()
}

/// A drive without a brake has nothing that holds its shaft: clients may rely on one of the two words.
fn brake_text(brake: Option<Brake>) -> &'static str {
    match brake {
        Some(Brake::Engaged) => "engaged",
        Some(Brake::Released) | None => "released",
    }
}

fn bus_text(world: &World, id: StationId, takes_part: bool) -> &'static str {
    if !takes_part {
        return "off";
    }
    if world.is_cut(id) {
        return "cut";
    }
    world.counters(id).state().word()
}

fn seconds(world: &World) -> f64 {
    // A division rounds once, so that 12.5 s prints as 12.5.
    world.now().as_nanos() as f64 / 1e9
}

//! Does what a command says, and words the answer.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Instant;
use serde::Serialize;

use super::{Action, Command, CommandError, Service, parse, to_json};
use crate::wire::ErrorState;
use crate::{Brake, OutputShaft, Report, StationId, VirtualDrive, World};

/// Does what `command` says; returns the line of JSON that answers it.
pub(super) fn apply(world: &mut World, command: &Command, service: Service) -> Result<String, CommandError> {
    match command {
        Command::Now => Ok(now(world, service)),
        Command::Help => Ok(to_json(&Help { ok: true, help: parse::FORMS })),
        Command::Quit => Ok(done(world)),
        Command::Drive { number, action } => {
            let id = world.drive_id(*number).ok_or_else(|| no_such_drive(world, *number))?;
            if *action == Action::Get {
                return get(world, *number, id, service);
            }
            apply_to_drive(world, *number, id, action)
        }
    }
}

fn apply_to_drive(world: &mut World, number: u8, id: StationId, action: &Action) -> Result<String, CommandError> {
    match action {
        Action::CableCut(true) => world.cut(id),
        Action::CableCut(false) => world.join(id),
        Action::PowerCycle => {
            operate(world, number, |drive, now| act(drive, &Action::Power(false), now))?;
            operate(world, number, |drive, now| act(drive, &Action::Power(true), now))?;
        }
        action => operate(world, number, |drive, now| act(drive, action, now))?,
    }
    Ok(done(world))
}

fn act(drive: &mut dyn VirtualDrive, action: &Action, now: Instant) -> Result<(), CommandError> {
    match action {
        Action::Power(on) => drive.set_power(*on, now),
        Action::PowerCut => drive.cut_power(now),
        Action::Input { name, level } => drive.set_input(input_number(drive, name)?, *level, now)?,
        Action::Switch { name, range } => drive.set_switch(input_number(drive, name)?, *range, now)?,
        Action::LoadTorque(torque_nm) => drive.set_load_torque(*torque_nm, now)?,
        Action::LoadInertia(inertia_kg_m2) => drive.set_load_inertia(*inertia_kg_m2, now)?,
        Action::RotorLock(locked) => drive.set_rotor_locked(*locked, now)?,
        Action::Supply(source) => drive.set_source(*source, now)?,
        Action::Temperature(sensor, celsius) => drive.hold_temperature(*sensor, *celsius, now)?,
        Action::Fault(component, broken) => drive.set_fault(*component, *broken, now)?,
        Action::Battery(connected) => drive.set_battery(*connected, now)?,
        Action::Pulses(train) => drive.set_pulses(*train, now)?,
        // The cable, the power cycle and the report are the world's.
        Action::CableCut(_) | Action::PowerCycle | Action::Get => {}
    }
    Ok(())
}

fn operate(
    world: &mut World,
    number: u8,
    operation: impl FnOnce(&mut dyn VirtualDrive, Instant) -> Result<(), CommandError>,
) -> Result<(), CommandError> {
    match world.with_drive(number, operation) {
        Ok(result) => result,
        Err(_) => Err(no_such_drive(world, number)),
    }
}

fn input_number(drive: &dyn VirtualDrive, name: &str) -> Result<usize, CommandError> {
    let inputs = drive.inputs();
    let place = inputs.iter().position(|input| input.eq_ignore_ascii_case(name));
    place.ok_or_else(|| {
        let present = if inputs.is_empty() { "none".to_string() } else { inputs.join(", ") };
        CommandError::NoSuchInput { model: drive.model(), name: name.to_string(), present }
    })
}

fn no_such_drive(world: &World, number: u8) -> CommandError {
    let numbers: Vec<String> = world.drive_numbers().map(|number| number.to_string()).collect();
    let present = if numbers.is_empty() { "none".to_string() } else { numbers.join(", ") };
    CommandError::NoSuchDrive { number, present }
}

#[derive(Serialize)]
struct Done {
    ok: bool,
    t: f64,
}

fn done(world: &World) -> String {
    to_json(&Done { ok: true, t: seconds(world) })
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
    to_json(&Now { ok: true, t: seconds(world), behind_ms: millis(behind), frames_lost })
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
    position: i64,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotor_position: Option<i64>,
    velocity_rpm: f64,
    current_a: f64,
    supply_v: f64,
    outputs: BTreeMap<&'a str, u8>,
    brake: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    output_shaft: Option<Output>,
    #[serde(skip_serializing_if = "Option::is_none")]
    damage: Option<&'a str>,
    motor_c: Option<f64>,
    driver_c: Option<f64>,
    statusword: Option<u16>,
    error_code: u32,
    shaft_angle_rad: f64,
    bitrate: Option<u32>,
    bus: &'a str,
    tec: u16,
    rec: u16,
    behind_ms: u64,
}

/// The shaft behind a reducer.
#[derive(Serialize)]
struct Output {
    angle_deg: f64,
    torque_nm: f64,
    most_nm: f64,
    overloads: u32,
    jumps: u32,
    slip_deg: f64,
}

impl From<OutputShaft> for Output {
    fn from(shaft: OutputShaft) -> Self {
        let OutputShaft { angle_rad, torque_nm, most_nm, overloads, jumps, slip_rad } = shaft;
        let (angle_deg, slip_deg) = (angle_rad.to_degrees(), slip_rad.to_degrees());
        Self { angle_deg, torque_nm, most_nm, overloads, jumps, slip_deg }
    }
}

fn get(world: &mut World, number: u8, id: StationId, service: Service) -> Result<String, CommandError> {
    let measured = world.with_drive(number, |drive, now| {
        drive.advance(now);
        (drive.model(), drive.bitrate(), drive.report())
    });
    let (model, bitrate, report) = measured.map_err(|_| no_such_drive(world, number))?;
    let Report { node, powered, position, velocity_rpm, current_a, supply_v, .. } = report;
    let counters = world.counters(id);
    Ok(to_json(&Got {
        ok: true,
        t: seconds(world),
        node,
        model,
        powered,
        position,
        rotor_position: report.rotor_position,
        velocity_rpm,
        current_a,
        supply_v,
        outputs: report.outputs.iter().map(|(name, level)| (name, u8::from(level))).collect(),
        brake: brake_text(report.brake),
        output_shaft: report.output.map(Output::from),
        damage: report.damage,
        motor_c: report.motor_c,
        driver_c: report.driver_c,
        statusword: report.statusword,
        error_code: report.error_code,
        shaft_angle_rad: report.shaft_angle_rad,
        bitrate: bitrate.map(can::Bitrate::bits_per_second),
        bus: bus_text(world, id, powered),
        tec: counters.tec(),
        rec: counters.rec(),
        behind_ms: millis(service.behind),
    }))
}

/// A drive without a brake has nothing that holds its shaft: clients may rely on one of the two words.
fn brake_text(brake: Option<Brake>) -> &'static str {
    match brake {
        Some(Brake::Engaged) => "engaged",
        Some(Brake::Released) | None => "released",
    }
}

fn bus_text(world: &World, id: StationId, powered: bool) -> &'static str {
    if !powered {
        return "off";
    }
    if world.is_cut(id) {
        return "cut";
    }
    match world.counters(id).state() {
        ErrorState::ErrorActive => "error-active",
        ErrorState::ErrorPassive => "error-passive",
        ErrorState::BusOff => "bus-off",
    }
}

fn seconds(world: &World) -> f64 {
    // A division rounds once, so that 12.5 s prints as 12.5.
    world.now().as_nanos() as f64 / 1e9
}

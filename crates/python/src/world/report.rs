//! What can be measured at a drive, as a dictionary whose keys have their units in their names.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim::stimulus::Place;
use sim::wire::ErrorState;
use sim::{Brake, OutputShaft, Report};

use crate::failure::refused;

/// The report of a place.
pub(super) fn at<'py>(py: Python<'py>, world: &mut sim::World, place: Place) -> PyResult<Bound<'py, PyDict>> {
    let report = world.with_drive(place.node, |drive, now| {
        drive.advance(now);
        drive.check_axis(place.axis).map(|()| (drive.report_of(place.axis), drive.analogue()))
    });
    let (report, channels) = report.map_err(refused)?.map_err(refused)?;
    let dict = values(py, &report)?;
    let analogue = PyDict::new(py);
    for (mux, value) in channels {
        analogue.set_item(format!("{mux:X}"), value)?;
    }
    dict.set_item("analogue", analogue)?;
    dict.set_item("bus", bus(world, place.node, report.powered))?;
    Ok(dict)
}

fn values<'py>(py: Python<'py>, report: &Report) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("node_id", report.node)?;
    dict.set_item("powered", report.powered)?;
    dict.set_item("statusword", report.statusword)?;
    dict.set_item("error_code", report.error_code)?;
    dict.set_item("position", report.position)?;
    dict.set_item("rotor_position", report.rotor_position)?;
    dict.set_item("position_demand", report.position_demand)?;
    dict.set_item("velocity_rpm", report.velocity_rpm)?;
    dict.set_item("velocity_demand_rpm", report.velocity_demand_rpm)?;
    dict.set_item("current_a", report.current_a)?;
    dict.set_item("current_demand_a", report.current_demand_a)?;
    dict.set_item("supply_v", report.supply_v)?;
    dict.set_item("motor_c", report.motor_c)?;
    dict.set_item("driver_c", report.driver_c)?;
    let outputs = PyDict::new(py);
    for (name, level) in report.outputs.iter() {
        outputs.set_item(name, level)?;
    }
    dict.set_item("outputs", outputs)?;
    dict.set_item("brake", report.brake.map(brake))?;
    dict.set_item("output_shaft", report.output.map(|shaft| output(py, shaft)).transpose()?)?;
    dict.set_item("damage", report.damage)?;
    dict.set_item("shaft_angle_rad", report.shaft_angle_rad)?;
    Ok(dict)
}

const fn brake(brake: Brake) -> &'static str {
    match brake {
        Brake::Released => "released",
        Brake::Engaged => "engaged",
    }
}

fn output(py: Python<'_>, shaft: OutputShaft) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("angle_rad", shaft.angle_rad)?;
    dict.set_item("torque_nm", shaft.torque_nm)?;
    dict.set_item("most_nm", shaft.most_nm)?;
    dict.set_item("overloads", shaft.overloads)?;
    dict.set_item("jumps", shaft.jumps)?;
    dict.set_item("slip_rad", shaft.slip_rad)?;
    Ok(dict)
}

/// How the drive stands to the bus, in the words of `get`.
fn bus(world: &sim::World, number: u8, powered: bool) -> &'static str {
    let Some(id) = world.drive_id(number).filter(|_| powered) else { return "off" };
    if world.is_cut(id) {
        return "cut";
    }
    match world.counters(id).state() {
        ErrorState::ErrorActive => "error-active",
        ErrorState::ErrorPassive => "error-passive",
        ErrorState::BusOff => "bus-off",
    }
}

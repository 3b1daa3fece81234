//! What Python does to a world, from the arguments of its methods: no text is made of them, and none is read.
//!
//! The bounds of numbers are those of the machine, which refuses what it cannot take.

use std::time::Duration;

use can::Frame;
use canopen::{Mux, NodeId};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use sim::stimulus::{
    BodyStimulus, BusFault, Component, Friction, LoadKind, LoadPart, MPDO_VALUES, ObjectValue, Power, PulseTrain,
    Source, Stimulus, SwitchRange, TemperatureSensor, WireFault,
};

use crate::failure::{bad_value, refused};

/// The arguments of a stimulus.
type Values<'a, 'py> = &'a Bound<'py, PyTuple>;

/// What is done to a node.
pub(super) fn of_node(name: &str, values: Values<'_, '_>) -> PyResult<Stimulus> {
    let one = || values.get_item(0)?.extract::<f64>();
    let flag = || values.get_item(0)?.extract::<bool>();
    Ok(match name {
        "power" => Stimulus::Power(named(values, &Power::ALL.map(|power| (power.word(), power)))?),
        "input" => {
            let (name, level) = values.extract()?;
            Stimulus::Input { name, level }
        }
        "switch" => {
            let (name, low, high) = values.extract()?;
            Stimulus::Switch { name, range: SwitchRange::new(low, high).map_err(refused)? }
        }
        "load_torque" => Stimulus::LoadTorque(one()?),
        "load_inertia" => Stimulus::LoadInertia(one()?),
        "rotor_lock" => Stimulus::RotorLock(flag()?),
        "supply" => {
            let (voltage_v, limit_a, resistance_ohm) = values.extract()?;
            Stimulus::Supply(Source { voltage_v, limit_a, resistance_ohm })
        }
        "temperature" => {
            let sensor = named(values, &TemperatureSensor::ALL.map(|sensor| (sensor.word(), sensor)))?;
            Stimulus::Temperature(sensor, values.get_item(1)?.extract()?)
        }
        "fault" => {
            let component = named(values, &Component::ALL.map(|component| (component.word(), component)))?;
            Stimulus::Fault(component, values.get_item(1)?.extract()?)
        }
        "battery" => Stimulus::Battery(flag()?),
        "pulses" | "quadrature" => {
            let (count, hz) = (whole(values, 0, "a number of pulses")?, values.get_item(1)?.extract()?);
            let is_pulses = name == "pulses";
            Stimulus::Pulses(if is_pulses {
                PulseTrain::Pulses { count, hz }
            } else {
                PulseTrain::Quadrature { count, hz }
            })
        }
        "duty" => Stimulus::Pulses(PulseTrain::Duty(one()?)),
        "clock" => Stimulus::Pulses(PulseTrain::Clock(one()?)),
        "cable_cut" => Stimulus::CableCut(flag()?),
        "object" => {
            let mux = Mux::new(whole(values, 0, "an index")?, whole(values, 1, "a sub-index")?);
            Stimulus::Object { mux, value: object_value(values, 2)? }
        }
        "mpdo" => mpdo(values)?,
        _ => match (load(name, values)?, bus(name, values)?) {
            (Some(part), _) => Stimulus::Load(part),
            (_, Some(fault)) => Stimulus::Bus(fault),
            _ => return Err(bad_value(format!("{name:?} is not a stimulus"))),
        },
    })
}

fn load(name: &str, values: Values<'_, '_>) -> PyResult<Option<LoadPart>> {
    Ok(Some(match name {
        "load_friction" => {
            let (coulomb_nm, viscous_nm_s, static_nm, stribeck_rad_s) = values.extract()?;
            LoadPart::Friction(Friction { coulomb_nm, viscous_nm_s, static_nm, stribeck_rad_s })
        }
        "load_pulley" => {
            let (mass_kg, radius_m) = values.extract()?;
            LoadPart::Pulley { mass_kg, radius_m }
        }
        "load_spring" => {
            let (stiffness_nm_rad, rest_deg) = values.extract()?;
            LoadPart::Spring { stiffness_nm_rad, rest_deg }
        }
        "load_stop" => {
            let (low, high) = values.extract()?;
            let range = SwitchRange::new(low, high).map_err(refused)?;
            LoadPart::Stop { range, stiffness_nm_rad: None, damping_nm_s_rad: None }
        }
        "load_fan" => {
            let (torque_nm, speed_rpm) = values.extract()?;
            LoadPart::Fan { torque_nm, speed_rpm }
        }
        "load_gear" => {
            let (ratio, backlash_deg) = values.extract()?;
            LoadPart::Gear { ratio, backlash_deg, stiffness_nm_rad: None }
        }
        "load_off" => LoadPart::Off(named(values, &LoadKind::ALL.map(|kind| (kind.word(), kind)))?),
        "load_none" => LoadPart::None,
        _ => return Ok(None),
    }))
}

fn bus(name: &str, values: Values<'_, '_>) -> PyResult<Option<BusFault>> {
    let is_off = values.is_empty();
    let fault = match name {
        "bus_silent" => Ok(BusFault::Silent(values.get_item(0)?.extract()?)),
        "bus_late" if is_off => Ok(BusFault::Late(None)),
        "bus_babble" if is_off => Ok(BusFault::Babble(None)),
        "bus_overrun" if is_off => Ok(BusFault::Overrun(None)),
        "bus_late" => BusFault::late(time(values, 0)?, time(values, 1)?),
        "bus_babble" => {
            let frame: String = values.get_item(0)?.extract()?;
            let frame: Frame = frame.parse().map_err(|error| refused(format!("{frame:?} is not a frame: {error}")))?;
            BusFault::babble(frame, time(values, 1)?)
        }
        "bus_overrun" => BusFault::overrun(whole(values, 0, "a number of frames")?, time(values, 1)?),
        "bus_corrupt" => BusFault::corrupt(values.get_item(0)?.extract()?),
        _ => return Ok(None),
    };
    fault.map(Some).map_err(refused)
}

/// To node 0, which is all; the value is one of up to four bytes.
fn mpdo(values: Values<'_, '_>) -> PyResult<Stimulus> {
    let out_of_range = |what, value: String| refused(format!("{value} is out of range for {what}"));
    let node: u8 = whole(values, 0, "a node")?;
    let to = NodeId::new(node);
    if to.is_none() && node != 0 {
        return Err(out_of_range("a node", node.to_string()));
    }
    let object = Mux::new(whole(values, 1, "an index")?, whole(values, 2, "a sub-index")?);
    let value: i64 = whole(values, 3, "a value of up to four bytes")?;
    if !MPDO_VALUES.contains(&value) {
        return Err(out_of_range("a value of up to four bytes", value.to_string()));
    }
    Ok(Stimulus::Mpdo { to, object, value })
}

/// What is done to a machine that several drives move.
pub(super) fn of_body(name: &str, values: Values<'_, '_>) -> PyResult<BodyStimulus> {
    Ok(match name {
        "slope" => {
            let (slope_deg, uphill_deg) = values.extract()?;
            BodyStimulus::Slope { slope_deg, uphill_deg }
        }
        "grip" => BodyStimulus::Grip(values.get_item(0)?.extract()?),
        "mass" => BodyStimulus::Mass(values.get_item(0)?.extract()?),
        "payload" => BodyStimulus::Payload(values.get_item(0)?.extract()?),
        _ => return Err(bad_value(format!("{name:?} is not a stimulus of a body"))),
    })
}

/// What disturbs the wire.
pub(super) fn of_wire(name: &str, values: Values<'_, '_>) -> PyResult<WireFault> {
    match name {
        "corrupt" => WireFault::corrupt(values.get_item(0)?.extract()?),
        "destroy" => {
            WireFault::destroy(whole(values, 0, "a number of a frame")?, whole(values, 1, "a number of a bit")?)
        }
        _ => return Err(bad_value(format!("{name:?} is not a disturbance of the wire"))),
    }
    .map_err(refused)
}

/// The one of these that the first argument names.
fn named<T: Copy>(values: Values<'_, '_>, known: &[(&str, T)]) -> PyResult<T> {
    let word: String = values.get_item(0)?.extract()?;
    known.iter().find(|(name, _)| *name == word).map(|(_, one)| *one).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        refused(format!("{word:?} is not known here; expected {}", names.join(", ")))
    })
}

/// A time that is given in ms.
fn time(values: Values<'_, '_>, nth: usize) -> PyResult<Duration> {
    let ms: f64 = values.get_item(nth)?.extract()?;
    Duration::try_from_secs_f64(ms / 1e3).map_err(|_| refused(format!("invalid time in ms {ms}")))
}

/// A whole number that fits; one of any size is refused as the simulator refuses it, not by an `OverflowError`.
fn whole<T: TryFrom<i128>>(values: Values<'_, '_>, nth: usize, what: &str) -> PyResult<T> {
    let value = values.get_item(nth)?;
    let out_of_range = || refused(format!("{value} is out of range for {what}"));
    match value.extract::<i128>() {
        Ok(number) => T::try_from(number).map_err(|_| out_of_range()),
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => Err(out_of_range()),
        Err(error) => Err(error),
    }
}

fn object_value(values: Values<'_, '_>, nth: usize) -> PyResult<ObjectValue> {
    let value = values.get_item(nth)?;
    if let Ok(text) = value.extract() {
        return Ok(ObjectValue::Text(text));
    }
    if value.is_instance_of::<pyo3::types::PyFloat>() {
        return value.extract().map(ObjectValue::Real);
    }
    whole(values, nth, "the value of an object").map(ObjectValue::Integer)
}

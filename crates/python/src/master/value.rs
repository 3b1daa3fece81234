//! What a job gives, as values that are made without the interpreter and become Python's when they are asked for.

use master::drive::{DriveState, MotionReport, Report};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use words::calls::in_python;

/// A value on its way to Python.
pub(crate) enum Value {
    None,
    Bool(bool),
    Integer(i64),
    Real(f64),
    Text(String),
    Bytes(Vec<u8>),
    List(Vec<Value>),
    Record(Vec<(&'static str, Value)>),
    /// A report, as `--json` has it.
    Report(serde_json::Value),
}

impl Value {
    /// A report of crate `host`.
    pub(super) fn report(report: &impl serde::Serialize) -> Self {
        Self::Report(serde_json::to_value(report).unwrap_or_default())
    }

    /// Python's value.
    pub(super) fn into_python(self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self {
            Self::None => py.None(),
            Self::Bool(flag) => flag.into_pyobject(py)?.to_owned().into_any().unbind(),
            Self::Integer(integer) => integer.into_pyobject(py)?.into_any().unbind(),
            Self::Real(real) => real.into_pyobject(py)?.into_any().unbind(),
            Self::Text(text) => text.into_pyobject(py)?.into_any().unbind(),
            Self::Bytes(bytes) => PyBytes::new(py, &bytes).into_any().unbind(),
            Self::List(values) => {
                let list = PyList::empty(py);
                for value in values {
                    list.append(value.into_python(py)?)?;
                }
                list.into_any().unbind()
            }
            Self::Record(fields) => {
                let dict = PyDict::new(py);
                for (name, value) in fields {
                    dict.set_item(name, value.into_python(py)?)?;
                }
                dict.into_any().unbind()
            }
            Self::Report(report) => of_json(py, report)?,
        })
    }
}

fn of_json(py: Python<'_>, json: serde_json::Value) -> PyResult<Py<PyAny>> {
    use serde_json::Value as Json;
    let value = match json {
        Json::Null => Value::None,
        Json::Bool(flag) => Value::Bool(flag),
        Json::Number(number) => match number.as_i64() {
            Some(integer) => Value::Integer(integer),
            None => real(number.as_f64()),
        },
        Json::String(text) => Value::Text(in_python(&text).into_owned()),
        Json::Array(items) => Value::List(items.into_iter().map(Value::Report).collect()),
        Json::Object(fields) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                let value = match value {
                    // A file as the command line writes it, too.
                    Json::String(text) if name == "parameters" => Value::Text(text).into_python(py)?,
                    value => of_json(py, value)?,
                };
                dict.set_item(name, value)?;
            }
            return Ok(dict.into_any().unbind());
        }
    };
    value.into_python(py)
}

fn real(value: Option<f64>) -> Value {
    value.map_or(Value::None, Value::Real)
}

/// Everything that a drive says of itself, by names with units.
pub(super) fn state(state: &DriveState) -> Value {
    let faults = state.faults.iter().map(|fault| {
        Value::Record(vec![("name", Value::Text(fault.name.into())), ("remedy", Value::Text(fault.remedy.into()))])
    });
    Value::Record(vec![
        ("statusword", Value::Integer(state.statusword.0.into())),
        ("power", state.power.map_or(Value::None, |power| Value::Text(power.name().to_owned()))),
        ("mode", state.mode.map_or(Value::None, |mode| Value::Integer(mode.0.into()))),
        ("fault_code", state.fault_code.map_or(Value::None, |code| Value::Integer(code.into()))),
        ("faults", Value::List(faults.collect())),
        ("position", state.position.map_or(Value::None, |position| Value::Integer(position.0))),
        ("angle_deg", real(state.angle.map(|angle| angle.0))),
        ("velocity_rpm", real(state.velocity.map(|velocity| velocity.0))),
        ("current_a", real(state.current.map(|current| current.0))),
        ("supply_v", real(state.supply.map(|supply| supply.0))),
        ("motor_c", real(state.motor_temperature.map(|celsius| celsius.0))),
        ("driver_c", real(state.driver_temperature.map(|celsius| celsius.0))),
        ("nmt", state.nmt.map_or(Value::None, |nmt| Value::Text(nmt.to_string()))),
    ])
}

/// What came of a command to a drive.
pub(super) fn report(report: &Report) -> Value {
    match report {
        Report::Done => Value::None,
        Report::Guarded(loss) => Value::Text(loss.to_string()),
        Report::Moved(report) => motion(report),
    }
}

/// How a motion went.
fn motion(report: &MotionReport) -> Value {
    Value::Record(vec![
        ("reached_after_s", real(report.reached_after.map(|after| after.as_secs_f64()))),
        ("notes", Value::List(report.notes.iter().map(|note| Value::Text(note.to_string())).collect())),
    ])
}

//! Captures as files for Python: written, read back, and looked at for what they show of their drive. The parts are those of
//! `ferrodrive capture -o` and `ferrodrive tune --capture`.

use std::path::{Path, PathBuf};

use canopen::Mux;
use host::capture::Captured;
use host::tune::of_capture;
use pyo3::prelude::*;
use recording::{Capture, Kind, Trace, read};
use serve::files::create_record;
use sim::Place;
use words::document::read_bytes;
use words::failure::Failure;

use super::value::Value;
use crate::failure::{bad_value, raised};

/// The largest file that is read.
const LARGEST: u64 = 1 << 30;

/// A capture in plain values.
#[derive(FromPyObject)]
pub(crate) struct CaptureValues {
    #[pyo3(item)]
    name: String,
    #[pyo3(item)]
    notes: String,
    #[pyo3(item)]
    node: u8,
    #[pyo3(item)]
    model: String,
    #[pyo3(item)]
    trigger_s: Option<f64>,
    #[pyo3(item)]
    time_s: Vec<f64>,
    /// Quantity, unit and values.
    #[pyo3(item)]
    traces: Vec<(String, String, Vec<f64>)>,
    #[pyo3(item)]
    objects: Vec<(String, Vec<u8>)>,
}

/// Writes a capture.
#[pyfunction]
pub(crate) fn save_capture(py: Python<'_>, capture: CaptureValues, path: PathBuf) -> PyResult<()> {
    let kind = kind_of(&path).map_err(|failure| raised(py, &failure))?;
    let capture = capture.capture().map_err(bad_value)?;
    let written = py.detach(|| create_record(&path, kind).and_then(|file| capture.write(kind, Box::new(file))));
    Ok(written?)
}

/// Reads a capture.
#[pyfunction]
pub(crate) fn load_capture(py: Python<'_>, path: PathBuf, node: Option<u8>) -> PyResult<Py<PyAny>> {
    let capture = py.detach(|| loaded(&path, node)).map_err(|failure| raised(py, &failure))?;
    Value::report(&Captured::of_file(&capture)).into_python(py)
}

/// What a capture shows of its drive.
#[pyfunction]
pub(crate) fn tune_capture(
    py: Python<'_>,
    path: PathBuf,
    node: Option<u8>,
    torque_constant: Option<f64>,
) -> PyResult<Py<PyAny>> {
    let found = py.detach(|| of_capture(&loaded(&path, node)?, torque_constant, None));
    Value::report(&found.map_err(|failure| raised(py, &failure))?).into_python(py)
}

impl CaptureValues {
    fn capture(self) -> Result<Capture, String> {
        let Self { name, notes, node, model, trigger_s, time_s, traces, objects } = self;
        let rows = time_s.len();
        let traces = traces.into_iter().map(|(quantity, unit, values)| match values.len() == rows {
            true => Ok(Trace::new(quantity, unit, values, &time_s)),
            false => Err(format!("{quantity} has {} values, and there are {rows} times", values.len())),
        });
        let traces = traces.collect::<Result<Vec<_>, _>>()?;
        if !time_s.is_sorted() || time_s.iter().any(|at| !(0.0..1e9).contains(at)) {
            return Err("times are to ascend from 0 s on".to_owned());
        }
        let object = |(text, value): (String, Vec<u8>)| {
            let mux = text.split_once("h:").and_then(|(index, sub)| {
                Some(Mux::new(u16::from_str_radix(index, 16).ok()?, u8::from_str_radix(sub, 16).ok()?))
            });
            mux.map(|mux| (mux, value)).ok_or_else(|| format!("expected an object such as 6083h:00, got {text:?}"))
        };
        let parameters = objects.into_iter().map(object).collect::<Result<_, _>>()?;
        let place = Place::node(node);
        Ok(Capture { name, notes, model, place, trigger_s, time_s, traces, parameters, is_cut_off: false })
    }
}

fn kind_of(path: &Path) -> Result<Kind, Failure> {
    Kind::of_name(&path.to_string_lossy()).ok_or_else(|| {
        Failure::bad_file(format!("{} is not the name of a capture", path.display())).next("NAME.mcap or NAME.csv")
    })
}

fn loaded(path: &Path, node: Option<u8>) -> Result<Capture, Failure> {
    let kind = kind_of(path)?;
    let recorded = read_bytes(path, LARGEST).and_then(|bytes| read(kind, &bytes));
    recorded.and_then(|recorded| Capture::of_node(&recorded, node)).map_err(|reason| {
        Failure::bad_file(format!("{} cannot be read as a capture", path.display()))
            .because(reason)
            .next("give a capture or a record of one node, or name which: node=4")
    })
}

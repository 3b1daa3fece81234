//! Exchanges with a physics engine: arrays of NumPy in and out, without the interpreter's lock.
//!
//! What is given is copied once, into a buffer that the world reads while other Python threads run, and what comes out is a new array.
//! NumPy is looked for when the first array is needed: who has no engine needs none.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods, PyUntypedArrayMethods};
use plant::coupled::{ExternalModel, MOST, Rule};
use pyo3::exceptions::PyImportError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use sim::{CoupledShaft, Coupling, ExternalShaft, Given};

use crate::failure::{bad_value, refused, wrong_use};
use crate::world::{Shared, World, WorldState, place_of};

type FloatArray<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
type Rows<'py> = PyArrayLike2<'py, f64, AllowTypeChange>;
type Vector<'py> = Bound<'py, PyArray1<f64>>;

/// So many milliseconds of a drive's time are worth a thread: they take some 50 µs, and to start and join it takes 15 µs.
const LEAST_DRIVE_MS: u128 = 16;

/// That NumPy is there: its arrays cannot be asked for without it.
fn need_numpy(py: Python<'_>) -> PyResult<()> {
    static FOUND: PyOnceLock<()> = PyOnceLock::new();
    FOUND.get_or_try_init(py, || {
        let reason = "an exchange with a physics engine takes arrays: pip install numpy";
        py.import("numpy").map(|_| ()).map_err(|_| PyImportError::new_err(reason))
    })?;
    Ok(())
}

fn step(dt_s: f64) -> PyResult<Duration> {
    let ns = (dt_s * 1e9).round();
    if (1.0..=1e18).contains(&ns) {
        return Ok(Duration::from_nanos(ns as u64));
    }
    Err(bad_value(format!("expected a step of more than 0 s, got {dt_s}")))
}

/// One row of numbers. An engine hands over its own array of 64-bit numbers as a rule, which is copied as it stands; everything else is
/// made one first.
fn row<'py>(what: &str, values: &Bound<'py, PyAny>) -> PyResult<Vec<f64>> {
    if let Ok(array) = values.cast::<PyArray1<f64>>()
        && let Ok(row) = array.to_vec()
    {
        return Ok(row);
    }
    let array: FloatArray<'py> = values
        .extract()
        .map_err(|_| bad_value(format!("{what}: expected an array of numbers with one dimension, got {values}")))?;
    Ok(array.as_array().to_vec())
}

/// Has the drives at these places moved from outside; see `World.external`.
#[pyfunction]
pub(crate) fn couple_external(
    py: Python<'_>,
    world: &Bound<'_, World>,
    name: &str,
    rule: &str,
    shafts: Vec<(String, f64, f64, f64)>,
) -> PyResult<()> {
    need_numpy(py)?;
    let rule: Rule = rule.parse().map_err(|()| bad_value(format!("rule {rule:?}: expected {}", Rule::NAMES)))?;
    let coupled = shafts.iter().map(|(place, turns, ..)| Ok(CoupledShaft { place: place_of(place)?, turns: *turns }));
    let coupled = coupled.collect::<PyResult<Vec<_>>>()?;
    let joints: Vec<_> = shafts.iter().map(|(_, _, first_rad, inertia)| (*first_rad, *inertia)).collect();
    let model = ExternalModel::new(rule, &joints)
        .ok_or_else(|| bad_value(format!("{} drives; an external body has one to {MOST}", shafts.len())))?;
    world.get().shared().lock(py)?.world.couple(name, &Coupling::External(model), &coupled).map_err(refused)
}

/// A step of the engine: angles and velocities in, torques out.
#[pyfunction]
pub(crate) fn exchange<'py>(
    py: Python<'py>,
    world: &Bound<'py, World>,
    dt_s: f64,
    angle_rad: &Bound<'py, PyAny>,
    velocity_rad_s: &Bound<'py, PyAny>,
) -> PyResult<Vector<'py>> {
    need_numpy(py)?;
    let (dt, angle_rad) = (step(dt_s)?, row("angle_rad", angle_rad)?);
    let velocity_rad_s = row("velocity_rad_s", velocity_rad_s)?;
    let torque_nm = world.get().shared().detached(py, move |state| {
        let mut torque_nm = vec![0.0; angle_rad.len()];
        let done = state.world.exchange(dt, (&angle_rad, &velocity_rad_s), &mut torque_nm);
        state.keep_record();
        done.map(|()| torque_nm)
    })?;
    Ok(PyArray1::from_slice(py, &torque_nm.map_err(bad_value)?))
}

/// The other form: torques in, angles and velocities out.
#[pyfunction]
pub(crate) fn exchange_torque<'py>(
    py: Python<'py>,
    world: &Bound<'py, World>,
    dt_s: f64,
    torque_nm: &Bound<'py, PyAny>,
) -> PyResult<(Vector<'py>, Vector<'py>)> {
    need_numpy(py)?;
    let (dt, torque_nm) = (step(dt_s)?, row("torque_nm", torque_nm)?);
    let moved = world.get().shared().detached(py, move |state| {
        let (mut angle_rad, mut velocity_rad_s) = (vec![0.0; torque_nm.len()], vec![0.0; torque_nm.len()]);
        let done = state.world.exchange_torque(dt, &torque_nm, (&mut angle_rad, &mut velocity_rad_s));
        state.keep_record();
        done.map(|()| (angle_rad, velocity_rad_s))
    })?;
    let (angle_rad, velocity_rad_s) = moved.map_err(bad_value)?;
    Ok((PyArray1::from_slice(py, &angle_rad), PyArray1::from_slice(py, &velocity_rad_s)))
}

/// The half of a step before its time passes, for a thread that takes part in the virtual time; its length in ns.
#[pyfunction]
pub(crate) fn begin_exchange<'py>(
    py: Python<'py>,
    world: &Bound<'py, World>,
    dt_s: f64,
    first: &Bound<'py, PyAny>,
    second: Option<&Bound<'py, PyAny>>,
) -> PyResult<u64> {
    need_numpy(py)?;
    let dt = step(dt_s)?;
    // Before the world is locked: an array may be an object whose own Python code asks this world, or lets another thread do so.
    let first = row(if second.is_some() { "angle_rad" } else { "torque_nm" }, first)?;
    let second = second.map(|second| row("velocity_rad_s", second)).transpose()?;
    let given = second.as_ref().map_or(Given::Torque(&first), |second| Given::Motion(&first, second));
    let begun = world.get().shared().lock(py)?.world.begin_exchange(dt, given);
    begun.map_err(bad_value)?;
    Ok(dt.as_nanos() as u64)
}

/// What came of the last exchange, of each shaft: torques, and where they are now with their velocities.
#[pyfunction]
pub(crate) fn exchanged<'py>(
    py: Python<'py>,
    world: &Bound<'py, World>,
) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>)> {
    let world = &mut world.get().shared().lock(py)?.world;
    let none = vec![0.0; world.external_shaft_count()];
    let (mut torque_nm, mut angle_rad, mut velocity_rad_s) = (none.clone(), none.clone(), none);
    world.read_torques(&mut torque_nm);
    world.read_motions(&mut angle_rad, &mut velocity_rad_s);
    let array = |values: &[f64]| PyArray1::from_slice(py, values);
    Ok((array(&torque_nm), array(&angle_rad), array(&velocity_rad_s)))
}

/// For each shaft: place, turns, inertia, dry friction, torque, angle, velocity.
type ShaftRow = (String, f64, f64, f64, f64, f64, f64);

/// The shafts that are moved from outside, in the order of the exchange.
#[pyfunction]
pub(crate) fn external_shafts(py: Python<'_>, world: &Bound<'_, World>) -> PyResult<Vec<ShaftRow>> {
    let shafts = world.get().shared().lock(py)?.world.external_shafts();
    let plain = |ExternalShaft { place, turns, inertia_kg_m2, dry_nm, torque_nm, angle_rad, velocity_rad_s }| {
        (place.to_string(), turns, inertia_kg_m2, dry_nm, torque_nm, angle_rad, velocity_rad_s)
    };
    Ok(shafts.into_iter().map(plain).collect())
}

/// Several worlds that are exchanged together; `ferrodrive.Worlds` is what users have.
#[pyclass(frozen, subclass, module = "ferrodrive._native")]
pub(crate) struct Worlds {
    worlds: Vec<Arc<Shared>>,
    /// In which order they are locked: the same for all lists that have two of them.
    order: Vec<usize>,
}

#[pymethods]
impl Worlds {
    #[new]
    fn new(worlds: Vec<Bound<'_, World>>) -> PyResult<Self> {
        let worlds: Vec<_> = worlds.iter().map(|world| Arc::clone(world.get().shared())).collect();
        let mut order: Vec<usize> = (0..worlds.len()).collect();
        order.sort_by_key(|&i| Arc::as_ptr(&worlds[i]) as usize);
        if order.windows(2).any(|pair| Arc::ptr_eq(&worlds[pair[0]], &worlds[pair[1]])) {
            return Err(bad_value("one world is in the list twice"));
        }
        Ok(Self { worlds, order })
    }

    /// A step of the engines, a row for each world; on all cores.
    fn exchange<'py>(
        &self,
        py: Python<'py>,
        dt_s: f64,
        angle_rad: &Bound<'py, PyAny>,
        velocity_rad_s: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        need_numpy(py)?;
        let dt = step(dt_s)?;
        let (angle_rad, shape) = self.rows("angle_rad", angle_rad)?;
        let (velocity_rad_s, same) = self.rows("velocity_rad_s", velocity_rad_s)?;
        if shape != same {
            return Err(bad_value(format!("angle_rad has shape {shape:?}, velocity_rad_s {same:?}")));
        }
        for shared in &self.worlds {
            shared.check_process()?;
        }
        let width = shape[1];
        let torque_nm = py.detach(|| self.exchange_rows(dt, width, (&angle_rad, &velocity_rad_s)));
        PyArray1::from_vec(py, torque_nm.map_err(bad_value)?).reshape(shape).map_err(wrong_use)
    }
}

impl Worlds {
    /// Rows of numbers one after the other, and how many rows and columns.
    fn rows<'py>(&self, what: &str, values: &Bound<'py, PyAny>) -> PyResult<(Vec<f64>, [usize; 2])> {
        let expected = || format!("{what}: expected an array with a row for each of {} worlds", self.worlds.len());
        let shape = |shape: &[usize]| match *shape {
            [rows, columns] if rows == self.worlds.len() => Ok([rows, columns]),
            [rows, ..] => Err(bad_value(format!("{}, got {rows} rows", expected()))),
            [] => Err(bad_value(expected())),
        };
        // As of one row.
        if let Ok(array) = values.cast::<PyArray2<f64>>()
            && array.is_c_contiguous()
            && let Ok(numbers) = array.to_vec()
        {
            return Ok((numbers, shape(array.shape())?));
        }
        let array: Rows<'py> = values.extract().map_err(|_| bad_value(expected()))?;
        let shape = shape(array.shape())?;
        Ok((array.as_array().iter().copied().collect(), shape))
    }

    /// All worlds or none: what is wrong with one is found before any of them moves.
    fn exchange_rows(&self, dt: Duration, width: usize, given: (&[f64], &[f64])) -> Result<Vec<f64>, String> {
        let mut guards: Vec<Option<MutexGuard<'_, WorldState>>> = self.worlds.iter().map(|_| None).collect();
        for &i in &self.order {
            guards[i] = Some(self.worlds[i].state().lock().unwrap_or_else(PoisonError::into_inner));
        }
        let mut states: Vec<&mut WorldState> = guards.iter_mut().flatten().map(|guard| &mut **guard).collect();
        let of = |i: usize| i * width..(i + 1) * width;
        for (i, state) in states.iter_mut().enumerate() {
            let motion = Given::Motion(&given.0[of(i)], &given.1[of(i)]);
            state.world.check_exchange(dt, motion).map_err(|error| format!("world {i}: {error}"))?;
        }
        let mut torque_nm = vec![0.0; width * states.len()];
        if width == 0 || states.is_empty() {
            return Ok(torque_nm);
        }
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let drive_ms = width as u128 * states.len() as u128 * dt.as_micros() / 1000;
        let threads = cores.min((drive_ms / LEAST_DRIVE_MS) as usize).max(1);
        let share = states.len().div_ceil(threads);
        let angles = given.0.chunks(share * width).zip(given.1.chunks(share * width));
        let parts = states.chunks_mut(share).zip(angles).zip(torque_nm.chunks_mut(share * width));
        let parts: Vec<_> = parts.map(|part| Mutex::new(Some(part))).collect();
        let one_part =
            |((states, (angle_rad, velocity_rad_s)), torque_nm): ((&mut [&mut WorldState], _), &mut [f64])| {
                let (angle_rad, velocity_rad_s): (&[f64], &[f64]) = (angle_rad, velocity_rad_s);
                for (i, state) in states.iter_mut().enumerate() {
                    let motion = (&angle_rad[of(i)], &velocity_rad_s[of(i)]);
                    // It was checked above.
                    let _ = state.world.exchange(dt, motion, &mut torque_nm[of(i)]);
                    state.keep_record();
                }
            };
        let do_part = |part: &Mutex<Option<_>>| {
            let part = part.lock().unwrap_or_else(PoisonError::into_inner).take();
            part.into_iter().for_each(one_part);
        };
        thread::scope(|scope| {
            let spawn = |part| thread::Builder::new().spawn_scoped(scope, move || do_part(part)).is_ok();
            // A system that gives fewer threads gets the same results, later.
            let others = parts.iter().skip(1).take_while(|part| spawn(*part)).count();
            parts.iter().take(1).chain(parts.iter().skip(1 + others)).for_each(do_part);
        });
        Ok(torque_nm)
    }
}

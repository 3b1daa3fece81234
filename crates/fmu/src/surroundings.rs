//! What surrounds a drive and what can be measured at it: the variables that each FMU of a drive has.

use std::sync::{Arc, Mutex, PoisonError};

use can::Instant;
use sim::{Brake, CouplingError, Report, Rule, VirtualDrive};

use crate::joint::Joint;
use crate::variable::{Causality, Reference, Value, Variable};

const SEED: Reference = 6;
const LOAD_TORQUE: Reference = 10;
const SUPPLY: Reference = 11;
const SUPPLY_ON: Reference = 12;
const INPUTS: Reference = 100;
/// The first that is measured.
pub(crate) const OUTPUTS: Reference = 200;
const LEVELS: Reference = 300;

/// The row of an output: reference, name, unit, what it is, and where it is in a report. What a drive does not have reads 0.
type OutputRow = (Reference, &'static str, &'static str, &'static str, fn(&Report) -> Value);

/// What is read of every drive.
const READ: [OutputRow; 15] = [
    (OUTPUTS, "angle", "rad", "angle of the motor shaft, many turns", |it| Value::Float64(it.shaft_angle_rad)),
    (OUTPUTS + 1, "velocity", "rad/s", "speed of the motor shaft", |it| {
        Value::Float64(it.velocity_rpm * std::f64::consts::PI / 30.0)
    }),
    (OUTPUTS + 2, "torque", "N.m", "torque of the motor on its rotor", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.motor_torque_nm))
    }),
    (OUTPUTS + 3, "load_angle", "rad", "angle of the load, behind a gear if there is one", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.load_angle_rad))
    }),
    (OUTPUTS + 4, "current", "A", "signed motor current", |it| Value::Float64(it.current_a)),
    (OUTPUTS + 5, "bus_voltage", "V", "voltage at the supply terminals", |it| Value::Float64(it.supply_v)),
    (OUTPUTS + 6, "winding_temperature", "degC", "true temperature of the winding", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.winding_c))
    }),
    (OUTPUTS + 7, "heat_sink_temperature", "degC", "true temperature of the power stage", |it| {
        Value::Float64(it.physics.as_ref().map_or(0.0, |physics| physics.heat_sink_c))
    }),
    (OUTPUTS + 8, "statusword", "", "6041h; 0 without power", |it| Value::UInt16(it.statusword.unwrap_or(0))),
    (OUTPUTS + 9, "error_code", "", "present fault in the drive's own numbering; 0 for none", |it| {
        Value::UInt32(it.error_code)
    }),
    (OUTPUTS + 10, "position", "", "actual position in the drive's counts", |it| Value::Int64(it.position)),
    (OUTPUTS + 11, "node_id", "", "node-ID in use", |it| Value::UInt8(it.node)),
    (OUTPUTS + 12, "powered", "", "there is enough voltage for the firmware", |it| Value::Boolean(it.powered)),
    (OUTPUTS + 13, "brake_engaged", "", "the holding brake holds the shaft", |it| {
        Value::Boolean(it.brake == Some(Brake::Engaged))
    }),
    (OUTPUTS + 14, "damaged", "", "something was destroyed", |it| Value::Boolean(it.damage.is_some())),
];

/// What surrounds a drive, as the importer has set it.
#[derive(Clone)]
pub(crate) struct Surroundings {
    pub(crate) seed: u64,
    load_torque_nm: f64,
    /// `None` for the drive's own.
    supply_v: Option<f64>,
    pub(crate) supply_on: bool,
    inputs: Vec<bool>,
    /// Where the importer owns the motion of the shaft.
    pub(crate) joint: Option<Joint>,
    /// A drive like it, which is never switched on: it is asked what such a drive takes.
    asked: Arc<Mutex<Box<dyn VirtualDrive>>>,
}

impl Surroundings {
    /// Those of a drive that nothing was done to.
    ///
    /// # Errors
    /// The importer is to move its shaft, and it has none that can be taken over.
    pub(crate) fn of(drive: &dyn VirtualDrive, rule: Rule) -> Result<Self, CouplingError> {
        let joint = Joint::of(drive, rule)?;
        let inputs = vec![false; drive.inputs().len()];
        let asked = Arc::new(Mutex::new(drive.clone_box()));
        Ok(Self { seed: 1, load_torque_nm: 0.0, supply_v: None, supply_on: true, inputs, joint, asked })
    }

    /// The variables of a drive that shows `report` now.
    pub(crate) fn variables(&self, drive: &dyn VirtualDrive, report: &Report) -> Vec<Variable> {
        use Causality::{Input, Output, Parameter};
        let supply_v = report.physics.as_ref().map_or(0.0, |physics| physics.source_v);
        let load = "torque of the load at the output shaft; positive opposes positive motion";
        let supply = "open-circuit voltage of the supply";
        let jitter = "decides the jitter of the drive's own times";
        let mut rows = vec![
            Variable::new(SEED, "seed", Parameter, Value::UInt64(1), jitter),
            Variable::new(SUPPLY, "supply_voltage", Input, Value::Float64(supply_v), supply).in_unit("V"),
            Variable::new(SUPPLY_ON, "supply_on", Input, Value::Boolean(true), "the switch between supply and drive"),
        ];
        match &self.joint {
            None => {
                rows.push(Variable::new(LOAD_TORQUE, "load_torque", Input, Value::Float64(0.0), load).in_unit("N.m"))
            }
            Some(joint) => rows.extend(joint.variables()),
        }
        for (place, name) in (INPUTS..).zip(drive.inputs()) {
            rows.push(Variable::new(place, &format!("input.{name}"), Input, Value::Boolean(false), "digital input"));
        }
        for (reference, name, unit, what, read) in READ {
            rows.push(Variable::new(reference, name, Output, read(report), what).in_unit(unit));
        }
        for (place, name) in (LEVELS..).zip(report.outputs.names) {
            rows.push(Variable::new(place, &format!("output.{name}"), Output, Value::Boolean(false), "digital output"));
        }
        rows
    }

    /// What of the drive does not change by itself: a parameter, an input, an inertia.
    pub(crate) fn get(&self, reference: Reference, report: &Report) -> Option<Value> {
        if let Some(value) = self.joint.as_ref().and_then(|joint| joint.get(reference)) {
            return Some(value);
        }
        Some(match reference {
            SEED => Value::UInt64(self.seed),
            LOAD_TORQUE if self.joint.is_none() => Value::Float64(self.load_torque_nm),
            SUPPLY => Value::Float64(self.supply_v.or(report.physics.as_ref().map(|it| it.source_v)).unwrap_or(0.0)),
            SUPPLY_ON => Value::Boolean(self.supply_on),
            INPUTS..OUTPUTS => Value::Boolean(*self.inputs.get((reference - INPUTS) as usize)?),
            _ => return None,
        })
    }

    /// Whether [`set`](Self::set) would take it.
    ///
    /// # Errors
    /// What the drive does not take.
    pub(crate) fn check(&self, variable: (Reference, &Value)) -> Result<(), String> {
        if let (Some(joint), (reference, Value::Float64(number))) = (&self.joint, variable) {
            joint.check(reference, *number)?;
        }
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = match variable {
            (LOAD_TORQUE, Value::Float64(torque_nm)) => asked.set_load_torque(*torque_nm, Instant::ZERO),
            (SUPPLY, Value::Float64(volt)) => asked.set_supply(*volt, Instant::ZERO),
            _ => Ok(()),
        };
        taken.map_err(|refused| refused.to_string())
    }

    /// Writes a parameter or an input, which acts from `now` on. `is_on` is whether the drive's power follows its switch.
    ///
    /// # Errors
    /// What the drive does not take.
    pub(crate) fn set(
        &mut self,
        (reference, value): (Reference, &Value),
        drive: &mut dyn VirtualDrive,
        is_on: bool,
        now: Instant,
    ) -> Result<(), String> {
        if let (Some(joint), Value::Float64(number)) = (&mut self.joint, value) {
            joint.set(reference, *number)?;
        }
        match (reference, value) {
            (SEED, Value::UInt64(seed)) => self.seed = *seed,
            (LOAD_TORQUE, Value::Float64(torque_nm)) if *torque_nm != self.load_torque_nm => {
                drive.set_load_torque(*torque_nm, now).map_err(|refused| refused.to_string())?;
                self.load_torque_nm = *torque_nm;
            }
            (SUPPLY, Value::Float64(volt)) if Some(*volt) != self.supply_v => {
                drive.set_supply(*volt, now).map_err(|refused| refused.to_string())?;
                self.supply_v = Some(*volt);
            }
            (SUPPLY_ON, Value::Boolean(on)) if *on != self.supply_on => {
                self.supply_on = *on;
                if is_on {
                    drive.set_power(*on, now);
                }
            }
            // What acts at once is seen at once.
            (INPUTS..OUTPUTS, Value::Boolean(level)) => {
                let input = (reference - INPUTS) as usize;
                let before = *self.inputs.get(input).ok_or("the drive has no such input")?;
                if before != *level {
                    drive.set_input(input, *level, now).map_err(|refused| refused.to_string())?;
                    self.inputs[input] = *level;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// What is measured.
pub(crate) fn measured(reference: Reference, report: &Report) -> Option<Value> {
    if let Some(level) = reference.checked_sub(LEVELS) {
        return report.outputs.iter().nth(level as usize).map(|(_, level)| Value::Boolean(level));
    }
    let row = reference.checked_sub(OUTPUTS)? as usize;
    READ.get(row).map(|row| row.4(report))
}

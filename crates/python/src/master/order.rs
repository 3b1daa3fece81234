//! What a drive is asked to do, as it comes from Python: plain values.

use std::time::Duration;

use master::drive::{Command, Manner, Motion, SwitchedOff};
use master::units::{Along, Amperes, Angle, Ramp, Rpm};
use pyo3::prelude::*;

use crate::failure::bad_value;

/// What a drive is asked to do, in plain values.
#[derive(FromPyObject)]
pub(super) struct Order {
    #[pyo3(item)]
    pub(super) do_: String,
    #[pyo3(item, default)]
    value: Option<f64>,
    #[pyo3(item, default)]
    counts: Option<i64>,
    #[pyo3(item, default)]
    relative: bool,
    #[pyo3(item, default)]
    speed_rpm: Option<f64>,
    #[pyo3(item, default)]
    acceleration_rpm_s: Option<f64>,
    #[pyo3(item, default)]
    deceleration_rpm_s: Option<f64>,
    #[pyo3(item, default)]
    wait: bool,
    #[pyo3(item, default)]
    limit_s: Option<f64>,
    #[pyo3(item, default)]
    pub(super) gear_ratio: Option<f64>,
    /// Its model is what the node has shown, and no more than a guess.
    #[pyo3(item, default)]
    pub(super) guessed: bool,
}

impl Order {
    /// The command of the master.
    pub(super) fn command(&self) -> PyResult<Command> {
        Ok(match self.do_.as_str() {
            "enable" => Command::Enable,
            "disable" => Command::Disable,
            "stop" => Command::Stop,
            "quick_stop" => Command::QuickStop,
            "reset_fault" => Command::ResetFault,
            "save" => Command::Save,
            "restore" => Command::Restore,
            "guard" => Command::Guard(SwitchedOff::Leave),
            "release_guard" => Command::ReleaseGuard,
            "velocity" => Motion::Velocity(Rpm(self.value()?).into(), self.manner()?).into(),
            "torque" => Motion::Torque(Amperes(self.value()?)).into(),
            "move" => Motion::Move {
                to: self.angle()?.into(),
                relative: self.relative,
                speed: self.speed()?,
                manner: self.manner()?,
            }
            .into(),
            "home" => {
                let method = self.counts.and_then(|method| i8::try_from(method).ok());
                let method = method.ok_or_else(|| bad_value("a homing method is a number from -128 to 127"))?;
                let Manner { wait, within, .. } = self.manner()?;
                Motion::Home { method, speed: self.speed()?, wait, within }.into()
            }
            other => return Err(bad_value(format!("a drive cannot {other:?}"))),
        })
    }

    /// Of a way whose target decides the direction.
    fn speed(&self) -> PyResult<Option<Along<Rpm>>> {
        Ok(above_zero("speed_rpm", self.speed_rpm)?.map(|speed| Rpm(speed).into()))
    }

    fn manner(&self) -> PyResult<Manner> {
        let ramp = |name, rate| Ok::<_, PyErr>(above_zero(name, rate)?.map(|rate| Ramp::RpmPerSecond(rate).into()));
        Ok(Manner {
            acceleration: ramp("acceleration_rpm_s", self.acceleration_rpm_s)?,
            deceleration: ramp("deceleration_rpm_s", self.deceleration_rpm_s)?,
            wait: self.wait,
            within: self.limit_s.map(duration).transpose()?,
        })
    }

    fn value(&self) -> PyResult<f64> {
        let value = self.value.filter(|value| value.is_finite());
        value.ok_or_else(|| bad_value(format!("{} needs a number", self.do_)))
    }

    fn angle(&self) -> PyResult<Angle> {
        match self.counts {
            Some(counts) => Ok(Angle::Counts(counts)),
            None => self.value().map(|degrees| Angle::Turns(degrees / 360.0)),
        }
    }
}

/// A number of which there has to be some: NaN, infinitely many and none are refused before anything is sent.
fn above_zero(name: &str, value: Option<f64>) -> PyResult<Option<f64>> {
    match value {
        Some(number) if !(number.is_finite() && number > 0.0) => Err(bad_value(format!(
            "{name} is {number}: expected a finite number above 0, or None to leave it as the drive has it"
        ))),
        value => Ok(value),
    }
}

/// A time that Python gives in seconds.
pub(super) fn duration(seconds: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(seconds).map_err(|error| bad_value(format!("{seconds} s: {error}")))
}

//! Commands to one node, as JSON.

use super::capture::CaptureCommand;
use super::fields::{Fields, command, taken};
use super::parameters::{ParameterChange, ParameterReading};
use super::pdo::PdoCommand;
use super::tune::TuneCommand;
use master::drive::{self, Manner};
use master::units::{Amperes, Angle, Ramp, Rpm};

/// What one node is to do.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeCommand {
    /// A command of the master to a drive.
    Drive(drive::Command),
    /// Turns as long as it is held.
    Jog {
        /// Speed in r/min.
        rpm: f64,
    },
    /// Holds a jog; at least every 100 ms.
    JogHold,
    /// Ends a jog: the drive stops with its ramp.
    JogEnd,
    /// Allows motions of this drive although nothing stops it when this program dies. Holds until control changes hands.
    AcceptUnguarded,
    /// Explains what keeps a drive from moving.
    Explain,
    /// Reads the homing methods of a drive, its homing settings and the present levels of its switches.
    Homing,
    /// Lists the objects in the description of a drive.
    Objects,
    /// Reads or plans parameters.
    Read(ParameterReading),
    /// Changes parameters.
    Change(ParameterChange),
    /// Something with its PDOs.
    Pdos(PdoCommand),
    /// A capture, or a report.
    Capture(CaptureCommand),
    /// Gains, or ramps.
    Tune(TuneCommand),
}

impl NodeCommand {
    const WORDS: &[&str] = &[
        "enable",
        "disable",
        "reset_fault",
        "stop",
        "quick_stop",
        "velocity",
        "move",
        "torque",
        "home",
        "jog",
        "jog_hold",
        "jog_end",
        "accept_unguarded",
        "explain",
        "homing",
        "objects",
    ];

    pub(super) fn words() -> impl Iterator<Item = &'static str> {
        let of_parameters = [ParameterReading::WORDS, ParameterChange::WORDS];
        let others = [PdoCommand::WORDS, CaptureCommand::WORDS, TuneCommand::WORDS, Self::WORDS];
        of_parameters.into_iter().chain(others).flatten().copied()
    }

    /// Whether it needs control.
    pub(super) const fn needs_control(&self) -> bool {
        match self {
            Self::Drive(drive::Command::QuickStop) | Self::Explain | Self::Homing | Self::Objects | Self::Read(_) => {
                false
            }
            Self::Drive(_)
            | Self::Jog { .. }
            | Self::JogHold
            | Self::JogEnd
            | Self::AcceptUnguarded
            | Self::Change(_) => true,
            Self::Pdos(command) => command.needs_control(),
            Self::Capture(command) => command.needs_control(),
            Self::Tune(command) => command.needs_control(),
        }
    }
}

impl From<drive::Command> for NodeCommand {
    fn from(command: drive::Command) -> Self {
        Self::Drive(command)
    }
}

/// A command of one of the [words](NodeCommand::words).
pub(super) fn read(word: &str, mut fields: Fields) -> Result<NodeCommand, String> {
    if ParameterReading::WORDS.contains(&word) {
        return command(word, fields).map(NodeCommand::Read);
    }
    if ParameterChange::WORDS.contains(&word) {
        return command(word, fields).map(NodeCommand::Change);
    }
    if PdoCommand::WORDS.contains(&word) {
        return command(word, fields).map(NodeCommand::Pdos);
    }
    if CaptureCommand::WORDS.contains(&word) {
        return command(word, fields).map(NodeCommand::Capture);
    }
    if TuneCommand::WORDS.contains(&word) {
        return command(word, fields).map(NodeCommand::Tune);
    }
    fields.remove("do");
    let command = match word {
        "jog" => NodeCommand::Jog { rpm: taken(&mut fields, "rpm")? },
        "jog_hold" => NodeCommand::JogHold,
        "jog_end" => NodeCommand::JogEnd,
        "accept_unguarded" => NodeCommand::AcceptUnguarded,
        "explain" => NodeCommand::Explain,
        "homing" => NodeCommand::Homing,
        "objects" => NodeCommand::Objects,
        _ => NodeCommand::Drive(to_drive(word, &mut fields)?),
    };
    match fields.keys().next() {
        Some(name) => Err(format!("unknown field `{name}`: `{word}` does not have it")),
        None => Ok(command),
    }
}

fn to_drive(word: &str, fields: &mut Fields) -> Result<drive::Command, String> {
    use drive::{Command, Motion};
    let speed = |fields: &mut Fields| Ok::<_, String>(taken::<Option<f64>>(fields, "rpm")?.map(|rpm| Rpm(rpm).into()));
    Ok(match word {
        "enable" => Command::Enable,
        "disable" => Command::Disable,
        "reset_fault" => Command::ResetFault,
        "stop" => Command::Stop,
        "quick_stop" => Command::QuickStop,
        "velocity" => {
            let ramp: Option<f64> = taken(fields, "rpm_per_s")?;
            let ramp = ramp.map(|rate| Ramp::RpmPerSecond(rate).into());
            let manner = Manner { acceleration: ramp, deceleration: ramp, ..Manner::default() };
            Motion::Velocity(Rpm(taken(fields, "rpm")?).into(), manner).into()
        }
        "move" => {
            let degrees: f64 = taken(fields, "degrees")?;
            let relative: Option<bool> = taken(fields, "relative")?;
            let to = Angle::Turns(degrees / 360.0).into();
            let (speed, manner) = (speed(fields)?, Manner::default());
            Motion::Move { to, relative: relative.unwrap_or_default(), speed, manner }.into()
        }
        "torque" => Motion::Torque(Amperes(taken(fields, "amperes")?)).into(),
        "home" => {
            Motion::Home { method: taken(fields, "method")?, speed: speed(fields)?, wait: true, within: None }.into()
        }
        _ => return Err(format!("unknown command `{word}`")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_a_command_and_a_field_that_it_does_not_have_is_refused() {
        let all = || Fields::from_iter(["rpm", "degrees", "amperes", "method"].map(|name| (name.into(), 1.into())));
        for word in NodeCommand::WORDS {
            // With what it has of these fields it is whole; what is left over is named.
            let mut fields = all();
            let refused = loop {
                match read(word, fields.clone()) {
                    Ok(_) => break None,
                    Err(error) => match error.strip_prefix("unknown field `").and_then(|rest| rest.split_once('`')) {
                        Some((name, _)) => fields.remove(name),
                        None => break Some(error),
                    },
                };
            };
            assert_eq!(refused, None, "{word}");
        }
    }
}

//! Encoders on the shafts of drives: what the one node turns, another one measures.

use super::member::Member;
use super::{StationId, World, WorldError};
use crate::refused::Refused;
use crate::stimulus::Place;

impl World {
    /// Puts the encoder `number` onto the motor shaft of an axis of another node, in place of the one that it sat on. It sees the shaft
    /// as it is at each moment that it looks.
    ///
    /// # Errors
    /// That there is no such node. Inside: that the first is not an encoder, or the other has no such shaft.
    pub fn mount(&mut self, number: u8, shaft: Place) -> Result<Result<(), Refused>, WorldError> {
        let encoder = self.drive_id(number).ok_or(WorldError::NoSuchDrive(number))?.index();
        let turns =
            self.with_drive(shaft.node, |drive, _| drive.check_axis(shaft.axis).map(|()| drive.report_of(shaft.axis)))?;
        let is_encoder = self.with_drive(number, |drive, _| (drive.reads_a_shaft(), drive.model()))?;
        match (turns, is_encoder) {
            (Err(refused), _) => Ok(Err(refused)),
            (_, (false, model)) => Ok(Err(Refused::Absent { model, what: "shaft to sit on: it is not an encoder" })),
            (Ok(report), _) if report.physics.is_none() => {
                let model = self.with_drive(shaft.node, |drive, _| drive.model())?;
                Ok(Err(Refused::Absent { model, what: "shaft that an encoder could sit on" }))
            }
            _ => {
                self.mounted.retain(|(station, _)| *station != encoder);
                self.mounted.push((encoder, shaft));
                self.look_at_shaft(encoder);
                Ok(Ok(()))
            }
        }
    }

    /// Before anything is let into a station that sits on a shaft: it sees the shaft as it is now.
    pub(super) fn look_at_shaft(&mut self, station: usize) {
        let Some((_, shaft)) = self.mounted.iter().find(|(encoder, _)| *encoder == station).copied() else { return };
        // A drive that has been removed turns nothing: the encoder stays where it is.
        let Some(report) = self.measure(shaft) else { return };
        if let Member::Drive { drive, .. } = &mut self.members[station] {
            drive.see_shaft(report.shaft_angle_rad / core::f64::consts::TAU, report.velocity_rpm / 60.0);
        }
    }

    /// What an encoder is on, if it is on anything.
    pub fn shaft_of(&self, encoder: StationId) -> Option<Place> {
        self.mounted.iter().find(|(station, _)| *station == encoder.index()).map(|(_, shaft)| *shaft)
    }
}

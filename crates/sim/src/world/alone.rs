//! The shaft of a drive that is in no world, moved from outside by the same body, exchanges and control periods as one that is.

use core::time::Duration;

use can::Instant;
use plant::coupled::{Body, ExternalData, ExternalModel};

use super::bodies::next_period;
use super::body::{CoupledBody, Shaft};
use super::external::{ExchangeError, Given};
use crate::coupling::{Coupling, CouplingError};
use crate::stimulus::Place;
use crate::{AxisId, VirtualDrive};

/// The first shaft of one drive, which a program outside moves: what [`World::couple`](crate::World::couple) and
/// [`World::exchange`](crate::World::exchange) are to the drives of a world. The program that holds the drive calls [`settle`](Self::settle)
/// before it lets anything into it, always with the same drive.
#[derive(Clone)]
pub struct LoneShaft {
    body: CoupledBody,
}

impl LoneShaft {
    /// Takes the shaft of a drive over, for ever; it is brought up to `now`. The joint is the drive's output shaft.
    ///
    /// # Errors
    /// [`CouplingError`] says what is in the way; nothing is changed then.
    pub fn couple(drive: &mut dyn VirtualDrive, model: ExternalModel, now: Instant) -> Result<Self, CouplingError> {
        let body = Coupling::External(model).body()?;
        if model.count() != 1 {
            return Err(CouplingError::Count { kind: "lone shaft", least: 1, most: 1, given: model.count() });
        }
        let place = Place { node: drive.report().node, axis: AxisId::FIRST };
        let period = next_period(drive, place, now)?;
        let mechanics = drive.mechanics().ok_or(CouplingError::NoShaft(place))?;
        let turns = mechanics.couple(place.axis)?;
        let mut body = CoupledBody::new("external", body, period, 1);
        body.join(Shaft { station: 0, axis: place.axis }, turns);
        Ok(Self { body })
    }

    /// When the next control period begins, and how long each is.
    pub fn next_period(&self) -> (Instant, Duration) {
        (self.body.next, Duration::from_nanos(self.body.period_ns))
    }

    /// Brings the drive and its shaft up to `now`.
    pub fn settle(&mut self, drive: &mut dyn VirtualDrive, now: Instant) {
        self.body.bring_up(drive, now);
    }

    /// Whether an exchange could begin, once all up to now is settled.
    ///
    /// # Errors
    /// [`ExchangeError`], as of a world's.
    pub fn check_exchange(&self, dt: Duration, given: Given<'_>) -> Result<(), ExchangeError> {
        let (Given::Motion(first, _) | Given::Torque(first)) = given;
        let second = if let Given::Motion(_, second) = given { second } else { first };
        if let Some(other) = [first, second].into_iter().find(|values| values.len() != 1) {
            return Err(ExchangeError::Length { expected: 1, given: other.len() });
        }
        given.check()?;
        self.body.check_exchange(dt, given, 0)
    }

    /// Begins an exchange: `dt` has to pass now, and then the torque is there.
    ///
    /// # Errors
    /// [`ExchangeError`]; nothing is stored then.
    pub fn begin_exchange(&mut self, dt: Duration, given: Given<'_>) -> Result<(), ExchangeError> {
        self.check_exchange(dt, given)?;
        self.body.begin_exchange(dt, given);
        Ok(())
    }

    /// Torque of the drive at the joint less its friction, the mean of the last exchange, N·m.
    pub fn torque_nm(&self) -> f64 {
        self.data().map_or(0.0, |data| data.torque_nm(0))
    }

    /// Inertia of the drive at the joint, kg·m²; 0 before the first control period.
    pub fn inertia_kg_m2(&self) -> f64 {
        self.data().map_or(0.0, |data| data.inertia_kg_m2(0))
    }

    fn data(&self) -> Option<&ExternalData> {
        match &self.body.body {
            Body::External(_, data) => Some(data),
            _ => None,
        }
    }
}

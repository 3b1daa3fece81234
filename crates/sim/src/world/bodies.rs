//! Machines that several drives of a world move together.

use can::Instant;

use super::World;
use super::body::{CoupledBody, Shaft};
use super::member::Member;
use crate::coupling::{self, BodyState, CoupledShaft, Coupling, CouplingError};
use crate::mechanics::Mechanics;
use crate::stimulus::{BodyStimulus, Place};
use crate::{Refused, VirtualDrive};

impl World {
    /// Joins drives to a machine that they move together, under a name, for ever. Their shafts are those of the machine from now
    /// on: what else hangs on them stays.
    ///
    /// # Errors
    /// [`CouplingError`] says what is in the way; nothing is changed then.
    pub fn couple(&mut self, name: &str, coupling: &Coupling, shafts: &[CoupledShaft]) -> Result<(), CouplingError> {
        if self.bodies.iter().any(|body| body.name == name) {
            return Err(CouplingError::DuplicateName(name.to_owned()));
        }
        let body = coupling.body()?;
        let ((least, most), given) = (body.motors(), shafts.len());
        if !(least..=most).contains(&given) {
            return Err(CouplingError::Count { kind: coupling.kind(), least, most, given });
        }
        let period = self.check_shafts(shafts)?;
        let mut coupled = CoupledBody::new(name, body, period, given);
        for CoupledShaft { place, turns } in shafts {
            let Some((station, mechanics)) = self.mechanics_of(place.node) else { continue };
            let own = mechanics.couple(place.axis)?;
            coupled.join(Shaft { station, axis: place.axis }, turns * own);
        }
        self.bodies.push(coupled);
        Ok(())
    }

    /// The next control period of these drives, which must be the same; they are brought up to now.
    fn check_shafts(&mut self, shafts: &[CoupledShaft]) -> Result<(Instant, u64), CouplingError> {
        let mut common = None;
        for (i, CoupledShaft { place, turns }) in shafts.iter().enumerate() {
            coupling::check_turns(*turns)?;
            let station = self.drive_id(place.node).ok_or(CouplingError::NoSuchDrive(place.node))?.index();
            let taken = self.bodies.iter().any(|body| body.stations.contains(&station))
                || shafts[..i].iter().any(|other| other.place == *place);
            if taken {
                return Err(CouplingError::Taken(*place));
            }
            let period = self
                .with_drive(place.node, |drive, now| next_period(drive, *place, now))
                .map_err(|_| CouplingError::NoSuchDrive(place.node))??;
            if *common.get_or_insert(period) != period {
                return Err(CouplingError::Period(*place));
            }
        }
        common.ok_or(CouplingError::Count { kind: "body", least: 1, most: plant::coupled::MOST, given: 0 })
    }

    fn mechanics_of(&mut self, number: u8) -> Option<(usize, &mut dyn Mechanics)> {
        let station = self.drive_id(number)?.index();
        match &mut self.members[station] {
            Member::Drive { drive, .. } => Some((station, drive.mechanics()?)),
            _ => None,
        }
    }

    /// The machine of this name, now.
    pub fn body(&mut self, name: &str) -> Option<BodyState> {
        let i = self.bodies.iter().position(|body| body.name == name)?;
        self.bring_up(i);
        let CoupledBody { name, body, .. } = &self.bodies[i];
        Some(coupling::state(name, body))
    }

    /// The names of all machines.
    pub fn body_names(&self) -> impl Iterator<Item = &str> {
        self.bodies.iter().map(|body| body.name.as_str())
    }

    /// The machine that an axis of a drive moves with others, now.
    pub fn body_of(&mut self, place: Place) -> Option<BodyState> {
        let station = self.drive_id(place.node)?.index();
        let is_it = |shaft: &Shaft| shaft.station == station && shaft.axis == place.axis;
        let name = self.bodies.iter().find(|body| body.shafts.iter().any(is_it))?.name.clone();
        self.body(&name)
    }

    /// Changes something at the machine of this name, and marks it in the recording. `None` if there is none; a refusal changes nothing.
    pub fn apply_to_body(&mut self, name: &str, stimulus: &BodyStimulus) -> Option<Result<(), Refused>> {
        let i = self.bodies.iter().position(|body| body.name == name)?;
        self.bring_up(i);
        let changed = coupling::change(&mut self.bodies[i].body, name, stimulus);
        if changed.is_ok() {
            self.mark(&format!("body {name} {stimulus}"));
        }
        Some(changed)
    }

    /// Before anything is let into a drive: the machine that it is part of is brought up to now, with all its drives.
    #[inline]
    pub(super) fn settle(&mut self, station: usize) {
        if !self.bodies.is_empty() {
            self.settle_body_of(station);
        }
        if !self.mounted.is_empty() {
            self.look_at_shaft(station);
        }
    }

    fn settle_body_of(&mut self, station: usize) {
        if let Some(i) = self.bodies.iter().position(|body| body.stations.contains(&station)) {
            self.bring_up(i);
        }
    }

    /// All machines up to now.
    pub(super) fn settle_all(&mut self) {
        (0..self.bodies.len()).for_each(|i| self.bring_up(i));
    }

    fn bring_up(&mut self, i: usize) {
        self.bodies[i].bring_up(self.members.as_mut_slice(), self.now);
    }

    /// The machines' states as bits, for the digest.
    pub(super) fn body_bits(&self) -> impl Iterator<Item = u64> + '_ {
        self.bodies.iter().flat_map(CoupledBody::bits)
    }
}

/// The next control period of a drive whose shaft can be handed over, and its length in ns; it is brought up to `now`.
pub(super) fn next_period(
    drive: &mut dyn VirtualDrive,
    place: Place,
    now: Instant,
) -> Result<(Instant, u64), CouplingError> {
    drive.check_axis(place.axis)?;
    drive.advance(now);
    drive.check_couple(place.axis)?;
    Ok(drive.mechanics().ok_or(CouplingError::NoShaft(place))?.next_period())
}

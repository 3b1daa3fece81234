//! What is written before a drive is measured, and put back afterwards.

use std::collections::BTreeMap;
use std::path::Path;

use canopen::Mux;
use canopen::pdo::PdoId;
use cia402::ModeOfOperation;
use cia402::object::MODES_OF_OPERATION;
use devices::{Description, Integral, Loops};
use master::parameters::{Parameters, PlanOptions, from_any_state};
use master::{Drive, Error};

use super::bench::write;
use crate::capture::Restorer;
use crate::network::params::journal::Kept;
use crate::network::params::source;
use machine::parameters::journal::Journal;
use words::failure::Failure;

/// A drive that is going to be moved, and its parameters changed, for a measurement.
#[derive(Clone, Debug)]
pub struct Setup {
    model: &'static Description,
    loops: Loops,
    /// What it had: each object that is going to be written, and what sets its loops.
    before: BTreeMap<Mux, Vec<u8>>,
    restorer: Restorer,
}

impl Setup {
    /// Reads what is going to be changed, and keeps the way back in the restorer, and in a journal, if one is named. Writes nothing to
    /// the drive. The caller notes what motion begins then. `also` is what is written beside what every measurement writes, such as gains that may be lowered.
    ///
    /// # Errors
    /// The drive is at work, or does not answer; a journal of an earlier transaction is there.
    pub async fn begin(
        (drive, restorer): (&Drive, &Restorer),
        (model, loops): (&'static Description, &Loops),
        also: &[Mux],
        journal: Option<&Path>,
        on_kept: fn(&str),
    ) -> Result<Self, Failure> {
        drive.check_at_rest().await.map_err(source::refused)?;
        let gains = speed_gains(loops);
        // Not changed, and looked at.
        let current = loops.current.into_iter().flat_map(|(kp, ki)| [kp.object, ki.object]);
        let scaled = [loops.position_proportional, loops.speed_filter].into_iter().flatten().map(|it| it.object);
        let others = scaled.chain(loops.rated.into_iter().flatten());
        let ramps = loops.without_ramps.iter().map(|(object, _)| *object);
        let rows = model.dictionary.rows().iter().filter(|row| row.access.is_writable()).map(|row| row.mux());
        let pdos = rows.filter(|mux| PdoId::of_object(mux.index).is_some());
        let changed: Vec<Mux> = ramps.chain(pdos).chain([MODES_OF_OPERATION]).chain(also.iter().copied()).collect();
        let (mut before, mut written) = (BTreeMap::new(), BTreeMap::new());
        let looked_at = gains.into_iter().chain(current).chain(others).filter(|object| !also.contains(object));
        for object in changed.iter().copied().chain(looked_at) {
            match drive.node().upload(object).await {
                Ok(value) => {
                    let value = value.as_bytes().to_vec();
                    // To write a mode of homing begins one on some drives.
                    let starts_homing = object == MODES_OF_OPERATION && value == [ModeOfOperation::HOMING.0 as u8];
                    if changed.contains(&object) && !starts_homing {
                        written.insert(object, value.clone());
                    }
                    before.insert(object, value);
                }
                // What this device does not have is not written either.
                Err(Error::Aborted { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let undo = from_any_state(Some(model), drive.node().id(), &written);
        keep((drive, restorer), journal, undo, on_kept).await?;
        Ok(Self { model, loops: *loops, before, restorer: restorer.clone() })
    }

    /// What an object had.
    pub fn had(&self, object: Mux) -> Option<i64> {
        let bytes = self.before.get(&object)?;
        let mut raw = [0; 8];
        raw.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(i64::from_le_bytes(raw))
    }

    /// The values of the loops' objects.
    pub(super) fn gains(&self, loops: &Loops) -> Vec<(Mux, i64)> {
        let others = [loops.position_proportional, loops.speed_filter].into_iter().flatten().map(|it| it.object);
        let current = loops.current.into_iter().flat_map(|(kp, ki)| [kp.object, ki.object]);
        let rated = loops.rated.into_iter().flatten();
        let all = speed_gains(loops).into_iter().chain(others).chain(current).chain(rated);
        all.filter_map(|object| Some((object, self.had(object)?))).collect()
    }

    /// The quotient of rated torque and rated current, N m/A, where the demand counts by them.
    pub(super) fn rated_constant(&self) -> Option<f64> {
        let [torque, current] = self.loops.rated?.map(|object| self.had(object).filter(|value| *value > 0));
        Some(torque? as f64 / current? as f64)
    }

    /// The least and the largest value of an object.
    pub(super) fn range(&self, object: Mux) -> (i64, i64) {
        self.model.row(object).and_then(|row| row.integer_limits()).unwrap_or((0, i64::from(u16::MAX)))
    }

    /// The gains of the speed loop at this share of what they were, as far as their objects go. A time stays.
    pub(super) fn lowered(&self, share: f64) -> Vec<(Mux, i64)> {
        let integral = match self.loops.speed_integral {
            Integral::Gain(object) => Some(object),
            Integral::Time(_) => None,
        };
        let lowered = |object: Mux| {
            let had = self.had(object)?;
            let least = self.range(object).0.max(1);
            Some((object, ((had as f64 * share).round() as i64).max(least).min(had)))
        };
        [Some(self.loops.speed_proportional), integral].into_iter().flatten().filter_map(lowered).collect()
    }

    /// The shares that proportional and integral gain really have then.
    pub(super) fn shares(&self, share: f64) -> (f64, f64) {
        let lowered = self.lowered(share);
        let of = |object: Mux| {
            let (now, had) = (lowered.iter().find(|(other, _)| *other == object)?.1, self.had(object)?);
            (had != 0).then_some(now as f64 / had as f64)
        };
        let proportional = of(self.loops.speed_proportional).unwrap_or(1.0);
        (proportional, of(self.loops.speed_integral.object()).unwrap_or(proportional))
    }

    /// Set-points take effect at once, and the gains of the speed loop are lowered to this share.
    ///
    /// # Errors
    /// What the drive refuses.
    pub(super) async fn prepare(&self, drive: &Drive, share: f64) -> Result<(), Failure> {
        for (object, value) in self.loops.without_ramps {
            if self.before.contains_key(object) {
                write(drive, *object, *value).await?;
            }
        }
        if share < 1.0 {
            for (object, value) in self.lowered(share) {
                write(drive, object, value).await?;
            }
        }
        Ok(())
    }

    /// The motion has ended: puts everything back, each value read back.
    ///
    /// # Errors
    /// What could not be put back; it stays in the restorer then, and its journal on the disk.
    pub async fn put_back(&self, drive: &Drive) -> Result<(), Failure> {
        self.restorer.end_motion();
        let undone = self.restorer.put_back_newest().await?;
        if undone.not_put_back.is_empty() {
            return Ok(());
        }
        Err(Failure::new(format!("node {}: not everything could be put back after the measurement", drive.node().id()))
            .of_kind("not_put_back")
            .at_node(drive.node().id())
            .because(undone)
            .next("power the drive off and on: nothing was stored"))
    }
}

/// The gains of the speed loop, which a measurement may lower.
pub fn speed_gains(loops: &Loops) -> [Mux; 2] {
    [loops.speed_proportional, loops.speed_integral.object()]
}

/// These writes lead back from what is going to be written: also a journal has them, if a place for it is named.
pub(super) async fn keep(
    (drive, restorer): (&Drive, &Restorer),
    path: Option<&Path>,
    undo: Vec<(Mux, Vec<u8>)>,
    on_kept: fn(&str),
) -> Result<(), Failure> {
    let Some(path) = path else {
        restorer.note_written(undo, None);
        return Ok(());
    };
    let nothing = Parameters::default();
    let identity = drive.plan_parameters(&nothing, PlanOptions::default()).await.map_err(source::refused)?.identity;
    let journal = Journal { node: drive.node().id(), identity, pre_operational: false, undo };
    let kept = Kept::create(path, &journal, on_kept)?;
    restorer.note_written(journal.undo, Some(kept));
    Ok(())
}

//! What is written before a drive is measured, and put back afterwards.

use std::collections::BTreeMap;
use std::path::Path;

use canopen::Mux;
use canopen::pdo::PdoId;
use devices::{Description, Loops};
use master::Drive;
use master::parameters::{Parameters, PlanOptions, from_any_state, roll_back};

use crate::network::params::journal::Kept;
use crate::network::params::source;
use machine::parameters::journal::Journal;
use words::failure::Failure;

/// A drive whose parameters are going to be changed for a measurement.
#[derive(Debug)]
pub struct Setup {
    /// What it had: each object that is going to be written, and gains.
    before: BTreeMap<Mux, Vec<u8>>,
    undo: Vec<(Mux, Vec<u8>)>,
    kept: Option<Kept>,
}

impl Setup {
    /// Reads what is going to be changed, and keeps the way back in a journal, if one is named. Writes nothing to the drive.
    ///
    /// # Errors
    /// The drive is at work, or does not answer; a journal of an earlier transaction is there.
    pub async fn begin(
        drive: &Drive,
        (model, loops): (&'static Description, &Loops),
        journal: Option<&Path>,
        on_kept: fn(&str),
    ) -> Result<Self, Failure> {
        drive.check_at_rest().await.map_err(source::refused)?;
        let gains = [loops.speed_proportional, loops.speed_integral.object(), loops.position_proportional.object];
        let ramps = loops.without_ramps.iter().map(|(object, _)| *object);
        let rows = model.dictionary.rows().iter().map(|row| row.mux());
        let pdos = rows.filter(|mux| PdoId::of_object(mux.index).is_some());
        let filter = loops.speed_filter.map(|filter| filter.object);
        let mut before = BTreeMap::new();
        // Not changed, and looked at: how the current loop is set.
        let current = loops.current.into_iter().flat_map(|(kp, ki)| [kp.object, ki.object]);
        for object in gains.into_iter().chain(filter).chain(current).chain(ramps).chain(pdos) {
            // What this device does not have is not written either.
            if let Ok(value) = drive.node().upload(object).await {
                before.insert(object, value.as_bytes().to_vec());
            }
        }
        let writable = |mux: &Mux| model.row(*mux).is_some_and(|row| row.access.is_writable());
        before.retain(|object, _| writable(object));
        let id = drive.node().id();
        let undo = from_any_state(Some(model), id, &before);
        let wanted = Parameters::default();
        let identity = drive.plan_parameters(&wanted, PlanOptions::default()).await.map_err(source::refused)?.identity;
        let kept = match journal {
            Some(path) => Some(Kept::create(path, &Journal { node: id, identity, undo: undo.clone() }, on_kept)?),
            None => None,
        };
        Ok(Self { before, undo, kept })
    }

    /// The same values without a way back.
    pub(super) fn clone_values(&self) -> Self {
        Self { before: self.before.clone(), undo: Vec::new(), kept: None }
    }

    /// What an object had.
    pub fn had(&self, object: Mux) -> Option<i64> {
        let bytes = self.before.get(&object)?;
        let mut raw = [0; 8];
        raw.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(i64::from_le_bytes(raw))
    }

    /// Puts everything back, each value read back.
    ///
    /// # Errors
    /// What could not be put back; the journal stays then.
    pub async fn put_back(self, drive: &Drive) -> Result<(), Failure> {
        let undone = roll_back(drive.node(), &self.undo, |object| self.before.get(&object).cloned()).await;
        if undone.not_put_back.is_empty() {
            return self.kept.map_or(Ok(()), Kept::remove);
        }
        Err(Failure::new(format!("node {}: not everything could be put back after the measurement", drive.node().id()))
            .at_node(drive.node().id())
            .because(undone)
            .next("power the drive off and on: nothing was stored"))
    }
}

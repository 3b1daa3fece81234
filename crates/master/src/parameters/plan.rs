//! The writes, worked out before the first is sent.

use std::collections::{BTreeMap, BTreeSet};

use canopen::od::{Access as Allowed, Entry};
use canopen::pdo::PdoId;
use canopen::{Mux, NodeId};
use cia402::PowerState;
use devices::{AxisId, Description};

use super::error::{PlanError, Unfit};
use super::order::{ParameterStep, in_order, number, pdo_of};
use super::values::{Left, Parameters, is_command, same};
use crate::drive::Drive;
use crate::error::Error;
use crate::identify::{Identity, identity};

/// What a plan may do.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlanOptions {
    /// Node-ID and bit rate may be written, as the last.
    pub address: bool,
}

/// Writes that make a node's parameters those of a list.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The node.
    pub node: NodeId,
    /// What the node says that it is.
    pub identity: Identity,
    /// The writes in order.
    pub steps: Vec<ParameterStep>,
    /// The values that it shall have in the end.
    pub wanted: BTreeMap<Mux, Vec<u8>>,
    /// The values that the objects of [`steps`](Self::steps) have now.
    pub current: BTreeMap<Mux, Vec<u8>>,
    /// What of the list is left out, and why.
    pub left: Vec<(Mux, Left)>,
    /// The revision that the list was made for, where the node has another of the same behaviour.
    pub other_revision: Option<u32>,
}

impl Plan {
    /// The writes that lead back to how everything is now, in their order. They are legal wherever the plan was broken off.
    pub fn undo(&self) -> Vec<(Mux, Vec<u8>)> {
        self.steps.iter().rev().filter_map(|step| Some((step.object, step.before.clone()?))).collect()
    }
}

impl Drive {
    /// Finds out how the node gets these values. Reads, and writes nothing.
    ///
    /// # Errors
    /// [`PlanError`]: another device than the list is of, or everything in it that this one cannot have.
    pub async fn plan_parameters(&self, wanted: &Parameters, options: PlanOptions) -> Result<Plan, PlanError> {
        let found = identity(self.node()).await?;
        let other_revision = same_device(self.node().id(), &wanted.identity, &found)?;
        let model = self.description();
        let mut left = Vec::new();
        let (mut current, mut unfit, mut usable) = (BTreeMap::new(), Vec::new(), BTreeMap::new());
        for (object, value) in &wanted.values {
            if is_command(*object, model) {
                left.push((*object, Left::Command));
                continue;
            }
            let has = match self.node().upload(*object).await {
                Ok(payload) => payload.as_bytes().to_vec(),
                Err(cause @ Error::Aborted { .. }) => {
                    unfit.push(Unfit::Unreadable { object: *object, cause });
                    continue;
                }
                Err(error) => return Err(error.into()),
            };
            let is_address = model.is_some_and(|model| model.storage.address.contains(object));
            if is_address && !options.address && has != *value {
                left.push((*object, Left::Address));
                continue;
            }
            match self.fits(*object, value, &has, &wanted.values).await? {
                Fit::Yes => {
                    current.insert(*object, has);
                    usable.insert(*object, value.clone());
                }
                Fit::Left(reason) => left.push((*object, reason)),
                Fit::No(why) => unfit.push(why),
            }
        }
        if !unfit.is_empty() {
            return Err(PlanError::Unfit { node: self.node().id(), unfit });
        }
        self.read_pdos(&usable, &mut current).await?;
        let steps = in_order(model, &current, &usable, false);
        let touched: BTreeSet<Mux> = steps.iter().map(|step| step.object).collect();
        current.retain(|object, _| touched.contains(object));
        let node = self.node().id();
        Ok(Plan { node, identity: found, steps, wanted: usable, current, left, other_revision })
    }

    /// Refuses a drive with an axis that moves or may be moved. Nothing is written to a drive at work.
    ///
    /// # Errors
    /// [`PlanError::AtWork`]; those of the SDO reads.
    pub async fn check_at_rest(&self) -> Result<(), PlanError> {
        let axes = self.description().map_or(1, |model| model.axes.len());
        for axis in (0..axes).filter_map(|axis| u8::try_from(axis).ok()).map(AxisId) {
            let of_axis = if axis == self.axis_id() { self.clone() } else { self.axis(axis)? };
            let statusword = match of_axis.statusword().await {
                Ok(statusword) => statusword,
                // A device that is not a drive, or whose model is not known.
                Err(Error::Aborted { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            if let Some(state @ (PowerState::OperationEnabled | PowerState::QuickStopActive)) =
                of_axis.power_state(statusword)
            {
                return Err(PlanError::AtWork { node: self.node().id(), axis, state });
            }
        }
        Ok(())
    }

    /// Whether the object can have the value, as far as that is known before it is tried.
    async fn fits(
        &self,
        object: Mux,
        value: &[u8],
        has: &[u8],
        wanted: &BTreeMap<Mux, Vec<u8>>,
    ) -> Result<Fit, PlanError> {
        let row = self.description().and_then(|model: &Description| model.row(object));
        if same(object, value, has) {
            let fixed = row.is_some_and(|row| !row.access.is_writable());
            return Ok(if fixed { Fit::Left(Left::Fixed) } else { Fit::Yes });
        }
        let Some(row) = row else {
            let length = Unfit::Length { object, expected: has.len(), given: value.len() };
            return Ok(if has.len() == value.len() { Fit::Yes } else { Fit::No(length) });
        };
        if !matches!(row.access, Allowed::ReadWrite) {
            return Ok(Fit::No(Unfit::ReadOnly { object, name: row.name, has: has.to_vec() }));
        }
        let size = row.data_type.size();
        if size > 0 && size != value.len() {
            return Ok(Fit::No(Unfit::Length { object, expected: size, given: value.len() }));
        }
        // Of types that a cell holds; texts and the like have no limits to compare with.
        if !row.data_type.fits_cell() || !row.data_type.is_integer() {
            return Ok(Fit::Yes);
        }
        let asked = row.data_type.value(number(value));
        self.check_write(object, asked)?;
        let moves = row.resolution.is_some_and(|resolution| wanted.contains_key(&resolution));
        if moves {
            // The limits are going to move with the write before this one: the drive says.
            return Ok(Fit::Yes);
        }
        self.within_limits(row, asked).await
    }

    async fn within_limits(&self, row: &'static Entry, asked: i64) -> Result<Fit, PlanError> {
        match self.check_number(row.mux(), asked).await {
            Ok(_) => Ok(Fit::Yes),
            Err(Error::OutOfLimits { limits, .. }) => Ok(Fit::No(Unfit::OutOfLimits { asked, limits })),
            Err(error) => Err(error.into()),
        }
    }

    /// A PDO is set up as a whole: what of it is not in the list stays as it is, and has to be known for the way back.
    async fn read_pdos(
        &self,
        wanted: &BTreeMap<Mux, Vec<u8>>,
        current: &mut BTreeMap<Mux, Vec<u8>>,
    ) -> Result<(), PlanError> {
        let pdos: BTreeSet<PdoId> = wanted.keys().filter_map(|object| pdo_of(*object)).collect();
        for pdo in pdos {
            for object in [Mux::new(pdo.parameter_index(), 1), Mux::new(pdo.mapping_index(), 0)] {
                if current.contains_key(&object) {
                    continue;
                }
                match self.node().upload(object).await {
                    Ok(payload) => {
                        current.insert(object, payload.as_bytes().to_vec());
                    }
                    Err(Error::Aborted { .. }) => {}
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(())
    }
}

enum Fit {
    Yes,
    Left(Left),
    No(Unfit),
}

/// Whether a list made for one device is for the one that is there. A revision whose upper half is the same behaves the same
/// on the bus (CiA 301, 7.5.2.21): a difference below that is reported, not refused.
fn same_device(node: NodeId, wanted: &Identity, found: &Identity) -> Result<Option<u32>, PlanError> {
    let differ = |wanted: Option<u32>, found: Option<u32>| matches!((wanted, found), (Some(a), Some(b)) if a != b);
    let major = |revision: Option<u32>| revision.map(|revision| revision >> 16);
    if differ(wanted.vendor_id, found.vendor_id)
        || differ(wanted.product_code, found.product_code)
        || differ(wanted.device_type, found.device_type)
        || differ(major(wanted.revision_number), major(found.revision_number))
    {
        return Err(PlanError::OtherDevice { node, wanted: *wanted, found: *found });
    }
    let other = differ(wanted.revision_number, found.revision_number);
    Ok(wanted.revision_number.filter(|_| other))
}

//! The writes themselves, each read back, and the way back.

use canopen::pdo::Direction;
use canopen::{AbortCode, Mux};

use super::error::{ApplyError, PlanError, Why};
use super::order::{ParameterStep, Purpose, pdo_of};
use super::plan::Plan;
use super::read::{Deviation, verify};
use super::undone::{Undone, roll_back};
use super::values::same;
use crate::drive::{Drive, Limits};
use crate::error::Error;

/// Everything was written and read back.
#[derive(Clone, Debug)]
pub struct Applied {
    /// How many writes.
    pub writes: usize,
    /// Values that the drive took and keeps as others.
    pub rounded: Vec<Rounded>,
    /// Values that were right after their own write, and are others after all writes.
    pub displaced: Vec<Deviation>,
}

/// A value that the drive made another of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rounded {
    /// Which object.
    pub object: Mux,
    /// What was written.
    pub asked: Vec<u8>,
    /// What it has.
    pub found: Vec<u8>,
}

impl Drive {
    /// Writes a plan, each value read back. On the first refusal everything written is put back. `progress` hears each step.
    ///
    /// # Errors
    /// [`PlanError::AtWork`] before anything is written; [`ApplyError`] after the way back.
    pub async fn apply_parameters(
        &self,
        plan: &Plan,
        progress: impl FnMut(usize, &ParameterStep),
    ) -> Result<Result<Applied, ApplyError>, PlanError> {
        self.check_at_rest().await?;
        self.write_steps(plan, progress).await
    }

    /// As [`apply_parameters`](Self::apply_parameters); a plan that changes TPDOs alone is written to a drive at work too: what it
    /// sends, and when, changes nothing of what it does.
    ///
    /// # Errors
    /// Those of [`apply_parameters`](Self::apply_parameters).
    pub async fn apply_tpdos(&self, plan: &Plan) -> Result<Result<Applied, ApplyError>, PlanError> {
        let is_tpdo = |step: &ParameterStep| pdo_of(step.object).is_some_and(|pdo| pdo.direction == Direction::Tpdo);
        if !plan.steps.iter().all(is_tpdo) {
            self.check_at_rest().await?;
        }
        self.write_steps(plan, |_, _| ()).await
    }

    async fn write_steps(
        &self,
        plan: &Plan,
        mut progress: impl FnMut(usize, &ParameterStep),
    ) -> Result<Result<Applied, ApplyError>, PlanError> {
        let mut rounded = Vec::new();
        for (position, step) in plan.steps.iter().enumerate() {
            progress(position + 1, step);
            let (why, written) = match self.take(step).await {
                StepResult::Yes => continue,
                StepResult::As(found) => {
                    rounded.push(Rounded { object: step.object, asked: step.value.clone(), found });
                    continue;
                }
                StepResult::No { why, written } => (why, written),
            };
            let done = &plan.steps[..position + usize::from(written)];
            let undone = self.go_back(plan, done).await;
            return Ok(Err(ApplyError {
                node: plan.node,
                object: step.object,
                value: step.value.clone(),
                purpose: step.purpose,
                step: position + 1,
                of: plan.steps.len(),
                limits: self.limits_in_force(step, &why).await,
                why,
                undone,
            }));
        }
        let mut displaced = verify(self.node(), &plan.wanted).await.map_err(PlanError::Node)?;
        displaced.retain(|deviation| rounded.iter().all(|rounded| rounded.object != deviation.object));
        Ok(Ok(Applied { writes: plan.steps.len(), rounded, displaced }))
    }

    async fn take(&self, step: &ParameterStep) -> StepResult {
        let node = self.node();
        match node.download(step.object, &step.value).await {
            Ok(()) => {}
            // Some devices map regardless and have no such bit: what follows shows whether this one does.
            Err(Error::Aborted { .. }) if step.purpose == Purpose::SwitchOff => return StepResult::Yes,
            Err(error) => {
                // After silence it is not known.
                let written = error.abort().is_none();
                return StepResult::No { why: Why::Failed(error), written };
            }
        }
        match node.upload(step.object).await {
            Ok(payload) if same(step.object, &step.value, payload.as_bytes()) => StepResult::Yes,
            Ok(_) if step.purpose == Purpose::SwitchOff => StepResult::Yes,
            Ok(payload) => {
                let found = payload.as_bytes().to_vec();
                // An identifier or a mapping that is nearly right is wrong; a speed is not.
                let exact = matches!(step.object.index, 0x1000..=0x1FFF) && !is_time(step.object);
                if exact {
                    StepResult::No { why: Why::ReadsBack { found }, written: true }
                } else {
                    StepResult::As(found)
                }
            }
            Err(error) => StepResult::No { why: Why::Failed(error), written: true },
        }
    }

    /// Puts back what `done` has written, in reverse, and reads it back.
    async fn go_back(&self, plan: &Plan, done: &[ParameterStep]) -> Undone {
        let undo: Vec<(Mux, Vec<u8>)> =
            done.iter().rev().filter_map(|step| Some((step.object, step.before.clone()?))).collect();
        roll_back(self.node(), &undo, |object| plan.current.get(&object).cloned()).await
    }

    async fn limits_in_force(&self, step: &ParameterStep, why: &Why) -> Option<Limits> {
        let by_value = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW];
        let Why::Failed(error) = why else { return None };
        if !error.abort().is_some_and(|code| by_value.contains(&code)) || pdo_of(step.object).is_some() {
            return None;
        }
        self.limits(step.object).await.ok()
    }
}

/// A time of the communication profile, which a device may round to what its clock counts.
const fn is_time(object: Mux) -> bool {
    matches!(object.index, 0x1006 | 0x1007 | 0x100C | 0x1015 | 0x1017)
        || matches!(object.index, 0x1400..=0x15FF | 0x1800..=0x19FF) && matches!(object.sub_index, 3 | 5)
}

enum StepResult {
    Yes,
    As(Vec<u8>),
    No {
        why: Why,
        /// The object may have the value.
        written: bool,
    },
}

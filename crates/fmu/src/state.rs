//! The state of an instance as a value and as bytes.

use serde::{Deserialize, Serialize};

use crate::call::{CallError, Called};
use crate::instance::Instance;
use crate::unit::Action;

/// A state, to be taken back by an instance of the same FMU.
pub struct SavedState(Box<Instance>);

/// What a state is as bytes: of what FMU, and what was done to it since its begin. Taking it back does all that again, a few
/// milliseconds for each simulated second.
#[derive(Serialize, Deserialize)]
struct StateBytes {
    token: String,
    actions: Vec<Action>,
    rest: crate::instance::Rest,
}

/// Bytes of the check sum before the rest.
const CHECK_SUM: usize = 4;

impl SavedState {
    /// The whole state of an instance.
    ///
    /// # Errors
    /// Of a drive with its master: more was done to it than is kept.
    pub fn of(instance: &Instance) -> Called<Self> {
        Ok(Self(Box::new(instance.copy()?)))
    }

    /// Has an instance go on from it.
    ///
    /// # Errors
    /// As of [`of`](Self::of).
    pub fn restore(&self, instance: &mut Instance) -> Called<()> {
        *instance = self.0.copy()?;
        Ok(())
    }

    /// The state as bytes.
    ///
    /// # Errors
    /// More was done to it than is kept.
    pub fn bytes(&self) -> Called<Vec<u8>> {
        let instance = &self.0;
        let written = StateBytes {
            token: instance.token.clone(),
            actions: instance.journal.actions()?.to_vec(),
            rest: instance.rest(),
        };
        // Numbers, texts and lists of them: they always have a form.
        let body = rmp_serde::to_vec(&written).unwrap_or_default();
        let mut bytes = crc32fast::hash(&body).to_le_bytes().to_vec();
        bytes.extend(body);
        Ok(bytes)
    }

    /// A state from bytes, for an FMU like `of`.
    ///
    /// # Errors
    /// The bytes are torn, of another FMU, or of what cannot have been.
    pub fn from_bytes(bytes: &[u8], of: &Instance) -> Called<Self> {
        let error = |what: String| CallError(format!("not a state of this FMU: {what}"));
        let (sum, body) = bytes.split_at_checked(CHECK_SUM).ok_or_else(|| error("too few bytes".to_owned()))?;
        if sum != crc32fast::hash(body).to_le_bytes() {
            return Err(error("its check sum is wrong".to_owned()));
        }
        let written: StateBytes = rmp_serde::from_slice(body).map_err(|torn| error(torn.to_string()))?;
        if written.token != of.token {
            return Err(error(format!("it is of {}; expected {}", written.token, of.token)));
        }
        let mut instance = of.anew()?;
        instance.replay(written.actions, written.rest).map_err(|refused| error(refused.to_string()))?;
        Ok(Self(Box::new(instance)))
    }
}

//! A unit with what was done to it since its begin: the same once more gives the same unit, to the last bit.

use crate::unit::{Action, Unit};

/// A unit and its actions, so that its state can become bytes.
pub(crate) struct Journal {
    pub(crate) unit: Unit,
    pub(crate) actions: Vec<Action>,
}

impl Journal {
    /// Of a unit to which nothing was done.
    pub(crate) const fn new(unit: Unit) -> Self {
        Self { unit, actions: Vec::new() }
    }

    /// Does an action and writes it down. Operations that are taken come back.
    ///
    /// # Errors
    /// What the unit does not take; nothing is written down then.
    pub(crate) fn act(&mut self, action: Action) -> Result<Vec<u8>, String> {
        let done = self.unit.act(&action)?;
        match (&action, self.actions.last()) {
            // Two of them are as good as one.
            (Action::Serve, Some(Action::Serve)) => {}
            (Action::Take(_), _) if done.is_empty() => {}
            // Time that passes does all that was due on its way.
            (Action::Advance(to_ns), _) => {
                let kept = match self.actions.as_slice() {
                    [.., Action::Advance(at)] | [.., Action::Advance(at), Action::Serve] if at == to_ns => {
                        return Ok(done);
                    }
                    [kept @ .., Action::Advance(_)] | [kept @ .., Action::Advance(_), Action::Serve] => kept.len(),
                    all => all.len(),
                };
                self.actions.truncate(kept);
                self.actions.push(action);
            }
            _ => self.actions.push(action),
        }
        Ok(done)
    }

    /// Before outputs are read.
    pub(crate) fn look(&mut self) {
        if self.unit.look() {
            self.actions.push(Action::Look);
        }
    }
}

impl Clone for Journal {
    fn clone(&self) -> Self {
        let unit = match &self.unit {
            Unit::Drive(drive) => Unit::Drive(drive.clone()),
            Unit::Bus(bus) => Unit::Bus(bus.clone()),
            // Its master waits in the middle of a request, and that cannot be copied: it is brought there again.
            Unit::Axis(axis) => {
                let mut unit = Unit::Axis(Box::new(axis.anew()));
                for action in &self.actions {
                    // It was taken before, and is now.
                    let _ = unit.act(action);
                }
                unit
            }
        };
        Self { unit, actions: self.actions.clone() }
    }
}

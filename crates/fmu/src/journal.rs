//! A unit with what was done to it since its begin: the same once more gives the same unit, to the last bit.

use crate::call::{Called, refused};
use crate::unit::{Action, Unit};

/// So many bytes of actions are kept. An importer that never asks for a state does not pay more for those it could ask for.
const KEPT: usize = 256 << 20;

/// A unit and its actions, so that its state can become bytes.
pub(crate) struct Journal {
    pub(crate) unit: Unit,
    /// `None` when they were more than are kept.
    actions: Option<Vec<Action>>,
    /// Bytes of operations in them.
    received: usize,
    kept: usize,
}

impl Journal {
    /// Of a unit to which nothing was done.
    pub(crate) const fn new(unit: Unit) -> Self {
        Self { unit, actions: Some(Vec::new()), received: 0, kept: KEPT }
    }

    /// What was done.
    ///
    /// # Errors
    /// It was more than is kept.
    pub(crate) fn actions(&self) -> Called<&[Action]> {
        let Some(actions) = &self.actions else {
            let kept = self.kept >> 20;
            return refused(format!(
                "more was done since the begin than is kept of it ({kept} MiB); states are of shorter runs"
            ));
        };
        Ok(actions)
    }

    /// Does an action and writes it down. Operations that are taken come back.
    ///
    /// # Errors
    /// What the unit does not take; nothing is written down then.
    pub(crate) fn act(&mut self, action: Action) -> Result<Vec<u8>, String> {
        let done = self.unit.act(&action)?;
        let Some(actions) = &mut self.actions else { return Ok(done) };
        match (&action, actions.as_slice()) {
            // Two of them are as good as one.
            (Action::Serve, [.., Action::Serve]) => return Ok(done),
            (Action::Take(_), _) if done.is_empty() => return Ok(done),
            // Time that passes does all that was due on its way.
            (Action::Advance(to_ns), [.., Action::Advance(at)] | [.., Action::Advance(at), Action::Serve])
                if at == to_ns =>
            {
                return Ok(done);
            }
            (
                Action::Advance(_),
                [before @ .., Action::Advance(_)] | [before @ .., Action::Advance(_), Action::Serve],
            ) if !self.unit.counts_steps() => {
                let before = before.len();
                actions.truncate(before);
            }
            (Action::Receive(_, bytes), _) => self.received += bytes.len(),
            _ => {}
        }
        self.keep(action);
        Ok(done)
    }

    /// Before outputs are read.
    pub(crate) fn look(&mut self) {
        if self.unit.look() {
            self.keep(Action::Look);
        }
    }

    fn keep(&mut self, action: Action) {
        let Some(actions) = &mut self.actions else { return };
        actions.push(action);
        if size_of_val(actions.as_slice()) + self.received > self.kept {
            self.actions = None;
        }
    }

    /// One that goes on as this one.
    ///
    /// # Errors
    /// Of a drive with its master: more was done than is kept.
    pub(crate) fn copy(&self) -> Called<Self> {
        let unit = match &self.unit {
            Unit::Drive(drive) => Unit::Drive(drive.clone()),
            Unit::Bus(bus) => Unit::Bus(bus.clone()),
            // Its master waits in the middle of a request, and that cannot be copied: it is brought there again.
            Unit::Axis(axis) => {
                let mut unit = Unit::Axis(Box::new(axis.anew()));
                for action in self.actions()? {
                    // It was taken before, and is now.
                    let _ = unit.act(action);
                }
                unit
            }
        };
        Ok(Self { unit, actions: self.actions.clone(), ..*self })
    }

    /// Does once more what was done to another unit, to one to which nothing was done.
    ///
    /// # Errors
    /// The first action that is not taken, and why.
    pub(crate) fn replay(&mut self, actions: Vec<Action>) -> Result<(), (Action, String)> {
        for action in actions {
            self.unit.act(&action).map_err(|error| (action.clone(), error))?;
            if let Action::Receive(_, bytes) = &action {
                self.received += bytes.len();
            }
            self.keep(action);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{AxisConfig, BusConfig, Config, DriveConfig, TargetKind, TxClock};

    fn journal(config: &Config, kept: usize) -> Journal {
        let mut journal = Journal { kept, ..Journal::new(Unit::new(config, ".".as_ref()).unwrap()) };
        journal.act(Action::Begin).unwrap();
        journal
    }

    /// Frames that come in for a long time take no more room than is kept; what goes on is the same.
    #[test]
    fn no_more_is_kept_than_fits() {
        let bus = Config::Bus(BusConfig { nodes: 2, bitrate: 500_000, clock: TxClock::Countdown });
        let [mut short, mut long] = [2 << 20, usize::MAX].map(|kept| journal(&bus, kept));
        let bytes = vec![0x55; 1 << 10];
        let mut lost_at = None;
        for ms in 1..3_000_u64 {
            for it in [&mut short, &mut long] {
                it.act(Action::Receive(0, bytes.clone())).unwrap();
                it.act(Action::Advance(ms * 1_000_000)).unwrap();
            }
            if short.actions().is_err() {
                lost_at.get_or_insert(ms);
            }
        }
        // 1 KiB and two actions each time.
        let expected = (2 << 20) / ((1 << 10) + 2 * size_of::<Action>() as u64);
        assert!(lost_at.unwrap().abs_diff(expected) <= 1, "{lost_at:?}, not {expected}");
        assert_eq!(
            short.actions().unwrap_err().0,
            "more was done since the begin than is kept of it (2 MiB); states are of shorter runs"
        );
        let mut copy = short.copy().unwrap();
        for reference in [10, 11] {
            assert_eq!(copy.unit.get(reference), long.unit.get(reference));
        }
    }

    /// A state of it that was not whole would be of another drive.
    #[test]
    fn a_drive_with_its_master_is_not_copied_by_half() {
        let drive = DriveConfig::new("zlac8030l@4");
        let mut axis = journal(&Config::Axis(AxisConfig { mode: TargetKind::Velocity, drive }), 1 << 10);
        assert!(axis.copy().is_ok());
        for target in 0..100 {
            axis.act(Action::Set(23, crate::variable::Value::Float64(f64::from(target)))).unwrap();
        }
        assert!(axis.copy().is_err());
    }
}

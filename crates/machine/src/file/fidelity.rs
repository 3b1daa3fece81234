//! How much of the drives of a machine is computed.

use can::Bitrate;
use sim::Fidelity;
use sim::machine::{Order, Realism};

use super::{BadFile, Machine, Placed};

/// What fidelity mechanical leaves out (docs/fidelity.md).
const NOT_SHOWN: &str = "current ripple, cogging, noise, commutation fault, lost phase or short circuit";

/// And of a stepper.
const NOT_SHOWN_OF_STEPPERS: &str = ", and of a stepper no ripple of its microsteps and no detent at speed";

impl Machine {
    /// What to order for a bus of this rate to have a drive of it: of the fidelity that itself says, or the machine.
    pub fn order_of(&self, placed: &Placed, bitrate: Bitrate) -> Order {
        Order { fidelity: self.fidelity_of(placed), ..placed.spec.order(bitrate) }
    }

    /// How much of a drive of it is computed.
    pub fn fidelity_of(&self, placed: &Placed) -> Fidelity {
        placed.spec.fidelity.or(self.fidelity).unwrap_or_default()
    }

    /// Which of its drives cannot show what `realism = "full"` adds, and why; `None` if all do.
    pub fn bad_realism(&self) -> Option<String> {
        let is_mechanical = |placed: &&Placed| self.fidelity_of(placed) == Fidelity::Mechanical;
        let placed = self.drives.iter().filter(|_| self.realism == Some(Realism::Full)).find(is_mechanical)?;
        let node = placed.spec.node;
        Some(format!(
            "node {node} has fidelity mechanical, which shows nothing of what realism full adds (noise, cogging); expected realism ideal, \
             or fidelity full"
        ))
    }

    pub(super) fn check_realism(&self) -> Result<(), BadFile> {
        match self.bad_realism().zip(self.drives.first()) {
            None => Ok(()),
            Some((what, placed)) => Err(placed.refused(None, &what)),
        }
    }

    /// What those of its drives that are not of fidelity full do not show; `None` if there is none.
    pub fn not_shown(&self) -> Option<String> {
        let drives = || self.drives.iter().filter(|placed| self.fidelity_of(placed) == Fidelity::Mechanical);
        let nodes: Vec<_> = drives().map(|placed| placed.spec.node.to_string()).collect();
        let of = if nodes.len() == 1 { "node" } else { "nodes" };
        let is_stepper = |placed: &Placed| placed.spec.model.axes.iter().any(|axis| axis.open_loop.is_some());
        let more = if drives().any(is_stepper) { NOT_SHOWN_OF_STEPPERS } else { "" };
        let nodes = (!nodes.is_empty()).then(|| nodes.join(", "))?;
        Some(format!("fidelity mechanical of {of} {nodes} shows no {NOT_SHOWN}{more}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_shown_is_that_of_the_drives_that_are_there() {
        let not_shown = |model: &str, fidelity: &str| {
            let text = format!("fidelity = '{fidelity}'\n[[drive]]\nmodel = '{model}'\nnode = 4");
            Machine::parse(&text).expect("it is read").not_shown()
        };
        assert_eq!(not_shown("zlim42c", "full"), None);
        let wheel = not_shown("zlac8030l", "mechanical").expect("it leaves something out");
        assert!(wheel.contains("node 4 shows no current ripple") && !wheel.contains("stepper"), "{wheel}");
        for model in ["zlim42c", "zlim42c-82"] {
            let stepper = not_shown(model, "mechanical").expect("it leaves something out");
            assert!(stepper.contains("of a stepper no ripple of its microsteps"), "{stepper}");
        }
    }

    #[test]
    fn realism_full_is_refused_where_a_drive_could_not_show_it() {
        let built = |top: &str, drive: &str| {
            let text = format!("{top}\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n{drive}");
            Machine::parse(&text).expect("it is read").build().map(|_| ()).map_err(|bad| bad.to_string())
        };
        for (top, drive) in [
            ("realism = 'full'\nfidelity = 'mechanical'", ""),
            ("realism = 'full'", "options = { fidelity = 'mechanical' }"),
        ] {
            let refusal = built(top, drive).expect_err("it would show nothing");
            assert!(refusal.contains("node 4 has fidelity mechanical"), "{refusal}");
        }
        assert_eq!(built("realism = 'full'\nfidelity = 'mechanical'", "options = { fidelity = 'full' }"), Ok(()));
        assert_eq!(built("realism = 'ideal'\nfidelity = 'mechanical'", ""), Ok(()));
    }
}

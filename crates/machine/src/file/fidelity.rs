//! How much of the drives of a machine is computed.

use can::Bitrate;
use sim::Fidelity;
use sim::machine::Order;

use super::{Machine, Placed};

/// What fidelity mechanical leaves out (docs/fidelity.md).
const NOT_SHOWN: &str = "current ripple, cogging, noise, commutation fault, lost phase or short circuit";

impl Machine {
    /// What to order for a bus of this rate to have a drive of it: of the fidelity that itself says, or the machine.
    pub fn order_of(&self, placed: &Placed, bitrate: Bitrate) -> Order {
        Order { fidelity: self.fidelity_of(placed), ..placed.spec.order(bitrate) }
    }

    /// How much of a drive of it is computed.
    pub fn fidelity_of(&self, placed: &Placed) -> Fidelity {
        placed.spec.fidelity.or(self.fidelity).unwrap_or_default()
    }

    /// What those of its drives that are not of fidelity full do not show; `None` if there is none.
    pub fn not_shown(&self) -> Option<String> {
        let nodes = self.drives.iter().filter(|placed| self.fidelity_of(placed) == Fidelity::Mechanical);
        let nodes: Vec<_> = nodes.map(|placed| placed.spec.node.to_string()).collect();
        let of = if nodes.len() == 1 { "node" } else { "nodes" };
        (!nodes.is_empty()).then(|| format!("fidelity mechanical of {of} {} shows no {NOT_SHOWN}", nodes.join(", ")))
    }
}

//! What hosts do with the process data of drives for a while: two of them cannot have the same.

use std::cell::RefCell;
use std::rc::Rc;

use canopen::NodeId;

/// For what a host has a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::host) enum Claim {
    /// It is captured, by TPDOs that are put back.
    Captured,
    /// It is moved in cycles.
    InCycles,
    /// It makes a test motion, is measured for its gains, or its parameters are written or stored: nothing else is done with it.
    Whole,
}

impl Claim {
    /// Whether a further one can begin beside it; `None` for a command by SDO, which holds nothing. What moves in cycles sets PDOs up, of
    /// which a capture that began before may have taken some.
    const fn allows(self, next: Option<Self>) -> bool {
        match (self, next) {
            (Self::Whole, _) => false,
            (_, None) | (Self::InCycles, Some(Self::Captured)) => true,
            (_, Some(_)) => false,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::Captured => "is captured",
            Self::InCycles => "is moved in cycles",
            Self::Whole => "makes a test motion, or its parameters are written",
        }
    }
}

/// Drives that hosts have for a while, for what, and the number of each host.
#[derive(Debug, Default)]
pub(in crate::host) struct Claims(Vec<(NodeId, Claim, usize)>);

/// Drives that a host has; given back when it is dropped.
pub(in crate::host) struct Claimed {
    all: Rc<RefCell<Claims>>,
    nodes: Vec<NodeId>,
    host: usize,
}

impl Claimed {
    /// # Errors
    /// What another host does with one of them.
    pub(super) fn of(
        all: &Rc<RefCell<Claims>>,
        host: usize,
        (nodes, claim): (Vec<NodeId>, Option<Claim>),
    ) -> Result<Self, String> {
        let claims = &mut all.borrow_mut().0;
        let others = claims.iter().filter(|(node, ..)| nodes.contains(node));
        if let Some((node, there, _)) = others.into_iter().find(|(_, there, _)| !there.allows(claim)) {
            let text =
                format!("node {node} {} meanwhile: wait for the end of that, or begin it behind this", there.words());
            return Err(text);
        }
        claims.extend(claim.into_iter().flat_map(|claim| nodes.iter().map(move |node| (*node, claim, host))));
        Ok(Self { all: Rc::clone(all), nodes, host })
    }
}

impl Drop for Claimed {
    fn drop(&mut self) {
        self.all.borrow_mut().0.retain(|(node, _, host)| !(*host == self.host && self.nodes.contains(node)));
    }
}

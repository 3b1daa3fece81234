//! A motion of several drives under way, and its present command.

use std::cell::Cell;
use std::rc::Rc;

use canopen::NodeId;
use master::base::Twist;

use crate::parameters::transactions::Refusal;
use crate::session::DeadMan;

/// The group under way.
pub(crate) struct GroupRun {
    /// Number of the work that runs on each of its nodes.
    pub(crate) generation: u64,
    pub(crate) nodes: Vec<NodeId>,
    /// Speeds and twists are held.
    pub(crate) held: Option<DeadMan>,
    /// Its last command.
    pub(crate) wanted: Rc<Cell<Wanted>>,
}

/// The command of a held motion.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wanted {
    pub(crate) twist: Twist,
    pub(crate) released: bool,
}

/// The outcome of a group.
pub(crate) type GroupOutcome = Result<Vec<String>, Refusal>;

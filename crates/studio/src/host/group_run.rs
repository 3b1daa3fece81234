//! A motion of several drives under way, and its present command.

use std::cell::Cell;
use std::rc::Rc;

use canopen::NodeId;
use master::base::Twist;

use super::transactions::Refusal;
use crate::dead_man::DeadMan;

/// The group under way.
pub(super) struct GroupRun {
    /// Number of the work that runs on each of its nodes.
    pub(super) generation: u64,
    pub(super) nodes: Vec<NodeId>,
    /// Speeds and twists are held.
    pub(super) held: Option<DeadMan>,
    /// Its last command.
    pub(super) wanted: Rc<Cell<Wanted>>,
}

/// The command of a held motion.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    pub(super) twist: Twist,
    pub(super) released: bool,
}

/// The outcome of a group.
pub(super) type GroupOutcome = Result<Vec<String>, Refusal>;

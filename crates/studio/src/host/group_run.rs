//! A motion of several drives that is under way, and what it is told.

use std::cell::Cell;
use std::rc::Rc;

use canopen::NodeId;
use master::base::Twist;

use super::transactions::Refusal;
use crate::dead_man::DeadMan;

/// The group that is under way.
pub(super) struct GroupRun {
    /// That of what runs on each of its nodes.
    pub(super) generation: u64,
    pub(super) nodes: Vec<NodeId>,
    /// Speeds and twists are held.
    pub(super) held: Option<DeadMan>,
    /// What it was last told.
    pub(super) wanted: Rc<Cell<Wanted>>,
}

/// What a held motion is told.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    pub(super) twist: Twist,
    pub(super) let_go: bool,
}

/// What a group tells when it is done.
pub(super) type GroupOutcome = Result<Vec<String>, Refusal>;

//! Where the energy of one step went, from a motor to its book.

/// What windings and shaft did during a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Flows {
    /// Power that the windings took from the bus; negative while regenerating.
    pub(crate) bus_w: f64,
    /// Heat in the phases' resistance per ohm of it.
    pub(crate) heat_w_per_ohm: f64,
    /// Heat of an arc, and of short circuits.
    pub(crate) arc_j: f64,
    /// Heat of all friction.
    pub(crate) friction_j: f64,
    /// Work done on the active load torque.
    pub(crate) load_j: f64,
}

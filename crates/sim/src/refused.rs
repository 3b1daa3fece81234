//! Why a command to a machine is refused.

use canopen::Mux;

/// Why a drive did not take a stimulus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// The model has no such part.
    #[error("a {model} has no {what}")]
    Absent {
        /// The drive's model.
        model: &'static str,
        /// What it does not have.
        what: &'static str,
    },
    /// The model has no input of this name.
    #[error("a {model} has no input {name:?}; it has {present}")]
    NoSuchInput {
        /// The drive's model.
        model: &'static str,
        /// The name given.
        name: String,
        /// The names there are, or `none`.
        present: String,
    },
    /// The model has no such axis.
    #[error("a {model} has no axis {axis}; it has {axes}")]
    NoSuchAxis {
        /// The drive's model.
        model: &'static str,
        /// The axis asked for, counted from 1.
        axis: u16,
        /// How many there are.
        axes: u8,
    },
    /// The objects are the firmware's.
    #[error("a {model} sets its objects by itself; write {object} over the bus, as its host does")]
    OwnObjects {
        /// The drive's model.
        model: &'static str,
        /// The object.
        object: Mux,
    },
    /// The object does not take the value.
    #[error("object {object} does not take it: {reason}")]
    BadObject {
        /// The object.
        object: Mux,
        /// Why, and what it would take.
        reason: String,
    },
    /// The node has no multiplexed PDO to send now.
    #[error(
        "this {model} sends no such PDO now: it has to be operational, with FFh in 1A00h:00 or another TPDO's, and the one before sent"
    )]
    NotSent {
        /// The node's model.
        model: &'static str,
    },
    /// The value makes no sense for this machine.
    #[error("{what} must be {expected}, not {}", shown(*value))]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// What would have been taken.
        expected: &'static str,
        /// What was given.
        value: f64,
    },
    /// A machine that several drives move has nothing of this kind.
    #[error("at the body {name:?} there is no such thing to change; there is {takes}")]
    NotOfBody {
        /// The machine's name.
        name: String,
        /// What can be changed at it.
        takes: &'static str,
    },
    /// Spring and stops stand where the load is, which another gear would change.
    #[error("spring and stops stand where the load is; take them off before the gear is changed")]
    Placed,
    /// A gear of its own between motor and machine.
    #[error("its load hangs on a gear; 'load gear off' before it is coupled, and give the turns of the coupling")]
    GearInTheWay,
    /// The shaft stands beyond the stops.
    #[error("the shaft stands at {position}, beyond these stops; give positions on both sides of it, min or max")]
    BeyondStops {
        /// Actual position in the drive's counts.
        position: i64,
    },
    /// The drive cannot be of the fidelity that was asked for.
    #[error("a {model} cannot be simulated with fidelity mechanical: {reason}")]
    Fidelity {
        /// The drive's model.
        model: &'static str,
        /// Why not, and what to do.
        reason: &'static str,
    },
    /// The fault is one of single phases, of which fidelity mechanical computes none.
    #[error(
        "this {model} is of fidelity mechanical, which computes no single phases; choose fidelity full for this fault"
    )]
    NotShown {
        /// The drive's model.
        model: &'static str,
    },
    /// The image does not come from this model's memory.
    #[error("not a memory image of a {model}: {reason}")]
    BadImage {
        /// The drive's model.
        model: &'static str,
        /// What is wrong with it.
        reason: &'static str,
    },
}

/// A number to be said again in an error: with a power of ten where it would be a long row of digits.
fn shown(value: f64) -> String {
    let is_short = value == 0.0 || (1e-6..1e12).contains(&value.abs());
    if is_short || !value.is_finite() { value.to_string() } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_far_out_of_range_is_said_in_few_digits() {
        for (value, text) in
            [(5000.0, "5000"), (-0.25, "-0.25"), (1e308, "1e308"), (-1.5e-200, "-1.5e-200"), (0.0, "0")]
        {
            let refused = Refused::OutOfRange { what: "load torque", expected: "-1000 to 1000 N·m", value };
            assert_eq!(refused.to_string(), format!("load torque must be -1000 to 1000 N·m, not {text}"));
        }
    }
}

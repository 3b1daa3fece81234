//! The variables of an FMU as tables: what the description of the model lists is what is read and written.

use serde::{Deserialize, Serialize};

/// A value reference (FMI 3.0, 2.4.7).
pub type Reference = u32;

/// The value of a variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// A 64-bit floating-point number.
    Float64(f64),
    /// A signed integer of 64 bits.
    Int64(i64),
    /// An unsigned integer of 8 bits.
    UInt8(u8),
    /// An unsigned integer of 16 bits.
    UInt16(u16),
    /// An unsigned integer of 32 bits.
    UInt32(u32),
    /// An unsigned integer of 64 bits.
    UInt64(u64),
    /// True or false.
    Boolean(bool),
    /// Bytes.
    Binary(Vec<u8>),
    /// A text; in FMI 2.0 alone.
    String(String),
}

impl Value {
    /// The name of the type, which is that of the element in the description.
    pub const fn type_name(&self) -> &'static str {
        match self {
            Self::Float64(_) => "Float64",
            Self::Int64(_) => "Int64",
            Self::UInt8(_) => "UInt8",
            Self::UInt16(_) => "UInt16",
            Self::UInt32(_) => "UInt32",
            Self::UInt64(_) => "UInt64",
            Self::Boolean(_) => "Boolean",
            Self::Binary(_) => "Binary",
            Self::String(_) => "String",
        }
    }

    /// As it stands in the description.
    pub fn text(&self) -> String {
        match self {
            Self::Float64(value) => value.to_string(),
            Self::Int64(value) => value.to_string(),
            Self::UInt8(value) => value.to_string(),
            Self::UInt16(value) => value.to_string(),
            Self::UInt32(value) => value.to_string(),
            Self::UInt64(value) => value.to_string(),
            Self::Boolean(value) => value.to_string(),
            Self::String(text) => text.clone(),
            Self::Binary(bytes) => bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        }
    }
}

/// What role a variable has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set before the simulation begins.
    Parameter,
    /// Set during the simulation.
    Input,
    /// Read.
    Output,
}

impl Causality {
    /// As it stands in the description.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Parameter => "parameter",
            Self::Input => "input",
            Self::Output => "output",
        }
    }
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its value reference.
    pub reference: Reference,
    /// Its name.
    pub name: String,
    /// Its role.
    pub causality: Causality,
    /// A value of its type: of parameters and inputs the one at the start.
    pub value: Value,
    /// The unit's name, empty for none.
    pub unit: &'static str,
    /// What it is.
    pub description: String,
    /// An output of the last step, which no input changes before the next one.
    pub is_of_last_step: bool,
}

impl Variable {
    /// A row without a unit.
    pub fn new(reference: Reference, name: &str, causality: Causality, value: Value, description: &str) -> Self {
        let (name, description) = (name.to_owned(), description.to_owned());
        Self { reference, name, causality, value, unit: "", description, is_of_last_step: false }
    }

    /// The same in a unit.
    #[must_use]
    pub fn in_unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// The same as an output of the last step.
    #[must_use]
    pub(crate) fn of_last_step(self) -> Self {
        Self { is_of_last_step: true, ..self }
    }
}

/// One network of an FMU: the variables of one terminal (fmi-ls-bus, "Bus Terminal").
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Terminal {
    /// Its name.
    pub name: String,
    /// What comes in: operations, binary.
    pub rx_data: Reference,
    /// The clock of what comes in.
    pub rx_clock: Reference,
    /// What goes out: operations, binary.
    pub tx_data: Reference,
    /// The clock of what goes out.
    pub tx_clock: Reference,
    /// Whether the bus notifies the node of what becomes of its frames: of a node a parameter, of a bus a constant.
    pub notifications: Reference,
}

impl Terminal {
    /// The terminal whose variables have the five value references from `first` on.
    pub fn new(name: impl Into<String>, first: Reference) -> Self {
        Self {
            name: name.into(),
            rx_clock: first,
            rx_data: first + 1,
            tx_clock: first + 2,
            tx_data: first + 3,
            notifications: first + 4,
        }
    }
}

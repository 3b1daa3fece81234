//! Commands to the parameters of a drive, as JSON.

use serde::Deserialize;

/// What is read of the parameters of a drive, or planned for them.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ParameterReading {
    /// Reads the present values of objects.
    ReadObjects {
        /// By index or name.
        objects: Vec<String>,
    },
    /// Plans the writes for values or a file, without writing.
    PlanParameters {
        /// The new values.
        #[serde(default)]
        values: Vec<NewValue>,
        /// The text of a file of parameters.
        file: Option<String>,
    },
    /// Compares the objects of a file: default, file, drive.
    CompareParameters {
        /// The text of a file of parameters.
        file: String,
    },
    /// Reads all parameters of a drive, as a file.
    BackUp {
        /// The format of the file.
        #[serde(default)]
        form: FileForm,
    },
}

impl ParameterReading {
    pub(super) const WORDS: &[&str] = &["read_objects", "plan_parameters", "compare_parameters", "back_up"];
}

/// A change of the parameters of a drive.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ParameterChange {
    /// Writes values or a file, all or nothing.
    WriteParameters {
        /// The new values.
        #[serde(default)]
        values: Vec<NewValue>,
        /// The text of a file of parameters.
        file: Option<String>,
    },
    /// Undoes the last write.
    RollBack {},
    /// Makes a drive store its parameters.
    Store {},
}

impl ParameterChange {
    pub(super) const WORDS: &[&str] = &["write_parameters", "roll_back", "store"];
}

/// The format of a parameter file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FileForm {
    /// For people.
    #[default]
    Toml,
    /// For other tools (CiA 306-1).
    Dcf,
}

/// A new value of an object, as people type it: `{"object":"6083","value":"600"}`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NewValue {
    /// By index or name.
    pub object: String,
    /// As people type it.
    pub value: String,
}

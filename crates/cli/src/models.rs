//! The drives that Ferrodrive knows, as the command line names them.

pub(crate) use drives::profile::{DriveProfile, MODELS, model as find};

/// The models on the embedded virtual bus, each at its node-ID as delivered.
pub(crate) const EMBEDDED: &[&DriveProfile] = &[&drives::zlac8030l::PROFILE];

/// The names of all models, for messages.
pub(crate) fn names() -> String {
    MODELS.iter().map(|model| model.model).collect::<Vec<_>>().join(", ")
}

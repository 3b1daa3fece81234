use core::fmt;

use canopen::Mux;
use devices::Description;

use crate::models::Models;

/// What a node says that it is. What it refuses to say is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:01.
    pub vendor_id: Option<u32>,
    /// 1018h:02.
    pub product_code: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
}

impl Identity {
    /// True if nothing that it says speaks against the model.
    pub fn matches(&self, model: &devices::Identity) -> bool {
        self.differences(model).next().is_none()
    }

    /// What it says otherwise than the model: name, what it says, and what the model does.
    pub fn differences(&self, model: &devices::Identity) -> impl Iterator<Item = (&'static str, u32, u32)> {
        let compared = [
            ("device type (1000h)", self.device_type, model.device_type),
            ("vendor (1018h:01)", self.vendor_id, model.vendor_id),
            ("product (1018h:02)", self.product_code, model.product_code),
            ("revision (1018h:03)", self.revision_number, model.revision_number),
        ];
        compared
            .into_iter()
            .filter_map(|(name, said, expected)| Some((name, said?, expected)))
            .filter(|(_, a, b)| a != b)
    }
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            ("device type", self.device_type),
            ("vendor", self.vendor_id),
            ("product", self.product_code),
            ("revision", self.revision_number),
        ];
        let mut separator = "";
        for (name, value) in parts {
            match value {
                Some(value) => write!(f, "{separator}{name} {value:X}h")?,
                None => write!(f, "{separator}{name} not given")?,
            }
            separator = ", ";
        }
        Ok(())
    }
}

/// What is known of a node's model.
#[derive(Clone, Debug)]
pub enum Knowledge {
    /// This model: named by the caller, or no other model answers so.
    Named(Model),
    /// One of several that answer so: good for reading and moving, not for what only one model means.
    Guessed(Guess),
    /// No model known here answers so, or models with other objects do and nothing speaks for one of them.
    Unknown,
}

impl Knowledge {
    /// The description to work with: of a guess, the one that all models it may be agree with.
    pub const fn description(&self) -> Option<&'static Description> {
        match self {
            Self::Named(Model(description)) => Some(description),
            Self::Guessed(guess) => Some(guess.description),
            Self::Unknown => None,
        }
    }

    /// The guess, if it is one.
    pub fn guess(&self) -> Option<Guess> {
        if let Self::Guessed(guess) = self { Some(guess.clone()) } else { None }
    }
}

impl From<&'static Description> for Knowledge {
    fn from(description: &'static Description) -> Self {
        Self::Named(Model(description))
    }
}

/// A model's description, which prints as its name.
#[derive(Clone, Copy)]
pub struct Model(pub &'static Description);

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.name)
    }
}

/// A model that several answer like, chosen by an object that it has, if the others have other objects.
///
/// Models with the same objects differ in their motors only: they are read and moved in the same way.
#[derive(Clone)]
pub struct Guess {
    pub(super) description: &'static Description,
    pub(super) evidence: Option<Mux>,
    /// Those among which the model was looked for.
    pub(super) known: Models,
}

impl Guess {
    /// The description to read and move with.
    pub const fn description(&self) -> &'static Description {
        self.description
    }

    /// The object that speaks for it; `None` where all that answer so have the same objects.
    pub const fn evidence(&self) -> Option<Mux> {
        self.evidence
    }

    /// The models that it may be by its objects.
    pub fn fitting(&self) -> impl Iterator<Item = &'static Description> {
        self.known.catalogue().same_objects(self.description)
    }

    /// True if this value of this object means the same on every model that answers so.
    pub fn may_write(&self, mux: Mux, value: i64) -> bool {
        self.known.catalogue().agree_on(self.description, mux, value)
    }
}

impl fmt::Debug for Guess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Guess {{ {}, {:?} }}", self.description.name, self.evidence)
    }
}

/// Why it is no more than a guess: "zlac8030l, zlim42c and zlim42c-82 answer the same identity; it has 2029h:00 as zlac8030l has".
impl fmt::Display for Guess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (answering, _) = names(self.known.catalogue().same_identity(self.description));
        let (fitting, several) = names(self.fitting());
        write!(f, "{answering} answer the same identity")?;
        match self.evidence {
            Some(evidence) => write!(f, "; it has {evidence} as {fitting} {}", if several { "have" } else { "has" }),
            None => f.write_str(" and have the same objects"),
        }
    }
}

/// Names in a sentence, and whether they are several.
pub(super) fn names(models: impl Iterator<Item = &'static Description>) -> (String, bool) {
    let names: Vec<_> = models.map(|model| model.name).collect();
    match names.split_last() {
        Some((last, [])) => ((*last).to_owned(), false),
        Some((last, others)) => (format!("{} and {last}", others.join(", ")), true),
        None => ("no model".to_owned(), false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn a_wrong_model_is_reported_with_the_number_that_differs_and_no_other() {
        let wanted =
            devices::Identity { device_type: 0x0042_0192, vendor_id: 0x5A, product_code: 0xC1, revision_number: 1 };
        let found = Identity {
            device_type: Some(0x0042_0192),
            vendor_id: None,
            product_code: Some(0xC1),
            revision_number: Some(0),
        };
        assert!(!found.matches(&wanted));
        assert!(
            Identity { revision_number: Some(1), ..found }.matches(&wanted),
            "what is not given speaks against nothing"
        );
        let node = canopen::NodeId::new(32).unwrap();
        let text = Error::WrongModel { node, model: "XLA-5", found, wanted }.to_string();
        assert_eq!(text, "node 32 is not a XLA-5: its revision (1018h:03) is 0h, not 1h. Name the right model");
    }
}

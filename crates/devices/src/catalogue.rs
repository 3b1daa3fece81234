//! Which devices are described here, and questions to a list of descriptions.

use canopen::Mux;
use canopen::od::Entry;

use crate::description::{Description, Identity};
use crate::mjoint;
use crate::servo::CIA402;
use crate::zltech::{ZLAC8030L, ZLIM42C, ZLIM42C_82};

static ALL: [&Description; 8] = [
    &ZLAC8030L,
    &mjoint::M4230E17B50,
    &mjoint::M4230E17B80,
    &mjoint::M8025E25B50,
    &mjoint::M8025E25B80,
    &ZLIM42C,
    &ZLIM42C_82,
    &CIA402,
];

/// The models that are described in this crate.
pub const fn all() -> Catalogue<'static> {
    Catalogue::of(&ALL)
}

/// The model of this name (`zlac8030l`) among [`all`], in any case of letters.
pub fn model(name: &str) -> Option<&'static Description> {
    all().named(name)
}

/// Descriptions to look in: those of this crate, or with more that were read from files.
#[derive(Clone, Copy)]
pub struct Catalogue<'a>(&'a [&'static Description]);

impl<'a> Catalogue<'a> {
    /// These descriptions.
    pub const fn of(known: &'a [&'static Description]) -> Self {
        Self(known)
    }

    /// The number of models.
    pub const fn count(self) -> usize {
        self.0.len()
    }

    /// All of them.
    pub fn iter(self) -> impl ExactSizeIterator<Item = &'static Description> + Clone + use<'a> {
        self.0.iter().copied()
    }

    /// The one of this name, in any case of letters.
    pub fn named(self, name: &str) -> Option<&'static Description> {
        self.iter().find(|known| known.name.eq_ignore_ascii_case(name))
    }

    /// Those that answer this identity: more than one may.
    pub fn of_identity(self, identity: Identity) -> impl Iterator<Item = &'static Description> + use<'a> {
        self.iter().filter(move |known| known.identity == identity)
    }

    /// Those that answer the same identity as `model`.
    pub fn same_identity(self, model: &Description) -> impl Iterator<Item = &'static Description> + use<'a> {
        self.of_identity(model.identity)
    }

    /// Those that answer the same identity and have the same objects as `model`.
    pub fn same_objects(self, model: &Description) -> impl Iterator<Item = &'static Description> + use<'a> {
        let model = *model;
        self.same_identity(&model).filter(move |known| known.same_objects(&model))
    }

    /// True if every one that answers the same identity as `model` has this object and means the same by this value of it.
    pub fn agree_on(self, model: &Description, mux: Mux, value: i64) -> bool {
        let own = model.row(mux);
        self.same_identity(model).all(|other| match (own, other.row(mux)) {
            (Some(own), Some(row)) => {
                let form = |row: &Entry| (row.name, row.data_type, row.unit, row.meaning(value));
                form(own) == form(row)
            }
            _ => false,
        })
    }

    /// The row of an object on which all agree that have it.
    pub fn common_row(self, mux: Mux) -> Option<&'static Entry> {
        let mut rows = self.rows(mux);
        let first = rows.next()?;
        rows.all(|row| same_meaning(row, first)).then_some(first)
    }

    /// The rows that the object has in those that have it.
    pub fn rows(self, mux: Mux) -> impl Iterator<Item = &'static Entry> + use<'a> {
        self.iter().filter_map(move |known| known.row(mux))
    }
}

/// True if two rows give an object the same name, type, unit and meanings.
pub fn same_meaning(a: &Entry, b: &Entry) -> bool {
    (a.name, a.data_type, a.unit, a.values) == (b.name, b.data_type, b.unit, b.values)
}

use std::sync::Arc;

use devices::{Catalogue, Description};

/// The models that are known: those of crate [`devices`], and what was read from files. A cheap clone.
#[derive(Clone)]
pub struct Models(Arc<[&'static Description]>);

impl Default for Models {
    /// Those of crate [`devices`].
    fn default() -> Self {
        Self(devices::all().iter().collect())
    }
}

impl Models {
    /// These and one more, which stands before one of the same name.
    #[must_use]
    pub fn with(&self, description: &'static Description) -> Self {
        let others = self.catalogue().iter().filter(|known| !known.name.eq_ignore_ascii_case(description.name));
        Self(core::iter::once(description).chain(others).collect())
    }

    /// The models, to look one up by its name or by what a node answers.
    pub fn catalogue(&self) -> Catalogue<'_> {
        Catalogue::of(&self.0)
    }
}

impl FromIterator<&'static Description> for Models {
    fn from_iter<T: IntoIterator<Item = &'static Description>>(known: T) -> Self {
        Self(known.into_iter().collect())
    }
}

impl core::fmt::Debug for Models {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_list().entries(self.0.iter().map(|known| known.name)).finish()
    }
}

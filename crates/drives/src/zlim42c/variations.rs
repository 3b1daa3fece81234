//! At which points two drives of this model may differ.

use crate::variant::{Variant, Variation};

/// All of them.
pub const VARIATIONS: &[Variation] = &[];

/// The first choice of each.
pub const VARIANT: Variant = Variant::first_of(VARIATIONS);

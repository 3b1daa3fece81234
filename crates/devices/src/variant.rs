//! Points at which two drives of one model may differ: how a place of the manual is read, the firmware's version, factory
//! values, the motor that is wired to it.
//!
//! Each model lists its [`Variation`]s as const data; a [`Variant`] is what one drive picked of them, the first choice of each
//! unless otherwise chosen. A firmware asks its variant with a [`Pick`] that was looked up at compile time.

use canopen::od::{Dictionary, Entry, Kind, Storage, Table, Value};
use canopen::{AbortCode, Mux, NodeId};

/// How sure it is that the real drive does this, from most to least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// Seen in a recording of the real drive, or working code for it depends on it.
    Traffic,
    /// Another document of the maker's for this drive.
    Vendor,
    /// The maker's manual of a related drive.
    Sibling,
    /// CiA 301 or CiA 402 decides.
    Standard,
    /// Nothing was found; the least surprising behaviour was chosen.
    Guess,
}

impl Trust {
    /// The word for people.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Traffic => "traffic",
            Self::Vendor => "vendor",
            Self::Sibling => "sibling",
            Self::Standard => "standard",
            Self::Guess => "guess",
        }
    }
}

/// What a variation is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariationKind {
    /// A place where the manual is silent or contradicts itself. Its key is the place's number in `docs/drives`.
    Reading,
    /// Another firmware, other factory values or another motor. Its key is a word, such as `firmware`.
    Build,
}

/// A point at which drives of one model may differ.
#[derive(Clone, Copy, Debug)]
pub struct Variation {
    /// The name to type: `Z050`, `firmware`.
    pub key: &'static str,
    /// What it is about.
    pub kind: VariationKind,
    /// Where the manual speaks of it.
    pub section: &'static str,
    /// What is open.
    pub about: &'static str,
    /// The choices; the first is taken unless another is asked for.
    pub choices: &'static [Choice],
}

/// One way in which a drive may be.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The name to type: `prose`, `2.01`.
    pub name: &'static str,
    /// What the drive does then.
    pub does: &'static str,
    /// How sure it is that real drives are like this.
    pub trust: Trust,
    /// Factory values that differ from those of the object table.
    pub factory: &'static [Preset],
}

impl Choice {
    /// A choice that leaves the factory values alone.
    pub const fn new(name: &'static str, does: &'static str, trust: Trust) -> Self {
        Self { name, does, trust, factory: &[] }
    }

    /// Factory values that differ from those of the object table.
    #[must_use]
    pub const fn factory(mut self, factory: &'static [Preset]) -> Self {
        self.factory = factory;
        self
    }
}

/// A value of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// The object.
    pub object: Mux,
    /// What, in the object's own unit.
    pub value: i64,
}

impl Preset {
    /// A value of an object.
    pub const fn new(index: u16, sub_index: u8, value: i64) -> Self {
        Self { object: Mux::new(index, sub_index), value }
    }

    /// Puts the value into a parameter store that `values` stand for: as if it had been written and stored.
    ///
    /// # Errors
    /// [`PresetError`]; the values are as before.
    pub fn store<S: Storage>(self, values: &mut Dictionary<S>) -> Result<(), PresetError> {
        self.store_if(values, Entry::is_kept)
    }

    /// The same of a device that keeps the rows that `is_kept` names.
    ///
    /// # Errors
    /// [`PresetError`]; the values are as before.
    pub fn store_if<S: Storage>(
        self,
        values: &mut Dictionary<S>,
        is_kept: impl Fn(&Entry) -> bool,
    ) -> Result<(), PresetError> {
        let table = values.table();
        let slot = table.find(self.object).map_err(|_| PresetError::NoSuchObject)?;
        let row = table.row(slot);
        if !is_kept(row) {
            return Err(PresetError::NotStored);
        }
        let refused = |code| PresetError::Refused(code);
        let value = match (row.data_type.kind(), row.data_type.size()) {
            (Kind::Signed | Kind::Unsigned, _) => Value::Integer(self.value),
            (Kind::Real, 4) => Value::Real32(self.value as f32),
            (Kind::Real, _) => Value::Real64(self.value as f64),
            (Kind::Time | Kind::Bytes, _) => return Err(refused(AbortCode::INVALID_VALUE)),
        };
        let bits = value.to_bits(row.data_type).ok_or(refused(AbortCode::INVALID_VALUE))?.to_le_bytes();
        let bytes = &bits[..row.data_type.size()];
        values.check_bytes(slot, bytes).map_err(refused)?;
        values.set_bytes(slot, bytes).map_err(refused)
    }
}

/// Why a value cannot be in a drive's parameter store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresetError {
    /// The drive has no such object.
    NoSuchObject,
    /// The drive does not store this object: it begins with its factory value at each start.
    NotStored,
    /// A write of this value would be refused.
    Refused(AbortCode),
}

/// Most variations of a model.
pub const MAX_VARIATIONS: usize = 24;

/// What one drive is like: a choice for each variation of its model.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    variations: &'static [Variation],
    /// The number of the choice of each variation.
    picked: [u8; MAX_VARIATIONS],
}

impl Variant {
    /// The first choice of each variation.
    ///
    /// # Panics
    /// If there are more than [`MAX_VARIATIONS`], or one has no choice.
    pub const fn first_of(variations: &'static [Variation]) -> Self {
        assert!(variations.len() <= MAX_VARIATIONS, "more variations than a variant holds");
        let mut i = 0;
        while i < variations.len() {
            assert!(!variations[i].choices.is_empty(), "a variation without a choice");
            i += 1;
        }
        Self { variations, picked: [0; MAX_VARIATIONS] }
    }

    /// Takes another choice; names in any case of letters.
    ///
    /// # Errors
    /// [`NoSuchChoice`] says which of the two names is not known.
    pub fn choose(&mut self, key: &str, choice: &str) -> Result<(), NoSuchChoice> {
        let same = |name: &str, typed: &str| name.eq_ignore_ascii_case(typed);
        let found = self.variations.iter().position(|variation| same(variation.key, key));
        let number = found.ok_or(NoSuchChoice::Variation)?;
        let variation = &self.variations[number];
        let found = variation.choices.iter().position(|known| same(known.name, choice));
        self.picked[number] = found.ok_or(NoSuchChoice::Choice(variation))? as u8;
        Ok(())
    }

    /// True if this choice was taken.
    #[inline]
    pub const fn is(&self, pick: Pick) -> bool {
        self.picked[pick.variation as usize] == pick.choice
    }

    /// All variations with the choice taken.
    pub fn choices(&self) -> impl Iterator<Item = (&'static Variation, &'static Choice)> + '_ {
        let variations = self.variations;
        variations
            .iter()
            .zip(&self.picked)
            .map(|(variation, number)| (variation, &variation.choices[usize::from(*number)]))
    }

    /// The values as delivered, of a device with this node-ID: those of the object table, and of the choices on top.
    pub fn delivered<S: Storage>(&self, table: &'static Table, node_id: NodeId) -> Dictionary<S> {
        let mut values = Dictionary::new(table, node_id);
        self.apply_factory_values(&mut values, |_| true);
        values
    }

    /// Puts the factory values of the choices into a dictionary that holds those of the object table, for the rows that
    /// `wanted` names. Objects that the table does not have are passed over.
    pub fn apply_factory_values<S: Storage>(&self, values: &mut Dictionary<S>, wanted: fn(&Entry) -> bool) {
        let table = values.table();
        for preset in self.choices().flat_map(|(_, choice)| choice.factory) {
            let Ok(slot) = table.find(preset.object) else { continue };
            let row = table.row(slot);
            if wanted(row) {
                values.set_raw(slot, row.data_type.raw(preset.value));
            }
        }
    }
}

/// A name that a model does not know.
#[derive(Clone, Copy, Debug)]
pub enum NoSuchChoice {
    /// No variation has this key.
    Variation,
    /// The variation has no choice of this name.
    Choice(&'static Variation),
}

/// A choice of a model, for a firmware to ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pick {
    variation: u8,
    choice: u8,
}

impl Pick {
    /// The place of a choice; for a `const` beside the table.
    ///
    /// # Panics
    /// At compile time if there is none of these names.
    pub const fn of(variations: &[Variation], key: &str, choice: &str) -> Self {
        let mut i = 0;
        while i < variations.len() {
            if is_same(variations[i].key, key) {
                let choices = variations[i].choices;
                let mut n = 0;
                while n < choices.len() {
                    if is_same(choices[n].name, choice) {
                        return Self { variation: i as u8, choice: n as u8 };
                    }
                    n += 1;
                }
            }
            i += 1;
        }
        panic!("the model has no such choice")
    }
}

const fn is_same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::name;
    use crate::row::{U16, rw, rws};
    use canopen::od::{Fixed, Index};

    const VARIATIONS: &[Variation] = &[
        Variation {
            key: "X001",
            kind: VariationKind::Reading,
            section: "1",
            about: "where it turns",
            choices: &[
                Choice::new("left", "turns left", Trust::Guess),
                Choice::new("right", "turns right", Trust::Guess),
            ],
        },
        Variation {
            key: "firmware",
            kind: VariationKind::Build,
            section: "",
            about: "version",
            choices: &[
                Choice::new("1.0", "as printed", Trust::Vendor),
                Choice::new("2.0", "another default", Trust::Vendor).factory(&[Preset::new(0x2000, 0, 9)]),
            ],
        },
    ];
    const RIGHT: Pick = Pick::of(VARIATIONS, "X001", "right");
    static ROWS: [Entry; 2] =
        [rws(0x2000, 0, U16, name!("a")).default(7).range(0, 100), rw(0x2001, 0, U16, name!("b")).default(8)];
    static INDEX: Index<2> = Index::of(&ROWS);
    static TABLE: Table = Table::new(&ROWS, &INDEX);

    #[test]
    fn the_first_choice_holds_until_another_is_taken() {
        let mut variant = Variant::first_of(VARIATIONS);
        assert!(!variant.is(RIGHT));
        variant.choose("x001", "RIGHT").unwrap();
        assert!(variant.is(RIGHT));
        let taken: std::vec::Vec<_> = variant.choices().map(|(at, choice)| (at.key, choice.name)).collect();
        assert_eq!(taken, [("X001", "right"), ("firmware", "1.0")]);
    }

    #[test]
    fn an_unknown_name_says_which_one_it_is_and_changes_nothing() {
        let mut variant = Variant::first_of(VARIATIONS);
        assert!(matches!(variant.choose("X002", "left"), Err(NoSuchChoice::Variation)));
        assert!(matches!(variant.choose("firmware", "3"), Err(NoSuchChoice::Choice(of)) if of.key == "firmware"));
        assert_eq!(variant.choices().next().unwrap().1.name, "left");
    }

    #[test]
    fn factory_values_are_those_of_the_choice() {
        let mut values = Dictionary::<Fixed<2>>::new(&TABLE, NodeId::MIN);
        let mut variant = Variant::first_of(VARIATIONS);
        variant.apply_factory_values(&mut values, |_| true);
        assert_eq!(values.value(TABLE.slot(0x2000, 0)), 7);
        variant.choose("firmware", "2.0").unwrap();
        variant.apply_factory_values(&mut values, |_| true);
        assert_eq!(values.value(TABLE.slot(0x2000, 0)), 9);
    }

    #[test]
    fn a_preset_is_held_to_what_the_drive_would_store() {
        let mut values = Dictionary::<Fixed<2>>::new(&TABLE, NodeId::MIN);
        assert_eq!(Preset::new(0x2000, 0, 5).store(&mut values), Ok(()));
        assert_eq!(values.value(TABLE.slot(0x2000, 0)), 5);
        assert_eq!(Preset::new(0x2001, 0, 5).store(&mut values), Err(PresetError::NotStored));
        assert_eq!(Preset::new(0x2002, 0, 5).store(&mut values), Err(PresetError::NoSuchObject));
        let high = PresetError::Refused(AbortCode::VALUE_TOO_HIGH);
        assert_eq!(Preset::new(0x2000, 0, 101).store(&mut values), Err(high));
        assert!(matches!(Preset::new(0x2000, 0, 65_541).store(&mut values), Err(PresetError::Refused(_))));
        assert_eq!(values.value(TABLE.slot(0x2000, 0)), 5);
    }
}

use super::{DataType, View};
use crate::{AbortCode, Mux};

/// How SDO may use an object. Source: CiA 301, table 43.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read only; the value may change by itself.
    ReadOnly,
    /// Write only.
    WriteOnly,
    /// Read and write.
    ReadWrite,
    /// Read only and never changing.
    Const,
}

impl Access {
    /// SDO upload is allowed.
    pub const fn is_readable(self) -> bool {
        !matches!(self, Self::WriteOnly)
    }

    /// SDO download is allowed.
    pub const fn is_writable(self) -> bool {
        matches!(self, Self::WriteOnly | Self::ReadWrite)
    }

    /// As EDS files spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ReadOnly => "ro",
            Self::WriteOnly => "wo",
            Self::ReadWrite => "rw",
            Self::Const => "const",
        }
    }
}

/// Whether an object may be mapped into PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PdoMapping {
    /// Not at all.
    No,
    /// Into TPDOs if readable, into RPDOs if writable.
    Yes,
}

/// How an object looks in TPDOs, where SDO shows it otherwise.
#[derive(Clone, Copy, Debug)]
pub struct TpdoForm {
    /// Its type there.
    pub data_type: DataType,
    /// Unit of one count of the value there.
    pub unit: &'static str,
    /// The value there from the object's cell.
    pub convert: fn(u32) -> u32,
}

/// The value after a factory reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Default {
    /// A number.
    Value(i64),
    /// A number plus the node-ID, as COB-IDs have it.
    NodeIdPlus(u32),
    /// A constant text (VISIBLE_STRING).
    Text(&'static str),
}

/// Another object that holds the values of an object back: one beyond it is accepted, and acts as if it were at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeldTo {
    /// That object.
    pub object: Mux,
    /// Counts of the object held back in one count of that one, at a resolution of 1.
    pub counts: i64,
}

/// What must hold for a download besides type, access and range: sees all values, refuses with an abort code.
///
/// The second argument is the raw cell to be written. Nothing is stored when the check fails.
pub type Check = fn(&View<'_>, u32) -> Result<(), AbortCode>;

/// One row of an object table: what a manual prints about one sub-index.
///
/// Built with [`Entry::new`] and the `const` methods after it, so that a row reads like the manual's row.
#[derive(Clone, Copy)]
pub struct Entry {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub_index: u8,
    /// Data type.
    pub data_type: DataType,
    /// SDO access.
    pub access: Access,
    /// The standard's name in snake case, to search and type: `position_actual_value`.
    pub name: &'static str,
    /// The manual's words, or the standard's.
    pub title: &'static str,
    /// Factory value.
    pub default: Default,
    /// Smallest and largest value accepted, if narrower than the type; at a [`resolution`](Self::resolution) of 1, where there
    /// is one.
    pub limits: Option<(i64, i64)>,
    /// The only values accepted, with their meaning; empty when any value in the limits is.
    pub values: &'static [(i64, &'static str)],
    /// Unit of one count of the value, e.g. `0.1 r/min`; empty for none. At a [`resolution`](Self::resolution) of 1, where
    /// there is one.
    pub unit: &'static str,
    /// An object whose value divides the unit and multiplies the limits.
    pub resolution: Option<Mux>,
    /// An object that holds back what a value effects.
    pub held_to: Option<HeldTo>,
    /// Kept in the device's parameter store.
    pub stored: bool,
    /// Kept there as well, but only by a save of everything: not with each write.
    pub saved: bool,
    /// May be mapped into PDOs.
    pub pdo: PdoMapping,
    /// Another type and scale in TPDOs.
    pub tpdo_form: Option<TpdoForm>,
    /// Further condition on downloads.
    pub check: Option<Check>,
}

impl Entry {
    /// A row with default 0, no limits, no unit, not stored, not mappable.
    pub const fn new(
        index: u16,
        sub_index: u8,
        data_type: DataType,
        access: Access,
        name: &'static str,
        title: &'static str,
    ) -> Self {
        Self {
            index,
            sub_index,
            data_type,
            access,
            name,
            title,
            default: Default::Value(0),
            limits: None,
            values: &[],
            unit: "",
            resolution: None,
            held_to: None,
            stored: false,
            saved: false,
            pdo: PdoMapping::No,
            tpdo_form: None,
            check: None,
        }
    }

    /// Factory value.
    pub const fn default(mut self, value: i64) -> Self {
        self.default = Default::Value(value);
        self
    }

    /// Factory value `base` + node-ID.
    pub const fn node_id_plus(mut self, base: u32) -> Self {
        self.default = Default::NodeIdPlus(base);
        self
    }

    /// Constant text.
    pub const fn text(mut self, text: &'static str) -> Self {
        self.default = Default::Text(text);
        self
    }

    /// Smallest and largest value accepted.
    pub const fn range(mut self, min: i64, max: i64) -> Self {
        self.limits = Some((min, max));
        self
    }

    /// The only values accepted, with their meaning.
    pub const fn values(mut self, values: &'static [(i64, &'static str)]) -> Self {
        self.values = values;
        self
    }

    /// Unit of one count.
    pub const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    /// The value of this object divides the unit and multiplies the limits.
    pub const fn resolution(mut self, index: u16, sub_index: u8) -> Self {
        self.resolution = Some(Mux::new(index, sub_index));
        self
    }

    /// Values beyond that of this object, `counts` of whose counts are one of its own, act as if they were at it.
    pub const fn held_to(mut self, index: u16, sub_index: u8, counts: i64) -> Self {
        self.held_to = Some(HeldTo { object: Mux::new(index, sub_index), counts });
        self
    }

    /// Kept in the parameter store.
    pub const fn stored(mut self) -> Self {
        self.stored = true;
        self
    }

    /// Kept in the parameter store by a save of everything only.
    pub const fn saved(mut self) -> Self {
        self.saved = true;
        self
    }

    /// Kept in the parameter store, in one way or the other.
    pub const fn is_kept(&self) -> bool {
        self.stored || self.saved
    }

    /// May be mapped into PDOs.
    pub const fn mappable(mut self) -> Self {
        self.pdo = PdoMapping::Yes;
        self
    }

    /// May be mapped into TPDOs, with another type and scale than SDO shows.
    pub const fn mappable_as(mut self, form: TpdoForm) -> Self {
        self.pdo = PdoMapping::Yes;
        self.tpdo_form = Some(form);
        self
    }

    /// Further condition on downloads.
    pub const fn check(mut self, check: Check) -> Self {
        self.check = Some(check);
        self
    }

    /// Index and sub-index.
    pub const fn mux(&self) -> Mux {
        Mux::new(self.index, self.sub_index)
    }

    /// Of the communication profile area, 1000h to 1FFFh.
    pub const fn is_communication(&self) -> bool {
        matches!(self.index, 0x1000..=0x1FFF)
    }

    /// The text of a VISIBLE_STRING; `None` for a number.
    pub const fn constant_text(&self) -> Option<&'static str> {
        match (self.data_type, self.default) {
            (DataType::VisibleString, Default::Text(text)) => Some(text),
            (DataType::VisibleString, _) => Some(""),
            _ => None,
        }
    }

    /// What a value means, where the row lists meanings.
    pub fn meaning(&self, value: i64) -> Option<&'static str> {
        self.values.iter().find(|(listed, _)| *listed == value).map(|(_, text)| *text)
    }

    /// Smallest and largest number accepted while the object of [`resolution`](Self::resolution) has this value; 1 for a row
    /// without one.
    pub fn limits_at(&self, resolution: i64) -> (i64, i64) {
        let (low, high) = self.data_type.range();
        self.limits.map_or((low, high), |(min, max)| ((min * resolution).max(low), (max * resolution).min(high)))
    }

    /// Checks a number against listed values and limits, those at a resolution of 1.
    ///
    /// # Errors
    /// [`AbortCode::INVALID_VALUE`] if values are listed and this is none of them, [`AbortCode::VALUE_TOO_HIGH`]
    /// and [`AbortCode::VALUE_TOO_LOW`] outside the limits.
    pub fn check_value(&self, value: i64) -> Result<(), AbortCode> {
        if !self.values.is_empty() && self.meaning(value).is_none() {
            return Err(AbortCode::INVALID_VALUE);
        }
        self.limits.map_or(Ok(()), |limits| check_limits(value, limits))
    }

    /// Checks a number of a row with a resolution against the limits at that resolution.
    ///
    /// # Errors
    /// [`AbortCode::VALUE_TOO_HIGH`] and [`AbortCode::VALUE_TOO_LOW`] outside the limits.
    pub fn check_value_at(&self, value: i64, resolution: i64) -> Result<(), AbortCode> {
        check_limits(value, self.limits_at(resolution))
    }
}

const fn check_limits(value: i64, (min, max): (i64, i64)) -> Result<(), AbortCode> {
    if value > max {
        Err(AbortCode::VALUE_TOO_HIGH)
    } else if value < min {
        Err(AbortCode::VALUE_TOO_LOW)
    } else {
        Ok(())
    }
}

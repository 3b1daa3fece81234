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
    /// Smallest and largest value accepted, if narrower than the type.
    pub limits: Option<(i64, i64)>,
    /// The only values accepted, with their meaning; empty when any value in the limits is.
    pub values: &'static [(i64, &'static str)],
    /// Unit of one count of the value, e.g. `0.1 r/min`; empty for none.
    pub unit: &'static str,
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

    /// Checks a number against listed values and limits.
    ///
    /// # Errors
    /// [`AbortCode::INVALID_VALUE`] if values are listed and this is none of them, [`AbortCode::VALUE_TOO_HIGH`]
    /// and [`AbortCode::VALUE_TOO_LOW`] outside the limits.
    pub fn check_value(&self, value: i64) -> Result<(), AbortCode> {
        if !self.values.is_empty() && self.meaning(value).is_none() {
            return Err(AbortCode::INVALID_VALUE);
        }
        match self.limits {
            Some((_, max)) if value > max => Err(AbortCode::VALUE_TOO_HIGH),
            Some((min, _)) if value < min => Err(AbortCode::VALUE_TOO_LOW),
            _ => Ok(()),
        }
    }
}

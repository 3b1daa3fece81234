use super::{DataType, Kind, ValueRange};
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
    /// Into RPDOs only (`rww` of an EDS file).
    Receive,
    /// Into TPDOs only (`rwr` of an EDS file).
    Transmit,
}

impl PdoMapping {
    /// True if it may be mapped into PDOs of one direction at least.
    pub const fn is_allowed(self) -> bool {
        !matches!(self, Self::No)
    }

    /// True if it may be mapped into TPDOs.
    pub const fn is_transmittable(self) -> bool {
        matches!(self, Self::Yes | Self::Transmit)
    }
}

/// The value after a factory reset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DefaultValue {
    /// A whole number, of BOOLEAN, INTEGER and UNSIGNED; of a time its milliseconds.
    Value(i64),
    /// An UNSIGNED64 beyond the largest `i64`.
    Unsigned(u64),
    /// A REAL32 or REAL64.
    Real(f64),
    /// A number plus the node-ID, as COB-IDs have it.
    NodeIdPlus(u32),
    /// The text of a VISIBLE_STRING.
    Text(&'static str),
    /// The bytes of any type as an SDO carries them.
    Bytes(&'static [u8]),
}

/// Another object that holds the values of an object back: one beyond it is accepted, and acts as if it were at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeldTo {
    /// That object.
    pub object: Mux,
    /// Counts of the object held back in one count of that one, at a resolution of 1.
    pub counts: i64,
}

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
    /// The name in snake case, to search and type: `position_actual_value`.
    pub name: &'static str,
    /// The name as an EDS has it: the standard's for an object of the standard, else the maker's.
    pub title: &'static str,
    /// What the manual calls it or says of it, where that is not the title; else empty.
    pub description: &'static str,
    /// Factory value.
    pub default: DefaultValue,
    /// Smallest and largest value accepted, if narrower than the type; at a [`resolution`](Self::resolution) of 1, where there
    /// is one.
    pub limits: Option<ValueRange>,
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
    /// Writing it does something, and what is written is not a setting.
    pub command: bool,
    /// May be mapped into PDOs.
    pub pdo: PdoMapping,
    /// Most bytes of a string or DOMAIN; 0 for one that never changes.
    pub capacity: u32,
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
            description: "",
            default: DefaultValue::Value(0),
            limits: None,
            values: &[],
            unit: "",
            resolution: None,
            held_to: None,
            stored: false,
            saved: false,
            command: false,
            pdo: PdoMapping::No,
            capacity: 0,
        }
    }

    /// What the manual calls it or says of it, beside the title.
    pub const fn described(mut self, description: &'static str) -> Self {
        self.description = description;
        self
    }

    /// Sets the value as delivered, in counts; 0 without it.
    pub const fn default(mut self, value: i64) -> Self {
        self.default = DefaultValue::Value(value);
        self
    }

    /// Factory value `base` + node-ID.
    pub const fn node_id_plus(mut self, base: u32) -> Self {
        self.default = DefaultValue::NodeIdPlus(base);
        self
    }

    /// Factory value of an UNSIGNED64.
    pub const fn default_unsigned(mut self, value: u64) -> Self {
        self.default = DefaultValue::Unsigned(value);
        self
    }

    /// Factory value of a REAL32 or REAL64.
    pub const fn default_real(mut self, value: f64) -> Self {
        self.default = DefaultValue::Real(value);
        self
    }

    /// The text of a VISIBLE_STRING: constant without a [`capacity`](Self::capacity), else the factory value.
    pub const fn text(mut self, text: &'static str) -> Self {
        self.default = DefaultValue::Text(text);
        self
    }

    /// Factory value of any type, as an SDO carries it; constant for a string or DOMAIN without a
    /// [`capacity`](Self::capacity).
    pub const fn bytes(mut self, bytes: &'static [u8]) -> Self {
        self.default = DefaultValue::Bytes(bytes);
        self
    }

    /// Most bytes that a string or DOMAIN holds: it can be written, by a peer if its access allows it.
    pub const fn capacity(mut self, bytes: u32) -> Self {
        self.capacity = bytes;
        self
    }

    /// Smallest and largest value accepted.
    pub const fn range(mut self, min: i64, max: i64) -> Self {
        self.limits = Some(ValueRange::Integer(min, max));
        self
    }

    /// Smallest and largest value accepted of an UNSIGNED64.
    pub const fn range_unsigned(mut self, min: u64, max: u64) -> Self {
        self.limits = Some(ValueRange::Unsigned(min, max));
        self
    }

    /// Smallest and largest value accepted of a REAL32 or REAL64.
    pub const fn range_real(mut self, min: f64, max: f64) -> Self {
        self.limits = Some(ValueRange::Real(min, max));
        self
    }

    /// The only values accepted, with their meaning.
    pub const fn values(mut self, values: &'static [(i64, &'static str)]) -> Self {
        self.values = values;
        self
    }

    /// Sets the physical unit of one count, such as `0.1 r/min`.
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

    /// Writing it does something.
    pub const fn command(mut self) -> Self {
        self.command = true;
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

    /// May be mapped into PDOs in this way.
    pub const fn mapping(mut self, pdo: PdoMapping) -> Self {
        self.pdo = pdo;
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

    /// The bytes of a string or DOMAIN that never changes, as an SDO carries them; `None` for any other object.
    pub const fn constant_bytes(&self) -> Option<&'static [u8]> {
        match (self.data_type.kind(), self.default) {
            (Kind::Bytes, _) if self.capacity > 0 => None,
            (Kind::Bytes, DefaultValue::Text(text)) => Some(text.as_bytes()),
            (Kind::Bytes, DefaultValue::Bytes(bytes)) => Some(bytes),
            (Kind::Bytes, _) => Some(&[]),
            _ => None,
        }
    }

    /// Bytes that a dictionary keeps for a value longer than a cell; 0 for one that fits and for one that never changes.
    pub const fn stored_bytes(&self) -> u32 {
        match self.data_type.kind() {
            Kind::Bytes => self.capacity,
            _ if self.data_type.fits_cell() => 0,
            _ => self.data_type.size() as u32,
        }
    }

    /// Smallest and largest whole number accepted, where the row has narrower ones than the type.
    pub const fn integer_limits(&self) -> Option<(i64, i64)> {
        match self.limits {
            Some(limits) => limits.integers(),
            None => None,
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
        let limits = self.integer_limits();
        let times = |limit: i64| limit.saturating_mul(resolution);
        limits.map_or((low, high), |(min, max)| (times(min).max(low), times(max).min(high)))
    }

    /// Checks a number against listed values and limits, those at a resolution of 1.
    ///
    /// # Errors
    /// [`AbortCode::INVALID_VALUE`] if values are listed and this is not among them, [`AbortCode::VALUE_TOO_HIGH`]
    /// and [`AbortCode::VALUE_TOO_LOW`] outside the limits.
    pub fn check_value(&self, value: i64) -> Result<(), AbortCode> {
        if !self.values.is_empty() && self.meaning(value).is_none() {
            return Err(AbortCode::INVALID_VALUE);
        }
        check_limits(value, self.limits_at(1))
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

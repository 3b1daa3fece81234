//! Values, types and flags from text.

use super::fields::Fields;
use super::reader::{Reader, shortened};
use crate::Rule;
use crate::data_type::Form;
use crate::document::{Entry, Section};
use crate::value::{Number, number};
use crate::{AccessType, TypeCode, Value};

/// What is taken where a value cannot be.
const NOTHING: &str = "nothing";

impl Reader {
    /// A whole number that must not depend on the node-ID, within bounds.
    pub(super) fn count<T: TryFrom<i128>>(&mut self, section: Section<'_>, entry: Entry<'_>) -> Option<T> {
        if entry.value.is_empty() {
            return None;
        }
        let found = self.number(section, entry).filter(|number| !number.plus_node_id);
        let fitting = found.and_then(|number| T::try_from(number.base).ok());
        if fitting.is_none() {
            self.found(
                Rule::NotANumber,
                section,
                entry,
                format!("no number that fits here: {:?}", shortened(entry.value)),
                NOTHING,
            );
        }
        fitting
    }

    /// A flag: 0 or 1.
    pub(super) fn flag(&mut self, section: Section<'_>, entry: Entry<'_>) -> bool {
        match self.count::<u32>(section, entry) {
            Some(0) | None => false,
            Some(1) => true,
            Some(_) => {
                self.found(Rule::OddNumber, section, entry, "neither 0 nor 1", "1");
                true
            }
        }
    }

    /// A number in any spelling; an odd one is a finding.
    fn number(&mut self, section: Section<'_>, entry: Entry<'_>) -> Option<Number> {
        let (number, oddity) = number(entry.value)?;
        if let Some(oddity) = oddity {
            // Where the spelling leaves a doubt the number is not one (a leading zero before 8 or 9).
            let rule = if oddity.is_clear() { Rule::OddNumber } else { Rule::NotANumber };
            self.found(rule, section, entry, oddity.text(), number.to_string());
        }
        Some(number)
    }

    /// A value of a type; an empty one counts as absent.
    pub(super) fn value(&mut self, section: Section<'_>, entry: Entry<'_>, data_type: TypeCode) -> Option<Value> {
        if entry.value.is_empty() {
            return None;
        }
        match data_type.form() {
            Some(Form::Text | Form::Time) | None => Some(Value::Text(entry.value.to_owned())),
            Some(Form::Real { bits }) => self.real(section, entry, bits),
            Some(Form::Integer { .. } | Form::Record) => self.integer(section, entry, data_type).map(Value::Number),
        }
    }

    fn integer(&mut self, section: Section<'_>, entry: Entry<'_>, data_type: TypeCode) -> Option<Number> {
        let Some(found) = self.number(section, entry) else { return self.other_integer(section, entry, data_type) };
        let (low, high) = data_type.range()?;
        let fits = |value: i128| (low..=high).contains(&value);
        // With the smallest and the largest node-ID.
        if fits(found.at_node(1)) && fits(found.at_node(127)) {
            return Some(found);
        }
        let what = format!("{} is beyond {data_type}", shortened(entry.value));
        // FFFFh for an INTEGER16, -1 for an UNSIGNED16: the same bits.
        let span = high - low + 1;
        let same_bits = if found.base > high { found.base - span } else { found.base + span };
        // A low limit of -1 is one below all values, not the highest.
        let is_low_limit = entry.key.eq_ignore_ascii_case("LowLimit");
        let is_pattern =
            if low < 0 { found.base > high } else { found.base < 0 && found.base >= -span / 2 && !is_low_limit };
        if !found.plus_node_id && is_pattern && fits(same_bits) {
            self.found(Rule::SameBits, section, entry, what, same_bits.to_string());
            return Some(Number::plain(same_bits));
        }
        self.found(Rule::BeyondType, section, entry, what, NOTHING);
        None
    }

    /// What some tools write for whole numbers: `1.0`, `true`.
    fn other_integer(&mut self, section: Section<'_>, entry: Entry<'_>, data_type: TypeCode) -> Option<Number> {
        let word = |name: &str| entry.value.eq_ignore_ascii_case(name);
        let whole = |text: &str| text.parse::<f64>().ok().filter(|real| real.fract() == 0.0 && real.abs() < 9e15);
        let value = match () {
            () if data_type == TypeCode::BOOLEAN && word("true") => Some(1),
            () if data_type == TypeCode::BOOLEAN && word("false") => Some(0),
            () => whole(entry.value).map(|real| real as i128),
        };
        let what = format!("expected a number of {data_type}, got {:?}", shortened(entry.value));
        let Some(value) =
            value.filter(|value| data_type.range().is_some_and(|(low, high)| (low..=high).contains(value)))
        else {
            self.found(Rule::NotANumber, section, entry, what, NOTHING);
            return None;
        };
        self.found(Rule::OddNumber, section, entry, what, value.to_string());
        Some(Number::plain(value))
    }

    fn real(&mut self, section: Section<'_>, entry: Entry<'_>, bits: u8) -> Option<Value> {
        let text =
            entry.value.strip_suffix(['f', 'F']).filter(|rest| !rest.contains(['x', 'X'])).unwrap_or(entry.value);
        // Words such as `inf` are not numbers of an EDS.
        let digits = text.bytes().any(|byte| byte.is_ascii_digit()) && !text.contains(['n', 'N']);
        let rounded = |real: f64| if bits == 32 { f64::from(real as f32) } else { real };
        if let Some(real) = text.parse().ok().map(rounded).filter(|real| digits && real.is_finite()) {
            return Some(Value::Real(real));
        }
        let Some((pattern, _)) = number(entry.value).filter(|(number, _)| !number.plus_node_id && number.base >= 0)
        else {
            let what = format!("no number with a decimal point: {:?}", shortened(entry.value));
            self.found(Rule::NotANumber, section, entry, what, NOTHING);
            return None;
        };
        let real = match bits {
            32 => u32::try_from(pattern.base).ok().map(|bits| f64::from(f32::from_bits(bits))),
            _ => u64::try_from(pattern.base).ok().map(f64::from_bits),
        };
        let Some(real) = real.filter(|real| real.is_finite()) else {
            self.found(Rule::NotANumber, section, entry, "no bits of a number with a decimal point", NOTHING);
            return None;
        };
        if pattern.base != 0 {
            let what = "hexadecimal digits for a number with a decimal point: other tools may read another value";
            self.found(Rule::RealBits, section, entry, what, format!("{real:?}, which these bits are"));
        }
        Some(Value::Real(real))
    }

    /// The type of a variable; one that cannot be is UNSIGNED32.
    pub(super) fn data_type(&mut self, section: Section<'_>, fields: &Fields<'_>, is_domain: bool) -> TypeCode {
        let instead = if is_domain { TypeCode::DOMAIN } else { TypeCode::UNSIGNED32 };
        let Some(entry) = fields.data_type.filter(|entry| !entry.value.is_empty()) else {
            if !is_domain {
                self.found_in(Rule::DataType, section, "no DataType", instead.to_string());
            }
            return instead;
        };
        let code = self.number(section, entry).filter(|number| !number.plus_node_id);
        let Some(code) = code.and_then(|number| u16::try_from(number.base).ok()).map(TypeCode) else {
            let what = format!("no code of a data type: {:?}", shortened(entry.value));
            self.found(Rule::DataType, section, entry, what, instead.to_string());
            return instead;
        };
        if !code.is_known() {
            self.found(
                Rule::DataType,
                section,
                entry,
                format!("{code} is not the data type of a value"),
                instead.to_string(),
            );
            return instead;
        }
        code
    }

    /// How a variable may be used; unknown, it is not to be written.
    pub(super) fn access(&mut self, section: Section<'_>, fields: &Fields<'_>, is_domain: bool) -> AccessType {
        let Some(entry) = fields.access_type.filter(|entry| !entry.value.is_empty()) else {
            let instead = if is_domain { AccessType::ReadWrite } else { AccessType::ReadOnly };
            self.found_in(Rule::AccessType, section, "no AccessType", instead.name());
            return instead;
        };
        AccessType::of(entry.value).unwrap_or_else(|| {
            let what = format!("no access type: {:?}", shortened(entry.value));
            self.found(Rule::AccessType, section, entry, what, AccessType::ReadOnly.name());
            AccessType::ReadOnly
        })
    }
}
